//! `docs/validation/fidelity.md`: what the low-fidelity model leaves out of the high-fidelity one,
//! found from recordings of the latter, and what that does to the diagnosis.

use std::fmt::Write as _;

use anyhow::{Context, Result, bail};
use ema_sim::{
    Effect, FaultCoordinates, HealthState, Imperfections, PhaseSensors, PhysicalFaults,
    model_file::{MachineModel, Model},
    presets::EMA_48,
};
use fdi_core::{
    Bundle, Condition, Dataset, DatasetRequest, DiagnoseOptions, Diagnoser, Experiment,
    RecordedContent, Recording, ReferenceDesign, RootSeed, SimulatedRecording,
};
use greybox::{CommandKind, Explained, Options, Record, Recordings, explain, rms};

use super::{bar::met, figure::Figure, measured::verdict};
use crate::median::median;

/// Root seed of conditions and noise.
const SEED: u64 = 1;
/// Threads.
const JOBS: usize = 2;
/// Rate of the commands, Hz, and length of each, s.
const RATE_HZ: f64 = 10e3;
const TEST_S: f64 = 4.0;
const LOAD_N_M: f64 = 0.5;
/// Recordings that are diagnosed, and reference signals that an offset is learnt from.
const DIAGNOSED: usize = 30;
const LEARNT: usize = 60;
/// Noise on each phase sample of a recording, A.
const NOISE_A: f64 = 0.01;
/// Simulations alone agree to rounding.
const SIMULATED_REL: f64 = 1e-6;

/// A way to move, rad over s.
struct Move {
    name: &'static str,
    position_rad: fn(f64) -> f64,
}

const TRAINED: [Move; 2] = [
    Move { name: "two sines", position_rad: |t| 0.011 * ((5.3 * t).sin() + (14.1 * t).sin()) },
    Move { name: "out and back", position_rad: |t| 0.015 * (1.0 - (4.2 * t).cos()) },
];
const HELD_OUT: Move =
    Move { name: "triangle", position_rad: |t| 0.01 * (0.98 * (5.0 * t).sin()).asin() };

impl Move {
    fn test(&self, name: &str, model: &Model) -> Result<Experiment> {
        let samples = (TEST_S * RATE_HZ) as usize;
        let command = (0..samples).map(|n| (self.position_rad)(n as f64 / RATE_HZ)).collect();
        let mut test = Experiment::recorded(command, RATE_HZ);
        test.scenario.load_n_m = LOAD_N_M;
        Ok(test.of_model(name, model)?)
    }
}

/// Signals of a healthy machine in high fidelity.
fn high(test: &Experiment, electronics: Imperfections, seed: u64) -> Result<Vec<f64>> {
    let model = test.high_fidelity(0.0, electronics)?.with_seed(seed);
    let healthy = PhysicalFaults::from(&HealthState::HEALTHY);
    Ok(test.high_fidelity_signal(&model, &healthy))
}

/// Root mean square of high less low fidelity of the healthy machine in the test held out.
fn gap_a(model: &Model, electronics: Imperfections) -> Result<f64> {
    let nominal = HELD_OUT.test("ema-48", &Model::from(EMA_48))?;
    let own = HELD_OUT.test("ema-48", model)?;
    let low = own.monitor(0.0)?.signal(&FaultCoordinates([0.0; 7]));
    let high = high(&nominal, electronics, SEED)?;
    Ok(rms(&high.iter().zip(&low).map(|(h, l)| h - l).collect::<Vec<_>>()))
}

/// Root mean square of what the electronics make of one test from seed to seed, of one run.
fn seed_to_seed_a() -> Result<f64> {
    let test = HELD_OUT.test("ema-48", &Model::from(EMA_48))?;
    let [a, b] = [SEED, SEED + 1].map(|seed| high(&test, Imperfections::REAL, seed));
    let apart: Vec<f64> = a?.iter().zip(b?).map(|(a, b)| a - b).collect();
    Ok(rms(&apart) / core::f64::consts::SQRT_2)
}

/// A recording of a healthy machine in high fidelity, its envelope filtered as for a diagnosis.
fn record(moved: &Move, electronics: Imperfections, seed: u64) -> Result<Record> {
    let test = moved.test("ema-48", &Model::from(EMA_48))?;
    let model = test.high_fidelity(0.0, electronics)?.with_seed(seed);
    let trace = model.simulate(&PhysicalFaults::from(&HealthState::HEALTHY));
    let envelope = trace.envelope_a(test.envelope, test.actuator.motor.pole_pairs);
    let drive = test.filter.apply(&envelope, trace.rate_hz);
    let step = (trace.rate_hz / test.filter.output_hz).round() as usize;
    let every = |values: &[f64]| -> Vec<f64> {
        values.iter().step_by(step).take(drive.len()).copied().collect()
    };
    Ok(Record {
        name: moved.name.to_owned(),
        rate_hz: test.filter.output_hz,
        command: every(&trace.command_rad),
        kind: CommandKind::Position,
        position: Some(every(&trace.motor_angle_rad)),
        load: Some(vec![LOAD_N_M; drive.len()]),
        drive,
        filter_hz: Some(test.filter.corner_hz),
        start_rad: None,
    })
}

fn explained(electronics: Imperfections) -> Result<Explained> {
    let repeat = if electronics == Imperfections::NONE {
        Vec::new()
    } else {
        vec![record(&TRAINED[0], electronics, SEED + 10)?]
    };
    let train = TRAINED.iter().zip(SEED..).map(|(moved, seed)| record(moved, electronics, seed));
    let recordings = Recordings {
        train: train.collect::<Result<_>>()?,
        holdout: vec![record(&HELD_OUT, electronics, SEED + 20)?],
        repeat,
    };
    let options = Options { jobs: JOBS, ..Options::default() };
    Ok(explain(&MachineModel::Actuator(Model::from(EMA_48)), &recordings, &options)?)
}

fn extended(explained: &Explained) -> Result<Model> {
    match explained.extend(&MachineModel::Actuator(Model::from(EMA_48))) {
        MachineModel::Actuator(model) => Ok(model),
        MachineModel::ServoAxis(_) => bail!("an actuator stays one"),
    }
}

/// An effect by symbol and name, of a ripple with its order.
fn in_words(effect: &Effect) -> String {
    let info = effect.id().info();
    let order = effect.get("order").map_or_else(String::new, |order| format!(" of order {order}"));
    format!("{} {}{order}", info.symbol, info.name)
}

/// Healthy and damaged machines in high fidelity with the electronics off or on: signals that an
/// offset is learnt from, and recordings that are diagnosed.
struct HighSignals {
    references: Dataset,
    recordings: Vec<(Condition, Recording)>,
}

impl HighSignals {
    fn new(electronics: Imperfections) -> Result<Self> {
        let nominal = Experiment::chirp();
        let learnt = DatasetRequest {
            design: ReferenceDesign::Incipient,
            conditions: LEARNT,
            seed: SEED,
            imperfections: electronics,
            jobs: JOBS,
        };
        let diagnosed = DatasetRequest {
            design: ReferenceDesign::Test,
            conditions: DIAGNOSED,
            seed: SEED + 1,
            ..learnt
        };
        let references = Dataset::generate(&nominal, &learnt)?;
        let mut recordings = Vec::new();
        for (place, condition) in Dataset::conditions(&nominal, &diagnosed)?.into_iter().enumerate()
        {
            let recording = SimulatedRecording {
                faults: condition.coordinates(),
                start_angle_rad: condition.start_angle_rad,
                imperfections: electronics,
                controller_seed: condition.noise_seed,
                sensors: PhaseSensors { noise_a: NOISE_A, converter: None },
                phase_rate_hz: None,
                sensor_seed: SEED + 1000 + place as u64,
                content: RecordedContent::Phases,
                has_voltage: false,
            }
            .record(&nominal, "test")?;
            recordings.push((condition, recording));
        }
        Ok(Self { references, recordings })
    }

    /// The reference signals as the low-fidelity model itself gives them: nothing is learnt from
    /// these.
    fn low(&self, experiment: &Experiment) -> Result<Dataset> {
        let mut monitor = experiment.monitor(experiment.scenario.start_angle_rad)?;
        let of = |condition: &Condition| monitor.signal(&condition.coordinates());
        let signals_a = self.references.conditions.iter().map(of).collect();
        Ok(Dataset { signals_a, ..self.references.clone() })
    }

    /// Median errors of `k1` and `k2` in a diagnosis by one low-fidelity model: as it is, or with
    /// the mean of its error learnt from the reference signals.
    fn errors(&self, model: &Model, learnt: bool) -> Result<[f64; 2]> {
        let experiment = Experiment::chirp().of_model("ema-48", model)?;
        let references = if learnt { self.references.clone() } else { self.low(&experiment)? };
        let bundle = Bundle::build(&experiment, vec![references], NOISE_A, RootSeed(SEED))?;
        let diagnoser = Diagnoser::new(bundle)?;
        let options = DiagnoseOptions { noise_a: Some(NOISE_A), ..DiagnoseOptions::default() };
        let mut errors = [Vec::new(), Vec::new()];
        for (condition, recording) in &self.recordings {
            let answer = diagnoser.diagnose(recording, &options)?;
            for (fault, errors) in errors.iter_mut().enumerate() {
                let value = answer.faults[fault].value.context("a level")?;
                errors.push((value - condition.levels[fault]).abs());
            }
        }
        Ok(errors.map(|errors| median(&errors)))
    }
}

/// Gap of the healthy machine, and what the electronics do from seed to seed: seconds.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let figure = |id: &str, value: f64| Figure {
        id: id.to_owned(),
        value,
        tolerance_rel: SIMULATED_REL,
        unit: "A".to_owned(),
    };
    let nominal = Model::from(EMA_48);
    Ok(vec![
        figure("gap-electronics-off", gap_a(&nominal, Imperfections::NONE)?),
        figure("gap-electronics-on", gap_a(&nominal, Imperfections::REAL)?),
        figure("seed-to-seed", seed_to_seed_a()?),
    ])
}

const ELECTRONICS: [(&str, Imperfections); 2] =
    [("off", Imperfections::NONE), ("on", Imperfections::REAL)];

pub(super) fn text(figures: &[Figure]) -> Result<String> {
    let mut page = include_str!("fidelity/head.md").to_owned();
    let value = |id: &str| figures.iter().find(|f| f.id == id).map(|f| f.value);
    let floor_a = value("seed-to-seed").context("a figure")?;
    let mut found = Vec::new();
    for (name, electronics) in ELECTRONICS {
        let explained = explained(electronics)?;
        let model = extended(&explained)?;
        found.push((name, electronics, explained, model));
    }
    page.push_str(include_str!("fidelity/found.md"));
    for (name, _, explained, _) in &found {
        let [before, after] = explained.holdout_rms.context("recordings held out")?;
        let floor = explained.noise_floor.context("a floor")?.rms;
        let named: Vec<String> = explained.effects.iter().map(|f| in_words(&f.effect)).collect();
        let named = if named.is_empty() { "nothing".to_owned() } else { named.join(", ") };
        writeln!(
            page,
            "| {name} | {} | {named} | {:.2} | {:.2} | {:.2} |",
            verdict(explained.verdict),
            1e3 * before,
            1e3 * after,
            1e3 * floor
        )?;
    }
    page.push_str(include_str!("fidelity/gap.md"));
    for (name, electronics, _, model) in &found {
        let before = gap_a(&Model::from(EMA_48), *electronics)?;
        let after = gap_a(model, *electronics)?;
        let floor = if *electronics == Imperfections::NONE { 0.0 } else { floor_a };
        let above = |gap: f64| (gap * gap - floor * floor).max(0.0).sqrt();
        let left = above(after) / above(before);
        writeln!(
            page,
            "| {name} | {:.2} | {:.2} | {:.2} | {left:.2} | {} |",
            1e3 * before,
            1e3 * after,
            1e3 * floor,
            met(left <= 0.5)
        )?;
    }
    page.push_str(include_str!("fidelity/diagnosis.md"));
    let mut are_cut = true;
    for (name, electronics, _, model) in &found {
        let signals = HighSignals::new(*electronics)?;
        for (learnt, offset) in [(false, "none"), (true, "learnt anew")] {
            let nominal = signals.errors(&Model::from(EMA_48), learnt)?;
            let extended = signals.errors(model, learnt)?;
            let ([a, b], [c, d]) = (nominal, extended);
            are_cut &= learnt || (c < a && d < b);
            writeln!(page, "| {name} | {offset} | {a:.5} | {c:.5} | {b:.5} | {d:.5} |")?;
        }
    }
    writeln!(
        page,
        "\nAsked for: without an offset the extended model cuts the errors of k1 and k2: {}.",
        met(are_cut)
    )?;
    page.push_str(include_str!("fidelity/foot.md"));
    Ok(page)
}
