//! Choice of rows, where one table holds several recordings: `COLUMN=VALUE`.

use crate::{ColumnMapError, RecordError};

/// Values of a column that a message repeats.
const MOST_SHOWN: usize = 5;

/// A condition on the rows that are read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct RowChoice {
    pub(super) column: String,
    value: String,
}

impl RowChoice {
    /// Reads `COLUMN=VALUE`.
    pub(super) fn parse(entry: &str) -> Result<Self, ColumnMapError> {
        let sides = entry.split_once('=').map(|(column, value)| (column.trim(), value.trim()));
        match sides {
            Some((column, value)) if !column.is_empty() => {
                Ok(Self { column: column.to_owned(), value: value.to_owned() })
            }
            _ => Err(ColumnMapError::RowForm { entry: entry.to_owned() }),
        }
    }

    /// Tells whether a cell has the value: the same text, or the same number.
    pub(super) fn is_met_by(&self, cell: &str) -> bool {
        let cell = cell.trim();
        let number = |text: &str| text.parse::<f64>().ok();
        cell == self.value || number(cell).is_some_and(|cell| Some(cell) == number(&self.value))
    }
}

/// Values of a column, as far as a message repeats them.
#[derive(Debug, Default)]
pub(super) struct Seen(Vec<String>);

impl Seen {
    pub(super) fn look_at(&mut self, value: &str) {
        let value = value.trim();
        if self.0.len() <= MOST_SHOWN && !self.0.iter().any(|seen| seen == value) {
            self.0.push(value.to_owned());
        }
    }
}

/// The error of a choice that no row has met, with the values of its first column.
pub(super) fn no_row(choices: &[RowChoice], seen: Seen) -> RecordError {
    let wanted = choices.iter().map(|one| format!("{}={}", one.column, one.value)).collect();
    let column = choices.first().map(|first| first.column.clone()).unwrap_or_default();
    let is_more = seen.0.len() > MOST_SHOWN;
    let found = seen.0.into_iter().take(MOST_SHOWN).collect();
    RecordError::NoRowChosen { wanted, column, found, is_more }
}

/// Tells whether places in ascending order leave some out between them.
pub(super) fn are_apart(places: &[usize]) -> bool {
    places.windows(2).any(|pair| pair[0] + 1 != pair[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_compared_as_text_and_as_numbers() {
        for (choice, cell, is_met) in [
            ("run=3", " 3 ", true),
            ("run = 3", "3.0", true),
            ("run=3", "33", false),
            ("state=RUN", "RUN", true),
            ("state=RUN", "run", false),
            ("note=", "", true),
            ("a=b=c", "b=c", true),
        ] {
            assert_eq!(
                RowChoice::parse(choice).unwrap().is_met_by(cell),
                is_met,
                "{choice} {cell}"
            );
        }
        for wrong in ["run", "=3"] {
            let error = RowChoice::parse(wrong).unwrap_err();
            assert_eq!(error, ColumnMapError::RowForm { entry: wrong.to_owned() });
        }
    }
}
