//! Two-step lookahead expected improvement.

#![expect(
    clippy::inline_always,
    reason = "kernels are compiled once for each instruction set, which inlining makes possible"
)]

use pulp::NullaryFnOnce;

use super::expected::{Scored, one_output};
use crate::{
    error::{AcquisitionError, SettingError},
    gp::{Block, GaussianProcess},
    kernel::exp_negative,
    linalg::{GROUP, subtract_rows, wide},
    normal::{density, distribution, improvement},
    random::{Purpose, Stream},
};

/// `1/√(2π)`. An improvement never exceeds `gain⁺ + σ·φ(z)/(1 + z²)`, because
/// Mills's ratio is at least `t/(1 + t²)`.
const PEAK: f64 = 0.398_942_280_401_432_7;

/// How the expectation over the next observation is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fantasies {
    /// Gauss-Hermite quadrature with this many nodes (1 to 32).
    GaussHermite(usize),
    /// Monte Carlo with this many draws, the same for every point (FREEDOM
    /// paper, eqs 15-16).
    MonteCarlo {
        /// Number of draws.
        draws: usize,
        /// Seed of the draws.
        seed: u64,
    },
}

/// Two-step lookahead expected improvement on a set of second points.
///
/// ```text
/// U(x₁) = EI⁰(x₁) + E_Z[ max_{x₂ ∈ C} EI¹(x₂) ]                 (FREEDOM paper, eq. 14)
/// μ¹(x₂) = μ⁰(x₂) + H·Z,   H = cov⁰(x₁, x₂)/√(σ⁰²(x₁) + noise)   (eq. 15)
/// σ¹²(x₂) = σ⁰²(x₂) − H²                                         (eq. 16, as a variance)
/// ```
///
/// The maximum is over a finite set `C`; nothing is factored again, because
/// `cov⁰` follows from `U⁻ᵀ·k` of both points. The gradient holds the
/// maximising `x₂` of each `Z` fixed (envelope theorem; Wu and Frazier,
/// `NeurIPS` 2019). Eq. 16 prints a standard deviation minus a variance.
#[derive(Clone, Debug)]
pub struct TwoStep {
    /// Standard normal nodes and their weights.
    nodes: Vec<(f64, f64)>,
}

/// The second points with their beliefs.
#[derive(Clone, Debug)]
pub(crate) struct Second {
    unit: Vec<Vec<f64>>,
    block: Block,
}

/// Criterion at one first point.
struct Looked {
    value: f64,
    /// Second point and improvement of each node.
    chosen: Vec<usize>,
    covariance: Vec<f64>,
}

impl TwoStep {
    /// A rule for the expectation.
    ///
    /// # Errors
    /// [`SettingError::OutOfRange`] for no node or draw, or more than 32 nodes.
    pub fn new(fantasies: Fantasies) -> Result<Self, SettingError> {
        let (count, limit) = match fantasies {
            Fantasies::GaussHermite(count) => (count, 32),
            Fantasies::MonteCarlo { draws, .. } => (draws, usize::MAX),
        };
        if count == 0 || count > limit {
            let (name, value) = ("fantasies", count as f64);
            return Err(SettingError::OutOfRange { name, value, needs: "1 to 32 nodes, or draws" });
        }
        let nodes = match fantasies {
            Fantasies::GaussHermite(count) => gauss_hermite(count),
            Fantasies::MonteCarlo { draws, seed } => {
                let mut stream = Stream::new(seed, Purpose::Fantasies, 0);
                (0..draws).map(|_| (stream.normal(), 1.0 / draws as f64)).collect()
            }
        };
        Ok(Self { nodes })
    }

    /// The criterion at `first`, with second points `second` and its gradient.
    ///
    /// # Errors
    /// [`AcquisitionError`]: unusable points, several outputs, an incumbent that is not finite.
    pub fn evaluate_with_gradient(
        &self,
        gp: &GaussianProcess,
        first: &[f64],
        second: &[Vec<f64>],
        best: f64,
    ) -> Result<Scored, AcquisitionError> {
        one_output(gp)?;
        if !best.is_finite() {
            return Err(AcquisitionError::Incumbent { value: best });
        }
        let bounds = gp.bounds();
        bounds.check(first)?;
        let mut unit = Vec::with_capacity(second.len());
        for point in second {
            bounds.check(point)?;
            unit.push(bounds.to_unit(point));
        }
        let second = Second::new(gp, unit);
        let (value, mut gradient) = self.slope(gp, &bounds.to_unit(first), &second, best);
        for (i, g) in gradient.iter_mut().enumerate() {
            *g /= bounds.width(i);
        }
        Ok(Scored { value, gradient })
    }

    /// The criterion at each of many first points.
    pub(crate) fn values(
        &self,
        gp: &GaussianProcess,
        first: &[Vec<f64>],
        second: &Second,
        best: f64,
    ) -> Vec<f64> {
        let mut values = Vec::with_capacity(first.len());
        for chunk in first.chunks(64) {
            let block = gp.block(chunk);
            let all = wide(Covariances { gp, first: &block, second });
            for (i, row) in all.chunks_exact(second.block.count).enumerate() {
                let covariance = row.to_vec();
                let look = Look { rule: self, gp, first: (&block, i), second, best, covariance };
                values.push(wide(look).value);
            }
        }
        values
    }

    /// The criterion with its gradient in unit coordinates.
    pub(crate) fn slope(
        &self,
        gp: &GaussianProcess,
        unit: &[f64],
        second: &Second,
        best: f64,
    ) -> (f64, Vec<f64>) {
        let block = gp.block(std::slice::from_ref(&unit.to_vec()));
        let covariance = wide(Covariances { gp, first: &block, second });
        let looked = wide(Look { rule: self, gp, first: (&block, 0), second, best, covariance });
        let (belief, slope) = gp.believe_with_slope(unit);
        let signal = gp.signal_std()[0];
        let noise = gp.report().noise_ratio;
        let mean_slope = slope.mean.row(0);
        let d = unit.len();
        let std = signal * belief.share.sqrt();
        let observed = signal * (belief.share + noise).sqrt();
        if std == 0.0 {
            return (looked.value, vec![0.0; d]);
        }
        let by_share = |s: f64, i: usize| signal * signal * slope.share[i] / (2.0 * s);
        let z0 = (best - belief.mean[0]) / std;
        let mut gradient: Vec<f64> = (0..d)
            .map(|i| -distribution(z0) * mean_slope[i] + density(z0) * by_share(std, i))
            .collect();
        for (&(z, weight), &c) in self.nodes.iter().zip(&looked.chosen) {
            let h = looked.covariance[c] / observed;
            let s1 = (signal * signal * second.block.share[c] - h * h).max(0.0).sqrt();
            let y1 = belief.mean[0] + observed * z;
            let best1 = best.min(y1);
            let mu1 = second.block.mean[c] + h * z;
            let (cdf, pdf) = if s1 > 0.0 {
                let u = (best1 - mu1) / s1;
                (distribution(u), density(u))
            } else {
                (if best1 > mu1 { 1.0 } else { 0.0 }, 0.0)
            };
            let cov_slope = gp.covariance_slope(unit, &second.unit[c], &second.block, c);
            for i in 0..d {
                let observed_slope = by_share(observed, i);
                let h_slope = (cov_slope[i] - h * observed_slope) / observed;
                let best_slope = if y1 < best { mean_slope[i] + z * observed_slope } else { 0.0 };
                let s_slope = if s1 > 0.0 { -h * h_slope / s1 } else { 0.0 };
                gradient[i] += weight * (cdf * (best_slope - z * h_slope) + pdf * s_slope);
            }
        }
        (looked.value, gradient)
    }
}

impl Second {
    /// Predicts the second points.
    pub(crate) fn new(gp: &GaussianProcess, unit: Vec<Vec<f64>>) -> Self {
        let block = gp.block(&unit);
        Self { unit, block }
    }

    /// Second points in falling order of plain expected improvement.
    pub(crate) fn by_improvement(&self, gp: &GaussianProcess, best: f64) -> Vec<usize> {
        let signal = gp.signal_variance().sqrt();
        let ln = super::Acquisition::LogExpectedImprovement;
        let values: Vec<f64> = (0..self.block.count)
            .map(|i| ln.value(self.block.mean[i], signal * self.block.share[i].sqrt(), best))
            .collect();
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
        order
    }
}

/// Columns of a tile, so that it stays in the first cache.
const TILE: usize = 128;

/// Posterior covariances of all first with all second points, first × second.
struct Covariances<'a> {
    gp: &'a GaussianProcess,
    first: &'a Block,
    second: &'a Second,
}

impl NullaryFnOnce for Covariances<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn call(self) -> Vec<f64> {
        let Self { gp, first, second: Second { block: second, .. } } = self;
        let count = second.count;
        let mut all = vec![0.0; first.count * count];
        let mut spare = vec![0.0; count];
        for (i, row) in all.chunks_exact_mut(count).enumerate() {
            gp.prior_row(first, i, second, row, &mut spare);
        }
        let mut from = 0;
        while from < count {
            let to = (from + TILE).min(count);
            let mut start = 0;
            while start < gp.len() {
                let end = (start + GROUP).min(gp.len());
                for (i, row) in all.chunks_exact_mut(count).enumerate() {
                    subtract_rows(
                        &mut row[from..to],
                        start..end,
                        |k| first.whitened[k * first.count + i],
                        |k| &second.whitened[k * count + from..k * count + to],
                    );
                }
                start = end;
            }
            from = to;
        }
        let variance = gp.signal_variance();
        for c in &mut all {
            *c *= variance;
        }
        all
    }
}

/// The two-step criterion of one first point.
struct Look<'a> {
    rule: &'a TwoStep,
    gp: &'a GaussianProcess,
    first: (&'a Block, usize),
    second: &'a Second,
    best: f64,
    /// Posterior covariance with each second point.
    covariance: Vec<f64>,
}

impl NullaryFnOnce for Look<'_> {
    type Output = Looked;

    #[inline(always)]
    fn call(self) -> Looked {
        let Self { rule, gp, first: (block, at), second, best, covariance } = self;
        let count = second.block.count;
        let variance = gp.signal_variance();
        let noise = gp.report().noise_ratio;
        let mean = block.mean[at];
        let std = (variance * block.share[at]).sqrt();
        let observed = (variance * (block.share[at] + noise)).sqrt();
        let now = if std > 0.0 { std * improvement((best - mean) / std) } else { 0.0 };
        let inverse = if observed > 0.0 { 1.0 / observed } else { 0.0 };
        let mut pull = vec![0.0; count];
        let mut later = vec![0.0; count];
        for i in 0..count {
            pull[i] = covariance[i] * inverse;
            let left = variance * second.block.share[i] - pull[i] * pull[i];
            later[i] = left.max(0.0).sqrt();
        }
        let mut ceiling = vec![0.0; count];
        let mut tops = vec![0.0; count.div_ceil(BLOCK)];
        let mut value = now;
        let mut chosen = Vec::with_capacity(rule.nodes.len());
        for &(z, weight) in &rule.nodes {
            let best1 = best.min(mean + observed * z);
            let rise =
                Rise { best: best1, z, mean: &second.block.mean, pull: &pull, later: &later };
            ceilings(&mut ceiling, &rise);
            let exact = |i: usize| {
                let gain = best1 - second.block.mean[i] - pull[i] * z;
                if later[i] > 0.0 { later[i] * improvement(gain / later[i]) } else { gain.max(0.0) }
            };
            block_maxima(&mut tops, &ceiling);
            let top = first_highest(&ceiling, &tops);
            let (mut most, mut which) = (exact(top), top);
            for (block, &highest) in tops.iter().enumerate() {
                if highest <= most {
                    continue;
                }
                let from = block * BLOCK;
                for (i, &c) in ceiling[from..].iter().take(BLOCK).enumerate() {
                    if c > most {
                        let e = exact(from + i);
                        if e > most {
                            (most, which) = (e, from + i);
                        }
                    }
                }
            }
            value += weight * most;
            chosen.push(which);
        }
        Looked { value, chosen, covariance }
    }
}

/// Second points after a first observation `z` standard deviations from its mean.
struct Rise<'a> {
    best: f64,
    z: f64,
    mean: &'a [f64],
    /// Move of each mean for one standard deviation of the first observation.
    pull: &'a [f64],
    /// Standard deviation that is left at each.
    later: &'a [f64],
}

/// Upper bounds of the improvement at each second point.
#[inline(always)]
fn ceilings(out: &mut [f64], rise: &Rise<'_>) {
    let n = out.len();
    let (best, z) = (rise.best, rise.z);
    // slices of one length, so that the loop needs no checks
    let (mean, pull, later) = (&rise.mean[..n], &rise.pull[..n], &rise.later[..n]);
    for i in 0..n {
        let gain = best - mean[i] - pull[i] * z;
        let u = gain / (later[i] + f64::MIN_POSITIVE);
        let u2 = u * u;
        let tail = later[i] * PEAK * exp_negative(-0.5 * u2) / (1.0 + u2);
        out[i] = gain.max(0.0) + tail;
    }
}

/// Entries of a block, several vectors of any instruction set.
const BLOCK: usize = 32;
/// Entries that are compared side by side.
const LANES: usize = 8;

/// Largest entry of each block.
#[inline(always)]
fn block_maxima(tops: &mut [f64], values: &[f64]) {
    for (top, block) in tops.iter_mut().zip(values.chunks(BLOCK)) {
        let mut lanes = [f64::NEG_INFINITY; LANES];
        let whole = block.chunks_exact(LANES);
        let rest = whole.remainder();
        for part in whole {
            for lane in 0..LANES {
                lanes[lane] = if part[lane] > lanes[lane] { part[lane] } else { lanes[lane] };
            }
        }
        *top = lanes.iter().chain(rest).fold(f64::NEG_INFINITY, |m, &v| if v > m { v } else { m });
    }
}

/// Index of the first of the largest entries, given the maxima of the blocks.
#[inline(always)]
fn first_highest(values: &[f64], tops: &[f64]) -> usize {
    let mut block = 0;
    for i in 1..tops.len() {
        if tops[i] > tops[block] {
            block = i;
        }
    }
    let from = block * BLOCK;
    let within = values[from..].iter().take(BLOCK).position(|v| *v == tops[block]);
    from + within.unwrap_or(0)
}

/// Nodes and weights for the standard normal law, by Newton's method on the
/// orthonormal Hermite polynomials.
fn gauss_hermite(count: usize) -> Vec<(f64, f64)> {
    // the roots interlace: those of the polynomial before bracket each new one
    let mut roots: Vec<f64> = Vec::new();
    for degree in 1..=count {
        let reach = 2.0 * (degree as f64).sqrt() + 1.0;
        let mut fences = vec![-reach];
        fences.extend(&roots);
        fences.push(reach);
        roots = fences.windows(2).map(|w| bisect(degree, w[0], w[1])).collect();
    }
    roots
        .into_iter()
        .map(|x| {
            // w = 1/(n·p_{n−1}(x)²) for orthonormal polynomials
            let (_, before) = hermite(count, x);
            (x, 1.0 / (count as f64 * before * before))
        })
        .collect()
}

/// Orthonormal Hermite polynomials of degree `n` and `n − 1`.
fn hermite(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut now) = (0.0, 1.0);
    for k in 0..n {
        let next = (x * now - (k as f64).sqrt() * before) / ((k + 1) as f64).sqrt();
        (before, now) = (now, next);
    }
    (now, before)
}

/// The root between two fences, to the last bit.
fn bisect(degree: usize, mut low: f64, mut high: f64) -> f64 {
    let rising = hermite(degree, high).0 > 0.0;
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if (hermite(degree, middle).0 > 0.0) == rising { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_highest_entry_is_found_in_any_block() {
        for count in [1, 7, 8, 31, 32, 33, 100, 640] {
            for place in [0, count / 2, count - 1] {
                let mut values = vec![-1.0; count];
                values[place] = 2.0;
                values[count - 1] = 2.0; // a tie: the first counts
                let mut tops = vec![0.0; count.div_ceil(BLOCK)];
                block_maxima(&mut tops, &values);
                assert_eq!(first_highest(&values, &tops), place, "{count}");
            }
            let (zeros, mut tops) = (vec![0.0; count], vec![1.0; count.div_ceil(BLOCK)]);
            block_maxima(&mut tops, &zeros);
            assert_eq!(first_highest(&zeros, &tops), 0);
        }
    }

    #[test]
    fn law_gauss_hermite_is_exact_for_moments() {
        for count in [1, 2, 5, 8, 16, 32] {
            let nodes = gauss_hermite(count);
            let mut moment = 1.0; // (2k − 1)!!
            for k in 0..count.min(6) {
                let sum: f64 = nodes.iter().map(|(x, w)| w * libm::pow(x * x, k as f64)).sum();
                assert!((sum / moment - 1.0).abs() < 1e-12, "{count} {k} {sum} {moment}");
                moment *= (2 * k + 1) as f64;
            }
        }
    }
}
