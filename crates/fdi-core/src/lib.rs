//! Fault detection and isolation of electromechanical actuators from stator current.

mod banded;
mod error_model;
mod experiment;
mod noise_covariance;

pub use banded::{BandedCholesky, BandedMatrix, NotPositiveDefinite};
pub use error_model::{ErrorModel, ErrorModelError, Trend, choose_taper};
pub use experiment::{Experiment, Monitor};
pub use noise_covariance::unit_noise_covariance;
