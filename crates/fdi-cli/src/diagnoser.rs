//! The seam between the command line and the diagnosis.

use std::{
    fmt::Display,
    fs,
    path::PathBuf,
    ptr,
    sync::{Arc, OnceLock},
};

use anyhow::{Context, Result, anyhow};
use fdi_core::{
    Bundle, DiagnoseOptions, DiagnosedAlone, EMBEDDED_BUNDLES, EmbeddedBundle, Encoding,
    Experiment, FitSignals, LearntUnit, Purpose, Recording, RootSeed, ToleranceUse,
    UnitLearningError,
    ema_sim::model_file::Model,
    fitting_experiment, list_recordings,
    report::{ActionLevels, RecordDiagnosis},
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

    /// Machines and tests of the bundles at hand.
    fn known(&self) -> Vec<KnownTest> {
        Vec::new()
    }

    /// True where the owner of a machine states levels for decisions.
    fn states_levels(&self) -> bool {
        false
    }
}

/// A test of a machine, as a bundle has it.
#[derive(Clone, Debug)]
pub struct KnownTest {
    /// SHA-256 of the bundle, hexadecimal.
    pub bundle_sha256: String,
    /// Name of the test.
    pub name: String,
    /// Levels for decisions about the machine, with its play.
    pub levels: ActionLevels,
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
    let bundles = read_bundles(&args.bundle)?;
    let map = args.map.column_map()?;
    let read = |path: &PathBuf| {
        read_named(path, &map, &args.fleet.names).with_context(|| path.display().to_string())
    };
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
    let mut bundles = read_bundles(reading.bundle.as_slice())?;
    let fitting = recordings.first().map_or(0, |first| place_of_fitting(&bundles, first));
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

/// The bundles of files, or the embedded ones where none is named.
fn read_bundles(paths: &[PathBuf]) -> Result<Vec<Prepared>> {
    if paths.is_empty() {
        let read = |one| Prepared::embedded(one).context("the embedded bundle");
        return EMBEDDED_BUNDLES.iter().map(read).collect();
    }
    let read = |path: &PathBuf| {
        let named = || path.display().to_string();
        let bytes = fs::read(path).with_context(named)?;
        Prepared::read(bytes).with_context(named)
    };
    paths.iter().map(read).collect()
}

/// The bundle of a file, or the embedded ones, each read whole.
fn whole_bundles(path: Option<&PathBuf>) -> Result<Vec<Bundle>> {
    read_bundles(path.map_or(&[], std::slice::from_ref))?
        .into_iter()
        .map(Prepared::into_bundle)
        .collect()
}

/// Place of the bundle that a recording is diagnosed with.
fn place_of_fitting(bundles: &[Prepared], recording: &Recording) -> usize {
    let experiments: Vec<_> = bundles.iter().map(|one| &one.experiment).collect();
    fitting_experiment(&experiments, recording)
}

/// Where a bundle is.
enum Source {
    /// With the program: read whole when it is needed.
    Embedded(&'static EmbeddedBundle),
    /// Read from a file, whose faults are told at once.
    Read { bytes: Vec<u8>, bundle: Box<Bundle> },
}

/// A bundle that is prepared when the first recording needs it.
struct Prepared {
    sha256: OnceLock<String>,
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
        Ok(Self::of(experiment, Source::Embedded(embedded)))
    }

    fn read(bytes: Vec<u8>) -> Result<Self> {
        let bundle = Box::new(Bundle::from_bytes(&bytes)?);
        Ok(Self::of(bundle.experiment.clone(), Source::Read { bytes, bundle }))
    }

    fn of(experiment: Experiment, source: Source) -> Self {
        Self { sha256: OnceLock::new(), experiment, source, ready: OnceLock::new() }
    }

    fn sha256(&self) -> &str {
        let bytes = match &self.source {
            Source::Embedded(embedded) => embedded.bytes,
            Source::Read { bytes, .. } => bytes,
        };
        self.sha256.get_or_init(|| recordings::sha256_hex(bytes))
    }

    fn bundle(&self) -> Result<Bundle> {
        match &self.source {
            Source::Embedded(embedded) => {
                Bundle::from_bytes(embedded.bytes).context("the embedded bundle")
            }
            Source::Read { bundle, .. } => Ok(Bundle::clone(bundle)),
        }
    }

    fn into_bundle(self) -> Result<Bundle> {
        match self.source {
            Source::Embedded(_) => self.bundle(),
            Source::Read { bundle, .. } => Ok(*bundle),
        }
    }

    fn ready(
        &self,
        encoding: Encoding,
        references: impl Fn() -> Result<Vec<Recording>, String>,
        options: &DiagnoseOptions,
    ) -> Result<&Ready> {
        let prepare = || {
            let references = references()?;
            let bundle = || self.bundle().map_err(|error| format!("{error:#}"));
            let plain = fdi_core::Diagnoser::with_encoding(bundle()?, encoding)
                .map_err(|error| error.to_string())?;
            if references.is_empty() {
                return Ok(Ready { diagnoser: plain, unit: None });
            }
            let of_references = |error: &dyn Display| format!("the references: {error}");
            let learnt = (options.tolerance == ToleranceUse::Model)
                .then(|| plain.learn_unit(&references, options));
            match learnt {
                Some(Ok(unit)) => Ok(Ready { diagnoser: plain, unit: Some(Arc::new(unit)) }),
                // where tolerances are not used, or do not explain it, levels are against the mean
                None | Some(Err(UnitLearningError::Unexplained { .. })) => {
                    fdi_core::Diagnoser::with_references(bundle()?, encoding, &references)
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
        &self.bundles[place_of_fitting(&self.bundles, recording)]
    }

    /// The references that are of the test of a bundle.
    fn references_of(&self, bundle: &Prepared) -> Result<Vec<Recording>, String> {
        let is_of_test = |reference: &&Recording| ptr::eq(self.fitting(reference), bundle);
        let own: Vec<Recording> = self.references.iter().filter(is_of_test).cloned().collect();
        if own.is_empty() && !self.references.is_empty() {
            let test = &bundle.experiment.name;
            return Err(format!("the references: none is of the test `{test}` of this recording"));
        }
        Ok(own)
    }

    /// Refuses a recording of another actuator than that of the references.
    fn check_references(&self, recording: &Recording) -> Result<()> {
        let Some(found) = &recording.metadata.actuator_id else { return Ok(()) };
        let stated = self.references.iter().filter_map(|one| one.metadata.actuator_id.as_ref());
        match stated.into_iter().find(|id| *id != found) {
            Some(expected) => Err(anyhow!(
                "it is of actuator `{found}`, the references are of `{expected}`: give those of its own, \
                 or a folder of learnt units (`--unit`)"
            )),
            None => Ok(()),
        }
    }

    /// The diagnosis of a recording with a bundle, and its settings: those of all, and its unit.
    fn prepared<'a>(
        &self,
        bundle: &'a Prepared,
        recording: &Recording,
    ) -> Result<(&'a fdi_core::Diagnoser, DiagnoseOptions)> {
        self.check_references(recording)?;
        let references = || self.references_of(bundle);
        let ready = bundle.ready(self.encoding, references, &self.options)?;
        let named = self.units.unit_of(recording, &ready.diagnoser)?;
        let unit = named.or(ready.unit.as_ref()).cloned();
        Ok((&ready.diagnoser, DiagnoseOptions { unit, ..self.options.clone() }))
    }

    /// Hash of a bundle that answers with it are told beside; `None` for that of the head.
    fn other_sha256(&self, bundle: &Prepared) -> Option<String> {
        let is_of_head = ptr::eq(bundle, &raw const self.bundles[0]);
        (!is_of_head).then(|| bundle.sha256().to_owned())
    }
}

impl Diagnoser for BundleDiagnoser {
    fn bundle_sha256(&self) -> &str {
        self.bundles[0].sha256()
    }

    fn bundles(&self) -> Vec<&str> {
        self.bundles.iter().map(Prepared::sha256).collect()
    }

    fn rates_hz(&self) -> &[f64] {
        &self.rates_hz
    }

    fn diagnose(&self, recording: &Recording) -> Result<RecordDiagnosis> {
        let bundle = self.fitting(recording);
        let (diagnoser, options) = self.prepared(bundle, recording)?;
        let mut answer = diagnoser.diagnose(recording, &options)?;
        answer.bundle = self.other_sha256(bundle);
        Ok(answer)
    }

    fn diagnose_alone(&self, recording: &Recording) -> Result<DiagnosedAlone> {
        let bundle = self.fitting(recording);
        let (diagnoser, options) = self.prepared(bundle, recording)?;
        let mut alone = diagnoser.diagnose_alone(recording, &options)?;
        alone.answer_mut().bundle = self.other_sha256(bundle);
        Ok(alone)
    }

    fn signals(&self, recording: &Recording) -> Result<Option<FitSignals>> {
        let (diagnoser, options) = self.prepared(self.fitting(recording), recording)?;
        let (_, signals) = diagnoser.diagnose_with_signals(recording, &options)?;
        Ok(Some(signals))
    }

    fn command_name(&self, recording: &Recording) -> Option<&str> {
        Some(&self.fitting(recording).experiment.name)
    }

    fn model_name(&self) -> Option<&str> {
        Some(&self.bundles[0].experiment.model_name)
    }

    fn known(&self) -> Vec<KnownTest> {
        let known = |one: &Prepared| KnownTest {
            bundle_sha256: one.sha256().to_owned(),
            name: one.experiment.name.clone(),
            levels: one.experiment.action_levels(),
        };
        self.bundles.iter().map(known).collect()
    }

    fn states_levels(&self) -> bool {
        let states = |one: &Prepared| one.experiment.stated_levels.iter().any(Option::is_some);
        self.bundles.iter().any(states)
    }
}
