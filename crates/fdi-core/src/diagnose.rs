//! The online diagnosis: from a recording to fault levels with their uncertainty.

use std::{f64::consts::TAU, sync::Arc};

use recordings::Recording;
use reduction::CompressionConfig;

use crate::{
    offline::{
        bundle::{Bundle, BundleError},
        encoder_fit::{compressing_encoder, fitted_encoder},
    },
    online::{
        cache::ErrorId,
        command_clock::begun_by_command,
        command_start::CommandStart,
        commutation::Commutation,
        error::DiagnoseError,
        learnt::Learnt,
        mixture::mixture,
        observation::{Observation, forget_direction},
        observation_error::ObservationError,
        options::DiagnoseOptions,
        plan::Plan,
        posterior::Posterior,
        run::{Hypothesis, Run},
        watch::Watch,
    },
    report::{Encoding, Notice, NoticeCode, RecordDiagnosis},
    unit::answer::{Within, beyond_incipient},
};

/// Most rounds in which faults and the start angle that commutation shows settle.
const COMMUTATION_ROUNDS: usize = 4;
/// Most rounds in which faults and the start of the command settle.
const START_ROUNDS: usize = 5;
/// Share of its standard deviation by which a start of the command may still be off.
const START_TOLERANCE: f64 = 0.1;
/// Start angles tried in one sector when the angle is not known.
const UNKNOWN_ANGLES: usize = 8;

/// Diagnoses recordings of one experiment.
#[derive(Debug)]
pub struct Diagnoser {
    pub(crate) learnt: Learnt,
}

/// An answer and the posterior that it was made from.
type Answered = (RecordDiagnosis, Posterior);

/// The answer to a recording from a start of the command on.
struct Begun {
    answer: RecordDiagnosis,
    posterior: Posterior,
    /// Time by which the command begins later than that, and its standard deviation, s; `None` where
    /// it was not looked for on the way to this answer, or was with the faults.
    late_s: Option<(f64, f64)>,
}

impl Begun {
    /// True where the command begins so much later or earlier that the answer may change.
    fn is_late(&self) -> bool {
        self.late_s.is_some_and(|(late_s, std_s)| late_s.abs() > START_TOLERANCE * std_s)
    }

    /// The one of two answers to a recording that leaves less of it unexplained, with the evaluations of
    /// both.
    fn or_nearer(self, other: Self) -> Self {
        let spent = self.answer.evaluations + other.answer.evaluations;
        let left = |begun: &Self| begun.answer.fit.rms_a / begun.answer.fit.noise_floor_a;
        let mut nearer = if left(&other) < left(&self) { other } else { self };
        nearer.answer.evaluations = spent;
        nearer
    }

    /// The answer to a recording, on which so many evaluations were spent before.
    fn answered(mut self, recording: &Recording, spent: u64) -> Answered {
        self.answer.evaluations += spent;
        self.answer.recording.clone_from(&recording.name);
        (self.answer, self.posterior)
    }
}

impl Diagnoser {
    /// Prepares a bundle: runs the low-fidelity model at its conditions and learns its error.
    ///
    /// # Errors
    ///
    /// [`BundleError`] for a bundle that nothing can be learnt from.
    pub fn new(bundle: Bundle) -> Result<Self, BundleError> {
        Self::with_encoding(bundle, Encoding::Full)
    }

    /// Prepares a bundle for diagnoses of an encoded signal.
    ///
    /// Search, uncertainty, noise and adequacy rest on the encoded numbers alone.
    ///
    /// # Errors
    ///
    /// [`BundleError`] for a bundle that nothing can be learnt from.
    pub fn with_encoding(bundle: Bundle, encoding: Encoding) -> Result<Self, BundleError> {
        let encoder = fitted_encoder(&bundle, encoding)?;
        Ok(Self { learnt: Learnt::of(bundle, encoder)? })
    }

    /// Prepares a bundle for diagnoses of the numbers that a compression keeps of a signal, fitted
    /// to the bundle's incipient signals.
    ///
    /// Search, uncertainty, noise and adequacy rest on these numbers alone, as with
    /// [`with_encoding`](Self::with_encoding), whose encodings are four of such compressions.
    ///
    /// # Errors
    ///
    /// [`BundleError`] for a bundle that nothing can be learnt from, and for a compression that
    /// cannot be fitted to its signals.
    pub fn with_compression(
        bundle: Bundle,
        compression: &CompressionConfig,
    ) -> Result<Self, BundleError> {
        let encoder = compressing_encoder(&bundle, compression)?;
        Ok(Self { learnt: Learnt::of(bundle, Some(Arc::new(encoder)))? })
    }

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
        let experiment = &plain.bundle().experiment;
        let observed = references.iter().map(|one| Observation::of(one, experiment, 0.0));
        let observed = observed.collect::<Result<Vec<_>, ObservationError>>()?;
        plain.referred_to(&observed)
    }

    /// Corrects the learnt error with what was read off references.
    pub(crate) fn referred_to(self, references: &[Observation]) -> Result<Self, DiagnoseError> {
        Ok(Self { learnt: self.learnt.referred_to(references)? })
    }

    /// The bundle.
    pub fn bundle(&self) -> &Bundle {
        &self.learnt.bundle
    }

    /// Diagnoses a recording.
    ///
    /// # Errors
    ///
    /// [`DiagnoseError`] for a recording that does not fit the bundle. A recording that the
    /// model does not explain is a result, with the verdict `model-inadequate`.
    pub fn diagnose(
        &self,
        recording: &Recording,
        options: &DiagnoseOptions,
    ) -> Result<RecordDiagnosis, DiagnoseError> {
        Ok(self.diagnose_shown(recording, options, &Watch::NOTHING)?.0)
    }

    /// Diagnoses a recording and shows each step to an observer; beside the answer what it was made
    /// from.
    pub(crate) fn diagnose_shown(
        &self,
        recording: &Recording,
        options: &DiagnoseOptions,
        watch: &Watch<'_>,
    ) -> Result<Answered, DiagnoseError> {
        if let Some(unit) = &options.unit {
            unit.check_basis(self.bundle(), &self.learnt.quantities())?;
        }
        let (options, notice) = self.with_agreeing_unit(options);
        let mut answered = self.diagnose_from_start(recording, &options, watch)?;
        answered.0.notices.extend(notice);
        Ok(answered)
    }

    /// Diagnoses a recording from the time on at which its command begins.
    fn diagnose_from_start(
        &self,
        recording: &Recording,
        options: &DiagnoseOptions,
        watch: &Watch<'_>,
    ) -> Result<Answered, DiagnoseError> {
        let experiment = &self.bundle().experiment;
        let begun = begun_by_command(recording, experiment).map_err(ObservationError::from)?;
        let (recording, mut start) = (begun.0.as_ref(), begun.1);
        let mut spent = 0;
        for _ in 1..START_ROUNDS {
            let begun = self.diagnose_begun(recording, start, true, options, watch)?;
            let late_s = begun.late_s.filter(|_| begun.is_late());
            let (Some(found), Some((late_s, _))) = (&mut start, late_s) else {
                return Ok(begun.answered(recording, spent));
            };
            spent += begun.answer.evaluations;
            let moved = found.later(late_s);
            if moved == *found {
                break;
            }
            *found = moved;
        }
        let begun = self.diagnose_begun(recording, start, false, options, watch)?;
        Ok(begun.answered(recording, spent))
    }

    /// Diagnoses a recording from a start of the command on, which may yet be moved.
    fn diagnose_begun(
        &self,
        recording: &Recording,
        start: Option<CommandStart>,
        moves_start: bool,
        options: &DiagnoseOptions,
        watch: &Watch<'_>,
    ) -> Result<Begun, DiagnoseError> {
        let experiment = &self.bundle().experiment;
        let mut observation =
            Observation::begun(recording, experiment, start, options.max_delay_s)?;
        let std_s = observation.start_std_s();
        let plan = Plan::of(options, experiment)?.with_start(std_s, moves_start, experiment)?;
        let mut notices = std::mem::take(&mut observation.notices);
        let seen = observation.commutation.take();
        let answered = |observation: &mut Observation| match &seen {
            Some(seen) => self.with_commutation(observation, seen, &plan, watch),
            None => self.with_corrections(observation, &plan, watch),
        };
        let mut begun = answered(&mut observation)?;
        if let Some(mut in_step) = observation.as_in_step() {
            begun = begun.or_nearer(answered(&mut in_step)?);
        }
        if let (Some(start), Some((_, std_s))) = (start, begun.late_s) {
            let seen = start.known_to(std_s).notice(recording);
            notices.retain(|notice| notice.code != seen.code);
            notices.push(seen);
        }
        begun.answer.notices.splice(0..0, notices);
        Ok(begun)
    }

    /// Diagnoses samples that were taken out of step with the controller, or under another load than that
    /// of the test: what these do to the signal depends on the faults.
    fn with_corrections(
        &self,
        observation: &mut Observation,
        plan: &Plan,
        watch: &Watch<'_>,
    ) -> Result<Begun, DiagnoseError> {
        let experiment = &self.bundle().experiment;
        let mut begun = self.diagnose_run(observation, plan, watch)?;
        if observation.depends_on_damage() {
            observation.correct_for(&begun.posterior, experiment).map_err(BundleError::from)?;
            let spent = begun.answer.evaluations;
            begun = self.diagnose_run(observation, plan, watch)?;
            begun.answer.evaluations += spent;
        }
        Ok(begun)
    }

    /// Diagnoses with a start angle read off the commutation: how the rotor turns, and so where it
    /// started, depends on the faults, which are found with the start angle.
    fn with_commutation(
        &self,
        observation: &mut Observation,
        seen: &Commutation,
        plan: &Plan,
        watch: &Watch<'_>,
    ) -> Result<Begun, DiagnoseError> {
        let experiment = &self.bundle().experiment;
        let mut begun = self.with_corrections(observation, plan, watch)?;
        for _ in 0..COMMUTATION_ROUNDS {
            let damage = begun.posterior.damage().0;
            let start_rad = seen.start_angle_rad(experiment, &damage).map_err(BundleError::from)?;
            let moved_rad = observation.start_angle_rad.map_or(TAU, |now| (start_rad - now).abs());
            if moved_rad < self.learnt.tolerance_rad() {
                break;
            }
            observation.start_angle_rad = Some(start_rad);
            let spent = begun.answer.evaluations;
            begun = self.diagnose_run(observation, plan, watch)?;
            begun.answer.evaluations += spent + 1;
        }
        forget_direction(&mut begun.answer, experiment.actuator.motor.pole_pairs);
        Ok(begun)
    }

    /// Diagnoses what was read off a recording, showing the residual of every evaluation of the
    /// low-fidelity model as it is made; beside the answer what it was made from.
    pub(crate) fn diagnose_watched(
        &self,
        observation: &Observation,
        options: &DiagnoseOptions,
        residual: &dyn Fn(&[f64]),
    ) -> Result<Answered, DiagnoseError> {
        let plan = Plan::of(options, &self.bundle().experiment)?;
        let watch = Watch { residual, ..Watch::NOTHING };
        let Begun { answer, posterior, .. } = self.diagnose_run(observation, &plan, &watch)?;
        Ok((answer, posterior))
    }

    fn diagnose_run(
        &self,
        observation: &Observation,
        plan: &Plan,
        watch: &Watch<'_>,
    ) -> Result<Begun, DiagnoseError> {
        let run = Run { learnt: &self.learnt, observation, plan, watch };
        let referred = self.learnt.reference_notice(observation.start_angle_rad, plan)?;
        let asked = run.within_tolerances();
        let mut within = None;
        let mut spent = 0;
        let unused = match &asked {
            Ok((error, angle_rad)) => {
                match run.diagnose_unit(error, *angle_rad, &[]) {
                    Ok(Within { answer, posterior, is_to_the_noise, late_s }) => {
                        let begun = Begun { answer, posterior, late_s };
                        if is_to_the_noise || (plan.moves_start && begun.is_late()) {
                            return Ok(begun);
                        }
                        spent = begun.answer.evaluations;
                        within = Some(begun);
                    }
                    // damage far beyond the incipient: a search from the machine as new runs away
                    Err(DiagnoseError::Unit(_)) => {}
                    Err(error) => return Err(error),
                }
                Some(beyond_incipient(plan.unit.is_some()))
            }
            Err(reason) if plan.unit.is_some() => {
                let reason = reason.clone();
                let reason = reason.unwrap_or_else(|| "tolerances are switched off".to_owned());
                return Err(DiagnoseError::UnitUnused { reason });
            }
            Err(reason) => reason.clone(),
        };
        let (mut answer, posterior) = match observation.start_angle_rad {
            Some(angle_rad) => self.with_known_angle(&run, angle_rad)?,
            None => self.with_unknown_angle(&run)?,
        };
        if let Ok((error, angle_rad)) = asked
            && posterior.indices == self.bundle().experiment.sought_indices()
        {
            // the machine that is exactly its file is nearer to damage far beyond the incipient, and
            // its covariance has how much the model errs there
            let near = run.diagnose_unit(error, angle_rad, &posterior.estimate);
            if let Ok(within @ Within { is_to_the_noise: true, .. }) = near {
                let Within { answer: mut found, posterior, late_s, .. } =
                    within.widened(&posterior.covariance);
                found.evaluations += answer.evaluations + spent;
                return Ok(Begun { answer: found, posterior, late_s });
            }
        }
        if let Some(within) = within
            && !answer.fit.adequate
        {
            return Ok(within);
        }
        answer.notices.extend(referred);
        answer.notices.extend(run.voltage_of_exact());
        answer.notices.extend(unused.map(|reason| Notice {
            code: NoticeCode::TolerancesUnused,
            message: format!("the machine is taken to be exactly its model file: {reason}"),
        }));
        Ok(Begun { answer, posterior, late_s: None })
    }

    fn with_known_angle(&self, run: &Run<'_>, angle_rad: f64) -> Result<Answered, DiagnoseError> {
        let own_rad = self.bundle().experiment.scenario.start_angle_rad;
        let at_zero = self.learnt.same_start(angle_rad, own_rad);
        if run.plan.emulates() && !at_zero {
            return Err(DiagnoseError::EmulatorStart { found_rad: Some(angle_rad) });
        }
        let mut notices = Vec::new();
        let is_turned = !at_zero && self.learnt.turned()?.is_some();
        let error_id = if is_turned { ErrorId::Turned } else { ErrorId::Incipient };
        if !at_zero && error_id == ErrorId::Incipient {
            notices.push(Notice {
                code: NoticeCode::StartAngleNotLearnt,
                message: format!(
                    "the rotor starts at {angle_rad:.4} rad and the bundle knows only {own_rad}: \
                     intervals may be too narrow"
                ),
            });
        }
        let hypothesis = self.hypothesis(error_id, angle_rad, at_zero)?;
        let (noise, spent) = run.noise(&hypothesis)?;
        let outcome = run.explain(&hypothesis, noise)?;
        if outcome.method != run.plan.method {
            notices.push(Notice {
                code: NoticeCode::EmulatorReplaced,
                message: "the recording is not of the incipient faults that the emulator knows; \
                          the answer is that of `gls`"
                    .to_owned(),
            });
        }
        if outcome.severe {
            notices.push(Notice {
                code: NoticeCode::OutsideTraining,
                message: "a level lies beyond the incipient range that the bundle is learnt on; \
                          intervals are widened by the error seen on severe faults"
                    .to_owned(),
            });
        }
        let answer = run.answer(&outcome, noise, spent, notices);
        Ok((answer, outcome.posterior))
    }

    fn with_unknown_angle(&self, run: &Run<'_>) -> Result<Answered, DiagnoseError> {
        if run.plan.emulates() {
            return Err(DiagnoseError::EmulatorStart { found_rad: None });
        }
        let is_learnt = self.learnt.turned()?.is_some();
        let error_id = if is_learnt { ErrorId::Turned } else { ErrorId::Incipient };
        let pole_pairs = f64::from(self.bundle().experiment.actuator.motor.pole_pairs);
        let sector_rad = TAU / 6.0 / pole_pairs;
        let first = self.hypothesis(error_id, 0.5 * sector_rad, false)?;
        let (noise, mut spent) = run.noise(&first)?;
        let mut outcomes = Vec::new();
        for step in 0..UNKNOWN_ANGLES {
            let start_angle_rad = (step as f64 + 0.5) / UNKNOWN_ANGLES as f64 * sector_rad;
            let standing = self.hypothesis(error_id, start_angle_rad, false)?;
            let outcome = run.explain(&standing, noise)?;
            spent += outcome.evaluations;
            outcomes.push(outcome);
        }
        let outcome = mixture(&self.bundle().experiment.sought_indices(), outcomes)
            .ok_or(DiagnoseError::Undetermined)?;
        spent -= outcome.evaluations;
        let notices = vec![Notice {
            code: NoticeCode::StartAngleUnknown,
            message: "the rotor's start angle is not known, so that k3 to k7 are not determined; \
                      record `motor_angle_rad` or give `start-angle-rad`"
                .to_owned(),
        }];
        let answer = run.answer(&outcome, noise, spent, notices);
        Ok((answer, outcome.posterior))
    }

    fn hypothesis(
        &self,
        error_id: ErrorId,
        start_angle_rad: f64,
        at_own_start: bool,
    ) -> Result<Hypothesis, DiagnoseError> {
        let error = self.learnt.error(error_id)?.ok_or(BundleError::NoIncipient)?;
        Ok(Hypothesis { error, error_id, start_angle_rad, at_own_start })
    }
}
