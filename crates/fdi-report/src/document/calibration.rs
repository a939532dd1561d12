//! The numbers of a machine from recordings of it in health, as JSON.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Holdout;

/// Numbers of a machine, refined from recordings of it while healthy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Calibration {
    /// Version of this form.
    pub schema_version: u32,
    /// Name and version of the program, `fdi 0.1.0`.
    pub tool: String,
    /// When it was made, RFC 3339; only with `--stamp`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stamp: Option<String>,
    /// Name that the model gives itself.
    pub model: String,
    /// The numbers, by their keys in the model file.
    pub parameters: BTreeMap<String, CalibratedParameter>,
    /// Inertias and frictions of an actuator over its torque constant, which is all that a current
    /// shows of either.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub ratios: BTreeMap<String, CalibratedParameter>,
    /// Residual of recordings that were not fitted, where there are any.
    pub holdout: Option<Holdout>,
    /// Wall time, s; left out with `--stable`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elapsed_s: Option<f64>,
}

/// A number of the machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CalibratedParameter {
    /// In the model file.
    pub nominal: f64,
    /// By the recordings.
    pub value: f64,
    /// Standard deviation of the value.
    pub std: f64,
    /// 95 % interval of the value.
    pub interval_95: [f64; 2],
    /// True where the recordings determine it; if not the model of an axis keeps the nominal value,
    /// that of an actuator the value beside the others that it is known with.
    pub determined: bool,
    /// A number that these recordings cannot tell it from.
    pub tied_to: Option<String>,
}
