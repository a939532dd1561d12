//! The paper's search: Bayesian optimisation of the scalar discrepancy on the mask.
//!
//! ```text
//! δ(k) = ‖r(k)‖ on the points of the mask
//! ```
//!
//! # Source
//!
//! FREEDOM paper, Algorithm 1 and eqs 6, 15 to 17, 21; `docs/paper-ledger.md`.

use gp_bayesopt::Criterion;

use crate::online::{
    damage::coordinates_of,
    error::DiagnoseError,
    method::unsettled::Ended,
    outcome::Outcome,
    run::{Hypothesis, Run},
    scalar_search::minimise,
};

impl Run<'_> {
    /// The paper's search on the mask. Where it ends is not where the likelihood is greatest.
    pub(crate) fn scalar(
        &self,
        hypothesis: &Hypothesis,
        noise_a: f64,
        criterion: Criterion,
    ) -> Result<Outcome, DiagnoseError> {
        let sought = self.learnt.bundle.experiment.sought_indices();
        let likelihood = self.likelihood(hypothesis, noise_a)?;
        let mask = &self.learnt.bundle.mask;
        let mut monitor = self.monitor(hypothesis)?;
        let budget = self.plan.budget.scalar;
        let discrepancy = |levels: &[f64]| {
            let point = coordinates_of(&sought, levels);
            let residual = self.residual(hypothesis, &mut monitor, &point);
            mask.iter().map(|&i| residual[i] * residual[i]).sum::<f64>().sqrt()
        };
        let (levels, evaluations) =
            minimise(criterion, &sought, budget, self.plan.seed, discrepancy)
                .map_err(|error| DiagnoseError::Search { reason: error.to_string() })?;
        let estimate = coordinates_of(&sought, &levels);
        let residual_a = self.residual(hypothesis, &mut monitor, &estimate);
        let white = likelihood.whiten(&residual_a);
        let evaluations = evaluations + 1;
        let ended = Ended { estimate, residual_a, white, severe: false, evaluations };
        self.unsettled(hypothesis, &likelihood, ended)
    }
}
