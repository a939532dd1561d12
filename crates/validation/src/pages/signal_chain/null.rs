//! Sound recordings that are simulated: healthy axes, and axes with one effect of the catalogue.

use anyhow::{Result, bail};
use ema_sim::{
    AxisInput, AxisScenario, AxisStart, Command, Effect, EffectId, Geometry, HealthState,
    ServoAxisSimulation,
    model_file::{MachineModel, parse_machine},
};
use greybox::{CommandKind, Record, Recordings, SignalFind, check_signals};

use crate::pages::chance::Chance;

const RATE_HZ: f64 = 2000.0;
/// Length of a recording, s.
const SECONDS: f64 = 6.0;
/// Noise of the current and step of its converter: 12 bits over 16 A.
const NOISE_A: f64 = 0.02;
const STEP_A: f64 = 16.0 / 4096.0;
/// Sines of a command.
const SINES: usize = 4;

/// The axis of the guide.
fn model() -> Result<MachineModel> {
    Ok(parse_machine(include_str!("../../../../../fixtures/models/axis.toml"))?)
}

/// Effects that one hidden each: sizes that are named on this axis.
pub(super) fn effects() -> Result<Vec<Effect>> {
    let of = |id: EffectId, numbers: &[(&str, f64)]| -> Result<Effect> {
        let mut effect = Effect::new(id, Geometry::Rotary);
        for (key, value) in numbers {
            effect = effect.with(key, *value)?;
        }
        Ok(effect)
    };
    Ok(vec![
        of(EffectId::Stribeck, &[("stribeck_n_m", 0.01), ("stribeck_speed_rad_per_s", 1.0)])?,
        of(EffectId::DirectionalFriction, &[("viscous_asymmetry_n_m_s_per_rad", 2e-4)])?,
        of(EffectId::Presliding, &[("presliding_rad", 0.02)])?,
        of(EffectId::TransmissionError, &[("error_sin_rad", 2e-3), ("order", 10.0)])?,
        of(EffectId::Cogging, &[("cogging_sin_n_m", 0.006), ("order", 12.0)])?,
        of(EffectId::CurrentRipple, &[("ripple_sin_ratio", 0.15), ("order", 6.0)])?,
        of(EffectId::MagnetLoss, &[("torque_constant_loss_ratio", 0.2)])?,
        of(EffectId::CurrentSensor, &[("gain_error_ratio", 0.2)])?,
        of(EffectId::CurrentSensor, &[("lag_s", 2e-3)])?,
        of(EffectId::PositionSensor, &[("eccentricity_sin_rad", 5e-3)])?,
        of(EffectId::ControllerMismatch, &[("speed_gain_error_ratio", 0.3)])?,
        of(EffectId::ControllerMismatch, &[("delay_s", 1e-3)])?,
        of(EffectId::Vibration, &[("vibration_sin_n_m", 6e-3), ("frequency_hz", 17.0)])?,
    ])
}

/// A recording of a random sum of sines.
fn record(name: &str, effects: &[Effect], chance: &mut Chance) -> Result<Record> {
    let MachineModel::ServoAxis(model) = model()? else { bail!("`axis.toml` is a servo axis") };
    let sines: Vec<[f64; 3]> = (0..SINES)
        .map(|_| {
            let hz = 0.2 * 10.0_f64.powf(chance.uniform());
            [hz, (0.3 + chance.uniform()) / hz, core::f64::consts::TAU * chance.uniform()]
        })
        .collect();
    let samples = (SECONDS * RATE_HZ) as usize;
    let at = |n: usize| {
        let t = n as f64 / RATE_HZ;
        let of = |[hz, amplitude, phase]: &[f64; 3]| {
            amplitude * ((core::f64::consts::TAU * hz * t + phase).sin() - phase.sin())
        };
        sines.iter().map(of).sum::<f64>()
    };
    let command: Vec<f64> = (0..samples).map(at).collect();
    let scenario = AxisScenario {
        input: AxisInput::Position(Command::Recorded {
            values_rad: command.clone(),
            rate_hz: RATE_HZ,
        }),
        load: 0.0,
        duration_s: SECONDS,
        start: AxisStart::default(),
    };
    let trace = ServoAxisSimulation::new(&model.axis, &scenario)?
        .with_effects(effects)?
        .try_simulate(&(&HealthState::HEALTHY).into())?;
    let drive = trace.current.iter().map(|current| {
        let noisy = current + NOISE_A * chance.normal();
        STEP_A * (noisy / STEP_A).round()
    });
    Ok(Record {
        name: name.to_owned(),
        rate_hz: RATE_HZ,
        command,
        kind: CommandKind::Position,
        drive: drive.collect(),
        position: Some(trace.position),
        load: None,
        filter_hz: None,
        start_rad: None,
    })
}

/// Finds on a sound set: two recordings to fit, one held out.
pub(super) fn finds(effects: &[Effect], seed: u64) -> Result<Vec<SignalFind>> {
    let mut chance = Chance::new(seed);
    let train =
        vec![record("first", effects, &mut chance)?, record("second", effects, &mut chance)?];
    let holdout = vec![record("third", effects, &mut chance)?];
    let recordings = Recordings { train, holdout, repeat: Vec::new() };
    Ok(check_signals(&model()?, &recordings, super::JOBS)?)
}
