//! Files of real producers: each gives the answer of its plain twin, or a message with the option
//! that then does.

use std::{fs, path::Path, process::Command};

use anyhow::{Context, Result, bail};
use validation::say;

use crate::python::{environment, finished};

/// Folder of the scripts and of the versions of the producers.
const SCRIPTS: &str = "fixtures/references/files";
/// Page with what came of it.
const PAGE: &str = "docs/validation/files.md";
/// Recordings that all files hold: names, and options of `fdi simulate`.
const TWINS: [(&str, &[&str]); 2] =
    [("healthy", &[]), ("damaged", &["--faults", "k1=0.02,k3=0.02", "--seed", "3"])];

/// Makes the corpus, diagnoses it and writes the page.
pub(crate) fn run(root: &Path) -> Result<()> {
    let scripts = root.join(SCRIPTS);
    let packages = fs::read_to_string(scripts.join("requirements.txt"))?;
    let packages: Vec<&str> = packages.lines().collect();
    let Some(python) = environment(root, "files", &packages) else {
        bail!("no Python with `venv` and `pip` that reaches the packages");
    };
    let cargo = ["build", "--release", "--package", "fdi-cli"];
    finished(Command::new(env!("CARGO")).args(cargo).current_dir(root))?;
    let program = root.join("target/release/fdi");
    let folder = root.join("target").join("files-check");
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    let (twins, files) = (folder.join("twins"), folder.join("files"));
    fs::create_dir_all(&twins)?;
    for (name, options) in TWINS {
        let mut simulate = Command::new(&program);
        simulate.args(["simulate", "--noise-a", "0.02", "--adc-bits", "12"]).args(options);
        finished(simulate.arg("--output").arg(twins.join(format!("{name}.csv"))))?;
    }
    let script = |name: &str| {
        let mut command = Command::new(&python);
        command.args(["-W", "ignore"]).arg(scripts.join(name)).env_remove("PYTHONPATH");
        command
    };
    finished(script("write_files.py").arg(&twins).arg(&files))?;
    let page = folder.join("page.md");
    let checked = finished(script("check_files.py").arg(&program).arg(&files).arg(&page));
    fs::write(root.join(PAGE), fs::read_to_string(&page).context("the page of the check")?)?;
    say(&format!("{PAGE} is written"));
    checked
}
