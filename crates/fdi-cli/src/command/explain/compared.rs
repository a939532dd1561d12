//! From a recording to the signals that a model is compared with.

use std::{f64::consts::TAU, path::Path};

use anyhow::{Context, Result, bail};
use fdi_core::{
    Channel, ChannelName, CommandSource, EnvelopeKind, RecordError, Recording,
    ema_sim::{Drive, Envelope, Scenario, model_file::MachineModel},
};
use greybox::{CommandKind, Record};

use crate::experiment::{named_test, recording_of};

/// Share of a sample that a sample may be off the grid of its recording.
const MOST_OFF_GRID: f64 = 0.01;

/// The signals, or what the recording lacks for a conclusion.
pub(super) fn compared(
    recording: &Recording,
    model: &MachineModel,
    asked: Option<&Asked>,
) -> Result<Result<Record, String>> {
    use ChannelName::{Force, Load, MotorAngle, Position, SurfaceAngle};
    let (drive, filter_hz) = match drive(recording, model)? {
        Ok(drive) => drive,
        Err(missing) => return Ok(Err(missing)),
    };
    let sampling = drive.sampling()?;
    let most_s = MOST_OFF_GRID / sampling.rate_hz;
    if sampling.deviation_s > most_s {
        let column = drive.name().column();
        bail!(
            "column `{column}` is sampled irregularly: a sample is {:.2e} s off its grid, expected \
             at most {most_s:.2e} s",
            sampling.deviation_s
        );
    }
    let first = |names: &[ChannelName]| names.iter().find_map(|name| recording.channel(*name));
    let on_axis = |channel: &Channel| interpolated(channel, drive.times_s());
    let is_axis = matches!(model, MachineModel::ServoAxis(_));
    let motor: &[ChannelName] =
        if is_axis { &[MotorAngle, Position, SurfaceAngle] } else { &[MotorAngle] };
    let position = first(motor).map(on_axis);
    // an axis has no rotor, and its position may be in metres
    let told = recording.metadata.start_angle_rad.filter(|_| !is_axis);
    let start_rad = start_rad(told, position.as_deref())?;
    let own = match (asked, &position) {
        (Some(Asked::Motion), Some(position)) => {
            Some((position.clone(), CommandKind::Motion, None))
        }
        (Some(Asked::Motion), None) => bail!("no position, whose inverse dynamics were asked for"),
        _ => command_of(recording).map(|(channel, kind)| (on_axis(channel), kind, None)),
    };
    let of_metadata = || match (&recording.metadata.command, model) {
        (Some(CommandSource::Named(name)), MachineModel::Actuator(_)) => Asked::named(name),
        _ => None,
    };
    let told = || match asked {
        Some(asked) => asked.at(drive.times_s()).map(Some),
        None => of_metadata().map(|asked| asked.at(drive.times_s())).transpose(),
    };
    let Some((command, kind, load)) = own.map_or_else(told, |own| Ok(Some(own)))? else {
        return Ok(Err(format!(
            "{NO_COMMAND}: what the controller was asked for is not known (`--command` names it; \
             of a servo axis `--inverse-dynamics` does without it)"
        )));
    };
    Ok(Ok(Record {
        name: recording.name.clone(),
        rate_hz: sampling.rate_hz,
        command,
        kind,
        drive: drive.values().to_vec(),
        position,
        load: first(&[Load, Force]).map(on_axis).or(load),
        filter_hz,
        start_rad,
    }))
}

/// Where the motor stood at the first sample, by the metadata, in the turn of its column.
fn start_rad(told: Option<f64>, position: Option<&[f64]>) -> Result<Option<f64>> {
    let (Some(told), Some(&[first, ..])) = (told, position) else { return Ok(told) };
    let off = told - first;
    let off = off - TAU * (off / TAU).round();
    if off.abs() > MOST_OFF_START_RAD {
        bail!(
            "`start-angle-rad` is {told}, but `motor_angle_rad` begins at {first}: expected the \
             same angle within {MOST_OFF_START_RAD} rad"
        );
    }
    Ok(Some(first + off))
}

/// Half a step of a coarse encoder.
const MOST_OFF_START_RAD: f64 = 0.02;

/// Why a recording without a column of its command is no use.
const NO_COMMAND: &str = "no command (`command_rad`, `command_m` or a speed command)";

/// The column that says what the controller was asked for.
fn command_of(recording: &Recording) -> Option<(&Channel, CommandKind)> {
    use ChannelName::{Command, LinearCommand, LinearSpeedCommand, SpeedCommand};
    let first = |names: [ChannelName; 2]| names.iter().find_map(|name| recording.channel(*name));
    let position = first([Command, LinearCommand]).map(|one| (one, CommandKind::Position));
    position.or_else(|| Some((first([SpeedCommand, LinearSpeedCommand])?, CommandKind::Speed)))
}

/// The command of a recording that has no column of it.
#[derive(Debug)]
pub(super) enum Asked {
    /// A test with a name, from its beginning.
    Test(Box<Scenario>),
    /// Another recording, from its beginning.
    Recorded(Box<Recording>),
    /// Nothing that is known: the motion itself.
    Motion,
}

/// Command, its kind and load on the axis of a recording.
type OnAxis = (Vec<f64>, CommandKind, Option<Vec<f64>>);

impl Asked {
    /// What `--command` says: a name, or a recording.
    pub(super) fn of_option(text: &str, model: &MachineModel) -> Result<Self> {
        if let Some(named) = Self::named(text) {
            if !matches!(model, MachineModel::Actuator(_)) {
                bail!("`--command {text}`: a test of actuators; give a recording of the command");
            }
            return Ok(named);
        }
        let (named, recording) = recording_of(Path::new(text))?;
        let asked = Self::Recorded(Box::new(recording));
        asked.at(&[0.0]).context(named)?;
        Ok(asked)
    }

    /// The test of that name.
    pub(super) fn named(name: &str) -> Option<Self> {
        named_test(name).map(|test| Self::Test(Box::new(test.scenario)))
    }

    /// The command at these times, the first of which is its beginning.
    fn at(&self, times_s: &[f64]) -> Result<OnAxis> {
        use ChannelName::{Force, Load};
        let begin_s = times_s.first().copied().unwrap_or(0.0);
        let since_s: Vec<f64> = times_s.iter().map(|time_s| time_s - begin_s).collect();
        let recording = match self {
            Self::Test(test) => {
                let command = since_s.iter().map(|&time_s| test.command.at(time_s)).collect();
                let load = vec![test.load_n_m; since_s.len()];
                return Ok((command, CommandKind::Position, Some(load)));
            }
            Self::Recorded(recording) => recording,
            Self::Motion => bail!("{NO_COMMAND}"),
        };
        let first = |names: &[ChannelName]| names.iter().find_map(|name| recording.channel(*name));
        let Some((command, kind)) = command_of(recording) else { bail!("{NO_COMMAND}") };
        let begin_s = command.times_s()[0];
        let own_s: Vec<f64> = since_s.iter().map(|time_s| time_s + begin_s).collect();
        let load = first(&[Load, Force]).map(|load| interpolated(load, &own_s));
        Ok((interpolated(command, &own_s), kind, load))
    }
}

/// What a recording lacks for a conclusion about actuators, besides a command.
pub(crate) fn lacks(recording: &Recording) -> Option<&'static str> {
    recording.channel(ChannelName::MotorAngle).is_none().then_some("motor_angle_rad")
}

/// Whether a recording says its command, in a column or by the name of a test.
pub(crate) fn says_its_command(recording: &Recording) -> bool {
    let column = [ChannelName::Command, ChannelName::SpeedCommand];
    let named = match &recording.metadata.command {
        Some(CommandSource::Named(name)) => Asked::named(name).is_some(),
        _ => false,
    };
    named || column.iter().any(|name| recording.channel(*name).is_some())
}

/// The signal that drives the machine, and the filter it went through.
fn drive(
    recording: &Recording,
    model: &MachineModel,
) -> Result<Result<(Channel, Option<f64>), String>> {
    use ChannelName::{
        Current, MotorAngle, MotorVoltage, PhaseACurrent, PhaseBCurrent, PhaseCCurrent,
        QAxisCurrent, Voltage,
    };
    let filter_hz = recording.metadata.filter_hz;
    let first = |names: &[ChannelName]| names.iter().find_map(|name| recording.channel(*name));
    let plain = |names: &[ChannelName]| match first(names) {
        Some(channel) => Ok((channel.clone(), filter_hz)),
        None => Err(format!("no column `{}`, which the model drives", names[0])),
    };
    let model = match model {
        MachineModel::ServoAxis(model) if model.axis.drive == Drive::Amplifier => {
            return Ok(plain(&[MotorVoltage, Voltage]));
        }
        MachineModel::Actuator(model) => model,
        _ => return Ok(plain(&[QAxisCurrent, Current])),
    };
    let phases = [PhaseACurrent, PhaseBCurrent, PhaseCCurrent].map(|name| recording.channel(name));
    let [Some(a), Some(b), Some(c)] = phases else { return Ok(plain(&[Current, QAxisCurrent])) };
    let Some(angle) = recording.channel(MotorAngle) else {
        return Ok(Err(
            "no column `motor_angle_rad`, which the envelope of the phases needs".to_owned()
        ));
    };
    let pole_pairs = f64::from(model.actuator.motor.pole_pairs);
    let electrical: Vec<f64> =
        interpolated(angle, a.times_s()).iter().map(|angle| angle * pole_pairs).collect();
    if [b, c].iter().any(|phase| phase.times_s() != a.times_s()) {
        return Err(RecordError::ChannelTime { channel: PhaseBCurrent, index: 0 }.into());
    }
    let envelope = match recording.metadata.envelope {
        Some(EnvelopeKind::QAxis) => Envelope::QAxis,
        Some(EnvelopeKind::SignedProjection) => Envelope::SignedProjection,
        Some(EnvelopeKind::HalfAbsSum) => Envelope::HalfAbsSum,
        _ => Envelope::ConductingPhase,
    };
    let values = envelope.of_phases([a.values(), b.values(), c.values()], &electrical);
    Ok(Ok((Channel::new(Current, a.times_s(), values)?, None)))
}

/// A channel at other times: straight between samples, constant beyond them.
fn interpolated(channel: &Channel, times_s: &[f64]) -> Vec<f64> {
    let (from_s, values) = (channel.times_s(), channel.values());
    if from_s == times_s {
        return values.to_vec();
    }
    let mut above = 0;
    times_s
        .iter()
        .map(|&time_s| {
            while above < from_s.len() && from_s[above] <= time_s {
                above += 1;
            }
            match (above.checked_sub(1), from_s.get(above)) {
                (Some(below), Some(&next_s)) => {
                    let share = (time_s - from_s[below]) / (next_s - from_s[below]);
                    values[below] + share * (values[above] - values[below])
                }
                (Some(last), None) => values[last],
                (None, _) => values[0],
            }
        })
        .collect()
}
