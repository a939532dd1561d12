//! `fdi explain` on machines in which something is hidden: the truth is sealed before, and opened
//! after. The scored set with its bars is `cargo xtask blind`. So few cases show no rate: a limit here
//! is what a program with the rates of that set keeps about nine times in ten. `cargo xtask mutants`
//! tells which ways to break the program are seen.

pub(crate) mod case;
mod seal;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Mutex,
    thread,
};

use fdi_core::report::{EffectFinding, Explanation, ExplanationVerdict, FaultBeforeAfter};
use greybox_blind::Class;
use serde::Deserialize;

use self::{
    case::{Kind, Name, Truth},
    seal::Sealed,
};
use crate::commands::output;

/// Classes with the numbers of their cases: first and count.
const CASES: [(Kind, u64, u64); 9] = [
    // the high-fidelity ones take longest
    (Kind::HighFidelity { hides: false }, 0, 2),
    (Kind::HighFidelity { hides: true }, 0, 2),
    (Kind::Blind(Class::Tied), 0, 4),
    (Kind::Blind(Class::Double), 0, 4),
    (Kind::Blind(Class::Single), 2, 14),
    (Kind::Blind(Class::Outside), 0, 4),
    (Kind::Blind(Class::FaultOnly), 0, 4),
    (Kind::Blind(Class::Null), 0, 6),
    (Kind::Blind(Class::UnusualNull), 0, 2),
];

/// How the recordings of a case are to be used.
#[derive(Deserialize)]
struct Roles {
    train: Vec<String>,
    holdout: Vec<String>,
    repeat: Vec<String>,
}

/// A case with its answer and, opened after it, its truth.
struct Opened {
    name: Name,
    truth: Truth,
    answer: Explanation,
}

/// Answer of `fdi explain` to the recordings in a folder, from nothing but the files there.
pub(crate) fn explain(folder: &Path, model: &str, more: &[&str]) -> Vec<u8> {
    let Roles { train, holdout, repeat } = roles(folder);
    // numbers without a tolerance are exact in all cases
    let mut arguments = vec!["explain", "--model", model, "--exact", "all"];
    for (role, files) in [("--train", &train), ("--holdout", &holdout), ("--repeat", &repeat)] {
        if !files.is_empty() {
            arguments.push(role);
            arguments.extend(files.iter().map(String::as_str));
        }
    }
    arguments.extend(["--output-format", "json", "--stable", "--jobs", "1", "-q"]);
    arguments.extend(more);
    let output = output(folder, &arguments);
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {complaint}", folder.display());
    output.stdout
}

pub(crate) fn read(answer: &[u8]) -> Explanation {
    serde_json::from_slice(answer).unwrap()
}

fn opened(name: Name) -> Opened {
    let case = Sealed::draw(name);
    let answer = explain(&case.seen(), "nominal.toml", &[]);
    let truth = case.answered(&answer).open();
    Opened { name, truth, answer: read(&answer) }
}

/// All cases, two side by side.
fn all_opened() -> Vec<Opened> {
    let of = |(kind, first, count): (Kind, u64, u64)| {
        (first..first + count).map(move |number| Name { kind, number })
    };
    let open = Mutex::new(CASES.into_iter().flat_map(of));
    let next = || open.lock().unwrap().next();
    let work = || std::iter::from_fn(next).map(opened).collect::<Vec<_>>();
    thread::scope(|scope| {
        let workers: Vec<_> = (0..2).map(|_| scope.spawn(work)).collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    })
}

pub(crate) fn is_name(verdict: ExplanationVerdict) -> bool {
    use ExplanationVerdict::{Named, NamedWithRemainder, OneOf};
    matches!(verdict, Named | NamedWithRemainder | OneOf)
}

impl Opened {
    /// Effects named, and those that may be instead of them.
    fn set(&self) -> Vec<&str> {
        let all = self.answer.effects.iter().chain(&self.answer.alternatives);
        all.map(|effect| effect.id.as_str()).collect()
    }

    fn names(&self) -> bool {
        is_name(self.answer.verdict)
    }

    fn has(&self, id: &str) -> bool {
        self.names() && self.set().contains(&id)
    }

    fn is_visible(&self) -> bool {
        self.truth.hidden.iter().any(|hidden| hidden.visible)
    }

    /// Every effect that is hidden is in the answered set.
    fn is_right(&self) -> bool {
        self.truth.hidden.iter().all(|hidden| self.has(&hidden.id))
    }

    /// Names, of which none is hidden here.
    fn is_wrong(&self) -> bool {
        self.names() && !self.truth.hidden.iter().any(|hidden| self.has(&hidden.id))
    }

    /// Effects named that are neither hidden here nor said to be instead of one that is.
    fn names_too_many(&self) -> usize {
        let is_hidden = |id: &str| self.truth.hidden.iter().any(|hidden| hidden.id == id);
        let is_there = |id: &str| {
            let mut others = self.answer.alternatives.iter();
            is_hidden(id)
                || others.any(|one| one.instead_of.as_deref() == Some(id) && is_hidden(&one.id))
        };
        self.answer.effects.iter().filter(|effect| !is_there(&effect.id)).count()
    }

    /// Says that something is left that it does not know.
    fn leaves_unknown(&self) -> bool {
        use ExplanationVerdict::{NamedWithRemainder, Unknown};
        matches!(self.answer.verdict, Unknown | NamedWithRemainder)
    }

    /// 95 % intervals of fault levels: how many there are, and how many hold the truth.
    fn intervals(&self) -> [usize; 2] {
        let of = |(key, level): (&String, &FaultBeforeAfter)| {
            let [least, most] = level.interval_95_after;
            (least..=most).contains(&self.truth.faults[key])
        };
        let held: Vec<bool> = self.answer.faults.iter().map(of).collect();
        [held.len(), held.iter().filter(|held| **held).count()]
    }
}

/// How many of some cases are so.
fn count(cases: &[&Opened], is: impl Fn(&Opened) -> bool) -> usize {
    cases.iter().filter(|one| is(one)).count()
}

#[test]
fn what_is_hidden_is_found_and_what_is_not_is_not() {
    let cases = all_opened();
    for Opened { name, truth, answer } in &cases {
        let hidden: Vec<_> = truth.hidden.iter().map(|h| (&h.id, h.visible)).collect();
        let named: Vec<&str> = answer.effects.iter().map(|effect| effect.id.as_str()).collect();
        let others: Vec<&str> = answer.alternatives.iter().map(|e| e.id.as_str()).collect();
        let verdict = answer.verdict;
        eprintln!("{name}: {verdict:?} {named:?} or {others:?} of {hidden:?}");
        assert_eq!(truth.class, name.kind.name());
        // all recordings are sound: to refuse them is a miss
        assert_ne!(verdict, ExplanationVerdict::Inconclusive, "{name}: {}", answer.sentence);
    }
    let of = |is: &dyn Fn(Kind) -> bool| -> Vec<&Opened> {
        cases.iter().filter(|one| is(one.name.kind)).collect()
    };
    let of_class = |class| of(&|kind| kind == Kind::Blind(class));

    // that damage may be an effect (`absorbed`) is no alarm
    let nothing = of(&|kind| !kind.hides());
    let alarms = count(&nothing, |one| one.names() || one.leaves_unknown());
    assert_eq!(alarms, 0, "of {} cases with nothing hidden", nothing.len());

    let single =
        of(&|kind| matches!(kind, Kind::Blind(Class::Single) | Kind::HighFidelity { hides: true }));
    let visible: Vec<&Opened> = single.iter().copied().filter(|one| one.is_visible()).collect();
    let right = count(&visible, Opened::is_right);
    assert!(visible.len() >= 10, "the seeds have {} visible ones", visible.len());
    let wrong = count(&single, Opened::is_wrong);
    assert!(10 * right >= 8 * visible.len(), "{right} of {} visible ones", visible.len());
    assert!(wrong <= 1, "{wrong} wrong names");
    let named: Vec<&Opened> = visible.iter().copied().filter(|one| one.names()).collect();
    let size: usize = named.iter().map(|one| one.set().len()).sum();
    assert!(10 * size <= 15 * named.len(), "{size} names in {} answers", named.len());
    let double = of_class(Class::Double);
    let too_many: usize = named.iter().chain(&double).map(|one| one.names_too_many()).sum();
    assert!(too_many <= 3, "{too_many} names too many");

    let both = count(&double, Opened::is_right);
    assert!(2 * both >= double.len(), "both of {both} of {} doubles", double.len());

    let outside = of_class(Class::Outside);
    let plain: Vec<&Opened> = outside.iter().copied().filter(|o| o.truth.excess >= 1.3).collect();
    let told = count(&plain, Opened::leaves_unknown);
    assert!(!plain.is_empty(), "the seeds have a plain one");
    assert_eq!(told, plain.len(), "told as unknown");
    let named = count(&outside, |one| one.names() && !one.leaves_unknown());
    assert!(named <= 1, "{named} named for what no catalogue has");

    let tied = of_class(Class::Tied);
    let is_stated =
        |one: &Opened| one.is_right() && one.truth.tied_with.iter().any(|id| one.has(id));
    let stated = count(&tied, is_stated);
    assert!(stated + 1 >= tied.len(), "{stated} of {} ties", tied.len());

    let intervals = cases.iter().map(Opened::intervals);
    let [all, held] = intervals.fold([0, 0], |[n, m], [a, b]| [n + a, m + b]);
    eprintln!("intervals: {held} of {all} hold the truth; right: {right} of {}", visible.len());
    assert!(all >= 3 * cases.len(), "{all} intervals");
    assert!(100 * held >= 88 * all, "{held} of {all} intervals of fault levels hold the truth");
}

/// Cases of white noise with one effect that recordings show well: the actuator's, and the axis's.
const PLAIN: [u64; 2] = [12, 7];

/// The model with what was found leaves of the recording held out what the answer says. The likelihood
/// rises by as much as white noise of the true size gives for that, or somewhat less: numbers that
/// training leaves open are told by the hold-out too, and take up a part without the effect.
#[test]
fn the_gain_claimed_is_that_of_the_extended_model() {
    for number in PLAIN {
        let case = Sealed::draw(Name { kind: Kind::Blind(Class::Single), number });
        let printed = explain(&case.seen(), "nominal.toml", &["-o", "extended.toml"]);
        let again = read(&explain(&case.seen(), "extended.toml", &[])).holdout.unwrap();
        let samples = held_out_samples(&case.seen());
        let truth = case.answered(&printed).open();
        assert_eq!(truth.noise, "white", "{number}");
        let answer = read(&printed);
        let [found] = &answer.effects[..] else { panic!("{}", answer.sentence) };
        let claimed = answer.holdout.unwrap();
        let ratio = again.rms_before / claimed.rms_after;
        assert!((ratio - 1.0).abs() < 0.01, "{number}: {ratio}");
        let fall = claimed.rms_before.powi(2) - again.rms_before.powi(2);
        let nats = 0.5 * samples as f64 * fall / truth.noise_a.powi(2);
        let ratio = found.holdout_gain_nats / nats;
        assert!((0.4..1.1).contains(&ratio), "{number}: {ratio} of {nats}");
    }
}

fn held_out_samples(folder: &Path) -> usize {
    rows(&fs::read_to_string(held_out(folder)).unwrap()).count()
}

fn held_out(folder: &Path) -> PathBuf {
    folder.join(&roles(folder).holdout[0])
}

fn roles(folder: &Path) -> Roles {
    toml::from_str(&fs::read_to_string(folder.join("roles.toml")).unwrap()).unwrap()
}

/// Rows of a recording, without its header.
fn rows(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter(|line| !line.starts_with('#')).skip(1)
}

/// Whatever is held out, what was fitted has the same numbers: it judges and moves nothing.
#[test]
fn nothing_is_fitted_to_what_is_held_out() {
    let case = Sealed::draw(Name { kind: Kind::Blind(Class::Single), number: PLAIN[1] });
    let whole = read(&explain(&case.seen(), "nominal.toml", &[]));
    let file = held_out(&case.seen());
    let text = fs::read_to_string(&file).unwrap();
    let kept = text.lines().count() - rows(&text).count() / 3;
    let shorter: String = text.lines().take(kept).map(|line| line.to_owned() + "\n").collect();
    fs::write(&file, shorter).unwrap();
    let cut = read(&explain(&case.seen(), "nominal.toml", &[]));
    let left = |answer: &Explanation| answer.holdout.as_ref().unwrap().rms_after;
    assert_ne!(left(&whole), left(&cut));
    let levels =
        |answer: &Explanation| answer.faults.values().map(|level| level.after).collect::<Vec<_>>();
    assert_eq!(levels(&whole), levels(&cut));
    let sizes = |answer: &Explanation| -> Vec<(String, Vec<f64>)> {
        let of = |e: &EffectFinding| e.parameters.values().map(|p| p.value).collect();
        answer.effects.iter().map(|effect| (effect.id.clone(), of(effect))).collect()
    };
    assert_eq!(sizes(&whole), sizes(&cut));
    assert!(!whole.effects.is_empty());
}
