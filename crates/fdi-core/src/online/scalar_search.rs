//! The paper's search: Bayesian optimisation of the scalar discrepancy on the mask.

use std::convert::Infallible;

use ema_sim::FAULT_COUNT;
use gp_bayesopt::{
    Bounds, BoundsError, Confidence, Criterion, Fantasies, Outcome, RunError, Study, StudyError,
    StudyOptions,
};

use crate::report::Method;

/// Draws of the Monte Carlo expectation in two-step lookahead (eqs 15-16 of the FREEDOM paper).
const DRAWS: usize = 16;

/// Why a scalar search failed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ScalarSearchError {
    #[error(transparent)]
    Bounds(#[from] BoundsError),
    #[error(transparent)]
    Study(#[from] StudyError),
    #[error(transparent)]
    Run(#[from] RunError<Infallible>),
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
    study.run(|point| Ok(Outcome::Value(discrepancy(point))))?;
    let evaluations = study.evaluations() as u64;
    let best = study.best().map_or_else(|| vec![0.0; sought.len()], |best| best.point);
    Ok((best, evaluations))
}
