//! Phase currents that were cut at a level, found without a model.

use inference::{EqualRuns, ends};
use recordings::{ChannelName, Recording};

/// A phase current that was cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CutPhase {
    pub(super) channel: ChannelName,
    /// The level, A.
    pub(super) level_a: f64,
    /// Share of all samples that stand at it.
    pub(super) share: f64,
}

impl CutPhase {
    /// The first phase of a recording that was cut, of a machine whose controller allows so much
    /// current.
    pub(super) fn of(recording: &Recording, limit_a: f64) -> Option<Self> {
        use ChannelName::{PhaseACurrent, PhaseBCurrent, PhaseCCurrent};
        [PhaseACurrent, PhaseBCurrent, PhaseCCurrent].into_iter().find_map(|channel| {
            let (level_a, share) = cut(recording.channel(channel)?.values(), limit_a)?;
            Some(Self { channel, level_a, share })
        })
    }
}

/// Fewest samples of a run that tells, of all such runs together, and their least share.
const LEAST_RUN: usize = 3;
const LEAST_SAMPLES: usize = 8;
const LEAST_SHARE: f64 = 1e-3;
/// Share of the controller's limit from which a level is that limit: what the machine did.
const LIMIT_SHARE: f64 = 0.98;

/// Level and share of a signal that was cut: at an end of its range, below what the controller
/// allows, it stands for longer than anywhere else but at zero, where a phase that does not conduct rests. The switching of the
/// inverter and the noise of the sensor leave no phase at another level.
fn cut(signal: &[f64], limit_a: f64) -> Option<(f64, f64)> {
    let ends = ends(signal);
    let runs = EqualRuns::of(signal);
    let elsewhere = runs.iter().filter(|(level, _)| !ends.contains(level) && *level != 0.0);
    let longest = elsewhere.map(|(_, run)| run.len()).max().unwrap_or(0);
    let least = LEAST_RUN.max(longest + 1);
    let at = |level: f64| {
        let standing = runs.iter().filter(|(value, run)| *value == level && run.len() >= least);
        let samples: usize = standing.map(|(_, run)| run.len()).sum();
        let share = samples as f64 / signal.len() as f64;
        let is_of_log = level != 0.0 && level.abs() < LIMIT_SHARE * limit_a;
        let is_cut = is_of_log && samples >= LEAST_SAMPLES && share >= LEAST_SHARE;
        is_cut.then_some((level, share))
    };
    ends.into_iter().filter_map(at).max_by(|a, b| a.1.total_cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT_A: f64 = 10.0;

    /// A current that switches about a slow wave, in steps of a converter.
    fn switched(step_a: f64) -> Vec<f64> {
        let wave = |pace: f64, n: i32| (pace * f64::from(n)).sin();
        let of = |n: i32| {
            let current_a = wave(0.005, n) + 0.03 * wave(2.1, n) + 0.02 * wave(0.73, n);
            step_a * (current_a / step_a).round()
        };
        (0..6000).map(of).collect()
    }

    #[test]
    fn a_cut_phase_stands_longest_at_its_ends() {
        let step_a = 1.0 / 512.0;
        let whole = switched(step_a);
        assert_eq!(cut(&whole, LIMIT_A), None);
        let level_a = step_a * (0.83 / step_a).round();
        let clamped: Vec<f64> = whole.iter().map(|x| x.clamp(-level_a, level_a)).collect();
        let (level, share) = cut(&clamped, LIMIT_A).unwrap();
        assert!(level.abs() == level_a && share > 0.1, "{level} {share}");
        // a drive that stands at its own limit
        assert_eq!(cut(&clamped, level_a), None);
    }

    #[test]
    fn rest_steps_and_little_are_no_cut() {
        // a phase that conducts a third of the time, and one whose samples are held
        let whole = switched(1.0 / 512.0);
        let open: Vec<f64> = whole
            .iter()
            .enumerate()
            .map(|(n, x)| if n / 100 % 3 == 0 { *x } else { 0.0 })
            .collect();
        let held: Vec<f64> = (0..6000).map(|n| whole[n / 20 * 20]).collect();
        for signal in [open, held, switched(1.0 / 16.0), vec![0.0; 100], vec![1.0; 4], Vec::new()] {
            assert_eq!(cut(&signal, LIMIT_A), None);
        }
    }
}
