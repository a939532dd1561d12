//! Bundles of the pages' machines.

use std::path::Path;

use anyhow::{Context, Result};
use fdi_core::{
    Bundle, ColumnMap, Dataset, DatasetRequest, EMBEDDED_BUNDLES, Experiment, Recording,
    ReferenceDesign, RootSeed, default_noise_a,
    ema_sim::{Imperfections, presets},
    read_model,
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
    let dataset = |design| {
        let imperfections = Imperfections::REAL;
        let request =
            DatasetRequest { design, conditions: 100, seed: 0, imperfections, jobs: jobs() };
        Dataset::generate(&experiment, &request)
    };
    let datasets = [ReferenceDesign::Incipient, ReferenceDesign::Sparse].map(dataset);
    let datasets = datasets.into_iter().collect::<Result<Vec<_>, _>>()?;
    let noise_a = default_noise_a(&experiment.actuator);
    Ok(Bundle::build(&experiment, datasets, noise_a, RootSeed(0))?)
}
