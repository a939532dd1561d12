//! Units with physics that their model file does not have, on the page of machines within their
//! tolerances.

use std::fmt::Write as _;

use anyhow::Result;
use experiments::{EffectLine, HiddenEffect, evaluate_effects};
use fdi_core::{
    ComparedSignals, Diagnoser, GivenCommand, Recording,
    ema_sim::{Effect, model_file::MachineModel},
    in_parallel,
    report::{NoticeCode, RecordDiagnosis, Verdict},
};
use greybox::{Explained, Options, Record, Recordings};

use super::{
    learnt::REFERENCES,
    setting::{JOBS, SEED, percent},
};

/// Units with an effect.
const UNITS: usize = 200;
/// The first of them that are explained too.
const EXPLAINED: usize = 40;
/// Units without an effect that are explained too.
const CONTROLS: usize = 20;
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
         unit had the effect then, or has got it since. Its \
         sizes are drawn, then scaled to an evidence λ of 60 to 600, log-uniform: twice the \
         logarithm of the likelihood ratio in one recording, by the low-fidelity model, damage and \
         all numbers free within their tolerances. \"No false level\": not faulty and every interval \
         of k1 to k6 holds zero, or model-inadequate. Bar: 90 %.\n\n\
         | diagnosed | healthy, % | faulty, % | undetermined, % | inadequate, % | refused, % | no \
         false level, % |\n|---|---|---|---|---|---|---|\n"
    );
    row(&mut text, "alone", hidden.iter().map(|one| one.alone.as_ref()));
    row(&mut text, "unit, effect as new", hidden.iter().map(|one| one.as_built.as_ref()));
    row(&mut text, "unit, effect since", hidden.iter().map(|one| one.since.as_ref()));
    row(&mut text, "no effect: alone", without.iter().map(|one| one.alone.as_ref()));
    row(&mut text, "no effect: unit", without.iter().map(|one| one.since.as_ref()));
    let _ = writeln!(text, "\n{}", forms(&hidden, &without));
    let command = GivenCommand::named("chirp");
    let explained = |hidden: &[HiddenEffect], count: usize| {
        in_parallel(&hidden[..count], JOBS, |_, one| explained(diagnoser, one, command.as_ref()))
    };
    let (of_effects, of_none) = (explained(&hidden, EXPLAINED)?, explained(&without, CONTROLS)?);
    let _ = writeln!(text, "\n{}", names(&hidden, &of_effects));
    let _ = writeln!(text, "\n{}", chance(&of_none));
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
    let verdict = |verdict| share(&|answer| answer.is_some_and(|one| one.verdict == verdict));
    let _ = writeln!(
        text,
        "| {name} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} |",
        verdict(Verdict::Healthy),
        verdict(Verdict::Faulty),
        verdict(Verdict::Undetermined),
        verdict(Verdict::ModelInadequate),
        share(&|answer| answer.is_none()),
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

/// Answer of `fdi explain --unit` to the recordings with the effect; `None` without a unit.
fn explained(
    diagnoser: &Diagnoser,
    hidden: &HiddenEffect,
    command: Option<&GivenCommand>,
) -> Result<Option<Explained>> {
    let Some(unit) = &hidden.unit else { return Ok(None) };
    let model = MachineModel::Actuator(diagnoser.unit_numbers(unit)?.model);
    let record = |(place, recording): (usize, &Recording)| -> Result<Record> {
        let signals = ComparedSignals::of_recording(recording, &model, command)?;
        Ok(Record {
            name: format!("{place}"),
            rate_hz: signals.rate_hz,
            command: signals.command,
            kind: signals.kind,
            drive: signals.drive,
            position: signals.position,
            load: signals.load,
            filter_hz: signals.filter_hz,
            start_rad: signals.start_rad,
        })
    };
    let mut records =
        hidden.recordings.iter().enumerate().map(record).collect::<Result<Vec<_>>>()?;
    let holdout = records.split_off(RECORDINGS - 1);
    let recordings = Recordings { train: records, holdout, repeat: Vec::new() };
    let options = Options { jobs: 1, ..Options::default() };
    Ok(greybox::explain(&model, &recordings, &options).ok())
}

/// Counts of what the explanations say of the effects.
fn names(hidden: &[HiddenEffect], explained: &[Option<Explained>]) -> String {
    let (mut right, mut tied, mut other, mut none) = (0, 0, 0, 0);
    for (hidden, explained) in hidden.iter().zip(explained) {
        let (Some(effect), Some(explained)) = (&hidden.effect, explained) else {
            none += 1;
            continue;
        };
        let id = effect.id();
        let is_it = |found: &greybox::Finding| found.effect.id() == id;
        if explained.effects.iter().any(is_it) {
            right += 1;
        } else if explained.alternatives.iter().any(is_it) || explained.absorbed.contains(&id) {
            tied += 1;
        } else if explained.effects.is_empty() {
            none += 1;
        } else {
            other += 1;
        }
    }
    let count = explained.len();
    format!(
        "`fdi explain --unit` on three recordings with the effect, one held out, of the first \
         {count} units, learnt without it: {:.1} % name it, {:.1} % have it among what is confounded, {:.1} % name \
         another effect alone, {:.1} % name none. Bar: named or said to be confounded in 80 %.",
        percent(right, count),
        percent(tied, count),
        percent(other, count),
        percent(none, count)
    )
}

/// Counts of what explanations say where there is no effect.
fn chance(explained: &[Option<Explained>]) -> String {
    let count = explained.len();
    let is_named = |one: &&Explained| !one.effects.is_empty();
    let named = explained.iter().flatten().filter(is_named).count();
    let held: usize = explained.iter().flatten().map(|one| one.absorbed.len()).sum();
    format!(
        "Of {count} units without an effect it names one in {:.1} %, and has {:.1} effects among \
         what is confounded on average: so much of the shares above is by chance.",
        percent(named, count),
        held as f64 / count as f64
    )
}
