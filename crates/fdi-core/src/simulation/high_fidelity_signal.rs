//! The diagnosed signal of the high-fidelity model, as a recording's phases are sampled.

use ema_sim::{HighFidelity, Imperfections, PhysicalFaults, SimulationError};

use crate::simulation::{envelope::filtered, experiment::Experiment, resampling::resampled};

/// The high-fidelity model without noise, seen as a recording's phases are sampled.
#[derive(Debug)]
pub(crate) struct HighFidelitySignal {
    experiment: Experiment,
    model: HighFidelity,
    phase_rate_hz: f64,
}

impl HighFidelitySignal {
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
        let all = experiment.all_coordinates(point);
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
}
