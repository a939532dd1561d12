//! Answers of three plain rules on the same files: a test of each feature alone for white noise,
//! thresholded least squares, and the least held-out rms.
//!
//! Each regresses the torque residual of the nominal machine, from measured current, position and
//! known load, on expert features of the catalogue's effects, with nuisance parameters and faults
//! free.

mod design;
mod feature;
mod gram;
mod nominal;
mod recorded;
mod select;
mod signals;
mod smooth;
mod table;

use std::{collections::BTreeMap, fs, path::Path};

use anyhow::Result;
use greybox_blind::File;

/// The rules by name, and what the page calls them.
pub(crate) const RULES: [(&str, &str); 3] = [
    ("white-f", "F test for white noise, Bonferroni 1 %"),
    ("stlsq", "thresholded least squares, threshold by hold-out"),
    ("best-rms", "least held-out rms, always named"),
];

/// Effects named by each rule from the files in a folder, the first the best.
pub(crate) fn answers(folder: &Path, files: &[File]) -> Result<BTreeMap<String, Vec<String>>> {
    let problem = select::Problem::of(&design::Design::read(folder, files)?);
    let [(f, _), (stlsq, _), (rms, _)] = RULES;
    Ok([(f, problem.white_f()), (stlsq, problem.thresholded()), (rms, problem.best_rms())]
        .into_iter()
        .map(|(rule, names)| (rule.to_owned(), names.into_iter().map(str::to_owned).collect()))
        .collect())
}

/// Writes the regression of a case for other programs: `features.csv` with a role, the residual
/// and all columns, and `features.json` that says which column belongs to what.
pub(crate) fn write(folder: &Path, files: &[File]) -> Result<()> {
    let (table, key) = table::of(&design::Design::read(folder, files)?);
    fs::write(folder.join("features.csv"), table)?;
    fs::write(folder.join("features.json"), serde_json::to_string(&key)?)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use greybox_blind::{Case, Class};

    use super::*;

    fn case(seed: u64, class: Class) -> (tempfile::TempDir, BTreeMap<String, Vec<String>>) {
        let folder = tempfile::tempdir().unwrap();
        let files = Case::draw(seed, class).unwrap().write(folder.path()).unwrap();
        let said = answers(folder.path(), &files).unwrap();
        write(folder.path(), &files).unwrap();
        (folder, said)
    }

    /// At twenty times the visible energy no rule misses them, and no test finds them where they
    /// are not.
    #[test]
    fn strong_effects_are_named_by_each_rule() {
        for (seed, name) in SEEDS {
            let truth = Case::draw(seed, Class::Single).unwrap();
            assert_eq!(truth.truth().hidden[0].symbol, name);
            assert!(truth.truth().hidden[0].lambda > 600.0, "{}", truth.truth().hidden[0].lambda);
            let (_folder, said) = case(seed, Class::Single);
            assert!(RULES.iter().all(|(rule, _)| said[*rule][0] == name), "{said:?}");
            let (_folder, said) = case(seed, Class::Null);
            assert!(said["white-f"].is_empty() && said["stlsq"].is_empty(), "{said:?}");
            assert_eq!(said["best-rms"].len(), 1);
        }
    }

    /// Development cases 57 and 56 of the singles: cogging of the servo, ripple of the actuator.
    const SEEDS: [(u64, &str); 2] =
        [(0xb1b0_5f1b_b497_0039, "E11"), (0xb1b0_5f1b_b497_0038, "E12")];

    #[test]
    fn answers_are_the_same_again_and_the_table_is_whole() {
        let ((one, first), (other, second)) = (case(21, Class::Null), case(21, Class::Null));
        assert_eq!(first, second);
        let text = |folder: &tempfile::TempDir| {
            fs::read_to_string(folder.path().join("features.csv")).unwrap()
        };
        assert_eq!(text(&one), text(&other));
        let table = text(&one);
        let columns = table.lines().next().unwrap().split(',').count();
        assert!(columns > 60 && table.lines().all(|line| line.split(',').count() == columns));
        let roles = |role: &str| table.lines().filter(|line| line.starts_with(role)).count();
        assert!(roles("train,") > roles("holdout,") && roles("holdout,") > 300);
    }
}
