//! Vector-valued Bayesian optimisation of the whitened residual.
//!
//! ```text
//! c = argmin ‖L⁻¹·r(c)‖²,   L·Lᵀ = Σ
//! ```
//!
//! A Gaussian process models every entry of `L⁻¹·r`, and the next point has the greatest expected
//! improvement of the squared norm.
//!
//! # Source
//!
//! Composite Bayesian optimisation, Astudillo and Frazier (ICML 2019); `docs/models/bayesopt.md`.

use std::convert::Infallible;

use gp_bayesopt::{Bounds, Outcome as Evaluated, RunError, Stall, Study, StudyOptions};

use crate::online::{
    damage::{LEAST, TRAINED_LEVEL},
    error::DiagnoseError,
    likelihood::Likelihood,
    method::unsettled::Ended,
    outcome::{MISFIT_DEVIATIONS, Outcome},
    run::{Hypothesis, Run},
};

/// Evaluations without progress that end a search.
const STALLED_EVALUATIONS: usize = 15;
/// Decrease of the residual's norm, relative to it, that counts as progress: of a thousand white
/// numbers that is one standard deviation of an estimate.
const STALLED_GAIN: f64 = 5e-4;
/// Size of the damage that the errors of a search for severe faults are taken at.
const SEVERE_SIZE: f64 = 0.3;

impl Run<'_> {
    /// Explains the recording by incipient faults, or where that fails by severe ones.
    pub(crate) fn composite(
        &self,
        hypothesis: &Hypothesis,
        noise_a: f64,
    ) -> Result<Outcome, DiagnoseError> {
        let likelihood = self.likelihood(hypothesis, noise_a)?;
        let near = self.optimised(hypothesis, &likelihood, TRAINED_LEVEL)?;
        let adequate = near.misfit() <= likelihood.largest_misfit(MISFIT_DEVIATIONS);
        let inside = near.estimate.iter().all(|level| level.abs() < TRAINED_LEVEL);
        if !(adequate && inside)
            && let Some(wide) = self.severe_likelihood(hypothesis, noise_a, SEVERE_SIZE)?
        {
            let mut far = self.optimised(hypothesis, &wide, 1.0)?;
            far.evaluations += near.evaluations;
            if far.cost(&wide) < near.cost(&likelihood) {
                return self.unsettled(hypothesis, &wide, Ended { severe: true, ..far });
            }
            let evaluations = far.evaluations;
            return self.unsettled(hypothesis, &likelihood, Ended { evaluations, ..near });
        }
        self.unsettled(hypothesis, &likelihood, near)
    }

    /// A search for coordinates of at most a size.
    fn optimised(
        &self,
        hypothesis: &Hypothesis,
        likelihood: &Likelihood,
        most: f64,
    ) -> Result<Ended, DiagnoseError> {
        let failed = |reason: String| DiagnoseError::Search { reason };
        let sought = self.experiment().sought_indices();
        let lower: Vec<f64> = sought.iter().map(|&index| LEAST[index].max(-most)).collect();
        let bounds = Bounds::new(&lower, &vec![most; sought.len()])
            .map_err(|error| failed(error.to_string()))?;
        let options = StudyOptions {
            seed: self.plan.seed,
            stall: Some(Stall { evaluations: STALLED_EVALUATIONS, relative_gain: STALLED_GAIN }),
            ..StudyOptions::residual(bounds, self.plan.budget.composite)
        };
        let mut study = Study::new(options).map_err(|error| failed(error.to_string()))?;
        let mut monitor = self.monitor(hypothesis)?;
        study
            .run(|point| {
                let residual_a = self.residual(hypothesis, &mut monitor, point);
                Ok(Evaluated::Residual(likelihood.whiten(&residual_a)))
            })
            .map_err(|error: RunError<Infallible>| failed(error.to_string()))?;
        let best = study.best().ok_or(DiagnoseError::Undetermined)?;
        let residual_a = self.residual(hypothesis, &mut monitor, &best.point);
        Ok(Ended {
            white: likelihood.whiten(&residual_a),
            estimate: best.point,
            residual_a,
            severe: false,
            evaluations: study.evaluations() as u64 + 1,
        })
    }
}
