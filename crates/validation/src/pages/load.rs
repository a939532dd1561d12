//! Page on recordings under another load than that of their bundle's test.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use experiments::{
    Days, HiddenDamage, LearntLine, UnitsScore, bundle_of_test, evaluate_learnt, over_days,
};
use fdi_core::{Diagnoser, Experiment, report::FaultId};

use super::{
    bar::{LEAST_POWER, MOST_ALARMS, coverages, met},
    figure::Figure,
    units::{HALF_WIDTH_K, percent},
};
use crate::{processor::jobs, terminal::say};

const HEAD: &str = include_str!("load/head.md");
const LIMITS: &str = include_str!("load/limits.md");

/// Root seeds of the hidden units and of what the bundles learn.
const SEED: u64 = 20_261_206;
const BUNDLE_SEED: u64 = 20_231;
/// Loads within so much of that of the test, N·m.
const WITHIN_N_M: [f64; 3] = [0.0, 2.0, 10.0];
/// Load of the quick figures.
const QUICK_N_M: f64 = 2.0;
/// Units without damage, with it, and of the quick figures.
const HEALTHY: usize = 500;
const DAMAGED: usize = 200;
const FEW: usize = 4;

/// Damage of units, with the fault that is to be detected.
const DAMAGE: [(&str, HiddenDamage); 3] = [
    ("none", HiddenDamage::Healthy),
    ("one short of 0.025", HiddenDamage::Alone(FaultId::K3, 0.025)),
    ("one to three of 0.01 to 0.05", HiddenDamage::OneToThree),
];

/// Four units: seconds.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let diagnoser = Diagnoser::new(super::machine::ema_48()?)?;
    let score = score(&diagnoser, HiddenDamage::Healthy, QUICK_N_M, FEW, SEED)?;
    let figure = |id: &str, value: f64, tolerance_rel: f64| Figure {
        id: id.to_owned(),
        value,
        tolerance_rel,
        unit: "1".to_owned(),
    };
    Ok(vec![
        figure("healthy", score.verdicts[0] as f64, 0.0),
        figure("detected", score.detected as f64, 0.0),
        figure("k2-std", score.std_median[1], 1e-6),
    ])
}

pub(super) fn text() -> Result<String> {
    let mut page = String::from(HEAD);
    say("load: bundle");
    let test = over_days(Experiment::chirp(), HALF_WIDTH_K);
    let diagnoser = Diagnoser::new(bundle_of_test(&test, BUNDLE_SEED, jobs())?)?;
    writeln!(
        page,
        "\n## Units in the chirp\n\n| damage | load within, N·m | units | healthy, % | model inadequate, % | \
         something detected, % | its short detected, % | coverage of k1 to k5 and (k6, k7), % | median \
         stated standard deviations of k1 to k6, thousandths |\n|---|---:|---:|---:|---:|---:|---:|---|---|"
    )?;
    for (place, (name, damage)) in DAMAGE.into_iter().enumerate() {
        for within_n_m in WITHIN_N_M {
            say(&format!("load: {name}, ±{within_n_m} N·m"));
            let units = if damage == HiddenDamage::Healthy { HEALTHY } else { DAMAGED };
            let score = score(&diagnoser, damage, within_n_m, units, SEED + place as u64)?;
            row(&mut page, name, damage, within_n_m, &score)?;
        }
    }
    page.push_str(LIMITS);
    Ok(page)
}

fn score(
    diagnoser: &Diagnoser,
    damage: HiddenDamage,
    load_within_n_m: f64,
    units: usize,
    seed: u64,
) -> Result<UnitsScore> {
    let line = LearntLine {
        references: 4,
        days: Days {
            half_width_k: HALF_WIDTH_K,
            reading_std_k: None,
            has_voltage: false,
            load_within_n_m,
        },
        damage,
        misstated: 1.0,
        units,
        shifted: 0,
    };
    let result = evaluate_learnt(diagnoser, &line, seed, jobs());
    Ok(result.context("units under another load")?.learnt)
}

fn row(
    page: &mut String,
    name: &str,
    damage: HiddenDamage,
    within_n_m: f64,
    score: &UnitsScore,
) -> Result<()> {
    let n = score.machines;
    let detected = percent(score.detected, n);
    let (alarms, power) = match damage {
        HiddenDamage::Healthy => (format!(" {}", met(detected <= MOST_ALARMS)), String::new()),
        HiddenDamage::Alone(..) => {
            let found = percent(score.short_detected, n);
            (String::new(), format!("{found:.1} {}", met(found >= LEAST_POWER)))
        }
        _ => Default::default(),
    };
    let (covered, holds) = coverages(score);
    writeln!(
        page,
        "| {name} | {within_n_m} | {n} | {:.1} | {:.1} | {detected:.1}{alarms} | {power} | {} {} | {} |",
        percent(score.verdicts[0], n),
        percent(score.verdicts[3], n),
        covered,
        met(holds),
        score.std_median.map(|std| format!("{:.2}", 1e3 * std)).join(", ")
    )?;
    Ok(())
}
