//! `docs/validation/cranfield.md`: a ball-screw actuator of another laboratory with seeded faults,
//! as far as a machine of its kind can be judged here.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use fdi_core::{
    Bundle, Channel, ChannelName, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Metadata, Recording,
};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::{figure::Figure, measured::recording::rows};
use crate::median::median;

/// Files of the actuator with a fault.
const FAULTY: [&str; 12] = [
    "lackLubrication1",
    "lackLubrication2",
    "backlash1",
    "backlash2",
    "spalling1",
    "spalling2",
    "spalling3",
    "spalling4",
    "spalling5",
    "spalling6",
    "spalling7",
    "spalling8",
];
/// Loads of the recordings, kgf.
const LOADS: [&str; 3] = ["-40", "20", "40"];
/// Chance that a healthy run stands out.
const RATE: f64 = 0.02;
/// Rate of the recordings, Hz.
const RATE_HZ: f64 = 25.0;
/// Change of the set point between samples from which the screw moves, mm.
const MOVES_MM: f64 = 0.2;
/// Sums over the same samples.
const SUMMED_REL: f64 = 1e-9;

/// Numbers of a run, each the mean over its recordings.
#[derive(Clone, Copy, Debug)]
struct Run {
    /// Mean current, A.
    current_a: f64,
    /// Position error of the strokes up less that of the strokes down, mm.
    hysteresis_mm: f64,
}

impl Run {
    const NAMES: [&'static str; 2] = ["mean current", "hysteresis of the position error"];

    fn numbers(self) -> [f64; 2] {
        [self.current_a, self.hysteresis_mm]
    }
}

/// Samples of set point and position error, mm, and current, A.
type Sample = [f64; 3];

/// The runs of a file at a load, in order.
fn runs(file: &str, load: &str) -> Result<Vec<Run>> {
    let rows = rows(&format!("cranfield_ema/{file}.csv.gz"))?;
    let mut by_run: Vec<(String, Vec<Sample>)> = Vec::new();
    for row in rows.iter().filter(|row| row.get(4).is_some_and(|cell| cell == load)) {
        let number = |place: usize| -> Result<f64> {
            let cell = row.get(place).with_context(|| format!("{file}: too few columns"))?;
            cell.parse().with_context(|| format!("{file}: `{cell}`"))
        };
        let sample = [number(0)?, number(1)?, number(2)?];
        match by_run.iter_mut().find(|(run, _)| *run == row[5]) {
            Some((_, samples)) => samples.push(sample),
            None => by_run.push((row[5].clone(), vec![sample])),
        }
    }
    Ok(by_run.iter().map(|(_, samples)| run_of(samples)).collect())
}

fn run_of(samples: &[Sample]) -> Run {
    let mean = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
        sum / f64::from(count.max(1))
    };
    let moved = |sign: f64| {
        let steps =
            samples.windows(2).filter(move |pair| sign * (pair[1][0] - pair[0][0]) > MOVES_MM);
        mean(&mut steps.map(|pair| pair[1][1]))
    };
    Run {
        current_a: mean(&mut samples.iter().map(|sample| sample[2])),
        hysteresis_mm: moved(1.0) - moved(-1.0),
    }
}

/// Distance of a value from others in standard deviations of one more of them.
fn distance(value: f64, others: &[f64]) -> f64 {
    let count = others.len() as f64;
    let mean = others.iter().sum::<f64>() / count;
    let variance = others.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (count - 1.0);
    (value - mean) / (variance * (1.0 + 1.0 / count)).sqrt()
}

/// Largest distance of a healthy run from so many others.
fn limit(others: usize) -> Result<f64> {
    Ok(StudentsT::new(0.0, 1.0, others as f64 - 1.0)?.inverse_cdf(1.0 - 0.5 * RATE))
}

/// Distances of each normal run from the other normal runs.
fn left_out(normal: &[f64]) -> Vec<f64> {
    let of = |place: usize| {
        let others: Vec<f64> = normal
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != place)
            .map(|(_, x)| *x)
            .collect();
        distance(normal[place], &others)
    };
    (0..normal.len()).map(of).collect()
}

/// Distances of a file's runs from the normal ones at a load, for each number.
fn distances(file: &str, load: &str) -> Result<[Vec<f64>; 2]> {
    let (normal, found) = (runs("normal", load)?, runs(file, load)?);
    Ok([0, 1].map(|number| {
        let normal: Vec<f64> = normal.iter().map(|run| run.numbers()[number]).collect();
        found.iter().map(|run| distance(run.numbers()[number], &normal)).collect()
    }))
}

/// The median distances of the first file.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let found = distances(FAULTY[0], LOADS[1])?;
    let figure = |(name, distances): (&str, Vec<f64>)| Figure {
        id: format!("{}-{}", FAULTY[0], name.replace(' ', "-")),
        value: median(&distances),
        tolerance_rel: SUMMED_REL,
        unit: "1".to_owned(),
    };
    Ok(Run::NAMES.into_iter().zip(found).map(figure).collect())
}

pub(super) fn text() -> Result<String> {
    let refused = refusal()?;
    let mut page = format!(
        "{}\n`fdi diagnose` of the current of all normal runs: \"{refused}\".\n\n{}",
        include_str!("cranfield/head.md"),
        include_str!("cranfield/table.md")
    );
    let least = limit(runs("normal", LOADS[0])?.len())?;
    for file in FAULTY {
        let mut cells = Vec::new();
        for load in LOADS {
            let [current, hysteresis] = distances(file, load)?.map(|of_runs| median(&of_runs));
            let told =
                |z: f64| if z.abs() > least { format!("**{z:.1}**") } else { format!("{z:.1}") };
            cells.push(format!("{}, {}", told(current), told(hysteresis)));
        }
        writeln!(page, "| {file} | {} |", cells.join(" | "))?;
    }
    page.push_str(&more_current(least)?);
    let (mut beyond, mut count) = (0, 0);
    for load in LOADS {
        let normal = runs("normal", load)?;
        for number in 0..2 {
            let values: Vec<f64> = normal.iter().map(|run| run.numbers()[number]).collect();
            let most = limit(values.len() - 1)?;
            beyond += left_out(&values).iter().filter(|z| z.abs() > most).count();
            count += values.len();
        }
    }
    writeln!(
        page,
        "\nOf the normal runs, each against the other five, {beyond} of {count} numbers stand out \
         ({:.1} % expected).",
        100.0 * RATE
    )?;
    page.push_str(include_str!("cranfield/limits.md"));
    Ok(page)
}

/// Cells of the table by the kind of fault, with more current than a normal run has.
fn more_current(least: f64) -> Result<String> {
    let mut kinds = Vec::new();
    for kind in ["lackLubrication", "backlash", "spalling"] {
        let (mut more, mut less, mut cells) = (0, 0, 0);
        for file in FAULTY.into_iter().filter(|file| file.starts_with(kind)) {
            for load in LOADS {
                let [current, _] = distances(file, load)?.map(|of_runs| median(&of_runs));
                more += usize::from(current > least);
                less += usize::from(current < -least);
                cells += 1;
            }
        }
        kinds.push(format!("{kind} {more} more and {less} less, of {cells}"));
    }
    Ok(format!("\nCells with more, and with less, current than normal: {}.\n", kinds.join("; ")))
}

/// Answer of a diagnosis to the current of a recording.
fn refusal() -> Result<String> {
    let rows = rows("cranfield_ema/normal.csv.gz")?;
    let current = rows.iter().map(|row| row[2].parse()).collect::<Result<Vec<f64>, _>>()?;
    let channel = Channel::uniform(ChannelName::Current, 0.0, RATE_HZ, current)?;
    let recording = Recording::new("normal", Metadata::default(), vec![channel])?;
    let diagnoser = Diagnoser::new(Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes)?)?;
    let answer = diagnoser.diagnose(&recording, &DiagnoseOptions::default());
    Ok(answer.err().context("a recording at 25 Hz is refused")?.to_string())
}
