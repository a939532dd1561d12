//! Reference datasets: designs of fault conditions through the high-fidelity model.

use std::{f64::consts::TAU, thread};

use ema_sim::{
    FAULT_COUNT, FaultCoordinates, HealthState, Imperfections, PhysicalFaults, SimulationError,
};
use gp_bayesopt::{Bounds, Design, DesignError};
use sha2::{Digest, Sha256};

use crate::{
    offline::store,
    seed::{Purpose, RootSeed},
    simulation::experiment::Experiment,
};

/// Which fault conditions a dataset holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ReferenceDesign {
    /// `k1..k6 = 0.05·u`, `k7 = u`, start angle of the experiment: what compression, offset and
    /// discrepancy are learnt on.
    Incipient,
    /// The ranges of `Incipient`, with at most two faults at a time and the others absent: the
    /// corner of the range where actuators are healthy or nearly so, which a Latin hypercube leaves
    /// empty.
    Sparse,
    /// `k1..k6 = 0.05·u`, `k7 = u`, start angle uniform over one mechanical turn.
    Turned,
    /// As [`Sparse`](Self::Sparse), start angle uniform over one mechanical turn.
    TurnedSparse,
    /// `k1..k6 = u³`, `k7 = u`: trust check and severe faults.
    Wide,
    /// `k1..k6 = 0.002 + 0.048·u`, `k7 = u`: the conditions that experiments are scored on.
    Test,
}

impl ReferenceDesign {
    /// Every design.
    pub const ALL: [Self; 6] =
        [Self::Incipient, Self::Sparse, Self::Turned, Self::TurnedSparse, Self::Wide, Self::Test];

    /// Name of the design in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Incipient => "incipient",
            Self::Sparse => "sparse",
            Self::Turned => "turned",
            Self::TurnedSparse => "turned-sparse",
            Self::Wide => "wide",
            Self::Test => "test",
        }
    }

    /// The design of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|design| design.name() == name)
    }

    /// True where the rotor starts anywhere.
    pub fn is_turned(self) -> bool {
        matches!(self, Self::Turned | Self::TurnedSparse)
    }

    /// True where most faults are absent.
    fn is_sparse(self) -> bool {
        matches!(self, Self::Sparse | Self::TurnedSparse)
    }

    /// Fault levels and start angle of a point of the unit cube.
    ///
    /// A design that is not turned starts where the experiment does.
    fn condition(self, experiment: &Experiment, unit: &[f64]) -> ([f64; FAULT_COUNT], f64) {
        let scaled = |u: f64| match self {
            Self::Wide => u * u * u,
            Self::Test => 0.002 + 0.048 * u,
            Self::Incipient | Self::Sparse | Self::Turned | Self::TurnedSparse => 0.05 * u,
        };
        let mut levels = HealthState::HEALTHY.levels();
        for fault in experiment.sought_indices() {
            let direction = fault == FAULT_COUNT - 1;
            levels[fault] = if direction { unit[fault] } else { scaled(unit[fault]) };
        }
        if self.is_sparse() {
            let present = [unit[FAULT_COUNT + 1], unit[FAULT_COUNT + 2]]
                .map(|u| (u * SPARSE_CHOICES as f64) as usize);
            for (fault, level) in levels.iter_mut().enumerate().take(FAULT_COUNT - 1) {
                if !present.contains(&fault) {
                    *level = 0.0;
                }
            }
        }
        let turned = self.is_turned();
        let own_rad = experiment.scenario.start_angle_rad;
        (levels, if turned { TAU * unit[FAULT_COUNT] } else { own_rad })
    }
}

/// Each of the two places of a sparse condition is one of six faults or, twice as often as one of
/// them, none.
const SPARSE_CHOICES: usize = FAULT_COUNT - 1 + 2;
/// Coordinates of a point that a condition is drawn from: levels, start angle, two choices.
const UNIT_DIMENSION: usize = FAULT_COUNT + 3;

/// One fault condition of a dataset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    /// `k1..k7`.
    pub levels: [f64; FAULT_COUNT],
    /// Mechanical angle of the rotor at the start, rad.
    pub start_angle_rad: f64,
    /// Seed of the controller's noise.
    pub noise_seed: u64,
}

impl Condition {
    /// The damage in coordinates.
    pub fn coordinates(&self) -> FaultCoordinates {
        HealthState::new(self.levels)
            .map_or(FaultCoordinates([0.0; FAULT_COUNT]), |health| health.coordinates())
    }
}

/// Reference signals of an experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    /// Which conditions.
    pub design: ReferenceDesign,
    /// Root seed of the design and of the controller's noise.
    pub seed: u64,
    /// Imperfections of the electronics.
    pub imperfections: Imperfections,
    /// The conditions.
    pub conditions: Vec<Condition>,
    /// One filtered envelope a condition, A.
    pub signals_a: Vec<Vec<f64>>,
}

/// Why a dataset could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// The experiment cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The design cannot be drawn.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// No condition was asked for.
    #[error("a dataset of 0 conditions was asked for, expected at least 1")]
    NoConditions,
}

/// Request for a dataset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DatasetRequest {
    /// Which conditions.
    pub design: ReferenceDesign,
    /// How many.
    pub conditions: usize,
    /// Root seed.
    pub seed: u64,
    /// Imperfections of the electronics.
    pub imperfections: Imperfections,
    /// Threads to use.
    pub jobs: usize,
}

impl Dataset {
    /// Runs the conditions of a design; the result does not depend on the number of threads.
    ///
    /// # Errors
    ///
    /// [`DatasetError`].
    ///
    /// # Panics
    ///
    /// Only if a simulation does, which is a programming error.
    pub fn generate(
        experiment: &Experiment,
        request: &DatasetRequest,
    ) -> Result<Self, DatasetError> {
        let DatasetRequest { design, seed, imperfections, .. } = *request;
        let conditions = draw(experiment, request)?;
        let jobs = request.jobs.clamp(1, conditions.len());
        let share = conditions.len().div_ceil(jobs);
        let parts: Vec<Result<Vec<Vec<f64>>, SimulationError>> = thread::scope(|scope| {
            let run = |part: &[Condition]| -> Result<Vec<Vec<f64>>, SimulationError> {
                part.iter().map(|c| signal(experiment, c, imperfections)).collect()
            };
            let handles: Vec<_> =
                conditions.chunks(share).map(|part| scope.spawn(move || run(part))).collect();
            handles
                .into_iter()
                .map(|handle| handle.join().expect("a simulation does not panic"))
                .collect()
        });
        let mut signals_a = Vec::with_capacity(conditions.len());
        for part in parts {
            signals_a.extend(part?);
        }
        Ok(Self { design, seed, imperfections, conditions, signals_a })
    }

    /// The conditions of a design, without their signals.
    ///
    /// # Errors
    ///
    /// [`DatasetError`].
    pub fn conditions(
        experiment: &Experiment,
        request: &DatasetRequest,
    ) -> Result<Vec<Condition>, DatasetError> {
        draw(experiment, request)
    }

    /// The angle at which all its conditions start; `None` for a turned design.
    pub fn start_angle_rad(&self) -> Option<f64> {
        let first = self.conditions.first()?;
        (!self.design.is_turned()).then_some(first.start_angle_rad)
    }

    /// SHA-256 over conditions and signals in little endian, hexadecimal.
    pub fn sha256(&self) -> String {
        let mut hasher = Sha256::new();
        for (condition, signal) in self.conditions.iter().zip(&self.signals_a) {
            let numbers = condition.levels.iter().chain([&condition.start_angle_rad]).chain(signal);
            for number in numbers {
                hasher.update(number.to_le_bytes());
            }
            hasher.update(condition.noise_seed.to_le_bytes());
        }
        store::hex(&hasher.finalize())
    }
}

/// Draws the conditions of a design.
fn draw(experiment: &Experiment, request: &DatasetRequest) -> Result<Vec<Condition>, DatasetError> {
    if request.conditions == 0 {
        return Err(DatasetError::NoConditions);
    }
    let root = RootSeed(request.seed);
    let cube = Bounds::unit(UNIT_DIMENSION).expect("the unit cube is a box");
    let seed = root.derive(Purpose::Design, request.design as u64);
    let points = Design::LatinHypercube.points(&cube, request.conditions, seed)?;
    Ok(points
        .iter()
        .enumerate()
        .map(|(index, unit)| {
            let (levels, start_angle_rad) = request.design.condition(experiment, unit);
            let stream = ((request.design as u64) << 32) | index as u64;
            let noise_seed = root.derive(Purpose::ControllerNoise, stream);
            Condition { levels, start_angle_rad, noise_seed }
        })
        .collect())
}

/// The signal of one condition.
fn signal(
    experiment: &Experiment,
    condition: &Condition,
    imperfections: Imperfections,
) -> Result<Vec<f64>, SimulationError> {
    let model = experiment
        .high_fidelity(condition.start_angle_rad, imperfections)?
        .with_seed(condition.noise_seed);
    Ok(experiment.high_fidelity_signal(&model, &PhysicalFaults::from(&condition.coordinates())))
}

/// Signals of the low-fidelity model at every condition; those of one start angle that follow one
/// another are simulated side by side.
pub(crate) fn monitor_signals(
    experiment: &Experiment,
    conditions: &[Condition],
) -> Result<Vec<Vec<f64>>, SimulationError> {
    let mut monitor = experiment.monitor(0.0)?;
    let mut signals = Vec::with_capacity(conditions.len());
    let same_start = |a: &Condition, b: &Condition| a.start_angle_rad == b.start_angle_rad;
    for together in conditions.chunk_by(same_start) {
        monitor.turn_to(together[0].start_angle_rad);
        let points: Vec<FaultCoordinates> = together.iter().map(Condition::coordinates).collect();
        signals.extend(monitor.signals(&points));
    }
    Ok(signals)
}

/// The coordinates looked for, of every condition.
pub(crate) fn sought_coordinates(experiment: &Experiment, dataset: &Dataset) -> Vec<Vec<f64>> {
    let indices = experiment.sought_indices();
    dataset
        .conditions
        .iter()
        .map(|condition| indices.iter().map(|&i| condition.coordinates().0[i]).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(jobs: usize, seed: u64) -> DatasetRequest {
        DatasetRequest {
            design: ReferenceDesign::Turned,
            conditions: 5,
            seed,
            imperfections: Imperfections::REAL,
            jobs,
        }
    }

    #[test]
    fn threads_do_not_matter_and_the_seed_does() {
        let experiment = Experiment::chirp();
        let one = Dataset::generate(&experiment, &request(1, 3)).unwrap();
        let three = Dataset::generate(&experiment, &request(3, 3)).unwrap();
        assert_eq!(one.sha256(), three.sha256());
        let other = Dataset::generate(&experiment, &request(1, 4)).unwrap();
        assert_ne!(one.sha256(), other.sha256());
    }

    #[test]
    fn incipient_levels_stay_below_a_twentieth() {
        let experiment = Experiment::sine();
        let request = DatasetRequest { design: ReferenceDesign::Incipient, ..request(1, 1) };
        for condition in draw(&experiment, &request).unwrap() {
            assert!(condition.levels[..2].iter().all(|k| (0.0..0.05).contains(k)));
            assert_eq!(condition.levels[2..], [0.0, 0.0, 0.0, 0.0, 0.5]);
        }
    }
}
