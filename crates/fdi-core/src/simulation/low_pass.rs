//! Signals before the low-pass of a drive.
//!
//! A drive smooths what it logs by an exponential mean at each tick of its controller, every `T`:
//!
//! ```text
//! y(t) = y(t − T) + (1 − e)·(x(t) − y(t − T)),   e = exp(−2π·f_c·T)
//! x(t) = y(t) + e/(1 − e)·(y(t) − y(t − T))
//! ```
//!
//! which is later by `T/2` less than the low-pass of first order with the corner `f_c`. The noise
//! before it becomes what it was, and that behind it, such as of digits, is amplified above the corner.

use core::f64::consts::TAU;

use crate::simulation::shifting::advanced;

/// Signal before an exponential mean with a corner at ticks of `tick_hz`, of samples at any rate.
pub(crate) fn before_low_pass(
    signal: &[f64],
    rate_hz: f64,
    corner_hz: f64,
    tick_hz: f64,
) -> Vec<f64> {
    let kept = (-TAU * corner_hz / tick_hz).exp();
    let share = kept / (1.0 - kept);
    let a_tick_before = advanced(signal, -rate_hz / tick_hz);
    signal.iter().zip(a_tick_before).map(|(now, before)| now + share * (now - before)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_is_what_it_was_before_its_low_pass() {
        let (tick_hz, corner_hz) = (10e3, 500.0);
        let wave = |n: usize| (1e-2 * n as f64).sin();
        let share = 1.0 - (-TAU * corner_hz / tick_hz).exp();
        let mut mean = 0.0;
        let passed: Vec<f64> = (0..4000)
            .map(|n| {
                mean += share * (wave(n) - mean);
                mean
            })
            .collect();
        // a hundredth of a radian a tick, three ticks late
        assert!((passed[314] - wave(314)).abs() > 0.02);
        // between samples a windowed sinc errs by some 1e-4
        for (ticks, most) in [(1, 1e-12), (4, 1e-3)] {
            let log: Vec<f64> = passed.iter().step_by(ticks).copied().collect();
            let rate_hz = tick_hz / ticks as f64;
            let given_back = before_low_pass(&log, rate_hz, corner_hz, tick_hz);
            for (n, value) in given_back.iter().enumerate().take(900).skip(50) {
                let off = (value - wave(n * ticks)).abs();
                assert!(off < most, "{ticks}, {n}: {off}");
            }
        }
    }
}
