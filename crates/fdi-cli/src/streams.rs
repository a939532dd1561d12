//! Where a command writes.

use std::{
    fs::File,
    io::{self, BufWriter, ErrorKind, Write},
    path::Path,
};

use anyhow::{Context, Result};

/// Standard output and standard error, or what stands for them in a test.
pub struct Streams<'a> {
    /// Data.
    pub out: &'a mut dyn Write,
    /// Everything else.
    pub err: &'a mut dyn Write,
    /// Whether someone watches standard error on a terminal, where a line can be rewritten.
    pub is_terminal: bool,
}

impl std::fmt::Debug for Streams<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Streams").finish_non_exhaustive()
    }
}

impl Streams<'_> {
    /// Writes a line to standard error; that it cannot be is no failure.
    pub(crate) fn say(&mut self, line: std::fmt::Arguments<'_>) {
        let _ = writeln!(self.err, "{line}");
    }

    /// Lets `write` produce the command's product, in `file` or on standard output.
    ///
    /// A reader that has gone away is no failure: it has read what it wanted.
    pub(crate) fn product(
        &mut self,
        file: Option<&Path>,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<()> {
        let Some(path) = file else {
            let written = write(self.out).and_then(|()| self.out.flush());
            return forgive_broken_pipe(written).context("standard output");
        };
        let create = || {
            let mut out = BufWriter::new(File::create(path)?);
            write(&mut out)?;
            out.flush()
        };
        create().with_context(|| format!("`{}` cannot be written", path.display()))
    }
}

/// A reader that has gone away is no failure.
fn forgive_broken_pipe(written: io::Result<()>) -> io::Result<()> {
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}
