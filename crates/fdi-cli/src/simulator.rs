//! The seam between the command line and the simulation.

use anyhow::{Context, Result, bail};
use fdi_core::{
    Channel, ChannelName, CsvFormat, Purpose, RecordedContent, Recording, RootSeed,
    SimulatedRecording,
    ema_sim::{
        Converter, FaultId, Geometry, HealthState, Imperfections, PhaseSensors, VisitedRange,
        model_file::{AxisModel, EffectBlock, MachineModel, Model},
    },
    read_machine,
    report::Fidelity,
};

use crate::{args::SimulateArgs, experiment};

/// Beyond the converters of any drive.
const FASTEST_PHASES_HZ: f64 = 1e7;
/// Samples of a recording: those of a simulated hour at 10 kHz.
const MOST_SAMPLES: f64 = 4e7;

/// A simulated recording, with what is to be said of it.
pub(crate) struct Simulated {
    pub(crate) recording: Recording,
    pub(crate) format: CsvFormat,
    pub(crate) notices: Vec<String>,
}

/// Simulates the test that the options ask for.
pub(crate) fn simulate(args: &SimulateArgs, seed: RootSeed) -> Result<Simulated> {
    let machine = read_machine(&args.test.model)?;
    check_faults(args, &machine)?;
    let mut format = CsvFormat::default();
    if machine.geometry() == Geometry::Linear {
        // encoders of a linear axis resolve nanometres
        format.value_decimals = 9;
    }
    let (recording, visited) = match &machine {
        MachineModel::Actuator(model) => actuator(args, model, seed)?,
        MachineModel::ServoAxis(model) => axis(args, model, seed)?,
    };
    let notices = departures(machine.effects(), machine.geometry(), &visited);
    Ok(Simulated { recording, format, notices })
}

/// Refuses faults that an axis cannot have, or that the model does not list.
fn check_faults(args: &SimulateArgs, machine: &MachineModel) -> Result<()> {
    // k7 is the direction of k6 and no damage of its own
    for fault in FaultId::ALL.into_iter().take(FaultId::EccentricityPhase.index()) {
        if args.faults.0[fault.index()] > 0.0 {
            let (symbol, model) = (fault.symbol(), &args.test.model);
            if let MachineModel::ServoAxis(axis) = machine {
                axis.axis
                    .check_fault(fault)
                    .with_context(|| format!("`--faults {symbol}=…`: {model}"))?;
            }
            if !machine.faults().contains(&fault) {
                bail!("`--faults {symbol}=…`: `faults` of {model} does not list {symbol}");
            }
        }
    }
    Ok(())
}

/// A servo axis; it has no phases, and one model.
fn axis(
    args: &SimulateArgs,
    model: &AxisModel,
    seed: RootSeed,
) -> Result<(Recording, VisitedRange)> {
    for (given, option, why) in [
        (args.adc_bits.is_some(), "--adc-bits", "has no phases to digitise"),
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
    if recording.channel(ChannelName::QAxisCurrent).is_none() {
        bail!("`--noise-a`: {} is a servo axis whose current is not recorded", args.test.model);
    }
    let sensor = PhaseSensors { noise_a: args.noise_a, converter: None };
    let measured = |channel: &Channel| {
        if channel.name() != ChannelName::QAxisCurrent {
            return Ok(channel.clone());
        }
        let seed = seed.derive(Purpose::SensorNoise, 0);
        let [current_a, _, _] = sensor.measure([channel.values(), &[], &[]], seed);
        Channel::new(channel.name(), channel.times_s(), current_a)
    };
    let channels = recording.channels().iter().map(measured).collect::<Result<_, _>>()?;
    Ok((Recording::new("simulated", recording.metadata.clone(), channels)?, visited))
}

/// Refuses more samples of the phases than a recording holds.
fn check_rate(args: &SimulateArgs, duration_s: f64) -> Result<()> {
    let most_hz = FASTEST_PHASES_HZ.min(MOST_SAMPLES / duration_s);
    match args.rate_hz {
        Some(rate_hz) if rate_hz > most_hz => {
            bail!("`--rate-hz` is {rate_hz}, expected at most {most_hz} for {duration_s} s")
        }
        _ => Ok(()),
    }
}

/// An actuator with three phases.
fn actuator(
    args: &SimulateArgs,
    model: &Model,
    seed: RootSeed,
) -> Result<(Recording, VisitedRange)> {
    let experiment = experiment::experiment_of(model, &args.test)?;
    check_rate(args, experiment.scenario.duration_s)?;
    let controller = &experiment.actuator.controller;
    let range_a = args.adc_range_a.unwrap_or(controller.current_limit_a);
    let converter = args.adc_bits.map(|bits| Converter { bits: u32::from(bits), range_a });
    let simulated = SimulatedRecording {
        faults: HealthState::new(args.faults.0)?.coordinates(),
        start_angle_rad: args.test.start_angle_rad,
        imperfections: Imperfections::REAL,
        controller_seed: seed.derive(Purpose::ControllerNoise, 0),
        sensors: PhaseSensors { noise_a: args.noise_a, converter },
        phase_rate_hz: Some(args.rate_hz.unwrap_or(controller.sample_hz)),
        sensor_seed: seed.derive(Purpose::SensorNoise, 0),
        content: RecordedContent::Phases,
    };
    Ok(match args.fidelity {
        Fidelity::High => simulated.record_visited(&experiment, "simulated")?,
        Fidelity::Low => simulated.record_low_fidelity_visited(&experiment, "simulated")?,
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
