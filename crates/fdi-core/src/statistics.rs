//! Noise of a filtered envelope, the range of a signal, and work in parallel.

pub(crate) mod noise_covariance;
pub(crate) mod parallel;

/// Greatest less least value.
pub(crate) fn range(signal: &[f64]) -> f64 {
    let least = signal.iter().copied().fold(f64::INFINITY, f64::min);
    let most = signal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    most - least
}
