//! Why an actuator or a test cannot be simulated.

use crate::effect::EffectError;

/// A parameter that no machine has.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ParameterError {
    /// Not finite, or outside its bounds.
    #[error("`{field}` is {value}, expected a number from {least} to {most}")]
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
    #[error("`{field}` is {value}, expected a number from {least} to {most}")]
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
    /// The carrier must be a whole multiple of the controller's rate.
    #[error(
        "`inverter.carrier-hz` is {carrier_hz}, expected a whole multiple of \
         `controller.sample-hz` {sample_hz}"
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
    /// The winding is faster than the carrier can resolve.
    #[error(
        "the winding's time constant of {time_constant_s} s is below two periods of the carrier \
         of {carrier_hz} Hz"
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
    #[error("`{field}` is {value}, expected a number from {least} to {most}")]
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
    /// Hysteresis control follows the six-step pattern, and averaged legs need all three connected.
    #[error("{control} control is not for a drive whose `inverter.commutation` is {commutation}")]
    ControlOfOtherDrive {
        /// The control asked for.
        control: &'static str,
        /// How the drive commutates.
        commutation: &'static str,
    },
    /// The command leaves the range between the end stops.
    #[error(
        "the command reaches {command_rad} rad at {time_s} s, beyond the stops at {stop_rad} rad"
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
