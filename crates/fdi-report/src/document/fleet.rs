//! How the actuators of a fleet change over time.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{FaultId, Verdict};

/// The trend of each actuator over its dated recordings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fleet {
    /// Version of this form.
    pub schema_version: u32,
    /// Name and version of the program, `fdi 0.1.0`.
    pub tool: String,
    /// Rise of a level since the reference recording from which on a change is a warning.
    pub warning_change: f64,
    /// Standard deviations beyond which a change is more than noise.
    pub significance: f64,
    /// One entry an actuator, in the order of their names.
    pub actuators: Vec<ActuatorTrend>,
    /// Diagnosed recordings that are in no trend.
    pub left_out: Vec<LeftOut>,
}

/// A diagnosed recording that is in no trend.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LeftOut {
    /// The path as it was given.
    pub recording: String,
    /// Why.
    pub reason: String,
}

/// How one actuator changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ActuatorTrend {
    /// Which actuator.
    pub actuator_id: String,
    /// The recording that changes are counted from: the earliest that the model explains, or the
    /// earliest where it explains none.
    pub reference: String,
    /// When that was taken, RFC 3339.
    pub reference_date: String,
    /// The gravest change in the latest recording that the model explains.
    pub change: Change,
    /// The recordings in the order of their dates.
    pub points: Vec<TrendPoint>,
    /// Straight lines through the levels, for faults determined at two dates or more.
    pub slopes: Vec<Slope>,
}

/// One recording of an actuator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrendPoint {
    /// The path as it was given.
    pub recording: String,
    /// When it was taken, RFC 3339.
    pub date: String,
    /// Days since the reference recording.
    pub days: f64,
    /// The answer in a word.
    pub verdict: Verdict,
    /// k1 to k6 as far as they are determined.
    pub faults: Vec<FaultChange>,
}

impl TrendPoint {
    /// True where the levels are to be believed, and were compared with those of the reference.
    pub fn is_judged(&self) -> bool {
        self.faults.iter().any(|fault| fault.change.is_some())
    }
}

/// A level and how far it is from the reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaultChange {
    /// Which fault.
    pub id: FaultId,
    /// The level.
    pub value: f64,
    /// Standard deviation of the level.
    pub std: f64,
    /// The level less that of the reference; left out where the reference does not determine it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub difference: Option<f64>,
    /// Standard deviation of that difference.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub difference_std: Option<f64>,
    /// Judgement of the change; left out with the difference, and where the model does not explain
    /// the recording.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub change: Option<Change>,
}

/// Judgement of a change.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Change {
    /// No more than noise.
    Steady,
    /// More than noise, and below the warning threshold or downwards.
    Changed,
    /// More than noise, and upwards by the warning threshold or more.
    Warning,
}

impl Change {
    /// The word as JSON has it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Steady => "steady",
            Self::Changed => "changed",
            Self::Warning => "warning",
        }
    }
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.word())
    }
}

/// A straight line through the levels of one fault, weighted by their standard deviations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Slope {
    /// Which fault.
    pub id: FaultId,
    /// Level gained in a day.
    pub per_day: f64,
    /// Standard deviation of the slope, if those of the levels are right and the level goes
    /// straight.
    pub per_day_std: f64,
}
