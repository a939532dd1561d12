//! The signals behind an answer: what was measured, what the model says, what is left.

use std::cell::RefCell;

use fdi_report::FitSignals;

use recordings::Recording;

use crate::{
    diagnose::Diagnoser,
    online::{error::DiagnoseError, options::DiagnoseOptions, watch::Watch},
    report::RecordDiagnosis,
};

impl Diagnoser {
    /// Diagnoses a recording, and gives the signals that the answer rests on; the answer is that
    /// of [`diagnose`](Self::diagnose).
    ///
    /// # Errors
    ///
    /// As [`diagnose`](Self::diagnose).
    pub fn diagnose_with_signals(
        &self,
        recording: &Recording,
        options: &DiagnoseOptions,
    ) -> Result<(RecordDiagnosis, FitSignals), DiagnoseError> {
        let searched = RefCell::new(Vec::new());
        let kept = RefCell::new((Vec::new(), Vec::new()));
        let watch = Watch {
            residual: &|residual_a| searched.borrow_mut().push(rms(residual_a)),
            answer: &|measured_a, residual_a| {
                *kept.borrow_mut() = (measured_a.to_vec(), residual_a.to_vec());
            },
        };
        let answer = self.diagnose_shown(recording, options, &watch)?.0;
        let (measured_a, residual_a) = kept.into_inner();
        let modelled_a = measured_a.iter().zip(&residual_a).map(|(y, r)| y - r).collect();
        let signals = FitSignals {
            rate_hz: self.bundle().experiment.filter.output_hz,
            measured_a,
            modelled_a,
            searched_rms_a: searched.into_inner(),
        };
        Ok((answer, signals))
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Bundle, EMBEDDED_BUNDLES, RecordedContent, SimulatedRecording,
        ema_sim::{HealthState, Imperfections, PhaseSensors},
    };

    /// The residual of the signals is the one that the answer states, to rounding of sums of a
    /// thousand squares.
    const RMS_REL: f64 = 1e-9;

    #[test]
    fn signals_are_those_of_the_answer() {
        let bundle = Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes).unwrap();
        let simulated = SimulatedRecording {
            faults: HealthState::new([0.02, 0.0, 0.0, 0.03, 0.0, 0.0, 0.5]).unwrap().coordinates(),
            start_angle_rad: 0.0,
            imperfections: Imperfections::REAL,
            controller_seed: 5,
            sensors: PhaseSensors { noise_a: 0.02, converter: None },
            phase_rate_hz: None,
            sensor_seed: 6,
            content: RecordedContent::Phases,
            has_voltage: false,
        };
        let recording = simulated.record(&bundle.experiment, "r").unwrap();
        let diagnoser = Diagnoser::new(bundle).unwrap();
        let options = DiagnoseOptions::default();
        let (answer, signals) = diagnoser.diagnose_with_signals(&recording, &options).unwrap();
        assert_eq!(answer, diagnoser.diagnose(&recording, &options).unwrap());
        assert_eq!(signals.measured_a.len(), diagnoser.bundle().experiment.samples());
        let found = rms(&signals.residual_a());
        assert!((found / answer.fit.rms_a - 1.0).abs() < RMS_REL, "{found} {:?}", answer.fit);
        // the measured signal is far from zero, the residual is not
        assert!(rms(&signals.measured_a) > 20.0 * found);
        assert!(signals.searched_rms_a.len() as u64 <= answer.evaluations);
        assert!(signals.searched_rms_a[0] > found);
    }
}
