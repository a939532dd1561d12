//! What a simulation of a machine leaves out, found from recordings: see [`explain`].
mod error;
mod explain;
mod fit;
mod floor;
mod gram;
mod hypothesis;
mod machine;
mod noise;
mod parallel;
mod problem;
mod random;
mod record;
mod response;
mod rival;
mod scan;
mod show;
mod structure;

pub use error::GreyboxError;
pub use explain::{Explained, FaultChange, Finding, Options, Use, Verdict, explain};
pub use floor::NoiseSource;
pub use machine::Prediction;
pub use noise::{Whitener, rms};
pub use record::{CommandKind, Record, Recordings};
pub use show::{RecordFit, Remainder};
