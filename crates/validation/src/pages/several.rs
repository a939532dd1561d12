//! `docs/validation/tests.md`: several recordings of one machine, answered together.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use experiments::{
    BoundCase, HiddenDamage, TogetherLine, TogetherResult, UnitsScore, evaluate_together,
    unit_bounds,
};
use fdi_core::{Bundle, report::FaultId};

use super::{
    bar::{LEAST_POWER, MOST_ALARMS, coverages, met},
    figure::Figure,
    units::{HALF_WIDTH_K, READING_STD_K, diagnoser, percent},
};
use crate::processor::jobs;

const HEAD: &str = include_str!("tests/head.md");
const LIMITS: &str = include_str!("tests/limits.md");

/// Root seed of the hidden units; development used others.
const SEED: u64 = 20_261_204;
/// Units of a line that false alarms or power are read from, and of another.
const MANY: usize = 500;
const SOME: usize = 300;
/// Units of the quick figures.
const FEW: usize = 4;

/// Sixteen references, three later days.
const DAYS: TogetherLine = TogetherLine {
    references: 16,
    days: 3,
    each: 1,
    half_width_k: HALF_WIDTH_K,
    reading_std_k: Some(READING_STD_K),
    damage: HiddenDamage::Healthy,
    only_last: false,
    units: MANY,
};
/// Four references, four recordings of a later day.
const SESSION: TogetherLine = TogetherLine { references: 4, days: 1, each: 4, ..DAYS };
/// A damage that comes with the last of three days.
const LAST: TogetherLine = TogetherLine { references: 4, only_last: true, units: SOME, ..DAYS };

const LINES: [(&str, TogetherLine); 8] = [
    ("none", DAYS),
    ("k1 of 0.06", TogetherLine { damage: HiddenDamage::Alone(FaultId::K1, 0.06), ..DAYS }),
    (
        "one to three of 0.01 to 0.05",
        TogetherLine { damage: HiddenDamage::OneToThree, units: SOME, ..DAYS },
    ),
    ("none", SESSION),
    (
        "k2 of 0.0015",
        TogetherLine { damage: HiddenDamage::Alone(FaultId::K2, 0.0015), units: SOME, ..SESSION },
    ),
    (
        "one to three of 0.01 to 0.05",
        TogetherLine { damage: HiddenDamage::OneToThree, units: SOME, ..SESSION },
    ),
    (
        "k2 of 0.003, on the last day alone",
        TogetherLine { damage: HiddenDamage::Alone(FaultId::K2, 0.003), ..LAST },
    ),
    (
        "k2 of 0.01, on the last day alone",
        TogetherLine { damage: HiddenDamage::Alone(FaultId::K2, 0.01), ..LAST },
    ),
];

/// Four units: seconds.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let diagnoser = diagnoser()?;
    let lines = [
        ("healthy", TogetherLine { units: FEW, each: 2, ..SESSION }),
        (
            "damaged",
            TogetherLine { units: FEW, each: 2, damage: HiddenDamage::OneToThree, ..SESSION },
        ),
    ];
    let mut figures = Vec::new();
    for (name, line) in lines {
        let result = evaluate_together(&diagnoser, &line, SEED + 100, jobs())?;
        for (of, score) in [("together", &result.together), ("last", &result.last)] {
            let [healthy, faulty, ..] = score.verdicts;
            for (what, value) in [("healthy", healthy), ("faulty", faulty)] {
                figures.push(Figure {
                    id: format!("{name}-{of}-{what}"),
                    value: value as f64,
                    tolerance_rel: 0.0,
                    unit: "1".to_owned(),
                });
            }
        }
    }
    Ok(figures)
}

pub(super) fn text() -> Result<String> {
    let diagnoser = diagnoser()?;
    let mut page = String::from(HEAD);
    page.push_str(
        "\n| recordings as new | later days × recordings | damage | units | answer | healthy, % | \
         something detected, % | its fault detected, % | disagree, % | coverage of k1 to k5 and \
         (k6, k7), % |\n|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let mut widths = String::new();
    for (place, (name, line)) in LINES.into_iter().enumerate() {
        crate::terminal::say(&format!("tests: line {} of {}", place + 1, LINES.len()));
        let result = evaluate_together(&diagnoser, &line, SEED + place as u64, jobs())
            .context("several recordings together")?;
        rows(&mut page, name, &result)?;
        if line.damage == HiddenDamage::Healthy {
            width(&mut widths, &result, diagnoser.bundle())?;
        }
    }
    write!(
        page,
        "\n*Disagree*: units of which no state of health is said to explain the recordings; their \
         verdict is `model-inadequate`. On the lines with damage on the last day alone nothing else \
         is right, and neither coverage nor a detection means anything.\n\n\
         ## Widths beside the bound\n\n\
         Median standard deviations on healthy units in thousandths, in brackets over the \
         Cramér-Rao bound with the same priors and with the learnt error as noise of each \
         recording. Recordings of one day have most of that error in common, which this bound does \
         not know.\n\n\
         | recordings | answer | k1 | k2 | k3 | k4 | k5 | k6 |\n|---|---|---|---|---|---|---|---|\n\
         {widths}\n"
    )?;
    page.push_str(LIMITS);
    Ok(page)
}

fn rows(page: &mut String, name: &str, result: &TogetherResult) -> Result<()> {
    let TogetherResult { line, together, last, disagree, .. } = result;
    let disagree = percent(*disagree, line.units);
    let answers = [("together", together, format!("{disagree:.1}")), ("last", last, String::new())];
    for (answer, score, disagree) in answers {
        let n = score.machines;
        let is_healthy = line.damage == HiddenDamage::Healthy;
        let detected = percent(score.detected, n);
        let of_fault = match line.damage {
            HiddenDamage::Alone(fault, _) => Some(score.detected_of[fault as usize]),
            _ => None,
        };
        let is_scored = answer == "together" && !line.only_last;
        let told =
            |is_met: bool| if is_scored { format!(" {}", met(is_met)) } else { String::new() };
        let alarms = if is_healthy { told(detected <= MOST_ALARMS) } else { String::new() };
        let power = of_fault.map(|found| {
            let found = percent(found, n);
            format!("{found:.1}{}", told(found >= LEAST_POWER))
        });
        let (covered, holds) = coverages(score);
        writeln!(
            page,
            "| {} | {} × {} | {name} | {n} | {answer} | {:.1} | {detected:.1}{alarms} | {} | \
             {disagree} | {}{} |",
            line.references,
            line.days,
            line.each,
            percent(score.verdicts[0], n),
            power.unwrap_or_default(),
            covered,
            told(holds)
        )?;
    }
    Ok(())
}

fn width(widths: &mut String, result: &TogetherResult, bundle: &Bundle) -> Result<()> {
    let TogetherResult { line, together, last, .. } = result;
    let case = BoundCase {
        scale: 1.0,
        references: line.references,
        days: line.days,
        each: line.each,
        half_width_k: Some(line.half_width_k),
        reading_std_k: line.reading_std_k,
        with_model_error: true,
    };
    let one = BoundCase { days: 1, each: 1, ..case };
    let recordings = format!("{} as new, {} × {}", line.references, line.days, line.each);
    let answers: [(&str, &UnitsScore, BoundCase); 2] =
        [("together", together, case), ("last", last, one)];
    for (answer, score, case) in answers {
        let bounds = unit_bounds(bundle, &case, jobs())?;
        let cells = score.std_median.iter().zip(bounds);
        let cells = cells.map(|(std, bound)| format!("{:.2} ({:.2})", 1e3 * std, std / bound));
        let cells: Vec<String> = cells.collect();
        writeln!(widths, "| {recordings} | {answer} | {} |", cells.join(" | "))?;
    }
    Ok(())
}
