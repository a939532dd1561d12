//! The sum of three measured phases, and what it shows of their sensors.
//!
//! ```text
//! i_a + i_b + i_c = 0                    of a star
//! i'_a + i'_b + i'_c = Σ g_j·i_j + Σ o_j + noise of three samples
//! ```
//!
//! for sensors with gains `1 + g_j` and offsets `o_j`. A gain that all three share adds nothing to
//! the sum and is not seen, nor is an offset of one phase alone.

use nalgebra::{Matrix3, Vector3};

/// A sum of the phase currents below this is one that was computed, not measured, A.
const COMPUTED_SUM_A: f64 = 1e-5;

/// Noise and errors of the sensors of three phases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PhaseSum {
    /// Noise on each phase sample beside gains and offsets, A.
    pub(crate) noise_a: f64,
    /// Gain of each phase beyond the mean of the three, a share.
    pub(crate) gains: [f64; 3],
    /// Sum of the offsets, A.
    pub(crate) offset_sum_a: f64,
}

impl PhaseSum {
    /// Reads off what three phases sum to; `None` for phases that do not move, and where one was
    /// computed from the others.
    ///
    /// With two differences of the currents for regressors this is linear, and what is left of the
    /// sum is the noise of three samples. The noise of a difference is not correlated with that of
    /// the sum. The currents themselves are no regressors: they hold their sum.
    pub(crate) fn of(phases: [&[f64]; 3]) -> Option<Self> {
        let [a, b, c] = phases;
        let sum = |n: usize| a[n] + b[n] + c[n];
        let regressors = |n: usize| Vector3::new(a[n] - b[n], b[n] - c[n], 1.0);
        let mut gram = Matrix3::<f64>::zeros();
        let mut moment = Vector3::<f64>::zeros();
        for n in 0..a.len() {
            let row = regressors(n);
            gram += row * row.transpose();
            moment += row * sum(n);
        }
        let shares = gram.try_inverse()? * moment;
        let square = |n: usize| (sum(n) - shares.dot(&regressors(n))).powi(2);
        let variance = (0..a.len()).map(square).sum::<f64>() / (a.len() as f64 - 3.0);
        let noise_a = (variance / 3.0).sqrt();
        let gains = [shares[0], shares[1] - shares[0], -shares[1]];
        (noise_a > COMPUTED_SUM_A).then_some(Self { noise_a, gains, offset_sum_a: shares[2] })
    }
}

/// Noise of one phase from the sum of the three currents, which a star connection keeps at zero:
/// whatever the model does, this is noise (offsets removed), quantisation included.
pub(crate) fn zero_sequence_noise_a(phases: [&[f64]; 3]) -> Option<f64> {
    let [a, b, c] = phases;
    let sums: Vec<f64> = a.iter().zip(b).zip(c).map(|((a, b), c)| a + b + c).collect();
    let count = sums.len() as f64;
    let mean = sums.iter().sum::<f64>() / count;
    let variance = sums.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / (count - 1.0);
    let noise_a = (variance / 3.0).sqrt();
    (noise_a > COMPUTED_SUM_A).then_some(noise_a)
}

#[cfg(test)]
mod tests {
    use core::f64::consts::PI;

    use approx::assert_relative_eq;

    use super::*;

    /// Three phases of a star, whose sensors have gains, offsets and noise.
    fn sensed(gains: [f64; 3], noise_a: f64) -> [Vec<f64>; 3] {
        let mut noise = crate::seed::Draws::new(7);
        core::array::from_fn(|phase| {
            let current_a = |n: u32| {
                let angle = 0.01 * f64::from(n) - phase as f64 * PI / 1.5;
                3.0 * angle.sin()
            };
            let offset_a = 0.02 * phase as f64;
            (0..20_000)
                .map(|n| gains[phase] * current_a(n) + offset_a + noise_a * noise.normal())
                .collect()
        })
    }

    #[test]
    fn noise_is_told_from_gains_of_the_sensors() {
        for noise_a in [0.02, 0.5] {
            let [a, b, c] = sensed([1.01, 0.99, 1.005], noise_a);
            let phases = [&a[..], &b[..], &c[..]];
            let found = PhaseSum::of(phases).expect("noise");
            assert_relative_eq!(found.noise_a, noise_a, max_relative = 0.02);
            // gains are noise to the plain sum
            let plain_a = zero_sequence_noise_a(phases).expect("noise");
            assert!(plain_a > found.noise_a, "{plain_a} {found:?}");
        }
    }

    #[test]
    fn gains_beyond_their_mean_and_the_sum_of_the_offsets_are_found() {
        let [a, b, c] = sensed([1.04, 1.01, 1.02], 0.02);
        let found = PhaseSum::of([&a, &b, &c]).expect("noise");
        let mean = (1.04 + 1.01 + 1.02) / 3.0;
        for (found, gain) in found.gains.iter().zip([1.04, 1.01, 1.02]) {
            assert!((found - (gain / mean - 1.0)).abs() < 5e-4, "{found} {gain}");
        }
        assert!((found.offset_sum_a - 0.06).abs() < 2e-3, "{found:?}");
    }

    #[test]
    fn phases_that_were_computed_have_no_noise() {
        let [a, b, c] = sensed([1.01, 0.99, 1.005], 0.0);
        assert_eq!(PhaseSum::of([&a, &b, &c]), None);
    }
}
