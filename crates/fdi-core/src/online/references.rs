//! Recordings of the machine as new: what they leave of the low-fidelity model at `k = 0` corrects
//! its error.
//!
//! ```text
//! δ = mean over n references of  y_ref − y_LF(0) − m(0)
//! m ← m + δ,   Σ ← (1 + 1/n)·S + (a² + a_ref²/n)·C
//! ```
//!
//! What the model file has wrong of the machine is in `δ`, as far as it does not depend on the
//! damage; an error of the low-fidelity model that is known already is counted twice, once in the
//! recording and once in the references.
//!
//! # Source
//!
//! Derived in `docs/models/diagnosis.md`, section "References"; chosen in
//! `docs/decisions/0068-references.md`.

use ema_sim::{FAULT_COUNT, FaultCoordinates};

use crate::{
    offline::{bundle::BundleError, error_model::ErrorModel},
    online::{
        error::DiagnoseError,
        learnt::{AtOwnStart, Learnt, References},
        observation::Observation,
        plan::Plan,
    },
    report::{Fidelity, Notice, NoticeCode},
};

impl Learnt {
    /// Corrects the learnt error with what was read off references.
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
            Some(turned) if !own => ErrorModel::clone(&turned),
            _ => ErrorModel::clone(&self.at_own_start()?.error),
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
            let surface = self.at_own_start()?.surface;
            self.correct_own_start(AtOwnStart {
                error: corrected.into(),
                surface: surface.map(|surface| surface.corrected(&offset_a, 1.0).into()),
            });
        } else {
            self.correct_turned(corrected);
        }
        Ok(self)
    }

    /// Mean residual of references against the low-fidelity model with its learnt error, A.
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
        told.unwrap_or(self.bundle.noise_a).hypot(reference.resampling_error_a)
    }

    /// Refuses what the references say nothing of; else the notice that they were used.
    pub(crate) fn reference_notice(
        &self,
        start_angle_rad: Option<f64>,
        plan: &Plan,
    ) -> Result<Option<Notice>, DiagnoseError> {
        let Some(References { count, start_angle_rad: own_rad, rms_a, .. }) = &self.references
        else {
            return Ok(None);
        };
        if plan.emulates() || plan.fidelity == Fidelity::High {
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
        Ok(Some(Notice { code: NoticeCode::ReferenceUsed, message }))
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}
