//! Samples of one channel: steps of a converter, and jumps where samples are missing.

use inference::ends;

/// Share of a step by which quantised values may be off its multiples.
const OFF_STEP: f64 = 1e-3;
/// Share of successive samples that are equal from which noise does not smooth the steps: of a
/// signal at rest under normal noise of half a step it is 0.46 to 0.51, and the error of the
/// converter is white only above that noise (Widrow and Kollár, *Quantization Noise*, 2008).
const UNDITHERED: f64 = 0.5;
/// Levels of eight bits, from the least to the largest value of a signal.
const FEW_LEVELS: f64 = 256.0;
/// Fewest different values of a signal whose steps are looked for, and most levels of one.
const LEAST_VALUES: usize = 8;
const MOST_LEVELS: f64 = 1e6;

/// Steps of a converter that a channel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Steps {
    pub(super) size: f64,
    /// Steps from the least to the largest value.
    pub(super) levels: f64,
    /// Share of successive samples that are equal.
    equal_share: f64,
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
        if levels > MOST_LEVELS || !values.iter().all(is_multiple) {
            return None;
        }
        let equal = signal.windows(2).filter(|w| w[0] == w[1]).count();
        let equal_share = equal as f64 / (signal.len() - 1) as f64;
        Some(Self { size, levels, equal_share })
    }

    /// Tells whether the steps are coarse and noise does not smooth them.
    pub(super) fn are_coarse(&self) -> bool {
        self.levels <= FEW_LEVELS && self.equal_share > UNDITHERED
    }
}

/// Largest changes between samples that may all be gaps.
const MOST_JUMPS: usize = 4;
/// Size of a jump over that of the largest ordinary change.
const JUMP: f64 = 4.0;
/// Acceleration of a jump over the largest that the drive can make: room for the noise of a
/// position and for a drive whose limit is not known.
const IMPOSSIBLE: f64 = 5.0;
/// Drive over the largest recorded one that a controller without a limit is taken to have.
const NO_LIMIT: f64 = 3.0;

/// A place where a position jumps as no drive makes it: samples are missing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Jump {
    /// Sample before it.
    pub(super) sample: usize,
    pub(super) size: f64,
}

impl Jump {
    /// The largest jump of a position sampled at a rate that the largest acceleration of the drive
    /// does not explain.
    pub(super) fn of(position: &[f64], rate_hz: f64, most_acceleration: f64) -> Option<Self> {
        let changes: Vec<f64> = position.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
        let all = changes.iter().copied().enumerate();
        let (sample, size) = all.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let mut sorted = changes.clone();
        sorted.sort_by(f64::total_cmp);
        let ordinary = sorted[sorted.len().checked_sub(1 + MOST_JUMPS)?];
        // the machine's own speed is on either side of a gap
        let beside = |n: Option<usize>| n.and_then(|n| changes.get(n)).copied().unwrap_or(0.0);
        let own = beside(sample.checked_sub(1)).max(beside(sample.checked_add(1)));
        let acceleration = (size - own) * rate_hz * rate_hz;
        let is_jump = size > JUMP * ordinary && acceleration > IMPOSSIBLE * most_acceleration;
        is_jump.then_some(Self { sample, size })
    }
}

/// Largest drive signal that a recording may have had, by the controller's limit or, without one,
/// by what was recorded.
pub(super) fn most_drive(drive: &[f64], limit: f64) -> f64 {
    let [least, most] = ends(drive);
    let largest = most.abs().max(least.abs());
    if limit < f64::MAX { limit.max(largest) } else { NO_LIMIT * largest }
}

#[cfg(test)]
mod tests {
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

    use super::*;
    use crate::random::normal;

    fn wave(n: usize) -> f64 {
        libm::sin(0.01 * n as f64) + 0.3 * libm::sin(0.037 * n as f64)
    }

    fn quantised(step: f64, noise: f64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let value = |n| wave(n) + noise * normal(&mut random);
        (0..4000).map(value).map(|x| step * libm::round(x / step)).collect()
    }

    #[test]
    fn steps_are_coarse_where_they_are_few_and_no_noise_smooths_them() {
        let coarse = Steps::of(&quantised(1.0 / 32.0, 0.0)).unwrap();
        assert!((coarse.size * 32.0 - 1.0).abs() < 1e-6 && coarse.are_coarse(), "{coarse:?}");
        let smoothed = Steps::of(&quantised(1.0 / 32.0, 1.0 / 32.0)).unwrap();
        assert!(!smoothed.are_coarse(), "{smoothed:?}");
        let fine = Steps::of(&quantised(1.0 / 2048.0, 0.0)).unwrap();
        assert!(!fine.are_coarse(), "{fine:?}");
        assert_eq!(Steps::of(&(0..4000).map(wave).collect::<Vec<_>>()), None);
    }

    #[test]
    fn a_gap_is_a_jump_that_no_drive_makes() {
        let whole: Vec<f64> = (0..4000).map(wave).collect();
        let cut: Vec<f64> = (0..4000).filter(|n| !(1500..1600).contains(n)).map(wave).collect();
        // the largest acceleration of the wave, twice over
        let most = 2.0 * (1e-4 + 0.3 * 0.037 * 0.037) * 1e6;
        assert_eq!(Jump::of(&whole, 1000.0, most), None);
        assert_eq!(Jump::of(&cut, 1000.0, most).unwrap().sample, 1499);
    }
}
