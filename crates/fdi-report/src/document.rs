//! Published forms written as JSON: plain data with stable names.
//!
//! These types are the interface to scripts (`docs/stability.md`); the types that
//! compute are free to change and are converted into these. Numbers are always
//! finite; what is not determined is `null`.

mod action;
mod bundle;
mod calibration;
mod diagnosis;
mod effects;
mod encoding;
mod evaluation;
mod explanation;
mod fault;
mod finding;
mod fleet;
mod identifiability;
mod notice;
mod prediction;
mod proposal;
mod setup;
mod signal;
mod test_plan;
mod together;
mod tolerance_use;
mod unit;

pub use action::{Action, ActionLevels, FaultAction, Limits, Severity};
pub use bundle::{BundleSummary, DatasetSummary, EncodingSummary};
pub use calibration::{CalibratedParameter, Calibration};
#[cfg(test)]
pub(crate) use diagnosis::tests;
pub use diagnosis::{
    BatchShard, Diagnosis, Failure, Fidelity, Fit, Method, NoiseSource, RecordDiagnosis,
    ResumeHead, Status, Verdict,
};
pub use effects::{CatalogueEffect, CatalogueKey, CatalogueParameter, EffectCatalogue};
pub use encoding::Encoding;
pub use evaluation::{
    ConvergencePoint, DetectionPoint, Evaluation, EvaluationSettings, FaultEvaluation,
    MethodEvaluation, Quartiles,
};
pub use explanation::{
    CoordinateShare, CurveBin, EffectFinding, EffectNumber, Explanation, ExplanationVerdict,
    FaultBeforeAfter, Holdout, HypothesisOutcome, HypothesisRefit, NominalChange, NumberFinding,
    RecordFit, Remainder, ResidualCurve, Sensitivity, Standing,
};
pub use fault::{Covariance, Fault, FaultId};
#[cfg(test)]
pub(crate) use finding::tests as finding_tests;
pub use finding::{Finding, FindingKind};
pub use fleet::{ActuatorTrend, Change, FaultChange, Fleet, LeftOut, Slope, TrendPoint};
pub use identifiability::{Further, Identifiability, WouldHelp};
pub use notice::{Notice, NoticeCode};
pub use prediction::Prediction;
pub use proposal::{Proposal, ProposedRecording, Separation};
pub use setup::{
    Acceptance, FaultTests, SetupChoice, SetupRefusal, SetupRefusalCode, SetupSummary,
};
pub use signal::{SignalCode, SignalFinding};
pub use test_plan::{ExpectedStd, MotionLimits, PlannedFault, PlannedMotion, SharedWith, TestPlan};
pub use together::{PooledLevel, PooledRecording};
pub use tolerance_use::ToleranceUse;
pub use unit::{LearntFrom, UnitNumber, UnitSummary};

/// Version of the JSON documents: raised when a field changes its meaning or goes,
/// not when one is added.
pub const SCHEMA_VERSION: u32 = 2;

macro_rules! words {
    ($($type:ident { $($variant:ident $word:literal),+ $(,)? })+) => {$(
        impl $type {
            /// The word as JSON has it.
            pub fn word(self) -> &'static str {
                match self { $(Self::$variant => $word,)+ }
            }
        }

        impl crate::Word for $type {
            fn word(self) -> &'static str {
                $type::word(self)
            }
        }

        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.word())
            }
        }
    )+};
}

pub(super) use words;
