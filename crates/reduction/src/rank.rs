/// How many singular values to keep.
///
/// Whatever the rule, no singular value below `max(m, n)·ε·σ₁` is kept: it is
/// rounding, and dividing by it would amplify rounding.
///
/// # Examples
///
/// ```
/// use reduction::RankRule;
///
/// let singular_values = [3.0, 1.0, 0.1];
/// assert_eq!(RankRule::Energy(0.9).rank(&singular_values, 100, 3), 2); // 9 ÷ 10.01 falls short
/// assert_eq!(RankRule::Fixed(2).rank(&singular_values, 100, 3), 2);
/// assert_eq!(RankRule::Full.rank(&[1.0, 1e-17], 100, 2), 1);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum RankRule {
    /// This many, or as many as there are.
    Fixed(usize),
    /// The fewest whose squares hold this fraction of the sum of all squares
    /// (the paper's "fraction of information retained", with `λ = σ²`).
    Energy(f64),
    /// The optimal hard threshold for a low-rank signal in white noise of
    /// unknown level, `τ = ω(β)·median(σ)`.
    ///
    /// # Source
    ///
    /// Gavish, Donoho: The optimal hard threshold for singular values is 4/√3.
    /// IEEE Trans. Inf. Theory 60(8), 2014. `ω` is computed, not approximated.
    OptimalHardThreshold,
    /// All that are not rounding.
    Full,
}

impl RankRule {
    /// Number of leading entries of `singular_values` (not increasing) to keep
    /// for a matrix of `rows` by `columns`.
    ///
    /// Zero only when every singular value is zero, or [`Fixed`](Self::Fixed)
    /// asks for none.
    pub fn rank(self, singular_values: &[f64], rows: usize, columns: usize) -> usize {
        let numerical = numerical_rank(singular_values, rows, columns);
        let wanted = match self {
            Self::Fixed(count) => count,
            Self::Energy(fraction) => energy_rank(singular_values, fraction),
            Self::OptimalHardThreshold => {
                let threshold = hard_threshold(singular_values, rows, columns);
                singular_values.iter().take_while(|&&value| value > threshold).count().max(1)
            }
            Self::Full => numerical,
        };
        wanted.min(numerical)
    }
}

/// Singular values above `max(m, n)·ε·σ₁`.
pub(crate) fn numerical_rank(singular_values: &[f64], rows: usize, columns: usize) -> usize {
    let first = singular_values.first().copied().unwrap_or(0.0);
    let floor = rows.max(columns) as f64 * f64::EPSILON * first;
    singular_values.iter().take_while(|&&value| value > floor).count()
}

fn energy_rank(singular_values: &[f64], fraction: f64) -> usize {
    let first = singular_values.first().copied().unwrap_or(0.0).max(f64::MIN_POSITIVE);
    let squares: Vec<f64> = singular_values.iter().map(|value| (value / first).powi(2)).collect();
    // Summed from the smallest, so that the tail is not lost beside the head.
    let mut tail = 0.0;
    let total: f64 = squares.iter().rev().sum();
    let mut rank = squares.len();
    for square in squares.iter().rev() {
        tail += square;
        if tail > (1.0 - fraction) * total {
            break;
        }
        rank -= 1;
    }
    rank.max(1)
}

fn hard_threshold(singular_values: &[f64], rows: usize, columns: usize) -> f64 {
    let ratio = rows.min(columns) as f64 / rows.max(columns) as f64;
    let count = singular_values.len();
    let median = f64::midpoint(singular_values[(count - 1) / 2], singular_values[count / 2]);
    optimal_threshold_factor(ratio) * median
}

/// `ω(β) = λ*(β) ÷ √μ(β)`, `μ` the median of the Marčenko–Pastur law.
fn optimal_threshold_factor(ratio: f64) -> f64 {
    let known_noise = (2.0 * (ratio + 1.0)
        + 8.0 * ratio / ((ratio + 1.0) + (ratio * ratio + 14.0 * ratio + 1.0).sqrt()))
    .sqrt();
    known_noise / marchenko_pastur_median(ratio).sqrt()
}

/// Median of the Marčenko–Pastur law with aspect ratio `ratio` in (0, 1].
///
/// With `x = 1 + β + 2√β·cos θ` the density times `dx` is
/// `2 sin²θ ÷ (π x) dθ`, smooth on (0, π), so that bisection over the midpoint
/// rule converges fast.
fn marchenko_pastur_median(ratio: f64) -> f64 {
    const PANELS: u32 = 4000;
    let at = |angle: f64| 1.0 + ratio + 2.0 * ratio.sqrt() * angle.cos();
    // Mass above the point of `angle`, that is over (0, angle).
    let mass_above = |angle: f64| {
        let step = angle / f64::from(PANELS);
        (0..PANELS)
            .map(|panel| {
                let middle = (f64::from(panel) + 0.5) * step;
                2.0 * middle.sin().powi(2) / (std::f64::consts::PI * at(middle)) * step
            })
            .sum::<f64>()
    };
    let (mut low, mut high) = (0.0, std::f64::consts::PI);
    for _ in 0..40 {
        let middle = f64::midpoint(low, high);
        if mass_above(middle) < 0.5 { low = middle } else { high = middle }
    }
    at(f64::midpoint(low, high))
}

#[cfg(test)]
mod tests {
    use super::{RankRule, optimal_threshold_factor};
    use approx::assert_abs_diff_eq;

    /// Gavish and Donoho 2014, table IV and the abstract: ω(1) = 2.858, and
    /// their cubic 0.56β³ − 0.95β² + 1.82β + 1.43 is within 0.02 of ω.
    #[test]
    fn published_optimal_threshold_factor() {
        const CUBIC_MAX_ERROR: f64 = 0.02;
        assert_abs_diff_eq!(optimal_threshold_factor(1.0), 2.858, epsilon = 5e-4);
        for ratio in [0.05, 0.2, 0.5, 0.8, 1.0] {
            let cubic = 0.56 * ratio * ratio * ratio - 0.95 * ratio * ratio + 1.82 * ratio + 1.43;
            let error = (optimal_threshold_factor(ratio) - cubic).abs();
            assert!(error < CUBIC_MAX_ERROR, "ratio {ratio}: {error}");
        }
    }

    #[test]
    fn energy_counts_the_tail_exactly() {
        let singular_values = [1.0, 1e-9, 1e-9];
        assert_eq!(RankRule::Energy(1.0).rank(&singular_values, 3, 3), 3);
        assert_eq!(RankRule::Energy(0.999).rank(&singular_values, 3, 3), 1);
    }

    #[test]
    fn zero_matrix_has_rank_zero() {
        for rule in [
            RankRule::Fixed(3),
            RankRule::Energy(0.9),
            RankRule::OptimalHardThreshold,
            RankRule::Full,
        ] {
            assert_eq!(rule.rank(&[0.0, 0.0], 4, 2), 0, "{rule:?}");
        }
    }
}
