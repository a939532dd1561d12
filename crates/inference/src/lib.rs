//! Statistical inference: covariances of correlated samples, noise, and derivatives of a model.
//!
//! ```text
//! residuals ─▶ tapered_covariance ─▶ BandedMatrix ─▶ BandedCholesky ─▶ white residuals
//! noise ─────▶ Whitener ──────────────────────────────────────────▶ white residuals
//! white residuals and slopes, priors ─▶ most_probable ─▶ numbers with their covariance
//! function ──▶ central_differences ─▶ slopes ─▶ QuadraticForm ─▶ least_in_box ─▶ step
//! ```
//!
//! The crate knows nothing of what the signals are. It does no IO, reads no clock and takes no
//! chance. Everything runs on one thread, and the kernels give the same bits at every vector width.

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod autoregressive;
mod banded;
mod central;
mod chance;
mod in_box;
mod most_probable;
#[cfg(test)]
mod random;
mod runs;
mod shrinkage;
mod sides;
mod symmetric;
mod taper;

pub use autoregressive::{Whitener, log_likelihood_without, rms};
pub use banded::{BandedCholesky, BandedMatrix, NotPositiveDefinite, dot};
pub use central::{central_differences, central_differences_together, try_central_differences};
pub use chance::{chi_squared_log_tail, ljung_box_chance};
pub use in_box::{QuadraticForm, least_in_box};
pub use most_probable::{MostProbable, Unknown, Whitened, most_probable};
pub use runs::{EqualRuns, LIMIT_SHARE, Standing, ends};
pub use shrinkage::shrunk_covariance;
pub use symmetric::SymmetricMatrix;
pub use taper::{add_tapered_covariance, gaspari_cohn, tapered_covariance};
