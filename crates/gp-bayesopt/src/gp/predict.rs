//! Prediction with its gradient.

#![expect(
    clippy::inline_always,
    reason = "kernels are compiled once for each instruction set, which inlining makes possible"
)]

use pulp::NullaryFnOnce;

use super::fit::GaussianProcess;
use crate::{
    error::BoundsError,
    linalg::{lanes_dot, subtract_rows, wide},
    matrix::Matrix,
};

/// Points predicted at once, so that their columns stay in the cache.
const BLOCK: usize = 128;

/// Mean and standard deviation of the noise-free outputs at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Mean of each output.
    pub mean: Vec<f64>,
    /// Standard deviation of each output.
    pub std: Vec<f64>,
}

/// Gradient of a prediction with respect to the inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictionSlope {
    /// `∂μ_o/∂x_i`, outputs × inputs.
    pub mean: Matrix,
    /// `∂σ_o/∂x_i`, outputs × inputs; zero where the standard deviation is zero.
    pub std: Matrix,
}

/// A prediction in unit coordinates: the standard deviation of output `o` is
/// its signal standard deviation times the root of `share`.
#[derive(Clone, Debug)]
pub(crate) struct Belief {
    pub(crate) mean: Vec<f64>,
    /// `1 − kᵀK⁻¹k`, not below zero.
    pub(crate) share: f64,
}

/// Gradient of a [`Belief`] in unit coordinates.
#[derive(Clone, Debug)]
pub(crate) struct BeliefSlope {
    /// Outputs × inputs.
    pub(crate) mean: Matrix,
    pub(crate) share: Vec<f64>,
}

/// Many predictions, with what conditional covariances need.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    pub(crate) count: usize,
    /// Outputs × points.
    pub(crate) mean: Vec<f64>,
    pub(crate) share: Vec<f64>,
    /// `U⁻ᵀ·k` of each point, observations × points.
    pub(crate) whitened: Vec<f64>,
    /// Features over length scales, features × points.
    pub(crate) scaled: Vec<f64>,
}

impl GaussianProcess {
    /// Predicts the noise-free outputs at a point of the box.
    ///
    /// # Errors
    /// [`BoundsError`] for a point of the wrong length or with NaN.
    pub fn predict(&self, point: &[f64]) -> Result<Prediction, BoundsError> {
        self.bounds.check(point)?;
        let belief = self.believe(&self.bounds.to_unit(point));
        Ok(self.prediction(&belief))
    }

    /// Predicts with the gradient.
    ///
    /// # Errors
    /// Those of [`Self::predict`].
    pub fn predict_with_slope(
        &self,
        point: &[f64],
    ) -> Result<(Prediction, PredictionSlope), BoundsError> {
        self.bounds.check(point)?;
        let (belief, slope) = self.believe_with_slope(&self.bounds.to_unit(point));
        let (q, d) = (self.outputs(), point.len());
        let root = belief.share.sqrt();
        let signal = self.signal_std();
        let (mut mean, mut std) = (Matrix::zeros(q, d), Matrix::zeros(q, d));
        for o in 0..q {
            for i in 0..d {
                let width = self.bounds.width(i);
                mean.set(o, i, slope.mean.get(o, i) / width);
                if root > 0.0 {
                    std.set(o, i, signal[o] * slope.share[i] / (2.0 * root * width));
                }
            }
        }
        Ok((self.prediction(&belief), PredictionSlope { mean, std }))
    }

    /// Predicts many points; faster than one by one.
    ///
    /// # Errors
    /// Those of [`Self::predict`].
    pub fn predict_many(&self, points: &[Vec<f64>]) -> Result<Vec<Prediction>, BoundsError> {
        let mut unit = Vec::with_capacity(points.len());
        for point in points {
            self.bounds.check(point)?;
            unit.push(self.bounds.to_unit(point));
        }
        let q = self.outputs();
        let mut all = Vec::with_capacity(points.len());
        for chunk in unit.chunks(BLOCK) {
            let block = self.block(chunk);
            for m in 0..block.count {
                let mean = (0..q).map(|o| block.mean[o * block.count + m]).collect();
                all.push(self.prediction(&Belief { mean, share: block.share[m] }));
            }
        }
        Ok(all)
    }

    /// Posterior covariance of one output between two points.
    ///
    /// # Errors
    /// Those of [`Self::predict`].
    ///
    /// # Panics
    /// When `output` is out of range.
    pub fn covariance(&self, output: usize, a: &[f64], b: &[f64]) -> Result<f64, BoundsError> {
        self.bounds.check(a)?;
        self.bounds.check(b)?;
        let block = self.block(&[self.bounds.to_unit(a), self.bounds.to_unit(b)]);
        let mut prior = [self.distance2(&block, 0, &block, 1)];
        self.options.kernel.evaluate(&mut prior, &mut [0.0]);
        let known: f64 = block.whitened.chunks_exact(2).map(|v| v[0] * v[1]).sum();
        Ok(self.signal_std()[output].powi(2) * (prior[0] - known))
    }

    fn distance2(&self, a: &Block, i: usize, b: &Block, j: usize) -> f64 {
        (0..self.features.len())
            .map(|f| a.scaled[f * a.count + i] - b.scaled[f * b.count + j])
            .map(|difference| difference * difference)
            .sum()
    }

    /// A belief in the outputs' units.
    fn prediction(&self, belief: &Belief) -> Prediction {
        let root = belief.share.sqrt();
        let std = self.signal_std().iter().map(|s| s * root).collect();
        Prediction { mean: belief.mean.clone(), std }
    }

    /// Covariances of a feature vector with the observations, in units of the
    /// signal variance.
    pub(super) fn correlations(&self, features: &[f64]) -> Vec<f64> {
        let scaled: Vec<f64> =
            features.iter().zip(&self.inverse_scale).map(|(z, inverse)| z * inverse).collect();
        wide(Correlate { gp: self, scaled: &scaled }).0
    }

    /// Predicts at a point of the unit cube.
    pub(crate) fn believe(&self, unit: &[f64]) -> Belief {
        let mut k = self.correlations(&self.features.of(unit));
        let mean = wide(Mean { gp: self, k: &k });
        wide(Whiten { gp: self, k: &mut k });
        Belief { mean, share: (1.0 - lanes_dot(&k, &k)).max(0.0) }
    }

    /// Predicts the means only, at a point of the unit cube, with their gradient.
    pub(crate) fn believe_mean_with_slope(&self, unit: &[f64]) -> (Vec<f64>, Matrix) {
        let (scaled, k, slopes) = self.correlate(unit);
        let mean = wide(Mean { gp: self, k: &k });
        (mean, self.mean_slope(unit, &scaled, &slopes))
    }

    /// Predicts at a point of the unit cube, with the gradient.
    pub(crate) fn believe_with_slope(&self, unit: &[f64]) -> (Belief, BeliefSlope) {
        let (scaled, k, slopes) = self.correlate(unit);
        let mean = wide(Mean { gp: self, k: &k });
        let mut solved = k.clone();
        self.solved.factor.solve(&mut solved);
        let share = (1.0 - lanes_dot(&k, &solved)).max(0.0);
        let by_feature: Vec<f64> = (0..self.features.len())
            .map(|f| {
                let row = self.feature_row(f);
                let pull: f64 =
                    (0..k.len()).map(|i| solved[i] * slopes[i] * (scaled[f] - row[i])).sum();
                2.0 * pull * self.inverse_scale[f]
            })
            .collect();
        let share_slope = self.features.jacobian(unit).transpose_times(&by_feature);
        let mean_slope = self.mean_slope(unit, &scaled, &slopes);
        (Belief { mean, share }, BeliefSlope { mean: mean_slope, share: share_slope })
    }

    /// Scaled features, covariances and kernel slopes of a point.
    fn correlate(&self, unit: &[f64]) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let mut scaled = self.features.of(unit);
        for (z, inverse) in scaled.iter_mut().zip(&self.inverse_scale) {
            *z *= inverse;
        }
        let (k, slopes) = wide(Correlate { gp: self, scaled: &scaled });
        (scaled, k, slopes)
    }

    /// `∂μ/∂u`, outputs × inputs.
    fn mean_slope(&self, unit: &[f64], scaled: &[f64], slopes: &[f64]) -> Matrix {
        let q = self.outputs();
        let by_feature: Vec<Vec<f64>> = (0..self.features.len())
            .map(|f| {
                let row = self.feature_row(f);
                let pull: Vec<f64> = (0..slopes.len())
                    .map(|i| slopes[i] * (row[i] - scaled[f]) * self.inverse_scale[f])
                    .collect();
                wide(Combine { gp: self, factors: &pull })
            })
            .collect();
        let jacobian = self.features.jacobian(unit);
        let mut slope = Matrix::zeros(q, unit.len());
        for (f, column) in by_feature.iter().enumerate() {
            for (i, &weight) in jacobian.row(f).iter().enumerate() {
                if weight != 0.0 {
                    for o in 0..q {
                        slope.set(o, i, slope.get(o, i) + weight * column[o]);
                    }
                }
            }
        }
        slope
    }

    /// Gradient, in unit coordinates of the first point, of the posterior
    /// covariance of a single output with a point of a block.
    pub(crate) fn covariance_slope(
        &self,
        unit: &[f64],
        other: &[f64],
        block: &Block,
        at: usize,
    ) -> Vec<f64> {
        let (scaled, _, slopes) = self.correlate(unit);
        let mut solved: Vec<f64> =
            (0..self.len()).map(|i| block.whitened[i * block.count + at]).collect();
        self.solved.factor.solve_upper_wide(&mut solved);
        let there: Vec<f64> =
            self.features.of(other).iter().zip(&self.inverse_scale).map(|(z, s)| z * s).collect();
        let mut r2 = [scaled.iter().zip(&there).map(|(a, b)| (a - b) * (a - b)).sum()];
        let mut direct = [0.0];
        self.options.kernel.evaluate(&mut r2, &mut direct);
        let by_feature: Vec<f64> = (0..self.features.len())
            .map(|f| {
                let row = self.feature_row(f);
                let known: f64 =
                    (0..solved.len()).map(|i| solved[i] * slopes[i] * (row[i] - scaled[f])).sum();
                (direct[0] * (there[f] - scaled[f]) - known) * self.inverse_scale[f]
            })
            .collect();
        let variance = self.signal_variance();
        let slope = self.features.jacobian(unit).transpose_times(&by_feature);
        slope.iter().map(|s| variance * s).collect()
    }

    /// Prior variance of the first output.
    pub(crate) fn signal_variance(&self) -> f64 {
        self.data.scaling[0].spread.powi(2) * self.solved.variance[0]
    }

    fn feature_row(&self, feature: usize) -> &[f64] {
        let n = self.data.len();
        &self.scaled[feature * n..(feature + 1) * n]
    }

    /// Means of the outputs in their units.
    fn output_mean(&self, output: usize) -> f64 {
        let scaling = self.data.scaling[output];
        scaling.centre + scaling.spread * self.solved.mean[output]
    }

    /// Predicts points of the unit cube together.
    pub(crate) fn block(&self, unit: &[Vec<f64>]) -> Block {
        wide(Predict { gp: self, unit })
    }

    /// Prior covariance, in units of the signal variance, between one point of
    /// a block and all points of another, into `out`.
    #[inline(always)]
    pub(crate) fn prior_row(
        &self,
        a: &Block,
        i: usize,
        b: &Block,
        out: &mut [f64],
        spare: &mut [f64],
    ) {
        out.fill(0.0);
        for f in 0..self.features.len() {
            let z = a.scaled[f * a.count + i];
            for (r2, w) in out.iter_mut().zip(&b.scaled[f * b.count..(f + 1) * b.count]) {
                *r2 += (z - w) * (z - w);
            }
        }
        self.options.kernel.evaluate(out, spare);
    }
}

/// Covariances of one point with the observations, and kernel slopes.
struct Correlate<'a> {
    gp: &'a GaussianProcess,
    scaled: &'a [f64],
}

impl NullaryFnOnce for Correlate<'_> {
    type Output = (Vec<f64>, Vec<f64>);

    #[inline(always)]
    fn call(self) -> Self::Output {
        let n = self.gp.data.len();
        let mut k = vec![0.0; n];
        let mut slopes = vec![0.0; n];
        for (z, row) in self.scaled.iter().zip(self.gp.scaled.chunks_exact(n)) {
            for (r2, w) in k.iter_mut().zip(row) {
                *r2 += (z - w) * (z - w);
            }
        }
        self.gp.options.kernel.evaluate(&mut k, &mut slopes);
        (k, slopes)
    }
}

/// Predicted means.
struct Mean<'a> {
    gp: &'a GaussianProcess,
    k: &'a [f64],
}

impl NullaryFnOnce for Mean<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn call(self) -> Vec<f64> {
        let mut mean: Vec<f64> = (0..self.gp.outputs()).map(|o| self.gp.output_mean(o)).collect();
        combine(self.gp, self.k, &mut mean);
        mean
    }
}

/// `Σ_i f_i·weights_i` for each output.
struct Combine<'a> {
    gp: &'a GaussianProcess,
    factors: &'a [f64],
}

impl NullaryFnOnce for Combine<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn call(self) -> Vec<f64> {
        let mut sum = vec![0.0; self.gp.outputs()];
        combine(self.gp, self.factors, &mut sum);
        sum
    }
}

#[inline(always)]
fn combine(gp: &GaussianProcess, factors: &[f64], sum: &mut [f64]) {
    let q = sum.len();
    if q == 1 {
        sum[0] += lanes_dot(factors, &gp.weights);
        return;
    }
    subtract_rows(sum, 0..factors.len(), |i| -factors[i], |i| &gp.weights[i * q..(i + 1) * q]);
}

/// `U⁻ᵀ·k` in place.
struct Whiten<'a> {
    gp: &'a GaussianProcess,
    k: &'a mut [f64],
}

impl NullaryFnOnce for Whiten<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.gp.solved.factor.solve_lower(self.k);
    }
}

/// Predictions of many points.
struct Predict<'a> {
    gp: &'a GaussianProcess,
    unit: &'a [Vec<f64>],
}

impl NullaryFnOnce for Predict<'_> {
    type Output = Block;

    #[inline(always)]
    fn call(self) -> Block {
        let Self { gp, unit } = self;
        let (n, q, count) = (gp.data.len(), gp.outputs(), unit.len());
        let features: Vec<Vec<f64>> = unit.iter().map(|u| gp.features.of(u)).collect();
        let scaled: Vec<f64> = (0..gp.features.len())
            .flat_map(|f| features.iter().map(move |z| z[f] * gp.inverse_scale[f]))
            .collect();
        let mut whitened = vec![0.0; n * count];
        let mut spare = vec![0.0; count];
        for (i, row) in whitened.chunks_exact_mut(count).enumerate() {
            for (f, points) in scaled.chunks_exact(count).enumerate() {
                let z = gp.scaled[f * n + i];
                for (r2, w) in row.iter_mut().zip(points) {
                    *r2 += (z - w) * (z - w);
                }
            }
            gp.options.kernel.evaluate(row, &mut spare);
        }
        let mut mean = vec![0.0; q * count];
        for (o, mean) in mean.chunks_exact_mut(count).enumerate() {
            mean.fill(gp.output_mean(o));
            subtract_rows(
                mean,
                0..n,
                |i| -gp.weights[i * q + o],
                |i| &whitened[i * count..(i + 1) * count],
            );
        }
        gp.solved.factor.solve_lower_many(&mut whitened, count);
        let mut share = vec![1.0; count];
        for row in whitened.chunks_exact(count) {
            for (s, v) in share.iter_mut().zip(row) {
                *s -= v * v;
            }
        }
        for s in &mut share {
            *s = s.max(0.0);
        }
        Block { count, mean, share, whitened, scaled }
    }
}
