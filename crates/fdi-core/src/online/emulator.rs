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
//! beforehand, for one level of noise.
//!
//! # Source
//!
//! Derived as `docs/models/diagnosis.md` has it in the sections "Error of the monitor" and "Likelihood
//! and search", with a model of the signal in place of one of the error.

use std::sync::Arc;

use ema_sim::FAULT_COUNT;
use inference::dot;
use nalgebra::{DMatrix, DVector};

use crate::{
    offline::{
        bundle::{Bundle, BundleError},
        error_model::ErrorModel,
    },
    online::likelihood::Likelihood,
    statistics::noise_covariance::unit_noise_at_rate,
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
    likelihood: Arc<Likelihood>,
    /// `L⁻¹·g_p`.
    whitened: Vec<Vec<f64>>,
    gram: DMatrix<f64>,
    /// `ZᵀL⁻¹·N·L⁻ᵀZ` of the noise's covariance `N`.
    noise_gram: DMatrix<f64>,
    folds: Vec<Fold>,
}

/// Reference errors as an emulator sees them that does not know them.
#[derive(Debug)]
struct Fold {
    gram: DMatrix<f64>,
    projections: Vec<DVector<f64>>,
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
        let unit = unit_noise_at_rate(&experiment.filter, phase_rate_hz, experiment.samples());
        let model = Arc::new(bundle.signal_model()?.ok_or(BundleError::NoEmulator)?);
        let likelihood = Arc::new(Likelihood::new(&model, &unit, noise_a, None)?);
        Ok(Self::on(model, experiment.sought_indices(), likelihood))
    }

    /// The mean of a model of the signal, with the errors that a likelihood knows.
    pub(crate) fn on(
        model: Arc<ErrorModel>,
        sought: Vec<usize>,
        likelihood: Arc<Likelihood>,
    ) -> Self {
        let (factor, noise) = (likelihood.factor(), likelihood.noise());
        let samples = noise.order();
        let whitened = factor.whiten_each(model.coefficients().iter());
        let solved = factor.spread_each(whitened.clone(), samples);
        let images: Vec<Vec<f64>> = solved.iter().map(|x| noise.times(x)).collect();
        let terms = whitened.len();
        let noise_gram = DMatrix::from_fn(terms, terms, |i, j| dot(&solved[i], &images[j]));
        let folds = likelihood
            .folds()
            .map(|(factor, residuals)| {
                let whitened = factor.whiten_each(model.coefficients().iter());
                let white = factor.whiten_each(residuals.iter());
                let projections = white.iter().map(|z| project(&whitened, z)).collect();
                Fold { gram: gram(&whitened), projections }
            })
            .collect();
        let gram = gram(&whitened);
        Self { model, sought, likelihood, whitened, gram, noise_gram, folds }
    }

    /// Likelihood of noise and errors of the signal.
    pub(crate) fn likelihood(&self) -> &Arc<Likelihood> {
        &self.likelihood
    }

    /// The model of the signal.
    pub(crate) fn model(&self) -> &ErrorModel {
        &self.model
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
        let white = self.likelihood.whiten(signal_a);
        let projection = project(&self.whitened, &white);
        let mut point: Vec<f64> =
            self.sought.iter().map(|&i| if i < FIRST_SIGNED { START_LEVEL } else { 0.0 }).collect();
        for _ in 0..MOST_STEPS {
            let terms = self.terms(&point);
            let slopes = self.slopes(&point);
            let gradient = &slopes * (&projection - &self.gram * &terms);
            let step = (&slopes * &self.gram * slopes.transpose()).cholesky()?.solve(&gradient);
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
        let terms = self.terms(&point);
        let explained = 2.0 * projection.dot(&terms) - (&self.gram * &terms).dot(&terms);
        let misfit = (dot(&white, &white) - explained) / white.len() as f64;
        let covariance = self.covariance(&self.slopes(&point))?;
        let order = point.len();
        let row = |i: usize| (0..order).map(|j| covariance[(i, j)]).collect();
        Some(Emulated { estimate: point, covariance: (0..order).map(row).collect(), misfit })
    }

    /// The generalised least-squares step for a residual that is white already, with the slopes
    /// that the signal has at a point; `None` where they leave a coordinate undetermined.
    pub(crate) fn step(&self, point: &[f64], white: &[f64]) -> Option<Vec<f64>> {
        let slopes = self.slopes(point);
        let gradient = &slopes * project(&self.whitened, white);
        let information = &slopes * &self.gram * slopes.transpose();
        Some(information.cholesky()?.solve(&gradient).as_slice().to_vec())
    }

    /// Derivatives of the signal at a point, one row a coordinate.
    pub(crate) fn jacobian(&self, point: &[f64]) -> Vec<Vec<f64>> {
        self.model.mean_jacobian(point)
    }

    /// Noise through the estimator, and the scatter of reference errors that it does not know.
    fn covariance(&self, slopes: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let order = slopes.nrows();
        let inverse = (slopes * &self.gram * slopes.transpose()).try_inverse()?;
        let estimator = &inverse * slopes;
        let mut covariance = &estimator * &self.noise_gram * estimator.transpose();
        let (mut count, mut scatter) = (0.0, DMatrix::zeros(order, order));
        for fold in &self.folds {
            let inverse = (slopes * &fold.gram * slopes.transpose()).try_inverse()?;
            let estimator = inverse * slopes;
            for projection in &fold.projections {
                let shift = &estimator * projection;
                scatter += &shift * shift.transpose();
                count += 1.0;
            }
        }
        covariance += scatter / f64::max(count, 1.0);
        Some(covariance)
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

fn project(whitened: &[Vec<f64>], white: &[f64]) -> DVector<f64> {
    DVector::from_iterator(whitened.len(), whitened.iter().map(|z| dot(z, white)))
}

fn gram(whitened: &[Vec<f64>]) -> DMatrix<f64> {
    let terms = whitened.len();
    DMatrix::from_fn(terms, terms, |i, j| dot(&whitened[i], &whitened[j]))
}

const _: () = assert!(FIRST_SIGNED + 2 == FAULT_COUNT);
