//! Options of `fdi explain`, `fdi propose` and `fdi calibrate`.

use std::path::PathBuf;

use clap::Args;
use fdi_core::report::Prediction;

use super::{MapArgs, ReportArgs, published};

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
    /// Command of the recordings that have no column of it: `chirp`, `sine` or a recording [default: the one their metadata name]
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

/// Options of `fdi propose`.
///
/// A command stays within the travel of the recordings, asks for no more than half of the
/// controller's limit of speed, or the fastest pace recorded where that is more or no limit is
/// known, and needs no more than half of its limit of current.
#[derive(Clone, Debug, Args)]
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
}
