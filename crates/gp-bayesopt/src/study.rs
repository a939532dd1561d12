//! Ask where to look, tell what was seen.

#[cfg(feature = "serde")]
mod layout;
mod options;
mod region;
mod state;

pub use options::{Criterion, Objective, Reach, Stall, StudyOptions, SurrogateRule};
pub use state::{Ask, Best, Outcome, RunError, Study, StudyState, Told};
