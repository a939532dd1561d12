//! Reference errors seen by estimators that do not know them.
//!
//! ```text
//! δ_i = (JᵀΣ_f⁻¹J + P)⁻¹·JᵀΣ_f⁻¹·e_i      Σ_f = S without the fold of i, with noise
//! ```
//!
//! Factors are made at every second level of the noise grid (`noise_grid`): their noise is within
//! 8 % of that of a recording, and an estimator with weights for such a noise errs as the best one,
//! to second order.
//!
//! # Source
//!
//! Derived in `docs/models/diagnosis.md`, section "Covariance of the estimate".

use std::sync::{Arc, OnceLock};

use inference::{BandedMatrix, NotPositiveDefinite, dot};
use nalgebra::{DMatrix, DVector};

use crate::{
    offline::{
        encoding::Encoder,
        error_model::{ErrorModel, FOLDS},
        estimator::gram,
        factor::{Factor, joined_in_place},
    },
    online::{grid_factor::probes, likelihood::misfit},
};

/// Folds of the reference errors at a noise level, their factors made when first asked for.
#[derive(Debug)]
pub(crate) struct Folds {
    error: Arc<ErrorModel>,
    encoder: Option<Arc<Encoder>>,
    /// Covariance of the noise of one ampere.
    noise: Arc<BandedMatrix>,
    variance_a2: f64,
    made: OnceLock<Result<Vec<Fold>, NotPositiveDefinite>>,
    /// Mean and variance of ln(misfit) over the reference errors.
    misfits: OnceLock<(f64, f64)>,
}

/// Errors with the factor of a covariance that does not know them.
#[derive(Debug)]
struct Fold {
    factor: Factor,
    /// The residuals as white numbers.
    white: Vec<Vec<f64>>,
}

impl Fold {
    /// Estimates from each residual of the fold, by the estimator that does not know the fold.
    fn shifts(&self, jacobian: &[Vec<f64>], prior: &DMatrix<f64>) -> Option<Vec<DVector<f64>>> {
        let rows = self.factor.whiten_each(jacobian.iter());
        let inverse = (gram(&rows) + prior).try_inverse()?;
        let project = |white: &Vec<f64>| {
            DVector::from_iterator(rows.len(), rows.iter().map(|row| dot(row, white)))
        };
        Some(self.white.iter().map(|white| &inverse * project(white)).collect())
    }
}

impl Folds {
    /// Folds of which nothing is made yet.
    pub(crate) fn at(
        error: &Arc<ErrorModel>,
        unit_noise: &Arc<BandedMatrix>,
        variance_a2: f64,
        encoder: Option<&Arc<Encoder>>,
    ) -> Self {
        Self {
            error: Arc::clone(error),
            encoder: encoder.cloned(),
            noise: Arc::clone(unit_noise),
            variance_a2,
            made: OnceLock::new(),
            misfits: OnceLock::new(),
        }
    }

    /// Mean square of what the reference errors do to estimates that do not know them, of slopes of
    /// the signal (one row a coordinate) with a prior precision.
    ///
    /// `None` when the slopes leave a coordinate undetermined.
    pub(crate) fn scatter(
        &self,
        slopes: &[Vec<f64>],
        prior: &DMatrix<f64>,
    ) -> Option<DMatrix<f64>> {
        let mut count = 0.0;
        let mut scatter = DMatrix::zeros(slopes.len(), slopes.len());
        for fold in self.made()? {
            for shift in fold.shifts(slopes, prior)? {
                scatter += &shift * shift.transpose();
                count += 1.0;
            }
        }
        Some(scatter / f64::max(count, 1.0))
    }

    /// Mean and variance of ln(misfit) over the reference errors.
    pub(crate) fn misfits(&self) -> Option<(f64, f64)> {
        if let Some(&misfits) = self.misfits.get() {
            return Some(misfits);
        }
        let logs: Vec<f64> = self.made()?.iter().flat_map(|fold| self.log_misfits(fold)).collect();
        Some(*self.misfits.get_or_init(|| mean_and_variance(&logs)))
    }

    /// Shows each fold: the factor of the covariance without it, and its errors as white numbers.
    /// None is kept for it.
    pub(crate) fn each(
        &self,
        mut show: impl FnMut(&Factor, &[Vec<f64>]),
    ) -> Result<(), NotPositiveDefinite> {
        let mut logs = Vec::new();
        for index in 0..FOLDS {
            let fold = self.fold(index)?;
            logs.extend(self.log_misfits(&fold));
            show(&fold.factor, &fold.white);
        }
        self.misfits.get_or_init(|| mean_and_variance(&logs));
        Ok(())
    }

    fn made(&self) -> Option<&[Fold]> {
        let made = || (0..FOLDS).map(|index| self.fold(index)).collect();
        self.made.get_or_init(made).as_deref().ok()
    }

    /// Covariance of all errors, with noise of a variance.
    pub(crate) fn whole_with(&self, variance_a2: f64) -> BandedMatrix {
        joined_in_place(self.error.covariance(), variance_a2, &self.noise)
    }

    /// Covariance of the noise of one ampere.
    pub(crate) fn noise(&self) -> &Arc<BandedMatrix> {
        &self.noise
    }

    /// Factor of a covariance as it is looked at.
    pub(crate) fn factor(&self, covariance: BandedMatrix) -> Result<Factor, NotPositiveDefinite> {
        Factor::new(covariance, self.encoder.as_ref())
    }

    fn fold(&self, index: usize) -> Result<Fold, NotPositiveDefinite> {
        let without = self.error.covariance_without(index);
        let factor = self.factor(joined_in_place(without, self.variance_a2, &self.noise))?;
        let white = factor.whiten_each(self.error.in_fold(index));
        Ok(Fold { factor, white })
    }

    /// ln(misfit) of the reference errors of a fold, the expectation of the noise added.
    fn log_misfits(&self, fold: &Fold) -> Vec<f64> {
        let noise = self.noise_share(&fold.factor);
        fold.white.iter().map(|white| (misfit(white) + noise).ln()).collect()
    }

    /// Expectation of the misfit per sample from noise alone, `tr(Σ⁻¹·N)/n`, from a few probing
    /// vectors of ±1 (Hutchinson, Commun. Stat. Simul. Comput. 19, 1990); their scatter is below
    /// a hundredth here.
    fn noise_share(&self, factor: &Factor) -> f64 {
        const PROBES: usize = 4;
        let (noise, variance_a2) = (&*self.noise, self.variance_a2);
        if let Some(share) = factor.exact_share(noise) {
            return variance_a2 * share;
        }
        let order = noise.order();
        let probes = probes(PROBES, order);
        let mut images: Vec<Vec<f64>> = probes.iter().map(|probe| noise.times(probe)).collect();
        images = factor.spread_each(factor.whiten_each(images.iter()), order);
        let sum: f64 = probes.iter().zip(&images).map(|(probe, image)| dot(probe, image)).sum();
        variance_a2 * sum / (PROBES as f64 * order as f64)
    }
}

fn mean_and_variance(logs: &[f64]) -> (f64, f64) {
    let count = logs.len().max(2) as f64;
    let mean = logs.iter().sum::<f64>() / count;
    let scatter = logs.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (count - 1.0);
    (mean, scatter)
}
