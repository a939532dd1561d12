//! Units with physics that their model file does not have, on the page of machines within their
//! tolerances.

use std::{fmt::Write as _, sync::Arc};

use anyhow::Result;
use experiments::{EffectLine, HiddenEffect, evaluate_effects};
use fdi_core::{
    Cause, CauseVerdict, Causes, Diagnoser, ExplainOptions,
    ema_sim::{Effect, Geometry, Role},
    in_parallel,
    report::{NoticeCode, RecordDiagnosis, Verdict},
};

use super::{
    learnt::REFERENCES,
    setting::{JOBS, SEED, percent},
};

/// Units with an effect, and units without one.
const UNITS: usize = 200;
/// Recordings with the effect: two are fitted, one is held out.
const RECORDINGS: usize = 3;

pub(super) fn text(diagnoser: &Diagnoser) -> Result<String> {
    crate::terminal::say("units: hidden effects");
    let line = |has_effect| EffectLine {
        references: REFERENCES,
        recordings: RECORDINGS,
        has_effect,
        units: UNITS,
    };
    let hidden = evaluate_effects(diagnoser, &line(true), SEED + 460, JOBS)?;
    let without = evaluate_effects(diagnoser, &line(false), SEED + 461, JOBS)?;
    let mut text = format!(
        "{UNITS} units at full tolerances, each with an effect of the catalogue that both models take \
         and the model file does not have, and no damage. With {REFERENCES} recordings as new the \
         unit had the effect then, or has got it since. Its sizes are drawn, then scaled to an evidence λ of 60 to 600, log-uniform: twice the \
         logarithm of the likelihood ratio in one recording by the low-fidelity model, damage and \
         all numbers fitted within their tolerances, times the square of the share of it that the \
         high-fidelity machine with its electronics shows. \"Level held\": the interval of a level of \
         k1 to k6 holds zero, or the unit is model-inadequate. \"No false level\": not faulty and all \
         six are held; intervals that are right in 95 % each are so together on fewer units. Bar: \
         90 %.\n\n\
         | diagnosed | healthy, % | faulty, % | undetermined, % | inadequate, % | refused, % | level \
         held, % | no false level, % |\n|---|---|---|---|---|---|---|---|\n"
    );
    row(&mut text, "alone", hidden.iter().map(|one| one.alone.as_ref()));
    row(&mut text, "unit, effect as new", hidden.iter().map(|one| one.as_built.as_ref()));
    row(&mut text, "unit, effect since", hidden.iter().map(|one| one.since.as_ref()));
    row(&mut text, "no effect: alone", without.iter().map(|one| one.alone.as_ref()));
    row(&mut text, "no effect: unit", without.iter().map(|one| one.since.as_ref()));
    let _ = writeln!(text, "\n{}", forms(&hidden, &without));
    let (of_effects, of_none) = (explained(diagnoser, &hidden)?, explained(diagnoser, &without)?);
    let _ = write!(
        text,
        "\n`fdi explain --unit` on {RECORDINGS} recordings, one of them held out, of the first \
         {UNITS} units with an effect and of the first {UNITS} without one, the units learnt \
         without it. Bar: named or said to be confounded in 80 %.\n\n\
         | units | it alone named, % | it and others named, % | among what is confounded, % | together, % \
         | others named, % | unknown, % | nothing, % |\n|---|---|---|---|---|---|---|---|\n"
    );
    explained_row(&mut text, "with an effect", &hidden, &of_effects);
    explained_row(&mut text, "without", &without, &of_none);
    let _ = writeln!(text, "\n{}", held(&hidden, &of_effects));
    Ok(text)
}

fn row<'a>(
    text: &mut String,
    name: &str,
    answers: impl Iterator<Item = Option<&'a RecordDiagnosis>>,
) {
    let answers: Vec<_> = answers.collect();
    let share = |is: &dyn Fn(Option<&RecordDiagnosis>) -> bool| {
        percent(answers.iter().filter(|answer| is(**answer)).count(), answers.len())
    };
    let held: Vec<bool> =
        answers.iter().flatten().flat_map(|answer| HiddenEffect::levels_held(answer)).collect();
    let verdict = |verdict| share(&|answer| answer.is_some_and(|one| one.verdict == verdict));
    let _ = writeln!(
        text,
        "| {name} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} |",
        verdict(Verdict::Healthy),
        verdict(Verdict::Faulty),
        verdict(Verdict::Undetermined),
        verdict(Verdict::ModelInadequate),
        share(&|answer| answer.is_none()),
        percent(held.iter().filter(|is_held| **is_held).count(), held.len()),
        share(&HiddenEffect::is_without_false_level)
    );
}

/// Counts of what the notices of recordings alone say of the effects.
fn forms(hidden: &[HiddenEffect], without: &[HiddenEffect]) -> String {
    let told = |one: &HiddenEffect| {
        let notices = one.alone.iter().flat_map(|answer| &answer.notices);
        let mut told = notices.filter(|one| one.code == NoticeCode::UnmodelledPhysics);
        told.next().map(|notice| notice.message.clone())
    };
    let all: Vec<(&HiddenEffect, String)> =
        hidden.iter().filter_map(|one| Some((one, told(one)?))).collect();
    let has_truth = |(one, told): &&(&HiddenEffect, String)| {
        let symbol = |effect: &Effect| format!("({})", effect.id().info().symbol);
        one.effect.as_ref().is_some_and(|effect| told.contains(&symbol(effect)))
    };
    let named: usize = all.iter().map(|(_, told)| told.matches("(E").count()).sum();
    format!(
        "The notice `unmodelled-physics` of a recording alone: told in {:.1} % with an effect and in \
         {:.1} % without one. Where it is told, the effect is among those that it names in {:.1} %; \
         it names {:.1} on average. The test looks for the effects of the catalogue at their usual \
         shapes, as they are drawn here: this set cannot show how it does on other physics.",
        percent(all.len(), hidden.len()),
        percent(without.iter().filter(|one| told(one).is_some()).count(), without.len()),
        percent(all.iter().filter(has_truth).count(), all.len()),
        named as f64 / all.len() as f64
    )
}

/// Answers of `fdi explain --unit` to the recordings of some units; `None` where the unit could not be
/// learnt, or they are refused.
fn explained(diagnoser: &Diagnoser, hidden: &[HiddenEffect]) -> Result<Vec<Option<Causes>>> {
    in_parallel(hidden, JOBS, |_, one| {
        let Some(unit) = one.unit.clone() else { return Ok(None) };
        let options = ExplainOptions { unit: Some(Arc::new(unit)), ..ExplainOptions::default() };
        let (train, holdout) = one.recordings.split_at(RECORDINGS - 1);
        Ok(diagnoser.explain(train, holdout, &options).ok())
    })
}

/// Row of what explanations say of the effects.
fn explained_row(
    text: &mut String,
    name: &str,
    hidden: &[HiddenEffect],
    explained: &[Option<Causes>],
) {
    let (mut alone, mut among, mut tied, mut other, mut unknown, mut none) = (0, 0, 0, 0, 0, 0);
    for (hidden, explained) in hidden.iter().zip(explained) {
        let Some(causes) = explained else {
            none += 1;
            continue;
        };
        let id = hidden.effect.as_ref().map(Effect::id);
        let is_it = |found: &Cause| Some(found.effect.id()) == id;
        let is_absorbed = id.is_some_and(|id| causes.absorbed.contains(&id));
        if causes.found.iter().any(is_it) {
            let count = if causes.found.len() == 1 { &mut alone } else { &mut among };
            *count += 1;
        } else if causes.as_good.iter().any(is_it) || is_absorbed {
            tied += 1;
        } else if !causes.found.is_empty() {
            other += 1;
        } else if causes.verdict == CauseVerdict::Unknown {
            unknown += 1;
        } else {
            none += 1;
        }
    }
    let count = explained.len();
    let share = |part| percent(part, count);
    let said = share(alone + among + tied);
    let _ = writeln!(
        text,
        "| {name} | {:.1} | {:.1} | {:.1} | {said:.1} | {:.1} | {:.1} | {:.1} |",
        share(alone),
        share(among),
        share(tied),
        share(other),
        share(unknown),
        share(none)
    );
}

/// Share of the intervals of the sizes found alone that hold the effect's own, and of levels beside
/// effects that hold zero.
fn held(hidden: &[HiddenEffect], explained: &[Option<Causes>]) -> String {
    let (mut sizes, mut held_sizes, mut levels, mut held_levels) = (0, 0, 0, 0);
    for (hidden, explained) in hidden.iter().zip(explained) {
        let (Some(effect), Some(causes)) = (&hidden.effect, explained) else { continue };
        let [found] = &causes.found[..] else { continue };
        if found.effect.id() != effect.id() {
            continue;
        }
        for (key, [from, to]) in &found.intervals_95 {
            let parameters = effect.id().info().parameters.iter();
            let own =
                parameters.zip(effect.values()).find(|(own, _)| own.key(Geometry::Rotary) == *key);
            if let Some((parameter, value)) = own
                && parameter.role() == Role::Amplitude
            {
                sizes += 1;
                held_sizes += usize::from((*from..=*to).contains(value));
            }
        }
        for fault in &causes.faults[1][..6] {
            if let Some([from, _]) = fault.interval_95 {
                levels += 1;
                held_levels += usize::from(from <= 0.0);
            }
        }
    }
    format!(
        "Where the effect alone is named, {:.1} % of the {sizes} intervals of its sizes hold them, and \
         {:.1} % of the {levels} levels of k1 to k6 beside it hold zero. An effect of a few \
         steps of the digitised position looks smaller than it is, and of an effect with several sizes \
         those that were not seen are taken to be none: sizes are to be read with that in mind.",
        percent(held_sizes, sizes),
        percent(held_levels, levels)
    )
}
