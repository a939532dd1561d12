//! Explanation of a recording: estimate, covariance, adequacy.

use crate::{
    online::{
        error::DiagnoseError,
        fit::FitResult,
        likelihood::Likelihood,
        posterior::Posterior,
        run::{Hypothesis, Run},
    },
    report::{Method, Notice},
};

/// Standard deviations of ln(misfit) over the reference signals that make a fit inadequate.
pub(crate) const MISFIT_DEVIATIONS: f64 = 4.0;

/// Best explanation of a recording, with its uncertainty.
pub(crate) struct Outcome {
    pub(crate) posterior: Posterior,
    pub(crate) residual_a: Vec<f64>,
    pub(crate) floor_a: f64,
    pub(crate) adequate: bool,
    pub(crate) severe: bool,
    /// The search stopped where the residual is not explained.
    pub(crate) unfinished: bool,
    /// Method that found it.
    pub(crate) method: Method,
    pub(crate) evaluations: u64,
    pub(crate) cost: f64,
    /// How the recording begins, or seems to, where that is not as the bundle has it.
    pub(crate) began_otherwise: Vec<Notice>,
    /// The signal that was explained, where it is not the observed one, A.
    pub(crate) measured_a: Option<Vec<f64>>,
}

/// Judgement of a fit.
#[derive(Clone, Copy)]
pub(crate) struct Judged {
    /// Method that found it.
    pub(crate) method: Method,
    pub(crate) adequate: bool,
    pub(crate) severe: bool,
    /// Evaluations of the low-fidelity model so far.
    pub(crate) spent: u64,
}

impl Run<'_> {
    /// Uncertainty and adequacy of a fit.
    pub(crate) fn outcome(
        &self,
        hypothesis: &Hypothesis,
        likelihood: &Likelihood,
        mut fit: FitResult,
        judged: Judged,
    ) -> Result<Outcome, DiagnoseError> {
        let Judged { method, adequate, severe, mut spent } = judged;
        let experiment = self.experiment();
        let unfinished = fit.cut_short && !adequate;
        let began_otherwise;
        let mut measured_a = None;
        let covariance = if let Some((began, covariance)) = fit.began.take() {
            began_otherwise = began.notices(experiment);
            measured_a = Some(self.observation.advanced(began.delay_s(), experiment));
            covariance
        } else {
            let slopes = if let Some(slopes) = fit.slopes.take() {
                slopes
            } else {
                let jacobian = self.jacobian(hypothesis, &fit.estimate)?;
                spent += 2 * jacobian.len() as u64;
                likelihood.slopes(jacobian)
            };
            // what explains a recording leaves no other start to suspect, and a search cut short
            // nothing to go by
            began_otherwise = if adequate || unfinished {
                Vec::new()
            } else {
                self.suspected_start(likelihood, slopes.rows(), &fit.residual_a)?
            };
            likelihood.estimate_covariance(&slopes).ok_or(DiagnoseError::Undetermined)?
        };
        let cost = fit.cost(likelihood);
        Ok(Outcome {
            posterior: Posterior {
                indices: experiment.sought_indices(),
                estimate: fit.estimate,
                covariance,
                explained: None,
            },
            residual_a: fit.residual_a,
            floor_a: likelihood.floor_a(),
            adequate,
            severe,
            unfinished,
            method,
            evaluations: spent,
            cost,
            began_otherwise,
            measured_a,
        })
    }
}
