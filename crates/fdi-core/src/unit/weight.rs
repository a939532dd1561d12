//! Covariance that a recording within tolerances is weighed with: noise, the model's learnt error,
//! and a shift in time that is not known.
//!
//! ```text
//! Σ = L·Lᵀ + s²·d·dᵀ        L·Lᵀ noise and learnt error, d = ∂y/∂t, s the shift's standard deviation
//! Σ^(−½) = P·L⁻¹            P = 1 − (1 − 1/√(1 + s²·|w|²))·u·uᵀ,   w = L⁻¹·d,   u = w/|w|
//! τ̂ = −s²·wᵀ·L⁻¹·r/(1 + s²·|w|²)
//! ```
//!
//! so that the shift is marginal in all that is found, to first order.
//!
//! # Source
//!
//! The matrix determinant and inversion lemmas for one row: Golub and Van Loan, *Matrix
//! Computations*, 2.1.4.

use inference::{BandedCholesky, BandedMatrix, NotPositiveDefinite, dot};

use crate::simulation::shifting::rise;

/// A covariance by its factor.
#[derive(Debug)]
pub(crate) struct Weight {
    cholesky: BandedCholesky,
    shift: Option<Shift>,
}

/// A shift in time.
#[derive(Debug)]
struct Shift {
    std_s: f64,
    /// `u`.
    direction: Vec<f64>,
    /// `s·|w|`.
    size: f64,
}

impl Weight {
    pub(crate) fn new(covariance: BandedMatrix) -> Result<Self, NotPositiveDefinite> {
        Ok(Self { cholesky: covariance.cholesky()?, shift: None })
    }

    /// Adds a shift in time of a signal with a standard deviation, s.
    pub(crate) fn with_shift(self, signal: &[f64], rate_hz: f64, std_s: f64) -> Self {
        let mut direction = rise(signal, rate_hz);
        self.cholesky.whiten(&mut direction);
        let norm = dot(&direction, &direction).sqrt();
        if norm == 0.0 {
            return Self { shift: None, ..self };
        }
        for value in &mut direction {
            *value /= norm;
        }
        Self { shift: Some(Shift { std_s, direction, size: std_s * norm }), ..self }
    }

    /// `v ← Σ^(−½)·v`.
    pub(crate) fn whiten(&self, vector: &mut [f64]) {
        self.whiten_each(&mut [vector]);
    }

    /// `v ← Σ^(−½)·v` of several vectors.
    pub(crate) fn whiten_each<V: AsMut<[f64]>>(&self, vectors: &mut [V]) {
        self.cholesky.whiten_each(vectors);
        for vector in vectors.iter_mut() {
            self.shrink(vector.as_mut());
        }
    }

    /// `v ← Σ^(−½)ᵀ·v` of several vectors.
    pub(crate) fn whiten_transposed_each<V: AsMut<[f64]>>(&self, vectors: &mut [V]) {
        for vector in vectors.iter_mut() {
            self.shrink(vector.as_mut());
        }
        self.cholesky.whiten_transposed_each(vectors);
    }

    /// `v ← P·v`.
    fn shrink(&self, vector: &mut [f64]) {
        let Some(Shift { direction, size, .. }) = &self.shift else { return };
        let away = (1.0 - 1.0 / size.hypot(1.0)) * dot(direction, &vector[..direction.len()]);
        for (value, along) in vector.iter_mut().zip(direction) {
            *value -= away * along;
        }
    }

    /// Time by which a signal with a white residual comes late, s, and what a white slope of the model
    /// changes of it; `None` without a shift.
    pub(crate) fn shift_s(&self, white: &[f64]) -> Option<f64> {
        let Shift { std_s, direction, size } = self.shift.as_ref()?;
        Some(-std_s * size / size.hypot(1.0) * dot(direction, &white[..direction.len()]))
    }

    /// Standard deviation of the shift where everything else is known, s.
    pub(crate) fn known_shift_std_s(&self) -> Option<f64> {
        self.shift.as_ref().map(|Shift { std_s, size, .. }| std_s / size.hypot(1.0))
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    const RATE_HZ: f64 = 1e3;

    fn wave(late_s: f64) -> Vec<f64> {
        (0..200).map(|n| (30.0 * (f64::from(n) / RATE_HZ - late_s)).sin()).collect()
    }

    fn weight(std_s: f64) -> Weight {
        let mut noise = BandedMatrix::zeros(200, 1);
        for n in 0..200 {
            *noise.at_mut(n, n) = 1e-4;
        }
        Weight::new(noise).unwrap().with_shift(&wave(0.0), RATE_HZ, std_s)
    }

    #[test]
    fn a_late_signal_is_told() {
        let weight = weight(1e-3);
        let mut residual: Vec<f64> =
            wave(2e-4).iter().zip(wave(0.0)).map(|(seen, model)| seen - model).collect();
        weight.whiten(&mut residual);
        assert_relative_eq!(weight.shift_s(&residual).unwrap(), 2e-4, max_relative = 0.03);
    }

    #[test]
    fn a_square_root_of_the_covariance_makes_white() {
        let weight = weight(1e-3);
        // Σ·x through its own definition
        let x: Vec<f64> = (0..200).map(|n| f64::from(n % 7) - 3.0).collect();
        let slope = rise(&wave(0.0), RATE_HZ);
        let along = 1e-6 * dot(&slope, &x);
        let mut image: Vec<f64> = x.iter().zip(&slope).map(|(x, d)| 1e-4 * x + along * d).collect();
        weight.whiten(&mut image);
        weight.whiten_transposed_each(&mut [&mut image]);
        for (found, expected) in image.iter().zip(&x) {
            assert_relative_eq!(found, expected, epsilon = 1e-9);
        }
    }
}
