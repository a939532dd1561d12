//! `fdi setup`.

use std::{fmt::Write as _, fs, path::Path};

use anyhow::{Context, Result, bail};
use fdi_core::{
    Bundle, ChannelName, Dataset, DatasetRequest, Diagnoser, Experiment, MappedColumn, Recording,
    ReferenceDesign, Setup, SetupError, SetupOptions, check_test, default_noise_a,
    ema_sim::Imperfections,
    read_model,
    report::{SCHEMA_VERSION, SetupChoice, SetupSummary},
};
use fdi_report::Page;

use crate::{
    ExitStatus, GlobalArgs, OutputFormat, Streams,
    args::SetupArgs,
    diagnoser::{diagnoser_of_model, learning_options, read_all},
    experiment,
    output::TOOL,
    progress::Steps,
    report_file,
};

/// Files of a folder that was set up.
const BUNDLE: &str = "bundle.fdi-bundle";
const UNIT: &str = "unit.fdi-unit";
const SETTINGS: &str = "fdi.toml";
const REPORT: &str = "setup.html";
const SUMMARY: &str = "setup.json";
/// Times of the parts of a setup, s, with three recordings of `ema-270` in the chirp: the reference
/// signals and the bundle, the unit, and one pair of simulated tests. Only their ratios count.
const REFERENCES_S: f64 = 1.3;
const BUNDLE_S: f64 = 24.5;
const UNIT_S: f64 = 0.24;
const PAIR_S: f64 = 0.113;
/// Conditions of each design of a bundle that is built.
const CONDITIONS: usize = 100;

/// Sets a machine up and writes its folder.
pub(crate) fn setup(
    args: &SetupArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let Some(folder) = global.output.as_deref() else {
        bail!("`--output FOLDER` says where unit, bundle, settings and report go");
    };
    if !matches!(global.output_format, OutputFormat::Human | OutputFormat::Json) {
        bail!("a setup has no such form: `--output-format human|json`");
    }
    let steps = Steps::new(streams, global.quiet);
    let recordings = read_all(&args.recordings, &args.reading)?;
    let prepared = prepared(args, global, &recordings, &steps);
    let (prepared, found) = match prepared {
        Ok(prepared) => {
            let options = SetupOptions {
                diagnosis: learning_options(global.root_seed()),
                levels: args.levels.over(prepared.diagnoser.bundle().experiment.action_levels())?,
                tests: args.tests.get(),
                jobs: global.threads(),
            };
            let before = if prepared.built.is_some() { built_share(args) } else { 0.0 };
            let tell = |what: &str, done: f64| steps.tell(what, before + (1.0 - before) * done);
            let found = prepared.diagnoser.set_up(&recordings, &options, &tell);
            (Some(prepared), found)
        }
        Err(NotPrepared::Refused(refused)) => (None, Err(refused)),
        Err(NotPrepared::Failed(error)) => return Err(error),
    };
    let mut summary = summary(args, global, &recordings, prepared.as_ref());
    fs::create_dir_all(folder).with_context(|| format!("`{}` cannot be made", folder.display()))?;
    match found {
        Ok(found) => {
            add_found(&mut summary, &found);
            if summary.accepted
                && let Some(prepared) = &prepared
            {
                write_folder(folder, args, prepared, &found)?;
            }
        }
        Err(SetupError::Refused(refused)) => summary.refused = Some(refused),
        Err(other) => return Err(other.into()),
    }
    let json = serde_json::to_string_pretty(&summary)? + "\n";
    report_file::put(&folder.join(SUMMARY), &json)?;
    report_file::put(&folder.join(REPORT), &Page::of_setup(&summary).html())?;
    let text = match global.output_format {
        OutputFormat::Json => json,
        _ => in_words(&summary, folder),
    };
    streams.product(None, |out| out.write_all(text.as_bytes()))?;
    Ok(if summary.accepted { ExitStatus::Done } else { ExitStatus::Failed })
}

/// The diagnosis that a machine is set up with.
struct Prepared {
    diagnoser: Diagnoser,
    /// Bytes of a bundle that was built.
    built: Option<Vec<u8>>,
    choices: Vec<SetupChoice>,
}

/// Why there is no diagnosis to set a machine up with.
enum NotPrepared {
    Refused(SetupError),
    Failed(anyhow::Error),
}

impl<E: Into<anyhow::Error>> From<E> for NotPrepared {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

/// The bundle that is named, the embedded one of this machine in this test, or one that is built.
fn prepared(
    args: &SetupArgs,
    global: &GlobalArgs,
    recordings: &[Recording],
    steps: &Steps<'_, '_>,
) -> Result<Prepared, NotPrepared> {
    let mut choices = Vec::new();
    let mut chosen = |what: &str, choice: &str, reason: &str, pin: &str| {
        let text = str::to_owned;
        choices.push(SetupChoice {
            what: text(what),
            choice: text(choice),
            reason: text(reason),
            pin: Some(text(pin)),
        });
    };
    if let Some(path) = &args.reading.bundle {
        let named = path.display().to_string();
        let bytes = fs::read(path).with_context(|| named.clone())?;
        let bundle = Bundle::from_bytes(&bytes).with_context(|| named.clone())?;
        if !bundle.knows_units() {
            return Err(anyhow::anyhow!(
                "{named}: has not learnt machines within tolerances: build it of a model file with \
                 `[tolerance]`, or leave `--bundle` out"
            )
            .into());
        }
        let pin = format!("--bundle {named}");
        chosen("bundle", &named, "the option names it", &pin);
        let diagnoser = Diagnoser::new(bundle)?;
        return Ok(Prepared { diagnoser, built: Some(bytes), choices });
    }
    let mut model = read_model(&args.test.model)?;
    let test = &args.test;
    if let Some(first) = recordings.first()
        && test.load_n_m.is_none()
        && let Some(diagnoser) = diagnoser_of_model(&model, Some(&test.command), first, None)?
    {
        let reason = "it is of this model file and test";
        chosen("bundle", "the embedded one", reason, "--bundle FILE");
        return Ok(Prepared { diagnoser, built: None, choices });
    }
    if experiment::take_usual_tolerances(&mut model) {
        let reason = "the model file has no `[tolerance]`: those that are usual for such actuators \
                      (`docs/models/tolerances.md`); write your own into the file if you know better";
        chosen("tolerances", "the usual ones", reason, "[tolerance] in the model file");
    }
    let mut experiment = experiment::experiment_of(&model, test)?;
    let designs = designs(&mut experiment, recordings);
    if let Err(error) = check_test(&experiment) {
        return Err(NotPrepared::Refused(error));
    }
    steps.tell("simulate the machine's reference signals", 0.0);
    let datasets = designs.iter().map(|&design| {
        let request = DatasetRequest {
            design,
            conditions: CONDITIONS,
            seed: global.seed,
            imperfections: Imperfections::REAL,
            jobs: global.threads(),
        };
        Dataset::generate(&experiment, &request)
    });
    let datasets = datasets.collect::<Result<Vec<_>, _>>()?;
    let noise_a = default_noise_a(&experiment.actuator);
    let (root, whole) = (global.root_seed(), built_share(args));
    let simulated = whole * REFERENCES_S / (REFERENCES_S + BUNDLE_S);
    let tell = |what: &str, done: f64| steps.tell(what, simulated + (whole - simulated) * done);
    let bundle = Bundle::build_told(&experiment, datasets, noise_a, root, &tell)?;
    let names: Vec<_> = designs.iter().map(|design| design.name()).collect();
    let choice = format!("built of {CONDITIONS} conditions each of {}", names.join(", "));
    chosen("bundle", &choice, "none at hand is of this model file and test", "--bundle FILE");
    let built = Some(bundle.to_bytes());
    Ok(Prepared { diagnoser: Diagnoser::new(bundle)?, built, choices })
}

/// Share of the time of a setup that is over once its bundle is built.
fn built_share(args: &SetupArgs) -> f64 {
    let built_s = REFERENCES_S + BUNDLE_S;
    built_s / (built_s + UNIT_S + PAIR_S * args.tests.get() as f64)
}

/// Designs of the bundle: with the rotor starting anywhere where the recordings do not start alike. Where
/// they do, the test starts there.
fn designs(experiment: &mut Experiment, recordings: &[Recording]) -> Vec<ReferenceDesign> {
    use ReferenceDesign::{Incipient, Sparse, Turned, TurnedSparse};

    let start = |recording: &Recording| {
        let recorded = recording.channel(ChannelName::MotorAngle);
        let first = recorded.and_then(|channel| channel.values().first().copied());
        first.or(recording.metadata.start_angle_rad)
    };
    let starts: Vec<f64> = recordings.iter().filter_map(start).collect();
    let Some(&first) = starts.first() else { return vec![Incipient, Sparse] };
    if !starts.iter().all(|&other| experiment.is_same_start(other, first)) {
        experiment.scenario.start_angle_rad = 0.0;
        return vec![Incipient, Sparse, Turned, TurnedSparse];
    }
    experiment.scenario.start_angle_rad = first;
    vec![Incipient, Sparse]
}

fn summary(
    args: &SetupArgs,
    global: &GlobalArgs,
    recordings: &[Recording],
    prepared: Option<&Prepared>,
) -> SetupSummary {
    let experiment = prepared.map(|prepared| &prepared.diagnoser.bundle().experiment);
    let of_args = |text: &str| text.to_owned();
    SetupSummary {
        schema_version: SCHEMA_VERSION,
        tool: TOOL.to_owned(),
        seed: global.seed,
        model: experiment.map_or(of_args(&args.test.model), |one| one.model_name.clone()),
        command: experiment.map_or(of_args(&args.test.command), |one| one.name.clone()),
        recordings: recordings.iter().map(|one| one.name.clone()).collect(),
        accepted: false,
        refused: None,
        choices: prepared.map(|prepared| prepared.choices.clone()).unwrap_or_default(),
        warnings: Vec::new(),
        acceptance: None,
    }
}

/// Writes unit, bundle and settings.
fn write_folder(folder: &Path, args: &SetupArgs, prepared: &Prepared, found: &Setup) -> Result<()> {
    let put = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        fs::write(&path, bytes).with_context(|| format!("`{}` cannot be written", path.display()))
    };
    if let Some(bytes) = &prepared.built {
        put(BUNDLE, bytes)?;
    }
    put(UNIT, &found.unit.to_bytes())?;
    let settings = settings(args, prepared.built.is_some(), &found.wiring);
    put(SETTINGS, settings.as_bytes())
}

/// Settings with which later recordings are read as these were.
fn settings(args: &SetupArgs, has_bundle: bool, wiring: &[MappedColumn]) -> String {
    let mut text = String::from(
        "# Written by `fdi setup`: how recordings of this machine are read and diagnosed.\n\
         # Paths count from the folder of this file.\n\n[diagnose]\n",
    );
    let mut line = |key: &str, value: toml::Value| {
        writeln!(text, "{key} = {value}").expect("a String takes all text");
    };
    if has_bundle {
        line("bundle", BUNDLE.into());
    }
    line("unit", UNIT.into());
    let reading = &args.reading;
    let maps = rewired(&reading.map.map, wiring);
    if !maps.is_empty() {
        line("map", maps.into());
    }
    if reading.map.is_bridged() {
        line("gaps", reading.map.gaps.word().into());
    }
    if reading.map.skip_lines > 0 {
        line("skip-lines", (reading.map.skip_lines as i64).into());
    }
    let [watch, act] = args.levels.words();
    for (key, levels) in [("watch", watch), ("act", act)] {
        if !levels.is_empty() {
            line(key, levels.into());
        }
    }
    for (key, pattern) in
        [("id-from", &reading.names.id_from), ("date-from", &reading.names.date_from)]
    {
        if let Some(pattern) = pattern {
            line(key, pattern.to_string().into());
        }
    }
    text
}

/// Maps that were given, of phases with another wiring each from the column of the other phase.
fn rewired(given: &[String], wiring: &[MappedColumn]) -> Vec<String> {
    let split = |map: &String| {
        let (name, column) = map.split_once('=')?;
        Some((name.trim().to_owned(), column.trim().to_owned()))
    };
    let named: Vec<(String, String)> = given.iter().filter_map(split).collect();
    let column_of = |name: &str| {
        let own = named.iter().find(|(channel, _)| channel == name);
        own.map_or_else(|| name.to_owned(), |(_, column)| column.clone())
    };
    let wiring = || wiring.iter().filter(|one| !one.is_as_stated());
    let is_rewired = |name: &str| wiring().any(|one| one.phase.column() == name);
    let others = given.iter().filter(|map| split(map).is_none_or(|(name, _)| !is_rewired(&name)));
    let phases = wiring().map(|one| {
        let column = column_of(one.column.column());
        let sign = if one.factor < 0.0 { "-" } else { "" };
        match column.rsplit_once('*') {
            Some((column, factor)) => format!("{}={column}*{sign}{factor}", one.phase),
            None if sign.is_empty() => format!("{}={column}", one.phase),
            None => format!("{}={column}*-1", one.phase),
        }
    });
    others.cloned().chain(phases).collect()
}

/// Adds what was found to a summary.
fn add_found(summary: &mut SetupSummary, found: &Setup) {
    summary.accepted = found.refusal.is_none();
    summary.refused.clone_from(&found.refusal);
    summary.choices.extend(found.choices.iter().cloned());
    summary.warnings = found.disagreements.iter().map(super::unit::warning).collect();
    summary.acceptance = Some(found.acceptance.clone());
}

/// The summary in words.
fn in_words(summary: &SetupSummary, folder: &Path) -> String {
    let mut text = String::new();
    let mut line = |line: String| {
        text.push_str(&line);
        text.push('\n');
    };
    line(format!(
        "{} in `{}`, {} recordings as new",
        summary.model,
        summary.command,
        summary.recordings.len()
    ));
    for SetupChoice { what, choice, reason, pin } in &summary.choices {
        let pin = pin.as_ref().filter(|pin| *pin != choice);
        let pin = pin.map(|pin| format!("; to pin: {pin}")).unwrap_or_default();
        line(format!("  {what}: {choice} ({reason}{pin})"));
    }
    for warning in &summary.warnings {
        line(format!("warning: {warning}"));
    }
    if let Some(tests) = &summary.acceptance {
        line(format!(
            "\nsimulated tests of this machine, {:.4} A of noise on each phase sample:",
            tests.noise_a
        ));
        line(format!(
            "  without damage: {} of {} healthy, {} called faulty; {} of {} intervals hold the truth",
            tests.healthy, tests.sound, tests.false_alarms, tests.held, tests.intervals
        ));
        for fault in &tests.faults {
            let std = fault.std.map_or("not determined".to_owned(), |std| format!("±{std:.4}"));
            line(format!(
                "  {} {}: {} of {} found at {:.3}, standard deviation {std}",
                fault.id,
                fault.id.name(),
                fault.found,
                fault.tests,
                fault.level
            ));
        }
    }
    let folder = folder.display();
    match &summary.refused {
        None => line(format!(
            "\naccepted; report: {folder}/{REPORT}\nnext: fdi diagnose --decide {folder}/LATER.csv"
        )),
        Some(refused) => {
            let of = refused.recording.as_ref().map(|name| format!("{name}: ")).unwrap_or_default();
            let code = refused.code.word();
            line(format!("\nnot set up ({code}): {of}{}", refused.reason));
        }
    }
    text
}
