//! Bars on figures, and words for what is asked of one.

use experiments::UnitsScore;

use super::units::percent;

/// Most healthy units with something detected, %.
pub(super) const MOST_ALARMS: f64 = 3.0;
/// Fewest units whose damage is detected, %.
pub(super) const LEAST_POWER: f64 = 90.0;
/// Bounds on the coverage of 95 % intervals, %.
const COVERAGE: [f64; 2] = [91.0, 98.5];

/// Says whether what is asked for was found.
pub(super) fn met(is_met: bool) -> &'static str {
    if is_met { "met" } else { "**missed**" }
}

/// Coverages of the 95 % intervals of units, %, and whether all are within bounds.
pub(super) fn coverages(score: &UnitsScore) -> (String, bool) {
    let [least, most] = COVERAGE;
    let covered = score.covered.map(|count| percent(count, score.machines));
    let holds = covered.iter().all(|held| (least..=most).contains(held));
    (covered.map(|held| format!("{held:.1}")).join(", "), holds)
}
