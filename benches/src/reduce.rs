//! Snapshot matrices and training sets for the reduction crate.

use std::f64::consts::PI;

use reduction::{Matrix, MatrixError, Snapshots};

/// Twelve travelling, decaying waves over pseudo-noise of 1e-3: full rank, as
/// `benches/peers/reduction/peers.py` builds them.
///
/// # Errors
///
/// [`MatrixError::Empty`] for no row or no column.
pub fn waves(rows: usize, columns: usize) -> Result<Snapshots, MatrixError> {
    Snapshots::from_fn(rows, columns, |row, column| {
        let (i, j) = (row as f64, column as f64);
        let (x, t) = (i / rows as f64, j / columns as f64);
        let waves: f64 = (1..=12)
            .map(f64::from)
            .map(|k| {
                let phase = 2.0 * PI * (k * x + 0.37 * k * t);
                0.7_f64.powf(k) * phase.sin() * (-0.3 * k * t).exp()
            })
            .sum();
        waves + 1e-3 * (12.9898 * i + 78.233 * j + 0.001 * i * j).sin()
    })
}

/// Samples without structure, `rows` by `features`, as
/// `benches/peers/reduction/peers.py` builds them.
///
/// # Errors
///
/// [`MatrixError::Empty`] for no row or no feature.
pub fn samples(rows: usize, features: usize) -> Result<Matrix, MatrixError> {
    Matrix::from_fn(rows, features, |row, feature| {
        let (i, f) = (row as f64, feature as f64);
        (12.9898 * i + 78.233 * f + 0.013 * i * f).sin() + (0.001 * i * (f + 1.0)).cos()
    })
}
