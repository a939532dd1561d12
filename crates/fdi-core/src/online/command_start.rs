//! Where the command begins in a recording that was running before it.
//!
//! ```text
//! ρ(τ) = Σ (s(t + τ) − s̄)·(m(t) − m̄) / (|s − s̄|·|m − m̄|)      0 ≤ t < T
//! ```
//!
//! with `s` the recorded command and `m` the test's; where no command was recorded, `s` half of the
//! sum of the magnitudes of the phase currents, or the magnitude of the envelope, and `m` the magnitude
//! of the healthy machine's envelope. Magnitudes need neither the rotor's angle nor its sense. `τ` is
//! looked for over what the recording has beyond the test's length `T`: one that is no longer than
//! the test cannot have begun before it and still hold all of it.
//!
//! A recorded command then tells `τ` to a part of a sample, by least squares. A current tells it to
//! a few milliseconds, and the diagnosis finds the rest with the faults.

use ema_sim::{Envelope, EnvelopeFilter, FAULT_COUNT, FaultCoordinates};
use inference::dot;
use recordings::{Channel, ChannelName, Current, RecordError, Recording};

use crate::{
    report::{Notice, NoticeCode},
    simulation::{experiment::Experiment, resampling::resampled},
};

/// Standard deviation of a start that a current shows, s: the filter's shortest period.
const CURRENT_STD_S: f64 = 2e-3;
/// A start that is nearer to the first sample than this is the first sample, in samples of the
/// command.
const SAME_SAMPLE: f64 = 0.02;
/// Least `ρ` at which a signal is taken to be of the test: half of its variance is the test's.
const LEAST_LIKENESS: f64 = 0.7;
/// Products of samples and starts that are tried at full rate; more are tried on means of samples.
const MOST_PRODUCTS: usize = 20_000_000;
/// Least samples of a test in which its start is looked for.
const LEAST_SAMPLES: f64 = 10.0;
/// Steps of Gauss and Newton's method in which a command's start settles.
const STEPS: usize = 8;

/// The channel that shows where a command begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SeenIn {
    Command,
    Current,
}

/// Where the command begins in a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CommandStart {
    /// By the recording's clock, s.
    at_s: f64,
    /// Standard deviation, s; zero where a command shows it.
    std_s: f64,
    seen_in: SeenIn,
    /// Ticks of the drive, where the current was logged at some of them: the command began at one.
    ticks: Option<Ticks>,
}

/// Instants that lie evenly.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ticks {
    first_s: f64,
    step_s: f64,
}

impl CommandStart {
    /// The start of a recording that began before the command; `None` where the two begin together
    /// as far as the recording shows it.
    pub(crate) fn of(recording: &Recording, experiment: &Experiment) -> Option<Self> {
        match recording.channel(ChannelName::Command) {
            Some(channel) => of_command(channel, experiment),
            None => of_current(recording, experiment),
        }
    }

    /// By the recording's clock, s.
    pub(crate) fn at_s(&self) -> f64 {
        self.at_s
    }

    /// Time after the first sample of a recording, s.
    pub(crate) fn after_s(&self, recording: &Recording) -> f64 {
        let first_s = recording.channels().iter().map(|channel| channel.times_s()[0]);
        self.at_s - first_s.fold(f64::INFINITY, f64::min)
    }

    /// Standard deviation, s; zero where a command shows it.
    pub(crate) fn std_s(&self) -> f64 {
        self.std_s
    }

    /// The start that is later by some time.
    pub(crate) fn later(self, by_s: f64) -> Self {
        let at_s = self.at_s + by_s;
        let on_tick = |Ticks { first_s, step_s }: Ticks| {
            first_s + ((at_s - first_s) / step_s).round() * step_s
        };
        Self { at_s: self.ticks.map_or(at_s, on_tick), ..self }
    }

    /// The start with another standard deviation, s.
    pub(crate) fn known_to(self, std_s: f64) -> Self {
        Self { std_s, ..self }
    }

    /// The recording from the current's sample that is nearest to the start, and the time by which the
    /// command begins after that sample, s.
    pub(crate) fn cut(&self, recording: &Recording) -> Result<(Recording, f64), RecordError> {
        let channel = recording.require_current()?.channel();
        let (times_s, rate_hz) = (channel.times_s(), channel.sampling()?.rate_hz);
        let after = times_s.partition_point(|time_s| *time_s < self.at_s - 0.5 / rate_hz);
        let first = after.min(times_s.len() - 1);
        let late_s = self.at_s - times_s[first];
        let late_s = if (late_s * rate_hz).abs() < SAME_SAMPLE { 0.0 } else { late_s };
        Ok((recording.since(times_s[first] - 0.25 / rate_hz), late_s))
    }

    /// Says where the command was found to begin.
    pub(crate) fn notice(&self, recording: &Recording) -> Notice {
        let seen_in = match self.seen_in {
            SeenIn::Command => "as `command_rad` shows".to_owned(),
            SeenIn::Current if self.std_s < CURRENT_STD_S => format!(
                "as the current shows to {:.3} ms (`command_rad` would show it exactly)",
                1e3 * self.std_s
            ),
            SeenIn::Current => "as the current shows".to_owned(),
        };
        let message = format!(
            "the command begins {:.2} ms after the first sample, {seen_in}; what is before is left out",
            1e3 * self.after_s(recording)
        );
        Notice { code: NoticeCode::BeginsBeforeCommand, message }
    }
}

/// The start that a recorded command shows.
fn of_command(channel: &Channel, experiment: &Experiment) -> Option<CommandStart> {
    let rate_hz = channel.sampling().ok()?.rate_hz;
    let samples = (experiment.scenario.duration_s * rate_hz).round() as usize;
    let test = |t: f64| experiment.scenario.command.at(t.max(0.0));
    let expected: Vec<f64> = (0..samples).map(|n| test(n as f64 / rate_hz)).collect();
    let values = channel.values();
    let whole = most_alike(values, &expected);
    let (coarse, _) = whole.or_else(|| most_alike_cut_short(values, &expected))?;
    let times_s = channel.times_s();
    let found = &values[coarse..(coarse + samples).min(values.len())];
    let mut at_s = times_s[coarse];
    for _ in 0..STEPS {
        let half_s = 0.5 / rate_hz;
        let (mut descent, mut curvature) = (0.0, 0.0);
        for (n, value) in found.iter().enumerate() {
            let t = times_s[coarse + n] - at_s;
            let slope = (test(t + half_s) - test(t - half_s)) / (2.0 * half_s);
            descent += slope * (test(t) - value);
            curvature += slope * slope;
        }
        if curvature <= 0.0 {
            return None;
        }
        let step_s = descent / curvature;
        at_s += step_s.clamp(-half_s, half_s);
    }
    let is_later = (at_s - times_s[0]) * rate_hz > SAME_SAMPLE;
    is_later.then_some(CommandStart { at_s, std_s: 0.0, seen_in: SeenIn::Command, ticks: None })
}

/// The start that the currents show.
fn of_current(recording: &Recording, experiment: &Experiment) -> Option<CommandStart> {
    let (magnitude_a, first_s) = magnitude(recording, experiment)?;
    let rotor_rad = experiment.scenario.start_angle_rad;
    let expected_a =
        experiment.monitor(rotor_rad).ok()?.signal(&FaultCoordinates([0.0; FAULT_COUNT]));
    let expected_a: Vec<f64> = expected_a.into_iter().map(f64::abs).collect();
    let (place, _) = most_alike(&magnitude_a, &expected_a)?;
    let after_s = place as f64 / experiment.filter.output_hz;
    let (at_s, std_s) = (first_s + after_s, CURRENT_STD_S);
    let is_of_the_drive = matches!(recording.require_current(), Ok(Current::Quadrature(_)));
    let step_s = 1.0 / experiment.actuator.controller.sample_hz;
    let ticks = is_of_the_drive.then_some(Ticks { first_s, step_s });
    let start = CommandStart { at_s, std_s, seen_in: SeenIn::Current, ticks };
    (after_s > std_s).then_some(start.later(0.0))
}

/// Magnitude of the current at the rate of the experiment's filter, A, and the time of its first
/// sample, s, where the recording is longer than the test.
fn magnitude(recording: &Recording, experiment: &Experiment) -> Option<(Vec<f64>, f64)> {
    let output_hz = experiment.filter.output_hz;
    let is_longer = |channel: &Channel, rate_hz: f64| {
        let excess_s = channel.values().len() as f64 / rate_hz - experiment.scenario.duration_s;
        // times in another unit make a test of no samples
        let of_test = experiment.scenario.duration_s * rate_hz;
        excess_s > CURRENT_STD_S && of_test >= LEAST_SAMPLES
    };
    match recording.require_current().ok()? {
        Current::Phases(phases) => {
            let rate_hz = phases[0].sampling().ok()?.rate_hz;
            if !is_longer(phases[0], rate_hz) {
                return None;
            }
            let silent = vec![0.0; phases[0].values().len()];
            let half = Envelope::HalfAbsSum.of_phases(phases.map(Channel::values), &silent);
            let smooth = EnvelopeFilter { output_hz: rate_hz, ..experiment.filter };
            let smooth_a = smooth.apply(&half, rate_hz);
            Some((resampled(&smooth_a, rate_hz, output_hz), phases[0].times_s()[0]))
        }
        Current::Envelope(channel) | Current::Quadrature(channel) => {
            let rate_hz = channel.sampling().ok()?.rate_hz;
            let magnitude_a: Vec<f64> = channel.values().iter().map(|i| i.abs()).collect();
            is_longer(channel, rate_hz)
                .then(|| (resampled(&magnitude_a, rate_hz, output_hz), channel.times_s()[0]))
        }
    }
}

/// The place in a signal from which it is most like an expected one, and how alike; `None` where it
/// is shorter than that or not like it.
fn most_alike(signal: &[f64], expected: &[f64]) -> Option<(usize, f64)> {
    let starts = (signal.len() + 1).checked_sub(expected.len())?;
    let fits = |k: &usize| starts / k * (expected.len() / k) <= MOST_PRODUCTS;
    let block = (1..=expected.len()).find(fits)?;
    let all = 0..starts;
    let near = if block == 1 {
        all
    } else {
        let (means, of_expected) = (block_means(signal, block), block_means(expected, block));
        let last = (means.len() + 1).checked_sub(of_expected.len())?;
        let (coarse, _) = best(&means, &of_expected, 0..last)?;
        (coarse * block).saturating_sub(2 * block)..((coarse + 2) * block).min(starts)
    };
    best(signal, expected, near).filter(|(_, likeness)| *likeness >= LEAST_LIKENESS)
}

/// The place in a signal from which it is most like the first half of an expected one, where it ends
/// before the whole of it.
fn most_alike_cut_short(signal: &[f64], expected: &[f64]) -> Option<(usize, f64)> {
    let (place, likeness) = most_alike(signal, &expected[..expected.len() / 2])?;
    (place + expected.len() > signal.len()).then_some((place, likeness))
}

fn block_means(signal: &[f64], block: usize) -> Vec<f64> {
    signal.chunks_exact(block).map(|part| part.iter().sum::<f64>() / block as f64).collect()
}

/// The best of some starts, with its `ρ`.
fn best(signal: &[f64], expected: &[f64], starts: core::ops::Range<usize>) -> Option<(usize, f64)> {
    let count = expected.len() as f64;
    let mean = expected.iter().sum::<f64>() / count;
    let centred: Vec<f64> = expected.iter().map(|value| value - mean).collect();
    let norm = dot(&centred, &centred).sqrt();
    let likeness = |start: usize| {
        let part = &signal[start..start + expected.len()];
        let mean = part.iter().sum::<f64>() / count;
        let spread = (dot(part, part) - count * mean * mean).max(0.0).sqrt();
        let likeness = dot(part, &centred) / (spread * norm);
        (start, if likeness.is_finite() { likeness } else { 0.0 })
    };
    starts.map(likeness).max_by(|a, b| a.1.total_cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;
    use recordings::Metadata;

    use super::*;

    /// A recording of the chirp's command that begins some samples of 1 kHz before it.
    fn before(samples: f64) -> Recording {
        let command = Experiment::chirp().scenario.command;
        let at = |n: i32| command.at((1e-3 * (f64::from(n) - samples)).max(0.0));
        let values: Vec<f64> = (0..900).map(at).collect();
        let channels = [ChannelName::Command, ChannelName::Current]
            .map(|name| Channel::uniform(name, 2.0, 1e3, values.clone()).unwrap());
        Recording::new("r", Metadata::default(), channels.into()).unwrap()
    }

    #[test]
    fn a_command_shows_its_start_to_a_part_of_a_sample() {
        for samples in [40.0, 123.4, 300.7] {
            let recording = before(samples);
            let start = CommandStart::of(&recording, &Experiment::chirp()).unwrap();
            // the chirp bends within the sample in which it begins
            assert_abs_diff_eq!(start.after_s(&recording), 1e-3 * samples, epsilon = 2e-6);
            let (cut, late_s) = start.cut(&recording).unwrap();
            let left = cut.channels()[1].values().len() as f64;
            assert_abs_diff_eq!(900.0 - left + 1e3 * late_s, samples, epsilon = 2e-3);
            assert!(late_s.abs() <= 0.5e-3);
        }
    }

    #[test]
    fn a_command_that_begins_with_the_recording_has_no_start() {
        assert_eq!(CommandStart::of(&before(0.0), &Experiment::chirp()), None);
    }

    #[test]
    fn a_recording_that_ends_early_begins_where_its_command_does() {
        let whole = before(340.0);
        let cut = whole.channels().iter().map(|channel| {
            Channel::uniform(channel.name(), 2.0, 1e3, channel.values()[..700].to_vec()).unwrap()
        });
        let cut = Recording::new("r", Metadata::default(), cut.collect()).unwrap();
        let start = CommandStart::of(&cut, &Experiment::chirp()).unwrap();
        assert_abs_diff_eq!(start.after_s(&cut), 0.34, epsilon = 2e-6);
    }

    #[test]
    fn a_signal_of_another_test_has_no_start() {
        let sine: Vec<f64> = (0..900).map(|n| (0.01 * f64::from(n)).sin()).collect();
        let command = Channel::uniform(ChannelName::Command, 0.0, 1e3, sine).unwrap();
        let recording = Recording::new("r", Metadata::default(), vec![command]).unwrap();
        assert_eq!(CommandStart::of(&recording, &Experiment::chirp()), None);
    }

    #[test]
    fn means_of_samples_lead_to_the_same_place() {
        let wave = |n: i32| (1e-6 * f64::from(n) * f64::from(n)).sin();
        let expected: Vec<f64> = (0..30_000).map(wave).collect();
        let rest = vec![0.0; 5_321];
        let signal: Vec<f64> = rest.iter().chain(&expected).chain(&rest).copied().collect();
        assert_eq!(most_alike(&signal, &expected).unwrap().0, rest.len());
    }
}
