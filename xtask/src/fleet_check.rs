//! A fleet on Spark, on Sail and in parts: the same bytes as from the command line, with workers
//! and jobs killed meanwhile.

use std::{fs, path::Path, process::Command};

use anyhow::{Context, Result, bail};
use validation::say;

use crate::python::{build, environment, finished, install};

/// Recordings where no other number is asked for.
const RECORDINGS: &str = "20000";
/// Page with what came of it.
const PAGE: &str = "docs/validation/fleet.md";
/// Packages beside the wheel's own for Spark, which needs Java 17.
const OF_SPARK: [&str; 1] = ["maturin"];
/// The wheel's own packages for Spark.
const SPARK: &str = "[spark]";
/// Packages beside Sail, which takes clients below 4.2.
const OF_SAIL: [&str; 3] = ["pysail", "pyspark-client<4.2", "pyarrow"];

/// Runs the check and writes its page.
pub(crate) fn run(root: &Path, recordings: Option<&str>) -> Result<()> {
    let recordings = recordings.unwrap_or(RECORDINGS);
    if !recordings.parse::<u32>().is_ok_and(|count| count >= 200) {
        bail!("`{recordings}` is no number of recordings from 200 on");
    }
    let environments = (environment(root, "spark", &OF_SPARK), environment(root, "sail", &OF_SAIL));
    let (Some(spark), Some(sail)) = environments else {
        bail!("no Python with `venv` and `pip` that reaches the packages");
    };
    let cargo = ["build", "--release", "--package", "fdi-cli"];
    finished(Command::new(env!("CARGO")).args(cargo).current_dir(root))?;
    let wheel = build(root, &spark)?;
    for python in [&spark, &sail] {
        install(python, &wheel)?;
    }
    // as a user installs it, so that a package that the wheel forgets is missed here
    let mut with_spark = wheel.into_os_string();
    with_spark.push(SPARK);
    let words = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
    finished(Command::new(&spark).args(words).arg(with_spark))?;
    let folder = root.join("target").join("fleet-check");
    let mut check = Command::new(&spark);
    check.arg(root.join("crates/fdi-py/fleet_check.py")).args(["--recordings", recordings]);
    check.arg("--program").arg(root.join("target/release/fdi")).arg("--sail").arg(&sail);
    check.arg("--folder").arg(&folder);
    finished(check.current_dir(root).env_remove("PYTHONPATH"))?;
    let made = fs::read_to_string(folder.join("page.md")).context("the page of the check")?;
    fs::write(root.join(PAGE), made)?;
    say(&format!("{PAGE} is written"));
    Ok(())
}
