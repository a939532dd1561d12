//! Finds of the signal chain as JSON: what controller, motion and samples of recordings say of one
//! another.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A lack of recordings that controller, motion and samples show before any physics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SignalFinding {
    /// Lack in a word.
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
    /// Standard deviation of the size, where it was estimated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std: Option<f64>,
    /// Unit of the size: `s`, `1`, `a`, `v`, `rad` or `m`.
    pub unit: String,
    /// Lack in words.
    pub told: String,
    /// Remedy in words.
    pub remedy: String,
    /// True where `--correct` set it right.
    pub corrected: bool,
    /// True where `--correct` can set it right, or did.
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
