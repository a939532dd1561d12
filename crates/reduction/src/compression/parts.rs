use super::{Encoding, FitReport};
use crate::{Matrix, matrix::dot};

/// A [`CompressionMap`](super::CompressionMap) as plain data, for storage.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct CompressionParts {
    /// The encoding that was fitted.
    pub encoding: Encoding,
    /// `E`.
    pub encoder: Encoder,
    /// `ȳ`, mean of the training snapshots.
    pub mean: Vec<f64>,
    /// `D`, locations × encoded numbers.
    pub decoder: Matrix,
    /// Order in which the training snapshots were read.
    pub snapshot_order: Vec<usize>,
    /// First mode of the training snapshots: the first dynamic mode where the
    /// encoding rests on dynamic modes, else the first centred singular mode.
    pub first_mode: Vec<f64>,
    /// Report of the fit.
    pub report: FitReport,
}

/// How encoded numbers come out of a signal.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Encoder {
    /// Values at these locations, increasing.
    Select(Vec<usize>),
    /// Means over these groups of locations.
    Average(Vec<Vec<usize>>),
    /// Weighted sums, one number a column.
    Project(Matrix),
}

/// Why parts could not be put together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PartsError {
    /// Nothing would be kept of a signal.
    #[error("the encoder keeps no number")]
    NothingKept,
    /// A location outside the signal.
    #[error("location {location} lies outside a signal of {signal_len} values")]
    Location {
        /// The location given.
        location: usize,
        /// Length of the mean.
        signal_len: usize,
    },
    /// Locations to select that do not increase.
    #[error("location {location} is not above the one before it")]
    NotIncreasing {
        /// The location given.
        location: usize,
    },
    /// A group without a location.
    #[error("group {group} has no location")]
    EmptyGroup {
        /// Index of the group.
        group: usize,
    },
    /// A matrix of another shape.
    #[error("{rows} by {columns} where {expected_rows} by {expected_columns} is needed")]
    Shape {
        /// Rows given.
        rows: usize,
        /// Columns given.
        columns: usize,
        /// Rows needed.
        expected_rows: usize,
        /// Columns needed.
        expected_columns: usize,
    },
    /// A first mode of another length than the mean.
    #[error("first mode of {found} values where the mean has {expected}")]
    FirstMode {
        /// Values given.
        found: usize,
        /// Values needed.
        expected: usize,
    },
    /// A NaN or an infinity in the mean or the first mode.
    #[error("value {index} of the mean or the first mode is not finite")]
    NotFinite {
        /// Index of the first such value.
        index: usize,
    },
}

impl CompressionParts {
    pub(super) fn check(&self) -> Result<(), PartsError> {
        let signal_len = self.mean.len();
        if self.encoder.len() == 0 {
            return Err(PartsError::NothingKept);
        }
        if let Some(index) = [&self.mean, &self.first_mode]
            .iter()
            .find_map(|values| values.iter().position(|value| !value.is_finite()))
        {
            return Err(PartsError::NotFinite { index });
        }
        if self.first_mode.len() != signal_len {
            let found = self.first_mode.len();
            return Err(PartsError::FirstMode { found, expected: signal_len });
        }
        check_shape(&self.decoder, signal_len, self.encoder.len())?;
        self.encoder.check(signal_len)
    }
}

fn check_shape(matrix: &Matrix, rows: usize, columns: usize) -> Result<(), PartsError> {
    if (matrix.rows(), matrix.columns()) == (rows, columns) {
        return Ok(());
    }
    Err(PartsError::Shape {
        rows: matrix.rows(),
        columns: matrix.columns(),
        expected_rows: rows,
        expected_columns: columns,
    })
}

impl Encoder {
    /// Numbers kept of a signal.
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Select(locations) => locations.len(),
            Self::Average(groups) => groups.len(),
            Self::Project(weights) => weights.columns(),
        }
    }

    pub(super) fn apply(&self, signal: &[f64], encoded: &mut [f64]) {
        match self {
            Self::Select(locations) => {
                encoded.iter_mut().zip(locations).for_each(|(to, &at)| *to = signal[at]);
            }
            Self::Average(groups) => {
                for (to, group) in encoded.iter_mut().zip(groups) {
                    *to = group.iter().map(|&at| signal[at]).sum::<f64>() / group.len() as f64;
                }
            }
            Self::Project(weights) => {
                for (column, to) in encoded.iter_mut().enumerate() {
                    *to = dot(weights.column(column), signal);
                }
            }
        }
    }

    /// `Eᵀ` for signals of `signal_len` values.
    pub(super) fn weights(&self, signal_len: usize) -> Matrix {
        let mut weights = Matrix::zeros(signal_len, self.len());
        match self {
            Self::Project(matrix) => return matrix.clone(),
            Self::Select(locations) => {
                for (column, &at) in locations.iter().enumerate() {
                    weights.set(at, column, 1.0);
                }
            }
            Self::Average(groups) => {
                for (column, group) in groups.iter().enumerate() {
                    for &at in group {
                        weights.set(at, column, 1.0 / group.len() as f64);
                    }
                }
            }
        }
        weights
    }

    fn check(&self, signal_len: usize) -> Result<(), PartsError> {
        let inside = |locations: &[usize]| match locations.iter().find(|&&at| at >= signal_len) {
            Some(&location) => Err(PartsError::Location { location, signal_len }),
            None => Ok(()),
        };
        match self {
            Self::Select(locations) => {
                inside(locations)?;
                match locations.windows(2).find(|pair| pair[0] >= pair[1]) {
                    Some(pair) => Err(PartsError::NotIncreasing { location: pair[1] }),
                    None => Ok(()),
                }
            }
            Self::Average(groups) => groups.iter().enumerate().try_for_each(|(group, members)| {
                if members.is_empty() {
                    return Err(PartsError::EmptyGroup { group });
                }
                inside(members)
            }),
            Self::Project(weights) => check_shape(weights, signal_len, weights.columns()),
        }
    }
}
