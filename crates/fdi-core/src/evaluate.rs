//! The FREEDOM paper's experiments, and one of ours with noise: how well faults are found.
//!
//! The reference is the high-fidelity model at conditions of the design
//! [`ReferenceDesign::Test`](crate::ReferenceDesign::Test); what a diagnosis knows beforehand is
//! learnt from other conditions, in the same setting. Errors are deterministic by seed, at any
//! number of threads; times come from the clock that the caller passes in.

mod contender;
mod convergence;
mod high;
mod noisy;
mod reference;
mod score;
mod setting;
mod start;

use std::{fmt, thread};

use crate::{
    offline::{
        bundle::BundleError,
        dataset::{Condition, Dataset, DatasetError, DatasetRequest, ReferenceDesign},
        error_model::ErrorModelError,
    },
    online::error::DiagnoseError,
    report::{Evaluation, EvaluationSettings, SCHEMA_VERSION},
    simulation::experiment::{Experiment, ExperimentError},
    statistics::banded::NotPositiveDefinite,
};
pub use contender::Contender;
pub use reference::{Beforehand, ReferenceRequest, ReferenceScore, evaluate_references};
pub use setting::EvaluationSetting;
pub use start::{Beginning, BeginningRequest, BeginningScore, evaluate_beginnings};

/// Which of the paper's experiments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Protocol {
    /// The high-fidelity model monitors (Tables 2 and 3).
    High,
    /// The low-fidelity model monitors (Tables 4 and 5).
    Low,
    /// The low-fidelity model monitors, population methods search (Table 6).
    Metaheuristics,
    /// Friction and backlash alone, on the sine (Tables 7 and 8).
    Bench,
    /// Noise of the sensors: errors against the Cramér-Rao bound, coverage, false alarms.
    Noisy,
}

impl Protocol {
    /// Every protocol.
    pub const ALL: [Self; 5] =
        [Self::High, Self::Low, Self::Metaheuristics, Self::Bench, Self::Noisy];

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::High => "high",
            Self::Low => "low",
            Self::Metaheuristics => "metaheuristics",
            Self::Bench => "bench",
            Self::Noisy => "noisy",
        }
    }

    /// The actuator, its test and the faults looked for.
    pub fn experiment(self) -> Experiment {
        if self == Self::Bench { Experiment::sine() } else { Experiment::chirp() }
    }

    /// Test conditions of the paper (of ours for [`Noisy`](Self::Noisy)).
    pub fn default_conditions(self) -> usize {
        match self {
            Self::Bench => 10,
            Self::Noisy => 1000,
            Self::High | Self::Low | Self::Metaheuristics => 100,
        }
    }

    /// What searches unless told otherwise.
    pub fn default_contenders(self) -> &'static [Contender] {
        match self {
            Self::Noisy => &[Contender::Composite],
            Self::High | Self::Low | Self::Bench => &[
                Contender::Composite,
                Contender::Emulator,
                Contender::Ei,
                Contender::Ucb,
                Contender::TwoStepEi,
            ],
            Self::Metaheuristics => &[
                Contender::Composite,
                Contender::Genetic,
                Contender::Swarm,
                Contender::DifferentialEvolution,
                Contender::GreyWolves,
                Contender::CmaEs,
            ],
        }
    }
}

/// A clock: seconds since any moment.
pub type Clock<'a> = &'a (dyn Fn() -> f64 + Sync);

/// What to evaluate.
pub struct EvaluationRequest<'a> {
    /// Which experiment.
    pub protocol: Protocol,
    /// Electronics, sensors and what is known beforehand.
    pub setting: EvaluationSetting,
    /// Test conditions.
    pub conditions: usize,
    /// What searches.
    pub contenders: &'a [Contender],
    /// Healthy recordings on which false alarms are counted ([`Protocol::Noisy`]).
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
    /// A diagnosis failed.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
    /// An error model cannot be learnt.
    #[error(transparent)]
    ErrorModel(#[from] ErrorModelError),
    /// A covariance has no factor.
    #[error(transparent)]
    Covariance(#[from] NotPositiveDefinite),
    /// A population method failed.
    #[error("the search failed: {reason}")]
    Search {
        /// What the solver says.
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

impl From<ema_sim::SimulationError> for EvaluationError {
    fn from(error: ema_sim::SimulationError) -> Self {
        Self::Dataset(error.into())
    }
}

/// Runs an experiment.
///
/// # Errors
///
/// [`EvaluationError`] when the setting cannot be simulated or learnt from.
pub fn evaluate(request: &EvaluationRequest<'_>) -> Result<Evaluation, EvaluationError> {
    let methods = match request.protocol {
        Protocol::Noisy => noisy::run(request)?,
        _ => contender::run(request)?,
    };
    Ok(Evaluation {
        schema_version: SCHEMA_VERSION,
        protocol: request.protocol.name().to_owned(),
        conditions: request.conditions as u64,
        seed: request.seed,
        settings: settings(request),
        methods,
    })
}

fn settings(request: &EvaluationRequest<'_>) -> EvaluationSettings {
    let setting = &request.setting;
    EvaluationSettings {
        controller_noise: setting.imperfections.controller_noise,
        digitisation: setting.imperfections.digitisation,
        sensor_noise_a: setting.sensor_noise_a,
        phase_rate_hz: setting.phase_rate_hz,
        envelope_rate_hz: request.protocol.experiment().filter.output_hz,
        snapshots: setting.snapshots as u64,
        sparse_snapshots: setting.sparse_snapshots as u64,
        largest_level: request.largest_level,
    }
}

/// The conditions that are scored.
fn test_conditions(
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

/// Applies a function to every item, on some threads; results in the order of the items.
fn in_parallel<T: Sync, R: Send, E: Send>(
    items: &[T],
    jobs: usize,
    work: impl Fn(usize, &T) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let share = items.len().div_ceil(jobs.clamp(1, items.len().max(1))).max(1);
    let parts: Vec<Result<Vec<R>, E>> = thread::scope(|scope| {
        let work = &work;
        let handles: Vec<_> = items
            .chunks(share)
            .enumerate()
            .map(|(part, chunk)| {
                scope.spawn(move || -> Result<Vec<R>, E> {
                    chunk.iter().enumerate().map(|(i, x)| work(part * share + i, x)).collect()
                })
            })
            .collect();
        handles.into_iter().map(|handle| handle.join().expect("no work panics")).collect()
    });
    let mut results = Vec::with_capacity(items.len());
    for part in parts {
        results.extend(part?);
    }
    Ok(results)
}
