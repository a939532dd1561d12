//! Model that predicts what recordings show in an explanation.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::words;

/// Model that predicts what recordings show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Prediction {
    /// Model with ideal electronics, without noise and steps in its loops; the only one of an axis.
    Ideal,
    /// Low-fidelity model with noise and steps of the electronics in its loops.
    Low,
    /// High-fidelity model with noise and steps of the electronics in its loops.
    High,
    /// Low-fidelity model with its error on machines within their tolerances, as a bundle has learnt it.
    Learnt,
}

words! {
    Prediction { Ideal "ideal", Low "low", High "high", Learnt "learnt" }
}
