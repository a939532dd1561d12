//! One presentation of all samples, compiled for the widest vector unit that the
//! machine has.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined is compiled for the vector unit that dispatch finds"
)]

use pulp::{Arch, Simd, WithSimd};

use super::{Grid, kernel::Weights};

/// Samples one after another, each of some features.
#[derive(Clone, Copy)]
pub(super) struct Samples<'a> {
    pub(super) values: &'a [f64],
    pub(super) features: usize,
}

/// Moves the weights after each sample of `queue`; `shares` are `α·h_lj`.
pub(super) struct OnlineEpoch<'a> {
    pub(super) weights: &'a mut Weights,
    pub(super) samples: Samples<'a>,
    pub(super) queue: &'a [usize],
    pub(super) shares: &'a [f64],
}

impl OnlineEpoch<'_> {
    pub(super) fn run(self) {
        Arch::new().dispatch(self);
    }
}

impl WithSimd for OnlineEpoch<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Samples { values, features } = self.samples;
        let padded = self.weights.padded();
        for &index in self.queue {
            let sample = &values[index * features..(index + 1) * features];
            let winner = self.weights.winner(sample);
            self.weights.pull(sample, &self.shares[winner * padded..(winner + 1) * padded]);
        }
    }
}

/// Sums the samples that each neuron wins, and counts them.
struct Assignment<'a> {
    weights: &'a mut Weights,
    samples: Samples<'a>,
    sums: &'a mut [f64],
    counts: &'a mut [f64],
}

impl WithSimd for Assignment<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Samples { values, features } = self.samples;
        for sample in values.chunks_exact(features) {
            let winner = self.weights.winner(sample);
            self.counts[winner] += 1.0;
            let sums = &mut self.sums[winner * features..(winner + 1) * features];
            for (sum, value) in sums.iter_mut().zip(sample) {
                *sum += value;
            }
        }
    }
}

/// Moves the weights once, to the weighted means; `shares` are `h_lj`.
pub(super) fn batch_epoch(weights: &mut Weights, samples: Samples<'_>, grid: Grid, shares: &[f64]) {
    let (neurons, features) = (grid.neurons(), samples.features);
    let mut sums = vec![0.0; neurons * features];
    let mut counts = vec![0.0; neurons];
    let (sums_mut, counts_mut) = (&mut sums, &mut counts);
    Arch::new().dispatch(Assignment { weights, samples, sums: sums_mut, counts: counts_mut });
    let padded = weights.padded();
    let mut moved = weights.by_feature();
    for neuron in 0..neurons {
        let share = |winner: usize| shares[winner * padded + neuron];
        let total: f64 = (0..neurons).map(|winner| share(winner) * counts[winner]).sum();
        if total > 0.0 {
            for feature in 0..features {
                let sum: f64 = (0..neurons)
                    .map(|winner| share(winner) * sums[winner * features + feature])
                    .sum();
                moved[feature * neurons + neuron] = sum / total;
            }
        }
    }
    *weights = Weights::new(neurons, &moved);
}
