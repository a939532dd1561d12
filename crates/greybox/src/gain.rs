//! Gain in likelihood on recordings that were not fitted, and how sure it is.

use inference::Whitener;

use crate::{
    gram::dot,
    problem::{PerRecord, Prepared, Problem},
};

/// Length of the blocks whose likelihoods are compared, s.
const BLOCK_S: f64 = 0.5;

/// Standard errors below what is expected of a rival that what cannot speak may show by chance.
const MUTE_STD_ERRORS: f64 = 2.0;
/// Standard errors below what is expected of a rival that refute it.
const REFUTING_STD_ERRORS: f64 = 3.0;
/// Nats that it may lose at most, however much it scatters: the least of `E/2 − c·√E`.
const MOST_MUTE_LOSS: f64 = 0.5 * MUTE_STD_ERRORS * MUTE_STD_ERRORS;

/// A stretch of a recording that was not fitted.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    /// Residual through the noise with which the others were fitted.
    pub(crate) white: Vec<f64>,
    pub(crate) log_likelihood: f64,
    /// Size of the residual held out that the likelihood goes by, over that noise.
    pub(crate) size: f64,
}

impl Block {
    fn over(&self, other: &Self) -> Share {
        let apart = self.white.iter().zip(&other.white).map(|(a, b)| (a - b) * (a - b));
        let energy = apart.sum();
        let mean_square = dot(&self.white, &self.white) / self.white.len().max(1) as f64;
        let nats = self.log_likelihood - other.log_likelihood;
        Share::new(nats, energy, mean_square, self.size * other.size)
    }
}

/// Gain of a block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Share {
    nats: f64,
    /// Energy of the difference of the two predictions.
    energy: f64,
    /// Variance that noise of the size seen there gives the gain.
    noise: f64,
}

impl Share {
    /// By the energy of the difference of two predictions, the mean square of what the first leaves,
    /// and the product of the sizes of their noise.
    pub(crate) fn new(nats: f64, energy: f64, mean_square: f64, sizes: f64) -> Self {
        Self { nats, energy, noise: energy * mean_square.max(1.0) / (sizes * sizes) }
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
    /// Gain of one explanation over another, block by block.
    pub(crate) fn over(this: &[Block], other: &[Block]) -> Self {
        let pairs = this.iter().zip(other);
        Self::of(&pairs.map(|(this, other)| this.over(other)).collect::<Vec<_>>())
    }

    /// Sum of the gains of blocks. Those in which the predictions differ more are expected to gain
    /// more: the standard error is that of the scatter about a line over the energy (after Vuong
    /// 1989, Diebold and Mariano 1995), and never less than the noise alone makes it, as large as
    /// it is where the predictions differ.
    pub(crate) fn of(blocks: &[Share]) -> Self {
        let n = blocks.len() as f64;
        let sum = |of: &dyn Fn(&Share) -> f64| blocks.iter().map(of).sum::<f64>();
        let (nats, energy) = (sum(&|b| b.nats), sum(&|b| b.energy));
        let (gain, apart) = (nats / n.max(1.0), energy / n.max(1.0));
        let spread = sum(&|b| (b.energy - apart) * (b.energy - apart));
        let common = sum(&|b| (b.energy - apart) * (b.nats - gain));
        let slope = if spread > 0.0 { common / spread } else { 0.0 };
        let off = |b: &Share| b.nats - gain - slope * (b.energy - apart);
        let scatter = sum(&|b| off(b) * off(b)) * n / (n - 2.0).max(1.0);
        Self { nats, std_error: libm::sqrt(scatter.max(sum(&|b| b.noise))), energy }
    }

    /// Tells whether it is above zero by so many standard errors.
    pub(crate) fn is_sure(&self, std_errors: f64) -> bool {
        self.nats > std_errors * self.std_error
    }

    /// Logarithm of a chance by what was fitted and this gain together: a chance over an
    /// independent likelihood ratio is a chance again.
    ///
    /// # Source
    ///
    /// Ignatiadis, Wang and Ramdas 2024.
    pub(crate) fn log_chance_with(&self, log_p: f64) -> f64 {
        log_p - self.nats
    }

    /// Tells whether it speaks for the first prediction and is no less than is expected where that is
    /// right, but for so many standard errors that they would refute it.
    pub(crate) fn is_as_expected(&self) -> bool {
        let least = 0.5 * self.energy - REFUTING_STD_ERRORS * self.std_error;
        self.nats > least.max(0.0)
    }

    /// Tells whether the two predictions differ by too little to be told apart by so many standard
    /// errors, and the gain is what is expected of the first.
    pub(crate) fn is_mute(&self, std_errors: f64) -> bool {
        let expected = 0.5 * self.energy;
        let least = (expected - MUTE_STD_ERRORS * self.std_error).max(-MOST_MUTE_LOSS);
        expected < std_errors * self.std_error && self.nats > least
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

    use super::*;
    use crate::random::normal;

    fn share(nats: f64, energy: f64) -> Share {
        Share { nats, energy, noise: energy }
    }

    /// Blocks of the prediction that is right and of one that is off by so much energy in each,
    /// under noise of a size in each.
    fn drawn(blocks: &[(f64, f64)], random: &mut ChaCha8Rng) -> Gain {
        let samples = 50;
        let (mut right, mut wrong) = (Vec::new(), Vec::new());
        for (energy, size) in blocks {
            let off = libm::sqrt(energy / f64::from(samples));
            let white: Vec<f64> = (0..samples).map(|_| size * normal(random)).collect();
            let moved: Vec<f64> = white.iter().map(|z| z + off).collect();
            let log_likelihood = |white: &[f64]| -0.5 * dot(white, white);
            right.push(Block { log_likelihood: log_likelihood(&white), white, size: 1.0 });
            wrong.push(Block { log_likelihood: log_likelihood(&moved), white: moved, size: 1.0 });
        }
        Gain::over(&right, &wrong)
    }

    #[test]
    fn what_shows_in_few_blocks_counts_whole() {
        let quiet = [0.1, -0.2, 0.0, 0.1].map(|nats| share(nats, 0.0));
        let gain = Gain::of(&[&quiet[..], &[share(36.0, 72.0)]].concat());
        assert!((gain.nats - 36.0).abs() < 1e-12 && gain.is_sure(2.0), "{gain:?}");
    }

    #[test]
    fn a_single_block_is_no_surer_than_noise_lets_it_be() {
        let gain = Gain::of(&[share(3.0, 9.0)]);
        assert_eq!(gain.std_error, 3.0);
        assert!(!gain.is_sure(1.0));
    }

    /// The standard error is that of many draws, whether blocks differ or not, and whether one is
    /// noisier where the predictions differ.
    #[test]
    fn law_the_standard_error_is_that_of_the_noise() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let even = vec![(4.0, 1.0); 12];
        let steep = (0..12).map(|n| (f64::from(n * n), 1.0)).collect();
        let burst = (0..12).map(|n| if n == 5 { (16.0, 3.0) } else { (0.0, 1.0) }).collect();
        for blocks in [even, steep, burst] {
            let variance: f64 = blocks.iter().map(|(energy, size)| energy * size * size).sum();
            let draws: Vec<Gain> = (0..400).map(|_| drawn(&blocks, &mut random)).collect();
            let mean = draws.iter().map(|g| g.std_error).sum::<f64>() / 400.0;
            let ratio = mean / libm::sqrt(variance);
            assert!((0.95..1.3).contains(&ratio), "{ratio} {blocks:?}");
            let within = draws.iter().filter(|g| (g.nats - 0.5 * g.energy).abs() < g.std_error);
            let within = within.count();
            assert!((250..340).contains(&within), "{within} {blocks:?}");
        }
    }

    #[test]
    fn noise_of_a_heavier_kind_is_less_sure() {
        let calm = vec![share(2.0, 4.0); 10];
        let mut wild = calm.clone();
        (wild[2].nats, wild[7].nats) = (-20.0, 24.0);
        assert!(Gain::of(&wild).std_error > 4.0 * Gain::of(&calm).std_error);
    }

    /// A gain of the truth is refused once in some hundred draws, one of the wrong prediction passes as
    /// seldom.
    #[test]
    fn law_what_is_right_gains_as_expected_and_what_is_wrong_does_not() {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let blocks = vec![(2.5, 1.0); 12];
        let draws: Vec<Gain> = (0..1000).map(|_| drawn(&blocks, &mut random)).collect();
        let right = draws.iter().filter(|gain| gain.is_as_expected()).count();
        assert!(right >= 985, "{right}");
        let against = |gain: &Gain| Gain { nats: -gain.nats, ..*gain };
        let wrong = draws.iter().map(against).filter(Gain::is_as_expected).count();
        assert!(wrong <= 15, "{wrong}");
        // more than three standard errors below 72 nats
        assert!(!Gain { nats: 30.0, std_error: 12.0, energy: 144.0 }.is_as_expected());
    }

    #[test]
    fn mute_is_what_differs_too_little_and_gains_what_it_should() {
        assert!(Gain::of(&[share(0.0, 1.0), share(0.1, 1.0)]).is_mute(2.0));
        // three standard errors below what is expected
        assert!(!Gain::of(&[share(-2.0, 1.0), share(-2.0, 3.0)]).is_mute(2.0));
        assert!(!Gain::of(&[share(4.0, 10.0), share(4.0, 10.0)]).is_mute(2.0));
        // as much, but blocks scatter by more than noise alone makes them
        assert!(Gain::of(&[share(10.0, 10.0), share(-2.0, 10.0), share(0.0, 0.0)]).is_mute(2.0));
        // a loss in one block is no scatter that excuses it
        let lost = [vec![share(0.0, 10.0); 9], vec![share(-60.0, 10.0)]].concat();
        assert!(Gain::of(&lost).std_error > 25.0 && !Gain::of(&lost).is_mute(2.0));
    }
}
