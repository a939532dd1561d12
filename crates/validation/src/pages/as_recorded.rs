//! `docs/validation/as-recorded.md`: recordings as benches make them, beside those that the bundle
//! expects.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use experiments::{
    AsRecordedRequest, AsRecordedScore,
    BenchColumn::{Angle, Command, Phase},
    BenchForm, DriveLog, evaluate_as_recorded,
};
use fdi_core::{Bundle, ToleranceUse};

use super::{
    bar::met,
    figure::Figure,
    machine::{built, ema_48},
};
use crate::processor::jobs;

/// Root seed of the page. The alignment was developed on recordings of `fdi simulate`.
const SEED: u64 = 11;
/// Machines without damage, and as many with some.
const MACHINES: usize = 100;
/// Machines of the quick figures.
const FEW: usize = 3;
/// Bars: percent of intervals that hold the truth, standard deviation over the twin's.
const HOLD_PERCENT: [f64; 2] = [91.0, 98.5];
const MOST_WIDTH: f64 = 1.3;
/// Least wirings that are told right, percent.
const LEAST_WIRING_PERCENT: usize = 99;
/// False alarms beyond those on the twins, of a hundred machines.
const MORE_ALARMS: usize = 1;
/// Searches with a tolerance of their own agree to this.
const SEARCHED_REL: f64 = 0.05;

const WHOLE: BenchForm = BenchForm {
    name: "up to 2 s before the command",
    most_before_s: 2.0,
    between_samples: false,
    columns: &[Phase, Angle, Command],
    any_wiring: false,
    quadrature: None,
};
const BETWEEN: BenchForm =
    BenchForm { name: "the same, the command between two samples", between_samples: true, ..WHOLE };
const UNTOLD: BenchForm = BenchForm {
    name: "up to 2 s before a command that is not recorded",
    columns: &[Phase, Angle],
    ..WHOLE
};
const WIRED: BenchForm = BenchForm { any_wiring: true, ..WHOLE };
const FORMS: [BenchForm; 9] = [
    WHOLE,
    BETWEEN,
    UNTOLD,
    BenchForm {
        name: "the same, a logger of its own: between two samples",
        between_samples: true,
        ..UNTOLD
    },
    BenchForm {
        name: "up to 2 s before, neither command nor rotor's angle recorded",
        columns: &[Phase],
        ..UNTOLD
    },
    BenchForm { name: "two phases", most_before_s: 0.0, columns: &[Angle, Command], ..WHOLE },
    BenchForm {
        name: "two phases, up to 2 s before a command between two samples",
        columns: &[Angle, Command],
        ..BETWEEN
    },
    BenchForm { name: "phases in any order and sense", most_before_s: 0.0, ..WIRED },
    BenchForm {
        name: "two phases in any order and sense, up to 2 s before the command",
        columns: &[Angle, Command],
        ..WIRED
    },
];

/// Logs of a field-oriented drive of its own current.
const LOGS: [BenchForm; 5] = [
    log("q-axis current, each tick", None, 1),
    BenchForm {
        columns: UNTOLD.columns,
        ..log("q-axis current, each tick, the command not recorded", None, 1)
    },
    log("q-axis current behind 1 kHz, each tick", Some(1000.0), 1),
    log("q-axis current behind 300 Hz, each second tick", Some(300.0), 2),
    log("q-axis current behind 1 kHz, each fourth tick", Some(1000.0), 4),
];

const fn log(name: &'static str, corner_hz: Option<f64>, ticks: usize) -> BenchForm {
    BenchForm { name, quadrature: Some(DriveLog { corner_hz, ticks }), ..WHOLE }
}

/// Ways to take the machine, with their titles.
const TOLERANCES: [(ToleranceUse, &str); 2] = [
    (ToleranceUse::None, "The machine is exactly its model file (`--tolerance none`)"),
    (ToleranceUse::Model, "The machine is within the tolerances of its model file (the default)"),
];

fn scores(
    bundle: &Bundle,
    forms: &[BenchForm],
    machines: usize,
    tolerance: ToleranceUse,
) -> Result<Vec<AsRecordedScore>> {
    let request =
        AsRecordedRequest { bundle, forms, machines, tolerance, seed: SEED, jobs: jobs() };
    evaluate_as_recorded(&request).context("recordings as benches make them")
}

/// Three machines of either kind: seconds.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let scores = scores(&ema_48()?, &[BETWEEN, UNTOLD, WIRED], FEW, ToleranceUse::None)?;
    let of = |(score, name): (&AsRecordedScore, &str)| {
        let figure = |what: &str, value: f64, tolerance_rel: f64| Figure {
            id: format!("{name}-{what}"),
            value,
            tolerance_rel,
            unit: "1".to_owned(),
        };
        [
            figure("healthy", score.answers.healthy as f64, 0.0),
            figure("faulty", score.answers.faulty as f64, 0.0),
            figure("width", score.answers.width.0, SEARCHED_REL),
            figure("wiring", score.wiring_right as f64, 0.0),
        ]
    };
    Ok(scores.iter().zip(["twin", "command", "current", "wired"]).flat_map(of).collect())
}

pub(super) fn text() -> Result<String> {
    let mut page = String::from(HEAD);
    let bundle = ema_48()?;
    for (tolerance, title) in TOLERANCES {
        write!(page, "\n## {title}\n\n{COLUMNS}")?;
        rows(&mut page, &scores(&bundle, &FORMS, MACHINES, tolerance)?, tolerance)?;
    }
    page.push_str(QUADRATURE);
    let bundle = built("bench", None)?;
    for (tolerance, title) in TOLERANCES {
        write!(page, "\n### {title}\n\n{COLUMNS}")?;
        rows(&mut page, &scores(&bundle, &LOGS, MACHINES, tolerance)?, tolerance)?;
    }
    page.push_str(LIMITS);
    Ok(page)
}

fn rows(page: &mut String, scores: &[AsRecordedScore], tolerance: ToleranceUse) -> Result<()> {
    let most_alarms = scores[0].answers.false_alarms + MORE_ALARMS;
    scores.iter().try_for_each(|score| row(page, score, most_alarms, tolerance))
}

fn row(
    page: &mut String,
    score: &AsRecordedScore,
    most_alarms: usize,
    tolerance: ToleranceUse,
) -> Result<()> {
    let answers = &score.answers;
    let percent = answers.held_percent();
    let [least, most] = HOLD_PERCENT;
    // a machine that is exactly its file has less to be told from than tolerances allow for
    let holds = percent >= least && (tolerance == ToleranceUse::Model || percent <= most);
    writeln!(
        page,
        "| {} | {} {} | {} | {} | {} | {} | {percent:.1} {} | {:.2}, {:.2} {} | {} {} |",
        score.name,
        answers.false_alarms,
        met(answers.false_alarms <= most_alarms),
        answers.healthy,
        answers.faulty,
        answers.inadequate,
        answers.refused,
        met(holds),
        answers.width.0,
        answers.width.1,
        met(answers.width.0 <= MOST_WIDTH),
        score.wiring_right,
        met(100 * score.wiring_right >= LEAST_WIRING_PERCENT * 2 * MACHINES),
    )?;
    Ok(())
}

const COLUMNS: &str = include_str!("as_recorded/columns.md");
const QUADRATURE: &str = include_str!("as_recorded/quadrature.md");
const HEAD: &str = include_str!("as_recorded/head.md");
const LIMITS: &str = include_str!("as_recorded/limits.md");
