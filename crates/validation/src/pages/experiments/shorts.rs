//! Short circuits with circulating current against the paper's scaling of R, L and `k_e`.

use std::fmt::Write as _;

use anyhow::Result;
use experiments::{
    Agreement, ShortAnswers, ShortResult, ShortsRequest, compare_short, evaluate_shorts,
};
use fdi_core::ema_sim::{ShortedTurns, presets::EMA_48};

use super::{SEED, seeded};
use crate::{
    pages::figure::{Figure, Rendered},
    processor::jobs,
};

/// Shares of the turns of phase A.
const SHARES: [f64; 4] = [0.01, 0.05, 0.2, 0.5];
/// Resistance of the fault over that of the shorted turns.
const OVER_TURNS: [f64; 5] = [0.0, 0.1, 1.0, 10.0, 100.0];
/// Recordings of each short circuit.
const RECORDINGS: usize = 10;
/// Shares of leakage that the result is compared at.
const LEAKAGES: [f64; 3] = [0.1, 0.5, 0.9];
/// Short circuit of the quick figures and of the comparison of leakages.
const EXAMPLE: f64 = 0.05;

/// Changes by one short circuit: seconds.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let fault_ohm = EXAMPLE * EMA_48.motor.resistance_ohm;
    let [current, motion] = compare_short(EXAMPLE, fault_ohm, ShortedTurns::DEFAULT_LEAKAGE_RATIO)?;
    let of = |name: &str, value| seeded(format!("shorts-{name}"), value, "1");
    Ok(vec![
        of("current-size", current.size),
        of("current-cosine", current.cosine),
        of("motion-size", motion.size),
        of("motion-cosine", motion.cosine),
    ])
}

/// The section.
pub(super) fn write(page: &mut Rendered) -> Result<()> {
    let request = ShortsRequest {
        shares: &SHARES,
        fault_over_turns: &OVER_TURNS,
        leakage_ratio: ShortedTurns::DEFAULT_LEAKAGE_RATIO,
        recordings: RECORDINGS,
        seed: SEED,
        jobs: jobs(),
    };
    let results = evaluate_shorts(&request)?;
    let text = &mut page.markdown;
    writeln!(text, "{INTRODUCTION}")?;
    changes(text, &results)?;
    leakages(text)?;
    for (n, title) in [
        "`--tolerance none`: the machine is exactly its model file",
        "by default: the machine is within its tolerances",
    ]
    .into_iter()
    .enumerate()
    {
        answers(text, title, &results, n)?;
    }
    conclusion(text, &results)
}

/// A fault's resistance as the tables tell it: in Ω, and over that of its turns.
fn told(result: &ShortResult) -> String {
    let Some(fault_ohm) = result.fault_ohm else { return "turns removed | ".to_owned() };
    let turns_ohm = result.share * EMA_48.motor.resistance_ohm;
    format!("{fault_ohm:.4} | {:.1}", fault_ohm / turns_ohm)
}

fn agreement(of: &Agreement) -> String {
    format!("{:.3} | {:.3} | {:.3}", of.size, of.cosine, of.difference)
}

fn changes(text: &mut String, results: &[ShortResult]) -> Result<()> {
    writeln!(
        text,
        "\n### What the scaling leaves out\n\n\
         | turns, % | R_f, Ω | R_f/(s·R) | current: size | cosine | difference | motion: size | cosine | difference |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    )?;
    for result in results {
        writeln!(
            text,
            "| {:.0} | {} | {} | {} |",
            100.0 * result.share,
            told(result),
            agreement(&result.current),
            agreement(&result.motion)
        )?;
    }
    Ok(())
}

fn leakages(text: &mut String) -> Result<()> {
    writeln!(
        text,
        "\nThe share of leakage in the phase's inductance is a choice. At {:.0} % of the turns:\n\n\
         | leakage | R_f/(s·R) | current: size | cosine | difference | motion: size | cosine | difference |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- |",
        100.0 * EXAMPLE
    )?;
    for leakage in LEAKAGES {
        for ratio in [0.0, 1.0] {
            let fault_ohm = ratio * EXAMPLE * EMA_48.motor.resistance_ohm;
            let [current, motion] = compare_short(EXAMPLE, fault_ohm, leakage)?;
            let (current, motion) = (agreement(&current), agreement(&motion));
            writeln!(text, "| {leakage} | {ratio} | {current} | {motion} |")?;
        }
    }
    Ok(())
}

fn answers(text: &mut String, title: &str, results: &[ShortResult], n: usize) -> Result<()> {
    writeln!(
        text,
        "\n### Diagnosed {title}\n\n\
         | turns, % | R_f, Ω | R_f/(s·R) | k1 | k2 | k3 | k4 | k5 | k6 | healthy, faulty, inadequate, undetermined | fit |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    )?;
    for result in results {
        let of = &result.answers[n];
        let level = |place: usize| match of.levels[place] {
            Some(level) => format!("{level:.4} ({})", of.detected[place]),
            None => format!("- ({})", of.detected[place]),
        };
        let levels: Vec<String> = (0..6).map(level).collect();
        writeln!(
            text,
            "| {:.0} | {} | {} | {} | {:.2} |",
            100.0 * result.share,
            told(result),
            levels.join(" | "),
            of.verdicts.map(|count| count.to_string()).join(", "),
            of.fit
        )?;
    }
    Ok(())
}

/// Least and largest of some numbers.
fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), v| (least.min(v), most.max(v)))
}

/// Short circuits with a resistance over that of their turns.
fn at(results: &[ShortResult], ratio: f64) -> impl Iterator<Item = &ShortResult> {
    let near = move |result: &&ShortResult| {
        let turns_ohm = result.share * EMA_48.motor.resistance_ohm;
        result.fault_ohm.is_some_and(|ohm| (ohm / turns_ohm - ratio).abs() < 1e-9)
    };
    results.iter().filter(near)
}

/// The conclusion, made of the numbers.
fn conclusion(text: &mut String, results: &[ShortResult]) -> Result<()> {
    let closed = || results.iter().filter(|result| result.fault_ohm.is_some());
    let (least, _) = span(closed().map(|result| result.current.difference));
    let (_, most) = span(closed().map(|result| result.current.cosine));
    writeln!(
        text,
        "\n### Conclusion\n\n\
         Ranges over the shares of the turns; recordings of all shares together.\n\n\
         | R_f/(s·R) | effect over that of the scaling | cosine | `--tolerance none`: k3 over the share | k3, k1 detected | inadequate | healthy \
         | default: k3 over the share | k3, k1 detected | inadequate | healthy |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    )?;
    for ratio in OVER_TURNS {
        let (small, large) = span(at(results, ratio).map(|result| result.current.size));
        let (low, high) = span(at(results, ratio).map(|result| result.current.cosine));
        let both = [0, 1].map(|n| {
            let answers = at(results, ratio).map(|result| (result.share, &result.answers[n]));
            diagnosed(&answers.collect::<Vec<_>>())
        });
        let both = both.join(" | ");
        writeln!(text, "| {ratio} | {small:.2} to {large:.2} | {low:.2} to {high:.2} | {both} |")?;
    }
    let removed = results.iter().filter(|result| result.fault_ohm.is_none());
    let removed: Vec<_> = removed.map(|result| (result.share, &result.answers)).collect();
    let both = [0, 1].map(|n| {
        let answers = removed.iter().map(|(share, answers)| (*share, &answers[n]));
        diagnosed(&answers.collect::<Vec<_>>())
    });
    writeln!(text, "| turns removed | 1 | 1 | {} |", both.join(" | "))?;
    let count = |n: usize, of: &dyn Fn(&ShortAnswers) -> usize| {
        closed().map(|result| of(&result.answers[n])).sum::<usize>()
    };
    let seen = count(0, &|answers| answers.detected[2]);
    let rubbing = count(0, &|answers| answers.detected[0]);
    let (least_share, _) = span(closed().map(|result| result.share));
    let of_least = |of: &dyn Fn(&ShortAnswers) -> usize| {
        let turns_ohm = least_share * EMA_48.motor.resistance_ohm;
        let is_low = |r: &&ShortResult| {
            r.share <= least_share && r.fault_ohm.is_some_and(|ohm| ohm <= 1.001 * turns_ohm)
        };
        closed().filter(is_low).map(|r| of(&r.answers[1])).sum::<usize>()
    };
    let explained = closed().filter(|result| result.answers[0].detected[2] > 0);
    let (least_k1, most_k1) =
        span(explained.filter_map(|result| {
            Some(result.answers[0].levels[0]? / result.answers[0].levels[2]?)
        }));
    writeln!(
        text,
        "\nThe scaling is never nearer to a short circuit with circulating current than {:.0} % of its own effect in the current; the cosine is {most:.2} at most, \
         so that no level of it would do.\n\
         The current brakes, which the diagnosis of an exact machine takes for friction: k1 is detected in {rubbing} and k3 in {seen} of {} recordings, and where k3 is \
         found k1 is {least_k1:.2} to {most_k1:.2} times it.\n\
         The resistance of the fault, not the share of the turns alone, sets the level: k3 is no longer the share of shorted turns.\n\
         Within tolerances k1 is detected in {} and k3 in {} of them; at {:.0} % of the turns, the least share, k3 is detected in {} of {} with R_f up to s·R.",
        100.0 * least,
        count(0, &|answers| answers.recordings),
        count(1, &|answers| answers.detected[0]),
        count(1, &|answers| answers.detected[2]),
        100.0 * least_share,
        of_least(&|answers| answers.detected[2]),
        of_least(&|answers| answers.recordings),
    )?;
    Ok(())
}

/// Cells of a diagnosis: k3 over the share, detections of k3 and k1, inadequate and healthy answers.
fn diagnosed(of: &[(f64, &ShortAnswers)]) -> String {
    let total: usize = of.iter().map(|(_, answers)| answers.recordings).sum();
    let count = |count: &dyn Fn(&ShortAnswers) -> usize| -> usize {
        of.iter().map(|(_, answers)| count(answers)).sum()
    };
    let (least, most) =
        span(of.iter().filter_map(|(share, answers)| Some(answers.levels[2]? / share)));
    format!(
        "{least:.2} to {most:.2} | {}, {} of {total} | {} | {}",
        count(&|answers| answers.detected[2]),
        count(&|answers| answers.detected[0]),
        count(&|answers| answers.verdicts[2]),
        count(&|answers| answers.verdicts[0]),
    )
}

const INTRODUCTION: &str = "\n## A short circuit with circulating current\n\n\
The paper takes shorted turns away: R·N, L·N² and k_e·N of a phase are left. In a machine they are a closed loop in which the\n\
back-EMF drives a current, which brakes and heats. The high-fidelity model has that loop as an option, with a resistance R_f of the fault\n\
(`docs/models/motor.md`; `fdi simulate --short-resistance-ohm`). The low-fidelity model and the bundle know the paper's scaling alone.\n\n\
Preset `ema-48`, chirp, shares s of the turns of phase A, R_f as a multiple of the resistance s·R of the shorted turns, leakage half of the\n\
phase's inductance. *Size*: the change from the healthy machine over the one that the scaling makes. *Cosine*: of the angle between both.\n\
*Difference*: of both changes over that of the scaling. Current: the filtered envelope; motion: the angle of the motor; both without noise.\n\
Diagnosed are 10 recordings each, with the drive's noise, 20 mA rms on each phase sample at 10 kHz and 12 bits, by the embedded bundle of the\n\
chirp. Levels are means, in brackets in how many recordings they are detected. *Fit*: rms residual over the rms of noise and learnt error. The verdict\n\
weighs the residual with its whole covariance, for large levels with the errors on damage of like size (`docs/models/diagnosis.md`), so that\n\
it does not follow from *fit* alone. Rows `turns removed` are the reference: the same recordings with the paper's scaling.";
