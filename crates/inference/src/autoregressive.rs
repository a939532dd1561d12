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
        let samples: usize = stretches.iter().map(|s| s.len()).sum();
        let shortest = stretches.iter().map(|s| s.len()).min().unwrap_or(0);
        let most = MOST_ORDER.min(shortest / 20);
        let n = samples.max(1) as f64;
        let covariance: Vec<f64> = (0..=most)
            .map(|lag| {
                let of = |s: &&[f64]| -> f64 { s.iter().zip(&s[lag..]).map(|(a, b)| a * b).sum() };
                stretches.iter().map(of).sum::<f64>() / n
            })
            .collect();
        if covariance[0] <= 0.0 {
            return Self::white(f64::MIN_POSITIVE);
        }
        let (mut variance, mut a) = (covariance[0], Vec::new());
        let (mut best, mut chosen) = (f64::INFINITY, (covariance[0], Vec::new()));
        for order in 0..=most {
            let criterion = n * libm::log(variance) + order as f64 * libm::log(n);
            if criterion < best {
                (best, chosen) = (criterion, (variance, a.clone()));
            }
            if order == most {
                break;
            }
            let ahead: f64 = a.iter().enumerate().map(|(i, x)| x * covariance[order - i]).sum();
            let reflection = (covariance[order + 1] - ahead) / variance;
            let mirrored: Vec<f64> = a.iter().rev().map(|x| reflection * x).collect();
            for (x, m) in a.iter_mut().zip(mirrored) {
                *x -= m;
            }
            a.push(reflection);
            variance *= 1.0 - reflection * reflection;
        }
        let correction = n / (n - parameters as f64).max(1.0);
        Self {
            coefficients: chosen.1,
            std: libm::sqrt(chosen.0 * correction).max(f64::MIN_POSITIVE),
        }
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
    fn another_model_of_the_same_noise_is_less_likely() {
        let noise = coloured(5000);
        let sum = |w: &Whitener| w.log_likelihoods(&noise, 250).iter().sum::<f64>();
        let right = Whitener::fit(&[&noise], 0);
        assert!(sum(&right) > sum(&Whitener::white(rms(&noise))) + 1000.0);
    }
}
