//! Bayesian optimisation of a scalar discrepancy over fault levels.
//!
//! # Source
//!
//! FREEDOM paper, Algorithm 1 and eqs 6, 15 and 16; `docs/paper-ledger.md`.

use std::convert::Infallible;

use ema_sim::FAULT_COUNT;
use gp_bayesopt::{
    Bounds, BoundsError, Confidence, Criterion, Fantasies, Outcome as Evaluated, RunError, Study,
    StudyError, StudyOptions,
};

use crate::report::Method;

/// Draws of the Monte Carlo expectation in two-step lookahead (eqs 15-16 of the FREEDOM paper).
const DRAWS: usize = 16;

/// Why a scalar search failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ScalarSearchError {
    /// The faults looked for do not form a domain.
    #[error(transparent)]
    Bounds(#[from] BoundsError),
    /// The study cannot be made.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// The study stopped with an error.
    #[error(transparent)]
    Run(#[from] RunError<Infallible>),
}

/// The paper's search for one signal.
#[derive(Clone, Debug)]
pub struct ScalarSearch {
    criterion: Criterion,
    max_evaluations: Option<usize>,
    seed: u64,
}

/// The end of a [`ScalarSearch`].
#[derive(Clone, Debug, PartialEq)]
pub struct ScalarMinimum {
    /// Levels of the faults looked for, each in `[0, 1]`.
    pub levels: Vec<f64>,
    /// Evaluations of the discrepancy.
    pub evaluations: u64,
}

impl ScalarSearch {
    /// The search of a method; `None` for a method that does not minimise the scalar discrepancy.
    ///
    /// Without `max_evaluations` it makes 20 for each fault looked for and 10.
    pub fn of(method: Method, max_evaluations: Option<usize>, seed: u64) -> Option<Self> {
        criterion(method, seed).map(|criterion| Self { criterion, max_evaluations, seed })
    }

    /// Minimises a discrepancy over the levels of the faults looked for, places in `k1..k7`.
    ///
    /// # Errors
    ///
    /// [`ScalarSearchError`] when there are no faults, or a discrepancy is not finite.
    pub fn minimise(
        self,
        sought: &[usize],
        discrepancy: impl FnMut(&[f64]) -> f64,
    ) -> Result<ScalarMinimum, ScalarSearchError> {
        let budget = self.max_evaluations.unwrap_or(default_budget(sought.len()));
        let (levels, evaluations) =
            minimise(self.criterion, sought, budget, self.seed, discrepancy)?;
        Ok(ScalarMinimum { levels, evaluations })
    }
}

/// Evaluations that a method may make unless told otherwise: 150 for seven faults (20 initial,
/// 130 sequential), 50 for two (10 and 40).
pub(crate) fn default_budget(faults: usize) -> usize {
    20 * faults + 10
}

/// The criterion of a scalar method; `None` for the others.
pub(crate) fn criterion(method: Method, seed: u64) -> Option<Criterion> {
    match method {
        Method::Ei => Some(Criterion::ExpectedImprovement),
        Method::Ucb => Some(Criterion::LowerConfidence(Confidence::Printed)),
        Method::TwoStepEi => Some(Criterion::TwoStep(Fantasies::MonteCarlo { draws: DRAWS, seed })),
        _ => None,
    }
}

/// Minimises the discrepancy over fault levels (Algorithm 1 of the FREEDOM paper).
///
/// The domain is the paper's, `[0, 1]` for each fault looked for, with `k7` on its circle.
/// Returns the best levels and the evaluations made.
pub(crate) fn minimise(
    criterion: Criterion,
    sought: &[usize],
    budget: usize,
    seed: u64,
    mut discrepancy: impl FnMut(&[f64]) -> f64,
) -> Result<(Vec<f64>, u64), ScalarSearchError> {
    let mut bounds = Bounds::unit(sought.len())?;
    let place = |fault: usize| sought.iter().position(|&index| index == fault);
    if let (Some(amplitude), Some(direction)) = (place(FAULT_COUNT - 2), place(FAULT_COUNT - 1)) {
        bounds = bounds.with_polar(amplitude, direction)?;
    }
    let options = StudyOptions { seed, ..StudyOptions::scalar(bounds, criterion, budget) };
    let mut study = Study::new(options)?;
    study.run(|point| Ok(Evaluated::Value(discrepancy(point))))?;
    let evaluations = study.evaluations() as u64;
    let best = study.best().map_or_else(|| vec![0.0; sought.len()], |best| best.point);
    Ok((best, evaluations))
}
