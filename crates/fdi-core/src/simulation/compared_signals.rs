//! The signals of a recording that a model is compared with in closed loop.

use ema_sim::{CommandKind, Scenario, model_file::MachineModel, testable_rate_hz};
use recordings::{AskedFor, ChannelName, CommandColumn, CommandSource, RecordError, Recording};

use crate::simulation::{
    cut_phase::CutPhase, drive_signal::DriveSignal, experiment::Experiment,
    resampling::band_limited,
};

/// The signals of a recording that a model is compared with: equally long, all at the times of
/// the signal that drives the machine, straight between the samples of the recording.
///
/// The controller's rate is a whole multiple of theirs. Where it is none of the recording's, they
/// are at the next rate above of which it is, at most the controller's own: drive signal, position and
/// recorded command band-limited by the kernel of Lanczos, the load straight between its samples.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ComparedSignals {
    /// Rate of all signals, Hz.
    pub rate_hz: f64,
    /// Rate of the recording, Hz.
    pub recorded_hz: f64,
    /// Command that was given: rad, rad/s, m or m/s.
    pub command: Vec<f64>,
    /// Quantity that the command asks for.
    pub kind: CommandKind,
    /// Signal that drives the machine: current in A, or of an amplifier or winding its voltage
    /// in V.
    pub drive: Vec<f64>,
    /// Position of the motor (of an axis its own), where there is one: rad or m.
    pub position: Option<Vec<f64>>,
    /// Load against positive motion, where there is one: N·m or N.
    pub load: Option<Vec<f64>>,
    /// Corner of the two first-order low-passes behind `drive`, Hz, where it was filtered.
    pub filter_hz: Option<f64>,
    /// Angle of an actuator's motor at the first sample, rad, where the metadata say it.
    pub start_rad: Option<f64>,
}

/// Why a recording cannot be compared with a model.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ComparedSignalsError {
    /// No column of the signal that drives the machine.
    #[error("no column `{expected}`, which the model drives")]
    NoDrive {
        /// Column that the model has for it.
        expected: ChannelName,
    },
    /// Three phase currents without the angle of the motor.
    #[error(
        "no column `{}`, which the envelope of the phases needs", ChannelName::MotorAngle.column()
    )]
    NoRotorAngle,
    /// Neither a column nor anything else says the command.
    #[error("no command (`command_rad`, `command_m` or a speed command)")]
    NoCommand,
    /// The motion was to stand for the command, and is not recorded.
    #[error("no position, whose inverse dynamics were asked for")]
    NoMotion,
    /// A phase current was cut at a level.
    #[error(
        "the signal is clipped: {:.1} % of the samples of `{}` stand at {level_a} A, at an end of \
         its range; record it with a wider range", 100.0 * share, column.column()
    )]
    Clipped {
        /// The phase.
        column: ChannelName,
        /// The level, A.
        level_a: f64,
        /// Share of its samples that stand there.
        share: f64,
    },
    /// The channels cannot be brought onto one time base.
    #[error(transparent)]
    Record(#[from] RecordError),
}

impl ComparedSignalsError {
    /// Tells whether the recording lacks a signal, or a part of one, so that nothing can be
    /// concluded from it; otherwise the recording or what was asked of it is wrong.
    pub fn lacks_a_signal(&self) -> bool {
        use ComparedSignalsError::{Clipped, NoCommand, NoDrive, NoRotorAngle};
        matches!(self, NoDrive { .. } | NoRotorAngle | NoCommand | Clipped { .. })
    }
}

/// The command of a recording that has no column of it.
#[derive(Clone, Debug, PartialEq)]
pub enum GivenCommand {
    /// A test with a name, from its beginning.
    Test(Box<Scenario>),
    /// Another recording, from its beginning.
    Recorded(Box<Recording>),
    /// Nothing that is known: the motion itself.
    Motion,
}

impl GivenCommand {
    /// The test of that name, `chirp` or `sine`.
    pub fn named(name: &str) -> Option<Self> {
        Experiment::named(name).map(|test| Self::Test(Box::new(test.scenario)))
    }

    /// The command of a recording.
    ///
    /// # Errors
    ///
    /// [`ComparedSignalsError::NoCommand`] for a recording without a column of it.
    pub fn of_recording(recording: Recording) -> Result<Self, ComparedSignalsError> {
        match recording.command_column() {
            Some(_) => Ok(Self::Recorded(Box::new(recording))),
            None => Err(ComparedSignalsError::NoCommand),
        }
    }

    /// The command at these times, the first of which is its beginning.
    fn at(
        &self,
        times_s: &[f64],
        position: Option<&[f64]>,
    ) -> Result<OnAxis, ComparedSignalsError> {
        let begin_s = times_s.first().copied().unwrap_or(0.0);
        let since_s = times_s.iter().map(|time_s| time_s - begin_s);
        match self {
            Self::Test(test) => Ok(OnAxis {
                values: since_s.map(|time_s| test.command.at(time_s)).collect(),
                kind: CommandKind::Position,
                load: Some(vec![test.load_n_m; times_s.len()]),
            }),
            Self::Recorded(recording) => {
                let column = recording.command_column().ok_or(ComparedSignalsError::NoCommand)?;
                let begin_s = column.channel.times_s()[0];
                let own_s: Vec<f64> = since_s.map(|time_s| time_s + begin_s).collect();
                let load = recording.first_channel(&LOADS).map(|load| load.at(&own_s));
                Ok(OnAxis { load, ..OnAxis::of(&column, &own_s) })
            }
            Self::Motion => {
                let values = position.ok_or(ComparedSignalsError::NoMotion)?.to_vec();
                Ok(OnAxis { values, kind: CommandKind::Motion, load: None })
            }
        }
    }
}

/// Columns of a load.
const LOADS: [ChannelName; 2] = [ChannelName::Load, ChannelName::Force];

/// A command on the time axis of a recording, with a load where it has one.
struct OnAxis {
    values: Vec<f64>,
    kind: CommandKind,
    load: Option<Vec<f64>>,
}

impl OnAxis {
    /// A column at these times.
    fn of(column: &CommandColumn<'_>, times_s: &[f64]) -> Self {
        let kind = match column.asked_for {
            AskedFor::Position => CommandKind::Position,
            AskedFor::Speed => CommandKind::Speed,
        };
        Self { values: column.channel.at(times_s), kind, load: None }
    }
}

impl ComparedSignals {
    /// The signals of a recording that a model is compared with, at the times of its drive signal.
    ///
    /// | signal | where it is from, the first that is there |
    /// | --- | --- |
    /// | drive | the column that the model drives; of an actuator the envelope of its phases |
    /// | position | `motor_angle_rad`; of a servo axis also `position_m`, `surface_angle_rad` |
    /// | command | [`GivenCommand::Motion`]; a column; any other given one; a test that the metadata name |
    /// | load | `load_n_m`, `force_n`; of an actuator `load-n-m` of the metadata; that of the command |
    ///
    /// # Errors
    ///
    /// [`ComparedSignalsError`] for a recording that lacks a signal
    /// ([`lacks_a_signal`](ComparedSignalsError::lacks_a_signal)) or is sampled unevenly.
    pub fn of_recording(
        recording: &Recording,
        model: &MachineModel,
        given: Option<&GivenCommand>,
    ) -> Result<Self, ComparedSignalsError> {
        use ChannelName::{MotorAngle, Position, SurfaceAngle};
        if let Some(CutPhase { channel, level_a, share }) =
            CutPhase::of(recording, model.kind().drive_limit())
        {
            return Err(ComparedSignalsError::Clipped { column: channel, level_a, share });
        }
        let DriveSignal { channel: drive, filter_hz } = DriveSignal::of(recording, model)?;
        let recorded_hz = drive.regular_rate_hz()?;
        // a followed motion has a controller of the recording's own rate
        let rate_hz = match given {
            Some(GivenCommand::Motion) => recorded_hz,
            _ => testable_rate_hz(recorded_hz, model.kind().controller_hz()),
        };
        let own_s = drive.times_s();
        let at_rate = |values: Vec<f64>| {
            if rate_hz == recorded_hz {
                values
            } else {
                band_limited(&values, recorded_hz, rate_hz)
            }
        };
        let driven = at_rate(drive.values().to_vec());
        let times_s: Vec<f64> = if rate_hz == recorded_hz {
            own_s.to_vec()
        } else {
            (0..driven.len()).map(|n| own_s[0] + n as f64 / rate_hz).collect()
        };
        let on_axis = |names: &[ChannelName], times_s: &[f64]| {
            recording.first_channel(names).map(|channel| channel.at(times_s))
        };
        let has_rotor = model.kind().pole_pairs().is_some();
        let motor: &[ChannelName] =
            if has_rotor { &[MotorAngle] } else { &[MotorAngle, Position, SurfaceAngle] };
        let position = on_axis(motor, own_s);
        // an axis has no rotor, and its position may be in metres
        let start_rad =
            if has_rotor { recording.start_angle_rad(position.as_deref())? } else { None };
        let position = position.map(at_rate);
        let column = recording.command_column();
        let column = column.filter(|_| !matches!(given, Some(GivenCommand::Motion)));
        let command = match column {
            // as the others, so that what a logger held is as late in all
            Some(column) => {
                let recorded = OnAxis::of(&column, own_s);
                OnAxis { values: at_rate(recorded.values), ..recorded }
            }
            None => command(recording, model, given, &times_s, position.as_deref())?,
        };
        let stated_load = recording.metadata.load_n_m.filter(|_| has_rotor);
        let stated_load = stated_load.map(|load| vec![load; times_s.len()]);
        Ok(Self {
            rate_hz,
            recorded_hz,
            command: command.values,
            kind: command.kind,
            drive: driven,
            load: on_axis(&LOADS, &times_s).or(stated_load).or(command.load),
            position,
            filter_hz,
            start_rad,
        })
    }

    /// Column that a recording of an actuator lacks for a conclusion, besides a command.
    pub fn missing_column(recording: &Recording) -> Option<ChannelName> {
        let name = ChannelName::MotorAngle;
        recording.channel(name).is_none().then_some(name)
    }

    /// Tells whether a recording of an actuator says its command, in a column or by the name of a
    /// test.
    pub fn says_its_command(recording: &Recording) -> bool {
        let column = [ChannelName::Command, ChannelName::SpeedCommand];
        named_test(recording).is_some() || recording.first_channel(&column).is_some()
    }
}

/// The command of a recording without a column of it, at the samples of the drive signal.
fn command(
    recording: &Recording,
    model: &MachineModel,
    given: Option<&GivenCommand>,
    times_s: &[f64],
    position: Option<&[f64]>,
) -> Result<OnAxis, ComparedSignalsError> {
    match given {
        Some(given) => given.at(times_s, position),
        // a test with a name is one of actuators
        None if matches!(model, MachineModel::Actuator(_)) => {
            let named = named_test(recording).ok_or(ComparedSignalsError::NoCommand)?;
            named.at(times_s, position)
        }
        None => Err(ComparedSignalsError::NoCommand),
    }
}

/// The test that the metadata of a recording name.
fn named_test(recording: &Recording) -> Option<GivenCommand> {
    match &recording.metadata.command {
        Some(CommandSource::Named(name)) => GivenCommand::named(name),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use ema_sim::{model_file::Model, presets::EMA_48};
    use recordings::ColumnMap;

    use super::*;

    fn actuator() -> MachineModel {
        MachineModel::Actuator(Model::from(EMA_48))
    }

    fn recording(text: &str) -> Recording {
        Recording::parse("r", text.as_bytes(), &ColumnMap::default()).unwrap()
    }

    fn of(text: &str, given: Option<&GivenCommand>) -> Result<ComparedSignals, String> {
        let compared = ComparedSignals::of_recording(&recording(text), &actuator(), given);
        compared.map_err(|error| format!("{} {error}", error.lacks_a_signal()))
    }

    #[test]
    fn an_actuator_is_driven_by_the_envelope_of_its_phases() {
        let phases = "time_s,current_a,phase_a_current_a,phase_b_current_a,phase_c_current_a";
        let text = format!("# envelope = \"half-abs-sum\"\n{phases},motor_angle_rad,command_rad\n");
        let rows = "0,9,2,-2,0,0,0.1\n0.1,9,0,3,-3,0,0.2\n";
        let signals = of(&(text + rows), None).unwrap();
        assert_eq!((signals.drive, signals.rate_hz), (vec![2.0, 3.0], 10.0));
        assert_eq!((signals.command, signals.kind), (vec![0.1, 0.2], CommandKind::Position));
        let envelope = "time_s,current_a,q_axis_current_a,command_rad\n0,1,5,0\n0.1,2,5,0\n";
        assert_eq!(of(envelope, None).unwrap().drive, [1.0, 2.0]);
    }

    #[test]
    fn what_is_lacking_is_named() {
        let lacking = [
            ("time_s,command_rad\n0,0\n0.1,0\n", "true no column `current_a`, which the model"),
            ("time_s,current_a\n0,0\n0.1,0\n", "true no command (`command_rad`, `command_m` or"),
            (
                "time_s,phase_a_current_a,phase_b_current_a,phase_c_current_a\n0,0,0,0\n0.1,0,0,0\n",
                "true no column `motor_angle_rad`, which the envelope of the phases needs",
            ),
        ];
        for (text, told) in lacking {
            let error = of(text, None).unwrap_err();
            assert!(error.starts_with(told), "{error}");
        }
        let error = of("time_s,current_a\n0,0\n0.1,0\n", Some(&GivenCommand::Motion)).unwrap_err();
        assert_eq!(error, "false no position, whose inverse dynamics were asked for");
    }

    #[test]
    fn rates_are_brought_to_a_part_of_the_controllers() {
        for (recorded_hz, wanted_hz) in
            [(1000.0, 1000.0), (250.0, 250.0), (800.0, 1000.0), (640.0, 1000.0), (2000.0, 1000.0)]
        {
            assert_eq!(testable_rate_hz(recorded_hz, 1000.0), wanted_hz);
        }
        assert_eq!(testable_rate_hz(300.0, 1000.0), 1000.0 / 3.0);
        let row = |n: usize| format!("{},{},{}\n", n as f64 / 800.0, n, 2 * n);
        let text =
            format!("time_s,current_a,command_rad\n{}", (0..81).map(row).collect::<String>());
        let signals = of(&text, None).unwrap();
        let controller_hz = EMA_48.controller.sample_hz;
        assert_eq!(signals.rate_hz, testable_rate_hz(800.0, controller_hz));
        assert_eq!(signals.drive.len(), signals.command.len());
        let middle = signals.drive.len() / 2;
        let place = middle as f64 * 800.0 / signals.rate_hz;
        assert!(
            (signals.drive[middle] - place).abs() < 0.02
                && (signals.command[middle] - 2.0 * place).abs() < 0.04
        );
    }

    #[test]
    fn a_given_command_begins_with_the_recording() {
        let text = "time_s,current_a\n5.0,0\n5.1,0\n5.2,0\n";
        let command = recording("time_s,command_rad,load_n_m\n2.0,0.1,7\n2.2,0.3,7\n");
        let given = GivenCommand::of_recording(command).unwrap();
        let signals = of(text, Some(&given)).unwrap();
        assert!((signals.command[1] - 0.2).abs() < 1e-12, "{:?}", signals.command);
        assert_eq!(signals.load, Some(vec![7.0; 3]));
        // a column of its own goes before
        let own = "time_s,current_a,command_rad\n5.0,0,4\n5.1,0,4\n";
        assert_eq!(of(own, Some(&given)).unwrap().command, [4.0, 4.0]);
        let named = of(&format!("# command = \"sine\"\n{text}"), None).unwrap();
        assert_eq!((named.command.len(), named.kind), (3, CommandKind::Position));
        assert!(GivenCommand::of_recording(recording(text)).is_err());
    }
}
