//! Explanation with the low-fidelity model and its learnt error.

use std::sync::Arc;

use anyhow::{Result, bail};
use fdi_core::{
    Cause, CauseRecording, CauseTried, CauseVerdict, Causes, Diagnoser, ExplainError,
    ExplainOptions, LearntUnit, Recording,
    ema_sim::{
        Effect, Geometry,
        model_file::{MachineModel, Model},
    },
    report::{Fault, FaultId, Prediction},
};
use greybox::{
    Explained, FaultChange, FaultLevel, Finding, Hypothesis, NoiseFloor, NoiseSource,
    NumberInterval, RecordChange, RecordFit, Refit, SmallestNamed, Use, Verdict,
};

use super::{Missing, Records, described, effects};
use crate::{
    GlobalArgs, Streams, args::ExplainArgs, diagnoser::diagnoser_of_model, progress::watched,
};

/// Why there is no answer about machines with a lot of damage.
const BEYOND_LEARNT: &str = "damage is beyond that of the machines on which the error of the \
                             low-fidelity model is learnt; `--fidelity high` predicts with the \
                             high-fidelity model";

/// Machine that recordings are compared with.
pub(super) struct Compared {
    pub(super) model: MachineModel,
    /// The unit, where it was learnt, with the diagnosis of the bundle that it was learnt with.
    pub(super) learnt: Option<(Diagnoser, Arc<LearntUnit>)>,
}

/// The answer with the learnt error, or why there is none.
pub(super) fn explained(
    compared: &Compared,
    records: &Records,
    args: &ExplainArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<Result<Explained, String>> {
    if args.fidelity.is_some_and(|asked| asked != Prediction::Learnt) {
        return Ok(Err("another model is asked for".to_owned()));
    }
    let is_pinned = args.fidelity == Some(Prediction::Learnt);
    let split = Split::of(records);
    let outcome = match &compared.model {
        _ if args.records.inverse_dynamics => {
            Err("the motion is taken as it was measured".to_owned())
        }
        MachineModel::ServoAxis(_) => {
            Err("the error of a servo axis's model is not learnt".to_owned())
        }
        _ if split.holdout.is_empty() => {
            Err("one recording alone cannot be fitted and judged on".to_owned())
        }
        // a command that is known, each recording once: as any other model asks it
        MachineModel::Actuator(model) => {
            // these serve the look at the signals alone, at whatever rate
            let mut told = Vec::new();
            match super::recordings(records, &args.records, &compared.model, &mut told)? {
                Ok(recordings) => {
                    let jobs = global.threads();
                    let finds = greybox::check_signals(&compared.model, &recordings, jobs)?;
                    if !finds.is_empty() {
                        return Ok(Ok(Explained::unsound(finds)));
                    }
                    of_actuator(compared, model, &split, args, global, streams)?
                }
                Err(Missing::Signal(reason)) => Err(reason),
                Err(Missing::Samples(gap)) => return Ok(Ok(Explained::unsound(vec![*gap]))),
            }
        }
    };
    match outcome {
        Ok(causes) if causes.verdict == CauseVerdict::BeyondLearnt && !is_pinned => {
            Ok(Err(BEYOND_LEARNT.to_owned()))
        }
        Ok(causes) => Ok(Ok(from_causes(&causes, split.train.len()))),
        Err(reason) if is_pinned => bail!("`--fidelity learnt`: {reason}"),
        Err(reason) => Ok(Err(reason)),
    }
}

/// Recordings by their use; without any held out the last of several is.
struct Split<'a> {
    train: &'a [Recording],
    repeat: &'a [Recording],
    holdout: &'a [Recording],
}

impl<'a> Split<'a> {
    fn of(records: &'a Records) -> Self {
        let (train, holdout) = match &records.train[..] {
            [train @ .., last] if records.holdout.is_empty() && !train.is_empty() => {
                (train, std::slice::from_ref(last))
            }
            train => (train, &records.holdout[..]),
        };
        Self { train, repeat: &records.repeat, holdout }
    }
}

fn of_actuator(
    compared: &Compared,
    model: &Model,
    split: &Split<'_>,
    args: &ExplainArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<Result<Causes, String>> {
    let of_type;
    let (diagnoser, unit) = if let Some((diagnoser, unit)) = &compared.learnt {
        (diagnoser, Some(Arc::clone(unit)))
    } else {
        let (command, bundle) = (args.records.command.as_deref(), args.bundle.as_ref());
        let Some(found) = diagnoser_of_model(model, command, &split.train[0], bundle)? else {
            let why = "no bundle of this model and test has learnt machines within tolerances";
            return Ok(Err(why.to_owned()));
        };
        of_type = found;
        (&of_type, None)
    };
    let options = ExplainOptions { unit, without: effects(&args.without)?, jobs: global.threads() };
    let fitted = [split.train, split.repeat].concat();
    let what = described("explaining", split.train.len(), split.holdout.len());
    let explained = watched(streams, global.quiet, &what, || {
        diagnoser.explain(&fitted, split.holdout, &options)
    });
    match explained {
        Err(error @ (ExplainError::Nothing | ExplainError::OtherBundle(_))) => Err(error.into()),
        other => Ok(other.map_err(|error| error.to_string())),
    }
}

/// The answer in the form that all explanations have. Of the recordings that were fitted those after
/// the first few are repetitions.
fn from_causes(causes: &Causes, trained: usize) -> Explained {
    let mut explained = Explained::inconclusive(BEYOND_LEARNT.to_owned());
    explained.verdict = match causes.verdict {
        CauseVerdict::Adequate => Verdict::Adequate,
        CauseVerdict::Named => Verdict::Named,
        CauseVerdict::NamedWithRemainder => Verdict::NamedWithRemainder,
        CauseVerdict::OneOf => Verdict::OneOf,
        CauseVerdict::Unknown => Verdict::Unknown,
        _ => return explained,
    };
    explained.reason = None;
    explained.effects = causes.found.iter().map(finding).collect();
    explained.alternatives = causes.as_good.iter().map(finding).collect();
    explained.absorbed.clone_from(&causes.absorbed);
    explained.noise_floor = Some(NoiseFloor { rms: causes.floor_a, source: NoiseSource::Learnt });
    let held: Vec<&CauseRecording> = causes.recordings.iter().filter(|r| r.is_held_out).collect();
    if !held.is_empty() {
        let mean = |at: usize| held.iter().map(|r| r.rms_a[at] * r.rms_a[at]).sum::<f64>();
        explained.holdout_rms = Some([0, 1].map(|at| (mean(at) / held.len() as f64).sqrt()));
    }
    let [before, after] = &causes.faults;
    explained.faults = before.iter().zip(after).filter_map(fault).collect();
    let record = |(place, one): (usize, &CauseRecording)| {
        let role = match (one.is_held_out, place < trained) {
            (true, _) => Use::Holdout,
            (false, true) => Use::Train,
            (false, false) => Use::Repeat,
        };
        let fit = |at: usize| RecordFit {
            record: one.name.clone(),
            rms: one.rms_a[at],
            fit_percent: one.fit_percent[at],
            whiteness_p: one.whiteness_p[at],
        };
        RecordChange { role, before: fit(0), after: fit(1) }
    };
    explained.log = causes.tried.iter().filter_map(tried).collect();
    explained.records = causes.recordings.iter().enumerate().map(record).collect();
    explained.hypotheses = causes
        .tried
        .iter()
        .map(|one| Hypothesis {
            id: one.id,
            log_p: one.log_p,
            visible_share: one.open_share.max(0.0).sqrt(),
            refit: one.fitted.map(|(gain, holdout)| Refit {
                holdout_gain_nats: holdout.unwrap_or(0.0),
                holdout_gain_se: standard_error(holdout),
                evidence_nats: 0.5 * gain,
                on_bound: false,
            }),
        })
        .collect();
    let smallest = causes.tried.iter().filter(|one| one.smallest_seen.is_finite());
    explained.smallest_named_90 = smallest
        .map(|one| SmallestNamed {
            effect: Effect::new(one.id, Geometry::Rotary),
            key: one.smallest_key.to_owned(),
            size: one.smallest_seen,
        })
        .collect();
    explained
}

/// A line of the log: an effect that was fitted beside damage and tolerances alone.
fn tried(one: &CauseTried) -> Option<String> {
    let (gain, holdout) = one.fitted?;
    let held = holdout.map_or(String::new(), |gain| format!(", {gain:.1} nats held out"));
    Some(format!("{} fitted: {:.1} nats{held}", one.id.info().label(), 0.5 * gain))
}

fn finding(cause: &Cause) -> Finding {
    let interval = |(key, interval_95): &(&str, [f64; 2])| NumberInterval {
        key: (*key).to_owned(),
        interval_95: *interval_95,
    };
    Finding {
        effect: cause.effect.clone(),
        interval_95: cause.intervals_95.iter().map(interval).collect(),
        p_familywise: cause.p_familywise,
        holdout_gain_nats: cause.holdout_gain_nats.unwrap_or(0.0),
        holdout_gain_se: standard_error(cause.holdout_gain_nats),
        evidence_nats: 0.5 * cause.gain,
        instead_of: cause.instead_of,
    }
}

/// Standard error of a gain: for a normal signal the variance of the logarithm of a likelihood ratio
/// is twice its mean.
fn standard_error(gain_nats: Option<f64>) -> f64 {
    gain_nats.map_or(0.0, |gain| (2.0 * gain.abs()).sqrt())
}

fn fault((before, after): (&Fault, &Fault)) -> Option<FaultChange> {
    let level = |fault: &Fault| {
        let (value, std) = (fault.value?, fault.std?);
        Some(FaultLevel { value, std, interval_95: fault.interval_95? })
    };
    // a direction is no level
    if before.id == FaultId::K7 {
        return None;
    }
    Some(FaultChange {
        key: before.id.to_string(),
        before: level(before)?,
        after: level(after)?,
        ambiguous_with: Vec::new(),
    })
}
