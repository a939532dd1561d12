//! Signal compression: SVD, dynamic mode decomposition, self-organising maps and what they keep of the information.
//!
//! ```text
//! Snapshots ─▶ Dmd ─▶ TrainingSet ─▶ Som ─▶ points, cluster means ─┐
//!     │                                                            ├─▶ CompressionMap ─▶ encode, decode
//!     ├─▶ Svd ───────────────────────────▶ modes, pivots ──────────┤
//!     └─▶ Sensitivities ─────────────────▶ sensitivities, optima ──┘
//! ```
//!
//! The crate knows nothing of what the signals are. It does no IO, reads no
//! clock, and takes chance from seeds alone. Everything runs on one thread.
//!
//! # Examples
//!
//! The FREEDOM paper's compression: 30 points from dynamic modes and a map.
//!
//! ```
//! use reduction::{CompressionConfig, CompressionMap, DmdConfig, RankRule, Snapshots};
//!
//! let snapshots = Snapshots::from_fn(400, 40, |row, j| {
//!     let (x, t) = (row as f64 / 400.0, j as f64 / 40.0);
//!     (20.0 * x + t).sin() + t * (9.0 * x * x).cos() + (5.0 * t * x).sin()
//! })?;
//! let config = CompressionConfig {
//!     dmd: DmdConfig { rank: RankRule::Energy(0.999), ..DmdConfig::default() },
//!     ..CompressionConfig::default()
//! };
//! let map = CompressionMap::fit(&(&snapshots).into(), &config)?;
//! assert_eq!(map.locations().map(<[usize]>::len), Some(30));
//! let encoded = map.encode(snapshots.snapshot(3))?;
//! assert_eq!(encoded.len(), 30);
//! # Ok::<_, Box<dyn std::error::Error>>(())
//! ```

mod bounds;
mod complex;
mod compression;
mod decomposition;
mod dmd;
mod figure;
mod information;
mod leading;
mod matrix;
mod noise;
mod placement;
mod randomised;
mod rank;
mod sensitivity;
mod snapshots;
mod som;
mod streaming;
mod svd;
mod training_set;

pub use bounds::{BoundCase, EncodingBounds};
pub use complex::Complex;
pub use compression::{
    CompressionConfig, CompressionError, CompressionMap, CompressionParts, Encoder, Encoding,
    FitReport, LengthError, PartsError, Placement, PointRule, SnapshotOrder, TrainingData,
};
pub use decomposition::NoConvergence;
pub use dmd::{Dmd, DmdConfig, DmdError, DmdKind};
pub use figure::ModeFigure;
pub use information::{CramerRao, Information, InformationError};
pub use leading::leading_svd;
pub use matrix::{Matrix, MatrixError};
pub use noise::{NoiseCovariance, NoiseError, NoiseModel};
pub use randomised::{RandomisedConfig, randomised_svd};
pub use rank::RankRule;
pub use sensitivity::{Regression, Sensitivities, SensitivityError};
pub use snapshots::Snapshots;
pub use som::{
    Decay, Grid, SampleOrder, Schedule, Som, SomConfig, SomError, SomStart, Topology, Training,
};
pub use streaming::{StreamedSvd, StreamingConfig, StreamingError, StreamingSvd};
pub use svd::{Svd, SvdError, thin_svd};
pub use training_set::{ModeScaling, TrainingScaling, TrainingSet};

/// The examples of the crate's README, compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
