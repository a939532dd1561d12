//! `docs/validation/real-recordings.md`: recordings that begin otherwise than the bundle's test, and
//! recordings of the bench with references.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use experiments::{
    Beforehand, Beginning, BeginningRequest, BeginningScore, EvaluationSetting, ReferenceRequest,
    evaluate_beginnings, evaluate_references,
};
use fdi_core::{DiagnoseOptions, ema_sim::presets::BENCH};

use super::figure::Figure;
use crate::processor::jobs;

/// Root seed of the page. The search was developed on seed 7.
const SEED: u64 = 1;
/// Recordings for each way to begin.
const CONDITIONS: usize = 16;
/// Recordings of the bench, and of it without damage.
const BENCH_CONDITIONS: usize = 10;
/// References of the bench.
const REFERENCES: [usize; 3] = [0, 1, 4];
/// Seeded results agree to rounding, those of a search with a tolerance of its own to this.
const SEARCHED_REL: f64 = 0.05;

/// As the bundle's test.
const OWN: Beginning =
    Beginning { delay_s: 0.0, side_ratio: 0.0, speed_integral_a: 0.0, current_integral_v: 0.0 };
const EARLY: Beginning = Beginning { delay_s: 7e-4, ..OWN };

const BEGINNINGS: [(&str, Beginning); 9] = [
    ("as the bundle's", OWN),
    ("0.7 ms before the command", EARLY),
    ("0.7 ms after it", Beginning { delay_s: -7e-4, ..OWN }),
    ("play, upper side", Beginning { side_ratio: 1.0, ..OWN }),
    ("play, lower side", Beginning { side_ratio: -1.0, ..OWN }),
    ("speed integrator 0.3 A", Beginning { speed_integral_a: 0.3, ..OWN }),
    ("speed integrator -0.5 A", Beginning { speed_integral_a: -0.5, ..OWN }),
    ("current integrator 1 V", Beginning { current_integral_v: 1.0, ..OWN }),
    (
        "0.5 ms before, lower side, 0.3 A",
        Beginning { delay_s: 5e-4, side_ratio: -1.0, speed_integral_a: 0.3, ..OWN },
    ),
];

fn scores(
    beginnings: &[(&str, Beginning)],
    conditions: usize,
    setting: EvaluationSetting,
) -> Result<Vec<BeginningScore>> {
    let estimated =
        DiagnoseOptions { max_delay_s: 2e-3, free_start: true, ..DiagnoseOptions::default() };
    let request = BeginningRequest {
        beginnings,
        conditions,
        estimated: &estimated,
        setting,
        seed: SEED,
        jobs: jobs(),
    };
    evaluate_beginnings(&request).context("beginnings")
}

/// Three recordings that begin before the command: seconds.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let setting =
        EvaluationSetting { snapshots: 60, sparse_snapshots: 40, ..BeginningRequest::SETTING };
    let scores = scores(&[("early", EARLY)], 3, setting)?;
    let mut figures = Vec::new();
    for score in scores {
        let name = if score.estimated { "estimated" } else { "taken-as-0" };
        for fault in score.faults.iter().take(2) {
            figures.push(Figure {
                id: format!("delay-{name}-{}", fault.id),
                value: fault.error_abs.map_or(0.0, |q| q.median),
                tolerance_rel: SEARCHED_REL,
                unit: "1".to_owned(),
            });
        }
        figures.push(Figure {
            id: format!("delay-{name}-adequate"),
            value: score.adequate_frac,
            tolerance_rel: 0.0,
            unit: "1".to_owned(),
        });
    }
    Ok(figures)
}

pub(super) fn text(_: &[Figure]) -> Result<String> {
    let mut page = String::from(HEAD);
    beginnings(&mut page)?;
    page.push_str(REFERENCE_HEAD);
    references(&mut page)?;
    page.push_str(LIMITS);
    Ok(page)
}

fn beginnings(page: &mut String) -> Result<()> {
    for score in scores(&BEGINNINGS, CONDITIONS, BeginningRequest::SETTING)? {
        let errors: Vec<String> = score
            .faults
            .iter()
            .map(|fault| {
                fault.error_abs.map_or(String::new(), |q| format!("{:.2}", 1e3 * q.median))
            })
            .collect();
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.1}"));
        writeln!(
            page,
            "| {} | {} | {} | {:.0} | {:.0} | {} / {} | {:.0} |",
            score.name,
            if score.estimated { "yes" } else { "no" },
            errors.join(" | "),
            100.0 * score.adequate_frac,
            100.0 * score.told_frac,
            number(score.chi2_median),
            number(score.chi2_mean),
            score.evaluations_median,
        )?;
    }
    Ok(())
}

fn references(page: &mut String) -> Result<()> {
    let mut sheet = BENCH;
    sheet.transmission.kinetic_friction_n_m *= 0.93;
    sheet.transmission.static_friction_n_m *= 0.93;
    sheet.transmission.surface_friction_n_m *= 0.75;
    sheet.motor.back_emf_v_s_per_rad *= 1.03;
    for (name, beforehand) in [
        ("high-fidelity signals of the machine", Beforehand::Itself),
        ("high-fidelity signals of the data sheet", Beforehand::Sheet(&sheet)),
        ("the low-fidelity model alone", Beforehand::LowFidelity),
    ] {
        let request = ReferenceRequest {
            beforehand,
            references: &REFERENCES,
            conditions: BENCH_CONDITIONS,
            healthy: BENCH_CONDITIONS,
            setting: ReferenceRequest::SETTING,
            seed: SEED,
            jobs: jobs(),
        };
        for score in evaluate_references(&request).context(name)? {
            write!(page, "| {name} | {} |", score.references)?;
            for fault in &score.faults {
                write!(
                    page,
                    " {:.2} ({:.1} %) | {:.0} | {} |",
                    fault.error_abs.map_or(0.0, |q| 1e3 * q.median),
                    fault.error_percent.map_or(0.0, |q| q.median),
                    100.0 * fault.coverage_95.unwrap_or(0.0),
                    fault.false_alarms.unwrap_or(0)
                )?;
            }
            writeln!(page, " {:.0} |", 100.0 * score.adequate_frac)?;
        }
    }
    Ok(())
}

const HEAD: &str = include_str!("real_recordings/head.md");
const REFERENCE_HEAD: &str = include_str!("real_recordings/references.md");
const LIMITS: &str = include_str!("real_recordings/limits.md");
