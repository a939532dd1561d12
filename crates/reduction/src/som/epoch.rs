//! One presentation of all samples.

#![expect(
    clippy::inline_always,
    reason = "a closure is compiled for a vector unit with what is inlined into it"
)]

use super::{Grid, kernel::Weights};

/// Moves the weights after each sample of `queue`; `shares` are `α·h_lj`.
#[inline(always)]
pub(super) fn online_epoch(
    weights: &mut Weights,
    samples: &[f64],
    features: usize,
    (queue, shares): (&[usize], &[f64]),
) {
    let padded = weights.padded();
    for &index in queue {
        let sample = &samples[index * features..(index + 1) * features];
        let winner = weights.winner(sample);
        weights.pull(sample, &shares[winner * padded..(winner + 1) * padded]);
    }
}

/// Moves the weights once, to the weighted means; `shares` are `h_lj`.
#[inline(always)]
pub(super) fn batch_epoch(
    weights: &mut Weights,
    samples: &[f64],
    features: usize,
    (grid, shares): (Grid, &[f64]),
) {
    let neurons = grid.neurons();
    let mut sums = vec![0.0; neurons * features];
    let mut counts = vec![0.0; neurons];
    for sample in samples.chunks_exact(features) {
        let winner = weights.winner(sample);
        counts[winner] += 1.0;
        for (sum, value) in sums[winner * features..(winner + 1) * features].iter_mut().zip(sample)
        {
            *sum += value;
        }
    }
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
