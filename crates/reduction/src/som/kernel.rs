//! The two inner loops of the map, laid out for vector units.
//!
//! Weights lie feature after feature, the neurons of one feature side by side
//! and padded to a multiple of [`LANES`]. The sums of one neuron run over the
//! features in order whatever the width of the vector unit, and nothing is
//! contracted into fused operations, so that the same bits come out everywhere.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined is compiled for the vector unit that dispatch finds"
)]

/// Neurons that are worked on at a time.
const LANES: usize = 32;

/// Weights in the layout of the kernels.
pub(super) struct Weights {
    neurons: usize,
    padded: usize,
    values: Vec<f64>,
    distances: Vec<f64>,
}

impl Weights {
    /// Takes weights feature after feature, `neurons` of each.
    pub(super) fn new(neurons: usize, by_feature: &[f64]) -> Self {
        let padded = neurons.next_multiple_of(LANES);
        let mut values = vec![0.0; by_feature.len() / neurons * padded];
        for (to, from) in values.chunks_exact_mut(padded).zip(by_feature.chunks_exact(neurons)) {
            to[..neurons].copy_from_slice(from);
        }
        Self { neurons, padded, values, distances: vec![0.0; padded] }
    }

    /// Neurons and padding.
    pub(super) fn padded(&self) -> usize {
        self.padded
    }

    /// Gives the weights back, feature after feature.
    pub(super) fn by_feature(&self) -> Vec<f64> {
        self.values
            .chunks_exact(self.padded)
            .flat_map(|row| &row[..self.neurons])
            .copied()
            .collect()
    }

    /// Squared distances of `sample` to every neuron.
    #[inline(always)]
    pub(super) fn distances_squared(&mut self, sample: &[f64]) -> &[f64] {
        for (block, out) in self.distances.chunks_exact_mut(LANES).enumerate() {
            let mut sums = [0.0; LANES];
            for (row, &value) in self.values.chunks_exact(self.padded).zip(sample) {
                let (weights, _) = row.as_chunks::<LANES>();
                let weights = &weights[block];
                for lane in 0..LANES {
                    let difference = weights[lane] - value;
                    sums[lane] += difference * difference;
                }
            }
            out.copy_from_slice(&sums);
        }
        &self.distances[..self.neurons]
    }

    /// Nearest neuron, the first in a tie (FREEDOM paper, eq. 5).
    #[inline(always)]
    pub(super) fn winner(&mut self, sample: &[f64]) -> usize {
        let distances = self.distances_squared(sample);
        first_smallest(distances)
    }

    /// `w_j += h_j·(sample − w_j)` for every neuron.
    #[inline(always)]
    pub(super) fn pull(&mut self, sample: &[f64], shares: &[f64]) {
        let (shares, _) = shares.as_chunks::<LANES>();
        for (block, shares) in shares.iter().enumerate() {
            let shares = *shares;
            for (row, &value) in self.values.chunks_exact_mut(self.padded).zip(sample) {
                let (weights, _) = row.as_chunks_mut::<LANES>();
                let weights = &mut weights[block];
                for lane in 0..LANES {
                    weights[lane] += shares[lane] * (value - weights[lane]);
                }
            }
        }
    }
}

/// Index of the smallest value, the first in a tie.
#[inline(always)]
fn first_smallest(values: &[f64]) -> usize {
    let mut lanes = [f64::INFINITY; 8];
    let blocks = values.chunks_exact(8);
    let mut smallest = blocks
        .remainder()
        .iter()
        .fold(f64::INFINITY, |low, &value| if value < low { value } else { low });
    for block in blocks {
        for (low, &value) in lanes.iter_mut().zip(block) {
            *low = if value < *low { value } else { *low };
        }
    }
    for low in lanes {
        smallest = if low < smallest { low } else { smallest };
    }
    values.iter().position(|&value| value == smallest).unwrap_or(0)
}
