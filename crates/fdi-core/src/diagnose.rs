//! The online diagnosis: from a recording to fault levels with their uncertainty.

mod reference;
mod start;

use std::sync::{Mutex, OnceLock};
use std::{collections::BTreeMap, f64::consts::TAU, sync::Arc};

use ema_sim::{FAULT_COUNT, FaultCoordinates, HealthState, Imperfections};
use fdi_report::INCIPIENT_LEVEL;
use gp_bayesopt::{Bounds, LevenbergMarquardt, SolveError, StopReason};
use nalgebra::DMatrix;
use recordings::Recording;

use self::{reference::References, start::Began};
use crate::{
    offline::{
        bundle::{Bundle, BundleError, StartAngle, differences},
        dataset::{ReferenceDesign, sought_coordinates},
        encoding::{Encoder, Encoding},
        error_model::ErrorModel,
    },
    online::{
        commutation::Commutation,
        emulator::Emulator,
        high_monitor::HighFit,
        likelihood::{Likelihood, Slopes, misfit},
        observation::{Observation, ObservationError, forget_direction},
        posterior::Posterior,
        scalar_search,
    },
    report::{
        Fault, Fidelity, Fit, Method, NoiseSource, Notice, NoticeCode, RecordDiagnosis, Status,
        Verdict,
    },
    simulation::{experiment::Monitor, high_fidelity_signal::HighFidelitySignal},
    statistics::{
        banded::{BandedMatrix, NotPositiveDefinite},
        central,
        noise_covariance::unit_noise_at_rate,
    },
};

/// Why a recording could not be diagnosed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DiagnoseError {
    /// The recording does not fit the bundle.
    #[error(transparent)]
    Observation(#[from] ObservationError),
    /// The bundle's content cannot be used.
    #[error(transparent)]
    Bundle(#[from] BundleError),
    /// The covariance of noise and model error has no factor.
    #[error(transparent)]
    Covariance(#[from] NotPositiveDefinite),
    /// The search could not be run.
    #[error("the search failed: {reason}")]
    Search {
        /// What the solver says.
        reason: String,
    },
    /// The emulator is of one start of the rotor.
    #[error(
        "method `emulator` is for recordings that are known to start at angle 0, and this one \
         {}; use `composite`",
        .found_rad.map_or("does not say".to_owned(), |rad| format!("starts at {rad:.4} rad"))
    )]
    EmulatorStart {
        /// Start angle of the recording.
        found_rad: Option<f64>,
    },
    /// The emulator looks at the whole signal.
    #[error("method `emulator` looks at the whole signal, not at an encoded one")]
    EmulatorEncoded,
    /// A scalar search with the high-fidelity model.
    #[error(
        "the high-fidelity model goes with the methods `composite` and `emulator`, found `{method}`"
    )]
    HighFidelityMethod {
        /// The method asked for.
        method: Method,
    },
    /// A method that takes the start of the test as the bundle has it.
    #[error(
        "a start that is not the bundle's is estimated by the method `composite` with \
         `--fidelity low`"
    )]
    StartMethod,
    /// A reference recording from another start angle than the others, or that says none; or a
    /// recording from another one than the references.
    #[error(
        "recording and references start at one angle, known for each: found {}, expected {}",
        .found_rad.map_or("none".to_owned(), |rad| format!("{rad:.4} rad")),
        .expected_rad.map_or("one".to_owned(), |rad| format!("{rad:.4} rad"))
    )]
    ReferenceStart {
        /// Start angle found.
        found_rad: Option<f64>,
        /// That of the references.
        expected_rad: Option<f64>,
    },
    /// A method that does not take references.
    #[error("references go with `--fidelity low` and any method but `emulator`")]
    ReferenceMethod,
    /// A largest delay that is no time.
    #[error("a largest delay of {found_s} s, expected 0 to {most_s} s")]
    MostDelay {
        /// Found.
        found_s: f64,
        /// Largest that is looked for.
        most_s: f64,
    },
    /// The recording leaves a fault without any effect on the signal.
    #[error(
        "the recording does not determine all faults looked for; \
         are its currents in A, and is it of this actuator?"
    )]
    Undetermined,
}

/// Settings of a diagnosis.
#[derive(Clone, Debug, PartialEq)]
pub struct DiagnoseOptions {
    /// How fault levels are searched.
    pub method: Method,
    /// Which model the recording is compared with in the end: the low-fidelity one with its
    /// learnt error, or from its answer on the high-fidelity one.
    pub fidelity: Fidelity,
    /// Most evaluations of the monitor in one search; `None`: 200 for `composite`, and
    /// 20 a fault and 10 for the scalar methods.
    pub max_evaluations: Option<usize>,
    /// Noise on each phase sample, where the user knows it, A.
    pub noise_a: Option<f64>,
    /// Largest time by which the recording may begin before or after the command, s: the delay is
    /// then estimated with the faults. Zero where they are triggered together.
    pub max_delay_s: f64,
    /// Whether the surface may begin anywhere in its play and the integrator of the speed loop
    /// charged: both are then estimated with the faults.
    pub free_start: bool,
    /// Seed of what is random.
    pub seed: u64,
}

impl Default for DiagnoseOptions {
    fn default() -> Self {
        Self {
            method: Method::Composite,
            fidelity: Fidelity::Low,
            max_evaluations: None,
            noise_a: None,
            max_delay_s: 0.0,
            free_start: false,
            seed: 0,
        }
    }
}

/// Diagnoses recordings of one experiment.
#[derive(Debug)]
pub struct Diagnoser {
    bundle: Bundle,
    /// Error of the monitor at the bundle's start angle.
    incipient: ErrorModel,
    /// At any other angle; learnt when first needed.
    turned: OnceLock<Option<ErrorModel>>,
    /// What the high-fidelity model leaves, at the bundle's start angle and at any other; learnt
    /// when first needed.
    high: [OnceLock<Option<ErrorModel>>; 2],
    /// How the monitor errs on severe damage; learnt when first needed.
    severe: OnceLock<Option<SevereErrors>>,
    /// The monitor's signal, its error's mean included, over the damage: where a search begins.
    surface: Option<Arc<ErrorModel>>,
    /// Recordings of the machine as new that the error models are corrected with.
    references: Option<References>,
    /// What another start changes of the signal; formed when first needed.
    start_effects: OnceLock<Vec<Vec<f64>>>,
    /// What makes few numbers of the signal; none for the whole signal.
    encoder: Option<Arc<Encoder>>,
    /// Noise covariances by the rate of the phases.
    unit_noise: Mutex<BTreeMap<u64, Arc<BandedMatrix>>>,
    /// Emulators by noise level and rate of the phases, with the likelihood of their errors.
    emulators: Mutex<BTreeMap<(u64, u64), Arc<Emulator>>>,
    /// The surface, prepared in the same way.
    surfaces: Mutex<BTreeMap<(u64, u64), Arc<Emulator>>>,
    /// Likelihoods by error model, noise level and rate of the phases.
    likelihoods: Mutex<BTreeMap<LikelihoodKey, Arc<Likelihood>>>,
}

/// Place of the error model; bits of the noise level and of the rate of the phases.
type LikelihoodKey = (usize, u64, u64);

/// Likelihoods kept for the next recording.
const LIKELIHOODS_KEPT: usize = 8;

/// Differences for derivatives: large against the monitor's own kinks (the controller's ticks),
/// small against the damage looked for.
const DIFFERENCE_STEP: f64 = 1e-3;
/// Where a search starts: damage in the middle of the incipient range.
const START: [f64; FAULT_COUNT] = [0.02, 0.02, 0.02, 0.02, 0.02, 0.0, 0.0];
/// Least value of each coordinate: an estimate free of bounds may be slightly negative, but not
/// beyond what the machine can be given (backlash 1 + 99·k2 > 0).
const LEAST: [f64; FAULT_COUNT] = [-0.05, -0.0099, -0.05, -0.05, -0.05, -1.0, -1.0];
/// Electrical start angles closer than this to the bundle's count as the bundle's, rad: at the
/// slowest commutation of the chirp that is a tenth of a carrier period. One milliradian at a rotor
/// of four pole pairs.
const ELECTRICAL_TOLERANCE_RAD: f64 = 4e-3;
/// Most rounds in which faults and the start angle that commutation shows settle.
const COMMUTATION_ROUNDS: usize = 4;
/// Largest level that the incipient designs hold, with a margin for the estimate's scatter.
const TRAINED_LEVEL: f64 = 0.06;
/// Start angles tried in one sector when the angle is not known.
const UNKNOWN_ANGLES: usize = 8;
/// Standard deviations of ln(misfit) over the reference signals that make a fit inadequate.
const MISFIT_DEVIATIONS: f64 = 4.0;
/// Natural logarithm of the factor by which a noise level may differ from the bundle's, one
/// standard deviation.
const NOISE_PRIOR_LN_STD: f64 = core::f64::consts::LN_2;

/// A fit of the monitor to a signal.
struct FitResult {
    /// Estimates of the coordinates looked for.
    estimate: Vec<f64>,
    /// Residual, A.
    residual_a: Vec<f64>,
    /// Mean square of the whitened residual.
    misfit: f64,
    evaluations: u64,
    /// Whether the search ran out of evaluations.
    cut_short: bool,
    /// Slopes of the signal at the estimate, where they are known already.
    slopes: Option<Slopes>,
    /// How the recording begins and the covariance with that, where that is estimated.
    began: Option<(Began, DMatrix<f64>)>,
}

impl FitResult {
    /// `−2·ln` of the likelihood, less a constant.
    fn cost(&self, likelihood: &Likelihood) -> f64 {
        self.misfit * likelihood.size() as f64 + likelihood.log_determinant()
    }
}

/// One way to explain a recording: how the monitor stands and errs.
struct Hypothesis<'a> {
    error: &'a ErrorModel,
    start_angle_rad: f64,
    /// Whether that is where the bundle's experiment starts.
    at_own_start: bool,
}

impl Diagnoser {
    /// Prepares a bundle: runs the monitor at its conditions and learns its error.
    ///
    /// # Errors
    ///
    /// [`BundleError`] for a bundle that nothing can be learnt from.
    pub fn new(bundle: Bundle) -> Result<Self, BundleError> {
        Self::with_encoding(bundle, Encoding::Full)
    }

    /// The same, looking at an encoded signal.
    ///
    /// Search, uncertainty, noise and adequacy rest on the encoded numbers alone.
    ///
    /// # Errors
    ///
    /// [`BundleError`] for a bundle that nothing can be learnt from.
    pub fn with_encoding(bundle: Bundle, encoding: Encoding) -> Result<Self, BundleError> {
        let encoder = Encoder::of(&bundle, encoding)?;
        let incipient = bundle.error_model(StartAngle::Zero)?.ok_or(BundleError::NoIncipient)?;
        let surface = bundle.monitor_surface(&incipient)?.map(Arc::new);
        Ok(Self {
            bundle,
            incipient,
            turned: OnceLock::new(),
            high: [OnceLock::new(), OnceLock::new()],
            severe: OnceLock::new(),
            surface,
            references: None,
            start_effects: OnceLock::new(),
            encoder,
            unit_noise: Mutex::new(BTreeMap::new()),
            emulators: Mutex::new(BTreeMap::new()),
            surfaces: Mutex::new(BTreeMap::new()),
            likelihoods: Mutex::new(BTreeMap::new()),
        })
    }

    /// The bundle.
    pub fn bundle(&self) -> &Bundle {
        &self.bundle
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
        self.diagnose_shown(recording, options, &Watch::NOTHING)
    }

    /// The same, showing what it does.
    pub(crate) fn diagnose_shown(
        &self,
        recording: &Recording,
        options: &DiagnoseOptions,
        watch: &Watch<'_>,
    ) -> Result<RecordDiagnosis, DiagnoseError> {
        let mut observation =
            Observation::of(recording, &self.bundle.experiment, options.max_delay_s)?;
        let notices = std::mem::take(&mut observation.notices);
        let mut answer = match observation.commutation.take() {
            Some(seen) => self.with_commutation(&mut observation, &seen, options, watch)?,
            None => self.diagnose_run(&observation, options, watch)?.0,
        };
        answer.notices.splice(0..0, notices);
        answer.recording.clone_from(&recording.name);
        Ok(answer)
    }

    /// Diagnoses with a start angle read off the commutation: how the rotor turns, and so where it
    /// started, depends on the faults, which are found with the start angle.
    fn with_commutation(
        &self,
        observation: &mut Observation,
        seen: &Commutation,
        options: &DiagnoseOptions,
        watch: &Watch<'_>,
    ) -> Result<RecordDiagnosis, DiagnoseError> {
        let experiment = &self.bundle.experiment;
        let pole_pairs = experiment.actuator.motor.pole_pairs;
        let (mut answer, mut posterior) = self.diagnose_run(observation, options, watch)?;
        for _ in 0..COMMUTATION_ROUNDS {
            let mut damage = [0.0; FAULT_COUNT];
            for (&index, &value) in posterior.indices.iter().zip(&posterior.estimate) {
                damage[index] = value;
            }
            let start_rad = seen.start_angle_rad(experiment, &damage).map_err(BundleError::from)?;
            let moved_rad = observation.start_angle_rad.map_or(TAU, |now| (start_rad - now).abs());
            if moved_rad < ELECTRICAL_TOLERANCE_RAD / f64::from(pole_pairs) {
                break;
            }
            observation.start_angle_rad = Some(start_rad);
            let spent = answer.evaluations;
            (answer, posterior) = self.diagnose_run(observation, options, watch)?;
            answer.evaluations += spent + 1;
        }
        forget_direction(&mut answer, pole_pairs);
        Ok(answer)
    }

    /// Diagnoses what was read off a recording; beside the answer what it was made from.
    pub(crate) fn diagnose_observation(
        &self,
        observation: &Observation,
        options: &DiagnoseOptions,
    ) -> Result<(RecordDiagnosis, Posterior), DiagnoseError> {
        self.diagnose_watched(observation, options, &|_| {})
    }

    /// The same, showing the residual of every evaluation of the monitor as it is made.
    pub(crate) fn diagnose_watched(
        &self,
        observation: &Observation,
        options: &DiagnoseOptions,
        residual: &dyn Fn(&[f64]),
    ) -> Result<(RecordDiagnosis, Posterior), DiagnoseError> {
        self.diagnose_run(observation, options, &Watch { residual, ..Watch::NOTHING })
    }

    fn diagnose_run(
        &self,
        observation: &Observation,
        options: &DiagnoseOptions,
        watch: &Watch<'_>,
    ) -> Result<(RecordDiagnosis, Posterior), DiagnoseError> {
        start::check(options)?;
        let scalar = scalar_search::criterion(options.method, options.seed).is_some();
        if scalar && options.fidelity == Fidelity::High {
            return Err(DiagnoseError::HighFidelityMethod { method: options.method });
        }
        let run = Run { diagnoser: self, observation, options, watch };
        let referred = self.reference_notice(observation.start_angle_rad, options)?;
        let (mut answer, posterior) = match observation.start_angle_rad {
            Some(angle_rad) => self.with_known_angle(&run, angle_rad)?,
            None => self.with_unknown_angle(&run)?,
        };
        answer.notices.extend(referred);
        Ok((answer, posterior))
    }

    /// The likelihood of an error model at a noise level, kept for the next recording.
    pub(crate) fn likelihood(
        &self,
        error: &ErrorModel,
        phase_rate_hz: f64,
        noise_a: f64,
    ) -> Result<Arc<Likelihood>, NotPositiveDefinite> {
        let known = [
            Some(&self.incipient),
            self.turned.get().and_then(Option::as_ref),
            self.high[0].get().and_then(Option::as_ref),
            self.high[1].get().and_then(Option::as_ref),
        ];
        let place = known.iter().position(|one| one.is_some_and(|one| std::ptr::eq(one, error)));
        let key = (place.unwrap_or(known.len()), noise_a.to_bits(), phase_rate_hz.to_bits());
        {
            let kept = self.likelihoods.lock().expect("no thread panics while it holds the cache");
            if let Some(likelihood) = kept.get(&key) {
                return Ok(Arc::clone(likelihood));
            }
        }
        let unit = self.unit_noise(phase_rate_hz);
        let whole_a = self.with_reference_noise(noise_a);
        let likelihood = Arc::new(Likelihood::new(error, &unit, whole_a, self.encoder.as_ref())?);
        let mut kept = self.likelihoods.lock().expect("no thread panics while it holds the cache");
        if kept.len() >= LIKELIHOODS_KEPT {
            kept.clear();
        }
        kept.insert(key, Arc::clone(&likelihood));
        Ok(likelihood)
    }

    /// The emulator for a noise level, kept for the next recording.
    fn emulator(&self, phase_rate_hz: f64, noise_a: f64) -> Result<Arc<Emulator>, DiagnoseError> {
        let key = (noise_a.to_bits(), phase_rate_hz.to_bits());
        let mut kept = self.emulators.lock().expect("no thread panics while it holds the cache");
        if let Some(emulator) = kept.get(&key) {
            return Ok(Arc::clone(emulator));
        }
        let emulator = Arc::new(Emulator::learn(&self.bundle, phase_rate_hz, noise_a)?);
        if kept.len() >= LIKELIHOODS_KEPT {
            kept.clear();
        }
        kept.insert(key, Arc::clone(&emulator));
        Ok(emulator)
    }

    /// The surface for a noise level, kept for the next recording; `None` where there is none.
    fn surface(
        &self,
        phase_rate_hz: f64,
        noise_a: f64,
    ) -> Result<Option<Arc<Emulator>>, NotPositiveDefinite> {
        let Some(surface) = &self.surface else { return Ok(None) };
        let key = (noise_a.to_bits(), phase_rate_hz.to_bits());
        {
            let kept = self.surfaces.lock().expect("no thread panics while it holds the cache");
            if let Some(prepared) = kept.get(&key) {
                return Ok(Some(Arc::clone(prepared)));
            }
        }
        let likelihood = self.likelihood(&self.incipient, phase_rate_hz, noise_a)?;
        let sought = self.bundle.experiment.sought_indices();
        let prepared = Arc::new(Emulator::on(Arc::clone(surface), sought, likelihood));
        let mut kept = self.surfaces.lock().expect("no thread panics while it holds the cache");
        if kept.len() >= LIKELIHOODS_KEPT {
            kept.clear();
        }
        kept.insert(key, Arc::clone(&prepared));
        Ok(Some(prepared))
    }

    /// The monitor's signal at levels of the faults looked for, start angle zero, with the mean
    /// of its error added.
    pub(crate) fn monitored(&self, monitor: &mut Monitor, levels: &[f64]) -> Vec<f64> {
        let sought = self.bundle.experiment.sought_indices();
        let point = coordinates_of(&sought, levels);
        self.monitored_at(monitor, &point)
    }

    /// The same at coordinates.
    pub(crate) fn monitored_at(&self, monitor: &mut Monitor, point: &[f64]) -> Vec<f64> {
        let mut all = FaultCoordinates([0.0; FAULT_COUNT]);
        for (index, &value) in self.bundle.experiment.sought_indices().into_iter().zip(point) {
            all.0[index] = value;
        }
        let mut signal = monitor.signal(&all);
        for (value, mean) in signal.iter_mut().zip(self.incipient.mean_at(&within_training(point)))
        {
            *value += mean;
        }
        signal
    }

    /// The error model for start angle zero.
    pub(crate) fn incipient(&self) -> &ErrorModel {
        &self.incipient
    }

    /// The error model for another start angle than zero.
    fn turned(&self) -> Result<Option<&ErrorModel>, BundleError> {
        if let Some(model) = self.turned.get() {
            return Ok(model.as_ref());
        }
        let model = self.bundle.error_model(StartAngle::Any)?;
        Ok(self.turned.get_or_init(|| model).as_ref())
    }

    /// What the high-fidelity model leaves: at the bundle's own start angle, or at another where
    /// the bundle has signals of others.
    fn high_error(&self, at_own_start: bool) -> Result<&ErrorModel, BundleError> {
        let turned = if at_own_start { None } else { self.turned()? };
        let (start, error) = match turned {
            Some(turned) => (StartAngle::Any, turned),
            None => (StartAngle::Zero, &self.incipient),
        };
        let kept = &self.high[usize::from(start == StartAngle::Any)];
        if kept.get().is_none() {
            let model = self.bundle.high_error_model(start, error)?;
            kept.get_or_init(|| model);
        }
        kept.get().and_then(Option::as_ref).ok_or(BundleError::NoIncipient)
    }

    /// How the monitor errs on severe damage, from the wide design.
    fn severe(&self) -> Result<Option<&SevereErrors>, BundleError> {
        if let Some(errors) = self.severe.get() {
            return Ok(errors.as_ref());
        }
        let experiment = &self.bundle.experiment;
        let errors = match self.bundle.dataset(ReferenceDesign::Wide) {
            Some(dataset) => Some(SevereErrors::learn(
                // what references correct is no error of the monitor on this machine's model
                self.references.as_ref().map_or(&self.incipient, |references| &references.learnt),
                differences(experiment, dataset)?,
                &sought_coordinates(experiment, dataset),
            )),
            None => None,
        };
        Ok(self.severe.get_or_init(|| errors).as_ref())
    }

    pub(crate) fn unit_noise(&self, phase_rate_hz: f64) -> Arc<BandedMatrix> {
        let mut cache = self.unit_noise.lock().expect("no thread panics while it holds the cache");
        let experiment = &self.bundle.experiment;
        Arc::clone(cache.entry(phase_rate_hz.to_bits()).or_insert_with(|| {
            let samples = experiment.samples();
            Arc::new(unit_noise_at_rate(&experiment.filter, phase_rate_hz, samples))
        }))
    }

    fn with_known_angle(
        &self,
        run: &Run<'_>,
        angle_rad: f64,
    ) -> Result<(RecordDiagnosis, Posterior), DiagnoseError> {
        let experiment = &self.bundle.experiment;
        let own_rad = experiment.scenario.start_angle_rad;
        let at_zero = self.same_start(angle_rad, own_rad);
        if run.options.method == Method::Emulator && !at_zero {
            return Err(DiagnoseError::EmulatorStart { found_rad: Some(angle_rad) });
        }
        let mut notices = Vec::new();
        let error = if at_zero {
            &self.incipient
        } else if let Some(turned) = self.turned()? {
            turned
        } else {
            notices.push(Notice {
                code: NoticeCode::OutsideTraining,
                message: format!(
                    "the rotor starts at {angle_rad:.4} rad and the bundle knows only {own_rad}: \
                     intervals may be too narrow"
                ),
            });
            &self.incipient
        };
        let hypothesis = Hypothesis { error, start_angle_rad: angle_rad, at_own_start: at_zero };
        let (noise, spent) = run.noise(&hypothesis)?;
        let outcome = run.explain(&hypothesis, noise)?;
        if outcome.method != run.options.method {
            notices.push(Notice {
                code: NoticeCode::OutsideTraining,
                message: "the recording is not of the incipient faults that the emulator knows; \
                          the answer is that of `composite`"
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
        if noise.source == NoiseSource::Bundle {
            notices.push(noise_notice(noise.level_a));
        }
        let answer = run.answer(&outcome, noise, spent, notices);
        Ok((answer, outcome.posterior))
    }

    fn with_unknown_angle(
        &self,
        run: &Run<'_>,
    ) -> Result<(RecordDiagnosis, Posterior), DiagnoseError> {
        if run.options.method == Method::Emulator {
            return Err(DiagnoseError::EmulatorStart { found_rad: None });
        }
        let error = self.turned()?.unwrap_or(&self.incipient);
        let pole_pairs = f64::from(self.bundle.experiment.actuator.motor.pole_pairs);
        let sector_rad = TAU / 6.0 / pole_pairs;
        let standing = |start_angle_rad| Hypothesis { error, start_angle_rad, at_own_start: false };
        let first = standing(0.5 * sector_rad);
        let (noise, mut spent) = run.noise(&first)?;
        let mut outcomes = Vec::new();
        for step in 0..UNKNOWN_ANGLES {
            let start_angle_rad = (step as f64 + 0.5) / UNKNOWN_ANGLES as f64 * sector_rad;
            let outcome = run.explain(&standing(start_angle_rad), noise)?;
            spent += outcome.evaluations;
            outcomes.push(outcome);
        }
        let outcome = mixture(&self.bundle.experiment.sought_indices(), outcomes)
            .ok_or(DiagnoseError::Undetermined)?;
        spent -= outcome.evaluations;
        let notices = vec![Notice {
            code: NoticeCode::StartAngleUnknown,
            message: "the rotor's start angle is not known, so that k3, k4, k5 and k7 cannot be \
                      told apart; record `motor_angle_rad` or give `start-angle-rad`"
                .to_owned(),
        }];
        let answer = run.answer(&outcome, noise, spent, notices);
        Ok((answer, outcome.posterior))
    }
}

/// A noise level with where it is from.
#[derive(Clone, Copy)]
struct Noise {
    level_a: f64,
    source: NoiseSource,
}

/// What explains a recording best.
struct Outcome {
    posterior: Posterior,
    residual_a: Vec<f64>,
    floor_a: f64,
    adequate: bool,
    severe: bool,
    /// The search stopped where the residual is not explained.
    unfinished: bool,
    /// What found it: `composite` where the emulator does not reach.
    method: Method,
    evaluations: u64,
    cost: f64,
    /// How the recording begins, or seems to, where that is not as the bundle has it.
    began_otherwise: Vec<Notice>,
    /// The signal that was explained, where it is not the observed one, A.
    measured_a: Option<Vec<f64>>,
}

/// A diagnosis under way.
#[derive(Clone, Copy)]
struct Run<'a> {
    diagnoser: &'a Diagnoser,
    observation: &'a Observation,
    options: &'a DiagnoseOptions,
    watch: &'a Watch<'a>,
}

/// Who is shown what a diagnosis does.
pub(crate) struct Watch<'a> {
    /// Shown the residual of every evaluation of the monitor, A.
    pub(crate) residual: &'a dyn Fn(&[f64]),
    /// Shown the signal and the residual that an answer rests on, A; the last one is that of the
    /// diagnosis.
    pub(crate) answer: &'a dyn Fn(&[f64], &[f64]),
}

impl Watch<'_> {
    pub(crate) const NOTHING: Self = Self { residual: &|_| {}, answer: &|_, _| {} };
}

impl Run<'_> {
    fn encoder(&self) -> Option<&Arc<Encoder>> {
        self.diagnoser.encoder.as_ref()
    }

    /// The noise level: told by the user or the metadata, read off the recording, or else what
    /// makes the residual most likely, with the bundle's level as a prior.
    fn noise(&self, hypothesis: &Hypothesis<'_>) -> Result<(Noise, u64), DiagnoseError> {
        let told = [
            (self.options.noise_a, NoiseSource::Flag),
            (self.observation.stated_noise_a, NoiseSource::Metadata),
            (self.observation.measured_noise_a, NoiseSource::OutOfBand),
        ];
        for (level, source) in told {
            if let Some(level_a) = level {
                return Ok((Noise { level_a, source }, 0));
            }
        }
        let prior_a = self.diagnoser.bundle.noise_a;
        let rate_hz = self.observation.phase_rate_hz;
        let unit = self.diagnoser.unit_noise(rate_hz);
        let prepared = match self.options.method {
            Method::Emulator => Some(self.diagnoser.emulator(rate_hz, prior_a)?),
            _ => None,
        };
        let (error, residual_a, evaluations) = if let Some(emulator) = &prepared {
            let found = emulator.diagnose(&self.observation.signal_a);
            let point = found.ok_or(DiagnoseError::Undetermined)?.estimate;
            (emulator.model(), self.less(emulator.signal_a(&point)), 0)
        } else {
            let likelihood = self.diagnoser.likelihood(hypothesis.error, rate_hz, prior_a)?;
            let fit = self.incipient_fit(hypothesis, &likelihood, prior_a)?;
            (hypothesis.error, fit.residual_a, fit.evaluations)
        };
        let cost = |ln_ratio: f64| -> Result<f64, NotPositiveDefinite> {
            let level_a = prior_a * ln_ratio.exp();
            let whole_a = self.diagnoser.with_reference_noise(level_a);
            let factor = Likelihood::plain(error, &unit, whole_a, self.encoder())?;
            let white = factor.whiten(&residual_a);
            let prior = ln_ratio / NOISE_PRIOR_LN_STD;
            Ok(white.iter().map(|z| z * z).sum::<f64>() + factor.log_determinant() + prior * prior)
        };
        let ln_ratio = least(cost, -3.0, 3.0)?;
        let level_a = prior_a * ln_ratio.exp();
        Ok((Noise { level_a, source: NoiseSource::Residual }, evaluations))
    }

    /// Explains the recording under a hypothesis.
    fn explain(&self, hypothesis: &Hypothesis<'_>, noise: Noise) -> Result<Outcome, DiagnoseError> {
        let outcome = self.explain_low(hypothesis, noise)?;
        match self.options.fidelity {
            Fidelity::Low => Ok(outcome),
            Fidelity::High => self.refined(hypothesis, noise, outcome),
        }
    }

    /// Goes on from an answer of the low-fidelity model with the high-fidelity one.
    ///
    /// Slopes are those of the low-fidelity model with its learnt error, and where they do not
    /// lead to an adequate fit those of the high-fidelity model itself.
    fn refined(
        &self,
        hypothesis: &Hypothesis<'_>,
        noise: Noise,
        low: Outcome,
    ) -> Result<Outcome, DiagnoseError> {
        let Diagnoser { bundle, .. } = self.diagnoser;
        let Observation { signal_a, phase_rate_hz, .. } = self.observation;
        let error = self.diagnoser.high_error(hypothesis.at_own_start)?;
        let likelihood = self.diagnoser.likelihood(error, *phase_rate_hz, noise.level_a)?;
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
                let rows = central::differences(&from, HIGH_STEP, |at| monitor.signal(at));
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

    /// Explains the recording by the low-fidelity model: by incipient faults, or where that fails
    /// by severe ones.
    fn explain_low(
        &self,
        hypothesis: &Hypothesis<'_>,
        noise: Noise,
    ) -> Result<Outcome, DiagnoseError> {
        let rate_hz = self.observation.phase_rate_hz;
        let likelihood = self.diagnoser.likelihood(hypothesis.error, rate_hz, noise.level_a)?;
        let seed = self.options.seed;
        if let Some(criterion) = scalar_search::criterion(self.options.method, seed) {
            return self.scalar(hypothesis, &likelihood, criterion);
        }
        if self.options.method == Method::Emulator {
            if let Some(outcome) = self.emulated(noise)? {
                return Ok(outcome);
            }
            let options = DiagnoseOptions { method: Method::Composite, ..self.options.clone() };
            return Run { options: &options, ..*self }.explain_low(hypothesis, noise);
        }
        let fit = self.incipient_fit(hypothesis, &likelihood, noise.level_a)?;
        let adequate = fit.misfit <= likelihood.largest_misfit(MISFIT_DEVIATIONS);
        let inside = fit.estimate.iter().all(|level| level.abs() <= TRAINED_LEVEL);
        let mut spent = fit.evaluations;
        if !(adequate && inside)
            && let Some((severe, severe_likelihood)) = self.severe_fit(hypothesis, noise, &fit)?
        {
            spent += severe.evaluations;
            if severe.cost(&severe_likelihood) < fit.cost(&likelihood) {
                let adequate = severe.misfit <= severe_likelihood.largest_misfit(MISFIT_DEVIATIONS);
                let judged = (adequate, true);
                return self.outcome(hypothesis, &severe_likelihood, severe, judged, spent);
            }
        }
        self.outcome(hypothesis, &likelihood, fit, (adequate, false), spent)
    }

    /// Explains the recording by incipient faults: from the surface where that leads there, else
    /// from the middle of the range.
    fn incipient_fit(
        &self,
        hypothesis: &Hypothesis<'_>,
        likelihood: &Likelihood,
        noise_a: f64,
    ) -> Result<FitResult, DiagnoseError> {
        let (near, spent) = self.near_surface(hypothesis, likelihood, noise_a)?;
        let fit = if let Some(fit) = near {
            fit
        } else {
            let fit = self.fit(hypothesis, likelihood, &START)?;
            FitResult { evaluations: fit.evaluations + spent, ..fit }
        };
        if start::is_free(self.options) {
            return self.freed(hypothesis, likelihood, &fit);
        }
        Ok(fit)
    }

    /// Generalised least squares from where the surface explains the recording best, with the
    /// surface's slopes: the monitor is run for its residuals alone. `None` where that does not
    /// settle within the range that the surface is learnt on; beside it the evaluations made.
    fn near_surface(
        &self,
        hypothesis: &Hypothesis<'_>,
        likelihood: &Likelihood,
        noise_a: f64,
    ) -> Result<(Option<FitResult>, u64), DiagnoseError> {
        if !hypothesis.at_own_start {
            return Ok((None, 0));
        }
        let rate_hz = self.observation.phase_rate_hz;
        let Some(surface) = self.diagnoser.surface(rate_hz, noise_a)? else {
            return Ok((None, 0));
        };
        let Some(found) = surface.diagnose(&self.observation.signal_a) else {
            return Ok((None, 0));
        };
        let mut point = found.estimate;
        let mut monitor = self.monitor(hypothesis)?;
        let most = self.options.max_evaluations.unwrap_or(SURFACE_EVALUATIONS) as u64;
        for evaluations in 1..=most.min(SURFACE_EVALUATIONS as u64) {
            if !self.within_surface(&point) {
                return Ok((None, evaluations - 1));
            }
            let residual_a = self.residual(hypothesis, &mut monitor, &point);
            let white = likelihood.whiten(&residual_a);
            let Some(step) = surface.step(&point, &white) else {
                return Ok((None, evaluations));
            };
            if step.iter().all(|part| part.abs() < STEP_TOLERANCE) {
                let fit = self.last_step(hypothesis, likelihood, &point, &white)?;
                let spent = evaluations + 2 * point.len() as u64 + 1;
                let fit = fit.map(|fit| FitResult { evaluations: spent, ..fit });
                return Ok((fit, spent));
            }
            for (value, part) in point.iter_mut().zip(step) {
                *value += part;
            }
        }
        Ok((None, most))
    }

    /// One step for a whitened residual with the monitor's own slopes, and its residual there: what
    /// a surface leaves out is not to be read as damage. `None` where the slopes leave a coordinate
    /// undetermined.
    fn last_step(
        &self,
        hypothesis: &Hypothesis<'_>,
        likelihood: &Likelihood,
        point: &[f64],
        white: &[f64],
    ) -> Result<Option<FitResult>, DiagnoseError> {
        let slopes = likelihood.slopes(self.jacobian(hypothesis, point)?);
        let Some(step) = slopes.step(white) else {
            return Ok(None);
        };
        let estimate: Vec<f64> = point.iter().zip(step.iter()).map(|(p, s)| p + s).collect();
        if !self.within_surface(&estimate) {
            return Ok(None);
        }
        let mut monitor = self.monitor(hypothesis)?;
        let residual_a = self.residual(hypothesis, &mut monitor, &estimate);
        let misfit = misfit(&likelihood.whiten(&residual_a));
        let slopes = Some(slopes);
        let (evaluations, cut_short, began) = (0, false, None);
        Ok(Some(FitResult { estimate, residual_a, misfit, evaluations, cut_short, slopes, began }))
    }

    /// Whether the surface is learnt at a point, and the machine can be given it.
    fn within_surface(&self, point: &[f64]) -> bool {
        let sought = self.diagnoser.bundle.experiment.sought_indices();
        let mut levels = point.iter().zip(sought);
        levels.all(|(level, index)| {
            (LEAST[index].max(-TRAINED_LEVEL)..=TRAINED_LEVEL).contains(level)
        })
    }

    /// What the emulator says; `None` where it does not explain the recording by incipient faults.
    fn emulated(&self, noise: Noise) -> Result<Option<Outcome>, DiagnoseError> {
        if self.encoder().is_some() {
            return Err(DiagnoseError::EmulatorEncoded);
        }
        let rate_hz = self.observation.phase_rate_hz;
        let emulator = self.diagnoser.emulator(rate_hz, noise.level_a)?;
        let likelihood = emulator.likelihood();
        let Some(found) = emulator.diagnose(&self.observation.signal_a) else {
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

    /// What is measured less what is modelled.
    fn less(&self, mut modelled: Vec<f64>) -> Vec<f64> {
        for (value, measured) in modelled.iter_mut().zip(&self.observation.signal_a) {
            *value = measured - *value;
        }
        modelled
    }

    /// The paper's search on the mask. Where it ends is not where the likelihood is greatest:
    /// the step that is left to there, to first order, is counted as uncertainty, and what the
    /// model cannot explain is judged after it.
    fn scalar(
        &self,
        hypothesis: &Hypothesis<'_>,
        likelihood: &Likelihood,
        criterion: gp_bayesopt::Criterion,
    ) -> Result<Outcome, DiagnoseError> {
        let sought = self.diagnoser.bundle.experiment.sought_indices();
        let mask = &self.diagnoser.bundle.mask;
        let mut monitor = self.monitor(hypothesis)?;
        let budget =
            self.options.max_evaluations.unwrap_or(scalar_search::default_budget(sought.len()));
        let discrepancy = |levels: &[f64]| {
            let point = coordinates_of(&sought, levels);
            let residual = self.residual(hypothesis, &mut monitor, &point);
            mask.iter().map(|&i| residual[i] * residual[i]).sum::<f64>().sqrt()
        };
        let (levels, evaluations) =
            scalar_search::minimise(criterion, &sought, budget, self.options.seed, discrepancy)
                .map_err(|error| DiagnoseError::Search { reason: error.to_string() })?;
        let estimate = coordinates_of(&sought, &levels);
        let residual_a = self.residual(hypothesis, &mut monitor, &estimate);
        let slopes = likelihood.slopes(self.jacobian(hypothesis, &estimate)?);
        let white = likelihood.whiten(&residual_a);
        let step = slopes.step(&white).ok_or(DiagnoseError::Undetermined)?;
        let here = misfit(&white);
        let misfit = misfit(&slopes.left(&white, &step));
        let limit = likelihood.largest_misfit(MISFIT_DEVIATIONS);
        let evaluations = evaluations + 1 + 2 * sought.len() as u64;
        let slopes = Some(slopes);
        let (cut_short, began) = (false, None);
        let fit = FitResult { estimate, residual_a, misfit, evaluations, cut_short, slopes, began };
        let mut outcome =
            self.outcome(hypothesis, likelihood, fit, (here <= limit, false), evaluations)?;
        outcome.unfinished = here > limit;
        outcome.posterior.covariance += &step * step.transpose();
        Ok(outcome)
    }

    /// A fit by severe faults, from several starts, with the monitor's error growing with the
    /// damage.
    fn severe_fit(
        &self,
        hypothesis: &Hypothesis<'_>,
        noise: Noise,
        near: &FitResult,
    ) -> Result<Option<(FitResult, Likelihood)>, DiagnoseError> {
        let Some(severe) = self.diagnoser.severe()? else {
            return Ok(None);
        };
        let unit = self.diagnoser.unit_noise(self.observation.phase_rate_hz);
        let likelihood_at = |size: f64| -> Result<Likelihood, NotPositiveDefinite> {
            let error = hypothesis.error.with_residuals(severe.at_size(size));
            let whole_a = self.diagnoser.with_reference_noise(noise.level_a);
            Likelihood::new(&error, &unit, whole_a, self.encoder())
        };
        let wide = likelihood_at(SEVERE_START)?;
        let mut starts = vec![self.all_coordinates(&near.estimate)];
        for index in self.diagnoser.bundle.experiment.sought_indices() {
            let mut start = START;
            start[index] = SEVERE_START;
            starts.push(start);
        }
        let mut evaluations = 0;
        let mut best: Option<FitResult> = None;
        for start in starts {
            let fit = self.fit(hypothesis, &wide, &start)?;
            evaluations += fit.evaluations;
            if best.as_ref().is_none_or(|best| fit.misfit < best.misfit) {
                best = Some(fit);
            }
        }
        let Some(mut best) = best else { return Ok(None) };
        let mut likelihood = wide;
        for _ in 0..SEVERE_ROUNDS {
            likelihood = likelihood_at(size_of(&best.estimate))?;
            best = self.fit(hypothesis, &likelihood, &self.all_coordinates(&best.estimate))?;
            evaluations += best.evaluations;
        }
        best.evaluations = evaluations;
        Ok(Some((best, likelihood)))
    }

    /// Levenberg-Marquardt on the whitened residual.
    fn fit(
        &self,
        hypothesis: &Hypothesis<'_>,
        likelihood: &Likelihood,
        start: &[f64; FAULT_COUNT],
    ) -> Result<FitResult, DiagnoseError> {
        let indices = self.diagnoser.bundle.experiment.sought_indices();
        let mut monitor = self.monitor(hypothesis)?;
        let select =
            |all: &[f64; FAULT_COUNT]| -> Vec<f64> { indices.iter().map(|&i| all[i]).collect() };
        let bounds = Bounds::new(&select(&LEAST), &vec![1.0; indices.len()])
            .map_err(|error| DiagnoseError::Search { reason: error.to_string() })?;
        let solver = LevenbergMarquardt {
            steps: Some(vec![DIFFERENCE_STEP; indices.len()]),
            max_evaluations: self.options.max_evaluations.unwrap_or(COMPOSITE_EVALUATIONS),
            step_tolerance: STEP_TOLERANCE,
            ..LevenbergMarquardt::default()
        };
        let residual = |point: &[f64]| -> Result<Vec<f64>, std::convert::Infallible> {
            Ok(likelihood.whiten(&self.residual(hypothesis, &mut monitor, point)))
        };
        let solution = solver
            .solve(residual, &select(start), &bounds)
            .map_err(|error: SolveError<_>| DiagnoseError::Search { reason: error.to_string() })?;
        let residual_a = self.residual(hypothesis, &mut monitor, &solution.point);
        Ok(FitResult {
            misfit: solution.norm * solution.norm / likelihood.size() as f64,
            estimate: solution.point,
            residual_a,
            evaluations: solution.evaluations as u64 + 1,
            cut_short: solution.stop == StopReason::BudgetSpent,
            slopes: None,
            began: None,
        })
    }

    fn monitor(&self, hypothesis: &Hypothesis<'_>) -> Result<Monitor, DiagnoseError> {
        let monitor = self.diagnoser.bundle.experiment.monitor(hypothesis.start_angle_rad);
        Ok(monitor.map_err(BundleError::from)?)
    }

    /// `y − y_LF(c) − m(c)`.
    fn residual(
        &self,
        hypothesis: &Hypothesis<'_>,
        monitor: &mut Monitor,
        point: &[f64],
    ) -> Vec<f64> {
        let signal = monitor.signal(&FaultCoordinates(self.all_coordinates(point)));
        self.compare(hypothesis, signal, point)
    }

    /// The same of what the monitor gives at the point.
    fn compare(
        &self,
        hypothesis: &Hypothesis<'_>,
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
    fn all_coordinates(&self, point: &[f64]) -> [f64; FAULT_COUNT] {
        let mut all = [0.0; FAULT_COUNT];
        for (index, &value) in
            self.diagnoser.bundle.experiment.sought_indices().into_iter().zip(point)
        {
            all[index] = value;
        }
        all
    }

    /// Uncertainty and adequacy of a fit.
    fn outcome(
        &self,
        hypothesis: &Hypothesis<'_>,
        likelihood: &Likelihood,
        mut fit: FitResult,
        (adequate, severe): (bool, bool),
        mut spent: u64,
    ) -> Result<Outcome, DiagnoseError> {
        let experiment = &self.diagnoser.bundle.experiment;
        let unfinished = fit.cut_short && !adequate;
        let began_otherwise;
        let mut measured_a = None;
        let covariance = if let Some((began, covariance)) = fit.began.take() {
            began_otherwise = began.notices(experiment);
            measured_a = Some(self.observation.advanced(began.delay_s(), experiment));
            covariance
        } else {
            let slopes = if let Some(slopes) = fit.slopes.take() {
                slopes
            } else {
                let jacobian = self.jacobian(hypothesis, &fit.estimate)?;
                spent += 2 * jacobian.len() as u64;
                likelihood.slopes(jacobian)
            };
            // what explains a recording leaves no other start to suspect, and a search cut short
            // nothing to go by
            began_otherwise = if adequate || unfinished {
                Vec::new()
            } else {
                self.suspected_start(likelihood, slopes.rows(), &fit.residual_a)?
            };
            likelihood.estimate_covariance(&slopes).ok_or(DiagnoseError::Undetermined)?
        };
        let cost = fit.cost(likelihood);
        Ok(Outcome {
            posterior: Posterior {
                indices: self.diagnoser.bundle.experiment.sought_indices(),
                estimate: fit.estimate,
                covariance,
            },
            residual_a: fit.residual_a,
            floor_a: likelihood.floor_a(),
            adequate,
            severe,
            unfinished,
            method: self.options.method,
            evaluations: spent,
            cost,
            began_otherwise,
            measured_a,
        })
    }

    /// Central differences of the modelled signal, one row a coordinate looked for.
    fn jacobian(
        &self,
        hypothesis: &Hypothesis<'_>,
        point: &[f64],
    ) -> Result<Vec<Vec<f64>>, DiagnoseError> {
        let monitor = self.monitor(hypothesis)?;
        Ok(central::differences_together(point, DIFFERENCE_STEP, |points| {
            let coordinates: Vec<FaultCoordinates> =
                points.iter().map(|moved| FaultCoordinates(self.all_coordinates(moved))).collect();
            // the signal's slopes are those of the residual, turned round
            let turned = |(signal, moved): (Vec<f64>, &Vec<f64>)| {
                self.compare(hypothesis, signal, moved).into_iter().map(|value| -value).collect()
            };
            monitor.signals(&coordinates).into_iter().zip(points).map(turned).collect()
        }))
    }

    /// The largest level that could be there undetected, where the recording is too noisy for
    /// "healthy": its noise far above what the bundle expects, or a whole incipient range open.
    fn hidden(&self, faults: &[Fault], noise: Noise) -> Option<f64> {
        let most = faults[..FAULT_COUNT - 1]
            .iter()
            .filter(|fault| fault.detected == Some(false))
            .filter_map(|fault| fault.interval_95.map(|[_, high]| high))
            .fold(0.0, f64::max);
        let loud = noise.level_a > LOUD_RATIO * self.diagnoser.bundle.noise_a;
        (loud || most > INCIPIENT_LEVEL).then_some(most)
    }

    /// The answer as it is reported.
    fn answer(
        &self,
        outcome: &Outcome,
        noise: Noise,
        spent: u64,
        mut notices: Vec<Notice>,
    ) -> RecordDiagnosis {
        let mut faults = outcome.posterior.faults();
        let sought = &self.diagnoser.bundle.experiment.sought;
        if outcome.unfinished {
            for fault in &mut faults {
                fault.detected = None;
            }
            notices.push(Notice {
                code: NoticeCode::SearchUnfinished,
                message: "the search ended where the model does not explain the recording; the \
                          levels are where it stopped, and nothing is decided"
                    .to_owned(),
            });
        }
        let rate_hz = self.observation.phase_rate_hz;
        let learnt_hz = self.diagnoser.bundle.experiment.actuator.controller.sample_hz;
        if rate_hz < LEAST_RATE_SHARE * learnt_hz {
            notices.push(Notice {
                code: NoticeCode::OutsideTraining,
                message: format!(
                    "the phases were sampled at {rate_hz} Hz and the bundle is learnt at \
                     {learnt_hz} Hz: commutation is seen more coarsely, which the intervals and \
                     the test of fit do not know"
                ),
            });
        }
        if let Some(encoder) = self.encoder() {
            notices.push(encoder.notice());
        }
        notices.extend(outcome.began_otherwise.iter().cloned());
        let any_null = (0..FAULT_COUNT - 1).any(|i| sought[i] && faults[i].value.is_none());
        let any_detected = faults.iter().any(|fault| fault.detected == Some(true));
        let eccentric = faults[5].detected == Some(true);
        if faults[5].value.is_some() && !eccentric {
            notices.push(Notice {
                code: NoticeCode::PhaseUndetermined,
                message: "no eccentricity is detected, so that it has no direction (k7)".to_owned(),
            });
        }
        let hidden = self.hidden(&faults, noise);
        notices.extend(hidden.map(|most| hidden_notice(most, noise)));
        let verdict = if outcome.unfinished {
            Verdict::Undetermined
        } else if !outcome.adequate {
            Verdict::ModelInadequate
        } else if any_detected {
            Verdict::Faulty
        } else if any_null || hidden.is_some() {
            Verdict::Undetermined
        } else {
            Verdict::Healthy
        };
        let measured_a = outcome.measured_a.as_ref().unwrap_or(&self.observation.signal_a);
        (self.watch.answer)(measured_a, &outcome.residual_a);
        let count = outcome.residual_a.len() as f64;
        let square_sum = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>();
        let rms_a = (square_sum(&mut outcome.residual_a.iter().copied()) / count).sqrt();
        let mask = &self.diagnoser.bundle.mask;
        let discrepancy = square_sum(&mut mask.iter().map(|&i| outcome.residual_a[i])).sqrt();
        RecordDiagnosis {
            recording_sha256: None,
            recording: String::new(),
            actuator_id: None,
            date: None,
            status: if any_null || !outcome.adequate { Status::Partial } else { Status::Ok },
            verdict,
            bundle: None,
            method: outcome.method,
            fidelity: self.options.fidelity,
            evaluations: outcome.evaluations + spent,
            elapsed_s: None,
            discrepancy,
            fit: Fit {
                rms_a,
                noise_floor_a: outcome.floor_a,
                noise_a: noise.level_a,
                noise_source: noise.source,
                adequate: outcome.adequate,
            },
            faults,
            covariance: outcome.posterior.report_covariance(),
            notices,
        }
    }
}

/// Errors of the monitor on severe damage: they grow with a power of its size.
#[derive(Debug)]
struct SevereErrors {
    /// Errors at unit size, one a wide condition, with the logarithm of the condition's size.
    at_unit: Vec<(f64, Vec<f64>)>,
    exponent: f64,
}

impl SevereErrors {
    /// Learns the power from errors at points: the slope of ln(rms) over ln(size).
    fn learn(model: &ErrorModel, mut errors: Vec<Vec<f64>>, points: &[Vec<f64>]) -> Self {
        let sizes: Vec<f64> = points.iter().map(|point| size_of(point)).collect();
        for (error, point) in errors.iter_mut().zip(points) {
            let mean = model.mean_at(&within_training(point));
            for (value, mean) in error.iter_mut().zip(mean) {
                *value -= mean;
            }
        }
        let ln_rms = |error: &Vec<f64>| {
            let mean_square = error.iter().map(|v| v * v).sum::<f64>() / error.len() as f64;
            0.5 * mean_square.max(f64::MIN_POSITIVE).ln()
        };
        let pairs: Vec<(f64, f64)> =
            sizes.iter().zip(&errors).map(|(size, error)| (size.ln(), ln_rms(error))).collect();
        let exponent = slope(&pairs).clamp(0.0, 4.0);
        for (error, size) in errors.iter_mut().zip(&sizes) {
            let scale = size.powf(-exponent);
            for value in error {
                *value *= scale;
            }
        }
        let at_unit = sizes.iter().map(|size| size.ln()).zip(errors).collect();
        Self { at_unit, exponent }
    }

    /// Errors for damage of a size: those of the conditions nearest in size, scaled to it.
    fn at_size(&self, size: f64) -> Vec<Vec<f64>> {
        let ln_size = size.ln();
        let mut nearest: Vec<&(f64, Vec<f64>)> = self.at_unit.iter().collect();
        nearest.sort_by(|a, b| (a.0 - ln_size).abs().total_cmp(&(b.0 - ln_size).abs()));
        let scale = size.powf(self.exponent);
        let scaled = |error: &[f64]| error.iter().map(|value| scale * value).collect();
        nearest.iter().take(NEAREST_SEVERE).map(|(_, error)| scaled(error)).collect()
    }
}

/// Wide conditions that tell the errors at a size of damage.
const NEAREST_SEVERE: usize = 40;

/// Least-squares slope of pairs (x, y).
fn slope(pairs: &[(f64, f64)]) -> f64 {
    let count = pairs.len() as f64;
    let mean = |pick: fn(&(f64, f64)) -> f64| pairs.iter().map(pick).sum::<f64>() / count;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let cross: f64 = pairs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let square: f64 = pairs.iter().map(|p| (p.0 - x) * (p.0 - x)).sum();
    cross / square.max(f64::MIN_POSITIVE)
}

/// Searches with the high-fidelity model, each with slopes of its own.
const HIGH_ROUNDS: usize = 3;
/// Differences of the high-fidelity signal: large against the steps in which commutation moves.
const HIGH_STEP: f64 = 1e-2;
/// Most evaluations of a search with the surface's slopes; three are usual.
const SURFACE_EVALUATIONS: usize = 10;
/// Most evaluations of one composite search.
const COMPOSITE_EVALUATIONS: usize = 200;
/// Share of the bundle's rate below which phases are too coarse for its error model: recordings
/// at 8 kHz are diagnosed as those at 10 kHz, one healthy one of seven at 5 kHz is not.
const LEAST_RATE_SHARE: f64 = 0.8;
/// Damage that a search for severe faults starts from.
const SEVERE_START: f64 = 0.3;
/// Rounds in which size of the damage and its error covariance settle.
const SEVERE_ROUNDS: usize = 2;
/// Steps below this end a search; levels are of interest to 1e-5.
const STEP_TOLERANCE: f64 = 1e-6;

/// The coordinates looked for of levels looked for, `k6` and `k7` taken together.
pub(crate) fn coordinates_of(sought: &[usize], levels: &[f64]) -> Vec<f64> {
    let mut all = HealthState::HEALTHY.levels();
    for (&index, &level) in sought.iter().zip(levels) {
        all[index] = level.clamp(0.0, 1.0);
    }
    let health = HealthState::new(all).unwrap_or(HealthState::HEALTHY);
    let coordinates = health.coordinates().0;
    sought.iter().map(|&index| coordinates[index]).collect()
}

/// Length of a damage vector, never zero.
fn size_of(point: &[f64]) -> f64 {
    point.iter().map(|x| x * x).sum::<f64>().sqrt().max(TRAINED_LEVEL)
}

/// The nearest point that the trend of the error is learnt on.
fn within_training(point: &[f64]) -> Vec<f64> {
    point.iter().map(|x| x.clamp(-TRAINED_LEVEL, TRAINED_LEVEL)).collect()
}

/// Noise over the bundle's from which on a recording is called disturbed.
const LOUD_RATIO: f64 = 5.0;

fn hidden_notice(most: f64, noise: Noise) -> Notice {
    Notice {
        code: NoticeCode::OutsideTraining,
        message: format!(
            "with {:.3} A of noise on each phase sample, levels up to {most:.3} are not excluded where \
             nothing is detected; look for outliers in the currents",
            noise.level_a
        ),
    }
}

fn noise_notice(level_a: f64) -> Notice {
    Notice {
        code: NoticeCode::NoiseFromBundle,
        message: format!("the noise level {level_a} A is the bundle's"),
    }
}

/// Joins the outcomes of equally likely start angles: what does not depend on the angle is
/// averaged by likelihood, its spread over the angles added; the rest is dropped.
fn mixture(sought: &[usize], mut outcomes: Vec<Outcome>) -> Option<Outcome> {
    let least = outcomes.iter().map(|outcome| outcome.cost).fold(f64::INFINITY, f64::min);
    let weights: Vec<f64> =
        outcomes.iter().map(|outcome| (-0.5 * (outcome.cost - least)).exp()).collect();
    let total: f64 = weights.iter().sum();
    let free: Vec<usize> =
        (0..sought.len()).filter(|&place| FREE_OF_ANGLE.contains(&sought[place])).collect();
    let mean: Vec<f64> = free
        .iter()
        .map(|&place| {
            let sum: f64 = outcomes
                .iter()
                .zip(&weights)
                .map(|(outcome, weight)| weight * outcome.posterior.estimate[place])
                .sum();
            sum / total
        })
        .collect();
    let covariance = nalgebra::DMatrix::from_fn(free.len(), free.len(), |i, j| {
        outcomes
            .iter()
            .zip(&weights)
            .map(|(outcome, weight)| {
                let posterior = &outcome.posterior;
                let away = |place: usize, k: usize| posterior.estimate[free[place]] - mean[k];
                weight * (posterior.covariance[(free[i], free[j])] + away(i, i) * away(j, j))
            })
            .sum::<f64>()
            / total
    });
    let best =
        (0..outcomes.len()).min_by(|&a, &b| outcomes[a].cost.total_cmp(&outcomes[b].cost))?;
    let mut best = outcomes.swap_remove(best);
    best.posterior = Posterior {
        indices: free.iter().map(|&place| sought[place]).collect(),
        estimate: mean,
        covariance,
    };
    Some(best)
}

/// Coordinates that mean the same at any start angle: friction and backlash.
const FREE_OF_ANGLE: [usize; 2] = [0, 1];

/// Least point of a function with one valley, by golden section to a thousandth.
fn least<E>(mut cost: impl FnMut(f64) -> Result<f64, E>, low: f64, high: f64) -> Result<f64, E> {
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    let (mut low, mut high) = (low, high);
    let (mut a, mut b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut cost_a, mut cost_b) = (cost(a)?, cost(b)?);
    while high - low > 1e-2 {
        if cost_a < cost_b {
            (high, b, cost_b) = (b, a, cost_a);
            a = high - GOLDEN * (high - low);
            cost_a = cost(a)?;
        } else {
            (low, a, cost_a) = (a, b, cost_b);
            b = low + GOLDEN * (high - low);
            cost_b = cost(b)?;
        }
    }
    Ok(0.5 * (low + high))
}
