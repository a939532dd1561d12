//! Low-passes without a delay, as the benchmark's own procedure uses them: Butterworth, and
//! Chebyshev of the first kind for decimation, by second-order sections, forwards and backwards.
//!
//! Conventions as in `SciPy` 1.17 (`butter`, `cheby1`, `sosfiltfilt`, `decimate`): bilinear
//! transform with the corner kept, odd extension at both ends, each section started in the steady
//! state of the first sample.

use core::f64::consts::PI;

/// `y = (b·(1 + 2/z + 1/z²)) / (1 + a1/z + a2/z²)`.
#[derive(Clone, Copy, Debug)]
struct Section {
    gain: f64,
    a1: f64,
    a2: f64,
}

/// A low-pass of even order.
#[derive(Clone, Debug)]
pub(super) struct LowPass(Vec<Section>);

impl LowPass {
    /// Butterworth, with the corner as a share of half the sampling rate.
    pub(super) fn butterworth(order: usize, corner_ratio: f64) -> Self {
        Self::of_poles(order, corner_ratio, (1.0, 1.0), 1.0)
    }

    /// Chebyshev of the first kind with so much ripple, and its edge as a share of half the
    /// sampling rate.
    pub(super) fn chebyshev(order: usize, ripple_db: f64, edge_ratio: f64) -> Self {
        let ripple = (10_f64.powf(0.1 * ripple_db) - 1.0).sqrt();
        let mu = (1.0 / ripple).asinh() / order as f64;
        // an even order is at the lower edge of its ripple at rest
        let at_rest = 1.0 / (1.0 + ripple * ripple).sqrt();
        Self::of_poles(order, edge_ratio, (mu.sinh(), mu.cosh()), at_rest)
    }

    /// Poles on an ellipse with these half-axes, moved to the corner and to discrete time.
    fn of_poles(order: usize, ratio: f64, axes: (f64, f64), at_rest: f64) -> Self {
        assert!(order.is_multiple_of(2), "an even order");
        let pairs = order / 2;
        let warped = 4.0 * (0.5 * PI * ratio).tan();
        let section = |pair: usize| {
            let angle = PI * (2 * pair + 1) as f64 / (2 * order) as f64;
            // analogue pole x + iy in the left half-plane; z = (4 + p)/(4 − p)
            let (x, y) = (-warped * axes.0 * angle.sin(), warped * axes.1 * angle.cos());
            let below = (4.0 - x) * (4.0 - x) + y * y;
            let re = ((4.0 + x) * (4.0 - x) - y * y) / below;
            let im = 8.0 * y / below;
            let (a1, a2) = (-2.0 * re, re * re + im * im);
            Section { gain: 0.25 * (1.0 + a1 + a2), a1, a2 }
        };
        let mut sections: Vec<Section> = (0..pairs).map(section).collect();
        sections[0].gain *= at_rest;
        Self(sections)
    }

    /// Forwards and backwards.
    pub(super) fn without_delay(&self, signal: &[f64]) -> Vec<f64> {
        let (last, reach) = (signal.len() - 1, 3 * (2 * self.0.len() + 1));
        assert!(last >= reach, "more than {reach} samples");
        let before = (1..=reach).rev().map(|n| 2.0 * signal[0] - signal[n]);
        let after = (1..=reach).map(|n| 2.0 * signal[last] - signal[last - n]);
        let extended: Vec<f64> = before.chain(signal.iter().copied()).chain(after).collect();
        let mut passed = extended;
        for _ in 0..2 {
            passed = self.once(&passed);
            passed.reverse();
        }
        passed[reach..=reach + last].to_vec()
    }

    fn once(&self, signal: &[f64]) -> Vec<f64> {
        let mut passed = signal.to_vec();
        let mut at_rest = signal[0];
        for s in &self.0 {
            // transposed form; states of a constant input
            let through = 4.0 * s.gain / (1.0 + s.a1 + s.a2);
            let mut second = at_rest * (s.gain - s.a2 * through);
            let mut first = at_rest * (2.0 * s.gain - s.a1 * through) + second;
            at_rest *= through;
            for x in &mut passed {
                let y = s.gain * *x + first;
                first = 2.0 * s.gain * *x - s.a1 * y + second;
                second = s.gain * *x - s.a2 * y;
                *x = y;
            }
        }
        passed
    }
}

/// Every tenth sample behind a Chebyshev low-pass, without a delay.
pub(super) fn decimated_by_ten(signal: &[f64]) -> Vec<f64> {
    let low_pass = LowPass::chebyshev(8, 0.05, 0.08);
    low_pass.without_delay(signal).into_iter().step_by(10).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `SciPy` 1.17.1: `x = sin(0.05 n) + 0.3 cos(0.9 n) + 0.01 n`, n = 0 … 199; values at 0, 7, 50
    /// and 199 of `sosfiltfilt(butter(4, 0.2, output="sos"), x)`.
    const BUTTERWORTH: [(usize, f64); 4] = [
        (0, 0.301_899_854_937),
        (7, 0.418_148_724_592),
        (50, 1.104_810_482_657),
        (199, 1.188_149_658_629),
    ];
    /// The same of `decimate(x, 10, zero_phase=True)`, at 0, 1, 5 and 19.
    const DECIMATED: [(usize, f64); 4] = [
        (0, 0.293_817_064_317),
        (1, 0.529_715_349_361),
        (5, 1.098_266_835_998),
        (19, 1.740_369_871_599),
    ];
    /// Rounding of the printed values; a recursion of order 8 with poles near 1 loses some digits.
    const ROUNDING: f64 = 1e-9;

    fn signal() -> Vec<f64> {
        let at = |n: f64| (0.05 * n).sin() + 0.3 * (0.9 * n).cos() + 0.01 * n;
        (0..200).map(|n| at(f64::from(n))).collect()
    }

    #[test]
    fn versus_scipy_butterworth_forwards_and_backwards() {
        let passed = LowPass::butterworth(4, 0.2).without_delay(&signal());
        for (place, expected) in BUTTERWORTH {
            assert!((passed[place] - expected).abs() < ROUNDING, "{place}: {}", passed[place]);
        }
    }

    #[test]
    fn versus_scipy_decimation_by_ten() {
        let passed = decimated_by_ten(&signal());
        assert_eq!(passed.len(), 20);
        for (place, expected) in DECIMATED {
            assert!((passed[place] - expected).abs() < ROUNDING, "{place}: {}", passed[place]);
        }
    }
}
