//! Few numbers in place of a whole signal: the likelihood on an encoded residual.
//!
//! ```text
//! z = E·r,   z ~ N(0, E·Σ·Eᵀ)
//! ```
//!
//! with the rows of `E` learnt on the bundle's incipient signals. Everything that is asked of
//! the whole signal's covariance is asked of the smaller one in the same way.
//!
//! # Source
//!
//! Derived in `docs/models/reduction.md`, sections "Encodings" and "Information"; the points are those
//! of the FREEDOM paper, section II.A.

use inference::{BandedMatrix, dot};

use crate::report::{Encoding, Notice, NoticeCode};

/// Rows `E` that make few numbers of a signal.
#[derive(Debug)]
pub(crate) struct Encoder {
    pub(crate) encoding: Encoding,
    rows: Vec<Vec<f64>>,
}

impl Encoder {
    /// An encoder of given rows.
    pub(crate) fn new(encoding: Encoding, rows: Vec<Vec<f64>>) -> Self {
        Self { encoding, rows }
    }

    /// Numbers made of a signal.
    pub(crate) fn size(&self) -> usize {
        self.rows.len()
    }

    /// Notice that an answer has.
    pub(crate) fn notice(&self) -> Notice {
        let (name, size) = (self.encoding.word(), self.size());
        let message = format!("`{name}`: {size} numbers were looked at, not the whole signal");
        Notice { code: NoticeCode::Encoded, message }
    }

    /// `E·r`.
    pub(crate) fn encode(&self, signal: &[f64]) -> Vec<f64> {
        self.rows.iter().map(|row| dot(row, signal)).collect()
    }

    /// `Eᵀ·z`.
    pub(crate) fn spread(&self, encoded: &[f64], samples: usize) -> Vec<f64> {
        let mut signal = vec![0.0; samples];
        for (row, part) in self.rows.iter().zip(encoded) {
            for (value, weight) in signal.iter_mut().zip(row) {
                *value += part * weight;
            }
        }
        signal
    }

    /// `E·Σ·Eᵀ`, dense: its band is as wide as it is.
    pub(crate) fn covariance(&self, whole: &BandedMatrix) -> BandedMatrix {
        let mut covariance = BandedMatrix::zeros(self.size(), self.size());
        for (i, row) in self.rows.iter().enumerate() {
            let image = whole.times(row);
            for (j, other) in self.rows[..=i].iter().enumerate() {
                *covariance.at_mut(i, j) = dot(&image, other);
            }
        }
        covariance
    }
}
