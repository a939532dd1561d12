//! Recordings of simulated actuators, as a test bench would have made them.

use ema_sim::{
    Commutation, Envelope, FaultCoordinates, HighFidelity, HighFidelityTrace, Imperfections,
    PhaseSensors, PhysicalFaults, Scenario, SimulationError, VisitedRange,
};

use recordings::{Channel, ChannelName, CommandSource, Metadata, RecordError, Recording};

use crate::simulation::{
    envelope::{envelope_kind, filtered},
    experiment::{Experiment, RECORDED},
    resampling::resampled,
    sampled::sampled_at,
};

/// Beyond the converters of any drive, Hz.
const FASTEST_PHASES_HZ: f64 = 1e7;
/// Samples of a recording: those of a simulated hour at 10 kHz.
const MOST_SAMPLES: f64 = 4e7;

/// Request for a simulated recording.
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
    /// Rate of the phase samples; `None`: that of the drive's controller.
    pub phase_rate_hz: Option<f64>,
    /// Seed of the sensors' noise.
    pub sensor_seed: u64,
    /// Content of the file.
    pub content: RecordedContent,
    /// True where the voltage that the drive puts on the motor is recorded beside currents at the rate
    /// of the phases: along the quadrature axis of a field-oriented drive.
    pub has_voltage: bool,
}

/// Content of a simulated recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordedContent {
    /// The three phase currents and the rotor's angle.
    Phases,
    /// The quadrature-axis current of a field-oriented drive, at the rate of the phases, and the
    /// rotor's angle.
    Quadrature,
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
    /// Fewer than two samples.
    #[error("a rate of {rate_hz} Hz leaves less than two samples, expected at least {least_hz} Hz")]
    TooSlow {
        /// Rate asked for.
        rate_hz: f64,
        /// Least rate that leaves two.
        least_hz: f64,
    },
    /// Faster than any converter, or more samples than a recording holds.
    #[error("a rate of {rate_hz} Hz, expected at most {most_hz} Hz for {duration_s} s")]
    TooFast {
        /// Rate asked for.
        rate_hz: f64,
        /// Greatest rate of a recording of that length.
        most_hz: f64,
        /// Length of the recording.
        duration_s: f64,
    },
    /// The channels do not form a recording.
    #[error(transparent)]
    Record(#[from] RecordError),
}

impl SimulatedRecording {
    /// Checks a rate of the phases that is asked for in a recording of some length.
    ///
    /// # Errors
    ///
    /// [`SimulatedRecordingError::TooFast`] beyond 10 MHz and beyond 40 million samples.
    fn check_fastest(rate_hz: f64, duration_s: f64) -> Result<(), SimulatedRecordingError> {
        let most_hz = FASTEST_PHASES_HZ.min(MOST_SAMPLES / duration_s);
        if rate_hz > most_hz {
            return Err(SimulatedRecordingError::TooFast { rate_hz, most_hz, duration_s });
        }
        Ok(())
    }

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
        self.record_visited(experiment, name).map(|(recording, _)| recording)
    }

    /// As [`record`](Self::record), with where the machine has been.
    ///
    /// # Errors
    ///
    /// [`SimulatedRecordingError`].
    pub fn record_visited(
        &self,
        experiment: &Experiment,
        name: &str,
    ) -> Result<(Recording, VisitedRange), SimulatedRecordingError> {
        self.check_most(experiment)?;
        let model = experiment
            .high_fidelity(self.start_angle_rad, self.imperfections)?
            .with_seed(self.controller_seed);
        let faults = PhysicalFaults::from(&self.faults);
        let (trace, visited) = self.sampled(&model, &faults, experiment)?;
        Ok((self.of_trace(trace, experiment, name)?, visited))
    }

    /// A motion of the high-fidelity model as the phases are sampled, and where it has been.
    pub(crate) fn sampled(
        &self,
        model: &HighFidelity,
        faults: &PhysicalFaults,
        experiment: &Experiment,
    ) -> Result<(HighFidelityTrace, VisitedRange), SimulatedRecordingError> {
        let load_n_m = experiment.scenario.load_n_m;
        let Some(rate_hz) = self.phase_rate_hz.filter(|rate_hz| *rate_hz != model.tick_hz()) else {
            let trace = model.try_simulate(faults)?;
            let visited = trace.visited_range(load_n_m);
            return Ok((trace, visited));
        };
        self.check_rate(model.tick_hz(), model.samples())?;
        let (trace, sampled) = sampled_at(model, faults, rate_hz)?;
        Ok((sampled, trace.visited_range(load_n_m)))
    }

    /// Records a motion of the high-fidelity model.
    pub(crate) fn of_trace(
        &self,
        mut trace: HighFidelityTrace,
        experiment: &Experiment,
        name: &str,
    ) -> Result<Recording, SimulatedRecordingError> {
        let [a, b, c] = &trace.phase_currents_a;
        trace.phase_currents_a = self.sensors.measure([a, b, c], self.sensor_seed);
        let rate_hz = trace.rate_hz;
        let voltage = self.has_voltage.then(|| {
            let name = match experiment.actuator.inverter.commutation {
                Commutation::FieldOriented => ChannelName::QAxisVoltage,
                _ => ChannelName::MotorVoltage,
            };
            (name, core::mem::take(&mut trace.motor_voltage_v))
        });
        let metadata = Metadata {
            command: Some(command_source(experiment)),
            rate_hz: Some(rate_hz),
            load_n_m: load_to_state(experiment),
            ..Metadata::default()
        };
        if self.content == RecordedContent::Phases {
            let [a, b, c] = trace.phase_currents_a;
            let mut channels = [
                (ChannelName::PhaseACurrent, a),
                (ChannelName::PhaseBCurrent, b),
                (ChannelName::PhaseCCurrent, c),
                (ChannelName::MotorAngle, trace.motor_angle_rad),
            ]
            .into_iter()
            .chain(voltage)
            .map(|(channel, values)| Channel::uniform(channel, 0.0, rate_hz, values))
            .collect::<Result<Vec<_>, _>>()?;
            if experiment.name == RECORDED {
                let command_rad = trace.command_rad;
                channels.push(Channel::uniform(ChannelName::Command, 0.0, rate_hz, command_rad)?);
            }
            return Ok(Recording::new(name, metadata, channels)?);
        }
        let pole_pairs = experiment.actuator.motor.pole_pairs;
        if self.content == RecordedContent::Quadrature {
            let quadrature_a = trace.envelope_a(Envelope::QAxis, pole_pairs);
            let channels = [
                (ChannelName::QAxisCurrent, quadrature_a),
                (ChannelName::MotorAngle, trace.motor_angle_rad),
            ];
            let channels = channels.into_iter().chain(voltage);
            let channels = channels
                .map(|(channel, values)| Channel::uniform(channel, 0.0, rate_hz, values))
                .collect::<Result<Vec<_>, _>>()?;
            return Ok(Recording::new(name, metadata, channels)?);
        }
        let envelope_a = trace.envelope_a(experiment.envelope, pole_pairs);
        let start_angle_rad =
            (self.content == RecordedContent::Envelope).then_some(self.start_angle_rad);
        let envelope = EnvelopeAtRate { envelope_a: &envelope_a, rate_hz };
        envelope.recording(experiment, name, start_angle_rad, None)
    }

    /// Runs the low-fidelity model and records its current as the envelope, and the rotor's angle;
    /// noise and converter act on the current as they would on the conducting phase.
    ///
    /// # Errors
    ///
    /// [`SimulatedRecordingError`].
    pub fn record_low_fidelity(
        &self,
        experiment: &Experiment,
        name: &str,
    ) -> Result<Recording, SimulatedRecordingError> {
        self.record_low_fidelity_visited(experiment, name).map(|(recording, _)| recording)
    }

    /// As [`record_low_fidelity`](Self::record_low_fidelity), with where the machine has been.
    ///
    /// # Errors
    ///
    /// [`SimulatedRecordingError`].
    pub fn record_low_fidelity_visited(
        &self,
        experiment: &Experiment,
        name: &str,
    ) -> Result<(Recording, VisitedRange), SimulatedRecordingError> {
        self.check_most(experiment)?;
        let scenario = Scenario {
            imperfections: self.imperfections,
            seed: self.controller_seed,
            ..experiment.scenario.clone()
        };
        let model = experiment.low_fidelity(&scenario.turned_to(self.start_angle_rad))?;
        let trace = model.try_simulate(&PhysicalFaults::from(&self.faults))?;
        let visited = trace.visited_range(experiment.scenario.load_n_m);
        self.check_rate(trace.rate_hz, trace.current_a.len())?;
        let rate_hz = self.phase_rate_hz.unwrap_or(trace.rate_hz);
        let current_a = resampled(&trace.current_a, trace.rate_hz, rate_hz);
        let [current_a, ..] =
            self.sensors.measure([&current_a, &current_a, &current_a], self.sensor_seed);
        let start_angle_rad = Some(self.start_angle_rad);
        let envelope = EnvelopeAtRate { envelope_a: &current_a, rate_hz };
        let angle_rad =
            resampled(&trace.motor_angle_rad, trace.rate_hz, experiment.filter.output_hz);
        let recording = envelope.recording(experiment, name, start_angle_rad, Some(angle_rad))?;
        Ok((recording, visited))
    }

    /// Refuses a rate that no converter has, or that leaves more samples than a recording holds.
    fn check_most(&self, experiment: &Experiment) -> Result<(), SimulatedRecordingError> {
        match self.phase_rate_hz {
            Some(rate_hz) => Self::check_fastest(rate_hz, experiment.scenario.duration_s),
            None => Ok(()),
        }
    }

    /// Refuses a rate that leaves less than two of so many samples.
    fn check_rate(&self, from_hz: f64, samples: usize) -> Result<(), SimulatedRecordingError> {
        let least_hz = from_hz / samples.saturating_sub(1).max(1) as f64;
        match self.phase_rate_hz {
            Some(rate_hz) if rate_hz < least_hz => {
                Err(SimulatedRecordingError::TooSlow { rate_hz, least_hz })
            }
            _ => Ok(()),
        }
    }
}

/// An envelope before its filter.
#[derive(Clone, Copy, Debug)]
struct EnvelopeAtRate<'a> {
    envelope_a: &'a [f64],
    rate_hz: f64,
}

impl EnvelopeAtRate<'_> {
    /// Records it filtered, with the rotor's angle at the same rate where that is recorded.
    fn recording(
        self,
        experiment: &Experiment,
        name: &str,
        start_angle_rad: Option<f64>,
        motor_angle_rad: Option<Vec<f64>>,
    ) -> Result<Recording, SimulatedRecordingError> {
        let output_hz = experiment.filter.output_hz;
        let metadata = Metadata {
            command: Some(command_source(experiment)),
            rate_hz: Some(output_hz),
            filter_hz: Some(experiment.filter.corner_hz),
            envelope: Some(envelope_kind(experiment.envelope)),
            phase_rate_hz: Some(self.rate_hz),
            start_angle_rad,
            load_n_m: load_to_state(experiment),
            ..Metadata::default()
        };
        let filtered_a = filtered(self.envelope_a, self.rate_hz, experiment);
        let samples = filtered_a.len();
        let channel = |channel, values: Vec<f64>| Channel::uniform(channel, 0.0, output_hz, values);
        let mut channels = vec![channel(ChannelName::Current, filtered_a)?];
        if let Some(mut angle_rad) = motor_angle_rad {
            angle_rad.truncate(samples);
            channels.push(channel(ChannelName::MotorAngle, angle_rad)?);
        }
        if experiment.name == RECORDED {
            let command = &experiment.scenario.command;
            let command_rad = (0..samples).map(|n| command.at(n as f64 / output_hz)).collect();
            channels.push(channel(ChannelName::Command, command_rad)?);
        }
        Ok(Recording::new(name, metadata, channels)?)
    }
}

/// Load in metadata, where it is not the one that the test has by its name.
fn load_to_state(experiment: &Experiment) -> Option<f64> {
    let usual_n_m = Experiment::named(&experiment.name).map_or(0.0, |test| test.scenario.load_n_m);
    let load_n_m = experiment.scenario.load_n_m;
    (load_n_m != usual_n_m).then_some(load_n_m)
}

/// Command in metadata; one that was recorded stands in a channel.
fn command_source(experiment: &Experiment) -> CommandSource {
    if experiment.name == RECORDED {
        CommandSource::Recorded
    } else {
        CommandSource::Named(experiment.name.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_bounded_by_converters_and_by_the_size_of_a_recording() {
        for (rate_hz, duration_s, most_hz) in
            [(1e7, 0.5, None), (1.1e7, 0.5, Some(1e7)), (1e4, 4e3, None), (1.1e4, 4e3, Some(1e4))]
        {
            let found = match SimulatedRecording::check_fastest(rate_hz, duration_s) {
                Err(SimulatedRecordingError::TooFast { most_hz, .. }) => Some(most_hz),
                _ => None,
            };
            assert_eq!(found, most_hz, "{rate_hz} Hz for {duration_s} s");
        }
    }
}
