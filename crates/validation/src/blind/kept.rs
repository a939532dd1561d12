//! The cases behind the page: what is scored of each, kept beside it. Who has the same explainer
//! goes on where they end.

use std::{fs, path::Path};

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::case_file::{Answer, Line};

/// Where they are.
pub(crate) const FILE: &str = "docs/validation/blind-cases.jsonl";
/// Digits that are kept.
const DIGITS: usize = 6;

/// The first line.
#[derive(Deserialize, Serialize)]
struct Header {
    /// Source of the seeds: the git tree of the explainer.
    tree: String,
}

/// Writes what is scored of the lines.
pub(crate) fn write(root: &Path, tree: &str, lines: &[Line]) -> Result<()> {
    let mut text = serde_json::to_string(&Header { tree: tree.to_owned() })? + "\n";
    let mut sorted: Vec<&Line> = lines.iter().collect();
    sorted.sort_by_key(|line| (&line.class, line.index));
    for line in sorted {
        text.push_str(&scored(line)?.to_string());
        text.push('\n');
    }
    fs::write(root.join(FILE), text).with_context(|| FILE.to_owned())
}

/// The lines of an explainer as text; none where those kept are of another.
pub(crate) fn of(root: &Path, tree: &str) -> Option<String> {
    let text = fs::read_to_string(root.join(FILE)).ok()?;
    let (header, lines) = text.split_once('\n')?;
    let Header { tree: theirs } = serde_json::from_str(header).ok()?;
    (theirs == tree).then(|| lines.to_owned())
}

/// A line with what is scored alone.
fn scored(line: &Line) -> Result<Value> {
    let mut line = line.clone();
    line.truth.rough.clear();
    line.truth.moves.clear();
    // fault levels are scored of singles alone
    let has_levels = line.class == "single";
    if !has_levels {
        line.truth.faults.clear();
        line.truth.shifts.clear();
    }
    for answer in line.answer.iter_mut().chain(&mut line.second) {
        only_names(answer);
        if !has_levels {
            answer.faults.clear();
        }
    }
    let baselines = serde_json::to_value(&line.baselines)?;
    let mut value = brief(serde_json::to_value(&line)?);
    // a rule that names nothing is not one that was not asked
    if let Value::Object(fields) = &mut value
        && !baselines.is_null()
    {
        fields.insert("baselines".to_owned(), baselines);
    }
    Ok(value)
}

fn only_names(answer: &mut Answer) {
    answer.more.clear();
    answer.holdout = None;
    for named in answer.effects.iter_mut().chain(&mut answer.alternatives) {
        named.more.clear();
    }
    answer.absorbed =
        answer.absorbed_ids().into_iter().map(|id| Value::String(id.to_owned())).collect();
}

/// Without what reads back as nothing, and with fewer digits.
fn brief(value: Value) -> Value {
    match value {
        Value::Object(fields) => {
            let fields = fields.into_iter().map(|(key, value)| (key, brief(value)));
            Value::Object(fields.filter(|(_, value)| !is_nothing(value)).collect())
        }
        Value::Array(values) => Value::Array(values.into_iter().map(brief).collect()),
        Value::Number(number) if number.is_f64() => {
            let rounded = number.as_f64().map(|x| format!("{x:.*e}", DIGITS - 1));
            rounded.and_then(|text| text.parse::<f64>().ok()).map_or(Value::Null, Value::from)
        }
        other => other,
    }
}

fn is_nothing(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Bool(yes) => !yes,
        Value::String(text) => text.is_empty(),
        Value::Array(values) => values.is_empty(),
        Value::Object(fields) => fields.is_empty(),
        Value::Number(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blind::score::bars;

    fn lines() -> Vec<Line> {
        let single = r#"{"class":"single","index":3,"seal":"ab","elapsed_s":1.23456789,
          "truth":{"class":"single","hidden":[{"id":"E03","lambda":44.0,"visible":true}],
            "shifts":{"k1":0.01},"faults":{"k1":0.2},"rough":{"motor.inertia":0.1},"moves":["ramps"]},
          "answer":{"verdict":"one-of","effects":[{"id":"E03","evidence_nats":4.0}],
            "alternatives":[{"id":"E19","instead_of":"E03"}],"absorbed":[{"id":"E12"}],
            "faults":{"k1":{"before":0.0,"after":0.1999,"std_after":0.0012345678,
              "interval_95_after":[0.0,0.21]}},"curves":[1,2,3]},
          "baselines":{"stlsq":[],"white-f":["E03"]}}"#;
        let tied = r#"{"class":"tied","index":0,"truth":{"hidden":[{"id":"E11"}],
          "tied_with":["E12"],"faults":{"k1":0.1}},
          "answer":{"verdict":"absorbed","absorbed":["E11","E12"]},
          "second":{"verdict":"named","effects":[{"id":"E11"}]}}"#;
        [tied, single].map(|text| serde_json::from_str(text).unwrap()).to_vec()
    }

    /// What is kept scores as what it is of, and is of its own explainer only.
    #[test]
    fn what_is_kept_scores_the_same() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir_all(folder.path().join("docs/validation")).unwrap();
        let lines = lines();
        write(folder.path(), "0123", &lines).unwrap();
        assert!(of(folder.path(), "4567").is_none());
        let text = of(folder.path(), "0123").unwrap();
        assert!(!text.contains("curves") && !text.contains("rough"), "{text}");
        let read: Vec<Line> =
            text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        assert_eq!((read[0].class.as_str(), read[0].index), ("single", 3));
        assert_eq!(read[0].baselines, lines[1].baselines);
        assert_eq!(read[0].seal, "ab");
        assert_eq!(format!("{:?}", bars(&read)), format!("{:?}", bars(&lines)));
        assert!(read[1].truth.faults.is_empty() && read[0].truth.faults["k1"] == 0.2);
    }
}
