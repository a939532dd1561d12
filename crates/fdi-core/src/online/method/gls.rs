//! Generalised least squares on the whitened envelope.
//!
//! ```text
//! c = argmin r(c)ᵀ·Σ⁻¹·r(c)
//! ```
//!
//! Gauss-Newton steps from a response surface lead there, else Levenberg and Marquardt's from the
//! middle of the range. No surrogate model is on the path.
//!
//! # Source
//!
//! Aitken (Proc. R. Soc. Edinburgh 55, 1935); see `docs/models/diagnosis.md`.

use crate::{
    online::{
        damage::{START, TRAINED_LEVEL},
        error::DiagnoseError,
        fit::FitResult,
        likelihood::Likelihood,
        method::severe::SevereFit,
        outcome::{Judged, MISFIT_DEVIATIONS, Outcome},
        run::{Hypothesis, Run},
    },
    report::Method,
};

impl Run<'_> {
    /// Explains the recording by incipient faults, or where that fails by severe ones.
    pub(crate) fn least_squares(
        &self,
        hypothesis: &Hypothesis,
        noise_a: f64,
    ) -> Result<Outcome, DiagnoseError> {
        let likelihood = self.likelihood(hypothesis, noise_a)?;
        let fit = self.incipient_fit(hypothesis, &likelihood, noise_a)?;
        let adequate = fit.misfit <= likelihood.largest_misfit(MISFIT_DEVIATIONS);
        let inside = fit.estimate.iter().all(|level| level.abs() <= TRAINED_LEVEL);
        let method = Method::Gls;
        let mut judged = Judged { method, adequate, severe: false, spent: fit.evaluations };
        if !(adequate && inside)
            && let Some(severe) = self.severe_fit(hypothesis, noise_a, &fit)?
        {
            let SevereFit { fit: severe, likelihood: wide } = severe;
            judged.spent += severe.evaluations;
            if severe.cost(&wide) < fit.cost(&likelihood) {
                let adequate = severe.misfit <= wide.largest_misfit(MISFIT_DEVIATIONS);
                let judged = Judged { adequate, severe: true, ..judged };
                return self.outcome(hypothesis, &wide, severe, judged);
            }
        }
        self.outcome(hypothesis, &likelihood, fit, judged)
    }

    /// Explains the recording by incipient faults: from the surface where that leads there, else
    /// from the middle of the range.
    pub(crate) fn incipient_fit(
        &self,
        hypothesis: &Hypothesis,
        likelihood: &Likelihood,
        noise_a: f64,
    ) -> Result<FitResult, DiagnoseError> {
        let (near, spent) = self.near_surface(hypothesis, likelihood, noise_a)?;
        let fit = if let Some(fit) = near {
            fit
        } else {
            let fit = self.fit(hypothesis, likelihood, &START)?;
            FitResult { evaluations: fit.evaluations + spent, ..fit }
        };
        if let Some(freedom) = &self.plan.freedom {
            return self.freed(hypothesis, likelihood, &fit, freedom);
        }
        Ok(fit)
    }
}
