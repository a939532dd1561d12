//! Options of the program whose help does not agree with the schema.
//!
//! How it counts:
//!
//! - An option, or argument, is of a published enumeration when it is listed in [`check`] under the
//!   option's name.
//! - It agrees where its help lists the words of the schema, in their order, each with the schema's
//!   description without the full stop.
//! - A listed name that no option has is a problem too.

use fdi_cli::{ListedOption, OptionValue, listed_options};
use fdi_core::{
    Encoding, Schema, ToleranceUse,
    report::{Fidelity, Method, Prediction, Word, choices},
};

/// Options whose help lists other words than the schema, or describes them in other words.
pub(crate) fn check() -> Vec<String> {
    let all = listed_options();
    // what predicts a recording in an explanation is asked for by the name of a fidelity too
    let (predicting, options): (Vec<ListedOption>, Vec<ListedOption>) =
        all.into_iter().partition(|option| {
            option.command.ends_with("explain") || option.command.ends_with("propose")
        });
    [
        differing::<Prediction>(&predicting, "fidelity"),
        differing::<Method>(&options, "method"),
        differing::<Fidelity>(&options, "fidelity"),
        differing::<Encoding>(&options, "encoding"),
        differing::<ToleranceUse>(&options, "tolerance"),
        differing::<Schema>(&options, "form"),
    ]
    .concat()
}

/// Options of a name that differ from a published enumeration.
fn differing<T: Word>(options: &[ListedOption], name: &str) -> Vec<String> {
    let published: Vec<OptionValue> = choices::<T>()
        .into_iter()
        .map(|one| OptionValue {
            word: one.value.word().to_owned(),
            help: one.meaning.trim_end_matches('.').to_owned(),
        })
        .collect();
    let named: Vec<_> = options.iter().filter(|option| option.name == name).collect();
    if named.is_empty() {
        return vec![format!("no option `{name}` lists published words")];
    }
    let other = named.into_iter().filter(|option| option.values != published);
    other
        .map(|option| {
            format!("`{} {name}`: its help does not list the words of the schema", option.command)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_word_or_another_meaning_is_found() {
        let mut options = listed_options();
        assert!(differing::<Method>(&options, "method").is_empty());
        let method = options.iter_mut().find(|option| option.name == "method").unwrap();
        method.values[0].help.push_str(" and more");
        assert_eq!(differing::<Method>(&options, "method").len(), 1);
        assert_eq!(differing::<Method>(&options, "methods").len(), 1);
    }
}
