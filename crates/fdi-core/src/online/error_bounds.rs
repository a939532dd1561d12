//! Cramér-Rao bounds of a diagnosis at one noise level.

use ema_sim::{FaultCoordinates, PhysicalFaults};
use inference::{central_differences, dot};
use nalgebra::DMatrix;

use crate::{
    Diagnoser,
    offline::{bundle::BundleError, estimator::information, factor::Factor},
    online::{cache::ErrorId, error::DiagnoseError, likelihood::Likelihood},
    simulation::resampling::resampled,
};

/// Differences for the bound's derivatives.
const STEP: f64 = 1e-3;
/// Phases that carry the current at any time, each with noise of its own.
const CONDUCTING_PHASES: f64 = 2.0;

/// The standard deviations that no unbiased estimate of the coordinates looked for can beat.
///
/// ```text
/// sd_i = √[(JᵀΣ⁻¹J)⁻¹]_ii
/// ```
///
/// # Source
///
/// Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, Prentice Hall 1993,
/// section 3.9 (Gaussian noise).
#[derive(Debug)]
pub struct ErrorBounds<'a> {
    diagnoser: &'a Diagnoser,
    likelihood: Likelihood,
    sensor_factor: Factor,
    phase_rate_hz: f64,
    noise_a: f64,
}

/// Bounds of each coordinate looked for, as standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorBound {
    /// On the filtered envelope, with sensor noise and the low-fidelity model's error.
    pub whole_std: Vec<f64>,
    /// On the filtered envelope, with sensor noise alone.
    pub sensor_std: Vec<f64>,
    /// On the raw phase currents, with sensor noise alone.
    pub phase_std: Vec<f64>,
}

impl<'a> ErrorBounds<'a> {
    /// Prepares the covariances for a rate of the phase samples, Hz, and noise on each, A.
    ///
    /// # Errors
    ///
    /// [`DiagnoseError::Covariance`] when a covariance has no factor.
    pub fn new(
        diagnoser: &'a Diagnoser,
        phase_rate_hz: f64,
        noise_a: f64,
    ) -> Result<Self, DiagnoseError> {
        let likelihood = diagnoser.learnt.likelihood(ErrorId::Incipient, phase_rate_hz, noise_a)?;
        let unit = diagnoser.learnt.unit_noise(phase_rate_hz);
        let sensor_factor = Factor::new(unit.scaled(noise_a * noise_a), None)?;
        Ok(Self { diagnoser, likelihood, sensor_factor, phase_rate_hz, noise_a })
    }

    /// The bounds at the truth.
    ///
    /// # Errors
    ///
    /// [`DiagnoseError`] when the experiment cannot be simulated or a coordinate has no effect.
    pub fn at(&self, truth: &FaultCoordinates) -> Result<ErrorBound, DiagnoseError> {
        let experiment = &self.diagnoser.bundle().experiment;
        let simulated = BundleError::from;
        let sought = experiment.sought_indices();
        let centre: Vec<f64> = sought.iter().map(|&i| truth.0[i]).collect();
        let mut monitor = self.diagnoser.learnt.corrected_monitor()?;
        let raw = experiment.low_fidelity(&experiment.scenario).map_err(simulated)?;
        let raw_hz = experiment.actuator.controller.sample_hz;
        let jacobian = central_differences(&centre, STEP, |point| monitor.signal(point));
        let mut current = |point: &[f64]| {
            let all = experiment.all_coordinates(point);
            let mut current_a = Vec::new();
            raw.simulate_current(&PhysicalFaults::from(&all), &mut current_a);
            resampled(&current_a, raw_hz, self.phase_rate_hz)
        };
        let phases = central_differences(&centre, STEP, &mut current);
        let (noise_a, order) = (self.noise_a, sought.len());
        let phase = DMatrix::from_fn(order, order, |i, j| {
            CONDUCTING_PHASES * dot(&phases[i], &phases[j]) / (noise_a * noise_a)
        });
        let std = |covariance: Option<DMatrix<f64>>| -> Result<Vec<f64>, DiagnoseError> {
            let covariance = covariance.ok_or(DiagnoseError::Undetermined)?;
            Ok(covariance.diagonal().iter().map(|v| v.sqrt()).collect())
        };
        Ok(ErrorBound {
            whole_std: std(self.likelihood.bound(&jacobian))?,
            sensor_std: std(information(&self.sensor_factor, &jacobian).try_inverse())?,
            phase_std: std(phase.try_inverse())?,
        })
    }
}
