//! What is written as JSON: plain data with stable names.
//!
//! These types are the interface to scripts (`docs/stability.md`); the types that
//! compute are free to change and are converted into these. Numbers are always
//! finite; what is not determined is `null`.

mod calibration;
mod effects;
mod explanation;
mod proposal;

pub use calibration::{CalibratedParameter, Calibration};
pub use effects::{CatalogueEffect, CatalogueKey, CatalogueParameter, EffectCatalogue};
pub use explanation::{
    CoordinateShare, CurveBin, EffectFinding, EffectNumber, Explanation, ExplanationVerdict,
    FaultBeforeAfter, Holdout, HypothesisOutcome, HypothesisRefit, NominalChange, RecordFit,
    Remainder, ResidualCurve, Sensitivity, Standing,
};

pub use proposal::{Proposal, ProposedRecording, Separation};

use std::{collections::BTreeMap, fmt};

use recordings::EnvelopeKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

mod fleet;

pub use fleet::{ActuatorTrend, Change, FaultChange, Fleet, LeftOut, Slope, TrendPoint};

/// Version of the JSON documents: raised when a field changes its meaning or goes,
/// not when one is added.
pub const SCHEMA_VERSION: u32 = 1;

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
    /// One entry for each recording that could be diagnosed, in the order of the input.
    pub records: Vec<RecordDiagnosis>,
    /// One entry for each that could not.
    pub failed: Vec<Failure>,
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

/// The answer to one recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecordDiagnosis {
    /// The path as it was given.
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
    /// Whether everything could be determined.
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
    /// Joint uncertainty of what is determined.
    pub covariance: Covariance,
    /// What the reader of the answer should know.
    pub notices: Vec<Notice>,
}

/// Whether everything could be determined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// All of it.
    Ok,
    /// Not all; the notices say what and why.
    Partial,
}

/// The answer in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// No fault vector explains the recording to the noise.
    ModelInadequate,
    /// A fault is detected.
    Faulty,
    /// k1 to k6 are all decided, none is detected.
    Healthy,
    /// None is detected, and one of k1 to k6 could not be determined.
    Undetermined,
}

/// How the fault levels were searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Method {
    /// Vector-valued Bayesian search on the residuals.
    Composite,
    /// The bundle's emulator, no simulation.
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
    /// What noise and learnt discrepancy explain of it, A.
    pub noise_floor_a: f64,
    /// Noise on each phase per sample, rms, A.
    pub noise_a: f64,
    /// Where that level is from.
    pub noise_source: NoiseSource,
    /// Whether the residual is explained.
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
    /// The recording where the actuator stands still.
    Standstill,
    /// The recording beyond the frequencies of the model.
    OutOfBand,
    /// The residual of the fit.
    Residual,
    /// The level that the bundle was made for.
    Bundle,
}

/// A fault of the actuator.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum FaultId {
    /// Friction.
    K1,
    /// Backlash.
    K2,
    /// Short circuit of phase A.
    K3,
    /// Short circuit of phase B.
    K4,
    /// Short circuit of phase C.
    K5,
    /// Static eccentricity, amplitude.
    K6,
    /// Static eccentricity, direction.
    K7,
}

impl FaultId {
    /// All seven, in order.
    pub const ALL: [Self; 7] =
        [Self::K1, Self::K2, Self::K3, Self::K4, Self::K5, Self::K6, Self::K7];

    /// `k1` to `k7`.
    pub fn id(self) -> &'static str {
        ["k1", "k2", "k3", "k4", "k5", "k6", "k7"][self as usize]
    }

    /// What it is.
    pub fn name(self) -> &'static str {
        [
            "friction",
            "backlash",
            "short circuit of phase A",
            "short circuit of phase B",
            "short circuit of phase C",
            "eccentricity",
            "direction of eccentricity",
        ][self as usize]
    }
}

impl fmt::Display for FaultId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}

/// The level of one fault.
///
/// `value`, `std` and `interval_95` are `null` together, where the level is not
/// determined. k6 and k7 are decided jointly: while k6 is not detected, k7 is null.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fault {
    /// Which fault.
    pub id: FaultId,
    /// What it is, in words.
    pub name: String,
    /// The level, 0 to 1.
    pub value: Option<f64>,
    /// Its standard deviation.
    pub std: Option<f64>,
    /// Its 95 % interval; for k7 read upward on the circle, where 1 is 0.
    pub interval_95: Option<[f64; 2]>,
    /// Whether the fault is there; left out for k7 and for what is not determined.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detected: Option<bool>,
}

impl Fault {
    /// A level that the recording determines; `detected` is `None` for k7.
    pub fn determined(
        id: FaultId,
        value: f64,
        std: f64,
        interval_95: [f64; 2],
        detected: Option<bool>,
    ) -> Self {
        let (value, std, interval_95) = (Some(value), Some(std), Some(interval_95));
        Self { id, name: id.name().to_owned(), value, std, interval_95, detected }
    }

    /// A level that it does not.
    pub fn undetermined(id: FaultId) -> Self {
        let name = id.name().to_owned();
        Self { id, name, value: None, std: None, interval_95: None, detected: None }
    }
}

/// Joint uncertainty of what is determined, in the coordinates of the search.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Covariance {
    /// The coordinates of rows and columns: of `k1` to `k5`, `k6_cos` and `k6_sin`
    /// those that are determined.
    pub parameters: Vec<String>,
    /// The estimate of these coordinates, free of bounds: it may lie below zero, where the levels
    /// are cut. With the matrix it gives the region of (k6, k7) also while k7 is null.
    pub estimate: Vec<f64>,
    /// The covariance, row by row.
    pub matrix: Vec<Vec<f64>>,
}

/// Something the reader of the answer should know.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Notice {
    /// What kind of thing.
    pub code: NoticeCode,
    /// It in words.
    pub message: String,
}

/// What a notice is about.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum NoticeCode {
    /// The rotor's angle at the start is not known: k3, k4, k5, k7 are null.
    StartAngleUnknown,
    /// The direction of the eccentricity cannot be told: k7 is null.
    PhaseUndetermined,
    /// The recording does not say its command; that of the bundle is assumed.
    CommandAssumed,
    /// The answer lies outside what the bundle was trained on.
    OutsideTraining,
    /// The noise level is that of the bundle.
    NoiseFromBundle,
    /// The model is not the one that the bundle is of.
    BundleOfAnotherModel,
    /// The search ended where the model does not explain the recording: nothing is decided.
    SearchUnfinished,
    /// Few numbers were looked at in place of the whole signal.
    Encoded,
}

impl NoticeCode {
    /// The code as JSON has it.
    pub fn code(self) -> &'static str {
        match self {
            Self::StartAngleUnknown => "start-angle-unknown",
            Self::PhaseUndetermined => "phase-undetermined",
            Self::CommandAssumed => "command-assumed",
            Self::OutsideTraining => "outside-training",
            Self::NoiseFromBundle => "noise-from-bundle",
            Self::BundleOfAnotherModel => "bundle-of-another-model",
            Self::SearchUnfinished => "search-unfinished",
            Self::Encoded => "encoded",
        }
    }
}

macro_rules! words {
    ($($type:ident { $($variant:ident $word:literal),+ $(,)? })+) => {$(
        impl $type {
            /// The word as JSON has it.
            pub fn word(self) -> &'static str {
                match self { $(Self::$variant => $word,)+ }
            }
        }

        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.pad(self.word())
            }
        }
    )+};
}

words! {
    Status { Ok "ok", Partial "partial" }
    Verdict {
        ModelInadequate "model-inadequate", Faulty "faulty",
        Healthy "healthy", Undetermined "undetermined",
    }
    Method {
        Composite "composite", Emulator "emulator", TwoStepEi "two-step-ei", Ei "ei", Ucb "ucb",
    }
    Fidelity { Low "low", High "high" }
    NoiseSource {
        Flag "flag", Metadata "metadata", Standstill "standstill",
        OutOfBand "out-of-band", Residual "residual", Bundle "bundle",
    }
}

impl RecordDiagnosis {
    /// The level of a fault.
    pub fn fault(&self, id: FaultId) -> Option<&Fault> {
        self.faults.iter().find(|fault| fault.id == id)
    }

    /// Whether any fault is detected.
    pub fn any_detected(&self) -> bool {
        self.faults.iter().any(|fault| fault.detected == Some(true))
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
        let of_covariance =
            self.covariance.matrix.iter().flatten().chain(&self.covariance.estimate);
        let of_covariance = of_covariance.map(|&value| ("covariance", value));
        let mut numbers = plain.into_iter().chain(of_faults).chain(of_covariance);
        numbers.find(|(_, value)| bad(value)).map(|(name, _)| name.to_owned())
    }
}

/// What a bundle holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BundleSummary {
    /// Version of this form.
    pub schema_version: u32,
    /// SHA-256 of the bundle, hexadecimal.
    pub sha256: String,
    /// Name of the model that it is of.
    pub model: String,
    /// Name of the command that it is for.
    pub command: String,
    /// Name of the envelope that it is for.
    pub envelope: String,
    /// Rate of the envelope, Hz.
    pub rate_hz: f64,
    /// Corner of the filter, Hz.
    pub filter_hz: f64,
    /// The datasets that it was learnt from.
    pub datasets: Vec<DatasetSummary>,
    /// Name of the encoding used unless another is asked for.
    pub default_encoding: String,
    /// The encodings that it holds.
    pub encodings: Vec<EncodingSummary>,
}

impl BundleSummary {
    /// The envelope as a choice, where this version knows it.
    pub fn envelope_kind(&self) -> Option<EnvelopeKind> {
        EnvelopeKind::from_name(&self.envelope)
    }
}

/// A dataset that a bundle was learnt from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct DatasetSummary {
    /// Name of the design.
    pub name: String,
    /// Number of conditions.
    pub conditions: u64,
    /// Seed it was made from.
    pub seed: u64,
    /// SHA-256 of its content, hexadecimal.
    pub sha256: String,
}

/// An encoding that a bundle holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EncodingSummary {
    /// Its name.
    pub name: String,
    /// Numbers that it makes of a recording.
    pub size: u64,
    /// For each fault, how much larger the bound of its standard deviation is
    /// than with the whole envelope.
    pub bound_inflation: BTreeMap<String, f64>,
}

/// The result of one of the paper's experiments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Evaluation {
    /// Version of this form.
    pub schema_version: u32,
    /// Name of the experiment.
    pub protocol: String,
    /// Test conditions.
    pub conditions: u64,
    /// Root seed.
    pub seed: u64,
    /// What the recordings and the reference signals were like.
    pub settings: EvaluationSettings,
    /// One entry a method.
    pub methods: Vec<MethodEvaluation>,
}

/// What the recordings of an experiment are like.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EvaluationSettings {
    /// Noise inside the controller, of recordings and reference signals.
    pub controller_noise: bool,
    /// Digitisation inside the control loop, of both.
    pub digitisation: bool,
    /// White noise on each phase sample, rms, A; a 12-bit converter over ±20 A follows it. 0:
    /// neither.
    pub sensor_noise_a: f64,
    /// Rate of the phase samples, Hz.
    pub phase_rate_hz: f64,
    /// Rate of the filtered envelope, Hz.
    pub envelope_rate_hz: f64,
    /// Reference signals of the design `incipient`.
    pub snapshots: u64,
    /// Reference signals of the design `sparse`.
    pub sparse_snapshots: u64,
    /// Largest level that searches of the scalar discrepancy look at.
    pub largest_level: f64,
}

/// How a method did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MethodEvaluation {
    /// Its name.
    pub method: String,
    /// Mean over the faults of the median percentage error.
    pub average_percent: f64,
    /// What the stated standard deviations predict for it: mean over the faults of the median of
    /// 67.4 % of the standard deviation over the level.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_percent: Option<f64>,
    /// Median number of evaluations of the monitor.
    pub evaluations_median: f64,
    /// Median `δ*`: norm of the residual on the mask's 30 points, A.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub discrepancy_median: Option<f64>,
    /// Median evaluations times the measured time of one, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_time_s: Option<f64>,
    /// Median wall time of a diagnosis, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall_time_s: Option<f64>,
    /// Least wall time of a diagnosis, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall_time_min_s: Option<f64>,
    /// Share of 95 % intervals that hold the truth, all faults together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage_95: Option<f64>,
    /// Healthy recordings on which false alarms were counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub healthy: Option<u64>,
    /// How the discrepancy falls, over the conditions; empty where nothing is searched.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub convergence: Vec<ConvergencePoint>,
    /// One entry a fault looked for.
    pub faults: Vec<FaultEvaluation>,
}

/// Least discrepancy that searches have reached after some evaluations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ConvergencePoint {
    /// Evaluations of the monitor.
    pub evaluations: u64,
    /// Median time from the start, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Norm of the residual on the mask's points, A; searches that have ended count with their
    /// end.
    pub discrepancy: Quartiles,
}

/// How well one fault is found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaultEvaluation {
    /// Which fault.
    pub id: FaultId,
    /// Percentage error, eq. 20 of the FREEDOM paper.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_percent: Option<Quartiles>,
    /// Absolute error of the level; on the circle for k7.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_abs: Option<Quartiles>,
    /// Median Cramér-Rao bound for sensor noise and the monitor's error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bound_std: Option<f64>,
    /// Median bound for sensor noise on the filtered envelope.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor_bound_std: Option<f64>,
    /// Median bound for sensor noise on the raw phase currents.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phase_bound_std: Option<f64>,
    /// Root mean square of error over bound; for k6 over both of its components.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rmse_over_bound: Option<f64>,
    /// Root mean square of error over the bound for sensor noise alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rmse_over_sensor_bound: Option<f64>,
    /// Share of 95 % intervals that hold the truth; for k6 of the joint region with k7.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage_95: Option<f64>,
    /// Healthy recordings on which the fault was called detected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub false_alarms: Option<u64>,
    /// Probability of detection by level.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub detection: Vec<DetectionPoint>,
}

impl FaultEvaluation {
    /// An entry without figures.
    pub fn of(id: FaultId) -> Self {
        Self {
            id,
            error_percent: None,
            error_abs: None,
            bound_std: None,
            sensor_bound_std: None,
            phase_bound_std: None,
            rmse_over_bound: None,
            rmse_over_sensor_bound: None,
            coverage_95: None,
            false_alarms: None,
            detection: Vec::new(),
        }
    }
}

/// One point of a curve of detection.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DetectionPoint {
    /// Middle of the levels taken together.
    pub level: f64,
    /// Conditions with such a level.
    pub conditions: u64,
    /// Share of them in which the fault was detected.
    pub detected_frac: f64,
}

/// Quartiles and maximum over the conditions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Quartiles {
    /// Half are smaller.
    pub median: f64,
    /// A quarter is smaller.
    pub p25: f64,
    /// A quarter is larger.
    pub p75: f64,
    /// None is larger.
    pub max: f64,
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn record() -> RecordDiagnosis {
        let mut faults: Vec<Fault> = FaultId::ALL.map(Fault::undetermined).into();
        faults[0] = Fault::determined(FaultId::K1, 0.021, 0.001, [0.019, 0.023], Some(true));
        RecordDiagnosis {
            recording_sha256: None,
            recording: "r01.csv".to_owned(),
            actuator_id: None,
            date: None,
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
            covariance: Covariance {
                parameters: vec!["k1".to_owned()],
                estimate: vec![0.021],
                matrix: vec![vec![1e-6]],
            },
            notices: vec![Notice {
                code: NoticeCode::StartAngleUnknown,
                message: "no angle".to_owned(),
            }],
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
        use NoticeCode as C;
        use Verdict as V;
        agree(&[Status::Ok, Status::Partial], Status::word);
        agree(&[V::ModelInadequate, V::Faulty, V::Healthy, V::Undetermined], V::word);
        agree(
            &[Method::Composite, Method::Emulator, Method::TwoStepEi, Method::Ei, Method::Ucb],
            Method::word,
        );
        agree(&[Fidelity::Low, Fidelity::High], Fidelity::word);
        agree(
            &[N::Flag, N::Metadata, N::Standstill, N::OutOfBand, N::Residual, N::Bundle],
            N::word,
        );
        agree(
            &[
                C::StartAngleUnknown,
                C::PhaseUndetermined,
                C::CommandAssumed,
                C::OutsideTraining,
                C::NoiseFromBundle,
                C::BundleOfAnotherModel,
                C::SearchUnfinished,
            ],
            C::code,
        );
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
    }
}
