//! Chances of sums of squares: the tail of the chi-squared distribution and what rests on it.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Sum from which the tail is taken by its asymptote: there the distribution's own underflows.
const ASYMPTOTIC_FROM: f64 = 500.0;
/// Lags of the whiteness test.
const LAGS: usize = 20;

/// Logarithm of the chance that a chi-squared sum exceeds a value.
///
/// # Examples
///
/// ```
/// let ln_chance = inference::chi_squared_log_tail(3.841_458_820_694_124, 1);
/// assert!((ln_chance.exp() - 0.05).abs() < 1e-9);
/// ```
pub fn chi_squared_log_tail(sum: f64, degrees: usize) -> f64 {
    if sum.is_nan() || sum <= 0.0 || degrees == 0 {
        return 0.0;
    }
    let d = degrees as f64;
    if sum < ASYMPTOTIC_FROM
        && let Ok(distribution) = ChiSquared::new(d)
    {
        return libm::log(distribution.sf(sum).max(f64::MIN_POSITIVE)).min(0.0);
    }
    let half = 0.5 * sum;
    ((0.5 * d - 1.0) * libm::log(half) - half - libm::lgamma(0.5 * d)).min(0.0)
}

/// Chance that white noise has as much correlation as some numbers, over 20 lags:
/// `n(n+2)·Σ r_l²/(n−l)` against the chi-squared distribution.
///
/// # Source
///
/// Ljung and Box, Biometrika 65, 1978.
pub fn ljung_box_chance(white: &[f64]) -> f64 {
    let n = white.len() as f64;
    let energy: f64 = white.iter().map(|x| x * x).sum();
    if energy <= 0.0 || white.len() <= 2 * LAGS {
        return 1.0;
    }
    let lagged = |lag: usize| -> f64 {
        let r = white.iter().zip(&white[lag..]).map(|(a, b)| a * b).sum::<f64>() / energy;
        r * r / (n - lag as f64)
    };
    let statistic = n * (n + 2.0) * (1..=LAGS).map(lagged).sum::<f64>();
    libm::exp(chi_squared_log_tail(statistic, LAGS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_is_that_of_tables_and_goes_on_where_it_underflows() {
        let tail = chi_squared_log_tail;
        assert!((tail(3.841_458_820_694_124, 1) - 0.05_f64.ln()).abs() < 1e-9);
        assert!((tail(9.210_340_371_976_18, 2) - 0.01_f64.ln()).abs() < 1e-9);
        // of two degrees it is a straight line, also over the seam
        assert!((tail(499.0, 2) - tail(501.0, 2) - 1.0).abs() < 1e-6);
        assert_eq!(tail(0.0, 2), 0.0);
    }

    #[test]
    fn a_wave_is_not_white() {
        let wave: Vec<f64> = (0..400).map(|n| libm::sin(0.3 * f64::from(n))).collect();
        assert!(ljung_box_chance(&wave) < 1e-12);
        // numbers without a pattern, by a multiplicative generator
        let mut state = 1_u32;
        let noise: Vec<f64> = (0..400)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state) / f64::from(u32::MAX) - 0.5
            })
            .collect();
        assert!(ljung_box_chance(&noise) > 0.01);
    }
}
