//! The signal of a recording that drives its machine.

use ema_sim::{DriveUnit, Envelope, model_file::MachineModel};
use recordings::{Channel, ChannelName, RecordError, Recording};

use crate::simulation::{
    compared_signals::ComparedSignalsError, envelope::envelope_of, low_pass::before_low_pass,
};

/// The signal that drives a machine, and the filter that it went through.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DriveSignal {
    /// Samples: current in A, or of an amplifier or winding its voltage in V.
    pub(crate) channel: Channel,
    /// Corner of the two first-order low-passes behind it, Hz, where it was filtered.
    pub(crate) filter_hz: Option<f64>,
}

impl DriveSignal {
    /// Signal of a recording that a model of the machine drives.
    ///
    /// | drive | columns, the first that is there |
    /// | --- | --- |
    /// | voltage | `motor_voltage_v`, `voltage_v` |
    /// | current of a servo axis | `q_axis_current_a`, `current_a` |
    /// | current of an actuator | envelope of the three phases, `current_a`, `q_axis_current_a` |
    ///
    /// # Errors
    ///
    /// [`ComparedSignalsError::NoDrive`] and [`ComparedSignalsError::NoRotorAngle`] where a column
    /// is missing, [`ComparedSignalsError::Record`] for phases with times of their own.
    pub(crate) fn of(
        recording: &Recording,
        model: &MachineModel,
    ) -> Result<Self, ComparedSignalsError> {
        use ChannelName::{Current, MotorVoltage, QAxisCurrent, Voltage};
        let machine = model.kind();
        let names = match (machine.drive_unit(), machine.pole_pairs()) {
            (DriveUnit::Volt, _) => [MotorVoltage, Voltage],
            (DriveUnit::Ampere, None) => [QAxisCurrent, Current],
            (DriveUnit::Ampere, Some(pole_pairs)) => {
                let usual = usual_envelope(model);
                if let Some(envelope) = envelope(recording, pole_pairs, usual)? {
                    return Ok(envelope);
                }
                [Current, QAxisCurrent]
            }
        };
        let channel = recording.first_channel(&names).cloned();
        let channel = channel.ok_or(ComparedSignalsError::NoDrive { expected: names[0] })?;
        let filter_hz = recording.metadata.filter_hz;
        match (filter_hz, model) {
            (Some(corner_hz), MachineModel::Actuator(model)) if channel.name() == QAxisCurrent => {
                let rate_hz = channel.regular_rate_hz()?;
                let tick_hz = model.actuator.controller.sample_hz;
                let values = before_low_pass(channel.values(), rate_hz, corner_hz, tick_hz);
                let channel = Channel::new(QAxisCurrent, channel.times_s(), values)?;
                Ok(Self { channel, filter_hz: None })
            }
            _ => Ok(Self { channel, filter_hz }),
        }
    }
}

/// Envelope that stands for the current of a machine's drive; a servo axis has no phases.
fn usual_envelope(model: &MachineModel) -> Envelope {
    match model {
        MachineModel::Actuator(model) => model.actuator.inverter.commutation.envelope(),
        MachineModel::ServoAxis(_) => Envelope::ConductingPhase,
    }
}

/// The envelope of the phase currents as the metadata name it, else the usual one; `None` for a
/// recording without all three.
fn envelope(
    recording: &Recording,
    pole_pairs: u32,
    usual: Envelope,
) -> Result<Option<DriveSignal>, ComparedSignalsError> {
    use ChannelName::{Current, MotorAngle, PhaseACurrent, PhaseBCurrent, PhaseCCurrent};
    let phases = [PhaseACurrent, PhaseBCurrent, PhaseCCurrent].map(|name| recording.channel(name));
    let [Some(a), Some(b), Some(c)] = phases else { return Ok(None) };
    let angle = recording.channel(MotorAngle).ok_or(ComparedSignalsError::NoRotorAngle)?;
    if [b, c].iter().any(|phase| phase.times_s() != a.times_s()) {
        return Err(RecordError::ChannelTime {
            channel: PhaseBCurrent,
            index: 0,
            can_be_bridged: false,
            begins_again: false,
            rows_before: None,
        }
        .into());
    }
    let envelope = recording.metadata.envelope.map_or(usual, envelope_of);
    let phases = [a, b, c].map(Channel::values);
    let values = envelope.of_phases_at(phases, &angle.at(a.times_s()), pole_pairs);
    let channel = Channel::new(Current, a.times_s(), values)?;
    Ok(Some(DriveSignal { channel, filter_hz: None }))
}
