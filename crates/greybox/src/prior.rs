//! Laws of numbers before any recording.

/// Degrees of freedom, and one, of the law of what no file states a tolerance for: a file that is
/// wrong by ten standard deviations costs 8 nats instead of 50, so that recordings can beat it.
const HEAVY: f64 = 5.0;

/// Law of a number beforehand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Prior {
    pub(crate) mean: f64,
    pub(crate) std: f64,
    /// True for a tail of powers:
    ///
    /// ```text
    /// −ln p = z²/2,   with a tail (n/2)·ln(1 + z²/n),   z = (x − mean)/std
    /// ```
    ///
    /// with the same curvature at the mean.
    pub(crate) has_tail: bool,
}

impl Prior {
    fn z(&self, value: f64) -> f64 {
        (value - self.mean) / self.std
    }

    /// Negative logarithm of its density over that at the mean.
    pub(crate) fn cost(&self, value: f64) -> f64 {
        let z = self.z(value);
        if self.has_tail { 0.5 * HEAVY * libm::log1p(z * z / HEAVY) } else { 0.5 * z * z }
    }

    /// Weight of the least squares that have its slope at a value: slope over distance from the mean,
    /// never negative.
    pub(crate) fn weight(&self, value: f64) -> f64 {
        let z = self.z(value);
        let share = if self.has_tail { HEAVY / (HEAVY + z * z) } else { 1.0 };
        share / (self.std * self.std)
    }

    /// Derivative of the cost.
    pub(crate) fn slope(&self, value: f64) -> f64 {
        (value - self.mean) * self.weight(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_the_slope_is_that_of_the_cost_and_a_tail_is_cheap() {
        for has_tail in [false, true] {
            let prior = Prior { mean: 2.0, std: 0.5, has_tail };
            for value in [0.3, 1.9, 2.0, 2.6, 9.0] {
                let difference = (prior.cost(value + 1e-5) - prior.cost(value - 1e-5)) / 2e-5;
                assert!((prior.slope(value) - difference).abs() < 1e-6 * (1.0 + difference.abs()));
            }
        }
        let [normal, tail] =
            [false, true].map(|has_tail| Prior { mean: 0.0, std: 1.0, has_tail }.cost(10.0));
        assert!(normal == 50.0 && (7.0..8.0).contains(&tail), "{tail}");
    }
}
