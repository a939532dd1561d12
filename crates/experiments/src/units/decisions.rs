//! Decisions about hidden units: how often damage is above its level where that was said with a probability.

use std::sync::Arc;

use fdi_core::{
    DiagnoseOptions, Diagnoser, Purpose, RootSeed, ToleranceUse, decide, in_parallel,
    report::{Action, ActionLevels, BACKLASH_GAIN, Severity},
};

use super::{hidden::HiddenDamage, learnt::Owned};
use crate::request::EvaluationError;

/// One line of the study: units at full tolerances, each with a decision about a later day.
#[derive(Clone, Copy, Debug)]
pub struct DecisionsLine {
    /// Recordings of each unit as new, each of a day of its own; 0: it is not learnt.
    pub references: usize,
    /// Damage on the day of the decision.
    pub damage: HiddenDamage,
    /// Levels that the decisions are made by.
    pub levels: ActionLevels,
    /// Units.
    pub units: usize,
}

/// A probability that was stated, and what was true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stated {
    /// Probability that damage is above a level.
    pub probability: f64,
    /// True where it was.
    pub is_above: bool,
}

/// Decisions of a line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DecisionsResult {
    /// Units.
    pub units: usize,
    /// Decisions by severity: nothing, undecided, watch, act.
    pub severities: [usize; 4],
    /// Decisions to act on a fault that is above its level for watching in truth.
    pub right_acts: usize,
    /// Units without an answer that is believed: inadequate or refused.
    pub without_answer: usize,
    /// Statements of each fault that is determined: on its level for watching, on that for acting.
    pub stated: [Vec<Stated>; 2],
}

/// Learns the units of a line, diagnoses them on a later day and decides.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated.
pub fn evaluate_decisions(
    diagnoser: &Diagnoser,
    line: &DecisionsLine,
    seed: u64,
    jobs: usize,
) -> Result<DecisionsResult, EvaluationError> {
    let experiment = &diagnoser.bundle().experiment;
    let indices: Vec<u64> = (0..line.units as u64).collect();
    let decided = in_parallel(&indices, jobs, |_, &index| -> Result<_, EvaluationError> {
        let own = RootSeed(seed).derive(Purpose::Units, index);
        let mut unit = Owned::usual(experiment, own);
        let references = unit.records_as_new(line.references)?;
        let damage = line.damage.draw(&mut unit.chance);
        let recording = unit.record(damage)?;
        let options =
            DiagnoseOptions { tolerance: ToleranceUse::Model, ..DiagnoseOptions::default() };
        let options = if references.is_empty() {
            Some(options)
        } else {
            let learnt = diagnoser.learn_unit(&references, &options).ok();
            learnt.map(|unit| DiagnoseOptions { unit: Some(Arc::new(unit)), ..options })
        };
        let answer = options.and_then(|options| diagnoser.diagnose(&recording, &options).ok());
        let mut levels = damage.levels();
        if line.references == 0 {
            // the play that there is, over that of the model file
            let times = unit.play_ratio() * (1.0 + BACKLASH_GAIN * levels[1]);
            levels[1] = (times - 1.0) / BACKLASH_GAIN;
        }
        Ok((levels, answer.map(|answer| decide(&answer, &line.levels))))
    })?;
    let mut result = DecisionsResult { units: line.units, ..DecisionsResult::default() };
    for (true_levels, action) in &decided {
        match action {
            Some(action) => result.count(action, true_levels, &line.levels),
            None => result.without_answer += 1,
        }
    }
    Ok(result)
}

impl DecisionsResult {
    fn count(&mut self, action: &Action, true_levels: &[f64], levels: &ActionLevels) {
        let severity = match action.severity {
            Severity::Undecided => 1,
            Severity::Watch => 2,
            Severity::Act => 3,
            _ => 0,
        };
        self.severities[severity] += 1;
        self.without_answer += usize::from(action.faults.is_empty());
        for fault in &action.faults {
            let place = fault.id as usize;
            let (level, watch, act) = (true_levels[place], levels.watch[place], levels.act[place]);
            let above = fault.probability_above;
            for (stated, (probability, limit)) in
                self.stated.iter_mut().zip([(above.watch, watch), (above.act, act)])
            {
                stated.push(Stated { probability, is_above: level > limit });
            }
            let is_named = action.severity == Severity::Act && action.fault == Some(fault.id);
            self.right_acts += usize::from(is_named && level > watch);
        }
    }
}
