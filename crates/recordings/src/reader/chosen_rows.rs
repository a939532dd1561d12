//! Rows of a file that is not text, chosen by the values of its columns.

use crate::{
    RecordError,
    property::Property,
    reader::container::{Container, Head, Samples},
    row_choice::{RowChoice, Seen, are_apart, no_row},
};

/// A file of which only some rows are read.
pub(super) struct ChosenRows<'a> {
    container: &'a dyn Container,
    heads: Vec<Head>,
    /// Samples of each column that are read; `None` where all are, in other tables of the file.
    kept: Vec<Option<Vec<usize>>>,
}

impl<'a> ChosenRows<'a> {
    /// Chooses the rows that meet all conditions, whose columns stand in one table.
    pub(super) fn new(
        container: &'a dyn Container,
        choices: &[RowChoice],
    ) -> Result<Self, RecordError> {
        let heads = container.heads();
        let columns = columns(heads, choices)?;
        let table = &heads[columns[0]];
        let mut seen = Seen::default();
        let mut is_met = vec![true; table.samples];
        for (index, (choice, &column)) in choices.iter().zip(&columns).enumerate() {
            let mut row = 0;
            container.each_cell(column, &mut |cell| {
                if index == 0 {
                    seen.look_at(cell);
                }
                if let Some(is_met) = is_met.get_mut(row) {
                    *is_met &= choice.is_met_by(cell);
                }
                row += 1;
            })?;
            is_met.truncate(row);
        }
        let rows: Vec<usize> = (0..is_met.len()).filter(|&row| is_met[row]).collect();
        if rows.is_empty() {
            return Err(no_row(choices, seen));
        }
        let kept = |(column, head): (usize, &Head)| {
            let is_of_table = head.group == table.group && head.samples == table.samples;
            let in_lists = container.in_rows(column, &rows)?;
            Ok(in_lists.or_else(|| is_of_table.then(|| rows.clone())))
        };
        let kept = heads.iter().enumerate().map(kept).collect::<Result<Vec<_>, _>>()?;
        let shorter = |(head, kept): (&Head, &Option<Vec<usize>>)| Head {
            samples: kept.as_ref().map_or(head.samples, Vec::len),
            ..head.clone()
        };
        let heads = heads.iter().zip(&kept).map(shorter).collect();
        Ok(Self { container, heads, kept })
    }
}

/// The column of each condition.
fn columns(heads: &[Head], choices: &[RowChoice]) -> Result<Vec<usize>, RecordError> {
    let mut columns: Vec<usize> = Vec::with_capacity(choices.len());
    for choice in choices {
        let is_beside = |head: &Head| {
            columns.first().is_none_or(|&first| {
                head.group == heads[first].group && head.samples == heads[first].samples
            })
        };
        let places = |is_named: &dyn Fn(&Head) -> bool| -> Vec<usize> {
            let is_one = |&place: &usize| is_named(&heads[place]) && is_beside(&heads[place]);
            (0..heads.len()).filter(is_one).collect()
        };
        let by_path = places(&|head| head.path == choice.column);
        let found =
            if by_path.is_empty() { places(&|head| head.name == choice.column) } else { by_path };
        let paths = |places: &[usize]| places.iter().map(|&at| heads[at].path.clone()).collect();
        let column = choice.column.clone();
        match *found {
            [only] => columns.push(only),
            [] => {
                let columns = paths(&places(&|_| true));
                return Err(RecordError::ChoiceColumnMissing { line: None, column, columns });
            }
            _ => return Err(RecordError::ColumnAmbiguous { column, columns: paths(&found) }),
        }
    }
    Ok(columns)
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
        let Some(kept) = &self.kept[column] else { return Ok(all) };
        let lacks = kept.last().is_some_and(|&last| last >= all.values.len());
        if lacks {
            // the column ends before the table that its head claims
            return Err(RecordError::NoRows { columns: vec![self.heads[column].path.clone()] });
        }
        let values = kept.iter().map(|&index| all.values[index]).collect();
        let present = all.present.map(|all| kept.iter().map(|&index| all[index]).collect());
        Ok(Samples { values, present, single: all.single })
    }

    fn has_rows_apart(&self, column: usize) -> bool {
        self.kept[column].as_ref().is_some_and(|kept| are_apart(kept))
    }
}
