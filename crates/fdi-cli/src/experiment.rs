//! The seam between the command line and the experiments that are simulated.

use std::path::Path;

use anyhow::{Context, Result, bail};
use fdi_core::{
    AxisTest, ColumnMap, Experiment, Recording,
    ema_sim::{
        Geometry,
        model_file::{AxisModel, Model},
        presets,
    },
    read_model,
};

use crate::args::TestArgs;

/// The actuator that the options name, in its test.
pub(crate) fn experiment(args: &TestArgs) -> Result<Experiment> {
    experiment_of(&read_model(&args.model)?, args)
}

/// An actuator in the test that the options name.
pub(crate) fn experiment_of(model: &Model, args: &TestArgs) -> Result<Experiment> {
    let name = model.name.clone().context("a model that is read has a name")?;
    let mut test = match Experiment::named(&args.command) {
        Some(test) => test,
        None => recorded(Path::new(&args.command))?,
    };
    if let Some(load_n_m) = args.load_n_m {
        test.scenario.load_n_m = load_n_m;
    }
    test.scenario.start_angle_rad = args.start_angle_rad;
    test.of_model(&name, model).map_err(|error| {
        let blamed = if error.is_of_the_command() { &args.command } else { &args.model };
        anyhow::Error::new(error).context(blamed.clone())
    })
}

/// Gives a model without tolerances those that are usual for such actuators; true where it had none.
pub(crate) fn take_usual_tolerances(model: &mut Model) -> bool {
    if !model.tolerance.is_empty() {
        return false;
    }
    model.tolerance = presets::ema_48_tolerance();
    model.temperature = model.temperature.or_else(|| Some(presets::ema_48_temperature()));
    true
}

/// The test of a servo axis that the options name.
pub(crate) fn axis_test(model: &AxisModel, args: &TestArgs) -> Result<AxisTest> {
    let geometry = model.axis.geometry;
    if args.start_angle_rad != 0.0 {
        bail!("`--start-angle-rad`: a servo axis has no rotor that commutates");
    }
    if args.load_n_m.is_some() && geometry == Geometry::Linear {
        bail!("`--load-n-m`: {} slides, its load would be a force", args.model);
    }
    let mut test = match args.command.as_str() {
        "chirp" => {
            bail!("`--command chirp`: a test of actuators; a servo axis has `sine`, or a recording")
        }
        "sine" => AxisTest::sine(),
        file => {
            let (named, recording) = recording_of(Path::new(file))?;
            AxisTest::of_recording(&recording, geometry).with_context(|| named)?
        }
    };
    test.scenario.load = args.load_n_m.unwrap_or(0.0);
    Ok(test)
}

/// The test of a recording.
fn recorded(path: &Path) -> Result<Experiment> {
    let (named, recording) = recording_of(path)?;
    Experiment::of_recording(&recording).with_context(|| named)
}

/// A recording of a command, with its name.
pub(crate) fn recording_of(path: &Path) -> Result<(String, Recording)> {
    let named = path.display().to_string();
    if path.extension().is_none() {
        bail!("{named}: neither a command (`chirp`, `sine`, `planned`) nor a recording");
    }
    let recording = Recording::read(path, &ColumnMap::default()).with_context(|| named.clone())?;
    Ok((named, recording))
}
