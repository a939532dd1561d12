//! Covariances of very few residuals, shrunk towards a stationary correlation.

use crate::{
    banded::BandedMatrix,
    taper::{gaspari_cohn, tapered_covariance},
};

/// Share of the support on either side over which a variance is local.
const LOCAL_SHARE: f64 = 0.25;
/// Share of the support on either side over which it is told how far to shrink.
const WEIGHED_SHARE: f64 = 0.5;

/// Covariance of residuals of mean zero, of which so many are `free`, shrunk where so few say less
/// than all their samples together.
///
/// ```text
/// V = A·Ŝ·A + B·T·B,   T_ij = s_i·s_j·ρ(|i − j|),   A² + B² = I
/// A_i² = 1 − Σ var Ŝ / Σ (Ŝ − T)²,   var Ŝ_ij = t²·(C_ij² + C_ii·C_jj)/free,   C = T/t
/// ```
///
/// with the [`tapered_covariance`] `Ŝ` of the residuals, its taper `t`, the root mean square `s` of all
/// residuals about a sample and the correlation `ρ` of residuals over `s` at each lag, tapered. The
/// sums are over rows about `i`, and `A` is between 0 and 1: where residuals are as loud and as long
/// remembered as elsewhere `T` is what they show, where they are not `Ŝ`.
///
/// # Source
///
/// Linear shrinkage by the variance of the estimate: Ledoit and Wolf, J. Multivar. Anal. 88 (2004),
/// here for each row about its own target.
///
/// # Panics
///
/// When a residual is shorter than the first.
pub fn shrunk_covariance<R: AsRef<[f64]>>(
    residuals: &[R],
    support: usize,
    free: f64,
) -> BandedMatrix {
    let mut covariance = tapered_covariance(residuals, support);
    covariance.scale(residuals.len() as f64 / free);
    let order = covariance.order();
    if order == 0 || residuals.len() < 2 {
        return covariance;
    }
    let target = Target::of(residuals, support, free);
    let kept = kept(&covariance, &target, support, free);
    for i in 0..order {
        for j in i.saturating_sub(covariance.half_band())..=i {
            let own = libm::sqrt(kept[i] * kept[j]);
            let other = libm::sqrt((1.0 - kept[i]) * (1.0 - kept[j]));
            let value = covariance.at_mut(i, j);
            *value = own * *value + other * target.at(i, j);
        }
    }
    covariance
}

/// Share of each row that is kept, between 0 and 1.
fn kept(covariance: &BandedMatrix, target: &Target, support: usize, free: f64) -> Vec<f64> {
    let order = covariance.order();
    let (mut noise, mut apart) = (vec![0.0; order], vec![0.0; order]);
    for i in 0..order {
        for j in i.saturating_sub(covariance.half_band())..=i {
            let (mean, loud) = (target.at(i, j), target.rms[i] * target.rms[j]);
            let unmeant = target.taper[i - j] * loud;
            let off = covariance.at(i, j) - mean;
            noise[i] += (mean * mean + unmeant * unmeant) / free;
            apart[i] += off * off;
        }
    }
    let half = (WEIGHED_SHARE * support as f64) as usize;
    let sums = local_sums(&noise, half).into_iter().zip(local_sums(&apart, half));
    sums.map(|(noise, apart)| (1.0 - noise / apart.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0))
        .collect()
}

/// Stationary correlation with a variance that changes slowly.
struct Target {
    /// Root mean square about each sample.
    rms: Vec<f64>,
    /// Tapered correlation at each lag.
    correlation: Vec<f64>,
    taper: Vec<f64>,
}

impl Target {
    fn of<R: AsRef<[f64]>>(residuals: &[R], support: usize, free: f64) -> Self {
        let samples = residuals[0].as_ref().len();
        let square =
            |n: usize| residuals.iter().map(|r| r.as_ref()[n] * r.as_ref()[n]).sum::<f64>() / free;
        let squares: Vec<f64> = (0..samples).map(square).collect();
        let half = (LOCAL_SHARE * support as f64) as usize;
        let counts = local_sums(&vec![1.0; samples], half);
        let rms: Vec<f64> = local_sums(&squares, half)
            .iter()
            .zip(&counts)
            .map(|(sum, count)| libm::sqrt(sum / count).max(f64::MIN_POSITIVE))
            .collect();
        let over = |r: &R| r.as_ref().iter().zip(&rms).map(|(x, s)| x / s).collect();
        let even: Vec<Vec<f64>> = residuals.iter().map(over).collect();
        let product = |lag: usize| -> f64 {
            let of = |r: &Vec<f64>| -> f64 { r[lag..].iter().zip(r).map(|(a, b)| a * b).sum() };
            even.iter().map(of).sum()
        };
        let all = product(0).max(f64::MIN_POSITIVE);
        let lags = 0..support.max(1).min(samples);
        let taper: Vec<f64> =
            lags.map(|lag| gaspari_cohn(lag as f64 / support.max(1) as f64)).collect();
        let correlation =
            taper.iter().enumerate().map(|(lag, taper)| taper * product(lag) / all).collect();
        Self { rms, correlation, taper }
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.rms[i] * self.rms[j] * self.correlation[i - j]
    }
}

/// Sums of so many samples on either side of each.
fn local_sums(samples: &[f64], half: usize) -> Vec<f64> {
    let mut sums = vec![0.0];
    sums.extend(samples.iter().scan(0.0, |sum, x| {
        *sum += x;
        Some(*sum)
    }));
    let of = |n: usize| sums[samples.len().min(n + half + 1)] - sums[n.saturating_sub(half)];
    (0..samples.len()).map(of).collect()
}

#[cfg(test)]
mod tests {
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

    use super::*;
    use crate::random::normal;

    const SAMPLES: usize = 400;
    const SUPPORT: usize = 60;
    const REMEMBERED: f64 = 0.8;

    /// So many residuals of a first-order process, `loud` times as large in a stretch, less their mean.
    fn residuals(count: usize, loud: f64, random: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
        let mut draw = || -> Vec<f64> {
            let mut x = normal(random) / libm::sqrt(1.0 - REMEMBERED * REMEMBERED);
            let size = |n: usize| if (180..220).contains(&n) { loud } else { 1.0 };
            let mut next = |n: usize| {
                x = REMEMBERED * x + normal(random);
                size(n) * x
            };
            (0..SAMPLES).map(&mut next).collect()
        };
        let mut all: Vec<Vec<f64>> = (0..count).map(|_| draw()).collect();
        for n in 0..SAMPLES {
            let mean = all.iter().map(|r| r[n]).sum::<f64>() / count as f64;
            for r in &mut all {
                r[n] -= mean;
            }
        }
        all
    }

    /// Mean square of whitened residuals that the covariance was not told by, less one.
    fn excess(loud: f64, of: impl Fn(&[Vec<f64>], f64) -> BandedMatrix) -> f64 {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut covariance = of(&residuals(12, loud, &mut random), 11.0);
        covariance.add_to_diagonal(0.1);
        let factor = covariance.cholesky().expect("a positive definite matrix");
        let fresh = residuals(200, loud, &mut random);
        let white = fresh.into_iter().flat_map(|mut r| {
            factor.whiten(&mut r);
            r
        });
        let squares: Vec<f64> = white.map(|x| x * x).collect();
        squares.iter().sum::<f64>() / squares.len() as f64 - 1.0
    }

    /// Few residuals span few directions: in all others noise looks larger than it is. With noise
    /// that is alike throughout, and with a stretch five times as loud.
    #[test]
    fn law_what_few_residuals_do_not_show_is_not_taken_for_silence() {
        let plain = |residuals: &[Vec<f64>], free: f64| {
            let mut covariance = tapered_covariance(residuals, SUPPORT);
            covariance.scale(residuals.len() as f64 / free);
            covariance
        };
        let shrunk = |residuals: &[Vec<f64>], free| shrunk_covariance(residuals, SUPPORT, free);
        for loud in [1.0, 5.0] {
            let [plain, shrunk] = [excess(loud, plain), excess(loud, shrunk)];
            assert!(plain > 0.5 && shrunk < 0.3 * plain, "{loud}: {plain} {shrunk}");
        }
    }

    #[test]
    fn many_residuals_are_kept_as_they_are() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let residuals = residuals(2000, 5.0, &mut random);
        let plain = tapered_covariance(&residuals, SUPPORT);
        let shrunk = shrunk_covariance(&residuals, SUPPORT, 2000.0);
        let middle = |covariance: &BandedMatrix| covariance.at(200, 195);
        let ratio = middle(&shrunk) / middle(&plain);
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    }
}
