//! Diagnosis with the high-fidelity model alone, from where the emulator ends and with
//! its slopes.

use std::sync::Arc;

use ema_sim::Imperfections;

use crate::{
    offline::{
        bundle::{Bundle, BundleError, StartAngle},
        dataset::sought_coordinates,
        error_choice::{self, References},
        error_model::Trend,
    },
    online::{emulator::Emulator, likelihood::Likelihood, method::high_fidelity::HighFit},
    simulation::high_fidelity_signal::HighFidelitySignal,
    statistics::{noise_covariance::unit_noise_covariance, parallel::in_parallel},
};

/// The high-fidelity model without noise, and what noise does to its signal.
///
/// The search is a chord Gauss-Newton on the whole envelope of a rotor that starts at angle 0.
#[derive(Debug)]
pub struct HighFidelitySearch {
    monitor: HighFidelitySignal,
    likelihood: Likelihood,
}

/// Settings of a [`HighFidelitySearch`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HighFidelitySettings {
    /// Imperfections of the electronics; the model has them without the controller's noise.
    pub imperfections: Imperfections,
    /// Rate of the phase samples, Hz.
    pub phase_rate_hz: f64,
    /// Noise on each phase sample, quantisation included, A.
    pub noise_a: f64,
    /// Threads that the reference signals are simulated on.
    pub jobs: usize,
}

/// The end of a [`HighFidelitySearch`].
#[derive(Clone, Debug, PartialEq)]
pub struct HighFidelityFit {
    /// Estimates of the coordinates looked for, free of bounds.
    pub estimate: Vec<f64>,
    /// Signal less the model's there, A.
    pub residual_a: Vec<f64>,
    /// Simulations of the high-fidelity model.
    pub evaluations: u64,
}

impl HighFidelitySearch {
    /// Learns the covariance of the controller's noise from the difference between reference
    /// signals and the model without it at the same conditions.
    ///
    /// # Errors
    ///
    /// [`BundleError`] when the experiment cannot be simulated or the covariance has no factor.
    pub fn learn(
        bundle: &Bundle,
        emulator: &Emulator,
        settings: &HighFidelitySettings,
    ) -> Result<Self, BundleError> {
        let experiment = bundle.experiment.clone();
        let HighFidelitySettings { imperfections, phase_rate_hz, noise_a, jobs } = *settings;
        let monitor = HighFidelitySignal::new(&experiment, 0.0, imperfections, phase_rate_hz)?;
        let (mut differences, mut coordinates) = (Vec::new(), Vec::new());
        for dataset in bundle.datasets.iter().filter(|d| StartAngle::Zero.has(d.design)) {
            let points = sought_coordinates(&experiment, dataset);
            differences.extend(in_parallel(&points, jobs, |index, point| {
                Ok::<_, BundleError>(monitor.residual(&dataset.signals_a[index], point))
            })?);
            coordinates.extend(points);
        }
        let electronics = bundle.electronics(StartAngle::Zero);
        let jacobians = coordinates.iter().map(|point| emulator.jacobian(point)).collect();
        let references = References { differences, coordinates, jacobians, electronics };
        let unit = unit_noise_covariance(&experiment, phase_rate_hz);
        let unit = Arc::new(unit);
        let noise = unit.scaled(noise_a * noise_a);
        let (trend, shape) = error_choice::choose(
            &references,
            &[Trend::Constant],
            experiment.filter.output_hz,
            &noise,
        )?;
        let error = references.learn(trend, shape)?;
        let likelihood = Likelihood::new(&Arc::new(error), &unit, noise_a, None)?;
        Ok(Self { monitor, likelihood })
    }

    /// The model's signal at a point of the coordinates looked for, A.
    pub fn signal_a(&self, point: &[f64]) -> Vec<f64> {
        self.monitor.signal(point)
    }

    /// The best point of a search from the emulator's answer, showing the residual of every
    /// simulation as it is made; `None` where the signal leaves a coordinate undetermined.
    pub fn diagnose(
        &self,
        emulator: &Emulator,
        signal_a: &[f64],
        watch: &dyn Fn(&[f64]),
    ) -> Option<HighFidelityFit> {
        let point = emulator.diagnose(signal_a)?.estimate;
        let slopes = self.likelihood.slopes(emulator.jacobian(&point));
        let HighFit { estimate, residual_a, evaluations, .. } =
            self.monitor.search(&point, &slopes, &self.likelihood, signal_a, watch)?;
        Some(HighFidelityFit { estimate, residual_a, evaluations })
    }
}
