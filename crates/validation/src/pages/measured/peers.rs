//! An expert's least squares and `PySINDy` beside the tool, on the same residuals: answers kept by the
//! script in `fixtures/references/expert`, computed again here from their terms and sizes.

use std::fmt::Write as _;

use anyhow::{Context, Result, bail, ensure};
use ema_sim::Effect;
use greybox::{Calibrated, Explained, Record, rms};
use serde::Deserialize;

use super::{
    answers::Answers,
    benchmark::{Motion, Raw, Refit, Term, columns_of, forces_of, left, refit},
    emps,
    forces::of_effects,
    laas, others,
    setting::axis as axis_of,
    wording::{fall, short, symbols},
};
use crate::pages::figure::Figure;

/// Relative difference between the script's residuals and those computed again: rounding of filters
/// of order 8, whose poles are near 1, in sizes that cancel one another.
const AGAIN_REL: f64 = 1e-6;

/// Answers of the script.
#[derive(Clone, Debug, Deserialize)]
struct Kept {
    versions: Versions,
    sets: Vec<KeptSet>,
}

#[derive(Clone, Debug, Deserialize)]
struct Versions {
    numpy: String,
    scipy: String,
    pysindy: String,
}

#[derive(Clone, Debug, Deserialize)]
struct KeptSet {
    set: String,
    unit: String,
    answers: Ways,
}

#[derive(Clone, Debug, Deserialize)]
struct Ways {
    base: Kind,
    expert: Kind,
    stlsq: Kind,
    sr3: Kind,
}

/// Terms chosen in a way, and what they leave.
#[derive(Clone, Debug, Deserialize)]
struct Kind {
    terms: Vec<SizedTerm>,
    train_rms: f64,
    holdout_rms: f64,
}

/// Term with its size.
#[derive(Clone, Debug, Deserialize)]
struct SizedTerm {
    term: String,
    size: f64,
}

fn kept() -> Result<Kept> {
    let text = include_str!("../../../../../fixtures/references/expert/answers.json");
    serde_json::from_str(text).context("fixtures/references/expert/answers.json")
}

/// Term of a name that the script writes, `stribeck:0.02`.
fn term(name: &str) -> Result<Term> {
    let (kind, number) = name.split_once(':').unwrap_or((name, "0"));
    let number: f64 = number.parse().with_context(|| format!("`{name}`"))?;
    Ok(match kind {
        "mass" => Term::Mass,
        "viscous" => Term::Viscous,
        "dry" => Term::Dry,
        "offset" => Term::Offset,
        "viscous-asymmetry" => Term::ViscousAsymmetry,
        "quadratic" => Term::Power { reference: 1.0, exponent: 2.0 },
        "root" => Term::Power { reference: 1.0, exponent: 0.5 },
        "stribeck" => Term::Stribeck { speed: number },
        "spring" => Term::Spring,
        "drift" => Term::Drift,
        "load-friction" => Term::LoadFriction,
        "constant" => Term::Load,
        "sine" => Term::SineOfAngle { order: number },
        "cosine" => Term::CosineOfAngle { order: number },
        "delay" => Term::Slope,
        _ => bail!("no term `{name}`"),
    })
}

/// Recordings of a set as inverse dynamics take them, and the structure that is extended.
struct Problem {
    train: Vec<Motion>,
    test: Vec<Motion>,
    structure: Vec<Term>,
}

impl Problem {
    fn new(set: &str) -> Result<Self> {
        let structure = |terms: &[Term]| terms.to_vec();
        let of = |records: &[Record], factor: f64, corner_hz: f64| -> Vec<Motion> {
            records.iter().map(|record| smoothed(record, factor, corner_hz)).collect()
        };
        Ok(match set {
            "emps" => {
                let [train, test] = emps::Data::read()?.motions();
                let structure = structure(&emps::STRUCTURE);
                Self { train: vec![train], test: vec![test], structure }
            }
            "laas" => {
                let recordings = laas::Data::read()?.recordings();
                let of = |records| of(records, 1.0, 60.0);
                let (train, test) = (of(&recordings.train), of(&recordings.holdout));
                Self { train, test, structure: structure(&[Term::Mass, Term::Viscous]) }
            }
            "bam" => {
                let set = others::servo()?;
                let constant = axis_of(set.model)?.axis.force_constant;
                let of = |records| of(records, constant, 10.0);
                let (train, test) = (of(&set.recordings.train), of(&set.recordings.holdout));
                Self { train, test, structure: structure(&emps::STRUCTURE) }
            }
            _ => {
                let axis = set.strip_prefix("kuka-").and_then(|axis| axis.parse().ok());
                let set = others::robot(axis.with_context(|| format!("no set `{set}`"))?)?;
                let constant = axis_of(set.model)?.axis.force_constant;
                let of = |records| of(records, constant, 8.0);
                let (train, test) = (of(&set.recordings.train), of(&set.recordings.holdout));
                Self { train, test, structure: structure(&[Term::Mass]) }
            }
        })
    }

    /// Residuals that terms of these sizes leave of the recordings fitted and of those held out.
    fn left_by(&self, answer: &Kind) -> Result<[f64; 2]> {
        let terms = answer.terms.iter().map(|t| term(&t.term)).collect::<Result<Vec<Term>>>()?;
        let sizes: Vec<f64> = answer.terms.iter().map(|t| t.size).collect();
        let of = |motions: &[Motion]| {
            rms(&left(&forces_of(motions, 0.0), &columns_of(motions, &terms), &sizes))
        };
        Ok([of(&self.train), of(&self.test)])
    }

    fn refit(&self, terms: &[Term]) -> Result<Refit> {
        refit((&self.train, &self.test), terms, 0.0)
    }
}

/// A recording behind a low-pass, its drive signal times a factor.
fn smoothed(record: &Record, factor: f64, corner_hz: f64) -> Motion {
    let raw = Raw {
        rate_hz: record.rate_hz,
        position: record.position.clone().unwrap_or_else(|| record.command.clone()),
        force: record.drive.iter().map(|drive| factor * drive).collect(),
        load: record.load.clone(),
    };
    Motion::smoothed(&raw, corner_hz)
}

/// The tool's answer to a set: numbers calibrated before, and explanations of its recordings.
fn answer<'a>(set: &str, answers: &'a Answers) -> (Option<&'a Calibrated>, Vec<&'a Explained>) {
    match set {
        "emps" => (None, vec![&answers.emps]),
        "laas" => (Some(&answers.calibrated), vec![&answers.laas]),
        "bam" => {
            let all = answers.servo_in_loop.iter().map(|(_, answer)| answer);
            (None, all.filter_map(|answer| answer.explained.as_ref().ok()).collect())
        }
        _ => {
            let axis = set.strip_prefix("kuka-").and_then(|axis| axis.parse::<usize>().ok());
            let answer = axis.and_then(|axis| answers.robot.get(axis.checked_sub(1)?));
            let explained = answer.and_then(|answer| answer.explained.as_ref().ok());
            (answer.and_then(|answer| answer.calibrated.as_ref()), explained.into_iter().collect())
        }
    }
}

/// Terms that the tool's answer to a set adds to the structure, and effects for which there is none.
fn of_tool(
    structure: &[Term],
    calibrated: Option<&Calibrated>,
    explained: &[&Explained],
) -> (Vec<Term>, Vec<&'static str>) {
    let mut terms = structure.to_vec();
    for number in calibrated.iter().flat_map(|c| &c.numbers).filter(|n| n.determined) {
        let more = match number.key.as_str() {
            "axis.kinetic-friction-n-m" => Term::Dry,
            "axis.viscous-n-m-s-per-rad" => Term::Viscous,
            _ => continue,
        };
        if !terms.contains(&more) {
            terms.push(more);
        }
    }
    let mut without = Vec::new();
    for finding in explained.iter().flat_map(|explained| &explained.effects) {
        let effect: &Effect = &finding.effect;
        match of_effects(&terms, &[effect]) {
            Ok(more) => {
                terms.clear();
                for term in more {
                    if !terms.contains(&term) {
                        terms.push(term);
                    }
                }
            }
            Err(_) => without.push(effect.id().info().symbol),
        }
    }
    (terms, without)
}

/// Names of terms beyond a structure.
fn added(answer: &Kind, structure: &[Term]) -> Result<String> {
    let mut names = Vec::new();
    for one in &answer.terms {
        if !structure.contains(&term(&one.term)?) {
            names.push(one.term.clone());
        }
    }
    Ok(if names.is_empty() { "none".to_owned() } else { names.join(", ") })
}

/// Residuals of the script's answers to EMPS, computed again.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let kept = kept()?;
    let set = kept.sets.iter().find(|set| set.set == "emps").context("a set of EMPS")?;
    let problem = Problem::new("emps")?;
    let figure = |way: &str, answer: &Kind| -> Result<Figure> {
        Ok(Figure {
            id: format!("emps-{way}-test"),
            value: problem.left_by(answer)?[1],
            tolerance_rel: AGAIN_REL,
            unit: "N".to_owned(),
        })
    };
    let Ways { expert, stlsq, sr3, .. } = &set.answers;
    Ok(vec![figure("expert", expert)?, figure("stlsq", stlsq)?, figure("sr3", sr3)?])
}

/// The part of the page that sets the three ways side by side.
pub(super) fn story(page: &mut String, answers: &Answers) -> Result<()> {
    let kept = kept()?;
    page.push_str(include_str!("peers.md"));
    let mut farthest = 0.0_f64;
    let mut first = [0; 4];
    let mut names = String::new();
    for set in &kept.sets {
        let problem = Problem::new(&set.set)?;
        let Ways { base, expert, stlsq, sr3 } = &set.answers;
        for answer in [base, expert, stlsq, sr3] {
            let again = problem.left_by(answer)?;
            for (was, is) in [answer.train_rms, answer.holdout_rms].iter().zip(again) {
                farthest = farthest.max((is / was - 1.0).abs());
            }
        }
        let (calibrated, explained) = answer(&set.set, answers);
        let (terms, without) = of_tool(&problem.structure, calibrated, &explained);
        let tool = problem.refit(&terms)?;
        let mut cells: Vec<String> = vec![short(base.holdout_rms)];
        let all = [tool.test_n, expert.holdout_rms, stlsq.holdout_rms, sr3.holdout_rms];
        let least = (0..all.len()).min_by(|a, b| all[*a].total_cmp(&all[*b])).unwrap_or(0);
        first[least] += 1;
        for left in all {
            // without the sign of a rounded zero
            let fall = fall(base.holdout_rms, left).round() + 0.0;
            cells.push(format!("{} ({fall:.0} %)", short(left)));
        }
        writeln!(page, "| {} | {} | {} |", set.set, set.unit, cells.join(" | "))?;
        let friction: Vec<&str> = [(Term::Dry, "dry"), (Term::Viscous, "viscous")]
            .into_iter()
            .filter(|(term, _)| calibrated.is_some() && !problem.structure.contains(term))
            .filter(|(term, _)| terms.contains(term))
            .map(|(_, name)| name)
            .collect();
        let mut named =
            explained.iter().map(|e| symbols(&e.effects)).collect::<Vec<_>>().join("; ");
        if !friction.is_empty() {
            write!(named, "; calibrated {}", friction.join(", "))?;
        }
        if !without.is_empty() {
            write!(named, "; {} without a force here", without.join(", "))?;
        }
        writeln!(
            names,
            "| {} | {named} | {} | {} | {} |",
            set.set,
            added(expert, &problem.structure)?,
            added(stlsq, &problem.structure)?,
            added(sr3, &problem.structure)?,
        )?;
    }
    let [tool, expert, stlsq, sr3] = first;
    writeln!(
        page,
        "\nLeast of what was held out is left by the tool in {tool} of {} sets, by the expert in \
         {expert}, by STLSQ in {stlsq}, by SR3 in {sr3}.",
        kept.sets.len()
    )?;
    ensure!(farthest < AGAIN_REL, "the script's residuals differ by {farthest:.1e} here");
    page.push_str(include_str!("peers_names.md"));
    page.push_str(&names);
    let Versions { numpy, scipy, pysindy } = &kept.versions;
    writeln!(
        page,
        "\nThe script's figures are of its run with numpy {numpy}, scipy {scipy} and PySINDy {pysindy}. \
         This page computes all of its residuals again from terms and sizes: they differ by {farthest:.0e} \
         at most, relative.\n"
    )?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The script answers in known terms, and least squares with more of them leave less of what was
    /// fitted.
    #[test]
    fn kept_answers_are_read() {
        let kept = kept().unwrap();
        assert_eq!((kept.versions.pysindy.as_str(), kept.sets.len()), ("2.1.0", 6));
        for set in &kept.sets {
            let Ways { base, expert, stlsq, sr3 } = &set.answers;
            assert!(expert.train_rms < base.train_rms, "{}", set.set);
            for one in [base, expert, stlsq, sr3].into_iter().flat_map(|way| &way.terms) {
                term(&one.term).unwrap();
            }
        }
        assert!(term("gravity").is_err());
    }
}
