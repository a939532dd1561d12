//! Properties: metadata of recordings that are not text.

/// Value of a metadata key, as a file or a program states it.
#[derive(Clone, Debug, PartialEq)]
pub enum Property {
    /// A number, in the unit of the key.
    Number(f64),
    /// A text, or a date in the form of ISO 8601.
    Text(String),
}
