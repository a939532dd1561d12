//! The one source of chance: a named generator, one stream per purpose.

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

use crate::normal::quantile;

/// Purpose of a stream of random numbers; adding draws to one moves no other.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Purpose {
    Design,
    Scramble,
    Starts,
    Candidates,
    Fantasies,
    Population,
}

/// A seeded stream of uniform and normal numbers.
#[derive(Clone, Debug)]
pub(crate) struct Stream(ChaCha8Rng);

impl Stream {
    /// The stream of `purpose` and `index` under `seed`.
    pub(crate) fn new(seed: u64, purpose: Purpose, index: u64) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream((purpose as u64) << 48 | index);
        Self(generator)
    }

    /// A number in `[0, 1)` with 53 random bits.
    pub(crate) fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// 64 random bits, to seed the generator of a library.
    #[cfg(feature = "swarm")]
    pub(crate) fn word(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// 32 random bits.
    pub(crate) fn bits(&mut self) -> u32 {
        self.0.next_u32()
    }

    /// A number in `[from, to)`.
    pub(crate) fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.uniform()
    }

    /// An index below `n`.
    pub(crate) fn index(&mut self, n: usize) -> usize {
        ((self.uniform() * n as f64) as usize).min(n - 1)
    }

    /// A standard normal number, by inversion: one draw each.
    pub(crate) fn normal(&mut self) -> f64 {
        let half_step = 0.5 / (1_u64 << 53) as f64;
        quantile(self.uniform() + half_step)
    }

    /// A random order of `0..n`.
    pub(crate) fn permutation(&mut self, n: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..n).collect();
        for i in (1..n).rev() {
            order.swap(i, self.index(i + 1));
        }
        order
    }
}
