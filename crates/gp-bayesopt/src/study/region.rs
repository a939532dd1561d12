//! The trust region of a study.

use crate::{
    bounds::{Bounds, Walls},
    gp::GaussianProcess,
};

/// Half-width of the first region, as a fraction of the intervals.
const FIRST: f64 = 0.4;
/// Largest half-width.
const LARGEST: f64 = 0.8;
/// Smallest half-width, below which no surrogate tells points apart.
const SMALLEST: f64 = 1e-7;
/// Gains in a row after which the region doubles.
const GAINS: usize = 2;
/// Failures in a row after which it halves, at least.
const LEAST_PATIENCE: usize = 3;

/// Half-width of the region after some outcomes of points that were looked for in it: doubled
/// after two gains in a row, halved after a third as many failures in a row as there are inputs,
/// three at least.
///
/// # Source
/// Eriksson et al., Scalable global optimization via local Bayesian optimization, `NeurIPS` 2019,
/// section 2, with other counts.
pub(super) fn half_width(gains: impl IntoIterator<Item = bool>, inputs: usize) -> f64 {
    let patience = (inputs / 3).max(LEAST_PATIENCE);
    let (mut width, mut good, mut bad) = (FIRST, 0, 0);
    for gain in gains {
        (good, bad) = if gain { (good + 1, 0) } else { (0, bad + 1) };
        if good == GAINS {
            (width, good) = ((2.0 * width).min(LARGEST), 0);
        } else if bad == patience {
            (width, bad) = ((0.5 * width).max(SMALLEST), 0);
        }
    }
    width
}

/// The region around a point of the unit cube: longer where the surrogate has longer length
/// scales, at equal volume.
pub(super) fn walls(
    bounds: &Bounds,
    gp: &GaussianProcess,
    centre: &[f64],
    half_width: f64,
) -> Walls {
    let outer = bounds.unit_walls();
    let scales = gp.scale_of_inputs();
    let mean_ln = scales.iter().map(|s| libm::log(*s)).sum::<f64>() / scales.len() as f64;
    let half = |i: usize| half_width * (scales[i] / libm::exp(mean_ln)).clamp(0.2, 5.0);
    let side =
        |i: usize, sign: f64| (centre[i] + sign * half(i)).clamp(outer.lower[i], outer.upper[i]);
    Walls {
        lower: (0..centre.len()).map(|i| side(i, -1.0)).collect(),
        upper: (0..centre.len()).map(|i| side(i, 1.0)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_region_follows_gains_and_failures() {
        assert_eq!(half_width([], 2), FIRST);
        assert_eq!(half_width([true, true], 2), 2.0 * FIRST);
        assert_eq!(half_width([true; 20], 2), LARGEST);
        assert_eq!(half_width([true, false, true, false, true, false], 2), FIRST);
        assert_eq!(half_width([false; 3], 2), 0.5 * FIRST);
        assert_eq!(half_width([false; 3], 12), FIRST);
        assert_eq!(half_width([false; 4], 12), 0.5 * FIRST);
        assert_eq!(half_width([false; 1000], 2), SMALLEST);
    }
}
