//! One part of a batch, as `fdi diagnose --shard` wrote it.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{self, File},
    io::{BufRead, BufReader, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    sync::Mutex,
};

use anyhow::{Context, Result, anyhow, bail};
use fdi_core::report::{BatchShard, Diagnosis, ResumeHead, SCHEMA_VERSION};
use serde::Deserialize;

use crate::{
    output::{Answer, Head, TOOL},
    resume::parse,
};

/// A part, with the names of its recordings in their order.
pub(super) struct Part {
    pub(super) path: PathBuf,
    pub(super) shard: BatchShard,
    /// Head of the whole.
    pub(super) head: Head,
    pub(super) names: Vec<String>,
    depend_on: BTreeMap<String, Option<String>>,
    content: Content,
}

enum Content {
    /// Where each line begins and ends: the answers of a large batch are read when they are due.
    Lines(Mutex<File>, Vec<[u64; 2]>),
    Answers(Vec<Answer>),
}

/// As much of an answer as tells which it is.
#[derive(Deserialize)]
struct Named {
    recording: String,
}

impl Part {
    /// Reads a part of either form.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let name = path.display();
        let file = File::open(path).with_context(|| format!("`{name}` cannot be opened"))?;
        let mut lines = BufReader::new(file);
        let mut first = Vec::new();
        lines.read_until(b'\n', &mut first).with_context(|| format!("`{name}`"))?;
        match serde_json::from_slice::<ResumeHead>(&first) {
            Ok(head) => Self::of_lines(path, head, lines, first.len() as u64),
            Err(_) => Self::of_document(path),
        }
    }

    /// A file of `--resume`.
    fn of_lines(
        path: &Path,
        head: ResumeHead,
        mut lines: BufReader<File>,
        mut end: u64,
    ) -> Result<Self> {
        let name = path.display();
        let shard = of_a_part(path, head.schema_version, &head.tool, head.shard)?;
        let (mut names, mut spans, mut line) = (Vec::new(), Vec::new(), Vec::new());
        loop {
            line.clear();
            lines.read_until(b'\n', &mut line).with_context(|| format!("`{name}`"))?;
            // a cut last line is no answer
            if line.last() != Some(&b'\n') {
                break;
            }
            let named = serde_json::from_slice::<Named>(&line);
            let named = named.with_context(|| format!("`{name}`, line {}", names.len() + 2))?;
            names.push(named.recording);
            spans.push([end, line.len() as u64]);
            end += line.len() as u64;
        }
        let setting = |key: &str| head.answers_depend_on.get(key).cloned().flatten();
        let seed = setting("seed").and_then(|seed| seed.parse().ok());
        let seed = seed.ok_or_else(|| anyhow!("`{name}` does not say its seed"))?;
        let bundles = setting("bundle").unwrap_or_default();
        let bundle = bundles.split(", ").next().unwrap_or_default().to_owned();
        Ok(Self {
            path: path.to_owned(),
            shard,
            head: Head { bundle, seed, stamp: None, part: None },
            names,
            depend_on: head.answers_depend_on,
            content: Content::Lines(Mutex::new(lines.into_inner()), spans),
        })
    }

    /// A JSON document.
    fn of_document(path: &Path) -> Result<Self> {
        let name = path.display();
        let bytes = fs::read(path).with_context(|| format!("`{name}`"))?;
        let document: Diagnosis = serde_json::from_slice(&bytes).with_context(|| {
            format!(
                "`{name}` is no part: merge takes files of `--resume` and JSON documents, and \
                 makes the other forms of them"
            )
        })?;
        let Diagnosis { bundle, seed, schema_version, tool, shard, .. } = document;
        let shard = of_a_part(path, schema_version, &tool, shard)?;
        let mut records = document.records.into_iter();
        let mut failed = document.failed.into_iter().zip(document.failed_at).peekable();
        let mut answers = Vec::new();
        loop {
            let place = answers.len() as u64;
            let answer = match failed.next_if(|(_, at)| *at == place) {
                Some((failure, _)) => Answer::Failed(failure),
                None => match records.next() {
                    Some(record) => Answer::Diagnosed(Box::new(record)),
                    None => break,
                },
            };
            answers.push(answer);
        }
        Ok(Self {
            path: path.to_owned(),
            shard,
            head: Head { bundle, seed, stamp: None, part: None },
            names: answers.iter().map(|answer| answer.recording().to_owned()).collect(),
            depend_on: document.answers_depend_on,
            content: Content::Answers(answers),
        })
    }

    /// The answer at a place, from 0.
    pub(super) fn answer(&self, place: usize) -> Result<Answer> {
        match &self.content {
            Content::Answers(answers) => Ok(answers[place].clone()),
            Content::Lines(file, spans) => {
                let [start, length] = spans[place];
                let mut bytes = vec![0; length as usize];
                let mut file = file.lock().expect("no thread panics while it holds the lock");
                file.seek(SeekFrom::Start(start))?;
                file.read_exact(&mut bytes)?;
                parse(&String::from_utf8(bytes)?)
                    .with_context(|| format!("`{}`, line {}", self.path.display(), place + 2))
            }
        }
    }

    /// Refuses parts of another batch, and answers that depend on something else.
    pub(super) fn check_against(&self, first: &Self) -> Result<()> {
        let (name, other) = (self.path.display(), first.path.display());
        let is_lines = |part: &Self| matches!(part.content, Content::Lines(..));
        if is_lines(self) != is_lines(first) {
            bail!("of `{other}` and `{name}` one is of `--resume`, one a document: give one kind");
        }
        let (shard, wanted) = (&self.shard, &first.shard);
        if shard.of != wanted.of {
            bail!(
                "`{other}` is a part of {}, `{name}` of {}: give parts of one batch",
                wanted.of,
                shard.of
            );
        }
        if (shard.recordings, &shard.list_sha256) != (wanted.recordings, &wanted.list_sha256) {
            bail!(
                "`{other}` is of a batch of {} recordings, `{name}` of one of {} recordings, and \
                 the lists differ: give parts of one batch",
                wanted.recordings,
                shard.recordings
            );
        }
        for setting in self.depend_on.keys().chain(first.depend_on.keys()) {
            let of = |part: &Self| part.depend_on.get(setting).cloned().flatten();
            let (then, now) = (of(first), of(self));
            if then != now {
                let told = |value: Option<String>| match value {
                    None => format!("without `--{setting}`"),
                    Some(value) => format!("with `--{setting}` `{value}`"),
                };
                bail!("`{other}` was made {}, `{name}` {}", told(then), told(now));
            }
        }
        Ok(())
    }

    /// Refuses a part that has not every one of its recordings once.
    pub(super) fn check_whole(&self) -> Result<()> {
        let BatchShard { index, of, recordings, .. } = self.shard;
        let wanted = (recordings + of - index) / of;
        let (path, found) = (self.path.display(), self.names.len());
        let mut seen = BTreeSet::new();
        if let Content::Lines(..) = self.content
            && let Some(twice) = self.names.iter().find(|name| !seen.insert(*name))
        {
            bail!(
                "`{path}`, part {index} of {of}, has `{twice}` twice: its run did not end, so run \
                 it again"
            );
        }
        if found as u64 != wanted {
            bail!(
                "`{path}`, part {index} of {of}, has {found} of its {wanted} recordings: its run \
                 did not end, so run it again"
            );
        }
        Ok(())
    }
}

/// The part that a file says to be.
fn of_a_part(path: &Path, form: u32, tool: &str, shard: Option<BatchShard>) -> Result<BatchShard> {
    let name = path.display();
    if form != SCHEMA_VERSION || tool != TOOL {
        bail!("`{name}` is of `{tool}`, form {form}; this is `{TOOL}`, form {SCHEMA_VERSION}");
    }
    let shard = shard.ok_or_else(|| {
        anyhow!("`{name}` is the answer to a whole batch, not to a part of one (`--shard I/N`)")
    })?;
    if !(1..=shard.of).contains(&shard.index) {
        bail!("`{name}` says to be part {} of {}", shard.index, shard.of);
    }
    Ok(shard)
}
