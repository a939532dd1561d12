//! Zero-phase low-pass of fourth order, and slopes.

use core::f64::consts::PI;

/// Samples put before and after, mirrored through the end, for the filter to settle on.
const RUN_IN: usize = 200;

/// Butterworth's low-pass of fourth order, once forth and once back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Smoother {
    /// b0 (b1 = 2·b0, b2 = b0), a1, a2 of both sections.
    sections: [[f64; 3]; 2],
}

impl Smoother {
    /// A corner at a sample rate.
    pub(super) fn new(corner_hz: f64, rate_hz: f64) -> Self {
        let k = (PI * corner_hz / rate_hz).tan();
        // pole pairs at 22.5° and 67.5° from the real axis
        let section = |angle: f64| {
            let damping = 2.0 * (angle * PI / 180.0).cos();
            let scale = 1.0 / (1.0 + damping * k + k * k);
            [k * k * scale, 2.0 * (k * k - 1.0) * scale, (1.0 - damping * k + k * k) * scale]
        };
        Self { sections: [section(22.5), section(67.5)] }
    }

    /// Smooths without shifting in time.
    pub(super) fn smooth(&self, values: &[f64]) -> Vec<f64> {
        let n = values.len();
        let reach = RUN_IN.min(n.saturating_sub(1));
        let mut all: Vec<f64> = Vec::with_capacity(n + 2 * reach);
        all.extend((1..=reach).rev().map(|i| 2.0 * values[0] - values[i]));
        all.extend(values);
        all.extend((1..=reach).map(|i| 2.0 * values[n - 1] - values[n - 1 - i]));
        for _ in 0..2 {
            self.forth(&mut all);
            all.reverse();
        }
        all[reach..reach + n].to_vec()
    }

    fn forth(&self, values: &mut [f64]) {
        let Some(&first) = values.first() else { return };
        for [b, a1, a2] in self.sections {
            let (mut z1, mut z2) = (0.0, 0.0);
            for value in values.iter_mut() {
                let x = *value - first;
                let y = b * x + z1;
                z1 = 2.0 * b * x - a1 * y + z2;
                z2 = b * x - a2 * y;
                *value = y + first;
            }
        }
    }
}

/// Central differences.
pub(super) fn slope(values: &[f64], rate_hz: f64) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    let at = |n: usize| {
        let (a, b) = (n.saturating_sub(1), (n + 1).min(last));
        if a == b { 0.0 } else { (values[b] - values[a]) * rate_hz / (b - a) as f64 }
    };
    (0..values.len()).map(at).collect()
}

/// Second differences.
pub(super) fn bend(values: &[f64], rate_hz: f64) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    let at = |n: usize| {
        let (a, b) = (values[n.saturating_sub(1)], values[(n + 1).min(last)]);
        (a - 2.0 * values[n] + b) * rate_hz * rate_hz
    };
    (0..values.len()).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    /// Forth and back the gain is 1/(1 + Ω⁸) with Ω the ratio of the tangents (bilinear transform).
    #[test]
    fn law_gain_of_a_tone() {
        let rate = 2000.0;
        let smoother = Smoother::new(100.0, rate);
        for hz in [10.0, 80.0, 100.0, 160.0] {
            let turn = 2.0 * PI * hz / rate;
            let tone: Vec<f64> = (0..8000).map(|n| (turn * f64::from(n)).sin()).collect();
            let out = smoother.smooth(&tone);
            let ratio = (0.5 * turn).tan() / (PI * 100.0 / rate).tan();
            let gain = 1.0 / (1.0 + ratio.powi(8));
            // the middle, 3000 samples from either end: transients are below rounding there
            let off = (3000..5000).map(|n| (out[n] - gain * tone[n]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-10, "{hz} Hz: {off:e}");
        }
    }

    #[test]
    fn slope_of_a_parabola() {
        let values: Vec<f64> = (0..50).map(|n| f64::from(n * n)).collect();
        let (slope, bend) = (slope(&values, 10.0), bend(&values, 10.0));
        for n in 1..49 {
            assert_abs_diff_eq!(slope[n], 20.0 * n as f64, epsilon = 1e-9);
            assert_abs_diff_eq!(bend[n], 200.0, epsilon = 1e-9);
        }
    }
}
