//! Parquet: the table of the CSV, with types, for data frames.

use std::{
    fmt::Write as _,
    io::{self, Write},
    mem,
    sync::Arc,
};

use fdi_core::report::SCHEMA_VERSION;
use parquet::{
    basic::Compression,
    column::writer::ColumnWriter,
    errors::ParquetError,
    file::{metadata::KeyValue, properties::WriterProperties, writer::SerializedFileWriter},
    schema::parser::parse_message_type,
};

use super::{
    answer::{Answer, AnswerWriter, Head},
    columns::{Cell, Kind, columns, row},
};

/// Rows that are kept until they are written together: what bounds the memory.
const GROUP_ROWS: usize = 4096;

/// Rows on their way to a file.
pub(super) struct Table<'a> {
    out: &'a mut dyn Write,
    /// Into memory, from where what is finished goes out.
    writer: Option<SerializedFileWriter<Vec<u8>>>,
    rows: Vec<Vec<Cell>>,
}

impl<'a> Table<'a> {
    pub(super) fn new(out: &'a mut dyn Write) -> Self {
        Self { out, writer: None, rows: Vec::new() }
    }

    fn write_group(&mut self) -> Result<(), ParquetError> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        let rows = mem::take(&mut self.rows);
        let mut group = writer.next_row_group()?;
        let mut index = 0;
        while let Some(mut column) = group.next_column()? {
            let cells = rows.iter().map(|row| &row[index]);
            match column.untyped() {
                ColumnWriter::ByteArrayColumnWriter(out) => {
                    let (values, levels) = present(cells, |cell| match cell {
                        Cell::Text(text) => text.as_deref().map(Into::into),
                        _ => None,
                    });
                    out.write_batch(&values, Some(&levels), None)?;
                }
                ColumnWriter::DoubleColumnWriter(out) => {
                    let (values, levels) = present(cells, |cell| match cell {
                        Cell::Number(number) => *number,
                        _ => None,
                    });
                    out.write_batch(&values, Some(&levels), None)?;
                }
                ColumnWriter::Int64ColumnWriter(out) => {
                    let (values, levels) = present(cells, |cell| match cell {
                        Cell::Count(count) => count.map(|count| count as i64),
                        _ => None,
                    });
                    out.write_batch(&values, Some(&levels), None)?;
                }
                ColumnWriter::BoolColumnWriter(out) => {
                    let (values, levels) = present(cells, |cell| match cell {
                        Cell::Truth(truth) => *truth,
                        _ => None,
                    });
                    out.write_batch(&values, Some(&levels), None)?;
                }
                _ => unreachable!("the schema has no other type"),
            }
            column.close()?;
            index += 1;
        }
        group.close()?;
        writer.flush()?;
        Ok(self.out.write_all(&mem::take(writer.inner_mut()))?)
    }
}

/// The values that are there, and for each row whether it has one.
fn present<'c, T>(
    cells: impl Iterator<Item = &'c Cell>,
    value: impl Fn(&Cell) -> Option<T>,
) -> (Vec<T>, Vec<i16>) {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    for cell in cells {
        let value = value(cell);
        levels.push(i16::from(value.is_some()));
        values.extend(value);
    }
    (values, levels)
}

fn schema() -> String {
    let mut text = "message diagnosis {".to_owned();
    for (name, kind) in columns() {
        let (kind, meaning) = match kind {
            Kind::Text => ("binary", " (UTF8)"),
            Kind::Number => ("double", ""),
            Kind::Count => ("int64", ""),
            Kind::Truth => ("boolean", ""),
        };
        write!(text, " optional {kind} {name}{meaning};").expect("a String takes all text");
    }
    text + " }"
}

impl AnswerWriter for Table<'_> {
    fn begin(&mut self, head: &Head) -> io::Result<()> {
        let mut keys = vec![
            KeyValue::new("schema_version".to_owned(), SCHEMA_VERSION.to_string()),
            KeyValue::new("tool".to_owned(), super::json::TOOL.to_owned()),
            KeyValue::new("bundle".to_owned(), head.bundle.clone()),
            KeyValue::new("seed".to_owned(), head.seed.to_string()),
        ];
        keys.extend(head.stamp.clone().map(|stamp| KeyValue::new("stamp".to_owned(), stamp)));
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_key_value_metadata(Some(keys))
            .build();
        let schema = parse_message_type(&schema()).map_err(of_stream)?;
        let writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties));
        self.writer = Some(writer.map_err(of_stream)?);
        Ok(())
    }

    fn answer(&mut self, answer: &Answer) -> io::Result<()> {
        self.rows.push(row(answer));
        if self.rows.len() == GROUP_ROWS {
            self.write_group().map_err(of_stream)?;
        }
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        if !self.rows.is_empty() {
            self.write_group().map_err(of_stream)?;
        }
        let rest = self.writer.take().map(SerializedFileWriter::into_inner).transpose();
        self.out.write_all(&rest.map_err(of_stream)?.unwrap_or_default())?;
        self.out.flush()
    }
}

/// The error of the stream itself, so that a broken pipe is known for one.
fn of_stream(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(source) => match source.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(source) => io::Error::other(source),
        },
        other => io::Error::other(other),
    }
}
