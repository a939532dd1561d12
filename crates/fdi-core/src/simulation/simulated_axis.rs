//! Recordings of simulated servo axes.

use ema_sim::{
    AxisInput, AxisScenario, AxisStart, AxisTrace, Command, Drive, Feedback, Geometry, HealthState,
    PhysicalFaults, ServoAxisSimulation, VisitedRange, model_file::AxisModel,
};

use recordings::{Channel, ChannelName, CommandSource, Metadata, RecordError, Recording};

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

/// Commanded position and commanded speed.
fn command_channels(geometry: Geometry) -> [ChannelName; 2] {
    match geometry {
        Geometry::Rotary => [ChannelName::Command, ChannelName::SpeedCommand],
        Geometry::Linear => [ChannelName::LinearCommand, ChannelName::LinearSpeedCommand],
    }
}
