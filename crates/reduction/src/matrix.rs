#[cfg(feature = "nalgebra")]
mod from_nalgebra;
#[cfg(feature = "ndarray")]
mod from_ndarray;
#[cfg(feature = "serde")]
mod layout;

use faer::{
    Accum, MatRef, Par,
    linalg::matmul::{matmul, triangular},
};

/// Why numbers could not be taken as a matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MatrixError {
    /// No row or no column.
    #[error("matrix of {rows} rows and {columns} columns is empty")]
    Empty {
        /// Rows given.
        rows: usize,
        /// Columns given.
        columns: usize,
    },
    /// The number of values is not rows times columns.
    #[error("{found} values given for {rows} rows and {columns} columns")]
    Length {
        /// Rows asked for.
        rows: usize,
        /// Columns asked for.
        columns: usize,
        /// Values given.
        found: usize,
    },
    /// Columns of unequal length.
    #[error("column {column} has {found} values where the first has {expected}")]
    Ragged {
        /// Index of the offending column.
        column: usize,
        /// Length of that column.
        found: usize,
        /// Length of the first column.
        expected: usize,
    },
    /// A NaN or an infinity.
    #[error("value at row {row}, column {column} is not finite")]
    NotFinite {
        /// Row of the first such value, in column order.
        row: usize,
        /// Column of that value.
        column: usize,
    },
}

/// A dense matrix of finite numbers, stored column after column.
///
/// # Examples
///
/// ```
/// use reduction::Matrix;
///
/// let matrix = Matrix::from_columns(&[[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])?;
/// assert_eq!((matrix.rows(), matrix.columns()), (2, 3));
/// assert_eq!(matrix.column(1), [3.0, 4.0]);
/// assert_eq!(matrix.get(1, 2), 6.0);
/// # Ok::<_, reduction::MatrixError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "layout::Layout", into = "layout::Layout"))]
pub struct Matrix {
    rows: usize,
    columns: usize,
    values: Vec<f64>,
}

impl Matrix {
    /// Takes `rows · columns` values, column after column.
    ///
    /// # Errors
    ///
    /// [`MatrixError::Empty`], [`MatrixError::Length`], [`MatrixError::NotFinite`].
    pub fn from_column_major(
        rows: usize,
        columns: usize,
        values: Vec<f64>,
    ) -> Result<Self, MatrixError> {
        if rows == 0 || columns == 0 {
            return Err(MatrixError::Empty { rows, columns });
        }
        if rows.checked_mul(columns) != Some(values.len()) {
            return Err(MatrixError::Length { rows, columns, found: values.len() });
        }
        if let Some(at) = values.iter().position(|value| !value.is_finite()) {
            return Err(MatrixError::NotFinite { row: at % rows, column: at / rows });
        }
        Ok(Self { rows, columns, values })
    }

    /// Joins columns of equal length.
    ///
    /// # Errors
    ///
    /// [`MatrixError::Empty`], [`MatrixError::Ragged`], [`MatrixError::NotFinite`].
    pub fn from_columns<C: AsRef<[f64]>>(columns: &[C]) -> Result<Self, MatrixError> {
        let rows = columns.first().map_or(0, |column| column.as_ref().len());
        let mut values = Vec::with_capacity(rows * columns.len());
        for (index, column) in columns.iter().enumerate() {
            let column = column.as_ref();
            if column.len() != rows {
                return Err(MatrixError::Ragged {
                    column: index,
                    found: column.len(),
                    expected: rows,
                });
            }
            values.extend_from_slice(column);
        }
        Self::from_column_major(rows, columns.len(), values)
    }

    /// Evaluates `value(row, column)` everywhere.
    ///
    /// # Errors
    ///
    /// [`MatrixError::Empty`], [`MatrixError::NotFinite`].
    pub fn from_fn(
        rows: usize,
        columns: usize,
        mut value: impl FnMut(usize, usize) -> f64,
    ) -> Result<Self, MatrixError> {
        let values = (0..columns)
            .flat_map(|column| (0..rows).map(move |row| (row, column)))
            .map(|(row, column)| value(row, column))
            .collect();
        Self::from_column_major(rows, columns, values)
    }

    /// Wraps values that this crate computed from finite ones.
    pub(crate) fn raw(rows: usize, columns: usize, values: Vec<f64>) -> Self {
        debug_assert_eq!(values.len(), rows * columns);
        Self { rows, columns, values }
    }

    pub(crate) fn zeros(rows: usize, columns: usize) -> Self {
        Self::raw(rows, columns, vec![0.0; rows * columns])
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// One column.
    ///
    /// # Panics
    ///
    /// If there is no such column.
    pub fn column(&self, column: usize) -> &[f64] {
        &self.values[column * self.rows..(column + 1) * self.rows]
    }

    pub(crate) fn column_mut(&mut self, column: usize) -> &mut [f64] {
        &mut self.values[column * self.rows..(column + 1) * self.rows]
    }

    /// One value.
    ///
    /// # Panics
    ///
    /// If there is no such row or column.
    pub fn get(&self, row: usize, column: usize) -> f64 {
        self.column(column)[row]
    }

    pub(crate) fn set(&mut self, row: usize, column: usize, value: f64) {
        self.values[column * self.rows + row] = value;
    }

    /// One row, gathered.
    ///
    /// # Panics
    ///
    /// If there is no such row.
    pub fn row(&self, row: usize) -> Vec<f64> {
        (0..self.columns).map(|column| self.get(row, column)).collect()
    }

    /// All values, column after column.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Gives the values away, column after column.
    pub fn into_values(self) -> Vec<f64> {
        self.values
    }

    /// The first `count` columns, at most all of them.
    #[must_use]
    pub fn leading_columns(&self, count: usize) -> Self {
        let columns = count.min(self.columns);
        Self::raw(self.rows, columns, self.values[..columns * self.rows].to_vec())
    }

    /// The transpose.
    #[must_use]
    pub fn transposed(&self) -> Self {
        let mut result = Self::zeros(self.columns, self.rows);
        for column in 0..self.columns {
            for (row, &value) in self.column(column).iter().enumerate() {
                result.set(column, row, value);
            }
        }
        result
    }

    /// The product `self · other`.
    ///
    /// # Panics
    ///
    /// If the inner dimensions differ.
    #[must_use]
    pub fn times(&self, other: &Self) -> Self {
        self.product(self.view(), other.view())
    }

    /// The product `selfᵀ · other`.
    ///
    /// # Panics
    ///
    /// If the numbers of rows differ.
    #[must_use]
    pub fn transposed_times(&self, other: &Self) -> Self {
        self.product(self.view().transpose(), other.view())
    }

    /// The product `selfᵀ · self`: its lower triangle, zeros above it.
    pub(crate) fn gram(&self) -> Self {
        let mut result = Self::zeros(self.columns, self.columns);
        triangular::matmul(
            result.view_mut(),
            triangular::BlockStructure::TriangularLower,
            Accum::Replace,
            self.view().transpose(),
            triangular::BlockStructure::Rectangular,
            self.view(),
            triangular::BlockStructure::Rectangular,
            1.0,
            Par::Seq,
        );
        result
    }

    #[expect(clippy::unused_self, reason = "keeps the two products beside one another")]
    fn product(&self, left: MatRef<'_, f64>, right: MatRef<'_, f64>) -> Self {
        let mut result = Self::zeros(left.nrows(), right.ncols());
        matmul(result.view_mut(), Accum::Replace, left, right, 1.0, Par::Seq);
        result
    }

    /// The product with a vector.
    ///
    /// # Panics
    ///
    /// If `vector` is not as long as there are columns.
    pub fn times_vector(&self, vector: &[f64]) -> Vec<f64> {
        assert_eq!(vector.len(), self.columns, "vector and columns differ");
        let mut result = vec![0.0; self.rows];
        for (column, &factor) in vector.iter().enumerate() {
            for (sum, &value) in result.iter_mut().zip(self.column(column)) {
                *sum += factor * value;
            }
        }
        result
    }

    /// The product of the transpose with a vector.
    ///
    /// # Panics
    ///
    /// If `vector` is not as long as there are rows.
    pub fn transposed_times_vector(&self, vector: &[f64]) -> Vec<f64> {
        assert_eq!(vector.len(), self.rows, "vector and rows differ");
        (0..self.columns).map(|column| dot(self.column(column), vector)).collect()
    }

    /// Square root of the sum of all squares.
    pub fn frobenius_norm(&self) -> f64 {
        norm(&self.values)
    }

    pub(crate) fn view(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.values, self.rows, self.columns)
    }

    pub(crate) fn view_mut(&mut self) -> faer::MatMut<'_, f64> {
        faer::MatMut::from_column_major_slice_mut(&mut self.values, self.rows, self.columns)
    }
}

/// Inner product in a fixed order of four interleaved partial sums.
pub(crate) fn dot(left: &[f64], right: &[f64]) -> f64 {
    let mut partial = [0.0; 4];
    let (left_blocks, right_blocks) = (left.chunks_exact(4), right.chunks_exact(4));
    let tail: f64 =
        left_blocks.remainder().iter().zip(right_blocks.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in left_blocks.zip(right_blocks) {
        for lane in 0..4 {
            partial[lane] += a[lane] * b[lane];
        }
    }
    (partial[0] + partial[1]) + (partial[2] + partial[3]) + tail
}

/// Euclidean norm, scaled so that neither large nor small values are lost.
pub(crate) fn norm(values: &[f64]) -> f64 {
    let largest = values.iter().fold(0.0_f64, |top, value| top.max(value.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    if (1e-140..1e140).contains(&largest) {
        return dot(values, values).sqrt();
    }
    largest * values.iter().map(|value| (value / largest).powi(2)).sum::<f64>().sqrt()
}
