//! The view that a scalar search has of an experiment: how levels lie on the unit interval, and which number it minimises.

/// How the levels `k1..k6` lie on the unit interval that a scalar search looks at; `k7` is a direction and lies
/// on its circle in each.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SearchSpace {
    /// `k = largest·u`: the paper's domain with `largest` 1.
    Linear {
        /// Largest level.
        largest: f64,
    },
    /// `k = u³`: the whole of `[0, 1]`, a third of each axis up to 0.037.
    Cubic,
    /// `k = s·((1 + 1/s)^u − 1)`: the whole of `[0, 1]`, linear below `s` and logarithmic above.
    Logarithmic {
        /// `s`, the level at which the law changes.
        scale: f64,
    },
}

impl SearchSpace {
    /// The level at a place of the unit interval.
    pub fn level(self, unit: f64) -> f64 {
        match self {
            Self::Linear { largest } => largest * unit,
            Self::Cubic => unit * unit * unit,
            // exact at both ends
            Self::Logarithmic { scale } => scale * (unit * (1.0 / scale).ln_1p()).exp_m1(),
        }
    }
}

/// The number that a scalar search minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SearchedScalar {
    /// `δ`, eq. 17 of the FREEDOM paper, A.
    Discrepancy,
    /// `ln δ`: the same order of points, another shape for the surrogate.
    Logarithm,
}

/// The view that a scalar search has of an experiment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchView {
    /// How the levels lie on the unit interval.
    pub space: SearchSpace,
    /// The number that is minimised.
    pub scalar: SearchedScalar,
}

impl SearchView {
    /// The discrepancy over a space.
    pub fn of(space: SearchSpace) -> Self {
        Self { space, scalar: SearchedScalar::Discrepancy }
    }

    /// The number that a search is told for a discrepancy.
    pub(crate) fn scalar(self, discrepancy: f64) -> f64 {
        match self.scalar {
            SearchedScalar::Discrepancy => discrepancy,
            // a discrepancy of zero has no logarithm
            SearchedScalar::Logarithm => discrepancy.max(f64::MIN_POSITIVE).ln(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    /// A few roundings of numbers of size one.
    const ROUNDING: f64 = 1e-14;

    #[test]
    fn every_space_grows_from_its_least_to_its_largest_level() {
        for (space, largest) in [
            (SearchSpace::Linear { largest: 0.05 }, 0.05),
            (SearchSpace::Cubic, 1.0),
            (SearchSpace::Logarithmic { scale: 0.002 }, 1.0),
        ] {
            assert_eq!(space.level(0.0), 0.0);
            assert_abs_diff_eq!(space.level(1.0), largest, epsilon = ROUNDING);
            let levels: Vec<f64> = (0..=50).map(|i| space.level(f64::from(i) / 50.0)).collect();
            assert!(levels.windows(2).all(|pair| pair[0] < pair[1]), "{space:?}: {levels:?}");
        }
    }

    #[test]
    fn the_logarithm_keeps_the_order_and_takes_zero() {
        let view =
            SearchView { scalar: SearchedScalar::Logarithm, ..SearchView::of(SearchSpace::Cubic) };
        assert!(view.scalar(0.0).is_finite());
        assert!(view.scalar(0.1) < view.scalar(0.2));
    }
}
