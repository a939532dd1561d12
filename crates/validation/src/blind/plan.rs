//! Which cases there are, and their seeds.

use std::{path::Path, process::Command};

use anyhow::{Context, Result, bail};
use greybox_blind::{Class, sha256_hex};

/// Seeds that may be looked at while the explainer is made, and seeds that it is scored on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Set {
    Dev,
    Score,
}

impl Set {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Dev => "dev",
            Self::Score => "score",
        }
    }
}

/// Cases of each class in the scored set.
pub(crate) const SIZES: [(Class, usize); 7] = [
    (Class::Null, 400),
    (Class::UnusualNull, 200),
    (Class::Single, 400),
    (Class::Double, 200),
    (Class::Outside, 200),
    (Class::FaultOnly, 300),
    (Class::Tied, 200),
];

/// The crate whose tree the scoring seeds come from.
const EXPLAINER: &str = "crates/greybox";

/// A case to be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Planned {
    pub(crate) class: Class,
    pub(crate) index: usize,
    pub(crate) seed: u64,
}

/// The cases of a run, those of the classes mixed evenly, so that a part of a run is a fair one.
pub(crate) fn plan(root: &str, only: Option<Class>, cases: Option<usize>) -> Vec<Planned> {
    let sizes = SIZES.into_iter().filter(|(class, _)| only.is_none_or(|only| only == *class));
    let sizes: Vec<(Class, usize)> = sizes
        .map(|(class, size)| (class, if only.is_some() { cases.unwrap_or(size) } else { size }))
        .collect();
    let mut all: Vec<(f64, Planned)> = Vec::new();
    for (class, size) in sizes {
        for index in 0..size {
            let at = (index as f64 + 0.5) / size as f64;
            all.push((at, Planned { class, index, seed: seed(root, class, index) }));
        }
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let most = if only.is_some() { all.len() } else { cases.unwrap_or(all.len()) };
    all.into_iter().take(most).map(|(_, planned)| planned).collect()
}

/// The seed of a case: its index in the low 16 bits, which choose machine and effect by turns,
/// and above them digits of a hash that does not depend on the explainer's answers.
fn seed(root: &str, class: Class, index: usize) -> u64 {
    let hash = sha256_hex(format!("{root} {} {}", class.name(), index >> 16).as_bytes());
    let high = u64::from_str_radix(&hash[..12], 16).unwrap_or(0);
    high << 16 | (index as u64 & 0xffff)
}

/// Source of the seeds of a set; for the scored one the git tree of the explainer.
pub(crate) fn root_of(set: Set, root: &Path) -> Result<String> {
    match set {
        Set::Dev => Ok("development".to_owned()),
        Set::Score => {
            let changed = git(root, &["status", "--porcelain", "--", EXPLAINER])?;
            if !changed.is_empty() {
                bail!("`{EXPLAINER}` is not as committed; the scoring seeds come from its tree");
            }
            git(root, &["rev-parse", &format!("HEAD:{EXPLAINER}")])
        }
    }
}

/// The first line of what git says.
pub(crate) fn git(root: &Path, arguments: &[&str]) -> Result<String> {
    let output = Command::new("git").args(arguments).current_dir(root).output().context("git")?;
    if !output.status.success() {
        bail!("git {}: {}", arguments.join(" "), String::from_utf8_lossy(&output.stderr).trim());
    }
    let text = String::from_utf8(output.stdout)?;
    Ok(text.lines().next().unwrap_or_default().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_differ_between_sets_and_run_within_a_class() {
        let (dev, score) = (plan("development", None, None), plan("0123abcd", None, None));
        assert_eq!(dev.len(), 1900);
        let seeds = |plan: &[Planned]| -> Vec<u64> {
            let mut seeds: Vec<u64> = plan.iter().map(|p| p.seed).collect();
            seeds.sort_unstable();
            seeds.dedup();
            seeds
        };
        let (a, b) = (seeds(&dev), seeds(&score));
        assert_eq!((a.len(), b.len()), (1900, 1900));
        assert!(a.iter().all(|seed| b.binary_search(seed).is_err()));
        assert!(dev.iter().all(|p| (p.seed & 0xffff) as usize == p.index));
    }

    #[test]
    fn a_part_of_a_run_has_all_classes() {
        let part = plan("development", None, Some(38));
        let count = |class| part.iter().filter(|p| p.class == class).count();
        assert_eq!(part.len(), 38);
        assert!(Class::ALL.into_iter().all(|class| count(class) >= 3), "{part:?}");
        let one = plan("development", Some(Class::Tied), Some(5));
        assert!(one.len() == 5 && one.iter().all(|p| p.class == Class::Tied));
    }
}
