//! JSON: one document, or one object a line. Written as the answers come, so that
//! memory does not grow with the batch.

use std::io::{self, Write};

use fdi_core::report::{Failure, SCHEMA_VERSION};
use serde::Serialize;

use super::answer::{Answer, AnswerWriter, Head};

/// Name and version of this program.
pub(crate) const TOOL: &str = concat!("fdi ", env!("CARGO_PKG_VERSION"));

/// The whole [`fdi_core::report::Diagnosis`], one record a line.
pub(super) struct Document<'a> {
    out: &'a mut dyn Write,
    separator: &'static str,
    failed: Vec<Failure>,
    /// True where this is a part of a batch, whose order is to be found again.
    is_part: bool,
    failed_at: Vec<u64>,
    done: u64,
}

impl<'a> Document<'a> {
    pub(super) fn new(out: &'a mut dyn Write) -> Self {
        let (failed, failed_at) = (Vec::new(), Vec::new());
        Self { out, separator: "\n", failed, is_part: false, failed_at, done: 0 }
    }
}

impl AnswerWriter for Document<'_> {
    fn begin(&mut self, head: &Head) -> io::Result<()> {
        let (tool, bundle) = (serde_json::to_string(TOOL)?, serde_json::to_string(&head.bundle)?);
        write!(
            self.out,
            "{{\"schema_version\":{SCHEMA_VERSION},\"tool\":{tool},\"bundle\":{bundle},\
             \"seed\":{}",
            head.seed
        )?;
        if let Some(stamp) = &head.stamp {
            write!(self.out, ",\"stamp\":{}", serde_json::to_string(stamp)?)?;
        }
        if let Some((shard, depend_on)) = &head.part {
            let (shard, depend_on) =
                (serde_json::to_string(shard)?, serde_json::to_string(depend_on)?);
            write!(self.out, ",\"shard\":{shard},\"answers_depend_on\":{depend_on}")?;
            self.is_part = true;
        }
        write!(self.out, ",\"records\":[")
    }

    fn answer(&mut self, answer: &Answer) -> io::Result<()> {
        self.done += 1;
        match answer {
            Answer::Diagnosed(record) => {
                self.out.write_all(self.separator.as_bytes())?;
                self.separator = ",\n";
                put(self.out, record)
            }
            Answer::Failed(failure) => {
                self.failed.push(failure.clone());
                self.failed_at.push(self.done - 1);
                Ok(())
            }
        }
    }

    fn end(&mut self) -> io::Result<()> {
        write!(self.out, "\n],\"failed\":[")?;
        let mut separator = "\n";
        for failure in &self.failed {
            self.out.write_all(separator.as_bytes())?;
            separator = ",\n";
            put(self.out, failure)?;
        }
        if self.is_part && !self.failed_at.is_empty() {
            return writeln!(
                self.out,
                "\n],\"failed_at\":{}}}",
                serde_json::to_string(&self.failed_at)?
            );
        }
        writeln!(self.out, "\n]}}")
    }
}

/// One object a line, in the order of the input: a record, or a failure.
pub(super) struct Lines<'a> {
    out: &'a mut dyn Write,
}

impl<'a> Lines<'a> {
    pub(super) fn new(out: &'a mut dyn Write) -> Self {
        Self { out }
    }
}

impl AnswerWriter for Lines<'_> {
    fn begin(&mut self, _head: &Head) -> io::Result<()> {
        Ok(())
    }

    fn answer(&mut self, answer: &Answer) -> io::Result<()> {
        self.out.write_all(&to_line(answer)?)?;
        // whoever follows the stream sees each answer at once
        self.out.flush()
    }

    fn end(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// An answer as a line of JSON Lines.
pub(crate) fn to_line(answer: &Answer) -> io::Result<Vec<u8>> {
    let mut line = Vec::new();
    match answer {
        Answer::Diagnosed(record) => put(&mut line, record)?,
        Answer::Failed(failure) => put(&mut line, failure)?,
    }
    line.push(b'\n');
    Ok(line)
}

/// Writes one value; from the serialiser only the sink's own error can come.
fn put(out: &mut dyn Write, value: &impl Serialize) -> io::Result<()> {
    let text = serde_json::to_vec(value)?;
    out.write_all(&text)
}
