//! Generalised least squares by Levenberg and Marquardt, with differences of the model.
//!
//! ```text
//! c = argmin ‖L⁻¹·r(c)‖²,   L·Lᵀ = Σ
//! ```
//!
//! # Source
//!
//! `gp_bayesopt::LevenbergMarquardt`; see `docs/models/diagnosis.md`.

use ema_sim::FAULT_COUNT;
use gp_bayesopt::{Bounds, LevenbergMarquardt, SolveError, StopReason};

use crate::online::{
    damage::{DIFFERENCE_STEP, LEAST, MOST, STEP_TOLERANCE},
    error::DiagnoseError,
    fit::FitResult,
    likelihood::Likelihood,
    run::{Hypothesis, Run},
};

impl Run<'_> {
    /// Levenberg-Marquardt on the whitened residual.
    pub(crate) fn fit(
        &self,
        hypothesis: &Hypothesis,
        likelihood: &Likelihood,
        start: &[f64; FAULT_COUNT],
    ) -> Result<FitResult, DiagnoseError> {
        let indices = self.learnt.bundle.experiment.sought_indices();
        let mut monitor = self.monitor(hypothesis)?;
        let select =
            |all: &[f64; FAULT_COUNT]| -> Vec<f64> { indices.iter().map(|&i| all[i]).collect() };
        let bounds = Bounds::new(&select(&LEAST), &select(&MOST))
            .map_err(|error| DiagnoseError::Search { reason: error.to_string() })?;
        let solver = LevenbergMarquardt {
            steps: Some(vec![DIFFERENCE_STEP; indices.len()]),
            max_evaluations: self.plan.budget.least_squares,
            step_tolerance: STEP_TOLERANCE,
            ..LevenbergMarquardt::default()
        };
        let residual = |point: &[f64]| -> Result<Vec<f64>, std::convert::Infallible> {
            Ok(likelihood.whiten(&self.residual(hypothesis, &mut monitor, point)))
        };
        let solution = solver
            .solve(residual, &select(start), &bounds)
            .map_err(|error: SolveError<_>| DiagnoseError::Search { reason: error.to_string() })?;
        let residual_a = self.residual(hypothesis, &mut monitor, &solution.point);
        Ok(FitResult {
            misfit: solution.norm * solution.norm / likelihood.size() as f64,
            estimate: solution.point,
            residual_a,
            evaluations: solution.evaluations as u64 + 1,
            cut_short: solution.stop == StopReason::BudgetSpent,
            slopes: None,
            began: None,
        })
    }
}
