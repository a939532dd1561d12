//! Small symmetric matrices, and systems that are semidefinite.

use nalgebra::{DMatrix, DVector};

/// A small dense symmetric matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct SymmetricMatrix {
    elements: DMatrix<f64>,
}

impl SymmetricMatrix {
    /// The matrix of a function of row and column; both sides of the diagonal are kept as given.
    pub fn from_fn(order: usize, element: impl FnMut(usize, usize) -> f64) -> Self {
        Self { elements: DMatrix::from_fn(order, order, element) }
    }

    /// Rows and columns.
    pub fn order(&self) -> usize {
        self.elements.nrows()
    }

    /// Element of a row and a column.
    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.elements[(row, column)]
    }

    /// Solves a positive semidefinite system; what has no size gets no weight.
    ///
    /// Rows and columns are scaled to a diagonal of one, to which 1e-10 is added: a system of
    /// dependent columns stays regular. An indefinite system has the answer zero.
    ///
    /// # Panics
    ///
    /// When the length is not the matrix order.
    pub fn solve_semidefinite(&self, right: &[f64]) -> Vec<f64> {
        assert_eq!(right.len(), self.order());
        solve(&self.elements, &DVector::from_column_slice(right)).data.into()
    }

    /// All elements.
    pub(crate) fn elements(&self) -> &DMatrix<f64> {
        &self.elements
    }
}

/// [`SymmetricMatrix::solve_semidefinite`] within the crate.
pub(crate) fn solve(matrix: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let n = right.len();
    let scale: Vec<f64> = (0..n)
        .map(|i| if matrix[(i, i)] > 0.0 { 1.0 / libm::sqrt(matrix[(i, i)]) } else { 0.0 })
        .collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| {
        let jitter = if i != j {
            0.0
        } else if scale[i] > 0.0 {
            1e-10
        } else {
            1.0
        };
        matrix[(i, j)] * scale[i] * scale[j] + jitter
    });
    let b = DVector::from_fn(n, |i, _| right[i] * scale[i]);
    match scaled.cholesky() {
        Some(factor) => {
            let solution = factor.solve(&b);
            DVector::from_fn(n, |i, _| solution[i] * scale[i])
        }
        None => DVector::zeros(n),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of a solution that the addition to the diagonal takes, with room.
    const REGULAR_REL: f64 = 1e-8;

    #[test]
    fn a_column_without_size_gets_no_weight() {
        let matrix =
            SymmetricMatrix::from_fn(3, |i, j| [[4.0, 0.0, 1.0], [0.0; 3], [1.0, 0.0, 2.0]][i][j]);
        let at = matrix.solve_semidefinite(&[6.0, 5.0, 5.0]);
        assert!((at[0] - 1.0).abs() < REGULAR_REL && (at[2] - 2.0).abs() < REGULAR_REL, "{at:?}");
        assert_eq!(at[1], 0.0);
    }

    #[test]
    fn an_indefinite_system_has_the_answer_zero() {
        let matrix = SymmetricMatrix::from_fn(2, |i, j| if i == j { 1.0 } else { 2.0 });
        assert_eq!(matrix.solve_semidefinite(&[1.0, 1.0]), [0.0, 0.0]);
    }
}
