//! The request for an experiment, its conditions, and its failures.

use std::fmt;

use fdi_core::{
    BundleError, Condition, Dataset, DatasetError, DatasetRequest, DiagnoseError, Experiment,
    ExperimentError, RecordError, ReferenceDesign, SimulatedRecordingError,
    ema_sim::SimulationError,
};

use crate::{contender::Contender, protocol::Protocol, setting::EvaluationSetting};

/// A clock: seconds since any moment.
pub type Clock<'a> = &'a (dyn Fn() -> f64 + Sync);

/// An experiment with its setting, methods and seed.
pub struct EvaluationRequest<'a> {
    /// Which experiment.
    pub protocol: Protocol,
    /// Electronics, sensors and what is known beforehand.
    pub setting: EvaluationSetting,
    /// Test conditions.
    pub conditions: usize,
    /// Methods that search.
    pub contenders: &'a [Contender],
    /// Healthy recordings on which false alarms are counted (protocols under noise).
    pub healthy: usize,
    /// Searches of the scalar discrepancy look at levels up to this: 1, the whole domain of the
    /// paper, or less.
    pub largest_level: f64,
    /// Most evaluations of one search; `None`: the method's own number.
    pub max_evaluations: Option<usize>,
    /// Root seed; conditions, noise and the reference signals derive theirs from it.
    pub seed: u64,
    /// Threads.
    pub jobs: usize,
    /// For times; without it they are left out.
    pub clock: Option<Clock<'a>>,
}

impl fmt::Debug for EvaluationRequest<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("EvaluationRequest")
            .field("protocol", &self.protocol)
            .field("setting", &self.setting)
            .field("conditions", &self.conditions)
            .field("contenders", &self.contenders)
            .field("seed", &self.seed)
            .finish_non_exhaustive()
    }
}

/// Why an evaluation could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EvaluationError {
    /// The conditions cannot be drawn or simulated.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// A machine cannot be tested.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// Nothing can be learnt from the reference signals.
    #[error(transparent)]
    Bundle(#[from] BundleError),
    /// A simulated recording is none.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A recording cannot be simulated.
    #[error(transparent)]
    Simulated(#[from] SimulatedRecordingError),
    /// A diagnosis failed.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
    /// A population method failed.
    #[error("the search failed: {reason}")]
    Search {
        /// Message of the solver.
        reason: String,
    },
    /// The protocol is about noise, and there is none.
    #[error("sensor noise is 0 A, expected more for this protocol")]
    NoNoise,
    /// A method that a protocol does not have.
    #[error("protocol `{protocol}` has no method `{method}`")]
    NoSuchMethod {
        /// Name of the protocol.
        protocol: &'static str,
        /// Name of the method.
        method: &'static str,
    },
}

impl From<SimulationError> for EvaluationError {
    fn from(error: SimulationError) -> Self {
        Self::Dataset(error.into())
    }
}

/// The conditions that are scored.
pub(crate) fn test_conditions(
    experiment: &Experiment,
    request: &EvaluationRequest<'_>,
) -> Result<Vec<Condition>, DatasetError> {
    Dataset::conditions(
        experiment,
        &DatasetRequest {
            design: ReferenceDesign::Test,
            conditions: request.conditions,
            seed: request.seed,
            imperfections: request.setting.imperfections,
            jobs: request.jobs,
        },
    )
}
