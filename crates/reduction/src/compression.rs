//! The map from a signal to the few numbers that are kept of it.

mod config;
mod fit;
#[cfg(feature = "serde")]
mod layout;
mod parts;

use crate::Matrix;

pub use config::{CompressionConfig, Encoding, Placement, PointRule, SnapshotOrder, TrainingData};
pub use fit::{CompressionError, FitReport};
pub use parts::{CompressionParts, Encoder, PartsError};

/// A signal of another length than the map was fitted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{found} values given, {expected} needed")]
pub struct LengthError {
    /// Values given.
    pub found: usize,
    /// Values needed.
    pub expected: usize,
}

/// A fitted linear compression `z = E·y` and the way back.
///
/// ```text
/// z = E·y,    ŷ = ȳ + D·(z − E·ȳ)
/// ```
///
/// | symbol | meaning |
/// |---|---|
/// | `E` | picks locations, averages clusters or projects, by [`Encoding`] |
/// | `ȳ` | mean of the training snapshots |
/// | `D` | least-squares decoder in the span of the leading centred modes of the training snapshots |
///
/// # Source
///
/// FREEDOM paper, section II.A, for [`Encoding::Points`] by [`Placement::DmdSom`];
/// the other encodings are choices of this project, compared in
/// `docs/validation/reduction.md`.
///
/// # Examples
///
/// ```
/// use reduction::{CompressionConfig, CompressionMap, Encoding, Snapshots};
///
/// // Two shapes in changing proportion: two modes lose nothing.
/// let snapshots = Snapshots::from_fn(200, 12, |row, column| {
///     let x = row as f64 / 200.0;
///     (6.0 * x).sin() * (0.5 * column as f64).cos() + x * x * column as f64
/// })?;
/// let config = CompressionConfig { encoding: Encoding::Modes, count: 2, ..Default::default() };
/// let map = CompressionMap::fit(&(&snapshots).into(), &config)?;
/// let signal = snapshots.snapshot(7);
/// let encoded = map.encode(signal)?;
/// assert_eq!(encoded.len(), 2);
/// let decoded = map.decode(&encoded)?;
/// assert!(decoded.iter().zip(signal).all(|(a, b)| (a - b).abs() < 1e-12));
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "layout::Layout", into = "layout::Layout"))]
pub struct CompressionMap {
    parts: CompressionParts,
    /// `E·ȳ`.
    encoded_mean: Vec<f64>,
}

impl CompressionMap {
    /// The numbers kept of a signal.
    ///
    /// # Errors
    ///
    /// [`LengthError`] when the signal is not as long as the training snapshots.
    pub fn encode(&self, signal: &[f64]) -> Result<Vec<f64>, LengthError> {
        let mut encoded = vec![0.0; self.encoded_len()];
        self.encode_into(signal, &mut encoded)?;
        Ok(encoded)
    }

    /// As [`encode`](Self::encode), into memory that is there already.
    ///
    /// # Errors
    ///
    /// [`LengthError`] for the signal or for the memory.
    pub fn encode_into(&self, signal: &[f64], encoded: &mut [f64]) -> Result<(), LengthError> {
        check_length(signal.len(), self.signal_len())?;
        check_length(encoded.len(), self.encoded_len())?;
        self.parts.encoder.apply(signal, encoded);
        Ok(())
    }

    /// The signal that encoded numbers stand for, as far as the training
    /// snapshots tell.
    ///
    /// # Errors
    ///
    /// [`LengthError`].
    pub fn decode(&self, encoded: &[f64]) -> Result<Vec<f64>, LengthError> {
        check_length(encoded.len(), self.encoded_len())?;
        let departure: Vec<f64> =
            encoded.iter().zip(&self.encoded_mean).map(|(value, mean)| value - mean).collect();
        let mut signal = self.parts.decoder.times_vector(&departure);
        signal.iter_mut().zip(&self.parts.mean).for_each(|(value, mean)| *value += mean);
        Ok(signal)
    }

    /// Length of the signals.
    pub fn signal_len(&self) -> usize {
        self.parts.mean.len()
    }

    /// Numbers kept of a signal.
    pub fn encoded_len(&self) -> usize {
        self.encoded_mean.len()
    }

    /// The encoding that was fitted.
    pub fn encoding(&self) -> Encoding {
        self.parts.encoding
    }

    /// Locations that are kept, increasing, if the encoding keeps locations.
    pub fn locations(&self) -> Option<&[usize]> {
        match &self.parts.encoder {
            Encoder::Select(locations) => Some(locations),
            _ => None,
        }
    }

    /// Mean of the training snapshots.
    pub fn mean(&self) -> &[f64] {
        &self.parts.mean
    }

    /// `Eᵀ`: weights of the signal's values in each encoded number, one number
    /// a column.
    pub fn weights(&self) -> Matrix {
        self.parts.encoder.weights(self.signal_len())
    }

    /// Report of the fit.
    pub fn report(&self) -> &FitReport {
        &self.parts.report
    }

    /// Everything the map consists of, as plain data.
    pub fn parts(&self) -> &CompressionParts {
        &self.parts
    }

    /// Gives the parts away.
    pub fn into_parts(self) -> CompressionParts {
        self.parts
    }

    /// Puts a map together again.
    ///
    /// # Errors
    ///
    /// [`PartsError`] when the parts do not fit one another.
    pub fn from_parts(parts: CompressionParts) -> Result<Self, PartsError> {
        parts.check()?;
        let mut encoded_mean = vec![0.0; parts.encoder.len()];
        parts.encoder.apply(&parts.mean, &mut encoded_mean);
        Ok(Self { parts, encoded_mean })
    }
}

fn check_length(found: usize, expected: usize) -> Result<(), LengthError> {
    if found == expected { Ok(()) } else { Err(LengthError { found, expected }) }
}
