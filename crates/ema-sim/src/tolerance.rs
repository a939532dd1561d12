//! Tolerances: which numbers of machines, tests and sensors scatter, how far, and between what.

use crate::parameter::Parameter;

/// Level at which a number scatters. Errors of several levels add: a recording has those of its
/// type, of its unit, of its session and its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Between types: the bias of a data sheet, alike in all machines that it describes.
    Type,
    /// Between units of one type.
    Unit,
    /// Between sessions of one unit, such as days.
    Session,
    /// Between recordings of one session.
    Recording,
}

impl Level {
    /// All levels, from the widest.
    pub const ALL: [Self; 4] = [Self::Type, Self::Unit, Self::Session, Self::Recording];

    /// Name in a model file: `unit`.
    pub fn key(self) -> &'static str {
        match self {
            Self::Type => "type",
            Self::Unit => "unit",
            Self::Session => "session",
            Self::Recording => "recording",
        }
    }

    /// The level with a name.
    pub fn find(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|level| level.key() == key)
    }

    /// True for what stays with a machine as built: type and unit.
    pub fn is_of_machine(self) -> bool {
        matches!(self, Self::Type | Self::Unit)
    }
}

/// A number that a tolerance can be given for.
///
/// | number | key | spread |
/// |---|---|---|
/// | [`Parameter`](Self::Parameter) | key of the parameter | share of its value |
/// | [`StaticOverKinetic`](Self::StaticOverKinetic) | `transmission.static-over-kinetic` | share of its value |
/// | [`Load`](Self::Load) | `test.load-n-m` | N·m |
/// | [`PhaseGain`](Self::PhaseGain) | `sensors.phase-gain` | share of its value |
/// | [`PhaseOffset`](Self::PhaseOffset) | `sensors.phase-offset-a` | A |
/// | [`VoltageGain`](Self::VoltageGain) | `sensors.voltage-gain` | share of its value |
/// | [`Turns`](Self::Turns) | `as-built.turns` | share of the turns |
/// | [`Eccentricity`](Self::Eccentricity) | `as-built.eccentricity` | share of the air gap |
/// | [`WindingTemperature`](Self::WindingTemperature) | `test.winding-temperature-k` | K |
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum UncertainNumber {
    /// A number of the actuator.
    Parameter(&'static Parameter),
    /// Static over kinetic friction, `F_s/F_k`. The static friction follows the kinetic one in
    /// this ratio.
    StaticOverKinetic,
    /// Load of the test at the surface, N·m.
    Load,
    /// Gain of a sensor of the phase currents, each phase by itself.
    PhaseGain,
    /// Offset of a sensor of the phase currents, A, each phase by itself.
    PhaseOffset,
    /// Gain of the measurement of the motor's voltage, or of the supply's.
    VoltageGain,
    /// Turns of a phase as built, each phase by itself.
    Turns,
    /// Eccentricity as built: rms amplitude `ζ` of the air gap's modulation. Each of the two
    /// coordinates `ζ·cos φ` and `ζ·sin φ` has this over √2.
    Eccentricity,
    /// Temperature of the winding less that of the model file's numbers, K. What follows it the
    /// model file's [`TemperatureLaw`](crate::TemperatureLaw) says.
    WindingTemperature,
}

impl UncertainNumber {
    /// The numbers that are no parameter of an actuator.
    pub const BESIDES_PARAMETERS: [Self; 8] = [
        Self::StaticOverKinetic,
        Self::Load,
        Self::PhaseGain,
        Self::PhaseOffset,
        Self::VoltageGain,
        Self::Turns,
        Self::Eccentricity,
        Self::WindingTemperature,
    ];

    /// Block and field in `[tolerance]`: `motor.resistance-ohm`, `sensors.phase-gain`.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.key(),
            Self::StaticOverKinetic => "transmission.static-over-kinetic",
            Self::Load => "test.load-n-m",
            Self::PhaseGain => "sensors.phase-gain",
            Self::PhaseOffset => "sensors.phase-offset-a",
            Self::VoltageGain => "sensors.voltage-gain",
            Self::Turns => "as-built.turns",
            Self::Eccentricity => "as-built.eccentricity",
            Self::WindingTemperature => "test.winding-temperature-k",
        }
    }

    /// The number with a key.
    pub fn find(key: &str) -> Option<Self> {
        let parameter = Parameter::find(key).map(Self::Parameter);
        parameter.or_else(|| Self::BESIDES_PARAMETERS.into_iter().find(|n| n.key() == key))
    }

    /// True where the spread is a share; false where it has the unit of the number.
    pub fn is_relative(self) -> bool {
        !matches!(self, Self::Load | Self::PhaseOffset | Self::WindingTemperature)
    }
}

/// Distribution of a number about its nominal value: a share of it, or in its unit
/// ([`UncertainNumber::is_relative`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spread {
    /// Uniform within this half-width.
    HalfWidth(f64),
    /// Normal with this standard deviation.
    Std(f64),
}

impl Spread {
    /// Standard deviation; of a uniform distribution its half-width over √3.
    pub fn std(self) -> f64 {
        match self {
            Self::HalfWidth(half_width) => half_width / libm::sqrt(3.0),
            Self::Std(std) => std,
        }
    }

    /// Half-width of the uniform distribution with this standard deviation.
    pub fn half_width(self) -> f64 {
        match self {
            Self::HalfWidth(half_width) => half_width,
            Self::Std(std) => std * libm::sqrt(3.0),
        }
    }
}

/// How far a number scatters at one level. Several levels of one number are several tolerances.
///
/// # Examples
///
/// ```
/// use ema_sim::{Level, Spread, Tolerance, UncertainNumber};
///
/// let number = UncertainNumber::find("motor.resistance-ohm").unwrap();
/// let tolerance = Tolerance { number, spread: Spread::HalfWidth(0.05), level: Level::Unit };
/// assert_eq!(tolerance.key(), "motor.resistance-ohm");
/// assert_eq!(tolerance.std(), 0.05 / 3.0_f64.sqrt());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Which number.
    pub number: UncertainNumber,
    /// Distribution about the nominal value.
    pub spread: Spread,
    /// Level at which it scatters.
    pub level: Level,
}

impl Tolerance {
    /// Standard deviation: a share, or in the unit of the number
    /// ([`UncertainNumber::is_relative`]).
    pub fn std(&self) -> f64 {
        self.spread.std()
    }

    /// Block and field in `[tolerance]`: `motor.resistance-ohm`, `sensors.phase-gain`.
    pub fn key(&self) -> &'static str {
        self.number.key()
    }
}
