//! Noise of a filtered envelope, and work in parallel.

pub(crate) mod noise_covariance;
pub(crate) mod parallel;
