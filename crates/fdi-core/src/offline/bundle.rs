//! The offline bundle: an experiment, its reference signals, and what was chosen on them.

use std::{num::NonZero, sync::Arc, thread};

use ema_sim::Actuator;
use inference::{BandedMatrix, NotPositiveDefinite};
use reduction::{
    CompressionConfig, CompressionError, CompressionMap, MatrixError, Snapshots, SomConfig,
};

use crate::{
    offline::{
        dataset::{Dataset, ReferenceDesign, monitor_signals, sought_coordinates},
        electronics::{electronics_covariance, electronics_noise, noise_of_loops},
        error_choice::{self, References},
        error_model::{CovarianceShape, ErrorModel, ErrorModelError, Trend},
        store::StoreError,
    },
    seed::{Purpose, RootSeed},
    simulation::experiment::{Experiment, MASK_POINTS},
    statistics::noise_covariance::unit_noise_covariance,
    unit::{
        error::{UnitError, UnitErrorError},
        voltage::{VoltageError, VoltageWorth},
    },
};

/// Drive's current limit over the noise that a bundle expects on each phase sample when a
/// recording tells none: 20 mA for 20 A.
const CURRENT_LIMIT_OVER_NOISE: f64 = 1000.0;
/// Reference signals needed for each term of a linear trend: with fewer than two the mean leverage
/// exceeds one half, and leave-one-out residuals tell more of the fit than of the error.
const SIGNALS_PER_TERM: usize = 2;
/// Most faults whose surface is quartic: fifteen terms for two, 330 would be needed for seven.
const QUARTIC_FAULTS: usize = 2;
/// Signals that a quartic surface needs: four a term.
const QUARTIC_SIGNALS: usize = 60;
/// Steps of the slopes that error models are chosen with.
const SLOPE_STEP: f64 = 1e-3;

/// Why a bundle cannot be made or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BundleError {
    /// Not a bundle, or a damaged one.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The content contradicts itself.
    #[error("the bundle holds {what}")]
    Content {
        /// Contradiction in the content.
        what: String,
    },
    /// The design that everything is learnt on is missing.
    #[error("no dataset of the design `incipient`: offset and discrepancy are learnt on it")]
    NoIncipient,
    /// The bundle has no model of the signal.
    #[error("no emulator; build the bundle anew")]
    NoEmulator,
    /// Too few reference signals for one start of the rotor.
    #[error("{found} conditions of {designs}, expected at least {needed} for {faults} faults")]
    TooFewConditions {
        /// Conditions given.
        found: usize,
        /// Least number.
        needed: usize,
        /// Designs that count together.
        designs: &'static str,
        /// Faults looked for.
        faults: usize,
    },
    /// A dataset whose conditions start elsewhere than the experiment.
    #[error(
        "the dataset of the design `{design}` starts at {found_rad} rad, expected {expected_rad} \
         rad as the others do"
    )]
    OtherStartAngle {
        /// Design of the dataset.
        design: &'static str,
        /// Where its conditions start.
        found_rad: f64,
        /// Where the experiment does.
        expected_rad: f64,
    },
    /// Reference signals that are given twice.
    #[error("the dataset of the design `{design}`, seed {seed}, is given twice")]
    Repeated {
        /// Design of the dataset.
        design: &'static str,
        /// Seed of the dataset.
        seed: u64,
    },
    /// The error model cannot be learnt.
    #[error(transparent)]
    ErrorModel(#[from] ErrorModelError),
    /// No taper gives a covariance with a factor.
    #[error(transparent)]
    Covariance(#[from] NotPositiveDefinite),
    /// The error on machines within the tolerances cannot be learnt.
    #[error(transparent)]
    Units(#[from] UnitErrorError),
    /// The signals cannot be compressed.
    #[error(transparent)]
    Compression(#[from] CompressionError),
    /// The signals do not form snapshots.
    #[error(transparent)]
    Snapshots(#[from] MatrixError),
    /// The experiment cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] ema_sim::SimulationError),
}

/// Where the rotor starts: which reference signals tell the low-fidelity model's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum StartAngle {
    /// Where the experiment does, by default at zero: designs `incipient` and `sparse`.
    Zero,
    /// Anywhere: designs `turned` and `turned-sparse`.
    Any,
}

impl StartAngle {
    /// The designs that tell the error for this start, in words.
    fn designs(self) -> &'static str {
        match self {
            Self::Zero => "the designs `incipient` and `sparse`",
            Self::Any => "the designs `turned` and `turned-sparse`",
        }
    }

    /// True for a design that tells the error for this start.
    pub(crate) fn has(self, design: ReferenceDesign) -> bool {
        match self {
            Self::Zero => {
                matches!(design, ReferenceDesign::Incipient | ReferenceDesign::Sparse)
            }
            Self::Any => design.is_turned(),
        }
    }
}

/// Quantity that is modelled as a function of damage with a covariance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Modelled {
    /// The error of the low-fidelity model, for a start of the rotor.
    Error(StartAngle),
    /// The reference signal itself, for start angle zero: the emulator.
    Signal,
}

/// How something is modelled, chosen on the reference signals alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelChoice {
    /// Quantity that is modelled.
    pub of: Modelled,
    /// How the mean depends on the damage.
    pub trend: Trend,
    /// How the covariance is made.
    pub shape: CovarianceShape,
}

/// Result of the offline stage.
#[derive(Clone, Debug, PartialEq)]
pub struct Bundle {
    /// The actuator and its test.
    pub experiment: Experiment,
    /// Reference signals.
    pub datasets: Vec<Dataset>,
    /// SHA-256 of the datasets as they were made; an artefact keeps their signals to 16 bits.
    pub dataset_sha256: Vec<String>,
    /// The paper's mask: samples kept by DMD and the self-organising map, ascending.
    pub mask: Vec<usize>,
    /// How errors and signal are modelled.
    pub choices: Vec<ModelChoice>,
    /// Noise expected on each phase sample, A.
    pub noise_a: f64,
    /// Runs of the low-fidelity model with the drive's own noise less those without, A, for each
    /// start of the rotor whose reference signals have such noise.
    pub(crate) noise_of_loops: Vec<(StartAngle, Vec<Vec<f64>>)>,
    /// Errors of the low-fidelity model on machines within the tolerances, where there are any.
    pub(crate) units: Vec<UnitError>,
}

/// Share of the time of learning that the models of error and signal take where machines within
/// tolerances are learnt too: 5.9 of 24.5 s for `ema-270` in the chirp.
const MODELS_SHARE: f64 = 0.24;

impl Bundle {
    /// True where it has learnt machines within the tolerances of its model.
    pub fn knows_units(&self) -> bool {
        !self.units.is_empty()
    }

    /// Covariance of the low-fidelity model's error on machines within the tolerances that is left
    /// beside its learnt mean, A², from the bundle's start angle; `None` without tolerances.
    pub fn unit_error_covariance(&self) -> Option<&BandedMatrix> {
        let own = self.units.iter().find(|error| error.start == StartAngle::Zero);
        own.map(|error| &error.covariance)
    }

    /// Worth of the motor's voltage beside the current, from the bundle's start angle; `None` where the
    /// bundle has not learnt it.
    pub fn voltage_worth(&self) -> Option<VoltageWorth> {
        let own = self.units.iter().find(|error| error.start == StartAngle::Zero)?;
        own.voltage.as_ref().and_then(VoltageError::worth)
    }

    /// Learns a bundle from datasets of an experiment.
    ///
    /// Trend and covariance of the error model are those with which reference signals that were
    /// left out are diagnosed best, with noise of `noise_a` on each phase sample; no test
    /// recording takes part.
    ///
    /// # Errors
    ///
    /// [`BundleError`] without an incipient dataset, for datasets that do not go together, or for
    /// signals that nothing can be learnt from.
    pub fn build(
        experiment: &Experiment,
        datasets: Vec<Dataset>,
        noise_a: f64,
        root: RootSeed,
    ) -> Result<Self, BundleError> {
        Self::build_told(experiment, datasets, noise_a, root, &|_, _| {})
    }

    /// Learns a bundle and tells each step in words as it begins, with the share of the time that is
    /// about over then: minutes can pass on a long test.
    ///
    /// # Errors
    ///
    /// As [`build`](Self::build).
    pub fn build_told(
        experiment: &Experiment,
        datasets: Vec<Dataset>,
        noise_a: f64,
        root: RootSeed,
        tell: &dyn Fn(&str, f64),
    ) -> Result<Self, BundleError> {
        let incipient = datasets
            .iter()
            .find(|dataset| dataset.design == ReferenceDesign::Incipient)
            .ok_or(BundleError::NoIncipient)?;
        go_together(experiment, &datasets)?;
        let has_tolerances = !experiment.tolerance.is_empty();
        let has_start = |start: &StartAngle| !of_start(&datasets, *start).is_empty();
        let starts: Vec<_> =
            [StartAngle::Zero, StartAngle::Any].into_iter().filter(has_start).collect();
        let models: usize = starts.iter().map(|&start| Modelled::of_start(start).len()).sum();
        let models_share = if has_tolerances { MODELS_SHARE } else { 1.0 };
        tell("placing the points of the mask", 0.0);
        let mask = informative_points(incipient, root)?;
        let (mut choices, mut noisy) = (Vec::new(), Vec::new());
        for &start in &starts {
            let at_start = of_start(&datasets, start);
            let runs = noise_of_loops(experiment, &at_start)?;
            let electronics = runs.as_ref().map(|runs| electronics_of(experiment, &at_start, runs));
            for &of in Modelled::of_start(start) {
                tell(&of.learning(), models_share * choices.len() as f64 / models as f64);
                choices.push(choose(experiment, &at_start, of, noise_a, electronics.as_ref())?);
            }
            noisy.extend(runs.map(|runs| (start, runs)));
        }
        let mut units = Vec::new();
        if has_tolerances {
            tell(
                "learning the error of the monitor on machines within the tolerances",
                models_share,
            );
            for start in starts {
                units.push(unit_error(experiment, start, noise_a, root)?);
            }
        }
        let dataset_sha256 = datasets.iter().map(Dataset::sha256).collect();
        let experiment = experiment.clone();
        Ok(Self {
            experiment,
            datasets,
            dataset_sha256,
            mask,
            choices,
            noise_a,
            noise_of_loops: noisy,
            units,
        })
    }

    /// The dataset of a design, where the bundle has it.
    pub fn dataset(&self, design: ReferenceDesign) -> Option<&Dataset> {
        self.datasets.iter().find(|dataset| dataset.design == design)
    }

    /// The error model for a start of the rotor, learnt afresh from the reference signals;
    /// `None` where the bundle has none.
    ///
    /// # Errors
    ///
    /// [`BundleError`] when the low-fidelity model cannot be run or nothing can be learnt.
    pub fn error_model(&self, start: StartAngle) -> Result<Option<ErrorModel>, BundleError> {
        self.model_of(Modelled::Error(start))
    }

    /// The model of the reference signal itself, learnt afresh; `None` where the bundle has none.
    pub(crate) fn signal_model(&self) -> Result<Option<ErrorModel>, BundleError> {
        self.model_of(Modelled::Signal)
    }

    /// Shape of the covariance of the error for the bundle's own start of the rotor; `None` where nothing
    /// is learnt of it.
    pub(crate) fn incipient_shape(&self) -> Option<CovarianceShape> {
        let of = Modelled::Error(StartAngle::Zero);
        self.choices.iter().find(|choice| choice.of == of).map(|choice| choice.shape)
    }

    /// The error model for the bundle's own start of the rotor, and the response surface beside it:
    /// the low-fidelity model's own signal with the mean of its error, as a quadratic function of
    /// damage, quartic for two faults; linear, or none, where there are too few conditions.
    pub(crate) fn incipient_with_surface(
        &self,
    ) -> Result<Option<(ErrorModel, Option<ErrorModel>)>, BundleError> {
        let of = Modelled::Error(StartAngle::Zero);
        let datasets = of_start(&self.datasets, StartAngle::Zero);
        let (mut signals, coordinates) = of.signals(&self.experiment, &datasets)?;
        let Some(error) = self.model_on(of, &signals, &coordinates)? else { return Ok(None) };
        let references = datasets.iter().flat_map(|dataset| &dataset.signals_a);
        for ((signal, reference), point) in signals.iter_mut().zip(references).zip(&coordinates) {
            for ((value, reference), mean) in
                signal.iter_mut().zip(reference).zip(error.mean_at(point))
            {
                *value = reference - *value + mean;
            }
        }
        let shape = CovarianceShape::tapered(1);
        let faults = self.experiment.sought_indices().len();
        let surfaces = if faults <= QUARTIC_FAULTS && signals.len() >= QUARTIC_SIGNALS {
            &[Trend::Quartic, Trend::Quadratic, Trend::Linear][..]
        } else {
            &[Trend::Quadratic, Trend::Linear]
        };
        let learnt =
            |&trend: &Trend| ErrorModel::learn(&signals, &coordinates, trend, shape, None).ok();
        let surface = surfaces.iter().find_map(learnt);
        Ok(Some((error, surface)))
    }

    /// Difference between the reference signals and the high-fidelity model without noise: a
    /// constant, and the noise of the electronics, with the covariance shaped as that of the
    /// low-fidelity model's error for the same start is; `None` where the bundle has none.
    pub(crate) fn high_error_model(
        &self,
        start: StartAngle,
        error: &ErrorModel,
    ) -> Result<Option<ErrorModel>, BundleError> {
        let (mut noise, mut coordinates) = (Vec::new(), Vec::new());
        for dataset in of_start(&self.datasets, start) {
            noise.extend(electronics_noise(&self.experiment, dataset)?);
            coordinates.extend(sought_coordinates(&self.experiment, dataset));
        }
        if noise.is_empty() {
            return Ok(None);
        }
        let (shape, electronics) = (error.shape(), error.electronics().cloned());
        let trend = Trend::Constant;
        Ok(Some(ErrorModel::learn(&noise, &coordinates, trend, shape, electronics)?))
    }

    fn model_of(&self, of: Modelled) -> Result<Option<ErrorModel>, BundleError> {
        if !self.choices.iter().any(|choice| choice.of == of) {
            return Ok(None);
        }
        let datasets = of_start(&self.datasets, of.start());
        let (signals, coordinates) = of.signals(&self.experiment, &datasets)?;
        self.model_on(of, &signals, &coordinates)
    }

    /// The model of signals at coordinates, as it was chosen; `None` where it was not.
    fn model_on(
        &self,
        of: Modelled,
        signals: &[Vec<f64>],
        coordinates: &[Vec<f64>],
    ) -> Result<Option<ErrorModel>, BundleError> {
        let Some(choice) = self.choices.iter().find(|choice| choice.of == of) else {
            return Ok(None);
        };
        let electronics = match choice.shape.electronics_share {
            0.0 => None,
            _ => self.electronics(of.start()),
        };
        let (trend, shape) = (choice.trend, choice.shape);
        Ok(Some(ErrorModel::learn(signals, coordinates, trend, shape, electronics)?))
    }

    /// Covariance of the drive's own noise, A²; `None` where the reference signals have none.
    pub(crate) fn electronics(&self, start: StartAngle) -> Option<Arc<BandedMatrix>> {
        let (_, runs) = self.noise_of_loops.iter().find(|(of, _)| *of == start)?;
        Some(electronics_of(&self.experiment, &of_start(&self.datasets, start), runs))
    }
}

/// Error of the low-fidelity model on machines within the tolerances.
fn unit_error(
    experiment: &Experiment,
    start: StartAngle,
    noise_a: f64,
    root: RootSeed,
) -> Result<UnitError, UnitErrorError> {
    let rate_hz = experiment.phase_rate_hz.unwrap_or(experiment.actuator.controller.sample_hz);
    let unit_noise = unit_noise_covariance(experiment, rate_hz);
    let jobs = thread::available_parallelism().map_or(1, NonZero::get);
    UnitError::learn(experiment, start, &unit_noise, noise_a, root, jobs)
}

/// Noise that a bundle expects on each phase sample of a drive when a recording tells none, A: a
/// thousandth of its current limit.
pub fn default_noise_a(actuator: &Actuator) -> f64 {
    actuator.controller.current_limit_a / CURRENT_LIMIT_OVER_NOISE
}

/// Refuses datasets that nothing can be learnt from together.
fn go_together(experiment: &Experiment, datasets: &[Dataset]) -> Result<(), BundleError> {
    let expected_rad = experiment.scenario.start_angle_rad;
    let mut seen: Vec<String> = Vec::new();
    for dataset in datasets {
        let design = dataset.design.name();
        if let Some(found_rad) = dataset.start_angle_rad()
            && found_rad != expected_rad
        {
            return Err(BundleError::OtherStartAngle { design, found_rad, expected_rad });
        }
        let sha256 = dataset.sha256();
        if seen.contains(&sha256) {
            return Err(BundleError::Repeated { design, seed: dataset.seed });
        }
        seen.push(sha256);
    }
    let faults = experiment.sought_indices().len();
    let needed = SIGNALS_PER_TERM * (faults + 1);
    for start in [StartAngle::Zero, StartAngle::Any] {
        let of_start = datasets.iter().filter(|dataset| start.has(dataset.design));
        let found: usize = of_start.map(|dataset| dataset.conditions.len()).sum();
        if (1..needed).contains(&found) {
            let designs = start.designs();
            return Err(BundleError::TooFewConditions { found, needed, designs, faults });
        }
    }
    Ok(())
}

/// The 30 informative points of the incipient signals: DMD, then a self-organising map.
fn informative_points(dataset: &Dataset, root: RootSeed) -> Result<Vec<usize>, BundleError> {
    let snapshots = Snapshots::from_columns(&dataset.signals_a)?;
    let som = SomConfig { seed: root.derive(Purpose::Map, 0), ..SomConfig::default() };
    let config = CompressionConfig { count: MASK_POINTS, som, ..CompressionConfig::default() };
    let map = CompressionMap::fit(&(&snapshots).into(), &config)?;
    let mut points = map.locations().map(<[usize]>::to_vec).unwrap_or_default();
    points.sort_unstable();
    Ok(points)
}

/// Reference less low-fidelity model, for every condition.
pub(crate) fn differences(
    experiment: &Experiment,
    dataset: &Dataset,
) -> Result<Vec<Vec<f64>>, ema_sim::SimulationError> {
    let mut differences = monitor_signals(experiment, &dataset.conditions)?;
    for (difference, reference) in differences.iter_mut().zip(&dataset.signals_a) {
        for (value, reference) in difference.iter_mut().zip(reference) {
            *value = reference - *value;
        }
    }
    Ok(differences)
}

/// The datasets that tell the error for a start of the rotor.
fn of_start(datasets: &[Dataset], start: StartAngle) -> Vec<&Dataset> {
    datasets.iter().filter(|dataset| start.has(dataset.design)).collect()
}

/// Covariance of the drive's own noise, A².
fn electronics_of(
    experiment: &Experiment,
    datasets: &[&Dataset],
    runs: &[Vec<f64>],
) -> Arc<BandedMatrix> {
    let longest = error_choice::longest_support(experiment.filter.output_hz);
    Arc::new(electronics_covariance(experiment, datasets, runs, longest))
}

/// Signals with the coordinates looked for, one row a condition.
type Signals = (Vec<Vec<f64>>, Vec<Vec<f64>>);

impl Modelled {
    /// Quantities that are modelled on the reference signals of a start.
    fn of_start(start: StartAngle) -> &'static [Self] {
        match start {
            StartAngle::Zero => &[Self::Error(StartAngle::Zero), Self::Signal],
            StartAngle::Any => &[Self::Error(StartAngle::Any)],
        }
    }

    /// That it is being learnt, in words.
    fn learning(self) -> String {
        match self {
            Self::Error(start) => {
                format!("learning the error of the monitor on {}", start.designs())
            }
            Self::Signal => "learning the emulator".to_owned(),
        }
    }

    fn start(self) -> StartAngle {
        match self {
            Self::Error(start) => start,
            Self::Signal => StartAngle::Zero,
        }
    }

    /// Signals that are to be modelled, at every condition of some datasets.
    fn signals(
        self,
        experiment: &Experiment,
        datasets: &[&Dataset],
    ) -> Result<Signals, ema_sim::SimulationError> {
        let (mut signals, mut coordinates) = (Vec::new(), Vec::new());
        for dataset in datasets {
            match self {
                Self::Error(_) => signals.extend(differences(experiment, dataset)?),
                Self::Signal => signals.extend(dataset.signals_a.iter().cloned()),
            }
            coordinates.extend(sought_coordinates(experiment, dataset));
        }
        Ok((signals, coordinates))
    }

    /// Trends that are tried.
    fn trends(self) -> &'static [Trend] {
        match self {
            Self::Error(_) => &Trend::ALL,
            Self::Signal => &[Trend::Linear, Trend::Quadratic],
        }
    }
}

/// How something is modelled: trend and covariance with which left-out signals are diagnosed best.
fn choose(
    experiment: &Experiment,
    datasets: &[&Dataset],
    of: Modelled,
    noise_a: f64,
    electronics: Option<&Arc<BandedMatrix>>,
) -> Result<ModelChoice, BundleError> {
    let (differences, coordinates) = of.signals(experiment, datasets)?;
    let jacobians = match of {
        Modelled::Error(_) => monitor_jacobians(experiment, datasets)?,
        Modelled::Signal => Vec::new(),
    };
    let references =
        References { differences, coordinates, jacobians, electronics: electronics.cloned() };
    let rate_hz = experiment.phase_rate_hz.unwrap_or(experiment.actuator.controller.sample_hz);
    let noise = unit_noise_covariance(experiment, rate_hz).scaled(noise_a * noise_a);
    let (trend, shape) =
        error_choice::choose(&references, of.trends(), experiment.filter.output_hz, &noise)?;
    Ok(ModelChoice { of, trend, shape })
}

/// Slopes of the low-fidelity model at every condition.
fn monitor_jacobians(
    experiment: &Experiment,
    datasets: &[&Dataset],
) -> Result<Vec<Vec<Vec<f64>>>, ema_sim::SimulationError> {
    let sought = experiment.sought_indices();
    let mut monitor = experiment.monitor(0.0)?;
    let conditions = datasets.iter().flat_map(|dataset| &dataset.conditions);
    Ok(conditions
        .map(|condition| {
            monitor.turn_to(condition.start_angle_rad);
            monitor.jacobian(&condition.coordinates(), &sought, SLOPE_STEP)
        })
        .collect())
}
