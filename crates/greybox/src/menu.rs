//! Commands that a machine may be given: within the travel that its recordings had, at speeds
//! within its limits.

use core::f64::consts::TAU;

use ema_sim::CommandKind;

use crate::{
    machine::Machine,
    record::{Record, Recordings},
};

/// Length of a command, s.
const DURATION_S: f64 = 8.0;
/// Rest at the start and between moves, s.
const REST_S: f64 = 0.5;
/// Time in which a move comes to its speed, s.
const RAMP_S: f64 = 0.15;
/// Multiples of the largest speed recorded.
const PACES: [f64; 3] = [0.3, 1.0, 3.0];
/// Share of the controller's limit of speed that a command may ask for.
const SPEED_SHARE: f64 = 0.5;
/// Frequencies of sines, Hz; none above the bandwidth of the loops, where the machine does not
/// follow. Near it the current depends on the gain of the motor, far below it on the torque alone.
const SINES_HZ: [f64; 7] = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
/// Shares of the amplitude that a sine's speed allows, largest first: fast ones need current.
const AMPLITUDES: [f64; 4] = [1.0, 0.5, 0.25, 0.125];
/// Multiple of the largest speed recorded that a command may ask for where no limit of speed is
/// known: for rounding, and the same move on another grid.
const PACE_MARGIN: f64 = 1.02;
/// Frequency of a swinging load, Hz.
const LOAD_HZ: f64 = 0.4;

/// A command that might be given.
pub(crate) struct Offer {
    /// Motion of the machine in words.
    pub(crate) description: String,
    /// The recording to be taken, in falling sizes: the first that the machine can do is meant.
    pub(crate) sizes: Vec<Record>,
}

/// Ranges that the recordings went through.
struct Span {
    least: f64,
    most: f64,
    start: f64,
    /// Fastest change of the command, per s.
    pace: f64,
    load: f64,
    rate_hz: f64,
    kind: CommandKind,
}

impl Span {
    fn of(recordings: &Recordings, first: &Record) -> Self {
        let all = || recordings.all().flat_map(|record| record.command.iter().copied());
        let pace = recordings.all().map(fastest).fold(0.0, f64::max);
        let loads = recordings.all().filter_map(|record| record.load.as_ref()).flatten();
        Self {
            least: all().fold(f64::INFINITY, f64::min),
            most: all().fold(f64::NEG_INFINITY, f64::max),
            start: first.command[0],
            pace,
            load: loads.fold(0.0_f64, |most, x| most.max(x.abs())),
            rate_hz: first.rate_hz,
            kind: first.kind,
        }
    }
}

/// Fastest change of a command over a twentieth of a second: a step is no speed.
fn fastest(record: &Record) -> f64 {
    let lag = (libm::round(0.05 * record.rate_hz) as usize).max(1);
    let span_s = lag as f64 / record.rate_hz;
    let command = &record.command;
    let pairs = command.iter().zip(command.iter().skip(lag));
    pairs.map(|(a, b)| (b - a).abs() / span_s).fold(0.0, f64::max)
}

/// Fastest pace that a command may ask for, per s: that of the recordings where the machine's
/// controller limits no speed, as where it is not known.
pub(crate) struct PaceLimit(f64);

impl PaceLimit {
    pub(crate) fn new(machine: &Machine, recordings: &Recordings, kind: CommandKind) -> Self {
        let is_limited = match kind {
            CommandKind::Position => machine.speed_limit().is_some(),
            // the speed itself is asked for
            CommandKind::Speed => true,
            CommandKind::Motion => false,
        };
        let recorded = recordings.all().map(fastest).fold(0.0, f64::max);
        Self(if is_limited { f64::INFINITY } else { PACE_MARGIN * recorded })
    }

    /// Tells whether a command keeps to it.
    pub(crate) fn allows(&self, record: &Record) -> bool {
        fastest(record) <= self.0
    }
}

/// Commands with what they do, as recordings to be taken.
pub(crate) fn menu(machine: &Machine, recordings: &Recordings) -> Vec<Offer> {
    let Some(first) = recordings.train.first() else { return Vec::new() };
    let span = Span::of(recordings, first);
    if span.most <= span.least {
        return Vec::new();
    }
    let limit = machine.speed_limit().map_or(f64::INFINITY, |limit| SPEED_SHARE * limit);
    let mut moves = vec![("at rest".to_owned(), vec![vec![span.start; samples(&span)]])];
    for ratio in PACES {
        let pace = ratio * span.pace;
        if span.kind == CommandKind::Position && pace > limit.max(span.pace) {
            continue;
        }
        let at = format!("at {ratio} times the fastest recorded pace");
        moves.push((format!("there and back {at}"), vec![visits(&span, pace, &[1.0, 0.0], 0.0)]));
        let levels = [0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25, 0.0];
        let stairs = visits(&span, pace, &levels, REST_S);
        moves.push((format!("in stairs with rests {at}"), vec![stairs]));
    }
    for hz in SINES_HZ.into_iter().filter(|hz| *hz <= machine.bandwidth_hz()) {
        let half = 0.5 * (span.most - span.least);
        let fastest = limit.max(span.pace).min(PACES[2] * span.pace);
        let amplitude = half.min(fastest / (TAU * hz));
        let sines = AMPLITUDES.map(|share| sine(&span, share * amplitude, hz));
        moves.push((format!("a sine of {hz} Hz"), sines.into()));
    }
    let offered = |(description, commands): (String, Vec<Vec<f64>>)| {
        let under = |load: f64| -> Vec<Record> {
            let of = |command: &Vec<f64>| record(&span, command.clone(), recordings, load);
            commands.iter().map(of).collect()
        };
        let loaded = (span.load > 0.0).then(|| Offer {
            description: format!("{description}, under a swinging load of ±{}", span.load),
            sizes: under(span.load),
        });
        let plain = Offer { sizes: under(0.0), description };
        core::iter::once(plain).chain(loaded)
    };
    moves.into_iter().flat_map(offered).collect()
}

fn samples(span: &Span) -> usize {
    libm::round(DURATION_S * span.rate_hz) as usize
}

/// Goes to places of the travel, shares of it, one after the other and round again.
fn visits(span: &Span, pace: f64, places: &[f64], rest_s: f64) -> Vec<f64> {
    let count = samples(span);
    let step = 1.0 / span.rate_hz;
    let rest = |command: &mut Vec<f64>, seconds: f64| {
        let last = command.last().copied().unwrap_or(span.start);
        command.extend(std::iter::repeat_n(last, (seconds * span.rate_hz) as usize));
    };
    let mut command = vec![span.start];
    rest(&mut command, REST_S);
    for share in places.iter().cycle() {
        if command.len() >= count {
            break;
        }
        let from = command.last().copied().unwrap_or(span.start);
        let way = span.least + share * (span.most - span.least) - from;
        // up to the pace, along, and down again
        let ramp_s = RAMP_S.min(libm::sqrt(RAMP_S * way.abs() / pace.max(1e-300)));
        let top = pace * ramp_s / RAMP_S;
        let along_s = (way.abs() / top.max(1e-300) - ramp_s).max(0.0);
        let length_s = 2.0 * ramp_s + along_s;
        let mut time_s = step;
        while time_s < length_s && command.len() < count {
            let done = gone(time_s, ramp_s, along_s, top);
            command.push(from + way.signum() * done);
            time_s += step;
        }
        command.push(from + way);
        rest(&mut command, rest_s.max(step));
    }
    command.truncate(count);
    command
}

/// Way gone in a move that speeds up, runs along and slows down.
fn gone(time_s: f64, ramp_s: f64, along_s: f64, top: f64) -> f64 {
    let rate = top / ramp_s.max(1e-300);
    let up = 0.5 * top * ramp_s;
    if time_s < ramp_s {
        0.5 * rate * time_s * time_s
    } else if time_s < ramp_s + along_s {
        up + top * (time_s - ramp_s)
    } else {
        let left_s = (2.0 * ramp_s + along_s - time_s).max(0.0);
        2.0 * up + top * along_s - 0.5 * rate * left_s * left_s
    }
}

/// A sine about the nearest place to the start that leaves it room.
fn sine(span: &Span, amplitude: f64, hz: f64) -> Vec<f64> {
    let middle = span
        .start
        .clamp(span.least + amplitude, (span.most - amplitude).max(span.least + amplitude));
    (0..samples(span))
        .map(|n| {
            let time_s = n as f64 / span.rate_hz;
            // from the start into the swing without a jump
            let grown = (time_s / (2.0 * REST_S)).min(1.0);
            let swing = amplitude * libm::sin(TAU * hz * time_s);
            span.start + grown * (middle - span.start + swing)
        })
        .collect()
}

fn record(span: &Span, command: Vec<f64>, recordings: &Recordings, load: f64) -> Record {
    let loaded = recordings.train.first().is_some_and(|record| record.load.is_some());
    let swing = |n: usize| {
        let time_s = n as f64 / span.rate_hz;
        load * (time_s / (2.0 * REST_S)).min(1.0) * libm::sin(TAU * LOAD_HZ * time_s)
    };
    let samples = command.len();
    Record {
        name: "proposed".to_owned(),
        rate_hz: span.rate_hz,
        drive: vec![0.0; samples],
        position: None,
        load: loaded.then(|| (0..samples).map(swing).collect()),
        filter_hz: None,
        start_rad: None,
        kind: span.kind,
        command,
    }
}

#[cfg(test)]
mod tests {
    use ema_sim::model_file::parse_machine;

    use super::*;

    fn span() -> Span {
        Span {
            least: -1.0,
            most: 2.0,
            start: 0.5,
            pace: 4.0,
            load: 0.0,
            rate_hz: 1000.0,
            kind: CommandKind::Position,
        }
    }

    #[test]
    fn visits_stay_within_travel_and_pace_and_do_not_jump() {
        for (places, rest_s) in [(vec![1.0, 0.0], 0.0), (vec![0.25, 0.3, 1.0, 0.0], 0.5)] {
            let command = visits(&span(), 4.0, &places, rest_s);
            assert_eq!(command.len(), 8000);
            assert!(command.iter().all(|x| (-1.0..=2.0).contains(x)));
            let fastest = command.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
            assert!((0.0039..=0.0042).contains(&fastest), "{fastest}");
            assert!(command.contains(&2.0) && command.contains(&-1.0));
        }
    }

    #[test]
    fn a_sine_begins_where_the_recordings_did_and_stays_within() {
        let command = sine(&span(), 1.5, 1.0);
        assert_eq!(command[0], 0.5);
        assert!(command.iter().all(|x| (-1.0..=2.0).contains(x)));
        let range = command.iter().fold(0.0_f64, |most, x| most.max((x - 0.5).abs()));
        assert!((range - 1.5).abs() < 1e-3, "{range}");
    }
    #[test]
    fn without_a_limit_of_speed_nothing_goes_faster_than_what_was_recorded() {
        let ramp = |pace: f64, kind| Record {
            name: String::new(),
            rate_hz: 1000.0,
            command: (0..1000).map(|n| pace * f64::from(n) / 1000.0).collect(),
            kind,
            drive: vec![0.0; 1000],
            position: None,
            load: None,
            filter_hz: None,
            start_rad: None,
        };
        let allowed = |text: &str, kind| {
            let machine = Machine::new(&parse_machine(text).expect("a model"));
            let train = vec![ramp(2.0, kind)];
            let limit = PaceLimit::new(&machine, &Recordings { train, ..Default::default() }, kind);
            [0.6, 2.0, 6.0].into_iter().filter(|pace| limit.allows(&ramp(*pace, kind))).count()
        };
        let limited = include_str!("../../../fixtures/models/axis.toml");
        let free = limited.replace("speed-limit-rad-per-s = 80.0\n", "");
        assert_ne!(free, limited);
        assert_eq!(allowed(limited, CommandKind::Position), 3);
        assert_eq!(allowed(&free, CommandKind::Position), 2);
        assert_eq!(allowed(limited, CommandKind::Motion), 2);
        assert_eq!(allowed(&free, CommandKind::Speed), 3);
    }
}
