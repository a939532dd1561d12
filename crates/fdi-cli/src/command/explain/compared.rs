//! From a recording to the signals that a model is compared with.

use anyhow::{Result, bail};
use fdi_core::{
    Channel, ChannelName, EnvelopeKind, RecordError, Recording,
    ema_sim::{Drive, Envelope, model_file::MachineModel},
};
use greybox::{CommandKind, Record};

/// Share of a sample that a sample may be off the grid of its recording.
const MOST_OFF_GRID: f64 = 0.01;

/// The signals, or what the recording lacks for a conclusion.
pub(super) fn compared(
    recording: &Recording,
    model: &MachineModel,
) -> Result<Result<Record, String>> {
    use ChannelName::{
        Command, Force, LinearCommand, LinearSpeedCommand, Load, MotorAngle, Position,
        SpeedCommand, SurfaceAngle,
    };
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
    let (command, kind) =
        match (first(&[Command, LinearCommand]), first(&[SpeedCommand, LinearSpeedCommand])) {
            (Some(position), _) => (position, CommandKind::Position),
            (None, Some(speed)) => (speed, CommandKind::Speed),
            (None, None) => {
                return Ok(Err(
                    "no command (`command_rad`, `command_m` or a speed command): what the \
                           controller was asked for is not known"
                        .to_owned(),
                ));
            }
        };
    let is_axis = matches!(model, MachineModel::ServoAxis(_));
    let motor: &[ChannelName] =
        if is_axis { &[MotorAngle, Position, SurfaceAngle] } else { &[MotorAngle] };
    Ok(Ok(Record {
        name: recording.name.clone(),
        rate_hz: sampling.rate_hz,
        command: on_axis(command),
        kind,
        drive: drive.values().to_vec(),
        position: first(motor).map(on_axis),
        load: first(&[Load, Force]).map(on_axis),
        filter_hz,
    }))
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
