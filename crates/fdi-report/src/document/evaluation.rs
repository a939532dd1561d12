//! Results of the paper's experiments, as JSON.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::FaultId;

/// The result of one of the paper's experiments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Evaluation {
    /// Version of this form.
    pub schema_version: u32,
    /// Name of the experiment.
    pub protocol: String,
    /// Test conditions.
    pub conditions: u64,
    /// Root seed.
    pub seed: u64,
    /// Properties of the recordings and of the reference signals.
    pub settings: EvaluationSettings,
    /// One entry a method.
    pub methods: Vec<MethodEvaluation>,
}

/// Properties of the recordings of an experiment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EvaluationSettings {
    /// Noise inside the controller, of recordings and reference signals.
    pub controller_noise: bool,
    /// Digitisation inside the control loop, of both.
    pub digitisation: bool,
    /// White noise on each phase sample, rms, A; a 12-bit converter over ±20 A follows it. 0:
    /// neither.
    pub sensor_noise_a: f64,
    /// Rate of the phase samples, Hz.
    pub phase_rate_hz: f64,
    /// Rate of the filtered envelope, Hz.
    pub envelope_rate_hz: f64,
    /// Reference signals of the design `incipient`.
    pub snapshots: u64,
    /// Reference signals of the design `sparse`.
    pub sparse_snapshots: u64,
    /// Largest level that searches of the scalar discrepancy look at.
    pub largest_level: f64,
}

/// How a method did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MethodEvaluation {
    /// Name of the method.
    pub method: String,
    /// Mean over the faults of the median percentage error.
    pub average_percent: f64,
    /// Prediction of it from the stated standard deviations: mean over the faults of the median of
    /// 67.4 % of the standard deviation over the level.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_percent: Option<f64>,
    /// Median number of evaluations of the monitor.
    pub evaluations_median: f64,
    /// Median `δ*`: norm of the residual on the mask's 30 points, A.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub discrepancy_median: Option<f64>,
    /// Median evaluations times the measured time of one, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_time_s: Option<f64>,
    /// Median wall time of a diagnosis, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall_time_s: Option<f64>,
    /// Least wall time of a diagnosis, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall_time_min_s: Option<f64>,
    /// Share of 95 % intervals that hold the truth, all faults together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage_95: Option<f64>,
    /// Healthy recordings on which false alarms were counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub healthy: Option<u64>,
    /// How the discrepancy falls, over the conditions; empty where nothing is searched.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub convergence: Vec<ConvergencePoint>,
    /// One entry a fault looked for.
    pub faults: Vec<FaultEvaluation>,
}

/// Least discrepancy that searches have reached after some evaluations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ConvergencePoint {
    /// Evaluations of the monitor.
    pub evaluations: u64,
    /// Median time from the start, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Norm of the residual on the mask's points, A; searches that have ended count with their
    /// end.
    pub discrepancy: Quartiles,
    /// Percentage error of each fault at the best point so far, in the order of the faults; empty
    /// where the points are not known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub errors_percent: Vec<Quartiles>,
}

/// How well one fault is found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaultEvaluation {
    /// Which fault.
    pub id: FaultId,
    /// Percentage error, eq. 20 of the FREEDOM paper.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_percent: Option<Quartiles>,
    /// Absolute error of the level; on the circle for k7.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_abs: Option<Quartiles>,
    /// Median Cramér-Rao bound for sensor noise and the monitor's error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bound_std: Option<f64>,
    /// Median bound for sensor noise on the filtered envelope.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor_bound_std: Option<f64>,
    /// Median bound for sensor noise on the raw phase currents.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phase_bound_std: Option<f64>,
    /// Root mean square of error over bound; for k6 over both of its components.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rmse_over_bound: Option<f64>,
    /// Root mean square of error over the bound for sensor noise alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rmse_over_sensor_bound: Option<f64>,
    /// Share of 95 % intervals that hold the truth; for k6 of the joint region with k7.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage_95: Option<f64>,
    /// Healthy recordings on which the fault was called detected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub false_alarms: Option<u64>,
    /// Probability of detection by level.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub detection: Vec<DetectionPoint>,
}

impl FaultEvaluation {
    /// An entry without figures.
    pub fn of(id: FaultId) -> Self {
        Self {
            id,
            error_percent: None,
            error_abs: None,
            bound_std: None,
            sensor_bound_std: None,
            phase_bound_std: None,
            rmse_over_bound: None,
            rmse_over_sensor_bound: None,
            coverage_95: None,
            false_alarms: None,
            detection: Vec::new(),
        }
    }
}

/// One point of a curve of detection.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DetectionPoint {
    /// Middle of the levels taken together.
    pub level: f64,
    /// Conditions with such a level.
    pub conditions: u64,
    /// Share of them in which the fault was detected.
    pub detected_frac: f64,
}

/// Quartiles and maximum over the conditions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Quartiles {
    /// Half are smaller.
    pub median: f64,
    /// A quarter is smaller.
    pub p25: f64,
    /// A quarter is larger.
    pub p75: f64,
    /// None is larger.
    pub max: f64,
}
