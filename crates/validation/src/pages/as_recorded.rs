//! `docs/validation/as-recorded.md`: recordings as benches make them, beside those that the bundle
//! expects.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use experiments::{
    AsRecordedRequest, AsRecordedScore,
    BenchColumn::{Angle, Command, Phase},
    BenchForm, evaluate_as_recorded,
};
use fdi_core::ToleranceUse;

use super::{bar::met, figure::Figure};
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
};
const BETWEEN: BenchForm =
    BenchForm { name: "the same, the command between two samples", between_samples: true, ..WHOLE };
const UNTOLD: BenchForm =
    BenchForm { name: "the same, the command not recorded", columns: &[Phase, Angle], ..BETWEEN };
const WIRED: BenchForm = BenchForm { any_wiring: true, ..WHOLE };
const FORMS: [BenchForm; 8] = [
    WHOLE,
    BETWEEN,
    UNTOLD,
    BenchForm { name: "the same, without the rotor's angle", columns: &[Phase], ..UNTOLD },
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

fn scores(
    forms: &[BenchForm],
    machines: usize,
    tolerance: ToleranceUse,
) -> Result<Vec<AsRecordedScore>> {
    let request = AsRecordedRequest { forms, machines, tolerance, seed: SEED, jobs: jobs() };
    evaluate_as_recorded(&request).context("recordings as benches make them")
}

/// Three machines of either kind: seconds.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let scores = scores(&[BETWEEN, UNTOLD, WIRED], FEW, ToleranceUse::None)?;
    let of = |(score, name): (&AsRecordedScore, &str)| {
        let figure = |what: &str, value: f64, tolerance_rel: f64| Figure {
            id: format!("{name}-{what}"),
            value,
            tolerance_rel,
            unit: "1".to_owned(),
        };
        [
            figure("healthy", score.healthy as f64, 0.0),
            figure("faulty", score.faulty as f64, 0.0),
            figure("width", score.width.0, SEARCHED_REL),
            figure("wiring", score.wiring_right as f64, 0.0),
        ]
    };
    Ok(scores.iter().zip(["twin", "command", "current", "wired"]).flat_map(of).collect())
}

pub(super) fn text() -> Result<String> {
    let mut page = String::from(HEAD);
    for (tolerance, title) in [
        (ToleranceUse::None, "The machine is exactly its model file (`--tolerance none`)"),
        (
            ToleranceUse::Model,
            "The machine is within the tolerances of its model file (the default)",
        ),
    ] {
        write!(page, "\n## {title}\n\n{COLUMNS}")?;
        let scores = scores(&FORMS, MACHINES, tolerance)?;
        let most_alarms = scores[0].false_alarms + MORE_ALARMS;
        for score in &scores {
            row(&mut page, score, most_alarms, tolerance)?;
        }
    }
    page.push_str(LIMITS);
    Ok(page)
}

fn row(
    page: &mut String,
    score: &AsRecordedScore,
    most_alarms: usize,
    tolerance: ToleranceUse,
) -> Result<()> {
    let (held, all) = score.held;
    let percent = 100.0 * held as f64 / all.max(1) as f64;
    let [least, most] = HOLD_PERCENT;
    // a machine that is exactly its file has less to be told from than tolerances allow for
    let holds = percent >= least && (tolerance == ToleranceUse::Model || percent <= most);
    writeln!(
        page,
        "| {} | {} {} | {} | {} | {} | {} | {percent:.1} {} | {:.2}, {:.2} {} | {} {} |",
        score.name,
        score.false_alarms,
        met(score.false_alarms <= most_alarms),
        score.healthy,
        score.faulty,
        score.inadequate,
        score.refused,
        met(holds),
        score.width.0,
        score.width.1,
        met(score.width.0 <= MOST_WIDTH),
        score.wiring_right,
        met(100 * score.wiring_right >= LEAST_WIRING_PERCENT * 2 * MACHINES),
    )?;
    Ok(())
}

const COLUMNS: &str = include_str!("as_recorded/columns.md");
const HEAD: &str = include_str!("as_recorded/head.md");
const LIMITS: &str = include_str!("as_recorded/limits.md");
