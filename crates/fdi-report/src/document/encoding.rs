//! Encodings: which part of the signal a diagnosis looks at.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::words;

/// Part of the filtered envelope that a diagnosis looks at.
///
/// # Source
///
/// [`Points`](Self::Points) is the FREEDOM paper's, section II.A; what each of the others costs
/// in accuracy is compared in `docs/validation/reduction.md`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(description = "Part of the filtered envelope that a diagnosis looks at.")]
#[serde(rename_all = "kebab-case")]
pub enum Encoding {
    /// Every sample.
    #[default]
    Full,
    /// The 30 samples of the bundle's mask.
    Points,
    /// Means over the clusters of the map that places the points.
    ClusterMeans,
    /// Projection on the leading modes of the reference signals.
    Modes,
    /// Projection on the effects of the faults in the reference signals.
    Sensitivities,
}

impl Encoding {
    /// Every encoding, the default first.
    pub const ALL: [Self; 5] =
        [Self::Full, Self::Points, Self::ClusterMeans, Self::Modes, Self::Sensitivities];
}

words! {
    Encoding {
        Full "full", Points "points", ClusterMeans "cluster-means", Modes "modes",
        Sensitivities "sensitivities",
    }
}
