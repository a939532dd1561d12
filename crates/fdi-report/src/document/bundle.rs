//! The contents of a bundle, as JSON.

use std::collections::BTreeMap;

use recordings::EnvelopeKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Encoding;

/// Content of a bundle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BundleSummary {
    /// Version of this form.
    pub schema_version: u32,
    /// SHA-256 of the bundle, hexadecimal.
    pub sha256: String,
    /// Name of the model that it is of.
    pub model: String,
    /// Name of the command that it is for.
    pub command: String,
    /// Name of the envelope that it is for.
    pub envelope: String,
    /// Rate of the envelope, Hz.
    pub rate_hz: f64,
    /// Corner of the filter, Hz.
    pub filter_hz: f64,
    /// The datasets that it was learnt from.
    pub datasets: Vec<DatasetSummary>,
    /// The encoding used unless another is asked for.
    pub default_encoding: Encoding,
    /// The encodings that it holds.
    pub encodings: Vec<EncodingSummary>,
}

impl BundleSummary {
    /// The envelope as a choice, where this version knows it.
    pub fn envelope_kind(&self) -> Option<EnvelopeKind> {
        EnvelopeKind::from_name(&self.envelope)
    }
}

/// A dataset that a bundle was learnt from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct DatasetSummary {
    /// Name of the design.
    pub name: String,
    /// Number of conditions.
    pub conditions: u64,
    /// Seed it was made from.
    pub seed: u64,
    /// SHA-256 of its content, hexadecimal.
    pub sha256: String,
}

/// An encoding that a bundle holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EncodingSummary {
    /// Name of the encoding.
    pub name: Encoding,
    /// Numbers that it makes of a recording.
    pub size: u64,
    /// For each fault, how much larger the bound of its standard deviation is
    /// than with the whole envelope.
    pub bound_inflation: BTreeMap<String, f64>,
}
