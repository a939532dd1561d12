//! Search with the high-fidelity model and slopes that are given.
//!
//! The search is a chord Gauss-Newton: the signal's own differences are rough in the damage
//! (commutation instants).

use crate::{
    online::likelihood::{Likelihood, Slopes, misfit},
    simulation::high_fidelity_signal::HighFidelitySignal,
};

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
