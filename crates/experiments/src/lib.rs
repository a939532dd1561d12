//! Experiments that score the diagnosis of electromechanical actuators.
//!
//! The conditions are those of the FREEDOM paper, and of ours with noise. The reference is the
//! high-fidelity model at conditions of the design [`ReferenceDesign::Test`](fdi_core::ReferenceDesign::Test);
//! what a diagnosis knows beforehand is learnt from other conditions, in the same setting. Errors are
//! deterministic by seed, at any number of threads; times come from the clock that the caller passes in.

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod ablation;
mod answers;
mod as_recorded;
mod chance;
mod clocks;
mod contender;
mod convergence;
mod evaluation;
mod noisy;
mod paired;
mod protocol;
mod reference;
mod request;
mod score;
mod search_view;
mod seeded_searches;
mod setting;
mod shorts;
mod start;
mod trials;
mod units;

pub use ablation::{AblationRequest, AblationScore, Compression, evaluate_compressions};
pub use answers::AnswersScore;
pub use as_recorded::{
    AsRecordedRequest, AsRecordedScore, BenchColumn, BenchForm, DriveLog, evaluate_as_recorded,
};
pub use clocks::{ClockFault, ClocksRequest, ClocksScore, evaluate_clocks};
pub use contender::Contender;
pub use convergence::SearchPoint;
pub use evaluation::evaluate;
pub use paired::{PairedComparison, holm};
pub use protocol::Protocol;
pub use reference::{Beforehand, ReferenceRequest, ReferenceScore, evaluate_references};
pub use request::{Clock, EvaluationError, EvaluationRequest};
pub use search_view::{SearchSpace, SearchView, SearchedScalar};
pub use seeded_searches::{DiscrepancyRay, SearchesOfSeed, SeededSearch, SeededSearches};
pub use setting::EvaluationSetting;
pub use shorts::{
    Agreement, ShortAnswers, ShortResult, ShortsRequest, compare_short, evaluate_shorts,
};
pub use start::{Beginning, BeginningRequest, BeginningScore, evaluate_beginnings};
pub use units::{
    BoundCase, Days, DecisionsLine, DecisionsResult, EffectLine, HiddenDamage, HiddenEffect,
    LearntLine, LearntResult, NumberBound, NumberScore, NumbersLine, NumbersResult, SetupsLine,
    SetupsResult, Stated, Symmetry, SymmetryResult, TogetherLine, TogetherResult, Unfit, UnitsLine,
    UnitsResult, UnitsScore, WearLine, bundle_at, bundle_of_scaled_torques, bundle_of_test,
    bundle_over_days, difference_of_diagnosers, effect_of_size, effects_of_both,
    evaluate_decisions, evaluate_effects, evaluate_learnt, evaluate_numbers, evaluate_setups,
    evaluate_symmetries, evaluate_together, evaluate_unfit, evaluate_units, evaluate_wear,
    hidden_recordings, number_bounds, over_days, plan_request, planned_test, test_by_hand,
    unit_bounds, unit_recordings,
};
