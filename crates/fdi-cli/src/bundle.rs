//! The seam between the command line and the offline stage.

use std::path::Path;

use anyhow::{Result, bail};
use fdi_core::{RootSeed, report::BundleSummary};

use crate::args::BuildArgs;

/// Learns a bundle; gives the bytes of its file.
pub(crate) fn build(_args: &BuildArgs, _seed: RootSeed) -> Result<Vec<u8>> {
    bail!("no offline stage in this build")
}

/// What the bundle in `file`, or the embedded one, holds.
pub(crate) fn summarise(_file: Option<&Path>) -> Result<BundleSummary> {
    bail!("no bundle in this build")
}
