//! The signal chain of recordings, judged before any physics: equations that hold whatever the
//! plant does.
//!
//! | equation | finds |
//! | --- | --- |
//! | controller: `u = law(command, position)` | shift, sign and gain of each channel, another controller, inputs behind it |
//! | balance: `c·u = M·a + friction + load` | the same of the drive where the controller is not known; a motor's constant far off |
//! | samples of a channel | gaps, coarse steps, a signal that was cut |
//! | motions beside one another | a hold-out that repeats the motion fitted, or is of another machine |
//!
//! A find is told where a number is beyond a limit, but for a chance: the limit is what effects of
//! the catalogue or the spacing of samples do, the chance is [`FALSE_ALARM`] over all questions. The
//! limits and their reasons: `docs/models/signal-chain.md`.

mod balance;
mod clipping;
mod corrected;
mod correction;
mod find;
mod inputs;
mod judged;
mod law;
mod motions;
mod regression;
mod samples;
mod shift;
mod view;

use ema_sim::model_file::MachineModel;

pub(crate) use clipping::first_clipped;
pub use find::{SignalChannel, SignalCode, SignalEquation, SignalFind, SignalSize};

use crate::{
    error::GreyboxError,
    machine::Machine,
    parallel,
    record::{Record, Recordings},
};
use judged::{EFFECTS_UP_TO, Judged, digits};
use regression::Estimate;

/// Chance that sound recordings are called unsound, over all questions asked of a set.
pub const FALSE_ALARM: f64 = 1e-3;
/// Questions asked of a recording: gain and sign of the drive, shift and sign of two channels and
/// the shift of a third, scale of the position, two gains, inertia and its sign, and another machine.
const QUESTIONS: f64 = 12.0;

/// Use that is made of the signal chain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Signals {
    /// Judged: a set that is not sound gets no conclusion.
    #[default]
    Checked,
    /// Judged, and what shifts, signs, factors and a load can set right is set right.
    Corrected,
    /// Not judged, but for signals that were cut.
    Trusted,
}

/// Finds of the signal chain of recordings of a machine, the first to be set right first; none of
/// sound ones.
///
/// # Errors
///
/// [`GreyboxError`] for recordings that cannot be compared with the model at all.
pub fn check_signals(
    model: &MachineModel,
    recordings: &Recordings,
    jobs: usize,
) -> Result<Vec<SignalFind>, GreyboxError> {
    recordings.check()?;
    examine(&Machine::new(model), recordings, jobs)
}

/// Recordings with all that can be set right set right, and the finds: those set right first, then
/// those that are left.
///
/// # Errors
///
/// [`GreyboxError`] for recordings that cannot be compared with the model at all.
pub fn correct_signals(
    model: &MachineModel,
    recordings: &Recordings,
    jobs: usize,
) -> Result<(Recordings, Vec<SignalFind>), GreyboxError> {
    recordings.check()?;
    sound(&Machine::new(model), recordings.clone(), Signals::Corrected, jobs)
}

/// Recordings as they are used, and the finds of their signal chain.
pub(crate) fn sound(
    machine: &Machine,
    mut recordings: Recordings,
    signals: Signals,
    jobs: usize,
) -> Result<(Recordings, Vec<SignalFind>), GreyboxError> {
    if signals == Signals::Trusted {
        let finds = first_clipped(machine, &recordings)?.into_iter().collect();
        return Ok((recordings, finds));
    }
    let mut finds = examine(machine, &recordings, jobs)?;
    let mut done = Vec::new();
    if signals == Signals::Corrected {
        // what one correction uncovers another may set right
        for _ in 0..MOST_CORRECTIONS {
            if !finds.iter().any(SignalFind::is_correctable) {
                break;
            }
            recordings = corrected::corrected(&recordings, &mut finds);
            done.extend(finds.into_iter().filter(|find| find.corrected));
            finds = examine(machine, &recordings, jobs)?;
        }
    }
    done.extend(finds);
    Ok((recordings, done))
}

/// Corrections one after another.
const MOST_CORRECTIONS: usize = 3;

/// First find that stands.
pub(crate) fn standing(finds: &[SignalFind]) -> Option<&SignalFind> {
    finds.iter().find(|find| !find.corrected)
}

/// Judges recordings that were checked.
fn examine(
    machine: &Machine,
    recordings: &Recordings,
    jobs: usize,
) -> Result<Vec<SignalFind>, GreyboxError> {
    let all: Vec<&Record> = recordings.all().collect();
    let chance = FALSE_ALARM / (QUESTIONS * all.len() as f64);
    let judge = |record: &&Record| -> Result<_, GreyboxError> {
        let judged = Judged::new(machine, record, chance)?;
        let finds = judged.finds()?;
        let is_moved = finds.iter().all(|find| find.equation == SignalEquation::Balance);
        let inertia = judged.inertia().filter(|_| is_moved);
        Ok((finds, Part { name: judged.record().name.clone(), inertia }))
    };
    let judged = parallel::map(&all, jobs, judge);
    let (finds, parts): (Vec<_>, Vec<_>) =
        judged.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
    let mut finds = finds.concat();
    finds.extend(first_clipped(machine, recordings)?);
    let (fitted, others) = parts.split_at(recordings.train.len());
    if let Some(other) = other_machine(fitted, &others[..recordings.holdout.len()], chance) {
        finds.retain(|find| find.record != other.record);
        finds.push(other);
    }
    finds.extend(same_motion(machine, recordings));
    finds.sort_by_key(|find| find.code);
    Ok(finds)
}

/// A recording with the inertia that its balance gives, over that of the model file.
struct Part {
    name: String,
    inertia: Option<Estimate>,
}

/// A recording held out that is by its inertia of another machine than those fitted.
fn other_machine(fitted: &[Part], held_out: &[Part], chance: f64) -> Option<SignalFind> {
    let surest = |a: &Estimate, b: &Estimate| (a.std / a.value).total_cmp(&(b.std / b.value));
    let known = fitted.iter().filter_map(|part| part.inertia).min_by(surest)?;
    let off = |part: &Part| {
        let ratio = part.inertia?.over(known);
        ratio.is_factor_beyond(EFFECTS_UP_TO, chance).then(|| (part.name.clone(), ratio))
    };
    let (record, ratio) = held_out.iter().find_map(off)?;
    let told = format!(
        "{record}: motion and drive ask for {} times the inertia of the recordings fitted (standard \
         deviation {}): it is of another machine",
        digits(ratio.value),
        digits(ratio.std)
    );
    Some(SignalFind {
        code: SignalCode::OtherMachine,
        equation: SignalEquation::Balance,
        record,
        channel: None,
        size: SignalSize { value: ratio.value, std: Some(ratio.std), unit: "1" },
        told,
        remedy: "hold out a recording of the machine that is fitted".to_owned(),
        corrected: false,
        correction: None,
    })
}

/// The lack of recordings all of whose hold-outs repeat the motion that is fitted.
fn same_motion(machine: &Machine, recordings: &Recordings) -> Option<SignalFind> {
    if !machine.is_axis() {
        return None;
    }
    let twin =
        |record: &Record| recordings.train.iter().find(|fitted| motions::repeats(record, fitted));
    let first = recordings.holdout.first()?;
    let fitted = twin(first)?;
    if !recordings.holdout.iter().all(|record| twin(record).is_some()) {
        return None;
    }
    let told = format!(
        "{} repeats the command of {}: an effect that fits nothing but that motion is not refuted by \
         it",
        first.name, fitted.name
    );
    Some(SignalFind {
        code: SignalCode::SameMotion,
        equation: SignalEquation::Motions,
        record: first.name.clone(),
        channel: Some(SignalChannel::Command),
        size: SignalSize { value: 1.0, std: None, unit: "1" },
        told,
        remedy: "hold out a recording of another command; a repetition is for `--repeat`"
            .to_owned(),
        corrected: false,
        correction: None,
    })
}
