//! Parameters that no machine has.

use crate::{
    fault::FaultId,
    number_format::{Expected, Told},
};

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
        /// Value of the kinetic friction.
        kinetic_value: f64,
        /// Block and field of the static friction, with unit.
        fixed: String,
        /// Value of the static friction.
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
        /// The part that the axis does not have.
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
