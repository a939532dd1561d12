//! Effects that a simulation of a servo machine leaves out, found from recordings in closed loop.
//!
//! ```text
//! recordings ─▶ signal chain ─▶ Problem ─▶ fit ─▶ scan ─▶ rivals ─▶ verdict
//!                                ▲         │ noise   ▲ catalogue of ema-sim
//!                                └─ Machine (model, rough numbers, damage, effects)
//! ```
//!
//! The steps are in `docs/models/greybox.md`; [`explain`] is the whole chain.

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod ambiguous;
mod anchor;
mod calibrate;
mod curve;
mod damage;
mod detection_limit;
mod elsewhere;
mod error;
mod explain;
mod explained;
mod fit;
mod floor;
mod following;
mod gain;
mod gram;
mod hypothesis;
mod inject;
mod interval;
mod known;
mod machine;
mod mains;
mod median;
mod menu;
mod number;
mod observation;
mod observing;
mod parallel;
mod plausible;
mod prior;
mod problem;
mod profile;
mod propose;
mod random;
mod record;
mod response;
mod rival;
mod scan;
mod search;
mod show;
mod signal_chain;
mod structure;
mod suspects;
mod through_plant;
mod trial;
mod unexplained;

pub use ema_sim::CommandKind;

pub use calibrate::{Calibrated, CalibratedNumber, Tie, calibrate};
pub use curve::{CurveBin, Hypothesis, Refit, ResidualCurve};
pub use error::GreyboxError;
pub use explain::{Options, explain, with_holdout};
pub use explained::{
    Explained, FaultChange, FaultLevel, Finding, NumberFit, NumberInterval, RecordChange,
    SmallestNamed, Use, Verdict, WrongNumber,
};
pub use floor::{NoiseFloor, NoiseSource};
pub use inference::{Whitener, rms};
pub use inject::with_effect;
pub use observation::Observation;
pub use propose::{Proposal, Proposed, Separation, propose};
pub use record::{Record, Recordings};
pub use show::{CoordinateShare, RecordFit, Remainder};
pub use signal_chain::{
    FALSE_ALARM, SignalChannel, SignalCode, SignalEquation, SignalFind, SignalSize, Signals,
    check_signals, correct_signals,
};
pub use suspects::numbers_without_tolerance;
