//! Rows of a text that are read.

use csv::ByteRecord;

use crate::{
    RecordError,
    row_choice::{RowChoice, Seen, no_row},
};

/// Rows that are read, chosen one after another.
pub(super) struct Chooser<'a> {
    choices: &'a [RowChoice],
    /// Places of their columns.
    columns: Vec<usize>,
    seen: Seen,
    rows: usize,
    last: Option<usize>,
    are_apart: bool,
}

impl<'a> Chooser<'a> {
    pub(super) fn new(
        choices: &'a [RowChoice],
        columns: &[String],
        header_line: u64,
    ) -> Result<Self, RecordError> {
        let place = |choice: &RowChoice| {
            let place = columns.iter().position(|column| *column == choice.column);
            place.ok_or_else(|| RecordError::ChoiceColumnMissing {
                line: Some(header_line),
                column: choice.column.clone(),
                columns: columns.to_vec(),
            })
        };
        let columns = choices.iter().map(place).collect::<Result<_, _>>()?;
        let (seen, rows, last, are_apart) = (Seen::default(), 0, None, false);
        Ok(Self { choices, columns, seen, rows, last, are_apart })
    }

    /// Tells whether the next row is read; one that ends before a column of the choice is not.
    pub(super) fn takes(&mut self, record: &ByteRecord) -> bool {
        let Some(&first) = self.columns.first() else { return true };
        let cell = |column: usize| str::from_utf8(record.get(column)?).ok();
        if let Some(value) = cell(first) {
            self.seen.look_at(value);
        }
        let row = self.rows;
        self.rows += 1;
        let mut choices = self.choices.iter().zip(&self.columns);
        if !choices.all(|(one, &column)| cell(column).is_some_and(|cell| one.is_met_by(cell))) {
            return false;
        }
        self.are_apart |= self.last.is_some_and(|last| last + 1 != row);
        self.last = Some(row);
        true
    }

    /// Refuses a choice without a row, and one with gaps where rows have no times of their own.
    pub(super) fn check(self, has_times: bool) -> Result<(), RecordError> {
        if self.are_apart && !has_times {
            return Err(RecordError::RowsApart);
        }
        if !self.choices.is_empty() && self.last.is_none() {
            return Err(no_row(self.choices, self.seen));
        }
        Ok(())
    }
}
