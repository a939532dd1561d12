//! Errors of the low-fidelity model on severe damage.
//!
//! ```text
//! e(c) = ‖c‖^p·e_1,   e_1 from the wide conditions nearest in size
//! ```
//!
//! # Source
//!
//! `docs/models/diagnosis.md`, severe faults.

use crate::{
    offline::error_model::ErrorModel,
    online::damage::{size_of, within_training},
};

/// Errors of the low-fidelity model on severe damage: they grow with a power of its size.
#[derive(Debug)]
pub(crate) struct SevereErrors {
    /// Errors at unit size, one a wide condition, with the logarithm of the condition's size.
    at_unit: Vec<(f64, Vec<f64>)>,
    exponent: f64,
}

impl SevereErrors {
    /// Learns the power from errors at points: the slope of ln(rms) over ln(size).
    pub(crate) fn learn(
        model: &ErrorModel,
        mut errors: Vec<Vec<f64>>,
        points: &[Vec<f64>],
    ) -> Self {
        let sizes: Vec<f64> = points.iter().map(|point| size_of(point)).collect();
        for (error, point) in errors.iter_mut().zip(points) {
            let mean = model.mean_at(&within_training(point));
            for (value, mean) in error.iter_mut().zip(mean) {
                *value -= mean;
            }
        }
        let ln_rms = |error: &Vec<f64>| {
            let mean_square = error.iter().map(|v| v * v).sum::<f64>() / error.len() as f64;
            0.5 * mean_square.max(f64::MIN_POSITIVE).ln()
        };
        let pairs: Vec<(f64, f64)> =
            sizes.iter().zip(&errors).map(|(size, error)| (size.ln(), ln_rms(error))).collect();
        let exponent = slope(&pairs).clamp(0.0, 4.0);
        for (error, size) in errors.iter_mut().zip(&sizes) {
            let scale = size.powf(-exponent);
            for value in error {
                *value *= scale;
            }
        }
        let at_unit = sizes.iter().map(|size| size.ln()).zip(errors).collect();
        Self { at_unit, exponent }
    }

    /// Errors for damage of a size: those of the conditions nearest in size, scaled to it.
    pub(crate) fn at_size(&self, size: f64) -> Vec<Vec<f64>> {
        let ln_size = size.ln();
        let mut nearest: Vec<&(f64, Vec<f64>)> = self.at_unit.iter().collect();
        nearest.sort_by(|a, b| (a.0 - ln_size).abs().total_cmp(&(b.0 - ln_size).abs()));
        let scale = size.powf(self.exponent);
        let scaled = |error: &[f64]| error.iter().map(|value| scale * value).collect();
        nearest.iter().take(NEAREST_SEVERE).map(|(_, error)| scaled(error)).collect()
    }
}

/// Wide conditions that tell the errors at a size of damage.
const NEAREST_SEVERE: usize = 40;

/// Least-squares slope of pairs (x, y).
fn slope(pairs: &[(f64, f64)]) -> f64 {
    let count = pairs.len() as f64;
    let mean = |pick: fn(&(f64, f64)) -> f64| pairs.iter().map(pick).sum::<f64>() / count;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let cross: f64 = pairs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let square: f64 = pairs.iter().map(|p| (p.0 - x) * (p.0 - x)).sum();
    cross / square.max(f64::MIN_POSITIVE)
}
