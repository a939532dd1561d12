//! Signals in 16-bit steps, laid out so that deflating them pays.
//!
//! A signal is written as its differences over time, first or second ones, of itself or of what it
//! adds to the first signal of its group. Arithmetic wraps around, so nothing is lost. The
//! differences are folded to be unsigned (0, -1, 1, -2, …), and their low and high bytes stand
//! apart: high bytes are nearly all zero, low bytes alone carry the noise.

use crate::offline::store::{Decode, Encode};

/// A group of signals of equal length.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub(super) struct SignalCodes {
    /// The prediction of each signal, by its place in [`Prediction::ALL`].
    predictions: Vec<u8>,
    low: Vec<u8>,
    high: Vec<u8>,
}

/// Prediction whose errors are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Prediction {
    /// From the first signal of the group as well.
    from_first: bool,
    /// Times that differences over time are taken.
    order: usize,
}

impl Prediction {
    const ALL: [Self; 4] = [
        Self { from_first: false, order: 1 },
        Self { from_first: false, order: 2 },
        Self { from_first: true, order: 1 },
        Self { from_first: true, order: 2 },
    ];

    /// Errors of the prediction of a signal.
    fn errors(self, signal: &[i16], first: &[i16]) -> Vec<i16> {
        let mut errors = signal.to_vec();
        if self.from_first {
            errors
                .iter_mut()
                .zip(first)
                .for_each(|(error, base)| *error = error.wrapping_sub(*base));
        }
        for _ in 0..self.order {
            let mut before = 0;
            for error in &mut errors {
                let value = *error;
                *error = value.wrapping_sub(before);
                before = value;
            }
        }
        errors
    }

    /// Turns the errors of a prediction into the signal, in place.
    fn restore(self, errors: &mut [i16], first: &[i16]) {
        for _ in 0..self.order {
            let mut sum = 0_i16;
            for error in errors.iter_mut() {
                sum = sum.wrapping_add(*error);
                *error = sum;
            }
        }
        if self.from_first {
            errors
                .iter_mut()
                .zip(first)
                .for_each(|(error, base)| *error = error.wrapping_add(*base));
        }
    }
}

impl SignalCodes {
    /// Packs signals of `samples` steps that stand one after the other.
    pub(super) fn pack(codes: &[i16], samples: usize) -> Self {
        let samples = samples.max(1);
        let first = codes.get(..samples).unwrap_or(codes);
        let mut packed = Self {
            predictions: Vec::with_capacity(codes.len() / samples),
            low: Vec::with_capacity(codes.len()),
            high: Vec::with_capacity(codes.len()),
        };
        for (index, signal) in codes.chunks(samples).enumerate() {
            let (place, errors) = Prediction::ALL
                .into_iter()
                .enumerate()
                .filter(|(_, prediction)| index > 0 || !prediction.from_first)
                .map(|(place, prediction)| (place, prediction.errors(signal, first)))
                .min_by_key(|(_, errors)| size_of_errors(errors))
                .expect("two predictions need no first signal");
            packed.predictions.push(place as u8);
            for error in errors {
                let [low, high] = folded(error).to_le_bytes();
                packed.low.push(low);
                packed.high.push(high);
            }
        }
        packed
    }

    /// The signals, one after the other; none where these are no signals of `samples` steps.
    pub(super) fn unpack(&self, samples: usize) -> Option<Vec<i16>> {
        let expected = self.predictions.len().checked_mul(samples)?;
        if self.low.len() != expected || self.high.len() != expected {
            return None;
        }
        let bytes = self.low.iter().zip(&self.high);
        let mut codes: Vec<i16> =
            bytes.map(|(&low, &high)| unfolded(u16::from_le_bytes([low, high]))).collect();
        let (first, others) = codes.split_at_mut(samples.min(expected));
        let mut predictions = self.predictions.iter();
        if let Some(&place) = predictions.next() {
            let prediction = Prediction::ALL.get(usize::from(place))?;
            if prediction.from_first {
                return None;
            }
            prediction.restore(first, &[]);
        }
        for (&place, signal) in predictions.zip(others.chunks_exact_mut(samples.max(1))) {
            Prediction::ALL.get(usize::from(place))?.restore(signal, first);
        }
        Some(codes)
    }
}

/// Sum of the absolute errors, by which predictions are compared.
fn size_of_errors(errors: &[i16]) -> u64 {
    errors.iter().map(|error| u64::from(error.unsigned_abs())).sum()
}

/// 0, -1, 1, -2, … as 0, 1, 2, 3, …
fn folded(error: i16) -> u16 {
    ((error << 1) ^ (error >> 15)).cast_unsigned()
}

/// Inverse of [`folded`].
fn unfolded(code: u16) -> i16 {
    (code >> 1).cast_signed() ^ -(code & 1).cast_signed()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sine of `samples` steps per signal, each signal a little larger than the one before.
    fn alike(signals: i16, samples: i16) -> Vec<i16> {
        let value = |signal: i16, n: i16| {
            let amplitude = 20_000.0 + 40.0 * f64::from(signal);
            (amplitude * (0.05 * f64::from(n)).sin()).round() as i16
        };
        (0..signals).flat_map(|signal| (0..samples).map(move |n| value(signal, n))).collect()
    }

    #[test]
    fn folding_is_a_permutation_of_all_codes() {
        assert_eq!([0, -1, 1, -2].map(folded), [0, 1, 2, 3]);
        assert_eq!(folded(i16::MIN), u16::MAX);
        for code in 0..=u16::MAX {
            assert_eq!(folded(unfolded(code)), code);
        }
    }

    #[test]
    fn signals_come_back() {
        let extremes = [-32767, 32767, i16::MIN, i16::MAX, 0, -32767, -1, 1, 32767, i16::MIN, 0, 0];
        for codes in [&alike(9, 400)[..], &extremes, &[]] {
            for samples in [1, 2, 3, 4, 12].into_iter().filter(|n| codes.len() % n == 0) {
                let packed = SignalCodes::pack(codes, samples);
                assert_eq!(packed.unpack(samples).as_deref(), Some(codes), "{samples} samples");
            }
        }
    }

    #[test]
    fn each_prediction_is_undone_by_its_restoration() {
        let (signal, first) = ([32767, -32767, 32767, -32768, 5], [-32767, 32767, 1, 32767, -9]);
        for prediction in Prediction::ALL {
            let mut errors = prediction.errors(&signal, &first);
            assert_ne!(errors, signal);
            prediction.restore(&mut errors, &first);
            assert_eq!(errors, signal, "{prediction:?}");
        }
    }

    #[test]
    fn alike_signals_have_small_errors() {
        let packed = SignalCodes::pack(&alike(9, 400), 400);
        let large = packed.high.iter().filter(|byte| **byte != 0).count();
        // a signal's first two differences are large, and no other
        assert!(large <= 2 * 9, "{large} large errors");
    }

    #[test]
    fn what_no_pack_has_made_is_refused() {
        let good = SignalCodes::pack(&alike(3, 8), 8);
        assert_eq!(good.unpack(7), None);
        assert_eq!(good.unpack(usize::MAX), None);
        let mut shorter = good.clone();
        shorter.high.pop();
        assert_eq!(shorter.unpack(8), None);
        // the first signal has none to be predicted from, and there are four predictions
        for (signal, place) in [(0, 2), (0, 4), (1, 4)] {
            let mut bad = good.clone();
            bad.predictions[signal] = place;
            assert_eq!(bad.unpack(8), None, "signal {signal}, prediction {place}");
        }
    }
}
