//! The seam between the command line and the simulation.

use std::{fs, path::Path};

use anyhow::{Context, Result, bail};
use fdi_core::{
    ChannelName, ColumnMap, Experiment, Purpose, RecordedContent, Recording, RootSeed,
    SimulatedRecording,
    ema_sim::{
        Actuator, Command, Converter, HealthState, Imperfections, PhaseSensors, model_file, presets,
    },
};

use crate::args::{FidelityArg, SimulateArgs};

/// The recording that the options ask for.
pub(crate) fn simulate(args: &SimulateArgs, seed: RootSeed) -> Result<Recording> {
    let experiment = experiment(args)?;
    let converter =
        args.adc_bits.map(|bits| Converter { bits: u32::from(bits), range_a: args.adc_range_a });
    let simulated = SimulatedRecording {
        faults: HealthState::new(args.faults.0)?.coordinates(),
        start_angle_rad: args.start_angle_rad,
        imperfections: Imperfections::REAL,
        controller_seed: seed.derive(Purpose::ControllerNoise, 0),
        sensors: PhaseSensors { noise_a: args.noise_a, converter },
        phase_rate_hz: Some(args.rate_hz),
        sensor_seed: seed.derive(Purpose::SensorNoise, 0),
        content: RecordedContent::Phases,
    };
    Ok(match args.fidelity {
        FidelityArg::High => simulated.record(&experiment, "simulated")?,
        FidelityArg::Low => simulated.record_low_fidelity(&experiment, "simulated")?,
    })
}

/// The actuator and its test.
fn experiment(args: &SimulateArgs) -> Result<Experiment> {
    let mut experiment = match args.command.as_str() {
        "chirp" => Experiment::chirp(),
        "sine" => Experiment::sine(),
        file => recorded(Path::new(file))?,
    };
    (experiment.model_name, experiment.actuator) = actuator(&args.model)?;
    Ok(experiment)
}

/// A preset by its name, or a model file.
fn actuator(model: &str) -> Result<(String, Actuator)> {
    if model == "ema-48" {
        return Ok((model.to_owned(), presets::EMA_48));
    }
    let text = fs::read_to_string(model)
        .with_context(|| format!("{model}: neither a preset (`ema-48`) nor a model file"))?;
    let parsed = model_file::parse(&text).with_context(|| model.to_owned())?;
    if let Some(block) = parsed.effects.first() {
        let symbol = block.effect.id().info().symbol;
        bail!("{model}: holds effect {symbol}; this command simulates models without effects");
    }
    Ok((parsed.name.unwrap_or_else(|| model.to_owned()), parsed.actuator))
}

/// A test with the command of a recording.
fn recorded(path: &Path) -> Result<Experiment> {
    let named = path.display();
    let recording =
        Recording::read(path, &ColumnMap::default()).with_context(|| named.to_string())?;
    let Some(channel) = recording.channel(ChannelName::Command) else {
        bail!("{named}: no column `command_rad`, which holds the command");
    };
    let sampling = channel.sampling().with_context(|| named.to_string())?;
    if !sampling.is_uniform() {
        bail!("{named}: `command_rad` is sampled irregularly, expected a uniform rate");
    }
    let mut experiment = Experiment::chirp();
    "recorded".clone_into(&mut experiment.name);
    experiment.scenario.command =
        Command::Recorded { values_rad: channel.values().to_vec(), rate_hz: sampling.rate_hz };
    experiment.scenario.duration_s = sampling.samples as f64 / sampling.rate_hz;
    Ok(experiment)
}
