//! The likelihood of the data, with mean and variance of each output profiled out.

#![expect(
    clippy::inline_always,
    reason = "kernels are compiled once for each instruction set, which inlining makes possible"
)]

use std::f64::consts::TAU;

use pulp::NullaryFnOnce;

use super::data::Data;
use crate::{
    features::Features,
    kernel::Kernel,
    linalg::{Factor, factor, lanes_dot, subtract_rows, wide},
};

/// Smallest signal variance of a standardised output; below it an output
/// counts as constant up to rounding.
const VARIANCE_FLOOR: f64 = 1e-30;

/// Solution for one set of hyperparameters.
#[derive(Clone, Debug)]
pub(super) struct Solved {
    pub(super) factor: Factor,
    /// `K⁻¹·(y − m)`, one column after another.
    pub(super) alpha: Vec<f64>,
    /// Profiled mean of each standardised output.
    pub(super) mean: Vec<f64>,
    /// Profiled signal variance of each standardised output; zero when constant.
    pub(super) variance: Vec<f64>,
    /// Log-likelihood of the standardised data.
    pub(super) ln_likelihood: f64,
}

/// The likelihood as a function of the hyperparameters.
///
/// ```text
/// y_o ~ N(m_o·1, s_o²·K),   K = C(ℓ) + (g + jitter)·I
/// m_o = 1ᵀK⁻¹y_o / 1ᵀK⁻¹1,   s_o² = (y_o−m_o)ᵀK⁻¹(y_o−m_o)/n
/// ln L = −½·Σ_o [n·ln s_o² + ln det K + n·(1 + ln 2π)]
/// ∂ln L/∂θ = −½·Σ_ij W_ij·∂K_ij/∂θ,   W = q·K⁻¹ − Σ_o α_o·α_oᵀ/s_o²
/// ```
///
/// Squared differences of each length scale are kept, upper half packed row
/// by row, so that one evaluation costs one Cholesky and one inverse.
#[derive(Clone, Debug)]
pub(super) struct Evidence<'a> {
    data: &'a Data,
    kernel: Kernel,
    /// Squared differences, one packed triangle for each length scale.
    squares: Vec<Vec<f64>>,
    /// The noise ratio when it is given; else it is the last hyperparameter.
    fixed_noise: Option<f64>,
    jitter: f64,
}

impl<'a> Evidence<'a> {
    /// Prepares the squared differences. `fixed_noise` is the ratio of noise
    /// to signal variance when that is not fitted.
    pub(super) fn new(
        data: &'a Data,
        features: &Features,
        kernel: Kernel,
        fixed_noise: Option<f64>,
    ) -> Self {
        let n = data.len();
        let mut squares = vec![vec![0.0; n * (n - 1) / 2]; features.scales()];
        for (feature, &group) in features.groups().iter().enumerate() {
            let column: Vec<f64> = data.features.iter().map(|z| z[feature]).collect();
            let mut at = 0;
            for i in 0..n {
                for (slot, z) in squares[group][at..].iter_mut().zip(&column[i + 1..]) {
                    *slot += (column[i] - z) * (column[i] - z);
                }
                at += n - 1 - i;
            }
        }
        Self { data, kernel, squares, fixed_noise, jitter: 0.0 }
    }

    /// Adds a jitter to the diagonal.
    pub(super) fn with_jitter(mut self, jitter: f64) -> Self {
        self.jitter = jitter;
        self
    }

    /// Number of length scales.
    fn scales(&self) -> usize {
        self.squares.len()
    }

    /// The noise ratio of some hyperparameters.
    pub(super) fn noise(&self, theta: &[f64]) -> f64 {
        self.fixed_noise.unwrap_or_else(|| libm::exp(theta[self.scales()]))
    }

    /// Everything at `theta` (logarithms of the length scales, then of the
    /// noise ratio if that is fitted). Fails with the pivot that broke.
    pub(super) fn solve(&self, theta: &[f64]) -> Result<Solved, f64> {
        let mut memory = Memory::default();
        wide(Covariance { evidence: self, theta, memory: &mut memory });
        self.solve_with(memory.matrix)
    }

    fn solve_with(&self, matrix: Vec<f64>) -> Result<Solved, f64> {
        Ok(profile(self.data, factor(matrix, self.data.len())?))
    }

    /// Log-likelihood and gradient, `None` when the covariance is indefinite.
    pub(super) fn value_and_gradient(
        &self,
        theta: &[f64],
        memory: &mut Memory,
    ) -> Option<(f64, Vec<f64>)> {
        wide(Covariance { evidence: self, theta, memory });
        let solved = self.solve_with(std::mem::take(&mut memory.matrix)).ok()?;
        let gradient = wide(Gradient { evidence: self, theta, solved: &solved, memory });
        memory.matrix = solved.factor.into_buffer();
        Some((solved.ln_likelihood, gradient))
    }
}

/// Memory that one evaluation leaves to the next.
#[derive(Debug, Default)]
pub(super) struct Memory {
    matrix: Vec<f64>,
    r2: Vec<f64>,
    slopes: Vec<f64>,
    triangle: Vec<f64>,
    inverse: Vec<f64>,
}

/// Means, variances and likelihood for a factored covariance.
pub(super) fn profile(data: &Data, factor: Factor) -> Solved {
    let (n, q) = (data.len(), data.outputs());
    let mut ones = vec![1.0; n];
    factor.solve(&mut ones);
    let total: f64 = ones.iter().sum();
    let mut alpha = data.columns.clone();
    let (mut mean, mut variance) = (vec![0.0; q], vec![0.0; q]);
    let mut ln_variances = 0.0;
    let mut varying = 0;
    for (o, alpha) in alpha.chunks_exact_mut(n).enumerate() {
        if data.scaling[o].spread == 0.0 {
            continue;
        }
        let y = &data.columns[o * n..(o + 1) * n];
        mean[o] = lanes_dot(&ones, y) / total;
        for a in alpha.iter_mut() {
            *a -= mean[o];
        }
        factor.solve(alpha);
        // (y − m)ᵀα = yᵀα, because 1ᵀα = 0
        variance[o] = (lanes_dot(y, alpha) / n as f64).max(VARIANCE_FLOOR);
        ln_variances += libm::log(variance[o]);
        varying += 1;
    }
    let count = f64::from(varying);
    let ln_likelihood = -0.5 * n as f64 * (ln_variances + count * (1.0 + libm::log(TAU)))
        - count * factor.half_ln_det();
    Solved { factor, alpha, mean, variance, ln_likelihood }
}

/// Fills the covariance and the kernel's slopes.
struct Covariance<'a, 'b> {
    evidence: &'b Evidence<'a>,
    theta: &'b [f64],
    memory: &'b mut Memory,
}

impl NullaryFnOnce for Covariance<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { evidence, theta, memory: Memory { matrix, r2, slopes, .. } } = self;
        let n = evidence.data.len();
        r2.clear();
        r2.resize(n * (n - 1) / 2, 0.0);
        slopes.resize(r2.len(), 0.0);
        for (squares, theta) in evidence.squares.iter().zip(theta) {
            let weight = libm::exp(-2.0 * theta);
            for (r2, s) in r2.iter_mut().zip(squares) {
                *r2 += weight * s;
            }
        }
        evidence.kernel.evaluate(r2, slopes);
        let diagonal = 1.0 + evidence.noise(theta) + evidence.jitter;
        matrix.resize(n * n, 0.0);
        let mut at = 0;
        for i in 0..n {
            matrix[i * n + i] = diagonal;
            let width = n - 1 - i;
            matrix[i * n + i + 1..(i + 1) * n].copy_from_slice(&r2[at..at + width]);
            at += width;
        }
    }
}

/// The gradient from the factor.
struct Gradient<'a, 'b> {
    evidence: &'b Evidence<'a>,
    theta: &'b [f64],
    solved: &'b Solved,
    memory: &'b mut Memory,
}

impl NullaryFnOnce for Gradient<'_, '_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn call(self) -> Vec<f64> {
        let Self { evidence, theta, solved, memory } = self;
        let Memory { slopes, triangle, inverse: w, .. } = memory;
        let n = evidence.data.len();
        let varying: Vec<usize> =
            (0..solved.variance.len()).filter(|&o| solved.variance[o] > 0.0).collect();
        let count = varying.len() as f64;
        solved.factor.inverse_upper_into(triangle, w);
        let mut trace = 0.0;
        let mut at = 0;
        for i in 0..n {
            let row = &mut w[i * n + i..(i + 1) * n];
            for v in row.iter_mut() {
                *v *= count;
            }
            let column = |o: usize| &solved.alpha[o * n + i..(o + 1) * n];
            subtract_rows(
                row,
                0..varying.len(),
                |v| column(varying[v])[0] / solved.variance[varying[v]],
                |v| column(varying[v]),
            );
            trace += row[0];
            let width = n - 1 - i;
            for (s, v) in slopes[at..at + width].iter_mut().zip(&row[1..]) {
                *s *= v;
            }
            at += width;
        }
        let mut gradient: Vec<f64> = evidence
            .squares
            .iter()
            .zip(theta)
            .map(|(squares, theta)| -libm::exp(-2.0 * theta) * lanes_dot(slopes, squares))
            .collect();
        if evidence.fixed_noise.is_none() {
            gradient.push(-0.5 * evidence.noise(theta) * trace);
        }
        gradient
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{bounds::Bounds, design::Design, matrix::Matrix};

    /// Richardson's extrapolation of central differences in `ln ℓ`: truncation of order `h⁴` =
    /// 1e-12 times a fifth derivative; rounding of a likelihood of 30 data with condition below
    /// 1e4, 30·1e4·ε/h = 1e-7.
    const RICHARDSON_REL: f64 = 1e-6;
    const H: f64 = 1e-3;

    #[test]
    fn property_slopes_are_those_of_the_likelihood() {
        let bounds = Bounds::new(&[0.0, -1.0, 0.0, 0.0], &[2.0, 1.0, 1.0, 1.0])
            .and_then(|b| b.with_periodic(1))
            .and_then(|b| b.with_polar(2, 3))
            .unwrap();
        let points = Design::Sobol.points(&bounds, 30, 3).unwrap();
        let rows: Vec<Vec<f64>> = points
            .iter()
            .map(|x| {
                vec![(3.0 * x[0]).sin() + x[2] * (TAU * x[3]).cos(), x[0] * (3.0 * x[1]).cos()]
            })
            .collect();
        let features = Features::new(&bounds);
        let outputs = Matrix::from_rows(&rows).unwrap();
        let data = Data::new(&bounds, &features, &points, &outputs).unwrap();
        for kernel in [Kernel::SquaredExponential, Kernel::Matern32, Kernel::Matern52] {
            for fixed_noise in [None, Some(1e-3)] {
                let evidence = Evidence::new(&data, &features, kernel, fixed_noise);
                let mut theta = vec![-0.5, -1.2, -0.3, 0.2];
                theta.extend(fixed_noise.is_none().then_some(-6.0));
                let at = |theta: &[f64]| {
                    evidence.value_and_gradient(theta, &mut Memory::default()).unwrap()
                };
                let (_, gradient) = at(&theta);
                assert_eq!(gradient.len(), theta.len());
                let scale = gradient.iter().fold(0.0_f64, |m, g| m.max(g.abs()));
                for (i, g) in gradient.iter().enumerate() {
                    let central = |h: f64| {
                        let side = |sign: f64| {
                            let mut moved = theta.clone();
                            moved[i] += sign * h;
                            at(&moved).0
                        };
                        (side(1.0) - side(-1.0)) / (2.0 * h)
                    };
                    let slope = (4.0 * central(0.5 * H) - central(H)) / 3.0;
                    let error = (slope - g).abs() / scale;
                    assert!(error < RICHARDSON_REL, "{kernel:?} {i}: {slope} {g} {error:e}");
                }
            }
        }
    }
}
