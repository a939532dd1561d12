//! Powers of numbers that are not negative.

use libm::{pow, sqrt};

/// A power of a number that is not negative; the usual ones without a logarithm.
#[inline]
pub(crate) fn power(base: f64, exponent: f64) -> f64 {
    if exponent == 2.0 {
        base * base
    } else if exponent == 1.0 {
        base
    } else if exponent == 0.5 {
        sqrt(base)
    } else if exponent == 1.5 {
        base * sqrt(base)
    } else if exponent == 2.5 {
        base * base * sqrt(base)
    } else {
        pow(base, exponent)
    }
}
