//! Settings of a setup.

use crate::{online::options::DiagnoseOptions, report::ActionLevels};

/// Settings of a setup.
#[derive(Clone, Debug)]
pub struct SetupOptions {
    /// Settings that recordings are learnt and diagnosed with.
    pub diagnosis: DiagnoseOptions,
    /// Levels of the damage in the simulated tests: those from which it is to be watched.
    pub levels: ActionLevels,
    /// Simulated tests of the unit without damage, and as many with damage.
    pub tests: usize,
    /// Simulations and diagnoses at the same time.
    pub jobs: usize,
}
