//! Covariances of sampled signals and derivatives, without a machine.

pub(crate) mod banded;
pub(crate) mod central;
pub(crate) mod noise_covariance;
pub(crate) mod parallel;
