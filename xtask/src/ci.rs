//! All that must pass, one step after another.

use std::{fs, path::Path, process::Command, time::Duration};

use anyhow::{Context, Result, bail};
use validation::{clock, say};

/// A step: its name, the command after `cargo`, and environment it needs.
struct Step {
    name: &'static str,
    cargo: &'static [&'static str],
    environment: &'static [(&'static str, &'static str)],
}

const fn step(name: &'static str, cargo: &'static [&'static str]) -> Step {
    Step { name, cargo, environment: &[] }
}

/// The steps, those that fail soonest first. A task of this program is a step like
/// any other, so that what runs here can be run by hand.
const STEPS: &[Step] = &[
    step("format", &["fmt", "--all", "--check"]),
    step("lints", &["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]),
    step("tidy", &["xtask", "tidy"]),
    // a reader that is not built by default
    step(
        "HDF5",
        &["test", "--package", "recordings", "--features", "hdf5", "--test", "it", "hdf5"],
    ),
    step("tests", &["test", "--workspace"]),
    Step {
        name: "docs",
        cargo: &["doc", "--workspace", "--no-deps"],
        environment: &[("RUSTDOCFLAGS", "-D warnings")],
    },
    step("reference pages", &["xtask", "docs", "--check"]),
    step("reference datasets", &["xtask", "gen-dataset", "--check"]),
    step("budgets", &["xtask", "budget"]),
    step("validation figures", &["xtask", "validate", "--check"]),
    // with this program, so that what both need has the same features and is compiled once
    step(
        "program for Python",
        &["build", "--release", "--package", "fdi-cli", "--package", "xtask"],
    ),
    step("Python", &["xtask", "python"]),
];

/// Runs every step; stops at the first that fails.
pub(crate) fn run(root: &Path) -> Result<()> {
    let mut times = Vec::with_capacity(STEPS.len());
    for (index, step) in STEPS.iter().enumerate() {
        say(&format!("[{}/{}] {}: cargo {}", index + 1, STEPS.len(), step.name, words(step)));
        let start = clock();
        let status = Command::new(env!("CARGO"))
            .args(step.cargo)
            .envs(step.environment.iter().copied())
            .current_dir(root)
            .status()
            .with_context(|| format!("step `{}`", step.name))?;
        if !status.success() {
            bail!("step `{}` failed: cargo {}", step.name, words(step));
        }
        times.push((step.name, start.elapsed()));
    }
    let total: Duration = times.iter().map(|(_, took)| *took).sum();
    for (name, took) in times.into_iter().chain([("all", total)]) {
        say(&format!("{name:<20} {:>7.1} s", took.as_secs_f64()));
    }
    // target/release/xtask; the last test binary leaves the count of the tests that were skipped
    let program = std::env::current_exe()?;
    let target = program.ancestors().nth(2).context("the target folder")?;
    say(&fs::read_to_string(target.join("skipped-tests.txt")).context("count of skipped tests")?);
    Ok(())
}

fn words(step: &Step) -> String {
    step.cargo.join(" ")
}
