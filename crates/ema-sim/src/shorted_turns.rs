//! Turns that a partial short circuit takes out of a phase: removed, or closed over a resistance.

use crate::{fault::PhysicalFaults, parameter::within, parameter_error::ParameterError};

/// Shorted turns of the faults `k3..k5`, as the high-fidelity model takes them.
///
/// # Source
///
/// `docs/models/motor.md`, section "Shorted turns as a loop".
///
/// # Examples
///
/// ```
/// use ema_sim::{HealthState, HighFidelity, Scenario, ShortedTurns, presets::EMA_48};
///
/// let mut actuator = EMA_48;
/// actuator.motor.shorted_turns = ShortedTurns::closed_over(0.05);
/// let scenario = Scenario { duration_s: 0.05, ..Scenario::chirp() };
/// let damaged = HealthState::new([0.0, 0.0, 0.05, 0.0, 0.0, 0.0, 0.5])?;
/// let (_, energy) =
///     HighFidelity::new(&actuator, &scenario)?.simulate_with_ledger(&(&damaged).into());
/// assert!(energy.short_circuit_j > 0.0);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum ShortedTurns {
    /// Turns that are gone and carry nothing: of a phase `R·N`, `L·N²`, `k_e·N` are left. The reading of
    /// the FREEDOM paper, and always that of the low-fidelity model.
    #[default]
    Removed,
    /// Turns that stay in the machine, closed over a resistance, with a current that circulates.
    Closed {
        /// Resistance of the fault between the two ends of the shorted turns, `R_f`, 0 to 1e6 Ω;
        /// zero is a bolted short circuit.
        resistance_ohm: f64,
        /// Share of a phase's inductance that is leakage, `σ`, 0.01 to 1: flux that a turn shares
        /// with no other.
        leakage_ratio: f64,
    },
}

impl ShortedTurns {
    /// Share of leakage where none is known: half of the phase's inductance. A choice of this
    /// project; `docs/validation/experiments.md` shows how little hangs on it.
    pub const DEFAULT_LEAKAGE_RATIO: f64 = 0.5;
    /// Least and largest resistance of the fault, Ω.
    pub const RESISTANCE_OHM: [f64; 2] = [0.0, 1e6];
    /// Least and largest share of leakage.
    pub const LEAKAGE_RATIO: [f64; 2] = [0.01, 1.0];

    /// Turns closed over a resistance, with the default share of leakage.
    pub fn closed_over(resistance_ohm: f64) -> Self {
        Self::Closed { resistance_ohm, leakage_ratio: Self::DEFAULT_LEAKAGE_RATIO }
    }

    /// Takes another share of leakage; of removed turns there is none.
    #[must_use]
    pub fn with_leakage_ratio(mut self, ratio: f64) -> Self {
        if let Self::Closed { leakage_ratio, .. } = &mut self {
            *leakage_ratio = ratio;
        }
        self
    }

    /// Share of leakage; of removed turns the default.
    pub fn leakage_ratio(self) -> f64 {
        match self {
            Self::Removed => Self::DEFAULT_LEAKAGE_RATIO,
            Self::Closed { leakage_ratio, .. } => leakage_ratio,
        }
    }

    /// Refuses a resistance or a share of leakage out of bounds.
    pub(crate) fn check(self) -> Result<(), ParameterError> {
        let Self::Closed { resistance_ohm, leakage_ratio } = self else { return Ok(()) };
        let ([least, most], [least_ratio, most_ratio]) =
            (Self::RESISTANCE_OHM, Self::LEAKAGE_RATIO);
        within("short-circuit.resistance-ohm", resistance_ohm, least, most)?;
        within("short-circuit.leakage-ratio", leakage_ratio, least_ratio, most_ratio)
    }

    /// The damage that the phases themselves show: turns in a loop of their own are still there.
    pub(crate) fn left_in_phases(self, faults: &PhysicalFaults) -> PhysicalFaults {
        match self {
            Self::Removed => *faults,
            Self::Closed { .. } => PhysicalFaults {
                healthy_turns_frac: faults.healthy_turns_frac.map(|turns| turns.max(1.0)),
                ..*faults
            },
        }
    }
}
