//! The sample rate of a time axis, with the tolerance that its writing implies.

use crate::clock::roundest;

/// Rate and regularity of a time axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Samples per second: the roundest number within
    /// [`rate_tolerance_hz`](Self::rate_tolerance_hz) of samples over duration.
    pub rate_hz: f64,
    /// How far the true rate can be from that, as the time column is rounded.
    pub rate_tolerance_hz: f64,
    /// Largest distance of a sample from the uniform grid between first and last, s.
    pub deviation_s: f64,
    /// Distance that rounding alone explains, s.
    pub tolerance_s: f64,
    /// Number of samples.
    pub samples: usize,
}

impl Sampling {
    /// Reads the rate off a strictly increasing time axis whose numbers are
    /// written to a multiple of `quantum_s`; `None` for fewer than two samples.
    ///
    /// ```text
    /// t_i = t_0 + i/f + r_i,   |r_i| ≤ q/2 + ε·max|t|
    /// f̂   = n / (t_n − t_0)
    /// ```
    ///
    /// Both ends are off by up to `q/2`, so the grid drawn between them is off by
    /// up to `q/2` anywhere and a sample from it by up to `q`; the duration is off
    /// by `q`, the rate by `f·q/(t_n − t_0)`. The floating-point part is two
    /// roundings (reading, and `t_0 + i/f`) at each end.
    pub(super) fn of(times_s: &[f64], quantum_s: f64) -> Option<Self> {
        let (&first, &last) = (times_s.first()?, times_s.last()?);
        let intervals = times_s.len() - 1;
        if intervals == 0 {
            return None;
        }
        let period_s = (last - first) / intervals as f64;
        let tolerance_s = quantum_s + 4.0 * f64::EPSILON * first.abs().max(last.abs());
        let from_grid =
            |(index, time_s): (usize, &f64)| (time_s - (first + index as f64 * period_s)).abs();
        let deviation_s = times_s.iter().enumerate().map(from_grid).fold(0.0, f64::max);
        let rate_hz = period_s.recip();
        let rate_tolerance_hz = rate_hz * tolerance_s / (last - first);
        Some(Self {
            rate_hz: roundest(rate_hz, rate_tolerance_hz),
            rate_tolerance_hz,
            deviation_s,
            tolerance_s,
            samples: times_s.len(),
        })
    }

    /// Tells whether the samples stand on a uniform grid, as far as the file resolves it.
    pub fn is_uniform(&self) -> bool {
        self.deviation_s <= self.tolerance_s
    }

    /// Tells whether the samples are even and their times fine enough to show each one that lacks:
    /// to a quarter of a period.
    pub fn shows_each_sample(&self) -> bool {
        self.is_uniform() && self.tolerance_s < 0.25 / self.rate_hz
    }

    /// Tells whether the axis can be taken as one at `rate_hz`: over the whole length
    /// the two drift apart by at most half a sample (beyond rounding), so that no
    /// sample has the index of its neighbour.
    pub fn agrees_with(&self, rate_hz: f64) -> bool {
        let drift_samples = (self.rate_hz - rate_hz).abs() / rate_hz * self.samples as f64;
        let rounding_samples = self.rate_tolerance_hz / self.rate_hz * self.samples as f64;
        drift_samples <= 0.5 + rounding_samples
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(rate_hz: f64, samples: usize, decimals: i32) -> Vec<f64> {
        let scale = 10f64.powi(decimals);
        (0..samples).map(|i| (i as f64 / rate_hz * scale).round() / scale).collect()
    }

    #[test]
    fn rounded_times_give_the_rate_they_were_made_at() {
        for (rate_hz, samples) in [(2000.0, 1000), (10_000.0, 5000), (4800.0, 2400), (25.0, 300)] {
            let sampling = Sampling::of(&axis(rate_hz, samples, 6), 1e-6).unwrap();
            assert_eq!(sampling.rate_hz, rate_hz);
            assert!(sampling.is_uniform(), "{sampling:?}");
            assert!(sampling.agrees_with(rate_hz) && !sampling.agrees_with(rate_hz * 1.01));
        }
    }

    #[test]
    fn exact_times_need_no_quantum() {
        let times_s: Vec<f64> = (0..5000).map(|i| 0.3 + f64::from(i) / 2000.0).collect();
        let sampling = Sampling::of(&times_s, 0.0).unwrap();
        assert_eq!(sampling.rate_hz, 2000.0);
        assert!(sampling.is_uniform(), "{sampling:?}");
    }

    #[test]
    fn a_missing_sample_is_not_uniform() {
        let mut times_s = axis(2000.0, 1000, 6);
        times_s.remove(500);
        assert!(!Sampling::of(&times_s, 1e-6).unwrap().is_uniform());
    }

    #[test]
    fn one_sample_has_no_rate() {
        assert_eq!(Sampling::of(&[0.0], 0.0), None);
        assert_eq!(Sampling::of(&[], 0.0), None);
    }
}
