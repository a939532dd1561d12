//! The scored hidden-effect cases: `cargo xtask blind`.
//!
//! Two processes that know nothing of each other: this one draws a case, writes the truth's hash
//! down, and opens the truth when `fdi explain` has answered on recordings and nominal model.

mod baseline;
mod bound;
mod case_file;
mod kept;
mod null_check;
mod page;
pub(crate) mod plan;
mod pysindy;
mod run;
mod score;

use std::{
    collections::BTreeSet,
    fs::{self, File, OpenOptions},
    io::Write,
    path::{Path, PathBuf},
    process::Command,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use anyhow::{Context, Result, bail};
use greybox_blind::Class;

use self::{
    case_file::Line,
    page::Origin,
    plan::{Planned, Set},
};
use crate::terminal::say;

/// How the task is called.
const USAGE: &str = "\
cargo xtask blind [--seed dev|score] [--class C] [--cases N] [--resume FILE] [--jobs N]
                  [--fdi PROGRAM] [--keep FOLDER]
  --seed    dev (default): cases to develop on; score: seeds from the git tree of crates/greybox
  --class   null, unusual-null, single, double, outside, fault-only or tied alone
  --cases   so many cases, evenly from all classes, or of the one class
  --resume  results to read and go on with (default of `score`: those of the same explainer,
            of an earlier run or kept beside the page; `dev` begins anew)
  --jobs    cases side by side (default 2)
  --fdi     the program that explains (default: built with --release)
  --keep    write each answered case's recordings, roles and features, and its truth, to FOLDER/CLASS/INDEX";

/// The flags of a call.
struct Options {
    set: Set,
    class: Option<Class>,
    cases: Option<usize>,
    resume: Option<PathBuf>,
    jobs: usize,
    fdi: Option<PathBuf>,
    keep: Option<PathBuf>,
}

impl Options {
    fn parse(arguments: &[&str]) -> Result<Self> {
        let mut options = Self {
            set: Set::Dev,
            class: None,
            cases: None,
            resume: None,
            jobs: 2,
            fdi: None,
            keep: None,
        };
        let mut rest = arguments.iter();
        while let Some(&flag) = rest.next() {
            let value = *rest.next().with_context(|| format!("`{flag}` needs a value\n{USAGE}"))?;
            match flag {
                "--seed" => {
                    let sets = [Set::Dev, Set::Score];
                    let known = sets.into_iter().find(|set| set.name() == value);
                    options.set = known.with_context(|| format!("no set `{value}`\n{USAGE}"))?;
                }
                "--class" => {
                    let class = Class::find(value);
                    options.class =
                        Some(class.with_context(|| format!("no class `{value}`\n{USAGE}"))?);
                }
                "--cases" => options.cases = Some(value.parse().context("--cases")?),
                "--jobs" => options.jobs = value.parse::<usize>().context("--jobs")?.max(1),
                "--resume" => options.resume = Some(value.into()),
                "--fdi" => options.fdi = Some(value.into()),
                "--keep" => options.keep = Some(value.into()),
                _ => bail!("unknown flag `{flag}`\n{USAGE}"),
            }
        }
        Ok(options)
    }
}

/// Draws the blind cases, has them explained, and writes their page.
///
/// # Errors
///
/// When a flag is unknown, a generator check fails, or a file cannot be read or written.
pub fn score_blind_cases(root: &Path, arguments: &[&str]) -> Result<()> {
    let options = Options::parse(arguments)?;
    let checks = null_check::run()?;
    null_check::judge(&checks)?;
    let fdi = match &options.fdi {
        Some(program) => program.canonicalize().context("--fdi")?,
        None => built(root)?,
    };
    let from = plan::root_of(options.set, root)?;
    let results = results_file(root, &options, &from)?;
    let plan = plan::plan(&from, options.class, options.cases);
    let done = read(&results)?;
    let known: BTreeSet<(String, usize)> =
        done.iter().map(|line| (line.class.clone(), line.index)).collect();
    let open: Vec<Planned> = plan
        .iter()
        .filter(|p| !known.contains(&(p.class.name().to_owned(), p.index)))
        .copied()
        .collect();
    say(&format!(
        "{} cases, {} answered, results in {}",
        plan.len(),
        done.len(),
        results.display()
    ));
    let commit = plan::git(root, &["describe", "--always", "--dirty", "--abbrev=7"])?;
    let not_drawn = answer_all(&open, &commit, &results, &fdi, &options)?;
    let lines = read(&results)?;
    let page_file = match options.set {
        Set::Score => root.join("docs/validation/blind.md"),
        Set::Dev => results.with_extension("md"),
    };
    if options.set == Set::Score {
        kept::write(root, &from, &lines)?;
    }
    let origin = Origin {
        set: options.set.name(),
        root: from,
        planned: plan::plan("", None, None).len(),
        not_drawn,
        pysindy: pysindy::kept(root)?,
    };
    let earlier = fs::read_to_string(&page_file).unwrap_or_default();
    fs::write(&page_file, page::page(&lines, &checks, &origin, &earlier))?;
    say(&format!("{}", page_file.display()));
    Ok(())
}

/// The program as it is here, optimised.
pub(crate) fn built(root: &Path) -> Result<PathBuf> {
    let status = Command::new(env!("CARGO"))
        .args(["build", "--release", "--package", "fdi-cli"])
        .current_dir(root)
        .status()
        .context("cargo build")?;
    if !status.success() {
        bail!("cargo build --release --package fdi-cli: {status}");
    }
    // cargo runs in `root`, so that a relative folder is one of `root`
    let target = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    let name = format!("fdi{}", std::env::consts::EXE_SUFFIX);
    Ok(root.join(target).join("release").join(name))
}

/// Where the results go: scored ones by their seeds, and always on from where they were, here or,
/// with the same explainer, beside the page.
fn results_file(root: &Path, options: &Options, from: &str) -> Result<PathBuf> {
    if let Some(file) = &options.resume {
        return Ok(file.clone());
    }
    let folder = root.join("target/blind");
    fs::create_dir_all(&folder)?;
    let tag = &from[..from.len().min(12)];
    let file = folder.join(format!("{}-{tag}.jsonl", options.set.name()));
    if options.set == Set::Dev && file.exists() {
        fs::remove_file(&file)?;
    }
    if options.set == Set::Score
        && !file.exists()
        && let Some(kept) = kept::of(root, from)
    {
        fs::write(&file, kept)?;
    }
    Ok(file)
}

/// Results so far; a last line that was cut off is left out, and the case run again.
fn read(file: &Path) -> Result<Vec<Line>> {
    let Ok(text) = fs::read_to_string(file) else { return Ok(Vec::new()) };
    let mut lines = Vec::new();
    let count = text.lines().count();
    for (n, line) in text.lines().enumerate() {
        match serde_json::from_str::<Line>(line) {
            Ok(line) if line.class.is_empty() => {
                bail!("{} line {}: no case: `class` is missing", file.display(), n + 1)
            }
            Ok(line) => lines.push(line),
            Err(_) if n + 1 == count => {}
            Err(error) => bail!("{} line {}: {error}", file.display(), n + 1),
        }
    }
    Ok(lines)
}

/// Appends a line as a whole; after one that was cut off on a line of its own.
fn append(file: &Mutex<File>, line: &str) -> Result<()> {
    let mut file = file.lock().map_err(|_| anyhow::anyhow!("a worker failed"))?;
    file.write_all(format!("{line}\n").as_bytes())?;
    file.flush()?;
    Ok(())
}

fn opened(file: &Path) -> Result<Mutex<File>> {
    // what was cut off would spoil the next line
    if let Ok(text) = fs::read_to_string(file)
        && !text.is_empty()
        && !text.ends_with('\n')
    {
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        fs::write(file, &text[..whole])?;
    }
    Ok(Mutex::new(OpenOptions::new().create(true).append(true).open(file)?))
}

/// Has the open cases answered side by side; returns how many could not be drawn.
fn answer_all(
    open: &[Planned],
    commit: &str,
    results: &Path,
    fdi: &Path,
    options: &Options,
) -> Result<usize> {
    let (answers, seals) = (opened(results)?, opened(&results.with_extension("seals"))?);
    let (next, not_drawn) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let work = || -> Result<()> {
        while let Some(planned) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
            let name = format!("{} {}", planned.class.name(), planned.index);
            let seal = |hash: &str| append(&seals, &format!("{name} {hash}"));
            let line = match run::explain_case(planned, fdi, options.keep.as_deref(), seal) {
                Ok(line) => Line { commit: commit.to_owned(), ..line },
                Err(error) if error.is::<greybox_blind::BlindError>() => {
                    not_drawn.fetch_add(1, Ordering::Relaxed);
                    say(&format!("{name}: {error}"));
                    continue;
                }
                Err(error) => return Err(error.context(name)),
            };
            let verdict = line.answer.as_ref().map_or("no answer", |a| a.verdict.as_str());
            let said = line.answer.as_ref().map(|a| a.set().join(" ")).unwrap_or_default();
            let truth: Vec<&str> = line.truth.hidden.iter().map(|h| h.id.as_str()).collect();
            let error = line.error.as_deref().unwrap_or_default();
            say(&format!("{name}: {} -> {verdict} {said} {error}", truth.join(" ")));
            append(&answers, &serde_json::to_string(&line)?)?;
        }
        Ok(())
    };
    thread::scope(|scope| {
        let workers: Vec<_> = (0..options.jobs).map(|_| scope.spawn(work)).collect();
        workers
            .into_iter()
            .try_for_each(|worker| worker.join().map_err(|_| anyhow::anyhow!("a worker failed"))?)
    })?;
    Ok(not_drawn.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_are_read_and_slips_named() {
        let options =
            Options::parse(&["--seed", "score", "--class", "tied", "--cases", "3"]).unwrap();
        assert_eq!(
            (options.set, options.class, options.cases),
            (Set::Score, Some(Class::Tied), Some(3))
        );
        let error = Options::parse(&["--sed", "dev"]).err().unwrap().to_string();
        assert!(error.starts_with("unknown flag `--sed`"), "{error}");
        assert!(Options::parse(&["--seed"]).is_err());
    }

    /// A stopped run leaves a line cut off; it is dropped and the rest read.
    #[test]
    fn results_survive_being_stopped() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("r.jsonl");
        let whole = serde_json::to_string(&Line { class: "null".to_owned(), ..Line::default() });
        fs::write(&file, format!("{}\n{{\"class\":\"nu", whole.unwrap())).unwrap();
        assert_eq!(read(&file).unwrap().len(), 1);
        append(&opened(&file).unwrap(), "{\"class\":\"tied\",\"index\":7}").unwrap();
        let lines = read(&file).unwrap();
        assert_eq!((lines.len(), lines[1].index), (2, 7));
        // what stands beside the page begins with what its seeds come from
        fs::write(&file, "{\"tree\":\"0123\"}\n{\"class\":\"tied\",\"index\":7}\n").unwrap();
        let error = read(&file).unwrap_err().to_string();
        assert!(error.ends_with("line 1: no case: `class` is missing"), "{error}");
    }
}
