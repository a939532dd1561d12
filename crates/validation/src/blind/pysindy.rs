//! Answers of `PySINDy`, kept by the script in `fixtures/references/pysindy`.

use std::{collections::BTreeMap, fs, path::Path};

use anyhow::{Context, Result};
use serde::Deserialize;

use super::case_file::Line;

/// Where the script and its answers are.
const FOLDER: &str = "fixtures/references/pysindy";

/// Answers on a set of cases.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Kept {
    /// Version of `PySINDy`.
    pub(crate) version: String,
    /// The set that the cases are of.
    pub(crate) set: String,
    /// Variants with their titles.
    pub(crate) variants: BTreeMap<String, String>,
    /// Class, truth and names by variant, as in a line of results.
    pub(crate) lines: Vec<Line>,
}

/// Reads what was kept, by file name.
pub(crate) fn kept(root: &Path) -> Result<Vec<Kept>> {
    let Ok(folder) = fs::read_dir(root.join(FOLDER)) else { return Ok(Vec::new()) };
    let mut files = Vec::new();
    for entry in folder {
        let file = entry?.path();
        if file.extension().is_some_and(|end| end == "json") {
            files.push(file);
        }
    }
    files.sort();
    let read = |file: &std::path::PathBuf| {
        let text = fs::read_to_string(file)?;
        serde_json::from_str(&text).with_context(|| file.display().to_string())
    };
    files.iter().map(read).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The answers in the repository are of as many cases as their name says, and each line has
    /// its variants and a truth of its class.
    #[test]
    fn kept_answers_are_read() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let kept = kept(&root).unwrap();
        assert_eq!((kept[0].version.as_str(), kept[0].set.as_str()), ("2.1.0", "score"));
        assert_eq!((kept[0].variants.len(), kept[0].lines.len()), (2, 1900));
        for (kept, line) in kept.iter().flat_map(|k| k.lines.iter().map(move |line| (k, line))) {
            let names = line.baselines.as_ref().unwrap();
            assert!(kept.variants.keys().all(|variant| names.contains_key(variant)));
            let class = greybox_blind::Class::find(&line.class).unwrap();
            assert_eq!(line.truth.hidden.is_empty(), !class.hides());
        }
    }
}
