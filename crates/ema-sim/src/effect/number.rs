//! Typed numbers of an effect: keys, quantity, bounds, role, and the size to try first.

use crate::effect::quantity::{Geometry, Quantity};

/// Most numbers that an effect has.
pub const MOST_PARAMETERS: usize = 5;

/// Largest size of a torque, force or drag that any effect may have, N·m, N, N·m·s/rad or N·s/m.
pub(crate) const MOST: f64 = 1e9;

/// Role of a number for one who fits it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Role {
    /// A size; with all sizes at zero the effect does nothing.
    Amplitude,
    /// A scale or exponent, worth trying at these multiples of its default.
    Shape(&'static [f64]),
    /// A position of the surface, to be sought over the travel; the number after it is the width of
    /// a region.
    Place,
    /// Periods in a turn of the motor, to be sought in the spectrum over angle.
    Order,
    /// A frequency, to be sought in the spectrum over time.
    Frequency,
    /// 0 or 1, given and not fitted.
    Switch,
}

impl Role {
    /// The name in reports: `amplitude`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Amplitude => "amplitude",
            Self::Shape(_) => "shape",
            Self::Place => "place",
            Self::Order => "order",
            Self::Frequency => "frequency",
            Self::Switch => "switch",
        }
    }
}

/// Scales of a machine at work, from which the typical size of an effect follows; SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MachineScales {
    /// Root mean square of the motor's torque or force.
    pub torque: f64,
    /// Root mean square of its current or voltage.
    pub drive: f64,
    /// Root mean square of the motor's speed.
    pub speed: f64,
    /// Half the travel of the surface or axis.
    pub travel: f64,
    /// Half the travel of the motor.
    pub motor_travel: f64,
    /// Time between two samples of the recording.
    pub sample_s: f64,
}

impl MachineScales {
    /// Least value of a scale that another is divided by.
    const LEAST: f64 = 1e-12;

    /// Speed, above zero.
    pub(crate) fn positive_speed(&self) -> f64 {
        self.speed.max(Self::LEAST)
    }

    /// Torque, above zero.
    pub(crate) fn positive_torque(&self) -> f64 {
        self.torque.max(Self::LEAST)
    }

    /// Half of the travel, above zero.
    pub(crate) fn positive_travel(&self) -> f64 {
        self.travel.max(Self::LEAST)
    }

    /// Square of the drive signal, above zero.
    pub(crate) fn positive_drive_squared(&self) -> f64 {
        (self.drive * self.drive).max(Self::LEAST)
    }
}

/// Scales of a machine from which the shapes follow that are worth trying on it; SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeScales {
    /// Usual speed of the motor, above zero.
    pub speed: f64,
    /// Inertia or mass of a machine that does not know its load's part of it.
    pub undivided_inertia: Option<f64>,
}

/// Values of a shape that a search tries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Trials {
    /// The multiples of its default that its role names.
    Multiples,
    /// These values.
    Values(&'static [f64]),
    /// Multiples of the machine's usual speed.
    OfSpeed(&'static [f64]),
    /// Parts of an inertia whose division is not known.
    OfInertia(&'static [f64]),
}

/// Quantity of a machine that bounds the size of an effect on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Limit {
    /// No quantity of the machine; the bounds of the catalogue alone.
    Catalogue,
    /// A multiple of what the motor makes.
    Torque,
    /// Inertia over the controller's tick.
    Drag,
    /// Inertia over the square of the tick, and the bound of a torque at the stop.
    Spring,
    /// The supply's voltage.
    Supply,
    /// Output that the controller may ask for.
    ControllerOutput,
}

/// One number of an effect.
#[derive(Clone, Copy, Debug)]
pub struct EffectParameter {
    rotary_key: &'static str,
    linear_key: &'static str,
    quantity: Quantity,
    rotary_default: f64,
    linear_default: f64,
    least: f64,
    most: f64,
    role: Role,
    cosine: bool,
    typical: fn(&MachineScales) -> f64,
    trials: Trials,
    limit: Limit,
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

    /// Physical quantity.
    pub fn quantity(&self) -> Quantity {
        self.quantity
    }

    /// Unit as text for people: `N·m·s/rad`.
    pub fn unit(&self, geometry: Geometry) -> &'static str {
        self.quantity.unit(geometry)
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

    /// Role for one who fits it.
    pub fn role(&self) -> Role {
        self.role
    }

    /// True for the cosine part of a wave, whose sine part is the number before it: the two make
    /// one amplitude and phase.
    pub fn is_cosine_part(&self) -> bool {
        self.cosine
    }

    /// Symbol in the equation, and what it stands for.
    pub fn meaning(&self) -> &'static str {
        self.meaning
    }

    /// Values worth starting a search from; none for a size, place, order or frequency.
    pub fn grid(&self, geometry: Geometry) -> Vec<f64> {
        match self.role {
            Role::Shape(multiples) => {
                multiples.iter().map(|m| m * self.default_value(geometry)).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Values of a shape that a search tries on a machine; none where the default alone is tried.
    ///
    /// # Examples
    ///
    /// ```
    /// use ema_sim::{EffectId, Geometry, ShapeScales};
    ///
    /// let speed = EffectId::NonlinearViscous.info().parameters[1];
    /// let scales = ShapeScales { speed: 40.0, undivided_inertia: None };
    /// assert_eq!(speed.trials(Geometry::Rotary, &scales), [40.0]);
    /// ```
    pub fn trials(&self, geometry: Geometry, machine: &ShapeScales) -> Vec<f64> {
        let times = |ratios: &[f64], scale: f64| ratios.iter().map(|r| r * scale).collect();
        let values: Vec<f64> = match self.trials {
            Trials::Multiples => {
                Some(self.grid(geometry)).filter(|grid| grid.len() > 1).unwrap_or_default()
            }
            Trials::Values(values) => values.to_vec(),
            Trials::OfSpeed(ratios) => times(ratios, machine.speed),
            Trials::OfInertia(parts) => {
                machine.undivided_inertia.map(|whole| times(parts, whole)).unwrap_or_default()
            }
        };
        values.into_iter().map(|value| value.clamp(self.least, self.most)).collect()
    }

    /// A size worth trying first, within the bounds: small against what a machine of these scales
    /// does. Of a number that is no size it is zero or the nearest bound.
    ///
    /// # Examples
    ///
    /// ```
    /// use ema_sim::{EffectId, MachineScales};
    ///
    /// let scales = MachineScales {
    ///     torque: 0.2, drive: 2.0, speed: 50.0, travel: 0.1, motor_travel: 5.0, sample_s: 1e-3,
    /// };
    /// let cogging = EffectId::Cogging.info().parameters[0].typical_size(&scales);
    /// assert!((cogging - 0.006).abs() < 1e-15); // 3 % of the usual torque, N·m
    /// ```
    pub fn typical_size(&self, scales: &MachineScales) -> f64 {
        (self.typical)(scales).clamp(self.least.max(-self.most), self.most)
    }

    /// Quantity of the machine that bounds it.
    pub(crate) fn limit(&self) -> Limit {
        self.limit
    }
}

/// Bounds of a size, and what a search and a machine make of it.
#[derive(Clone, Copy)]
pub(crate) struct Size {
    pub(crate) least: f64,
    pub(crate) most: f64,
    /// Size worth trying first on a machine of some scales.
    pub(crate) typical: fn(&MachineScales) -> f64,
    pub(crate) limit: Limit,
}

/// Default and bounds of a number that is no size.
#[derive(Clone, Copy)]
pub(crate) struct Range {
    /// Default of a machine that turns, and of one that slides.
    pub(crate) defaults: [f64; 2],
    pub(crate) least: f64,
    pub(crate) most: f64,
}

/// A size, with its keys on a machine that turns and on one that slides; zero by default.
pub(crate) const fn size(
    keys: [&'static str; 2],
    quantity: Quantity,
    size: Size,
    meaning: &'static str,
) -> EffectParameter {
    EffectParameter {
        rotary_key: keys[0],
        linear_key: keys[1],
        quantity,
        rotary_default: 0.0,
        linear_default: 0.0,
        least: size.least,
        most: size.most,
        role: Role::Amplitude,
        cosine: false,
        typical: size.typical,
        trials: Trials::Multiples,
        limit: size.limit,
        meaning,
    }
}

/// The cosine part of a wave whose sine part is the number before it.
pub(crate) const fn cosine(
    keys: [&'static str; 2],
    quantity: Quantity,
    of: Size,
    meaning: &'static str,
) -> EffectParameter {
    EffectParameter { cosine: true, ..size(keys, quantity, of, meaning) }
}

/// A number that is no size.
pub(crate) const fn number(
    keys: [&'static str; 2],
    quantity: Quantity,
    range: Range,
    role: Role,
    meaning: &'static str,
) -> EffectParameter {
    EffectParameter {
        rotary_key: keys[0],
        linear_key: keys[1],
        quantity,
        rotary_default: range.defaults[0],
        linear_default: range.defaults[1],
        least: range.least,
        most: range.most,
        role,
        cosine: false,
        typical: |_| 0.0,
        trials: Trials::Multiples,
        limit: Limit::Catalogue,
        meaning,
    }
}

impl EffectParameter {
    /// The shape, with values that a search tries.
    pub(crate) const fn tried(self, trials: Trials) -> Self {
        Self { trials, ..self }
    }

    /// The number, bounded on a machine by one of its quantities.
    pub(crate) const fn limited_by(self, limit: Limit) -> Self {
        Self { limit, ..self }
    }
}

/// Periods in a turn of the rotor; of a linear axis the wave number.
pub(crate) const fn order(default: f64) -> EffectParameter {
    let range = Range { defaults: [default, default], least: 0.0, most: 1e6 };
    let keys = ["order", "wavenumber_rad_per_m"];
    number(keys, Quantity::Order, range, Role::Order, "n, periods a turn (rad per m)")
}

/// Declares the numbers of an effect once: a struct with a field for each, by which the effect's
/// law reads them, and `NUMBERS`, the descriptions in the same order.
macro_rules! numbers {
    (
        $(#[$meta:meta])*
        $name:ident { $($(#[$field_meta:meta])* $field:ident: $parameter:expr,)* }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug)]
        pub(super) struct $name {
            $($(#[$field_meta])* $field: f64,)*
        }

        impl $name {
            /// Descriptions of the numbers, in the order of the fields.
            pub(super) const NUMBERS: &'static [$crate::effect::number::EffectParameter] =
                &[$($parameter),*];

            /// The numbers of an effect.
            #[inline]
            pub(super) fn of(given: &$crate::effect::law::Given<'_>) -> Self {
                let [$($field,)* ..] = *given.values;
                Self { $($field),* }
            }
        }
    };
}
pub(crate) use numbers;
