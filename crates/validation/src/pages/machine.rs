//! Bundles of the pages' machines.

use std::path::Path;

use anyhow::{Context, Result};
use experiments::bundle_of_test;
use fdi_core::{
    Bundle, ColumnMap, EMBEDDED_BUNDLES, Experiment, Recording, ema_sim::presets, read_model,
};

use crate::processor::jobs;

/// EMA-48 in the embedded chirp.
pub(super) fn ema_48() -> Result<Bundle> {
    Ok(Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes)?)
}

/// A machine whose bundle is built as `fdi setup` does, with the usual tolerances; in the chirp where no
/// recording gives the command.
pub(super) fn built(model: &str, command: Option<&Path>) -> Result<Bundle> {
    let mut model = read_model(model)?;
    model.tolerance = presets::ema_48_tolerance();
    model.temperature = model.temperature.or_else(|| Some(presets::ema_48_temperature()));
    let test = match command {
        Some(path) => Experiment::of_recording(&Recording::read(path, &ColumnMap::default())?)?,
        None => Experiment::named("chirp").context("the chirp")?,
    };
    let own = model.name.clone().context("a model that is read has a name")?;
    let experiment = test.of_model(&own, &model)?;
    Ok(bundle_of_test(&experiment, 0, jobs())?)
}
