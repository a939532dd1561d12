//! The high-fidelity model as its own monitor, from where the emulator ends and with its slopes.

use super::{
    EvaluationError, EvaluationSetting, contender::Found, convergence::History, in_parallel,
};
use crate::{
    offline::{
        bundle::{Bundle, StartAngle},
        dataset::sought_coordinates,
        error_choice::{self, References},
        error_model::Trend,
    },
    online::{
        emulator::Emulator, error::DiagnoseError, likelihood::Likelihood,
        method::high_fidelity::HighFit,
    },
    simulation::high_fidelity_signal::HighFidelitySignal,
    statistics::noise_covariance::unit_noise_at_rate,
};

/// The high-fidelity model without noise, and what noise does to its signal.
pub(super) struct HighTrial {
    monitor: HighFidelitySignal,
    mask: Vec<usize>,
    likelihood: Likelihood,
}

impl HighTrial {
    /// Learns the controller noise's covariance from the difference between reference signals
    /// and the model without it at the same conditions.
    pub(super) fn learn(
        bundle: &Bundle,
        emulator: &Emulator,
        setting: &EvaluationSetting,
        jobs: usize,
    ) -> Result<Self, EvaluationError> {
        let experiment = bundle.experiment.clone();
        let phase_rate_hz = setting.phase_rate_hz;
        let monitor =
            HighFidelitySignal::new(&experiment, 0.0, setting.imperfections, phase_rate_hz)?;
        let (mut differences, mut coordinates) = (Vec::new(), Vec::new());
        for dataset in bundle.datasets.iter().filter(|d| StartAngle::Zero.has(d.design)) {
            let points = sought_coordinates(&experiment, dataset);
            differences.extend(in_parallel(&points, jobs, |index, point| {
                Ok::<_, EvaluationError>(monitor.residual(&dataset.signals_a[index], point))
            })?);
            coordinates.extend(points);
        }
        let electronics = bundle.electronics(StartAngle::Zero)?;
        let jacobians = coordinates.iter().map(|point| emulator.jacobian(point)).collect();
        let references = References { differences, coordinates, jacobians, electronics };
        let unit = unit_noise_at_rate(&experiment.filter, phase_rate_hz, experiment.samples());
        let noise_a = setting.noise_a();
        let noise = unit.scaled(noise_a * noise_a);
        let (trend, shape) = error_choice::choose(
            &references,
            &[Trend::Constant],
            experiment.filter.output_hz,
            &noise,
        )?;
        let error = references.learn(trend, shape)?;
        let likelihood = Likelihood::new(&error, &unit, noise_a, None)?;
        let mask = bundle.mask.clone();
        Ok(Self { monitor, mask, likelihood })
    }

    /// The model's signal at a point of the coordinates looked for.
    pub(super) fn signal(&self, point: &[f64]) -> Vec<f64> {
        self.monitor.signal(point)
    }

    /// The search of [`HighFidelitySignal::search`].
    pub(super) fn diagnose(
        &self,
        emulator: &Emulator,
        signal_a: &[f64],
        watch: &dyn Fn(&[f64]),
    ) -> Result<Found, EvaluationError> {
        let point = emulator.diagnose(signal_a).ok_or(DiagnoseError::Undetermined)?.estimate;
        let slopes = emulator.jacobian(&point);
        let HighFit { estimate, residual_a, evaluations, .. } = self
            .monitor
            .search(&point, &self.likelihood.slopes(slopes), &self.likelihood, signal_a, watch)
            .ok_or(DiagnoseError::Undetermined)?;
        let discrepancy =
            self.mask.iter().map(|&i| residual_a[i] * residual_a[i]).sum::<f64>().sqrt();
        let (history, std) = (History::default(), Vec::new());
        Ok(Found { estimate, discrepancy, evaluations, history, std })
    }
}
