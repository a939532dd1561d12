//! Signals that were cut at a level, found without a model.

use inference::{EqualRuns, Standing, ends};
use recordings::{ChannelName, Recording};

/// A phase current that was cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CutPhase {
    pub(crate) channel: ChannelName,
    /// The level, A.
    pub(crate) level_a: f64,
    /// Share of all samples that stand at it.
    pub(crate) share: f64,
}

impl CutPhase {
    /// The first phase of a recording that was cut, of a machine whose controller allows so much
    /// current.
    pub(crate) fn of(recording: &Recording, limit_a: f64) -> Option<Self> {
        use ChannelName::{PhaseACurrent, PhaseBCurrent, PhaseCCurrent};
        [PhaseACurrent, PhaseBCurrent, PhaseCCurrent].into_iter().find_map(|channel| {
            let (level_a, share) = cut(recording.channel(channel)?.values(), limit_a)?;
            Some(Self { channel, level_a, share })
        })
    }
}

/// Level and share of a signal that was cut: at an end of its range, below a limit that the controller
/// may itself hold it at, it stands for longer than anywhere else but at zero, where a phase that does not conduct
/// rests. The switching of the inverter and the noise of the sensor leave no phase at another level.
pub(crate) fn cut(signal: &[f64], limit: f64) -> Option<(f64, f64)> {
    let (runs, ends) = (EqualRuns::of(signal), ends(signal));
    let elsewhere = runs.iter().filter(|(level, _)| !ends.contains(level) && *level != 0.0);
    let longest = elsewhere.map(|(_, run)| run.len()).max().unwrap_or(0);
    let standing = runs.standing_at_ends(limit, longest).into_iter();
    let levels = standing.map(|Standing { level, share, .. }| (level, share));
    levels.filter(|(level, _)| *level != 0.0).max_by(|a, b| a.1.total_cmp(&b.1))
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
