//! A machine that was set up, or why not.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{FaultId, words};

/// The answer of `setup`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SetupSummary {
    /// Version of this form.
    pub schema_version: u32,
    /// Name and version of the program, `fdi 0.1.0`.
    pub tool: String,
    /// Seed of the run.
    pub seed: u64,
    /// Name of the model file.
    pub model: String,
    /// Name of the test's command.
    pub command: String,
    /// The recordings as new.
    pub recordings: Vec<String>,
    /// True where later recordings can be diagnosed with what was written.
    pub accepted: bool,
    /// Why the machine cannot be set up; left out where it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<SetupRefusal>,
    /// Choices that were made, with their grounds.
    pub choices: Vec<SetupChoice>,
    /// Things to look at before the setup is relied on.
    pub warnings: Vec<String>,
    /// Simulated tests of this unit; left out where it was refused before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acceptance: Option<Acceptance>,
}

/// A choice of a setup.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct SetupChoice {
    /// Subject of the choice.
    pub what: String,
    /// Result.
    pub choice: String,
    /// Grounds.
    pub reason: String,
    /// Option that makes the choice in place of the program, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pin: Option<String>,
}

/// Why a machine cannot be set up.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct SetupRefusal {
    /// Reason in a word.
    pub code: SetupRefusalCode,
    /// Recording that shows it, where it is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recording: Option<String>,
    /// Reason in a sentence, with what to do.
    pub reason: String,
}

/// Reason why a machine cannot be set up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum SetupRefusalCode {
    /// No recording was given.
    NoRecording,
    /// A recording does not fit the test.
    NotReadable,
    /// The machine never reverses in the test.
    NoReversal,
    /// The recording is shorter than the test, or the test moves the machine too little.
    TooShort,
    /// A phase was cut at a level.
    Saturated,
    /// The rotor travels by another distance than that of the model.
    WrongGear,
    /// No machine within the tolerances explains a recording.
    OtherMachine,
    /// The recordings as new do not agree with one another.
    Disagreement,
    /// In simulated tests of this unit damage is not found.
    Noise,
    /// In simulated tests of this unit false alarms are too many, or intervals do not hold the truth.
    NotCalibrated,
}

words! {
    SetupRefusalCode {
        NoRecording "no-recording",
        NotReadable "not-readable",
        NoReversal "no-reversal",
        TooShort "too-short",
        Saturated "saturated",
        WrongGear "wrong-gear",
        OtherMachine "other-machine",
        Disagreement "disagreement",
        Noise "noise",
        NotCalibrated "not-calibrated",
    }
}

/// Simulated tests of a unit that was learnt, in high fidelity, each of a day of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Acceptance {
    /// Noise on each phase sample of the tests, that of the recordings, rms, A.
    pub noise_a: f64,
    /// Tests without damage.
    pub sound: usize,
    /// Tests without damage that are called `healthy`.
    pub healthy: usize,
    /// Tests without damage that are called `faulty`: false alarms.
    pub false_alarms: usize,
    /// Tests with and without damage that no answer is given to, or an inadequate one.
    pub unanswered: usize,
    /// 95 % intervals of levels that are determined.
    pub intervals: usize,
    /// Intervals that hold the truth.
    pub held: usize,
    /// Damage of each kind at the level from which it is to be watched.
    pub faults: Vec<FaultTests>,
}

/// Simulated tests of a unit with one fault.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaultTests {
    /// Fault.
    pub id: FaultId,
    /// Level of the tests, that from which it is to be watched.
    pub level: f64,
    /// Tests.
    pub tests: usize,
    /// Tests in which the machine is called `faulty`.
    pub found: usize,
    /// Median standard deviation of the level in tests without damage; `null` where it is not
    /// determined.
    pub std: Option<f64>,
}
