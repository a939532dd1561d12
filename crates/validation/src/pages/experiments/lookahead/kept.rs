//! The searches behind the section, kept beside the page: who has them goes on where they end.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{self, OpenOptions},
    io::Write as _,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, ensure};
use experiments::{SearchPoint, SearchesOfSeed, SeededSearch};
use serde::{Deserialize, Serialize};

use super::case::{COMPARED, Case};

/// Where they are.
const FILE: &str = "docs/validation/lookahead.jsonl";
/// Digits that are kept.
const DIGITS: usize = 5;

/// The first line: what all searches depend on.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub(super) struct Header {
    /// Root seed.
    pub(super) seed: u64,
    /// Conditions of the design.
    pub(super) conditions: usize,
    /// Pairs that are made of each case of the comparison, in its order. High fidelity takes ten
    /// times as long as the others, so that a file may hold fewer than all.
    pub(super) pairs: [usize; COMPARED.len()],
}

impl Header {
    fn is_like(&self, other: &Self) -> bool {
        (self.seed, self.conditions) == (other.seed, other.conditions)
    }
}

/// A search that has ended.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub(super) struct Line {
    pub(super) problem: String,
    pub(super) view: String,
    pub(super) method: String,
    /// Index of the condition in the design.
    pub(super) seed: usize,
    /// Levels that were found.
    pub(super) levels: Vec<f64>,
    /// Errors of the levels, %.
    pub(super) errors: Vec<f64>,
    /// Evaluations, discrepancy in A and mean error in % on the way; the last is the end.
    pub(super) points: Vec<[f64; 3]>,
}

impl Line {
    fn of(case: &Case, index: usize, search: &SeededSearch) -> Self {
        Self {
            problem: case.problem.name().to_owned(),
            view: case.view.name().to_owned(),
            method: search.contender.name().to_owned(),
            seed: index,
            levels: search.levels.iter().copied().map(brief).collect(),
            errors: search.errors_percent.iter().copied().map(brief).collect(),
            points: search.points.iter().map(numbers).collect(),
        }
    }

    /// Mean error at the end, %.
    pub(super) fn error(&self) -> f64 {
        self.end()[2]
    }

    /// Least discrepancy, A.
    pub(super) fn discrepancy(&self) -> f64 {
        self.end()[1]
    }

    pub(super) fn end(&self) -> [f64; 3] {
        self.points.last().copied().unwrap_or([f64::NAN; 3])
    }

    /// The search after some evaluations, which must be one of its marks or its end.
    pub(super) fn after(&self, evaluations: usize) -> Option<[f64; 3]> {
        self.points.iter().find(|point| point[0] == evaluations as f64).copied()
    }

    fn key(&self) -> (String, String, usize, String) {
        (self.problem.clone(), self.view.clone(), self.seed, self.method.clone())
    }
}

fn numbers(point: &SearchPoint) -> [f64; 3] {
    [point.evaluations as f64, brief(point.discrepancy_a), brief(point.error_percent)]
}

/// A number with fewer digits.
pub(super) fn brief(value: f64) -> f64 {
    format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value)
}

/// All that is kept.
#[derive(Debug)]
pub(super) struct Kept {
    path: PathBuf,
    header: Header,
    lines: Vec<Line>,
    /// True where the file ends within a line.
    is_cut: bool,
}

impl Kept {
    /// Reads what there is.
    ///
    /// # Errors
    ///
    /// When the file is of other settings, has a search twice or cannot be read.
    pub(super) fn read(root: &Path, mut header: Header) -> Result<Self> {
        let path = root.join(FILE);
        let mut lines = Vec::new();
        let mut is_cut = false;
        if path.exists() {
            let text = fs::read_to_string(&path)?;
            is_cut = !text.ends_with('\n');
            let mut rows = text.lines();
            let found: Header = serde_json::from_str(rows.next().unwrap_or_default())
                .with_context(|| format!("first line of {FILE}"))?;
            ensure!(found.is_like(&header), "{FILE} is of {found:?}; remove it to search anew");
            header = found;
            // a run that was ended in the middle of a line leaves a part of it
            lines.extend(rows.filter_map(|row| serde_json::from_str::<Line>(row).ok()));
            let mut known = BTreeSet::new();
            for line in &lines {
                ensure!(known.insert(line.key()), "{FILE} has {:?} twice", line.key());
            }
        }
        Ok(Self { path, header, lines, is_cut })
    }

    /// The conditions of a case that lack a search.
    pub(super) fn missing(&self, case: &Case) -> Vec<usize> {
        let same = |other: &Case| (other.problem, other.view) == (case.problem, case.view);
        let compared = COMPARED.iter().position(|other| same(other) && other.seeds == case.seeds);
        let seeds = compared.map_or(case.seeds, |place| case.seeds.min(self.header.pairs[place]));
        let has = |seed: usize, method: &str| self.of(case, method).any(|line| line.seed == seed);
        let all = |seed: &usize| case.contenders.iter().all(|c| has(*seed, c.name()));
        (0..seeds).filter(|seed| !all(seed)).collect()
    }

    /// The searches of a method in a case.
    pub(super) fn of<'a>(
        &'a self,
        case: &'a Case,
        method: &'a str,
    ) -> impl Iterator<Item = &'a Line> {
        self.lines.iter().filter(move |line| {
            line.problem == case.problem.name()
                && line.view == case.view.name()
                && line.method == method
                && line.seed < case.seeds
        })
    }

    /// Searches of two methods at the same seeds, in their order.
    pub(super) fn pairs<'a>(
        &'a self,
        case: &'a Case,
        methods: [&'a str; 2],
    ) -> Vec<(&'a Line, &'a Line)> {
        let [first, second] = methods.map(|method| -> BTreeMap<usize, &'a Line> {
            self.of(case, method).map(|line| (line.seed, line)).collect()
        });
        first.iter().filter_map(|(seed, line)| Some((*line, *second.get(seed)?))).collect()
    }

    /// Adds searches, at once on disk.
    pub(super) fn add(&mut self, case: &Case, found: &[SearchesOfSeed]) -> Result<()> {
        let is_new = !self.path.exists();
        let mut file = OpenOptions::new().create(true).append(true).open(&self.path)?;
        let mut text = String::new();
        if is_new {
            text = serde_json::to_string(&self.header)? + "\n";
        }
        if std::mem::take(&mut self.is_cut) {
            text.push('\n');
        }
        for of_seed in found {
            for search in &of_seed.searches {
                let line = Line::of(case, of_seed.index, search);
                if self.lines.iter().any(|known| known.key() == line.key()) {
                    continue;
                }
                text += &(serde_json::to_string(&line)? + "\n");
                self.lines.push(line);
            }
        }
        file.write_all(text.as_bytes())?;
        Ok(())
    }

    /// Writes all in one order, whatever the order that they were made in.
    pub(super) fn sort(&mut self) -> Result<()> {
        self.lines.sort_by_key(Line::key);
        let mut text = serde_json::to_string(&self.header)? + "\n";
        for line in &self.lines {
            text += &(serde_json::to_string(line)? + "\n");
        }
        fs::write(&self.path, text).with_context(|| FILE.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use experiments::Protocol;

    use super::{
        super::case::{PAIR, View},
        *,
    };

    const CASE: Case =
        Case { problem: Protocol::Low, view: View::Cubic, contenders: &PAIR, seeds: 3 };
    const HEADER: Header = Header { seed: 1, conditions: 3, pairs: [3; COMPARED.len()] };

    fn of_seed(index: usize) -> SearchesOfSeed {
        let point = SearchPoint {
            evaluations: 20,
            time_s: 0.0,
            discrepancy_a: 0.123_456_789,
            error_percent: 90.0 + index as f64,
        };
        let search = |contender| SeededSearch {
            contender,
            levels: vec![0.01],
            errors_percent: vec![50.0],
            points: vec![point],
        };
        SearchesOfSeed { index, truth: vec![0.02], searches: PAIR.map(search).to_vec() }
    }

    /// A folder in which nothing is kept.
    fn empty() -> (tempfile::TempDir, Kept) {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir_all(folder.path().join("docs/validation")).unwrap();
        let kept = Kept::read(folder.path(), HEADER).unwrap();
        (folder, kept)
    }

    #[test]
    fn searches_are_kept_at_once_and_paired_by_seed() {
        let (folder, mut kept) = empty();
        assert_eq!(kept.missing(&CASE), [0, 1, 2]);
        kept.add(&CASE, &[of_seed(2)]).unwrap();
        kept.add(&CASE, &[of_seed(0), of_seed(2)]).unwrap();
        let mut kept = Kept::read(folder.path(), HEADER).unwrap();
        assert_eq!(kept.missing(&CASE), [1]);
        let pairs = kept.pairs(&CASE, PAIR.map(experiments::Contender::name));
        let seeds: Vec<usize> = pairs.iter().map(|(ei, _)| ei.seed).collect();
        assert_eq!(seeds, [0, 2]);
        assert_eq!((pairs[1].0.error(), pairs[1].0.discrepancy()), (92.0, 0.12346));
        kept.sort().unwrap();
        let again = Kept::read(folder.path(), HEADER).unwrap();
        assert_eq!(again.lines, kept.lines);
        assert!(Kept::read(folder.path(), Header { seed: 2, ..HEADER }).is_err());
    }

    #[test]
    fn a_search_that_is_there_twice_is_refused() {
        let (folder, mut kept) = empty();
        kept.add(&CASE, &[of_seed(1)]).unwrap();
        let path = folder.path().join(FILE);
        let text = fs::read_to_string(&path).unwrap();
        let first = text.lines().nth(1).unwrap();
        fs::write(&path, format!("{text}{first}\n")).unwrap();
        let refused = Kept::read(folder.path(), HEADER).unwrap_err().to_string();
        assert!(refused.contains("twice"), "{refused}");
    }

    /// A run that was ended leaves a part of a line, which is searched anew.
    #[test]
    fn a_line_that_was_cut_off_counts_as_missing() {
        let (folder, mut kept) = empty();
        kept.add(&CASE, &[of_seed(0)]).unwrap();
        let path = folder.path().join(FILE);
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, &text[..text.len() - 20]).unwrap();
        let mut kept = Kept::read(folder.path(), HEADER).unwrap();
        assert_eq!(kept.missing(&CASE), [0, 1, 2]);
        kept.add(&CASE, &[of_seed(0)]).unwrap();
        assert_eq!(Kept::read(folder.path(), HEADER).unwrap().missing(&CASE), [1, 2]);
    }
}
