//! `docs/validation/detection-limits.md`: effects added to measured recordings, at sizes about the
//! smallest that an explanation says it would have named.

use core::f64::consts::TAU;
use std::fmt::Write as _;

use anyhow::{Context, Result};
use ema_sim::{Effect, EffectId, Role};
use greybox::{Explained, Finding, Options, SmallestNamed, explain, with_effect};

use super::{
    bar::met,
    figure::Figure,
    measured::verdict,
    signal_chain::{Set, emps_sound, laas_sound},
    units::percent,
};

/// Threads.
const JOBS: usize = 2;
/// Phases of an effect that has one.
const PHASES: usize = 6;
/// The first of them, turns.
const FIRST_PHASE_TURNS: f64 = 0.029;
/// Samples of each recording of LAAS that are explained.
const BRIEF_SAMPLES: usize = 4000;
/// Sizes over the limit, and the share seen that is asked for, least and most, %.
const ASKED: [(f64, [f64; 2]); 3] = [(0.5, [0.0, 30.0]), (1.0, [60.0, 95.0]), (2.0, [95.0, 100.0])];
/// Relative difference of a limit that a search with tolerances of its own may show.
const LIMIT_REL: f64 = 0.1;

/// The limit of the cogging of EMPS: half a minute.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let explained = explained(&emps_sound()?)?;
    let limit = limit_of(&explained, EffectId::Cogging, None).context("a limit of the cogging")?;
    Ok(vec![Figure {
        id: "emps-cogging-limit".to_owned(),
        value: limit.size,
        tolerance_rel: LIMIT_REL,
        unit: "N".to_owned(),
    }])
}

pub(super) fn text() -> Result<String> {
    let mut page = String::from(include_str!("detection_limits/head.md"));
    let emps = emps_sound()?;
    let extended = Set { model: explained(&emps)?.extend(&emps.model), ..emps.clone() };
    let asymmetries = ["viscous_asymmetry", "coulomb_asymmetry"];
    let asymmetry = asymmetries.map(|key| (EffectId::DirectionalFriction, Some(key)));
    let cogging = (EffectId::Cogging, None);
    let lag = (EffectId::PositionSensor, Some("lag_s"));
    let delay = (EffectId::ControllerMismatch, Some("delay_s"));
    let whole = [&[cogging, lag, delay][..], &asymmetry].concat();
    let mut score = Score::default();
    story(&mut page, &mut score, "EMPS", &emps, &[cogging, lag, delay])?;
    story(&mut page, &mut score, "EMPS, extended", &extended, &whole)?;
    let laas = laas_sound()?.part(0..BRIEF_SAMPLES);
    story(&mut page, &mut score, "LAAS", &laas, &[&[cogging][..], &asymmetry].concat())?;
    score.write(&mut page)?;
    Ok(page)
}

fn explained(set: &Set) -> Result<Explained> {
    let options = Options { jobs: JOBS, ..Options::default() };
    Ok(explain(&set.model, &set.recordings, &options)?)
}

/// The limit of an effect, by the beginning of the key of its size where it has several.
fn limit_of<'e>(
    explained: &'e Explained,
    id: EffectId,
    key: Option<&str>,
) -> Option<&'e SmallestNamed> {
    let is_asked = |limit: &&SmallestNamed| {
        limit.effect.id() == id && key.is_none_or(|key| limit.key.starts_with(key))
    };
    explained.smallest_named_90.iter().find(is_asked)
}

/// Cases seen of those added, by size.
#[derive(Default)]
struct Score {
    seen: [usize; 3],
    added: usize,
}

impl Score {
    fn write(&self, page: &mut String) -> Result<()> {
        page.push_str("\n## All together\n\n| size over the limit | seen | asked for | |\n");
        page.push_str("| ---: | ---: | ---: | --- |\n");
        for ((times, [least, most]), seen) in ASKED.into_iter().zip(self.seen) {
            let share = percent(seen, self.added);
            writeln!(
                page,
                "| {times} | {seen} of {} ({share:.0} %) | {least:.0} to {most:.0} % | {} |",
                self.added,
                met((least..=most).contains(&share)),
            )?;
        }
        Ok(())
    }
}

/// Effects added to a set, each at all sizes.
fn story(
    page: &mut String,
    score: &mut Score,
    name: &str,
    set: &Set,
    asked: &[(EffectId, Option<&str>)],
) -> Result<()> {
    let base = explained(set)?;
    writeln!(
        page,
        "\n## {name}\n\nAs recorded: {}, {}.\n\n\
         | added | limit | seen at half of it | at it | at twice |\n\
         | --- | ---: | ---: | ---: | ---: |",
        verdict(base.verdict),
        symbols(&base.effects),
    )?;
    for &(id, key) in asked {
        let symbol = id.info().symbol;
        let Some(limit) = limit_of(&base, id, key) else {
            let key = key.map_or_else(String::new, |key| format!(" `{key}…`"));
            writeln!(page, "| {symbol}{key} | none | | | |")?;
            continue;
        };
        let all = directions(limit);
        let mut seen = [0; 3];
        for ((times, _), seen) in ASKED.iter().zip(&mut seen) {
            for &direction in &all {
                let effect = sized(limit, times * limit.size, direction)?;
                let recordings = with_effect(&set.model, &set.recordings, &effect)?;
                let answer = explained(&Set { model: set.model.clone(), recordings })?;
                *seen += usize::from(is_seen(&answer, &effect));
            }
        }
        let order = place_of(&limit.effect, Role::Order);
        let order = order.map(|place| format!(" of order {:.0}", limit.effect.values()[place]));
        writeln!(
            page,
            "| {symbol} `{}`{} | {:.3e} | {} of {count} | {} of {count} | {} of {count} |",
            limit.key,
            order.unwrap_or_default(),
            limit.size,
            seen[0],
            seen[1],
            seen[2],
            count = all.len(),
        )?;
        score.added += all.len();
        score.seen.iter_mut().zip(seen).for_each(|(all, seen)| *all += seen);
    }
    Ok(())
}

fn symbols(findings: &[Finding]) -> String {
    let named: Vec<&str> = findings.iter().map(|f| f.effect.id().info().symbol).collect();
    if named.is_empty() { "no effect".to_owned() } else { named.join(", ") }
}

fn place_of(effect: &Effect, role: Role) -> Option<usize> {
    effect.id().info().parameters.iter().position(|parameter| parameter.role() == role)
}

/// Cosine and sine of each phase of an effect that has one, else the signs that it can have.
fn directions(limit: &SmallestNamed) -> Vec<[f64; 2]> {
    let place = place_of_size(limit);
    if group(limit).len() == 2 {
        let turns = |n: usize| FIRST_PHASE_TURNS + n as f64 / PHASES as f64;
        let phase = |n: usize| [(TAU * turns(n)).cos(), (TAU * turns(n)).sin()];
        return (0..PHASES).map(phase).collect();
    }
    let has_one_sign = limit.effect.id().info().parameters[place].bounds().0 >= 0.0;
    if has_one_sign { vec![[1.0, 0.0]] } else { vec![[1.0, 0.0], [-1.0, 0.0]] }
}

fn place_of_size(limit: &SmallestNamed) -> usize {
    let geometry = limit.effect.geometry();
    let mut parameters = limit.effect.id().info().parameters.iter();
    parameters.position(|parameter| parameter.key(geometry) == limit.key).unwrap_or(0)
}

/// Sizes that belong to that of a limit.
fn group(limit: &SmallestNamed) -> Vec<usize> {
    let groups = limit.effect.id().info().size_groups();
    let place = place_of_size(limit);
    groups.into_iter().find(|group| group.contains(&place)).unwrap_or_default()
}

/// The effect of a limit with another size.
fn sized(limit: &SmallestNamed, size: f64, direction: [f64; 2]) -> Result<Effect> {
    let mut effect = limit.effect.clone();
    let parameters = effect.id().info().parameters;
    for (place, part) in group(limit).into_iter().zip(direction) {
        effect.set(parameters[place].key(effect.geometry()), size * part)?;
    }
    Ok(effect)
}

/// Tells whether an effect is among the answers: one of an order by that, a delay by a lag too.
fn is_seen(answer: &Explained, added: &Effect) -> bool {
    let order = |effect: &Effect| place_of(effect, Role::Order).map(|n| effect.values()[n]);
    let is_late = |effect: &Effect| {
        let has = |key: &str| effect.get(key).is_some_and(|size| size != 0.0);
        has("lag_s") || has("delay_s")
    };
    let is_same = |effect: &Effect| {
        let of_order = match (order(effect), order(added)) {
            (Some(a), Some(b)) => (a / b - 1.0).abs() < 0.01,
            _ => true,
        };
        effect.id() == added.id() && of_order || is_late(effect) && is_late(added)
    };
    let mut all = answer.effects.iter().chain(&answer.alternatives);
    all.any(|finding| is_same(&finding.effect))
}
