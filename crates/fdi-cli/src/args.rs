//! The command line.

mod effects;
mod evaluate;
mod experiment;
mod explain;
mod published;
mod report;
mod setup;
mod unit;

use std::{num::NonZeroUsize, path::PathBuf, str::FromStr, thread};

use clap::{ArgAction, Args, Parser, Subcommand, ValueEnum};
use fdi_core::{
    ColumnMap, ColumnMapError, Encoding, FileFormat, Gaps, RootSeed, Schema,
    ema_sim::PhaseSensors,
    report::{ActionLevels, FaultId, Fidelity, Method, ToleranceUse},
};

use crate::{setting::ResolvedSetting, shell::quoted};
use published::published;

pub use effects::EffectsArgs;
pub use evaluate::{EvaluateArgs, ProtocolArg, Switch};
pub use experiment::{DatasetArgs, DesignArg, TestArgs};
pub(crate) use explain::DEFAULT_BEFORE;
pub use explain::{CalibrateArgs, ExplainArgs, PlanArgs, ProposeArgs, RecordArgs};
pub use report::{FleetArgs, NameArgs, ReportArgs};
pub use setup::SetupArgs;
pub use unit::{
    LearnArgs, ReadingArgs, ReplacedArg, ResetArgs, ShowUnitArgs, UnitCommand, UpdateArgs,
};

/// Diagnose electromechanical actuators from recordings of their stator current.
///
/// Data goes to standard output, everything else to standard error. Exit status: 0
/// the work was done, and with `--exit-code` everything is healthy; 2 it could not be
/// done, or some recordings of a batch could not be. With `--exit-code` alone: 1 a fault
/// or a model error was found; 3 none was, and on some recordings there is no conclusion.
#[derive(Debug, Parser)]
#[command(name = "fdi", version, propagate_version = true, max_term_width = 100)]
pub struct Cli {
    /// Command to carry out.
    #[command(subcommand)]
    pub command: Command,
    /// Options with one meaning in every command.
    #[command(flatten)]
    pub global: GlobalArgs,
}

/// Options that mean the same in every command.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Everywhere")]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of the command line")]
pub struct GlobalArgs {
    /// Write the product (result, recording, dataset, bundle) to this file instead of standard output
    #[arg(long, short, global = true, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Form of the result
    #[arg(
        long,
        global = true,
        value_enum,
        default_value_t,
        env = "FDI_OUTPUT_FORMAT",
        hide_env_values = true
    )]
    pub output_format: OutputFormat,
    /// Seed of everything random; the same seed gives the same answer
    #[arg(
        long,
        global = true,
        default_value_t = 0,
        value_name = "N",
        env = "FDI_SEED",
        hide_env_values = true
    )]
    pub seed: u64,
    /// Recordings or simulations worked on at the same time [default: one for each processor]
    #[arg(
        long,
        global = true,
        value_name = "N",
        value_parser = at_least_one,
        env = "FDI_JOBS",
        hide_env_values = true
    )]
    pub jobs: Option<NonZeroUsize>,
    /// Leave out what differs from run to run (timings)
    #[arg(long, global = true)]
    pub stable: bool,
    /// Write the date and time into the JSON document
    #[arg(long, global = true, conflicts_with = "stable")]
    pub stamp: bool,
    /// When to colour
    #[arg(long, global = true, value_enum, default_value_t, value_name = "WHEN")]
    pub color: Color,
    /// Settings of this file in place of those of `fdi.toml` in this folder
    #[arg(long, global = true, value_name = "FILE", env = "FDI_CONFIG", hide_env_values = true)]
    pub config: Option<PathBuf>,
    /// Say only what went wrong
    #[arg(long, short, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say what is being done
    #[arg(long, short, global = true, action = ArgAction::SetTrue)]
    pub verbose: bool,
    /// Settings of this run with their origins
    #[arg(skip)]
    pub settings: Vec<ResolvedSetting>,
    /// True where the file of settings was found beside the recordings
    #[arg(skip)]
    pub is_config_found: bool,
}

impl GlobalArgs {
    /// Threads asked for; without a wish one for each processor.
    pub(crate) fn threads(&self) -> usize {
        self.jobs.map_or_else(
            || thread::available_parallelism().map_or(1, NonZeroUsize::get),
            NonZeroUsize::get,
        )
    }

    pub(crate) fn root_seed(&self) -> RootSeed {
        RootSeed(self.seed)
    }
}

/// Form of a result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum OutputFormat {
    /// A table and sentences for people.
    #[default]
    Human,
    /// One JSON document.
    Json,
    /// One JSON object a line.
    Jsonl,
    /// One row a recording.
    Csv,
    /// The rows of the CSV with types, for data frames; not on a terminal.
    #[cfg(feature = "parquet")]
    Parquet,
}

impl OutputFormat {
    /// Tells whether the form is binary, hence nothing for a terminal.
    pub fn is_binary(self) -> bool {
        match self {
            Self::Human | Self::Json | Self::Jsonl | Self::Csv => false,
            #[cfg(feature = "parquet")]
            Self::Parquet => true,
        }
    }
}

/// When to colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Color {
    /// On a terminal, unless `NO_COLOR` is set; `CLICOLOR_FORCE` holds.
    #[default]
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

impl Color {
    /// Converts the setting for the library that strips the colours.
    pub fn choice(self) -> anstream::ColorChoice {
        match self {
            Self::Auto => anstream::ColorChoice::Auto,
            Self::Always => anstream::ColorChoice::Always,
            Self::Never => anstream::ColorChoice::Never,
        }
    }
}

/// A command.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Everything that diagnoses of one machine need, from recordings of it as new
    ///
    /// Checks the test and the recordings, finds how the phases are wired and where the command begins,
    /// builds the bundle if there is none, learns the unit, and tries it out in simulated tests. The
    /// folder then holds unit, bundle, settings and a report of one page: `fdi diagnose FOLDER/…` needs
    /// no options. What cannot be set up is refused with the reason.
    Setup(SetupArgs),
    /// Fault levels with uncertainty, verdict and fit for each recording
    Diagnose(DiagnoseArgs),
    /// One answer of the parts of a batch, which `fdi diagnose --shard` made
    Merge(MergeArgs),
    /// A recording of a simulated actuator
    Simulate(SimulateArgs),
    /// Reference signals of an actuator in a test, to learn a bundle from
    Dataset(DatasetArgs),
    /// The offline stage: what is learnt from datasets
    #[command(subcommand)]
    Bundle(BundleCommand),
    /// The paper's experiments: how well faults are found
    Evaluate(EvaluateArgs),
    /// The numbers of a machine of your own from healthy recordings
    Calibrate(CalibrateArgs),
    /// Errors of a simulation, their cause, the extended model and the gain
    Explain(ExplainArgs),
    /// The recording to take next: which safe command tells open causes apart, or tells faults best
    Propose(ProposeArgs),
    /// Learn single machines of a type, and learn on from later sessions
    #[command(subcommand)]
    Unit(UnitCommand),
    /// The catalogue of effects: keys, units, what each is confounded with
    Effects(EffectsArgs),
    /// Content of a recording, and how to map its columns
    Inspect(InspectArgs),
    /// The JSON Schema of an answer, or the columns of a recording
    Schema(SchemaArgs),
    /// Completions for a shell, to standard output
    Completions(CompletionsArgs),
    /// The manual page, to standard output
    Man,
}

/// Which columns of a file are which channels.
#[derive(Clone, Debug, Default, Args)]
pub struct MapArgs {
    /// Read channel NAME from COLUMN, or from `(COLUMN + COLUMN)`, multiplied by FACTOR, with OFFSET added; may be repeated
    #[arg(long, value_name = "NAME=COLUMN[*FACTOR[+OFFSET]]", value_parser = mapping)]
    pub map: Vec<String>,
    /// Recordings that lack samples, or have some twice or out of order
    #[arg(long, value_enum, default_value_t)]
    pub gaps: GapsArg,
    /// Leave out the first N lines of a text
    #[arg(long, default_value_t, value_name = "N")]
    pub skip_lines: usize,
    /// Read the rows with this VALUE in this COLUMN, of tables that hold several recordings; may be repeated, and is for every file of the command
    #[arg(long = "where", value_name = "COLUMN=VALUE", value_parser = row_choice)]
    pub rows: Vec<String>,
}

impl MapArgs {
    pub(crate) fn is_bridged(&self) -> bool {
        self.gaps == GapsArg::Bridge
    }

    /// The options for columns and rows as words of a command line.
    pub(crate) fn words(&self) -> Vec<String> {
        let maps = self.map.iter().map(|entry| format!("--map {}", quoted(entry)));
        let rows = self.rows.iter().map(|choice| format!("--where {}", quoted(choice)));
        maps.chain(rows).collect()
    }

    /// How columns are read.
    pub(crate) fn column_map(&self) -> Result<ColumnMap, ColumnMapError> {
        let gaps = match self.gaps {
            GapsArg::Refuse => Gaps::Refuse,
            GapsArg::Bridge => Gaps::Bridge,
        };
        let map = ColumnMap::new(&self.map)?.with_rows(&self.rows)?;
        Ok(map.with_gaps(gaps).with_skipped_lines(self.skip_lines))
    }
}

/// Levels that decisions are made by.
#[derive(Clone, Debug, Default, Args)]
pub struct LevelArgs {
    /// Decide, with these levels from which a fault is to be watched, as `k1=0.1,k2=0.02` [default: friction 20 % above nominal, play 3 times nominal, 2 % of the turns of a phase, 5 % of the air gap]
    #[arg(long, value_name = "LEVELS", value_delimiter = ',', value_parser = action_level)]
    pub watch: Vec<(FaultId, f64)>,
    /// Decide, with these levels from which a fault is to be acted on [default: 40 %, 10 times, 5 % and 15 %]
    #[arg(long, value_name = "LEVELS", value_delimiter = ',', value_parser = action_level)]
    pub act: Vec<(FaultId, f64)>,
}

impl LevelArgs {
    /// True where any level is given.
    pub(crate) fn are_given(&self) -> bool {
        !self.watch.is_empty() || !self.act.is_empty()
    }

    /// The levels; of a fault without one that of the machine.
    ///
    /// # Errors
    /// A level for acting that is below the one for watching.
    pub fn over(&self, of_machine: ActionLevels) -> anyhow::Result<ActionLevels> {
        let mut levels = of_machine;
        for (given, known) in [(&self.watch, &mut levels.watch), (&self.act, &mut levels.act)] {
            for &(fault, level) in given {
                known[fault as usize] = level;
            }
        }
        for (place, (watch, act)) in levels.watch.iter().zip(&levels.act).enumerate() {
            let fault = FaultId::ALL[place];
            anyhow::ensure!(
                watch <= act,
                "{fault} is watched from {watch} and acted on from {act}, expected no less"
            );
        }
        Ok(levels)
    }

    /// Levels as the command line spells them: for watching, for acting.
    pub(crate) fn words(&self) -> [Vec<String>; 2] {
        [&self.watch, &self.act]
            .map(|levels| levels.iter().map(|(fault, level)| format!("{fault}={level}")).collect())
    }
}

/// Recordings that lack samples, or have some twice or out of order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum GapsArg {
    /// Are refused with the place.
    #[default]
    Refuse,
    /// Are put in order and filled, up to 8 samples a gap; the answer says so.
    Bridge,
}

impl GapsArg {
    /// The choice as the command line spells it.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Refuse => "refuse",
            Self::Bridge => "bridge",
        }
    }
}

/// Options of `fdi diagnose`.
#[derive(Clone, Debug, Args)]
pub struct DiagnoseArgs {
    /// Recordings, by the endings of [`FileFormat::listed`], and folders of recordings
    #[arg(required_unless_present = "files_from", value_name = "PATH", help = paths_help())]
    pub paths: Vec<PathBuf>,
    /// Recordings, folders and patterns named in FILE, one a line; `-` reads the names from standard input
    #[arg(long, value_name = "FILE")]
    pub files_from: Option<PathBuf>,
    /// Bundle to diagnose with; may be repeated, then each recording is diagnosed with the one that fits it [default: the embedded one that fits the recording]
    #[arg(long, value_name = "FILE")]
    pub bundle: Vec<PathBuf>,
    /// A recording of this machine as new: levels are changes since those of the same test; may be repeated
    #[arg(long, value_name = "FILE")]
    pub reference: Vec<PathBuf>,
    /// The unit that `fdi unit learn` has learnt, or a folder of units, matched by `actuator-id`: levels are changes since it was new
    #[arg(long, value_name = "FILE|FOLDER", conflicts_with = "reference")]
    pub unit: Option<PathBuf>,
    /// Say for each fault how well it can be told: at best, what it is shared with, and what would help; a report has it anyway, but with `--resume` and `--shard`
    #[arg(long)]
    pub identifiability: bool,
    /// One answer to all recordings of an actuator, of one session or of all, in one state of health
    ///
    /// Recordings are of one actuator by `actuator-id` (those without one count as one actuator's),
    /// and of one session by `session`, else by the day of `date`. Needs `--method gls`, `--fidelity
    /// low`, `--encoding full` and `--tolerance model`, which are the defaults.
    #[arg(long, value_name = "BY", conflicts_with_all = ["resume", "shard"])]
    pub together: Option<TogetherBy>,
    /// How the fault levels are searched
    #[arg(long, value_parser = published::<Method>(), default_value_t = Method::Gls)]
    pub method: Method,
    /// Which model the recording is compared with; `high` goes on from the answer of `low`
    #[arg(long, value_parser = published::<Fidelity>(), default_value_t = Fidelity::Low)]
    pub fidelity: Fidelity,
    /// Part of the filtered envelope that is looked at; other than `full` misses faults that `full` finds
    #[arg(long, value_parser = published::<Encoding>(), default_value_t = Encoding::Full)]
    pub encoding: Encoding,
    /// Use of the machine's tolerances: `model`, it differs from its file as they say; `none`, it is exactly its file
    #[arg(long, value_parser = published::<ToleranceUse>(), default_value_t = ToleranceUse::Model)]
    pub tolerance: ToleranceUse,
    /// Most evaluations of the model in one search; noise, uncertainty and severe faults take more [default: the method's own]
    #[arg(long, value_name = "N")]
    pub max_evaluations: Option<NonZeroUsize>,
    /// Noise on each phase per sample, rms in A, in place of the recording's own
    #[arg(long, value_name = "RMS", value_parser = noise_a)]
    pub noise_a: Option<f64>,
    /// Estimate with the faults by how much the recording begins before or after the command: up to this, at most 0.05
    #[arg(long, value_name = "S", value_parser = not_negative)]
    pub max_delay_s: Option<f64>,
    /// Estimate with the faults where in its play the surface begins and how the speed loop's integrator is charged
    #[arg(long)]
    pub free_start: bool,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub map: MapArgs,
    /// Keep the answers in FILE, one a line, and go on where it ends
    ///
    /// A batch that was interrupted is run again with the same options: recordings
    /// that FILE has are not diagnosed again, and their answers are told with the
    /// others. A recording that failed or whose file is another now is diagnosed
    /// again; other options that change an answer are refused. With `--stable`
    /// nothing tells FILE from that of an uninterrupted run.
    #[arg(long, value_name = "FILE.jsonl")]
    pub resume: Option<PathBuf>,
    /// Diagnose only every N-th recording, beginning with the I-th (from 1)
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Say what to do about each machine: how probable it is that each fault is above levels, and the next step; a report always does
    #[arg(long)]
    pub decide: bool,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub levels: LevelArgs,
    /// Exit by what is found. Alone: with 1 when a fault or a model error is found, with 3 when on some recording there is no conclusion; `=decision`: with 1 when a machine is to be acted on, with 3 when nothing is decided of one, with 0 else
    #[arg(long, value_name = "BY", num_args = 0..=1, require_equals = true, default_missing_value = "verdict")]
    pub exit_code: Option<ExitBy>,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub report: ReportArgs,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub fleet: FleetArgs,
}

impl DiagnoseArgs {
    /// True where the options ask for decisions in the answers.
    pub(crate) fn ask_for_decisions(&self) -> bool {
        self.decide || self.exit_code == Some(ExitBy::Decision) || self.levels.are_given()
    }

    /// True where the answers have to be kept until the batch has ended.
    pub(crate) fn wants_report(&self) -> bool {
        self.report.report.is_some() || self.report.figures.is_some()
    }
}

/// Recordings that one answer is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum TogetherBy {
    /// Recordings of an actuator in a session.
    Session,
    /// All recordings of an actuator.
    Actuator,
}

impl TogetherBy {
    /// The choice as the command line spells it.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Session => "session",
            Self::Actuator => "actuator",
        }
    }
}

/// Ending that the exit code tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum ExitBy {
    /// The verdict.
    Verdict,
    /// The decision.
    Decision,
}

/// A level of k1 to k6.
fn action_level(text: &str) -> Result<(FaultId, f64), String> {
    let expected = || format!("`{text}`, expected a fault and a level such as `k1=0.1`");
    let (name, level) = text.split_once('=').ok_or_else(expected)?;
    let fault = FaultId::ALL[..6].iter().find(|fault| fault.id() == name.trim());
    let fault = *fault.ok_or_else(|| format!("`{name}`, expected k1 to k6"))?;
    let level: f64 = level.trim().parse().map_err(|_| expected())?;
    if level > 0.0 && level <= 1.0 {
        return Ok((fault, level));
    }
    Err(format!("a level of {level} for {fault}, expected above 0 and at most 1"))
}

/// Help that lists the endings of the recordings that this build reads.
fn paths_help() -> String {
    let endings = FileFormat::listed();
    format!(
        "Recordings ({endings}), folders of recordings, and patterns such as '2026-*/*.csv'; `-` \
         reads one recording from standard input"
    )
}

/// Every N-th recording, beginning with the I-th.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    pub(crate) index: usize,
    pub(crate) of: usize,
}

impl Shard {
    /// Tells whether the recording with that index, from 0, belongs to the shard.
    pub fn holds(self, recording: usize) -> bool {
        recording % self.of == self.index - 1
    }
}

impl FromStr for Shard {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parse = || {
            let (index, of) = text.split_once('/')?;
            let (index, of): (usize, usize) = (index.parse().ok()?, of.parse().ok()?);
            (1..=of).contains(&index).then_some(Self { index, of })
        };
        parse().ok_or("expected I/N with I from 1 to N, such as 2/8")
    }
}

/// Options of `fdi merge`.
#[derive(Clone, Debug, Args)]
pub struct MergeArgs {
    /// Every part of the batch, in any order: files of `--resume`, or JSON documents
    #[arg(required = true, value_name = "PART")]
    pub parts: Vec<PathBuf>,
}

/// Options of `fdi simulate`.
#[derive(Clone, Debug, Args)]
pub struct SimulateArgs {
    /// Model to simulate
    #[arg(long, value_parser = published::<Fidelity>(), default_value_t = Fidelity::High)]
    pub fidelity: Fidelity,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub test: TestArgs,
    /// Fault levels from 0 to 1, such as `k1=0.02,k6=0.03,k7=0.6`; the others are 0
    #[arg(long, value_name = "LEVELS", default_value = "")]
    pub faults: FaultLevels,
    /// Resistance over which the turns of k3 to k5 are shorted, so that a current circulates in them, 0 to 1000000 Ω [default: the turns are gone]
    #[arg(long, value_name = "OHM", value_parser = not_negative)]
    pub short_resistance_ohm: Option<f64>,
    /// Share of leakage in a phase's inductance, 0.01 to 1, for the current in shorted turns [default: that of the model, or 0.5]
    #[arg(long, value_name = "X", value_parser = positive, requires = "short_resistance_ohm")]
    pub short_leakage_ratio: Option<f64>,
    /// White noise on each sample of the phases, or of the current of an axis, rms in A
    #[arg(long, value_name = "RMS", default_value_t = 0.0, value_parser = not_negative)]
    pub noise_a: f64,
    /// Bits of the converter that reads the phases [default: not digitised]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=32))]
    pub adc_bits: Option<u8>,
    /// Range of that converter, from -X to X A [default: the current limit of the model; 20 for `ema-48`]
    #[arg(long, value_name = "X", value_parser = positive, requires = "adc_bits")]
    pub adc_range_a: Option<f64>,
    /// Rate of the phase samples in Hz [default: that of the model's controller; 10000 for `ema-48`]
    #[arg(long, value_name = "N", value_parser = positive)]
    pub rate_hz: Option<f64>,
    /// Record the voltage that the drive puts on the motor beside the phases
    #[arg(long)]
    pub motor_voltage: bool,
    /// Leave noise and steps of the electronics out of the controller's loops
    #[arg(long)]
    pub ideal_electronics: bool,
}

/// Levels of the seven faults.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaultLevels(pub [f64; 7]);

impl FromStr for FaultLevels {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut levels: [Option<f64>; 7] = [None; 7];
        for entry in text.split(',').map(str::trim).filter(|entry| !entry.is_empty()) {
            let form = || format!("`{entry}` is not of the form `k1=0.02`");
            let (name, value) = entry.split_once('=').ok_or_else(form)?;
            let number: Option<usize> =
                name.trim().strip_prefix('k').and_then(|digit| digit.parse().ok());
            let index = number
                .filter(|number| (1..=7).contains(number))
                .ok_or_else(|| format!("`{}` is no fault; they are k1 to k7", name.trim()))?;
            let value: f64 = value.trim().parse().map_err(|_| form())?;
            if !(0.0..=1.0).contains(&value) {
                return Err(format!("k{index} is {value}, expected 0 to 1"));
            }
            if levels[index - 1].replace(value).is_some() {
                return Err(format!("k{index} is given twice"));
            }
        }
        Ok(Self(levels.map(|level| level.unwrap_or(0.0))))
    }
}

/// A command about bundles.
#[derive(Debug, Subcommand)]
pub enum BundleCommand {
    /// Learn a bundle from datasets
    Build(BuildArgs),
    /// Say what a bundle holds
    Show(ShowArgs),
}

/// Options of `fdi bundle build`.
#[derive(Clone, Debug, Args)]
pub struct BuildArgs {
    /// Datasets to learn from
    #[arg(long, required = true, num_args = 1.., value_name = "FILE")]
    pub dataset: Vec<PathBuf>,
}

/// Options of `fdi bundle show`.
#[derive(Clone, Debug, Args)]
pub struct ShowArgs {
    /// The bundle [default: the embedded one]
    #[arg(value_name = "FILE")]
    pub file: Option<PathBuf>,
    /// Draw the first dynamic mode with the points on it
    #[arg(long, value_name = "FILE.svg")]
    pub figure: Option<PathBuf>,
}

/// Options of `fdi schema`.
#[derive(Clone, Debug, Args)]
pub struct SchemaArgs {
    /// Which form
    #[arg(value_parser = published::<Schema>())]
    pub form: Schema,
}

/// Options of `fdi completions`.
#[derive(Clone, Debug, Args)]
pub struct CompletionsArgs {
    /// Which shell
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// Options of `fdi inspect`.
#[derive(Clone, Debug, Args)]
pub struct InspectArgs {
    /// The recording, or `config` for all settings with their origins
    #[arg(value_name = "FILE|config")]
    pub file: PathBuf,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub map: MapArgs,
}

fn at_least_one(text: &str) -> Result<NonZeroUsize, String> {
    text.parse().map_err(|_| "expected a whole number from 1 on".to_owned())
}

fn finite(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number".to_owned())?;
    if value.is_finite() { Ok(value) } else { Err("expected a finite number".to_owned()) }
}

fn positive(text: &str) -> Result<f64, String> {
    finite(text).and_then(|value| {
        if value > 0.0 { Ok(value) } else { Err("expected a positive number".to_owned()) }
    })
}

fn not_negative(text: &str) -> Result<f64, String> {
    finite(text).and_then(|value| {
        if value >= 0.0 { Ok(value) } else { Err("expected a number that is not negative".into()) }
    })
}

fn noise_a(text: &str) -> Result<f64, String> {
    not_negative(text).and_then(|value| {
        if value <= PhaseSensors::MOST_A {
            Ok(value)
        } else {
            Err(format!("expected at most {} A", PhaseSensors::MOST_A))
        }
    })
}

/// An entry of `--map`; whether entries go together is seen once all are known.
fn mapping(text: &str) -> Result<String, String> {
    ColumnMap::new([text]).map(|_| text.to_owned()).map_err(|error| error.to_string())
}

/// A condition of `--where`.
fn row_choice(text: &str) -> Result<String, String> {
    let map = ColumnMap::default().with_rows([text]);
    map.map(|_| text.to_owned()).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;
    use fdi_core::ema_sim::model_file::PRESETS;

    use super::*;

    #[test]
    fn the_tree_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn help_of_models_names_every_preset() {
        let tree = Cli::command();
        let models = tree.get_subcommands().flat_map(|command| {
            command.get_arguments().filter(|argument| argument.get_id() == "model")
        });
        let helps: Vec<String> = models.map(|a| a.get_help().unwrap().to_string()).collect();
        assert_eq!(helps.len(), 6);
        for (name, _) in PRESETS {
            let named = format!("`{name}`");
            assert!(helps.iter().all(|help| help.contains(&named)), "{named}: {helps:?}");
        }
    }

    #[test]
    fn fault_levels_are_checked() {
        let parse = |text: &str| text.parse::<FaultLevels>().map(|levels| levels.0);
        assert_eq!(parse("k1=0.02, k6=0.03,k7=1"), Ok([0.02, 0., 0., 0., 0., 0.03, 1.0]));
        assert_eq!(parse(""), Ok([0.0; 7]));
        assert_eq!(parse("k8=0.1"), Err("`k8` is no fault; they are k1 to k7".to_owned()));
        assert_eq!(parse("k1=2"), Err("k1 is 2, expected 0 to 1".to_owned()));
        assert_eq!(parse("k1=NaN"), Err("k1 is NaN, expected 0 to 1".to_owned()));
        assert_eq!(parse("k1=0,k1=0"), Err("k1 is given twice".to_owned()));
        assert_eq!(parse("k1"), Err("`k1` is not of the form `k1=0.02`".to_owned()));
    }

    #[test]
    fn shards_share_out_everything_once() {
        let shards: Vec<Shard> =
            ["1/3", "2/3", "3/3"].map(|text| text.parse().unwrap()).into_iter().collect();
        for recording in 0..10 {
            assert_eq!(shards.iter().filter(|shard| shard.holds(recording)).count(), 1);
        }
        for bad in ["0/3", "4/3", "1", "a/b", "1/0"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }
}
