//! An emulator of the reference signal itself: a diagnosis without any simulation.
//!
//! ```text
//! y(c) = Σ_p t_p(c)·g_p + r,    r ~ N(0, S + a²·C)
//! ```
//!
//! with `t` the constant, linear and (where left-out signals say so) quadratic terms of the damage
//! coordinates and the signals
//! `g` learnt from reference signals. Since the signal is linear in `t`, the likelihood needs a
//! recording only through its projections on the whitened `g`; everything else is formed
//! beforehand, for a level of the noise grid, with its change about that level:
//!
//! ```text
//! Σ(σ)⁻¹ = Σ_k⁻¹ − δ·Σ_k⁻¹·C·Σ_k⁻¹ + O(δ²),   δ = σ² − σ_k²
//! ```
//!
//! # Source
//!
//! Derived as `docs/models/diagnosis.md` has it in the sections "Error of the monitor" and "Likelihood
//! and search", with a model of the signal in place of one of the error.

use std::sync::{Arc, OnceLock};

use ema_sim::FAULT_COUNT;
use inference::dot;
use nalgebra::{DMatrix, DVector};

use crate::{
    offline::{
        bundle::{Bundle, BundleError},
        error_model::ErrorModel,
        estimator::gram,
    },
    online::likelihood::GridLikelihood,
    statistics::noise_covariance::unit_noise_covariance,
};

/// Damage in the middle of the incipient range, where a search starts.
const START_LEVEL: f64 = 0.02;
/// Coordinates with a sign: no level to start from.
const FIRST_SIGNED: usize = 5;
/// Most Gauss-Newton steps; four are usual.
const MOST_STEPS: usize = 20;
/// Steps below this end a search.
const STEP_TOLERANCE: f64 = 1e-9;
/// An estimate is kept within this distance of the incipient range.
const REACH: f64 = 0.1;

/// The reference signal as a quadratic function of damage, prepared for one noise level.
#[derive(Debug)]
pub struct Emulator {
    model: Arc<ErrorModel>,
    sought: Vec<usize>,
    grid: Arc<GridLikelihood>,
    /// `Σ⁻¹·G`.
    solved: Vec<Vec<f64>>,
    /// `G·Σ⁻¹·Gᵀ`.
    gram: DMatrix<f64>,
    /// `Σ⁻¹·C·Σ⁻¹·G` of the covariance `C` of the noise of one ampere.
    solved_noise: Vec<Vec<f64>>,
    /// `G·Σ⁻¹·C·Σ⁻¹·Gᵀ`.
    noise_gram: DMatrix<f64>,
    /// Reference errors, by folds, formed when first asked for.
    folds: OnceLock<Option<Vec<Fold>>>,
}

/// Reference errors as an emulator sees them that does not know them.
#[derive(Debug)]
struct Fold {
    /// `G·Σ_f⁻¹·Gᵀ` of the covariance without the fold.
    gram: DMatrix<f64>,
    /// Sum of the outer products of `G·Σ_f⁻¹·e` over the errors `e` of the fold.
    products: DMatrix<f64>,
    errors: usize,
}

/// Answer of an emulator to a signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Emulated {
    /// Estimates of the coordinates looked for, free of bounds.
    pub estimate: Vec<f64>,
    /// Covariance of the estimates, row by row.
    pub covariance: Vec<Vec<f64>>,
    /// Mean square of the whitened residual.
    pub misfit: f64,
}

impl Emulator {
    /// Learns from a bundle's reference signals with start angle zero, for white noise on each
    /// phase sample at a rate.
    ///
    /// # Errors
    ///
    /// [`BundleError`] for a bundle with too few reference signals, or without an emulator.
    pub fn learn(bundle: &Bundle, phase_rate_hz: f64, noise_a: f64) -> Result<Self, BundleError> {
        let experiment = &bundle.experiment;
        let unit = unit_noise_covariance(experiment, phase_rate_hz);
        let model = Arc::new(bundle.signal_model()?.ok_or(BundleError::NoEmulator)?);
        let grid = GridLikelihood::new(&model, &Arc::new(unit), noise_a * noise_a, None)?;
        Ok(Self::on(model, experiment.sought_indices(), Arc::new(grid)))
    }

    /// The mean of a model of the signal, with the errors that a likelihood knows.
    pub(crate) fn on(
        model: Arc<ErrorModel>,
        sought: Vec<usize>,
        grid: Arc<GridLikelihood>,
    ) -> Self {
        let (factor, noise) = (grid.whole().factor(), grid.whole().noise());
        let samples = noise.order();
        let white = factor.whiten_each(model.coefficients().iter());
        let gram = gram(&white);
        let solved = factor.spread_each(white, samples);
        let images: Vec<Vec<f64>> = solved.iter().map(|x| noise.times(x)).collect();
        let terms = images.len();
        let noise_gram = DMatrix::from_fn(terms, terms, |i, j| dot(&solved[i], &images[j]));
        let solved_noise = factor.spread_each(factor.whiten_each(images.iter()), samples);
        let folds = OnceLock::new();
        Self { model, sought, grid, solved, gram, solved_noise, noise_gram, folds }
    }

    /// Likelihood of noise and errors of the signal.
    pub(crate) fn grid(&self) -> &Arc<GridLikelihood> {
        &self.grid
    }

    /// Indices of the coordinates looked for.
    pub fn sought(&self) -> &[usize] {
        &self.sought
    }

    /// The signal at a point of the coordinates looked for, A.
    pub fn signal_a(&self, point: &[f64]) -> Vec<f64> {
        self.model.mean_at(point)
    }

    /// Generalised least squares of the emulator to a signal; `None` where the Jacobian leaves a
    /// coordinate undetermined.
    pub fn diagnose(&self, signal_a: &[f64]) -> Option<Emulated> {
        self.diagnose_beside(signal_a, 0.0)
    }

    /// As [`diagnose`](Self::diagnose), where the noise has a variance beyond that of the level
    /// that the emulator is prepared for.
    pub(crate) fn diagnose_beside(&self, signal_a: &[f64], excess_a2: f64) -> Option<Emulated> {
        let estimate = self.nearest(signal_a, excess_a2)?;
        let mut residual_a = self.model.mean_at(&estimate);
        for (value, measured) in residual_a.iter_mut().zip(signal_a) {
            *value = measured - *value;
        }
        let white = self.grid.whole().whiten(&residual_a, excess_a2);
        let misfit = dot(&white, &white) / white.len() as f64;
        let covariance = self.covariance(&self.slopes(&estimate), excess_a2)?;
        let order = estimate.len();
        let row = |i: usize| (0..order).map(|j| covariance[(i, j)]).collect();
        Some(Emulated { estimate, covariance: (0..order).map(row).collect(), misfit })
    }

    /// Where the emulator explains a signal best, with noise of a variance beyond that of the level
    /// that it is prepared for; `None` where the Jacobian leaves a coordinate undetermined.
    pub(crate) fn nearest(&self, signal_a: &[f64], excess_a2: f64) -> Option<Vec<f64>> {
        let (gram, projection) = (self.gram_beside(excess_a2), self.projected(signal_a, excess_a2));
        let mut point: Vec<f64> =
            self.sought.iter().map(|&i| if i < FIRST_SIGNED { START_LEVEL } else { 0.0 }).collect();
        for _ in 0..MOST_STEPS {
            let slopes = self.slopes(&point);
            let weighted = &slopes * &gram;
            let gradient = &slopes * &projection - &weighted * self.terms(&point);
            let step = (weighted * slopes.transpose()).cholesky()?.solve(&gradient);
            let mut length = 0.0f64;
            for (value, part) in point.iter_mut().zip(step.iter()) {
                let moved = (*value + part).clamp(-REACH, REACH);
                length = length.max((moved - *value).abs());
                *value = moved;
            }
            if length < STEP_TOLERANCE {
                break;
            }
        }
        Some(point)
    }

    /// The generalised least-squares step for a residual, with the slopes that the signal has at a
    /// point and noise of a variance beyond that of the level that the emulator is prepared for;
    /// `None` where they leave a coordinate undetermined.
    pub(crate) fn step(
        &self,
        point: &[f64],
        residual_a: &[f64],
        excess_a2: f64,
    ) -> Option<Vec<f64>> {
        let slopes = self.slopes(point);
        let gradient = &slopes * self.projected(residual_a, excess_a2);
        let information = &slopes * self.gram_beside(excess_a2) * slopes.transpose();
        Some(information.cholesky()?.solve(&gradient).as_slice().to_vec())
    }

    /// `G·Σ⁻¹·Gᵀ` of a level beside that which the emulator is prepared for.
    fn gram_beside(&self, excess_a2: f64) -> DMatrix<f64> {
        &self.gram - excess_a2 * &self.noise_gram
    }

    /// `G·Σ⁻¹·y` of a level beside that which the emulator is prepared for.
    fn projected(&self, signal_a: &[f64], excess_a2: f64) -> DVector<f64> {
        let of = |rows: &[Vec<f64>]| {
            DVector::from_iterator(rows.len(), rows.iter().map(|row| dot(row, signal_a)))
        };
        let at_level = of(&self.solved);
        if excess_a2 == 0.0 { at_level } else { at_level - excess_a2 * of(&self.solved_noise) }
    }

    /// Derivatives of the signal at a point, one row a coordinate.
    pub(crate) fn jacobian(&self, point: &[f64]) -> Vec<Vec<f64>> {
        self.model.mean_jacobian(point)
    }

    fn folds(&self) -> Option<&[Fold]> {
        let made = || {
            let (coefficients, mut folds) = (self.model.coefficients(), Vec::new());
            let each = self.grid.folds().each(|factor, errors| {
                let white = factor.whiten_each(coefficients.iter());
                let terms = white.len();
                let mut products = DMatrix::zeros(terms, terms);
                for error in errors {
                    let seen = white.iter().map(|row| dot(row, error));
                    let seen = DVector::from_iterator(terms, seen);
                    products += &seen * seen.transpose();
                }
                folds.push(Fold { gram: gram(&white), products, errors: errors.len() });
            });
            each.ok().map(|()| folds)
        };
        self.folds.get_or_init(made).as_deref()
    }

    /// Noise through the estimator of the level that the emulator is prepared for, which is nearly
    /// the best of a level beside it, and the scatter of reference errors that it does not know.
    fn covariance(&self, slopes: &DMatrix<f64>, excess_a2: f64) -> Option<DMatrix<f64>> {
        let estimator = (slopes * &self.gram * slopes.transpose()).try_inverse()? * slopes;
        let variance_a2 = self.grid.whole().variance_a2() + excess_a2;
        let noise = variance_a2 * (&estimator * &self.noise_gram * estimator.transpose());
        let (mut count, mut scatter) = (0, DMatrix::zeros(slopes.nrows(), slopes.nrows()));
        for fold in self.folds()? {
            let estimator = (slopes * &fold.gram * slopes.transpose()).try_inverse()? * slopes;
            scatter += &estimator * &fold.products * estimator.transpose();
            count += fold.errors;
        }
        Some(noise + scatter / f64::max(count as f64, 1.0))
    }

    fn terms(&self, point: &[f64]) -> DVector<f64> {
        DVector::from_vec(self.model.terms_at(point))
    }

    /// Derivatives of the terms, one row a coordinate.
    fn slopes(&self, point: &[f64]) -> DMatrix<f64> {
        let rows = self.model.slopes_at(point);
        DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
    }
}

const _: () = assert!(FIRST_SIGNED + 2 == FAULT_COUNT);
