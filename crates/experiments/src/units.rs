//! Machines that differ from their model file: hidden numbers, hidden faults, one recording each.
//!
//! The generator knows nothing of how the diagnosis treats tolerances: it changes the numbers of the
//! high-fidelity model itself, sensors included, with scatter written down here.

mod bound;
mod decisions;
mod effects;
mod hidden;
mod learnt;
mod numbers;
mod planned;
mod score;
mod setups;
mod symmetry;
mod together;

pub use bound::{BoundCase, NumberBound, number_bounds, unit_bounds};
pub use decisions::{DecisionsLine, DecisionsResult, Stated, evaluate_decisions};
pub use effects::{EffectLine, HiddenEffect, effect_of_size, effects_of_both, evaluate_effects};
pub use hidden::HiddenDamage;
pub use learnt::{
    Days, LearntLine, LearntResult, WearLine, bundle_of_test, bundle_over_days, evaluate_learnt,
    evaluate_wear, over_days, unit_recordings,
};
pub use numbers::{NumberScore, NumbersLine, NumbersResult, evaluate_numbers};
pub use planned::{plan_request, planned_test, test_by_hand};
pub use score::UnitsScore;
pub use setups::{SetupsLine, SetupsResult, Unfit, evaluate_setups, evaluate_unfit};
pub use symmetry::{
    Symmetry, SymmetryResult, bundle_of_scaled_torques, difference_of_diagnosers,
    evaluate_symmetries,
};
pub use together::{TogetherLine, TogetherResult, evaluate_together};

use fdi_core::{
    Bundle, BundleError, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Experiment, Purpose,
    Recording, RootSeed, ToleranceUse,
    ema_sim::{FaultCoordinates, Spread, Tolerance, UncertainNumber, presets},
    in_parallel,
};

use crate::{chance::Chance, request::EvaluationError};
use hidden::{Hidden, Label, SESSION, UNIT};
use score::scored;

/// One line of the study: many machines at a share of their tolerances.
#[derive(Clone, Copy, Debug)]
pub struct UnitsLine {
    /// Share of the tolerances that machines scatter with, and that the model file states.
    pub scale: f64,
    /// Damage.
    pub damage: HiddenDamage,
    /// Most that a number's scatter is more or less than stated, as a factor of its own for each
    /// number and machine; 1 where the model file is right.
    pub misstated: f64,
    /// True where the rotor starts anywhere; false for the start of the bundle.
    pub any_start: bool,
    /// True where mismatch of turns and eccentricity as built are there.
    pub as_built: bool,
    /// Machines.
    pub machines: usize,
    /// Machines that are diagnosed as their model file's too.
    pub twins: usize,
}

/// A line with its scores.
#[derive(Clone, Debug)]
pub struct UnitsResult {
    /// The line.
    pub line: UnitsLine,
    /// The diagnosis with tolerances.
    pub with_tolerances: UnitsScore,
    /// The first of these recordings, the machine taken to be exactly its model file.
    pub without: UnitsScore,
}

/// The embedded chirp with tolerances at a share of their size, learnt anew; with or without those of
/// what is there as built, mismatch of turns and eccentricity.
///
/// # Errors
///
/// [`BundleError`] when nothing can be learnt.
pub fn bundle_at(scale: f64, as_built: bool, seed: u64) -> Result<Bundle, BundleError> {
    let embedded = Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes)?;
    let mut experiment = embedded.experiment.clone();
    experiment.tolerance = tolerance_at(scale, as_built);
    experiment.temperature = (scale > 0.0).then(presets::ema_48_temperature);
    Bundle::build(&experiment, embedded.datasets, embedded.noise_a, RootSeed(seed))
}

/// The tolerances of the preset at a share of their size; at zero every number is exact.
pub(crate) fn tolerance_at(scale: f64, as_built: bool) -> Vec<Tolerance> {
    let scaled = |tolerance: Tolerance| Tolerance {
        spread: match tolerance.spread {
            Spread::HalfWidth(half_width) => Spread::HalfWidth(scale * half_width),
            Spread::Std(std) => Spread::Std(scale * std),
        },
        ..tolerance
    };
    let is_kept = |tolerance: &Tolerance| {
        let built = [UncertainNumber::Turns, UncertainNumber::Eccentricity];
        as_built || !built.contains(&tolerance.number)
    };
    presets::ema_48_tolerance().into_iter().filter(is_kept).map(scaled).collect()
}

/// Recordings of the machines of a line, each with its hidden damage.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated.
pub fn hidden_recordings(
    experiment: &Experiment,
    line: &UnitsLine,
    seed: u64,
    jobs: usize,
) -> Result<Vec<(FaultCoordinates, Recording)>, EvaluationError> {
    let indices: Vec<u64> = (0..line.machines as u64).collect();
    in_parallel(&indices, jobs, |_, &index| hidden_recording(experiment, line, seed, index))
}

fn hidden_recording(
    experiment: &Experiment,
    line: &UnitsLine,
    seed: u64,
    index: u64,
) -> Result<(FaultCoordinates, Recording), EvaluationError> {
    let own = RootSeed(seed).derive(Purpose::Units, index);
    let mut chance = Chance::new(own);
    let mut hidden = Hidden::nominal(experiment);
    hidden.damage = line.damage.draw(&mut chance);
    let unit = UNIT.misstated(line.misstated, &mut chance);
    let session = SESSION.misstated(line.misstated, &mut chance);
    hidden.scatter(&unit, line.scale, line.as_built, &mut chance);
    hidden.scatter(&session, line.scale, false, &mut chance);
    let scenario = experiment.scenario.clone();
    let scenario = if line.any_start {
        scenario.turned_to(std::f64::consts::TAU * chance.uniform())
    } else {
        scenario
    };
    let turned = Experiment { scenario, ..experiment.clone() };
    Ok((hidden.damage, hidden.record(&turned, own, &Label::default())?))
}

/// Diagnoses the machines of a line with and without tolerances.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated.
pub fn evaluate_units(
    diagnoser: &Diagnoser,
    line: &UnitsLine,
    seed: u64,
    jobs: usize,
) -> Result<UnitsResult, EvaluationError> {
    let experiment = &diagnoser.bundle().experiment;
    let indices: Vec<u64> = (0..line.machines as u64).collect();
    let options = |tolerance| DiagnoseOptions { tolerance, ..DiagnoseOptions::default() };
    let judged = in_parallel(&indices, jobs, |_, &index| -> Result<_, EvaluationError> {
        let (damage, recording) = hidden_recording(experiment, line, seed, index)?;
        let answer = |tolerance| diagnoser.diagnose(&recording, &options(tolerance)).ok();
        let is_twin = index < line.twins as u64;
        let twin = is_twin.then(|| answer(ToleranceUse::None));
        Ok((damage, answer(ToleranceUse::Model), twin))
    })?;
    let with: Vec<_> = judged.iter().map(|(damage, answer, _)| (damage, answer.as_ref())).collect();
    let twins =
        judged.iter().filter_map(|(damage, _, twin)| Some((damage, twin.as_ref()?.as_ref())));
    let without: Vec<_> = twins.collect();
    Ok(UnitsResult { line: *line, with_tolerances: scored(&with), without: scored(&without) })
}
