//! To and from the matrices of ndarray.

use ndarray::{Array2, ArrayView2, ShapeBuilder};

use super::{Matrix, MatrixError};
use crate::Snapshots;

impl TryFrom<ArrayView2<'_, f64>> for Matrix {
    type Error = MatrixError;

    /// Copies the values, whatever their order in memory; refuses an empty matrix, NaN and
    /// infinities.
    fn try_from(array: ArrayView2<'_, f64>) -> Result<Self, MatrixError> {
        let (rows, columns) = array.dim();
        // the transpose in logical order: column after column
        Self::from_column_major(rows, columns, array.t().iter().copied().collect())
    }
}

impl From<&Matrix> for Array2<f64> {
    /// Copies the values; the array is stored column after column.
    fn from(matrix: &Matrix) -> Self {
        let shape = (matrix.rows(), matrix.columns()).f();
        Self::from_shape_vec(shape, matrix.values().to_vec())
            .expect("a matrix holds rows times columns values")
    }
}

impl TryFrom<ArrayView2<'_, f64>> for Snapshots {
    type Error = MatrixError;

    /// Takes each column as a snapshot; refuses as [`Matrix`] does.
    fn try_from(array: ArrayView2<'_, f64>) -> Result<Self, MatrixError> {
        Matrix::try_from(array).map(Self::from)
    }
}

impl From<&Snapshots> for Array2<f64> {
    /// Copies the values, one snapshot a column.
    fn from(snapshots: &Snapshots) -> Self {
        snapshots.matrix().into()
    }
}
