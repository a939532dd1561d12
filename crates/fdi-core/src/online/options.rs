//! Settings of a diagnosis.

use std::sync::Arc;

use crate::{
    report::{Fidelity, Method, ToleranceUse},
    unit::learnt_unit::LearntUnit,
};

/// Settings of a diagnosis.
#[derive(Clone, Debug, PartialEq)]
pub struct DiagnoseOptions {
    /// How fault levels are searched.
    pub method: Method,
    /// Which model the recording is compared with in the end: the low-fidelity one with its
    /// learnt error, or from its answer on the high-fidelity one.
    pub fidelity: Fidelity,
    /// Most evaluations of the low-fidelity model in one search; `None`: 200 for `gls`, and
    /// 20 a fault and 10 for the scalar methods.
    pub max_evaluations: Option<usize>,
    /// Noise on each phase sample, where the user knows it, A.
    pub noise_a: Option<f64>,
    /// Largest time by which the recording may begin before or after the command, s: the delay is
    /// then estimated with the faults. Zero where they are triggered together.
    pub max_delay_s: f64,
    /// True where the surface may begin anywhere in its play and the integrator of the speed loop
    /// charged: both are then estimated with the faults.
    pub free_start: bool,
    /// Use of the tolerances of the machine.
    pub tolerance: ToleranceUse,
    /// The unit that the recording is of, where it was learnt: levels are changes since its
    /// recordings as new.
    pub unit: Option<Arc<LearntUnit>>,
    /// True where the answer is to say how well each fault can be told, and what would help.
    pub identifiability: bool,
    /// Seed of what is random.
    pub seed: u64,
}

impl Default for DiagnoseOptions {
    fn default() -> Self {
        Self {
            method: Method::Gls,
            fidelity: Fidelity::Low,
            max_evaluations: None,
            noise_a: None,
            max_delay_s: 0.0,
            free_start: false,
            tolerance: ToleranceUse::None,
            unit: None,
            identifiability: false,
            seed: 0,
        }
    }
}
