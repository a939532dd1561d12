//! Normal numbers from a seeded generator.

use rand::{RngExt, distr::Open01};
use rand_chacha::ChaCha8Rng;

/// A number of the standard normal distribution (Box and Muller).
pub(crate) fn normal(random: &mut ChaCha8Rng) -> f64 {
    let radius = libm::sqrt(-2.0 * libm::log(random.sample::<f64, _>(Open01)));
    let angle = core::f64::consts::TAU * random.sample::<f64, _>(Open01);
    radius * libm::cos(angle)
}
