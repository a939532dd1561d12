//! The inference budgets, guarded: the FREEDOM paper's, 25 s for seven faults and 6 s for two, and
//! those of this project's own methods.

use anyhow::{Context, Result, bail};
use fdi_benches::diagnose::{BUDGETS, Budget};
use fdi_core::report::RecordDiagnosis;

use crate::terminal::{clock, say};

/// Runs a figure is the least of.
const RUNS: usize = 3;
/// The same for what takes no second.
const SHORT_RUNS: usize = 20;

/// Measures every budget on this machine and fails at the end when one is exceeded.
///
/// # Errors
///
/// When a recording cannot be made or diagnosed, or a budget is exceeded.
pub fn check_budgets() -> Result<()> {
    say(&format!(
        "{:<28} {:>6} {:>10} {:>9} {:>7}  levels found",
        "setting", "runs", "time/s", "limit/s", "share"
    ));
    let mut exceeded = Vec::new();
    for budget in BUDGETS {
        let (answer, least_s) = measure(budget)?;
        let Budget { name, evaluations, limit_s, .. } = budget;
        if answer.evaluations != evaluations {
            bail!("{name}: {} evaluations, {evaluations} expected", answer.evaluations);
        }
        let levels: Vec<String> = answer
            .faults
            .iter()
            .filter_map(|fault| fault.value.map(|value| format!("{} {value:.4}", fault.id)))
            .collect();
        say(&format!(
            "{name:<28} {evaluations:>6} {least_s:>10.5} {limit_s:>9.3} {:>6.1}%  {}",
            100.0 * least_s / limit_s,
            levels.join(", ")
        ));
        if least_s > limit_s {
            exceeded.push(format!("{name}: {least_s:.5} s exceed {limit_s} s"));
        }
    }
    if exceeded.is_empty() { Ok(()) } else { bail!("{}", exceeded.join("; ")) }
}

/// The answer, and the least time of some runs; preparing the bundle is not part of it.
fn measure(budget: Budget) -> Result<(RecordDiagnosis, f64)> {
    let case = budget.prepare()?;
    let runs = if budget.limit_s < 1.0 { SHORT_RUNS } else { RUNS };
    let mut best: Option<(RecordDiagnosis, f64)> = None;
    for _ in 0..runs {
        let start = clock();
        let answer = case.run()?;
        let took_s = start.elapsed().as_secs_f64();
        if best.as_ref().is_none_or(|(_, least)| took_s < *least) {
            best = Some((answer, took_s));
        }
    }
    best.context("no run was made")
}
