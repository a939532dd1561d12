//! From recordings to the causes that a model leaves out, with their probabilities.

use ema_sim::Geometry;
use inference::{Whitener, rms};

use crate::{
    cause::{Cause, CausePort, menu},
    fit::Fitted,
    model::{ModelError, OwnModel, Recordings},
    problem::{Problem, Residuals},
    search::{Rated, search},
};

/// Probability from which a cause is named.
const NAMED: f64 = 0.95;
/// Odds below which two causes cannot be told apart: 20 to 1, in nats.
const TIED: f64 = 2.995_732_273_553_991;
/// Gain of likelihood, nats, by which noise that remembers is better than noise that does not,
/// from which something is left: the odds beforehand of 1 to 20 000.
const LEFT: f64 = 10.0;
/// Standard deviations to either side of a 95 % interval.
const INTERVAL: f64 = 1.959_963_984_540_054;

/// Verdict of recordings on a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OwnVerdict {
    /// The model explains the recordings to noise without memory.
    Adequate,
    /// The model does with the causes that are named.
    Named,
    /// Causes are named, and something is left that none explains.
    NamedWithRemainder,
    /// One of several causes that explain the recordings about equally well.
    OneOf,
    /// Something is left, and no cause is more probable than none of them.
    Unknown,
    /// A cause is likely that is not sure, that hold-out recordings do not bear out, or that leaves
    /// more than it explains.
    Inconclusive,
}

impl OwnVerdict {
    /// The code in documents: `named-with-remainder`.
    pub fn code(self) -> &'static str {
        match self {
            Self::Adequate => "adequate",
            Self::Named => "named",
            Self::NamedWithRemainder => "named-with-remainder",
            Self::OneOf => "one-of",
            Self::Unknown => "unknown",
            Self::Inconclusive => "inconclusive",
        }
    }
}

/// Value with its uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Key: of a size as in model files, of a number its own.
    pub key: String,
    /// Most probable value.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
    /// Ends of the 95 % interval.
    pub interval: [f64; 2],
    /// Value in the model; zero of what it does not have.
    pub before: f64,
}

/// A cause as it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedCause {
    /// Name: `dry friction`, `number mass_kg`.
    pub name: String,
    /// Symbol in the catalogue of effects, where it is there.
    pub symbol: Option<&'static str>,
    /// Where it enters.
    pub port: CausePort,
    /// Sizes with their intervals.
    pub sizes: Vec<Estimate>,
    /// Order, exponent and the like, chosen from a list.
    pub shape: Vec<(&'static str, f64)>,
    /// Probability that it acts, among the sets compared.
    pub probability: f64,
    /// Causes that explain the recordings about as well in its place.
    pub tied_with: Vec<String>,
}

/// A set of causes that was compared.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparedSet {
    /// Names; none: the model with its rough numbers alone.
    pub causes: Vec<String>,
    /// Probability among the sets compared.
    pub probability: f64,
}

/// How a signal is explained.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalFit {
    /// The signal.
    pub signal: String,
    /// Root mean square of the residual in training: of the model with its rough numbers fitted, and
    /// with the causes.
    pub train_rms: [f64; 2],
    /// Held out; `None` without hold-out recordings.
    pub holdout_rms: Option<[f64; 2]>,
    /// Standard deviation of the noise.
    pub noise: f64,
    /// Share of the mean square of what is left that has a memory, and so is no white noise.
    pub left_ratio: f64,
}

/// The answer.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnExplanation {
    /// Verdict.
    pub verdict: OwnVerdict,
    /// The causes of the best set, most probable first; none where none is named or likely.
    pub causes: Vec<NamedCause>,
    /// Rough numbers as fitted.
    pub numbers: Vec<Estimate>,
    /// The most probable sets.
    pub sets: Vec<ComparedSet>,
    /// Each signal.
    pub signals: Vec<SignalFit>,
    /// Runs of the model, one for each recording.
    pub runs: usize,
}

impl OwnExplanation {
    /// Share of the root mean square of the residual that the causes take away held out, over all
    /// signals in units of their noise; `None` without hold-out recordings.
    pub fn holdout_gain(&self) -> Option<f64> {
        let mut squares = [0.0; 2];
        for signal in &self.signals {
            let held = signal.holdout_rms?;
            for (square, size) in squares.iter_mut().zip(held) {
                *square += (size / signal.noise) * (size / signal.noise);
            }
        }
        Some(1.0 - libm::sqrt(squares[1] / squares[0]))
    }

    /// True where what is left without being white noise is more than what the causes explain, in
    /// mean squares over all signals in units of their noise. The likelihood of a cause is then that
    /// of a model which is known to be wrong.
    fn leaves_more(&self) -> bool {
        let (mut explained, mut left) = (0.0, 0.0);
        for signal in &self.signals {
            let [before, after] = signal.train_rms.map(|size| size / signal.noise);
            explained += before * before - after * after;
            left += signal.left_ratio * after * after;
        }
        left > explained
    }
}

/// Sets that are told.
const TOLD: usize = 8;

/// Says what a model leaves out of recordings.
///
/// # Errors
///
/// [`ModelError`] for recordings that do not fit the model, and for what it says itself.
pub fn explain(
    model: &dyn OwnModel,
    geometry: Geometry,
    recordings: Recordings<'_>,
) -> Result<OwnExplanation, ModelError> {
    let problem = Problem::new(model, recordings)?;
    let menu = menu(model, geometry, &problem.scales)?;
    let sets = search(&problem, &menu)?;
    let best = answer(&sets);
    let none = sets.iter().find(|set| set.fitted.causes.is_empty());
    let none = none.map_or(&best.fitted, |rated| &rated.fitted);
    let signals = signal_fits(&problem, none, &best.fitted)?;
    let causes = named(&problem, &sets, best);
    let left = left(&best.fitted) > LEFT;
    let mut told = OwnExplanation {
        verdict: OwnVerdict::Inconclusive,
        numbers: estimates(&problem, &best.fitted, 0, problem.rough.len()),
        sets: sets.iter().take(TOLD).map(compared).collect(),
        causes,
        signals,
        runs: problem.runs(),
    };
    told.verdict = verdict(&told, &sets, left);
    Ok(told)
}

fn verdict(told: &OwnExplanation, sets: &[Rated], left: bool) -> OwnVerdict {
    if told.causes.is_empty() {
        return if left { OwnVerdict::Unknown } else { OwnVerdict::Adequate };
    }
    if told.holdout_gain().is_some_and(|gain| gain <= 0.0) || (left && told.leaves_more()) {
        return OwnVerdict::Inconclusive;
    }
    if told.causes.iter().all(|cause| cause.probability >= NAMED) {
        return if left { OwnVerdict::NamedWithRemainder } else { OwnVerdict::Named };
    }
    let sure = |cause: &NamedCause| {
        let acts =
            |set: &&Rated| set.has(&cause.name) || cause.tied_with.iter().any(|name| set.has(name));
        sets.iter().filter(acts).map(|set| set.probability).sum::<f64>() >= NAMED
    };
    if told.causes.iter().all(sure) { OwnVerdict::OneOf } else { OwnVerdict::Inconclusive }
}

/// The most probable set, without causes that explain less than what it leaves. Where something is
/// left, the evidence of a small cause is that of a model which is known to be wrong.
fn answer(sets: &[Rated]) -> &Rated {
    let mut best = &sets[0];
    while left(&best.fitted) > LEFT {
        let without = |out: &Cause| {
            let is_less = |set: &&Rated| {
                let causes = &set.fitted.causes;
                let kept = |cause: &Cause| causes.iter().any(|other| other.is(cause));
                causes.len() + 1 == best.fitted.causes.len()
                    && best.fitted.causes.iter().all(|cause| cause.is(out) != kept(cause))
            };
            sets.iter().find(is_less)
        };
        let smaller = best.fitted.causes.iter().filter_map(without);
        let explains =
            |set: &&Rated| squares(&set.fitted, &best.fitted) - squares(&best.fitted, &best.fitted);
        let smaller = smaller.min_by(|a, b| explains(a).total_cmp(&explains(b)));
        match smaller.filter(|set| explains(set) < with_memory(&best.fitted)) {
            Some(set) => best = set,
            None => break,
        }
    }
    best
}

/// Mean squares of residuals over all signals, in units of the noise of a fit.
fn squares(of: &Fitted, noise: &Fitted) -> f64 {
    let each = of.residuals.iter().zip(&noise.noise);
    each.map(|(of_signal, noise)| (rms(&of_signal.concat()) / noise.std()).powi(2)).sum()
}

/// Mean squares of what is left and has a memory, likewise.
fn with_memory(fitted: &Fitted) -> f64 {
    let of = |(of_signal, noise): (&Vec<Vec<f64>>, &Whitener)| {
        if noise.order() == 0 {
            0.0
        } else {
            (rms(&of_signal.concat()) / noise.std()).powi(2) - 1.0
        }
    };
    fitted.residuals.iter().zip(&fitted.noise).map(of).sum()
}

/// The causes of the answer.
fn named(problem: &Problem<'_>, sets: &[Rated], best: &Rated) -> Vec<NamedCause> {
    let mut from = problem.rough.len();
    let mut causes = Vec::new();
    for cause in &best.fitted.causes {
        let with = sets.iter().filter(|set| set.has(&cause.name));
        causes.push(NamedCause {
            name: cause.name.clone(),
            symbol: cause.symbol,
            port: cause.port,
            sizes: estimates(problem, &best.fitted, from, from + cause.sizes.len()),
            shape: cause.shape.clone(),
            probability: with.map(|set| set.probability).sum(),
            tied_with: tied(sets, best, cause),
        });
        from += cause.sizes.len();
    }
    causes.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    causes
}

/// Causes that take the place of one in the answer at odds of at most 20 to 1.
fn tied(sets: &[Rated], best: &Rated, cause: &Cause) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for set in sets {
        let others = &set.fitted.causes;
        let close = (best.ln_weight - set.ln_weight).abs() <= TIED;
        if !close || others.len() != best.fitted.causes.len() || set.has(&cause.name) {
            continue;
        }
        let new: Vec<&Cause> = others.iter().filter(|other| !best.has(&other.name)).collect();
        if let [new] = new[..]
            && !names.contains(&new.name)
        {
            names.push(new.name.clone());
        }
    }
    names
}

fn compared(set: &Rated) -> ComparedSet {
    let causes = set.fitted.causes.iter().map(|cause| cause.name.clone()).collect();
    ComparedSet { causes, probability: set.probability }
}

/// Values of some of the sizes.
pub(crate) fn estimates(
    problem: &Problem<'_>,
    fitted: &Fitted,
    from: usize,
    to: usize,
) -> Vec<Estimate> {
    let sizes = problem.sizes(&fitted.causes);
    let of = |place: usize| {
        let (size, value, std) = (&sizes[place], fitted.values[place], fitted.stds[place]);
        let end = |sign: f64| (value + sign * INTERVAL * std).clamp(size.least, size.most);
        let (key, before) = (size.key.clone(), size.base);
        Estimate { key, value, std, interval: [end(-1.0), end(1.0)], before }
    };
    (from..to).map(of).collect()
}

pub(crate) fn signal_fits(
    problem: &Problem<'_>,
    none: &Fitted,
    best: &Fitted,
) -> Result<Vec<SignalFit>, ModelError> {
    let held = |fitted: &Fitted| problem.residuals(problem.holdout, &fitted.causes, &fitted.values);
    let holdouts = [held(none)?, held(best)?];
    let size = |residuals: &Residuals, signal: usize| rms(&residuals[signal].concat());
    let of = |(signal, name): (usize, &String)| {
        let (after, noise) = (size(&best.residuals, signal), &best.noise[signal]);
        let holdout = holdouts.each_ref().map(|residuals| size(residuals, signal));
        SignalFit {
            signal: name.clone(),
            train_rms: [size(&none.residuals, signal), after],
            holdout_rms: (!problem.holdout.is_empty()).then_some(holdout),
            noise: noise.std(),
            left_ratio: (1.0 - noise.std() * noise.std() / (after * after)).max(0.0),
        }
    };
    Ok(problem.signals().iter().enumerate().map(of).collect())
}

/// Gain of likelihood by noise that remembers over noise that does not, nats.
fn left(fitted: &Fitted) -> f64 {
    let of = |(of_signal, noise): (&Vec<Vec<f64>>, &Whitener)| {
        let all = of_signal.concat();
        let n = all.len() as f64;
        let ratio = rms(&all) / noise.std();
        let gain = n * libm::log(ratio.max(1.0)) - 0.5 * noise.order() as f64 * libm::log(n);
        if noise.order() > 0 { gain } else { 0.0 }
    };
    fitted.residuals.iter().zip(&fitted.noise).map(of).sum()
}
