//! Points of the damage space: where searches start, may go, and what error models are learnt on.

use ema_sim::{FAULT_COUNT, HealthState};

/// Where a search starts: damage in the middle of the incipient range.
pub(crate) const START: [f64; FAULT_COUNT] = [0.02, 0.02, 0.02, 0.02, 0.02, 0.0, 0.0];
/// Least value of each coordinate: an estimate free of bounds may be slightly negative, but not
/// beyond what the machine can be given (backlash 1 + 99·k2 > 0).
pub(crate) const LEAST: [f64; FAULT_COUNT] = [-0.05, -0.0099, -0.05, -0.05, -0.05, -1.0, -1.0];
/// Largest value of each coordinate: that of a fault, and of a short the last one below which the
/// model still follows it, since a phase keeps a hundredth of its turns.
pub(crate) const MOST: [f64; FAULT_COUNT] = [1.0, 1.0, 0.985, 0.985, 0.985, 1.0, 1.0];
/// Largest level that the incipient designs hold, with a margin for the estimate's scatter.
pub(crate) const TRAINED_LEVEL: f64 = 0.06;
/// Differences for derivatives: large against the low-fidelity model's own kinks (the controller's
/// ticks), small against the damage looked for.
pub(crate) const DIFFERENCE_STEP: f64 = 1e-3;
/// Steps below this end a search; levels are of interest to 1e-5.
pub(crate) const STEP_TOLERANCE: f64 = 1e-6;

/// The coordinates looked for of levels looked for, `k6` and `k7` taken together.
pub(crate) fn coordinates_of(sought: &[usize], levels: &[f64]) -> Vec<f64> {
    let mut all = HealthState::HEALTHY.levels();
    for (&index, &level) in sought.iter().zip(levels) {
        all[index] = level.clamp(0.0, 1.0);
    }
    let health = HealthState::new(all).unwrap_or(HealthState::HEALTHY);
    let coordinates = health.coordinates().0;
    sought.iter().map(|&index| coordinates[index]).collect()
}

/// Length of a damage vector, never zero.
pub(crate) fn size_of(point: &[f64]) -> f64 {
    point.iter().map(|x| x * x).sum::<f64>().sqrt().max(TRAINED_LEVEL)
}

/// The nearest point that the trend of the error is learnt on.
pub(crate) fn within_training(point: &[f64]) -> Vec<f64> {
    point.iter().map(|x| x.clamp(-TRAINED_LEVEL, TRAINED_LEVEL)).collect()
}
