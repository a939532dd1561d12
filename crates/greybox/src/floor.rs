//! The noise that no model can explain: from repetitions of a recording, or from what is left
//! when everything that the catalogue can do is taken away.

use inference::{Whitener, rms};

use crate::{
    elsewhere::elsewhere,
    error::GreyboxError,
    problem::{PerRecord, Problem},
    record::{Record, Recordings},
    response::{orthonormal, without},
    structure::Structure,
};

/// Where the noise level is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NoiseSource {
    /// The difference of two recordings of the same command.
    Repeat,
    /// Rest of the residual beside all that the catalogue can do.
    Saturated,
    /// Noise and learnt error of the low-fidelity model.
    Learnt,
}

/// Level of the noise of the drive signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseFloor {
    /// Root mean square, A or V.
    pub rms: f64,
    /// Where it is from.
    pub source: NoiseSource,
}

/// Share of the noise that a residual has to exceed it by, so that there is a gap to close.
const LEAST_GAP_FRAC: f64 = 0.02;

impl NoiseFloor {
    /// Share of the gap between a residual and the noise that is closed, from the root mean square
    /// of the residual before and after, in the unit of [`rms`](Self::rms).
    ///
    /// ```text
    /// g = (r_0 − r_1)/(r_0 − n),   r_0 − n > 0.02·n
    /// ```
    ///
    /// with the residuals `r_0` before and `r_1` after and the noise `n`. It is negative where the
    /// residual rises and above 1 where it falls below the noise; `None` for a gap within 2 % of the
    /// noise, which is none. That bound is a choice of this project.
    pub fn closed_gap_frac(&self, [before, after]: [f64; 2]) -> Option<f64> {
        let gap = before - self.rms;
        (gap > LEAST_GAP_FRAC * self.rms).then(|| (before - after) / gap)
    }
}

/// Noise of the drive signal.
#[derive(Clone, Debug)]
pub(crate) struct Floor {
    pub(crate) source: NoiseSource,
    pub(crate) whitener: Whitener,
    pub(crate) rms: f64,
}

/// Pairs of places in `train` and `repeat` that are of one command.
pub(crate) fn pairs(recordings: &Recordings) -> Vec<(usize, usize)> {
    let of = |(place, repeat): (usize, &Record)| {
        let twin = recordings.train.iter().position(|train| train.repeats(repeat))?;
        Some((twin, place))
    };
    recordings.repeat.iter().enumerate().filter_map(of).collect()
}

impl Floor {
    /// Level and source, where noise of size one is so much in its own unit.
    pub(crate) fn level(&self, unit: f64) -> NoiseFloor {
        NoiseFloor { rms: unit * self.rms, source: self.source }
    }

    /// Root mean square of residuals over the noise. One burst decides nothing: samples far beyond the
    /// noise count less.
    pub(crate) fn times(&self, residuals: &PerRecord) -> f64 {
        let white: Vec<f64> = residuals.iter().flatten().map(|x| x / self.rms).collect();
        libm::sqrt(clipped_energy(&white))
    }

    /// From pairs of recordings; `None` without any.
    pub(crate) fn of_pairs(
        train: &Problem<'_>,
        repeat: &Problem<'_>,
        pairs: &[(usize, usize)],
    ) -> Option<Self> {
        let half = libm::sqrt(0.5);
        let differences: Vec<Vec<f64>> = pairs
            .iter()
            .map(|&(a, b)| {
                let pair = train.records[a].measured.iter().zip(&repeat.records[b].measured);
                pair.map(|(x, y)| (x - y) * half).collect()
            })
            .collect();
        if differences.is_empty() {
            return None;
        }
        let stretches: Vec<&[f64]> = differences.iter().map(Vec::as_slice).collect();
        let all: Vec<f64> = differences.iter().flatten().copied().collect();
        let whitener = Whitener::fit(&stretches, 0);
        Some(Self { source: NoiseSource::Repeat, whitener, rms: rms(&all) })
    }

    /// From a residual beside columns that may explain it.
    ///
    /// # Errors
    ///
    /// [`GreyboxError::FewSamples`], where the columns explain any residual of so few samples.
    pub(crate) fn of_saturated(
        residuals: &PerRecord,
        columns: &[&PerRecord],
    ) -> Result<Self, GreyboxError> {
        let joined: Vec<Vec<f64>> = columns.iter().map(|column| column.concat()).collect();
        let basis = orthonormal(joined);
        let samples = residuals.iter().map(Vec::len).sum();
        if basis.len() >= samples {
            return Err(GreyboxError::FewSamples { samples });
        }
        let rest = without(&basis, residuals.concat());
        let mut from = 0;
        let mut stretches = Vec::new();
        for residual in residuals {
            stretches.push(&rest[from..from + residual.len()]);
            from += residual.len();
        }
        let whitener = Whitener::fit(&stretches, basis.len());
        let n = rest.len() as f64;
        let level = rms(&rest) * libm::sqrt(n / (n - basis.len() as f64).max(1.0));
        Ok(Self { source: NoiseSource::Saturated, whitener, rms: level })
    }
}

/// How much more than noise is left of recordings that were repeated: the energy of the mean of
/// two residuals over that of half their difference, both whitened. A model that explains all
/// gives 1 within [`Excess::std`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Excess {
    pub(crate) ratio: f64,
    pub(crate) std: f64,
}

/// Samples beyond so many standard deviations count as so many: one burst decides nothing.
const MOST_DEVIATION: f64 = 3.5;

impl Excess {
    pub(crate) fn of_pairs(
        structure: &Structure,
        values: &[f64],
        residuals: &PerRecord,
        repeat: &Problem<'_>,
        pairs: &[(usize, usize)],
        whitener: &Whitener,
    ) -> Result<Option<Self>, GreyboxError> {
        if pairs.is_empty() {
            return Ok(None);
        }
        let repeated = elsewhere(repeat, structure, values, whitener)?;
        let (mut common, mut noise) = (Vec::new(), Vec::new());
        for &(a, b) in pairs {
            let pair = || residuals[a].iter().zip(&repeated[b]);
            let half = libm::sqrt(0.5);
            common.extend(whitener.apply(&pair().map(|(x, y)| (x + y) * half).collect::<Vec<_>>()));
            noise.extend(whitener.apply(&pair().map(|(x, y)| (x - y) * half).collect::<Vec<_>>()));
        }
        let level = clipped_energy(&noise);
        let ratio = clipped_energy(&common) / level;
        Ok(Some(Self { ratio, std: libm::sqrt(4.0 / noise.len() as f64) }))
    }

    /// Tells whether more than noise is left.
    pub(crate) fn is_there(self) -> bool {
        self.ratio > 1.02 + 3.0 * self.std
    }
}

/// Mean square with deviations clipped.
fn clipped_energy(white: &[f64]) -> f64 {
    let clipped = |z: &f64| {
        let z = z.clamp(-MOST_DEVIATION, MOST_DEVIATION);
        z * z
    };
    (white.iter().map(clipped).sum::<f64>() / white.len().max(1) as f64).max(f64::MIN_POSITIVE)
}

/// Time within which residuals may share what makes them large, s.
const SHARED_S: f64 = 0.1;

/// Standard deviation of the root mean square of residuals over itself ([`rms_std_of`]).
pub(crate) fn rms_std(problem: &Problem<'_>, residuals: &PerRecord) -> f64 {
    let pairs = problem.records.iter().zip(residuals);
    let blocks = pairs.flat_map(|(prepared, residual)| {
        residual.chunks((libm::round(SHARED_S * prepared.rate_hz()) as usize).max(1))
    });
    rms_std_of(&blocks.collect::<Vec<_>>())
}

/// Standard deviation of a root mean square over itself: of normal samples `√(1/2n)`, more where the
/// squares scatter more between blocks, as of outliers, bursts and what stands alike for a while.
fn rms_std_of(blocks: &[&[f64]]) -> f64 {
    let energies: Vec<f64> = blocks.iter().map(|block| block.iter().map(|x| x * x).sum()).collect();
    let samples = blocks.iter().map(|block| block.len()).sum::<usize>().max(1) as f64;
    let total: f64 = energies.iter().sum();
    let off = |(block, energy): (&&[f64], &f64)| energy - total * block.len() as f64 / samples;
    let scatter: f64 = blocks.iter().zip(&energies).map(off).map(|off| off * off).sum();
    let count = blocks.len() as f64;
    let of_blocks =
        scatter * count / f64::max(count - 1.0, 1.0) / (total * total).max(f64::MIN_POSITIVE);
    0.5 * libm::sqrt(of_blocks.max(2.0 / samples))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three samples are any three columns: what is left would be rounding and no noise.
    #[test]
    fn columns_as_many_as_samples_tell_no_noise() {
        let column = |values: [f64; 3]| vec![values.to_vec()];
        let residuals = column([1.0, -2.0, 0.5]);
        let columns = [column([1.0, 0.0, 0.0]), column([1.0, 1.0, 0.0]), column([1.0, 1.0, 1.0])];
        let all: Vec<&PerRecord> = columns.iter().collect();
        let told = Floor::of_saturated(&residuals, &all).map(|floor| floor.rms);
        assert_eq!(told, Err(GreyboxError::FewSamples { samples: 3 }));
        assert!(Floor::of_saturated(&residuals, &all[..2]).is_ok());
    }

    /// Where two of a hundred blocks hold all that there is, the mean square has a relative scatter of
    /// `√(100/99·98/200)`, by hand; blocks alike have that of normal samples.
    #[test]
    fn a_root_mean_square_of_bursts_is_known_less_well() {
        let (quiet, loud) = (vec![0.0; 50], vec![2.0; 50]);
        let mut blocks: Vec<&[f64]> = vec![&quiet; 98];
        blocks.extend([loud.as_slice(), &loud]);
        let by_hand = 0.5 * libm::sqrt(100.0 / 99.0 * 98.0 / 200.0);
        assert!((rms_std_of(&blocks) - by_hand).abs() < 1e-12, "{}", rms_std_of(&blocks));
        let alike = [loud.as_slice(); 100];
        assert_eq!(rms_std_of(&alike), libm::sqrt(0.5 / 5000.0));
    }

    #[test]
    fn a_gap_within_two_percent_of_the_noise_is_none() {
        let noise = NoiseFloor { rms: 1.0, source: NoiseSource::Repeat };
        assert_eq!(noise.closed_gap_frac([3.0, 2.0]), Some(0.5));
        assert_eq!(noise.closed_gap_frac([3.0, 4.0]), Some(-0.5));
        assert_eq!(noise.closed_gap_frac([1.01, 1.0]), None);
        assert_eq!(noise.closed_gap_frac([0.9, 0.8]), None);
    }
}
