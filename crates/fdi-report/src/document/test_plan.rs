//! A test that is planned for some faults, as JSON.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::FaultId;

/// The answer of `propose --faults`: a test and what is expected of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TestPlan {
    /// Version of this form.
    pub schema_version: u32,
    /// Name and version of the program, `fdi 0.1.0`.
    pub tool: String,
    /// Seed of the machines that the model's error is guessed from.
    pub seed: u64,
    /// When it was made, RFC 3339; only with `--stamp`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stamp: Option<String>,
    /// Name that the model gives itself.
    pub model: String,
    /// Test that the plan is compared with.
    pub compared_with: String,
    /// Load on the surface in that test, N·m; left out where the machine cannot run it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compared_load_n_m: Option<f64>,
    /// Recordings of the unit as new that the expectations take, of the test that they are of.
    pub references: usize,
    /// Standard deviation of the thermometer's reading that `with_reading` takes, K.
    pub reading_std_k: f64,
    /// True where the test is planned for such a reading.
    pub is_read: bool,
    /// True where it is planned for a recording of the motor's voltage.
    pub has_voltage: bool,
    /// Load on the surface in the planned test, N·m.
    pub load_n_m: f64,
    /// Longest that the test may last, s.
    pub within_s: f64,
    /// Limits that no motion goes beyond.
    pub limits: MotionLimits,
    /// Length of the planned test, s.
    pub duration_s: f64,
    /// Motions of the planned test in their order.
    pub motions: Vec<PlannedMotion>,
    /// Motions within the limits that they were chosen from.
    pub candidates: usize,
    /// Expectations of each fault that a test of this model tells.
    pub faults: Vec<PlannedFault>,
    /// Wall time, s; left out with `--stable`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elapsed_s: Option<f64>,
}

/// Limits of the motions of a test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MotionLimits {
    /// Travel of the surface to either side, rad.
    pub travel_rad: f64,
    /// Speed of the rotor, rad/s.
    pub speed_rad_per_s: f64,
    /// Current, A.
    pub current_a: f64,
}

/// A motion of a planned test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlannedMotion {
    /// When it begins, s.
    pub begins_s: f64,
    /// Length with the rest behind it, s.
    pub duration_s: f64,
    /// Course of the motion in words.
    pub description: String,
    /// Largest speed of the rotor that it asks for, rad/s.
    pub rotor_rad_per_s: f64,
}

/// Expectations of a fault.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlannedFault {
    /// The fault.
    pub id: FaultId,
    /// True where the test was planned for it.
    pub is_asked: bool,
    /// By the test that the plan is compared with; left out where it does not tell the fault.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub before: Option<ExpectedStd>,
    /// By the planned test; left out where no motion within the limits tells the fault.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub planned: Option<ExpectedStd>,
    /// By a test that shows all that a current can, and a voltage: the rest is left by tolerances and by
    /// what differs from day to day; left out where these leave everything open.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least: Option<ExpectedStd>,
    /// Number that the rest is shared with, without a thermometer; left out where it is no single one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shared_with: Option<SharedWith>,
}

/// Standard deviation of a fault that a recording is expected to leave, beside the references.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ExpectedStd {
    /// With the current alone.
    pub alone: f64,
    /// With a reading of the winding's temperature.
    pub with_reading: f64,
    /// With the motor's voltage.
    pub with_voltage: f64,
}

/// A number of the machine that a fault cannot be told from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SharedWith {
    /// Key of the number in `[tolerance]`.
    pub key: String,
    /// Least standard deviation of the fault, were that number known.
    pub std: f64,
}
