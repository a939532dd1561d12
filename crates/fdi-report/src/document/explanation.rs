//! Explanations as JSON: effects that a model misses in recordings.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Prediction, signal::SignalFinding};

/// Effects that a model misses in recordings of one machine, and their cost in its fault levels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Explanation {
    /// Version of this form.
    pub schema_version: u32,
    /// Name and version of the program, `fdi 0.1.0`.
    pub tool: String,
    /// Seed of the run.
    pub seed: u64,
    /// When it was made, RFC 3339; only with `--stamp`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stamp: Option<String>,
    /// Name that the model gives itself.
    pub model: String,
    /// Model that predicted the recordings, where they were compared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prediction: Option<Prediction>,
    /// The answer in a word.
    pub verdict: ExplanationVerdict,
    /// The answer in a sentence.
    pub sentence: String,
    /// Find of the signal chain that decides: the first that stands, for which there is no conclusion,
    /// else the first that `--correct` set right.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<SignalFinding>,
    /// All finds of the signal chain: those set right, then those that stand.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub signals: Vec<SignalFinding>,
    /// Effects that were found, strongest first, but for one in doubt before the others.
    pub effects: Vec<EffectFinding>,
    /// Effects that explain the recordings as well as one of `effects`.
    pub alternatives: Vec<EffectFinding>,
    /// Numbers of the model file that are wrong: the recordings have them beyond their tolerance.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub numbers: Vec<NumberFinding>,
    /// Catalogue identifiers of effects that these recordings cannot tell from damage or from
    /// numbers within their tolerance.
    pub absorbed: Vec<String>,
    /// Residual of the recordings that were not fitted.
    pub holdout: Option<Holdout>,
    /// Fault levels, `k1` to `k6`, without and with what was found.
    pub faults: BTreeMap<String, FaultBeforeAfter>,
    /// Numbers of the model that may be off, as fitted: those with a tolerance, and others that the
    /// recordings show.
    pub nominal: BTreeMap<String, NominalChange>,
    /// How well each recording is explained without and with the effects.
    pub records: Vec<RecordFit>,
    /// Description of the part left unexplained, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remainder: Option<Remainder>,
    /// Smallest size of each effect that would have been named nine times in ten.
    pub sensitivity: Vec<Sensitivity>,
    /// How each effect of the catalogue fared against the nominal model, best first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hypotheses: Vec<HypothesisOutcome>,
    /// Mean residual over each coordinate without and with what was found, the one that
    /// explains most first; of the recordings that were fitted and of those that were not.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub curves: Vec<ResidualCurve>,
    /// Wall time, s; left out with `--stable`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elapsed_s: Option<f64>,
}

impl Explanation {
    /// Name of what a residual has without any missing effect: the learnt error of a model is noise to
    /// it.
    pub fn floor_name(&self) -> &'static str {
        match self.prediction {
            Some(Prediction::Learnt) => "noise and learnt error",
            _ => "noise",
        }
    }
}

/// The answer in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ExplanationVerdict {
    /// The model explains the recordings to the noise.
    Adequate,
    /// The model explains the recordings with the effects named, or with numbers of its file that are
    /// wrong.
    Named,
    /// Effects are named, and something is left.
    NamedWithRemainder,
    /// One of several effects that explain the recordings equally well.
    OneOf,
    /// Something is left that nothing in the catalogue explains.
    Unknown,
    /// Apparent damage or tolerance may be an effect: the recordings cannot tell.
    Absorbed,
    /// The recordings do not suffice; `sentence` says what is missing.
    Inconclusive,
}

/// An effect that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectFinding {
    /// Catalogue identifier, `E03`.
    pub id: String,
    /// Name that an engineer gives it.
    pub name: String,
    /// Where it acts.
    pub port: String,
    /// Effects of one class differ in the form of the same curve.
    pub class: String,
    /// Numbers of the effect, by keys that carry the unit.
    pub parameters: BTreeMap<String, EffectNumber>,
    /// Chance that noise alone makes any effect of the catalogue score as much.
    pub p_familywise: f64,
    /// Gain in log-likelihood on recordings that were not fitted.
    pub holdout_gain_nats: f64,
    /// Standard error of the gain held out.
    pub holdout_gain_se: f64,
    /// Evidence that tells it from its look-alikes.
    pub separated_by: String,
    /// For an alternative, the one of `effects` that it may be instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instead_of: Option<String>,
}

/// A number of the model file that is wrong.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NumberFinding {
    /// Key with `number:` before it, `number:axis.inertia-kg-m2`.
    pub id: String,
    /// Value in the model file, in the unit of the key.
    pub nominal: f64,
    /// Value by the recordings.
    pub value: f64,
    /// 95 % interval of the value.
    pub interval_95: [f64; 2],
    /// Value over the nominal one, where that is not zero.
    pub factor: Option<f64>,
    /// Half-width of the tolerance that it leaves, in the unit of the key.
    pub tolerance: f64,
    /// Chance that noise alone makes any number leave its tolerance by as much.
    pub p_familywise: f64,
    /// Gain in log-likelihood, over the number within its tolerance, on recordings that were not
    /// fitted.
    pub holdout_gain_nats: f64,
    /// Standard error of the gain held out.
    pub holdout_gain_se: f64,
}

impl NumberFinding {
    /// Key of the model file.
    pub fn key(&self) -> &str {
        self.id.strip_prefix("number:").unwrap_or(&self.id)
    }
}

/// A number of an effect.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectNumber {
    /// Value of the number.
    pub value: f64,
    /// 95 % interval, where it was fitted.
    pub interval_95: Option<[f64; 2]>,
}

/// Residual of recordings that were not fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Holdout {
    /// Root mean square with the nominal model.
    pub rms_before: f64,
    /// Root mean square with the effects.
    pub rms_after: f64,
    /// Root mean square of the noise.
    pub noise_floor: f64,
    /// Share of the gap to the noise that the effects close, where there is a gap.
    pub gap_closed_frac: Option<f64>,
    /// Unit of the three, `a` or `v`.
    pub unit: String,
}

/// A fault level without and with what was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaultBeforeAfter {
    /// With the nominal model.
    pub before: f64,
    /// Standard deviation of the level before.
    pub std_before: f64,
    /// 95 % interval of the level before, within what a level can be.
    pub interval_95_before: [f64; 2],
    /// With the effects.
    pub after: f64,
    /// Standard deviation of the level after.
    pub std_after: f64,
    /// 95 % interval of the level after, which holds those of all explanations that are left open.
    pub interval_95_after: [f64; 2],
    /// Keys of numbers of the model file that leave the level open, the most first: were all numbers
    /// known, its standard deviation would halve.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ambiguous_with: Vec<String>,
}

/// Length of an interval from which on a level, which is of 0 to 1, may be anything.
const ANYTHING: f64 = 0.99;

impl FaultBeforeAfter {
    /// True where the recordings determine a level: its 95 % interval is shorter than 0.99.
    pub fn determines(interval_95: [f64; 2]) -> bool {
        let [low, high] = interval_95;
        high - low <= ANYTHING
    }
}

/// Number of the model with a tolerance, before and after the fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NominalChange {
    /// In the model file.
    pub nominal: f64,
    /// Fitted together with the effects.
    pub fitted: f64,
}

impl NominalChange {
    /// Change by the fit, %, of a number that is not zero in the model file.
    pub fn change_percent(&self) -> Option<f64> {
        (self.nominal != 0.0).then(|| 100.0 * (self.fitted / self.nominal - 1.0))
    }
}

/// How well a recording is explained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecordFit {
    /// The path as it was given.
    pub recording: String,
    /// Use of the recording: `train`, `holdout` or `repeat`.
    pub role: String,
    /// Root mean square of measured less nominal model.
    pub rms_before: f64,
    /// Root mean square of measured less model with effects.
    pub rms_after: f64,
    /// `100·(1 − |residual|/|measured − mean|)`, nominal.
    pub fit_percent_before: f64,
    /// `100·(1 − |residual|/|measured − mean|)`, with effects.
    pub fit_percent_after: f64,
    /// Chance that white noise is as little white as the residual with effects.
    pub whiteness_p: f64,
}

/// Description of the part left unexplained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Remainder {
    /// Share of the residual's variance, noise included, that each coordinate explains alone
    /// beyond chance, largest first.
    pub shares: Vec<CoordinateShare>,
    /// The leading curve: mean residual over that coordinate.
    pub curve: Vec<[f64; 2]>,
    /// Kurtosis of the residual, 3 for normal noise: above, it comes in bursts.
    pub kurtosis: f64,
}

/// How much a coordinate explains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CoordinateShare {
    /// `time`, `speed`, `motor-angle`, `position`, `load`, `drive`, `direction`.
    pub coordinate: String,
    /// Share of the variance.
    pub share: f64,
}

/// Smallest size of an effect that these recordings would have named, whatever its sign and phase.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Sensitivity {
    /// Catalogue identifier.
    pub id: String,
    /// Key of the number that is the size.
    pub parameter: String,
    /// The size: with the effect added to the recordings, fitted and held out, the gates that name
    /// effects begin to let it pass.
    pub smallest_named_90: f64,
    /// Unit of the size, from the key.
    pub unit: String,
    /// Numbers of the shape that shows best, by their keys: an order, a frequency, a speed.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub shape: BTreeMap<String, f64>,
}

/// How an effect of the catalogue fared against the nominal model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HypothesisOutcome {
    /// Catalogue identifier.
    pub id: String,
    /// Name that an engineer gives it.
    pub name: String,
    /// Outcome of the hypothesis.
    pub standing: Standing,
    /// Decimal logarithm of the chance that noise alone scores as much for this effect.
    pub log10_p: f64,
    /// Share of what the effect does that damage and numbers within their tolerance cannot imitate.
    pub visible_share: f64,
    /// Result of the refit, for the best of the scan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refit: Option<HypothesisRefit>,
}

/// Outcome of a hypothesis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Standing {
    /// Among what was found.
    Found,
    /// As likely as what was found.
    AsLikely,
    /// Fitted, and not good enough or beaten.
    FellShort,
    /// Too little promise to be fitted.
    NotFitted,
}

/// Result of fitting an effect.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HypothesisRefit {
    /// Gain in log-likelihood on recordings that were not fitted.
    pub holdout_gain_nats: f64,
    /// Standard error of the gain held out.
    pub holdout_gain_se: f64,
    /// Gain in evidence on those that were.
    pub evidence_nats: f64,
    /// True where a number of the effect stands on a bound, which no explanation may.
    pub on_bound: bool,
}

/// Mean residual over bins of a coordinate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ResidualCurve {
    /// `time`, `speed`, `motor-angle` (within a period of the current), `position`, `drive` or
    /// `load`.
    pub coordinate: String,
    /// Unit of the coordinate, as in keys: `rad_per_s`.
    pub unit: String,
    /// Share of the nominal residual's variance that the means explain, beyond chance.
    pub share_before: f64,
    /// Share of the variance of the residual with the effects found that the means explain.
    pub share_after: f64,
    /// The bins that hold samples, along the coordinate.
    pub bins: Vec<CurveBin>,
}

/// A bin of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurveBin {
    /// Middle of the bin, in the unit of the coordinate.
    pub centre: f64,
    /// Samples in it.
    pub samples: u64,
    /// Mean residual with the nominal model, in the unit of `holdout`.
    pub mean_before: f64,
    /// Mean residual with what was found.
    pub mean_after: f64,
}
