//! The diagnosed signal of the high-fidelity model, as a recording's phases are sampled.

use ema_sim::{HighFidelity, Imperfections, PhysicalFaults, SimulationError};

use crate::simulation::{envelope::filtered, experiment::Experiment, sampled::sampled_at};

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
        let faults = PhysicalFaults::from(&all);
        let trace = if self.phase_rate_hz == self.model.tick_hz() {
            self.model.simulate(&faults)
        } else {
            match sampled_at(&self.model, &faults, self.phase_rate_hz) {
                Ok((_, sampled)) => sampled,
                // a shaft that is driven away has no signal
                Err(_) => return vec![f64::NAN; experiment.samples()],
            }
        };
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
