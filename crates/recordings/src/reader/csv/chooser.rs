//! Rows of a text that are read.

use csv::ByteRecord;

use crate::{
    RecordError,
    row_choice::{Condition, RowChoice, no_row},
};

/// Rows that are read, chosen one after another.
pub(super) struct Chooser {
    /// Conditions, each with the place of its column.
    conditions: Vec<(usize, Condition)>,
    rows: usize,
    last: Option<usize>,
    are_apart: bool,
}

impl Chooser {
    pub(super) fn new(
        choices: &[RowChoice],
        columns: &[String],
        header_line: u64,
    ) -> Result<Self, RecordError> {
        let place = |name: &str| Ok(columns.iter().position(|column| column == name));
        let of = |choice: &RowChoice| choice.condition(columns, Some(header_line), place);
        let conditions = choices.iter().map(of).collect::<Result<_, _>>()?;
        Ok(Self { conditions, rows: 0, last: None, are_apart: false })
    }

    /// Tells whether the next row is read; one that ends before a column of the choice is not.
    pub(super) fn takes(&mut self, record: &ByteRecord) -> bool {
        let row = self.rows;
        self.rows += 1;
        let mut is_taken = true;
        // each looks at its cell, so that what no row meets is known
        for (column, condition) in &mut self.conditions {
            let cell = record.get(*column).and_then(|cell| str::from_utf8(cell).ok());
            is_taken &= cell.is_some_and(|cell| condition.is_met_by(cell));
        }
        if is_taken {
            self.are_apart |= self.last.is_some_and(|last| last + 1 != row);
            self.last = Some(row);
        }
        is_taken
    }

    /// Refuses a choice without a row, and one with gaps where rows have no times of their own.
    pub(super) fn check(self, has_times: bool) -> Result<(), RecordError> {
        if self.are_apart && !has_times {
            return Err(RecordError::RowsApart);
        }
        if self.rows > 0 && self.last.is_none() {
            return Err(no_row(self.conditions.into_iter().map(|(_, one)| one).collect()));
        }
        Ok(())
    }
}
