//! Paired comparison of two methods: signs, signed ranks, and an interval of the median.

use statrs::distribution::{Binomial, DiscreteCDF};

/// Coverage that the interval of the median has at least.
const COVERAGE: f64 = 0.95;

/// A comparison of two methods by the differences that they leave at the same seeds.
///
/// Nothing is assumed of the differences but that they are independent; the signed-rank test
/// assumes besides that they are symmetric about their median.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairedComparison {
    /// Differences below zero.
    pub below: usize,
    /// Differences above zero.
    pub above: usize,
    /// Differences of zero.
    pub zero: usize,
    /// Median of the differences.
    pub median: f64,
    /// Order statistics that hold the median with a probability of at least 95 %, exactly by the
    /// binomial law; least and largest difference where there are fewer than six.
    pub interval: [f64; 2],
    /// Two-sided p value of the exact sign test, differences of zero left out.
    pub sign_p: f64,
    /// Two-sided p value of Wilcoxon's signed-rank test, differences of zero left out: the exact
    /// law of the ranks that occur, equal sizes sharing their mean rank.
    pub signed_rank_p: f64,
}

impl PairedComparison {
    /// Compares; `None` of no difference, or of one that is not finite.
    ///
    /// # Source
    ///
    /// Hollander, Wolfe, Chicken: Nonparametric Statistical Methods, 3rd edition, 2014, sections 3.1
    /// (signed ranks with their law given the ties), 3.4 (sign test) and 3.6 (interval).
    ///
    /// # Examples
    ///
    /// ```
    /// use experiments::PairedComparison;
    ///
    /// let found = PairedComparison::of(&[-2.0, -1.0, 0.5, -3.0, -4.0, -5.0]).expect("six numbers");
    /// assert_eq!((found.below, found.above), (5, 1));
    /// assert!((found.sign_p - 14.0 / 64.0).abs() < 1e-12);
    /// ```
    pub fn of(differences: &[f64]) -> Option<Self> {
        if differences.is_empty() || !differences.iter().all(|d| d.is_finite()) {
            return None;
        }
        let mut sorted = differences.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let below = sorted.iter().filter(|d| **d < 0.0).count();
        let above = sorted.iter().filter(|d| **d > 0.0).count();
        let count = sorted.len();
        let half = count / 2;
        let median = if count % 2 == 1 {
            sorted[half]
        } else {
            f64::midpoint(sorted[half - 1], sorted[half])
        };
        let left_out = left_out(count);
        Some(Self {
            below,
            above,
            zero: count - below - above,
            median,
            interval: [sorted[left_out], sorted[count - 1 - left_out]],
            sign_p: sign_p(below, above),
            signed_rank_p: signed_rank_p(differences),
        })
    }

    /// Share of the pairs that the first method wins by having the smaller number, ties counted half.
    pub fn share_below(&self) -> f64 {
        let pairs = self.below + self.above + self.zero;
        (self.below as f64 + 0.5 * self.zero as f64) / pairs as f64
    }
}

/// The law of the number of successes in tosses of a fair coin.
fn fair(tosses: usize) -> Binomial {
    Binomial::new(0.5, tosses as u64).expect("one half is a probability")
}

/// Order statistics to leave out at each end.
fn left_out(count: usize) -> usize {
    let law = fair(count);
    let tail = (1.0 - COVERAGE) / 2.0;
    // with k left out the interval misses with twice P(B ≤ k)
    (0..count.div_ceil(2)).take_while(|&k| law.cdf(k as u64) <= tail).last().unwrap_or(0)
}

fn sign_p(below: usize, above: usize) -> f64 {
    if below + above == 0 {
        return 1.0;
    }
    (2.0 * fair(below + above).cdf(below.min(above) as u64)).min(1.0)
}

/// Twice the smaller tail of the sum of the ranks of positive differences, each sign a fair coin.
fn signed_rank_p(differences: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = differences.iter().copied().filter(|d| *d != 0.0).collect();
    sizes.sort_unstable_by(|a, b| a.abs().total_cmp(&b.abs()));
    // twice the mean rank, so that it is whole
    let mut doubled = vec![0usize; sizes.len()];
    let mut start = 0;
    while start < sizes.len() {
        let same = sizes[start..].iter().take_while(|d| d.abs() == sizes[start].abs()).count();
        doubled[start..start + same].fill(2 * start + same + 1);
        start += same;
    }
    let total: usize = doubled.iter().sum();
    let positive: usize =
        doubled.iter().zip(&sizes).filter(|(_, d)| **d > 0.0).map(|(rank, _)| rank).sum();
    let mut law = vec![0.0; total + 1];
    law[0] = 1.0;
    let mut reached = 0;
    for rank in doubled {
        reached += rank;
        for sum in (0..=reached).rev() {
            let with = if sum >= rank { law[sum - rank] } else { 0.0 };
            law[sum] = 0.5 * (law[sum] + with);
        }
    }
    let tail: f64 = law[..=positive.min(total - positive)].iter().sum();
    (2.0 * tail).min(1.0)
}

/// Holm's correction: p values of a family, so that comparing each with a level keeps the chance of
/// one false rejection below it.
///
/// # Source
///
/// Holm, Scandinavian Journal of Statistics 6(2), 1979.
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|&a, &b| p_values[a].total_cmp(&p_values[b]));
    let mut corrected = vec![0.0; p_values.len()];
    let mut largest: f64 = 0.0;
    for (place, &index) in order.iter().enumerate() {
        let factor = (p_values.len() - place) as f64;
        largest = largest.max((factor * p_values[index]).min(1.0));
        corrected[index] = largest;
    }
    corrected
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    /// Sums of some thousand products of halves.
    const SUMMED_REL: f64 = 1e-10;

    /// `differences` of the script below: a shifted, skewed sequence without chance.
    fn sequence(count: usize, digits: f64) -> Vec<f64> {
        (0..count)
            .map(|i| {
                let x = i as f64;
                let value = (12.9898 * x).sin() + 0.3 * (0.7 * x).cos().powi(2) - 0.1;
                (value * digits).round() / digits
            })
            .collect()
    }

    /// scipy 1.17.1: `wilcoxon(d, method="exact").pvalue`, which wants no ties, and
    /// `binomtest((d > 0).sum(), n).pvalue`, of
    /// `d = round((sin(12.9898·i) + 0.3·cos(0.7·i)² − 0.1)·1e9)/1e9`, `i = 0 … n − 1`.
    #[test]
    fn versus_scipy_signed_ranks_and_signs() {
        for (count, wilcoxon, sign) in SCIPY {
            let found = PairedComparison::of(&sequence(count, 1e9)).unwrap();
            assert_relative_eq!(found.signed_rank_p, wilcoxon, max_relative = SUMMED_REL);
            assert_relative_eq!(found.sign_p, sign, max_relative = SUMMED_REL);
        }
    }

    /// All signs of a small set with ties and a zero, counted one by one.
    #[test]
    fn law_of_ties_by_counting_all_signs() {
        let differences = [1.0, -1.0, 2.0, 2.0, 2.0, -3.0, 0.0, 4.0];
        let ranks = [1.5, 1.5, 4.0, 4.0, 4.0, 6.0, 7.0];
        let observed: f64 = 1.5 + 3.0 * 4.0 + 7.0;
        let total: f64 = ranks.iter().sum();
        let least = observed.min(total - observed);
        let as_small = (0..128u32).filter(|signs| {
            let sum: f64 = (0..7).filter(|&i| signs >> i & 1 == 1).map(|i| ranks[i]).sum();
            sum <= least
        });
        let exact = 2.0 * as_small.count() as f64 / 128.0;
        let found = PairedComparison::of(&differences).unwrap();
        assert_abs_diff_eq!(found.signed_rank_p, exact.min(1.0), epsilon = 1e-12);
        assert_eq!((found.below, found.above, found.zero), (2, 5, 1));
    }

    /// Hollander and Wolfe, table of the sign test: of 20 the interval from the 6th to the 15th has
    /// 95.9 %; of 5 none has 95 %.
    #[test]
    fn published_order_statistics_of_the_median() {
        let count = |n: usize| (0..n).map(|i| i as f64 + 1.0).collect::<Vec<_>>();
        assert_eq!(PairedComparison::of(&count(20)).unwrap().interval, [6.0, 15.0]);
        assert_eq!(PairedComparison::of(&count(5)).unwrap().interval, [1.0, 5.0]);
        // 200: the 86th to the 115th
        assert_eq!(PairedComparison::of(&count(200)).unwrap().interval, [86.0, 115.0]);
    }

    #[test]
    fn holm_steps_down_and_stays_monotone() {
        let corrected = holm(&[0.01, 0.04, 0.03, 0.005]);
        let expected = [0.03, 0.06, 0.06, 0.02];
        for (found, expected) in corrected.iter().zip(expected) {
            assert_abs_diff_eq!(*found, expected, epsilon = 1e-12);
        }
        assert_eq!(holm(&[0.9, 0.8]), [1.0, 1.0]);
    }

    #[test]
    fn nothing_and_what_is_not_finite_are_not_compared() {
        assert_eq!(PairedComparison::of(&[]), None);
        assert_eq!(PairedComparison::of(&[1.0, f64::NAN]), None);
        let same = PairedComparison::of(&[0.0, 0.0]).unwrap();
        assert_eq!((same.sign_p, same.signed_rank_p), (1.0, 1.0));
        assert_abs_diff_eq!(same.share_below(), 0.5);
    }

    /// Count, two-sided p of Wilcoxon's test and of the sign test.
    const SCIPY: [(usize, f64, f64); 3] = [
        (12, 0.301_269_531_25, 0.387_695_312_5),
        (40, 0.226_507_542_605_759_23, 0.268_187_251_054_769_15),
        (200, 0.118_054_263_790_146_72, 0.358_003_090_624_502_2),
    ];
}
