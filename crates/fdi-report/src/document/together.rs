//! Recordings that one answer is of.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{FaultId, Verdict};
use crate::{plus_minus, sentence::to_digits_of};

/// A recording among several that one answer is of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PooledRecording {
    /// The path as it was given.
    pub recording: String,
    /// Session of the recording, else its day, where it states either.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub session: Option<String>,
    /// When the recording was taken, RFC 3339, where it says so or its name does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub date: Option<String>,
    /// Verdict on the recording by itself.
    pub verdict: Verdict,
    /// Why the answer does not rest on it; left out where it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_out: Option<String>,
    /// Levels that it determines by itself, k1 to k6.
    pub levels: Vec<PooledLevel>,
}

/// A level as one of several recordings shows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PooledLevel {
    /// Fault.
    pub id: FaultId,
    /// Level by the recording alone.
    pub value: f64,
    /// Standard deviation by the recording alone.
    pub std: f64,
    /// Standard deviation of the answer without the recording; left out where the answer does not
    /// rest on it, or on nothing else.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std_without: Option<f64>,
}

impl PooledRecording {
    /// A level that the recording determines.
    pub fn level(&self, id: FaultId) -> Option<&PooledLevel> {
        self.levels.iter().find(|level| level.id == id)
    }
}

impl PooledLevel {
    /// Level and standard deviation, in brackets that of the answer without the recording:
    /// `0.021±0.001 (0.002)`.
    pub fn in_words(&self) -> String {
        let without = self.std_without.map(|std| format!(" ({})", to_digits_of(std, std)));
        plus_minus(self.value, self.std, "±") + &without.unwrap_or_default()
    }
}
