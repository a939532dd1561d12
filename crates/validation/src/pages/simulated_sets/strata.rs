//! Page on what is told of machines without an effect whose loops see noise, by kinds of recordings.

use std::fmt::Write as _;

use anyhow::Result;
use ema_sim::{
    FaultCoordinates, ModelFidelity,
    model_file::{MachineModel, Model},
};
use fdi_core::{Purpose, RootSeed, in_parallel};
use greybox::{Options, Record, Recordings, Verdict, explain};
use greybox_blind::UnusualNoise;

use super::{
    Answer, Kind,
    course::Course,
    hidden::Outlook,
    models, off,
    set::{Choice, HEALTHY},
};
use crate::{
    pages::{bar::met, chance::Chance, figure::Figure, measured::verdict, units::percent},
    processor::jobs,
    terminal::say,
};

/// Root seed of all sets; development used others.
const SEED: u64 = 20_261_130;
/// Sets of each stratum: healthy, with damage alone, and with one effect.
const HEALTHY_SETS: usize = 18;
const DAMAGED_SETS: usize = 6;
const EFFECT_SETS: usize = 3;
/// Streams of unusual noise, apart from those of the recordings.
const UNUSUAL: u64 = 100;
/// Largest level of damage.
const MOST_DAMAGE: f64 = 0.3;
/// Most healthy sets that get an alarm, of a stratum and of all, %, most with damage alone, and most
/// without a conclusion.
const MOST_ALARMS: usize = 1;
const MOST_ALARMS_PERCENT: f64 = 1.0;
const MOST_DAMAGED_PERCENT: f64 = 2.0;
const MOST_INCONCLUSIVE_PERCENT: f64 = 5.0;

/// Kind of recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stratum {
    Smooth,
    Staircase,
    FastSteps,
    Reversals,
    UnusualNoise,
}

impl Stratum {
    const ALL: [Self; 5] =
        [Self::Smooth, Self::Staircase, Self::FastSteps, Self::Reversals, Self::UnusualNoise];

    fn word(self) -> &'static str {
        match self {
            Self::Smooth => "smooth",
            Self::UnusualNoise => "unusual noise",
            other => other.course().word(),
        }
    }

    fn course(self) -> Course {
        match self {
            Self::Smooth | Self::UnusualNoise => Course::MultiSine,
            Self::Staircase => Course::Staircase,
            Self::FastSteps => Course::FastSteps,
            Self::Reversals => Course::Reversals,
        }
    }
}

/// Content of the machines of sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Content {
    Nothing,
    Damage,
    Effect,
}

impl Content {
    const ALL: [Self; 3] = [Self::Nothing, Self::Damage, Self::Effect];

    fn heading(self) -> &'static str {
        match self {
            Self::Nothing => "Healthy",
            Self::Damage => "Damage alone",
            Self::Effect => "One effect",
        }
    }

    fn sets(self) -> usize {
        match self {
            Self::Nothing => HEALTHY_SETS,
            Self::Damage => DAMAGED_SETS,
            Self::Effect => EFFECT_SETS,
        }
    }
}

/// A set of a stratum; machine and whether its numbers are its file's go by its place.
#[derive(Clone, Copy, Debug)]
struct Case {
    stratum: Stratum,
    content: Content,
    place: usize,
}

impl Case {
    fn is_off(self) -> bool {
        self.place / 3 % 2 == 1
    }

    fn kind(self) -> Kind {
        let (machine, course) = (self.place % 3, self.stratum.course());
        Kind { machine, fidelity: ModelFidelity::Low, course }
    }

    fn seed(self) -> RootSeed {
        let kind = Content::ALL.len() * self.stratum as usize + self.content as usize;
        let index = (1000 * kind + self.place) as u64;
        RootSeed(RootSeed(SEED).derive(Purpose::Units, index))
    }
}

/// A set of the staircase: seconds.
pub(crate) fn quick() -> Result<Vec<Figure>> {
    let case = Case { stratum: Stratum::Staircase, content: Content::Nothing, place: 1 };
    let answer = answer(&models()?, case)?;
    Ok(vec![Figure {
        id: "alarm".to_owned(),
        value: f64::from(u8::from(is_alarm(&answer))),
        tolerance_rel: 0.0,
        unit: "1".to_owned(),
    }])
}

pub(crate) fn text() -> Result<String> {
    let models = models()?;
    let mut page = String::from(include_str!("../strata/head.md"));
    let _ = writeln!(page, "\nRoot seed {SEED}.");
    for content in Content::ALL {
        say(&format!("strata: {}", content.heading()));
        let sets = content.sets();
        let cases = |stratum| (0..sets).map(move |place| Case { stratum, content, place });
        let cases: Vec<Case> = Stratum::ALL.into_iter().flat_map(cases).collect();
        let answers = in_parallel(&cases, jobs(), |_, &case| answer(&models, case))?;
        let answered: Vec<(Case, Answer)> = cases.into_iter().zip(answers).collect();
        let _ = writeln!(page, "\n## {}\n", content.heading());
        if content == Content::Effect {
            effect_rows(&mut page, &answered);
        } else {
            rows(&mut page, &answered, content);
        }
    }
    page.push_str(include_str!("../strata/limits.md"));
    Ok(page)
}

/// Answer to one set.
fn answer(models: &[Model], case: Case) -> Result<Answer> {
    let (kind, seed) = (case.kind(), case.seed());
    let model = &models[kind.machine];
    let machine = if case.is_off() { off::drawn(model, seed) } else { model.clone() };
    let choice =
        Choice { model, machine: &machine, fidelity: kind.fidelity, course: kind.course, seed };
    let hidden = match case.content {
        Content::Effect => Some(Outlook::new(&choice)?.draw()?),
        Content::Nothing | Content::Damage => None,
    };
    let faults = if case.content == Content::Damage { damage(seed) } else { HEALTHY };
    let mut recordings = choice.recordings(hidden.as_slice(), faults)?;
    if case.stratum == Stratum::UnusualNoise {
        disturb(&mut recordings, case.place, seed);
    }
    let options = Options::default();
    let explained = explain(&MachineModel::Actuator(model.clone()), &recordings, &options)?;
    Ok(Answer::new(kind, [model, &machine], hidden, &explained))
}

/// Two levels of damage, of seven.
fn damage(seed: RootSeed) -> FaultCoordinates {
    let mut chance = Chance::new(seed.derive(Purpose::Design, 1));
    let mut levels = HEALTHY;
    for _ in 0..2 {
        let place = (chance.uniform() * levels.0.len() as f64) as usize;
        levels.0[place] = chance.between(0.0, MOST_DAMAGE);
    }
    levels
}

/// Puts unusual noise of a kind on the currents, of one sensor in all recordings.
fn disturb(recordings: &mut Recordings, kind: usize, seed: RootSeed) {
    let Recordings { train, holdout, .. } = recordings;
    let of = |place: u64| seed.derive(Purpose::SensorNoise, UNUSUAL + place);
    let first: Vec<f64> = speeds(&train[0]).iter().map(|speed| speed.abs()).collect();
    let mean_speed = first.iter().sum::<f64>() / first.len() as f64;
    let sensor = UnusualNoise::draw(kind, mean_speed, of(0));
    for (place, record) in train.iter_mut().chain(holdout).enumerate() {
        let noise = sensor.samples_a(&speeds(record), record.rate_hz, of(1 + place as u64));
        for (value, noise) in record.drive.iter_mut().zip(noise) {
            *value += noise;
        }
    }
}

/// Speed at each sample, by the angle recorded.
fn speeds(record: &Record) -> Vec<f64> {
    let angle = record.position.as_deref().unwrap_or(&record.command);
    let last = angle.len() - 1;
    let of =
        |n: usize| (angle[(n + 1).min(last)] - angle[n.saturating_sub(1)]) * record.rate_hz / 2.0;
    (0..angle.len()).map(of).collect()
}

/// Tells whether an effect is named, something unknown is told, or a number that is within its tolerance.
fn is_alarm(answer: &Answer) -> bool {
    let is_silent = matches!(answer.verdict, Verdict::Absorbed | Verdict::Inconclusive);
    !answer.is_adequate() && (!is_silent || answer.false_numbers > 0)
}

fn of(answered: &[(Case, Answer)], stratum: Option<Stratum>) -> Vec<&Answer> {
    let is_of = |case: &Case| stratum.is_none_or(|stratum| case.stratum == stratum);
    answered.iter().filter(|(case, _)| is_of(case)).map(|(_, answer)| answer).collect()
}

/// Alarms and the other answers by strata.
fn rows(page: &mut String, answered: &[(Case, Answer)], content: Content) {
    let _ = writeln!(
        page,
        "| recordings | sets | alarms | adequate | absorbed | inconclusive | numbers told, falsely |\n\
         |---|---:|---:|---:|---:|---:|---:|"
    );
    let mut is_met = true;
    for stratum in Stratum::ALL.into_iter().map(Some).chain([None]) {
        let own = of(answered, stratum);
        let count = |is: &dyn Fn(&Answer) -> bool| own.iter().filter(|one| is(one)).count();
        let of_verdict = |verdict| count(&|one: &Answer| one.verdict == verdict);
        let (alarms, inconclusive) = (count(&is_alarm), of_verdict(Verdict::Inconclusive));
        let most =
            if content == Content::Nothing { MOST_ALARMS_PERCENT } else { MOST_DAMAGED_PERCENT };
        is_met &= percent(inconclusive, own.len()) <= MOST_INCONCLUSIVE_PERCENT
            && if stratum.is_none() {
                percent(alarms, own.len()) <= most
            } else {
                alarms <= MOST_ALARMS
            };
        let told: usize = own.iter().map(|one| one.numbers).sum();
        let falsely: usize = own.iter().map(|one| one.false_numbers).sum();
        let _ = writeln!(
            page,
            "| {} | {} | {alarms} | {} | {} | {inconclusive} | {told}, {falsely} |",
            stratum.map_or("all", Stratum::word),
            own.len(),
            count(&Answer::is_adequate),
            of_verdict(Verdict::Absorbed),
        );
    }
    let _ = writeln!(page, "\nAll that is asked for: {}. Alarms:\n", met(is_met));
    for (case, one) in answered.iter().filter(|(_, one)| is_alarm(one)) {
        told(page, *case, one);
    }
}

/// Table of the sets with an effect.
fn effect_rows(page: &mut String, answered: &[(Case, Answer)]) {
    let _ = writeln!(
        page,
        "| recordings | sets | right | another named | adequate |\n|---|---:|---:|---:|---:|"
    );
    for stratum in Stratum::ALL.into_iter().map(Some).chain([None]) {
        let own = of(answered, stratum);
        let count = |is: &dyn Fn(&Answer) -> bool| own.iter().filter(|one| is(one)).count();
        let _ = writeln!(
            page,
            "| {} | {} | {} | {} | {} |",
            stratum.map_or("all", Stratum::word),
            own.len(),
            count(&Answer::is_right),
            count(&|one| !one.named.is_empty() && !one.named.contains(&one.truth())),
            count(&Answer::is_adequate),
        );
    }
    let _ = writeln!(page, "\nThose missed:\n");
    for (case, one) in answered.iter().filter(|(_, one)| !one.is_right()) {
        told(page, *case, one);
    }
}

/// A line of what was said of a set.
fn told(page: &mut String, case: Case, one: &Answer) {
    let numbers = if case.is_off() { "numbers off" } else { "as its file" };
    let named = if one.named.is_empty() { "nothing".to_owned() } else { one.named.join(", ") };
    let _ = writeln!(
        page,
        "- {}, {}, {numbers}: hidden {}, {}, {named} named, {} numbers told",
        case.stratum.word(),
        super::MACHINES[case.kind().machine],
        one.truth(),
        verdict(one.verdict),
        one.numbers,
    );
}
