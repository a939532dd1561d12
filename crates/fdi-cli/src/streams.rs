//! Where a command writes.

use std::{
    fs::{self, File, OpenOptions},
    io::{self, BufWriter, ErrorKind, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};

/// Standard output and standard error, or what stands for them in a test.
pub struct Streams<'a> {
    /// Data.
    pub out: &'a mut dyn Write,
    /// Everything else.
    pub err: &'a mut dyn Write,
    /// True where someone watches standard error on a terminal, where a line can be rewritten.
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
        self.product_worth(file, |out| write(out).map(|()| Worth::Keeping)).map(drop)
    }

    /// As [`product`](Self::product), where `write` says whether what it wrote is worth more than
    /// an older file. Says whether an older file was left as it was.
    pub(crate) fn product_worth(
        &mut self,
        file: Option<&Path>,
        write: impl FnOnce(&mut dyn Write) -> io::Result<Worth>,
    ) -> Result<bool> {
        let Some(path) = file else {
            let written = write(self.out).and_then(|_| self.out.flush());
            forgive_broken_pipe(written).context("standard output")?;
            return Ok(false);
        };
        in_place_of(path, write).with_context(|| format!("`{}` cannot be written", path.display()))
    }
}

/// Worth of a product against an older one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Worth {
    /// A product that takes the place of an older one.
    Keeping,
    /// Nothing came of it: it is written only where there is no older one.
    Nothing,
}

/// Lets `write` make a file, which takes the place of an older one only once it is whole.
/// Says whether an older file was left as it was.
pub(crate) fn in_place_of(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<Worth>,
) -> io::Result<bool> {
    let older = fs::metadata(path).ok();
    // a pipe or a device takes what it is given as it comes
    if older.as_ref().is_some_and(|older| !older.is_file()) {
        return directly(path, write);
    }
    let target = if older.is_some() { fs::canonicalize(path)? } else { path.to_owned() };
    let Some(part) = part_of(&target) else { return directly(&target, write) };
    let file = match File::create(&part) {
        Err(error) if is_of_the_folder(&error) => {
            return once_whole(&target, older.is_some(), write);
        }
        made => made?,
    };
    let finish = || {
        let mut out = BufWriter::new(file);
        let worth = write(&mut out)?;
        out.flush()?;
        if let Some(older) = &older {
            if worth == Worth::Nothing {
                fs::remove_file(&part)?;
                return Ok(true);
            }
            fs::set_permissions(&part, older.permissions())?;
        }
        fs::rename(&part, &target)?;
        Ok(false)
    };
    finish().inspect_err(|_| {
        let _ = fs::remove_file(&part);
    })
}

/// Tells whether no file can be made beside the wanted one, which may still be written itself.
fn is_of_the_folder(error: &io::Error) -> bool {
    use ErrorKind::{InvalidFilename, IsADirectory, PermissionDenied};

    matches!(error.kind(), PermissionDenied | IsADirectory | InvalidFilename)
}

/// Writes a file in its place, where none can be made beside it: only once `write` has ended, as
/// it may read what the file holds.
fn once_whole(
    path: &Path,
    has_older: bool,
    write: impl FnOnce(&mut dyn Write) -> io::Result<Worth>,
) -> io::Result<bool> {
    // that it cannot be written is known before the work
    let mut file = OpenOptions::new().write(true).create(true).truncate(false).open(path)?;
    let mut whole = Vec::new();
    let worth = write(&mut whole)?;
    if has_older && worth == Worth::Nothing {
        return Ok(true);
    }
    file.write_all(&whole)?;
    file.set_len(whole.len() as u64)?;
    Ok(false)
}

fn directly(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<Worth>,
) -> io::Result<bool> {
    let mut out = BufWriter::new(File::create(path)?);
    write(&mut out)?;
    out.flush()?;
    Ok(false)
}

/// The file beside it that is written first.
fn part_of(path: &Path) -> Option<PathBuf> {
    let name = path.file_name()?.to_string_lossy();
    Some(path.with_file_name(format!(".{name}.part")))
}

/// A reader that has gone away is no failure.
fn forgive_broken_pipe(written: io::Result<()>) -> io::Result<()> {
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}
