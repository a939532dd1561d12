//! The high-fidelity model as its own monitor.
//!
//! A search goes on with slopes that are given, a chord: the signal's own differences are rough in
//! the damage (commutation instants).

use ema_sim::{
    FAULT_COUNT, FaultCoordinates, HighFidelity, Imperfections, PhysicalFaults, SimulationError,
};

use crate::{
    bundle::sought_coordinates,
    dataset::Dataset,
    experiment::Experiment,
    likelihood::{Likelihood, Slopes, misfit},
    observation::filtered,
    simulated::resampled,
};

/// Most evaluations of the model in one search.
const MOST_EVALUATIONS: u64 = 12;
/// Steps below this end a search.
const STEP_TOLERANCE: f64 = 1e-6;

/// The high-fidelity model without noise, seen as a recording's phases are sampled.
#[derive(Debug)]
pub(crate) struct HighMonitor {
    experiment: Experiment,
    model: HighFidelity,
    phase_rate_hz: f64,
}

/// Where a search ended.
pub(crate) struct HighFit {
    /// Estimates of the coordinates looked for.
    pub(crate) estimate: Vec<f64>,
    /// Residual there, A.
    pub(crate) residual_a: Vec<f64>,
    /// Mean square of the whitened residual.
    pub(crate) misfit: f64,
    pub(crate) evaluations: u64,
}

impl HighMonitor {
    /// The model at a start angle, with the imperfections of the electronics less their noise.
    pub(crate) fn new(
        experiment: &Experiment,
        start_angle_rad: f64,
        imperfections: Imperfections,
        phase_rate_hz: f64,
    ) -> Result<Self, SimulationError> {
        let quiet = Imperfections { controller_noise: false, ..imperfections };
        let model = experiment.high_fidelity(start_angle_rad, quiet)?;
        Ok(Self { experiment: experiment.clone(), model, phase_rate_hz })
    }

    /// The signal at a point of the coordinates looked for, A.
    pub(crate) fn signal(&self, point: &[f64]) -> Vec<f64> {
        let experiment = &self.experiment;
        let mut all = FaultCoordinates([0.0; FAULT_COUNT]);
        for (index, &value) in experiment.sought_indices().into_iter().zip(point) {
            all.0[index] = value;
        }
        let mut trace = self.model.simulate(&PhysicalFaults::from(&all));
        for channel in &mut trace.phase_currents_a {
            *channel = resampled(channel, trace.rate_hz, self.phase_rate_hz);
        }
        trace.motor_angle_rad =
            resampled(&trace.motor_angle_rad, trace.rate_hz, self.phase_rate_hz);
        trace.rate_hz = self.phase_rate_hz;
        let pole_pairs = experiment.actuator.motor.pole_pairs;
        let envelope_a = trace.envelope_a(experiment.envelope, pole_pairs);
        filtered(&envelope_a, self.phase_rate_hz, experiment)
    }

    /// A signal less the model's at a point, A.
    pub(crate) fn residual(&self, signal_a: &[f64], point: &[f64]) -> Vec<f64> {
        let mut residual = self.signal(point);
        for (value, measured) in residual.iter_mut().zip(signal_a) {
            *value = measured - *value;
        }
        residual
    }

    /// Chord Gauss-Newton from a point with slopes of the signal there; the best point seen is
    /// the answer. `None` where the slopes leave a coordinate undetermined.
    pub(crate) fn search(
        &self,
        start: &[f64],
        slopes: &Slopes,
        likelihood: &Likelihood,
        signal_a: &[f64],
        watch: &dyn Fn(&[f64]),
    ) -> Option<HighFit> {
        let mut point = start.to_vec();
        let mut best: Option<HighFit> = None;
        for evaluations in 1..=MOST_EVALUATIONS {
            let residual_a = self.residual(signal_a, &point);
            watch(&residual_a);
            let white = likelihood.whiten(&residual_a);
            let misfit = misfit(&white);
            let step = slopes.step(&white)?;
            if best.as_ref().is_none_or(|fit| misfit < fit.misfit) {
                best = Some(HighFit { estimate: point.clone(), residual_a, misfit, evaluations });
            }
            for (value, part) in point.iter_mut().zip(step.iter()) {
                *value += part;
            }
            if let Some(fit) = &mut best {
                fit.evaluations = evaluations;
            }
            if step.amax() < STEP_TOLERANCE {
                break;
            }
        }
        best
    }
}

/// What the noise of the electronics adds to the reference signals of a dataset: these less the
/// model without noise at the same conditions.
pub(crate) fn electronics_noise(
    experiment: &Experiment,
    dataset: &Dataset,
) -> Result<Vec<Vec<f64>>, SimulationError> {
    let rate_hz = experiment.phase_rate_hz.unwrap_or(experiment.actuator.controller.sample_hz);
    let points = sought_coordinates(experiment, dataset);
    let conditions = dataset.conditions.iter().zip(&dataset.signals_a).zip(points);
    conditions
        .map(|((condition, reference), point)| {
            let (start_rad, electronics) = (condition.start_angle_rad, dataset.imperfections);
            let monitor = HighMonitor::new(experiment, start_rad, electronics, rate_hz)?;
            Ok(monitor.residual(reference, &point))
        })
        .collect()
}
