//! Page on the motor's voltage as a second signal.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use experiments::{
    Days, HiddenDamage, LearntLine, UnitsScore, bundle_of_test, bundle_over_days, evaluate_learnt,
    plan_request, planned_test,
};
use fdi_core::{Bundle, Diagnoser, EMBEDDED_BUNDLES, report::FaultId};

use super::{
    bar::{LEAST_POWER, MOST_ALARMS, coverages, met},
    figure::Figure,
    section::Section,
    units::{HALF_WIDTH_K, percent},
};
use crate::{processor::jobs, terminal::say};

const HEAD: &str = include_str!("voltage/head.md");
const LIMITS: &str = include_str!("voltage/limits.md");

/// Root seeds of the hidden units, of the plan, and of what the bundles learn.
const SEED: u64 = 20_261_206;
const PLAN_SEED: u64 = 1;
const BUNDLE_SEED: u64 = 20_231;
/// Length that the planned test is within, s.
const WITHIN_S: f64 = 3.0;
/// Units without damage, and with it.
const HEALTHY: usize = 500;
const DAMAGED: usize = 200;

/// One short of a level that is to be detected, or what else a line has.
#[derive(Clone, Copy)]
struct Line {
    damage: &'static str,
    drawn: HiddenDamage,
    has_voltage: bool,
    /// True where the line has bars: those without voltage are beside it for comparison.
    is_judged: bool,
    units: usize,
}

/// Lines of a test, with the short that its voltage is to show.
fn lines(name: &'static str, level: f64) -> [Line; 5] {
    let short = HiddenDamage::Alone(FaultId::K3, level);
    let line = |damage, drawn, has_voltage, units| Line {
        damage,
        drawn,
        has_voltage,
        is_judged: has_voltage,
        units,
    };
    [
        line("none", HiddenDamage::Healthy, true, HEALTHY),
        line(name, short, true, DAMAGED),
        line("one to three of 0.01 to 0.05", HiddenDamage::OneToThree, true, DAMAGED),
        line("none", HiddenDamage::Healthy, false, DAMAGED),
        line(name, short, false, DAMAGED),
    ]
}

/// Numbers that the embedded chirp's voltage shows: no time at all.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let bundle = Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes)?;
    let worth = bundle.voltage_worth().context("the embedded chirp has learnt its voltage")?;
    let figure = |id: &str, value: f64| Figure {
        id: id.to_owned(),
        value,
        tolerance_rel: 1e-6,
        unit: "1".to_owned(),
    };
    Ok(vec![
        figure("torque-constant-std", worth.torque_constant),
        figure("resistance-std", worth.resistance),
        figure("imbalance-std", worth.imbalance),
    ])
}

/// Sections that can be rebuilt one by one.
pub(super) const SECTIONS: &[Section] = &[
    Section { name: "chirp", write: |page| units(&mut page.markdown, chirp()?) },
    Section { name: "planned", write: |page| units(&mut page.markdown, planned()?) },
];

/// A test with what its bundle has learnt and what is recorded in it.
struct Learnt {
    name: String,
    bundle: Bundle,
    lines: [Line; 5],
    seed: u64,
}

fn chirp() -> Result<Learnt> {
    say("voltage: the chirp's bundle");
    Ok(Learnt {
        name: "chirp, 0.5 s".to_owned(),
        bundle: bundle_over_days(HALF_WIDTH_K, BUNDLE_SEED)?,
        lines: lines("one short of 0.010", 0.010),
        seed: SEED,
    })
}

fn planned() -> Result<Learnt> {
    say("voltage: the planned test's bundle");
    let (test, plan) = planned_test(&plan_request(WITHIN_S, PLAN_SEED, jobs()), HALF_WIDTH_K)?;
    let length_s = plan.command_rad.len() as f64 / plan.rate_hz;
    Ok(Learnt {
        name: format!("planned, {length_s:.2} s"),
        bundle: bundle_of_test(&test, BUNDLE_SEED, jobs())?,
        lines: lines("one short of 0.005", 0.005),
        seed: SEED + 100,
    })
}

pub(super) fn text() -> Result<String> {
    let mut page = String::from(HEAD);
    let tests = [chirp()?, planned()?];
    worths(&mut page, &tests)?;
    for test in tests {
        units(&mut page, test)?;
    }
    page.push('\n');
    page.push_str(LIMITS);
    Ok(page)
}

/// Numbers that the voltage of each test shows of a machine.
fn worths(page: &mut String, tests: &[Learnt]) -> Result<()> {
    writeln!(
        page,
        "\n## What the voltage shows\n\nStandard deviations of numbers read off the voltage of one \
         recording less those of the machine, over those of the 800 units that each bundle is learnt on whose play is narrow (shares \
         of the number, in thousandths); the root mean square that the fit leaves of the filtered \
         voltage; shares of the variance that recordings of a unit, of one state of health, and of one \
         session have in common.\n\n\
         | test | torque constant | resistance | imbalance | left, V | in common |\n\
         |---|---:|---:|---:|---:|---|"
    )?;
    for Learnt { name, bundle, .. } in tests {
        let worth = bundle.voltage_worth().context("a bundle has learnt its voltage")?;
        writeln!(
            page,
            "| {name} | {:.2} | {:.2} | {:.2} | {:.3} | {} |",
            1e3 * worth.torque_constant,
            1e3 * worth.resistance,
            1e3 * worth.imbalance,
            worth.left_v,
            worth.in_common.map(|share| format!("{share:.2}")).join(", ")
        )?;
    }
    Ok(())
}

/// Units in a test, with the voltage and without.
fn units(page: &mut String, test: Learnt) -> Result<()> {
    let Learnt { name, bundle, lines, seed } = test;
    let diagnoser = Diagnoser::new(bundle)?;
    writeln!(
        page,
        "\n## Units in the test: {name}\n\n| damage | voltage | units | healthy, % | model inadequate, % \
         | something detected, % | its fault detected, % | coverage of k1 to k5 and (k6, k7), % | stated \
         standard deviations of k1 to k6, thousandths | rms errors |\n\
         |---|---|---:|---:|---:|---:|---:|---|---|---|"
    )?;
    for (place, line) in lines.iter().enumerate() {
        say(&format!("voltage: {name}, line {} of {}", place + 1, lines.len()));
        let learnt = LearntLine {
            references: 4,
            days: Days {
                half_width_k: HALF_WIDTH_K,
                reading_std_k: None,
                has_voltage: line.has_voltage,
                load_within_n_m: 0.0,
            },
            damage: line.drawn,
            misstated: 1.0,
            units: line.units,
            shifted: 0,
        };
        // lines without voltage are of the units of those with it
        let seed = seed + (place % 3) as u64;
        let score = evaluate_learnt(&diagnoser, &learnt, seed, jobs())
            .context("units whose voltage is recorded")?
            .learnt;
        row(page, line, &score)?;
    }
    Ok(())
}

fn row(page: &mut String, line: &Line, score: &UnitsScore) -> Result<()> {
    let n = score.machines;
    let judged =
        |is_met: bool| if line.is_judged { format!(" {}", met(is_met)) } else { String::new() };
    let detected = percent(score.detected, n);
    let (alarms, power) = match line.drawn {
        HiddenDamage::Healthy => (judged(detected <= MOST_ALARMS), String::new()),
        HiddenDamage::Alone(..) => {
            let found = percent(score.short_detected, n);
            (String::new(), format!("{found:.1}{}", judged(found >= LEAST_POWER)))
        }
        _ => (String::new(), String::new()),
    };
    let (covered, holds) = coverages(score);
    let thousandths = |stds: [f64; 6]| stds.map(|std| format!("{:.2}", 1e3 * std)).join(", ");
    writeln!(
        page,
        "| {} | {} | {n} | {:.1} | {:.1} | {detected:.1}{alarms} | {power} | {}{} | {} | {} |",
        line.damage,
        if line.has_voltage { "yes" } else { "no" },
        percent(score.verdicts[0], n),
        percent(score.verdicts[3], n),
        covered,
        judged(holds),
        thousandths(score.std_median),
        thousandths(score.error_rms)
    )?;
    Ok(())
}
