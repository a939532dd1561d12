use faer::{
    Par,
    dyn_stack::{MemBuffer, MemStack},
    linalg::cholesky::llt::factor,
    prelude::default,
};

use crate::{Matrix, MatrixError, matrix::dot};

/// Why a noise covariance could not be used.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoiseError {
    /// A variance, or an autocovariance at lag zero, that is not positive.
    #[error("variance {found} at location {location} is not positive")]
    Variance {
        /// The variance given.
        found: f64,
        /// Location it belongs to, 0 where one variance holds for all.
        location: usize,
    },
    /// A white floor that is negative or not finite.
    #[error("white floor of variance {found} is negative or not finite")]
    Floor {
        /// The variance given.
        found: f64,
    },
    /// Sizes differ.
    #[error("covariance of {found} locations where the signals have {expected}")]
    Size {
        /// Size of the covariance.
        found: usize,
        /// Size of the signals.
        expected: usize,
    },
    /// A covariance matrix that is not square.
    #[error("covariance of {rows} rows and {columns} columns is not square")]
    NotSquare {
        /// Rows given.
        rows: usize,
        /// Columns given.
        columns: usize,
    },
    /// A covariance matrix that is not symmetric.
    #[error("covariance differs from its transpose at row {row}, column {column}")]
    NotSymmetric {
        /// Row of the first such pair.
        row: usize,
        /// Column of that value.
        column: usize,
    },
    /// A band of another length than its place asks for.
    #[error("band {lag} has {found} entries where {expected} are needed")]
    Band {
        /// Distance from the diagonal.
        lag: usize,
        /// Entries given.
        found: usize,
        /// Entries needed.
        expected: usize,
    },
    /// No value, or a NaN or an infinity.
    #[error(transparent)]
    Values(#[from] MatrixError),
    /// No Cholesky factor: noise without any part in some direction, where the
    /// information would be infinite. A white floor cures it.
    #[error("noise covariance is not positive definite: pivot {pivot:e} at location {location}")]
    NotPositiveDefinite {
        /// The pivot that was not positive (to rounding).
        pivot: f64,
        /// Location it stands for.
        location: usize,
    },
}

/// A covariance of measurement noise, as a caller states it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum NoiseModel {
    /// Independent, of the same variance everywhere.
    White {
        /// Variance.
        variance: f64,
    },
    /// Independent, one variance a location.
    Diagonal(Vec<f64>),
    /// `Σ_ij = r(|i − j|)`, zero beyond the lags given: filtered stationary noise.
    Stationary {
        /// Autocovariance at lags 0, 1, …
        autocovariance: Vec<f64>,
    },
    /// Zero far from the diagonal: entry `(j + lag, j)` is `bands[lag][j]`, each
    /// band shorter than the one before by one.
    Banded(Vec<Vec<f64>>),
    /// Any symmetric positive definite matrix.
    Dense(Matrix),
    /// `Σ = F·Fᵀ`: a filter `F` applied to white noise of unit variance.
    Factor(Matrix),
}

/// A factored noise covariance `Σ = L·Lᵀ`, `L` lower triangular.
///
/// # Examples
///
/// ```
/// use reduction::{NoiseCovariance, NoiseModel};
///
/// let model = NoiseModel::Stationary { autocovariance: vec![1.0, 0.5] };
/// let noise = NoiseCovariance::new(&model, 4, 0.0)?;
/// assert_eq!(noise.covariance_column(1), [0.5, 1.0, 0.5, 0.0]);
/// # Ok::<_, reduction::NoiseError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct NoiseCovariance {
    size: usize,
    covariance: Covariance,
    lower: Lower,
}

#[derive(Clone, Debug, PartialEq)]
enum Covariance {
    Diagonal(Vec<f64>),
    Banded(Bands),
    Dense(Matrix),
}

#[derive(Clone, Debug, PartialEq)]
enum Lower {
    Diagonal(Vec<f64>),
    Banded(Bands),
    Dense(Matrix),
}

/// The lower half of a banded matrix: `values[lag·size + j]` is entry
/// `(j + lag, j)`.
#[derive(Clone, Debug, PartialEq)]
struct Bands {
    values: Vec<f64>,
    lags: usize,
}

/// Pivots below this fraction of the largest variance are rounding: the
/// backward error of a Cholesky factorisation is some `n·ε`, here for `n` up to
/// 5000.
const PIVOT_REL: f64 = 5000.0 * f64::EPSILON;

impl NoiseCovariance {
    /// Factors a model for signals of `size` locations, with independent noise
    /// of variance `white_floor` added (0 for none).
    ///
    /// A floor is needed where a steep filter leaves directions without noise:
    /// there the factorisation fails, for the information would be infinite.
    ///
    /// # Errors
    ///
    /// Each [`NoiseError`] for what it names.
    pub fn new(model: &NoiseModel, size: usize, white_floor: f64) -> Result<Self, NoiseError> {
        if !(white_floor.is_finite() && white_floor >= 0.0) {
            return Err(NoiseError::Floor { found: white_floor });
        }
        let covariance = model.covariance(size, white_floor)?;
        let lower = match &covariance {
            Covariance::Diagonal(variances) => {
                Lower::Diagonal(variances.iter().map(|variance| variance.sqrt()).collect())
            }
            Covariance::Banded(bands) => banded_cholesky(bands, size)?,
            Covariance::Dense(matrix) => dense_cholesky(matrix)?,
        };
        Ok(Self { size, covariance, lower })
    }

    /// Number of locations.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Covariance of one location with all.
    ///
    /// # Panics
    ///
    /// If there is no such location.
    pub fn covariance_column(&self, location: usize) -> Vec<f64> {
        assert!(location < self.size, "no location {location}");
        match &self.covariance {
            Covariance::Diagonal(variances) => {
                let mut column = vec![0.0; self.size];
                column[location] = variances[location];
                column
            }
            Covariance::Banded(bands) => (0..self.size)
                .map(|other| {
                    let lag = other.abs_diff(location);
                    if lag < bands.lags {
                        bands.values[lag * self.size + other.min(location)]
                    } else {
                        0.0
                    }
                })
                .collect(),
            Covariance::Dense(matrix) => matrix.column(location).to_vec(),
        }
    }

    /// Variance at each location.
    pub fn variances(&self) -> Vec<f64> {
        match &self.covariance {
            Covariance::Diagonal(variances) => variances.clone(),
            Covariance::Banded(bands) => bands.values[..self.size].to_vec(),
            Covariance::Dense(matrix) => (0..self.size).map(|at| matrix.get(at, at)).collect(),
        }
    }

    /// `L⁻¹·M`: signals, one a column, with the noise made white.
    ///
    /// # Errors
    ///
    /// [`NoiseError::Size`].
    pub fn whiten(&self, signals: &Matrix) -> Result<Matrix, NoiseError> {
        self.columnwise(signals, Lower::solve)
    }

    /// `L⁻ᵀ·M`: from directions among whitened signals to directions among
    /// signals.
    pub(crate) fn solve_transposed(&self, signals: &Matrix) -> Result<Matrix, NoiseError> {
        self.columnwise(signals, Lower::solve_transposed)
    }

    /// `L·M`.
    pub(crate) fn colour(&self, signals: &Matrix) -> Result<Matrix, NoiseError> {
        self.columnwise(signals, Lower::times)
    }

    /// `Lᵀ·M`.
    pub(crate) fn times_transposed(&self, signals: &Matrix) -> Result<Matrix, NoiseError> {
        self.columnwise(signals, Lower::times_transposed)
    }

    /// `Mᵀ·Σ·M`: the covariance of the numbers that the columns of `M` weigh out
    /// of a signal.
    ///
    /// # Errors
    ///
    /// [`NoiseError::Size`].
    pub fn of_projection(&self, weights: &Matrix) -> Result<Matrix, NoiseError> {
        let half = self.times_transposed(weights)?;
        Ok(half.transposed_times(&half))
    }

    fn columnwise(
        &self,
        signals: &Matrix,
        apply: impl Fn(&Lower, &mut [f64]),
    ) -> Result<Matrix, NoiseError> {
        if signals.rows() != self.size {
            return Err(NoiseError::Size { found: self.size, expected: signals.rows() });
        }
        let mut result = signals.clone();
        (0..result.columns()).for_each(|column| apply(&self.lower, result.column_mut(column)));
        Ok(result)
    }
}

impl NoiseModel {
    fn covariance(&self, size: usize, floor: f64) -> Result<Covariance, NoiseError> {
        match self {
            Self::White { variance } => {
                positive(*variance + floor, 0)?;
                Ok(Covariance::Diagonal(vec![variance + floor; size]))
            }
            Self::Diagonal(variances) => {
                same_size(variances.len(), size)?;
                let variances: Vec<f64> = variances.iter().map(|value| value + floor).collect();
                for (location, variance) in variances.iter().enumerate() {
                    positive(*variance, location)?;
                }
                Ok(Covariance::Diagonal(variances))
            }
            Self::Stationary { autocovariance } => {
                let lags = autocovariance.len().min(size);
                let bands: Vec<Vec<f64>> =
                    (0..lags).map(|lag| vec![autocovariance[lag]; size - lag]).collect();
                Matrix::from_column_major(autocovariance.len(), 1, autocovariance.clone())?;
                Ok(Covariance::Banded(Bands::new(&bands, size, floor)?))
            }
            Self::Banded(bands) => Ok(Covariance::Banded(Bands::new(bands, size, floor)?)),
            Self::Dense(matrix) => {
                check_symmetric(matrix)?;
                same_size(matrix.rows(), size)?;
                Ok(Covariance::Dense(with_floor(matrix.clone(), floor)))
            }
            Self::Factor(factor) => {
                same_size(factor.rows(), size)?;
                let across = factor.transposed();
                Ok(Covariance::Dense(with_floor(across.transposed_times(&across), floor)))
            }
        }
    }
}

fn positive(found: f64, location: usize) -> Result<(), NoiseError> {
    if found.is_finite() && found > 0.0 {
        Ok(())
    } else {
        Err(NoiseError::Variance { found, location })
    }
}

fn same_size(found: usize, expected: usize) -> Result<(), NoiseError> {
    if found == expected { Ok(()) } else { Err(NoiseError::Size { found, expected }) }
}

fn check_symmetric(matrix: &Matrix) -> Result<(), NoiseError> {
    let (rows, columns) = (matrix.rows(), matrix.columns());
    if rows != columns {
        return Err(NoiseError::NotSquare { rows, columns });
    }
    let scale = matrix.values().iter().fold(0.0_f64, |top, value| top.max(value.abs()));
    for column in 0..columns {
        for row in 0..column {
            let difference = (matrix.get(row, column) - matrix.get(column, row)).abs();
            if difference > 8.0 * f64::EPSILON * scale {
                return Err(NoiseError::NotSymmetric { row, column });
            }
        }
    }
    Ok(())
}

fn with_floor(mut matrix: Matrix, floor: f64) -> Matrix {
    for at in 0..matrix.rows() {
        matrix.set(at, at, matrix.get(at, at) + floor);
    }
    matrix
}

impl Bands {
    fn new(bands: &[Vec<f64>], size: usize, floor: f64) -> Result<Self, NoiseError> {
        if bands.is_empty() || size == 0 {
            return Err(MatrixError::Empty { rows: size, columns: bands.len() }.into());
        }
        let mut values = vec![0.0; bands.len() * size];
        for (lag, band) in bands.iter().enumerate() {
            let (found, expected) = (band.len(), size.saturating_sub(lag));
            if found != expected {
                return Err(NoiseError::Band { lag, found, expected });
            }
            if let Some(row) = band.iter().position(|value| !value.is_finite()) {
                return Err(MatrixError::NotFinite { row, column: lag }.into());
            }
            values[lag * size..lag * size + found].copy_from_slice(band);
        }
        for (location, variance) in values[..size].iter_mut().enumerate() {
            *variance += floor;
            positive(*variance, location)?;
        }
        Ok(Self { values, lags: bands.len() })
    }
}

fn banded_cholesky(covariance: &Bands, size: usize) -> Result<Lower, NoiseError> {
    let Bands { mut values, lags } = covariance.clone();
    let largest = values[..size].iter().fold(0.0_f64, |top, value| top.max(*value));
    for column in 0..size {
        let pivot = values[column];
        if pivot.is_nan() || pivot <= PIVOT_REL * largest {
            return Err(NoiseError::NotPositiveDefinite { pivot, location: column });
        }
        let root = pivot.sqrt();
        let reach = (lags - 1).min(size - 1 - column);
        values[column] = root;
        for lag in 1..=reach {
            values[lag * size + column] /= root;
        }
        for ahead in 1..=reach {
            let factor = values[ahead * size + column];
            for lag in ahead..=reach {
                values[(lag - ahead) * size + column + ahead] -=
                    factor * values[lag * size + column];
            }
        }
    }
    Ok(Lower::Banded(Bands { values, lags }))
}

fn dense_cholesky(matrix: &Matrix) -> Result<Lower, NoiseError> {
    let size = matrix.rows();
    let mut lower = matrix.clone();
    let scratch = factor::cholesky_in_place_scratch::<f64>(size, Par::Seq, default());
    let outcome = factor::cholesky_in_place(
        lower.view_mut(),
        default(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        default(),
    );
    let largest = (0..size).fold(0.0_f64, |top, at| top.max(matrix.get(at, at)));
    let failed = match outcome {
        Err(factor::LltError::NonPositivePivot { index }) => Some((index, lower.get(index, index))),
        Ok(_) => (0..size)
            .map(|at| (at, lower.get(at, at).powi(2)))
            .find(|(_, pivot)| *pivot <= PIVOT_REL * largest),
    };
    if let Some((location, pivot)) = failed {
        return Err(NoiseError::NotPositiveDefinite { pivot, location });
    }
    for column in 1..size {
        lower.column_mut(column)[..column].fill(0.0);
    }
    Ok(Lower::Dense(lower))
}

impl Lower {
    /// Entries of one column from the diagonal on.
    fn below(&self, column: usize, size: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (values, stride, from, count) = match self {
            Self::Diagonal(deviations) => (deviations.as_slice(), 1, column, 1),
            Self::Banded(bands) => {
                (bands.values.as_slice(), size, column, bands.lags.min(size - column))
            }
            Self::Dense(lower) => (lower.values(), 1, column * size + column, size - column),
        };
        (0..count).map(move |step| (column + step, values[from + step * stride]))
    }

    fn solve(&self, vector: &mut [f64]) {
        let size = vector.len();
        for column in 0..size {
            let mut entries = self.below(column, size);
            let Some((_, pivot)) = entries.next() else { continue };
            let value = vector[column] / pivot;
            vector[column] = value;
            entries.for_each(|(row, entry)| vector[row] -= entry * value);
        }
    }

    fn solve_transposed(&self, vector: &mut [f64]) {
        let size = vector.len();
        for column in (0..size).rev() {
            let mut entries = self.below(column, size);
            let Some((_, pivot)) = entries.next() else { continue };
            let known: f64 = entries.map(|(row, entry)| entry * vector[row]).sum();
            vector[column] = (vector[column] - known) / pivot;
        }
    }

    fn times(&self, vector: &mut [f64]) {
        let size = vector.len();
        for column in (0..size).rev() {
            let value = vector[column];
            vector[column] = 0.0;
            self.below(column, size).for_each(|(row, entry)| vector[row] += entry * value);
        }
    }

    fn times_transposed(&self, vector: &mut [f64]) {
        let size = vector.len();
        for column in 0..size {
            vector[column] = match self {
                Self::Dense(lower) => dot(&lower.column(column)[column..], &vector[column..]),
                _ => self.below(column, size).map(|(row, entry)| entry * vector[row]).sum(),
            };
        }
    }
}
