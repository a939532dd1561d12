//! Values of published enumerations with their meanings, from the schema itself.

use schemars::JsonSchema;
use serde::de::DeserializeOwned;

use crate::schema::schema_of;

/// A published enumeration whose values are words of the JSON.
pub trait Word: Copy + JsonSchema + DeserializeOwned {
    /// The word as JSON has it.
    fn word(self) -> &'static str;
}

/// A value of a published enumeration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice<T> {
    /// The value.
    pub value: T,
    /// Meaning of the value, as the schema describes it.
    pub meaning: String,
}

/// Every value of a published enumeration, in the order and with the descriptions of its schema.
///
/// A help text that is made from these cannot differ from the schema.
///
/// ```
/// use fdi_report::{Fidelity, Word, choices};
///
/// let words = choices::<Fidelity>().into_iter().map(|one| (one.value.word(), one.meaning));
/// assert_eq!(words.last(), Some(("high", "The reference model.".to_owned())));
/// ```
pub fn choices<T: Word>() -> Vec<Choice<T>> {
    let schema = schema_of::<T>();
    let listed = schema.get("oneOf").and_then(|values| values.as_array()).cloned();
    let of = |entry: serde_json::Value| {
        let value = serde_json::from_value(entry.get("const")?.clone()).ok()?;
        let meaning = entry.get("description")?.as_str()?.replace('\n', " ");
        Some(Choice { value, meaning })
    };
    listed.unwrap_or_default().into_iter().filter_map(of).collect()
}
