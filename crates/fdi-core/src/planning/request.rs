//! A request for a test, and why none may be planned.

use ema_sim::{Actuator, FaultId, SimulationError};

use crate::{
    report::MotionLimits,
    seed::RootSeed,
    simulation::experiment::ExperimentError,
    unit::{error::UnitErrorError, search::UnitSearchError},
};

/// A test that is asked for.
#[derive(Clone, Debug)]
pub struct PlanRequest {
    /// Faults that it is to tell; of the eccentricity the size, `k6`.
    pub faults: Vec<FaultId>,
    /// Longest that it may last, s.
    pub within_s: f64,
    /// Recordings of the unit as new with the same test, each of a day of its own.
    pub references: usize,
    /// Standard deviation of a thermometer on the winding, K.
    pub reading_std_k: f64,
    /// True where the winding's temperature will be read: the test is planned for it.
    pub is_read: bool,
    /// True where the motor's voltage will be recorded: the test is planned for it.
    pub has_voltage: bool,
    /// Load on the surface, N·m.
    pub load_n_m: f64,
    /// Limits of the motions.
    pub limits: MotionLimits,
    /// Seed of the machines that the model's error is guessed from.
    pub seed: RootSeed,
    /// Simulations at the same time.
    pub jobs: usize,
}

/// Why no test is planned.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// No fault, or one that the machine's model does not list.
    #[error("`{}` is no fault that a test of this model tells, expected some of {}", .fault.symbol(), .expected.iter().map(|fault| fault.symbol()).collect::<Vec<_>>().join(", "))]
    NoSuchFault {
        /// Asked for.
        fault: FaultId,
        /// Faults that can be.
        expected: Vec<FaultId>,
    },
    /// No motion stays within the limits.
    #[error(
        "no motion of at most {within_s} s stays within ±{} rad, {} rad/s of the rotor and {} A{}: \
         allow more time or wider limits{}",
        .limits.travel_rad,
        .limits.speed_rad_per_s,
        .limits.current_a,
        if *load_n_m == 0.0 { String::new() } else { format!(" under a load of {load_n_m} N·m") },
        if *load_n_m == 0.0 { "" } else { ", or a smaller load" }
    )]
    NoMotion {
        /// Longest that the test may last.
        within_s: f64,
        /// Limits of the motions.
        limits: MotionLimits,
        /// Load on the surface, N·m.
        load_n_m: f64,
    },
    /// A limit beyond what the machine itself allows.
    #[error("a limit of {asked} {unit}, expected at most the {most} {unit} of the machine")]
    BeyondMachine {
        /// Asked for.
        asked: f64,
        /// Limit of the machine.
        most: f64,
        /// Unit of both.
        unit: &'static str,
    },
    /// Model and motion make no test.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// The machine at a trial value cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The model's error cannot be guessed.
    #[error(transparent)]
    Error(#[from] UnitErrorError),
    /// A recording of the test has no evidence.
    #[error(transparent)]
    Search(#[from] UnitSearchError),
}

/// Limits that a test keeps where none are given: half of the way to a stop, three quarters of the
/// drive's limit of speed, and half of its limit of current.
pub fn motion_limits(actuator: &Actuator) -> MotionLimits {
    MotionLimits {
        travel_rad: 0.5 * actuator.transmission.stop_rad,
        speed_rad_per_s: 0.75 * actuator.controller.speed_limit_rad_per_s,
        current_a: 0.5 * actuator.controller.current_limit_a,
    }
}
