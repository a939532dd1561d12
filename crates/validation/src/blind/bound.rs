//! Bounds of a rate.

use statrs::distribution::{Beta, ContinuousCDF};

/// A count of so many.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Rate {
    pub(crate) hits: usize,
    pub(crate) of: usize,
}

/// One-sided level of the bounds.
const LEVEL: f64 = 0.95;

impl Rate {
    /// Counts the items that a test holds for.
    pub(crate) fn of<T>(items: &[T], test: impl Fn(&T) -> bool) -> Self {
        Self { hits: items.iter().filter(|item| test(item)).count(), of: items.len() }
    }

    /// Share of hits; none of none is NaN.
    pub(crate) fn value(&self) -> f64 {
        self.hits as f64 / self.of as f64
    }

    /// One-sided 95 % Clopper-Pearson bound from above; 1 without any case.
    pub(crate) fn at_most(&self) -> f64 {
        if self.hits >= self.of {
            return 1.0;
        }
        quantile(self.hits as f64 + 1.0, (self.of - self.hits) as f64, LEVEL)
    }

    /// One-sided 95 % Clopper-Pearson bound from below; 0 without any case.
    pub(crate) fn at_least(&self) -> f64 {
        if self.hits == 0 {
            return 0.0;
        }
        quantile(self.hits as f64, (self.of - self.hits) as f64 + 1.0, 1.0 - LEVEL)
    }
}

fn quantile(a: f64, b: f64, level: f64) -> f64 {
    Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(level))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    /// Without hits the bound solves (1 − p)ⁿ = 0.05.
    #[test]
    fn law_bounds_of_none_and_all() {
        let none = Rate { hits: 0, of: 60 };
        assert_abs_diff_eq!(none.at_most(), 1.0 - 0.05_f64.powf(1.0 / 60.0), epsilon = 1e-9);
        assert_eq!(none.at_least(), 0.0);
        let all = Rate { hits: 60, of: 60 };
        assert_abs_diff_eq!(all.at_least(), 0.05_f64.powf(1.0 / 60.0), epsilon = 1e-9);
        assert_eq!(all.at_most(), 1.0);
    }

    /// The chance of what was counted, or less, is 5 % at the bound from above.
    #[test]
    fn law_bounds_are_binomial_tails() {
        let rate = Rate { hits: 3, of: 40 };
        let tail = |p: f64, range: core::ops::RangeInclusive<i32>| -> f64 {
            range
                .map(|k| {
                    let ways: f64 = (0..k).map(|i| f64::from(40 - i) / f64::from(i + 1)).product();
                    ways * p.powi(k) * (1.0 - p).powi(40 - k)
                })
                .sum()
        };
        assert_abs_diff_eq!(tail(rate.at_most(), 0..=3), 0.05, epsilon = 1e-9);
        assert_abs_diff_eq!(tail(rate.at_least(), 3..=40), 0.05, epsilon = 1e-9);
    }
}
