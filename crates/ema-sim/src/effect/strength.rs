//! How strong an effect may be on a machine.
//!
//! The catalogue bounds a number for any machine. On a given one a torque far beyond the motor's,
//! or a drag or spring that the controller's tick is too long for, drives the shaft where no
//! series of a segment holds; such an effect is refused by name.

use super::{Coordinate, Curve, CurveKind, Effect, EffectError, EffectId, catalogue::MOST};

/// Torque that an effect may have, over what the motor makes at its limit.
const MOST_OVER_PEAK: f64 = 100.0;

/// Largest sizes of effects on a machine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strength {
    /// Torque on the moving shaft.
    torque: f64,
    /// Drag: `J/T`.
    drag: f64,
    /// Torque on the shaft over the surface's position: `J·i_g/T²`.
    spring: f64,
    /// Largest voltage on the winding.
    supply_v: f64,
    /// Largest output of the controller, mostly a current.
    limit: f64,
}

const SUPPLY: &str = "all of its supply";
const LIMIT: &str = "all that its controller asks for";
const FRICTION: &str = "times its curve, the friction that any effect may have";
const TORQUE: &str = "a hundred times what its motor makes";
const DRAG: &str = "the inertia over the controller's tick";
const SPRING: &str = "the inertia over the square of the controller's tick";
const SPRING_AT_STOP: &str = "at the stop a hundred times what its motor makes";

impl Effect {
    /// Whether its torque can put energy into the motion: for those that only brake, or hold,
    /// it cannot.
    pub(crate) fn can_feed(&self) -> bool {
        let v = self.values();
        match self.id() {
            EffectId::NonlinearViscous => v[0] < 0.0,
            // of one sign in both directions: with the motion in one of them
            EffectId::DirectionalFriction => v[1] != 0.0,
            EffectId::CurrentRipple => v[0].hypot(v[1]) > 1.0,
            EffectId::Imbalance => v[..3] != [0.0; 3] && (v[..2] != [0.0; 2] || v[2] < 0.0),
            EffectId::TransmissionError | EffectId::Cogging | EffectId::Vibration => {
                v[..2] != [0.0; 2]
            }
            EffectId::Tabulated => self.curve().is_some_and(|curve| curve.can_feed(v[0])),
            _ => false,
        }
    }
}

impl Curve {
    /// Whether it is a torque that can act with the motion, at a scale.
    fn can_feed(&self, scale: f64) -> bool {
        if self.kind() != CurveKind::Torque || scale == 0.0 || self.is_zero() {
            return false;
        }
        let with_motion = |x: f64| scale * self.at(x) * x < 0.0;
        self.over() != Coordinate::Speed
            || self.at(0.0) != 0.0
            || self.points().iter().any(|point| with_motion(point[0]))
            || [-1.0, 1.0].iter().any(|sign| with_motion(sign * f64::MAX.sqrt()))
    }
}

impl Strength {
    /// Of a machine with a motor's largest torque, an inertia at the motor behind a gear ratio, a
    /// tick, and the limits of supply and controller.
    pub(crate) fn new(
        peak_torque: f64,
        (inertia, gear_ratio): (f64, f64),
        tick_s: f64,
        (supply_v, limit): (f64, f64),
    ) -> Self {
        Self {
            torque: MOST_OVER_PEAK * peak_torque,
            drag: inertia / tick_s,
            spring: inertia * gear_ratio / (tick_s * tick_s),
            supply_v,
            limit,
        }
    }

    /// Refuses what is too strong; with stops a spring is also bounded by its torque there.
    pub(crate) fn check(&self, effect: &Effect, stop_rad: Option<f64>) -> Result<(), EffectError> {
        let v = effect.values();
        let sizes: &[(usize, f64, &str)] = match effect.id() {
            EffectId::NonlinearViscous => &[(0, self.torque, TORQUE)],
            EffectId::DirectionalFriction => &[(0, self.torque, TORQUE), (1, self.drag, DRAG)],
            EffectId::Imbalance => &[
                (0, self.torque, TORQUE),
                (1, self.torque, TORQUE),
                (2, self.spring, SPRING),
                (2, stop_rad.map_or(f64::INFINITY, |stop| self.torque / stop), SPRING_AT_STOP),
            ],
            EffectId::Cogging | EffectId::Vibration => {
                &[(0, self.torque, TORQUE), (1, self.torque, TORQUE)]
            }
            EffectId::Presliding | EffectId::InductanceEddy => &[(1, self.drag, DRAG)],
            EffectId::DeadTime => &[(0, self.supply_v, SUPPLY)],
            EffectId::CurrentSensor => &[(1, self.limit, LIMIT)],
            _ => &[],
        };
        for (place, most, reason) in sizes {
            // their bounds have made sure that values are finite
            if v[*place].abs() > *most {
                let key = effect.id().info().parameters[*place].key(effect.geometry());
                let (effect, value, most, reason) = (effect.id(), v[*place], *most, *reason);
                return Err(EffectError::TooStrong { effect, key, value, most, reason });
            }
        }
        self.check_curve(effect)
    }

    /// The same of a measured torque or friction.
    fn check_curve(&self, effect: &Effect) -> Result<(), EffectError> {
        let Some(curve) = effect.curve() else { return Ok(()) };
        let (bound, reason) = match curve.kind() {
            CurveKind::Torque => (self.torque, TORQUE),
            CurveKind::Friction => (MOST, FRICTION),
        };
        let largest = curve.points().iter().fold(0.0_f64, |most, point| most.max(point[1].abs()));
        let value = effect.values()[0];
        if value.abs() * largest <= bound {
            return Ok(());
        }
        let key = effect.id().info().parameters[0].key(effect.geometry());
        let (effect, most) = (effect.id(), bound / largest);
        Err(EffectError::TooStrong { effect, key, value, most, reason })
    }
}
