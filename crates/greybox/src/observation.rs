//! The model of what recordings show: which model of the machine predicts them.

use ema_sim::ModelFidelity;

/// Model that predicts what recordings show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Observation {
    /// Model with ideal electronics: no noise and no steps in its loops. The only one of an axis.
    Ideal,
    /// Low-fidelity model with noise and steps of the electronics in its loops.
    Low,
    /// High-fidelity model with noise and steps of the electronics in its loops.
    High,
}

impl Observation {
    /// All, the simplest first.
    pub const ALL: [Self; 3] = [Self::Ideal, Self::Low, Self::High];

    /// Word for it: `ideal`, `low`, `high`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Ideal => "ideal",
            Self::Low => "low",
            Self::High => "high",
        }
    }

    /// Model that is run with its electronics, if any.
    pub(crate) fn fidelity(self) -> Option<ModelFidelity> {
        match self {
            Self::Ideal => None,
            Self::Low => Some(ModelFidelity::Low),
            Self::High => Some(ModelFidelity::High),
        }
    }
}
