//! The reference datasets, the embedded bundles and the committed recordings.

use std::{
    fmt::Write as _,
    fs,
    io::Read,
    path::{Path, PathBuf},
    thread,
};

use anyhow::{Context, Result, bail};
use fdi_core::{
    Bundle, CsvFormat, Dataset, DatasetRequest, Experiment, Purpose, RecordedContent,
    ReferenceDesign, RootSeed, SimulatedRecording, dataset_to_bytes, default_noise_a,
    ema_sim::{Converter, HealthState, Imperfections, PhaseSensors, presets},
};
use flate2::read::GzDecoder;
use serde::{Deserialize, Serialize};

/// Root seed of everything made here.
const SEED: u64 = 20_231;
/// Noise on each phase sample of the committed recordings, A.
const FIXTURE_NOISE_A: f64 = 0.020;

/// The designs of an experiment's bundle, with their sizes.
fn designs(experiment: &Experiment) -> &'static [(ReferenceDesign, usize)] {
    match experiment.name.as_str() {
        "sine" => &[(ReferenceDesign::Incipient, 100), (ReferenceDesign::Sparse, 50)],
        // six times as long as the chirp, and the wheel for Python may have 15 MB
        "planned" => &[(ReferenceDesign::Incipient, 50), (ReferenceDesign::Turned, 50)],
        _ => &[
            (ReferenceDesign::Incipient, 100),
            (ReferenceDesign::Sparse, 100),
            (ReferenceDesign::Turned, 300),
            (ReferenceDesign::TurnedSparse, 150),
            (ReferenceDesign::Wide, 100),
        ],
    }
}

/// Electronics that datasets of an experiment are made with; its bundle is made of the real ones.
fn electronics(experiment: &Experiment) -> &'static [Imperfections] {
    match experiment.name.as_str() {
        "planned" => &[Imperfections::REAL],
        _ => &[Imperfections::REAL, Imperfections::NONE],
    }
}

/// Products with their hashes: committed, and compared by `--check`.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct Manifest {
    seed: u64,
    dataset: Vec<DatasetEntry>,
    bundle: Vec<BundleEntry>,
    recording: Vec<RecordingEntry>,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct DatasetEntry {
    command: String,
    model: String,
    design: String,
    controller_noise: bool,
    digitisation: bool,
    conditions: usize,
    sha256: String,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct BundleEntry {
    command: String,
    bytes: usize,
    sha256: String,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct RecordingEntry {
    name: String,
    sha256: String,
}

/// A file that belongs in the repository or beside it.
struct Product {
    path: PathBuf,
    bytes: Vec<u8>,
}

/// Makes everything anew, or with `check` compares it with what is committed.
pub(crate) fn run(root: &Path, check: bool) -> Result<()> {
    let (manifest, products, scratch) = make(root)?;
    let manifest_path = root.join("fixtures/datasets/manifest.toml");
    if check {
        let text = fs::read_to_string(&manifest_path).with_context(|| {
            format!("{}: run `cargo xtask gen-dataset`", manifest_path.display())
        })?;
        let stored: Manifest = toml::from_str(&text)?;
        compare(&stored, &manifest)?;
        for product in &products {
            let found =
                fs::read(&product.path).with_context(|| product.path.display().to_string())?;
            if product.path.extension().is_some_and(|extension| extension == BUNDLE_EXTENSION) {
                same_bundle(&found, &product.bytes)
                    .with_context(|| product.path.display().to_string())?;
                let sha256 = recordings::sha256_hex(&found);
                if !stored.bundle.iter().any(|entry| entry.sha256 == sha256) {
                    bail!("{}: not the file of the manifest", product.path.display());
                }
                continue;
            }
            if content(&product.path, &found)? != content(&product.path, &product.bytes)? {
                bail!("{}: differs from what is made now", product.path.display());
            }
        }
        return Ok(());
    }
    for product in products.iter().chain(&scratch) {
        if let Some(folder) = product.path.parent() {
            fs::create_dir_all(folder)?;
        }
        fs::write(&product.path, &product.bytes)
            .with_context(|| product.path.display().to_string())?;
    }
    fs::create_dir_all(root.join("fixtures/datasets"))?;
    fs::write(manifest_path, toml::to_string_pretty(&manifest)?)?;
    Ok(())
}

/// Ending of a bundle's file.
const BUNDLE_EXTENSION: &str = "fdi-bundle";

/// Content of a file, without its compression: the same content has other bytes with another
/// compressor.
fn content(path: &Path, bytes: &[u8]) -> Result<Vec<u8>> {
    if path.extension().is_none_or(|extension| extension != "gz") {
        return Ok(bytes.to_vec());
    }
    let mut content = Vec::new();
    GzDecoder::new(bytes).read_to_end(&mut content).with_context(|| path.display().to_string())?;
    Ok(content)
}

/// Compares a bundle with the one made now.
///
/// The signals and what is chosen on them must be equal. The mask comes out of a singular value
/// decomposition, whose last bits may differ between processors, through a map that amplifies
/// them: its points are compared in number only.
fn same_bundle(found: &[u8], made: &[u8]) -> Result<()> {
    let (found, made) = (Bundle::from_bytes(found)?, Bundle::from_bytes(made)?);
    let equal = found.experiment == made.experiment
        && found.datasets == made.datasets
        && found.dataset_sha256 == made.dataset_sha256
        && found.choices == made.choices
        && found.noise_a == made.noise_a
        && found.mask.len() == made.mask.len();
    if !equal {
        bail!("differs from the bundle that is made now");
    }
    Ok(())
}

/// Names the first entry that differs.
fn compare(stored: &Manifest, made: &Manifest) -> Result<()> {
    for (was, is) in stored.dataset.iter().zip(&made.dataset) {
        if was != is {
            bail!("dataset `{}` of `{}` differs: {was:?} is now {is:?}", is.design, is.command);
        }
    }
    for (was, is) in stored.recording.iter().zip(&made.recording) {
        if was != is {
            bail!("recording `{}` differs: {was:?} is now {is:?}", is.name);
        }
    }
    let counts = |manifest: &Manifest| {
        (manifest.seed, manifest.dataset.len(), manifest.bundle.len(), manifest.recording.len())
    };
    if counts(stored) != counts(made) {
        bail!("the manifest has other entries or another seed than what is made now");
    }
    Ok(())
}

/// Everything in memory: the manifest, what is committed, and the dataset files beside.
fn make(root: &Path) -> Result<(Manifest, Vec<Product>, Vec<Product>)> {
    let jobs = thread::available_parallelism().map_or(1, usize::from);
    let mut manifest =
        Manifest { seed: SEED, dataset: Vec::new(), bundle: Vec::new(), recording: Vec::new() };
    let (mut products, mut scratch) = (Vec::new(), Vec::new());
    let tolerance = presets::ema_48_tolerance();
    let temperature = Some(presets::ema_48_temperature());
    let within = |test| Experiment { tolerance: tolerance.clone(), temperature, ..test };
    let tests = [within(Experiment::chirp()), Experiment::sine(), within(Experiment::planned())];
    for experiment in tests {
        let mut of_bundle = Vec::new();
        for &imperfections in electronics(&experiment) {
            for &(design, conditions) in designs(&experiment) {
                let request =
                    DatasetRequest { design, conditions, seed: SEED, imperfections, jobs };
                let dataset = Dataset::generate(&experiment, &request)?;
                manifest.dataset.push(entry(&experiment, &dataset));
                let kind = if imperfections == Imperfections::REAL { "real" } else { "ideal" };
                let file = format!("{}-{}-{kind}.fdi-dataset", experiment.name, design.name());
                scratch.push(Product {
                    path: root.join("target/datasets").join(file),
                    bytes: dataset_to_bytes(&experiment, std::slice::from_ref(&dataset)),
                });
                if imperfections == Imperfections::REAL {
                    of_bundle.push(dataset);
                }
            }
        }
        let bytes = Bundle::build(
            &experiment,
            of_bundle,
            default_noise_a(&experiment.actuator),
            RootSeed(SEED),
        )?
        .to_bytes();
        manifest.bundle.push(BundleEntry {
            command: experiment.name.clone(),
            bytes: bytes.len(),
            sha256: recordings::sha256_hex(&bytes),
        });
        let file = format!("{}.fdi-bundle", experiment.name);
        products.push(Product { path: root.join("crates/fdi-core/bundles").join(file), bytes });
    }
    for product in recordings(&root.join("fixtures/recordings"))? {
        let name = product.path.file_name().map(|name| name.to_string_lossy().into_owned());
        manifest.recording.push(RecordingEntry {
            name: name.unwrap_or_default(),
            sha256: recordings::sha256_hex(&content(&product.path, &product.bytes)?),
        });
        products.push(product);
    }
    Ok((manifest, products, scratch))
}

fn entry(experiment: &Experiment, dataset: &Dataset) -> DatasetEntry {
    DatasetEntry {
        command: experiment.name.clone(),
        model: experiment.model_name.clone(),
        design: dataset.design.name().to_owned(),
        controller_noise: dataset.imperfections.controller_noise,
        digitisation: dataset.imperfections.digitisation,
        conditions: dataset.conditions.len(),
        sha256: dataset.sha256(),
    }
}

/// A committed recording: its damage, start angle and content.
struct Fixture {
    experiment: Experiment,
    levels: [f64; 7],
    start_angle_rad: f64,
    content: RecordedContent,
}

/// The committed recordings, in order. Levels come from the seed; what is fixed is which faults
/// are there.
fn fixtures() -> Vec<Fixture> {
    let root = RootSeed(SEED);
    let mut drawn = 0;
    let mut unit = || {
        drawn += 1;
        (root.derive(Purpose::Fixture, drawn) >> 11) as f64 / (1u64 << 53) as f64
    };
    let chirp = |levels: [f64; 7]| Fixture {
        experiment: Experiment::chirp(),
        levels,
        start_angle_rad: 0.0,
        content: RecordedContent::Phases,
    };
    let healthy = HealthState::HEALTHY.levels();
    let mut all: Vec<Fixture> = (0..3).map(|_| chirp(healthy)).collect();
    // each fault alone, three of them between 0.010 and 0.015
    for fault in 0..6 {
        let mut levels = healthy;
        let slight = fault % 2 == 0;
        levels[fault] = if slight { 0.010 + 0.005 * unit() } else { 0.015 + 0.035 * unit() };
        levels[6] = unit();
        all.push(chirp(levels));
    }
    // combinations of incipient faults
    for _ in 0..10 {
        let mut levels = healthy;
        for level in &mut levels[..6] {
            let present = unit() < 0.6;
            let value = 0.010 + 0.040 * unit();
            *level = if present { value } else { 0.0 };
        }
        levels[6] = unit();
        all.push(chirp(levels));
    }
    // one severe fault among slight ones
    let mut severe = healthy;
    (severe[0], severe[3], severe[6]) = (0.010 + 0.010 * unit(), 0.3 + 0.2 * unit(), unit());
    all.push(chirp(severe));
    // two with the rotor turned at the start
    for _ in 0..2 {
        let mut levels = healthy;
        (levels[0], levels[3], levels[5], levels[6]) =
            (0.010 + 0.040 * unit(), 0.010 + 0.040 * unit(), 0.010 + 0.040 * unit(), unit());
        let start_angle_rad = core::f64::consts::TAU * unit();
        all.push(Fixture { start_angle_rad, ..chirp(levels) });
    }
    // two of which only the envelope was kept
    for _ in 0..2 {
        let mut levels = healthy;
        (levels[1], levels[2], levels[4]) =
            (0.010 + 0.040 * unit(), 0.010 + 0.040 * unit(), 0.010 + 0.040 * unit());
        all.push(Fixture { content: RecordedContent::Envelope, ..chirp(levels) });
    }
    // two of the sine test
    for _ in 0..2 {
        let mut levels = healthy;
        (levels[0], levels[1]) = (0.010 + 0.040 * unit(), 0.010 + 0.040 * unit());
        all.push(Fixture {
            experiment: Experiment::sine(),
            content: RecordedContent::Envelope,
            ..chirp(levels)
        });
    }
    all
}

/// The files of the committed recordings and of their truth.
fn recordings(folder: &Path) -> Result<Vec<Product>> {
    let root = RootSeed(SEED);
    let format = CsvFormat::default();
    let mut truth = "recording,k1,k2,k3,k4,k5,k6,k7,start_angle_rad\n".to_owned();
    let mut products = Vec::new();
    for (index, fixture) in fixtures().into_iter().enumerate() {
        let name = format!("r{:02}.csv.gz", index + 1);
        let stream = index as u64 + (1 << 40);
        let recording = SimulatedRecording {
            faults: HealthState::new(fixture.levels)?.coordinates(),
            start_angle_rad: fixture.start_angle_rad,
            imperfections: Imperfections::REAL,
            controller_seed: root.derive(Purpose::ControllerNoise, stream),
            sensors: PhaseSensors { noise_a: FIXTURE_NOISE_A, converter: Some(Converter::DEFAULT) },
            phase_rate_hz: None,
            sensor_seed: root.derive(Purpose::SensorNoise, stream),
            content: fixture.content,
            has_voltage: false,
        }
        .record(&fixture.experiment, &name)?;
        write!(truth, "{name}")?;
        for level in fixture.levels {
            write!(truth, ",{level:.6}")?;
        }
        writeln!(truth, ",{:.6}", fixture.start_angle_rad)?;
        products.push(Product { path: folder.join(&name), bytes: recording.to_csv_gz(format)? });
    }
    products.push(Product { path: folder.join("truth.csv"), bytes: truth.into_bytes() });
    Ok(products)
}
