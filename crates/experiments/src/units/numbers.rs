//! Numbers of units that were learnt, beside the hidden ones.

use fdi_core::{
    DiagnoseOptions, Diagnoser, LearntNumbers, Purpose, RootSeed, ToleranceUse, in_parallel,
};

use super::learnt::Owned;
use crate::{request::EvaluationError, score::median};

/// Units whose numbers are learnt.
#[derive(Clone, Copy, Debug)]
pub struct NumbersLine {
    /// Recordings of each unit as new, each of a day of its own.
    pub references: usize,
    /// Units.
    pub units: usize,
}

/// Scores of one number.
#[derive(Clone, Debug, PartialEq)]
pub struct NumberScore {
    /// Key, as [`fdi_core::LearntNumber`] has it.
    pub key: String,
    /// Standard deviation by the tolerances, over the value in the model file, or in its unit where
    /// that is zero.
    pub prior_std: f64,
    /// Units whose 95 % interval holds the truth.
    pub covered: usize,
    /// Units on which the number is called determined.
    pub determined: usize,
    /// Median standard deviation over that of the tolerances.
    pub share_median: f64,
    /// Units whose value is within 2 % of the truth.
    pub within_2_percent: usize,
}

/// Scores of the numbers of a line's units.
#[derive(Clone, Debug, PartialEq)]
pub struct NumbersResult {
    /// Units that could be learnt.
    pub learnt: usize,
    /// Scores in the order of the model file, ratios last.
    pub numbers: Vec<NumberScore>,
}

/// Learns the units of a line and compares their numbers with the hidden ones.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated.
pub fn evaluate_numbers(
    diagnoser: &Diagnoser,
    line: &NumbersLine,
    seed: u64,
    jobs: usize,
) -> Result<NumbersResult, EvaluationError> {
    let experiment = &diagnoser.bundle().experiment;
    let options = DiagnoseOptions { tolerance: ToleranceUse::Model, ..DiagnoseOptions::default() };
    let indices: Vec<u64> = (0..line.units as u64).collect();
    let judged = in_parallel(&indices, jobs, |_, &index| -> Result<_, EvaluationError> {
        let own = RootSeed(seed).derive(Purpose::Units, index);
        let mut unit = Owned::usual(experiment, own);
        let references = unit.records_as_new(line.references)?;
        let learnt = diagnoser.learn_unit(&references, &options);
        let found = learnt.and_then(|learnt| diagnoser.unit_numbers(&learnt)).ok();
        Ok(found.map(|found| compared(&found, &unit)))
    })?;
    let judged: Vec<Vec<Compared>> = judged.into_iter().flatten().collect();
    let count = judged.first().map_or(0, Vec::len);
    let numbers = (0..count).map(|place| {
        let of_place: Vec<&Compared> = judged.iter().map(|unit| &unit[place]).collect();
        scored(&of_place)
    });
    Ok(NumbersResult { learnt: judged.len(), numbers: numbers.collect() })
}

/// A number beside its truth.
struct Compared {
    key: String,
    prior_std: f64,
    is_covered: bool,
    is_determined: bool,
    share: f64,
    is_within_2_percent: bool,
}

fn compared(found: &LearntNumbers, unit: &Owned<'_>) -> Vec<Compared> {
    let all = found.numbers.iter().chain(&found.ratios);
    let of_one = all.filter_map(|number| {
        let truth = unit.number(&number.key)?;
        let [from, to] = number.interval_95();
        let scale = if number.nominal == 0.0 { 1.0 } else { number.nominal.abs() };
        Some(Compared {
            key: number.key.clone(),
            prior_std: number.prior_std / scale,
            is_covered: (from..=to).contains(&truth),
            is_determined: number.is_determined(),
            share: number.std / number.prior_std,
            is_within_2_percent: (number.value - truth).abs() <= 0.02 * truth.abs(),
        })
    });
    of_one.collect()
}

/// Scores of a number of all units.
fn scored(units: &[&Compared]) -> NumberScore {
    let count = |is: fn(&Compared) -> bool| units.iter().filter(|one| is(one)).count();
    let first = units.first();
    NumberScore {
        key: first.map_or_else(String::new, |one| one.key.clone()),
        prior_std: first.map_or(0.0, |one| one.prior_std),
        covered: count(|one| one.is_covered),
        determined: count(|one| one.is_determined),
        share_median: median(units.iter().map(|one| one.share).collect::<Vec<f64>>()),
        within_2_percent: count(|one| one.is_within_2_percent),
    }
}
