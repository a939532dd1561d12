//! The seam between the command line and the simulation.

use anyhow::{Result, bail};
use fdi_core::{
    Purpose, RecordedContent, Recording, RootSeed, SimulatedRecording,
    ema_sim::{Converter, FaultId, HealthState, Imperfections, PhaseSensors},
};

use crate::{
    args::{FidelityArg, SimulateArgs},
    experiment,
};

/// The recording that the options ask for.
pub(crate) fn simulate(args: &SimulateArgs, seed: RootSeed) -> Result<Recording> {
    let (experiment, faults) = experiment::experiment(&args.test)?;
    // k7 is the direction of k6 and no damage of its own
    for fault in FaultId::ALL.into_iter().take(FaultId::EccentricityPhase.index()) {
        if args.faults.0[fault.index()] > 0.0 && !faults.contains(&fault) {
            let (symbol, model) = (fault.symbol(), &args.test.model);
            bail!("`--faults {symbol}=…`: `faults` of {model} does not list {symbol}");
        }
    }
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
        FidelityArg::High => simulated.record(&experiment, "simulated")?,
        FidelityArg::Low => simulated.record_low_fidelity(&experiment, "simulated")?,
    })
}
