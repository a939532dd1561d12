//! One case from its seal to its answer.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use anyhow::{Context, Result, bail};
use greybox_blind::{Case, File, Role, sha256_hex};

use super::{
    baseline,
    case_file::{Answer, Line, Truth},
    plan::Planned,
};
use crate::terminal::clock;

/// Draws a case, seals it, has it explained by another process on recordings and nominal model
/// alone, and opens the truth.
pub(crate) fn explain_case(
    planned: &Planned,
    fdi: &Path,
    keep: Option<&Path>,
    seal: impl FnOnce(&str) -> Result<()>,
) -> Result<Line> {
    let case = Case::draw(planned.seed, planned.class)?;
    let sealed = case.seal();
    // the hash is on disk before anybody explains
    seal(&sealed)?;
    let folder = tempfile::tempdir()?;
    let files = case.write(folder.path())?;
    let began = clock();
    let first = explain(fdi, folder.path(), &files, None);
    let mut line = Line {
        class: planned.class.name().to_owned(),
        index: planned.index,
        seal: sealed.clone(),
        ..Line::default()
    };
    match first {
        Ok(answer) => line.answer = Some(answer),
        Err(error) => line.error = Some(format!("{error:#}")),
    }
    if case.truth().tie.is_some() && line.answer.is_some() {
        match propose(fdi, folder.path(), &files, &case) {
            Ok(answer) => line.second = Some(answer),
            Err(error) => line.error = Some(format!("proposal: {error:#}")),
        }
    }
    line.elapsed_s = began.elapsed().as_secs_f64();
    line.baselines = Some(baseline::answers(folder.path(), &files).context("baselines")?);
    let truth = case.truth_json();
    if sha256_hex(truth.as_bytes()) != sealed {
        bail!("the truth of {} {} is not the sealed one", line.class, line.index);
    }
    line.truth = serde_json::from_str::<Truth>(&truth).context("the generator's truth")?;
    if let Some(keep) = keep {
        let kept = keep.join(&line.class).join(line.index.to_string());
        let files = case.write(&kept)?;
        baseline::write(&kept, &files)?;
        fs::write(kept.join("truth.json"), &truth)?;
    }
    Ok(line)
}

fn of_role(files: &[File], role: Role) -> impl Iterator<Item = &str> {
    files.iter().filter(move |file| file.role == role).map(|file| file.name.as_str())
}

/// Numbers without a tolerance are exact in all cases.
const EXACT: [&str; 2] = ["--exact", "all"];

/// Runs `fdi explain` in the folder.
fn explain(fdi: &Path, folder: &Path, files: &[File], more: Option<&str>) -> Result<Answer> {
    let mut command = Command::new(fdi);
    command.args(["explain", "--model", "nominal.toml", EXACT[0], EXACT[1], "--train"]);
    command.args(of_role(files, Role::Train).chain(more));
    command.arg("--holdout").args(of_role(files, Role::HoldOut));
    command.arg("--repeat").args(of_role(files, Role::Repeat));
    let output = asked(command, folder)?;
    serde_json::from_slice(&output.stdout).context("the answer is not an explanation")
}

/// Asks for the recording to take next, takes it, and has all explained again.
fn propose(fdi: &Path, folder: &Path, files: &[File], case: &Case) -> Result<Answer> {
    let mut command = Command::new(fdi);
    command.args(["propose", "--model", "nominal.toml", EXACT[0], EXACT[1], "--train"]);
    command.args(of_role(files, Role::Train));
    command.arg("--holdout").args(of_role(files, Role::HoldOut));
    command.arg("--repeat").args(of_role(files, Role::Repeat));
    command.args(["--output", "next.csv"]);
    asked(command, folder)?;
    let next = fs::read_to_string(folder.join("next.csv")).context("the proposed command")?;
    let recorded = case.record_for(&next)?;
    fs::write(folder.join(&recorded.name), &recorded.text)?;
    explain(fdi, folder, files, Some(&recorded.name))
}

/// Runs a command of `fdi` for its JSON; one job, since cases run side by side.
fn asked(mut command: Command, folder: &Path) -> Result<Output> {
    command.args(["--output-format", "json", "--stable", "--jobs", "1", "-q"]);
    let output =
        command.current_dir(folder).env_clear().output().context("`fdi` does not start")?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        bail!("{}: {}", output.status, said.lines().take(4).collect::<Vec<_>>().join("; "));
    }
    Ok(output)
}
