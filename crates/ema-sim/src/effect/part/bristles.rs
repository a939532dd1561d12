//! Bristles in place of dry friction: the model of Lund and Grenoble.
//!
//! ```text
//! T = σ0·z + σ1·z'    z' = ω − |ω|·σ0·z/g(ω)    g = F_d + (F_s − F_d)·exp(−(ω/ω_s)²)
//! ```
//!
//! Over a segment the speed of the steady deflection is held, and the deflection `z` follows the
//! turn `φ` exactly: `z = z_∞ + (z_0 − z_∞)·exp(−|φ/z_∞|)`, `z_∞ = g/σ0`.
//!
//! # Source
//!
//! Canudas de Wit, Olsson, Åström, Lischinsky, "A new model for control of systems with
//! friction", IEEE Transactions on Automatic Control 40(3), 1995.
#![expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]

use libm::exp;

use crate::bounds::larger;

/// Distance from the steady deflection of bristles, over it, within which they follow the speed.
const STEADY_RATIO: f64 = 1e-3;

/// Bristles in place of dry friction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bristles {
    /// Deflection at which the kinetic friction is reached, `z_0`.
    pub(crate) distance_rad: f64,
    /// Damping, `σ1`.
    pub(crate) damping: f64,
    /// Stribeck speed, `ω_s`.
    pub(crate) stribeck_rad_per_s: f64,
    /// Present deflection, `z`.
    pub(crate) deflection_rad: f64,
    /// Kinetic and static friction of the present direction.
    pub(crate) level_n_m: [f64; 2],
    /// Longest segment, and its longest turn, while the bristles bend.
    pub(crate) longest_s: f64,
    pub(crate) longest_rad: f64,
}

impl Bristles {
    /// Argument of the exponential in [`steady_of`](Self::steady_of).
    #[inline(always)]
    pub(crate) fn steady_argument(&self, speed: f64) -> f64 {
        let ratio = speed / self.stribeck_rad_per_s;
        -ratio * ratio
    }

    /// Deflection at which sliding is steady, `g(ω)/σ0`, by that exponential.
    #[inline(always)]
    pub(crate) fn steady_of(&self, decayed: f64) -> f64 {
        let [kinetic, fixed] = self.level_n_m;
        let g = kinetic + larger(fixed - kinetic, 0.0) * decayed;
        let bent = self.distance_rad * g / kinetic;
        if kinetic > 0.0 { bent } else { self.distance_rad }
    }

    /// Deflection at which sliding is steady.
    fn steady_rad(&self, speed: f64) -> f64 {
        self.steady_of(exp(self.steady_argument(speed)))
    }

    /// True where the bristles have bent as far as they do at a speed: they follow it from there,
    /// however long the segment, until the motion turns.
    pub(crate) fn is_steady(&self, speed: f64) -> bool {
        self.is_steady_at(speed, self.steady_rad(speed))
    }

    /// That, with the deflection at which sliding is steady.
    #[inline(always)]
    pub(crate) fn is_steady_at(&self, speed: f64, steady_rad: f64) -> bool {
        let steady = steady_rad.copysign(speed);
        (speed != 0.0) & ((self.deflection_rad - steady).abs() < STEADY_RATIO * steady.abs())
    }

    /// The deflection after a turn.
    pub(crate) fn turned(&self, turn_rad: f64, speed: f64) -> f64 {
        if turn_rad == 0.0 {
            self.deflection_rad
        } else {
            self.bent(turn_rad, self.steady_rad(speed))
        }
    }

    /// The deflection after a turn, with the one at which sliding is steady.
    fn bent(&self, turn_rad: f64, steady_rad: f64) -> f64 {
        self.bent_of(turn_rad, steady_rad, exp(Self::bent_argument(turn_rad, steady_rad)))
    }

    /// Argument of the exponential in [`bent_of`](Self::bent_of).
    #[inline(always)]
    pub(crate) fn bent_argument(turn_rad: f64, steady_rad: f64) -> f64 {
        -(turn_rad / steady_rad.copysign(turn_rad)).abs()
    }

    /// The deflection after a turn, by that exponential.
    #[inline(always)]
    pub(crate) fn bent_of(&self, turn_rad: f64, steady_rad: f64, decayed: f64) -> f64 {
        let steady = steady_rad.copysign(turn_rad);
        let bent = steady + (self.deflection_rad - steady) * decayed;
        if turn_rad == 0.0 { self.deflection_rad } else { bent }
    }

    /// Torque of the bristles after a turn, against positive motion.
    pub(crate) fn torque_n_m(&self, turn_rad: f64, speed: f64) -> f64 {
        let steady_rad = self.steady_rad(speed);
        self.torque_of(self.bent(turn_rad, steady_rad), steady_rad, speed)
    }

    /// Torque of bristles with a deflection.
    #[inline(always)]
    pub(crate) fn torque_of(&self, deflection_rad: f64, steady_rad: f64, speed: f64) -> f64 {
        let slip = deflection_rad / steady_rad;
        let rate = speed - speed.abs() * slip;
        self.level_n_m[0] / self.distance_rad * deflection_rad + self.damping * rate
    }
}
