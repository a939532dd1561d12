//! The recording to take next, as JSON.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which recording tells apart the causes that the recordings at hand leave open.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Proposal {
    /// Version of this form.
    pub schema_version: u32,
    /// Name and version of the program, `fdi 0.1.0`.
    pub tool: String,
    /// Seed of everything random.
    pub seed: u64,
    /// When it was made, RFC 3339; only with `--stamp`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stamp: Option<String>,
    /// Name that the model gives itself.
    pub model: String,
    /// Symbols of the causes that are open, the likeliest first.
    pub open: Vec<String>,
    /// The menu, most telling first; empty where nothing is open.
    pub menu: Vec<ProposedRecording>,
    /// Wall time, s; left out with `--stable`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elapsed_s: Option<f64>,
}

/// A recording that might be taken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ProposedRecording {
    /// Course of the machine in the test.
    pub description: String,
    /// Length of the recording, s.
    pub duration_s: f64,
    /// Least of the separations.
    pub separation: f64,
    /// Expected separation of each pair of open causes.
    pub separations: Vec<Separation>,
}

/// How far a recording is expected to tell two causes apart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Separation {
    /// Symbols of the two.
    pub causes: [String; 2],
    /// Twice the log-likelihood by which it is expected to speak against the wrong one; 9 is
    /// three standard deviations.
    pub separation: f64,
}
