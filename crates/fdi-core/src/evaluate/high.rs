//! The high-fidelity model as its own monitor.
//!
//! The search begins where the emulator ends and goes on with the emulator's Jacobian: the
//! signal's own differences are rough in the damage (commutation instants), a chord is not.

use ema_sim::{FaultCoordinates, HighFidelity, Imperfections, PhysicalFaults};

use super::{
    EvaluationError, EvaluationSetting, contender::Found, convergence::History, in_parallel,
};
use crate::{
    bundle::{Bundle, StartAngle, sought_coordinates},
    diagnose::DiagnoseError,
    emulator::Emulator,
    error_choice::{self, References},
    error_model::Trend,
    experiment::Experiment,
    likelihood::Likelihood,
    noise_covariance::unit_noise_at_rate,
    observation::filtered,
    simulated::resampled,
};

/// Most evaluations of the model in one diagnosis.
const MOST_EVALUATIONS: u64 = 12;
/// Steps below this end a search.
const STEP_TOLERANCE: f64 = 1e-6;

/// The high-fidelity model without noise, and what noise does to its signal.
pub(super) struct HighMonitor {
    experiment: Experiment,
    model: HighFidelity,
    phase_rate_hz: f64,
    mask: Vec<usize>,
    likelihood: Likelihood,
}

impl HighMonitor {
    /// Learns the controller noise's covariance from the difference between reference signals
    /// and the model without it at the same conditions.
    pub(super) fn learn(
        bundle: &Bundle,
        emulator: &Emulator,
        setting: &EvaluationSetting,
        jobs: usize,
    ) -> Result<Self, EvaluationError> {
        let experiment = bundle.experiment.clone();
        let imperfections = Imperfections { controller_noise: false, ..setting.imperfections };
        let model = experiment.high_fidelity(0.0, imperfections)?;
        let phase_rate_hz = setting.phase_rate_hz;
        let (mut differences, mut coordinates) = (Vec::new(), Vec::new());
        for dataset in bundle.datasets.iter().filter(|d| StartAngle::Zero.has(d.design)) {
            let points = sought_coordinates(&experiment, dataset);
            differences.extend(in_parallel(&points, jobs, |index, point| {
                let mut difference = signal(&experiment, &model, phase_rate_hz, point);
                for (value, reference) in difference.iter_mut().zip(&dataset.signals_a[index]) {
                    *value = reference - *value;
                }
                Ok::<_, EvaluationError>(difference)
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
        Ok(Self { experiment, model, phase_rate_hz, mask, likelihood })
    }

    /// The model's signal at a point of the coordinates looked for.
    pub(super) fn signal(&self, point: &[f64]) -> Vec<f64> {
        signal(&self.experiment, &self.model, self.phase_rate_hz, point)
    }

    /// Chord Gauss-Newton from the emulator's estimate; the best point seen is the answer.
    pub(super) fn diagnose(
        &self,
        emulator: &Emulator,
        signal_a: &[f64],
        watch: &dyn Fn(&[f64]),
    ) -> Result<Found, EvaluationError> {
        let mut point = emulator.diagnose(signal_a).ok_or(DiagnoseError::Undetermined)?.estimate;
        let jacobian = emulator.jacobian(&point);
        let mut best: Option<(f64, Vec<f64>, Vec<f64>)> = None;
        let mut evaluations = 0;
        while evaluations < MOST_EVALUATIONS {
            let mut residual = self.signal(&point);
            for (value, measured) in residual.iter_mut().zip(signal_a) {
                *value = measured - *value;
            }
            evaluations += 1;
            watch(&residual);
            let white = self.likelihood.whiten(&residual);
            let misfit: f64 = white.iter().map(|z| z * z).sum();
            let (step, _) = self
                .likelihood
                .linear_step(&jacobian, &residual)
                .ok_or(DiagnoseError::Undetermined)?;
            if best.as_ref().is_none_or(|(least, ..)| misfit < *least) {
                best = Some((misfit, point.clone(), residual));
            }
            for (value, part) in point.iter_mut().zip(step.iter()) {
                *value += part;
            }
            if step.amax() < STEP_TOLERANCE {
                break;
            }
        }
        let (_, estimate, residual) = best.ok_or(DiagnoseError::Undetermined)?;
        let discrepancy = self.mask.iter().map(|&i| residual[i] * residual[i]).sum::<f64>().sqrt();
        Ok(Found {
            estimate,
            discrepancy,
            evaluations,
            history: History::default(),
            std: Vec::new(),
        })
    }
}

fn signal(
    experiment: &Experiment,
    model: &HighFidelity,
    phase_rate_hz: f64,
    point: &[f64],
) -> Vec<f64> {
    let mut all = FaultCoordinates([0.0; ema_sim::FAULT_COUNT]);
    for (index, &value) in experiment.sought_indices().into_iter().zip(point) {
        all.0[index] = value;
    }
    let mut trace = model.simulate(&PhysicalFaults::from(&all));
    for channel in &mut trace.phase_currents_a {
        *channel = resampled(channel, trace.rate_hz, phase_rate_hz);
    }
    trace.motor_angle_rad = resampled(&trace.motor_angle_rad, trace.rate_hz, phase_rate_hz);
    trace.rate_hz = phase_rate_hz;
    let envelope_a = trace.envelope_a(experiment.envelope, experiment.actuator.motor.pole_pairs);
    filtered(&envelope_a, phase_rate_hz, experiment)
}
