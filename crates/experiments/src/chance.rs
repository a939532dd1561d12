//! Random numbers of a hidden machine or recording.

use core::f64::consts::TAU;

use fdi_core::{Purpose, RootSeed};

/// Standard deviations beyond which nothing is drawn.
const FARTHEST: f64 = 2.5;

/// A stream of random numbers; equal seeds give equal streams.
pub(crate) struct Chance {
    root: RootSeed,
    drawn: u64,
}

impl Chance {
    pub(crate) fn new(seed: u64) -> Self {
        Self { root: RootSeed(seed), drawn: 0 }
    }

    /// Uniform on `[0, 1)`.
    pub(crate) fn uniform(&mut self) -> f64 {
        self.drawn += 1;
        (self.root.derive(Purpose::Units, self.drawn) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Standard normal, within [`FARTHEST`].
    pub(crate) fn normal(&mut self) -> f64 {
        loop {
            let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
            let value = radius * (TAU * self.uniform()).cos();
            if value.abs() <= FARTHEST {
                return value;
            }
        }
    }

    /// A whole number of a range, each as likely.
    pub(crate) fn whole(&mut self, from: core::ops::RangeInclusive<usize>) -> usize {
        let count = from.end() - from.start() + 1;
        from.start() + (self.uniform() * count as f64) as usize
    }
}
