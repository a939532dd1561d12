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
        let scenario = self.scenario.clone().turned_to(start_angle_rad);
        Ok(Monitor {
            model: LowFidelity::new(&self.actuator, &scenario)?,
            filter: self.filter,
            rate_hz: self.actuator.controller.sample_hz,
            current_a: Vec::new(),
        })
    }
}

/// The low-fidelity model as a function from damage to the diagnosed signal.
#[derive(Clone, Debug)]
pub struct Monitor {
    model: LowFidelity,
    filter: EnvelopeFilter,
    rate_hz: f64,
    current_a: Vec<f64>,
}

impl Monitor {
    /// Turns the rotor at the start.
    pub fn turn_to(&mut self, start_angle_rad: f64) {
        self.model.turn_to(start_angle_rad);
    }

    /// The signal at a point of the damage space.
    pub fn signal(&mut self, coordinates: &FaultCoordinates) -> Vec<f64> {
        self.model.simulate_current(&PhysicalFaults::from(coordinates), &mut self.current_a);
        self.filter.apply(&self.current_a, self.rate_hz)
    }
}
