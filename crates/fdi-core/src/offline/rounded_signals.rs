//! Signals in steps of each one's range.
//!
//! ```text
//! y_t = c_t·r/n,   r = max_t |y_t|,   |c_t| ≤ n
//! ```

use crate::offline::{
    signal_codes::SignalCodes,
    store::{Decode, Encode},
};

/// Steps of a signal that is kept as well as 16 bits can, to either side of zero.
pub(super) const CODE_STEPS: f64 = 32767.0;
/// Steps of a run of noise to either side of zero: rounding adds a white part of a thousandth of the
/// noise's variance, where its covariance is known to a tenth.
pub(super) const NOISE_STEPS: f64 = 63.0;

/// Signals of one length in steps, so many to each one's range.
#[derive(Encode, Decode)]
pub(super) struct RoundedSignals {
    /// Largest absolute value of each signal.
    ranges: Vec<f64>,
    codes: SignalCodes,
}

impl RoundedSignals {
    pub(super) fn of(signals: &[Vec<f64>], steps: f64) -> Self {
        let ranges: Vec<f64> = signals.iter().map(|signal| range_of(signal)).collect();
        let rows = signals.iter().zip(&ranges);
        let codes: Vec<i16> = rows
            .flat_map(|(signal, range)| {
                let scale = steps / range.max(f64::MIN_POSITIVE);
                signal.iter().map(move |value| (value * scale).round() as i16)
            })
            .collect();
        Self { codes: SignalCodes::pack(&codes, signals.first().map_or(0, Vec::len)), ranges }
    }

    /// The signals; `None` where they are not of so many samples each, or a range is not finite.
    pub(super) fn into_signals(self, samples: usize, steps: f64) -> Option<Vec<Vec<f64>>> {
        let codes = self.codes.unpack(samples)?;
        let fits = codes.len() == self.ranges.len() * samples
            && self.ranges.iter().all(|range| range.is_finite());
        let decoded = |(codes, range): (&[i16], &f64)| {
            codes.iter().map(|&code| f64::from(code) * range / steps).collect()
        };
        fits.then(|| codes.chunks_exact(samples).zip(&self.ranges).map(decoded).collect())
    }
}

/// Largest absolute value of a signal.
fn range_of(signal: &[f64]) -> f64 {
    signal.iter().fold(0.0, |range: f64, value| range.max(value.abs()))
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    fn signals() -> Vec<Vec<f64>> {
        let row = |k: i32| (0..40).map(|t| f64::from(k) * f64::from(t * k).sin()).collect();
        let mut signals: Vec<Vec<f64>> = (1..4).map(row).collect();
        signals.push(vec![0.0; 40]);
        signals
    }

    #[test]
    fn signals_come_back_to_half_a_step() {
        for steps in [CODE_STEPS, NOISE_STEPS] {
            let back = RoundedSignals::of(&signals(), steps).into_signals(40, steps).unwrap();
            for (signal, back) in signals().iter().zip(&back) {
                let half = 0.5 * range_of(signal) / steps;
                for (value, back) in signal.iter().zip(back) {
                    assert_abs_diff_eq!(*value, *back, epsilon = half * (1.0 + 1e-9));
                }
            }
        }
    }

    #[test]
    fn signals_of_another_length_are_none() {
        let rounded = || RoundedSignals::of(&signals(), CODE_STEPS);
        assert!(rounded().into_signals(39, CODE_STEPS).is_none());
        let endless = RoundedSignals { ranges: vec![f64::INFINITY; 4], ..rounded() };
        assert!(endless.into_signals(40, CODE_STEPS).is_none());
        let fewer = RoundedSignals { ranges: vec![1.0; 3], ..rounded() };
        assert!(fewer.into_signals(40, CODE_STEPS).is_none());
    }
}
