//! Answers kept in a file, so that a batch that was interrupted can go on.
//!
//! The first line says what the answers depend on ([`ResumeHead`]); each line after it is an
//! answer. While a batch runs, answers are appended as they come, also in place of earlier ones:
//! the last line of a recording counts. When the batch has ended the file is put into its order.

use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions, TryLockError},
    io::{self, BufRead, BufReader, ErrorKind, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::Mutex,
};

use anyhow::{Context, Result, bail};
use fdi_core::report::{BatchShard, Failure, ResumeHead};

use crate::{
    output::{Answer, to_line},
    streams::{Worth, in_place_of},
};

/// Where a line of the file stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Span {
    start: u64,
    length: usize,
}

impl Span {
    fn end(self) -> u64 {
        self.start + self.length as u64
    }
}

/// The file of answers: what it holds, and where the next one goes.
pub(crate) struct Resume {
    path: PathBuf,
    /// Shared by the threads that look at earlier answers and the one that adds new ones.
    file: Mutex<File>,
    /// Length of the first line as it stands there.
    head: u64,
    /// The last line of each recording.
    kept: BTreeMap<String, Kept>,
    /// The lines of this batch in its order.
    order: Vec<Span>,
    end: u64,
}

/// A line of an earlier run.
#[derive(Clone, Copy, Debug)]
struct Kept {
    span: Span,
    /// True where the line says more than that the diagnosis failed.
    is_diagnosed: bool,
}

impl Resume {
    /// Opens the file, made if there is none, and checks that its answers are of this batch and
    /// depend on the same; an unfinished last line is cut off.
    pub(crate) fn open(
        path: &Path,
        batch: impl Iterator<Item = String>,
        head: &ResumeHead,
    ) -> Result<Self> {
        let name = path.display();
        if fs::metadata(path).is_ok_and(|found| !found.is_file()) {
            bail!("`{name}` is not a regular file");
        }
        let mut options = OpenOptions::new();
        let file = options
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .with_context(|| format!("`{name}` cannot be opened"))?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            bail!("`{name}` is written by another run");
        }
        let first = serde_json::to_string(head)? + "\n";
        let recordings: Vec<String> = batch.collect();
        let mut resume = Self {
            path: path.to_owned(),
            file: Mutex::new(file),
            head: first.len() as u64,
            kept: BTreeMap::new(),
            order: Vec::new(),
            end: 0,
        };
        resume.index(&first, head, &recordings).with_context(|| format!("`{name}`"))?;
        let mut file = resume.locked();
        let begin = |file: &mut File| {
            file.set_len(resume.end)?;
            file.seek(SeekFrom::End(0))?;
            if resume.end == 0 { file.write_all(first.as_bytes()) } else { Ok(()) }
        };
        begin(&mut file).with_context(|| format!("`{name}` cannot be written"))?;
        drop(file);
        resume.end = resume.end.max(resume.head);
        Ok(resume)
    }

    /// Finds out what the file holds.
    fn index(&mut self, first: &str, head: &ResumeHead, batch: &[String]) -> Result<()> {
        let mut known: Vec<&str> = batch.iter().map(String::as_str).collect();
        known.sort_unstable();
        let file = self.file.get_mut().expect("no thread has it yet");
        let mut lines = BufReader::new(&*file);
        let mut line = String::new();
        for number in 1.. {
            line.clear();
            match lines.read_line(&mut line) {
                Ok(read) if read > 0 && line.ends_with('\n') => {}
                Ok(_) if number == 1 && !first.starts_with(&line) => {
                    check_head(&line, head)?;
                    break;
                }
                Ok(_) => break,
                // a cut inside a character
                Err(error) if number > 1 && error.kind() == ErrorKind::InvalidData => break,
                Err(error) => return Err(error.into()),
            }
            let span = Span { start: self.end, length: line.len() };
            self.end = span.end();
            if number == 1 {
                check_head(&line, head)?;
                // another program may have written it in other bytes
                self.head = self.end;
                continue;
            }
            let answer = parse(&line).with_context(|| format!("line {number}"))?;
            let found = answer.recording();
            if known.binary_search(&found).is_err() {
                bail!("line {number} is of `{found}`, which is not in this batch");
            }
            let is_diagnosed = matches!(answer, Answer::Diagnosed(_));
            self.kept.insert(found.to_owned(), Kept { span, is_diagnosed });
        }
        Ok(())
    }

    /// How many recordings of the batch it has, failures apart.
    pub(crate) fn done(&self, recording: &Path) -> bool {
        self.kept.get(&recording.display().to_string()).is_some_and(|kept| kept.is_diagnosed)
    }

    /// The answer to a recording that an earlier run has, and its line.
    pub(crate) fn earlier(&self, recording: &Path) -> Result<Option<(Answer, Line)>> {
        let Some(kept) = self.kept.get(&recording.display().to_string()) else { return Ok(None) };
        let mut bytes = vec![0; kept.span.length];
        let mut file = self.locked();
        file.seek(SeekFrom::Start(kept.span.start))?;
        file.read_exact(&mut bytes)?;
        drop(file);
        let answer = parse(&String::from_utf8(bytes)?)?;
        Ok(Some((answer, Line(kept.span))))
    }

    /// Takes over the answer on this line as the next one of the batch.
    pub(crate) fn take_over(&mut self, line: Line) {
        self.order.push(line.0);
    }

    /// Keeps one more answer, the next one of the batch.
    pub(crate) fn keep(&mut self, answer: &Answer) -> io::Result<()> {
        let line = to_line(answer)?;
        let mut file = self.locked();
        file.seek(SeekFrom::End(0)).and_then(|_| file.write_all(&line)).map_err(|error| {
            io::Error::other(format!("`{}` cannot be written: {error}", self.path.display()))
        })?;
        drop(file);
        let span = Span { start: self.end, length: line.len() };
        self.end = span.end();
        self.order.push(span);
        Ok(())
    }

    /// Puts the file into the order of the batch, once all of it is done: the file of a run that
    /// was not interrupted is that already.
    pub(crate) fn finish(self) -> Result<()> {
        let mut expected = self.head;
        let in_order = self.order.iter().all(|span| {
            let fits = span.start == expected;
            expected = span.end();
            fits
        });
        if in_order && expected == self.end {
            return Ok(());
        }
        let whole = Span { start: 0, length: self.head as usize };
        let rewritten = in_place_of(&self.path, |out| {
            let mut file = self.locked();
            for span in std::iter::once(&whole).chain(&self.order) {
                file.seek(SeekFrom::Start(span.start))?;
                io::copy(&mut Read::by_ref(&mut *file).take(span.length as u64), out)?;
            }
            Ok(Worth::Keeping)
        });
        rewritten
            .map(|_| ())
            .with_context(|| format!("`{}` cannot be written", self.path.display()))
    }

    fn locked(&self) -> std::sync::MutexGuard<'_, File> {
        self.file.lock().expect("no thread panics while it holds the lock")
    }
}

impl Drop for Resume {
    /// Gives the file free at once, also where a process that was started meanwhile shares it.
    fn drop(&mut self) {
        if let Ok(file) = self.file.lock() {
            let _ = file.unlock();
        }
    }
}

/// A line of the file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line(Span);

/// Refuses answers that depend on something else.
fn check_head(line: &str, now: &ResumeHead) -> Result<()> {
    let Ok(then) = serde_json::from_str::<ResumeHead>(line) else {
        bail!("its first line is not that of a file of `--resume`; it is left as it was");
    };
    let form = then.schema_version;
    if form != now.schema_version {
        bail!(
            "its answers are of the form {form}, this run writes {}: use another file",
            now.schema_version
        );
    }
    if then.tool != now.tool {
        bail!("its answers are of `{}`, this is `{}`: use another file", then.tool, now.tool);
    }
    if then.shard != now.shard {
        let told = |head: &ResumeHead| match &head.shard {
            None => "a whole batch".to_owned(),
            Some(BatchShard { index, of, recordings, .. }) => {
                format!("part {index} of {of} of a batch of {recordings} recordings")
            }
        };
        let (then, now) = (told(&then), told(now));
        if then == now {
            bail!("it is {now}, which has other recordings now: use another file");
        }
        bail!("it is {then}, this run is {now}: use another file");
    }
    let settings = |head: &ResumeHead| head.answers_depend_on.clone();
    let (then, now) = (settings(&then), settings(now));
    for name in now.keys().chain(then.keys()) {
        let of = |head: &BTreeMap<String, Option<String>>| head.get(name).cloned().flatten();
        let (before, wanted) = (of(&then), of(&now));
        if before != wanted {
            let told = |value: Option<String>| match value {
                None => format!("without `--{name}`"),
                Some(value) => format!("with `--{name}` `{value}`"),
            };
            bail!(
                "its answers were made {}, this run is {}: give the same, or another file",
                told(before),
                told(wanted)
            );
        }
    }
    Ok(())
}

/// An answer from its line.
pub(crate) fn parse(line: &str) -> Result<Answer> {
    if let Ok(failure) = serde_json::from_str::<Failure>(line) {
        return Ok(Answer::Failed(failure));
    }
    let record = serde_json::from_str(line).context("is no answer of `diagnose`")?;
    Ok(Answer::Diagnosed(Box::new(record)))
}
