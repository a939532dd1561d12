//! Options that say which actuator does what, and those of `fdi dataset`.

use std::num::NonZeroUsize;

use clap::{Args, ValueEnum};
use fdi_core::ReferenceDesign;

use super::finite;

/// An actuator in a test.
#[derive(Clone, Debug, Args)]
pub struct TestArgs {
    /// Actuator: `ema-48`, `bench` or a model file; `simulate` takes that of a servo axis too
    #[arg(long, value_name = "NAME|FILE.toml", default_value = "ema-48")]
    pub model: String,
    /// Command: `chirp`, `sine`, `planned` or a recording with the column `command_rad`, for a servo axis that slides `command_m`
    #[arg(long, value_name = "NAME|FILE.csv", default_value = "chirp")]
    pub command: String,
    /// Constant load on the surface, N·m, positive against positive motion [default: 0.5 for `chirp` and `planned`, 0 for `sine`, the column `load_n_m` of a recording or else 0]
    #[arg(long, value_name = "X", value_parser = finite)]
    pub load_n_m: Option<f64>,
    /// Mechanical angle of the rotor at the first sample, rad
    #[arg(long, value_name = "X", default_value_t = 0.0, value_parser = finite)]
    pub start_angle_rad: f64,
}

/// Options of `fdi dataset`.
#[derive(Clone, Debug, Args)]
pub struct DatasetArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub test: TestArgs,
    /// Fault conditions of each design
    #[arg(long, value_name = "N", default_value = "100")]
    pub conditions: NonZeroUsize,
    /// Which conditions; several designs go into one file
    #[arg(
        long,
        value_enum,
        value_name = "DESIGN,...",
        value_delimiter = ',',
        default_value = "incipient,sparse"
    )]
    pub design: Vec<DesignArg>,
}

/// Which fault conditions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DesignArg {
    /// All faults at once, levels up to 0.05; every bundle needs it
    Incipient,
    /// At most two faults at a time, levels up to 0.05: healthy machines, or nearly so
    Sparse,
    /// As `incipient`, with the rotor starting anywhere
    Turned,
    /// As `sparse`, with the rotor starting anywhere
    TurnedSparse,
    /// Levels up to 1: severe faults
    Wide,
}

impl DesignArg {
    /// Converts the argument into the design of the dataset.
    pub fn of_dataset(self) -> ReferenceDesign {
        match self {
            Self::Incipient => ReferenceDesign::Incipient,
            Self::Sparse => ReferenceDesign::Sparse,
            Self::Turned => ReferenceDesign::Turned,
            Self::TurnedSparse => ReferenceDesign::TurnedSparse,
            Self::Wide => ReferenceDesign::Wide,
        }
    }
}
