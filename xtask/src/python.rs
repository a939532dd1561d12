//! The wheel: built, installed into an environment of its own, and tested there.

use std::{
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, bail};
use validation::say;

/// Folder of the wheel's crate, a workspace of its own.
const CRATE: &str = "crates/fdi-py";
/// Largest wheel that is given out, bytes: a download that nobody thinks about.
const MOST_BYTES: u64 = 15_000_000;
/// Libraries whose tables go in and out, one that runs FMUs, and what checks the types and runs the tests.
const TO_TEST: [&str; 9] =
    ["maturin", "numpy", "pandas", "polars", "pyarrow", "duckdb", "fmpy", "mypy", "pytest"];

/// Builds and tests the wheel; says so where there is no Python for it.
pub(crate) fn run(root: &Path) -> Result<()> {
    let Some(python) = environment(root, "python", &TO_TEST) else {
        say("skipped: no Python with `venv` and `pip` that reaches the packages, so no wheel");
        return Ok(());
    };
    let manifest = root.join(CRATE).join("Cargo.toml");
    let cargo = |words: &[&str]| {
        let (first, rest) = words.split_first().context("a command of cargo")?;
        let mut command = Command::new(env!("CARGO"));
        command.arg(first).arg("--manifest-path").arg(&manifest).args(rest);
        finished(command.env("CARGO_TARGET_DIR", root.join("target")))
    };
    cargo(&["fmt", "--check"])?;
    cargo(&["clippy", "--quiet", "--locked", "--all-targets", "--", "-D", "warnings"])?;
    let wheel = build(root, &python)?;
    install(&python, &wheel)?;
    let package = root.join(CRATE).join("python/fdi");
    let run = |words: &[&OsStr]| finished(beside(root, &python).args(words));
    run(&[
        "-m".as_ref(),
        "mypy".as_ref(),
        "--strict".as_ref(),
        "--config-file".as_ref(),
        root.join(CRATE).join("pyproject.toml").as_ref(),
        package.as_ref(),
    ])?;
    run(&["-m", "mypy.stubtest", "fdi._fdi"].map(OsStr::new))?;
    // tests of engines say that they are skipped where none is installed
    let tests = root.join(CRATE).join("tests");
    run(&["-m".as_ref(), "pytest".as_ref(), "-q".as_ref(), "-rs".as_ref(), tests.as_ref()])
}

/// The Python of an environment with these packages; `None` where none can be made.
pub(crate) fn environment(root: &Path, name: &str, packages: &[&str]) -> Option<PathBuf> {
    let folder = root.join("target").join(format!("venv-{name}"));
    let python = folder.join("bin").join("python");
    let made = |command: &mut Command| command.status().is_ok_and(|status| status.success());
    if !python.exists() && !made(Command::new("python3").args(["-m", "venv"]).arg(&folder)) {
        return None;
    }
    let mut pip = Command::new(&python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).args(packages);
    made(&mut pip).then_some(python)
}

/// Builds the wheel in the folder of the workspace's own build, so that what both need is compiled
/// once where it has the same features.
pub(crate) fn build(root: &Path, python: &Path) -> Result<PathBuf> {
    let out = root.join("target").join("wheels");
    if out.exists() {
        fs::remove_dir_all(&out)?;
    }
    let mut maturin = Command::new(python);
    maturin.args(["-m", "maturin", "build", "--release", "--locked", "--out"]).arg(&out);
    let maturin = maturin.current_dir(root.join(CRATE));
    finished(maturin.env("CARGO_TARGET_DIR", root.join("target")))?;
    let mut wheels = fs::read_dir(&out)?.collect::<Result<Vec<_>, _>>()?;
    let wheel = wheels.pop().context("maturin made no wheel")?.path();
    let bytes = fs::metadata(&wheel)?.len();
    say(&format!("wheel: {bytes} bytes, at most {MOST_BYTES}"));
    if bytes > MOST_BYTES {
        bail!("the wheel has {bytes} bytes, more than {MOST_BYTES}");
    }
    Ok(wheel)
}

/// Installs the wheel in the place of an older one.
pub(crate) fn install(python: &Path, wheel: &Path) -> Result<()> {
    let words = ["-m", "pip", "install", "--quiet", "--force-reinstall", "--no-deps"];
    finished(Command::new(python).args(words).arg(wheel))
}

/// A Python that sees the wheel alone, and the program to compare it with.
pub(crate) fn beside(root: &Path, python: &Path) -> Command {
    let mut command = Command::new(python);
    // from the sources the wheel would be hidden by its own folder
    command.current_dir(root).env_remove("PYTHONPATH");
    command.env("FREEDOM_PROGRAM", root.join("target/release/fdi"));
    command
}

/// Runs a command to its end.
pub(crate) fn finished(command: &mut Command) -> Result<()> {
    let status = command.status().with_context(|| format!("{command:?}"))?;
    if !status.success() {
        bail!("{command:?}: {status}");
    }
    Ok(())
}
