//! The seam between the command line and the simulation.

use anyhow::{Result, anyhow, bail};
use fdi_core::{
    CsvFormat, Purpose, RecordedContent, Recording, RootSeed, SimulatedRecording,
    SimulatedRecordingError, axis_csv_format,
    ema_sim::{
        Converter, Geometry, HealthState, Imperfections, PhaseSensors, ShortedTurns, VisitedRange,
        model_file::{AxisModel, EffectBlock, FaultRefused, MachineModel, Model},
    },
    read_machine,
    report::Fidelity,
    with_current_noise,
};

use crate::{args::SimulateArgs, experiment};

/// A simulated recording, with what is to be said of it.
pub(crate) struct Simulated {
    pub(crate) recording: Recording,
    pub(crate) format: CsvFormat,
    pub(crate) notices: Vec<String>,
}

/// Simulates the test that the options ask for.
pub(crate) fn simulate(args: &SimulateArgs, seed: RootSeed) -> Result<Simulated> {
    let mut machine = read_machine(&args.test.model)?;
    if let MachineModel::Actuator(model) = &mut machine {
        short_turns(args, model)?;
    }
    check_faults(args, &machine)?;
    let format = axis_csv_format(machine.geometry());
    let (recording, visited) = match &machine {
        MachineModel::Actuator(model) => actuator(args, model, seed)?,
        MachineModel::ServoAxis(model) => axis(args, model, seed)?,
    };
    let notices = departures(machine.effects(), machine.geometry(), &visited);
    Ok(Simulated { recording, format, notices })
}

/// Closes the shorted turns of a model over the resistance that the options give.
fn short_turns(args: &SimulateArgs, model: &mut Model) -> Result<()> {
    let Some(resistance_ohm) = args.short_resistance_ohm else { return Ok(()) };
    if args.fidelity == Fidelity::Low {
        bail!("`--short-resistance-ohm`: in the low-fidelity model shorted turns are gone");
    }
    if args.faults.0[2..5] == [0.0; 3] {
        bail!("`--short-resistance-ohm`: no turns are shorted; give k3, k4 or k5 in `--faults`");
    }
    let turns = &mut model.actuator.motor.shorted_turns;
    let leakage_ratio = args.short_leakage_ratio.unwrap_or_else(|| turns.leakage_ratio());
    *turns = ShortedTurns::closed_over(resistance_ohm).with_leakage_ratio(leakage_ratio);
    Ok(model.actuator.check()?)
}

/// Refuses faults that the machine cannot have, or that its model does not list.
fn check_faults(args: &SimulateArgs, machine: &MachineModel) -> Result<()> {
    let model = &args.test.model;
    machine.check_faults(&args.faults.0).map_err(|refused| match refused {
        FaultRefused::Impossible { fault, reason } => {
            let symbol = fault.symbol();
            anyhow::Error::new(reason).context(format!("`--faults {symbol}=…`: {model}"))
        }
        FaultRefused::NotListed { fault } => {
            let symbol = fault.symbol();
            anyhow!("`--faults {symbol}=…`: `faults` of {model} does not list {symbol}")
        }
        other => anyhow::Error::new(other).context(format!("`--faults`: {model}")),
    })
}

/// A servo axis; it has no phases, and one model.
fn axis(
    args: &SimulateArgs,
    model: &AxisModel,
    seed: RootSeed,
) -> Result<(Recording, VisitedRange)> {
    for (given, option, why) in [
        (args.adc_bits.is_some(), "--adc-bits", "has no phases to digitise"),
        (args.short_resistance_ohm.is_some(), "--short-resistance-ohm", "has no turns to short"),
        (args.motor_voltage, "--motor-voltage", "has no current loop"),
        (args.ideal_electronics, "--ideal-electronics", "has no noise in its loops"),
        (args.rate_hz.is_some(), "--rate-hz", "is recorded at the rate of its controller"),
        (args.fidelity == Fidelity::Low, "--fidelity low", "has one model"),
    ] {
        if given {
            bail!("`{option}`: {} is a servo axis, which {why}", args.test.model);
        }
    }
    let test = experiment::axis_test(model, &args.test)?;
    let (recording, visited) =
        test.record(model, &HealthState::new(args.faults.0)?, "simulated")?;
    if args.noise_a == 0.0 {
        return Ok((recording, visited));
    }
    let sensor_seed = seed.derive(Purpose::SensorNoise, 0);
    let Some(noisy) = with_current_noise(&recording, args.noise_a, sensor_seed)? else {
        bail!("`--noise-a`: {} is a servo axis whose current is not recorded", args.test.model);
    };
    Ok((noisy, visited))
}

/// An actuator with three phases.
fn actuator(
    args: &SimulateArgs,
    model: &Model,
    seed: RootSeed,
) -> Result<(Recording, VisitedRange)> {
    let experiment = experiment::experiment_of(model, &args.test)?;
    let controller = &experiment.actuator.controller;
    let of_drive = |bits| Converter::of_drive(u32::from(bits), args.adc_range_a, controller);
    let converter = args.adc_bits.map(of_drive);
    let imperfections =
        if args.ideal_electronics { Imperfections::NONE } else { Imperfections::REAL };
    let simulated = SimulatedRecording {
        faults: HealthState::new(args.faults.0)?.coordinates(),
        start_angle_rad: args.test.start_angle_rad,
        imperfections,
        controller_seed: seed.derive(Purpose::ControllerNoise, 0),
        sensors: PhaseSensors { noise_a: args.noise_a, converter },
        phase_rate_hz: args.rate_hz,
        sensor_seed: seed.derive(Purpose::SensorNoise, 0),
        content: RecordedContent::Phases,
        has_voltage: args.motor_voltage,
    };
    if args.motor_voltage && args.fidelity == Fidelity::Low {
        bail!("`--motor-voltage`: the low-fidelity model has no current loop");
    }
    let recorded = match args.fidelity {
        Fidelity::High => simulated.record_visited(&experiment, "simulated"),
        Fidelity::Low => simulated.record_low_fidelity_visited(&experiment, "simulated"),
    };
    recorded.map_err(|error| match error {
        SimulatedRecordingError::TooFast { rate_hz, most_hz, duration_s } => {
            anyhow!("`--rate-hz` is {rate_hz}, expected at most {most_hz} for {duration_s} s")
        }
        other => other.into(),
    })
}

/// Effects whose valid range the simulation left.
fn departures(effects: &[EffectBlock], geometry: Geometry, visited: &VisitedRange) -> Vec<String> {
    let of = |block: &EffectBlock| {
        let left = block.valid_range().unwrap_or_default().left_by(visited);
        let (symbol, known) = (block.effect.id().info().symbol, block.effect.id().info().name);
        let name = block.name.clone().unwrap_or_else(|| known.to_owned());
        left.into_iter().map(move |departure| {
            let ([from, to], [least, most]) = (departure.valid, departure.visited);
            let (what, unit) = (departure.of.name(), departure.of.unit(geometry));
            format!(
                "effect {symbol} ({name}) is known for a {what} from {from} to {to} {unit}, and \
                 the simulation goes from {least:.4} to {most:.4}"
            )
        })
    };
    effects.iter().flat_map(of).collect()
}
