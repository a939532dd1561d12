//! Findings that cannot be told from tolerances, over a batch.

use crate::{
    FindingKind, RecordDiagnosis,
    sentence::{sized, to_digits_of},
};

/// Collects what tolerances leave open in the recordings of a batch, for few lines of text: findings
/// that are open in the same recordings share a line.
#[derive(Debug, Default)]
pub struct OpenFindings {
    all: Vec<Open>,
}

/// One finding over the batch.
#[derive(Debug)]
struct Open {
    label: String,
    would_tell: Option<String>,
    /// The recordings in which it is open.
    places: Vec<usize>,
    /// The finding with its size, in the first of them.
    sized: String,
    /// Largest standard deviation.
    std: f64,
}

impl OpenFindings {
    /// Takes in the recording at a place of the batch; nothing, where its levels are not to be
    /// believed.
    pub fn push(&mut self, place: usize, record: &RecordDiagnosis) {
        let findings = record.findings.iter().filter(|one| one.kind == FindingKind::Ambiguous);
        for finding in findings.filter(|_| record.is_believed()) {
            let label = finding.label();
            let is_same =
                |one: &&mut Open| (&one.label, &one.would_tell) == (&label, &finding.would_tell);
            if let Some(one) = self.all.iter_mut().find(is_same) {
                one.places.push(place);
                one.std = one.std.max(finding.std);
            } else {
                self.all.push(Open {
                    label,
                    would_tell: finding.would_tell.clone(),
                    places: vec![place],
                    sized: sized(finding),
                    std: finding.std,
                });
            }
        }
    }

    /// Lines with the places of their recordings. A line of one recording has sizes; a line of
    /// several has the largest standard deviations.
    pub fn lines(&self) -> Vec<(String, &[usize])> {
        let mut groups: Vec<Vec<&Open>> = Vec::new();
        for one in &self.all {
            let shares = |group: &&mut Vec<&Open>| {
                (&group[0].places, &group[0].would_tell) == (&one.places, &one.would_tell)
            };
            match groups.iter_mut().find(shares) {
                Some(group) => group.push(one),
                None => groups.push(vec![one]),
            }
        }
        groups.into_iter().map(|group| (line(&group), &group[0].places[..])).collect()
    }
}

fn line(group: &[&Open]) -> String {
    let alone = group[0].places.len() == 1;
    let told = group.iter().map(|one| {
        let most = || format!("{} ± {}", one.label, to_digits_of(one.std, one.std));
        if alone { one.sized.clone() } else { most() }
    });
    let told = told.collect::<Vec<_>>().join(", ");
    let most = if alone { "" } else { " at most" };
    let remedy = group[0].would_tell.as_ref().map(|would| format!("; {would} would tell"));
    format!("not told from tolerances: {told}{most}{}", remedy.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Verdict,
        document::{
            finding_tests::{ambiguous, finding},
            tests::record,
        },
    };

    fn open() -> RecordDiagnosis {
        let mut record = record();
        let shorts = ["k3", "k4", "k5", "motor.back-emf-v-s-per-rad"];
        record.findings = vec![
            ambiguous("friction", &["k1"], "recordings as new"),
            ambiguous("play", &["k2", "transmission.backlash-rad"], "recordings as new"),
            finding("imbalance-a", &["k3", "as-built.turns"], 0.031, 0.004),
            ambiguous("torque-constant", &shorts, "the voltage"),
        ];
        record
    }

    #[test]
    fn one_recording_has_a_line_for_each_measurement_with_sizes() {
        let mut all = OpenFindings::default();
        all.push(0, &open());
        let lines = [
            "not told from tolerances: friction (k1) 0.020 ± 0.100, backlash (k2) 0.020 ± 0.100; \
             recordings as new would tell",
            "not told from tolerances: torque constant (k3, k4, k5) 0.020 ± 0.100; the voltage \
             would tell",
        ];
        assert_eq!(all.lines(), lines.map(|line| (line.to_owned(), &[0][..])));
    }

    #[test]
    fn findings_that_are_open_in_the_same_recordings_share_a_line() {
        let mut all = OpenFindings::default();
        let (mut wider, mut fewer, mut strange) = (open(), open(), open());
        wider.findings[1].std = 0.2;
        fewer.findings.remove(0);
        strange.verdict = Verdict::ModelInadequate;
        for (place, record) in [open(), wider, record(), fewer, strange].iter().enumerate() {
            all.push(place, record);
        }
        let told = all.lines();
        let lines: Vec<(&str, &[usize])> =
            told.iter().map(|(line, places)| (line.as_str(), *places)).collect();
        let want: [(&str, &[usize]); 3] = [
            (
                "not told from tolerances: friction (k1) ± 0.100 at most; recordings as new would \
                 tell",
                &[0, 1],
            ),
            (
                "not told from tolerances: backlash (k2) ± 0.200 at most; recordings as new would \
                 tell",
                &[0, 1, 3],
            ),
            (
                "not told from tolerances: torque constant (k3, k4, k5) ± 0.100 at most; the \
                 voltage would tell",
                &[0, 1, 3],
            ),
        ];
        assert_eq!(lines, want);
    }
}
