//! Recordings of a machine in sessions of four, with the motor's voltage, answered together.

use anyhow::{Context, Result};
use fdi_core::{
    Bundle, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Experiment, Purpose, RecordedContent,
    Recording, RootSeed, SimulatedRecording, ToleranceUse, diagnose_together,
    ema_sim::{HealthState, Imperfections, PhaseSensors},
};

use super::over;
use crate::{
    processor::{processor_s, reference_s},
    terminal::say,
};

/// Recordings of a session, and of all.
const OF_SESSION: usize = 4;
const RECORDINGS: usize = 16;
/// Damage of the machine.
const LEVELS: [f64; 7] = [0.0, 0.0, 0.006, 0.0, 0.0, 0.0, 0.0];
const NOISE_A: f64 = 0.020;
const SEED: u64 = 20_261_127;

/// A test whose recordings are answered together.
struct Together {
    name: &'static str,
    /// Place of the bundle among the embedded ones.
    bundle: usize,
    /// Evaluations of the low-fidelity model for all of them.
    evaluations: u64,
    /// Most processor time of all, reading the bundle included, in runs of the reference loop: about
    /// twice the ratio that was measured when the budget was set.
    limit_ratio: f64,
}

const TESTS: [Together; 2] = [
    Together { name: "16 chirps together", bundle: 0, evaluations: 1060, limit_ratio: 3.0 },
    Together { name: "16 planned tests together", bundle: 2, evaluations: 1176, limit_ratio: 10.0 },
];

/// Budgets that are exceeded.
pub(super) fn exceeded() -> Result<Vec<String>> {
    let told = TESTS.iter().map(Together::exceeded).collect::<Result<Vec<_>>>()?;
    Ok(told.into_iter().flatten().collect())
}

/// Recordings of a worn machine.
pub(crate) fn recordings(test: &Experiment, count: usize) -> Result<Vec<Recording>> {
    let record = |place: usize| {
        let simulated = SimulatedRecording {
            faults: HealthState::new(LEVELS)?.coordinates(),
            start_angle_rad: 0.0,
            imperfections: Imperfections::REAL,
            controller_seed: RootSeed(SEED).derive(Purpose::Fixture, 2 * place as u64),
            sensors: PhaseSensors { noise_a: NOISE_A, converter: None },
            phase_rate_hz: None,
            sensor_seed: RootSeed(SEED).derive(Purpose::Fixture, 2 * place as u64 + 1),
            content: RecordedContent::Phases,
            has_voltage: true,
        };
        let mut recording = simulated.record(test, &place.to_string())?;
        recording.metadata.session = Some((place / OF_SESSION).to_string());
        Ok(recording)
    };
    (0..count).map(record).collect()
}

/// Cost of an answer to recordings together, reading the bundle included.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cost {
    /// Processor time, s.
    pub(crate) took_s: f64,
    /// Processor time in runs of the reference loop.
    pub(crate) ratio: f64,
    /// Evaluations of the low-fidelity model.
    pub(crate) evaluations: u64,
}

/// Answers recordings together by a bundle's bytes.
pub(crate) fn cost(bytes: &[u8], recordings: &[Recording]) -> Result<Cost> {
    let options = DiagnoseOptions { tolerance: ToleranceUse::Model, ..DiagnoseOptions::default() };
    let before_s = reference_s();
    let start_s = processor_s();
    let diagnoser = Diagnoser::new(Bundle::from_bytes(bytes)?)?;
    let alone = recordings.iter().map(|recording| {
        diagnoser.diagnose_alone(recording, &options).context("a recording whose cost is asked for")
    });
    let answer = diagnose_together(&alone.collect::<Result<Vec<_>>>()?)?;
    let took_s = processor_s() - start_s;
    let ratio = took_s / before_s.min(reference_s());
    Ok(Cost { took_s, ratio, evaluations: answer.evaluations })
}

impl Together {
    fn exceeded(&self) -> Result<Option<String>> {
        let Self { name, bundle, evaluations, limit_ratio } = self;
        let bytes = EMBEDDED_BUNDLES[*bundle].bytes;
        let recordings = recordings(&Bundle::experiment_from_bytes(bytes)?, RECORDINGS)?;
        let Cost { took_s, ratio, evaluations: runs } = cost(bytes, &recordings)?;
        say(&format!("{name:<28} {runs:>6} {took_s:>12.3} {ratio:>9.2} {limit_ratio:>9.2}"));
        Ok(if runs == *evaluations {
            over(name, ratio, *limit_ratio)
        } else {
            Some(format!("{name}: {runs} evaluations, {evaluations} expected"))
        })
    }
}
