//! A recording as its equations are compared: averaged, without its start and its end.

use crate::{machine::Machine, record::Record};

/// Time left out at the start: integrators are not known there.
const SETTLING_S: f64 = 0.3;
/// Time left out at the end, and the largest shift looked for, s.
pub(super) const MOST_SHIFT_S: f64 = 0.025;
/// Fewest averages that are compared.
const LEAST_AVERAGES: usize = 40;

/// A recording with position, and how it is averaged.
#[derive(Clone, Copy, Debug)]
pub(super) struct View<'a> {
    pub(super) record: &'a Record,
    pub(super) position: &'a [f64],
    factor: usize,
    from: usize,
    to: usize,
}

impl<'a> View<'a> {
    /// `None` for a recording without a position, behind a filter, or too short.
    pub(super) fn of(machine: &Machine, record: &'a Record) -> Option<Self> {
        if record.filter_hz.is_some() {
            return None;
        }
        let position = record.position.as_deref()?;
        let factor = libm::round(record.rate_hz / machine.compared_hz(record)).max(1.0) as usize;
        let samples = record.drive.len();
        let from = (libm::ceil(SETTLING_S * record.rate_hz) as usize).min(samples / 4);
        let end = libm::ceil(MOST_SHIFT_S * record.rate_hz) as usize;
        let to = samples.checked_sub(end)?;
        if to < from + LEAST_AVERAGES * factor {
            return None;
        }
        Some(Self { record, position, factor, from, to })
    }

    /// A signal at the recording's rate, averaged.
    pub(super) fn averaged(&self, signal: &[f64]) -> Vec<f64> {
        let mean = |chunk: &[f64]| chunk.iter().sum::<f64>() / self.factor as f64;
        signal[self.from..self.to].chunks_exact(self.factor).map(mean).collect()
    }

    /// Time of the averages from the middle of the recording, in halves of its length.
    pub(super) fn course(&self) -> Vec<f64> {
        let count = (self.to - self.from) / self.factor;
        let half = 0.5 * count as f64;
        (0..count).map(|n| (n as f64 + 0.5 - half) / half).collect()
    }

    /// Samples that are compared.
    pub(super) fn kept(&self) -> core::ops::Range<usize> {
        self.from..self.to
    }

    pub(super) fn rate_hz(&self) -> f64 {
        self.record.rate_hz
    }
}

/// A signal as it was a time before each sample, straight between samples and constant beyond.
pub(super) fn shifted(signal: &[f64], rate_hz: f64, later_s: f64) -> Vec<f64> {
    let last = signal.len().saturating_sub(1);
    let shift = later_s * rate_hz;
    let at = |n: usize| {
        let place = (n as f64 - shift).clamp(0.0, last as f64);
        let before = place as usize;
        let next = signal[(before + 1).min(last)];
        signal[before] + (next - signal[before]) * (place - before as f64)
    };
    (0..signal.len()).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shift_moves_a_signal_by_parts_of_a_sample() {
        let ramp: Vec<f64> = (0..10).map(f64::from).collect();
        let later = shifted(&ramp, 1000.0, 2.5e-3);
        assert_eq!((later[0], later[5], later[9]), (0.0, 2.5, 6.5));
        assert_eq!(shifted(&ramp, 1000.0, -1e-3)[3], 4.0);
    }
}
