//! The factor of a covariance at a level of the noise grid, and what it is at the levels about it.
//!
//! ```text
//! Σ(σ) = L·(I + δ·K)·Lᵀ,   δ = σ² − σ_k²,   K = L⁻¹·C·L⁻ᵀ
//! (I + δ·K)^(−½) = I − ½·δ·K + O(δ²·K²)
//! ln det Σ(σ) = ln det Σ(σ_k) + δ·tr K − ½·δ²·tr K² + O(δ³·K³)
//! ```
//!
//! with `C` the covariance of the noise of one ampere and `L` the factor at the grid's level. The
//! eigenvalues of `σ_k²·K` are below one, and half a step of the grid is 2.5 % of `σ`: white numbers
//! are good to `3/8·0.05² = 1e-3` of themselves.
//!
//! # Source
//!
//! Neumann's series of a perturbed inverse: Golub and van Loan, *Matrix Computations*, 2.3.4; traces
//! by probing vectors: Hutchinson, Commun. Stat. Simul. Comput. 19, 1990.

use std::sync::{Arc, OnceLock};

use inference::{BandedMatrix, dot};

use crate::offline::factor::Factor;

/// Numbers of all probing vectors together: the scatter of the traces is then an eighth of the
/// scatter of a noise level that is read off a residual of a thousand samples.
const PROBED_NUMBERS: usize = 64_000;
/// Probing vectors at least.
const LEAST_PROBES: usize = 8;

/// The factor of a covariance at a level of the grid.
#[derive(Debug)]
pub(crate) struct GridFactor {
    factor: Factor,
    /// Covariance of the noise of one ampere.
    noise: Arc<BandedMatrix>,
    /// Variance of the noise at the level, A².
    variance_a2: f64,
    log_determinant: f64,
    /// `tr K` and `tr K²`, formed when first asked for.
    traces: OnceLock<[f64; 2]>,
}

/// Shares of the noise in a residual about a level: `zᵀ·K·z` and `zᵀ·K²·z` of its white numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoiseShares {
    pub(crate) first: f64,
    pub(crate) second: f64,
}

impl GridFactor {
    /// Takes the factor of a covariance in which the noise has a variance.
    pub(crate) fn new(factor: Factor, noise: Arc<BandedMatrix>, variance_a2: f64) -> Self {
        let log_determinant = factor.log_determinant();
        Self { factor, noise, variance_a2, log_determinant, traces: OnceLock::new() }
    }

    /// The factor at the grid's level.
    pub(crate) fn factor(&self) -> &Factor {
        &self.factor
    }

    /// Covariance of the noise of one ampere.
    pub(crate) fn noise(&self) -> &BandedMatrix {
        &self.noise
    }

    /// Variance of the noise at the grid's level, A².
    pub(crate) fn variance_a2(&self) -> f64 {
        self.variance_a2
    }

    /// White numbers of a residual where the noise has a variance beyond the grid's.
    pub(crate) fn whiten(&self, residual: &[f64], excess_a2: f64) -> Vec<f64> {
        let mut white = [self.factor.whiten(residual)];
        self.correct(&mut white, residual.len(), excess_a2);
        let [white] = white;
        white
    }

    /// White numbers of several residuals.
    pub(crate) fn whiten_each<'r>(
        &self,
        residuals: impl Iterator<Item = &'r Vec<f64>>,
        excess_a2: f64,
    ) -> Vec<Vec<f64>> {
        let mut white = self.factor.whiten_each(residuals);
        self.correct(&mut white, self.noise.order(), excess_a2);
        white
    }

    /// Signals of full length from white numbers: after [`whiten_each`](Self::whiten_each) this is
    /// `Σ⁻¹·r`.
    pub(crate) fn spread_each(
        &self,
        mut white: Vec<Vec<f64>>,
        samples: usize,
        excess_a2: f64,
    ) -> Vec<Vec<f64>> {
        self.correct(&mut white, samples, excess_a2);
        self.factor.spread_each(white, samples)
    }

    /// `(I − ½·δ·K)·z`.
    fn correct(&self, white: &mut [Vec<f64>], samples: usize, excess_a2: f64) {
        if excess_a2 == 0.0 {
            return;
        }
        let images = self.images(white.to_vec(), samples);
        for (white, image) in white.iter_mut().zip(images) {
            for (value, image) in white.iter_mut().zip(image) {
                *value -= 0.5 * excess_a2 * image;
            }
        }
    }

    /// `K·z` of white numbers.
    fn images(&self, white: Vec<Vec<f64>>, samples: usize) -> Vec<Vec<f64>> {
        let spread = self.factor.spread_each(white, samples);
        let noise: Vec<Vec<f64>> = spread.iter().map(|signal| self.noise.times(signal)).collect();
        self.factor.whiten_each(noise.iter())
    }

    /// Shares of the noise in a residual.
    pub(crate) fn shares(&self, residual: &[f64]) -> NoiseShares {
        let white = self.factor.whiten(residual);
        let image = self.images(vec![white.clone()], residual.len()).remove(0);
        NoiseShares { first: dot(&white, &image), second: dot(&image, &image) }
    }

    /// Shares of the noise to be expected, `tr K` and `tr K²`.
    pub(crate) fn expected_shares(&self) -> NoiseShares {
        let [first, second] = *self.traces.get_or_init(|| {
            let (size, samples) = (self.factor.size(), self.noise.order());
            let count = (PROBED_NUMBERS / size.max(1)).max(LEAST_PROBES);
            let probes = probes(count, size);
            let images = self.images(probes.clone(), samples);
            let first: f64 = probes.iter().zip(&images).map(|(w, image)| dot(w, image)).sum();
            let second: f64 = images.iter().map(|image| dot(image, image)).sum();
            [first / count as f64, second / count as f64]
        });
        NoiseShares { first, second }
    }

    /// Logarithm of the determinant of the covariance.
    pub(crate) fn log_determinant(&self, excess_a2: f64) -> f64 {
        if excess_a2 == 0.0 {
            return self.log_determinant;
        }
        let NoiseShares { first, second } = self.expected_shares();
        self.log_determinant + excess_a2 * first - 0.5 * excess_a2 * excess_a2 * second
    }
}

/// Probing vectors of ±1.
pub(crate) fn probes(count: usize, size: usize) -> Vec<Vec<f64>> {
    let numbers = |probe: usize| (0..size).map(move |i| sign((i + probe * size) as u64));
    (0..count).map(|probe| numbers(probe).collect()).collect()
}

/// ±1 from a counter (the finaliser of SplitMix64): fixed probing vectors, not randomness.
fn sign(counter: u64) -> f64 {
    let mut z = counter.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    if (z ^ (z >> 31)) & 1 == 0 { 1.0 } else { -1.0 }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;
    use crate::offline::factor::joined;

    const SAMPLES: usize = 200;

    /// An error with long memory and a noise with short memory.
    fn matrices() -> (BandedMatrix, BandedMatrix) {
        let (mut error, mut noise) =
            (BandedMatrix::zeros(SAMPLES, 30), BandedMatrix::zeros(SAMPLES, 3));
        for i in 0..SAMPLES {
            for j in i.saturating_sub(30)..=i {
                let lag = (i - j) as f64;
                *error.at_mut(i, j) = 4e-4 * (-lag / 8.0).exp() * (1.0 - lag / 40.0);
            }
            for j in i.saturating_sub(3)..=i {
                *noise.at_mut(i, j) = [0.5, 0.3, 0.1, 0.02][i - j];
            }
        }
        (error, noise)
    }

    fn factor_at(level_a: f64) -> GridFactor {
        let (error, noise) = matrices();
        let variance_a2 = level_a * level_a;
        let whole = joined(&error, &noise.scaled(variance_a2));
        GridFactor::new(Factor::new(whole, None).unwrap(), Arc::new(noise), variance_a2)
    }

    fn residual() -> Vec<f64> {
        (0..SAMPLES)
            .map(|i| 0.03 * (1.7 * i as f64).sin() + 0.02 * (0.1 * i as f64).cos())
            .collect()
    }

    #[test]
    fn half_a_step_away_solutions_are_good_to_the_second_power() {
        for (away, most) in [(0.025, 3e-3), (-0.025, 3e-3), (0.0125, 8e-4)] {
            let (grid, own) = (factor_at(0.02), factor_at(0.02 * f64::exp(away)));
            let excess_a2 = own.variance_a2 - grid.variance_a2;
            let near = grid.whiten_each([residual()].iter(), excess_a2);
            let exact = own.whiten_each([residual()].iter(), 0.0);
            let (square, want) = (dot(&near[0], &near[0]), dot(&exact[0], &exact[0]));
            assert!((square / want - 1.0).abs() < most, "{away}: {square} {want}");
            let near = grid.spread_each(near, SAMPLES, excess_a2);
            let exact = own.spread_each(exact, SAMPLES, 0.0);
            let norm = dot(&exact[0], &exact[0]).sqrt();
            for (a, b) in near[0].iter().zip(&exact[0]) {
                assert!((a - b).abs() < most * norm, "{away}: {a} {b}");
            }
        }
    }

    #[test]
    fn determinants_follow_the_traces() {
        let (grid, own) = (factor_at(0.02), factor_at(0.02 * f64::exp(0.025)));
        let excess_a2 = own.variance_a2 - grid.variance_a2;
        let rise = grid.log_determinant(excess_a2) - grid.log_determinant(0.0);
        let want = own.log_determinant(0.0) - grid.log_determinant(0.0);
        // 320 probing vectors of 200 numbers
        assert_abs_diff_eq!(rise, want, epsilon = 0.02 * want);
    }
}
