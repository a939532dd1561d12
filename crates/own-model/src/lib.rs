//! Names for the difference between recordings and a simulation of somebody else: causes at its ports
//! and among its numbers.
//!
//! ```text
//! OwnModel ─▶ Problem ─▶ scan ─▶ fit ─▶ evidence of sets of causes ─▶ verdict
//!    ports ◀── causes: effects of ema-sim, friction, drag, gain, delay, wrong numbers
//! ```
//!
//! The equations are in `docs/models/own-model.md`.

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod calibrate;
mod cause;
mod explain;
mod fit;
mod model;
mod ports;
mod problem;
mod propose;
mod scales;
mod scan;
mod search;

pub use calibrate::{OwnCalibration, calibrate};
pub use cause::CausePort;
pub use ema_sim::Geometry;
pub use explain::{
    ComparedSet, Estimate, NamedCause, OwnExplanation, OwnVerdict, SignalFit, explain,
};
pub use model::{ModelError, Number, OwnModel, Ports, Record, Recordings, Test};
pub use ports::PortsInUse;
pub use propose::{OwnProposal, ProposedTest, SetSeparation, propose};
