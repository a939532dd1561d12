//! Decisions about units, on the page of machines within their tolerances.

use std::fmt::Write as _;

use anyhow::Result;
use experiments::{DecisionsLine, DecisionsResult, HiddenDamage, Stated, evaluate_decisions};
use fdi_core::report::{ActionLevels, FaultId};

use super::{
    super::bar::met,
    learnt::{REFERENCES, diagnoser},
    setting::{JOBS, SEED, percent},
};

/// Units in service, without damage, and of a line of power.
const IN_SERVICE: usize = 500;
const HEALTHY: usize = 300;
const POWER: usize = 100;
/// Bar of power, percent.
const LEAST_PERCENT: f64 = 70.0;
/// Edges of the bins of stated probabilities, around 0.05, 0.2, 0.5, 0.8 and 0.95.
const EDGES: [f64; 7] = [0.0, 0.01, 0.1, 0.35, 0.65, 0.9, 1.0];
/// Least expected counts on either side for a standard error to be read as that of a normal.
const LEAST_EXPECTED: f64 = 1.0;

/// The section of decisions.
pub(super) fn text() -> Result<String> {
    crate::terminal::say("units: decisions");
    let diagnoser = diagnoser()?;
    let levels = ActionLevels::default();
    let mut text = format!(
        "The decisions of `fdi diagnose --decide` on units at full tolerances, with its default \
         levels. \"References\": {REFERENCES} recordings as new, each of a day of its own. The \
         decision is about a later day, temperatures as above, read. \"In service\": {IN_SERVICE} \
         units with every fault, drawn as machines in service are assumed to have them \
         (`prior_above` of the answer, at most 1). Damage is what has come to a machine as built; of one \
         recording alone, play is all that there is (`docs/decisions/0162-a-prior-that-a-recording-can-beat.md`).\n\n\
         Bars: the share of faults above a level is within two standard errors of the probability \
         stated. There is no `act` on {HEALTHY} units without damage. With references there is one on \
         at least {LEAST_PERCENT:.0} % of {POWER} units with a fault at twice its level for acting. \
         Standard errors are those of independent statements.\n\n"
    );
    let assumed = HiddenDamage::InService(levels.watch);
    let of = |references, damage, units, seed| {
        let line = DecisionsLine { references, damage, levels, units };
        evaluate_decisions(&diagnoser, &line, SEED + seed, JOBS)
    };
    let learnt = of(REFERENCES, assumed, IN_SERVICE, 900)?;
    let alone = of(0, assumed, IN_SERVICE, 901)?;
    text.push_str("### What is stated comes true\n\n");
    for (name, result) in [("with references", &learnt), ("one recording alone", &alone)] {
        reliability(&mut text, name, result);
    }
    text.push_str("### Decisions\n\n");
    text.push_str(
        "\"Right\": of the decisions to act those about a fault that is above its level for watching.\n\n\
         | units | references | nothing | undecided | watch | act | right | without an answer | |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    row(&mut text, "in service", REFERENCES, &learnt, None);
    row(&mut text, "in service", 0, &alone, None);
    for (place, references) in [REFERENCES, 0].into_iter().enumerate() {
        let result = of(references, HiddenDamage::Healthy, HEALTHY, 910 + place as u64)?;
        row(&mut text, "no damage", references, &result, Some(result.severities[3] == 0));
    }
    for fault in &FaultId::ALL[..6] {
        if matches!(fault, FaultId::K4 | FaultId::K5) {
            continue;
        }
        let level = (2.0 * levels.act[*fault as usize]).min(1.0);
        let seed = 920 + *fault as u64;
        let result = of(REFERENCES, HiddenDamage::Alone(*fault, level), POWER, seed)?;
        let share = percent(result.severities[3], result.units);
        let of_a_phase = if *fault == FaultId::K3 { " of a random phase" } else { "" };
        let name = format!("{} of {level:.3}{of_a_phase}", fault.id());
        row(&mut text, &name, REFERENCES, &result, Some(share >= LEAST_PERCENT));
    }
    Ok(text)
}

fn row(
    text: &mut String,
    name: &str,
    references: usize,
    result: &DecisionsResult,
    is_met: Option<bool>,
) {
    let [nothing, undecided, watch, act] = result.severities;
    let told = is_met.map_or("", met);
    let _ = writeln!(
        text,
        "| {}, {name} | {references} | {nothing} | {undecided} | {watch} | {act} | {} | {} | {told} |",
        result.units, result.right_acts, result.without_answer
    );
}

fn reliability(text: &mut String, name: &str, result: &DecisionsResult) {
    let _ = write!(
        text,
        "{} {name}:\n\n\
         | stated probability | above watch: statements | stated, mean | true | off, standard \
         errors | above act: statements | stated, mean | true | off, standard errors |\n\
         |---|---|---|---|---|---|---|---|---|\n",
        result.units
    );
    for edges in EDGES.windows(2) {
        let cells = result.stated.each_ref().map(|stated| bin(stated, edges[0], edges[1]));
        let _ = writeln!(text, "| {} to {} | {} |", edges[0], edges[1], cells.join(" | "));
    }
    text.push('\n');
}

/// Statements of a bin beside what came true.
fn bin(stated: &[Stated], from: f64, to: f64) -> String {
    let is_in = |one: &&Stated| {
        (from..to).contains(&one.probability) || (to >= 1.0 && one.probability >= to)
    };
    let found: Vec<&Stated> = stated.iter().filter(is_in).collect();
    if found.is_empty() {
        return "0 | | |".to_owned();
    }
    let count = found.len() as f64;
    let expected: f64 = found.iter().map(|one| one.probability).sum();
    let variance: f64 = found.iter().map(|one| one.probability * (1.0 - one.probability)).sum();
    let above = found.iter().filter(|one| one.is_above).count() as f64;
    let off = (above - expected) / variance.sqrt().max(f64::MIN_POSITIVE);
    let is_enough = expected.min(count - expected) >= LEAST_EXPECTED;
    let told = if is_enough {
        format!("{off:+.1} {}", met(off.abs() <= 2.0))
    } else {
        format!("too few: {above} against {expected:.2}")
    };
    format!("{} | {:.3} | {:.3} | {told}", found.len(), expected / count, above / count)
}
