//! Rows of a file that is not text, chosen by the values of its columns.

use std::ops::Range;

use crate::{
    RecordError,
    property::Property,
    reader::container::{Container, Head, Samples},
    row_choice::{Condition, RowChoice, no_row},
};

/// A file of which only some rows are read.
pub(super) struct ChosenRows<'a> {
    container: &'a dyn Container,
    heads: Vec<Head>,
    /// The rows, ascending.
    rows: Vec<usize>,
    kept: Vec<Kept>,
}

/// Samples of a column that are read.
#[derive(Clone, Debug)]
enum Kept {
    /// All: the column is in another table of the file.
    All,
    /// Samples of the rows.
    Rows,
    /// Samples of the list in the one row.
    List(Range<usize>),
}

impl<'a> ChosenRows<'a> {
    /// Chooses the rows that meet all conditions, whose columns stand in one table.
    pub(super) fn new(
        container: &'a dyn Container,
        choices: &[RowChoice],
    ) -> Result<Self, RecordError> {
        let heads = container.heads();
        let (mut columns, mut conditions) = (Vec::new(), Vec::new());
        for choice in choices {
            let (column, condition) = condition(heads, choice, columns.first().copied())?;
            columns.push(column);
            conditions.push(condition);
        }
        let is_met = is_met(container, &columns, &mut conditions)?;
        let rows: Vec<usize> = (0..is_met.len()).filter(|&row| is_met[row]).collect();
        if rows.is_empty() {
            return Err(no_row(conditions));
        }
        let table = columns.first().map(|&first| &heads[first]);
        let kept = |(column, head): (usize, &Head)| match container.in_rows(column, &rows) {
            Ok(Some(samples)) => Ok(Kept::List(samples)),
            Ok(None) if table.is_some_and(|table| is_beside(head, table)) => Ok(Kept::Rows),
            // a list of what is no number is told where it is asked for
            Ok(None) | Err(RecordError::NotNumbers { .. }) => Ok(Kept::All),
            Err(error) => Err(error),
        };
        let kept = heads.iter().enumerate().map(kept).collect::<Result<Vec<_>, _>>()?;
        let shorter = |(head, kept): (&Head, &Kept)| {
            let samples = match kept {
                Kept::All => head.samples,
                Kept::Rows => rows.len(),
                Kept::List(samples) => samples.len(),
            };
            Head { samples, ..head.clone() }
        };
        let heads = heads.iter().zip(&kept).map(shorter).collect();
        Ok(Self { container, heads, rows, kept })
    }
}

/// Tells whether two columns are of one table.
fn is_beside(one: &Head, other: &Head) -> bool {
    one.group == other.group && one.samples == other.samples
}

/// A condition with its column, which stands beside that of the first.
fn condition(
    heads: &[Head],
    choice: &RowChoice,
    first: Option<usize>,
) -> Result<(usize, Condition), RecordError> {
    let stands = |head: &Head| first.is_none_or(|first| is_beside(head, &heads[first]));
    let paths: Vec<String> =
        heads.iter().filter(|head| stands(head)).map(|head| head.path.clone()).collect();
    choice.condition(&paths, None, |name| {
        let places = |is_named: &dyn Fn(&Head) -> bool| -> Vec<usize> {
            (0..heads.len()).filter(|&at| stands(&heads[at]) && is_named(&heads[at])).collect()
        };
        let by_path = places(&|head| head.path == name);
        let found = if by_path.is_empty() { places(&|head| head.name == name) } else { by_path };
        match *found {
            [] => Ok(None),
            [only] => Ok(Some(only)),
            _ => Err(RecordError::ChoiceAmbiguous {
                column: name.to_owned(),
                columns: found.iter().map(|&at| heads[at].path.clone()).collect(),
            }),
        }
    })
}

/// Tells of each row whether it meets all conditions.
fn is_met(
    container: &dyn Container,
    columns: &[usize],
    conditions: &mut [Condition],
) -> Result<Vec<bool>, RecordError> {
    let mut is_met: Vec<bool> = Vec::new();
    for (index, (condition, &column)) in conditions.iter_mut().zip(columns).enumerate() {
        let mut row = 0;
        container.each_cell(column, &mut |cell| {
            let is_own = condition.is_met_by(cell);
            if index == 0 {
                is_met.push(is_own);
            } else if let Some(is_met) = is_met.get_mut(row) {
                *is_met &= is_own;
            }
            row += 1;
        })?;
        is_met.truncate(row);
    }
    Ok(is_met)
}

impl Container for ChosenRows<'_> {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    fn properties(&self) -> Vec<(String, Property)> {
        self.container.properties()
    }

    fn read(&self, column: usize) -> Result<Samples, RecordError> {
        let all = self.container.read(column)?;
        let places: Vec<usize> = match &self.kept[column] {
            Kept::All => return Ok(all),
            Kept::Rows => self.rows.clone(),
            Kept::List(samples) => samples.clone().collect(),
        };
        if places.last().is_some_and(|&last| last >= all.values.len()) {
            // the column ends before the table that its head claims
            return Err(RecordError::NoRows { columns: vec![self.heads[column].path.clone()] });
        }
        let values = places.iter().map(|&index| all.values[index]).collect();
        let present = all.present.map(|all| places.iter().map(|&index| all[index]).collect());
        Ok(Samples { values, present, single: all.single })
    }

    fn each_cell(&self, column: usize, visit: &mut dyn FnMut(&str)) -> Result<(), RecordError> {
        if !matches!(self.kept[column], Kept::Rows) {
            return self.container.each_cell(column, visit);
        }
        let (mut rows, mut row) = (self.rows.iter().peekable(), 0);
        self.container.each_cell(column, &mut |cell| {
            if rows.next_if_eq(&&row).is_some() {
                visit(cell);
            }
            row += 1;
        })
    }

    fn first_place(&self, column: usize) -> Result<usize, RecordError> {
        if !matches!(self.kept[column], Kept::Rows) {
            return Ok(0);
        }
        if self.rows.windows(2).any(|pair| pair[0] + 1 != pair[1]) {
            return Err(RecordError::RowsApart);
        }
        Ok(self.rows.first().copied().unwrap_or(0))
    }
}
