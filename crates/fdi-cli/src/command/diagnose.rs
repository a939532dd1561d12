//! `fdi diagnose`.

mod after;
mod answers;
mod together;

use std::{
    fs,
    io::{self, Read},
    path::{Path, PathBuf},
    sync::RwLock,
};

use anyhow::{Context, Result, bail};
use fdi_core::{
    list_recordings, recording_sha256,
    report::{BatchShard, RecordDiagnosis, Severity, Verdict},
};
use recordings::sha256_hex;

use crate::{
    DiagnoseArgs, Diagnoser, ExitBy, ExitStatus, GlobalArgs, OutputFormat, Streams,
    answering::{Batch, STANDARD_INPUT, Source, failure},
    batch::in_order,
    config,
    deciding::Deciding,
    files::Files,
    output::{Answer, Head, Tally, writer},
    progress::Progress,
    reading_options::ReadingOptions,
    resume::{Line, Resume},
    stamp,
    streams::Worth,
};

/// Diagnoses the recordings that the options name.
///
/// # Errors
/// When the options are contradictory or the product cannot be written. What goes
/// wrong with a recording stands in the answer and makes the status
/// [`ExitStatus::Failed`].
pub fn diagnose_with(
    diagnoser: &dyn Diagnoser,
    args: &DiagnoseArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    Files::of_diagnosis(args, global).check()?;
    diagnose(diagnoser, args, global, streams)
}

/// Diagnoses recordings, once the files that are read and written have been checked.
pub(crate) fn diagnose(
    diagnoser: &dyn Diagnoser,
    args: &DiagnoseArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    together::check(args)?;
    let one_a_line = args.resume.is_some() || global.output_format == OutputFormat::Jsonl;
    let map = args.map.column_map()?;
    let is_kept = args.resume.is_some();
    let (names, stable) = (&args.fleet.names, global.stable);
    let deciding = &Deciding::of(args, diagnoser)?;
    let batch = Batch { diagnoser, map, names, stable, one_a_line, is_kept, deciding };
    let (inputs, shard) = inputs(args)?;
    config::check_beside(inputs.iter().filter_map(Source::file), global)?;
    let part = match shard {
        Some(shard) => {
            let depend_on =
                answers::head(args, global, diagnoser, deciding, None)?.answers_depend_on;
            Some((shard, depend_on))
        }
        None => None,
    };
    let resume = match &args.resume {
        Some(path) => {
            let shard = part.as_ref().map(|(shard, _)| shard.clone());
            let head = answers::head(args, global, diagnoser, deciding, shard)?;
            Some(Resume::open(path, inputs.iter().map(Source::name), &head)?)
        }
        None => None,
    };
    let mut records = args.wants_report().then(Vec::new);
    let head = Head {
        bundle: batch.diagnoser.bundle_sha256().to_owned(),
        seed: global.seed,
        stamp: global.stamp.then(stamp::now),
        part,
    };
    let asked = Asked { inputs, head, is_identifiability_told: args.identifiability };
    let (tally, left) = match args.together {
        Some(by) => together::tell(&batch, &asked, by, &mut records, global, streams)?,
        None => tell(&batch, &asked, resume, &mut records, global, streams)?,
    };
    if let (Some(path), true) = (&global.output, left) {
        say_left(path, global, streams);
    }
    for failure in &tally.failures {
        streams.say(format_args!("error: {}: {}", failure.recording, failure.error));
    }
    if !global.quiet {
        if let Some(hint) = reading_hint(&tally, args) {
            streams.say(format_args!("\nhint: {hint}"));
        }
        if let Some(folder) = args.unit.as_ref().filter(|path| path.is_dir())
            && tally.without_unit > 0
        {
            let (count, folder) = (tally.without_unit, folder.display());
            streams.say(format_args!(
                "`--unit {folder}`: no unit was used for {count} of the recordings (units are matched \
                 by `actuator-id`)"
            ));
        }
        streams.say(format_args!("{}", tally.sentence()));
    }
    let watched = tally.decided(Severity::Watch);
    if args.exit_code == Some(ExitBy::Decision) && !watched.is_empty() {
        streams.say(format_args!("warning: to be watched: {}", watched.join(", ")));
    }
    after::batch(&batch, args, global, &tally, records.as_deref(), streams)?;
    Ok(status(&tally, args.exit_code))
}

/// Failures that are looked at for options that would have read the recording.
const LOOKED_AT: usize = 3;

/// Options that read a recording which was not, where some do.
fn reading_hint(tally: &Tally, args: &DiagnoseArgs) -> Option<String> {
    tally.failures.iter().take(LOOKED_AT).find_map(|failure| {
        let path = Path::new(&failure.recording);
        let options = ReadingOptions::of_failure(path, &args.map)?;
        let (condition, words, file) = (options.condition(), options.words(), path.display());
        Some(format!("{condition}`{words}` reads `{file}`"))
    })
}

/// Says that an older product stays.
fn say_left(path: &Path, global: &GlobalArgs, streams: &mut Streams<'_>) {
    if !global.quiet {
        let name = path.display();
        streams.say(format_args!("`{name}` is left as it was: no recording could be diagnosed"));
    }
}

/// Diagnoses what is not done yet and writes all answers; says whether an older product was left
/// because nothing came of the batch.
fn tell(
    batch: &Batch<'_>,
    asked: &Asked,
    resume: Option<Resume>,
    records: &mut Option<Vec<RecordDiagnosis>>,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<(Tally, bool)> {
    let Asked { inputs, head, .. } = asked;
    let jobs = global.threads();
    let is_done = |input: &&Source| resume.as_ref().is_some_and(|one| one.done(&input.path()));
    let before = inputs.iter().filter(is_done).count();
    let mut tally = Tally::default();
    let mut keep = |answer: &Answer| {
        if let (Some(records), Answer::Diagnosed(record)) = (records.as_mut(), answer) {
            records.push((**record).clone());
        }
    };
    // a list of the recordings with `-v` tells as much
    let is_told = !global.quiet && !global.verbose;
    let total = if is_told { inputs.len() } else { 0 };
    let mut progress = Progress::new(total, before.min(total), streams.is_terminal);
    let Streams { out, err, is_terminal } = streams;
    let mut product = Streams { out: &mut **out, err: &mut io::sink(), is_terminal: *is_terminal };
    progress.begin(*err);
    let resume = resume.map(RwLock::new);
    let left = product.product_worth(global.output.as_deref(), |out| {
        let styled = global.output.is_none();
        let mut writer = writer(global.output_format, styled, out);
        writer.begin(head)?;
        let emit = |mut done: Done| {
            keep(&done.answer);
            asked.leave_to_the_report(&mut done.answer);
            let answer = &done.answer;
            if let Some(resume) = &resume {
                let mut resume = resume.write().expect(UNPOISONED);
                match done.line {
                    Some(line) => resume.take_over(line),
                    None => resume.keep(answer)?,
                }
            }
            if global.verbose {
                let again = if done.line.is_some() { " (taken over)" } else { "" };
                // that progress cannot be told is no failure
                let _ = writeln!(err, "{}{again}", answer.in_a_word());
            }
            match done.line {
                Some(_) => tally.take_over(answer),
                None => tally.count(answer),
            }
            progress.clear(*err);
            let written = writer.answer(answer);
            match done.line {
                Some(_) => progress.stay(*err),
                None => progress.step(*err),
            }
            written
        };
        let work = |_: usize, input: &Source| batch.done(input, resume.as_ref());
        let done = in_order(inputs, jobs, work, emit);
        progress.clear(*err);
        done?;
        writer.end()?;
        Ok(if tally.is_empty() { Worth::Nothing } else { Worth::Keeping })
    })?;
    if let Some(resume) = resume {
        resume.into_inner().expect(UNPOISONED).finish()?;
    }
    Ok((tally, left))
}

/// Why a lock can be had.
const UNPOISONED: &str = "no thread panics while it holds the lock";

/// An answer, and its line where an earlier run has it.
struct Done {
    answer: Answer,
    line: Option<Line>,
}

fn status(tally: &Tally, exit_by: Option<ExitBy>) -> ExitStatus {
    let (is_found, is_open) = match exit_by {
        None => (false, false),
        Some(ExitBy::Verdict) => (tally.found(), tally.without_conclusion > 0),
        Some(ExitBy::Decision) => {
            let of = |severity| !tally.decided(severity).is_empty();
            (of(Severity::Act), of(Severity::Undecided))
        }
    };
    if !tally.failures.is_empty() {
        ExitStatus::Failed
    } else if is_found {
        ExitStatus::Found
    } else if is_open {
        ExitStatus::Open
    } else {
        ExitStatus::Done
    }
}

/// Recordings that a run is to diagnose, and the facts before its answers.
struct Asked {
    inputs: Vec<Source>,
    head: Head,
    is_identifiability_told: bool,
}

impl Asked {
    /// Takes out of an answer what was added for a report.
    fn leave_to_the_report(&self, answer: &mut Answer) {
        if let (false, Answer::Diagnosed(record)) = (self.is_identifiability_told, answer) {
            record.identifiability.clear();
        }
    }
}

/// The entries that the options stand for, in their order, and which part of the batch they are.
fn inputs(args: &DiagnoseArgs) -> Result<(Vec<Source>, Option<BatchShard>)> {
    let paths = paths(args)?;
    let inputs = sources(paths.iter().map(PathBuf::as_path));
    let Some(shard) = args.shard else { return Ok((inputs, None)) };
    let told = BatchShard {
        index: shard.index as u64,
        of: shard.of as u64,
        recordings: inputs.len() as u64,
        list_sha256: list_sha256(inputs.iter().map(Source::name)),
    };
    let kept = inputs.into_iter().enumerate().filter(|(index, _)| shard.holds(*index));
    Ok((kept.map(|(_, input)| input).collect(), Some(told)))
}

/// Paths of the command line and of `--files-from`.
fn paths(args: &DiagnoseArgs) -> Result<Vec<PathBuf>> {
    let mut paths = args.paths.clone();
    let is_input = |path: &PathBuf| path.as_os_str() == STANDARD_INPUT;
    if let Some(list) = &args.files_from {
        let names = if is_input(list) {
            io::read_to_string(io::stdin()).context("standard input")?
        } else {
            fs::read_to_string(list).with_context(|| list.display().to_string())?
        };
        let lines = names.lines().map(str::trim_end).filter(|line| !line.is_empty());
        paths.extend(lines.map(PathBuf::from));
        if paths.is_empty() {
            bail!("`--files-from {}` names no recording", list.display());
        }
    }
    let times = paths.iter().chain(&args.files_from).filter(|path| is_input(path)).count();
    if times > 1 {
        bail!("standard input (`-`) is named {times} times, and can be read once");
    }
    let again = [("--report", args.report.report.is_some() || args.report.figures.is_some())];
    let again = again.into_iter().chain([("--resume", args.resume.is_some())]);
    if let Some((option, _)) = again.into_iter().find(|(_, is_given)| *is_given)
        && paths.iter().any(is_input)
    {
        bail!("`{option}` reads a recording again, which standard input (`-`) does not allow");
    }
    Ok(paths)
}

/// Identity of a list of recordings, by their names in their order.
pub(crate) fn list_sha256(names: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    let mut list = Vec::new();
    for name in names {
        list.extend_from_slice(name.as_ref().as_bytes());
        list.push(0);
    }
    sha256_hex(&list)
}

/// Recordings that paths stand for, in their order.
pub(crate) fn sources<'a>(paths: impl IntoIterator<Item = &'a Path>) -> Vec<Source> {
    let mut sources = Vec::new();
    for path in paths {
        if path.as_os_str() == STANDARD_INPUT {
            sources.push(of_standard_input());
            continue;
        }
        match list_recordings(path) {
            Ok(found) => sources.extend(found.into_iter().map(Source::File)),
            Err(error) => sources.push(Source::Broken(failure(path, error.to_string()))),
        }
    }
    sources
}

/// The recording that comes through standard input.
fn of_standard_input() -> Source {
    let mut bytes = Vec::new();
    match io::stdin().take(MOST_BYTES).read_to_end(&mut bytes) {
        Ok(_) => Source::Bytes { name: STANDARD_INPUT.to_owned(), bytes },
        Err(error) => Source::Broken(failure(Path::new(STANDARD_INPUT), error.to_string())),
    }
}

/// One byte more than a reader takes.
const MOST_BYTES: u64 = (1 << 30) + 1;

impl Batch<'_> {
    /// The answer of an earlier run, where the recording is the same, else one of its own.
    fn done(&self, input: &Source, resume: Option<&RwLock<Resume>>) -> Done {
        let Some(resume) = resume else { return Done { answer: self.answer(input), line: None } };
        let path = input.path();
        let earlier = resume.read().expect(UNPOISONED).earlier(&path);
        match earlier {
            Ok(Some((Answer::Diagnosed(record), line)))
                if record.recording_sha256.is_some()
                    && recording_sha256(&path).ok() == record.recording_sha256 =>
            {
                Done { answer: Answer::Diagnosed(record), line: Some(line) }
            }
            // what failed is tried again, what is not the same diagnosed again
            Ok(_) => Done { answer: self.answer(input), line: None },
            Err(error) => {
                let answer = Answer::Failed(failure(&path, format!("{error:#}")));
                Done { answer, line: None }
            }
        }
    }
}

impl Tally {
    /// Tells whether a fault or a model error was found.
    fn found(&self) -> bool {
        self.of(Verdict::Faulty) + self.of(Verdict::ModelInadequate) > 0
    }
}
