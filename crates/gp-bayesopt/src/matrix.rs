//! A dense matrix that crosses the crate's border without a foreign type.

#[cfg(feature = "nalgebra")]
mod from_nalgebra;
#[cfg(feature = "ndarray")]
mod from_ndarray;

use crate::error::MatrixError;

/// A dense matrix of `f64`, stored row by row.
///
/// # Examples
///
/// ```
/// use gp_bayesopt::Matrix;
///
/// let jacobian = Matrix::from_rows(&[vec![1.0, 2.0], vec![3.0, 4.0]])?;
/// assert_eq!(jacobian.get(1, 0), 3.0);
/// # Ok::<_, gp_bayesopt::MatrixError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix {
    rows: usize,
    columns: usize,
    values: Vec<f64>,
}

impl Matrix {
    /// A matrix of zeros.
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self { rows, columns, values: vec![0.0; rows * columns] }
    }

    /// A matrix from its values, row by row.
    ///
    /// # Errors
    /// [`MatrixError::Shape`] when `values` does not hold `rows · columns` numbers.
    pub fn from_vec(rows: usize, columns: usize, values: Vec<f64>) -> Result<Self, MatrixError> {
        if values.len() != rows * columns {
            return Err(MatrixError::Shape { expected: rows * columns, found: values.len() });
        }
        Ok(Self { rows, columns, values })
    }

    /// A matrix from its rows.
    ///
    /// # Errors
    /// [`MatrixError::Shape`] when the rows differ in length.
    pub fn from_rows(rows: &[Vec<f64>]) -> Result<Self, MatrixError> {
        let columns = rows.first().map_or(0, Vec::len);
        if let Some(odd) = rows.iter().find(|row| row.len() != columns) {
            return Err(MatrixError::Shape { expected: columns, found: odd.len() });
        }
        Ok(Self { rows: rows.len(), columns, values: rows.concat() })
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The entry in row `row` and column `column`.
    ///
    /// # Panics
    /// When an index is out of range.
    pub fn get(&self, row: usize, column: usize) -> f64 {
        assert!(column < self.columns, "column {column} of {}", self.columns);
        self.values[row * self.columns + column]
    }

    /// Writes the entry in row `row` and column `column`.
    ///
    /// # Panics
    /// When an index is out of range.
    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        assert!(column < self.columns, "column {column} of {}", self.columns);
        self.values[row * self.columns + column] = value;
    }

    /// One row.
    ///
    /// # Panics
    /// When `row` is out of range.
    pub fn row(&self, row: usize) -> &[f64] {
        &self.values[row * self.columns..(row + 1) * self.columns]
    }

    /// One row, to be written.
    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [f64] {
        &mut self.values[row * self.columns..(row + 1) * self.columns]
    }

    /// All rows, in the form in which points are given to a fit.
    pub fn to_rows(&self) -> Vec<Vec<f64>> {
        (0..self.rows).map(|row| self.row(row).to_vec()).collect()
    }

    /// All entries, row by row.
    pub fn as_slice(&self) -> &[f64] {
        &self.values
    }

    /// The matrix times a vector.
    pub(crate) fn times(&self, vector: &[f64]) -> Vec<f64> {
        (0..self.rows).map(|i| dot(self.row(i), vector)).collect()
    }

    /// The transposed matrix times a vector.
    pub(crate) fn transpose_times(&self, vector: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.columns];
        for (i, &v) in vector.iter().enumerate() {
            for (o, &a) in out.iter_mut().zip(self.row(i)) {
                *o += a * v;
            }
        }
        out
    }

    /// `AᵀA`, both halves filled.
    pub(crate) fn gram(&self) -> Self {
        let mut gram = Self::zeros(self.columns, self.columns);
        for i in 0..self.rows {
            let row = self.row(i);
            for (a, &x) in row.iter().enumerate() {
                for (g, &y) in gram.row_mut(a).iter_mut().zip(row) {
                    *g += x * y;
                }
            }
        }
        gram
    }
}

/// The inner product, summed from left to right.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// The Euclidean norm, safe from overflow and underflow; NaN with a NaN inside.
pub(crate) fn norm(v: &[f64]) -> f64 {
    // unlike f64::max this lets NaN through
    let larger = |m: f64, x: &f64| if x.is_nan() || x.abs() > m { x.abs() } else { m };
    let scale = v.iter().fold(0.0_f64, larger);
    if scale == 0.0 || !scale.is_finite() {
        return scale;
    }
    let sum: f64 = v.iter().map(|x| (x / scale) * (x / scale)).sum();
    scale * sum.sqrt()
}
