//! Ask where to look, tell what was seen.

#[cfg(feature = "serde")]
mod layout;
mod options;
mod state;

pub use options::{Criterion, Objective, Stall, StudyOptions};
pub use state::{Ask, Best, Outcome, RunError, Study, StudyState, Told};
