//! Recordings that a unit was learnt from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Content of the file of a unit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct UnitSummary {
    /// The actuator, where a recording states it.
    pub actuator_id: Option<String>,
    /// Name of the model file.
    pub model: String,
    /// Name of the test's command.
    pub command: String,
    /// The recordings in the order in which they were learnt.
    pub recordings: Vec<LearntFrom>,
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
