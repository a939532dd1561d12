//! The signal chain of recordings, judged before any physics: what controller, motor and sensors
//! say of one another has to hold before an effect may be named.
//!
//! | equation | what it tells |
//! | --- | --- |
//! | controller: `u = law(command, position)` | shift, sign and gain of each channel, inputs behind the controller, a drive switched off, a controller that the model file does not describe |
//! | balance of torques: `c·u = M·a + friction + load` | which channel it is, and a constant of the motor that is far off |
//! | samples of a channel | steps, a cut signal, gaps |
//! | motions beside one another | a hold-out that repeats what was fitted, or is of another machine |
//!
//! Symbols and limits: `docs/models/signal-chain.md`.

mod balance;
mod channels;
mod correction;
mod equations;
mod inputs;
mod law;
mod least_squares;
mod motions;
mod recorded;
mod view;

use ema_sim::model_file::MachineModel;

pub(crate) use correction::Correction;

use crate::{
    error::GreyboxError,
    explain::Options,
    machine::Machine,
    parallel,
    record::{Record, Recordings},
};
use recorded::Recorded;

/// Lack of a recording that the signal chain shows, in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum SignalCode {
    /// Samples are missing.
    Gap,
    /// A signal is cut at a level that the machine did not have.
    Saturated,
    /// The steps of a converter are too coarse.
    Quantised,
    /// A channel has the wrong sign.
    Sign,
    /// A channel is late, or early, against the others.
    Late,
    /// A channel is a multiple of what it should be.
    Gain,
    /// The controller is another than the model file's.
    Controller,
    /// The constant of the motor, or all inertia, is far off the model file's.
    Constant,
    /// The drive is switched off in part of a recording.
    Disabled,
    /// Inputs come in behind the controller.
    Disturbed,
    /// What is held out repeats what is fitted.
    SameMotion,
    /// What is held out is of another machine.
    OtherMachine,
}

impl SignalCode {
    /// The word as answers spell it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gap => "gap",
            Self::Saturated => "saturated",
            Self::Quantised => "quantised",
            Self::Sign => "sign",
            Self::Late => "late",
            Self::Gain => "gain",
            Self::Controller => "controller",
            Self::Constant => "constant",
            Self::Disabled => "disabled",
            Self::Disturbed => "disturbed",
            Self::SameMotion => "same-motion",
            Self::OtherMachine => "other-machine",
        }
    }
}

/// Equation that recorded signals do not fulfil.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SignalEquation {
    /// The drive signal is what the controller makes of command and position.
    Controller,
    /// The drive accelerates the machine and overcomes friction and load.
    Balance,
    /// Samples of one channel.
    Samples,
    /// Recordings beside one another.
    Motions,
}

impl SignalEquation {
    /// The word as answers spell it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Controller => "controller",
            Self::Balance => "balance",
            Self::Samples => "samples",
            Self::Motions => "motions",
        }
    }
}

/// Channel of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SignalChannel {
    /// The command.
    Command,
    /// The measured position.
    Position,
    /// The drive signal.
    Drive,
}

impl SignalChannel {
    /// The word as answers spell it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Command => "command",
            Self::Position => "position",
            Self::Drive => "drive",
        }
    }
}

/// A lack of a recording.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SignalFault {
    /// In a word.
    pub code: SignalCode,
    /// Equation that fails.
    pub equation: SignalEquation,
    /// Recording that shows it.
    pub record: String,
    /// Channel at fault, where it is one.
    pub channel: Option<SignalChannel>,
    /// Size, in `unit`.
    pub value: f64,
    /// Unit of the size: `s`, `1`, `a`, `v`, `rad` or `m`.
    pub unit: &'static str,
    /// What is wrong, as a sentence without a full stop.
    pub told: String,
    /// True where the recordings were corrected for it ([`Options::correct`](crate::Options)).
    pub corrected: bool,
    pub(crate) correction: Option<Correction>,
}

impl SignalFault {
    /// True where [`Options::correct`](crate::Options) can set it right.
    pub fn is_correctable(&self) -> bool {
        self.correction.is_some()
    }
}

/// Estimates of the signal chain of one recording.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SignalCheck {
    /// The recording.
    pub record: String,
    /// Share of the drive signal's energy that the controller's law leaves, with gain, offset and
    /// drift of its own; `None` where the controller is not known.
    pub law_left: Option<f64>,
    /// Recorded drive over that of the law.
    pub law_gain: Option<f64>,
    /// Recorded drive less that of the law, in the unit of the drive.
    pub law_offset: Option<f64>,
    /// By how much the drive is late against command and position, s.
    pub drive_late_s: Option<f64>,
    /// Share of the drive signal's energy that the balance of torques leaves, with numbers of its
    /// own; `None` where nothing moves.
    pub balance_left: Option<f64>,
    /// Inertia by the balance over that of the model file, where acceleration shows it.
    pub inertia_ratio: Option<f64>,
    /// Step of the drive signal's converter, where it shows one.
    pub drive_step: Option<f64>,
    /// Step of the position, where it shows one.
    pub position_step: Option<f64>,
    /// Share of the samples at which the drive signal stands at an end of its range.
    pub saturated_share: f64,
    /// Time in which inputs come in behind the controller, s.
    pub inputs_s: f64,
}

/// What the signal chain of recordings shows.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct SignalChain {
    /// Estimates for each recording: fitted, held out, repeated.
    pub checks: Vec<SignalCheck>,
    /// What is wrong, the first thing to set right first.
    pub faults: Vec<SignalFault>,
}

impl SignalChain {
    /// What is wrong and was not corrected, the first thing to set right.
    pub fn standing(&self) -> Option<&SignalFault> {
        self.faults.iter().find(|fault| !fault.corrected)
    }
}

/// Judges the signal chain of recordings of a machine, before any physics.
///
/// # Errors
///
/// [`GreyboxError`] for recordings that cannot be compared with the model at all.
pub fn check_signals(
    model: &MachineModel,
    recordings: &Recordings,
) -> Result<SignalChain, GreyboxError> {
    recordings.check()?;
    examine(&Machine::new(model), recordings, 1)
}

/// Judges recordings that were checked.
pub(crate) fn examine(
    machine: &Machine,
    recordings: &Recordings,
    jobs: usize,
) -> Result<SignalChain, GreyboxError> {
    let all: Vec<&Record> = recordings.all().collect();
    let of = |record: &&Record| Recorded::new(machine, record);
    let recorded: Vec<Recorded> =
        parallel::map(&all, jobs, of).into_iter().collect::<Result<_, _>>()?;
    let mut faults: Vec<SignalFault> =
        recorded.iter().flat_map(|one| one.faults.iter().cloned()).collect();
    let held_out = recordings.train.len()..recordings.train.len() + recordings.holdout.len();
    if faults.is_empty() {
        faults.extend(equations::other_machine(&recorded[..held_out.start], &recorded[held_out]));
    }
    faults.extend(same_motion(recordings));
    faults.sort_by_key(|fault| fault.code);
    Ok(SignalChain { checks: recorded.into_iter().map(|one| one.check).collect(), faults })
}

/// Recordings with what their signal chain shows set right where that is asked for, and what it
/// shows: what was set right first, what stands after it.
pub(crate) fn sound(
    machine: &Machine,
    recordings: Recordings,
    options: &Options,
) -> Result<(Recordings, SignalChain), GreyboxError> {
    let mut chain = examine(machine, &recordings, options.jobs)?;
    if !options.correct || chain.faults.is_empty() {
        return Ok((recordings, chain));
    }
    let recordings = correction::corrected(&recordings, &mut chain.faults);
    let after = examine(machine, &recordings, options.jobs)?;
    chain.faults.retain(|fault| fault.corrected);
    chain.faults.extend(after.faults);
    Ok((recordings, SignalChain { checks: after.checks, ..chain }))
}

/// The lack of recordings all of whose hold-outs repeat what is fitted.
fn same_motion(recordings: &Recordings) -> Option<SignalFault> {
    let twin =
        |record: &Record| recordings.train.iter().find(|fitted| motions::repeats(record, fitted));
    let first = recordings.holdout.first()?;
    let fitted = twin(first)?;
    if !recordings.holdout.iter().all(|record| twin(record).is_some()) {
        return None;
    }
    Some(SignalFault {
        code: SignalCode::SameMotion,
        equation: SignalEquation::Motions,
        record: first.name.clone(),
        channel: Some(SignalChannel::Command),
        value: 0.0,
        unit: "1",
        told: format!(
            "{} repeats the command of {}: what is held out has to be of another command (a \
             repetition is for `--repeat`)",
            first.name, fitted.name
        ),
        corrected: false,
        correction: None,
    })
}
