//! Records of cases: truth and answers, one line of JSON each.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The truth, as the generator sealed it.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(default)]
pub(crate) struct Truth {
    pub(crate) class: String,
    pub(crate) machine: String,
    pub(crate) hidden: Vec<Hidden>,
    pub(crate) lambda: f64,
    pub(crate) excess: f64,
    /// By how much what is hidden shifts fault levels that are fitted without it.
    pub(crate) shifts: BTreeMap<String, f64>,
    pub(crate) faults: BTreeMap<String, f64>,
    pub(crate) rough: BTreeMap<String, f64>,
    pub(crate) noise: String,
    pub(crate) noise_a: f64,
    pub(crate) moves: Vec<String>,
    pub(crate) tied_with: Vec<String>,
    pub(crate) tie_lambda: f64,
}

/// One hidden effect.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(default)]
pub(crate) struct Hidden {
    pub(crate) id: String,
    pub(crate) size: f64,
    pub(crate) form: String,
    pub(crate) lambda: f64,
    /// Lambda by slopes over faults and nuisance parameters alone.
    pub(crate) lambda_by_slopes: f64,
    pub(crate) visible: bool,
    pub(crate) own_share: f64,
    pub(crate) severity: f64,
}

/// Answer of `fdi explain`, as far as it is scored.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(default)]
pub(crate) struct Answer {
    pub(crate) verdict: String,
    pub(crate) effects: Vec<Named>,
    pub(crate) alternatives: Vec<Named>,
    /// Identifiers, or objects with one.
    pub(crate) absorbed: Vec<Value>,
    pub(crate) holdout: Option<HoldOut>,
    pub(crate) faults: BTreeMap<String, Fault>,
    /// All else that it says, kept for those who read the results.
    #[serde(flatten)]
    pub(crate) more: serde_json::Map<String, Value>,
}

/// An effect of an answer.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(default)]
pub(crate) struct Named {
    pub(crate) id: String,
    /// Effect that an alternative may stand for; none for a first answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) instead_of: Option<String>,
    /// All else that is said of it.
    #[serde(flatten)]
    pub(crate) more: serde_json::Map<String, Value>,
}

/// The residual on the held-out recording.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(default)]
pub(crate) struct HoldOut {
    pub(crate) rms_before: Option<f64>,
    pub(crate) rms_after: Option<f64>,
    pub(crate) noise_floor: Option<f64>,
    pub(crate) gap_closed_frac: Option<f64>,
}

/// A fault before and after the extension.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(default)]
pub(crate) struct Fault {
    pub(crate) before: Option<f64>,
    pub(crate) after: Option<f64>,
    pub(crate) std_after: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) interval_95_after: Option<[f64; 2]>,
}

/// A case with its answers.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(default)]
pub(crate) struct Line {
    pub(crate) class: String,
    pub(crate) index: usize,
    /// Commit at which it was answered.
    pub(crate) commit: String,
    /// SHA-256 of the truth, written before the answer was asked for.
    pub(crate) seal: String,
    pub(crate) truth: Truth,
    /// None where `explain` gave none.
    pub(crate) answer: Option<Answer>,
    /// Message in place of an answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) error: Option<String>,
    /// Answer with the proposed recording, for tied cases.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) second: Option<Answer>,
    /// Effects that the baselines name on the same files, by rule, the first the best; lines from
    /// before there were baselines have none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) baselines: Option<BTreeMap<String, Vec<String>>>,
    pub(crate) elapsed_s: f64,
}

impl Answer {
    /// True where the answer names a cause.
    pub(crate) fn names(&self) -> bool {
        matches!(self.verdict.as_str(), "named" | "named-with-remainder" | "one-of")
            && !self.effects.is_empty()
    }

    /// The first effect's identifier, of an answer that names one.
    pub(crate) fn first(&self) -> Option<&str> {
        self.names().then(|| self.effects[0].id.as_str())
    }

    /// True for an effect that was found, or an alternative to it.
    pub(crate) fn has_at(&self, place: usize, id: &str) -> bool {
        let Some(found) = self.effects.get(place) else { return false };
        let instead =
            |one: &Named| one.instead_of.as_ref().map_or(place == 0, |of| *of == found.id);
        found.id == id || self.alternatives.iter().any(|one| one.id == id && instead(one))
    }

    /// The answered set.
    pub(crate) fn set(&self) -> Vec<&str> {
        if !self.names() {
            return Vec::new();
        }
        let all = self.effects.iter().chain(&self.alternatives);
        let mut ids: Vec<&str> = all.map(|named| named.id.as_str()).collect();
        ids.sort_unstable();
        ids.dedup();
        ids
    }

    /// Effects that it says the faults absorb.
    pub(crate) fn absorbed_ids<'a>(&'a self) -> Vec<&'a str> {
        let id = |value: &'a Value| value.as_str().or_else(|| value.get("id")?.as_str());
        self.absorbed.iter().filter_map(id).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The generator's truth is read back whole.
    #[test]
    fn the_truth_of_the_generator_is_read() {
        let case = greybox_blind::Case::draw(1, greybox_blind::Class::Single).unwrap();
        let truth: Truth = serde_json::from_str(&case.truth_json()).unwrap();
        assert_eq!(truth.class, "single");
        assert_eq!(truth.machine, "servo");
        assert_eq!(truth.hidden[0].id, case.truth().hidden[0].symbol);
        assert_eq!(truth.hidden[0].lambda, case.truth().hidden[0].lambda);
        assert_eq!(truth.faults["k1"], case.truth().fault("k1").unwrap());
    }

    /// Lines from before there were baselines are read, and stay without.
    #[test]
    fn lines_without_baselines_are_read() {
        let line: Line = serde_json::from_str(r#"{"class":"null","elapsed_s":1.0}"#).unwrap();
        assert!(line.baselines.is_none());
        assert!(!serde_json::to_string(&line).unwrap().contains("baselines"));
        let text = r#"{"class":"null","baselines":{"stlsq":["E02","E01"],"white-f":[]}}"#;
        let line: Line = serde_json::from_str(text).unwrap();
        assert_eq!(line.baselines.unwrap()["stlsq"], ["E02", "E01"]);
    }

    #[test]
    fn the_answer_of_the_interfaces_is_read() {
        let text = r#"{ "schema_version": 1, "verdict": "one-of",
          "effects": [ { "id": "E03", "name": "direction-dependent friction", "port": "motor-torque",
            "parameters": { "viscous_asymmetry_n_m_s_per_rad": { "value": 0.1, "interval_95": [0.08, 0.12] } },
            "p_familywise": 0.001, "holdout_gain_nats": 597.0, "holdout_gain_se": 65.0 } ],
          "alternatives": [ { "id": "E19" } ], "absorbed": ["E14", { "id": "E12" }],
          "holdout": { "rms_before": 0.0907, "rms_after": 0.0291, "noise_floor": 0.0290, "gap_closed_frac": 0.998, "unit": "a" },
          "faults": { "k1": { "before": 0.256, "after": 0.174, "std_after": 0.001 }, "k2": { "before": null, "after": null } },
          "sensitivity": [ { "id": "E11", "smallest_named_90": 0.0006, "unit": "n_m" } ] }"#;
        let answer: Answer = serde_json::from_str(text).unwrap();
        let kept = serde_json::to_value(&answer).unwrap();
        assert_eq!(kept["effects"][0]["holdout_gain_nats"], 597.0);
        assert_eq!(kept["sensitivity"][0]["id"], "E11");
        assert_eq!(answer.first(), Some("E03"));
        assert_eq!(answer.set(), ["E03", "E19"]);
        assert_eq!(answer.absorbed_ids(), ["E14", "E12"]);
        assert_eq!(answer.faults["k1"].after, Some(0.174));
        assert_eq!(answer.faults["k2"].after, None);
    }
}
