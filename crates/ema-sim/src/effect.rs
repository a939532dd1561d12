//! Optional physics: what a machine does besides the base model, one effect a cause.
//!
//! An effect acts on a declared port and has an equation with a few numbers. With the defaults
//! it does nothing, and a model without effects is the base model bit for bit.

mod catalogue;
mod curve;
pub(crate) mod extension;
pub(crate) mod footing;
pub(crate) mod strength;

pub use catalogue::EffectId;
pub use curve::{Coordinate, Curve, CurveError, CurveKind};

use crate::number_format::{Expected, Told};

/// Where an effect enters the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Port {
    /// A torque (of a linear axis: a force) on the moving shaft.
    MotorTorque,
    /// Between motor and surface.
    Transmission,
    /// Winding, inverter, supply.
    Electrical,
    /// What a sensor shows.
    Sensor,
    /// What the controller does.
    Controller,
}

impl Port {
    /// All ports.
    pub const ALL: [Self; 5] =
        [Self::MotorTorque, Self::Transmission, Self::Electrical, Self::Sensor, Self::Controller];

    /// Its name in model files and reports: `motor-torque`.
    pub fn name(self) -> &'static str {
        match self {
            Self::MotorTorque => "motor-torque",
            Self::Transmission => "transmission",
            Self::Electrical => "electrical",
            Self::Sensor => "sensor",
            Self::Controller => "controller",
        }
    }
}

/// Effects of one class differ in the form of the same curve and are hard to tell apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum EffectClass {
    /// Friction against speed.
    FrictionSpeed,
    /// Difference between the directions of motion.
    Asymmetry,
    /// Torque or friction with the load.
    Load,
    /// Motion before sliding.
    MicroMotion,
    /// Torque or friction with the position.
    Position,
    /// Change over time.
    Time,
    /// Elasticity and errors of the gear.
    Transmission,
    /// A fixed order of the motor's angle.
    AnglePeriodic,
    /// Torque against current.
    Current,
    /// A factor on torque.
    Gain,
    /// Winding, inverter, supply.
    Electrical,
    /// What a sensor shows.
    Sensor,
    /// What the controller does.
    Controller,
    /// A fixed frequency.
    TimePeriodic,
    /// No cause known.
    Unknown,
}

/// Whether a machine turns or slides: the units of its effects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Geometry {
    /// Angles in rad, torques in N·m.
    Rotary,
    /// Lengths in m, forces in N.
    Linear,
}

/// What a number of an effect is for one who fits it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Role {
    /// A size; with all sizes at zero the effect does nothing.
    Amplitude,
    /// A scale or exponent, worth trying at these multiples of its default.
    Shape(&'static [f64]),
    /// A position of the surface, to be sought over the travel.
    Place,
    /// Periods in a turn of the motor, to be sought in the spectrum over angle.
    Order,
    /// A frequency, to be sought in the spectrum over time.
    Frequency,
    /// 0 or 1, known beforehand.
    Switch,
}

/// One number of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectParameter {
    rotary_key: &'static str,
    linear_key: &'static str,
    rotary_default: f64,
    linear_default: f64,
    least: f64,
    most: f64,
    role: Role,
    meaning: &'static str,
}

impl EffectParameter {
    /// Name with unit, as in reports: `viscous_asymmetry_n_m_s_per_rad`, of a linear axis
    /// `viscous_asymmetry_n_s_per_m`. Model files write `-` for `_`.
    pub fn key(&self, geometry: Geometry) -> &'static str {
        match geometry {
            Geometry::Rotary => self.rotary_key,
            Geometry::Linear => self.linear_key,
        }
    }

    /// Value of a new effect; zero for an [`Role::Amplitude`].
    pub fn default_value(&self, geometry: Geometry) -> f64 {
        match geometry {
            Geometry::Rotary => self.rotary_default,
            Geometry::Linear => self.linear_default,
        }
    }

    /// Least and largest value allowed.
    pub fn bounds(&self) -> (f64, f64) {
        (self.least, self.most)
    }

    /// What it is for one who fits it.
    pub fn role(&self) -> Role {
        self.role
    }

    /// Its symbol in the equation, and what it is.
    pub fn meaning(&self) -> &'static str {
        self.meaning
    }

    /// Values worth starting a search from; of a size, place, order or frequency none.
    pub fn grid(&self, geometry: Geometry) -> Vec<f64> {
        match self.role {
            Role::Shape(multiples) => {
                multiples.iter().map(|m| m * self.default_value(geometry)).collect()
            }
            _ => Vec::new(),
        }
    }
}

/// What is known of an effect besides its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectInfo {
    /// Catalogue identifier, `E01` to `E25`; `U` for the tabulated one.
    pub symbol: &'static str,
    /// What an engineer calls it.
    pub name: &'static str,
    /// Where it acts.
    pub port: Port,
    /// Its family.
    pub class: EffectClass,
    /// What it adds.
    pub equation: &'static str,
    /// Its numbers, at most [`MOST_PARAMETERS`].
    pub parameters: &'static [EffectParameter],
    /// The fault, or other effect, that it is mistaken for.
    pub mimics: &'static str,
    /// What tells it apart.
    pub separated_by: &'static str,
    /// Where form and size come from.
    pub source: &'static str,
}

/// Most numbers that an effect has.
pub const MOST_PARAMETERS: usize = 5;

/// An effect with its numbers.
///
/// # Examples
///
/// ```
/// use ema_sim::{Effect, EffectId, Geometry, HealthState, LowFidelity, Scenario, presets::EMA_48};
///
/// let cogging = Effect::new(EffectId::Cogging, Geometry::Rotary)
///     .with("cogging_sin_n_m", 0.004)?
///     .with("order", 24.0)?;
/// let model = LowFidelity::new(&EMA_48, &Scenario::chirp())?.with_effects(&[cogging])?;
/// let trace = model.simulate(&(&HealthState::HEALTHY).into());
/// assert_eq!(trace.current_a.len(), 5000);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    id: EffectId,
    geometry: Geometry,
    values: [f64; MOST_PARAMETERS],
    curve: Option<Curve>,
}

/// A number that an effect does not have, or not with this value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EffectError {
    /// No such parameter.
    #[error("effect {} has no parameter `{key}`", .effect.info().symbol)]
    UnknownKey {
        /// The effect.
        effect: EffectId,
        /// The key given.
        key: String,
    },
    /// Not finite, or outside its bounds.
    #[error(
        "`{key}` of effect {} is {}, expected {}",
        .effect.info().symbol,
        Told(*.value),
        Expected(*.least, *.most)
    )]
    OutOfBounds {
        /// The effect.
        effect: EffectId,
        /// The parameter.
        key: &'static str,
        /// Value given.
        value: f64,
        /// Least value allowed.
        least: f64,
        /// Largest value allowed.
        most: f64,
    },
    /// The model has not what the effect acts on, or has it built in.
    #[error("effect {} ({}) does not act in {model}: {reason}", .effect.info().symbol, .effect.info().name)]
    NotInModel {
        /// The effect.
        effect: EffectId,
        /// The model.
        model: &'static str,
        /// Why.
        reason: &'static str,
    },
    /// Stronger than the machine that it is put in can be simulated with.
    #[error(
        "`{key}` of effect {} is {}, and this machine takes at most {}: {reason}",
        .effect.info().symbol,
        Told(*.value),
        Told(*.most)
    )]
    TooStrong {
        /// The effect.
        effect: EffectId,
        /// The parameter.
        key: &'static str,
        /// Value given.
        value: f64,
        /// Largest size that the machine takes, of either sign.
        most: f64,
        /// What sets it.
        reason: &'static str,
    },
    /// The effect is of a machine of the other geometry.
    #[error("effect {} is in the units of a {found:?} machine", .effect.info().symbol)]
    WrongGeometry {
        /// The effect.
        effect: EffectId,
        /// Its geometry.
        found: Geometry,
    },
    /// Two effects that cannot act together.
    #[error("effect {} acts in a model once only", .effect.info().symbol)]
    Twice {
        /// The effect.
        effect: EffectId,
    },
}

impl Effect {
    /// An effect that does nothing yet.
    pub fn new(id: EffectId, geometry: Geometry) -> Self {
        let mut values = [0.0; MOST_PARAMETERS];
        for (value, parameter) in values.iter_mut().zip(id.info().parameters) {
            *value = parameter.default_value(geometry);
        }
        Self { id, geometry, values, curve: None }
    }

    /// A measured curve.
    pub fn tabulated(curve: Curve, geometry: Geometry) -> Self {
        let mut effect = Self::new(EffectId::Tabulated, geometry);
        effect.values[0] = 1.0;
        effect.curve = Some(curve);
        effect
    }

    /// Which effect.
    pub fn id(&self) -> EffectId {
        self.id
    }

    /// The units of its numbers.
    pub fn geometry(&self) -> Geometry {
        self.geometry
    }

    /// The measured curve of a tabulated effect.
    pub fn curve(&self) -> Option<&Curve> {
        self.curve.as_ref()
    }

    /// A number by its key.
    pub fn get(&self, key: &str) -> Option<f64> {
        self.place(key).map(|place| self.values[place])
    }

    /// Its numbers, in the order of [`EffectInfo::parameters`].
    pub fn values(&self) -> &[f64] {
        &self.values[..self.id.info().parameters.len()]
    }

    /// The same effect with one number replaced.
    ///
    /// # Errors
    ///
    /// As [`set`](Self::set).
    pub fn with(mut self, key: &str, value: f64) -> Result<Self, EffectError> {
        self.set(key, value)?;
        Ok(self)
    }

    /// Replaces a number.
    ///
    /// # Errors
    ///
    /// [`EffectError`] for a key that the effect does not have or a value out of its bounds.
    pub fn set(&mut self, key: &str, value: f64) -> Result<(), EffectError> {
        let unknown = || EffectError::UnknownKey { effect: self.id, key: key.to_owned() };
        let place = self.place(key).ok_or_else(unknown)?;
        let parameter = &self.id.info().parameters[place];
        let (least, most) = parameter.bounds();
        if !(least..=most).contains(&value) {
            let key = parameter.key(self.geometry);
            return Err(EffectError::OutOfBounds { effect: self.id, key, value, least, most });
        }
        self.values[place] = value;
        Ok(())
    }

    /// Whether all its sizes are zero, so that it changes nothing.
    pub fn is_off(&self) -> bool {
        let mut numbers = self.id.info().parameters.iter().zip(self.values);
        let sized = numbers.any(|(parameter, v)| parameter.role == Role::Amplitude && v != 0.0);
        !sized || (self.id == EffectId::Tabulated && self.curve.as_ref().is_none_or(Curve::is_zero))
    }

    fn place(&self, key: &str) -> Option<usize> {
        self.id.info().parameters.iter().position(|p| p.key(self.geometry) == key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_is_complete_and_off_by_default() {
        for (n, id) in EffectId::ALL.into_iter().enumerate() {
            let info = id.info();
            let symbol =
                if id == EffectId::Tabulated { "U".to_owned() } else { format!("E{:02}", n + 1) };
            assert_eq!(info.symbol, symbol);
            assert!((1..=MOST_PARAMETERS).contains(&info.parameters.len()), "{symbol}");
            for text in [info.name, info.equation, info.mimics, info.separated_by, info.source] {
                assert!(!text.is_empty(), "{symbol}");
            }
            for geometry in [Geometry::Rotary, Geometry::Linear] {
                assert!(Effect::new(id, geometry).is_off(), "{symbol}");
                for parameter in info.parameters {
                    let (least, most) = parameter.bounds();
                    let value = parameter.default_value(geometry);
                    assert!(least <= value && value <= most, "{symbol}: {parameter:?}");
                    assert_eq!(EffectId::find(info.symbol), Some(id));
                    if parameter.role() == Role::Amplitude {
                        assert_eq!(value, 0.0, "{symbol}: {parameter:?}");
                    }
                    for value in parameter.grid(geometry) {
                        assert!(least <= value && value <= most, "{symbol}: {parameter:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_number_out_of_bounds_is_refused_by_name() {
        let error = Effect::new(EffectId::Stribeck, Geometry::Linear)
            .with("stribeck_n", -1.0)
            .unwrap_err()
            .to_string();
        assert!(error.starts_with("`stribeck_n` of effect E01 is -1"), "{error}");
        let error = Effect::new(EffectId::Stribeck, Geometry::Linear)
            .with("stribeck_n_m", 1.0)
            .unwrap_err()
            .to_string();
        assert_eq!(error, "effect E01 has no parameter `stribeck_n_m`");
    }
}
