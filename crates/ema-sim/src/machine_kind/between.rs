//! A command between the samples of a log that is slower than the controller.

/// Factor by which a second difference exceeds those around it where a command has a kink or jump.
const KINK: f64 = 8.0;
/// Fewest samples of a stretch that a spline goes through.
const LEAST_SAMPLES: usize = 4;

/// A command at the ticks of a controller, a number of ticks for each sample: a cubic spline
/// through stretches without a kink, straight across kinks and jumps, constant after the last
/// sample.
///
/// ```text
/// m_{i−1} + 4·m_i + m_{i+1} = 6·(x_{i+1} − 2·x_i + x_{i−1}),   m_0 = m_1,  m_n = m_{n−1}
/// ```
///
/// Straight lines between the samples of a smooth command have kinks that nobody commanded; a stiff
/// position loop makes spikes of them. A jump or a kink that was commanded stands out in the second
/// differences, and no spline goes through it, so that nothing swings over.
///
/// # Source
///
/// Interpolating cubic spline with parabolic ends, de Boor, *A Practical Guide to Splines*, 1978,
/// chapter IV; the rule for kinks is a choice of this project, `docs/models/greybox.md`.
pub(super) fn at_ticks(values: &[f64], ticks_per_sample: f64, ticks: usize) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    let bends = bends(values);
    let at = |tick: usize| {
        let place = tick as f64 / ticks_per_sample;
        let before = (place as usize).min(last);
        let part = place - before as f64;
        if before == last || part == 0.0 {
            return values[before];
        }
        let (from, to, [b0, b1]) = (values[before], values[before + 1], bends[before]);
        let rest = 1.0 - part;
        let cubic = |share: f64| share * (share * share - 1.0) / 6.0;
        rest * from + part * to + cubic(rest) * b0 + cubic(part) * b1
    };
    (0..ticks).map(at).collect()
}

/// Second derivatives, per sample squared, at both ends of each interval between samples.
fn bends(values: &[f64]) -> Vec<[f64; 2]> {
    let mut bends = vec![[0.0; 2]; values.len()];
    let knots = corners(values);
    for pair in knots.windows(2) {
        let stretch = &values[pair[0]..=pair[1]];
        if stretch.len() < LEAST_SAMPLES {
            continue;
        }
        let second = spline(stretch);
        for (place, ends) in second.windows(2).enumerate() {
            bends[pair[0] + place] = [ends[0], ends[1]];
        }
    }
    bends
}

/// Samples at which a stretch without a kink begins or ends: the first, the last, kinks and both
/// sides of jumps.
fn corners(values: &[f64]) -> Vec<usize> {
    let last = values.len().saturating_sub(1);
    let second = |n: usize| {
        if n == 0 || n >= last {
            return 0.0;
        }
        (values[n + 1] - 2.0 * values[n] + values[n - 1]).abs()
    };
    let mut is_corner = vec![false; values.len()];
    for n in 1..last {
        let (before, here, next, after) = (second(n - 1), second(n), second(n + 1), second(n + 2));
        // a kink on a sample bends there alone, one between samples at both of them
        if here > KINK * before.max(next) {
            is_corner[n] = true;
        }
        if n + 1 < last && here.min(next) > KINK * before.max(after) {
            is_corner[n] = true;
            is_corner[n + 1] = true;
        }
    }
    let inside = (1..last).filter(|n| is_corner[*n]);
    core::iter::once(0).chain(inside).chain((last > 0).then_some(last)).collect()
}

/// Second derivatives of a spline with parabolic ends, per sample squared.
fn spline(values: &[f64]) -> Vec<f64> {
    let inner = values.len() - 2;
    let right = |n: usize| 6.0 * (values[n + 2] - 2.0 * values[n + 1] + values[n]);
    // the ends repeat their neighbours: five on the diagonal there
    let diagonal = |n: usize| if n == 0 || n + 1 == inner { 5.0 } else { 4.0 };
    let (mut upper, mut second) = (vec![0.0; inner], vec![0.0; inner]);
    for n in 0..inner {
        let (above, before) =
            n.checked_sub(1).map_or((0.0, 0.0), |last| (upper[last], second[last]));
        let pivot = diagonal(n) - above;
        upper[n] = 1.0 / pivot;
        second[n] = (right(n) - before) / pivot;
    }
    for n in (0..inner.saturating_sub(1)).rev() {
        second[n] -= upper[n] * second[n + 1];
    }
    let (first, last) = (second[0], second[inner - 1]);
    core::iter::once(first).chain(second).chain([last]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest error of a sine between samples, so many of them a period.
    fn off(samples_per_period: f64) -> f64 {
        let sine = |place: f64| libm::sin(core::f64::consts::TAU * place / samples_per_period);
        let values: Vec<f64> = (0..200).map(|n| sine(f64::from(n))).collect();
        let fine = at_ticks(&values, 8.0, 1600);
        (160..1400).map(|tick| (fine[tick] - sine(tick as f64 / 8.0)).abs()).fold(0.0, f64::max)
    }

    /// The error of a spline falls with the fourth power, h⁴/384 of the fourth derivative.
    #[test]
    fn order_four_of_a_smooth_command() {
        let [coarse, fine] = [off(12.5), off(25.0)];
        assert!(coarse < 4e-4, "{coarse}");
        assert!((12.0..24.0).contains(&(coarse / fine)), "{coarse} {fine}");
    }

    #[test]
    fn steps_and_ramps_stay_what_they_are() {
        let steps: Vec<f64> = (0..60).map(|n| f64::from(n / 20)).collect();
        let fine = at_ticks(&steps, 4.0, 240);
        assert!(fine.iter().all(|x| (0.0..=2.0).contains(x)));
        assert_eq!((fine[76], fine[78], fine[80]), (0.0, 0.5, 1.0));
        let ramp: Vec<f64> = (0..60).map(|n| f64::from((n - 20i32).max(0)) * 0.5).collect();
        let fine = at_ticks(&ramp, 4.0, 230);
        let straight = |tick: usize| ((tick as f64 / 4.0) - 20.0).max(0.0) * 0.5;
        assert!((0..230).all(|tick| (fine[tick] - straight(tick)).abs() < 1e-12));
    }

    #[test]
    fn samples_are_met_and_the_end_is_held() {
        let values: Vec<f64> = (0..30).map(|n| libm::sin(0.3 * f64::from(n))).collect();
        let fine = at_ticks(&values, 5.0, 160);
        assert!((0..30).all(|n| fine[5 * n] == values[n]));
        assert_eq!(fine[150..], [values[29]; 10]);
        assert_eq!(at_ticks(&[0.7], 3.0, 4), [0.7; 4]);
        assert_eq!(at_ticks(&[0.0, 1.0], 2.0, 4), [0.0, 0.5, 1.0, 1.0]);
    }
}
