//! Every number of an actuator by name: what model files, checks and calibration share.

use crate::{motion_term::MotionTerm, parameter_error::ParameterError, params::Actuator};

/// One number of an [`Actuator`], by the key that model files use.
///
/// # Examples
///
/// ```
/// use ema_sim::{Parameter, presets::EMA_48};
///
/// let resistance = Parameter::find("motor.resistance-ohm").unwrap();
/// assert_eq!(*resistance, Parameter::RESISTANCE);
///
/// let mut actuator = EMA_48;
/// resistance.set(&mut actuator, 1.1);
/// assert_eq!(resistance.get(&actuator), 1.1);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    key: &'static str,
    block: Block,
    least: f64,
    most: f64,
    default: Option<f64>,
    motion_term: Option<MotionTerm>,
    get: fn(&Actuator) -> f64,
    set: fn(&mut Actuator, f64),
}

/// Part of an actuator that a parameter describes: a block of the model file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Block {
    /// `[motor]`.
    Motor,
    /// `[inverter]`.
    Inverter,
    /// `[transmission]`.
    Transmission,
    /// `[controller]`.
    Controller,
    /// `[sensing]`.
    Sensing,
}

/// Lower bound of what must be above zero.
const POSITIVE: f64 = f64::MIN_POSITIVE;
/// No bound but finite.
const FINITE: f64 = f64::MAX;
/// Beyond the steps and noise of any sensor, in rad, A and rad/s.
const COARSEST: f64 = 1e6;
/// Beyond the switches and controllers of any drive; each period costs work.
const FASTEST_HZ: f64 = 1e7;

macro_rules! parameters {
    (@default) => { None };
    (@default $default:expr) => { Some($default) };
    (@block motor) => { Block::Motor };
    (@block inverter) => { Block::Inverter };
    (@block transmission) => { Block::Transmission };
    (@block controller) => { Block::Controller };
    (@block sensing) => { Block::Sensing };
    (@term) => { None };
    (@term $term:ident) => { Some(MotionTerm::$term) };
    ($($name:ident $key:literal: $block:ident.$field:ident as $kind:ty, $least:expr, $most:expr
        $(, else $default:expr)? $(, sets $term:ident)?;)*) => {
        $(
            #[doc = concat!("`", $key, "`.")]
            pub const $name: Self = Self {
                key: $key,
                block: parameters!(@block $block),
                least: $least,
                most: $most,
                default: parameters!(@default $($default)?),
                motion_term: parameters!(@term $($term)?),
                get: |actuator| <$kind as Number>::read(actuator.$block.$field),
                set: |actuator, value| {
                    actuator.$block.$field = <$kind as Number>::made_of(value);
                },
            };
        )*

        /// All numbers, block by block.
        pub const ALL: &'static [Self] = &[$(Self::$name),*];
    };
}

impl PartialEq for Parameter {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}

impl Parameter {
    parameters! {
        POLE_PAIRS "motor.pole-pairs": motor.pole_pairs as u32, 1.0, 1000.0;
        RESISTANCE "motor.resistance-ohm": motor.resistance_ohm as f64, POSITIVE, FINITE;
        INDUCTANCE "motor.inductance-henry": motor.inductance_henry as f64, POSITIVE, FINITE;
        BACK_EMF "motor.back-emf-v-s-per-rad": motor.back_emf_v_s_per_rad as f64, POSITIVE, FINITE, sets TorqueConstant;
        MOTOR_INERTIA "motor.inertia-kg-m2": motor.inertia_kg_m2 as f64, POSITIVE, FINITE, sets Inertia;
        VISCOUS "motor.viscous-n-m-s-per-rad": motor.viscous_n_m_s_per_rad as f64, 0.0, FINITE, sets Drag;
        BUS_VOLTAGE "inverter.bus-voltage-v": inverter.bus_voltage_v as f64, POSITIVE, FINITE;
        CARRIER "inverter.carrier-hz": inverter.carrier_hz as f64, POSITIVE, FASTEST_HZ;
        CURRENT_BANDWIDTH "inverter.current-bandwidth-hz": inverter.current_bandwidth_hz as f64, POSITIVE, FINITE;
        DEAD_TIME "inverter.dead-time-s": inverter.dead_time_s as f64, 0.0, FINITE, else 0.0;
        GEAR_RATIO "transmission.gear-ratio": transmission.gear_ratio as f64, POSITIVE, FINITE;
        SURFACE_INERTIA "transmission.surface-inertia-kg-m2": transmission.surface_inertia_kg_m2 as f64, 0.0, FINITE;
        BACKLASH "transmission.backlash-rad": transmission.backlash_rad as f64, 0.0, FINITE;
        KINETIC_FRICTION "transmission.kinetic-friction-n-m": transmission.kinetic_friction_n_m as f64, 0.0, FINITE, sets KineticFriction;
        STATIC_FRICTION "transmission.static-friction-n-m": transmission.static_friction_n_m as f64, 0.0, FINITE;
        SURFACE_FRICTION "transmission.surface-friction-n-m": transmission.surface_friction_n_m as f64, 0.0, FINITE, else 0.0;
        EFFICIENCY "transmission.efficiency-ratio": transmission.efficiency_ratio as f64, 0.01, 1.0;
        STOP "transmission.stop-rad": transmission.stop_rad as f64, POSITIVE, FINITE;
        SAMPLE_RATE "controller.sample-hz": controller.sample_hz as f64, POSITIVE, FASTEST_HZ;
        POSITION_GAIN "controller.position-gain-per-s": controller.position_gain_per_s as f64, 0.0, FINITE;
        SPEED_LIMIT "controller.speed-limit-rad-per-s": controller.speed_limit_rad_per_s as f64, POSITIVE, FINITE;
        SPEED_GAIN "controller.speed-gain-a-s-per-rad": controller.speed_gain_a_s_per_rad as f64, 0.0, FINITE;
        SPEED_INTEGRAL "controller.speed-integral-a-per-rad": controller.speed_integral_a_per_rad as f64, 0.0, FINITE;
        SPEED_DERIVATIVE "controller.speed-derivative-a-s2-per-rad": controller.speed_derivative_a_s2_per_rad as f64, 0.0, FINITE, else 0.0;
        CURRENT_LIMIT "controller.current-limit-a": controller.current_limit_a as f64, POSITIVE, FINITE;
        SURFACE_STEP "sensing.surface-step-rad": sensing.surface_step_rad as f64, 0.0, COARSEST;
        CURRENT_REFERENCE_STEP "sensing.current-reference-step-a": sensing.current_reference_step_a as f64, 0.0, COARSEST;
        SPEED_NOISE "sensing.speed-noise-rad-per-s": sensing.speed_noise_rad_per_s as f64, 0.0, COARSEST;
        CURRENT_NOISE "sensing.current-noise-half-width-a": sensing.current_noise_half_width_a as f64, 0.0, COARSEST;
    }

    /// The parameter with a key.
    pub fn find(key: &str) -> Option<&'static Self> {
        Self::ALL.iter().find(|parameter| parameter.key == key)
    }

    /// Block and field, with unit: `motor.resistance-ohm`.
    pub const fn key(&self) -> &'static str {
        self.key
    }

    /// Part of the actuator that it describes.
    pub fn block(&self) -> Block {
        self.block
    }

    /// Least and largest value that a machine can have.
    pub fn bounds(&self) -> (f64, f64) {
        (self.least, self.most)
    }

    /// Term of the equation of motion that it sets, if any.
    pub fn motion_term(&self) -> Option<MotionTerm> {
        self.motion_term
    }

    /// Default in a machine whose file leaves it out; `None` when every file must give it.
    pub fn default_value(&self) -> Option<f64> {
        self.default
    }

    /// Value in an actuator.
    pub fn get(&self, actuator: &Actuator) -> f64 {
        (self.get)(actuator)
    }

    /// Replaces its value; [`Actuator::check`] says whether the result can be simulated. The
    /// number of pole pairs is rounded.
    pub fn set(&self, actuator: &mut Actuator, value: f64) {
        (self.set)(actuator, value);
    }

    /// Refuses what is not finite or out of bounds.
    pub(crate) fn check(&self, actuator: &Actuator) -> Result<(), ParameterError> {
        within(self.key, self.get(actuator), self.least, self.most)
    }
}

/// Requires `least ≤ value ≤ most`.
pub(crate) fn within(
    field: &'static str,
    value: f64,
    least: f64,
    most: f64,
) -> Result<(), ParameterError> {
    if value.is_finite() && value >= least && value <= most {
        Ok(())
    } else {
        Err(ParameterError::OutOfBounds { field, value, least, most })
    }
}

/// A number of a machine with its key.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Keyed<'a> {
    pub(crate) key: &'a str,
    pub(crate) value: f64,
}

/// Requires dry friction that does not fall when the machine stops.
pub(crate) fn kinetic_within_static(
    kinetic: Keyed<'_>,
    fixed: Keyed<'_>,
) -> Result<(), ParameterError> {
    let (kinetic_value, fixed_value) = (kinetic.value, fixed.value);
    if kinetic_value > fixed_value {
        let (kinetic, fixed) = (kinetic.key.to_owned(), fixed.key.to_owned());
        return Err(ParameterError::KineticAboveStatic {
            kinetic,
            kinetic_value,
            fixed,
            fixed_value,
        });
    }
    Ok(())
}

/// How a field is read and written as a number.
trait Number: Copy {
    fn read(self) -> f64;
    fn made_of(value: f64) -> Self;
}

impl Number for f64 {
    fn read(self) -> f64 {
        self
    }
    fn made_of(value: f64) -> Self {
        value
    }
}

impl Number for u32 {
    fn read(self) -> f64 {
        f64::from(self)
    }
    fn made_of(value: f64) -> Self {
        libm::round(value) as Self
    }
}
