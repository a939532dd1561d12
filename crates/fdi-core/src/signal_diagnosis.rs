//! Diagnosis of a filtered envelope that is at hand as numbers, without a recording.

use crate::{
    Diagnoser,
    offline::bundle::BundleError,
    online::{
        damage::coordinates_of,
        error::DiagnoseError,
        learnt::CorrectedMonitor,
        motor_voltage::MotorVoltage,
        observation::{Observation, UnfilteredEnvelope},
        options::DiagnoseOptions,
    },
    report::RecordDiagnosis,
    simulation::{envelope::filtered, experiment::Experiment},
};

/// A filtered stator envelope of a machine whose rotor started at angle 0.
#[derive(Clone, Debug)]
pub struct EnvelopeSignal {
    observation: Observation,
}

impl EnvelopeSignal {
    /// A signal at the output rate of the experiment's filter, A, with the rate of the phase
    /// samples behind it and their noise, quantisation included.
    pub fn new(signal_a: Vec<f64>, phase_rate_hz: f64, noise_a: f64) -> Self {
        Self {
            observation: Observation {
                signal_a,
                envelope: None,
                start_angle_rad: Some(0.0),
                commutation: None,
                phase_rate_hz,
                measured_noise_a: None,
                phase_sum: None,
                sensor_shares: None,
                stated_noise_a: Some(noise_a),
                resampling_error_a: 0.0,
                start: None,
                ripple: None,
                other_load: None,
                wiring: None,
                session: None,
                winding_temperature_k: None,
                motor_voltage: MotorVoltage::NotRecorded,
                notices: Vec::new(),
            },
        }
    }

    /// Adds the envelope before its filter, at the rate of the phase samples, A; a search of the
    /// test's start needs it.
    #[must_use]
    pub fn with_envelope(mut self, envelope_a: Vec<f64>) -> Self {
        let rate_hz = self.observation.phase_rate_hz;
        self.observation.envelope = Some(UnfilteredEnvelope { samples_a: envelope_a, rate_hz });
        self
    }
}

/// The answer for a signal, with the estimate that it was made from.
#[derive(Clone, Debug)]
pub struct SignalDiagnosis {
    /// Published answer.
    pub answer: RecordDiagnosis,
    /// Which coordinates were estimated, places in `k1..k7`.
    pub indices: Vec<usize>,
    /// Estimates of the coordinates, free of bounds: `k6` and `k7` as cosine and sine part of the
    /// eccentricity.
    pub estimate: Vec<f64>,
    /// Covariance of the estimates, row by row.
    pub covariance: Vec<Vec<f64>>,
}

impl Diagnoser {
    /// Diagnoses a signal, showing the residual of every evaluation of the low-fidelity model as it
    /// is made, A.
    ///
    /// # Errors
    ///
    /// [`DiagnoseError`] as for a recording.
    pub fn diagnose_signal(
        &self,
        signal: &EnvelopeSignal,
        options: &DiagnoseOptions,
        watch: &dyn Fn(&[f64]),
    ) -> Result<SignalDiagnosis, DiagnoseError> {
        let (answer, posterior) = self.diagnose_watched(&signal.observation, options, watch)?;
        let covariance = &posterior.covariance;
        let rows = covariance.row_iter().map(|row| row.iter().copied().collect()).collect();
        Ok(SignalDiagnosis {
            answer,
            indices: posterior.indices,
            estimate: posterior.estimate,
            covariance: rows,
        })
    }

    /// Corrects the low-fidelity model's error by signals of the machine as new.
    ///
    /// # Errors
    ///
    /// [`DiagnoseError`] as for reference recordings.
    pub fn referred_to_signals(self, references: &[EnvelopeSignal]) -> Result<Self, DiagnoseError> {
        let observed: Vec<_> = references.iter().map(|one| one.observation.clone()).collect();
        self.referred_to(&observed)
    }

    /// The low-fidelity model with the mean of its learnt error added, start angle 0.
    ///
    /// # Errors
    ///
    /// [`BundleError`] for a bundle that nothing can be learnt from.
    pub fn corrected_monitor(&self) -> Result<CorrectedMonitor<'_>, BundleError> {
        self.learnt.corrected_monitor()
    }
}

impl Experiment {
    /// The coordinates looked for of levels looked for, each cut to `[0, 1]`; `k6` and `k7` become
    /// the cosine and sine part of the eccentricity.
    pub fn sought_coordinates(&self, levels: &[f64]) -> Vec<f64> {
        coordinates_of(&self.sought_indices(), levels)
    }

    /// The diagnosed signal of an envelope at the rate of the phase samples, A.
    pub fn filtered_envelope(&self, envelope_a: &[f64], phase_rate_hz: f64) -> Vec<f64> {
        filtered(envelope_a, phase_rate_hz, self)
    }
}
