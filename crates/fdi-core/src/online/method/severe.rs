//! Fits by severe faults, whose model errors grow with the damage.

use std::sync::Arc;

use crate::online::{
    damage::{START, size_of},
    error::DiagnoseError,
    fit::FitResult,
    likelihood::Likelihood,
    run::{Hypothesis, Run},
};

/// Damage that a search for severe faults starts from.
const SEVERE_START: f64 = 0.3;
/// Rounds in which size of the damage and its error covariance settle.
const SEVERE_ROUNDS: usize = 2;

/// A fit with the likelihood that it is of.
pub(crate) struct SevereFit {
    pub(crate) fit: FitResult,
    pub(crate) likelihood: Likelihood,
}

impl Run<'_> {
    /// Likelihood with the errors at a size of damage; `None` where the bundle has no wide design.
    pub(crate) fn severe_likelihood(
        &self,
        hypothesis: &Hypothesis,
        noise_a: f64,
        size: f64,
    ) -> Result<Option<Likelihood>, DiagnoseError> {
        let Some(severe) = self.learnt.severe()? else {
            return Ok(None);
        };
        let unit = self.learnt.unit_noise(self.observation.phase_rate_hz);
        let error = hypothesis.error.with_residuals(severe.at_size(size));
        let whole_a = self.learnt.with_reference_noise(noise_a);
        Ok(Some(Likelihood::new(&Arc::new(error), &unit, whole_a, self.encoder())?))
    }

    /// A fit by severe faults, from several starts, with the low-fidelity model's error growing
    /// with the damage.
    pub(crate) fn severe_fit(
        &self,
        hypothesis: &Hypothesis,
        noise_a: f64,
        near: &FitResult,
    ) -> Result<Option<SevereFit>, DiagnoseError> {
        let Some(wide) = self.severe_likelihood(hypothesis, noise_a, SEVERE_START)? else {
            return Ok(None);
        };
        let mut starts = vec![self.all_coordinates(&near.estimate)];
        for index in self.learnt.bundle.experiment.sought_indices() {
            let mut start = START;
            start[index] = SEVERE_START;
            starts.push(start);
        }
        let mut evaluations = 0;
        let mut best: Option<FitResult> = None;
        for start in starts {
            let fit = self.fit(hypothesis, &wide, &start)?;
            evaluations += fit.evaluations;
            if best.as_ref().is_none_or(|best| fit.misfit < best.misfit) {
                best = Some(fit);
            }
        }
        let Some(mut best) = best else { return Ok(None) };
        let mut likelihood = wide;
        for _ in 0..SEVERE_ROUNDS {
            let size = size_of(&best.estimate);
            let Some(at_size) = self.severe_likelihood(hypothesis, noise_a, size)? else {
                return Ok(None);
            };
            likelihood = at_size;
            best = self.fit(hypothesis, &likelihood, &self.all_coordinates(&best.estimate))?;
            evaluations += best.evaluations;
        }
        best.evaluations = evaluations;
        Ok(Some(SevereFit { fit: best, likelihood }))
    }
}
