//! Recordings of simulated actuators, as a test bench would have made them.

use ema_sim::{FaultCoordinates, Imperfections, PhaseSensors, PhysicalFaults, SimulationError};

use crate::{
    experiment::Experiment,
    observation::envelope_kind,
    record::{Channel, ChannelName, CommandSource, Metadata, RecordError, Recording},
};

/// What a simulated recording is of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulatedRecording {
    /// Damage.
    pub faults: FaultCoordinates,
    /// Rotor angle at the start, rad.
    pub start_angle_rad: f64,
    /// Imperfections of the electronics.
    pub imperfections: Imperfections,
    /// Seed of the controller's noise.
    pub controller_seed: u64,
    /// The current sensors.
    pub sensors: PhaseSensors,
    /// Seed of the sensors' noise.
    pub sensor_seed: u64,
    /// What the file holds.
    pub content: RecordedContent,
}

/// What a simulated recording holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordedContent {
    /// The three phase currents and the rotor's angle.
    Phases,
    /// The filtered envelope with the start angle in the metadata.
    Envelope,
    /// The filtered envelope without a start angle.
    EnvelopeWithoutAngle,
}

/// Why a recording could not be simulated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimulatedRecordingError {
    /// The actuator or the test cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The channels do not form a recording.
    #[error(transparent)]
    Record(#[from] RecordError),
}

impl SimulatedRecording {
    /// Runs the high-fidelity model and records it.
    ///
    /// # Errors
    ///
    /// [`SimulatedRecordingError`].
    pub fn record(
        &self,
        experiment: &Experiment,
        name: &str,
    ) -> Result<Recording, SimulatedRecordingError> {
        let model = experiment
            .high_fidelity(self.start_angle_rad, self.imperfections)?
            .with_seed(self.controller_seed);
        let mut trace = model.simulate(&PhysicalFaults::from(&self.faults));
        let [a, b, c] = &trace.phase_currents_a;
        trace.phase_currents_a = self.sensors.measure([a, b, c], self.sensor_seed);
        let rate_hz = trace.rate_hz;
        let mut metadata = Metadata {
            command: Some(CommandSource::Named(experiment.name.clone())),
            rate_hz: Some(rate_hz),
            ..Metadata::default()
        };
        if self.content == RecordedContent::Phases {
            let [a, b, c] = trace.phase_currents_a;
            let channels = [
                (ChannelName::PhaseACurrent, a),
                (ChannelName::PhaseBCurrent, b),
                (ChannelName::PhaseCCurrent, c),
                (ChannelName::MotorAngle, trace.motor_angle_rad),
            ]
            .map(|(channel, values)| Channel::uniform(channel, 0.0, rate_hz, values));
            let channels = channels.into_iter().collect::<Result<_, _>>()?;
            return Ok(Recording::new(name, metadata, channels)?);
        }
        let pole_pairs = experiment.actuator.motor.pole_pairs;
        let envelope_a = trace.envelope_a(experiment.envelope, pole_pairs);
        let filtered_a = experiment.filter.apply(&envelope_a, rate_hz);
        let output_hz = experiment.filter.output_hz;
        metadata.rate_hz = Some(output_hz);
        metadata.filter_hz = Some(experiment.filter.corner_hz);
        metadata.envelope = Some(envelope_kind(experiment.envelope));
        metadata.phase_rate_hz = Some(rate_hz);
        if self.content == RecordedContent::Envelope {
            metadata.start_angle_rad = Some(self.start_angle_rad);
        }
        let channel = Channel::uniform(ChannelName::Current, 0.0, output_hz, filtered_a)?;
        Ok(Recording::new(name, metadata, vec![channel])?)
    }
}
