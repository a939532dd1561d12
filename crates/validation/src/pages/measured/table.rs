//! One row a set: what was expected of it, what else is accepted, and what the tool says.

use std::fmt::Write as _;

use anyhow::Result;
use ema_sim::EffectId;
use greybox::{Calibrated, Explained, Finding, Verdict};

use super::{
    answers::Answers,
    others::Answer,
    wording::{short, verdict},
};
use crate::pages::bar::met;

/// Effects that are friction.
const FRICTION: [EffectId; 6] = [
    EffectId::Stribeck,
    EffectId::NonlinearViscous,
    EffectId::DirectionalFriction,
    EffectId::LoadFriction,
    EffectId::Presliding,
    EffectId::FrictionDrift,
];
/// Numbers of a model file that are friction.
const FRICTION_KEYS: [&str; 2] = ["axis.kinetic-friction-n-m", "axis.viscous-n-m-s-per-rad"];

/// Row of the table.
struct Row<'a> {
    set: String,
    file: String,
    expected: &'static str,
    accepted: &'static str,
    calibrated: Option<&'a Calibrated>,
    explained: std::result::Result<&'a Explained, String>,
    is_met: bool,
}

/// Effects found, and those as likely as one of them.
fn named(explained: &Explained) -> impl Iterator<Item = EffectId> + '_ {
    explained.effects.iter().chain(&explained.alternatives).map(|f| f.effect.id())
}

fn is_inconclusive(explained: &Explained) -> bool {
    explained.verdict == Verdict::Inconclusive && explained.reason.is_some()
}

/// Numbers calibrated whose intervals begin above zero, by key.
fn is_determined(calibrated: Option<&Calibrated>, keys: &[&str]) -> bool {
    let numbers = calibrated.iter().flat_map(|calibrated| &calibrated.numbers);
    numbers
        .filter(|number| keys.contains(&number.key.as_str()))
        .any(|number| number.determined && number.interval_95()[0] > 0.0)
}

fn is_of_emps(explained: &Explained) -> bool {
    explained.effects.first().is_some_and(|first| {
        first.effect.id() == EffectId::DirectionalFriction
            && first.effect.get("viscous_asymmetry_n_s_per_m").is_some_and(|size| size != 0.0)
    })
}

fn is_of_laas(calibrated: &Calibrated, explained: &Explained, order: usize) -> bool {
    let is_cogging = |finding: &Finding| {
        let effect = &finding.effect;
        effect.id() == EffectId::Cogging
            && effect.get("order").is_some_and(|found| (found - order as f64).abs() < 0.5)
    };
    is_determined(Some(calibrated), &FRICTION_KEYS[..1]) && explained.effects.iter().any(is_cogging)
}

fn is_of_servo(explained: &Explained) -> bool {
    let is_open = explained.absorbed.contains(&EffectId::LoadFriction)
        && matches!(explained.verdict, Verdict::Absorbed | Verdict::Unknown);
    named(explained).any(|id| id == EffectId::LoadFriction) || is_open || is_inconclusive(explained)
}

fn is_of_robot(answer: &Answer, explained: &Explained) -> bool {
    explained.verdict == Verdict::Unknown
        || is_determined(answer.calibrated.as_ref(), &FRICTION_KEYS)
        || named(explained).any(|id| FRICTION.contains(&id) || id == EffectId::Imbalance)
}

/// The seeded fault by its level or by an effect that is it.
fn is_of_actuator(file: &str, explained: &Explained) -> bool {
    let grown = |key: &str| {
        let mut faults = explained.faults.iter().filter(|fault| fault.key == key);
        explained.effects.is_empty() && faults.any(|fault| fault.after.interval_95[0] > 0.0)
    };
    let alone = |ids: &[EffectId]| {
        !explained.effects.is_empty()
            && explained.effects.iter().all(|f| ids.contains(&f.effect.id()))
    };
    let is_seeded = match file {
        "lackLubrication1" => grown("k1") || alone(&FRICTION),
        "backlash1" => grown("k2"),
        "spalling1" => alone(&[EffectId::WornRegion, EffectId::TransmissionError]),
        _ => explained.verdict == Verdict::Adequate,
    };
    is_inconclusive(explained) || is_seeded
}

/// Writes the table.
pub(super) fn write(page: &mut String, answers: &Answers) -> Result<()> {
    page.push_str(include_str!("table.md"));
    let mut rows = vec![
        Row {
            set: "EMPS".to_owned(),
            file: "emps.toml, offset 0".to_owned(),
            expected: "drag that depends on the direction",
            accepted: "none; a mere offset is not",
            calibrated: None,
            explained: Ok(&answers.emps),
            is_met: is_of_emps(&answers.emps),
        },
        Row {
            set: "LAAS".to_owned(),
            file: "laas.toml".to_owned(),
            expected: "dry friction; cogging of order 72",
            accepted: "none",
            calibrated: Some(&answers.calibrated),
            explained: Ok(&answers.laas),
            is_met: is_of_laas(&answers.calibrated, &answers.laas, answers.order),
        },
    ];
    let of_servo = |set: String, answer| {
        let expected = ["load-dependent friction", "told undecidable"];
        row(set, "xl330.toml".to_owned(), expected, answer, is_of_servo)
    };
    for (gain, answer) in &answers.servo_in_loop {
        rows.push(of_servo(format!("BAM, gain {gain}"), answer));
    }
    rows.push(of_servo("BAM, both gains, without the controller".to_owned(), &answers.servo));
    for (place, answer) in answers.robot.iter().enumerate() {
        rows.push(row(
            format!("KUKA A, axis {}", place + 1),
            format!("kr300-axis-{}.toml", place + 1),
            ["friction", "gravity, `unknown`"],
            answer,
            |explained| is_of_robot(answer, explained),
        ));
    }
    for (file, answer) in &answers.actuator {
        let expected = match file.as_str() {
            "lackLubrication1" => "lack of lubrication",
            "backlash1" => "backlash",
            "spalling1" => "spalling",
            _ => "nothing",
        };
        rows.push(row(
            format!("Cranfield, `{file}`"),
            "of this page".to_owned(),
            [expected, "`inconclusive` with the reason"],
            answer,
            |explained| is_of_actuator(file, explained),
        ));
    }
    for row in rows {
        writeln!(
            page,
            "| {} | {} | {} | {} | {} | {} |",
            row.set,
            file(&row.file),
            row.expected,
            row.accepted,
            told(row.calibrated, &row.explained),
            met(row.is_met)
        )?;
    }
    Ok(())
}

/// A model file of the repository, or where else it stands.
fn file(name: &str) -> String {
    match name.split_once(".toml") {
        Some((stem, rest)) => format!("`fixtures/models/{stem}.toml`{rest}"),
        None => name.to_owned(),
    }
}

fn row<'a>(
    set: String,
    file: String,
    [expected, accepted]: [&'static str; 2],
    answer: &'a Answer,
    is_right: impl Fn(&Explained) -> bool,
) -> Row<'a> {
    let explained = answer.explained.as_ref().map_err(ToString::to_string);
    let is_met = explained.as_ref().is_ok_and(|explained| is_right(explained));
    let calibrated = answer.calibrated.as_ref();
    Row { set, file, expected, accepted, calibrated, explained, is_met }
}

/// An answer in a cell.
fn told(
    calibrated: Option<&Calibrated>,
    explained: &std::result::Result<&Explained, String>,
) -> String {
    let mut parts = Vec::new();
    let numbers = calibrated.iter().flat_map(|calibrated| &calibrated.numbers);
    let determined: Vec<String> = numbers
        .filter(|number| number.determined && FRICTION_KEYS.contains(&number.key.as_str()))
        .map(|number| {
            let [least, most] = number.interval_95();
            let ends = format!("{} to {}", short(least), short(most));
            format!("`{}` {} ({ends})", number.key, short(number.value))
        })
        .collect();
    if !determined.is_empty() {
        parts.push(format!("calibrated: {}", determined.join(", ")));
    }
    match explained {
        Ok(explained) => parts.push(of_explained(explained)),
        Err(refused) => parts.push(format!("refused: {refused}")),
    }
    parts.join("; ")
}

fn of_explained(explained: &Explained) -> String {
    let mut verdict = format!("**{}**", verdict(explained.verdict));
    let effects: Vec<String> = explained.effects.iter().map(of_finding).collect();
    if !effects.is_empty() {
        verdict = format!("{verdict}: {}", effects.join("; "));
    }
    if let (Verdict::Inconclusive, Some(reason)) = (explained.verdict, &explained.reason) {
        verdict = format!("{verdict}: {reason}");
    }
    let mut parts = vec![verdict];
    let symbols = |mut ids: Vec<EffectId>| {
        ids.dedup();
        ids.iter().map(|id| id.info().symbol).collect::<Vec<_>>().join(", ")
    };
    if !explained.alternatives.is_empty() {
        let others = explained.alternatives.iter().map(|f| f.effect.id()).collect();
        parts.push(format!("as likely: {}", symbols(others)));
    }
    for number in &explained.numbers {
        let [least, most] = number.interval_95.map(short);
        parts.push(format!("number `{}` {} ({least} to {most})", number.key, short(number.value)));
    }
    if !explained.absorbed.is_empty() {
        let absorbed = symbols(explained.absorbed.clone());
        parts.push(format!("not to be told from damage or tolerance: {absorbed}"));
    }
    if let Some(rms) = explained.holdout_rms {
        let [before, after] = rms.map(short);
        let unit = explained.drive_unit.to_uppercase();
        parts.push(format!("held out {before} {unit} before, {after} {unit} after"));
    }
    parts.join("; ")
}

/// An effect with the numbers that are not zero.
fn of_finding(finding: &Finding) -> String {
    let (info, effect) = (finding.effect.id().info(), &finding.effect);
    let mut numbers = Vec::new();
    for (parameter, value) in info.parameters.iter().zip(effect.values()) {
        if *value == 0.0 {
            continue;
        }
        let key = parameter.key(effect.geometry());
        let interval = finding.interval_95.iter().find(|one| one.key == key);
        let ends = interval.map_or_else(String::new, |one| {
            let [least, most] = one.interval_95;
            format!(" ({} to {})", short(least), short(most))
        });
        numbers.push(format!("`{key}` {}{ends}", short(*value)));
    }
    format!("{} {}, {}", info.symbol, info.name, numbers.join(", "))
}
