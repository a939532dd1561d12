//! Page on planned tests: what a plan expects of a test, and what units in it show.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use experiments::{
    Days, EffectLine, HiddenDamage, HiddenEffect, LearntLine, UnitsScore, bundle_of_test,
    evaluate_effects, evaluate_learnt, over_days, plan_request, planned_test, test_by_hand,
};
use fdi_core::{
    Diagnoser, Experiment, PlannedTest, expected_stds,
    report::{ExpectedStd, FaultId, NoticeCode},
};

use super::{
    bar::{LEAST_POWER, MOST_ALARMS, coverages, met},
    figure::Figure,
    section::Section,
    units::{HALF_WIDTH_K, READING_STD_K, percent},
};
use crate::{
    budget::together::{cost, recordings},
    processor::jobs,
    terminal::say,
};

const HEAD: &str = include_str!("planned/head.md");
const LIMITS: &str = include_str!("planned/limits.md");

/// Root seeds of the hidden units, of plans, and of what the bundle learns.
const SEED: u64 = 20_261_205;
const PLAN_SEED: u64 = 1;
const BUNDLE_SEED: u64 = 20_231;
/// Lengths of the planned tests; the first is the one that units are recorded in.
const WITHIN_S: [f64; 2] = [3.0, 10.0];
/// Length of the plan of the quick figures.
const QUICK_S: f64 = 0.4;
/// Units without damage, and with it.
const HEALTHY: usize = 500;
const DAMAGED: usize = 200;
/// Units with an effect, and as many without.
const WITH_EFFECT: usize = 100;
/// Evidence below which an effect is weak.
const WEAK: f64 = 120.0;
/// Recordings that are answered together, and the most processor time of so many, s.
const MOST_S: [(usize, f64); 2] = [(1, 1.0), (16, 12.0)];
/// Bar on expectations over what is stated.
const NEAR: [f64; 2] = [0.75, 1.25];

/// Lines with what is to be detected on them.
const LINES: [(&str, HiddenDamage, bool, Told); 7] = [
    ("none", HiddenDamage::Healthy, false, Told::Nothing),
    (
        "one short of 0.006, the imbalance",
        HiddenDamage::Alone(FaultId::K3, 0.006),
        false,
        Told::Short,
    ),
    ("k6 of 0.003", HiddenDamage::Alone(FaultId::K6, 0.003), false, Told::Eccentricity),
    ("none", HiddenDamage::Healthy, true, Told::Nothing),
    ("one short of 0.018", HiddenDamage::Alone(FaultId::K3, 0.018), true, Told::Short),
    ("k2 of 0.001", HiddenDamage::Alone(FaultId::K2, 0.001), true, Told::Backlash),
    ("one to three of 0.01 to 0.05", HiddenDamage::OneToThree, true, Told::Something),
];

/// Damage that a line is to show.
#[derive(Clone, Copy, PartialEq)]
enum Told {
    Nothing,
    Something,
    Backlash,
    Short,
    Eccentricity,
}

impl Told {
    /// Units on which it is detected; `None` where the line has no such bar.
    fn units(self, score: &UnitsScore) -> Option<usize> {
        match self {
            Self::Nothing | Self::Something => None,
            Self::Backlash => Some(score.detected_of[1]),
            Self::Short => Some(score.short_detected),
            Self::Eccentricity => Some(score.detected_of[5]),
        }
    }
}

/// A short plan: seconds.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let (_, plan) = planned_test(&plan_request(QUICK_S, PLAN_SEED, jobs()), HALF_WIDTH_K)?;
    let figure = |id: String, value: f64, tolerance_rel: f64| Figure {
        id,
        value,
        tolerance_rel,
        unit: "1".to_owned(),
    };
    let mut figures = vec![figure("motions".to_owned(), plan.motions.len() as f64, 0.0)];
    for fault in &plan.faults {
        let std = fault.planned.map_or(f64::NAN, |std| std.alone);
        figures.push(figure(format!("{}-std", fault.id), std, 1e-6));
    }
    Ok(figures)
}

/// The section that can be rebuilt on its own, on a machine where nothing else runs.
pub(super) const SECTIONS: &[Section] =
    &[Section { name: "time", write: |page| costs(&mut page.markdown, &plan(WITHIN_S[1])?.0) }];

/// The test of a length, with its plan.
fn plan(within_s: f64) -> Result<(Experiment, PlannedTest)> {
    say(&format!("planned: the plan within {within_s} s"));
    Ok(planned_test(&plan_request(within_s, PLAN_SEED, jobs()), HALF_WIDTH_K)?)
}

pub(super) fn text() -> Result<String> {
    let mut page = String::from(HEAD);
    let [short, long] = WITHIN_S.map(plan);
    let ((test, plan), (long_test, long)) = (short?, long?);
    motions(&mut page, &plan)?;
    expectations(&mut page, &plan, &long)?;
    achieved(&mut page, &test, &plan)?;
    costs(&mut page, &long_test)?;
    page.push('\n');
    page.push_str(LIMITS);
    Ok(page)
}

fn motions(page: &mut String, plan: &PlannedTest) -> Result<()> {
    let duration_s = plan.command_rad.len() as f64 / plan.rate_hz;
    writeln!(
        page,
        "\n## The test of {duration_s:.2} s\n\n{} of {} motions within the limits.\n\n\
         | from, s | for, s | motion | rotor, rad/s |\n|---:|---:|---|---:|",
        plan.motions.len(),
        plan.candidates
    )?;
    for one in &plan.motions {
        let [begins_s, duration_s] = [one.begins_s, one.duration_s];
        let (motion, speed) = (&one.description, one.rotor_rad_per_s);
        writeln!(page, "| {begins_s:.2} | {duration_s:.2} | {motion} | {speed:.0} |")?;
    }
    Ok(())
}

/// Expectations of the tests side by side.
fn expectations(page: &mut String, plan: &PlannedTest, long: &PlannedTest) -> Result<()> {
    let request = plan_request(WITHIN_S[0], PLAN_SEED, jobs());
    let chirp = over_days(Experiment::chirp(), HALF_WIDTH_K);
    let chirp = expected_stds(&chirp, &request)?;
    let hand = expected_stds(&test_by_hand(HALF_WIDTH_K)?, &request)?;
    let length_s = |plan: &PlannedTest| plan.command_rad.len() as f64 / plan.rate_hz;
    writeln!(
        page,
        "\n## Expectations\n\nStandard deviations of one recording beside four as new, in thousandths; \
         in brackets with the winding's temperature read to {READING_STD_K} K. *Any*: by a test that \
         shows all that a current can; tolerances and days leave that.\n\n\
         | fault | chirp, 0.5 s | by hand, 8.8 s | planned, {:.2} s | planned, {:.2} s | any | longer \
         plan over by hand |\n|---|---:|---:|---:|---:|---:|---:|",
        length_s(plan),
        length_s(long)
    )?;
    let cell = |std: Option<ExpectedStd>| {
        let digits = |std: f64| format!("{:.3}", 1e3 * std);
        std.map_or("-".to_owned(), |std| {
            format!("{} ({})", digits(std.alone), digits(std.with_reading))
        })
    };
    for (place, (short, long)) in plan.faults.iter().zip(&long.faults).enumerate() {
        let beside = long.planned.zip(hand[place]).map(|(plan, hand)| plan.alone / hand.alone);
        let beside = beside.map(|ratio| format!("{ratio:.2} {}", met(ratio < 1.005)));
        writeln!(
            page,
            "| {} | {} | {} | {} | {} | {} | {} |",
            short.id,
            cell(chirp[place]),
            cell(hand[place]),
            cell(short.planned),
            cell(long.planned),
            cell(short.least),
            beside.unwrap_or_default()
        )?;
    }
    Ok(())
}

/// Units in the shorter test: what is detected, and standard deviations beside those expected.
fn achieved(page: &mut String, test: &Experiment, plan: &PlannedTest) -> Result<()> {
    say("planned: bundle");
    let bundle = bundle_of_test(test, BUNDLE_SEED, jobs())?;
    let bytes = bundle.to_bytes().len();
    let diagnoser = Diagnoser::new(bundle)?;
    writeln!(
        page,
        "\n## Achieved\n\nThe bundle of the shorter plan has {:.2} MB.\n\n| damage | temperature read | \
         units | healthy, % | model inadequate, % | something detected, % | its fault detected, % | \
         coverage of k1 to k5 and (k6, k7), % |\n|---|---|---:|---:|---:|---:|---:|---|",
        bytes as f64 / 1e6
    )?;
    let mut widths = String::new();
    for (place, (name, damage, is_read, told)) in LINES.into_iter().enumerate() {
        say(&format!("planned: line {} of {}", place + 1, LINES.len()));
        let line = LearntLine {
            references: 4,
            days: Days {
                half_width_k: HALF_WIDTH_K,
                reading_std_k: is_read.then_some(READING_STD_K),
                has_voltage: false,
                load_within_n_m: 0.0,
            },
            damage,
            misstated: 1.0,
            units: if damage == HiddenDamage::Healthy { HEALTHY } else { DAMAGED },
            shifted: 0,
        };
        let score = evaluate_learnt(&diagnoser, &line, SEED + place as u64, jobs())
            .context("units in a planned test")?
            .learnt;
        row(page, name, is_read, told, &score)?;
        if damage == HiddenDamage::Healthy {
            width(&mut widths, is_read, plan, &score)?;
        }
    }
    writeln!(
        page,
        "\nStandard deviations on the healthy units, in thousandths: the median of those stated, the root \
         mean square of the errors, and in brackets the expected one over each.\n\n\
         | temperature read | which | k1 | k2 | k3 | k4 | k5 | k6 |\n\
         |---|---|---|---|---|---|---|---|\n{widths}"
    )?;
    effects(page, &diagnoser)
}

/// Recordings alone of units with an effect that the model file does not have: on how many it is told.
fn effects(page: &mut String, diagnoser: &Diagnoser) -> Result<()> {
    writeln!(
        page,
        "\n## Physics that the model file does not have\n\nOne recording of each unit without damage, no \
         unit learnt, its temperature read. Effects are drawn as on `docs/validation/units.md`, with an evidence \
         λ of 60 to 600. *Told*: the notice `unmodelled-physics`.\n\n\
         | units | count | told | refused |\n|---|---:|---:|---:|"
    )?;
    let mut row = |name: String, units: &[&HiddenEffect]| {
        let answers = units.iter().filter_map(|unit| unit.alone.as_ref());
        let refused = units.len() - answers.clone().count();
        let told = answers.filter(|one| one.notice(NoticeCode::UnmodelledPhysics).is_some());
        let told = told.count();
        writeln!(page, "| {name} | {} | {told} | {refused} |", units.len())
    };
    for has_effect in [true, false] {
        say(&format!("planned: effects, {}", if has_effect { "with" } else { "without" }));
        let line = EffectLine { references: 0, recordings: 1, has_effect, units: WITH_EFFECT };
        let seed = SEED + 50 + u64::from(has_effect);
        let units = evaluate_effects(diagnoser, &line, seed, jobs())
            .context("units with an effect in a planned test")?;
        if has_effect {
            let (weak, clear) = units.iter().partition::<Vec<_>, _>(|unit| unit.lambda < WEAK);
            row(format!("with an effect, λ below {WEAK}"), &weak)?;
            row(format!("with an effect, λ of {WEAK} and more"), &clear)?;
        } else {
            row("without an effect".to_owned(), &units.iter().collect::<Vec<_>>())?;
        }
    }
    Ok(())
}

/// Processor time of answers to recordings of the longer test.
fn costs(page: &mut String, test: &Experiment) -> Result<()> {
    say("planned: cost of the longer test");
    let bytes = bundle_of_test(test, BUNDLE_SEED, jobs())?.to_bytes();
    let all = MOST_S.iter().map(|(count, _)| *count).max().unwrap_or_default();
    let recordings = recordings(test, all)?;
    let length_s = test.scenario.duration_s;
    writeln!(
        page,
        "\n## Time of the longer test\n\nRecordings of {length_s:.2} s of one worn machine with the motor's \
         voltage, four a session, answered together on one thread: processor time with the bundle of {:.2} \
         MB read, and over that of a loop of known work in the same run (`cargo xtask budget` has the loop).\n\n\
         | recordings | processor time, s | over the loop | evaluations |\n|---:|---:|---:|---:|",
        bytes.len() as f64 / 1e6
    )?;
    for (count, most_s) in MOST_S {
        let cost = cost(&bytes, &recordings[..count])?;
        writeln!(
            page,
            "| {count} | {:.2} {} (bar {most_s:.0}) | {:.1} | {} |",
            cost.took_s,
            met(cost.took_s <= most_s),
            cost.ratio,
            cost.evaluations
        )?;
    }
    Ok(())
}

fn row(page: &mut String, name: &str, is_read: bool, told: Told, score: &UnitsScore) -> Result<()> {
    let n = score.machines;
    let detected = percent(score.detected, n);
    let alarms = match told {
        Told::Nothing => format!(" {}", met(detected <= MOST_ALARMS)),
        _ => String::new(),
    };
    let power = told.units(score).map(|found| {
        let found = percent(found, n);
        format!("{found:.1} {}", met(found >= LEAST_POWER))
    });
    let (covered, holds) = coverages(score);
    writeln!(
        page,
        "| {name} | {} | {n} | {:.1} | {:.1} | {detected:.1}{alarms} | {} | {} {} |",
        if is_read { "yes" } else { "no" },
        percent(score.verdicts[0], n),
        percent(score.verdicts[3], n),
        power.unwrap_or_default(),
        covered,
        met(holds)
    )?;
    Ok(())
}

fn width(widths: &mut String, is_read: bool, plan: &PlannedTest, score: &UnitsScore) -> Result<()> {
    let read = if is_read { "yes" } else { "no" };
    let [least, most] = NEAR;
    for (which, achieved) in [("stated", score.std_median), ("error", score.error_rms)] {
        let cell = |(std, fault): (&f64, &fdi_core::report::PlannedFault)| {
            let expected = fault.planned.map_or(f64::NAN, |expected| {
                if is_read { expected.with_reading } else { expected.alone }
            });
            let ratio = expected / std;
            let is_near = (least..=most).contains(&ratio);
            let told = if which == "stated" { format!(" {}", met(is_near)) } else { String::new() };
            format!("{:.3} ({ratio:.2}){told}", 1e3 * std)
        };
        let cells: Vec<String> = achieved.iter().zip(&plan.faults).map(cell).collect();
        writeln!(widths, "| {read} | {which} | {} |", cells.join(" | "))?;
    }
    Ok(())
}
