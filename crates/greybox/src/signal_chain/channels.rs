//! What the samples of a channel alone show: steps of a converter, levels at which it stands, gaps.

/// Fewest equal samples in a row that are a run.
const LEAST_RUN: usize = 3;
/// Share of a step by which quantised values may be off its multiples.
const OFF_STEP: f64 = 1e-3;
/// Share of successive samples that are equal where no noise moves a converter's steps.
const UNDITHERED: f64 = 0.5;
/// Levels of a signal of eight bits, from its least to its largest value.
const FEW_LEVELS: f64 = 256.0;
/// Fewest different values of a signal whose steps are looked for.
const LEAST_VALUES: usize = 8;

/// Steps of a converter that a channel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Steps {
    pub(super) size: f64,
    /// Steps from the least to the largest value.
    pub(super) levels: f64,
    /// Share of successive samples that are equal.
    pub(super) equal_share: f64,
}

impl Steps {
    /// Steps of a channel whose values are multiples of one of them.
    pub(super) fn of(signal: &[f64]) -> Option<Self> {
        let mut values = signal.to_vec();
        values.sort_by(f64::total_cmp);
        values.dedup();
        let (least, most) = (*values.first()?, *values.last()?);
        if values.len() < LEAST_VALUES {
            return None;
        }
        let size = values.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
        let is_multiple = |value: &f64| {
            let steps = (value - least) / size;
            (steps - libm::round(steps)).abs() < OFF_STEP * steps.clamp(1.0, 100.0)
        };
        let levels = (most - least) / size;
        if levels > 1e6 || !values.iter().all(is_multiple) {
            return None;
        }
        let equal = signal.windows(2).filter(|w| w[0] == w[1]).count();
        let equal_share = equal as f64 / (signal.len() - 1) as f64;
        Some(Self { size, levels, equal_share })
    }

    /// Tells whether the steps are so coarse that noise does not average over them.
    pub(super) fn are_coarse(&self) -> bool {
        self.levels <= FEW_LEVELS && self.equal_share > UNDITHERED
    }
}

/// Samples in a row that stand at one value.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Run {
    pub(super) from: usize,
    pub(super) to: usize,
}

impl Run {
    fn len(&self) -> usize {
        self.to - self.from
    }
}

/// Runs of equal samples.
fn runs(signal: &[f64], tolerance: f64) -> Vec<Run> {
    let mut found = Vec::new();
    let mut from = 0;
    for n in 1..=signal.len() {
        if n < signal.len() && (signal[n] - signal[from]).abs() <= tolerance {
            continue;
        }
        if n - from >= LEAST_RUN {
            found.push(Run { from, to: n });
        }
        from = n;
    }
    found
}

/// A level at the end of a signal's range at which it stands again and again.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plateau {
    pub(super) level: f64,
    pub(super) runs: Vec<Run>,
    /// Share of all samples.
    pub(super) share: f64,
    /// Tells whether the signal stands nowhere else.
    pub(super) is_alone: bool,
}

/// Fewest samples of a plateau, and their least share of all.
const LEAST_SAMPLES: usize = 8;
const LEAST_SHARE: f64 = 1e-3;
/// Share of the other samples that may stand somewhere too.
const STANDS_ELSEWHERE: f64 = 0.05;

/// Plateaus at either end of a signal's range.
pub(super) fn plateaus(signal: &[f64]) -> Vec<Plateau> {
    let [least, most] = range(signal);
    let tolerance = 1e-9 * (most - least);
    if tolerance <= 0.0 {
        return Vec::new();
    }
    let all = runs(signal, tolerance);
    let standing: usize = all.iter().map(Run::len).sum();
    let at = |level: f64| {
        let is_at = |run: &&Run| (signal[run.from] - level).abs() <= tolerance;
        let runs: Vec<Run> = all.iter().filter(is_at).cloned().collect();
        let samples: usize = runs.iter().map(Run::len).sum();
        let share = samples as f64 / signal.len() as f64;
        (samples >= LEAST_SAMPLES && share >= LEAST_SHARE).then_some((level, runs, samples, share))
    };
    let found: Vec<_> = [least, most].into_iter().filter_map(at).collect();
    let at_ends: usize = found.iter().map(|(_, _, samples, _)| samples).sum();
    let elsewhere = standing - at_ends;
    let rest = (signal.len() - at_ends).max(1);
    let is_alone = (elsewhere as f64) < STANDS_ELSEWHERE * rest as f64;
    let plateau = |(level, runs, _, share)| Plateau { level, runs, share, is_alone };
    found.into_iter().map(plateau).collect()
}

/// Least and largest value.
pub(super) fn range(signal: &[f64]) -> [f64; 2] {
    signal
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(*x), high.max(*x)])
}

/// Jumps between samples that are looked for.
const MOST_JUMPS: usize = 4;
/// Size of a jump over that of the largest ordinary change.
const JUMP: f64 = 4.0;
/// Acceleration of a jump over the largest that the drive can make.
const IMPOSSIBLE: f64 = 5.0;

/// A place where a position jumps as no machine does: samples are missing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Jump {
    /// Sample before it.
    pub(super) sample: usize,
    pub(super) size: f64,
}

/// The largest jump of a position sampled at a rate, which the largest acceleration of the drive
/// does not explain.
pub(super) fn jump(position: &[f64], rate_hz: f64, most_acceleration: f64) -> Option<Jump> {
    let changes: Vec<f64> = position.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let (sample, size) = changes.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let mut others: Vec<f64> = changes.clone();
    others.sort_by(f64::total_cmp);
    let ordinary = others[others.len().checked_sub(1 + MOST_JUMPS)?];
    // the machine's own speed is on either side of a gap
    let beside = |n: Option<usize>| n.and_then(|n| changes.get(n)).copied().unwrap_or(0.0);
    let own = beside(sample.checked_sub(1)).max(beside(sample.checked_add(1)));
    let acceleration = (size - own) * rate_hz * rate_hz;
    let is_jump = size > JUMP * ordinary && acceleration > IMPOSSIBLE * most_acceleration;
    is_jump.then_some(Jump { sample, size })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: usize) -> f64 {
        libm::sin(0.01 * n as f64) + 0.3 * libm::sin(0.037 * n as f64)
    }

    fn quantised(step: f64) -> Vec<f64> {
        (0..4000).map(|n| step * libm::round(wave(n) / step)).collect()
    }

    #[test]
    fn steps_of_a_converter_are_found_and_judged() {
        let coarse = Steps::of(&quantised(1.0 / 32.0)).unwrap();
        assert!((coarse.size * 32.0 - 1.0).abs() < 1e-6 && coarse.are_coarse(), "{coarse:?}");
        let fine = Steps::of(&quantised(1.0 / 2048.0)).unwrap();
        assert!(!fine.are_coarse(), "{fine:?}");
        assert_eq!(Steps::of(&(0..4000).map(wave).collect::<Vec<_>>()), None);
    }

    #[test]
    fn a_cut_signal_stands_at_its_ends_alone() {
        let cut: Vec<f64> = (0..4000).map(|n| wave(n).clamp(-1.0, 1.0)).collect();
        let found = plateaus(&cut);
        assert_eq!(found.len(), 2);
        assert!(found.iter().all(|p| p.is_alone && p.level.abs() == 1.0), "{found:?}");
        assert!(plateaus(&(0..4000).map(wave).collect::<Vec<_>>()).is_empty());
        let stairs: Vec<f64> = (0..4000).map(|n| f64::from(n as u32 / 500)).collect();
        assert!(plateaus(&stairs).iter().all(|p| !p.is_alone));
    }

    #[test]
    fn a_gap_is_a_jump_that_no_drive_makes() {
        let whole: Vec<f64> = (0..4000).map(wave).collect();
        let cut: Vec<f64> = (0..4000).filter(|n| !(1500..1600).contains(n)).map(wave).collect();
        // the largest acceleration of the wave, twice over
        let most = 2.0 * (1e-4 + 0.3 * 0.037 * 0.037) * 1e6;
        assert_eq!(jump(&whole, 1000.0, most), None);
        assert_eq!(jump(&cut, 1000.0, most).unwrap().sample, 1499);
    }
}
