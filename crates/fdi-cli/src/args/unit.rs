//! Options of `fdi unit`.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use fdi_core::Component;

use super::{MapArgs, NameArgs};

/// A command about units: single machines of a type.
#[derive(Debug, Subcommand)]
pub enum UnitCommand {
    /// Learn a unit from recordings of it as new
    ///
    /// The file (`--output`) holds what each recording shows of the unit, not the recordings
    /// themselves. `fdi diagnose --unit FILE` then finds what has changed since.
    Learn(LearnArgs),
    /// Learn on from later recordings; those on which damage is found are left out
    ///
    /// A slow wear is not taken for what the unit is: what later sessions have in common with time
    /// counts as wear.
    Update(UpdateArgs),
    /// Note that a part was replaced: what was learnt of it is of the old one
    Reset(ResetArgs),
    /// Say what a unit was learnt from, and its numbers
    Show(ShowUnitArgs),
    /// Write the model file of a unit: its numbers, and what is left open of them as tolerances
    ///
    /// `fdi explain --model` and `fdi simulate --model` then take the unit for its type. Errors of
    /// its current sensors, mismatch of its turns and its eccentricity have no place in a model file.
    Model(ShowUnitArgs),
}

/// Options of `fdi unit learn`.
#[derive(Clone, Debug, Args)]
pub struct LearnArgs {
    /// Recordings of the unit as new, best of several days
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub reading: ReadingArgs,
}

/// Options of `fdi unit update`.
#[derive(Clone, Debug, Args)]
pub struct UpdateArgs {
    /// The unit; it is written anew unless `--output` is given
    #[arg(value_name = "UNIT")]
    pub unit: PathBuf,
    /// Later recordings of it, in the order of their sessions
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub reading: ReadingArgs,
}

/// How the recordings of a unit are read.
#[derive(Clone, Debug, Args)]
pub struct ReadingArgs {
    /// Bundle of the unit [default: the embedded one that fits the first recording]
    #[arg(long, value_name = "FILE")]
    pub bundle: Option<PathBuf>,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub map: MapArgs,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub names: NameArgs,
}

/// Options of `fdi unit reset`.
#[derive(Clone, Debug, Args)]
pub struct ResetArgs {
    /// The unit; it is written anew unless `--output` is given
    #[arg(value_name = "UNIT")]
    pub unit: PathBuf,
    /// Part that was replaced
    #[arg(long, value_enum)]
    pub replaced: ReplacedArg,
}

/// Options of `fdi unit show` and `fdi unit model`.
#[derive(Clone, Debug, Args)]
pub struct ShowUnitArgs {
    /// The unit
    #[arg(value_name = "UNIT")]
    pub unit: PathBuf,
    /// Bundle that it was learnt with [default: the embedded one]
    #[arg(long, value_name = "FILE")]
    pub bundle: Option<PathBuf>,
}

/// Part of an actuator that was replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ReplacedArg {
    /// Rotor, windings and bearings
    Motor,
    /// Gear, screw and surface
    Gear,
    /// Sensors of the phase currents
    Sensor,
}

impl From<ReplacedArg> for Component {
    fn from(replaced: ReplacedArg) -> Self {
        match replaced {
            ReplacedArg::Motor => Self::Motor,
            ReplacedArg::Gear => Self::Gear,
            ReplacedArg::Sensor => Self::Sensor,
        }
    }
}
