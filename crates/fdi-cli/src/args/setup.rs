//! Options of `fdi setup`.

use std::{num::NonZeroUsize, path::PathBuf};

use clap::Args;

use super::{LevelArgs, ReadingArgs, TestArgs};

/// Options of `fdi setup`.
#[derive(Clone, Debug, Args)]
pub struct SetupArgs {
    /// Recordings of the machine as new, best of several days, and folders of them
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub test: TestArgs,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub reading: ReadingArgs,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub levels: LevelArgs,
    /// Simulated tests of the machine without damage, and as many with damage
    #[arg(long, value_name = "N", default_value = "20")]
    pub tests: NonZeroUsize,
}
