//! The seam between the command line and the simulation.

use anyhow::{Result, bail};
use fdi_core::{Recording, RootSeed};

use crate::args::SimulateArgs;

/// The recording that the options ask for.
pub(crate) fn simulate(_args: &SimulateArgs, _seed: RootSeed) -> Result<Recording> {
    bail!("no simulation in this build")
}
