//! Layout of bundles and datasets on disk: plain data, kept apart from the types that compute.

use ema_sim::{
    Actuator, Command, ControlMode, EffectId, EnvelopeFilter, FAULT_COUNT, Imperfections, Role,
    Scenario,
    model_file::{self, Model},
};

use inference::BandedMatrix;
use nalgebra::DMatrix;
use recordings::EnvelopeKind;

use crate::{
    offline::{
        bundle::{Bundle, BundleError, ModelChoice, Modelled, StartAngle},
        dataset::{Condition, Dataset, ReferenceDesign},
        error_model::{CovarianceShape, Trend},
        rounded_signals::{CODE_STEPS, NOISE_STEPS, RoundedSignals},
        signal_codes::SignalCodes,
        store::{self, ArtefactKind, Decode, Encode},
    },
    simulation::{
        envelope::{envelope_kind, envelope_of},
        experiment::Experiment,
    },
    unit::{
        effect_error::EffectError,
        embedded_error::EmbeddedError,
        error::UnitError,
        evidence::InCommon,
        quantities::Quantities,
        voltage::{FOUND, VoltageError},
    },
};

/// Layout of a bundle; the experiment first, since it can be read alone.
#[derive(Encode, Decode)]
struct BundleData {
    experiment: ExperimentData,
    datasets: Vec<DatasetData>,
    mask: Vec<u32>,
    choices: Vec<ChoiceData>,
    noise_a: f64,
    noise_of_loops: Vec<NoiseOfLoopsData>,
    units: Vec<UnitErrorData>,
}

/// Layout of a dataset file.
#[derive(Encode, Decode)]
struct DatasetFileData {
    experiment: ExperimentData,
    datasets: Vec<FullDatasetData>,
}

#[derive(Encode, Decode)]
struct FullDatasetData {
    dataset: DatasetData,
    /// Signals in full, where the dataset's own are rounded.
    signals_a: Vec<f64>,
}

#[derive(Encode, Decode)]
struct ExperimentData {
    name: String,
    model_name: String,
    model: String,
    scenario: ScenarioData,
    envelope: String,
    filter_hz: f64,
    rate_hz: f64,
    sought: Vec<bool>,
}

#[derive(Encode, Decode)]
struct ScenarioData {
    command: CommandData,
    /// True where the command is a speed.
    speed_mode: bool,
    load_n_m: f64,
    brake_n_m: f64,
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
    signals: RoundedSignals,
}

#[derive(Encode, Decode)]
struct ChoiceData {
    /// 0: error of the low-fidelity model at start angle zero, 1: at any, 2: the signal itself.
    of: u8,
    trend: u8,
    taper_support_samples: u32,
    electronics_share: f64,
}

/// Runs with the drive's own noise less those without.
#[derive(Encode, Decode)]
struct NoiseOfLoopsData {
    /// 0: start angle zero, 1: any.
    start: u8,
    runs: RoundedSignals,
}

/// Learnt error on units, its rows in steps of their range.
#[derive(Encode, Decode)]
struct UnitErrorData {
    /// 0: start angle zero, 1: any.
    start: u8,
    centre: Vec<f64>,
    spread: Vec<f64>,
    coefficients: RoundedSignals,
    covariance: CovarianceData,
    wide: Option<CovarianceData>,
    /// Covariances of quantities, of a narrow play and of a wide one, row by row.
    embedded: [Vec<f64>; 2],
    embedded_in_common: [f64; 3],
    effects: Vec<EffectErrorData>,
    /// Shares of the covariance in common: of a unit, of a state of health, of a session.
    in_common: [f64; 3],
    ln_misfit_mean: f64,
    ln_misfit_std: f64,
    voltage: Option<VoltageErrorData>,
}

/// Covariances of an effect's amplitudes, of a narrow play and of a wide one, row by row.
#[derive(Encode, Decode)]
struct EffectErrorData {
    symbol: String,
    narrow: Vec<f64>,
    wide: Vec<f64>,
}

impl EffectErrorData {
    fn of(error: &EffectError) -> Self {
        let [narrow, wide] =
            [&error.narrow, &error.wide].map(|covariance| covariance.iter().copied().collect());
        Self { symbol: error.effect.info().symbol.to_owned(), narrow, wide }
    }

    /// `None` where the effect is not known or its numbers contradict one another.
    fn into_error(self) -> Option<EffectError> {
        let effect = EffectId::find(&self.symbol)?;
        let parameters = effect.info().parameters.iter();
        let size = parameters.filter(|one| one.role() == Role::Amplitude).count();
        let [narrow, wide] = [&self.narrow, &self.wide].map(|rows| square(rows, size));
        Some(EffectError { effect, narrow: narrow?, wide: wide? })
    }
}

/// A square matrix by its rows; `None` where they are not of its size or not finite.
fn square(rows: &[f64], size: usize) -> Option<DMatrix<f64>> {
    let fits = rows.len() == size * size && rows.iter().all(|value| value.is_finite());
    fits.then(|| DMatrix::from_row_slice(size, size, rows))
}

/// Learnt error of what the motor's voltage shows.
#[derive(Encode, Decode)]
struct VoltageErrorData {
    centre: [f64; 2],
    spread: [f64; 2],
    /// One row a term.
    coefficients: Vec<f64>,
    /// Row by row.
    covariance: Vec<f64>,
    /// Covariance of machines with a wide play.
    wide: Option<Vec<f64>>,
    in_common: [f64; 3],
    ln_left: [f64; 2],
}

/// Covariance as correlations in steps of 1/32767 below standard deviations.
#[derive(Encode, Decode)]
struct CovarianceData {
    half_band: u32,
    std_a: Vec<f32>,
    /// As one signal, lag by lag.
    correlations: SignalCodes,
}

impl CovarianceData {
    fn of(covariance: &BandedMatrix) -> Self {
        let std = |row: usize| covariance.at(row, row).sqrt();
        let mut correlations = Vec::new();
        for lag in 1..=covariance.half_band() {
            for row in lag..covariance.order() {
                let unit = std(row) * std(row - lag);
                let share = if unit > 0.0 { covariance.at(row, row - lag) / unit } else { 0.0 };
                correlations.push((share.clamp(-1.0, 1.0) * CODE_STEPS).round() as i16);
            }
        }
        Self {
            half_band: covariance.half_band() as u32,
            std_a: (0..covariance.order()).map(|row| std(row) as f32).collect(),
            correlations: SignalCodes::pack(&correlations, correlations.len()),
        }
    }

    /// `None` where it is not of so many samples.
    fn into_covariance(self, samples: usize) -> Option<BandedMatrix> {
        let half_band = (self.half_band as usize).min(samples.saturating_sub(1));
        let stored: usize = (0..samples).map(|row| half_band.min(row)).sum();
        let correlations = self.correlations.unpack(stored)?;
        let fits = self.std_a.len() == samples
            && correlations.len() == stored
            && self.std_a.iter().all(|std| std.is_finite() && *std >= 0.0);
        if !fits {
            return None;
        }
        let mut covariance = BandedMatrix::zeros(samples, half_band);
        let mut codes = correlations.iter();
        let std = |row: usize| f64::from(self.std_a[row]);
        for row in 0..samples {
            *covariance.at_mut(row, row) = std(row) * std(row);
        }
        for lag in 1..=half_band {
            for (row, code) in (lag..samples).zip(&mut codes) {
                *covariance.at_mut(row, row - lag) =
                    f64::from(*code) / CODE_STEPS * std(row) * std(row - lag);
            }
        }
        Some(covariance)
    }
}

impl NoiseOfLoopsData {
    fn of((start, runs): &(StartAngle, Vec<Vec<f64>>)) -> Self {
        Self { start: *start as u8, runs: RoundedSignals::of(runs, NOISE_STEPS) }
    }

    fn into_runs(self, samples: usize) -> Result<(StartAngle, Vec<Vec<f64>>), BundleError> {
        let wrong_size = || content("runs with the drive's noise of the wrong size".to_owned());
        let runs = self.runs.into_signals(samples, NOISE_STEPS).ok_or_else(wrong_size)?;
        Ok((start_of(self.start), runs))
    }
}

impl UnitErrorData {
    fn of(error: &UnitError) -> Self {
        Self {
            start: error.start as u8,
            centre: error.centre.clone(),
            spread: error.spread.clone(),
            coefficients: RoundedSignals::of(&error.coefficients, CODE_STEPS),
            covariance: CovarianceData::of(&error.covariance),
            wide: error.wide.as_ref().map(CovarianceData::of),
            embedded: [&error.embedded.narrow, &error.embedded.wide]
                .map(|covariance| covariance.iter().copied().collect()),
            embedded_in_common: error.embedded.in_common.shares(),
            effects: error.effects.iter().map(EffectErrorData::of).collect(),
            in_common: error.in_common.shares(),
            ln_misfit_mean: error.ln_misfit_mean,
            ln_misfit_std: error.ln_misfit_std,
            voltage: error.voltage.as_ref().map(VoltageErrorData::of),
        }
    }

    fn into_error(self, quantities: &Quantities, samples: usize) -> Result<UnitError, BundleError> {
        let bent = quantities.bent();
        let wrong_size = || content("an error on units of the wrong size".to_owned());
        let size = bent.damage.len();
        let embedded = |rows: &[f64]| square(rows, size).ok_or_else(wrong_size);
        let (quantities, terms) = (quantities.len(), UnitError::terms_of(quantities.len(), &bent));
        let coefficients =
            self.coefficients.into_signals(samples, CODE_STEPS).ok_or_else(wrong_size)?;
        let covariance =
            |data: CovarianceData| data.into_covariance(samples).ok_or_else(wrong_size);
        let voltage = |data: VoltageErrorData| data.into_error(terms).ok_or_else(wrong_size);
        let effects = self.effects.into_iter().map(EffectErrorData::into_error);
        let effects = effects.collect::<Option<Vec<_>>>().ok_or_else(wrong_size)?;
        let fits = self.centre.len() == quantities
            && self.spread.len() == quantities
            && coefficients.len() == terms
            && self.spread.iter().all(|spread| *spread > 0.0)
            && [self.ln_misfit_mean, self.ln_misfit_std].iter().all(|x| x.is_finite());
        if !fits {
            return Err(wrong_size());
        }
        Ok(UnitError {
            start: start_of(self.start),
            coefficients,
            centre: self.centre,
            spread: self.spread,
            bent,
            covariance: covariance(self.covariance)?,
            wide: self.wide.map(covariance).transpose()?,
            embedded: EmbeddedError {
                narrow: embedded(&self.embedded[0])?,
                wide: embedded(&self.embedded[1])?,
                in_common: InCommon::of_shares(self.embedded_in_common).ok_or_else(wrong_size)?,
            },
            effects,
            in_common: InCommon::of_shares(self.in_common).ok_or_else(wrong_size)?,
            ln_misfit_mean: self.ln_misfit_mean,
            ln_misfit_std: self.ln_misfit_std,
            voltage: self.voltage.map(voltage).transpose()?,
        })
    }
}

impl VoltageErrorData {
    fn of(error: &VoltageError) -> Self {
        Self {
            centre: error.centre,
            spread: error.spread,
            coefficients: error.coefficients.concat(),
            covariance: error.covariance.iter().copied().collect(),
            wide: error.wide.as_ref().map(|wide| wide.iter().copied().collect()),
            in_common: error.in_common.shares(),
            ln_left: error.ln_left,
        }
    }

    /// `None` where it is not beside so many terms of the current's mean error.
    fn into_error(self, of_current: usize) -> Option<VoltageError> {
        let terms = VoltageError::terms_beside(of_current);
        let covariances = [Some(&self.covariance), self.wide.as_ref()].into_iter().flatten();
        let is_square = covariances.clone().all(|one| one.len() == FOUND * FOUND);
        let numbers = covariances.chain([&self.coefficients]).flatten();
        let pairs = self.centre.iter().chain(&self.spread).chain(&self.ln_left);
        let fits = self.coefficients.len() == terms * FOUND
            && is_square
            && numbers.chain(pairs).all(|number| number.is_finite())
            && self.spread.iter().all(|spread| *spread > 0.0);
        fits.then_some(())?;
        let square = |of: &[f64]| DMatrix::from_column_slice(FOUND, FOUND, of);
        Some(VoltageError {
            centre: self.centre,
            spread: self.spread,
            coefficients: self.coefficients.chunks_exact(FOUND).map(<[f64]>::to_vec).collect(),
            covariance: square(&self.covariance),
            wide: self.wide.as_deref().map(square),
            in_common: InCommon::of_shares(self.in_common)?,
            ln_left: self.ln_left,
        })
    }
}

impl Bundle {
    /// The bytes of the artefact.
    pub fn to_bytes(&self) -> Vec<u8> {
        let data = BundleData {
            experiment: ExperimentData::of(&self.experiment),
            datasets: self
                .datasets
                .iter()
                .zip(&self.dataset_sha256)
                .map(|(dataset, sha256)| DatasetData::of(dataset, sha256))
                .collect(),
            mask: self.mask.iter().map(|&point| point as u32).collect(),
            choices: self
                .choices
                .iter()
                .map(|choice| ChoiceData {
                    of: match choice.of {
                        Modelled::Error(StartAngle::Zero) => 0,
                        Modelled::Error(StartAngle::Any) => 1,
                        Modelled::Signal => 2,
                    },
                    trend: choice.trend as u8,
                    taper_support_samples: choice.shape.taper_support_samples as u32,
                    electronics_share: choice.shape.electronics_share,
                })
                .collect(),
            noise_a: self.noise_a,
            noise_of_loops: self.noise_of_loops.iter().map(NoiseOfLoopsData::of).collect(),
            units: self.units.iter().map(UnitErrorData::of).collect(),
        };
        store::encode(ArtefactKind::Bundle, &data)
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

    /// Reads the experiment of an artefact alone, in a fraction of the time of the whole: tells
    /// which of several bundles fits a recording. Its start angle is zero whatever the datasets'.
    ///
    /// # Errors
    ///
    /// As [`from_bytes`](Self::from_bytes), for the checksum and the experiment.
    pub fn experiment_from_bytes(bytes: &[u8]) -> Result<Experiment, BundleError> {
        store::decode_first::<ExperimentData>(bytes, ArtefactKind::Bundle)?.into_experiment()
    }
}

/// The bytes of a file of datasets of one experiment, signals in full.
pub fn dataset_to_bytes(experiment: &Experiment, datasets: &[Dataset]) -> Vec<u8> {
    let full = |dataset: &Dataset| FullDatasetData {
        dataset: DatasetData::of(dataset, &dataset.sha256()),
        signals_a: dataset.signals_a.iter().flatten().copied().collect(),
    };
    let data = DatasetFileData {
        experiment: ExperimentData::of(experiment),
        datasets: datasets.iter().map(full).collect(),
    };
    store::encode(ArtefactKind::Dataset, &data)
}

/// Reads a file of datasets.
///
/// The experiment starts where the datasets do that do not start anywhere; at zero where there
/// is none.
///
/// # Errors
///
/// As [`Bundle::from_bytes`].
pub fn dataset_from_bytes(bytes: &[u8]) -> Result<(Experiment, Vec<Dataset>), BundleError> {
    let data = store::decode::<DatasetFileData>(bytes, ArtefactKind::Dataset)?;
    let mut experiment = data.experiment.into_experiment()?;
    let samples = experiment.samples();
    let datasets = data
        .datasets
        .into_iter()
        .map(|full| full.into_dataset(samples))
        .collect::<Result<Vec<_>, _>>()?;
    start_with(&mut experiment, &datasets);
    Ok((experiment, datasets))
}

/// Lets an experiment start where its datasets do.
fn start_with(experiment: &mut Experiment, datasets: &[Dataset]) {
    let start_angle_rad = datasets.iter().find_map(Dataset::start_angle_rad).unwrap_or(0.0);
    experiment.scenario.start_angle_rad = start_angle_rad;
}

impl FullDatasetData {
    fn into_dataset(self, samples: usize) -> Result<Dataset, BundleError> {
        let mut dataset = self.dataset.into_dataset(samples)?;
        let fits = self.signals_a.len() == dataset.conditions.len() * samples
            && self.signals_a.iter().all(|value| value.is_finite());
        if !fits {
            return Err(content("signals of the wrong size".to_owned()));
        }
        dataset.signals_a = self.signals_a.chunks_exact(samples).map(<[f64]>::to_vec).collect();
        Ok(dataset)
    }
}

impl BundleData {
    fn into_bundle(self) -> Result<Bundle, BundleError> {
        let mut experiment = self.experiment.into_experiment()?;
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
        start_with(&mut experiment, &datasets);
        let choices = self
            .choices
            .into_iter()
            .map(|choice| {
                Ok(ModelChoice {
                    of: match choice.of {
                        0 => Modelled::Error(StartAngle::Zero),
                        1 => Modelled::Error(StartAngle::Any),
                        2 => Modelled::Signal,
                        other => return Err(content(format!("an unknown model {other}"))),
                    },
                    trend: *Trend::ALL
                        .get(usize::from(choice.trend))
                        .ok_or_else(|| content(format!("an unknown trend {}", choice.trend)))?,
                    shape: CovarianceShape {
                        taper_support_samples: (choice.taper_support_samples as usize)
                            .clamp(1, samples),
                        electronics_share: share(choice.electronics_share)?,
                    },
                })
            })
            .collect::<Result<Vec<_>, BundleError>>()?;
        let noise_of_loops = self.noise_of_loops.into_iter().map(|data| data.into_runs(samples));
        let noise_of_loops = noise_of_loops.collect::<Result<Vec<_>, _>>()?;
        let quantities = Quantities::new(&experiment);
        let units = self.units.into_iter().map(|data| data.into_error(&quantities, samples));
        let units = units.collect::<Result<Vec<_>, _>>()?;
        if !(self.noise_a.is_finite() && self.noise_a > 0.0) {
            return Err(content(format!("a noise level of {} A", self.noise_a)));
        }
        Ok(Bundle {
            experiment,
            datasets,
            dataset_sha256,
            mask: self.mask.into_iter().map(|point| point as usize).collect(),
            choices,
            noise_a: self.noise_a,
            noise_of_loops,
            units,
        })
    }
}

/// A share of the electronics' covariance.
fn share(value: f64) -> Result<f64, BundleError> {
    if (0.0..=1.0).contains(&value) {
        Ok(value)
    } else {
        Err(content(format!("a share {value} of the electronics, expected 0 to 1")))
    }
}

impl ExperimentData {
    fn of(experiment: &Experiment) -> Self {
        Self {
            name: experiment.name.clone(),
            model_name: experiment.model_name.clone(),
            model: model_file::write(&experiment.model()),
            scenario: ScenarioData::of(&experiment.scenario, &experiment.actuator),
            envelope: envelope_kind(experiment.envelope).name().to_owned(),
            filter_hz: experiment.filter.corner_hz,
            rate_hz: experiment.filter.output_hz,
            sought: experiment.sought.to_vec(),
        }
    }

    fn into_experiment(self) -> Result<Experiment, BundleError> {
        let envelope = EnvelopeKind::from_name(&self.envelope)
            .ok_or_else(|| content(format!("an unknown envelope `{}`", self.envelope)))?;
        let sought = self
            .sought
            .try_into()
            .map_err(|found: Vec<bool>| content(format!("{} fault flags", found.len())))?;
        let model = model_of(&self.model)?;
        let experiment = Experiment {
            name: self.name,
            model_name: self.model_name,
            actuator: model.actuator,
            effects: model.switched_on(),
            scenario: self.scenario.into_scenario(),
            envelope: envelope_of(envelope),
            filter: EnvelopeFilter { corner_hz: self.filter_hz, output_hz: self.rate_hz },
            sought,
            phase_rate_hz: None,
            tolerance: model.tolerance,
            temperature: model.temperature,
            stated_levels: model.action_levels,
        };
        // refuses durations and rates that would claim unbounded memory
        experiment.monitor(0.0)?;
        let EnvelopeFilter { corner_hz, output_hz } = experiment.filter;
        let sample_hz = experiment.actuator.controller.sample_hz;
        let usable = corner_hz.is_finite()
            && corner_hz > 0.0
            && output_hz > 0.0
            && output_hz <= sample_hz
            && experiment.samples() > 0;
        if !usable {
            return Err(content(format!(
                "a filter of {corner_hz} Hz at {output_hz} Hz for a drive of {sample_hz} Hz"
            )));
        }
        Ok(experiment)
    }
}

impl ScenarioData {
    fn of(scenario: &Scenario, actuator: &Actuator) -> Self {
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
            Command::Recorded { values_rad, rate_hz } => {
                CommandData::Recorded { values_rad: values_rad.clone(), rate_hz: *rate_hz }
            }
            other => {
                // any other command is a curve, of which the controller sees its ticks
                let rate_hz = actuator.controller.sample_hz;
                let count = (scenario.duration_s * rate_hz).ceil() as usize + 1;
                let values_rad = (0..count).map(|n| other.at(n as f64 / rate_hz)).collect();
                CommandData::Recorded { values_rad, rate_hz }
            }
        };
        Self {
            command,
            speed_mode: scenario.mode == ControlMode::Speed,
            load_n_m: scenario.load_n_m,
            brake_n_m: scenario.brake_n_m,
            duration_s: scenario.duration_s,
        }
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
            mode: if self.speed_mode { ControlMode::Speed } else { ControlMode::Position },
            load_n_m: self.load_n_m,
            brake_n_m: self.brake_n_m,
            duration_s: self.duration_s,
            ..Scenario::chirp()
        }
    }
}

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
            signals: RoundedSignals::of(&dataset.signals_a, CODE_STEPS),
        }
    }

    fn into_dataset(self, samples: usize) -> Result<Dataset, BundleError> {
        let design = design_of(&self.design)?;
        let count = self.noise_seeds.len();
        let wrong_size = || content(format!("a dataset `{}` of the wrong size", self.design));
        let signals_a = self.signals.into_signals(samples, CODE_STEPS).ok_or_else(wrong_size)?;
        let fits = self.start_angles_rad.len() == count
            && self.levels.len() == count * FAULT_COUNT
            && signals_a.len() == count
            && self.start_angles_rad.iter().all(|angle| angle.is_finite());
        if !fits {
            return Err(wrong_size());
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
            signals_a,
        })
    }
}

fn start_of(code: u8) -> StartAngle {
    if code == 0 { StartAngle::Zero } else { StartAngle::Any }
}

fn design_of(name: &str) -> Result<ReferenceDesign, BundleError> {
    ReferenceDesign::from_name(name)
        .ok_or_else(|| content(format!("a dataset of an unknown design `{name}`")))
}

fn content(what: String) -> BundleError {
    BundleError::Content { what }
}

/// The model from text.
fn model_of(text: &str) -> Result<Model, BundleError> {
    model_file::parse(text)
        .map_err(|error| content(format!("a model that cannot be read: {error}")))
}
