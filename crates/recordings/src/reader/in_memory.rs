//! Recordings made of the columns of a table in memory.

use crate::{
    ColumnMap, Metadata, RecordError, Recording, SharedNumbers,
    property::Property,
    reader::container::{Clock, Container, Head, Numbers, Samples, assemble_with},
};

/// A column of a table in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct MemoryColumn {
    /// Name, as a file would spell it: `time_s`, a channel, or what a [`ColumnMap`] maps.
    pub name: String,
    /// Values, in the SI unit of the name or multiplied by the map's factor.
    pub values: SharedNumbers,
    /// Which of them are there; `None` where all are.
    pub present: Option<Vec<bool>>,
    /// True where the numbers were held in single precision.
    pub single: bool,
}

impl Recording {
    /// A recording of the columns of a table, as those of a file are read. Numbers that need no
    /// factor and have no gaps are shared, not copied.
    ///
    /// # Errors
    /// [`RecordError`] as for a file with these columns.
    pub fn from_columns(
        name: impl Into<String>,
        metadata: Metadata,
        columns: Vec<MemoryColumn>,
        map: &ColumnMap,
    ) -> Result<Self, RecordError> {
        assemble_with(name.into(), metadata, &Table::new(columns), map)
    }
}

/// Columns of a table, as a reader of files would show them.
struct Table {
    heads: Vec<Head>,
    columns: Vec<MemoryColumn>,
}

impl Table {
    fn new(columns: Vec<MemoryColumn>) -> Self {
        let head = |column: &MemoryColumn| Head {
            group: None,
            name: column.name.clone(),
            path: column.name.clone(),
            samples: column.values.len(),
            clock: Clock::Unstated,
            unit: None,
        };
        Self { heads: columns.iter().map(head).collect(), columns }
    }
}

impl Container for Table {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    fn properties(&self) -> Vec<(String, Property)> {
        Vec::new()
    }

    fn read(&self, column: usize) -> Result<Samples, RecordError> {
        let MemoryColumn { values, present, single, .. } = &self.columns[column];
        Ok(Samples { values: values.to_vec(), present: present.clone(), single: *single })
    }

    fn numbers(&self, column: usize) -> Result<Numbers, RecordError> {
        let MemoryColumn { values, present, single, .. } = &self.columns[column];
        Ok(Numbers { values: values.clone(), present: present.clone(), single: *single })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ChannelName;

    fn column(name: &str, values: &[f64]) -> MemoryColumn {
        MemoryColumn { name: name.to_owned(), values: values.into(), present: None, single: false }
    }

    fn recording(columns: Vec<MemoryColumn>, map: &[&str]) -> Result<Recording, RecordError> {
        let map = ColumnMap::new(map).unwrap();
        Recording::from_columns("table", Metadata::default(), columns, &map)
    }

    #[test]
    fn numbers_are_shared_where_nothing_is_done_to_them() {
        let table = [column("t", &[0.0, 0.1]), column("current_a", &[1.0, 2.0])];
        let places = table.clone().map(|column| column.values.as_ptr());
        let shared = recording(table.to_vec(), &["time_s=t"]).unwrap();
        let current = shared.channel(ChannelName::Current).unwrap();
        assert_eq!([current.times_s().as_ptr(), current.values().as_ptr()], places);
        let scaled = recording(table.to_vec(), &["time_s=t*0.001", "current_a=current_a*2"]);
        let scaled = scaled.unwrap();
        let current = scaled.channel(ChannelName::Current).unwrap();
        assert_eq!((current.times_s(), current.values()), (&[0.0, 1e-4][..], &[2.0, 4.0][..]));
    }

    #[test]
    fn gaps_are_left_out_and_what_is_no_number_is_refused() {
        let mut table = vec![column("time_s", &[0.0, 0.1, 0.2]), column("current_a", &[1.0; 3])];
        table[1].present = Some(vec![true, false, true]);
        let gap = recording(table.clone(), &[]).unwrap();
        assert_eq!(gap.channel(ChannelName::Current).unwrap().times_s(), [0.0, 0.2]);
        table[1] = column("current_a", &[1.0, f64::NAN, 1.0]);
        let error = recording(table, &[]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "`current_a` is not finite at sample 1 (`--gaps bridge` takes it for a missing sample)"
        );
    }
}
