//! What a simulation of a servo machine leaves out, found from recordings in closed loop.
//!
//! ```text
//! recordings ─▶ Problem ─▶ fit ─▶ scan ─▶ rivals ─▶ verdict
//!                 ▲         │ noise   ▲ catalogue of ema-sim
//!                 └─ Machine (model, rough numbers, damage, effects)
//! ```
//!
//! The steps are in `docs/models/greybox.md`; [`explain`] is the whole chain.

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod calibrate;
mod curve;
mod elsewhere;
mod error;
mod explain;
mod explained;
mod fit;
mod floor;
mod follow;
mod gain;
mod gram;
mod hypothesis;
mod in_box;
mod known;
mod machine;
mod mains;
mod menu;
mod noise;
mod parallel;
mod problem;
mod propose;
mod random;
mod record;
mod response;
mod rival;
mod run;
mod scan;
mod search;
mod show;
mod structure;
mod through_plant;
mod trial;

pub use calibrate::{Calibrated, CalibratedNumber, calibrate};
pub use curve::{CurveBin, Hypothesis, Refit, ResidualCurve};
pub use error::GreyboxError;
pub use explain::{Options, explain};
pub use explained::{Explained, FaultChange, FaultLevel, Finding, Use, Verdict};
pub use floor::NoiseSource;
pub use machine::Prediction;
pub use noise::{Whitener, rms};
pub use propose::{Proposal, Proposed, propose};
pub use record::{CommandKind, Record, Recordings};
pub use show::{RecordFit, Remainder};
