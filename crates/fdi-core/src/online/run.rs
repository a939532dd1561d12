//! A diagnosis under way: a recording against the low-fidelity model.
//!
//! ```text
//! r(c) = y − y_LF(c) − m(c)
//! ```

use std::sync::Arc;

use ema_sim::{FAULT_COUNT, FaultCoordinates};
use inference::central_differences_together;

use crate::{
    offline::{bundle::BundleError, encoding::Encoder, error_model::ErrorModel},
    online::{
        cache::ErrorId,
        damage::{DIFFERENCE_STEP, within_training},
        error::DiagnoseError,
        learnt::Learnt,
        likelihood::Likelihood,
        observation::Observation,
        plan::Plan,
        watch::Watch,
    },
    simulation::experiment::{Experiment, Monitor},
};

/// A diagnosis under way.
#[derive(Clone, Copy)]
pub(crate) struct Run<'a> {
    pub(crate) learnt: &'a Learnt,
    pub(crate) observation: &'a Observation,
    pub(crate) plan: &'a Plan,
    pub(crate) watch: &'a Watch<'a>,
}

/// One way to explain a recording: how the low-fidelity model stands and errs.
pub(crate) struct Hypothesis {
    pub(crate) error: Arc<ErrorModel>,
    /// Which one that is.
    pub(crate) error_id: ErrorId,
    pub(crate) start_angle_rad: f64,
    /// True where the bundle's experiment starts at that angle.
    pub(crate) at_own_start: bool,
}

impl Run<'_> {
    pub(crate) fn experiment(&self) -> &Experiment {
        &self.learnt.bundle.experiment
    }

    pub(crate) fn encoder(&self) -> Option<&Arc<Encoder>> {
        self.learnt.encoder.as_ref()
    }

    /// Likelihood of a residual under a hypothesis, at a noise level.
    pub(crate) fn likelihood(
        &self,
        hypothesis: &Hypothesis,
        noise_a: f64,
    ) -> Result<Likelihood, DiagnoseError> {
        self.learnt.likelihood(hypothesis.error_id, self.observation.phase_rate_hz, noise_a)
    }

    /// Measured signal less a modelled one.
    pub(crate) fn less(&self, mut modelled: Vec<f64>) -> Vec<f64> {
        for (value, measured) in modelled.iter_mut().zip(&self.observation.signal_a) {
            *value = measured - *value;
        }
        modelled
    }

    pub(crate) fn monitor(&self, hypothesis: &Hypothesis) -> Result<Monitor, DiagnoseError> {
        let monitor = self.learnt.bundle.experiment.monitor(hypothesis.start_angle_rad);
        Ok(monitor.map_err(BundleError::from)?)
    }

    /// `y − y_LF(c) − m(c)`.
    pub(crate) fn residual(
        &self,
        hypothesis: &Hypothesis,
        monitor: &mut Monitor,
        point: &[f64],
    ) -> Vec<f64> {
        let signal = monitor.signal(&FaultCoordinates(self.all_coordinates(point)));
        self.compare(hypothesis, signal, point)
    }

    /// `y − y_LF(c) − m(c)` of a signal `y_LF(c)` of the low-fidelity model.
    pub(crate) fn compare(
        &self,
        hypothesis: &Hypothesis,
        mut signal: Vec<f64>,
        point: &[f64],
    ) -> Vec<f64> {
        let mean = hypothesis.error.mean_at(&within_training(point));
        for ((value, mean), measured) in signal.iter_mut().zip(mean).zip(&self.observation.signal_a)
        {
            *value = measured - *value - mean;
        }
        (self.watch.residual)(&signal);
        signal
    }

    /// The coordinates looked for among all seven, the others zero.
    pub(crate) fn all_coordinates(&self, point: &[f64]) -> [f64; FAULT_COUNT] {
        self.experiment().all_coordinates(point).0
    }

    /// Central differences of the modelled signal, one row a coordinate looked for.
    pub(crate) fn jacobian(
        &self,
        hypothesis: &Hypothesis,
        point: &[f64],
    ) -> Result<Vec<Vec<f64>>, DiagnoseError> {
        let monitor = self.monitor(hypothesis)?;
        Ok(central_differences_together(point, DIFFERENCE_STEP, |points| {
            let coordinates: Vec<FaultCoordinates> =
                points.iter().map(|moved| FaultCoordinates(self.all_coordinates(moved))).collect();
            // the signal's slopes are those of the residual, turned round
            let turned = |(signal, moved): (Vec<f64>, &Vec<f64>)| {
                self.compare(hypothesis, signal, moved).into_iter().map(|value| -value).collect()
            };
            monitor.signals(&coordinates).into_iter().zip(points).map(turned).collect()
        }))
    }
}
