//! Signals at other rates.

use core::f64::consts::PI;

/// A signal at another rate, straight between its samples.
pub fn resampled(signal: &[f64], from_hz: f64, to_hz: f64) -> Vec<f64> {
    if from_hz == to_hz {
        return signal.to_vec();
    }
    let last = signal.len().saturating_sub(1);
    let count = (last as f64 * to_hz / from_hz).floor() as usize + 1;
    (0..count)
        .map(|n| {
            let place = (n as f64 * from_hz / to_hz).min(last as f64);
            let before = (place.floor() as usize).min(last.saturating_sub(1));
            let share = place - before as f64;
            signal[before] + share * (signal[(before + 1).min(last)] - signal[before])
        })
        .collect()
}

/// Zeros of the kernel on either side of its middle.
const LOBES: f64 = 3.0;

/// A signal at another rate, without what the slower of the two cannot hold: weighted sums
///
/// ```text
/// y(t) = Σ w(t_i − t)·x_i / Σ w(t_i − t),   w(τ) = sinc(τ/T)·sinc(τ/3T) for |τ| < 3T, else 0
/// ```
///
/// with the sample period `T` of the slower rate. A sine of a fifth of that rate or less keeps its
/// size to 2 %.
///
/// # Source
///
/// C. E. Duchon, "Lanczos filtering in one and two dimensions", Journal of Applied Meteorology 18
/// (1979) 1016-1022.
pub(crate) fn band_limited(signal: &[f64], from_hz: f64, to_hz: f64) -> Vec<f64> {
    let last = signal.len().saturating_sub(1);
    let count = (last as f64 * to_hz / from_hz).floor() as usize + 1;
    // samples of the signal in a period of the slower rate
    let period = (from_hz / to_hz).max(1.0);
    let at = |n: usize| {
        let place = n as f64 * from_hz / to_hz;
        let reach = LOBES * period;
        let first = (place - reach).ceil().max(0.0) as usize;
        let end = ((place + reach).floor() as usize).min(last);
        let weighted = (first..=end).map(|i| (lanczos((i as f64 - place) / period), signal[i]));
        let (of_values, of_weights) = weighted
            .fold((0.0, 0.0), |(sum, weights), (weight, x)| (sum + weight * x, weights + weight));
        of_values / of_weights
    };
    (0..count).map(at).collect()
}

fn lanczos(periods: f64) -> f64 {
    let sinc = |x: f64| if x.abs() < 1e-9 { 1.0 } else { (PI * x).sin() / (PI * x) };
    if periods.abs() < LOBES { sinc(periods) * sinc(periods / LOBES) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(hz: f64, rate_hz: f64) -> Vec<f64> {
        (0..(2.0 * rate_hz) as usize).map(|n| (2.0 * PI * hz * n as f64 / rate_hz).sin()).collect()
    }

    #[test]
    fn slow_sines_stay_and_fast_ones_go() {
        for (from_hz, to_hz) in [(800.0, 1000.0), (640.0, 1000.0), (2000.0, 1000.0)] {
            let (made, wanted) =
                (band_limited(&sine(40.0, from_hz), from_hz, to_hz), sine(40.0, to_hz));
            assert!(made.len() + 2 >= wanted.len());
            for n in 10..made.len() - 10 {
                assert!((made[n] - wanted[n]).abs() < 0.005, "{from_hz} {n}");
            }
        }
        let gone = band_limited(&sine(850.0, 2000.0), 2000.0, 1000.0);
        assert!(gone[10..gone.len() - 10].iter().all(|x| x.abs() < 0.05));
    }
}
