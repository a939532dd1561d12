//! An experiment: which actuator does what, and which signal of it is diagnosed.

use ema_sim::{
    Actuator, Envelope, EnvelopeFilter, FAULT_COUNT, FaultCoordinates, HighFidelity, Imperfections,
    LowFidelity, PhysicalFaults, Scenario, SimulationError, presets::EMA_48,
};

/// An actuator in a test, with the envelope that is diagnosed and the faults looked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Its name, also that of the command in metadata.
    pub name: String,
    /// Name of the actuator's model.
    pub model_name: String,
    /// The machine.
    pub actuator: Actuator,
    /// The test, with ideal electronics and start angle zero.
    pub scenario: Scenario,
    /// Definition of the envelope.
    pub envelope: Envelope,
    /// Filter and rate of the envelope.
    pub filter: EnvelopeFilter,
    /// Which coordinates of [`FaultCoordinates`] are looked for; the others are zero.
    pub sought: [bool; FAULT_COUNT],
    /// Rate at which the monitor's current is sampled before it is filtered; `None`: that of the
    /// controller.
    pub phase_rate_hz: Option<f64>,
}

impl Experiment {
    /// The chirp of the paper's numerical experiments, all seven faults.
    pub fn chirp() -> Self {
        Self {
            name: "chirp".into(),
            model_name: "ema-48".into(),
            actuator: EMA_48,
            scenario: Scenario::chirp(),
            envelope: Envelope::ConductingPhase,
            filter: EnvelopeFilter::DEFAULT,
            sought: [true; FAULT_COUNT],
            phase_rate_hz: None,
        }
    }

    /// The sine of the paper's bench, friction and backlash alone.
    pub fn sine() -> Self {
        Self {
            name: "sine".into(),
            scenario: Scenario::sine(),
            sought: [true, true, false, false, false, false, false],
            ..Self::chirp()
        }
    }

    /// Samples of the diagnosed signal.
    pub fn samples(&self) -> usize {
        (self.scenario.duration_s * self.filter.output_hz).round() as usize
    }

    /// Indices of the coordinates looked for.
    pub fn sought_indices(&self) -> Vec<usize> {
        (0..FAULT_COUNT).filter(|&i| self.sought[i]).collect()
    }

    /// The high-fidelity model at a start angle.
    ///
    /// # Errors
    ///
    /// [`SimulationError`] for parameters or a test that cannot be simulated.
    pub fn high_fidelity(
        &self,
        start_angle_rad: f64,
        imperfections: Imperfections,
    ) -> Result<HighFidelity, SimulationError> {
        let scenario = Scenario { imperfections, ..self.scenario.clone() };
        HighFidelity::new(&self.actuator, &scenario.turned_to(start_angle_rad))
    }

    /// The diagnosed signal of the high-fidelity model, noise of the sensors apart.
    pub fn high_fidelity_signal(&self, model: &HighFidelity, faults: &PhysicalFaults) -> Vec<f64> {
        let trace = model.simulate(faults);
        let envelope = trace.envelope_a(self.envelope, self.actuator.motor.pole_pairs);
        self.filter.apply(&envelope, trace.rate_hz)
    }

    /// The monitor at a start angle.
    ///
    /// # Errors
    ///
    /// [`SimulationError`] for parameters or a test that cannot be simulated.
    pub fn monitor(&self, start_angle_rad: f64) -> Result<Monitor, SimulationError> {
        self.noisy_monitor(start_angle_rad, Imperfections::NONE, 0)
    }

    /// The monitor with imperfect electronics in its loops.
    pub(crate) fn noisy_monitor(
        &self,
        start_angle_rad: f64,
        imperfections: Imperfections,
        seed: u64,
    ) -> Result<Monitor, SimulationError> {
        let scenario = self.scenario.clone().turned_to(start_angle_rad);
        let scenario = Scenario { imperfections, seed, ..scenario };
        let monitor = Monitor {
            model: LowFidelity::new(&self.actuator, &scenario)?,
            filter: self.filter,
            rate_hz: self.actuator.controller.sample_hz,
            keep_every: 1,
            current_a: Vec::new(),
        };
        Ok(match self.phase_rate_hz {
            Some(rate_hz) => monitor.sampled_at(rate_hz),
            None => monitor,
        })
    }
}

/// The low-fidelity model as a function from damage to the diagnosed signal.
#[derive(Clone, Debug)]
pub struct Monitor {
    model: LowFidelity,
    filter: EnvelopeFilter,
    rate_hz: f64,
    /// The current is sampled at `rate_hz / keep_every`, then filtered.
    keep_every: usize,
    current_a: Vec<f64>,
}

impl Monitor {
    /// Turns the rotor at the start.
    pub fn turn_to(&mut self, start_angle_rad: f64) {
        self.model.turn_to(start_angle_rad);
    }

    /// Samples the current as the sensors of the phases do, where their rate is a whole part of
    /// the controller's; what is filtered afterwards then has the same aliases as a recording.
    #[must_use]
    pub fn sampled_at(mut self, phase_rate_hz: f64) -> Self {
        let ratio = self.rate_hz / phase_rate_hz;
        let whole = ratio >= 1.0 && (ratio - ratio.round()).abs() < 1e-6;
        self.keep_every = if whole { ratio.round() as usize } else { 1 };
        self
    }

    /// Slopes of the signal in some coordinates, one row each: central differences.
    pub fn jacobian(
        &mut self,
        coordinates: &FaultCoordinates,
        indices: &[usize],
        step: f64,
    ) -> Vec<Vec<f64>> {
        indices
            .iter()
            .map(|&index| {
                let mut side = |sign: f64| {
                    let mut moved = *coordinates;
                    moved.0[index] += sign * step;
                    self.signal(&moved)
                };
                let (up, down) = (side(1.0), side(-1.0));
                up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * step)).collect()
            })
            .collect()
    }

    /// The signal at a point of the damage space.
    pub fn signal(&mut self, coordinates: &FaultCoordinates) -> Vec<f64> {
        self.model.simulate_current(&PhysicalFaults::from(coordinates), &mut self.current_a);
        if self.keep_every == 1 {
            return self.filter.apply(&self.current_a, self.rate_hz);
        }
        let kept: Vec<f64> = self.current_a.iter().step_by(self.keep_every).copied().collect();
        self.filter.apply(&kept, self.rate_hz / self.keep_every as f64)
    }
}
