//! The seven faults: levels as in Table 1 of the FREEDOM paper, and what they do to the machine.

use libm::{atan2, cos, hypot, sin};

use crate::phase::PerPhase;

/// Number of fault parameters.
pub const FAULT_COUNT: usize = 7;

/// Identity of a fault parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FaultId {
    /// `k1`, dry friction.
    Friction,
    /// `k2`, backlash.
    Backlash,
    /// `k3`, partial inter-turn short of phase A.
    ShortA,
    /// `k4`, partial inter-turn short of phase B.
    ShortB,
    /// `k5`, partial inter-turn short of phase C.
    ShortC,
    /// `k6`, eccentricity that turns with the rotor (dynamic eccentricity).
    Eccentricity,
    /// `k7`, direction of the eccentricity.
    EccentricityPhase,
}

impl FaultId {
    /// All faults in the order `k1..k7`.
    pub const ALL: [Self; FAULT_COUNT] = [
        Self::Friction,
        Self::Backlash,
        Self::ShortA,
        Self::ShortB,
        Self::ShortC,
        Self::Eccentricity,
        Self::EccentricityPhase,
    ];

    /// Position in a fault vector, 0 for `k1`.
    pub fn index(self) -> usize {
        self as usize
    }

    /// The symbol of the paper, `k1` to `k7`.
    pub fn symbol(self) -> &'static str {
        ["k1", "k2", "k3", "k4", "k5", "k6", "k7"][self.index()]
    }

    /// An engineer's name for it.
    pub fn name(self) -> &'static str {
        [
            "friction",
            "backlash",
            "phase A short",
            "phase B short",
            "phase C short",
            "rotor eccentricity",
            "eccentricity phase",
        ][self.index()]
    }
}

/// A fault level outside the scale of Table 1.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("fault level {value} of {} is outside [0, 1]", .fault.map_or("a fault", FaultId::symbol))]
#[non_exhaustive]
pub struct FaultLevelError {
    /// The level given.
    pub value: f64,
    /// Which fault, where known.
    pub fault: Option<FaultId>,
}

/// Level of one fault, 0 (no damage) to 1 (full damage).
///
/// # Source
///
/// Table 1 of the FREEDOM paper. For `k7` the scale is an angle, −180° to 180°.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct FaultLevel(f64);

impl FaultLevel {
    /// No damage.
    pub const NONE: Self = Self(0.0);
    /// Full damage.
    pub const FULL: Self = Self(1.0);

    /// A level of damage.
    ///
    /// # Errors
    ///
    /// [`FaultLevelError`] outside `[0, 1]` or for NaN.
    pub fn new(value: f64) -> Result<Self, FaultLevelError> {
        if (0.0..=1.0).contains(&value) {
            Ok(Self(value))
        } else {
            Err(FaultLevelError { value, fault: None })
        }
    }

    /// The level as a number.
    pub fn get(self) -> f64 {
        self.0
    }
}

/// Health of an actuator: the levels `k1..k7` of Table 1.
///
/// `k7` is a direction: its 0 is −180°, not "no damage", and it has no meaning while `k6 = 0`.
///
/// # Examples
///
/// ```
/// use ema_sim::{FaultId, HealthState};
///
/// let worn = HealthState::new([0.02, 0.0, 0.0, 0.0, 0.0, 0.01, 0.75])?;
/// assert_eq!(worn.level(FaultId::Friction).get(), 0.02);
/// # Ok::<_, ema_sim::FaultLevelError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HealthState([FaultLevel; FAULT_COUNT]);

impl HealthState {
    /// The undamaged actuator (`k7` at 0.5, which is 0°, by convention).
    pub const HEALTHY: Self = {
        let mut levels = [FaultLevel::NONE; FAULT_COUNT];
        levels[6] = FaultLevel(0.5);
        Self(levels)
    };

    /// A health state from `k1..k7`.
    ///
    /// # Errors
    ///
    /// [`FaultLevelError`] naming the first level outside `[0, 1]`.
    pub fn new(levels: [f64; FAULT_COUNT]) -> Result<Self, FaultLevelError> {
        let mut state = Self::HEALTHY;
        for fault in FaultId::ALL {
            state.0[fault.index()] = FaultLevel::new(levels[fault.index()])
                .map_err(|error| FaultLevelError { fault: Some(fault), ..error })?;
        }
        Ok(state)
    }

    /// The health with one level replaced.
    #[must_use]
    pub fn with(mut self, fault: FaultId, level: FaultLevel) -> Self {
        self.0[fault.index()] = level;
        self
    }

    /// The level of one fault.
    pub fn level(&self, fault: FaultId) -> FaultLevel {
        self.0[fault.index()]
    }

    /// The levels `k1..k7`.
    pub fn levels(&self) -> [f64; FAULT_COUNT] {
        self.0.map(FaultLevel::get)
    }

    /// The damage in coordinates without the circle of `k7`.
    pub fn coordinates(&self) -> FaultCoordinates {
        let k = self.levels();
        let direction_rad = eccentricity_direction_rad(k[6]);
        FaultCoordinates([
            k[0],
            k[1],
            k[2],
            k[3],
            k[4],
            k[5] * cos(direction_rad),
            k[5] * sin(direction_rad),
        ])
    }
}

/// Direction of the eccentricity, `φ = 2π·(k7 − ½)`.
fn eccentricity_direction_rad(k7: f64) -> f64 {
    core::f64::consts::TAU * (k7 - 0.5)
}

/// Damage as `k1..k5, k6·cos φ, k6·sin φ`.
///
/// `φ = 2π·(k7 − ½)`. In these coordinates nothing is periodic and nothing loses its meaning at
/// `k6 = 0`, so that derivatives and estimates live here. A coordinate may leave the scale of
/// Table 1, down to slightly negative damage: an estimate free of bounds needs that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultCoordinates(pub [f64; FAULT_COUNT]);

impl FaultCoordinates {
    /// Names of the coordinates, in order.
    pub const NAMES: [&'static str; FAULT_COUNT] =
        ["k1", "k2", "k3", "k4", "k5", "k6_cos", "k6_sin"];

    /// Back to `k1..k7`, levels clamped to `[0, 1]`, `k7` in `[0, 1)`.
    pub fn levels(&self) -> [f64; FAULT_COUNT] {
        let c = &self.0;
        let turn = atan2(c[6], c[5]) / core::f64::consts::TAU + 0.5;
        let clamp = |x: f64| x.clamp(0.0, 1.0);
        [
            clamp(c[0]),
            clamp(c[1]),
            clamp(c[2]),
            clamp(c[3]),
            clamp(c[4]),
            clamp(hypot(c[5], c[6])),
            if turn >= 1.0 { 0.0 } else { turn },
        ]
    }
}

/// Physical changes of the machine under its faults.
///
/// ```text
/// friction   F·(1 + 2·k1)          backlash   b·(1 + 99·k2)
/// turns      N_j = 1 − k_{3..5}    gap        1 + k6·cos(θ_m + φ)
/// ```
///
/// # Source
///
/// End points: Table 1 of the FREEDOM paper. The straight line between them is this project's
/// reading; `docs/paper-ledger.md`, Table 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhysicalFaults {
    /// Dry friction over its nominal value.
    pub friction_ratio: f64,
    /// Backlash over its nominal value.
    pub backlash_ratio: f64,
    /// Fraction of healthy turns of phases A, B, C.
    pub healthy_turns_frac: PerPhase,
    /// `ζ·cos φ`, relative modulation of the air gap.
    pub eccentricity_cos: f64,
    /// `ζ·sin φ`.
    pub eccentricity_sin: f64,
}

/// Smallest fraction of healthy turns: a winding with none left has neither resistance nor
/// inductance and no equation.
pub(crate) const LEAST_TURNS_FRAC: f64 = 0.01;
/// Largest eccentricity: at 1 the rotor rubs.
pub(crate) const MOST_ECCENTRICITY: f64 = 0.95;

impl From<&FaultCoordinates> for PhysicalFaults {
    fn from(coordinates: &FaultCoordinates) -> Self {
        let c = &coordinates.0;
        let amplitude = hypot(c[5], c[6]);
        let shrink =
            if amplitude > MOST_ECCENTRICITY { MOST_ECCENTRICITY / amplitude } else { 1.0 };
        Self {
            friction_ratio: (1.0 + 2.0 * c[0]).max(0.0),
            backlash_ratio: (1.0 + 99.0 * c[1]).max(0.0),
            healthy_turns_frac: [c[2], c[3], c[4]].map(|k| (1.0 - k).max(LEAST_TURNS_FRAC)),
            eccentricity_cos: c[5] * shrink,
            eccentricity_sin: c[6] * shrink,
        }
    }
}

impl From<&HealthState> for PhysicalFaults {
    fn from(state: &HealthState) -> Self {
        Self::from(&state.coordinates())
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    /// Rounding of a circle's coordinates.
    const ROUNDING: f64 = 1e-14;

    #[test]
    fn published_table_1_end_points() {
        let full =
            PhysicalFaults::from(&HealthState::new([1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap());
        assert_eq!(full.friction_ratio, 3.0);
        assert_eq!(full.backlash_ratio, 100.0);
        let healthy = PhysicalFaults::from(&HealthState::HEALTHY);
        assert_eq!(healthy.friction_ratio, 1.0);
        assert_eq!(healthy.healthy_turns_frac, [1.0; 3]);
        assert_eq!((healthy.eccentricity_cos, healthy.eccentricity_sin), (0.0, 0.0));
    }

    #[test]
    fn coordinates_and_levels_are_inverse() {
        let k = [0.01, 0.02, 0.03, 0.04, 0.05, 0.03, 0.9];
        let back = HealthState::new(k).unwrap().coordinates().levels();
        for (a, b) in k.iter().zip(back) {
            assert_abs_diff_eq!(*a, b, epsilon = ROUNDING);
        }
    }

    #[test]
    fn levels_outside_the_scale_are_refused() {
        for bad in [-1e-9, 1.0 + 1e-9, f64::NAN] {
            assert!(FaultLevel::new(bad).is_err());
        }
        let error = HealthState::new([0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap_err();
        assert_eq!(error.to_string(), "fault level 2 of k2 is outside [0, 1]");
    }
}
