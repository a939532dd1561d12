//! CSV: one row a recording.

use std::io::{self, Write};

use csv::Writer;

use super::{
    answer::{Answer, AnswerWriter, Head},
    columns::{Cell, columns, row},
};

/// Rows under a header whose names carry the units.
pub(super) struct Rows<'a> {
    writer: Writer<&'a mut dyn Write>,
}

impl<'a> Rows<'a> {
    pub(super) fn new(out: &'a mut dyn Write) -> Self {
        Self { writer: Writer::from_writer(out) }
    }
}

impl AnswerWriter for Rows<'_> {
    fn begin(&mut self, _head: &Head) -> io::Result<()> {
        let names = columns().into_iter().map(|(name, _)| name);
        self.writer.write_record(names).map_err(of_stream)
    }

    fn answer(&mut self, answer: &Answer) -> io::Result<()> {
        self.writer.write_record(row(answer).iter().map(text)).map_err(of_stream)
    }

    fn end(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// The error of the stream itself, so that a broken pipe is known for one.
fn of_stream(error: csv::Error) -> io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => io::Error::other(format!("{other:?}")),
    }
}

/// Empty where there is nothing.
fn text(cell: &Cell) -> String {
    let text = match cell {
        Cell::Text(text) => text.clone(),
        Cell::Number(number) => number.map(|number| number.to_string()),
        Cell::Count(count) => count.map(|count| count.to_string()),
        Cell::Truth(truth) => truth.map(|truth| truth.to_string()),
    };
    text.unwrap_or_default()
}
