//! Generalised least squares from the response surface of the low-fidelity model.
//!
//! ```text
//! c ← c + (JᵀΣ⁻¹J)⁻¹·JᵀΣ⁻¹·r(c)
//! ```
//!
//! with `r` the residual of the low-fidelity model and `J` the slopes of the surface, the last step
//! with the model's own.
//!
//! # Source
//!
//! Gauss-Newton with a response surface; see `docs/models/diagnosis.md`.

use crate::online::{
    damage::{LEAST, STEP_TOLERANCE, TRAINED_LEVEL},
    error::DiagnoseError,
    fit::FitResult,
    likelihood::{Likelihood, misfit},
    run::{Hypothesis, Run},
};

/// A fit, where the search settled, and the evaluations made.
type Near = (Option<FitResult>, u64);

impl Run<'_> {
    /// Generalised least squares from where the surface explains the recording best, with the
    /// surface's slopes: the low-fidelity model is run for its residuals alone. `None` where that
    /// does not settle within the range that the surface is learnt on; beside it the evaluations
    /// made.
    pub(crate) fn near_surface(
        &self,
        hypothesis: &Hypothesis,
        likelihood: &Likelihood,
        noise_a: f64,
    ) -> Result<Near, DiagnoseError> {
        if !hypothesis.at_own_start {
            return Ok((None, 0));
        }
        let rate_hz = self.observation.phase_rate_hz;
        let Some(surface) = self.learnt.surface(rate_hz, noise_a)? else {
            return Ok((None, 0));
        };
        let excess_a2 = self.learnt.level(noise_a).excess_a2();
        let Some(mut point) = surface.nearest(&self.observation.signal_a, excess_a2) else {
            return Ok((None, 0));
        };
        let mut monitor = self.monitor(hypothesis)?;
        let most = self.plan.budget.surface;
        for evaluations in 1..=most {
            if !self.within_surface(&point) {
                return Ok((None, evaluations - 1));
            }
            let residual_a = self.residual(hypothesis, &mut monitor, &point);
            let Some(step) = surface.step(&point, &residual_a, excess_a2) else {
                return Ok((None, evaluations));
            };
            if step.iter().all(|part| part.abs() < STEP_TOLERANCE) {
                let fit = self.last_step(hypothesis, likelihood, &point, &residual_a)?;
                let spent = evaluations + 2 * point.len() as u64 + 1;
                let fit = fit.map(|fit| FitResult { evaluations: spent, ..fit });
                return Ok((fit, spent));
            }
            for (value, part) in point.iter_mut().zip(step) {
                *value += part;
            }
        }
        Ok((None, most))
    }

    /// One step for a residual with the low-fidelity model's own slopes, and its residual
    /// there: what a surface leaves out is not to be read as damage. `None` where the slopes leave
    /// a coordinate undetermined.
    fn last_step(
        &self,
        hypothesis: &Hypothesis,
        likelihood: &Likelihood,
        point: &[f64],
        residual_a: &[f64],
    ) -> Result<Option<FitResult>, DiagnoseError> {
        let slopes = likelihood.slopes(self.jacobian(hypothesis, point)?);
        let Some(step) = slopes.step(&likelihood.whiten(residual_a)) else {
            return Ok(None);
        };
        let estimate: Vec<f64> = point.iter().zip(step.iter()).map(|(p, s)| p + s).collect();
        if !self.within_surface(&estimate) {
            return Ok(None);
        }
        let mut monitor = self.monitor(hypothesis)?;
        let residual_a = self.residual(hypothesis, &mut monitor, &estimate);
        let misfit = misfit(&likelihood.whiten(&residual_a));
        let slopes = Some(slopes);
        let (evaluations, cut_short, began) = (0, false, None);
        Ok(Some(FitResult { estimate, residual_a, misfit, evaluations, cut_short, slopes, began }))
    }

    /// True where the response surface is learnt at a point, and the machine can be given it.
    fn within_surface(&self, point: &[f64]) -> bool {
        let sought = self.learnt.bundle.experiment.sought_indices();
        let mut levels = point.iter().zip(sought);
        levels.all(|(level, index)| {
            (LEAST[index].max(-TRAINED_LEVEL)..=TRAINED_LEVEL).contains(level)
        })
    }
}
