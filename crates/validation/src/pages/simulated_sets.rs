//! Page on explanations of recordings that this repository simulates.

mod course;
mod hidden;
mod off;
mod set;
pub(super) mod strata;

use std::fmt::Write as _;

use anyhow::Result;
use ema_sim::{
    Effect, ModelFidelity, Parameter,
    model_file::{MachineModel, Model},
};
use fdi_core::{Purpose, RootSeed, in_parallel};
use greybox::{Explained, Observation, Options, Verdict, WrongNumber, explain};

use self::{
    course::Course,
    hidden::Outlook,
    set::{Choice, HEALTHY, MACHINES, machine},
};
use super::{bar::met, figure::Figure, measured::verdict, units::percent};
use crate::{processor::jobs, terminal::say};

const HEAD: &str = include_str!("simulated_sets/head.md");
const HIDDEN: &str = include_str!("simulated_sets/hidden.md");
const OFF: &str = include_str!("simulated_sets/off.md");
const LIMITS: &str = include_str!("simulated_sets/limits.md");

/// Root seed of all sets; development used commands of its own.
const SEED: u64 = 20_261_128;
/// Sets without an effect, and with one, of each machine, kind of command and fidelity.
const WITHOUT_EFFECT: usize = 2;
const WITH_EFFECT: usize = 1;
/// Place from which on sets of a kind are of machines with numbers of their own.
const FIRST_OFF: usize = 500;
/// Fewest sets without an effect that are called adequate, %, and with one that are right.
const LEAST_ADEQUATE: f64 = 99.0;
const LEAST_RIGHT: f64 = 85.0;

const FIDELITIES: [ModelFidelity; 2] = [ModelFidelity::High, ModelFidelity::Low];

/// Machine, fidelity and command of sets.
#[derive(Clone, Copy)]
struct Kind {
    machine: usize,
    fidelity: ModelFidelity,
    course: Course,
}

impl Kind {
    fn in_words(self) -> String {
        let Self { machine, fidelity, course } = self;
        format!("{}, {}, {}", MACHINES[machine], word(fidelity), course.word())
    }
}

/// Content of sets beside their kind.
#[derive(Clone, Copy)]
struct Content {
    /// True where machines have numbers of their own.
    is_off: bool,
    has_effect: bool,
}

/// Answer to a set.
struct Answer {
    kind: Kind,
    /// Effect that was hidden.
    hidden: Option<Effect>,
    verdict: Verdict,
    observation: Option<Observation>,
    /// Symbols of the effects named.
    named: Vec<&'static str>,
    /// Symbols that are as good as one named, or not to be told from damage.
    open: Vec<&'static str>,
    /// Numbers told as wrong, and those of them that are within their tolerance.
    numbers: usize,
    false_numbers: usize,
}

impl Answer {
    fn new(
        kind: Kind,
        [file, machine]: [&Model; 2],
        hidden: Option<Effect>,
        explained: &Explained,
    ) -> Self {
        let is_within = |wrong: &&WrongNumber| {
            let number = Parameter::find(&wrong.key)
                .map(|parameter| parameter.get(&machine.actuator) - parameter.get(&file.actuator));
            number.is_none_or(|off| off.abs() <= wrong.tolerance)
        };
        let symbol = |effect: &Effect| effect.id().info().symbol;
        let ties = explained.alternatives.iter().map(|one| symbol(&one.effect));
        let absorbed = explained.absorbed.iter().map(|id| id.info().symbol);
        Self {
            kind,
            hidden,
            verdict: explained.verdict,
            observation: explained.observation,
            named: explained.effects.iter().map(|found| symbol(&found.effect)).collect(),
            open: ties.chain(absorbed).collect(),
            numbers: explained.numbers.len(),
            false_numbers: explained.numbers.iter().filter(is_within).count(),
        }
    }

    /// Without an effect, and of the numbers told as wrong each is.
    fn is_adequate(&self) -> bool {
        let by_numbers = self.verdict == Verdict::Named && self.named.is_empty();
        (self.verdict == Verdict::Adequate || by_numbers) && self.false_numbers == 0
    }

    /// Symbol of the effect that was hidden.
    fn truth(&self) -> &'static str {
        self.hidden.as_ref().map_or("-", |effect| effect.id().info().symbol)
    }

    fn is_right(&self) -> bool {
        self.named.contains(&self.truth())
            || !self.is_adequate() && self.open.contains(&self.truth())
    }

    fn is_alone(&self) -> bool {
        self.named == [self.truth()]
    }
}

/// One set of the bench: seconds.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let models = models()?;
    let kind = Kind { machine: 1, fidelity: ModelFidelity::High, course: Course::MultiSine };
    let content = Content { is_off: false, has_effect: false };
    let answer = answer(&models, kind, 0, content)?;
    Ok(vec![Figure {
        id: "adequate".to_owned(),
        value: f64::from(u8::from(answer.is_adequate())),
        tolerance_rel: 0.0,
        unit: "1".to_owned(),
    }])
}

pub(super) fn text() -> Result<String> {
    let models = models()?;
    let mut page = String::from(HEAD);
    let _ = writeln!(page, "\nRoot seed {SEED}.");
    for is_off in [false, true] {
        let (heading, piece) =
            if is_off { ("off their files", OFF) } else { ("as their files", "") };
        say(&format!("simulated sets: machines {heading}"));
        let of = |has_effect| Content { is_off, has_effect };
        let with_effect = answers(&models, WITH_EFFECT, of(true))?;
        let healthy = answers(&models, WITHOUT_EFFECT, of(false))?;
        let _ = writeln!(page, "\n## Machines {heading}\n\n{piece}### Without an effect\n");
        healthy_rows(&mut page, &healthy);
        let hidden = if is_off { "" } else { HIDDEN };
        let _ = writeln!(page, "\n### With one effect\n\n{hidden}");
        effect_rows(&mut page, &with_effect);
    }
    page.push_str(LIMITS);
    Ok(page)
}

fn models() -> Result<Vec<Model>> {
    MACHINES.iter().map(|name| machine(name)).collect()
}

/// Answers to so many sets of each kind.
fn answers(models: &[Model], count: usize, content: Content) -> Result<Vec<Answer>> {
    let kinds = (0..models.len()).flat_map(|machine| {
        FIDELITIES.into_iter().flat_map(move |fidelity| {
            Course::OF_SETS.into_iter().map(move |course| Kind { machine, fidelity, course })
        })
    });
    // what takes long is spread over the threads
    let kinds: Vec<Kind> = kinds.collect();
    let sets: Vec<(Kind, usize)> =
        (0..count).flat_map(|place| kinds.iter().map(move |kind| (*kind, place))).collect();
    in_parallel(&sets, jobs(), |_, &(kind, place)| answer(models, kind, place, content))
}

/// Answer to one set.
fn answer(models: &[Model], kind: Kind, place: usize, content: Content) -> Result<Answer> {
    let Content { is_off, has_effect } = content;
    let place = if is_off { place + FIRST_OFF } else { place };
    let fidelity = usize::from(kind.fidelity == ModelFidelity::Low);
    let of_kind = (kind.machine * FIDELITIES.len() + fidelity) * Course::OF_SETS.len();
    let course =
        Course::OF_SETS.iter().position(|course| *course == kind.course).unwrap_or_default();
    let index = 2 * (1000 * (of_kind + course) + place) + usize::from(has_effect);
    let model = &models[kind.machine];
    let seed = RootSeed(RootSeed(SEED).derive(Purpose::Units, index as u64));
    let machine = if is_off { off::drawn(model, seed) } else { model.clone() };
    let Kind { fidelity, course, .. } = kind;
    let choice = Choice { model, machine: &machine, fidelity, course, seed };
    let hidden = if has_effect { Some(Outlook::new(&choice)?.draw()?) } else { None };
    let recordings = choice.recordings(hidden.as_slice(), HEALTHY)?;
    let file = MachineModel::Actuator(model.clone());
    let explained = explain(&file, &recordings, &Options::default())?;
    Ok(Answer::new(kind, [model, &machine], hidden, &explained))
}

/// A table by machine and fidelity, and what was not adequate.
fn healthy_rows(page: &mut String, answers: &[Answer]) {
    let _ = write!(page, "| machine | recordings |");
    for course in Course::OF_SETS {
        let _ = write!(page, " {} |", course.word());
    }
    let _ = writeln!(page, " predicted by ideal, low, high |\n|---|---|{}---|", "---:|".repeat(5));
    for (machine, name) in MACHINES.iter().enumerate() {
        for fidelity in FIDELITIES {
            let own: Vec<&Answer> = answers
                .iter()
                .filter(|one| one.kind.machine == machine && one.kind.fidelity == fidelity)
                .collect();
            let _ = write!(page, "| {name} | {} |", word(fidelity));
            for course in Course::OF_SETS {
                let of: Vec<&&Answer> =
                    own.iter().filter(|one| one.kind.course == course).collect();
                let adequate = of.iter().filter(|one| one.is_adequate()).count();
                let _ = write!(page, " {adequate} of {} |", of.len());
            }
            let by = Observation::ALL.map(|observation| {
                let is_it = |one: &&&Answer| one.observation == Some(observation);
                own.iter().filter(is_it).count().to_string()
            });
            let _ = writeln!(page, " {} |", by.join(", "));
        }
    }
    let adequate = answers.iter().filter(|one| one.is_adequate()).count();
    let share = percent(adequate, answers.len());
    let _ = writeln!(
        page,
        "\nAdequate: {adequate} of {} ({share:.1} %), asked for {LEAST_ADEQUATE} %: {}.",
        answers.len(),
        met(share >= LEAST_ADEQUATE)
    );
    let told: usize = answers.iter().map(|one| one.numbers).sum();
    let false_ones: usize = answers.iter().map(|one| one.false_numbers).sum();
    if told > 0 {
        let _ = writeln!(
            page,
            "\nNumbers told as wrong in the model file: {told}, of which the machine has \
             {false_ones} within the tolerance."
        );
    }
    for one in answers.iter().filter(|one| !one.is_adequate()) {
        let told: Vec<&str> =
            std::iter::once(verdict(one.verdict)).chain(one.named.iter().copied()).collect();
        let _ = writeln!(page, "\n- {}: {}", one.kind.in_words(), told.join(" "));
    }
}

fn effect_rows(page: &mut String, answers: &[Answer]) {
    let _ = writeln!(
        page,
        "| machine | recordings | sets | right, % | it alone, % | another named, % | adequate, % | \
         inconclusive, % |\n|---|---|---:|---:|---:|---:|---:|---:|"
    );
    for fidelity in FIDELITIES {
        for machine in [None, Some(0), Some(1), Some(2)] {
            let own: Vec<&Answer> = answers
                .iter()
                .filter(|one| machine.is_none_or(|machine| one.kind.machine == machine))
                .filter(|one| one.kind.fidelity == fidelity)
                .collect();
            let share = |is: &dyn Fn(&Answer) -> bool| {
                percent(own.iter().filter(|one| is(one)).count(), own.len())
            };
            let right = share(&Answer::is_right);
            let judged = if machine.is_none() { met(right >= LEAST_RIGHT) } else { "" };
            let _ = writeln!(
                page,
                "| {} | {} | {} | {right:.1} {judged} | {:.1} | {:.1} | {:.1} | {:.1} |",
                machine.map_or("all", |machine| MACHINES[machine]),
                word(fidelity),
                own.len(),
                share(&Answer::is_alone),
                share(&|one| !one.named.is_empty() && !one.named.contains(&one.truth())),
                share(&Answer::is_adequate),
                share(&|one| one.verdict == Verdict::Inconclusive),
            );
        }
    }
    let _ =
        writeln!(page, "\nAsked for: right in {LEAST_RIGHT} % of each fidelity. Those missed:\n");
    for one in answers.iter().filter(|one| !one.is_right()) {
        let named = if one.named.is_empty() { "nothing".to_owned() } else { one.named.join(", ") };
        let _ = writeln!(
            page,
            "- {}: {} hidden, {}, {named} named",
            one.kind.in_words(),
            one.truth(),
            verdict(one.verdict)
        );
    }
}

fn word(fidelity: ModelFidelity) -> &'static str {
    match fidelity {
        ModelFidelity::High => "high fidelity",
        ModelFidelity::Low => "low fidelity",
    }
}
