//! Diagnosis by the emulator of the reference signal, without a simulation.

use std::sync::Arc;

use nalgebra::DMatrix;

use crate::{
    online::{
        damage::TRAINED_LEVEL,
        error::DiagnoseError,
        likelihood::Likelihood,
        outcome::{MISFIT_DEVIATIONS, Outcome},
        posterior::Posterior,
        run::Run,
    },
    report::Method,
};

impl Run<'_> {
    /// Answer of the emulator; `None` where it does not explain the recording by incipient faults.
    pub(crate) fn emulated(&self, noise_a: f64) -> Result<Option<Outcome>, DiagnoseError> {
        if self.encoder().is_some() {
            return Err(DiagnoseError::EmulatorEncoded);
        }
        let rate_hz = self.observation.phase_rate_hz;
        let level = self.learnt.level(noise_a);
        let emulator = self.learnt.emulator(rate_hz, level)?;
        let likelihood = Likelihood::at(Arc::clone(emulator.grid()), level);
        let Some(found) = emulator.diagnose_beside(&self.observation.signal_a, level.excess_a2())
        else {
            return Err(DiagnoseError::Undetermined);
        };
        let adequate = found.misfit <= likelihood.largest_misfit(MISFIT_DEVIATIONS);
        let inside = found.estimate.iter().all(|level| level.abs() <= TRAINED_LEVEL);
        if !(adequate && inside) {
            return Ok(None);
        }
        let residual_a = self.less(emulator.signal_a(&found.estimate));
        let order = found.estimate.len();
        let covariance = DMatrix::from_fn(order, order, |i, j| found.covariance[i][j]);
        Ok(Some(Outcome {
            posterior: Posterior {
                indices: emulator.sought().to_vec(),
                estimate: found.estimate,
                covariance,
                explained: None,
            },
            residual_a,
            floor_a: likelihood.floor_a(),
            adequate,
            severe: false,
            unfinished: false,
            method: Method::Emulator,
            evaluations: 0,
            cost: found.misfit * likelihood.size() as f64 + likelihood.log_determinant(),
            began_otherwise: Vec::new(),
            measured_a: None,
        }))
    }
}
