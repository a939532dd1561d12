//! `fdi explain`.

mod compared;
mod document;
mod evidence;
mod learnt;
mod sentences;
mod signals;

pub(super) use document::{holdout, observation};
pub(crate) use sentences::rounded;
pub(super) use signals::sound;

use std::{path::PathBuf, sync::Arc, time::Instant};

use anyhow::{Context, Result, anyhow, bail};
use fdi_core::{
    GivenCommand, Recording,
    ema_sim::{EffectId, model_file::MachineModel},
    read_machine,
    report::{ExplanationVerdict, Prediction},
};
use fdi_report::Page;
use greybox::{Explained, Options, Record, Recordings, SignalFind, Signals};
use serde::Serialize;

use super::{effects::causes, unit::LearntMachine};
use crate::{
    ExitStatus, GlobalArgs, OutputFormat, Streams,
    args::{ExplainArgs, RecordArgs},
    progress::watched,
    report_file,
};

/// Says what a model misses in recordings, and writes the extended model.
#[expect(clippy::disallowed_methods, reason = "the time taken is part of the answer")]
pub(crate) fn explain(
    args: &ExplainArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    use OutputFormat::{Human, Json, Jsonl};

    if !matches!(global.output_format, Human | Json | Jsonl) {
        bail!("no table of this: `--output-format human|json|jsonl`");
    }
    let start = Instant::now();
    let compared = compared_with(args)?;
    let records = Records::read(&args.records)?;
    let model = &compared.model;
    let (explained, prediction) =
        match learnt::explained(&compared, &records, args, global, streams)? {
            Ok(explained) => (explained, Some(Prediction::Learnt)),
            Err(reason) => {
                if global.verbose {
                    streams.say(format_args!("not with the learnt error: {reason}"));
                }
                let explained = of_machine(&records, args, model, global, streams)?;
                let prediction = explained.observation.and_then(document::prediction);
                (explained, prediction)
            }
        };
    if global.verbose {
        for line in &explained.log {
            streams.say(format_args!("{line}"));
        }
    }
    let elapsed_s = (!global.stable).then(|| start.elapsed().as_secs_f64());
    let answer = document::document(&explained, prediction, model, global, elapsed_s);
    report_file::write(args.report.places(), || Ok(Page::of_explanation(&answer)))?;
    let text = in_form(global.output_format, &answer, sentences::human)?;
    streams.product(None, |out| out.write_all(text.as_bytes()))?;
    if let Some(path) = &global.output {
        let extended = explained.extend(model);
        if extended == *model {
            let name = path.display();
            streams.say(format_args!("{name}: nothing is found, the model as it was is written"));
        }
        streams.product(Some(path), |out| out.write_all(extended.write().as_bytes()))?;
    }
    Ok(match answer.verdict {
        _ if !args.exit_code => ExitStatus::Done,
        ExplanationVerdict::Adequate | ExplanationVerdict::Absorbed => ExitStatus::Done,
        ExplanationVerdict::Inconclusive => ExitStatus::Open,
        _ => ExitStatus::Found,
    })
}

/// The machine that recordings are compared with: a unit, or a model.
fn compared_with(args: &ExplainArgs) -> Result<learnt::Compared> {
    let Some(path) = &args.unit else {
        return Ok(learnt::Compared { model: read_machine(&args.model)?, learnt: None });
    };
    let LearntMachine { diagnoser, unit, model } =
        super::unit::learnt_machine(path, args.bundle.as_ref())?;
    let learnt = Some((diagnoser, Arc::new(unit)));
    Ok(learnt::Compared { model: MachineModel::Actuator(model), learnt })
}

/// The answer by the machine's own models, whose error is not known.
fn of_machine(
    records: &Records,
    args: &ExplainArgs,
    model: &MachineModel,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<Explained> {
    let recordings = match told_recordings(records, &args.records, model, global, streams)? {
        Ok(recordings) => recordings,
        Err(Missing::Signal(reason)) => return Ok(Explained::inconclusive(reason)),
        Err(Missing::Samples(gap)) => return Ok(Explained::unsound(vec![*gap])),
    };
    let options = Options {
        seed: global.seed,
        jobs: global.threads(),
        without: effects(&args.without)?,
        exact: exact(&args.exact, model)?,
        observation: args.fidelity.and_then(observation),
        signals: if args.records.correct { Signals::Corrected } else { Signals::Checked },
        ..Options::default()
    };
    let what = stage("explaining", &recordings);
    Ok(watched(streams, global.quiet, &what, || greybox::explain(model, &recordings, &options))?)
}

/// Effects by their symbols in the catalogue.
pub(super) fn effects(symbols: &[String]) -> Result<Vec<EffectId>> {
    let find = |symbol: &String| {
        EffectId::find(symbol).with_context(|| {
            let causes = causes();
            format!("`--without {symbol}`: no effect of the catalogue, expected one of {causes}")
        })
    };
    symbols.iter().map(find).collect()
}

/// Keys of exact numbers; `all` are those for which the model file states no tolerance.
pub(super) fn exact(keys: &[String], model: &MachineModel) -> Result<Vec<String>> {
    let numbers = model.kind().numbers();
    let mut exact = Vec::new();
    for key in keys {
        if key == "all" {
            exact.extend(greybox::numbers_without_tolerance(model));
        } else if numbers.iter().any(|number| number.key == *key) {
            exact.push(key.clone());
        } else {
            let keys: Vec<&str> = numbers.iter().map(|number| number.key.as_str()).collect();
            bail!(
                "`--exact {key}`: no number of this machine, expected `all` or one of {}",
                keys.join(", ")
            );
        }
    }
    Ok(exact)
}

/// Describes in a line the step that the recordings go through.
pub(super) fn stage(what: &str, recordings: &Recordings) -> String {
    described(what, recordings.train.len(), recordings.holdout.len())
}

/// Describes in a line the step that so many recordings go through.
fn described(what: &str, train: usize, holdout: usize) -> String {
    let noun = if train == 1 { "recording" } else { "recordings" };
    let held = if holdout == 0 { String::new() } else { format!(", {holdout} held out") };
    format!("{what} {train} {noun}{held}")
}

/// Message for the form of a table.
pub(super) const NO_SUCH_FORM: &str = "no such form: `--output-format human|json|jsonl`";

/// An answer in the form asked for, of those that are no tables.
pub(super) fn in_form<T: Serialize>(
    form: OutputFormat,
    answer: &T,
    human: impl FnOnce(&T) -> String,
) -> Result<String> {
    Ok(match form {
        OutputFormat::Human => human(answer),
        OutputFormat::Json => serde_json::to_string_pretty(answer)? + "\n",
        OutputFormat::Jsonl => serde_json::to_string(answer)? + "\n",
        _ => bail!("{NO_SUCH_FORM}"),
    })
}

/// The recordings by their use; an error where one lacks what is compared.
pub(super) fn whole_recordings(
    args: &RecordArgs,
    model: &MachineModel,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<Recordings> {
    let found = told_recordings(&Records::read(args)?, args, model, global, streams)?;
    found.map_err(|missing| match missing {
        Missing::Signal(reason) => anyhow!("{reason}"),
        Missing::Samples(gap) => anyhow!("{}: {}", gap.code.word(), gap.sentence()),
    })
}

/// The recordings as [`recordings`] has them; what was done to them is told.
fn told_recordings(
    records: &Records,
    args: &RecordArgs,
    model: &MachineModel,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<Result<Recordings, Missing>> {
    let mut told = Vec::new();
    let found = recordings(records, args, model, &mut told)?;
    if !global.quiet {
        for line in told {
            streams.say(format_args!("{line}"));
        }
    }
    Ok(found)
}

/// Recordings as they were read, by their use.
struct Records {
    train: Vec<Recording>,
    holdout: Vec<Recording>,
    repeat: Vec<Recording>,
}

impl Records {
    fn read(args: &RecordArgs) -> Result<Self> {
        let map = args.map.column_map()?;
        let read = |paths: &[PathBuf]| -> Result<Vec<Recording>> {
            let one = |path: &PathBuf| {
                Recording::read(path, &map).with_context(|| path.display().to_string())
            };
            paths.iter().map(one).collect()
        };
        let (train, holdout) = (read(&args.train)?, read(&args.holdout)?);
        Ok(Self { train, holdout, repeat: read(&args.repeat)? })
    }
}

/// Lack of recordings for which there is no conclusion.
#[derive(Debug)]
enum Missing {
    /// A signal, in words.
    Signal(String),
    /// Samples.
    Samples(Box<SignalFind>),
}

impl Missing {
    /// Lack of a recording in words.
    fn signal(recording: &Recording, lack: &str) -> Self {
        Self::Signal(format!("{}: {lack}", recording.name))
    }
}

/// The recordings as a model is compared with them, or what they lack.
fn recordings(
    records: &Records,
    args: &RecordArgs,
    model: &MachineModel,
    told: &mut Vec<String>,
) -> Result<Result<Recordings, Missing>> {
    let given = match args.command.as_deref() {
        _ if args.inverse_dynamics => Some(GivenCommand::Motion),
        Some(text) => Some(compared::given_command(text, model)?),
        None => None,
    };
    let mut missing = None;
    let mut compared = |all: &[Recording]| -> Result<Vec<Record>> {
        let mut compared = Vec::new();
        for recording in all {
            let named = || recording.name.clone();
            match compared::compared(recording, model, given.as_ref(), told).with_context(named)? {
                Ok(record) => compared.push(record),
                Err(lack) => missing = missing.take().or(Some(lack)),
            }
        }
        Ok(compared)
    };
    let recordings = Recordings {
        train: compared(&records.train)?,
        holdout: compared(&records.holdout)?,
        repeat: compared(&records.repeat)?,
    };
    if let Some(reason) = missing {
        return Ok(Err(reason));
    }
    recordings.check()?;
    Ok(Ok(recordings))
}
