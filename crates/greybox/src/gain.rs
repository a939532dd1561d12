//! Gain in likelihood on recordings that were not fitted, and how sure it is.

use crate::{
    noise::Whitener,
    problem::{PerRecord, Prepared, Problem},
};

/// Length of the blocks whose likelihoods are compared, s.
const BLOCK_S: f64 = 0.5;

/// Standard errors below what is expected of a rival that what cannot speak may show by chance.
const MUTE_STD_ERRORS: f64 = 2.0;

/// A stretch of a recording that was not fitted.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    /// Residual through the noise with which the others were fitted.
    pub(crate) white: Vec<f64>,
    pub(crate) log_likelihood: f64,
}

impl Block {
    /// Gain over another explanation, and the energy of the difference of their predictions.
    fn over(&self, other: &Self) -> (f64, f64) {
        let apart = self.white.iter().zip(&other.white).map(|(a, b)| (a - b) * (a - b));
        (self.log_likelihood - other.log_likelihood, apart.sum())
    }
}

/// Samples of a block.
pub(crate) fn block_length(prepared: &Prepared<'_>) -> usize {
    (libm::round(BLOCK_S * prepared.rate_hz()) as usize).max(1)
}

/// Residuals of recordings through the noise, in blocks.
pub(crate) fn in_blocks(
    problem: &Problem<'_>,
    residuals: &PerRecord,
    noise: &Whitener,
) -> Vec<Vec<f64>> {
    let of = |(prepared, residual): (&Prepared<'_>, &Vec<f64>)| -> Vec<Vec<f64>> {
        let white = noise.apply(residual);
        white.chunks(block_length(prepared)).map(<[f64]>::to_vec).collect()
    };
    problem.records.iter().zip(residuals).flat_map(of).collect()
}

/// Gain in log-likelihood on what was not fitted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gain {
    pub(crate) nats: f64,
    pub(crate) std_error: f64,
    /// Energy of the difference between the two predictions in units of the noise: where one of
    /// them is right, the gain is half of it, give or take its root.
    pub(crate) energy: f64,
}

impl Gain {
    /// Of one explanation over another, block by block.
    pub(crate) fn over(this: &[Block], other: &[Block]) -> Self {
        let pairs = this.iter().zip(other);
        Self::of(&pairs.map(|(this, other)| this.over(other)).collect::<Vec<_>>())
    }

    /// Of the gains of blocks and the energies by which their predictions differ. Blocks in which
    /// they differ more are expected to gain more: the standard error is that of the scatter about
    /// a line over the energy (after Vuong 1989, Diebold and Mariano 1995), and never less than
    /// the noise alone makes it.
    fn of(blocks: &[(f64, f64)]) -> Self {
        let n = blocks.len() as f64;
        let sum = |of: &dyn Fn(&(f64, f64)) -> f64| blocks.iter().map(of).sum::<f64>();
        let (nats, energy) = (sum(&|b| b.0), sum(&|b| b.1));
        let (gain, apart) = (nats / n.max(1.0), energy / n.max(1.0));
        let spread = sum(&|b| (b.1 - apart) * (b.1 - apart));
        let common = sum(&|b| (b.1 - apart) * (b.0 - gain));
        let slope = if spread > 0.0 { common / spread } else { 0.0 };
        let off = |b: &(f64, f64)| b.0 - gain - slope * (b.1 - apart);
        let scatter = sum(&|b| off(b) * off(b)) * n / (n - 2.0).max(1.0);
        Self { nats, std_error: libm::sqrt(scatter.max(energy)), energy }
    }

    /// Whether it is above zero by so many standard errors.
    pub(crate) fn is_sure(&self, std_errors: f64) -> bool {
        self.nats > std_errors * self.std_error
    }

    /// Whether the two predictions differ by too little to be told apart by so many standard
    /// errors, and the gain is what is expected of the first.
    pub(crate) fn is_mute(&self, std_errors: f64) -> bool {
        let least = 0.5 * self.energy - MUTE_STD_ERRORS * libm::sqrt(self.energy);
        self.energy < 4.0 * std_errors * std_errors && self.nats > least
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

    use super::*;
    use crate::random::normal;

    /// Gains of blocks under noise alone: the prediction that is right over one that is off by so
    /// much energy in each.
    fn drawn(energies: &[f64], random: &mut ChaCha8Rng) -> Vec<(f64, f64)> {
        let of = |&energy: &f64| (0.5 * energy + libm::sqrt(energy) * normal(random), energy);
        energies.iter().map(of).collect()
    }

    #[test]
    fn what_shows_in_few_blocks_counts_whole() {
        let mut blocks = vec![(0.1, 0.0), (-0.2, 0.0), (0.0, 0.0), (0.1, 0.0)];
        blocks.push((36.0, 72.0));
        let gain = Gain::of(&blocks);
        assert!((gain.nats - 36.0).abs() < 1e-12 && gain.is_sure(2.0), "{gain:?}");
    }

    #[test]
    fn a_single_block_is_no_surer_than_noise_lets_it_be() {
        let gain = Gain::of(&[(3.0, 9.0)]);
        assert_eq!(gain.std_error, 3.0);
        assert!(!gain.is_sure(1.0));
    }

    /// The standard error is that of many draws, whether blocks differ or not.
    #[test]
    fn law_the_standard_error_is_that_of_the_noise() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        for energies in [vec![4.0; 12], (0..12).map(|n| f64::from(n * n)).collect()] {
            let expected = libm::sqrt(energies.iter().sum());
            let draws: Vec<Gain> =
                (0..400).map(|_| Gain::of(&drawn(&energies, &mut random))).collect();
            let mean = draws.iter().map(|g| g.std_error).sum::<f64>() / 400.0;
            assert!((1.0..1.25).contains(&(mean / expected)), "{mean} of {expected}");
            let within = draws.iter().filter(|g| (g.nats - 0.5 * g.energy).abs() < g.std_error);
            assert!((240..330).contains(&within.count()));
        }
    }

    #[test]
    fn noise_of_a_heavier_kind_is_less_sure() {
        let calm: Vec<(f64, f64)> = (0..10).map(|_| (2.0, 4.0)).collect();
        let mut wild = calm.clone();
        (wild[2].0, wild[7].0) = (-20.0, 24.0);
        assert!(Gain::of(&wild).std_error > 4.0 * Gain::of(&calm).std_error);
    }

    #[test]
    fn mute_is_what_differs_too_little_and_gains_what_it_should() {
        assert!(Gain::of(&[(0.0, 1.0), (0.1, 1.0)]).is_mute(2.0));
        // three standard errors below what is expected
        assert!(!Gain::of(&[(-2.0, 1.0), (-2.0, 3.0)]).is_mute(2.0));
        assert!(!Gain::of(&[(4.0, 10.0), (4.0, 10.0)]).is_mute(2.0));
    }
}
