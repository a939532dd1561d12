//! The offline bundle: an experiment, its reference signals, and what was chosen on them.

use ema_sim::{
    Actuator, Command, Envelope, EnvelopeFilter, FAULT_COUNT, FaultId, Imperfections, Scenario,
    model_file::{self, Model},
};
use reduction::{
    CompressionConfig, CompressionError, CompressionMap, MatrixError, Snapshots, SomConfig,
};

use crate::{
    banded::{BandedMatrix, NotPositiveDefinite},
    dataset::{Condition, Dataset, ReferenceDesign},
    error_model::{ErrorModel, ErrorModelError, Trend, choose_taper},
    experiment::Experiment,
    observation::envelope_kind,
    record::EnvelopeKind,
    report::{BundleSummary, DatasetSummary, SCHEMA_VERSION},
    seed::{Purpose, RootSeed},
    store::{self, ArtefactKind, Decode, Encode, StoreError},
};

/// Points of the paper's mask, section IV.
pub const MASK_POINTS: usize = 30;
/// Noise that a bundle expects on each phase sample when a recording tells none, A.
pub const DEFAULT_NOISE_A: f64 = 0.020;
/// Reach of the tapers tried, s.
const TAPER_SUPPORTS_S: [f64; 6] = [0.010, 0.020, 0.040, 0.060, 0.080, 0.120];

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
        /// What is wrong.
        what: String,
    },
    /// The design that everything is learnt on is missing.
    #[error("no dataset of the design `incipient`: offset and discrepancy are learnt on it")]
    NoIncipient,
    /// The error model cannot be learnt.
    #[error(transparent)]
    ErrorModel(#[from] ErrorModelError),
    /// No taper gives a covariance with a factor.
    #[error(transparent)]
    Covariance(#[from] NotPositiveDefinite),
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

/// Where the rotor starts: which reference signals tell the monitor's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum StartAngle {
    /// At zero: designs `incipient` and `sparse`.
    Zero,
    /// Anywhere: designs `turned` and `turned-sparse`.
    Any,
}

impl StartAngle {
    /// Whether a design tells the error for this start.
    fn has(self, design: ReferenceDesign) -> bool {
        match self {
            Self::Zero => {
                matches!(design, ReferenceDesign::Incipient | ReferenceDesign::Sparse)
            }
            Self::Any => design.is_turned(),
        }
    }
}

/// How the error of the monitor is modelled, chosen on the reference signals alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorChoice {
    /// For which start of the rotor.
    pub start: StartAngle,
    /// How the mean depends on the damage.
    pub trend: Trend,
    /// Samples that the taper reaches.
    pub taper_support_samples: usize,
}

/// What the offline stage learnt.
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
    /// How errors are modelled.
    pub choices: Vec<ErrorChoice>,
    /// Noise expected on each phase sample, A.
    pub noise_a: f64,
}

impl Bundle {
    /// Learns a bundle from datasets of an experiment.
    ///
    /// Trend and taper of the error model are chosen by the likelihood of reference signals that
    /// were left out; no test recording takes part.
    ///
    /// # Errors
    ///
    /// [`BundleError`] without an incipient dataset, or for signals that nothing can be learnt
    /// from.
    pub fn build(
        experiment: &Experiment,
        datasets: Vec<Dataset>,
        root: RootSeed,
    ) -> Result<Self, BundleError> {
        let incipient = datasets
            .iter()
            .find(|dataset| dataset.design == ReferenceDesign::Incipient)
            .ok_or(BundleError::NoIncipient)?;
        let mask = informative_points(incipient, root)?;
        let mut choices = Vec::new();
        for start in [StartAngle::Zero, StartAngle::Any] {
            let references = References::of(experiment, &datasets, start)?;
            if !references.differences.is_empty() {
                choices.push(references.choose(experiment, start)?);
            }
        }
        let dataset_sha256 = datasets.iter().map(Dataset::sha256).collect();
        let experiment = experiment.clone();
        Ok(Self { experiment, datasets, dataset_sha256, mask, choices, noise_a: DEFAULT_NOISE_A })
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
    /// [`BundleError`] when the monitor cannot be run or nothing can be learnt.
    pub fn error_model(&self, start: StartAngle) -> Result<Option<ErrorModel>, BundleError> {
        let Some(choice) = self.choices.iter().find(|choice| choice.start == start) else {
            return Ok(None);
        };
        let References { differences, coordinates } =
            References::of(&self.experiment, &self.datasets, start)?;
        let support = choice.taper_support_samples;
        Ok(Some(ErrorModel::learn(&differences, &coordinates, choice.trend, support)?))
    }

    /// The bytes of the artefact.
    pub fn to_bytes(&self) -> Vec<u8> {
        store::encode(ArtefactKind::Bundle, &BundleData::of(self))
    }

    /// Reads an artefact.
    ///
    /// # Errors
    ///
    /// [`BundleError::Store`] for bytes that are no bundle, [`BundleError::Content`] for a bundle
    /// that contradicts itself.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, BundleError> {
        store::decode::<BundleData>(bytes, ArtefactKind::Bundle)?.into_bundle()
    }

    /// What the bundle holds, for people and scripts.
    pub fn summary(&self, sha256: String) -> BundleSummary {
        let experiment = &self.experiment;
        BundleSummary {
            schema_version: SCHEMA_VERSION,
            sha256,
            model: experiment.model_name.clone(),
            command: experiment.name.clone(),
            envelope: envelope_kind(experiment.envelope).name().to_owned(),
            rate_hz: experiment.filter.output_hz,
            filter_hz: experiment.filter.corner_hz,
            datasets: self
                .datasets
                .iter()
                .zip(&self.dataset_sha256)
                .map(|(dataset, sha256)| DatasetSummary {
                    name: dataset.design.name().to_owned(),
                    conditions: dataset.conditions.len() as u64,
                    seed: dataset.seed,
                    sha256: sha256.clone(),
                })
                .collect(),
            default_encoding: "full".to_owned(),
            encodings: Vec::new(),
        }
    }
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

/// Reference less monitor, for every condition.
pub(crate) fn differences(
    experiment: &Experiment,
    dataset: &Dataset,
) -> Result<Vec<Vec<f64>>, ema_sim::SimulationError> {
    let mut monitor = experiment.monitor(0.0)?;
    Ok(dataset
        .conditions
        .iter()
        .zip(&dataset.signals_a)
        .map(|(condition, reference)| {
            monitor.turn_to(condition.start_angle_rad);
            let mut difference = monitor.signal(&condition.coordinates());
            for (value, reference) in difference.iter_mut().zip(reference) {
                *value = reference - *value;
            }
            difference
        })
        .collect())
}

/// The coordinates looked for, of every condition.
pub(crate) fn sought_coordinates(experiment: &Experiment, dataset: &Dataset) -> Vec<Vec<f64>> {
    let indices = experiment.sought_indices();
    dataset
        .conditions
        .iter()
        .map(|condition| indices.iter().map(|&i| condition.coordinates().0[i]).collect())
        .collect()
}

/// Reference less monitor for one start of the rotor, with the coordinates looked for.
struct References {
    differences: Vec<Vec<f64>>,
    coordinates: Vec<Vec<f64>>,
}

impl References {
    fn of(
        experiment: &Experiment,
        datasets: &[Dataset],
        start: StartAngle,
    ) -> Result<Self, ema_sim::SimulationError> {
        let mut references = Self { differences: Vec::new(), coordinates: Vec::new() };
        for dataset in datasets.iter().filter(|dataset| start.has(dataset.design)) {
            references.differences.extend(differences(experiment, dataset)?);
            references.coordinates.extend(sought_coordinates(experiment, dataset));
        }
        Ok(references)
    }

    /// Trend and taper that explain left-out signals best.
    fn choose(
        &self,
        experiment: &Experiment,
        start: StartAngle,
    ) -> Result<ErrorChoice, BundleError> {
        let mut floor = BandedMatrix::zeros(experiment.samples(), 0);
        floor.add_to_diagonal(crate::likelihood::FLOOR_A * crate::likelihood::FLOOR_A);
        let supports = TAPER_SUPPORTS_S
            .map(|support_s| (support_s * experiment.filter.output_hz).round().max(2.0) as usize);
        let mut best: Option<(f64, ErrorChoice)> = None;
        for trend in Trend::ALL {
            let model = match ErrorModel::learn(&self.differences, &self.coordinates, trend, 2) {
                Err(ErrorModelError::TooFewSignals { .. }) if best.is_some() => continue,
                learnt => learnt?,
            };
            for (taper_support_samples, score) in
                choose_taper(model.residuals(), &supports, &floor)?
            {
                if best.is_none_or(|(best_score, _)| score > best_score) {
                    best = Some((score, ErrorChoice { start, trend, taper_support_samples }));
                }
            }
        }
        best.map(|(_, choice)| choice).ok_or(BundleError::NoIncipient)
    }
}

/// Layout of the artefact.
#[derive(Encode, Decode)]
struct BundleData {
    name: String,
    model_name: String,
    model: String,
    scenario: ScenarioData,
    envelope: String,
    filter_hz: f64,
    rate_hz: f64,
    sought: Vec<bool>,
    datasets: Vec<DatasetData>,
    mask: Vec<u32>,
    choices: Vec<ChoiceData>,
    noise_a: f64,
}

#[derive(Encode, Decode)]
struct ScenarioData {
    command: CommandData,
    load_n_m: f64,
    duration_s: f64,
}

#[derive(Encode, Decode)]
enum CommandData {
    Chirp { amplitude_rad: f64, start_hz: f64, end_hz: f64, sweep_s: f64 },
    Sine { amplitude_rad: f64, frequency_hz: f64 },
    Recorded { values_rad: Vec<f64>, rate_hz: f64 },
}

#[derive(Encode, Decode)]
struct DatasetData {
    design: String,
    seed: u64,
    controller_noise: bool,
    digitisation: bool,
    sha256: String,
    levels: Vec<f64>,
    start_angles_rad: Vec<f64>,
    noise_seeds: Vec<u64>,
    /// Largest absolute value of each signal, A.
    ranges_a: Vec<f64>,
    /// Signals over their range, in steps of 1/32767.
    signals: Vec<i16>,
}

#[derive(Encode, Decode)]
struct ChoiceData {
    any_start_angle: bool,
    trend: u8,
    taper_support_samples: u32,
}

impl BundleData {
    fn of(bundle: &Bundle) -> Self {
        let experiment = &bundle.experiment;
        Self {
            name: experiment.name.clone(),
            model_name: experiment.model_name.clone(),
            model: model_text(experiment),
            scenario: ScenarioData::of(&experiment.scenario),
            envelope: envelope_kind(experiment.envelope).name().to_owned(),
            filter_hz: experiment.filter.corner_hz,
            rate_hz: experiment.filter.output_hz,
            sought: experiment.sought.to_vec(),
            datasets: bundle
                .datasets
                .iter()
                .zip(&bundle.dataset_sha256)
                .map(|(dataset, sha256)| DatasetData::of(dataset, sha256))
                .collect(),
            mask: bundle.mask.iter().map(|&point| point as u32).collect(),
            choices: bundle
                .choices
                .iter()
                .map(|choice| ChoiceData {
                    any_start_angle: choice.start == StartAngle::Any,
                    trend: choice.trend as u8,
                    taper_support_samples: choice.taper_support_samples as u32,
                })
                .collect(),
            noise_a: bundle.noise_a,
        }
    }

    fn into_bundle(self) -> Result<Bundle, BundleError> {
        let envelope = EnvelopeKind::from_name(&self.envelope)
            .ok_or_else(|| content(format!("an unknown envelope `{}`", self.envelope)))?;
        let sought = self
            .sought
            .try_into()
            .map_err(|found: Vec<bool>| content(format!("{} fault flags", found.len())))?;
        let experiment = Experiment {
            name: self.name,
            model_name: self.model_name,
            actuator: actuator_of(&self.model)?,
            scenario: self.scenario.into_scenario(),
            envelope: envelope_of(envelope),
            filter: EnvelopeFilter { corner_hz: self.filter_hz, output_hz: self.rate_hz },
            sought,
        };
        let samples = experiment.samples();
        if let Some(point) = self.mask.iter().find(|&&point| point as usize >= samples) {
            return Err(content(format!("a mask point {point} beyond {samples} samples")));
        }
        let dataset_sha256 = self.datasets.iter().map(|data| data.sha256.clone()).collect();
        let datasets = self
            .datasets
            .into_iter()
            .map(|data| data.into_dataset(samples))
            .collect::<Result<Vec<_>, _>>()?;
        let choices = self
            .choices
            .into_iter()
            .map(|choice| {
                Ok(ErrorChoice {
                    start: if choice.any_start_angle { StartAngle::Any } else { StartAngle::Zero },
                    trend: *Trend::ALL
                        .get(usize::from(choice.trend))
                        .ok_or_else(|| content(format!("an unknown trend {}", choice.trend)))?,
                    taper_support_samples: (choice.taper_support_samples as usize)
                        .clamp(1, samples),
                })
            })
            .collect::<Result<Vec<_>, BundleError>>()?;
        Ok(Bundle {
            experiment,
            datasets,
            dataset_sha256,
            mask: self.mask.into_iter().map(|point| point as usize).collect(),
            choices,
            noise_a: self.noise_a,
        })
    }
}

impl ScenarioData {
    fn of(scenario: &Scenario) -> Self {
        let command = match &scenario.command {
            Command::Chirp { amplitude_rad, start_hz, end_hz, sweep_s } => CommandData::Chirp {
                amplitude_rad: *amplitude_rad,
                start_hz: *start_hz,
                end_hz: *end_hz,
                sweep_s: *sweep_s,
            },
            Command::Sine { amplitude_rad, frequency_hz } => {
                CommandData::Sine { amplitude_rad: *amplitude_rad, frequency_hz: *frequency_hz }
            }
            other => {
                // any other command is a curve: its samples at a rate that the controller holds
                let rate_hz = CURVE_RATE_HZ;
                let count = (scenario.duration_s * rate_hz).ceil() as usize + 1;
                let values_rad = (0..count).map(|n| other.at(n as f64 / rate_hz)).collect();
                CommandData::Recorded { values_rad, rate_hz }
            }
        };
        Self { command, load_n_m: scenario.load_n_m, duration_s: scenario.duration_s }
    }

    fn into_scenario(self) -> Scenario {
        let command = match self.command {
            CommandData::Chirp { amplitude_rad, start_hz, end_hz, sweep_s } => {
                Command::Chirp { amplitude_rad, start_hz, end_hz, sweep_s }
            }
            CommandData::Sine { amplitude_rad, frequency_hz } => {
                Command::Sine { amplitude_rad, frequency_hz }
            }
            CommandData::Recorded { values_rad, rate_hz } => {
                Command::Recorded { values_rad, rate_hz }
            }
        };
        Scenario {
            command,
            load_n_m: self.load_n_m,
            duration_s: self.duration_s,
            ..Scenario::chirp()
        }
    }
}

/// Rate at which a command without a formula is stored.
const CURVE_RATE_HZ: f64 = 10e3;

impl DatasetData {
    fn of(dataset: &Dataset, sha256: &str) -> Self {
        Self {
            design: dataset.design.name().to_owned(),
            seed: dataset.seed,
            controller_noise: dataset.imperfections.controller_noise,
            digitisation: dataset.imperfections.digitisation,
            sha256: sha256.to_owned(),
            levels: dataset.conditions.iter().flat_map(|c| c.levels).collect(),
            start_angles_rad: dataset.conditions.iter().map(|c| c.start_angle_rad).collect(),
            noise_seeds: dataset.conditions.iter().map(|c| c.noise_seed).collect(),
            ranges_a: dataset.signals_a.iter().map(|signal| range_of(signal)).collect(),
            signals: dataset.signals_a.iter().flat_map(|signal| coded(signal)).collect(),
        }
    }

    fn into_dataset(self, samples: usize) -> Result<Dataset, BundleError> {
        let design = design_of(&self.design)?;
        let count = self.noise_seeds.len();
        let fits = self.start_angles_rad.len() == count
            && self.levels.len() == count * FAULT_COUNT
            && self.ranges_a.len() == count
            && self.signals.len() == count * samples
            && self.ranges_a.iter().all(|range| range.is_finite());
        if !fits {
            return Err(content(format!("a dataset `{}` of the wrong size", self.design)));
        }
        let conditions = self
            .levels
            .chunks_exact(FAULT_COUNT)
            .zip(&self.start_angles_rad)
            .zip(&self.noise_seeds)
            .map(|((levels, &start_angle_rad), &noise_seed)| Condition {
                levels: levels.try_into().expect("a chunk has one level a fault"),
                start_angle_rad,
                noise_seed,
            })
            .collect();
        Ok(Dataset {
            design,
            seed: self.seed,
            imperfections: Imperfections {
                controller_noise: self.controller_noise,
                digitisation: self.digitisation,
            },
            conditions,
            signals_a: self
                .signals
                .chunks_exact(samples)
                .zip(&self.ranges_a)
                .map(|(codes, range_a)| decoded(codes, *range_a))
                .collect(),
        })
    }
}

/// Steps of a stored signal to either side of zero.
const CODE_STEPS: f64 = 32767.0;

/// Largest absolute value of a signal.
fn range_of(signal: &[f64]) -> f64 {
    signal.iter().fold(0.0, |range: f64, value| range.max(value.abs()))
}

/// A signal in steps of its range.
fn coded(signal: &[f64]) -> impl Iterator<Item = i16> {
    let scale = CODE_STEPS / range_of(signal).max(f64::MIN_POSITIVE);
    signal.iter().map(move |value| (value * scale).round() as i16)
}

/// A signal from its steps.
fn decoded(codes: &[i16], range_a: f64) -> Vec<f64> {
    codes.iter().map(|&code| f64::from(code) * range_a / CODE_STEPS).collect()
}

fn design_of(name: &str) -> Result<ReferenceDesign, BundleError> {
    ReferenceDesign::from_name(name)
        .ok_or_else(|| content(format!("a dataset of an unknown design `{name}`")))
}

fn content(what: String) -> BundleError {
    BundleError::Content { what }
}

/// The envelope of the simulation by its name in metadata.
fn envelope_of(kind: EnvelopeKind) -> Envelope {
    match kind {
        EnvelopeKind::HalfAbsSum => Envelope::HalfAbsSum,
        EnvelopeKind::SignedProjection => Envelope::SignedProjection,
        EnvelopeKind::QAxis => Envelope::QAxis,
        EnvelopeKind::ConductingPhase => Envelope::ConductingPhase,
    }
}

/// The model as text, complete.
fn model_text(experiment: &Experiment) -> String {
    model_file::write(&Model {
        name: Some(experiment.model_name.clone()),
        actuator: experiment.actuator,
        faults: FaultId::ALL.into_iter().filter(|id| experiment.sought[id.index()]).collect(),
        tolerance: Vec::new(),
    })
}

/// The model from text.
fn actuator_of(text: &str) -> Result<Actuator, BundleError> {
    let model = model_file::parse(text)
        .map_err(|error| content(format!("a model that cannot be read: {error}")))?;
    Ok(model.actuator)
}
