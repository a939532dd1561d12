//! From a recording to the signal that is diagnosed, at the rate and with the filter of an
//! experiment.

use std::borrow::Cow;

use ema_sim::{Envelope, EnvelopeFilter, FAULT_COUNT, Sector};
use recordings::{
    Channel, ChannelName, ClockNote, CommandSource, Current, Recording, Sampling, TakenRate,
    WINDING_TEMPERATURES_K,
};

use crate::{
    online::{
        command_clock::begun_by_command,
        command_start::CommandStart,
        commutation::{Commutation, MOST_DEVIATION_RAD},
        motor_voltage::MotorVoltage,
        observation_error::ObservationError,
        other_load::OtherLoad,
        phase_sum::{PhaseSum, zero_sequence_noise_a},
        ripple::TakenRipple,
        wiring::Wiring,
    },
    report::{Fault, FaultId, Notice, NoticeCode, RecordDiagnosis, Status},
    simulation::{
        envelope::{envelope_kind, filtered},
        experiment::Experiment,
        low_pass::before_low_pass,
        shifting::{advanced, at_ticks},
    },
    unit::{
        learnt_unit::session_of,
        sensors::{SensorShares, measured_shares},
    },
};

/// The diagnosed signal of a recording, with what the recording says of itself.
#[derive(Clone, Debug)]
pub(crate) struct Observation {
    /// Filtered envelope, A.
    pub(crate) signal_a: Vec<f64>,
    /// The envelope before its filter, where it is known.
    pub(crate) envelope: Option<UnfilteredEnvelope>,
    /// Rotor angle at the first sample, where it is known, rad.
    pub(crate) start_angle_rad: Option<f64>,
    /// Where that angle is read off the commutation: what was seen of it.
    pub(crate) commutation: Option<Commutation>,
    /// Rate of the phase samples behind the envelope.
    pub(crate) phase_rate_hz: f64,
    /// Noise on each phase sample read off the recording itself, A.
    pub(crate) measured_noise_a: Option<f64>,
    /// Noise and errors of the phases' sensors by the sum of the phases.
    pub(crate) phase_sum: Option<PhaseSum>,
    /// Shares of the signal that errors of the phases' sensors have, where phases were recorded.
    pub(crate) sensor_shares: Option<SensorShares>,
    /// Noise on each phase sample by the metadata, A.
    pub(crate) stated_noise_a: Option<f64>,
    /// Root mean square error of a sample that filling gaps and resampling have made, A: part of the
    /// noise, and not seen in the sum of the phases, which is zero before and after.
    pub(crate) resampling_error_a: f64,
    /// Where the command begins, where the recording was running before it.
    pub(crate) start: Option<CommandStart>,
    /// Ripple of the carrier that was taken off, where the phases were sampled out of step.
    pub(crate) ripple: Option<TakenRipple>,
    /// Load that the recording states, where it is not that of the test.
    pub(crate) other_load: Option<OtherLoad>,
    /// Wiring of the phases, where it is not as stated.
    pub(crate) wiring: Option<Wiring>,
    /// Session that the recording states, else its day.
    pub(crate) session: Option<String>,
    /// Temperature of the winding with its standard deviation, where it was read, K.
    pub(crate) winding_temperature_k: Option<(f64, f64)>,
    pub(crate) motor_voltage: MotorVoltage,
    pub(crate) notices: Vec<Notice>,
}

/// An envelope before its filter.
#[derive(Clone, Debug)]
pub(crate) struct UnfilteredEnvelope {
    /// A.
    pub(crate) samples_a: Vec<f64>,
    pub(crate) rate_hz: f64,
}

impl UnfilteredEnvelope {
    /// The signal of an experiment, from a time after the first sample on, or before it, s.
    fn filtered_from(&self, by_s: f64, experiment: &Experiment) -> Vec<f64> {
        if by_s == 0.0 {
            return filtered(&self.samples_a, self.rate_hz, experiment);
        }
        filtered(&advanced(&self.samples_a, by_s * self.rate_hz), self.rate_hz, experiment)
    }
}

/// Standard deviation of a temperature that comes without one, K: that of a sensor on the winding.
pub(crate) const TEMPERATURE_STD_K: f64 = 3.0;

/// Temperature of the winding that metadata state, else the mean of its channel, with its standard
/// deviation, K.
fn winding_temperature_k(recording: &Recording) -> Result<Option<(f64, f64)>, ObservationError> {
    let metadata = &recording.metadata;
    let mean_k = || {
        let values = recording.channel(ChannelName::WindingTemperature)?.values();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    let Some(found_k) = metadata.winding_temperature_k.or_else(mean_k) else { return Ok(None) };
    if !WINDING_TEMPERATURES_K.contains(&found_k) {
        return Err(ObservationError::TemperatureUnit { found_k });
    }
    Ok(Some((found_k, metadata.winding_temperature_std_k.unwrap_or(TEMPERATURE_STD_K))))
}

/// Lowest rate at which phase currents still show the sectors.
const LEAST_PHASE_RATE_HZ: f64 = 2000.0;
/// Currents beyond this many times the controller's limit are in another unit, such as mA.
const BEYOND_LIMIT: f64 = 10.0;
/// Share of a sample by which the times of two phases may differ: lines through stamps that scatter
/// by 0.4 samples, with and without a few of 100 or more.
const SAME_TIME_SAMPLES: f64 = 0.02;
/// Difference of two times that are one, as times are rounded, s.
const SAME_INSTANT_S: f64 = 1e-9;
/// Largest difference of a recorded command from the bundle's, as a share of its range.
const COMMAND_TOLERANCE: f64 = 0.01;

impl Observation {
    /// Reads the signal of an experiment off a recording, from where the command begins on, which has to
    /// be known.
    pub(crate) fn of(
        recording: &Recording,
        experiment: &Experiment,
        max_delay_s: f64,
    ) -> Result<Self, ObservationError> {
        let (recording, start) = begun_by_command(recording, experiment)?;
        let recording = recording.as_ref();
        if let Some(start) = start.filter(|start| start.std_s() > 0.0) {
            return Err(ObservationError::StartUnknown { after_s: start.after_s(recording) });
        }
        Self::begun(recording, experiment, start, max_delay_s)
    }

    /// Noise on each phase sample beside errors of the sensors' gains, which add to the sum of the
    /// phases, A.
    pub(crate) fn noise_beside_gains_a(&self) -> Option<f64> {
        self.phase_sum.map(|sum| sum.noise_a)
    }

    /// Reads the signal of an experiment off a recording, from a start of the command on, else from its
    /// first sample.
    pub(crate) fn begun(
        recording: &Recording,
        experiment: &Experiment,
        start: Option<CommandStart>,
        max_delay_s: f64,
    ) -> Result<Self, ObservationError> {
        let mut notices = mended(recording);
        notices.extend(computed(recording));
        notices.extend(start.map(|start| start.notice(recording)));
        let (cut, late_s) = match start {
            Some(start) => {
                let (cut, late_s) = start.cut(recording)?;
                (Cow::Owned(cut), late_s)
            }
            None => (Cow::Borrowed(recording), 0.0),
        };
        let recording = cut.as_ref();
        let current = recording.require_current()?;
        let mut observation = match current {
            Current::Phases(phases) => of_phases(recording, phases, experiment)?,
            Current::Envelope(channel) => of_envelope(recording, channel, experiment)?,
            Current::Quadrature(channel) => of_quadrature(recording, channel, experiment)?,
        };
        check_command(recording, experiment, late_s, max_delay_s, &mut notices)?;
        if late_s != 0.0 {
            observation.signal_a = observation.advanced(late_s, experiment);
        }
        notices.append(&mut observation.notices);
        (observation.notices, observation.start) = (notices, start);
        observation.motor_voltage = MotorVoltage::of(recording, late_s, experiment);
        // a drive computes its own current at its ticks
        if let Current::Phases([phase, ..]) = current
            && let Some(instants) = observation.out_of_step(phase, late_s, experiment)
        {
            let is_by_command =
                |note: &ClockNote| matches!(note.taken, Some(TakenRate::Command(_)));
            let may_be_none = recording.clock_notes().iter().any(is_by_command);
            observation.take_ripple_if_shown(instants, may_be_none, experiment)?;
        }
        observation.other_load = OtherLoad::of(recording, experiment);
        observation.take_load(experiment)?;
        if let Some(load) = &observation.other_load {
            load.check()?;
            observation.notices.extend(load.notice(experiment));
        }
        Ok(observation)
    }

    /// Standard deviation of the time at which the command begins, s; zero where it is known.
    pub(crate) fn start_std_s(&self) -> f64 {
        self.start.map_or(0.0, |start| start.std_s())
    }
}

impl Observation {
    /// The signal from a time after the first sample on, or before it, s: from the envelope before
    /// its filter, else between the samples of the filtered one. What the recording lacks is held.
    pub(crate) fn advanced(&self, by_s: f64, experiment: &Experiment) -> Vec<f64> {
        match &self.envelope {
            Some(envelope) => envelope.filtered_from(by_s, experiment),
            None => advanced(&self.signal_a, by_s * experiment.filter.output_hz),
        }
    }
}

/// The uniform sampling of a channel that is long enough.
fn uniform_sampling(
    recording: &Recording,
    channel: &Channel,
) -> Result<Sampling, ObservationError> {
    let sampling = channel.sampling()?;
    let column = channel.name().column();
    recording.require_no_gap(channel)?;
    if !sampling.is_uniform() {
        let Sampling { deviation_s, tolerance_s, .. } = sampling;
        return Err(ObservationError::Irregular { column, deviation_s, tolerance_s });
    }
    Ok(sampling)
}

/// Refuses a channel that ends before the command does.
fn long_enough(
    channel: &Channel,
    sampling: &Sampling,
    experiment: &Experiment,
) -> Result<(), ObservationError> {
    let expected_s = experiment.scenario.duration_s;
    // the last output sample stands one output period before the end
    let last_needed_s = expected_s - 1.0 / experiment.filter.output_hz;
    let found_s = sampling.samples as f64 / sampling.rate_hz;
    let last_s = (sampling.samples - 1) as f64 / sampling.rate_hz;
    if last_s < last_needed_s * (1.0 - 1e-9) {
        return Err(ObservationError::TooShort {
            column: channel.name().column(),
            found_s,
            expected_s,
            command: experiment.name.clone(),
        });
    }
    Ok(())
}

/// Refuses currents that no sensor of the actuator shows, outliers apart.
fn within_limit(channel: &Channel, experiment: &Experiment) -> Result<(), ObservationError> {
    let limit_a = experiment.actuator.controller.current_limit_a;
    let found_a = BEYOND_LIMIT * limit_a;
    let values = channel.values();
    let beyond = values.iter().filter(|value| value.abs() > found_a).count();
    if 10 * beyond > values.len() {
        let column = channel.name().column();
        return Err(ObservationError::BeyondLimit { column, found_a, limit_a });
    }
    Ok(())
}

/// Three phase currents.
fn of_phases(
    recording: &Recording,
    phases: [&Channel; 3],
    experiment: &Experiment,
) -> Result<Observation, ObservationError> {
    let first = phases[0];
    let sampling = current_fast_enough(recording, first, experiment)?;
    phases[1..].iter().try_for_each(|phase| within_limit(phase, experiment))?;
    for other in &phases[1..] {
        if let Some(error) = different_axes(recording, first, other, sampling.rate_hz) {
            return Err(error);
        }
    }
    let columns = phases.map(Channel::values);
    let rotor = rotor_of(recording, phases, sampling.rate_hz, experiment)?;
    let wiring = rotor.wiring(columns, sampling.rate_hz, recording.computed_phase(), experiment);
    let rewired = wiring.map(|wiring| wiring.phases(columns));
    let views = rewired.as_ref().map_or(columns, |phases| phases.each_ref().map(Vec::as_slice));
    let samples_a = experiment.envelope.of_phases(views, &rotor.electrical_rad);
    let envelope = UnfilteredEnvelope { samples_a, rate_hz: sampling.rate_hz };
    // the filters cost as much as the signal itself, and only tolerances need them
    let shares = (!experiment.tolerance.is_empty()).then(|| {
        measured_shares(views, &rotor.electrical_rad, experiment, |channel| {
            filtered(channel, sampling.rate_hz, experiment)
        })
    });
    Ok(Observation {
        signal_a: envelope.filtered_from(0.0, experiment),
        envelope: Some(envelope),
        start_angle_rad: rotor.start_angle_rad,
        commutation: rotor.commutation,
        phase_rate_hz: sampling.rate_hz,
        measured_noise_a: zero_sequence_noise_a(views),
        phase_sum: PhaseSum::of(views),
        sensor_shares: shares,
        stated_noise_a: recording.metadata.noise_a,
        resampling_error_a: root_mean_square(phases.map(Channel::resampling_error)),
        start: None,
        ripple: None,
        other_load: None,
        wiring,
        session: session_of(&recording.metadata),
        winding_temperature_k: winding_temperature_k(recording)?,
        motor_voltage: MotorVoltage::NotRecorded,
        notices: wiring.iter().map(Wiring::notice).collect(),
    })
}

/// Notices of samples that were put in order, filled or resampled when the file was read.
fn mended(recording: &Recording) -> Vec<Notice> {
    let notes = recording.clock_notes().iter();
    let notice =
        |note: &ClockNote| Notice { code: NoticeCode::SamplesMended, message: note.to_string() };
    notes.map(notice).collect()
}

/// Notice of a phase that was not recorded.
fn computed(recording: &Recording) -> Option<Notice> {
    let name = recording.computed_phase()?;
    let message = format!(
        "`{name}` is not recorded and taken for what brings the sum of the phases to zero: right for a \
         winding without a neutral conductor"
    );
    Some(Notice { code: NoticeCode::PhaseComputed, message })
}

fn root_mean_square(of: [f64; 3]) -> f64 {
    (of.iter().map(|x| x * x).sum::<f64>() / 3.0).sqrt()
}

/// Says where the time axes of two phases first differ, where they do by more than a filled axis may
/// differ from one that lacks nothing.
fn different_axes(
    recording: &Recording,
    first: &Channel,
    other: &Channel,
    rate_hz: f64,
) -> Option<ObservationError> {
    let (a, b) = (first.times_s(), other.times_s());
    let is_other = |(a, b): (&f64, &f64)| (a - b).abs() * rate_hz > SAME_TIME_SAMPLES;
    let place = a.iter().zip(b).position(is_other).unwrap_or(a.len().min(b.len()));
    if place == a.len() && place == b.len() {
        return None;
    }
    // of two unequal times the earlier one has no partner
    let ends = [a.get(place), b.get(place)].into_iter().flatten().copied();
    let time_s = ends.fold(f64::INFINITY, f64::min);
    let line = recording.line_at(time_s);
    Some(ObservationError::TimeAxes { column: other.name().column(), time_s, line })
}

/// Where the rotor stands in a recording of phases.
struct Rotor {
    /// At the first sample, mechanical.
    start_angle_rad: Option<f64>,
    /// At each sample of the phases.
    electrical_rad: Vec<f64>,
    commutation: Option<Commutation>,
    /// True where something else than the currents shows it.
    is_seen_apart: bool,
}

impl Rotor {
    /// The wiring of columns of phases, where the rotor's angle shows another than the stated one.
    fn wiring(
        &self,
        columns: [&[f64]; 3],
        rate_hz: f64,
        computed: Option<ChannelName>,
        experiment: &Experiment,
    ) -> Option<Wiring> {
        let start_angle_rad = self.start_angle_rad.filter(|_| self.is_seen_apart)?;
        let electrical_rad = &self.electrical_rad;
        Wiring::found(columns, electrical_rad, rate_hz, start_angle_rad, computed, experiment)
    }
}

/// The rotor's angle: as recorded, else from Hall sensors, else from the currents.
fn rotor_of(
    recording: &Recording,
    phases: [&Channel; 3],
    rate_hz: f64,
    experiment: &Experiment,
) -> Result<Rotor, ObservationError> {
    let times_s = phases[0].times_s();
    if let Some(angle) = recording.channel(ChannelName::MotorAngle) {
        let pole_pairs = f64::from(experiment.actuator.motor.pole_pairs);
        let unheld = angle.unheld();
        let angle = unheld.as_ref().unwrap_or(angle);
        let electrical = angle.smooth_at(times_s).into_iter().map(|theta| theta * pole_pairs);
        return Ok(Rotor {
            start_angle_rad: angle.values().first().copied(),
            electrical_rad: electrical.collect(),
            commutation: None,
            is_seen_apart: true,
        });
    }
    let hall = recording.channel(ChannelName::HallState);
    let (seen, seen_in) = if let Some(hall) = hall {
        let sectors = sectors_at(hall, times_s)?;
        (Some(Commutation::of_sectors(sectors, rate_hz, experiment)?), "in `hall_state`")
    } else {
        let views = phases.map(Channel::values);
        let noise_a = zero_sequence_noise_a(views).unwrap_or(0.0);
        let seen = Commutation::of_currents(views, noise_a, rate_hz, experiment)?;
        (seen, "in the currents")
    };
    let deviation_rad = seen.as_ref().map_or(core::f64::consts::PI, |seen| seen.deviation_rad);
    match seen {
        Some(seen) if deviation_rad <= MOST_DEVIATION_RAD => Ok(Rotor {
            start_angle_rad: Some(seen.start_angle_rad(experiment, &[0.0; FAULT_COUNT])?),
            electrical_rad: if hall.is_some() {
                seen.electrical_rad()
            } else {
                seen.clone().before_the_tick(experiment).electrical_rad()
            },
            commutation: Some(seen),
            is_seen_apart: hall.is_some(),
        }),
        _ => Err(ObservationError::NoRotorAngle {
            seen_in,
            deviation_deg: deviation_rad.to_degrees(),
            most_deg: MOST_DEVIATION_RAD.to_degrees(),
        }),
    }
}

/// The sectors that Hall sensors show at given times, held between their samples.
fn sectors_at(hall: &Channel, times_s: &[f64]) -> Result<Vec<Sector>, ObservationError> {
    let (own, values) = (hall.times_s(), hall.values());
    let mut place = 0;
    times_s
        .iter()
        .map(|&t| {
            while place + 1 < own.len() && own[place + 1] <= t {
                place += 1;
            }
            let found = values[place];
            let state = (1..=6u8).find(|state| f64::from(*state) == found);
            let refused = ObservationError::HallState { found, time_s: own[place] };
            state.and_then(Sector::from_hall_state).ok_or(refused)
        })
        .collect()
}

/// An envelope as recorded.
fn of_envelope(
    recording: &Recording,
    channel: &Channel,
    experiment: &Experiment,
) -> Result<Observation, ObservationError> {
    let metadata = &recording.metadata;
    let expected = envelope_kind(experiment.envelope);
    let found = metadata.envelope.unwrap_or(expected);
    if found != expected {
        let (found, expected) = (found.name(), expected.name());
        return Err(ObservationError::OtherEnvelope { found, expected });
    }
    let EnvelopeFilter { corner_hz, output_hz } = experiment.filter;
    let sampling = uniform_sampling(recording, channel)?;
    let column = channel.name().column();
    if !sampling.agrees_with(output_hz) {
        let expected = format!("{output_hz} Hz as the bundle has it");
        return Err(ObservationError::Rate { column, found_hz: sampling.rate_hz, expected });
    }
    if let Some(found_hz) = metadata.filter_hz
        && (found_hz / corner_hz - 1.0).abs() > 1e-6
    {
        return Err(ObservationError::OtherFilter { found_hz, expected_hz: corner_hz });
    }
    long_enough(channel, &sampling, experiment)?;
    let phase_rate_hz = metadata.phase_rate_hz.unwrap_or(experiment.actuator.controller.sample_hz);
    let signal_a = channel.values()[..experiment.samples()].to_vec();
    of_channel(recording, channel, signal_a, phase_rate_hz)
}

/// The quadrature-axis current of a field-oriented drive, at a rate of its own and behind the drive's
/// own low-pass.
fn of_quadrature(
    recording: &Recording,
    channel: &Channel,
    experiment: &Experiment,
) -> Result<Observation, ObservationError> {
    if experiment.envelope != Envelope::QAxis {
        return Err(ObservationError::QuadratureOfSixSteps);
    }
    let Sampling { rate_hz, .. } = current_fast_enough(recording, channel, experiment)?;
    let tick_hz = experiment.actuator.controller.sample_hz;
    let (samples_a, fine_hz) = at_ticks(channel.values(), rate_hz, tick_hz);
    let samples_a = match recording.metadata.filter_hz {
        Some(corner_hz) => before_low_pass(&samples_a, fine_hz, corner_hz, tick_hz),
        None => samples_a,
    };
    let envelope = UnfilteredEnvelope { samples_a, rate_hz: fine_hz };
    let signal_a = envelope.filtered_from(0.0, experiment);
    let observation = of_channel(recording, channel, signal_a, rate_hz)?;
    Ok(Observation { envelope: Some(envelope), ..observation })
}

/// The uniform sampling of a current that is long and fast enough for the experiment's filter, within
/// the controller's limit.
fn current_fast_enough(
    recording: &Recording,
    channel: &Channel,
    experiment: &Experiment,
) -> Result<Sampling, ObservationError> {
    let sampling = sampled_fast_enough(recording, channel, experiment)?;
    within_limit(channel, experiment)?;
    Ok(sampling)
}

/// The uniform sampling of a channel that is long and fast enough for the experiment's filter.
pub(super) fn sampled_fast_enough(
    recording: &Recording,
    channel: &Channel,
    experiment: &Experiment,
) -> Result<Sampling, ObservationError> {
    let sampling = uniform_sampling(recording, channel)?;
    if sampling.rate_hz < LEAST_PHASE_RATE_HZ * (1.0 - 1e-9) {
        let column = channel.name().column();
        let expected = format!("{LEAST_PHASE_RATE_HZ} Hz or more");
        return Err(ObservationError::Rate { column, found_hz: sampling.rate_hz, expected });
    }
    long_enough(channel, &sampling, experiment)?;
    Ok(sampling)
}

/// The observation of a recording of one current, with what it says besides its signal.
fn of_channel(
    recording: &Recording,
    channel: &Channel,
    signal_a: Vec<f64>,
    phase_rate_hz: f64,
) -> Result<Observation, ObservationError> {
    let metadata = &recording.metadata;
    Ok(Observation {
        signal_a,
        envelope: None,
        start_angle_rad: metadata
            .start_angle_rad
            .or_else(|| recording.channel(ChannelName::MotorAngle)?.values().first().copied()),
        commutation: None,
        phase_rate_hz,
        measured_noise_a: None,
        phase_sum: None,
        sensor_shares: None,
        stated_noise_a: metadata.noise_a,
        resampling_error_a: channel.resampling_error(),
        start: None,
        ripple: None,
        other_load: None,
        wiring: None,
        session: session_of(metadata),
        winding_temperature_k: winding_temperature_k(recording)?,
        motor_voltage: MotorVoltage::NotRecorded,
        notices: Vec::new(),
    })
}

/// Compares the recording's command with the bundle's, which begins late by a part of a sample,
/// before and after it by some delay.
fn check_command(
    recording: &Recording,
    experiment: &Experiment,
    late_s: f64,
    max_delay_s: f64,
    notices: &mut Vec<Notice>,
) -> Result<(), ObservationError> {
    if let Some(CommandSource::Named(found)) = &recording.metadata.command {
        return if *found == experiment.name {
            Ok(())
        } else {
            let (found, expected) = (found.clone(), experiment.name.clone());
            Err(ObservationError::OtherCommand { found, expected })
        };
    }
    let Some(channel) = recording.channel(ChannelName::Command) else {
        notices.push(Notice {
            code: NoticeCode::CommandAssumed,
            message: format!(
                "the recording does not say its command; `{}` of the bundle is assumed",
                experiment.name
            ),
        });
        return Ok(());
    };
    let command = |t: f64| experiment.scenario.command.at(t);
    let start_s = channel.times_s().first().copied().unwrap_or(0.0) + late_s;
    let (mut range, mut worst) = (0.0f64, (0.0f64, 0.0, 0.0, 0.0));
    for (&time_s, &found_rad) in channel.times_s().iter().zip(channel.values()) {
        let since_s = (time_s - start_s).max(0.0);
        if since_s >= experiment.scenario.duration_s - SAME_INSTANT_S {
            break;
        }
        let expected_rad = command(since_s);
        range = range.max(expected_rad.abs());
        let ends = [-max_delay_s, max_delay_s].map(|late_s| command((since_s - late_s).max(0.0)));
        let least = ends[0].min(ends[1]).min(expected_rad);
        let most = ends[0].max(ends[1]).max(expected_rad);
        let difference = (least - found_rad).max(found_rad - most).max(0.0);
        if difference > worst.0 {
            worst = (difference, found_rad, expected_rad, time_s);
        }
    }
    if worst.0 > COMMAND_TOLERANCE * range {
        return Err(ObservationError::CommandDiffers {
            found_rad: worst.1,
            expected_rad: worst.2,
            time_s: worst.3,
            command: experiment.name.clone(),
        });
    }
    Ok(())
}

/// Drops the direction of the eccentricity from an answer, where whole electrical turns are open.
pub(crate) fn forget_direction(answer: &mut RecordDiagnosis, pole_pairs: u32) {
    let direction = &mut answer.faults[FaultId::K7 as usize];
    if direction.value.is_some() {
        answer.status = Status::Partial;
    }
    *direction = Fault::undetermined(FaultId::K7);
    answer.notices.retain(|notice| notice.code != NoticeCode::PhaseUndetermined);
    answer.notices.push(Notice {
        code: NoticeCode::ElectricalTurnUnknown,
        message: format!(
            "the rotor's angle is read off the commutation, which looks alike {pole_pairs} times a \
             turn: the direction of an eccentricity (k7) stays open; record `motor_angle_rad`"
        ),
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_winding_s_temperature_is_read_off_metadata_or_its_channel() {
        let read_k = |head: &str| {
            let text = format!("{head}time_s,winding_temperature_k\n0,310\n0.1,312\n");
            let map = recordings::ColumnMap::default();
            let recording = Recording::parse("t.csv", text.as_bytes(), &map).unwrap();
            winding_temperature_k(&recording).unwrap()
        };
        assert_eq!(read_k(""), Some((311.0, TEMPERATURE_STD_K)));
        assert_eq!(read_k("# winding-temperature-sd-k = 1.5\n"), Some((311.0, 1.5)));
        let stated = "# winding-temperature-k = 305\n";
        assert_eq!(read_k(stated), Some((305.0, TEMPERATURE_STD_K)));
    }

    #[test]
    fn a_temperature_in_another_unit_is_read_by_its_map_alone() {
        let read_k = |column: &str, map: &[&str]| {
            let text = format!("time_s,{column}\n0,20\n0.1,22\n");
            let map = recordings::ColumnMap::new(map).unwrap();
            winding_temperature_k(&Recording::parse("t.csv", text.as_bytes(), &map).unwrap())
        };
        let refused = read_k("winding_temperature_k", &[]).unwrap_err().to_string();
        assert!(refused.starts_with("the mean of `winding_temperature_k` is 21.0"), "{refused}");
        let (found_k, _) = read_k("T", &["winding_temperature_k=T*1+273.15"]).unwrap().unwrap();
        assert!((found_k - 294.15).abs() < 1e-9, "{found_k}");
    }
}
