//! The methods that are compared.

use fdi_core::report::Method;
use gp_bayesopt::Population;

/// A method that searches in an experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Contender {
    /// The default method: generalised least squares on the whitened envelope.
    Gls,
    /// Vector-valued Bayesian optimisation of the whitened residual.
    Composite,
    /// The emulator of the reference signal; no simulation.
    Emulator,
    /// Expected improvement on the mask's scalar discrepancy.
    Ei,
    /// Upper confidence bound on it.
    Ucb,
    /// Two-step lookahead expected improvement on it.
    TwoStepEi,
    /// Genetic algorithm on it.
    Genetic,
    /// Particle swarm on it.
    Swarm,
    /// Differential evolution on it.
    DifferentialEvolution,
    /// Grey wolf optimiser on it.
    GreyWolves,
    /// CMA-ES on it.
    CmaEs,
}

impl Contender {
    /// Every contender.
    pub const ALL: [Self; 11] = [
        Self::Gls,
        Self::Composite,
        Self::Emulator,
        Self::Ei,
        Self::Ucb,
        Self::TwoStepEi,
        Self::Genetic,
        Self::Swarm,
        Self::DifferentialEvolution,
        Self::GreyWolves,
        Self::CmaEs,
    ];

    /// Name on the command line and in files: of a method of the diagnosis its published word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gls => Method::Gls.word(),
            Self::Composite => Method::Composite.word(),
            Self::Emulator => Method::Emulator.word(),
            Self::Ei => Method::Ei.word(),
            Self::Ucb => Method::Ucb.word(),
            Self::TwoStepEi => Method::TwoStepEi.word(),
            Self::Genetic => "ga",
            Self::Swarm => "pso",
            Self::DifferentialEvolution => "de",
            Self::GreyWolves => "gwo",
            Self::CmaEs => "cma-es",
        }
    }

    /// The contender of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|contender| contender.name() == name)
    }

    pub(crate) fn method(self) -> Option<Method> {
        match self {
            Self::Gls => Some(Method::Gls),
            Self::Composite => Some(Method::Composite),
            Self::Ei => Some(Method::Ei),
            Self::Ucb => Some(Method::Ucb),
            Self::TwoStepEi => Some(Method::TwoStepEi),
            _ => None,
        }
    }

    pub(crate) fn population(self) -> Option<Population> {
        match self {
            Self::Genetic => Some(Population::Genetic),
            Self::Swarm => Some(Population::Swarm),
            Self::DifferentialEvolution => Some(Population::DifferentialEvolution),
            Self::GreyWolves => Some(Population::GreyWolves),
            Self::CmaEs => Some(Population::CmaEs),
            _ => None,
        }
    }
}
