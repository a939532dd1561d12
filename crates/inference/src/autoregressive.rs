//! Autoregressive noise: a model of it, and what the model leaves white.

/// Largest order tried.
const MOST_ORDER: usize = 15;

/// An autoregressive model of noise; it turns such noise into white noise of unit size.
///
/// ```text
/// e_t = Σ a_i·e_{t−i} + s·ε_t        (e_t − Σ a_i·e_{t−i})/s = ε_t
/// ```
///
/// # Source
///
/// Box, Jenkins and Reinsel, *Time Series Analysis* (Yule-Walker equations, Levinson's recursion).
#[derive(Clone, Debug, PartialEq)]
pub struct Whitener {
    coefficients: Vec<f64>,
    std: f64,
}

impl Whitener {
    /// White noise of a size.
    pub fn white(std: f64) -> Self {
        Self { coefficients: Vec::new(), std: std.max(f64::MIN_POSITIVE) }
    }

    /// Noise so many times as large.
    #[must_use]
    pub fn scaled(&self, ratio: f64) -> Self {
        let std = (ratio * self.std).max(f64::MIN_POSITIVE);
        Self { coefficients: self.coefficients.clone(), std }
    }

    /// The model of several stretches of one noise, its order by the Bayesian information
    /// criterion (Yule-Walker, Levinson's recursion).
    ///
    /// `parameters` numbers were fitted to the stretches before: the variance is larger by
    /// `n/(n − parameters)`.
    pub fn fit(stretches: &[&[f64]], parameters: usize) -> Self {
        let n = samples(stretches) as f64;
        let covariance = autocovariances(stretches);
        if covariance[0] <= 0.0 {
            return Self::white(f64::MIN_POSITIVE);
        }
        let (variance, coefficients) = by_autocovariances(&covariance, n);
        let correction = n / (n - parameters as f64).max(1.0);
        Self { coefficients, std: libm::sqrt(variance * correction).max(f64::MIN_POSITIVE) }
    }

    /// Order of the model: samples that [`apply`](Self::apply) uses up.
    pub fn order(&self) -> usize {
        self.coefficients.len()
    }

    /// Size of what is new in each sample.
    pub fn std(&self) -> f64 {
        self.std
    }

    /// The noise without its memory, of unit size; [`order`](Self::order) samples shorter.
    pub fn apply(&self, signal: &[f64]) -> Vec<f64> {
        let p = self.order();
        (p..signal.len())
            .map(|t| {
                let known: f64 =
                    self.coefficients.iter().enumerate().map(|(i, a)| a * signal[t - 1 - i]).sum();
                (signal[t] - known) / self.std
            })
            .collect()
    }

    /// Log-likelihood of noise, summed over blocks of so many samples; the last block may be
    /// shorter.
    pub fn log_likelihoods(&self, noise: &[f64], block: usize) -> Vec<f64> {
        let scale = libm::log(self.std) + 0.5 * libm::log(core::f64::consts::TAU);
        let white = self.apply(noise);
        let of = |z: &[f64]| z.iter().map(|z| -0.5 * z * z - scale).sum();
        white.chunks(block.max(1)).map(of).collect()
    }
}

/// Samples of all stretches.
fn samples(stretches: &[&[f64]]) -> usize {
    stretches.iter().map(|s| s.len()).sum::<usize>().max(1)
}

/// Autocovariances of stretches of one noise of mean zero, up to the largest order tried.
fn autocovariances(stretches: &[&[f64]]) -> Vec<f64> {
    let shortest = stretches.iter().map(|s| s.len()).min().unwrap_or(0);
    let n = samples(stretches) as f64;
    let of_lag = |lag| {
        let of = |s: &&[f64]| -> f64 { s.iter().zip(&s[lag..]).map(|(a, b)| a * b).sum() };
        stretches.iter().map(of).sum::<f64>() / n
    };
    (0..=MOST_ORDER.min(shortest / 20)).map(of_lag).collect()
}

/// Innovation variance and coefficients of the model of a noise of which so many samples have these
/// autocovariances.
fn by_autocovariances(covariance: &[f64], samples: f64) -> (f64, Vec<f64>) {
    let (mut variance, mut a) = (covariance[0], Vec::new());
    let (mut best, mut chosen) = (f64::INFINITY, (covariance[0], Vec::new()));
    for order in 0..covariance.len() {
        let criterion = samples * libm::log(variance) + order as f64 * libm::log(samples);
        if criterion < best {
            (best, chosen) = (criterion, (variance, a.clone()));
        }
        let Some(next) = covariance.get(order + 1) else { break };
        let ahead: f64 = a.iter().enumerate().map(|(i, x)| x * covariance[order - i]).sum();
        let reflection = (next - ahead) / variance;
        if reflection.abs() >= 1.0 {
            // autocovariances of no noise, as a difference of two may be
            break;
        }
        let mirrored: Vec<f64> = a.iter().rev().map(|x| reflection * x).collect();
        for (x, m) in a.iter_mut().zip(mirrored) {
            *x -= m;
        }
        a.push(reflection);
        variance *= 1.0 - reflection * reflection;
    }
    chosen
}

/// Least share of a noise that is left when a part is taken off it.
const LEAST_LEFT: f64 = 0.1;

/// Log-likelihood that a noise would have without an independent part, under the autoregressive
/// model of what is left.
///
/// ```text
/// ℓ = −(n/2)·(ln 2πs² + 1),   s² the innovation variance of γ_noise − w·γ_part
/// ```
///
/// with autocovariances γ. Of the part there are other stretches, in which it has `1/w` of the
/// variance that it has in the noise; none for a noise as it is.
pub fn log_likelihood_without(noise: &[&[f64]], part: &[&[f64]], w: f64) -> f64 {
    let n = samples(noise) as f64;
    let mut left = autocovariances(noise);
    let least = (LEAST_LEFT * left[0]).max(f64::MIN_POSITIVE);
    if !part.is_empty() {
        for (own, part) in left.iter_mut().zip(autocovariances(part)) {
            *own -= w * part;
        }
    }
    left[0] = left[0].max(least);
    let (variance, _) = by_autocovariances(&left, n);
    -0.5 * n * (libm::log(core::f64::consts::TAU * variance) + 1.0)
}

/// Root mean square.
pub fn rms(signal: &[f64]) -> f64 {
    libm::sqrt(signal.iter().map(|x| x * x).sum::<f64>() / signal.len().max(1) as f64)
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    use super::*;
    use crate::random::normal;

    fn coloured(samples: usize) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let (mut last, mut noise) = (0.0, Vec::new());
        for _ in 0..samples {
            last = 0.8 * last + 0.3 * normal(&mut random);
            noise.push(last);
        }
        noise
    }

    #[test]
    fn the_model_of_a_noise_is_found_and_whitens_it() {
        let noise = coloured(20_000);
        let model = Whitener::fit(&[&noise], 0);
        assert!((model.coefficients[0] - 0.8).abs() < 0.02, "{model:?}");
        assert!((model.std() - 0.3).abs() < 0.01, "{model:?}");
        let white = model.apply(&noise);
        assert_abs_diff_eq!(rms(&white), 1.0, epsilon = 0.02);
        let lagged: f64 = white.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / 20_000.0;
        assert_abs_diff_eq!(lagged, 0.0, epsilon = 0.02);
    }

    #[test]
    fn a_part_that_is_known_apart_is_taken_off() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let white: Vec<f64> = (0..20_000).map(|_| 0.5 * normal(&mut random)).collect();
        let part = coloured(20_000);
        let both: Vec<f64> = white.iter().zip(&part).map(|(w, p)| w + p).collect();
        // the same part, of twice the variance
        let others: Vec<f64> = part.iter().rev().map(|p| core::f64::consts::SQRT_2 * p).collect();
        let alone = log_likelihood_without(&[&white], &[], 0.0);
        let without = log_likelihood_without(&[&both], &[&others], 0.5);
        let with = log_likelihood_without(&[&both], &[], 0.0);
        assert!(
            (without - alone).abs() < 400.0 && alone - with > 2000.0,
            "{alone} {without} {with}"
        );
        let own = Whitener::fit(&[&white], 0).log_likelihoods(&white, usize::MAX)[0];
        assert!((alone - own).abs() < 1.0, "{alone} {own}");
    }

    #[test]
    fn another_model_of_the_same_noise_is_less_likely() {
        let noise = coloured(5000);
        let sum = |w: &Whitener| w.log_likelihoods(&noise, 250).iter().sum::<f64>();
        let right = Whitener::fit(&[&noise], 0);
        assert!(sum(&right) > sum(&Whitener::white(rms(&noise))) + 1000.0);
    }
}
