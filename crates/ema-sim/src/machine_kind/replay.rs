//! Recorded signals at the ticks of a controller, and back at the samples of the recording.

/// A recorded signal at the ticks of a controller, from its first sample to its last: the cubic
/// through the four samples around each tick.
pub(super) fn at_ticks(signal: &[f64], rate_hz: f64, tick_hz: f64) -> Vec<f64> {
    let last = signal.len().saturating_sub(1);
    let ticks = libm::round(last as f64 * tick_hz / rate_hz) as usize + 1;
    (0..ticks)
        .map(|tick| cubic(signal, (tick as f64 * rate_hz / tick_hz).min(last as f64)))
        .collect()
}

/// Value at a place between samples, by the cubic through the four around it (Lagrange); at either
/// end of the signal through the four nearest.
fn cubic(signal: &[f64], place: f64) -> f64 {
    let before = place as usize;
    if before as f64 == place || signal.len() < 4 {
        let next = signal[(before + 1).min(signal.len() - 1)];
        return signal[before] + (place - before as f64) * (next - signal[before]);
    }
    let first = before.saturating_sub(1).min(signal.len() - 4);
    let x = place - first as f64;
    let [a, b, c, d] = [x, x - 1.0, x - 2.0, x - 3.0];
    let around = &signal[first..first + 4];
    -b * c * d / 6.0 * around[0] + a * c * d / 2.0 * around[1] - a * b * d / 2.0 * around[2]
        + a * b * c / 6.0 * around[3]
}

/// Rate of change of a signal at each tick, from the ticks beside it.
pub(super) fn rates(signal: &[f64], tick_hz: f64) -> Vec<f64> {
    let last = signal.len().saturating_sub(1);
    let rate = |n: usize| {
        let (before, after) = (n.saturating_sub(1), (n + 1).min(last));
        (signal[after] - signal[before]) * tick_hz / (after - before).max(1) as f64
    };
    (0..signal.len()).map(rate).collect()
}

/// Values at so many samples of a recording, straight between ticks.
pub(super) fn at_samples(signal: &[f64], tick_hz: f64, rate_hz: f64, samples: usize) -> Vec<f64> {
    let last = signal.len() - 1;
    let at = |n: usize| {
        let place = (n as f64 * tick_hz / rate_hz).min(last as f64);
        let before = place as usize;
        let next = signal[(before + 1).min(last)];
        signal[before] + (place - before as f64) * (next - signal[before])
    };
    (0..samples).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of a cubic whose terms reach 10.
    const ROUNDED: f64 = 1e-12;

    #[test]
    fn a_cubic_goes_through_ticks_between_samples_and_back() {
        let law = |t: f64| 0.3 * t * t * t - t * t + 2.0 * t - 1.0;
        let samples: Vec<f64> = (0..8).map(|n| law(0.25 * f64::from(n))).collect();
        let ticks = at_ticks(&samples, 4.0, 20.0);
        assert_eq!(ticks.len(), 36);
        for (n, value) in (0..).zip(&ticks) {
            assert!((value - law(0.05 * f64::from(n))).abs() < ROUNDED, "{n}: {value}");
        }
        let back = at_samples(&ticks, 20.0, 4.0, 8);
        assert!(back.iter().zip(&samples).all(|(a, b)| (a - b).abs() < ROUNDED));
        assert_eq!(at_ticks(&samples, 4.0, 4.0), samples);
        assert_eq!(rates(&[0.0, 1.0, 4.0], 10.0), [10.0, 20.0, 30.0]);
    }
}
