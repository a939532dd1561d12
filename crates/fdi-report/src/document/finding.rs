//! Findings: directions of damage that a recording shows, or cannot tell from tolerances.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{FaultId, words};

/// Direction of damage, with what the tolerances of the machine leave open of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Finding {
    /// Kind of finding.
    pub kind: FindingKind,
    /// Name of the direction: `imbalance-a`, `play`, `eccentricity`, `torque-constant`.
    pub id: String,
    /// The faults and numbers of the model file that move along it.
    pub members: Vec<String>,
    /// Size, as a level of the faults among its members, free of bounds; of an eccentricity its
    /// amplitude.
    pub value: f64,
    /// Standard deviation of the size: what recording and tolerances leave open together.
    pub std: f64,
    /// 95 % interval of the size.
    pub interval_95: [f64; 2],
    /// True where neither noise nor tolerances explain the size.
    pub detected: bool,
    /// Standard deviation that the tolerances alone leave open, were the recording without noise.
    pub prior_std: f64,
    /// Standard deviation that the recording leaves open, were every number known.
    pub posterior_std: f64,
    /// Measurements that would tell its members apart, where it is ambiguous.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub would_tell: Option<String>,
}

/// Kind of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum FindingKind {
    /// Damage, if it is detected: the recording tells the direction from the tolerances.
    Known,
    /// Damage since the references of the unit, if it is detected.
    Changed,
    /// Damage and tolerances do the same, and the size is within what the tolerances explain.
    Ambiguous,
}

words! {
    FindingKind { Known "known", Changed "changed", Ambiguous "ambiguous" }
}

impl Finding {
    /// Name in words; the id, where it is of a later version.
    pub fn name(&self) -> &str {
        match self.id.as_str() {
            "play" => FaultId::K2.name(),
            "imbalance-a" => "imbalance of phase A",
            "imbalance-b" => "imbalance of phase B",
            "imbalance-c" => "imbalance of phase C",
            "torque-constant" => "torque constant",
            other => other,
        }
    }

    /// The faults among its members.
    pub fn faults(&self) -> impl Iterator<Item = FaultId> + '_ {
        FaultId::ALL.into_iter().filter(|id| self.members.iter().any(|member| member == id.id()))
    }

    /// Name in words with its faults, `torque constant (k3, k4, k5)`.
    pub fn label(&self) -> String {
        let faults: Vec<&str> = self.faults().map(FaultId::id).collect();
        match faults[..] {
            [] => self.name().to_owned(),
            _ => format!("{} ({})", self.name(), faults.join(", ")),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn finding(id: &str, members: &[&str], value: f64, std: f64) -> Finding {
        Finding {
            kind: FindingKind::Known,
            id: id.to_owned(),
            members: members.iter().map(|&member| member.to_owned()).collect(),
            value,
            std,
            interval_95: [value - 2.0 * std, value + 2.0 * std],
            detected: value > 3.0 * std,
            prior_std: 0.8 * std,
            posterior_std: 0.6 * std,
            would_tell: None,
        }
    }

    pub(crate) fn ambiguous(id: &str, members: &[&str], would_tell: &str) -> Finding {
        Finding {
            kind: FindingKind::Ambiguous,
            would_tell: Some(would_tell.to_owned()),
            ..finding(id, members, 0.02, 0.1)
        }
    }

    #[test]
    fn names_are_words_of_the_table_of_levels() {
        let names = [
            ("friction", "friction"),
            ("play", "backlash"),
            ("imbalance-a", "imbalance of phase A"),
            ("imbalance-b", "imbalance of phase B"),
            ("imbalance-c", "imbalance of phase C"),
            ("torque-constant", "torque constant"),
            ("eccentricity", "eccentricity"),
            ("of-a-later-version", "of-a-later-version"),
        ];
        for (id, name) in names {
            assert_eq!(finding(id, &[], 0.0, 0.1).name(), name);
        }
    }

    #[test]
    fn a_label_has_the_faults_and_not_the_numbers_of_the_model_file() {
        let members = ["k3", "k4", "k5", "motor.back-emf-v-s-per-rad"];
        let of = |members: &[&str]| finding("torque-constant", members, 0.0, 0.1).label();
        assert_eq!(of(&members), "torque constant (k3, k4, k5)");
        assert_eq!(of(&members[3..]), "torque constant");
    }
}
