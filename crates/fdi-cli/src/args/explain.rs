//! Options of `fdi explain`, `fdi propose` and `fdi calibrate`.

use std::path::PathBuf;

use clap::{Arg, Args};
use fdi_core::{ema_sim::FaultId, report::Prediction};

use super::{MapArgs, ReportArgs, finite, positive, published};

/// Recordings of one machine, by what they are for.
#[derive(Clone, Debug, Args)]
pub struct RecordArgs {
    /// Recordings that are fitted, of one machine in one state of health; without `--holdout`,
    /// `explain` and `propose` hold the last of several out
    #[arg(long, required = true, num_args = 1.., value_name = "REC")]
    pub train: Vec<PathBuf>,
    /// Recordings of other commands that are judged on and never fitted
    #[arg(long, num_args = 1.., value_name = "REC")]
    pub holdout: Vec<PathBuf>,
    /// Repetitions of recordings to train on, for the noise
    #[arg(long, num_args = 1.., value_name = "REC")]
    pub repeat: Vec<PathBuf>,
    /// Command of the recordings that have no column of it: `chirp`, `sine`, `planned` or a recording [default: the one their metadata name]
    #[arg(long, value_name = "NAME|FILE")]
    pub command: Option<String>,
    /// Compare with what the measured motion asks for: for a servo axis under a controller that the model file does not describe
    #[arg(long, conflicts_with = "command")]
    pub inverse_dynamics: bool,
    /// Set right what the signal chain shows of a servo axis: shifts, signs and factors of channels,
    /// and inputs behind the controller, which become a load
    #[arg(long)]
    pub correct: bool,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub map: MapArgs,
}

/// Options of `fdi explain`.
#[derive(Clone, Debug, Args)]
pub struct ExplainArgs {
    /// Model that is compared with the recordings: `ema-48`, `bench` or a model file
    #[arg(long, value_name = "MODEL", default_value = "ema-48")]
    pub model: String,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub records: RecordArgs,
    /// Model that predicts the recordings [default: `learnt` where they are of a bundle's test, else
    /// the one under which they are likeliest]
    #[arg(long, value_name = "MODEL", value_parser = published::<Prediction>())]
    pub fidelity: Option<Prediction>,
    /// Unit that the recordings are of, as `fdi unit learn` wrote it: its numbers in place of its
    /// type's
    #[arg(long, value_name = "FILE", conflicts_with = "model")]
    pub unit: Option<PathBuf>,
    /// Bundle that knows the error of the low-fidelity model, of a unit the one that it was learnt with
    /// [default: the embedded one]
    #[arg(long, value_name = "FILE")]
    pub bundle: Option<PathBuf>,
    /// Effects of the catalogue that this machine cannot have: `E05 E08`
    #[arg(long, num_args = 1.., value_name = "EFFECT")]
    pub without: Vec<String>,
    /// Numbers of the model file that are exact, by their keys, or `all` that it states no tolerance
    /// for; any other may be off: as the file says, else by 10 %, friction, drag and play by 30 %
    #[arg(long, num_args = 1.., value_name = "KEY")]
    pub exact: Vec<String>,
    /// Exit with 1 when the model misses something, with 3 when there is no conclusion
    #[arg(long)]
    pub exit_code: bool,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub report: ReportArgs,
}

/// Options of `fdi calibrate`.
#[derive(Clone, Debug, Args)]
pub struct CalibrateArgs {
    /// Model with the numbers of the data sheet: `ema-48`, `bench` or a model file
    #[arg(long, value_name = "MODEL")]
    pub model: String,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub records: RecordArgs,
    /// Bundle of an actuator's model, which knows the error of the low-fidelity model [default: the
    /// embedded one, where the model is its]
    #[arg(long, value_name = "FILE")]
    pub bundle: Option<PathBuf>,
}

/// Test that a plan is compared with where none is named.
pub(crate) const DEFAULT_BEFORE: &str = "chirp";

/// Options of a plan: beside any of them `--train` is not asked for, nor taken.
const OF_A_PLAN: [&str; 10] = [
    "faults",
    "within",
    "references",
    "reading_std_k",
    "motor_voltage",
    "load_n_m",
    "most_travel_rad",
    "most_speed_rad_per_s",
    "most_current_a",
    "before",
];

/// Options of a test that is planned for faults.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "A test for faults")]
pub struct PlanArgs {
    /// Plan the test that tells these faults best, `k1` to `k6`; without a list all of the model. No
    /// recordings are needed
    #[arg(
        long,
        value_name = "K,...",
        value_delimiter = ',',
        num_args = 0..,
        value_parser = fault,
        conflicts_with_all = ["train", "without", "exact", "fidelity"]
    )]
    pub faults: Option<Vec<FaultId>>,
    /// Longest that the test may last: `10s`, `500ms`
    #[arg(long, value_name = "TIME", value_parser = test_time, default_value = "10s")]
    pub within: f64,
    /// Recordings of the machine as new, each of another day, that there will be of the test
    #[arg(long, value_name = "N", default_value_t = 4)]
    pub references: usize,
    /// Plan for a test in which the winding's temperature is read, with this standard deviation, K;
    /// without it, expectations are told for 3 K too
    #[arg(long, value_name = "K", value_parser = positive)]
    pub reading_std_k: Option<f64>,
    /// Plan for a test in which the motor's voltage is recorded
    #[arg(long)]
    pub motor_voltage: bool,
    /// Constant load on the surface, N·m, positive against positive motion
    #[arg(
        long,
        value_name = "X",
        default_value_t = 0.0,
        value_parser = finite
    )]
    pub load_n_m: f64,
    /// Travel to either side [default: half of the way to a stop]
    #[arg(long, value_name = "RAD", value_parser = positive)]
    pub most_travel_rad: Option<f64>,
    /// Speed of the rotor [default: three quarters of the drive's limit]
    #[arg(long, value_name = "RAD/S", value_parser = positive)]
    pub most_speed_rad_per_s: Option<f64>,
    /// Current [default: half of the drive's limit]
    #[arg(long, value_name = "A", value_parser = positive)]
    pub most_current_a: Option<f64>,
    /// Test to compare with: `chirp`, `sine`, `planned` or a recording with the column `command_rad`
    #[arg(long, value_name = "NAME|FILE", default_value = DEFAULT_BEFORE)]
    pub before: String,
}

/// A fault whose size a test tells.
fn fault(text: &str) -> Result<FaultId, String> {
    let sizes = FaultId::ALL.into_iter().filter(|fault| *fault != FaultId::EccentricityPhase);
    let mut named = sizes.filter(|fault| fault.symbol() == text);
    named.next().ok_or_else(|| "expected `k1` to `k6`".to_owned())
}

/// Longest test that is planned, s: nobody waits longer for a bench.
const LONGEST_TEST_S: f64 = 600.0;

/// Units of a time, with their seconds; `s` is last, since `ms` ends with it.
const TIME_UNITS: [(&str, f64); 3] = [("ms", 1e-3), ("min", 60.0), ("s", 1.0)];

/// The time of a test, with or without its unit.
fn test_time(text: &str) -> Result<f64, String> {
    let with_unit = |(unit, of_one_s)| Some((text.strip_suffix(unit)?, of_one_s));
    let (number, of_one_s) = TIME_UNITS.into_iter().find_map(with_unit).unwrap_or((text, 1.0));
    positive(number.trim_end())
        .ok()
        .map(|number| number * of_one_s)
        .filter(|&seconds| seconds <= LONGEST_TEST_S)
        .ok_or_else(|| {
            format!("expected a time from 0 to {LONGEST_TEST_S} s: `10s`, `500ms` or `2min`")
        })
}

/// An option of `fdi propose`; one of a plan goes with `--faults` alone.
fn for_faults(option: Arg) -> Arg {
    let id = option.get_id().as_str();
    if id != "faults" && OF_A_PLAN.contains(&id) {
        option.requires("faults").conflicts_with("train")
    } else {
        option
    }
}

/// Options of `fdi propose`.
///
/// A command stays within the travel of the recordings, asks for no more than half of the
/// controller's limit of speed, or the fastest pace recorded where that is more or no limit is
/// known, and needs no more than half of its limit of current.
#[derive(Clone, Debug, Args)]
#[command(
    mut_arg("train", |train| train.required(false).required_unless_present_any(OF_A_PLAN)),
    mut_args(for_faults)
)]
pub struct ProposeArgs {
    /// Model that is compared with the recordings: `ema-48`, `bench` or a model file
    #[arg(long, value_name = "MODEL", default_value = "ema-48")]
    pub model: String,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub records: RecordArgs,
    /// Model that predicts the recordings [default: the one under which they are likeliest]
    #[arg(long, value_name = "MODEL", value_parser = published::<Prediction>())]
    pub fidelity: Option<Prediction>,
    /// Effects of the catalogue that this machine cannot have: `E05 E08`
    #[arg(long, num_args = 1.., value_name = "EFFECT")]
    pub without: Vec<String>,
    /// Numbers of the model file that are exact, by their keys, or `all` that it states no tolerance
    /// for; any other may be off: as the file says, else by 10 %, friction, drag and play by 30 %
    #[arg(long, num_args = 1.., value_name = "KEY")]
    pub exact: Vec<String>,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub plan: PlanArgs,
}
