//! Truth against answer over the committed recordings.

use std::{fmt::Write as _, fs, path::Path};

use anyhow::{Context, Result, ensure};
use fdi_core::{
    Bundle, ColumnMap, CommandSource, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Recording,
    ema_sim::HealthState,
    report::{Covariance, Method, RecordDiagnosis},
    sensor_bound_std,
};

use super::figure::Figure;

/// Faults from this level on must not be missed.
const NOT_TO_MISS: f64 = 0.010;
/// 95 % quantile of χ² with two degrees of freedom.
const ELLIPSE_95: f64 = 5.991_464_547_107_979;
/// Levels whose interval is judged: `k1..k5` each.
const LEVELS: usize = 5;

/// A recording's truth, answer and bound.
struct Case {
    name: String,
    truth: [f64; 7],
    turned: bool,
    answer: RecordDiagnosis,
    /// Cramér-Rao bound of `k1..k5, k6_cos, k6_sin` at the truth.
    bound: [Option<f64>; 7],
}

/// Counts over all cases.
#[derive(Default)]
struct Tally {
    intervals: usize,
    covered: usize,
    missed: usize,
    false_alarms: usize,
    present: usize,
    error2_over_std2: f64,
    levels: usize,
}

/// Diagnoses every committed recording with the embedded bundles and a method.
fn cases(method: Method) -> Result<Vec<Case>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/recordings");
    let diagnosers = EMBEDDED_BUNDLES
        .iter()
        .map(|embedded| Ok(Diagnoser::new(Bundle::from_bytes(embedded.bytes)?)?))
        .collect::<Result<Vec<_>>>()?;
    let truth = fs::read_to_string(folder.join("truth.csv"))?;
    truth
        .lines()
        .skip(1)
        .map(|line| {
            let mut cells = line.split(',');
            let name = cells.next().context("a line of truth.csv is empty")?.to_owned();
            let numbers = cells.map(str::parse).collect::<Result<Vec<f64>, _>>()?;
            ensure!(numbers.len() == 8, "truth.csv: {} numbers for {name}", numbers.len());
            let levels: [f64; 7] = numbers[..7].try_into()?;
            let recording = Recording::read(&folder.join(&name), &ColumnMap::default())?;
            let Some(CommandSource::Named(command)) = &recording.metadata.command else {
                anyhow::bail!("{name} does not name its command");
            };
            let diagnoser = diagnosers
                .iter()
                .find(|one| one.bundle().experiment.name == *command)
                .with_context(|| format!("no bundle for `{command}`"))?;
            let options = DiagnoseOptions { method, ..DiagnoseOptions::default() };
            let answer = diagnoser.diagnose(&recording, &options)?;
            let bound = sensor_bound_std(
                &diagnoser.bundle().experiment,
                &HealthState::new(levels)?.coordinates(),
                numbers[7],
                answer.fit.noise_a,
                10e3,
            )?;
            Ok(Case { name, truth: levels, turned: numbers[7] != 0.0, answer, bound })
        })
        .collect()
}

impl Tally {
    fn of(cases: &[Case]) -> Self {
        let mut tally = Self::default();
        for case in cases {
            for (fault, &truth) in case.answer.faults.iter().zip(&case.truth).take(LEVELS + 1) {
                if let Some(detected) = fault.detected {
                    tally.present += usize::from(truth >= NOT_TO_MISS);
                    tally.missed += usize::from(truth >= NOT_TO_MISS && !detected);
                    let healthy = case.truth[..=LEVELS].iter().all(|&level| level == 0.0);
                    tally.false_alarms += usize::from(healthy && detected);
                }
            }
            for (fault, &truth) in case.answer.faults.iter().zip(&case.truth).take(LEVELS) {
                if let (Some([low, high]), Some(value), Some(std)) =
                    (fault.interval_95, fault.value, fault.std)
                {
                    tally.intervals += 1;
                    tally.covered += usize::from((low..=high).contains(&truth));
                    tally.error2_over_std2 += ((value - truth) / std).powi(2);
                    tally.levels += 1;
                }
            }
            if let Some(distance2) = region_distance2(case) {
                tally.intervals += 1;
                tally.covered += usize::from(distance2 <= ELLIPSE_95);
            }
        }
        tally
    }
}

/// Squared distance of the true eccentricity from the estimate in units of its covariance.
fn region_distance2(case: &Case) -> Option<f64> {
    let Covariance { parameters, estimate, matrix } = &case.answer.covariance;
    let x = parameters.iter().position(|name| name == "k6_cos")?;
    let y = parameters.iter().position(|name| name == "k6_sin")?;
    let truth = HealthState::new(case.truth).ok()?.coordinates().0;
    let (dx, dy) = (estimate[x] - truth[5], estimate[y] - truth[6]);
    let (a, b, c) = (matrix[x][x], matrix[x][y], matrix[y][y]);
    let determinant = a * c - b * b;
    Some((c * dx * dx - 2.0 * b * dx * dy + a * dy * dy) / determinant)
}

pub(super) fn quick() -> Result<Vec<Figure>> {
    let cases = cases(Method::Gls)?;
    let tally = Tally::of(&cases);
    let figure = |id: &str, value: f64, tolerance_rel: f64, unit: &str| Figure {
        id: id.to_owned(),
        value,
        tolerance_rel,
        unit: unit.to_owned(),
    };
    let evaluations: u64 = cases.iter().map(|case| case.answer.evaluations).sum();
    Ok(vec![
        figure("recordings", cases.len() as f64, 0.0, "1"),
        figure("faults-of-0.010-or-more", tally.present as f64, 0.0, "1"),
        figure("missed", tally.missed as f64, 0.0, "1"),
        figure("false-alarms-on-healthy", tally.false_alarms as f64, 0.0, "1"),
        figure("intervals", tally.intervals as f64, 0.0, "1"),
        figure("intervals-with-the-truth", tally.covered as f64, 0.0, "1"),
        figure("evaluations", evaluations as f64, 0.02, "1"),
        figure(
            "rms-error-over-stated-std",
            (tally.error2_over_std2 / tally.levels as f64).sqrt(),
            1e-3,
            "1",
        ),
    ])
}

pub(super) fn text(figures: &[Figure]) -> Result<String> {
    let cases = cases(Method::Gls)?;
    let value = |id: &str| figures.iter().find(|f| f.id == id).map_or(f64::NAN, |f| f.value);
    let mut page = String::new();
    writeln!(
        page,
        "# Diagnosis of the committed recordings\n\n\
         Made by `cargo xtask validate diagnosis`; nobody edits it. The recordings of\n\
         `fixtures/recordings` come from the high-fidelity model in the reference configuration\n\
         (carrier modulation, controller noise and digitisation on), with white noise of 20 mA rms\n\
         on each phase sample at 10 kHz and 12 bits over ±20 A; seeds and hashes stand in\n\
         `fixtures/datasets/manifest.toml`. They are diagnosed with the embedded bundles, whose\n\
         seeds are others, by the default method with `--tolerance none`: each is of exactly the\n\
         machine of its model file. The truth is read by this page alone.\n"
    )?;
    let intervals = value("intervals");
    writeln!(
        page,
        "| over {} recordings | figure | required |\n|---|---|---|\n\
         | faults of 0.010 or more missed | {} of {} | 0 |\n\
         | detections on the three healthy recordings | {} | 0 |\n\
         | 95 % intervals that hold the truth (k1..k5 each, k6 and k7 as one region) | {} of {} \
         ({:.1} %) | at least 85 % |\n\
         | rms of error over stated standard deviation, k1..k5 | {:.2} | 1 if exact |\n",
        value("recordings"),
        value("missed"),
        value("faults-of-0.010-or-more"),
        value("false-alarms-on-healthy"),
        value("intervals-with-the-truth"),
        intervals,
        100.0 * value("intervals-with-the-truth") / intervals,
        value("rms-error-over-stated-std"),
    )?;
    writeln!(
        page,
        "Levels below zero are reported as zero, so that the last figure is below one on healthy\n\
         faults.\n\n## Each recording\n\n\
         A cell gives *error / stated standard deviation / bound*, in units of 1e-3; **bold** is a\n\
         fault that is there, `!` an interval that does not hold the truth. The bound is Cramér and\n\
         Rao's for the sensors' noise alone on the filtered envelope: it does not know that the\n\
         monitor errs, the stated deviation does. k6 is the amplitude; its bound is along it.\n\n\
         | recording | verdict | k1 | k2 | k3 | k4 | k5 | k6 | k7 (error in degrees) |\n\
         |---|---|---|---|---|---|---|---|---|"
    )?;
    for case in &cases {
        write!(
            page,
            "| {}{} | {} |",
            case.name,
            if case.turned { " (turned)" } else { "" },
            case.answer.verdict
        )?;
        for index in 0..6 {
            write!(page, " {} |", cell(case, index))?;
        }
        let direction = case.answer.faults[6].value.map_or("-".to_owned(), |turn| {
            let away = (turn - case.truth[6] + 0.5).rem_euclid(1.0) - 0.5;
            format!("{:+.1}", 360.0 * away)
        });
        writeln!(page, " {direction} |")?;
    }
    budgets(&mut page)?;
    Ok(page)
}

/// Error, stated deviation and bound of one level.
fn cell(case: &Case, index: usize) -> String {
    let fault = &case.answer.faults[index];
    let (Some(value), Some(std), Some([low, high])) = (fault.value, fault.std, fault.interval_95)
    else {
        return "-".to_owned();
    };
    let truth = case.truth[index];
    let bound = if index < LEVELS {
        case.bound[index]
    } else {
        let angle = core::f64::consts::TAU * (case.truth[6] - 0.5);
        case.bound[5].zip(case.bound[6]).map(|(c, s)| (c * angle.cos()).hypot(s * angle.sin()))
    };
    let mut text = format!("{:+.2} / {:.2}", 1e3 * (value - truth), 1e3 * std);
    if let Some(bound) = bound {
        let _ = write!(text, " / {:.2}", 1e3 * bound);
    }
    if truth > 0.0 {
        text = format!("**{text}**");
    }
    if !(low..=high).contains(&truth) {
        text.push_str(" !");
    }
    text
}

/// The paper's search at its budget, beside the default.
fn budgets(page: &mut String) -> Result<()> {
    writeln!(
        page,
        "\n## The paper's search at its budget\n\n\
         Median of the absolute error over the faults that are there, chirp recordings with\n\
         start angle zero, and evaluations of the monitor. The scalar methods search the paper's\n\
         whole domain [0, 1] on the mask of 30 points with 20 initial and 130 sequential\n\
         evaluations; `cargo xtask budget` guards their time.\n\n\
         | method | k1 | k2 | k3..k5 | k6 | evaluations (median) |\n|---|---|---|---|---|---|"
    )?;
    for method in [Method::Gls, Method::TwoStepEi, Method::Ei, Method::Ucb] {
        let cases = cases(method)?;
        let chosen: Vec<&Case> = cases
            .iter()
            .filter(|case| !case.turned && case.answer.faults[5].value.is_some())
            .collect();
        let median_error = |faults: std::ops::Range<usize>| {
            let mut errors: Vec<f64> = chosen
                .iter()
                .flat_map(|case| {
                    faults.clone().filter(|&i| case.truth[i] > 0.0).filter_map(|i| {
                        case.answer.faults[i].value.map(|value| (value - case.truth[i]).abs())
                    })
                })
                .collect();
            errors.sort_by(f64::total_cmp);
            errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let mut evaluations: Vec<u64> = chosen.iter().map(|case| case.answer.evaluations).collect();
        evaluations.sort_unstable();
        writeln!(
            page,
            "| {method} | {:.4} | {:.4} | {:.4} | {:.4} | {} |",
            median_error(0..1),
            median_error(1..2),
            median_error(2..5),
            median_error(5..6),
            evaluations[evaluations.len() / 2],
        )?;
    }
    Ok(())
}
