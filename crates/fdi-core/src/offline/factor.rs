//! Covariances of residuals and their factors, of whole or encoded signals.
//!
//! ```text
//! z = L⁻¹·E·r,   L·Lᵀ = E·Σ·Eᵀ
//! ```
//!
//! with `E` the rows of an encoder, or the identity for the whole signal.

use std::sync::Arc;

use inference::{BandedCholesky, BandedMatrix, NotPositiveDefinite};

use crate::offline::encoding::Encoder;

/// White floor of every covariance, A: far below any sensor, far above rounding. It keeps
/// samples that are zero in all reference signals (the start) from being trusted absolutely.
pub(crate) const FLOOR_A: f64 = 1e-5;

/// Sum of the covariances, with the floor.
pub(crate) fn joined(model: &BandedMatrix, noise: &BandedMatrix) -> BandedMatrix {
    let mut whole = model.plus(noise);
    whole.add_to_diagonal(FLOOR_A * FLOOR_A);
    whole
}

/// As [`joined`], with noise of a variance, in the memory of the model's covariance.
pub(crate) fn joined_in_place(
    model: BandedMatrix,
    variance_a2: f64,
    unit_noise: &BandedMatrix,
) -> BandedMatrix {
    let mut whole = model.plus_scaled(variance_a2, unit_noise);
    whole.add_to_diagonal(FLOOR_A * FLOOR_A);
    whole
}

/// Factor of the covariance of what a diagnosis looks at.
#[derive(Debug)]
pub(crate) struct Factor {
    encoder: Option<Arc<Encoder>>,
    cholesky: BandedCholesky,
    size: usize,
}

impl Factor {
    /// Factors the covariance of a signal, or that of what an encoder makes of it.
    pub(crate) fn new(
        covariance: BandedMatrix,
        encoder: Option<&Arc<Encoder>>,
    ) -> Result<Self, NotPositiveDefinite> {
        let seen = match encoder {
            Some(encoder) => encoder.covariance(&covariance),
            None => covariance,
        };
        let size = seen.order();
        Ok(Self { encoder: encoder.cloned(), cholesky: seen.cholesky()?, size })
    }

    /// Numbers that are looked at.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// White numbers from a residual of full length.
    pub(crate) fn whiten(&self, residual: &[f64]) -> Vec<f64> {
        let mut seen = match &self.encoder {
            Some(encoder) => encoder.encode(residual),
            None => residual.to_vec(),
        };
        self.cholesky.whiten(&mut seen);
        seen
    }

    /// White numbers from several residuals.
    pub(crate) fn whiten_each<'r>(
        &self,
        residuals: impl Iterator<Item = &'r Vec<f64>>,
    ) -> Vec<Vec<f64>> {
        let see = |residual: &Vec<f64>| match &self.encoder {
            Some(encoder) => encoder.encode(residual),
            None => residual.clone(),
        };
        let mut seen: Vec<Vec<f64>> = residuals.map(see).collect();
        self.cholesky.whiten_each(&mut seen);
        seen
    }

    /// `Eᵀ·L⁻ᵀ·z` of several rows of white numbers, of full length: after
    /// [`whiten_each`](Self::whiten_each) this is `Eᵀ·(E·Σ·Eᵀ)⁻¹·E·r`.
    pub(crate) fn spread_each(&self, mut white: Vec<Vec<f64>>, samples: usize) -> Vec<Vec<f64>> {
        self.cholesky.whiten_transposed_each(&mut white);
        match &self.encoder {
            Some(encoder) => white.iter().map(|row| encoder.spread(row, samples)).collect(),
            None => white,
        }
    }

    /// Logarithm of the determinant of the covariance.
    pub(crate) fn log_determinant(&self) -> f64 {
        self.cholesky.log_determinant()
    }

    /// The part of a misfit of one a number that a noise of covariance `N` has,
    /// `tr((E·Σ·Eᵀ)⁻¹·E·N·Eᵀ)/size`; `None` for the whole signal, where it is estimated.
    pub(crate) fn exact_share(&self, noise: &BandedMatrix) -> Option<f64> {
        let encoder = self.encoder.as_ref()?;
        let covariance = encoder.covariance(noise);
        let trace: f64 = (0..self.size)
            .map(|j| {
                let mut column: Vec<f64> = (0..self.size).map(|i| covariance.at(i, j)).collect();
                self.cholesky.whiten(&mut column);
                self.cholesky.whiten_transposed(&mut column);
                column[j]
            })
            .sum();
        Some(trace / self.size as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Encoding;
    use approx::assert_abs_diff_eq;

    /// Two solves of order 12 with condition below 10.
    const SOLVE_ABS: f64 = 1e-13;

    fn covariance() -> BandedMatrix {
        let mut whole = BandedMatrix::zeros(12, 2);
        for i in 0..12_usize {
            for j in i.saturating_sub(2)..=i {
                *whole.at_mut(i, j) = if i == j { 2.0 } else { 0.5 / (i - j) as f64 };
            }
        }
        whole
    }

    /// A row that picks one of twelve samples.
    fn unit(sample: usize) -> Vec<f64> {
        (0..12).map(|at| f64::from(u8::from(at == sample))).collect()
    }

    fn encoder(rows: Vec<Vec<f64>>) -> Arc<Encoder> {
        Arc::new(Encoder::new(Encoding::Modes, rows))
    }

    #[test]
    fn a_square_encoder_loses_nothing() {
        // any invertible E leaves r'Σ⁻¹r as it is
        let rows = (0..12)
            .map(|i| {
                (0..12).map(|j| if i == j { 2.0 } else { 0.1 * f64::from(i - j).sin() }).collect()
            })
            .collect();
        let whole = Factor::new(covariance(), None).unwrap();
        let encoded = Factor::new(covariance(), Some(&encoder(rows))).unwrap();
        let residual: Vec<f64> = (0..12).map(|i| (0.9 * f64::from(i)).sin()).collect();
        let solve = |factor: &Factor| {
            let white = factor.whiten(&residual);
            factor.spread_each(vec![white], residual.len()).remove(0)
        };
        for (a, b) in solve(&whole).iter().zip(solve(&encoded)) {
            assert_abs_diff_eq!(*a, b, epsilon = SOLVE_ABS);
        }
        let square = |factor: &Factor| factor.whiten(&residual).iter().map(|z| z * z).sum::<f64>();
        assert_abs_diff_eq!(square(&whole), square(&encoded), epsilon = SOLVE_ABS);
        // of noise that is all there is, every number has one
        assert_abs_diff_eq!(encoded.exact_share(&covariance()).unwrap(), 1.0, epsilon = SOLVE_ABS);
    }

    #[test]
    fn a_picked_sample_has_its_own_variance() {
        let factor = Factor::new(covariance(), Some(&encoder(vec![unit(5)]))).unwrap();
        let residual: Vec<f64> = (0..12).map(f64::from).collect();
        assert_eq!(factor.size(), 1);
        assert_abs_diff_eq!(factor.whiten(&residual)[0], 5.0 / 2f64.sqrt(), epsilon = SOLVE_ABS);
        assert_abs_diff_eq!(factor.log_determinant(), 2f64.ln(), epsilon = SOLVE_ABS);
    }
}
