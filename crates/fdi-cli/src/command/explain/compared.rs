//! From a recording to the signals that a model is compared with.

use std::path::Path;

use anyhow::{Context, Result, bail};
use fdi_core::{
    AskedFor, Channel, ChannelName, CommandColumn, CommandSource, EnvelopeKind, Experiment,
    RecordError, Recording,
    ema_sim::{DriveUnit, Envelope, Scenario, model_file::MachineModel},
};
use greybox::{CommandKind, Record};

use crate::experiment::recording_of;

/// The signals, or what the recording lacks for a conclusion.
pub(super) fn compared(
    recording: &Recording,
    model: &MachineModel,
    asked: Option<&Asked>,
) -> Result<Result<Record, String>> {
    use ChannelName::{Force, Load, MotorAngle, Position, SurfaceAngle};
    let DriveSignal { channel: drive, filter_hz } = match drive(recording, model)? {
        Ok(drive) => drive,
        Err(missing) => return Ok(Err(missing)),
    };
    let rate_hz = drive.regular_rate_hz()?;
    let on_axis = |names: &[ChannelName]| {
        recording.first_channel(names).map(|channel| channel.at(drive.times_s()))
    };
    let has_rotor = model.kind().pole_pairs().is_some();
    let motor: &[ChannelName] =
        if has_rotor { &[MotorAngle] } else { &[MotorAngle, Position, SurfaceAngle] };
    let position = on_axis(motor);
    // an axis has no rotor, and its position may be in metres
    let start_rad = if has_rotor { recording.start_angle_rad(position.as_deref())? } else { None };
    let Some(command) = command(recording, model, asked, &drive, position.as_ref())? else {
        return Ok(Err(format!(
            "{NO_COMMAND}: what the controller was asked for is not known (`--command` names it; \
             of a servo axis `--inverse-dynamics` does without it)"
        )));
    };
    Ok(Ok(Record {
        name: recording.name.clone(),
        rate_hz,
        command: command.values,
        kind: command.kind,
        drive: drive.values().to_vec(),
        position,
        load: on_axis(&[Load, Force]).or(command.load),
        filter_hz,
        start_rad,
    }))
}

/// The command at the samples of the drive signal: the motion where that is asked for, else the
/// column, else what `--command` or the metadata name; `None` where nothing says it.
fn command(
    recording: &Recording,
    model: &MachineModel,
    asked: Option<&Asked>,
    drive: &Channel,
    position: Option<&Vec<f64>>,
) -> Result<Option<OnAxis>> {
    if matches!(asked, Some(Asked::Motion)) {
        let Some(position) = position else {
            bail!("no position, whose inverse dynamics were asked for");
        };
        let (values, kind) = (position.clone(), CommandKind::Motion);
        return Ok(Some(OnAxis { values, kind, load: None }));
    }
    if let Some(column) = recording.command_column() {
        let values = column.channel.at(drive.times_s());
        return Ok(Some(OnAxis { values, kind: kind_of(&column), load: None }));
    }
    let of_metadata = || match (&recording.metadata.command, model) {
        (Some(CommandSource::Named(name)), MachineModel::Actuator(_)) => Asked::named(name),
        _ => None,
    };
    match asked {
        Some(asked) => asked.at(drive.times_s()).map(Some),
        None => of_metadata().map(|asked| asked.at(drive.times_s())).transpose(),
    }
}

/// Why a recording without a column of its command is no use.
const NO_COMMAND: &str = "no command (`command_rad`, `command_m` or a speed command)";

/// Quantity that a command column asks for.
fn kind_of(column: &CommandColumn<'_>) -> CommandKind {
    match column.asked_for {
        AskedFor::Position => CommandKind::Position,
        AskedFor::Speed => CommandKind::Speed,
    }
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

/// A command on the time axis of a recording, with a load where it has one.
struct OnAxis {
    values: Vec<f64>,
    kind: CommandKind,
    load: Option<Vec<f64>>,
}

impl Asked {
    /// Reads the value of `--command`: a name, or a recording.
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
        Experiment::named(name).map(|test| Self::Test(Box::new(test.scenario)))
    }

    /// The command at these times, the first of which is its beginning.
    fn at(&self, times_s: &[f64]) -> Result<OnAxis> {
        use ChannelName::{Force, Load};
        let begin_s = times_s.first().copied().unwrap_or(0.0);
        let since_s: Vec<f64> = times_s.iter().map(|time_s| time_s - begin_s).collect();
        let recording = match self {
            Self::Test(test) => {
                return Ok(OnAxis {
                    values: since_s.iter().map(|&time_s| test.command.at(time_s)).collect(),
                    kind: CommandKind::Position,
                    load: Some(vec![test.load_n_m; since_s.len()]),
                });
            }
            Self::Recorded(recording) => recording,
            Self::Motion => bail!("{NO_COMMAND}"),
        };
        let Some(column) = recording.command_column() else { bail!("{NO_COMMAND}") };
        let begin_s = column.channel.times_s()[0];
        let own_s: Vec<f64> = since_s.iter().map(|time_s| time_s + begin_s).collect();
        Ok(OnAxis {
            values: column.channel.at(&own_s),
            kind: kind_of(&column),
            load: recording.first_channel(&[Load, Force]).map(|load| load.at(&own_s)),
        })
    }
}

/// Names the column that a recording lacks for a conclusion about actuators, besides a command.
pub(crate) fn lacks(recording: &Recording) -> Option<&'static str> {
    recording.channel(ChannelName::MotorAngle).is_none().then_some("motor_angle_rad")
}

/// Tells whether a recording says its command, in a column or by the name of a test.
pub(crate) fn says_its_command(recording: &Recording) -> bool {
    let column = [ChannelName::Command, ChannelName::SpeedCommand];
    let named = match &recording.metadata.command {
        Some(CommandSource::Named(name)) => Asked::named(name).is_some(),
        _ => false,
    };
    named || column.iter().any(|name| recording.channel(*name).is_some())
}

/// The signal that drives the machine, and the filter it went through.
struct DriveSignal {
    channel: Channel,
    filter_hz: Option<f64>,
}

/// The signal that drives the machine; an error in words where the recording lacks it.
fn drive(recording: &Recording, model: &MachineModel) -> Result<Result<DriveSignal, String>> {
    use ChannelName::{Current, MotorVoltage, QAxisCurrent, Voltage};
    let machine = model.kind();
    let plain = |names: &[ChannelName]| match recording.first_channel(names) {
        Some(channel) => {
            let filter_hz = recording.metadata.filter_hz;
            Ok(DriveSignal { channel: channel.clone(), filter_hz })
        }
        None => Err(format!("no column `{}`, which the model drives", names[0])),
    };
    let names = match (machine.drive_unit(), machine.pole_pairs()) {
        (DriveUnit::Volt, _) => [MotorVoltage, Voltage],
        (DriveUnit::Ampere, None) => [QAxisCurrent, Current],
        (DriveUnit::Ampere, Some(pole_pairs)) => match envelope(recording, pole_pairs)? {
            Some(envelope) => return Ok(envelope),
            None => [Current, QAxisCurrent],
        },
    };
    Ok(plain(&names))
}

/// The envelope of the phase currents; `None` for a recording without all three.
fn envelope(recording: &Recording, pole_pairs: u32) -> Result<Option<Result<DriveSignal, String>>> {
    use ChannelName::{Current, MotorAngle, PhaseACurrent, PhaseBCurrent, PhaseCCurrent};
    let phases = [PhaseACurrent, PhaseBCurrent, PhaseCCurrent].map(|name| recording.channel(name));
    let [Some(a), Some(b), Some(c)] = phases else { return Ok(None) };
    let Some(angle) = recording.channel(MotorAngle) else {
        let missing = "no column `motor_angle_rad`, which the envelope of the phases needs";
        return Ok(Some(Err(missing.to_owned())));
    };
    if [b, c].iter().any(|phase| phase.times_s() != a.times_s()) {
        return Err(RecordError::ChannelTime { channel: PhaseBCurrent, index: 0 }.into());
    }
    let envelope = match recording.metadata.envelope {
        Some(EnvelopeKind::QAxis) => Envelope::QAxis,
        Some(EnvelopeKind::SignedProjection) => Envelope::SignedProjection,
        Some(EnvelopeKind::HalfAbsSum) => Envelope::HalfAbsSum,
        _ => Envelope::ConductingPhase,
    };
    let phases = [a, b, c].map(Channel::values);
    let values = envelope.of_phases_at(phases, &angle.at(a.times_s()), pole_pairs);
    let channel = Channel::new(Current, a.times_s(), values)?;
    Ok(Some(Ok(DriveSignal { channel, filter_hz: None })))
}
