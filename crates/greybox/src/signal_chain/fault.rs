//! A lack of recordings, estimates, and both together as answers have them.

use super::correction::Correction;

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
    /// Hold-out that repeats what is fitted.
    SameMotion,
    /// Hold-out of another machine.
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
    /// Lack as a sentence without a full stop.
    pub told: String,
    /// True where the recordings were corrected for it (`Options::correct`).
    pub corrected: bool,
    pub(crate) correction: Option<Correction>,
}

impl SignalFault {
    /// True where `Options::correct` can set it right.
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

/// Signal chain of recordings.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct SignalChain {
    /// Estimates for each recording: fitted, held out, repeated.
    pub checks: Vec<SignalCheck>,
    /// Lacks, the first thing to set right first.
    pub faults: Vec<SignalFault>,
}

impl SignalChain {
    /// First lack that was not corrected, the first thing to set right.
    pub fn standing(&self) -> Option<&SignalFault> {
        self.faults.iter().find(|fault| !fault.corrected)
    }
}
