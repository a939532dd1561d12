//! A delay of the EMPS drive: what the benchmark's residual gains from one that is imposed, and how
//! much of it the training alone can tell.

use std::fmt::Write as _;

use anyhow::{Context, Result, bail};
use ema_sim::{Effect, EffectId, Geometry};
use greybox::{Explained, Whitener, rms};

use super::{
    benchmark::{Motion, Term, columns_of, forces_of, least_squares, left, refit},
    emps::{self, Data},
    wording::{fall, symbols, verdict},
};

/// Delays imposed in the first table, ms.
const IMPOSED_MS: [f64; 9] = [0.0, 0.2, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2, 1.5];
/// Step and end of the search for the best delay, ms.
const SEARCHED_MS: (f64, f64) = (0.05, 1.5);
/// Mass, drag, friction, and a drag that differs between the directions.
const STRUCTURE: [Term; 4] = [Term::Mass, Term::Viscous, Term::Dry, Term::ViscousAsymmetry];
/// Speeds within which friction falls, m/s.
const STRIBECK_M_PER_S: [f64; 5] = [0.002, 0.005, 0.01, 0.02, 0.05];
/// Deflections of a bristle, m.
const BRISTLE_M: [f64; 5] = [2e-6, 5e-6, 1e-5, 2e-5, 5e-5];
/// Exponents of a drag that is no straight line.
const EXPONENTS: [f64; 4] = [0.5, 1.5, 2.0, 3.0];
/// Speed of that drag, m/s; it only scales the force.
const REFERENCE_M_PER_S: f64 = 0.1;
/// Every which sample is compared, of 1000 a second.
const EVERY: [usize; 4] = [10, 5, 2, 1];
/// Corner of the low-pass, as a share of the rate compared.
const CORNER: f64 = 0.4;
/// Refits under the noise that the fit before has left.
const REWEIGHTED: usize = 3;
/// Half a sample: how late on the mean a voltage acts that is held over a tick of the controller.
const HOLD_MS: f64 = 0.5;
/// Delays that the model given to the tool has, beyond the hold, ms.
const GIVEN_MS: [f64; 4] = [0.1, 0.2, 0.3, 0.5];
/// Fall of the log-likelihood at the ends of a 95 % interval of one number.
const INTERVAL_NATS: f64 = 1.92;

/// Structure with effects beside it, each with its shapes to choose from.
struct Rival {
    name: &'static str,
    shapes: Vec<Vec<Term>>,
    has_delay: bool,
}

fn rivals() -> Vec<Rival> {
    let with = |terms: Vec<Term>| {
        terms.into_iter().map(|term| [&STRUCTURE[..], &[term]].concat()).collect::<Vec<_>>()
    };
    let stribeck =
        || with(STRIBECK_M_PER_S.iter().map(|speed| Term::Stribeck { speed: *speed }).collect());
    let bristle = || {
        let of = |deflection: &f64| {
            let mut terms = STRUCTURE.to_vec();
            terms[2] = Term::Bristle { deflection: *deflection };
            terms
        };
        BRISTLE_M.iter().map(of).collect::<Vec<_>>()
    };
    let drag = with(
        EXPONENTS
            .iter()
            .map(|exponent| Term::Power { reference: REFERENCE_M_PER_S, exponent: *exponent })
            .collect(),
    );
    let one = |name, shapes, has_delay| Rival { name, shapes, has_delay };
    vec![
        one("delay (E21)", vec![STRUCTURE.to_vec()], true),
        one("Stribeck friction (E01)", stribeck(), false),
        one("presliding (E05)", bristle(), false),
        one("non-linear drag (E02)", drag, false),
        one("Stribeck friction and delay", stribeck(), true),
        one("presliding and delay", bristle(), true),
    ]
}

/// The two halves of the training at a rate, as columns and forces.
struct Halves {
    fitted: Motion,
    held: Motion,
    every: usize,
}

/// Log-likelihoods of a structure, nats.
#[derive(Clone, Copy, Debug)]
struct Told {
    fitted: f64,
    held: f64,
    delay_ms: f64,
}

impl Halves {
    fn new(motion: &Motion, every: usize) -> Self {
        let fitted = motion.part(0..emps::HALF);
        let held = motion.part(emps::HALF..motion.samples());
        Self { fitted, held, every }
    }

    fn thinned(&self, signal: &[f64]) -> Vec<f64> {
        signal.iter().step_by(self.every).copied().collect()
    }

    fn columns(&self, motion: &Motion, terms: &[Term]) -> Vec<Vec<f64>> {
        columns_of(std::slice::from_ref(motion), terms).iter().map(|c| self.thinned(c)).collect()
    }

    fn force(&self, motion: &Motion, delay_s: f64) -> Vec<f64> {
        self.thinned(&forces_of(std::slice::from_ref(motion), delay_s))
    }

    /// A structure fitted to the first half under autoregressive noise, and judged on both halves,
    /// on each by noise with the colour of what it leaves there.
    fn told(&self, terms: &[Term], delay_ms: f64) -> Result<Told> {
        let delay_s = 1e-3 * delay_ms;
        let (columns, force) =
            (self.columns(&self.fitted, terms), self.force(&self.fitted, delay_s));
        let apart = || "forces that cannot be told apart";
        let mut sizes = least_squares(&columns, &force).with_context(apart)?;
        for _ in 0..REWEIGHTED {
            let noise = Whitener::fit(&[&left(&force, &columns, &sizes)], terms.len());
            let white: Vec<Vec<f64>> = columns.iter().map(|column| noise.apply(column)).collect();
            sizes = least_squares(&white, &noise.apply(&force)).with_context(apart)?;
        }
        let likelihood = |residual: &[f64]| {
            let noise = Whitener::fit(&[residual], 0);
            noise.log_likelihoods(residual, residual.len()).iter().sum::<f64>()
        };
        let held_columns = self.columns(&self.held, terms);
        Ok(Told {
            fitted: likelihood(&left(&force, &columns, &sizes)),
            held: likelihood(&left(&self.force(&self.held, delay_s), &held_columns, &sizes)),
            delay_ms,
        })
    }

    /// The likeliest of a rival's shapes and delays by the first half, and the delays within its 95 %
    /// interval.
    fn best(&self, rival: &Rival) -> Result<(Told, [f64; 2])> {
        let (step, end) = SEARCHED_MS;
        let steps = if rival.has_delay { (end / step).round() as usize } else { 0 };
        let mut all = Vec::new();
        for terms in &rival.shapes {
            for n in 0..=steps {
                all.push(self.told(terms, step * n as f64)?);
            }
        }
        let best = all.iter().copied().max_by(|a, b| a.fitted.total_cmp(&b.fitted));
        let best = best.context("a shape")?;
        let near = all.iter().filter(|told| told.fitted > best.fitted - INTERVAL_NATS);
        let ends = near.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], told| {
            [least.min(told.delay_ms), most.max(told.delay_ms)]
        });
        Ok((best, ends))
    }
}

/// The part of the page about the delay.
pub(super) fn story(page: &mut String, data: &Data, explained: &Explained) -> Result<()> {
    page.push_str(include_str!("delay.md"));
    imposed(page, data)?;
    told_by_training(page, data)?;
    told_by_tool(page, data, explained)
}

/// Residuals of the benchmark under an imposed delay.
fn imposed(page: &mut String, data: &Data) -> Result<()> {
    let [train, test] = data.motions();
    let (train, test) = ([train], [test]);
    let base = refit((&train, &test), &STRUCTURE[..3], 0.0)?;
    let low_speed = [&STRUCTURE[..], &[Term::Stribeck { speed: 0.02 }]].concat();
    for delay_ms in IMPOSED_MS {
        write!(page, "| {delay_ms:.1} |")?;
        for terms in [&STRUCTURE[..], &low_speed] {
            let fit = refit((&train, &test), terms, 1e-3 * delay_ms)?;
            let falls = [fall(base.train_n, fit.train_n), fall(base.test_n, fit.test_n)];
            write!(
                page,
                " {:.3} | {:.3} | {:.1} | {:.1} |",
                fit.train_n, fit.test_n, falls[0], falls[1]
            )?;
        }
        page.push('\n');
    }
    Ok(())
}

/// Gains of a delay and of its rivals by the training alone, at several rates.
fn told_by_training(page: &mut String, data: &Data) -> Result<()> {
    page.push_str(include_str!("rivals.md"));
    let raw = data.raw_training();
    let rivals = rivals();
    let mut notes = String::new();
    for every in EVERY {
        let rate_hz = raw.rate_hz / every as f64;
        let halves = Halves::new(&Motion::smoothed(&raw, CORNER * rate_hz), every);
        let base = halves.told(&STRUCTURE, 0.0)?;
        let mut all = Vec::new();
        for rival in &rivals {
            let (told, [least, most]) = halves.best(rival)?;
            let delay = if rival.has_delay {
                format!("{:.2} ({least:.2} to {most:.2})", told.delay_ms)
            } else {
                String::new()
            };
            let (fitted, held) = (told.fitted - base.fitted, told.held - base.held);
            writeln!(
                page,
                "| {rate_hz:.0} | {} | {delay} | {fitted:.0} | {held:.0} |",
                rival.name
            )?;
            all.push((fitted, held, told.delay_ms));
        }
        let [delay, stribeck, presliding, _, with_stribeck, with_presliding] = all[..] else {
            bail!("six rivals");
        };
        writeln!(
            notes,
            "- {rate_hz:.0} Hz: one effect alone, the delay gains {:+.0} nats on the second half over \
             presliding. Beside Stribeck friction it adds {:.0} and is {:.2} ms, {:+.2} ms beyond the \
             hold; beside presliding it adds {:.0} and is {:.2} ms, {:+.2} ms beyond the hold.",
            delay.1 - presliding.1,
            with_stribeck.1 - stribeck.1,
            with_stribeck.2,
            with_stribeck.2 - HOLD_MS,
            with_presliding.1 - presliding.1,
            with_presliding.2,
            with_presliding.2 - HOLD_MS,
        )?;
    }
    writeln!(page, "\nHow far that tells a delay, by rate:\n\n{notes}")?;
    page.push_str(include_str!("undecided.md"));
    Ok(())
}

/// Answers of the tool to a slower recording, and to a model that has the drag or a delay already.
fn told_by_tool(page: &mut String, data: &Data, explained: &Explained) -> Result<()> {
    page.push_str(include_str!("scan.md"));
    let drag = explained.effects.first().context("an effect of EMPS")?.effect.clone();
    let mut cases: Vec<(f64, String, Vec<Effect>)> = Vec::new();
    for rate_hz in [1000.0, 500.0] {
        cases.push((rate_hz, "as published, without offset".to_owned(), Vec::new()));
        cases.push((rate_hz, "with the drag found".to_owned(), vec![drag.clone()]));
    }
    for delay_ms in GIVEN_MS {
        let late = Effect::new(EffectId::ControllerMismatch, Geometry::Linear)
            .with("delay_s", 1e-3 * delay_ms)?;
        let name = format!("with it and a delay of {delay_ms} ms");
        cases.push((1000.0, name, vec![drag.clone(), late]));
    }
    for (rate_hz, name, effects) in cases {
        let answer = data.explained_at(rate_hz, &effects)?;
        let [before, after] = answer.holdout_rms.context("recordings held out")?;
        writeln!(
            page,
            "| {rate_hz:.0} | {name} | {} | {} | {} | {before:.4} | {after:.4} |",
            verdict(answer.verdict),
            symbols(&answer.effects),
            scanned(&answer),
        )?;
    }
    Ok(())
}

/// How E21 fared in a scan.
fn scanned(answer: &Explained) -> String {
    let all = &answer.hypotheses;
    let Some(place) = all.iter().position(|h| h.id == EffectId::ControllerMismatch) else {
        return "not tried".to_owned();
    };
    let refitted = all[place].refit.map_or_else(
        || "not refitted".to_owned(),
        |refit| {
            let (gain, error) = (refit.holdout_gain_nats, refit.holdout_gain_se);
            format!("refitted, {gain:.0} ± {error:.0} nats held out")
        },
    );
    format!("place {} of {}, ln p = {:.1}, {refitted}", place + 1, all.len(), all[place].log_p)
}

/// Root mean square of the benchmark's residual under the structure at delays of the search, training
/// alone: the best of them, s.
pub(super) fn best_of_training(data: &Data) -> Result<f64> {
    let [train, _] = data.motions();
    let train = [train];
    let columns = columns_of(&train, &STRUCTURE);
    let (step, end) = SEARCHED_MS;
    let mut best = (f64::INFINITY, 0.0);
    for n in 0..=(end / step).round() as usize {
        let delay_s = 1e-3 * step * n as f64;
        let force = forces_of(&train, delay_s);
        let sizes = least_squares(&columns, &force).context("forces that cannot be told apart")?;
        let remains = rms(&left(&force, &columns, &sizes));
        if remains < best.0 {
            best = (remains, delay_s);
        }
    }
    Ok(best.1)
}
