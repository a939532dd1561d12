//! Published forms of the diagnosis of electromechanical actuators, and what people are shown of them.
//!
//! The types are the interface to scripts: plain data with stable names, written as JSON
//! (`docs/stability.md`). Numbers are always finite; what is not determined is `null`. Drawings
//! are self-contained SVG made from the published types alone, so that an answer that was kept
//! as JSON can be drawn later.
//!
//! ```
//! use fdi_report::{Fault, FaultId};
//!
//! let friction = Fault::determined(FaultId::K1, 0.021, 0.001, [0.019, 0.023], Some(true));
//! assert_eq!(serde_json::to_value(&friction)?["id"], "k1");
//! # Ok::<_, serde_json::Error>(())
//! ```

mod choice;
mod decision;
mod document;
mod figure;
mod fit_signals;
mod fleet;
mod folder;
mod open_findings;
mod page;
mod schema;
mod sentence;

pub use choice::{Choice, Word, choices};
pub use decision::{FALSE_ALARM_RATE, FAMILY_FALSE_ALARM_RATE, INCIPIENT_LEVEL};
pub use document::{
    Acceptance, Action, ActionLevels, ActuatorTrend, BatchShard, BundleSummary,
    CalibratedParameter, Calibration, CatalogueEffect, CatalogueKey, CatalogueParameter, Change,
    ConvergencePoint, CoordinateShare, Covariance, CurveBin, DatasetSummary, DetectionPoint,
    Diagnosis, EffectCatalogue, EffectFinding, EffectNumber, Encoding, EncodingSummary, Evaluation,
    EvaluationSettings, ExpectedStd, Explanation, ExplanationVerdict, Failure, Fault, FaultAction,
    FaultBeforeAfter, FaultChange, FaultEvaluation, FaultId, FaultTests, Fidelity, Finding,
    FindingKind, Fit, Fleet, Further, Holdout, HypothesisOutcome, HypothesisRefit, Identifiability,
    LearntFrom, LeftOut, Limits, Method, MethodEvaluation, MotionLimits, NoiseSource,
    NominalChange, Notice, NoticeCode, NumberFinding, PlannedFault, PlannedMotion, PooledLevel,
    PooledRecording, Prediction, Proposal, ProposedRecording, Quartiles, RecordDiagnosis,
    RecordFit, Remainder, ResidualCurve, ResumeHead, SCHEMA_VERSION, Sensitivity, Separation,
    SetupChoice, SetupRefusal, SetupRefusalCode, SetupSummary, Severity, SharedWith, SignalCode,
    SignalFinding, Slope, Standing, Status, TestPlan, ToleranceUse, TrendPoint, UnitNumber,
    UnitSummary, Verdict, WouldHelp,
};
pub use figure::{
    CompressionCurve, CompressionPanel, DrawnMode, compression_figure_svg, convergence_figure_svg,
    detection_figure_svg, fault_change_figure_svg, fault_figure_svg, fit_figure_svg,
    held_out_figure_svg, identifiability_figure_svg, mode_figure_svg, residual_curve_figure_svg,
    residual_curves_figure_svg, search_figure_svg, trend_figure_svg,
};
pub use fit_signals::FitSignals;
pub use folder::common_folder;
pub use open_findings::OpenFindings;
pub use page::{DiagnosisPage, Figure, Page, SettingRow};
pub use schema::Schema;
pub use sentence::{
    BACKLASH_GAIN, FRICTION_GAIN, detected_findings, direction_in_words, percent, plus_minus,
    sentence, three_digits, two_digits,
};
