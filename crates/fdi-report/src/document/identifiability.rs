//! How well a recording can tell each fault, as JSON.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{FaultId, SharedWith};

/// How well a fault can be told from the recording and those of its unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Identifiability {
    /// The fault.
    pub id: FaultId,
    /// Standard deviation of its level; of the eccentricity the root mean square over its two
    /// coordinates.
    pub std: f64,
    /// Standard deviation that would be left if the recording had no noise and its model no error:
    /// tolerances, and what differs from day to day.
    pub least_std: f64,
    /// Number of the machine that the fault is shared with most; left out where knowing none would
    /// tell much more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shared_with: Option<SharedWith>,
    /// The further recording or reading that would tell most more; left out where none would tell
    /// much.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub would_help: Option<WouldHelp>,
}

/// A further recording or reading with what it would leave open.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WouldHelp {
    /// The recording or reading.
    pub what: Further,
    /// Standard deviation of the fault with it.
    pub std: f64,
}

/// A further recording or reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Further {
    /// Another recording of the test, on the same day.
    Recording,
    /// Another recording of the test, on another day, in one state of health.
    Day,
    /// Four recordings of the machine as new, of four days, where there are none.
    References,
    /// A reading of the winding's temperature.
    Temperature,
    /// The motor's voltage beside the current.
    Voltage,
}

impl Further {
    /// The recording or reading in words.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Recording => "the same test again",
            Self::Day => "the same test on another day",
            Self::References => "recordings of it as new",
            Self::Temperature => "the winding's temperature",
            Self::Voltage => "the motor's voltage",
        }
    }
}
