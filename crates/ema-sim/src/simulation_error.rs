//! Why a test cannot be simulated.

use crate::{
    effect::EffectError,
    number_format::{Expected, Told},
    parameter_error::ParameterError,
    runaway::Runaway,
};

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
        /// The command given: a position or a speed.
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
