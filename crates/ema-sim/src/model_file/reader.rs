//! Values of a model file, each with its line.

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::error::ModelFileError;

/// Reads the parts of a file.
pub(super) struct Reader<'a> {
    pub(super) text: &'a str,
    /// True where a base fills what is left out.
    pub(super) complete: bool,
}

impl Reader<'_> {
    pub(super) fn table<'t, 'i>(
        &self,
        key: &str,
        value: &'t Spanned<DeValue<'i>>,
    ) -> Result<&'t DeTable<'i>, ModelFileError> {
        let found = || value.get_ref().type_str().to_owned();
        value.get_ref().as_table().ok_or_else(|| self.wrong(key, "a table", value, found()))
    }

    pub(super) fn number(
        &self,
        key: &str,
        value: &Spanned<DeValue<'_>>,
    ) -> Result<f64, ModelFileError> {
        let parsed: Option<f64> = match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse().ok(),
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().parse().ok(),
            _ => None,
        };
        let found = |is_nan: bool| {
            let found = if is_nan { "NaN" } else { value.get_ref().type_str() };
            self.wrong(key, "a number", value, found.to_owned())
        };
        parsed.filter(|number| !number.is_nan()).ok_or_else(|| found(parsed.is_some()))
    }

    pub(super) fn wrong(
        &self,
        key: &str,
        expected: &'static str,
        value: &Spanned<DeValue<'_>>,
        found: String,
    ) -> ModelFileError {
        let line = line_of(self.text, value);
        ModelFileError::WrongType { line, key: key.to_owned(), expected, found }
    }
}

pub(super) fn document(text: &str) -> Result<DeTable<'_>, ModelFileError> {
    let table = DeTable::parse(text).map_err(|error| ModelFileError::Syntax {
        line: line_at(text, error.span().map_or(0, |span| span.start)),
        message: error.message().lines().next().unwrap_or_default().to_owned(),
    })?;
    Ok(table.into_inner())
}

pub(super) fn entry<'t, 'i>(table: &'t DeTable<'i>, key: &str) -> Option<&'t Spanned<DeValue<'i>>> {
    table.iter().find(|(known, _)| known.get_ref().as_ref() == key).map(|(_, value)| value)
}

pub(super) fn string<'t>(
    text: &str,
    key: &str,
    value: &'t Spanned<DeValue<'_>>,
) -> Result<&'t str, ModelFileError> {
    value.get_ref().as_str().ok_or_else(|| ModelFileError::WrongType {
        line: line_of(text, value),
        key: key.to_owned(),
        expected: "a text",
        found: value.get_ref().type_str().to_owned(),
    })
}

pub(super) fn line_of<T>(text: &str, at: &Spanned<T>) -> usize {
    line_at(text, at.span().start)
}

fn line_at(text: &str, offset: usize) -> usize {
    text.bytes().take(offset).filter(|byte| *byte == b'\n').count() + 1
}

/// The name with the fewest edits, when they are few.
pub(super) fn closest_of(
    key: &str,
    names: impl Iterator<Item = &'static str>,
) -> Option<&'static str> {
    let (edits, best) = names.map(|name| (distance(key, name), name)).min()?;
    (edits * 3 <= key.len()).then_some(best)
}

/// Number of letters to insert, delete or replace.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut corner = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = corner + usize::from(x != *y);
            corner = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(corner + 1);
        }
    }
    row[b.len()]
}
