//! Answers kept in a file, so that a batch that was interrupted can go on.

use std::{
    fs::{File, OpenOptions},
    io::{self, BufRead, BufReader, ErrorKind, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use fdi_core::report::Failure;

use crate::output::{Answer, to_line};

/// The file of answers: what it holds, and where the next one goes.
pub(crate) struct Resume {
    path: PathBuf,
    file: File,
    done: usize,
}

impl Resume {
    /// Opens the file, made if there is none, and checks that it holds the beginning
    /// of this batch; an unfinished last line is cut off.
    pub(crate) fn open<'a>(
        path: &Path,
        mut batch: impl Iterator<Item = &'a Path>,
        acceptable: impl Fn(&Answer) -> Result<()>,
    ) -> Result<Self> {
        let name = path.display();
        let mut options = OpenOptions::new();
        let mut file = options
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .with_context(|| format!("`{name}` cannot be opened"))?;
        let (mut done, mut length) = (0, 0);
        let mut lines = BufReader::new(&file);
        let mut line = String::new();
        loop {
            line.clear();
            match lines.read_line(&mut line) {
                Ok(read) if read > 0 && line.ends_with('\n') => length += read as u64,
                Ok(_) => break,
                // a cut inside a character
                Err(error) if error.kind() == ErrorKind::InvalidData => break,
                Err(error) => return Err(error).with_context(|| format!("`{name}`")),
            }
            done += 1;
            let answer = parse(&line).with_context(|| format!("`{name}` line {done}"))?;
            let found = answer.recording();
            match batch.next().map(|path| path.display().to_string()) {
                Some(expected) if expected == found => {}
                Some(expected) => {
                    bail!("`{name}` line {done} is of `{found}`, the batch has `{expected}` there")
                }
                None => bail!("`{name}` line {done} is of `{found}`, the batch ends before it"),
            }
            acceptable(&answer).with_context(|| format!("`{name}` line {done}"))?;
        }
        file.set_len(length)?;
        file.seek(SeekFrom::End(0))?;
        Ok(Self { path: path.to_owned(), file, done })
    }

    /// How many recordings of the batch it has.
    pub(crate) fn done(&self) -> usize {
        self.done
    }

    /// Tells the answers that it had when it was opened.
    pub(crate) fn replay(&self, mut tell: impl FnMut(&Answer) -> io::Result<()>) -> io::Result<()> {
        let lines = BufReader::new(File::open(&self.path)?).lines();
        lines.take(self.done).try_for_each(|line| {
            let answer = parse(&line?).map_err(|error| io::Error::other(format!("{error:#}")))?;
            tell(&answer)
        })
    }

    /// Keeps one more answer.
    pub(crate) fn keep(&mut self, answer: &Answer) -> io::Result<()> {
        self.file.write_all(&to_line(answer)?).map_err(|error| {
            io::Error::other(format!("`{}` cannot be written: {error}", self.path.display()))
        })
    }
}

/// An answer from its line.
fn parse(line: &str) -> Result<Answer> {
    if let Ok(failure) = serde_json::from_str::<Failure>(line) {
        return Ok(Answer::Failed(failure));
    }
    let record = serde_json::from_str(line).context("is no answer of `diagnose`")?;
    Ok(Answer::Diagnosed(Box::new(record)))
}
