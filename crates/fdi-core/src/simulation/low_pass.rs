//! What a low-pass of first order took from a signal, given back.
//!
//! ```text
//! x = y + τ·dy/dt,   τ = 1/(2π·f_c)
//! ```
//!
//! The noise before the low-pass becomes what it was, and that behind it, such as of digits, is
//! amplified above the corner.

use core::f64::consts::TAU;

/// Signal before a low-pass of first order whose corner is `corner_hz`.
pub(crate) fn before_low_pass(signal: &[f64], rate_hz: f64, corner_hz: f64) -> Vec<f64> {
    let tau_s = 1.0 / (TAU * corner_hz);
    signal.iter().zip(rise(signal, rate_hz)).map(|(y, rate)| y + tau_s * rate).collect()
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
    fn a_slow_signal_is_what_it_was_before_its_low_pass() {
        let (rate_hz, corner_hz) = (10e3, 500.0);
        let wave = |n: i32| (1e-2 * f64::from(n)).sin();
        let decay = (-TAU * corner_hz / rate_hz).exp();
        let mut passed = vec![0.0];
        for n in 1..4000 {
            let before = passed[passed.len() - 1];
            // straight between samples
            let r = TAU * corner_hz / rate_hz;
            let now = 1.0 - (1.0 - decay) / r;
            passed.push(decay * before + (1.0 - decay - now) * wave(n - 1) + now * wave(n));
        }
        let given_back = before_low_pass(&passed, rate_hz, corner_hz);
        for (n, value) in given_back.iter().enumerate().take(3900).skip(200) {
            assert!((value - wave(n as i32)).abs() < 1e-5, "{n}: {value}");
        }
        // the low-pass itself is a thousand times that
        assert!((passed[157] - wave(157)).abs() < 0.1 && (passed[314] - wave(314)).abs() > 0.02);
    }
}
