//! Recordings of simulated servo axes.

use ema_sim::{
    AxisInput, AxisScenario, AxisStart, AxisTrace, Command, CommandKind, Drive, Feedback, Geometry,
    HealthState, PhaseSensors, PhysicalFaults, ServoAxisSimulation, VisitedRange,
    model_file::AxisModel,
};

use recordings::{
    Channel, ChannelName, CommandSource, CsvFormat, Metadata, RecordError, Recording,
};

use crate::simulation::{
    experiment::RECORDED, recorded_test::RecordedTestError, simulated::SimulatedRecordingError,
};

/// A servo axis in a test: what it is given, for how long, under which load.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisTest {
    /// Name, also that of the command in metadata.
    pub name: String,
    /// The test.
    pub scenario: AxisScenario,
}

impl AxisTest {
    /// One period of 0.12 in the unit of the axis, rad or m, at 0.2 Hz: the sine of the bench.
    pub fn sine() -> Self {
        Self::of("sine", AxisInput::Position(Command::SINE), 5.0, 0.0)
    }

    /// The test that a recording is of: its commanded position, or else its commanded speed. The
    /// axis starts where its command does.
    ///
    /// # Errors
    ///
    /// [`RecordedTestError`] where the recording has neither in the unit of the axis, or at
    /// uneven times.
    pub fn of_recording(
        recording: &Recording,
        geometry: Geometry,
    ) -> Result<Self, RecordedTestError> {
        let [position, speed] = command_channels(geometry);
        let found = |name: ChannelName| recording.channel(name);
        let channel = found(position).or(found(speed)).ok_or(RecordedTestError::NoAxisCommand {
            position: position.column(),
            speed: speed.column(),
        })?;
        let rate_hz = crate::simulation::recorded_test::even_rate_hz(channel)?;
        let values_rad = channel.values().to_vec();
        let (first, samples) = (values_rad[0], values_rad.len());
        let command = Command::Recorded { values_rad, rate_hz };
        let is_position = channel.name() == position;
        let start = if is_position { first } else { 0.0 };
        let input =
            if is_position { AxisInput::Position(command) } else { AxisInput::Speed(command) };
        Ok(Self::of(RECORDED, input, samples as f64 / rate_hz, start))
    }

    fn of(name: &str, input: AxisInput, duration_s: f64, position: f64) -> Self {
        let start = AxisStart { position, ..AxisStart::default() };
        let scenario = AxisScenario { input, load: 0.0, duration_s, start };
        Self { name: name.into(), scenario }
    }

    /// Runs a model and records it at the rate of its controller, with where it has been.
    ///
    /// The channels are command, position, speed, force (of a linear axis), and what the
    /// controller drives: `q_axis_current_a`, of an amplifier `voltage_v`, of a winding
    /// `motor_voltage_v` and its `q_axis_current_a`.
    ///
    /// # Errors
    ///
    /// [`SimulatedRecordingError`] for an axis or a test that cannot be simulated.
    pub fn record(
        &self,
        model: &AxisModel,
        health: &HealthState,
        name: &str,
    ) -> Result<(Recording, VisitedRange), SimulatedRecordingError> {
        let effects: Vec<_> = model.effects.iter().map(|block| block.effect.clone()).collect();
        let simulation =
            ServoAxisSimulation::new(&model.axis, &self.scenario)?.with_effects(&effects)?;
        let trace = simulation.try_simulate(&PhysicalFaults::from(health))?;
        let visited = trace.visited_range(self.scenario.load);
        let command = match self.name.as_str() {
            RECORDED => CommandSource::Recorded,
            named => CommandSource::Named(named.to_owned()),
        };
        let (command, rate_hz) = (Some(command), Some(trace.rate_hz));
        let metadata = Metadata { command, rate_hz, ..Metadata::default() };
        Ok((Recording::new(name, metadata, self.channels(model, trace)?)?, visited))
    }

    fn channels(&self, model: &AxisModel, trace: AxisTrace) -> Result<Vec<Channel>, RecordError> {
        let axis = &model.axis;
        let rate_hz = trace.rate_hz;
        let [position_command, speed_command] = command_channels(axis.geometry);
        let command = match self.scenario.input {
            AxisInput::Speed(_) => speed_command,
            _ => position_command,
        };
        let (position, speed) = match (axis.geometry, axis.controller.feedback) {
            (Geometry::Linear, _) => (ChannelName::Position, ChannelName::LinearSpeed),
            (Geometry::Rotary, Feedback::Load) => {
                (ChannelName::SurfaceAngle, ChannelName::MotorSpeed)
            }
            (Geometry::Rotary, _) => (ChannelName::MotorAngle, ChannelName::MotorSpeed),
        };
        let mut channels =
            vec![(command, trace.command), (position, trace.position), (speed, trace.speed)];
        if axis.geometry == Geometry::Linear {
            channels.push((ChannelName::Force, trace.force));
        }
        match axis.drive {
            Drive::Amplifier => channels.push((ChannelName::Voltage, trace.output)),
            Drive::Winding => {
                channels.push((ChannelName::MotorVoltage, trace.output));
                channels.push((ChannelName::QAxisCurrent, trace.current));
            }
            _ => channels.push((ChannelName::QAxisCurrent, trace.current)),
        }
        let uniform = |(name, values)| Channel::uniform(name, 0.0, rate_hz, values);
        channels.into_iter().map(uniform).collect()
    }
}

/// Decimals that a file needs for what the sensors of a machine resolve.
pub fn axis_csv_format(geometry: Geometry) -> CsvFormat {
    match geometry {
        Geometry::Rotary => CsvFormat::default(),
        // encoders of a linear axis resolve nanometres
        Geometry::Linear => CsvFormat { value_decimals: 9, ..CsvFormat::default() },
    }
}

/// A recording of a servo axis with white noise on its measured current; `None` where the current
/// is not recorded.
///
/// # Errors
///
/// [`RecordError`] where the noise leaves no recording.
pub fn with_current_noise(
    recording: &Recording,
    noise_a: f64,
    seed: u64,
) -> Result<Option<Recording>, RecordError> {
    if recording.channel(ChannelName::QAxisCurrent).is_none() {
        return Ok(None);
    }
    let sensor = PhaseSensors { noise_a, converter: None };
    let measured = |channel: &Channel| {
        if channel.name() != ChannelName::QAxisCurrent {
            return Ok(channel.clone());
        }
        let [current_a, _, _] = sensor.measure([channel.values(), &[], &[]], seed);
        Channel::new(channel.name(), channel.times_s(), current_a)
    };
    let channels = recording.channels().iter().map(measured).collect::<Result<_, _>>()?;
    Recording::new(recording.name.clone(), recording.metadata.clone(), channels).map(Some)
}

/// Channel of a command of a machine in rad or m. A motion is asked for as a position, whatever
/// controller follows it.
pub fn command_channel(geometry: Geometry, kind: CommandKind) -> ChannelName {
    let [position, speed] = command_channels(geometry);
    match kind {
        CommandKind::Speed => speed,
        CommandKind::Position | CommandKind::Motion => position,
    }
}

/// Channel of the load on the output of a machine: a torque or a force.
pub fn load_channel(geometry: Geometry) -> ChannelName {
    match geometry {
        Geometry::Rotary => ChannelName::Load,
        Geometry::Linear => ChannelName::Force,
    }
}

/// Commanded position and commanded speed.
fn command_channels(geometry: Geometry) -> [ChannelName; 2] {
    match geometry {
        Geometry::Rotary => [ChannelName::Command, ChannelName::SpeedCommand],
        Geometry::Linear => [ChannelName::LinearCommand, ChannelName::LinearSpeedCommand],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_on_the_current_alone() {
        let uniform = |name| Channel::uniform(name, 0.0, 1000.0, vec![1.0; 500]).unwrap();
        let channels = vec![uniform(ChannelName::MotorAngle), uniform(ChannelName::QAxisCurrent)];
        let recording = Recording::new("r", Metadata::default(), channels).unwrap();
        let noisy = with_current_noise(&recording, 0.1, 3).unwrap().unwrap();
        let values = |of: ChannelName| noisy.channel(of).unwrap().values().to_vec();
        assert_eq!(values(ChannelName::MotorAngle), [1.0; 500]);
        let current_a = values(ChannelName::QAxisCurrent);
        let variance_a2 = current_a.iter().map(|a| (a - 1.0).powi(2)).sum::<f64>() / 500.0;
        // a standard deviation from 500 samples is within a fifth: six standard deviations
        assert!((0.08..0.12).contains(&variance_a2.sqrt()), "{variance_a2}");
        let channels = vec![uniform(ChannelName::MotorAngle)];
        let blind = Recording::new("r", Metadata::default(), channels).unwrap();
        assert!(with_current_noise(&blind, 0.1, 3).unwrap().is_none());
    }

    #[test]
    fn a_linear_axis_is_written_in_nanometres() {
        assert_eq!(axis_csv_format(Geometry::Linear).value_decimals, 9);
        assert_eq!(axis_csv_format(Geometry::Rotary), CsvFormat::default());
    }
}
