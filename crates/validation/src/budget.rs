//! The inference budgets, guarded: evaluations exactly, times as ratios.
//!
//! - The FREEDOM paper's budgets, 25 s for seven faults and 6 s for two, are times of the clock.
//! - Distinct recordings are diagnosed one after another, each with the noise level that is
//!   estimated from it, so that nothing that was prepared for one serves another. Their processor
//!   time is judged as a ratio to that of a loop which runs between the cases.
//! - Evaluations of the models are pinned everywhere.

pub(crate) mod together;
mod work;

use std::path::Path;

use anyhow::{Context, Result, bail};
use fdi_benches::diagnose::{BUDGETS, Budget};
use fdi_core::{
    Bundle, ColumnMap, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Recording, ToleranceUse,
    report::{Fidelity, NoiseSource},
};

use crate::{
    processor::{processor_s, reference_s},
    terminal::{clock, say},
};

/// Distinct recordings that are diagnosed in a row.
struct Batch {
    name: &'static str,
    /// Place of the bundle among the embedded ones.
    bundle: usize,
    recordings: &'static [&'static str],
    fidelity: Fidelity,
    tolerance: ToleranceUse,
    /// The bundle is read and prepared within the time: the first diagnosis of a process.
    first: bool,
    /// Evaluations of the models for each recording.
    evaluations: &'static [u64],
    /// Most processor time a recording, in runs of the reference loop: about twice the ratio that
    /// was measured when the budget was set.
    limit_ratio: f64,
}

const BATCHES: [Batch; 8] = [
    Batch {
        name: "chirp, first of a process",
        bundle: 0,
        recordings: &["r16.csv.gz"],
        fidelity: Fidelity::Low,
        tolerance: ToleranceUse::None,
        first: true,
        evaluations: &[20],
        limit_ratio: 0.6,
    },
    Batch {
        name: "chirps, batch",
        bundle: 0,
        recordings: &[
            "r01.csv.gz",
            "r04.csv.gz",
            "r05.csv.gz",
            "r06.csv.gz",
            "r07.csv.gz",
            "r08.csv.gz",
            "r09.csv.gz",
            "r10.csv.gz",
            "r11.csv.gz",
            "r12.csv.gz",
            "r16.csv.gz",
        ],
        fidelity: Fidelity::Low,
        tolerance: ToleranceUse::None,
        first: false,
        evaluations: &[20, 20, 19, 21, 22, 21, 19, 23, 23, 22, 20],
        limit_ratio: 0.1,
    },
    Batch {
        name: "chirps, high fidelity",
        bundle: 0,
        recordings: &["r10.csv.gz", "r16.csv.gz"],
        fidelity: Fidelity::High,
        tolerance: ToleranceUse::None,
        first: false,
        evaluations: &[49, 46],
        limit_ratio: 2.2,
    },
    Batch {
        name: "sine, first of a process",
        bundle: 1,
        recordings: &["r25.csv.gz"],
        fidelity: Fidelity::Low,
        tolerance: ToleranceUse::None,
        first: true,
        evaluations: &[16],
        limit_ratio: 5.0,
    },
    Batch {
        name: "sines, batch",
        bundle: 1,
        recordings: &["r25.csv.gz", "r26.csv.gz"],
        fidelity: Fidelity::Low,
        tolerance: ToleranceUse::None,
        first: false,
        evaluations: &[16, 15],
        limit_ratio: 2.0,
    },
    Batch {
        name: "chirp, tolerances, first",
        bundle: 0,
        recordings: &["r16.csv.gz"],
        fidelity: Fidelity::Low,
        tolerance: ToleranceUse::Model,
        first: true,
        evaluations: &[160],
        limit_ratio: 0.5,
    },
    Batch {
        name: "chirps, tolerances, batch",
        bundle: 0,
        recordings: &["r01.csv.gz", "r04.csv.gz", "r08.csv.gz", "r10.csv.gz", "r12.csv.gz"],
        fidelity: Fidelity::Low,
        tolerance: ToleranceUse::Model,
        first: false,
        evaluations: &[31, 31, 28, 109, 234],
        limit_ratio: 0.15,
    },
    Batch {
        name: "sines, tolerances, batch",
        bundle: 1,
        recordings: &["r25.csv.gz", "r26.csv.gz"],
        fidelity: Fidelity::Low,
        tolerance: ToleranceUse::Model,
        first: false,
        evaluations: &[16, 15],
        limit_ratio: 3.0,
    },
];

/// Measures every budget on this machine and fails at the end when one is exceeded.
///
/// # Errors
///
/// When a recording cannot be read or diagnosed, or a budget is exceeded.
pub fn check_budgets(root: &Path) -> Result<()> {
    let mut exceeded = Vec::new();
    say(&format!("{:<28} {:>6} {:>9} {:>9}", "noise told", "runs", "time/s", "limit/s"));
    for budget in BUDGETS {
        exceeded.extend(told(budget)?);
    }
    say(&format!(
        "{:<28} {:>6} {:>12} {:>9} {:>9}",
        "noise of each recording", "runs", "processor/s", "ratio", "limit"
    ));
    for batch in &BATCHES {
        exceeded.extend(estimated(root, batch)?);
    }
    exceeded.extend(together::exceeded()?);
    exceeded.extend(work::exceeded()?);
    if exceeded.is_empty() { Ok(()) } else { bail!("{}", exceeded.join("; ")) }
}

/// A diagnosis with its noise told, by its evaluations and where the paper gives one its time;
/// preparing the bundle is not part of it.
fn told(budget: Budget) -> Result<Option<String>> {
    let case = budget.prepare()?;
    let Budget { name, evaluations, limit_s, .. } = budget;
    let start = clock();
    let answer = case.run()?;
    let took_s = start.elapsed().as_secs_f64();
    let shown = limit_s.map_or("-".to_owned(), |limit_s| format!("{limit_s:.0}"));
    say(&format!("{name:<28} {:>6} {took_s:>9.3} {shown:>9}", answer.evaluations));
    if answer.evaluations != evaluations {
        return Ok(Some(format!(
            "{name}: {} evaluations, {evaluations} expected",
            answer.evaluations
        )));
    }
    let over = limit_s.filter(|&limit_s| took_s > limit_s);
    Ok(over.map(|limit_s| format!("{name}: {took_s:.3} s exceed {limit_s} s")))
}

/// Recordings with the noise that is estimated from each.
fn estimated(root: &Path, batch: &Batch) -> Result<Option<String>> {
    let folder = root.join("fixtures/recordings");
    let read = |file: &&str| {
        Recording::read(&folder.join(file), &ColumnMap::default())
            .with_context(|| (*file).to_owned())
    };
    let recordings = batch.recordings.iter().map(read).collect::<Result<Vec<_>>>()?;
    let prepared = || -> Result<Diagnoser> {
        let bundle = Bundle::from_bytes(EMBEDDED_BUNDLES[batch.bundle].bytes)?;
        Ok(Diagnoser::new(bundle)?)
    };
    let before_s = reference_s();
    let ready = if batch.first { None } else { Some(prepared()?) };
    let start_s = processor_s();
    let diagnoser = match ready {
        Some(diagnoser) => diagnoser,
        None => prepared()?,
    };
    let options = DiagnoseOptions {
        fidelity: batch.fidelity,
        tolerance: batch.tolerance,
        ..DiagnoseOptions::default()
    };
    let mut evaluations = Vec::new();
    for (recording, name) in recordings.iter().zip(batch.recordings) {
        let answer = diagnoser.diagnose(recording, &options)?;
        if !matches!(answer.fit.noise_source, NoiseSource::OutOfBand | NoiseSource::Residual) {
            bail!("{name}: the noise level is not estimated from the recording");
        }
        evaluations.push(answer.evaluations);
    }
    let took_s = (processor_s() - start_s) / recordings.len() as f64;
    let ratio = took_s / before_s.min(reference_s());
    let runs: u64 = evaluations.iter().sum();
    let Batch { name, limit_ratio, .. } = batch;
    say(&format!("{name:<28} {runs:>6} {took_s:>12.3} {ratio:>9.2} {limit_ratio:>9.2}"));
    if evaluations != batch.evaluations {
        let expected = batch.evaluations;
        return Ok(Some(format!("{name}: {evaluations:?} evaluations, {expected:?} expected")));
    }
    Ok(over(name, ratio, *limit_ratio))
}

/// Complaint about work that takes too much processor time, in runs of the reference loop.
fn over(name: &str, ratio: f64, limit_ratio: f64) -> Option<String> {
    (ratio > limit_ratio)
        .then(|| format!("{name}: {ratio:.2} runs of the reference loop exceed {limit_ratio:.2}"))
}
