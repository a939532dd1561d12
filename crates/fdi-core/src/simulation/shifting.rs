//! Signals between their samples.

use core::f64::consts::PI;

/// A signal from some samples after its first on: through a windowed sinc (Lanczos), the ends held.
pub(crate) fn advanced(signal: &[f64], by: f64) -> Vec<f64> {
    let whole = by.floor();
    let weights = lanczos_weights(by - whole);
    (0..signal.len()).map(|n| weighted(signal, n as i64 + whole as i64, &weights)).collect()
}

/// A signal that is slower than a drive's ticks at each of these, through the same windowed sinc; one
/// that is not, at its own rate. With the rate.
///
/// The filters of the envelope are exact between samples that lie on a straight line: at a few samples
/// for each period of the signal they need the ones between.
pub(crate) fn at_ticks(signal: &[f64], rate_hz: f64, tick_hz: f64) -> (Vec<f64>, f64) {
    if rate_hz > tick_hz * (1.0 - 1e-6) {
        return (signal.to_vec(), rate_hz);
    }
    let last = signal.len() - 1;
    let count = (last as f64 * tick_hz / rate_hz + 1e-6).floor() as usize + 1;
    let value = |tick: usize| {
        let place = tick as f64 * rate_hz / tick_hz;
        let nearest = place.round();
        if (place - nearest).abs() < 1e-6 {
            return signal[nearest as usize];
        }
        weighted(signal, place.floor() as i64, &lanczos_weights(place - place.floor()))
    };
    ((0..count).map(value).collect(), tick_hz)
}

/// Samples to either side that one between two is made of.
const LANCZOS_REACH: i64 = 8;

/// Weighted sum of the samples around a middle one, the ends of the signal held.
fn weighted(signal: &[f64], middle: i64, weights: &[f64]) -> f64 {
    let last = signal.len() as i64 - 1;
    let first = middle - LANCZOS_REACH;
    let at = |tap: usize| signal[(first + tap as i64).clamp(0, last) as usize];
    weights.iter().enumerate().map(|(tap, weight)| weight * at(tap)).sum()
}

/// Weights of the samples from `LANCZOS_REACH` before to as many after, for one that lies a share
/// of a period after the middle one; their sum is one.
fn lanczos_weights(share: f64) -> Vec<f64> {
    let sinc = |x: f64| if x == 0.0 { 1.0 } else { (PI * x).sin() / (PI * x) };
    let weight = |tap: i64| {
        let x = (tap - LANCZOS_REACH) as f64 - share;
        sinc(x) * sinc((x / LANCZOS_REACH as f64).clamp(-1.0, 1.0))
    };
    let weights: Vec<f64> = (0..=2 * LANCZOS_REACH).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|weight| weight / sum).collect()
}

/// Derivative of a signal by time, by differences of the fourth order.
pub(crate) fn rise(signal: &[f64], rate_hz: f64) -> Vec<f64> {
    let last = signal.len() as i64 - 1;
    let at = |n: i64| signal[n.clamp(0, last) as usize];
    let near = |n: i64| at(n + 1) - at(n - 1);
    let far = |n: i64| at(n + 2) - at(n - 2);
    (0..=last).map(|n| rate_hz * (8.0 * near(n) - far(n)) / 12.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_signal_is_advanced_between_its_samples() {
        let wave = |n: f64| (0.5 * n).sin() + 2.0;
        let signal: Vec<f64> = (0..80).map(|n| wave(f64::from(n))).collect();
        for by in [1.4, -2.25, 3.0] {
            let moved = advanced(&signal, by);
            for (n, value) in moved.iter().enumerate().take(65).skip(15) {
                // a period of a dozen samples through 17 taps: a thousandth
                assert!((value - wave(n as f64 + by)).abs() < 2e-3, "{n} {by}");
            }
        }
        assert_eq!(advanced(&signal, 3.0)[2], signal[5]);
        assert_eq!(advanced(&signal, -3.0)[1], signal[0]);
    }

    #[test]
    fn a_slow_signal_is_known_at_each_tick() {
        let wave = |t_s: f64| (700.0 * t_s).sin();
        for rate_hz in [2000.0, 2500.0, 3300.0] {
            let signal: Vec<f64> = (0..400).map(|n| wave(f64::from(n) / rate_hz)).collect();
            let (ticks, tick_hz) = at_ticks(&signal, rate_hz, 10e3);
            assert_eq!(tick_hz, 10e3);
            // as many as fit between the first sample and the last
            assert_eq!(ticks.len(), (399.0 * 10e3 / rate_hz).floor() as usize + 1);
            for (n, value) in ticks.iter().enumerate().skip(100).take(ticks.len() - 200) {
                assert!((value - wave(n as f64 / 10e3)).abs() < 1e-3, "{rate_hz} {n}");
            }
        }
        assert_eq!(at_ticks(&[1.0, 2.0], 20e3, 10e3), (vec![1.0, 2.0], 20e3));
    }
}
