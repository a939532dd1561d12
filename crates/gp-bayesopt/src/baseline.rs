//! Solvers that see a scalar alone, for comparison.

mod cma;
mod crowd;
mod differential;
mod genetic;
#[cfg(feature = "swarm")]
mod swarm;
mod wolves;

pub use crowd::PopulationOptions;
use crowd::{Crowd, Ended};

use crate::{
    bounds::Bounds,
    error::{SettingError, SolveError},
    stop::StopReason,
};

/// A population method on a scalar (FREEDOM paper, Table 6, and CMA-ES).
///
/// | method | rule | source |
/// |---|---|---|
/// | genetic | binary tournament, BLX-½ crossover, normal mutation of one input on average, two elites | Eshelman and Schaffer, FOGA 2 (1993) 187 |
/// | swarm (feature `swarm`) | standard particle swarm, global best, the box mirrored at its faces; carried by argmin | Zambrano-Bigiarini et al., CEC 2013, section II.A |
/// | differential evolution | best/1/bin, dithered factor | Storn and Price, J. Global Optim. 11 (1997) 341 |
/// | grey wolves | three leaders, linear decrease over the budget | Mirjalili et al., Adv. Eng. Softw. 69 (2014) 46 |
/// | CMA-ES | rank-one and rank-µ updates, restarts with twice the population | Hansen, arXiv:1604.00772; Auger and Hansen, CEC 2005 |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Population {
    /// A real-coded genetic algorithm.
    Genetic,
    /// Particle swarm.
    #[cfg(feature = "swarm")]
    Swarm,
    /// Differential evolution.
    DifferentialEvolution,
    /// Grey wolf optimiser.
    GreyWolves,
    /// Covariance matrix adaptation.
    CmaEs,
}

/// Where a population method ended.
#[derive(Clone, Debug, PartialEq)]
pub struct PopulationSolution {
    /// The best point.
    pub point: Vec<f64>,
    /// The value there.
    pub value: f64,
    /// Evaluations made.
    pub evaluations: usize,
    /// Why the run ended.
    pub stop: StopReason,
}

impl Population {
    /// Minimises a scalar on a box. A value of NaN ranks behind all others.
    ///
    /// # Errors
    /// [`SolveError::Setting`] for an unusable setting, [`SolveError::Start`] for an unusable
    /// start, [`SolveError::UnusableStart`] when no value was a number, and
    /// [`SolveError::Evaluation`] with the function's own error and the best point so far.
    pub fn minimise<E, F>(
        self,
        function: F,
        bounds: &Bounds,
        options: &PopulationOptions,
    ) -> Result<PopulationSolution, SolveError<E>>
    where
        E: std::error::Error + 'static,
        F: FnMut(&[f64]) -> Result<f64, E>,
    {
        let members = options.members.unwrap_or(match self {
            Self::Genetic => 100,
            Self::GreyWolves => 40,
            #[cfg(feature = "swarm")]
            Self::Swarm => 40,
            Self::DifferentialEvolution => 15 * bounds.dimension(),
            Self::CmaEs => 4 + (3.0 * libm::log(bounds.dimension() as f64)) as usize,
        });
        if members < 4 || options.max_evaluations == 0 {
            let (name, value) = ("members", members as f64);
            let needs = "at least 4 members and one evaluation";
            return Err(SettingError::OutOfRange { name, value, needs }.into());
        }
        if let Some((start, spread)) = &options.start {
            bounds.check(start)?;
            if !(spread.is_finite() && *spread > 0.0) {
                let (name, needs) = ("start", "a positive spread");
                return Err(SettingError::OutOfRange { name, value: *spread, needs }.into());
            }
        }
        let mut crowd = Crowd { function, bounds, options, evaluations: 0, best: None };
        let ended = match self {
            Self::Genetic => genetic::run(&mut crowd, members),
            #[cfg(feature = "swarm")]
            Self::Swarm => swarm::run(&mut crowd, members),
            Self::DifferentialEvolution => differential::run(&mut crowd, members),
            Self::GreyWolves => wolves::run(&mut crowd, members),
            Self::CmaEs => cma::run(&mut crowd, members),
        };
        let stop = match ended {
            Ended::Stop(stop) => stop,
            Ended::Error(source) => {
                let evaluation = crowd.evaluations;
                let best = crowd.best.map(|(point, value)| (point, vec![value]));
                return Err(SolveError::Evaluation { evaluation, best, source });
            }
        };
        let (point, value) = crowd.best.ok_or(SolveError::UnusableStart)?;
        Ok(PopulationSolution { point, value, evaluations: crowd.evaluations, stop })
    }
}
