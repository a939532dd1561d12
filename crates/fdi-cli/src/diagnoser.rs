//! The seam between the command line and the diagnosis.

use std::{
    fmt::Display,
    fs,
    path::PathBuf,
    sync::{Arc, OnceLock},
};

use anyhow::{Context, Result, anyhow};
use fdi_core::{
    Bundle, DiagnoseOptions, DiagnosedAlone, EMBEDDED_BUNDLES, EmbeddedBundle, Encoding,
    Experiment, FitSignals, LearntUnit, Purpose, Recording, RootSeed, ToleranceUse,
    UnitLearningError, ema_sim::model_file::Model, fitting_experiment, list_recordings,
    report::RecordDiagnosis,
};

use crate::{DiagnoseArgs, args::ReadingArgs, identity::read_named, unit_file::Units};

/// Diagnoses one recording after another, from several threads at once.
pub trait Diagnoser: Send + Sync {
    /// SHA-256 of the bundle that stands at the head of the answer.
    fn bundle_sha256(&self) -> &str;

    /// SHA-256 of every bundle that answers may be made with.
    fn bundles(&self) -> Vec<&str> {
        vec![self.bundle_sha256()]
    }

    /// Rates that recordings may have, Hz: named when one cannot even be read and
    /// its rate is another.
    fn rates_hz(&self) -> &[f64];

    /// The answer to one recording, without the time it took.
    ///
    /// # Errors
    /// Why this recording cannot be diagnosed, in one line.
    fn diagnose(&self, recording: &Recording) -> Result<RecordDiagnosis>;

    /// A recording by itself, for an answer to several.
    ///
    /// # Errors
    /// As [`diagnose`](Self::diagnose), and where there is no answer to several.
    fn diagnose_alone(&self, recording: &Recording) -> Result<DiagnosedAlone> {
        Err(anyhow!("{}: this diagnosis is of one recording", recording.name))
    }

    /// The signals behind the answer to a recording, where it has any to show.
    ///
    /// # Errors
    /// As [`diagnose`](Self::diagnose).
    fn signals(&self, recording: &Recording) -> Result<Option<FitSignals>> {
        let _ = recording;
        Ok(None)
    }

    /// Name of the command that the recording is taken to be of, where that is known.
    fn command_name(&self, recording: &Recording) -> Option<&str> {
        let _ = recording;
        None
    }

    /// Name of the model whose recordings it diagnoses, where that is known.
    fn model_name(&self) -> Option<&str> {
        None
    }
}

/// True where a report is made of these answers alone: answers that are kept depend on options that
/// are given.
fn reports_at_once(args: &DiagnoseArgs) -> bool {
    args.report.report.is_some() && args.resume.is_none() && args.shard.is_none()
}

/// The diagnosis that the options ask for.
pub(crate) fn diagnoser(args: &DiagnoseArgs, seed: RootSeed) -> Result<Box<dyn Diagnoser>> {
    let options = DiagnoseOptions {
        method: args.method,
        fidelity: args.fidelity,
        max_evaluations: args.max_evaluations.map(usize::from),
        noise_a: args.noise_a,
        max_delay_s: args.max_delay_s.unwrap_or(0.0),
        free_start: args.free_start,
        tolerance: args.tolerance,
        unit: None,
        identifiability: args.identifiability || reports_at_once(args),
        seed: seed.derive(Purpose::Diagnosis, 0),
    };
    let bundles = read_bundles(args.bundle.as_ref())?;
    let map = args.map.column_map()?;
    let read =
        |path: &PathBuf| Recording::read(path, &map).with_context(|| path.display().to_string());
    let references = args.reference.iter().map(read).collect::<Result<Vec<_>>>()?;
    let units = Units::of(args.unit.as_deref())?;
    let rates_hz = bundles.iter().map(|one| one.experiment.filter.output_hz).collect();
    let encoding = args.encoding;
    Ok(Box::new(BundleDiagnoser { bundles, options, encoding, references, units, rates_hz }))
}

/// Recordings to learn from, and what diagnoses them.
pub(crate) struct ToLearn {
    pub(crate) recordings: Vec<Recording>,
    pub(crate) diagnoser: fdi_core::Diagnoser,
}

/// Reads recordings to learn from, with the bundle that fits the first of them.
pub(crate) fn diagnoser_of_first(paths: &[PathBuf], reading: &ReadingArgs) -> Result<ToLearn> {
    let recordings = read_all(paths, reading)?;
    let mut bundles = read_bundles(reading.bundle.as_ref())?;
    let experiments: Vec<_> = bundles.iter().map(|one| &one.experiment).collect();
    let fitting = recordings.first().map_or(0, |first| fitting_experiment(&experiments, first));
    let diagnoser = fdi_core::Diagnoser::new(bundles.swap_remove(fitting).into_bundle()?)?;
    Ok(ToLearn { recordings, diagnoser })
}

/// Reads recordings, each with the actuator and the day that its name or itself states.
pub(crate) fn read_all(paths: &[PathBuf], reading: &ReadingArgs) -> Result<Vec<Recording>> {
    let map = reading.map.column_map()?;
    let mut recordings = Vec::new();
    for path in paths {
        let named = || path.display().to_string();
        for file in list_recordings(path).with_context(named)? {
            let read = read_named(&file, &map, &reading.names);
            recordings.push(read.with_context(|| file.display().to_string())?);
        }
    }
    Ok(recordings)
}

/// The bundle that a unit was learnt with, of a file or the embedded ones; `None` where none is.
///
/// # Errors
/// A bundle that was named, and is another.
pub(crate) fn diagnoser_of_unit(
    unit: &LearntUnit,
    bundle: Option<&PathBuf>,
) -> Result<Option<fdi_core::Diagnoser>> {
    let fitting = whole_bundles(bundle)?.into_iter().find(|one| unit.is_of(one));
    if let (Some(path), None) = (bundle, &fitting) {
        return Err(anyhow!("{}: the unit was learnt with another bundle", path.display()));
    }
    Ok(fitting.map(fdi_core::Diagnoser::new).transpose()?)
}

/// The diagnosis of a model's machines within their tolerances, in a test; `None` where no bundle at
/// hand has learnt them.
///
/// # Errors
/// A bundle that was named, and is of another model or test.
pub(crate) fn diagnoser_of_model(
    model: &Model,
    command: Option<&str>,
    recording: &Recording,
    bundle: Option<&PathBuf>,
) -> Result<Option<fdi_core::Diagnoser>> {
    let is_of = |bundle: &Bundle| {
        let Experiment { actuator, tolerance, temperature, effects, name, .. } = &bundle.experiment;
        let is_stated = model.tolerance.is_empty() || model.tolerance == *tolerance;
        let is_as_warm = model.temperature.is_none() || model.temperature == *temperature;
        let is_machine = *actuator == model.actuator && *effects == model.switched_on();
        let is_test = command.is_none_or(|command| command == name);
        is_machine && is_stated && is_as_warm && is_test && bundle.knows_units()
    };
    let mut bundles = whole_bundles(bundle)?;
    bundles.retain(is_of);
    if bundles.is_empty() {
        return match bundle {
            Some(path) => Err(anyhow!(
                "{}: of another model or test, or it has not learnt machines within tolerances",
                path.display()
            )),
            None => Ok(None),
        };
    }
    let experiments: Vec<_> = bundles.iter().map(|one| &one.experiment).collect();
    let fitting = fitting_experiment(&experiments, recording);
    Ok(Some(fdi_core::Diagnoser::new(bundles.swap_remove(fitting))?))
}

/// Settings that units are learnt with.
pub(crate) fn learning_options(seed: RootSeed) -> DiagnoseOptions {
    DiagnoseOptions {
        tolerance: ToleranceUse::Model,
        seed: seed.derive(Purpose::Diagnosis, 0),
        ..DiagnoseOptions::default()
    }
}

/// The bundle of a file, or the embedded ones.
fn read_bundles(path: Option<&PathBuf>) -> Result<Vec<Prepared>> {
    let Some(path) = path else {
        let read = |one| Prepared::embedded(one).context("the embedded bundle");
        return EMBEDDED_BUNDLES.iter().map(read).collect();
    };
    let named = path.display().to_string();
    let bytes = fs::read(path).with_context(|| named.clone())?;
    Ok(vec![Prepared::read(&bytes).context(named)?])
}

/// The bundle of a file, or the embedded ones, each read whole.
fn whole_bundles(path: Option<&PathBuf>) -> Result<Vec<Bundle>> {
    read_bundles(path)?.into_iter().map(Prepared::into_bundle).collect()
}

/// Where a bundle is.
enum Source {
    /// With the program: read whole when it is needed.
    Embedded(&'static EmbeddedBundle),
    /// Read from a file, whose faults are told at once.
    Read(Box<Bundle>),
}

/// A bundle that is prepared when the first recording needs it.
struct Prepared {
    sha256: String,
    experiment: Experiment,
    source: Source,
    ready: OnceLock<Result<Ready, String>>,
}

/// A bundle that is ready to diagnose, with the unit that references have shown.
struct Ready {
    diagnoser: fdi_core::Diagnoser,
    unit: Option<Arc<LearntUnit>>,
}

impl Prepared {
    fn embedded(embedded: &'static EmbeddedBundle) -> Result<Self> {
        let experiment = Bundle::experiment_from_bytes(embedded.bytes)?;
        Ok(Self::of(embedded.bytes, experiment, Source::Embedded(embedded)))
    }

    fn read(bytes: &[u8]) -> Result<Self> {
        let bundle = Bundle::from_bytes(bytes)?;
        Ok(Self::of(bytes, bundle.experiment.clone(), Source::Read(Box::new(bundle))))
    }

    fn of(bytes: &[u8], experiment: Experiment, source: Source) -> Self {
        let sha256 = recordings::sha256_hex(bytes);
        Self { sha256, experiment, source, ready: OnceLock::new() }
    }

    fn bundle(&self) -> Result<Bundle> {
        match &self.source {
            Source::Embedded(embedded) => {
                Bundle::from_bytes(embedded.bytes).context("the embedded bundle")
            }
            Source::Read(bundle) => Ok(Bundle::clone(bundle)),
        }
    }

    fn into_bundle(self) -> Result<Bundle> {
        match self.source {
            Source::Embedded(_) => self.bundle(),
            Source::Read(bundle) => Ok(*bundle),
        }
    }

    fn ready(
        &self,
        encoding: Encoding,
        references: &[Recording],
        options: &DiagnoseOptions,
    ) -> Result<&Ready> {
        let prepare = || {
            let bundle = || self.bundle().map_err(|error| format!("{error:#}"));
            let plain = fdi_core::Diagnoser::with_encoding(bundle()?, encoding)
                .map_err(|error| error.to_string())?;
            if references.is_empty() {
                return Ok(Ready { diagnoser: plain, unit: None });
            }
            let of_references = |error: &dyn Display| format!("the references: {error}");
            let learnt = (options.tolerance == ToleranceUse::Model)
                .then(|| plain.learn_unit(references, options));
            match learnt {
                Some(Ok(unit)) => Ok(Ready { diagnoser: plain, unit: Some(Arc::new(unit)) }),
                // where tolerances are not used, or do not explain it, levels are against the mean
                None | Some(Err(UnitLearningError::Unexplained { .. })) => {
                    fdi_core::Diagnoser::with_references(bundle()?, encoding, references)
                        .map(|diagnoser| Ready { diagnoser, unit: None })
                        .map_err(|error| of_references(&error))
                }
                Some(Err(error)) => Err(of_references(&error)),
            }
        };
        self.ready.get_or_init(prepare).as_ref().map_err(|error| anyhow!("{error}"))
    }
}

/// Diagnoses each recording with the bundle that fits it.
struct BundleDiagnoser {
    bundles: Vec<Prepared>,
    options: DiagnoseOptions,
    encoding: Encoding,
    references: Vec<Recording>,
    units: Units,
    rates_hz: Vec<f64>,
}

impl BundleDiagnoser {
    /// The bundle that a recording is diagnosed with.
    fn fitting(&self, recording: &Recording) -> &Prepared {
        let experiments: Vec<_> = self.bundles.iter().map(|one| &one.experiment).collect();
        &self.bundles[fitting_experiment(&experiments, recording)]
    }

    /// The diagnosis of a recording, with its settings: those of all, and its unit.
    fn prepared(&self, recording: &Recording) -> Result<(&fdi_core::Diagnoser, DiagnoseOptions)> {
        let prepared = self.fitting(recording);
        let ready = prepared.ready(self.encoding, &self.references, &self.options)?;
        let named = self.units.unit_of(recording, &prepared.experiment.name)?;
        let unit = named.or(ready.unit.as_ref()).cloned();
        Ok((&ready.diagnoser, DiagnoseOptions { unit, ..self.options.clone() }))
    }
}

impl Diagnoser for BundleDiagnoser {
    fn bundle_sha256(&self) -> &str {
        &self.bundles[0].sha256
    }

    fn bundles(&self) -> Vec<&str> {
        self.bundles.iter().map(|one| one.sha256.as_str()).collect()
    }

    fn rates_hz(&self) -> &[f64] {
        &self.rates_hz
    }

    fn diagnose(&self, recording: &Recording) -> Result<RecordDiagnosis> {
        let prepared = self.fitting(recording);
        let (diagnoser, options) = self.prepared(recording)?;
        let mut answer = diagnoser.diagnose(recording, &options)?;
        if prepared.sha256 != self.bundle_sha256() {
            answer.bundle = Some(prepared.sha256.clone());
        }
        Ok(answer)
    }

    fn diagnose_alone(&self, recording: &Recording) -> Result<DiagnosedAlone> {
        let prepared = self.fitting(recording);
        let (diagnoser, options) = self.prepared(recording)?;
        let mut alone = diagnoser.diagnose_alone(recording, &options)?;
        if prepared.sha256 != self.bundle_sha256() {
            alone.answer_mut().bundle = Some(prepared.sha256.clone());
        }
        Ok(alone)
    }

    fn signals(&self, recording: &Recording) -> Result<Option<FitSignals>> {
        let (diagnoser, options) = self.prepared(recording)?;
        let (_, signals) = diagnoser.diagnose_with_signals(recording, &options)?;
        Ok(Some(signals))
    }

    fn command_name(&self, recording: &Recording) -> Option<&str> {
        Some(&self.fitting(recording).experiment.name)
    }

    fn model_name(&self) -> Option<&str> {
        Some(&self.bundles[0].experiment.model_name)
    }
}
