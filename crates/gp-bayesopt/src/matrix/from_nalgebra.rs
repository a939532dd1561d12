//! To and from the matrices of nalgebra.

use nalgebra::DMatrix;

use super::Matrix;

impl From<&DMatrix<f64>> for Matrix {
    /// Copies the entries.
    fn from(matrix: &DMatrix<f64>) -> Self {
        let mut copy = Self::zeros(matrix.nrows(), matrix.ncols());
        for i in 0..copy.rows {
            for j in 0..copy.columns {
                copy.set(i, j, matrix[(i, j)]);
            }
        }
        copy
    }
}

impl From<&Matrix> for DMatrix<f64> {
    /// Copies the entries.
    fn from(matrix: &Matrix) -> Self {
        Self::from_row_slice(matrix.rows(), matrix.columns(), matrix.as_slice())
    }
}
