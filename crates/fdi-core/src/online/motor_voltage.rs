//! The motor's voltage of a recording.
//!
//! A drive knows the voltage that it puts on the motor: its duty times the supply. A recording has
//! it as `motor_voltage_v`, as `q_axis_voltage_v` of a field-oriented drive, or as `duty_frac` with
//! `bus_voltage_v`.

use ema_sim::Commutation;
use recordings::{Channel, ChannelName, Recording};

use crate::{
    online::observation::sampled_fast_enough,
    simulation::{
        cut_phase::cut,
        envelope::filtered,
        experiment::Experiment,
        shifting::{advanced, at_ticks},
    },
};

/// Share of the supply from which on a drive may hold its voltage.
const HELD_SHARE: f64 = 0.8;
/// Share by which a recorded voltage and duty times supply may differ: dead time and the drop of
/// switches are less.
const MOST_APART: f64 = 0.2;
/// Duty up to which a value beyond one is a spike, and above which it is of percent.
const MOST_SPIKE: f64 = 2.0;

/// The motor's voltage, as far as a recording has it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum MotorVoltage {
    NotRecorded,
    /// Through the filter of the experiment.
    Filtered {
        /// V.
        voltage_v: Vec<f64>,
        /// Columns that it was read off.
        columns: &'static str,
    },
    /// Recorded, and of no use for this reason.
    Unusable(String),
}

impl MotorVoltage {
    /// True where a recording has a channel of it, of use or not.
    pub(crate) fn is_recorded(recording: &Recording) -> bool {
        let names = [ChannelName::MotorVoltage, ChannelName::QAxisVoltage, ChannelName::Duty];
        names.iter().any(|&name| recording.channel(name).is_some())
    }

    /// Reads the voltage off a recording whose command begins late by a part of a sample, s.
    pub(crate) fn of(recording: &Recording, late_s: f64, experiment: &Experiment) -> Self {
        match samples(recording, experiment) {
            Ok(None) => Self::NotRecorded,
            Ok(Some(Samples { columns, voltage_v, rate_hz })) => {
                let tick_hz = experiment.actuator.controller.sample_hz;
                let (mut fine_v, fine_hz) = at_ticks(&voltage_v, rate_hz, tick_hz);
                if late_s != 0.0 {
                    fine_v = advanced(&fine_v, late_s * fine_hz);
                }
                Self::Filtered { voltage_v: filtered(&fine_v, fine_hz, experiment), columns }
            }
            Err(reason) => Self::Unusable(reason),
        }
    }
}

/// Samples of a voltage, with the columns that they are from.
struct Samples {
    columns: &'static str,
    voltage_v: Vec<f64>,
    rate_hz: f64,
}

/// Samples of the voltage; `None` where there are none.
fn samples(recording: &Recording, experiment: &Experiment) -> Result<Option<Samples>, String> {
    let is_field_oriented = experiment.actuator.inverter.commutation == Commutation::FieldOriented;
    let own = [ChannelName::QAxisVoltage, ChannelName::MotorVoltage];
    let own = &own[usize::from(!is_field_oriented)..];
    if let Some(channel) = own.iter().find_map(|&name| recording.channel(name)) {
        let rate_hz = usable_rate_hz(recording, channel, experiment)?;
        let columns = channel.name().column();
        refuse_cut(channel, HELD_SHARE * experiment.actuator.inverter.bus_voltage_v)?;
        agrees_with_duty(channel, recording, is_field_oriented)?;
        return Ok(Some(Samples { columns, voltage_v: channel.values().to_vec(), rate_hz }));
    }
    let bus = recording.channel(ChannelName::BusVoltage);
    let Some(duty) = recording.channel(ChannelName::Duty) else {
        return match recording.channel(ChannelName::QAxisVoltage) {
            Some(_) => Err("`q_axis_voltage_v` is of a field-oriented drive, and this machine is \
                            commutated in six steps: record `motor_voltage_v`"
                .to_owned()),
            None if bus.is_some() => {
                Err("`bus_voltage_v` is recorded without `duty_frac`".to_owned())
            }
            None => Ok(None),
        };
    };
    let Some(bus) = bus else {
        return Err("`duty_frac` is recorded without `bus_voltage_v`".to_owned());
    };
    let largest = duty.values().iter().fold(0.0_f64, |most, duty| most.max(duty.abs()));
    let of_percent =
        if largest > MOST_SPIKE { "; of percent, `--map duty_frac=COLUMN*0.01`" } else { "" };
    refuse(duty, |duty| duty.abs() > 1.0 + 1e-6, &format!("−1 to 1{of_percent}"))?;
    refuse(bus, |bus_v| bus_v <= 0.0, "a positive supply")?;
    refuse_cut(duty, HELD_SHARE)?;
    let rate_hz = usable_rate_hz(recording, duty, experiment)?;
    let voltage_v = of_duty(duty, bus, is_field_oriented);
    Ok(Some(Samples { columns: OF_DUTY, voltage_v, rate_hz }))
}

/// Columns of a voltage that duty and supply give.
const OF_DUTY: &str = "duty_frac · bus_voltage_v";

/// Duty times supply, V.
fn of_duty(duty: &Channel, bus: &Channel, is_field_oriented: bool) -> Vec<f64> {
    // the axes of a field-oriented drive reach to half of the supply
    let reach = if is_field_oriented { 0.5 } else { 1.0 };
    let bus_v = bus.at(duty.times_s());
    duty.values().iter().zip(bus_v).map(|(duty, bus_v)| reach * duty * bus_v).collect()
}

/// Refuses a recorded voltage beside which duty times supply has another size.
fn agrees_with_duty(
    voltage: &Channel,
    recording: &Recording,
    is_field_oriented: bool,
) -> Result<(), String> {
    let by_name = |name| recording.channel(name);
    let (Some(duty), Some(bus)) = (by_name(ChannelName::Duty), by_name(ChannelName::BusVoltage))
    else {
        return Ok(());
    };
    let other_v = of_duty(duty, bus, is_field_oriented);
    let own_v = voltage.at(duty.times_s());
    let products = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let times = products(&own_v, &other_v) / products(&own_v, &own_v);
    if times.is_finite() && (times - 1.0).abs() > MOST_APART {
        let column = voltage.name().column();
        return Err(format!(
            "`{OF_DUTY}` is {times:.2} times `{column}`, and both are recorded: leave out the wrong one"
        ));
    }
    Ok(())
}

/// Refuses a channel that was cut at a level below one that the drive may hold it at.
fn refuse_cut(channel: &Channel, held: f64) -> Result<(), String> {
    let Some((level, share)) = cut(channel.values(), held) else { return Ok(()) };
    Err(format!(
        "`{}` is clipped: {:.1} % of its samples stand at {level}, an end of its range; record it with a \
         wider range",
        channel.name().column(),
        100.0 * share
    ))
}

/// Refuses a channel by its first value that is wrong.
fn refuse(channel: &Channel, is_wrong: impl Fn(f64) -> bool, expected: &str) -> Result<(), String> {
    let Some(place) = channel.values().iter().position(|&value| is_wrong(value)) else {
        return Ok(());
    };
    let (column, value) = (channel.name().column(), channel.values()[place]);
    Err(format!("`{column}` is {value} at {} s, expected {expected}", channel.times_s()[place]))
}

/// Rate of a channel that is even, fast and long enough.
fn usable_rate_hz(
    recording: &Recording,
    channel: &Channel,
    experiment: &Experiment,
) -> Result<f64, String> {
    let sampling = sampled_fast_enough(recording, channel, experiment);
    sampling.map(|sampling| sampling.rate_hz).map_err(|error| error.to_string())
}
