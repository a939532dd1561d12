//! The signal chain of recordings as JSON: what controller, motion and samples say of one another.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A lack of the recordings that controller, motion and samples show before any physics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SignalFinding {
    /// In a word.
    pub code: SignalCode,
    /// Equation that fails: `controller`, `balance`, `samples` or `motions`.
    pub equation: String,
    /// Recording that shows it.
    pub recording: String,
    /// Channel at fault, where it is one: `command`, `position` or `drive`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
    /// Size, in `unit`: seconds by which a channel is late, a factor, a level, a step.
    pub value: f64,
    /// Unit of the size: `s`, `1`, `a`, `v`, `rad` or `m`.
    pub unit: String,
    /// What is wrong, in words.
    pub told: String,
    /// True where `--correct` set it right.
    pub corrected: bool,
    /// True where `--correct` can set it right.
    pub correctable: bool,
}

/// Lack of recordings in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
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

/// Estimates of the signal chain for a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SignalCheck {
    /// The recording.
    pub recording: String,
    /// Share of the drive signal's energy that the controller's law leaves; where the controller is
    /// known.
    pub law_left_frac: Option<f64>,
    /// Recorded drive over that of the law.
    pub law_gain: Option<f64>,
    /// Recorded drive less that of the law, in `unit`.
    pub law_offset: Option<f64>,
    /// By how much the drive is late against command and position, s.
    pub drive_late_s: Option<f64>,
    /// Share of the drive signal's energy that the balance of torques leaves, with numbers of its own.
    pub balance_left_frac: Option<f64>,
    /// Inertia by the balance over that of the model file, where acceleration shows it.
    pub inertia_ratio: Option<f64>,
    /// Step of the drive signal's converter, where it shows one, in `unit`.
    pub drive_step: Option<f64>,
    /// Step of the position, where it shows one, rad or m.
    pub position_step: Option<f64>,
    /// Share of the samples at which the drive signal stands at an end of its range.
    pub saturated_frac: f64,
    /// Time in which inputs come in behind the controller, s.
    pub inputs_s: f64,
    /// Unit of the drive signal, `a` or `v`.
    pub unit: String,
}
