//! Options whose values are those of a published enumeration.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use fdi_report::{Word, choices};

/// Parser of the words of a published enumeration; its help is the description of the schema.
pub(super) fn published<T: Word + Send + Sync + 'static>() -> impl TypedValueParser<Value = T> {
    let shown = choices::<T>().into_iter().map(|one| {
        let help = one.meaning.trim_end_matches('.').to_owned();
        PossibleValue::new(one.value.word()).help(help)
    });
    PossibleValuesParser::new(shown).try_map(|word| {
        let mut all = choices::<T>().into_iter().map(|one| one.value);
        all.find(|value| value.word() == word).ok_or("not one of the possible values")
    })
}
