//! Every number of a servo axis by name: what model files, checks and calibration share.

use crate::{
    effect::Geometry, motion_term::MotionTerm, parameter_error::ParameterError,
    servo_axis::ServoAxis, servo_control::Drive,
};

/// One number of a [`ServoAxis`], by a key whose unit is that of the axis: rotary or linear,
/// driven by a current or a voltage.
///
/// # Examples
///
/// ```
/// use ema_sim::{AxisParameter, Geometry, Drive};
///
/// let keys: Vec<String> =
///     AxisParameter::ALL.iter().map(|p| p.key(Geometry::Linear, Drive::Amplifier)).collect();
/// assert!(keys.contains(&"axis.mass-kg".to_owned()));
/// assert!(keys.contains(&"drive.force-constant-n-per-v".to_owned()));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct AxisParameter {
    /// The key with `{…}` where the units go.
    pattern: &'static str,
    least: f64,
    most: f64,
    default: Option<f64>,
    /// True for the number that is that of the kinetic friction where a file leaves it out.
    as_kinetic: bool,
    motion_term: Option<MotionTerm>,
    /// True for a number of a winding, which no other drive has.
    of_winding: bool,
    get: fn(&ServoAxis) -> f64,
    set: fn(&mut ServoAxis, f64),
}

const POSITIVE: f64 = f64::MIN_POSITIVE;
const FINITE: f64 = f64::MAX;

macro_rules! parameters {
    (@default) => { None };
    (@default $default:expr) => { Some($default) };
    (@kinetic) => { false };
    (@kinetic kinetic) => { true };
    (@term) => { None };
    (@term $term:ident) => { Some(MotionTerm::$term) };
    (@winding) => { false };
    (@winding winding) => { true };
    ($($pattern:literal: $($field:ident).+, $least:expr, $most:expr
        $(, else $default:expr)? $(, as $other:ident)? $(, sets $term:ident)? $(, of $drive:ident)?;)*) => {
        &[$(AxisParameter {
            pattern: $pattern,
            least: $least,
            most: $most,
            default: parameters!(@default $($default)?),
            as_kinetic: parameters!(@kinetic $($other)?),
            motion_term: parameters!(@term $($term)?),
            of_winding: parameters!(@winding $($drive)?),
            get: |axis| axis.$($field).+,
            set: |axis, value| axis.$($field).+ = value,
        }),*]
    };
}

impl PartialEq for AxisParameter {
    fn eq(&self, other: &Self) -> bool {
        self.pattern == other.pattern
    }
}

impl AxisParameter {
    /// All numbers, block by block.
    pub const ALL: &'static [Self] = parameters! {
        "axis.{inertia}": inertia, POSITIVE, FINITE, sets Inertia;
        "axis.viscous-{f}-s-per-{x}": viscous, 0.0, FINITE, else 0.0, sets Drag;
        "axis.kinetic-friction-{f}":
            kinetic_friction, 0.0, FINITE, else 0.0, sets KineticFriction;
        "axis.static-friction-{f}": static_friction, 0.0, FINITE, as kinetic;
        "axis.offset-{f}": offset, -1e9, 1e9, else 0.0;
        "axis.backlash-{x}": backlash, 0.0, FINITE, else 0.0;
        "drive.{force}-constant-{f}-per-{u}":
            force_constant, POSITIVE, FINITE, sets TorqueConstant;
        "drive.resistance-ohm": resistance_ohm, POSITIVE, FINITE, of winding;
        "controller.sample-hz": controller.sample_hz, POSITIVE, 1e6;
        "controller.position-gain-per-s": controller.position_gain_per_s, 0.0, FINITE, else 0.0;
        "controller.position-integral-per-s2": controller.position_integral_per_s2, 0.0, FINITE, else 0.0;
        "controller.position-derivative-ratio":
            controller.position_derivative_ratio, 0.0, FINITE, else 0.0;
        "controller.speed-limit-{x}-per-s": controller.speed_limit, POSITIVE, FINITE, else FINITE;
        "controller.speed-gain-{u}-s-per-{x}": controller.speed_gain, 0.0, FINITE;
        "controller.speed-integral-{u}-per-{x}": controller.speed_integral, 0.0, FINITE, else 0.0;
        "controller.output-limit-{u}": controller.output_limit, POSITIVE, FINITE;
        "controller.encoder-step-{x}": controller.encoder_step, 0.0, 1e6, else 0.0;
    };

    /// Block and field, with unit: `axis.mass-kg`.
    pub fn key(&self, geometry: Geometry, drive: Drive) -> String {
        let (inertia, force, f, x) = match geometry {
            Geometry::Rotary => ("inertia-kg-m2", "torque", "n-m", "rad"),
            Geometry::Linear => ("mass-kg", "force", "n", "m"),
        };
        // a winding's constant is over its current, whatever drives it
        let constant = self.motion_term == Some(MotionTerm::TorqueConstant);
        let by_current = drive == Drive::Current || (constant && drive == Drive::Winding);
        self.pattern
            .replace("{inertia}", inertia)
            .replace("{force}", force)
            .replace("{f}", f)
            .replace("{x}", x)
            .replace("{u}", if by_current { "a" } else { "v" })
    }

    /// The parameter with a key, for an axis of a kind.
    pub fn find(key: &str, geometry: Geometry, drive: Drive) -> Option<&'static Self> {
        Self::ALL.iter().find(|parameter| parameter.key(geometry, drive) == key)
    }

    /// True where an axis with a drive has this number: a resistance belongs to a winding alone.
    pub fn applies(&self, drive: Drive) -> bool {
        drive == Drive::Winding || !self.of_winding
    }

    /// Least and largest value that an axis can have.
    pub fn bounds(&self) -> (f64, f64) {
        (self.least, self.most)
    }

    /// Term of the equation of motion that it sets, if any.
    pub fn motion_term(&self) -> Option<MotionTerm> {
        self.motion_term
    }

    /// Default in an axis whose file leaves it out; `None` where the file must give it. A static
    /// friction that is left out is the kinetic one, and a resistance belongs to a winding alone.
    pub fn default_value(&self) -> Option<f64> {
        self.default
    }

    /// True for the static friction, which is the kinetic one where a file leaves it out.
    pub(crate) fn defaults_to_kinetic(&self) -> bool {
        self.as_kinetic
    }

    /// The parameter with a pattern.
    pub(crate) fn of_pattern(pattern: &str) -> Option<&'static Self> {
        Self::ALL.iter().find(|parameter| parameter.has_pattern(pattern))
    }

    /// True for the parameter with a pattern.
    pub(crate) fn has_pattern(&self, pattern: &str) -> bool {
        self.pattern == pattern
    }

    /// Value in an axis.
    pub fn get(&self, axis: &ServoAxis) -> f64 {
        (self.get)(axis)
    }

    /// Replaces its value; [`ServoAxis::check`] says whether the result can be simulated.
    pub fn set(&self, axis: &mut ServoAxis, value: f64) {
        (self.set)(axis, value);
    }

    /// Refuses what is not finite or out of bounds.
    pub(crate) fn check(&self, axis: &ServoAxis) -> Result<(), ParameterError> {
        let (value, least, most) = (self.get(axis), self.least, self.most);
        if value.is_finite() && value >= least && value <= most {
            Ok(())
        } else {
            let field = self.key(axis.geometry, axis.drive);
            Err(ParameterError::AxisOutOfBounds { field, value, least, most })
        }
    }
}
