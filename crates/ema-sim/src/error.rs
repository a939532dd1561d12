//! Why an actuator or a test cannot be simulated.

use core::fmt;

use crate::{effect::EffectError, fault::FaultId, runaway::Runaway};

/// A number as a message shows it, in powers of ten where it is long.
pub(crate) struct Told(pub(crate) f64);

impl fmt::Display for Told {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plain = self.0 == 0.0 || (1e-6..1e12).contains(&self.0.abs()) || !self.0.is_finite();
        if plain { write!(f, "{}", self.0) } else { write!(f, "{:e}", self.0) }
    }
}

/// What a number between two bounds is; bounds that only say above zero or finite in words.
pub(crate) struct Expected(pub(crate) f64, pub(crate) f64);

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (least, most) = (self.0, self.1);
        match (least, most == f64::MAX) {
            (f64::MIN, true) => write!(f, "a finite number"),
            (f64::MIN_POSITIVE, true) => write!(f, "a number above 0"),
            (f64::MIN_POSITIVE, false) => write!(f, "a number above 0, to {}", Told(most)),
            (_, true) => write!(f, "a number of at least {}", Told(least)),
            (_, false) => write!(f, "a number from {} to {}", Told(least), Told(most)),
        }
    }
}

/// A parameter that no machine has.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ParameterError {
    /// Not finite, or outside its bounds.
    #[error("`{field}` is {}, expected {}", Told(*.value), Expected(*.least, *.most))]
    OutOfBounds {
        /// Block and field, with unit.
        field: &'static str,
        /// Value given.
        value: f64,
        /// Least value allowed.
        least: f64,
        /// Largest value allowed.
        most: f64,
    },
    /// A number of a servo axis that is not finite, or outside its bounds.
    #[error("`{field}` is {}, expected {}", Told(*.value), Expected(*.least, *.most))]
    AxisOutOfBounds {
        /// Block and field, with the axis' unit.
        field: String,
        /// Value given.
        value: f64,
        /// Least value allowed.
        least: f64,
        /// Largest value allowed.
        most: f64,
    },
    /// Dry friction that would fall when the machine stops.
    #[error(
        "`{kinetic}` is {}, above `{fixed}` {}, expected at most as much",
        Told(*.kinetic_value),
        Told(*.fixed_value)
    )]
    KineticAboveStatic {
        /// Block and field of the kinetic friction, with unit.
        kinetic: String,
        /// Its value.
        kinetic_value: f64,
        /// The same of the static one.
        fixed: String,
        /// Its value.
        fixed_value: f64,
    },
    /// The carrier must be a whole multiple of the controller's rate.
    #[error(
        "`inverter.carrier-hz` is {}, expected a whole multiple of `controller.sample-hz` {}",
        Told(*.carrier_hz),
        Told(*.sample_hz)
    )]
    CarrierNotMultiple {
        /// Carrier frequency.
        carrier_hz: f64,
        /// Rate of the controller.
        sample_hz: f64,
    },
    /// A field-oriented drive holds a sinusoidal current, which a trapezoidal machine has no use
    /// for.
    #[error(
        "`inverter.commutation` is \"field-oriented\", which a machine with a trapezoidal \
         `motor.back-emf-shape` cannot have"
    )]
    TrapezoidFieldOriented,
    /// An inertia so small that drag and back-EMF change its speed within a tick of the controller.
    #[error(
        "`{field}` is {}, expected at least {}: the drag would slow a smaller one within the \
         controller's tick of {} s",
        Told(*.value),
        Told(*.least),
        Told(*.tick_s)
    )]
    TooLight {
        /// Block and field, with unit.
        field: String,
        /// Value given.
        value: f64,
        /// Least value that the tick allows: twice the drag times the tick.
        least: f64,
        /// The controller's tick.
        tick_s: f64,
    },
    /// A machine so much faster than its carrier that a period would take more than hundreds of
    /// segments.
    #[error(
        "`{field}` is {}, expected at least {}: it makes a time constant of {} s, below a \
         hundredth of a period of the carrier of {} Hz",
        Told(*.value),
        Told(*.least),
        Told(*.time_s),
        Told(*.carrier_hz)
    )]
    TooFast {
        /// Block and field, with unit, that makes it so.
        field: &'static str,
        /// Value given.
        value: f64,
        /// Least value that the carrier allows.
        least: f64,
        /// The time constant.
        time_s: f64,
        /// Carrier frequency.
        carrier_hz: f64,
    },
    /// A fault that changes nothing in this axis.
    #[error("{} changes nothing in this axis: {reason}", .fault.symbol())]
    NoSuchFault {
        /// The fault.
        fault: FaultId,
        /// What the axis does not have.
        reason: &'static str,
    },
    /// The winding is faster than the carrier can resolve.
    #[error(
        "the winding's time constant of {} s is below two periods of the carrier of {} Hz",
        Told(*.time_constant_s),
        Told(*.carrier_hz)
    )]
    WindingTooFast {
        /// L/R of a phase.
        time_constant_s: f64,
        /// Carrier frequency.
        carrier_hz: f64,
    },
}

/// A test that cannot be run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// The actuator is refused.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// An effect is refused.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// A field of the scenario is not finite or out of bounds.
    #[error("`{field}` is {}, expected {}", Told(*.value), Expected(*.least, *.most))]
    Scenario {
        /// Which field, with unit.
        field: &'static str,
        /// Value given.
        value: f64,
        /// Least value allowed.
        least: f64,
        /// Largest value allowed.
        most: f64,
    },
    /// An axis is given what its controller has no gain for, and would stand still.
    #[error("the axis is given a {given}, and `{field}` is 0: it would stand still")]
    Unregulated {
        /// What it is given: a position or a speed.
        given: &'static str,
        /// The gain that is missing, with unit.
        field: String,
    },
    /// Hysteresis control follows the six-step pattern, and averaged legs need all three connected.
    #[error("{control} control is not for a drive whose `inverter.commutation` is {commutation}")]
    ControlOfOtherDrive {
        /// The control asked for.
        control: &'static str,
        /// How the drive commutates.
        commutation: &'static str,
    },
    /// The run ended early: the shaft went beyond any speed that the machine could make.
    #[error("{0}")]
    Runaway(Box<Runaway>),
    /// The command leaves the range between the end stops.
    #[error(
        "the command reaches {} rad at {} s, beyond the stops at {} rad",
        Told(*.command_rad),
        Told(*.time_s),
        Told(*.stop_rad)
    )]
    CommandBeyondStops {
        /// Command there.
        command_rad: f64,
        /// When.
        time_s: f64,
        /// Angle of the stops.
        stop_rad: f64,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_that_only_say_above_zero_are_told_in_words() {
        let told = |least, most| Expected(least, most).to_string();
        assert_eq!(told(f64::MIN_POSITIVE, f64::MAX), "a number above 0");
        assert_eq!(told(f64::MIN_POSITIVE, 1e6), "a number above 0, to 1000000");
        assert_eq!(told(0.0, f64::MAX), "a number of at least 0");
        assert_eq!(told(-f64::MAX, f64::MAX), "a finite number");
        assert_eq!(told(0.01, 1.0), "a number from 0.01 to 1");
        assert_eq!(Told(-2.5).to_string(), "-2.5");
        assert_eq!(Told(1e300).to_string(), "1e300");
        assert_eq!(Told(f64::NAN).to_string(), "NaN");
    }
}
