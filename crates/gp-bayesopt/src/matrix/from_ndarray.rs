//! To and from the matrices of ndarray.

use ndarray::{Array2, ArrayView2};

use super::Matrix;

impl From<ArrayView2<'_, f64>> for Matrix {
    /// Copies the entries, whatever their order in memory.
    fn from(array: ArrayView2<'_, f64>) -> Self {
        let (rows, columns) = array.dim();
        // ndarray iterates in logical order: row by row
        Self { rows, columns, values: array.iter().copied().collect() }
    }
}

impl From<&Matrix> for Array2<f64> {
    /// Copies the entries, row by row.
    fn from(matrix: &Matrix) -> Self {
        let shape = (matrix.rows(), matrix.columns());
        Self::from_shape_vec(shape, matrix.as_slice().to_vec())
            .expect("a matrix holds rows times columns entries")
    }
}
