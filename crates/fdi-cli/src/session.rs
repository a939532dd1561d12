//! The diagnosis without a terminal: options resolved once, recordings from anywhere, answers in
//! every published form. Other front ends than the program stand on it, so that their answers are
//! the program's, bit for bit (`docs/decisions/0130-python.md`).

use std::{io, path::Path};

use anyhow::{Context, Result, anyhow, bail};
use clap::Parser;
use fdi_core::{
    ColumnMap, FitSignals, Recording,
    report::{Failure, RecordDiagnosis},
};

use crate::{
    Cli, DiagnoseArgs, Diagnoser, GlobalArgs, OutputFormat,
    answering::{Batch, Source},
    args::Command,
    batch::in_order,
    command::sources,
    deciding::Deciding,
    diagnoser,
    output::{Answer, Cell, Head, Kind, columns, row, writer},
    simulator,
};

/// Settings of a diagnosis, with the bundles and units that they name, ready for recordings.
pub struct Session {
    diagnoser: Box<dyn Diagnoser>,
    args: DiagnoseArgs,
    global: GlobalArgs,
    map: ColumnMap,
    one_a_line: bool,
    deciding: Deciding,
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session").field("args", &self.args).finish_non_exhaustive()
    }
}

/// Told that nobody waits for more answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stopped;

impl Session {
    /// Settings as words of the command line, after `fdi diagnose`. Neither a file of settings nor
    /// variables of the environment add to them where `--seed`, `--jobs` and `--output-format` are
    /// given.
    ///
    /// # Errors
    /// Words that are no options of `fdi diagnose`, and files that cannot be read.
    pub fn new(words: &[String]) -> Result<Self> {
        let Cli { command: Command::Diagnose(args), global } = parsed("diagnose", words)? else {
            bail!("not options of `fdi diagnose`");
        };
        let diagnoser = diagnoser::diagnoser(&args, global.root_seed())?;
        let map = args.map.column_map()?;
        let one_a_line = global.output_format == OutputFormat::Jsonl;
        let deciding = Deciding::of(&args, diagnoser.as_ref())?;
        Ok(Self { diagnoser, args, global, map, one_a_line, deciding })
    }

    /// Recordings that paths stand for: files, those in folders, and those that match patterns.
    pub fn sources<'a>(paths: impl IntoIterator<Item = &'a Path>) -> Vec<Source> {
        sources(paths)
    }

    /// Which columns are which channels.
    pub fn map(&self) -> &ColumnMap {
        &self.map
    }

    /// Answers to recordings in their order, on as many threads as the options say. Ends when
    /// `emit` wants no more.
    ///
    /// # Errors
    /// [`Stopped`] where `emit` said so.
    pub fn answers(
        &self,
        sources: &[Source],
        emit: impl FnMut(Answer) -> Result<(), Stopped>,
    ) -> Result<(), Stopped> {
        let batch = self.batch();
        let work = |_: usize, source: &Source| batch.answer(source);
        in_order(sources, self.global.threads(), work, emit)
    }

    /// The signals behind the answer to a recording.
    ///
    /// # Errors
    /// Why it cannot be diagnosed.
    pub fn signals(&self, recording: &Recording) -> Result<Option<FitSignals>> {
        self.diagnoser.signals(recording)
    }

    /// Facts that stand before the answers.
    pub fn head(&self) -> Head {
        let bundle = self.diagnoser.bundle_sha256().to_owned();
        Head { bundle, seed: self.global.seed, stamp: None, part: None }
    }

    fn batch(&self) -> Batch<'_> {
        Batch {
            diagnoser: self.diagnoser.as_ref(),
            map: self.map.clone(),
            names: &self.args.fleet.names,
            stable: self.global.stable,
            one_a_line: self.one_a_line,
            is_kept: false,
            deciding: &self.deciding,
        }
    }
}

/// Answers with what stands before them, in every published form.
#[derive(Debug)]
pub struct Answers {
    /// Facts that stand before them.
    pub head: Head,
    /// Answers, in the order of the recordings.
    pub answers: Vec<Answer>,
}

impl Answers {
    /// The product that `fdi diagnose --output-format FORM` writes.
    ///
    /// # Errors
    /// Words that are no form.
    pub fn written(&self, form: &str) -> Result<Vec<u8>> {
        let format = <OutputFormat as clap::ValueEnum>::from_str(form, false)
            .map_err(|_| anyhow!("`{form}` is no form of an answer"))?;
        let mut out = Vec::new();
        let mut writer = writer(format, false, &mut out);
        let mut write = || -> io::Result<()> {
            writer.begin(&self.head)?;
            self.answers.iter().try_for_each(|answer| writer.answer(answer))?;
            writer.end()
        };
        write().context("memory")?;
        drop(writer);
        Ok(out)
    }

    /// Names and kinds of the columns of the table.
    pub fn columns() -> Vec<(String, Kind)> {
        columns()
    }

    /// The table, a row an answer, a cell for each of the [`columns`](Self::columns).
    pub fn rows(&self) -> Vec<Vec<Cell>> {
        self.answers.iter().map(row).collect()
    }

    /// Answers to recordings that could be diagnosed.
    pub fn records(&self) -> impl Iterator<Item = &RecordDiagnosis> {
        self.answers.iter().filter_map(|answer| match answer {
            Answer::Diagnosed(record) => Some(record.as_ref()),
            Answer::Failed(_) => None,
        })
    }

    /// Recordings that could not be diagnosed.
    pub fn failures(&self) -> impl Iterator<Item = &Failure> {
        self.answers.iter().filter_map(|answer| match answer {
            Answer::Failed(failure) => Some(failure),
            Answer::Diagnosed(_) => None,
        })
    }
}

/// A simulated recording, with what is to be said of it, from words of the command line after
/// `fdi simulate`.
///
/// # Errors
/// Words that are no options of `fdi simulate`, and tests that cannot be simulated.
pub fn simulated(words: &[String]) -> Result<(Recording, Vec<String>)> {
    let Cli { command: Command::Simulate(args), global } = parsed("simulate", words)? else {
        bail!("not options of `fdi simulate`");
    };
    let simulator::Simulated { recording, notices, .. } =
        simulator::simulate(&args, global.root_seed())?;
    Ok((recording, notices))
}

/// A command line, without a file of settings.
///
/// # Errors
/// Words that the command does not take.
pub fn parsed(command: &str, words: &[String]) -> Result<Cli> {
    let words = ["fdi", command].into_iter().chain(words.iter().map(String::as_str));
    Cli::try_parse_from(words).map_err(|error| {
        let text = error.render().to_string();
        let told = text.split("\n\n").next().unwrap_or_default().trim();
        anyhow!("{}", told.trim_start_matches("error: "))
    })
}
