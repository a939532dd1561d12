//! Noise of the control electronics, reproducible on every platform.

use core::f64::consts::TAU;

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

/// A stream of random numbers from a named generator and `libm` functions alone.
#[derive(Clone, Debug)]
pub(crate) struct NoiseSource {
    generator: ChaCha8Rng,
    spare: Option<f64>,
}

impl NoiseSource {
    /// A stream; equal seeds give equal streams.
    pub(crate) fn new(seed: u64) -> Self {
        Self { generator: ChaCha8Rng::seed_from_u64(seed), spare: None }
    }

    /// Uniform on `[0, 1)`, 53 bits.
    fn unit(&mut self) -> f64 {
        (self.generator.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform on `[−1, 1)`.
    pub(crate) fn symmetric(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Standard normal (Box and Muller's pairs).
    pub(crate) fn normal(&mut self) -> f64 {
        if let Some(value) = self.spare.take() {
            return value;
        }
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.unit()));
        let (sin, cos) = libm::sincos(TAU * self.unit());
        self.spare = Some(radius * sin);
        radius * cos
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    #[test]
    fn law_moments_of_the_normal() {
        let mut source = NoiseSource::new(3);
        let n = 100_000;
        let draws: Vec<f64> = (0..n).map(|_| source.normal()).collect();
        let mean = draws.iter().sum::<f64>() / f64::from(n);
        let variance = draws.iter().map(|x| x * x).sum::<f64>() / f64::from(n);
        // five standard errors: 1/√n and √(2/n); false failure below 1e-6, and seeded
        assert_abs_diff_eq!(mean, 0.0, epsilon = 5.0 / f64::from(n).sqrt());
        assert_abs_diff_eq!(variance, 1.0, epsilon = 5.0 * (2.0 / f64::from(n)).sqrt());
        assert_ne!(NoiseSource::new(4).normal(), draws[0], "another seed must differ");
    }
}
