//! The inference budgets of the FREEDOM paper, guarded: 25 s for seven faults, 6 s for two.

use std::path::Path;

use anyhow::{Context, Result, bail};
use fdi_core::{
    Bundle, ColumnMap, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Recording,
    report::{Method, RecordDiagnosis},
};

use crate::ci::{clock, say};

/// A budget: a committed recording, a method, and what it may take.
struct Budget {
    name: &'static str,
    recording: &'static str,
    bundle: usize,
    method: Method,
    /// Evaluations of the monitor, pinned.
    evaluations: u64,
    limit_s: f64,
}

/// The paper's two settings, its method, and the default beside them.
///
/// Evaluations: the search's own, one at its end, and the central differences of the
/// uncertainty (two a fault).
const BUDGETS: &[Budget] = &[
    Budget {
        name: "7 faults, two-step EI, 20 + 130",
        recording: "r16.csv.gz",
        bundle: 0,
        method: Method::TwoStepEi,
        evaluations: 150 + 1 + 14,
        limit_s: 25.0,
    },
    Budget {
        name: "2 faults, two-step EI, 10 + 40",
        recording: "r25.csv.gz",
        bundle: 1,
        method: Method::TwoStepEi,
        evaluations: 50 + 1 + 4,
        limit_s: 6.0,
    },
    Budget {
        name: "7 faults, default",
        recording: "r16.csv.gz",
        bundle: 0,
        method: Method::Composite,
        evaluations: 0,
        limit_s: 1.0,
    },
    Budget {
        name: "2 faults, default",
        recording: "r25.csv.gz",
        bundle: 1,
        method: Method::Composite,
        evaluations: 0,
        limit_s: 1.0,
    },
];

/// Noise told, A: 20 mA and the converter's; so that no evaluation goes into finding it.
const TOLD_NOISE_A: f64 = 0.0202;

/// Runs a figure is the least of.
const RUNS: usize = 3;

/// Measures every budget on this machine and fails on the first that is exceeded.
pub(crate) fn run(root: &Path) -> Result<()> {
    say(&format!(
        "{:<34} {:>6} {:>9} {:>9} {:>7}  levels found",
        "setting", "runs", "time/s", "limit/s", "share"
    ));
    for budget in BUDGETS {
        let (answer, least_s) = measure(root, budget)?;
        let pinned = budget.evaluations;
        if pinned != 0 && answer.evaluations != pinned {
            bail!("{}: {} evaluations, {pinned} expected", budget.name, answer.evaluations);
        }
        let levels: Vec<String> = answer
            .faults
            .iter()
            .filter_map(|fault| fault.value.map(|value| format!("{} {value:.4}", fault.id)))
            .collect();
        say(&format!(
            "{:<34} {:>6} {least_s:>9.3} {:>9.1} {:>6.1}%  {}",
            budget.name,
            answer.evaluations,
            budget.limit_s,
            100.0 * least_s / budget.limit_s,
            levels.join(", ")
        ));
        if least_s > budget.limit_s {
            bail!("{}: {least_s:.3} s exceed {} s", budget.name, budget.limit_s);
        }
    }
    Ok(())
}

/// The answer, and the least time of some runs; preparing the bundle is not part of it.
fn measure(root: &Path, budget: &Budget) -> Result<(RecordDiagnosis, f64)> {
    let path = root.join("fixtures/recordings").join(budget.recording);
    let recording = Recording::read(&path, &ColumnMap::default())
        .with_context(|| path.display().to_string())?;
    let bundle = Bundle::from_bytes(EMBEDDED_BUNDLES[budget.bundle].bytes)?;
    let diagnoser = Diagnoser::new(bundle)?;
    let noise_a = Some(TOLD_NOISE_A);
    let options = DiagnoseOptions { method: budget.method, noise_a, ..DiagnoseOptions::default() };
    let mut best: Option<(RecordDiagnosis, f64)> = None;
    for _ in 0..RUNS {
        let start = clock();
        let answer = diagnoser.diagnose(&recording, &options)?;
        let took_s = start.elapsed().as_secs_f64();
        if best.as_ref().is_none_or(|(_, least)| took_s < *least) {
            best = Some((answer, took_s));
        }
    }
    best.context("no run was made")
}
