//! Values of some time ago.

use libm::floor;

/// A value some ticks ago, straight between ticks; the first before the first.
pub(super) fn late(past: &[f64], ticks: f64) -> f64 {
    let place = (past.len() - 1) as f64 - ticks;
    if place <= 0.0 {
        return past[0];
    }
    let before = floor(place) as usize;
    let next = past.get(before + 1).copied().unwrap_or(past[before]);
    past[before] + (next - past[before]) * (place - before as f64)
}
