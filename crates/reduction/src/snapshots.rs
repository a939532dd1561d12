use crate::{Matrix, MatrixError};

/// Signals side by side: one column a snapshot, one row a measurement location.
///
/// At least one row and one column, all values finite. Dynamic mode
/// decomposition reads the columns as a sequence, so their order matters there
/// (FREEDOM paper, eq. 1); nothing in this crate reorders them.
///
/// # Examples
///
/// ```
/// use reduction::Snapshots;
///
/// let snapshots = Snapshots::from_columns(&[[0.0, 1.0, 2.0], [0.0, 2.0, 4.0]])?;
/// assert_eq!((snapshots.locations(), snapshots.count()), (3, 2));
/// assert_eq!(snapshots.mean(), [0.0, 1.5, 3.0]);
/// # Ok::<_, reduction::MatrixError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshots(Matrix);

impl Snapshots {
    /// Joins signals of equal length.
    ///
    /// # Errors
    ///
    /// [`MatrixError`] when there is no value, lengths differ or a value is not
    /// finite.
    pub fn from_columns<C: AsRef<[f64]>>(columns: &[C]) -> Result<Self, MatrixError> {
        Matrix::from_columns(columns).map(Self)
    }

    /// Takes `locations · count` values, signal after signal.
    ///
    /// # Errors
    ///
    /// As [`Matrix::from_column_major`].
    pub fn from_column_major(
        locations: usize,
        count: usize,
        values: Vec<f64>,
    ) -> Result<Self, MatrixError> {
        Matrix::from_column_major(locations, count, values).map(Self)
    }

    /// Evaluates `value(location, snapshot)` everywhere.
    ///
    /// # Errors
    ///
    /// As [`Matrix::from_fn`].
    pub fn from_fn(
        locations: usize,
        count: usize,
        value: impl FnMut(usize, usize) -> f64,
    ) -> Result<Self, MatrixError> {
        Matrix::from_fn(locations, count, value).map(Self)
    }

    /// Number of measurement locations, `n_e` of the FREEDOM paper.
    pub fn locations(&self) -> usize {
        self.0.rows()
    }

    /// Number of snapshots, `n_s` of the FREEDOM paper.
    pub fn count(&self) -> usize {
        self.0.columns()
    }

    /// One snapshot.
    ///
    /// # Panics
    ///
    /// If there is no such snapshot.
    pub fn snapshot(&self, index: usize) -> &[f64] {
        self.0.column(index)
    }

    /// The snapshots as a matrix.
    pub fn matrix(&self) -> &Matrix {
        &self.0
    }

    /// Mean over the snapshots at each location.
    pub fn mean(&self) -> Vec<f64> {
        let count = self.count() as f64;
        let mut mean = vec![0.0; self.locations()];
        for index in 0..self.count() {
            for (sum, value) in mean.iter_mut().zip(self.snapshot(index)) {
                *sum += value / count;
            }
        }
        mean
    }

    /// The snapshots less a signal, usually their [mean](Self::mean).
    ///
    /// # Panics
    ///
    /// If `signal` has another length than the snapshots.
    #[must_use]
    pub fn less(&self, signal: &[f64]) -> Self {
        assert_eq!(signal.len(), self.locations(), "signal and snapshots differ in length");
        let mut values = self.0.values().to_vec();
        for column in values.chunks_exact_mut(signal.len()) {
            for (value, offset) in column.iter_mut().zip(signal) {
                *value -= offset;
            }
        }
        Self(Matrix::raw(self.locations(), self.count(), values))
    }

    /// Snapshots in another order.
    ///
    /// # Panics
    ///
    /// If `order` names a snapshot that is not there.
    #[must_use]
    pub fn reordered(&self, order: &[usize]) -> Self {
        let values = order.iter().flat_map(|&index| self.snapshot(index)).copied().collect();
        Self(Matrix::raw(self.locations(), order.len(), values))
    }
}

impl From<Matrix> for Snapshots {
    fn from(matrix: Matrix) -> Self {
        Self(matrix)
    }
}
