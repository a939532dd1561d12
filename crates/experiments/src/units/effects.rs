//! Units with physics that their model file does not have.

use std::sync::Arc;

use fdi_core::{
    DiagnoseOptions, Diagnoser, Experiment, LearntUnit, Purpose, Recording, RootSeed, ToleranceUse,
    ema_sim::{
        Effect, EffectId, FaultCoordinates, Geometry, HighFidelity, LowFidelity, MachineScales,
        PhysicalFaults, Role,
    },
    in_parallel,
    report::{RecordDiagnosis, Verdict},
};

use super::{bound::Evidence, hidden::Hidden, learnt::Owned};
use crate::{chance::Chance, request::EvaluationError};

/// Evidence of the effects, [`HiddenEffect::lambda`]: the least asked for, and the most drawn.
const LAMBDA: [f64; 2] = [60.0, 600.0];
/// Draws until an effect shows.
const MOST_DRAWS: u64 = 60;
/// Steps towards the evidence that is drawn.
const STEPS: usize = 8;
/// High-fidelity runs, each with a noise of its own, whose mean shows how much of an effect is seen.
const RUNS: u64 = 8;

/// Units with an effect of the catalogue that their model file does not have.
#[derive(Clone, Copy, Debug)]
pub struct EffectLine {
    /// Recordings of each unit as new, with the effect or without; each of a day of its own.
    pub references: usize,
    /// Recordings with the effect on a later day, the first of which is diagnosed.
    pub recordings: usize,
    /// True for an effect in each unit; false for none, by which chance is measured.
    pub has_effect: bool,
    /// Units.
    pub units: usize,
}

/// A unit with an effect, and what a diagnosis says of it.
#[derive(Clone, Debug)]
pub struct HiddenEffect {
    /// The effect; `None` for a unit without one.
    pub effect: Option<Effect>,
    /// Evidence of the effect in one recording beside damage and tolerances that are fitted to it, by
    /// the low-fidelity model, times the square of the share of it that the high-fidelity machine
    /// shows: twice the logarithm of a likelihood ratio.
    pub lambda: f64,
    /// The unit, as it was learnt without the effect; `None` where it could not be.
    pub unit: Option<LearntUnit>,
    /// Recordings with the effect.
    pub recordings: Vec<Recording>,
    /// Answer to the first of them alone; `None` for a refusal.
    pub alone: Option<RecordDiagnosis>,
    /// Answer as a recording of the unit that had the effect as new.
    pub as_built: Option<RecordDiagnosis>,
    /// Answer as a recording of the unit that has got the effect since.
    pub since: Option<RecordDiagnosis>,
}

impl HiddenEffect {
    /// True where an answer gives no false level: the intervals of k1 to k6 hold zero, or the model
    /// is called inadequate. A refusal gives no level.
    pub fn is_without_false_level(answer: Option<&RecordDiagnosis>) -> bool {
        answer.is_none_or(|answer| {
            answer.verdict == Verdict::ModelInadequate
                || (answer.verdict != Verdict::Faulty && Self::levels_held(answer).all(|held| held))
        })
    }

    /// True for each of k1 to k6 whose interval holds zero, or where the model is called inadequate.
    pub fn levels_held(answer: &RecordDiagnosis) -> impl Iterator<Item = bool> {
        let is_inadequate = answer.verdict == Verdict::ModelInadequate;
        let is_held = |interval: &[f64; 2]| interval[0] <= 0.0;
        answer.faults[..6]
            .iter()
            .map(move |fault| is_inadequate || fault.interval_95.as_ref().is_none_or(is_held))
    }
}

/// Draws units with an effect and diagnoses them.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated.
pub fn evaluate_effects(
    diagnoser: &Diagnoser,
    line: &EffectLine,
    seed: u64,
    jobs: usize,
) -> Result<Vec<HiddenEffect>, EvaluationError> {
    let evidence = Evidence::of_one_recording(diagnoser.bundle(), jobs)?;
    let experiment = &diagnoser.bundle().experiment;
    let usual = Usual::of(experiment)?;
    let options = DiagnoseOptions { tolerance: ToleranceUse::Model, ..DiagnoseOptions::default() };
    let indices: Vec<u64> = (0..line.units as u64).collect();
    in_parallel(&indices, jobs, |_, &index| {
        let own = RootSeed(seed).derive(Purpose::Units, index);
        let drawn = if line.has_effect { Some(usual.draw(&evidence, own)?) } else { None };
        let (effect, lambda) = drawn.map_or((None, 0.0), |(effect, lambda)| (Some(effect), lambda));
        let mut unit = Owned::usual(experiment, own);
        let references = unit.records_as_new(line.references)?;
        unit.hidden.effects = effect.iter().cloned().collect();
        let recordings = unit.records_as_new(line.recordings)?;
        let with_effect = unit.records_as_new(line.references)?;
        let learnt = |references: &[Recording]| diagnoser.learn_unit(references, &options).ok();
        let (before, with_effect) = (learnt(&references), learnt(&with_effect));
        let answer = |unit: Option<LearntUnit>| {
            let options = DiagnoseOptions { unit: unit.map(Arc::new), ..options.clone() };
            diagnoser.diagnose(recordings.first()?, &options).ok()
        };
        let alone = answer(None);
        let as_built = with_effect.and_then(|unit| answer(Some(unit)));
        let since = before.clone().and_then(|unit| answer(Some(unit)));
        Ok(HiddenEffect { effect, lambda, unit: before, recordings, alone, as_built, since })
    })
}

/// The machine as it usually moves, which effects are drawn for.
struct Usual<'a> {
    experiment: &'a Experiment,
    nominal: Hidden,
    scales: MachineScales,
    high: HighFidelity,
    /// Mean signal of the high-fidelity model, A.
    high_a: Vec<f64>,
    /// Effects that both models of the machine take.
    effects: Vec<EffectId>,
}

impl<'a> Usual<'a> {
    fn of(experiment: &'a Experiment) -> Result<Self, EvaluationError> {
        let nominal = Hidden::nominal(experiment);
        let (actuator, scenario) = (&experiment.actuator, &experiment.scenario);
        let low = LowFidelity::new(actuator, scenario)?;
        let healthy = PhysicalFaults::from(&FaultCoordinates([0.0; 7]));
        let trace = low.try_simulate(&healthy)?;
        let scales = low.scales(&trace);
        let high = HighFidelity::new(actuator, &scenario.clone().with_real_electronics(1))?;
        let effects = effects_of_both(&low, &high);
        let high_a = mean_signal(&nominal, experiment)?;
        Ok(Self { experiment, nominal, scales, high, high_a, effects })
    }

    /// An effect with its evidence.
    fn draw(&self, evidence: &Evidence, seed: u64) -> Result<(Effect, f64), EvaluationError> {
        for stream in 0..MOST_DRAWS {
            let mut chance = Chance::new(RootSeed(seed).derive(Purpose::Units, (1 << 50) | stream));
            let place = (self.effects.len() as f64 * chance.uniform()) as usize;
            let id = self.effects[place.min(self.effects.len() - 1)];
            let wanted = LAMBDA[0] * (LAMBDA[1] / LAMBDA[0]).powf(chance.uniform());
            let sizes: Vec<f64> = id.info().parameters.iter().map(|_| chance.normal()).collect();
            if let Some(found) = self.scaled(evidence, id, &sizes, wanted) {
                return Ok(found);
            }
        }
        Err(EvaluationError::Search { reason: "no effect shows in this test".to_owned() })
    }

    /// The effect with sizes in some proportion, scaled to an evidence; `None` where it cannot have
    /// it.
    fn scaled(
        &self,
        evidence: &Evidence,
        id: EffectId,
        sizes: &[f64],
        wanted: f64,
    ) -> Option<(Effect, f64)> {
        let mut scale = 0.3;
        for _ in 0..STEPS {
            let effect = effect_of_size(id, sizes, scale, &self.scales)?;
            let lambda = self.lambda(evidence, &effect)?;
            // the high-fidelity model has some effects of its own
            self.high.clone().with_effects(std::slice::from_ref(&effect)).ok()?;
            if (wanted / 1.3..=wanted * 1.3).contains(&lambda) && lambda >= LAMBDA[0] {
                return Some((effect, lambda));
            }
            scale *= (wanted / lambda.max(1e-9)).sqrt().clamp(0.1, 10.0);
        }
        None
    }

    fn lambda(&self, evidence: &Evidence, effect: &Effect) -> Option<f64> {
        let hidden = Hidden { effects: vec![effect.clone()], ..self.nominal.clone() };
        let moved = hidden.low_fidelity_signal(self.experiment).ok()?;
        let lambda = evidence.lambda(self.experiment, &self.nominal, &moved)?;
        // what is not worth it in the cheap model is not in the other
        if lambda.value < LAMBDA[0] {
            return Some(lambda.value);
        }
        let with = mean_signal(&hidden, self.experiment).ok()?;
        let change = with.iter().zip(&self.high_a).map(|(a, b)| a - b).collect();
        let share = evidence.shown_share(&lambda, change).max(0.0);
        Some(share * share * lambda.value)
    }
}

/// Effects that both models of a machine take, without those of a curve.
pub fn effects_of_both(low: &LowFidelity, high: &HighFidelity) -> Vec<EffectId> {
    let is_taken = |id: &EffectId| {
        let effect = [Effect::new(*id, Geometry::Rotary)];
        low.clone().with_effects(&effect).is_ok()
            && high.clone().with_effects(&effect).is_ok()
            && !id.info().takes_curve
    };
    EffectId::ALL.into_iter().filter(is_taken).collect()
}

/// An effect whose sizes are these shares of the typical ones on a machine, times a scale; `None`
/// where it cannot have them. A share is given for each number of the effect.
pub fn effect_of_size(
    id: EffectId,
    shares: &[f64],
    scale: f64,
    scales: &MachineScales,
) -> Option<Effect> {
    let mut effect = Effect::new(id, Geometry::Rotary);
    for (parameter, share) in id.info().parameters.iter().zip(shares) {
        if parameter.role() == Role::Amplitude {
            let (least, most) = parameter.bounds();
            let size = scale * share * parameter.typical_size(scales);
            let size = if least >= 0.0 { size.abs() } else { size };
            if size > most || size < least {
                return None;
            }
            effect.set(parameter.key(Geometry::Rotary), size).ok()?;
        }
    }
    Some(effect)
}

/// Mean signal of the high-fidelity machine with its electronics over some runs, A.
fn mean_signal(hidden: &Hidden, experiment: &Experiment) -> Result<Vec<f64>, EvaluationError> {
    let mut mean = vec![0.0; experiment.samples()];
    for seed in 0..RUNS {
        for (sum, value) in mean.iter_mut().zip(hidden.signal(experiment, seed)?) {
            *sum += value / RUNS as f64;
        }
    }
    Ok(mean)
}
