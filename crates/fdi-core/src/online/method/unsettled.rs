//! Answer of a search that ends beside the greatest likelihood.
//!
//! ```text
//! s = (JᵀΣ⁻¹J)⁻¹·JᵀΣ⁻¹·r,   cov(c) + s·sᵀ
//! ```
//!
//! The step `s` that is left to the greatest likelihood, to first order, is counted as uncertainty.
//! What the model cannot explain is judged where the search ended.
//!
//! # Source
//!
//! `docs/models/diagnosis.md`, scalar searches.

use crate::online::{
    error::DiagnoseError,
    fit::FitResult,
    likelihood::{Likelihood, misfit},
    outcome::{Judged, MISFIT_DEVIATIONS, Outcome},
    run::{Hypothesis, Run},
};

/// End of a search.
pub(crate) struct Ended {
    /// Estimates of the coordinates looked for.
    pub(crate) estimate: Vec<f64>,
    /// Residual there, A.
    pub(crate) residual_a: Vec<f64>,
    /// The residual as white numbers.
    pub(crate) white: Vec<f64>,
    /// True where a level lies beyond the incipient range.
    pub(crate) severe: bool,
    pub(crate) evaluations: u64,
}

impl Ended {
    /// Mean square of the whitened residual.
    pub(crate) fn misfit(&self) -> f64 {
        misfit(&self.white)
    }

    /// `−2·ln` of the likelihood, less a constant.
    pub(crate) fn cost(&self, likelihood: &Likelihood) -> f64 {
        self.misfit() * likelihood.size() as f64 + likelihood.log_determinant()
    }
}

impl Run<'_> {
    /// Uncertainty and adequacy where a search ended.
    pub(crate) fn unsettled(
        &self,
        hypothesis: &Hypothesis,
        likelihood: &Likelihood,
        ended: Ended,
    ) -> Result<Outcome, DiagnoseError> {
        let here = ended.misfit();
        let Ended { estimate, residual_a, white, severe, evaluations } = ended;
        let slopes = likelihood.slopes(self.jacobian(hypothesis, &estimate)?);
        let step = slopes.step(&white).ok_or(DiagnoseError::Undetermined)?;
        let misfit = misfit(&slopes.left(&white, &step));
        let limit = likelihood.largest_misfit(MISFIT_DEVIATIONS);
        let spent = evaluations + 2 * estimate.len() as u64;
        let slopes = Some(slopes);
        let (cut_short, began) = (false, None);
        let fit = FitResult {
            estimate,
            residual_a,
            misfit,
            evaluations: spent,
            cut_short,
            slopes,
            began,
        };
        let judged = Judged { method: self.plan.method, adequate: here <= limit, severe, spent };
        let mut outcome = self.outcome(hypothesis, likelihood, fit, judged)?;
        outcome.unfinished = here > limit;
        outcome.posterior.covariance += &step * step.transpose();
        Ok(outcome)
    }
}
