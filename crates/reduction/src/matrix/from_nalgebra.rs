//! To and from the matrices of nalgebra, which are stored column after column too.

use nalgebra::DMatrix;

use super::{Matrix, MatrixError};
use crate::Snapshots;

impl TryFrom<&DMatrix<f64>> for Matrix {
    type Error = MatrixError;

    /// Copies the values; refuses an empty matrix, NaN and infinities.
    fn try_from(matrix: &DMatrix<f64>) -> Result<Self, MatrixError> {
        Self::from_column_major(matrix.nrows(), matrix.ncols(), matrix.as_slice().to_vec())
    }
}

impl From<&Matrix> for DMatrix<f64> {
    /// Copies the values.
    fn from(matrix: &Matrix) -> Self {
        Self::from_column_slice(matrix.rows(), matrix.columns(), matrix.values())
    }
}

impl TryFrom<&DMatrix<f64>> for Snapshots {
    type Error = MatrixError;

    /// Takes each column as a snapshot; refuses as [`Matrix`] does.
    fn try_from(matrix: &DMatrix<f64>) -> Result<Self, MatrixError> {
        Matrix::try_from(matrix).map(Self::from)
    }
}

impl From<&Snapshots> for DMatrix<f64> {
    /// Copies the values, one snapshot a column.
    fn from(snapshots: &Snapshots) -> Self {
        snapshots.matrix().into()
    }
}
