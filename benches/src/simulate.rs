//! Cases of the simulators: the chirp and the sine on a healthy and a worn actuator.

use ema_sim::{HealthState, HighFidelity, LowFidelity, PhysicalFaults, Scenario, presets::EMA_48};

/// One test on one state of health, in both fidelities.
#[derive(Debug)]
pub struct Case {
    /// What the bench calls it.
    pub id: &'static str,
    /// The reference.
    pub high: HighFidelity,
    /// The monitor.
    pub low: LowFidelity,
    /// Damage.
    pub faults: PhysicalFaults,
    /// Samples that a run must give.
    pub samples: usize,
}

/// The chirp and the sine, healthy and worn.
///
/// # Errors
///
/// None for these cases; what the simulators refuse is passed on.
pub fn cases() -> anyhow::Result<Vec<Case>> {
    let worn = HealthState::new([0.04, 0.02, 0.05, 0.0, 0.03, 0.05, 0.7])?;
    let case = |id, scenario: &Scenario, health: &HealthState, samples| -> anyhow::Result<Case> {
        Ok(Case {
            id,
            high: HighFidelity::new(&EMA_48, scenario)?,
            low: LowFidelity::new(&EMA_48, scenario)?,
            faults: health.into(),
            samples,
        })
    };
    let (chirp, sine) = (Scenario::chirp(), Scenario::sine());
    Ok(vec![
        case("chirp/healthy", &chirp, &HealthState::HEALTHY, 5_000)?,
        case("chirp/worn", &chirp, &worn, 5_000)?,
        case("sine/healthy", &sine, &HealthState::HEALTHY, 50_000)?,
        case("sine/worn", &sine, &worn, 50_000)?,
    ])
}
