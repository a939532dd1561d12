//! Answers to recordings, as JSON.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    Action, Covariance, Fault, FaultId, Finding, Identifiability, Notice, NoticeCode,
    PooledRecording, words,
};

/// The answer to a batch of recordings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Diagnosis {
    /// Version of this form.
    pub schema_version: u32,
    /// Name and version of the program, `fdi 0.1.0`.
    pub tool: String,
    /// SHA-256 of the bundle, hexadecimal.
    pub bundle: String,
    /// Seed of the run.
    pub seed: u64,
    /// When it was made, RFC 3339; only with `--stamp`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stamp: Option<String>,
    /// Which part of a batch it is; only with `--shard`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<BatchShard>,
    /// Settings that change an answer, as in a file of `--resume`; only with `--shard`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub answers_depend_on: BTreeMap<String, Option<String>>,
    /// One entry for each recording that could be diagnosed, in the order of the input.
    pub records: Vec<RecordDiagnosis>,
    /// One entry for each that could not.
    pub failed: Vec<Failure>,
    /// Place of each entry of `failed` among all recordings of the part, from 0; only with `--shard`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub failed_at: Vec<u64>,
}

/// A part of a batch: every `of`-th recording, beginning with the `index`-th.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct BatchShard {
    /// Number of the part, from 1.
    pub index: u64,
    /// Number of parts.
    pub of: u64,
    /// Recordings of the whole batch.
    pub recordings: u64,
    /// SHA-256 of the names of all recordings of the batch in their order, each with a zero byte
    /// after it: parts of one batch have it in common.
    pub list_sha256: String,
}

/// The first line of a file of `--resume`: what the answers after it depend on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ResumeHead {
    /// Version of this form.
    pub schema_version: u32,
    /// Name and version of the program.
    pub tool: String,
    /// Every setting that changes an answer, by the name of its option, as text; `null` where it
    /// is left alone. Files (`bundle`, `reference`) are told by the SHA-256 of their bytes.
    pub answers_depend_on: BTreeMap<String, Option<String>>,
    /// Which part of a batch it is; only with `--shard`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<BatchShard>,
}

/// A recording that could not be diagnosed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Failure {
    /// The path as it was given.
    pub recording: String,
    /// Which actuator the recording is of, where it says so or its name does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub actuator_id: Option<String>,
    /// When the recording was taken, RFC 3339, where it says so or its name does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub date: Option<String>,
    /// Why, in one line.
    pub error: String,
}

/// The answer to one recording, or with `--together` to several of one machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecordDiagnosis {
    /// The path as it was given; of several recordings their number, actuator and session.
    pub recording: String,
    /// SHA-256 of the recording's file, hexadecimal; only with `--resume`, which diagnoses a
    /// recording again whose file is another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recording_sha256: Option<String>,
    /// Which actuator the recording is of, where it says so or its name does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub actuator_id: Option<String>,
    /// When the recording was taken, RFC 3339, where it says so or its name does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub date: Option<String>,
    /// Who took the recording, where it says so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub operator: Option<String>,
    /// Completeness of the answer.
    pub status: Status,
    /// The answer in a word.
    pub verdict: Verdict,
    /// SHA-256 of the bundle used, where it is not the one of the document.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bundle: Option<String>,
    /// How the fault levels were searched.
    pub method: Method,
    /// Which model was compared with the recording.
    pub fidelity: Fidelity,
    /// Evaluations of that model.
    pub evaluations: u64,
    /// Wall time, s; left out with `--stable`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elapsed_s: Option<f64>,
    /// The discrepancy of eq. 17 of the FREEDOM paper at the answer.
    pub discrepancy: f64,
    /// How well the model explains the recording.
    pub fit: Fit,
    /// k1 to k7, always all seven and in this order.
    pub faults: Vec<Fault>,
    /// Findings: damage that the recording tells from the machine's tolerances, or cannot tell from
    /// them; left out where the machine is taken to be exactly its model file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<Finding>,
    /// How well each fault can be told; only with `--identifiability`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub identifiability: Vec<Identifiability>,
    /// Decision about the machine; only with `--decide`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub action: Option<Action>,
    /// Joint uncertainty of what is determined.
    pub covariance: Covariance,
    /// Things that the reader of the answer should know.
    pub notices: Vec<Notice>,
    /// Recordings that the answer is of; only with `--together`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub together: Vec<PooledRecording>,
}

/// Completeness of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// Every level looked for is determined, apart from k7 without an eccentricity, and the model
    /// explains the recording.
    Ok,
    /// A level looked for is not determined, or the model does not explain the recording.
    Partial,
}

/// The answer in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// No fault vector explains the recording to noise and learnt error.
    ModelInadequate,
    /// A fault or a finding is detected.
    Faulty,
    /// Nothing looked for is detected, and k1 to k6 of it are all decided.
    Healthy,
    /// Nothing is detected, and one of k1 to k6 is not determined, noise or tolerances could hide a
    /// level, or the search did not finish.
    Undetermined,
}

/// How the fault levels were searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Method {
    /// Generalised least squares on the low-fidelity model with the learnt error's covariance.
    Gls,
    /// Vector-valued Bayesian optimisation of the whitened residual.
    Composite,
    /// The bundle's emulator of the signal: no simulation, incipient faults alone.
    Emulator,
    /// Two-step lookahead expected improvement.
    TwoStepEi,
    /// Expected improvement.
    Ei,
    /// Upper confidence bound.
    Ucb,
}

/// Which model was compared with the recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Fidelity {
    /// The monitoring model.
    Low,
    /// The reference model.
    High,
}

/// How well the model explains the recording, on the filtered envelope.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fit {
    /// Root mean square of the residual, A.
    pub rms_a: f64,
    /// Part of the residual that noise and learnt discrepancy explain, A.
    pub noise_floor_a: f64,
    /// Noise on each phase per sample, rms, A.
    pub noise_a: f64,
    /// Where that level is from.
    pub noise_source: NoiseSource,
    /// True where the residual is explained.
    pub adequate: bool,
}

/// Where the noise level is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseSource {
    /// `--noise-a`.
    Flag,
    /// The recording's metadata.
    Metadata,
    /// Sum of the three phase currents of the recording, which no machine drives.
    OutOfBand,
    /// The residual of the fit.
    Residual,
}

words! {
    Status { Ok "ok", Partial "partial" }
    Verdict {
        ModelInadequate "model-inadequate", Faulty "faulty",
        Healthy "healthy", Undetermined "undetermined",
    }
    Method {
        Gls "gls", Composite "composite", Emulator "emulator", TwoStepEi "two-step-ei", Ei "ei", Ucb "ucb",
    }
    Fidelity { Low "low", High "high" }
    NoiseSource {
        Flag "flag", Metadata "metadata",
        OutOfBand "out-of-band", Residual "residual",
    }
}

impl Fit {
    /// The residual over what noise and learnt discrepancy explain, where that is a number.
    pub fn ratio(self) -> Option<f64> {
        let ratio = self.rms_a / self.noise_floor_a;
        ratio.is_finite().then_some(ratio)
    }
}

impl RecordDiagnosis {
    /// The level of a fault.
    pub fn fault(&self, id: FaultId) -> Option<&Fault> {
        self.faults.iter().find(|fault| fault.id == id)
    }

    /// Tells whether any fault is detected.
    pub fn any_detected(&self) -> bool {
        self.faults.iter().any(|fault| fault.detected == Some(true))
    }

    /// Tells whether the search ended before the model explained the recording.
    pub fn is_unfinished(&self) -> bool {
        self.notice(NoticeCode::SearchUnfinished).is_some()
    }

    /// The first notice of a kind.
    pub fn notice(&self, code: NoticeCode) -> Option<&Notice> {
        self.notices.iter().find(|notice| notice.code == code)
    }

    /// Tells whether the levels are to be believed: the model explains the recording, and the search
    /// finished.
    pub fn is_believed(&self) -> bool {
        self.verdict != Verdict::ModelInadequate && !self.is_unfinished()
    }

    /// The name of a number that is not finite, if there is one: JSON would show
    /// it as `null`, which means something else.
    pub fn not_finite(&self) -> Option<String> {
        let fit = self.fit;
        let plain = [
            ("discrepancy", self.discrepancy),
            ("fit.rms_a", fit.rms_a),
            ("fit.noise_floor_a", fit.noise_floor_a),
            ("fit.noise_a", fit.noise_a),
            ("elapsed_s", self.elapsed_s.unwrap_or(0.0)),
        ];
        let bad = |value: &f64| !value.is_finite();
        let of_faults = self.faults.iter().flat_map(|fault| {
            let [low, high] = fault.interval_95.unwrap_or([0.0; 2]);
            [fault.value.unwrap_or(0.0), fault.std.unwrap_or(0.0), low, high]
                .map(|value| (fault.id.id(), value))
        });
        let of_findings = self.findings.iter().flat_map(|finding| {
            let [low, high] = finding.interval_95;
            let stds = [finding.std, finding.prior_std, finding.posterior_std];
            let numbers = [finding.value, low, high].into_iter().chain(stds);
            numbers.map(|value| (finding.id.as_str(), value))
        });
        let of_identifiability = self.identifiability.iter().flat_map(|one| {
            let further = one.would_help.as_ref().map(|further| further.std);
            let stds = [Some(one.std), Some(one.least_std), further].into_iter().flatten();
            stds.map(|std| ("identifiability", std))
        });
        let of_covariance =
            self.covariance.matrix.iter().flatten().chain(&self.covariance.estimate);
        let of_covariance = of_covariance.map(|&value| ("covariance", value));
        let numbers =
            plain.into_iter().chain(of_faults).chain(of_findings).chain(of_identifiability);
        let mut numbers = numbers.chain(of_covariance);
        numbers.find(|(_, value)| bad(value)).map(|(name, _)| name.to_owned())
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::document::finding_tests::finding;

    pub(crate) fn record() -> RecordDiagnosis {
        let mut faults: Vec<Fault> = FaultId::ALL.map(Fault::undetermined).into();
        faults[0] = Fault::determined(FaultId::K1, 0.021, 0.001, [0.019, 0.023], Some(true));
        RecordDiagnosis {
            recording_sha256: None,
            recording: "r01.csv".to_owned(),
            actuator_id: None,
            date: None,
            operator: None,
            status: Status::Partial,
            verdict: Verdict::Faulty,
            bundle: None,
            method: Method::TwoStepEi,
            fidelity: Fidelity::Low,
            evaluations: 18,
            elapsed_s: None,
            discrepancy: 0.041,
            fit: Fit {
                rms_a: 0.0036,
                noise_floor_a: 0.0035,
                noise_a: 0.02,
                noise_source: NoiseSource::OutOfBand,
                adequate: true,
            },
            faults,
            findings: Vec::new(),
            identifiability: Vec::new(),
            action: None,
            covariance: Covariance {
                parameters: vec!["k1".to_owned()],
                estimate: vec![0.021],
                matrix: vec![vec![1e-6]],
            },
            notices: vec![Notice {
                code: NoticeCode::StartAngleUnknown,
                message: "no angle".to_owned(),
            }],
            together: Vec::new(),
        }
    }

    #[test]
    fn names_are_those_of_the_interface() {
        let json = serde_json::to_value(record()).unwrap();
        let want = serde_json::json!({
            "recording": "r01.csv", "status": "partial", "verdict": "faulty",
            "method": "two-step-ei", "fidelity": "low", "evaluations": 18,
            "discrepancy": 0.041,
            "fit": { "rms_a": 0.0036, "noise_floor_a": 0.0035, "noise_a": 0.02,
                     "noise_source": "out-of-band", "adequate": true },
            "faults": [
                { "id": "k1", "name": "friction", "value": 0.021, "std": 0.001,
                  "interval_95": [0.019, 0.023], "detected": true },
                { "id": "k2", "name": "backlash", "value": null, "std": null, "interval_95": null },
                { "id": "k3", "name": "short circuit of phase A", "value": null, "std": null,
                  "interval_95": null },
                { "id": "k4", "name": "short circuit of phase B", "value": null, "std": null,
                  "interval_95": null },
                { "id": "k5", "name": "short circuit of phase C", "value": null, "std": null,
                  "interval_95": null },
                { "id": "k6", "name": "eccentricity", "value": null, "std": null,
                  "interval_95": null },
                { "id": "k7", "name": "direction of eccentricity", "value": null, "std": null,
                  "interval_95": null },
            ],
            "covariance": { "parameters": ["k1"], "estimate": [0.021], "matrix": [[1e-6]] },
            "notices": [{ "code": "start-angle-unknown", "message": "no angle" }],
        });
        assert_eq!(json, want);
        assert_eq!(serde_json::from_value::<RecordDiagnosis>(json).unwrap(), record());
    }

    #[test]
    fn words_are_those_that_serde_writes() {
        fn agree<T: Serialize + Copy>(values: &[T], word: fn(T) -> &'static str) {
            for &value in values {
                assert_eq!(serde_json::to_value(value).unwrap(), word(value));
            }
        }
        use NoiseSource as N;
        use Verdict as V;
        agree(&[Status::Ok, Status::Partial], Status::word);
        agree(&[V::ModelInadequate, V::Faulty, V::Healthy, V::Undetermined], V::word);
        agree(
            &[
                Method::Gls,
                Method::Composite,
                Method::Emulator,
                Method::TwoStepEi,
                Method::Ei,
                Method::Ucb,
            ],
            Method::word,
        );
        agree(&[Fidelity::Low, Fidelity::High], Fidelity::word);
        agree(&[N::Flag, N::Metadata, N::OutOfBand, N::Residual], N::word);
        agree(&NoticeCode::ALL, NoticeCode::code);
        agree(&FaultId::ALL, FaultId::id);
    }

    #[test]
    fn a_number_that_json_cannot_hold_is_found() {
        assert_eq!(record().not_finite(), None);
        let mut bad = record();
        bad.faults[0].std = Some(f64::NAN);
        assert_eq!(bad.not_finite().as_deref(), Some("k1"));
        let mut bad = record();
        bad.covariance.matrix[0][0] = f64::INFINITY;
        assert_eq!(bad.not_finite().as_deref(), Some("covariance"));
        let mut bad = record();
        bad.findings = vec![finding("play", &["k2"], 0.01, f64::NAN)];
        assert_eq!(bad.not_finite().as_deref(), Some("play"));
    }
}
