//! A recording as its equations are compared: averaged, without its start and its end.

use core::ops::Range;

use crate::{machine::Machine, record::Record};

/// Time left out at the start, where integrators are not known; as the comparison leaves it out.
const SETTLING_S: f64 = 0.3;
/// Largest shift looked for, s, and time left out at the end.
pub(super) const MOST_SHIFT_S: f64 = 0.025;
/// Fewest averages that are compared.
const LEAST_AVERAGES: usize = 40;
/// Length of the blocks whose scatter gives standard deviations, s.
pub(super) const BLOCK_S: f64 = 0.5;

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

    /// Averages in a block.
    pub(super) fn block(&self) -> usize {
        (libm::round(BLOCK_S * self.rate_hz() / self.factor as f64) as usize).max(1)
    }

    /// Blocks.
    pub(super) fn blocks(&self) -> f64 {
        ((self.to - self.from) as f64 / (BLOCK_S * self.rate_hz())).max(1.0)
    }

    /// Samples that are compared.
    pub(super) fn kept(&self) -> Range<usize> {
        self.from..self.to
    }

    pub(super) fn rate_hz(&self) -> f64 {
        self.record.rate_hz
    }
}
