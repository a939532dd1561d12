//! Decisions about a machine, by what a recording says of its damage.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{FaultId, words};

/// Decision about a machine: how urgent it is, and the next step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Action {
    /// How urgent it is: that of the worst fault.
    pub severity: Severity,
    /// The worst fault; left out where the answer is not to be believed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<FaultId>,
    /// Probability that the worst fault is above its levels; left out with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub probability_above: Option<Limits>,
    /// Why it is so, in words: size of the worst fault, and how sure it is above its level.
    pub reason: String,
    /// The next step, in words.
    pub next: String,
    /// Each fault that is determined, in the order k1 to k6.
    pub faults: Vec<FaultAction>,
}

/// One fault as a decision sees it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaultAction {
    /// Which fault.
    pub id: FaultId,
    /// How urgent it is.
    pub severity: Severity,
    /// Median of its size, in [`unit`](Self::unit): of play all that there is (with references as a
    /// multiple of that as new), of the other faults what has come to the machine as built (with
    /// references, since they were taken).
    pub size: f64,
    /// Interval that holds the size with a probability of 95 %.
    pub interval_95: [f64; 2],
    /// Unit of the size and of the levels, in words.
    pub unit: String,
    /// Sizes from which it is to be watched, and to be acted on.
    pub levels: Limits,
    /// Probability that the size is above each.
    pub probability_above: Limits,
    /// Probability before the recording was taken: assumed of machines in service.
    pub prior_above: Limits,
}

/// A number for watching and one for acting.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Limits {
    /// For watching.
    pub watch: f64,
    /// For acting.
    pub act: f64,
}

/// Urgency of an action.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Severity {
    /// Below its level for watching with a probability of 0.9.
    Nothing,
    /// The recording does not decide it.
    Undecided,
    /// Above its level for watching with a probability of 0.9.
    Watch,
    /// Above its level for acting with a probability of 0.9.
    Act,
}

words! {
    Severity { Nothing "nothing", Undecided "undecided", Watch "watch", Act "act" }
}

/// Levels of k1 to k6 from which damage is watched and acted on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActionLevels {
    /// From which it is watched.
    pub watch: [f64; 6],
    /// From which it is acted on.
    pub act: [f64; 6],
    /// Play of the machine's model file, rad: where it is known, sizes of play are in mrad.
    pub nominal_backlash_rad: Option<f64>,
}

impl Default for ActionLevels {
    /// Friction 20 and 40 % above nominal, play 3 and 10 times nominal, 2 and 5 % of the turns of a
    /// phase, 5 and 15 % of the air gap.
    fn default() -> Self {
        let [watch_play, act_play] = [2.0 / 99.0, 9.0 / 99.0];
        Self {
            watch: [0.1, watch_play, 0.02, 0.02, 0.02, 0.05],
            act: [0.2, act_play, 0.05, 0.05, 0.05, 0.15],
            nominal_backlash_rad: None,
        }
    }
}
