//! Recordings that a unit was learnt from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Content of the file of a unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UnitSummary {
    /// The actuator, where a recording states it.
    pub actuator_id: Option<String>,
    /// Name of the model file.
    pub model: String,
    /// Name of the test's command.
    pub command: String,
    /// The recordings in the order in which they were learnt.
    pub recordings: Vec<LearntFrom>,
    /// Numbers of the unit as built, in the order of the model file; empty where no bundle at hand is
    /// the one that it was learnt with.
    pub numbers: Vec<UnitNumber>,
    /// Inertias and frictions over the torque constant, which is all that a current shows of either.
    pub ratios: Vec<UnitNumber>,
}

/// A number of a unit as built.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UnitNumber {
    /// Key of the model file's `[tolerance]`, with the phase where there are three; of a ratio both
    /// keys with ` / ` between them.
    pub key: String,
    /// In the model file.
    pub nominal: f64,
    /// By the recordings.
    pub value: f64,
    /// Standard deviation of the value.
    pub std: f64,
    /// 95 % interval of the value.
    pub interval_95: [f64; 2],
    /// Standard deviation by the model file's tolerances.
    pub prior_std: f64,
    /// True where the recordings leave half of the tolerances' spread at most.
    pub determined: bool,
}

/// A recording that a unit was learnt from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LearntFrom {
    /// Name of the file.
    pub name: String,
    /// Session, or else the day, that it is of.
    pub session: Option<String>,
    /// True where the unit was as new; false where it may have worn.
    pub as_new: bool,
}
