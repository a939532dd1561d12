//! The seam between the command line and the experiments that are simulated.

use std::path::Path;

use anyhow::{Context, Result, bail};
use fdi_core::{
    ColumnMap, Experiment, ExperimentError, Recording,
    ema_sim::{FaultId, SimulationError},
    read_model,
};

use crate::args::TestArgs;

/// The actuator that the options name, in its test, and the faults that it can have.
pub(crate) fn experiment(args: &TestArgs) -> Result<(Experiment, Vec<FaultId>)> {
    let mut model = read_model(&args.model)?;
    let name = model.name.take().context("a model that is read has a name")?;
    let mut test = match args.command.as_str() {
        "chirp" => Experiment::chirp(),
        "sine" => Experiment::sine(),
        file => recorded(Path::new(file))?,
    };
    if let Some(load_n_m) = args.load_n_m {
        test.scenario.load_n_m = load_n_m;
    }
    test.scenario.start_angle_rad = args.start_angle_rad;
    let experiment = test.of_model(&name, &model).map_err(|error| {
        let blamed = if of_the_command(&error) { &args.command } else { &args.model };
        anyhow::Error::new(error).context(blamed.clone())
    })?;
    Ok((experiment, model.faults))
}

/// Whether it is the command's fault that the test cannot be run.
fn of_the_command(error: &ExperimentError) -> bool {
    matches!(
        error,
        ExperimentError::TooShort { .. }
            | ExperimentError::Simulation(
                SimulationError::CommandBeyondStops { .. } | SimulationError::Scenario { .. }
            )
    )
}

/// The test of a recording.
fn recorded(path: &Path) -> Result<Experiment> {
    let named = || path.display().to_string();
    if path.extension().is_none() {
        bail!("{}: neither a command (`chirp`, `sine`) nor a recording", named());
    }
    let recording = Recording::read(path, &ColumnMap::default()).with_context(named)?;
    Experiment::of_recording(&recording).with_context(named)
}
