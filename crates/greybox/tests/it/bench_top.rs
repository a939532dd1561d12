//! A small servo on a bench top: its model, recordings of it with something hidden, noise.

use ema_sim::{
    AxisInput, AxisScenario, AxisStart, Command, Effect, FaultId, FaultLevel, HealthState, Load,
    ServoAxisSimulation,
    model_file::{AxisModel, MachineModel, parse_machine},
};
use greybox::{CommandKind, Record, Recordings};
use rand::{RngExt, SeedableRng, distr::Open01};
use rand_chacha::ChaCha8Rng;

const RATE_HZ: f64 = 1000.0;

pub(crate) fn model() -> MachineModel {
    parse_machine(include_str!("bench_top.toml")).expect("the model of the test is one")
}

/// What is true of a machine beside its model.
#[derive(Clone, Debug, Default)]
pub(crate) struct Truth {
    pub(crate) effects: Vec<Effect>,
    pub(crate) k1: f64,
    /// Relative error of inertia and drag.
    pub(crate) rough: [f64; 2],
    /// Relative errors of kinetic and static friction, which the model has no tolerance for.
    pub(crate) friction: [f64; 2],
    pub(crate) seed: u64,
    /// A torque that changes its sign at random, at other times in each take.
    pub(crate) telegraph_n_m: f64,
    /// Whether nothing is noisy.
    pub(crate) quiet: bool,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Motion {
    Waves,
    Ramps,
    Chirp,
    /// There and back without a rest.
    Back,
    /// One way at a steady speed.
    OneWay,
}

impl Motion {
    fn at(self, time_s: f64) -> (f64, f64) {
        use core::f64::consts::TAU;
        let t = time_s - 0.4;
        if t < 0.0 {
            return (0.0, 0.0);
        }
        let wave = |amplitude: f64, hz: f64| amplitude * libm::sin(TAU * hz * t);
        match self {
            Self::Waves => {
                let load = if libm::floor(0.5 * t) % 2.0 == 0.0 { 0.05 } else { -0.03 };
                (wave(2.0, 0.3) + wave(0.6, 1.1) + wave(0.2, 2.7), load)
            }
            Self::OneWay => (1.2 * t, 0.0),
            Self::Ramps => {
                let phase = t % 3.0;
                let ramp = if phase < 1.5 { phase } else { 3.0 - phase };
                (4.0 / 1.5 * ramp + wave(0.1, 5.0), 0.0)
            }
            Self::Back => {
                let phase = (t + 0.5) % 2.0;
                (2.0 * if phase < 1.0 { phase } else { 2.0 - phase } - 1.0, 0.0)
            }
            Self::Chirp => (wave(3.0, 0.4) + wave(0.3, 0.5 + 0.4 * t), 0.04 * libm::sin(1.3 * t)),
        }
    }
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    let radius = libm::sqrt(-2.0 * libm::log(random.sample::<f64, _>(Open01)));
    radius * libm::cos(core::f64::consts::TAU * random.sample::<f64, _>(Open01))
}

fn telegraph(truth: &Truth, samples: usize, take: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(truth.seed ^ 0x7e1e);
    random.set_stream(take);
    let mut torque = truth.telegraph_n_m;
    (0..samples)
        .map(|_| {
            if random.random::<f64>() < 3.0 / RATE_HZ {
                torque = -torque;
            }
            torque
        })
        .collect()
}

/// One recording; `take` makes its noise differ.
pub(crate) fn record(truth: &Truth, motion: Motion, seconds: f64, take: u64) -> Record {
    let MachineModel::ServoAxis(AxisModel { mut axis, .. }) = model() else {
        unreachable!("the model of the test is a servo axis");
    };
    axis.inertia *= 1.0 + truth.rough[0];
    axis.viscous *= 1.0 + truth.rough[1];
    axis.kinetic_friction *= 1.0 + truth.friction[0];
    axis.static_friction *= 1.0 + truth.friction[1];
    let samples = libm::round(seconds * RATE_HZ) as usize;
    let (command, load): (Vec<f64>, Vec<f64>) =
        (0..samples).map(|n| motion.at(n as f64 / RATE_HZ)).unzip();
    let scenario = AxisScenario {
        input: AxisInput::Position(Command::Recorded {
            values_rad: command.clone(),
            rate_hz: RATE_HZ,
        }),
        load: 0.0,
        duration_s: seconds,
        start: AxisStart::default(),
    };
    let values_n_m = load.iter().zip(telegraph(truth, samples, take)).map(|(l, t)| l + t).collect();
    let trace = ServoAxisSimulation::new(&axis, &scenario)
        .and_then(|axis| axis.with_effects(&truth.effects))
        .and_then(|axis| axis.with_load(Load::Recorded { values_n_m, rate_hz: RATE_HZ }))
        .expect("the test can be simulated");
    let worn = FaultLevel::new(truth.k1).expect("a level");
    let trace = trace.simulate(&(&HealthState::HEALTHY.with(FaultId::Friction, worn)).into());
    let mut random = ChaCha8Rng::seed_from_u64(truth.seed);
    random.set_stream(take);
    let mut noise = 0.0;
    let mut noisy = |value: &f64| {
        noise = 0.5 * noise + 0.015 * normal(&mut random);
        if truth.quiet { *value } else { value + noise }
    };
    let drive = trace.current.iter().map(&mut noisy).collect();
    Record {
        name: format!("{motion:?} {take}"),
        rate_hz: RATE_HZ,
        command,
        kind: CommandKind::Position,
        drive,
        position: Some(trace.position),
        load: Some(load),
        filter_hz: None,
        start_rad: None,
    }
}

/// Two recordings to train on, one held out, one repeated.
pub(crate) fn recordings(truth: &Truth) -> Recordings {
    Recordings {
        train: vec![record(truth, Motion::Waves, 6.0, 0), record(truth, Motion::Ramps, 5.0, 1)],
        holdout: vec![record(truth, Motion::Chirp, 5.0, 2)],
        repeat: vec![record(truth, Motion::Waves, 6.0, 3)],
    }
}
