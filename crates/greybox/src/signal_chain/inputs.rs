//! Inputs that come in behind the controller.

use core::ops::Range;

use crate::median::median;

/// Time over which a residual is averaged, s: single samples are no input.
const AVERAGED_S: f64 = 5e-3;
/// Shortest input, s.
const SHORTEST_S: f64 = 0.02;
/// Size of an input over the scatter of the residual beside it, and over the range of the drive.
const OVER_SCATTER: f64 = 8.0;
const OVER_RANGE: f64 = 0.1;
/// Least share of a recording without inputs, for it to tell them.
const LEAST_QUIET: f64 = 0.3;
/// Scatter of an input within itself, over its size: pulses and steps are told, and no law that is
/// wrong.
const MOST_UNEVEN: f64 = 0.3;
/// Share of the drive's energy that the controller may leave beside the inputs.
const MOST_LEFT: f64 = 0.02;

/// Inputs behind the controller of one recording.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Inputs {
    /// Input at each sample, in the unit of the drive; zero where there is none.
    pub(super) values: Vec<f64>,
    /// Time that they last.
    pub(super) lasting_s: f64,
    /// The largest.
    pub(super) largest: f64,
}

impl Inputs {
    /// Inputs that a residual (recorded drive less replayed controller) shows; `None` where it shows
    /// none, or is no more than noise beside them.
    pub(super) fn of(
        residual: &[f64],
        drive: &[f64],
        rate_hz: f64,
        kept: Range<usize>,
    ) -> Option<Self> {
        let length = (libm::round(AVERAGED_S * rate_hz) as usize).max(1);
        let smooth = around(residual, length / 2);
        let [least, most] = inference::ends(drive);
        let is_quiet = |x: &f64| x.abs() < OVER_RANGE * (most - least);
        let quiet: Vec<f64> = smooth[kept.clone()].iter().copied().filter(is_quiet).collect();
        if (quiet.len() as f64) < LEAST_QUIET * kept.len() as f64 {
            return None;
        }
        let middle = median(quiet.clone());
        let scatter = 1.4826 * median(quiet.iter().map(|x| (x - middle).abs()).collect());
        let limit = (OVER_SCATTER * scatter).max(OVER_RANGE * (most - least));
        let shortest = ((SHORTEST_S * rate_hz) as usize).max(2);
        let mut runs = runs(&smooth, middle, limit, shortest);
        runs.retain(|run| is_even(&residual[run.clone()], middle));
        let samples: usize = runs.iter().map(ExactSizeIterator::len).sum();
        if runs.is_empty() {
            return None;
        }
        let mut values = vec![0.0; residual.len()];
        for run in &runs {
            let size = median(residual[run.clone()].iter().map(|x| x - middle).collect());
            // the ends of a run belong to the average's length
            let reach = length / 2;
            values[(run.start + reach).min(run.end)..run.end.saturating_sub(reach).max(run.start)]
                .fill(size);
        }
        let is_beside =
            |n: &usize| runs.iter().all(|run| *n + length < run.start || *n >= run.end + length);
        let beside: Vec<usize> = kept.filter(is_beside).collect();
        let energy = |of: &dyn Fn(usize) -> f64| {
            let mean = beside.iter().map(|n| of(*n)).sum::<f64>() / beside.len().max(1) as f64;
            beside.iter().map(|n| (of(*n) - mean) * (of(*n) - mean)).sum::<f64>()
        };
        let left = energy(&|n| smooth[n]);
        if left > MOST_LEFT * energy(&|n| drive[n]) {
            return None;
        }
        let largest =
            values.iter().copied().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        Some(Self { values, lasting_s: samples as f64 / rate_hz, largest })
    }
}

/// Tells whether an input scatters less than its size.
fn is_even(input: &[f64], middle: f64) -> bool {
    let size = median(input.iter().map(|x| x - middle).collect());
    let scatter = 1.4826 * median(input.iter().map(|x| (x - middle - size).abs()).collect());
    scatter < MOST_UNEVEN * size.abs()
}

/// Stretches in which a signal departs from its middle to one side by more than a limit.
fn runs(signal: &[f64], middle: f64, limit: f64, shortest: usize) -> Vec<Range<usize>> {
    let side = |n: usize| {
        let off = signal[n] - middle;
        if off > limit { 1 } else { -i32::from(off < -limit) }
    };
    let (mut found, mut from) = (Vec::new(), 0);
    for n in 1..=signal.len() {
        if n < signal.len() && side(n) == side(from) {
            continue;
        }
        if side(from) != 0 && n - from >= shortest {
            found.push(from..n);
        }
        from = n;
    }
    found
}

/// Means over as many samples before as after.
fn around(signal: &[f64], reach: usize) -> Vec<f64> {
    let last = signal.len().saturating_sub(1);
    let mean = |n: usize| {
        let reach = reach.min(n).min(last - n);
        let around = &signal[n - reach..=n + reach];
        around.iter().sum::<f64>() / around.len() as f64
    };
    (0..signal.len()).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive() -> Vec<f64> {
        (0..8000).map(|n| 3.0 * libm::sin(2e-3 * f64::from(n))).collect()
    }

    #[test]
    fn pulses_behind_the_controller_are_told_with_their_size() {
        let mut residual: Vec<f64> = (0..8000).map(|n| 0.01 * libm::sin(f64::from(n))).collect();
        residual[3000..3200].iter_mut().for_each(|x| *x += 5.0);
        residual[6000..6100].iter_mut().for_each(|x| *x -= 4.0);
        let inputs = Inputs::of(&residual, &drive(), 1000.0, 300..7900).unwrap();
        assert!((inputs.largest - 5.0).abs() < 0.02, "{inputs:?}");
        assert!((inputs.values[6050] + 4.0).abs() < 0.02 && inputs.values[1000] == 0.0);
        assert!((inputs.lasting_s - 0.3).abs() < 0.02);
    }

    #[test]
    fn noise_and_a_wrong_controller_are_no_inputs() {
        let noise: Vec<f64> = (0..8000).map(|n| 0.3 * libm::sin(1.7 * f64::from(n))).collect();
        assert_eq!(Inputs::of(&noise, &drive(), 1000.0, 300..7900), None);
        let half: Vec<f64> = drive().iter().map(|u| 0.5 * u).collect();
        assert_eq!(Inputs::of(&half, &drive(), 1000.0, 300..7900), None);
    }
}
