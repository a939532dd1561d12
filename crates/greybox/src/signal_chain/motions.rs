//! Motions of recordings beside one another: a hold-out that repeats what was fitted, and one of
//! another machine.

use ema_sim::CommandKind;

use crate::record::Record;

/// Part of a command's spread by which a repetition may be off.
const SAME: f64 = 5e-3;
/// Share of the shorter recording that has to be alike.
const LEAST_OVERLAP: f64 = 0.8;
/// Points by which commands are compared roughly, and shifts of them.
const POINTS: usize = 400;
/// Rough distance, over the spread, above which no finer comparison is worth it.
const ROUGH: f64 = 0.1;

/// Tells whether a recording repeats the command of another, under the same load, at once or some
/// time later.
pub(super) fn repeats(record: &Record, of: &Record) -> bool {
    if record.kind != of.kind || record.kind == CommandKind::Motion {
        return false;
    }
    let spread = spread(&of.command);
    if spread <= 0.0 || !is_alike_load(record, of) {
        return false;
    }
    let command = at_rate(&record.command, record.rate_hz, of.rate_hz);
    let stride = (command.len().max(of.command.len()) / POINTS).max(1);
    let limit = (command.len().min(of.command.len()) as f64 * (1.0 - LEAST_OVERLAP)) as isize;
    let (most, least) = (of.command.len() as isize - command.len() as isize, 0);
    let shifts = most.min(least) - limit..=most.max(least) + limit;
    let rough = |shift: isize| distance(&command, &of.command, shift, stride);
    let best = shifts
        .clone()
        .step_by(stride)
        .min_by(|a, b| rough(*a).total_cmp(&rough(*b)))
        .filter(|shift| rough(*shift) < ROUGH * spread);
    let Some(best) = best else { return false };
    let near =
        (best - stride as isize).max(*shifts.start())..=(best + stride as isize).min(*shifts.end());
    near.into_iter()
        .any(|shift| distance(&command, &of.command, shift, 1 + stride / 8) < SAME * spread)
}

/// Root mean square difference of two commands, the first begun so many samples later.
fn distance(a: &[f64], b: &[f64], shift: isize, stride: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0_u32);
    for n in (0..a.len()).step_by(stride) {
        let other = n as isize + shift;
        if let Some(value) = usize::try_from(other).ok().and_then(|place| b.get(place)) {
            sum += (a[n] - value) * (a[n] - value);
            count += 1;
        }
    }
    if count == 0 { f64::INFINITY } else { libm::sqrt(sum / f64::from(count)) }
}

/// Root mean square of a signal about its mean.
fn spread(signal: &[f64]) -> f64 {
    libm::sqrt(super::regression::spread(signal) / signal.len().max(1) as f64)
}

/// Tells whether both have the same load, or none, as far as spread and mean tell.
fn is_alike_load(a: &Record, b: &Record) -> bool {
    match (&a.load, &b.load) {
        (None, None) => true,
        (Some(a), Some(b)) => {
            let mean = |load: &[f64]| load.iter().sum::<f64>() / load.len().max(1) as f64;
            let size = spread(a).max(spread(b)).max(mean(a).abs()).max(mean(b).abs());
            (mean(a) - mean(b)).abs() <= SAME * size && (spread(a) - spread(b)).abs() <= SAME * size
        }
        _ => false,
    }
}

/// A signal at another rate, straight between its samples.
fn at_rate(signal: &[f64], rate_hz: f64, other_hz: f64) -> Vec<f64> {
    let last = signal.len().saturating_sub(1);
    let samples = (signal.len() as f64 * other_hz / rate_hz) as usize;
    let at = |n: usize| {
        let place = (n as f64 * rate_hz / other_hz).min(last as f64);
        let before = place as usize;
        let next = signal[(before + 1).min(last)];
        signal[before] + (next - signal[before]) * (place - before as f64)
    };
    (0..samples).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(command: Vec<f64>, rate_hz: f64) -> Record {
        Record {
            name: "r".to_owned(),
            rate_hz,
            drive: vec![0.0; command.len()],
            command,
            kind: CommandKind::Position,
            position: None,
            load: None,
            filter_hz: None,
            start_rad: None,
        }
    }

    fn sine(hz: f64, rate_hz: f64, from_s: f64, seconds: f64) -> Record {
        let at = |n: usize| {
            let t = from_s + n as f64 / rate_hz;
            libm::sin(core::f64::consts::TAU * hz * t) + 0.3 * libm::sin(11.0 * t * t)
        };
        record((0..(seconds * rate_hz) as usize).map(at).collect(), rate_hz)
    }

    #[test]
    fn a_repetition_is_one_at_any_rate_and_shift() {
        let first = sine(0.5, 1000.0, 0.0, 6.0);
        assert!(repeats(&first, &first));
        assert!(repeats(&sine(0.5, 1000.0, 0.3, 5.5), &first));
        assert!(repeats(&sine(0.5, 500.0, 0.0, 6.0), &first));
    }

    #[test]
    fn another_command_or_another_load_is_none() {
        let first = sine(0.5, 1000.0, 0.0, 6.0);
        assert!(!repeats(&sine(0.7, 1000.0, 0.0, 6.0), &first));
        let smaller = record(first.command.iter().map(|c| 0.9 * c).collect(), 1000.0);
        assert!(!repeats(&smaller, &first));
        let loaded = Record { load: Some(vec![1.0; 6000]), ..first.clone() };
        assert!(!repeats(&loaded, &first));
    }
}
