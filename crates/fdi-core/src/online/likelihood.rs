//! The likelihood of a recording: generalised least squares on the filtered envelope, whole or
//! encoded.
//!
//! ```text
//! r(c) = y − y_LF(c) − m(c),   r ~ N(0, Σ),   Σ = S + a²·C
//! ```
//!
//! with `S` the covariance of the low-fidelity model's error and `a²·C` that of the sensors' noise
//! after the filter. The stated uncertainty is that of the estimator on errors that it has not
//! seen: each reference error goes through the estimator built without its fold, and the scatter of
//! what comes out is the low-fidelity model's share.
//!
//! Factors are made at the levels of a grid, and what a level beside one has otherwise is taken as a
//! perturbation (`grid_factor`). Those of the folds serve several levels of it (`folds`).
//!
//! # Source
//!
//! Generalised least squares: Aitken (Proc. R. Soc. Edinburgh 55, 1935). The covariance by estimators
//! that have not seen an error is derived in `docs/models/diagnosis.md`, section "Covariance of the
//! estimate".

use std::sync::Arc;

use inference::{BandedMatrix, NotPositiveDefinite, dot};
use nalgebra::{DMatrix, DVector};

use crate::{
    offline::{
        encoding::Encoder,
        error_model::ErrorModel,
        estimator::{combined, gram, symmetric},
    },
    online::{folds::Folds, grid_factor::GridFactor, noise_grid::NoiseLevel},
};

/// A Gaussian model of residuals at one noise level.
#[derive(Clone, Debug)]
pub(crate) struct Likelihood {
    /// Likelihood of the nearest level of the grid, made once for all levels about it.
    grid: Arc<GridLikelihood>,
    /// Variance of the noise beyond that of the grid's level, A².
    excess_a2: f64,
}

/// A Gaussian model of residuals at a noise level of the grid.
#[derive(Debug)]
pub(crate) struct GridLikelihood {
    whole: GridFactor,
    /// Mean variance of a sample, A².
    mean_variance: f64,
    /// Mean variance of a sample by noise of one ampere.
    mean_noise: f64,
    folds: Arc<Folds>,
}

/// Slopes of the signal, one row a coordinate, the same as white numbers, and their information.
#[derive(Debug)]
pub(crate) struct Slopes {
    rows: Vec<Vec<f64>>,
    white: Vec<Vec<f64>>,
    /// `JᵀΣ⁻¹J`.
    information: DMatrix<f64>,
}

impl Slopes {
    /// Slopes of the signal.
    pub(crate) fn rows(&self) -> &[Vec<f64>] {
        &self.rows
    }

    /// The generalised least-squares step for a whitened residual.
    ///
    /// `None` when the slopes leave a coordinate undetermined.
    pub(crate) fn step(&self, white: &[f64]) -> Option<DVector<f64>> {
        let projections = self.white.iter().map(|row| dot(row, white));
        let projected = DVector::from_iterator(self.white.len(), projections);
        Some(self.information.clone().try_inverse()? * projected)
    }

    /// Whitened residual that a step leaves, to first order.
    pub(crate) fn left(&self, white: &[f64], step: &DVector<f64>) -> Vec<f64> {
        let mut left = white.to_vec();
        for (row, part) in self.white.iter().zip(step.iter()) {
            for (value, slope) in left.iter_mut().zip(row) {
                *value -= part * slope;
            }
        }
        left
    }
}

/// Mean square of white numbers: the misfit per sample.
pub(crate) fn misfit(white: &[f64]) -> f64 {
    dot(white, white) / white.len() as f64
}

impl GridLikelihood {
    /// Joins model error and noise at a level of the grid.
    pub(crate) fn new(
        error: &Arc<ErrorModel>,
        unit_noise: &Arc<BandedMatrix>,
        variance_a2: f64,
        encoder: Option<&Arc<Encoder>>,
    ) -> Result<Self, NotPositiveDefinite> {
        let folds = Folds::at(error, unit_noise, variance_a2, encoder);
        Self::with_folds(variance_a2, Arc::new(folds))
    }

    /// Joins model error and noise at a level of the grid, with the folds of a level nearby.
    pub(crate) fn with_folds(
        variance_a2: f64,
        folds: Arc<Folds>,
    ) -> Result<Self, NotPositiveDefinite> {
        let (whole, noise) = (folds.whole_with(variance_a2), folds.noise());
        let (mean_variance, mean_noise) = (whole.mean_diagonal(), noise.mean_diagonal());
        let whole = GridFactor::new(folds.factor(whole)?, Arc::clone(noise), variance_a2);
        Ok(Self { whole, mean_variance, mean_noise, folds })
    }

    /// The factor of the whole covariance.
    pub(crate) fn whole(&self) -> &GridFactor {
        &self.whole
    }

    /// Reference errors seen by estimators that do not know them.
    pub(crate) fn folds(&self) -> &Folds {
        &self.folds
    }
}

impl Likelihood {
    /// Joins model error and noise at any level.
    pub(crate) fn new(
        error: &Arc<ErrorModel>,
        unit_noise: &Arc<BandedMatrix>,
        noise_a: f64,
        encoder: Option<&Arc<Encoder>>,
    ) -> Result<Self, NotPositiveDefinite> {
        let grid = GridLikelihood::new(error, unit_noise, noise_a * noise_a, encoder)?;
        Ok(Self { grid: Arc::new(grid), excess_a2: 0.0 })
    }

    /// The likelihood of a level that belongs to one of the grid.
    pub(crate) fn at(grid: Arc<GridLikelihood>, level: NoiseLevel) -> Self {
        Self { grid, excess_a2: level.excess_a2() }
    }

    /// The likelihood at the level of the grid.
    pub(crate) fn grid(&self) -> &Arc<GridLikelihood> {
        &self.grid
    }

    fn whole(&self) -> &GridFactor {
        &self.grid.whole
    }

    /// `(JᵀΣ⁻¹J)⁻¹`, what no unbiased estimate can beat under this model.
    pub(crate) fn bound(&self, jacobian: &[Vec<f64>]) -> Option<DMatrix<f64>> {
        gram(&self.whiten_each(jacobian.iter())).try_inverse()
    }

    /// A residual as white numbers; their squared length is the misfit.
    pub(crate) fn whiten(&self, residual: &[f64]) -> Vec<f64> {
        self.whole().whiten(residual, self.excess_a2)
    }

    /// White numbers from several residuals.
    pub(crate) fn whiten_each<'r>(
        &self,
        residuals: impl Iterator<Item = &'r Vec<f64>>,
    ) -> Vec<Vec<f64>> {
        self.whole().whiten_each(residuals, self.excess_a2)
    }

    /// White numbers that a residual makes.
    pub(crate) fn size(&self) -> usize {
        self.whole().factor().size()
    }

    /// Root of the mean variance that noise and model error explain, A.
    pub(crate) fn floor_a(&self) -> f64 {
        (self.grid.mean_variance + self.excess_a2 * self.grid.mean_noise).max(0.0).sqrt()
    }

    /// Logarithm of the determinant of `Σ`.
    pub(crate) fn log_determinant(&self) -> f64 {
        self.whole().log_determinant(self.excess_a2)
    }

    /// Slopes of the signal, one row a coordinate, with what is made of them here.
    pub(crate) fn slopes(&self, rows: Vec<Vec<f64>>) -> Slopes {
        let white = self.whiten_each(rows.iter());
        Slopes { information: gram(&white), rows, white }
    }

    /// Covariance of the generalised least-squares estimate.
    ///
    /// `None` when the slopes leave a coordinate undetermined.
    pub(crate) fn estimate_covariance(&self, slopes: &Slopes) -> Option<DMatrix<f64>> {
        self.estimate_covariance_given(slopes, &vec![0.0; slopes.rows.len()])
    }

    /// Covariance where some coordinates are known to be near zero, `N(0, 1/p)` with `p` their
    /// prior precision; 0 for what nothing is known of. With `V = (JᵀΣ⁻¹J + P)⁻¹` the prior
    /// adds `V·P·V`.
    pub(crate) fn estimate_covariance_given(
        &self,
        slopes: &Slopes,
        precision: &[f64],
    ) -> Option<DMatrix<f64>> {
        let order = slopes.rows.len();
        let prior = diagonal(precision);
        let inverse = (&slopes.information + &prior).try_inverse()?;
        let samples = slopes.rows.first().map_or(0, Vec::len);
        let solved = self.whole().spread_each(slopes.white.clone(), samples, self.excess_a2);
        let weights = combined(&inverse, &solved);
        let noise_images: Vec<Vec<f64>> =
            weights.iter().map(|weight| self.whole().noise().times(weight)).collect();
        let variance_a2 = self.whole().variance_a2() + self.excess_a2;
        let mut covariance =
            symmetric(order, |i, j| variance_a2 * dot(&weights[i], &noise_images[j]));
        covariance += self.grid.folds.scatter(&slopes.rows, &prior)?;
        covariance += &inverse * prior * &inverse;
        Some(covariance)
    }

    /// The misfit per sample that a recording of the modelled machine hardly exceeds.
    ///
    /// The misfits of the reference errors, each through the fold that does not know it and with
    /// the expectation of the noise added, are taken as log-normal; `deviations` standard
    /// deviations above their mean is the limit. The noise's own scatter, `√(2/n)`, is included.
    ///
    /// Nothing is below it where a covariance without a fold has no factor.
    pub(crate) fn largest_misfit(&self, deviations: f64) -> f64 {
        let Some((mean, scatter)) = self.grid.folds.misfits() else { return 0.0 };
        let own = 2.0 / self.size() as f64;
        (mean + deviations * (scatter + own).sqrt()).exp()
    }
}

/// A matrix with these on its diagonal.
fn diagonal(values: &[f64]) -> DMatrix<f64> {
    DMatrix::from_diagonal(&DVector::from_column_slice(values))
}
