//! A find of the signal chain: which channel fails which equation, by how much, and the remedy.

use super::correction::Correction;

/// Lack of a recording that its signal chain shows, in a word; the first to be set right first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum SignalCode {
    /// Samples are missing.
    Gap,
    /// A signal is cut at a level that the machine did not have.
    Saturated,
    /// The steps of a converter are too coarse, and no noise smooths them.
    Quantised,
    /// A channel has the wrong sign.
    Sign,
    /// A channel is late, or early, against the others.
    Late,
    /// A channel is a multiple of what it should be.
    Gain,
    /// The controller is another than the model file's.
    Controller,
    /// The motor's constant, or the inertia, is far off the model file's.
    Constant,
    /// Inputs come in behind the controller.
    Disturbed,
    /// A recording held out is of another machine.
    OtherMachine,
    /// Recordings held out repeat the motion of those fitted.
    SameMotion,
}

impl SignalCode {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Gap,
        Self::Saturated,
        Self::Quantised,
        Self::Sign,
        Self::Late,
        Self::Gain,
        Self::Controller,
        Self::Constant,
        Self::Disturbed,
        Self::OtherMachine,
        Self::SameMotion,
    ];

    /// Word that answers have for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Gap => "gap",
            Self::Saturated => "saturated",
            Self::Quantised => "quantised",
            Self::Sign => "sign",
            Self::Late => "late",
            Self::Gain => "gain",
            Self::Controller => "controller",
            Self::Constant => "constant",
            Self::Disturbed => "disturbed",
            Self::OtherMachine => "other-machine",
            Self::SameMotion => "same-motion",
        }
    }
}

/// Equation that sound recordings fulfil whatever the plant does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SignalEquation {
    /// The drive signal is what the controller makes of command and position.
    Controller,
    /// Drive signal and motion are those of one inertia with friction.
    Balance,
    /// Samples of a channel are evenly spaced, uncut and finely resolved.
    Samples,
    /// Recordings held out move otherwise than those fitted.
    Motions,
}

impl SignalEquation {
    /// Word that answers have for it.
    pub fn word(self) -> &'static str {
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
    /// Command that was given.
    Command,
    /// Measured position.
    Position,
    /// Current or voltage that drives the machine.
    Drive,
}

impl SignalChannel {
    /// Word that answers have for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Command => "command",
            Self::Position => "position",
            Self::Drive => "drive",
        }
    }
}

/// A number with its standard deviation and unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignalSize {
    /// Number found.
    pub value: f64,
    /// Standard deviation, from the scatter over blocks of 0.5 s; `None` for what is counted.
    pub std: Option<f64>,
    /// Unit: `s`, `1`, `a`, `v`, `rad` or `m`.
    pub unit: &'static str,
}

/// A find of the signal chain.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SignalFind {
    /// Lack in a word.
    pub code: SignalCode,
    /// Equation that fails.
    pub equation: SignalEquation,
    /// Recording that shows it.
    pub record: String,
    /// Channel at fault, where it is one.
    pub channel: Option<SignalChannel>,
    /// Size of the lack.
    pub size: SignalSize,
    /// Lack in words, a clause without a full stop.
    pub told: String,
    /// Remedy in words, a clause without a full stop.
    pub remedy: String,
    /// True where the recordings were corrected for it.
    pub corrected: bool,
    pub(crate) correction: Option<Correction>,
}

impl SignalFind {
    /// Tells whether [`Signals::Corrected`](super::Signals::Corrected) sets it right.
    pub fn is_correctable(&self) -> bool {
        self.correction.is_some()
    }

    /// Samples of a recording that are missing by its time stamps: the longest step, s, over the
    /// usual one.
    pub fn gap_of_stamps(record: &str, at_s: f64, step_s: f64, usual_s: f64) -> Self {
        let missing_ms = 1e3 * (step_s - usual_s);
        Self {
            code: SignalCode::Gap,
            equation: SignalEquation::Samples,
            record: record.to_owned(),
            channel: None,
            size: SignalSize { value: step_s - usual_s, std: None, unit: "s" },
            told: format!("{record}: {missing_ms:.1} ms are missing after {at_s:.4} s"),
            remedy: "record it again, or cut it there and give one part".to_owned(),
            corrected: false,
            correction: None,
        }
    }

    /// Lack and remedy, a sentence without a full stop.
    pub fn sentence(&self) -> String {
        format!("{}; {}", self.told, self.remedy)
    }
}
