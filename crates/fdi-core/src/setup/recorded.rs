//! Recordings as they were made: wiring, start, travel and noise, before anything is learnt from them.

use recordings::{Channel, ChannelName, Current, Recording};

use crate::{
    online::{
        command_clock::begun_by_command, observation::Observation,
        observation_error::ObservationError, phase_sum::PhaseSum, wiring::MappedColumn,
    },
    report::{NoticeCode, SetupChoice, SetupRefusalCode},
    setup::error::SetupError,
    simulation::{cut_phase::CutPhase, experiment::Experiment},
    statistics::range,
    unit::learnt_unit::LearntUnit,
};

/// Share by which the rotor's travel may differ from the model's: what tolerances change of the motion in
/// a closed loop is far less, another gear far more.
const MOST_TRAVEL_OFF: f64 = 0.05;

/// Share of the current's root mean square, noise included, that may be noise.
const MOST_NOISE: f64 = 0.5;

/// The healthy machine of the model file in the test.
#[derive(Clone, Copy, Debug)]
pub(super) struct Healthy {
    /// Distance that its rotor travels, rad.
    pub(super) travel_rad: f64,
    /// Noise on each phase sample where a recording shows none, A.
    pub(super) noise_a: f64,
}

/// A recording as it was made.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    /// Columns of the phases as the rotor's angle shows them; empty where they are as stated.
    pub(super) wiring: Vec<MappedColumn>,
    /// Where the rotor starts, rad.
    pub(super) start_angle_rad: Option<f64>,
    /// Time from the first sample to the command, s; zero where the recording begins with it.
    after_s: f64,
    /// Rate of the samples behind the envelope.
    pub(super) phase_rate_hz: f64,
    /// Noise on each phase sample, A.
    pub(super) noise_a: f64,
    /// Noise and errors of the sensors by the sum of the phases, where that is not zero.
    phase_sum: Option<PhaseSum>,
    /// Notices of samples that were put in order, filled or computed.
    mended: Vec<String>,
}

impl Seen {
    /// Reads what a recording shows in a test, beside the machine of the model file.
    pub(super) fn of(
        recording: &Recording,
        experiment: &Experiment,
        healthy: &Healthy,
    ) -> Result<Self, SetupError> {
        let refused = |code, reason| Err(SetupError::refused(code, Some(recording), reason));
        let begun = begun_by_command(recording, experiment).map_err(ObservationError::from);
        let observed =
            begun.and_then(|(timed, start)| Observation::begun(&timed, experiment, start, 0.0));
        let observation = match observed {
            Ok(observation) => observation,
            Err(error) => {
                let code = if error.is_too_short() {
                    SetupRefusalCode::TooShort
                } else {
                    SetupRefusalCode::NotReadable
                };
                return refused(code, error.to_string());
            }
        };
        let limit_a = experiment.actuator.controller.current_limit_a;
        if let Some(cut) = CutPhase::of(recording, limit_a) {
            let reason = format!(
                "`{}` stands at {:.3} A in {:.1} % of the samples, below the {limit_a} A that the \
                 controller allows: the range of sensor or logger is too small; widen it",
                cut.channel.column(),
                cut.level_a,
                100.0 * cut.share
            );
            return refused(SetupRefusalCode::Saturated, reason);
        }
        if let Some(reason) = other_travel(recording, healthy.travel_rad) {
            return refused(SetupRefusalCode::WrongGear, reason);
        }
        let noise_a = observation.noise_beside_gains_a().or(observation.measured_noise_a);
        let noise_a = noise_a.or(observation.stated_noise_a);
        if let Some(noise_a) = noise_a
            && noise_a > MOST_NOISE * current_a(recording)
        {
            let reason = format!(
                "the noise on each phase sample is {noise_a:.3} A, more than half of the current: are \
                 the sensors connected, and is their range that of this machine?"
            );
            return refused(SetupRefusalCode::Noise, reason);
        }
        let is_mended = |code: NoticeCode| {
            !matches!(code, NoticeCode::PhasesRewired | NoticeCode::BeginsBeforeCommand)
        };
        let mended = observation.notices.iter().filter(|notice| is_mended(notice.code));
        Ok(Self {
            wiring: observation.wiring.map(|wiring| wiring.columns()).unwrap_or_default(),
            start_angle_rad: observation.start_angle_rad,
            after_s: observation.start.map_or(0.0, |start| start.after_s(recording)),
            phase_rate_hz: observation.phase_rate_hz,
            noise_a: noise_a.unwrap_or(healthy.noise_a),
            phase_sum: observation.phase_sum,
            mended: mended.map(|notice| notice.message.clone()).collect(),
        })
    }

    /// The wiring that this recording and all others show; empty where they differ.
    pub(super) fn wiring_of_all(&self, all: &[Self]) -> Vec<MappedColumn> {
        if all.iter().all(|one| one.wiring == self.wiring) {
            self.wiring.clone()
        } else {
            Vec::new()
        }
    }
}

/// Root mean square of the phases together, A; of the envelope where no phases were recorded.
fn current_a(recording: &Recording) -> f64 {
    let of = |channels: &[&Channel]| {
        let values = channels.iter().flat_map(|channel| channel.values());
        let (sum, count) = values.fold((0.0, 0), |(sum, count), i| (sum + i * i, count + 1));
        (sum / f64::from(count.max(1))).sqrt()
    };
    match recording.require_current() {
        Ok(Current::Phases(phases)) => of(&phases),
        Ok(Current::Envelope(channel) | Current::Quadrature(channel)) => of(&[channel]),
        Err(_) => 0.0,
    }
}

/// Why the rotor does not travel as that of the model does; `None` where it does, or where its angle was
/// not recorded.
fn other_travel(recording: &Recording, expected_rad: f64) -> Option<String> {
    let found_rad = range(recording.channel(ChannelName::MotorAngle)?.values());
    if (found_rad / expected_rad - 1.0).abs() <= MOST_TRAVEL_OFF {
        return None;
    }
    Some(format!(
        "the rotor travels {found_rad:.2} rad, that of the model {expected_rad:.2} rad, {:.2} times as \
         far: is `transmission.gear-ratio` that of this machine, is `motor_angle_rad` the angle of the \
         rotor in rad, and is it this command?",
        found_rad / expected_rad
    ))
}

/// Choices that follow from the recordings.
pub(super) fn choices(seen: &[Seen], unit: &LearntUnit) -> Vec<SetupChoice> {
    let mut choices = Vec::new();
    let mut add = |what: &str, choice: String, reason: &str, pin: Option<String>| {
        choices.push(SetupChoice { what: what.to_owned(), choice, reason: reason.to_owned(), pin });
    };
    let Some(first) = seen.first() else { return choices };
    let wiring = first.wiring_of_all(seen);
    if wiring.is_empty() {
        let differ = seen.iter().any(|one| one.wiring != first.wiring);
        if differ {
            add(
                "wiring",
                "each recording as its rotor's angle shows".to_owned(),
                "the recordings are wired differently",
                None,
            );
        } else {
            add(
                "wiring",
                "as the columns say".to_owned(),
                "the rotor's angle shows no other",
                None,
            );
        }
    } else {
        let others = wiring.iter().filter(|one| !one.is_as_stated());
        let maps: Vec<String> = others.map(MappedColumn::option).collect();
        add(
            "wiring",
            maps.join(" "),
            "the rotor's angle shows the phases in this order and sense in every recording",
            Some(maps.join(" ")),
        );
    }
    let latest_s = seen.iter().map(|one| one.after_s).fold(0.0, f64::max);
    if latest_s > 0.0 {
        add(
            "start",
            format!("up to {:.1} ms after the first sample", 1e3 * latest_s),
            "`command_rad` or the current shows where the command begins; each recording is cut there",
            None,
        );
    } else {
        add("start", "at the first sample".to_owned(), "the command begins there", None);
    }
    if let Some((choice, reason)) = sensors(seen) {
        add("sensors", choice, &reason, None);
    }
    for message in distinct(seen.iter().flat_map(|one| &one.mended)) {
        add("samples", message.clone(), "found while reading", None);
    }
    let (count, sessions) = (unit.references(), unit.sessions());
    let days = if sessions < 2 {
        "of one day: how friction and temperature differ between days is taken from the model file"
    } else {
        "what they have in common is the machine, what differs is the day"
    };
    let plural = |count: usize| if count == 1 { "" } else { "s" };
    let learnt =
        format!("{count} recording{} of {sessions} session{}", plural(count), plural(sessions));
    add("unit", learnt, days, None);
    choices
}

/// Gains and offsets of the phases' sensors in the mean of the recordings, in words, with the reason;
/// `None` where a recording has no sum of three measured phases.
fn sensors(seen: &[Seen]) -> Option<(String, String)> {
    let all = seen.iter().map(|one| one.phase_sum).collect::<Option<Vec<_>>>()?;
    let mean = |of: &dyn Fn(&PhaseSum) -> f64| all.iter().map(of).sum::<f64>() / all.len() as f64;
    // adding zero takes the sign from a zero
    let rounded = |value: f64, parts: f64| (parts * value).round() / parts + 0.0;
    let [a, b, c] = [0, 1, 2].map(|phase| rounded(100.0 * mean(&|sum| sum.gains[phase]), 100.0));
    let offset_ma = rounded(1e3 * mean(&|sum| sum.offset_sum_a), 10.0);
    let choice = format!(
        "gains {a:+.2}, {b:+.2} and {c:+.2} % (A, B, C) beyond their mean, offsets {offset_ma:+.1} mA together"
    );
    let reason = "the currents of a star sum to zero; each diagnosis finds them anew, within \
                  `sensors.phase-gain` and `sensors.phase-offset-a` of the tolerances";
    Some((choice, reason.to_owned()))
}

fn distinct<'a>(texts: impl Iterator<Item = &'a String>) -> Vec<&'a String> {
    let mut kept: Vec<&String> = Vec::new();
    for text in texts {
        if !kept.contains(&text) {
            kept.push(text);
        }
    }
    kept
}
