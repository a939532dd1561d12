//! Published answer of a diagnosis: verdict, levels, notices.

use ema_sim::{Envelope, FAULT_COUNT};
use fdi_report::INCIPIENT_LEVEL;

use crate::{
    online::{noise_level::Noise, outcome::Outcome, run::Run},
    report::{
        Fault, FaultId, Fit, NoiseSource, Notice, NoticeCode, RecordDiagnosis, Status, Verdict,
    },
};

/// Noise over the bundle's from which on a recording is called disturbed.
const LOUD_RATIO: f64 = 5.0;
/// Share of the bundle's rate below which phases are too coarse for its error model: recordings
/// at 8 kHz are diagnosed as those at 10 kHz, one healthy one of seven at 5 kHz is not.
const LEAST_RATE_SHARE: f64 = 0.8;

impl Run<'_> {
    /// The answer as it is reported, with notices that are known already first.
    pub(crate) fn answer(
        &self,
        outcome: &Outcome,
        noise: Noise,
        spent: u64,
        mut notices: Vec<Notice>,
    ) -> RecordDiagnosis {
        let mut faults = outcome.posterior.faults();
        if outcome.unfinished {
            for fault in &mut faults {
                fault.detected = None;
            }
            // the direction is told of an eccentricity that is detected
            faults[FaultId::K7 as usize] = Fault::undetermined(FaultId::K7);
        }
        notices.extend(self.notices(outcome, &faults));
        let of_noise = self.of_noise(&faults, noise);
        let is_disturbed = !of_noise.is_empty();
        notices.extend(of_noise);
        let sought = &self.experiment().sought;
        let any_null = (0..FAULT_COUNT - 1).any(|i| sought[i] && faults[i].value.is_none());
        let open = any_null || is_disturbed;
        let measured_a = outcome.measured_a.as_ref().unwrap_or(&self.observation.signal_a);
        (self.watch.answer)(measured_a, &outcome.residual_a);
        RecordDiagnosis {
            recording_sha256: None,
            recording: String::new(),
            actuator_id: None,
            date: None,
            operator: None,
            status: if any_null || !outcome.adequate { Status::Partial } else { Status::Ok },
            verdict: verdict(outcome, &faults, open),
            bundle: None,
            method: outcome.method,
            fidelity: self.plan.fidelity,
            evaluations: outcome.evaluations + spent,
            elapsed_s: None,
            discrepancy: self.discrepancy(&outcome.residual_a),
            fit: Fit {
                rms_a: rms(&outcome.residual_a),
                noise_floor_a: outcome.floor_a,
                noise_a: noise.level_a,
                noise_source: noise.source,
                adequate: outcome.adequate,
            },
            faults,
            findings: Vec::new(),
            identifiability: Vec::new(),
            action: None,
            covariance: outcome.posterior.report_covariance(),
            notices,
            together: Vec::new(),
        }
    }

    /// `δ`: norm of a residual on the mask, A.
    pub(crate) fn discrepancy(&self, residual_a: &[f64]) -> f64 {
        let mask = &self.learnt.bundle.mask;
        mask.iter().map(|&i| residual_a[i]).map(|v| v * v).sum::<f64>().sqrt()
    }

    /// Notices of what limits the answer, apart from what noise hides.
    fn notices(&self, outcome: &Outcome, faults: &[Fault]) -> Vec<Notice> {
        let mut notices = Vec::new();
        if outcome.unfinished {
            notices.push(Notice {
                code: NoticeCode::SearchUnfinished,
                message:
                    "the search did not finish: it ended where the model does not explain the \
                          recording; the levels are where it stopped, and nothing is determined"
                        .to_owned(),
            });
        }
        notices.extend(self.coarse_phases());
        notices.extend(self.encoder().map(|encoder| encoder.notice()));
        notices.extend(outcome.began_otherwise.iter().cloned());
        if faults[FaultId::K6 as usize].detected == Some(false) {
            notices.push(Notice {
                code: NoticeCode::PhaseUndetermined,
                message: "no eccentricity is detected, so that it has no direction (k7)".to_owned(),
            });
        }
        notices
    }

    /// Notice of phases that are sampled too slowly for the bundle's error model.
    pub(crate) fn coarse_phases(&self) -> Option<Notice> {
        let rate_hz = self.observation.phase_rate_hz;
        let learnt_hz = self.experiment().actuator.controller.sample_hz;
        // the phases of a field-oriented drive are sines, without sectors
        let commutates = self.experiment().envelope != Envelope::QAxis;
        (commutates && rate_hz < LEAST_RATE_SHARE * learnt_hz).then(|| Notice {
            code: NoticeCode::PhasesSampledSlowly,
            message: format!(
                "the phases were sampled at {rate_hz} Hz and the bundle is learnt at \
                 {learnt_hz} Hz: commutation is seen more coarsely, which the intervals and \
                 the test of fit do not know"
            ),
        })
    }

    /// Notices of noise that keeps a recording from being healthy: far above what the bundle
    /// expects, or with a whole incipient range open. None where no fault is decided as absent.
    fn of_noise(&self, faults: &[Fault], noise: Noise) -> Vec<Notice> {
        let most = faults[..FAULT_COUNT - 1]
            .iter()
            .filter(|fault| fault.detected == Some(false))
            .filter_map(|fault| fault.interval_95.map(|[_, high]| high))
            .reduce(f64::max);
        most.map_or_else(Vec::new, |most| noise_notices(noise, self.learnt.bundle.noise_a, most))
    }
}

/// Verdict on a recording; `open` where a level is not determined or could hide.
fn verdict(outcome: &Outcome, faults: &[Fault], open: bool) -> Verdict {
    if outcome.unfinished {
        Verdict::Undetermined
    } else if !outcome.adequate {
        Verdict::ModelInadequate
    } else if faults.iter().any(|fault| fault.detected == Some(true)) {
        Verdict::Faulty
    } else if open {
        Verdict::Undetermined
    } else {
        Verdict::Healthy
    }
}

/// Notice of noise far above what the bundle expects.
pub(crate) fn loud_notice(noise: Noise, expected_a: f64) -> Option<Notice> {
    let level_a = noise.level_a;
    let than =
        format!("more than {LOUD_RATIO} times the {expected_a:.3} A that the bundle expects");
    let message = if noise.source == NoiseSource::Residual {
        format!(
            "what the levels do not explain is as much as {level_a:.3} A of noise on each phase \
             sample would be, {than}: outliers in the currents, or damage beyond what the bundle has \
             learnt"
        )
    } else {
        format!(
            "{level_a:.3} A of noise on each phase sample is {than}; look for outliers in the currents"
        )
    };
    let is_loud = level_a > LOUD_RATIO * expected_a;
    is_loud.then_some(Notice { code: NoticeCode::NoiseAboveBundle, message })
}

/// Notices of a noise level where `most` is the largest level that could be there undetected.
fn noise_notices(noise: Noise, expected_a: f64, most: f64) -> Vec<Notice> {
    let level_a = noise.level_a;
    let mut notices: Vec<Notice> = loud_notice(noise, expected_a).into_iter().collect();
    if most > INCIPIENT_LEVEL {
        notices.push(Notice {
            code: NoticeCode::NoiseHidesLevels,
            message: format!(
                "with {level_a:.3} A of noise on each phase sample, levels up to {most:.3} are not \
                 excluded where nothing is detected; record with less noise"
            ),
        });
    }
    notices
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::NoiseSource;

    #[test]
    fn noise_above_the_bundles_and_levels_that_it_hides_are_told_apart() {
        let codes = |level_a, most| -> Vec<NoticeCode> {
            let noise = Noise { level_a, source: NoiseSource::Flag };
            noise_notices(noise, 0.02, most).into_iter().map(|notice| notice.code).collect()
        };
        assert!(codes(0.02, 0.01).is_empty());
        assert_eq!(codes(0.2, 0.01), [NoticeCode::NoiseAboveBundle]);
        assert_eq!(codes(0.02, 0.1), [NoticeCode::NoiseHidesLevels]);
        assert_eq!(codes(0.2, 0.1), [NoticeCode::NoiseAboveBundle, NoticeCode::NoiseHidesLevels]);
    }
}
