//! Recordings of the machine as new: what they leave of the monitor at `k = 0` corrects its error.
//!
//! ```text
//! δ = mean over n references of  y_ref − y_LF(0) − m(0)
//! m ← m + δ,   Σ ← (1 + 1/n)·S + (a² + a_ref²/n)·C
//! ```
//!
//! What the model file has wrong of the machine is in `δ`, as far as it does not depend on the
//! damage; an error of the monitor that is known already is counted twice, once in the recording
//! and once in the references.

use std::{f64::consts::TAU, sync::OnceLock};

use ema_sim::{FAULT_COUNT, FaultCoordinates};

use super::{DiagnoseError, DiagnoseOptions, Diagnoser, ELECTRICAL_TOLERANCE_RAD};
use recordings::Recording;

use crate::{
    offline::{
        bundle::{Bundle, BundleError},
        encoding::Encoding,
        error_model::ErrorModel,
    },
    online::observation::{Observation, ObservationError},
    report::{Fidelity, Method, Notice, NoticeCode},
};

/// References that a diagnosis rests on.
#[derive(Debug)]
pub(super) struct References {
    /// Recordings.
    count: usize,
    /// Where they start.
    start_angle_rad: f64,
    /// Share of their noise in the mean, as a level on each phase sample, A.
    noise_a: f64,
    /// Root mean square of `δ`, A.
    rms_a: f64,
    /// The error model that the references have not changed.
    pub(super) learnt: ErrorModel,
}

impl Diagnoser {
    /// Prepares a bundle with recordings of the machine as new, all from one start angle.
    ///
    /// The answer to a recording from another start angle, by the method `emulator` or with the
    /// high-fidelity model is refused.
    ///
    /// # Errors
    ///
    /// [`DiagnoseError`] for references that do not fit the bundle or that do not say where the
    /// rotor starts.
    pub fn with_references(
        bundle: Bundle,
        encoding: Encoding,
        references: &[Recording],
    ) -> Result<Self, DiagnoseError> {
        let plain = Self::with_encoding(bundle, encoding)?;
        let experiment = &plain.bundle.experiment;
        let observed = references.iter().map(|one| Observation::of(one, experiment, 0.0));
        let observed = observed.collect::<Result<Vec<_>, ObservationError>>()?;
        plain.referred_to(&observed)
    }

    /// The same with what was read off the references.
    pub(crate) fn referred_to(mut self, references: &[Observation]) -> Result<Self, DiagnoseError> {
        let Some(start_rad) = references.first().and_then(|one| one.start_angle_rad) else {
            return Err(DiagnoseError::ReferenceStart { found_rad: None, expected_rad: None });
        };
        for reference in references {
            let found_rad = reference.start_angle_rad;
            if !found_rad.is_some_and(|rad| self.same_start(rad, start_rad)) {
                let expected_rad = Some(start_rad);
                return Err(DiagnoseError::ReferenceStart { found_rad, expected_rad });
            }
        }
        let own = self.same_start(start_rad, self.bundle.experiment.scenario.start_angle_rad);
        let learnt = match self.turned()? {
            Some(turned) if !own => turned.clone(),
            _ => self.incipient.clone(),
        };
        let offset_a = self.offset(references, start_rad, &learnt)?;
        let count = references.len();
        let corrected = learnt.corrected(&offset_a, 1.0 + 1.0 / count as f64);
        let squares: f64 = references.iter().map(|one| self.level_of(one).powi(2)).sum();
        let rms_a = rms(&offset_a);
        let references = References {
            count,
            start_angle_rad: start_rad,
            noise_a: squares.sqrt() / count as f64,
            rms_a,
            learnt,
        };
        self.references = Some(references);
        if own {
            self.surface = self.surface.map(|surface| surface.corrected(&offset_a, 1.0).into());
            self.incipient = corrected;
        } else {
            self.turned = OnceLock::from(Some(corrected));
        }
        Ok(self)
    }

    /// What references leave of the monitor with its learnt error, A.
    fn offset(
        &self,
        references: &[Observation],
        start_rad: f64,
        learnt: &ErrorModel,
    ) -> Result<Vec<f64>, DiagnoseError> {
        let healthy = [0.0; FAULT_COUNT];
        let mut monitor = self.bundle.experiment.monitor(start_rad).map_err(BundleError::from)?;
        let signal = monitor.signal(&FaultCoordinates(healthy));
        let mean = learnt.mean_at(&vec![0.0; self.bundle.experiment.sought_indices().len()]);
        let share = 1.0 / references.len() as f64;
        let mut offset: Vec<f64> = signal.iter().zip(&mean).map(|(y, m)| -y - m).collect();
        for reference in references {
            for (value, measured) in offset.iter_mut().zip(&reference.signal_a) {
                *value += share * measured;
            }
        }
        Ok(offset)
    }

    /// Noise on the phases of a reference, A: the recording's own, else what the bundle expects.
    fn level_of(&self, reference: &Observation) -> f64 {
        let told = reference.stated_noise_a.or(reference.measured_noise_a);
        told.unwrap_or(self.bundle.noise_a)
    }

    /// Whether two start angles count as one.
    pub(super) fn same_start(&self, a_rad: f64, b_rad: f64) -> bool {
        let pole_pairs = f64::from(self.bundle.experiment.actuator.motor.pole_pairs);
        let turn = (a_rad - b_rad).rem_euclid(TAU);
        turn.min(TAU - turn) < ELECTRICAL_TOLERANCE_RAD / pole_pairs
    }

    /// Noise of recording and references together, A.
    pub(super) fn with_reference_noise(&self, noise_a: f64) -> f64 {
        self.references.as_ref().map_or(noise_a, |references| noise_a.hypot(references.noise_a))
    }

    /// Refuses what the references say nothing of; else the notice that they were used.
    pub(super) fn reference_notice(
        &self,
        start_angle_rad: Option<f64>,
        options: &DiagnoseOptions,
    ) -> Result<Option<Notice>, DiagnoseError> {
        let Some(References { count, start_angle_rad: own_rad, rms_a, .. }) = &self.references
        else {
            return Ok(None);
        };
        if options.method == Method::Emulator || options.fidelity == Fidelity::High {
            return Err(DiagnoseError::ReferenceMethod);
        }
        if !start_angle_rad.is_some_and(|rad| self.same_start(rad, *own_rad)) {
            let (found_rad, expected_rad) = (start_angle_rad, Some(*own_rad));
            return Err(DiagnoseError::ReferenceStart { found_rad, expected_rad });
        }
        let message = format!(
            "levels are against {count} reference recording{}, which the model of the machine \
             misses by {rms_a:.4} A rms",
            if *count == 1 { "" } else { "s" }
        );
        Ok(Some(Notice { code: NoticeCode::BundleOfAnotherModel, message }))
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}
