//! Linear estimators by generalised least squares.
//!
//! ```text
//! δ = (JᵀΣ⁻¹J)⁻¹·JᵀΣ⁻¹·r
//! ```
//!
//! with `J` the slopes of a signal, one row a coordinate, and `Σ` the covariance of a residual `r`.
//!
//! # Source
//!
//! Aitken's estimator (Proc. R. Soc. Edinburgh 55, 1935); see `docs/models/diagnosis.md`.

use inference::dot;
use nalgebra::{DMatrix, DVector};

use crate::offline::factor::Factor;

/// A linear estimator: `δ = (JᵀΣ⁻¹J)⁻¹·JᵀΣ⁻¹·r`, one weight vector a coordinate.
pub(crate) struct Estimator {
    weights: Vec<Vec<f64>>,
}

impl Estimator {
    /// Estimators for several Jacobians of equal size on one factor.
    ///
    /// `None` when one of them leaves a coordinate undetermined.
    pub(crate) fn each(factor: &Factor, jacobians: &[&[Vec<f64>]]) -> Option<Vec<Self>> {
        let order = jacobians.first().map_or(0, |jacobian| jacobian.len());
        let samples = jacobians.first().and_then(|j| j.first()).map_or(0, Vec::len);
        let white = factor.whiten_each(jacobians.iter().flat_map(|jacobian| jacobian.iter()));
        let inverses: Vec<DMatrix<f64>> = white
            .chunks(order.max(1))
            .map(|rows| gram(rows).try_inverse())
            .collect::<Option<_>>()?;
        let solved = factor.spread_each(white, samples);
        let estimators = inverses.iter().zip(solved.chunks(order.max(1)));
        Some(
            estimators
                .map(|(inverse, solved)| Self { weights: combined(inverse, solved) })
                .collect(),
        )
    }

    /// Weights of a coordinate.
    pub(crate) fn weight(&self, coordinate: usize) -> &[f64] {
        &self.weights[coordinate]
    }

    pub(crate) fn apply(&self, residual: &[f64]) -> DVector<f64> {
        DVector::from_iterator(
            self.weights.len(),
            self.weights.iter().map(|weight| dot(weight, residual)),
        )
    }
}

/// Rows that a square matrix makes of rows.
pub(crate) fn combined(matrix: &DMatrix<f64>, rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let samples = rows.first().map_or(0, Vec::len);
    let row = |i: usize| {
        let mut sum = vec![0.0; samples];
        for (j, x) in rows.iter().enumerate() {
            for (value, x) in sum.iter_mut().zip(x) {
                *value += matrix[(i, j)] * x;
            }
        }
        sum
    };
    (0..rows.len()).map(row).collect()
}

/// `JᵀΣ⁻¹J`.
pub(crate) fn information(factor: &Factor, jacobian: &[Vec<f64>]) -> DMatrix<f64> {
    gram(&factor.whiten_each(jacobian.iter()))
}

/// Scalar products of rows.
pub(crate) fn gram(rows: &[Vec<f64>]) -> DMatrix<f64> {
    symmetric(rows.len(), |i, j| dot(&rows[i], &rows[j]))
}

/// A symmetric matrix from its lower half.
pub(crate) fn symmetric(order: usize, element: impl Fn(usize, usize) -> f64) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(order, order);
    for i in 0..order {
        for j in 0..=i {
            let value = element(i, j);
            matrix[(i, j)] = value;
            matrix[(j, i)] = value;
        }
    }
    matrix
}
