//! `docs/validation/signal-chain.md`: mutations of measured recordings, and false alarms on sound
//! ones.

mod emps;
mod laas;
mod mutation;
mod null;

use std::fmt::Write as _;

use anyhow::{Context, Result};
use ema_sim::EffectId;
use greybox::{NumberInterval, Options, SignalCode, Verdict, check_signals, explain};

use self::mutation::{Asked, Case};
pub(super) use self::{laas::sound as laas_sound, mutation::Set};
use super::{bar::met, figure::Figure, measured::verdict, section::Section};

/// Threads.
const JOBS: usize = 2;
/// Healthy simulated sets.
const HEALTHY: u64 = 300;
/// Sets of each effect.
const OF_EFFECT: u64 = 10;
/// Seeds of the simulated sets begin here.
const SEED: u64 = 330_000;
/// Samples of each recording of LAAS that are explained.
const BRIEF_SAMPLES: usize = 4000;
/// Share of harmful mutations that are to be told by their own code.
const ASKED_SHARE: f64 = 0.8;

/// How many harmful mutations of EMPS are told by their own code, without the explanation: seconds.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let emps = emps::Emps::read()?;
    let (mut told, mut scored) = (0, 0);
    for case in emps.harmful()?.iter().filter(|case| !case.is_development) {
        scored += 1;
        told += u32::from(code(&case.set)?.is_some_and(|code| case.asked == Asked::Code(code)));
    }
    let figure = |id: &str, value: u32| Figure {
        id: id.to_owned(),
        value: f64::from(value),
        tolerance_rel: 0.0,
        unit: "1".to_owned(),
    };
    Ok(vec![figure("emps-harmful-scored", scored), figure("emps-harmful-told", told)])
}

/// Recordings of EMPS, the pulses of its test taken for a load.
pub(super) fn emps_sound() -> Result<Set> {
    Ok(emps::Emps::read()?.sound)
}

/// Code of the first find.
fn code(set: &Set) -> Result<Option<SignalCode>> {
    let finds = check_signals(&set.model, &set.recordings, JOBS)?;
    Ok(finds.first().map(|find| find.code))
}

/// Answer to a set.
struct Answered {
    code: Option<SignalCode>,
    verdict: Verdict,
    effects: Vec<EffectId>,
    /// Numbers of the first effect.
    numbers: Vec<NumberInterval>,
    told: String,
}

impl Answered {
    /// The verdict, or the code of what is wrong with the signals.
    fn word(&self) -> String {
        self.code
            .map_or_else(|| verdict(self.verdict).to_owned(), |code| format!("`{}`", code.word()))
    }
}

fn answered(set: &Set, options: &Options) -> Result<Answered> {
    let explained = explain(&set.model, &set.recordings, options)?;
    let find = explained.signals.first();
    Ok(Answered {
        code: find.map(|find| find.code),
        verdict: explained.verdict,
        effects: explained.effects.iter().map(|found| found.effect.id()).collect(),
        numbers: explained.effects.first().map_or_else(Vec::new, |found| found.interval_95.clone()),
        told: find.map_or_else(String::new, |find| find.told.clone()),
    })
}

fn whole(set: &Set) -> Result<Answered> {
    answered(set, &Options { jobs: JOBS, ..Options::default() })
}

/// Answer to all of a set by its signal chain, and where that says nothing, to its beginning by one
/// effect alone.
fn briefly(set: &Set) -> Result<Answered> {
    if code(set)?.is_some() {
        return whole(set);
    }
    let options = Options { jobs: JOBS, most_effects: 1, refitted: 2, ..Options::default() };
    answered(&set.part(0..BRIEF_SAMPLES), &options)
}

fn symbols(effects: &[EffectId]) -> String {
    let symbols: Vec<&str> = effects.iter().map(|id| id.info().symbol).collect();
    if symbols.is_empty() { "none".to_owned() } else { symbols.join(", ") }
}

/// The section that can be rebuilt on its own; explanations of LAAS take most of the page's time.
pub(super) const SECTIONS: &[Section] = &[Section {
    name: "elsewhere",
    write: |page| emps_elsewhere(&mut page.markdown, &emps::Emps::read()?),
}];

pub(super) fn text() -> Result<String> {
    let mut page = String::from(include_str!("signal_chain/head.md"));
    let emps = emps::Emps::read()?;
    emps_story(&mut page, &emps)?;
    emps_elsewhere(&mut page, &emps)?;
    laas_story(&mut page)?;
    nulls(&mut page)?;
    page.push_str(include_str!("signal_chain/limits.md"));
    Ok(page)
}

/// EMPS with both kinds of mutations.
fn emps_story(page: &mut String, emps: &emps::Emps) -> Result<()> {
    let base = whole(&emps.sound)?;
    let first = *base.effects.first().context("a cause of the unmutated set")?;
    writeln!(
        page,
        "\n{}\nUnmutated: no find, {}, {}. The cause that has to stay is {}.\n\n\
         | equivalent mutation | answer | effects | |\n| --- | --- | --- | --- |",
        include_str!("signal_chain/emps.md"),
        verdict(base.verdict),
        symbols(&base.effects),
        first.info().symbol
    )?;
    let equivalent = emps.equivalent()?;
    let mut kept = 0;
    for case in &equivalent {
        let answer = whole(&case.set)?;
        let is_kept = answer.code.is_none() && answer.effects.first() == Some(&first);
        kept += usize::from(is_kept);
        let found = answer.word();
        let effects = symbols(&answer.effects);
        writeln!(page, "| {} | {found} | {effects} | {} |", case.name, met(is_kept))?;
    }
    let score = harmful_table(page, &emps.harmful()?, whole)?;
    writeln!(
        page,
        "\n| asked for | found | |\n| --- | --- | --- |\n\
         | equivalent mutations keep the cause | {kept} of {} | {} |",
        equivalent.len(),
        met(kept == equivalent.len())
    )?;
    score.write(page)
}

/// EMPS by other model files and at other rates.
fn emps_elsewhere(page: &mut String, emps: &emps::Emps) -> Result<()> {
    writeln!(
        page,
        "\n{}\n| set out from | answer | effects | numbers of the first, 95 % | |\n\
         | --- | --- | --- | --- | --- |",
        include_str!("signal_chain/elsewhere.md")
    )?;
    let absurd = [EffectId::Cogging, EffectId::Vibration];
    for (name, set) in emps.set_out_elsewhere()? {
        let answer = whole(&set)?;
        let is_right = answer.effects.first() == Some(&EffectId::DirectionalFriction)
            && !answer.effects.iter().any(|effect| absurd.contains(effect));
        let number = |number: &NumberInterval| {
            let [low, high] = number.interval_95;
            format!("`{}` {low:.3} to {high:.3}", number.key)
        };
        let numbers: Vec<String> = answer.numbers.iter().map(number).collect();
        let (found, effects) = (answer.word(), symbols(&answer.effects));
        let numbers = numbers.join(", ");
        writeln!(page, "| {name} | {found} | {effects} | {numbers} | {} |", met(is_right))?;
    }
    Ok(())
}

/// LAAS with harmful mutations.
fn laas_story(page: &mut String) -> Result<()> {
    let sound = laas::sound()?;
    let unmutated = match code(&sound)? {
        Some(code) => format!("`{}`", code.word()),
        None => "no find".to_owned(),
    };
    writeln!(page, "\n{}\nUnmutated: {unmutated}.", include_str!("signal_chain/laas.md"))?;
    let score = harmful_table(page, &laas::harmful(&sound)?, briefly)?;
    page.push_str("\n| asked for | found | |\n| --- | --- | --- |\n");
    score.write(page)
}

/// Counts of harmful mutations.
#[derive(Default)]
struct Score {
    scored: usize,
    told: usize,
    /// Scored ones with another answer than `inconclusive`.
    silent: usize,
    /// Cases in which an effect is named, development cases too.
    named: usize,
    /// Development cases, and those of them that are told.
    development: [usize; 2],
}

impl Score {
    fn write(&self, page: &mut String) -> Result<()> {
        let Self { scored, told, silent, named, development: [tried, told_there] } = *self;
        let share = told as f64 / scored as f64;
        writeln!(
            page,
            "| harmful mutations are told by their own code, {:.0} % at least | {told} of {scored} \
             ({:.0} %) | {} |\n\
             | all of them are inconclusive | {} of {scored} | {} |\n\
             | no effect is named in a harmful one | {named} of {} | {} |",
            100.0 * ASKED_SHARE,
            100.0 * share,
            met(share >= ASKED_SHARE),
            scored - silent,
            met(silent == 0),
            scored + tried,
            met(named == 0),
        )?;
        if tried > 0 {
            writeln!(
                page,
                "| development cases, told by their own code | {told_there} of {tried} | |"
            )?;
        }
        Ok(())
    }
}

/// A row for each harmful mutation.
fn harmful_table(
    page: &mut String,
    cases: &[Case],
    answer: fn(&Set) -> Result<Answered>,
) -> Result<Score> {
    page.push_str(
        "\n| harmful mutation | own code | code found | told as | |\n\
         | --- | --- | --- | --- | --- |\n",
    );
    let mut score = Score::default();
    for case in cases {
        let answer = answer(&case.set)?;
        let Asked::Code(own) = case.asked else { continue };
        let is_told = answer.code == Some(own);
        let found = answer.code.map_or("none", SignalCode::word);
        let mark = if case.is_development { "development" } else { met(is_told) };
        let told_as = if answer.told.is_empty() {
            format!("{}: {}", verdict(answer.verdict), symbols(&answer.effects))
        } else {
            answer.told.clone()
        };
        writeln!(page, "| {} | `{}` | `{found}` | {told_as} | {mark} |", case.name, own.word())?;
        score.named += usize::from(!answer.effects.is_empty());
        if case.is_development {
            score.development[0] += 1;
            score.development[1] += usize::from(is_told);
        } else {
            score.scored += 1;
            score.told += usize::from(is_told);
            score.silent += usize::from(answer.verdict != Verdict::Inconclusive);
        }
    }
    Ok(score)
}

/// False alarms on sound simulated sets.
fn nulls(page: &mut String) -> Result<()> {
    let mut healthy = Vec::new();
    for seed in 0..HEALTHY {
        healthy.extend(null::finds(&[], SEED + seed)?.into_iter().next().map(|find| find.code));
    }
    writeln!(
        page,
        "\n## False alarms\n\nThe axis of the guide (`fixtures/models/axis.toml`), simulated: three recordings of 6 s \
         of random sums of four sines, 20 mA of noise, 12 bits. By the stated chance, {:.1} of {HEALTHY} healthy sets \
         would be called unsound.\n\n| sets | called unsound | codes |\n| --- | ---: | --- |\n\
         | healthy | {} of {HEALTHY} | {} |",
        greybox::FALSE_ALARM * HEALTHY as f64,
        healthy.len(),
        words(&healthy)
    )?;
    for (place, effect) in null::effects()?.into_iter().enumerate() {
        let mut found = Vec::new();
        for seed in 0..OF_EFFECT {
            let seed = SEED + 1000 * (place as u64 + 1) + seed;
            let effects = [effect.clone()];
            found.extend(null::finds(&effects, seed)?.into_iter().next().map(|find| find.code));
        }
        let info = effect.id().info();
        writeln!(
            page,
            "| {} {}, {} | {} of {OF_EFFECT} | {} |",
            info.symbol,
            info.name,
            sizes(&effect),
            found.len(),
            words(&found)
        )?;
    }
    Ok(())
}

/// Numbers of an effect that were given.
fn sizes(effect: &ema_sim::Effect) -> String {
    let given = effect.values().iter().filter(|value| **value != 0.0);
    given.map(|value| format!("{value}")).collect::<Vec<_>>().join(", ")
}

fn words(codes: &[SignalCode]) -> String {
    let mut words: Vec<&str> = codes.iter().map(|code| code.word()).collect();
    words.sort_unstable();
    words.dedup();
    if words.is_empty() { "-".to_owned() } else { words.join(", ") }
}
