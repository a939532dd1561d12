//! Notices: facts that the reader of an answer should know.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
