//! Descriptions of effects: name, port, family, equation, look-alikes, source.

use crate::effect::number::{EffectParameter, Role};

/// Source of a form that textbooks have and whose sizes are the project's own.
pub(crate) const CHOICE: &str = "textbook form; the project's choice";

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
    /// A sensor's reading.
    Sensor,
    /// The controller's law.
    Controller,
}

impl Port {
    /// All ports.
    pub const ALL: [Self; 5] =
        [Self::MotorTorque, Self::Transmission, Self::Electrical, Self::Sensor, Self::Controller];

    /// The name in model files and reports: `motor-torque`.
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
    /// A sensor's reading.
    Sensor,
    /// The controller's law.
    Controller,
    /// A fixed frequency.
    TimePeriodic,
    /// No cause known.
    Unknown,
}

impl EffectClass {
    /// The name in reports: `friction-speed`.
    pub fn name(self) -> &'static str {
        match self {
            Self::FrictionSpeed => "friction-speed",
            Self::Asymmetry => "asymmetry",
            Self::Load => "load",
            Self::MicroMotion => "micro-motion",
            Self::Position => "position",
            Self::Time => "time",
            Self::Transmission => "transmission",
            Self::AnglePeriodic => "angle-periodic",
            Self::Current => "current",
            Self::Gain => "gain",
            Self::Electrical => "electrical",
            Self::Sensor => "sensor",
            Self::Controller => "controller",
            Self::TimePeriodic => "time-periodic",
            Self::Unknown => "unknown",
        }
    }
}

/// How often an effect may act in one model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Repetition {
    /// Once: it has a state of its own, or changes one number of the machine.
    Once,
    /// Several blocks add up to one cause.
    Sum,
    /// Several blocks are causes of their own: waves of different orders.
    ByOrder,
}

impl Repetition {
    /// The name in reports: `once`, `sum`, `by-order`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Once => "once",
            Self::Sum => "sum",
            Self::ByOrder => "by-order",
        }
    }
}

/// Part of the closed loop through which an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LoopPart {
    /// The machine with drive and current loop.
    Machine,
    /// The control of the motion alone: its law, or the position that it reads. The drive signal
    /// that a measured motion asks for does not depend on it.
    Controller,
}

/// Description of an effect, without the values of its numbers.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct EffectInfo {
    /// Catalogue identifier, `E` and a number; `U` for the tabulated one.
    pub symbol: &'static str,
    /// An engineer's name for it.
    pub name: &'static str,
    /// Where it acts.
    pub port: Port,
    /// Family of effects that are hard to tell apart.
    pub class: EffectClass,
    /// Contribution to the machine's equations.
    pub equation: &'static str,
    /// Typed numbers, at most [`MOST_PARAMETERS`](crate::MOST_PARAMETERS).
    pub parameters: &'static [EffectParameter],
    /// The fault, or other effect, that it is confounded with.
    pub mimics: &'static str,
    /// The experiment that tells it apart.
    pub separated_by: &'static str,
    /// Where form and size come from.
    pub source: &'static str,
    /// How often it may act in one model.
    pub repetition: Repetition,
    /// True where its sizes differ between recordings of one machine.
    pub differs_by_recording: bool,
    /// True where its action is not in proportion to its size.
    pub nonlinear_in_size: bool,
    /// Part of the closed loop through which it acts.
    pub acts_through: LoopPart,
    /// True where it takes a measured [`Curve`](crate::Curve).
    pub takes_curve: bool,
}

impl EffectInfo {
    /// Name with the catalogue's symbol: `cogging (E11)`.
    pub fn label(&self) -> String {
        format!("{} ({})", self.name, self.symbol)
    }

    /// Places of the sizes in [`parameters`](Self::parameters), those of one wave together.
    ///
    /// # Examples
    ///
    /// ```
    /// use ema_sim::EffectId;
    ///
    /// // gravity is a wave over the turn; the spring is a size of its own
    /// assert_eq!(EffectId::Imbalance.info().size_groups(), [vec![0, 1], vec![2]]);
    /// ```
    pub fn size_groups(&self) -> Vec<Vec<usize>> {
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for (place, parameter) in self.parameters.iter().enumerate() {
            match groups.last_mut() {
                Some(group) if parameter.is_cosine_part() => group.push(place),
                _ if parameter.role() == Role::Amplitude => groups.push(vec![place]),
                _ => {}
            }
        }
        groups
    }
}
