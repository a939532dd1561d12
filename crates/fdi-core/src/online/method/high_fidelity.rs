//! Searches with the high-fidelity model, from an answer of the low-fidelity one.
//!
//! Each is a chord Gauss-Newton with slopes that are given: the signal's own differences are rough
//! in the damage (commutation instants).

use ema_sim::Imperfections;
use inference::central_differences;

use crate::{
    offline::bundle::BundleError,
    online::{
        error::DiagnoseError,
        likelihood::{Likelihood, Slopes, misfit},
        noise_level::Noise,
        observation::Observation,
        outcome::{MISFIT_DEVIATIONS, Outcome},
        posterior::Posterior,
        run::{Hypothesis, Run},
    },
    simulation::high_fidelity_signal::HighFidelitySignal,
};

/// Searches with the high-fidelity model, each with slopes of its own.
const HIGH_ROUNDS: usize = 3;
/// Differences of the high-fidelity signal: large against the steps in which commutation moves.
const HIGH_STEP: f64 = 1e-2;
/// Most evaluations of the model in one search.
const MOST_EVALUATIONS: u64 = 12;
/// Steps below this end a search.
const STEP_TOLERANCE: f64 = 1e-6;

/// End of a search.
pub(crate) struct HighFit {
    /// Estimates of the coordinates looked for.
    pub(crate) estimate: Vec<f64>,
    /// Residual there, A.
    pub(crate) residual_a: Vec<f64>,
    /// Mean square of the whitened residual.
    pub(crate) misfit: f64,
    pub(crate) evaluations: u64,
}

impl HighFidelitySignal {
    /// Chord Gauss-Newton from a point with slopes of the signal there; the best point seen is
    /// the answer. `None` where the slopes leave a coordinate undetermined.
    pub(crate) fn search(
        &self,
        start: &[f64],
        slopes: &Slopes,
        likelihood: &Likelihood,
        signal_a: &[f64],
        watch: &dyn Fn(&[f64]),
    ) -> Option<HighFit> {
        let mut point = start.to_vec();
        let mut best: Option<HighFit> = None;
        for evaluations in 1..=MOST_EVALUATIONS {
            let residual_a = self.residual(signal_a, &point);
            watch(&residual_a);
            let white = likelihood.whiten(&residual_a);
            let misfit = misfit(&white);
            let step = slopes.step(&white)?;
            if best.as_ref().is_none_or(|fit| misfit < fit.misfit) {
                best = Some(HighFit { estimate: point.clone(), residual_a, misfit, evaluations });
            }
            for (value, part) in point.iter_mut().zip(step.iter()) {
                *value += part;
            }
            if let Some(fit) = &mut best {
                fit.evaluations = evaluations;
            }
            if step.amax() < STEP_TOLERANCE {
                break;
            }
        }
        best
    }
}

impl Run<'_> {
    /// Goes on from an answer of the low-fidelity model with the high-fidelity one.
    ///
    /// Slopes are those of the low-fidelity model with its learnt error, and where they do not
    /// lead to an adequate fit those of the high-fidelity model itself.
    pub(crate) fn refined(
        &self,
        hypothesis: &Hypothesis,
        noise: Noise,
        low: Outcome,
    ) -> Result<Outcome, DiagnoseError> {
        let bundle = &self.learnt.bundle;
        let Observation { signal_a, phase_rate_hz, .. } = self.observation;
        let error_id = self.learnt.high_error_id(hypothesis.at_own_start)?;
        let error = self.learnt.error(error_id)?.ok_or(BundleError::NoIncipient)?;
        let likelihood = self.learnt.likelihood(error_id, *phase_rate_hz, noise.level_a)?;
        let electronics = bundle.datasets.first().map_or(Imperfections::NONE, |d| d.imperfections);
        let start_rad = hypothesis.start_angle_rad;
        let monitor =
            HighFidelitySignal::new(&bundle.experiment, start_rad, electronics, *phase_rate_hz)
                .map_err(BundleError::from)?;
        let offset_a = error.mean_at(&low.posterior.estimate);
        let seen_a: Vec<f64> = signal_a.iter().zip(&offset_a).map(|(y, m)| y - m).collect();
        let limit = likelihood.largest_misfit(MISFIT_DEVIATIONS);
        let order = low.posterior.estimate.len() as u64;
        let mut slopes = likelihood.slopes(self.jacobian(hypothesis, &low.posterior.estimate)?);
        let mut evaluations = low.evaluations + 2 * order;
        let mut from = low.posterior.estimate.clone();
        let mut best: Option<HighFit> = None;
        for round in 0..HIGH_ROUNDS {
            if round > 0 {
                let rows = central_differences(&from, HIGH_STEP, |at| monitor.signal(at));
                slopes = likelihood.slopes(rows);
                evaluations += 2 * order;
            }
            let fit = monitor
                .search(&from, &slopes, &likelihood, &seen_a, self.watch.residual)
                .ok_or(DiagnoseError::Undetermined)?;
            evaluations += fit.evaluations;
            from.clone_from(&fit.estimate);
            let better = best.as_ref().is_none_or(|best| fit.misfit < best.misfit);
            best = if better { Some(fit) } else { best };
            if best.as_ref().is_some_and(|best| best.misfit <= limit) {
                break;
            }
        }
        let fit = best.ok_or(DiagnoseError::Undetermined)?;
        let covariance =
            likelihood.estimate_covariance(&slopes).ok_or(DiagnoseError::Undetermined)?;
        Ok(Outcome {
            cost: fit.misfit * likelihood.size() as f64 + likelihood.log_determinant(),
            posterior: Posterior { estimate: fit.estimate, covariance, ..low.posterior },
            residual_a: fit.residual_a,
            floor_a: likelihood.floor_a(),
            adequate: fit.misfit <= limit,
            severe: false,
            evaluations,
            ..low
        })
    }
}
