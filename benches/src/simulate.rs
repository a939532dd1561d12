//! Cases of the simulators: the chirp and the sine on a healthy and a worn actuator.

use ema_sim::{
    Effect, EffectId, FaultCoordinates, Geometry, HealthState, HighFidelity, LowFidelity,
    PhysicalFaults, Role, Scenario, presets::EMA_48,
};

/// One test on one state of health, in both fidelities.
#[derive(Debug)]
pub struct Case {
    /// Name in the bench.
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

/// Fault vectors of a batch, incipient and all different: `k = 0.05·frac(n·g)`, with another
/// irrational `g` for each coordinate.
pub fn batch(count: u32) -> Vec<PhysicalFaults> {
    let steps = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0].map(f64::sqrt);
    let vector = |n: u32| steps.map(|g| 0.05 * (f64::from(n) * g).fract());
    (0..count).map(|n| (&FaultCoordinates(vector(n))).into()).collect()
}

/// The chirp in low fidelity with each effect that EMA-48 can have, of the size worth trying first.
///
/// # Errors
///
/// None for this actuator; what the simulator refuses is passed on.
pub fn with_each_effect() -> anyhow::Result<Vec<(EffectId, LowFidelity)>> {
    let plain = LowFidelity::new(&EMA_48, &Scenario::chirp())?;
    let scales = plain.scales(&plain.simulate(&(&HealthState::HEALTHY).into()));
    let mut all = Vec::new();
    for id in EffectId::ALL {
        let mut effect = Effect::new(id, Geometry::Rotary);
        for parameter in id.info().parameters.iter().filter(|p| p.role() == Role::Amplitude) {
            let (least, most) = parameter.bounds();
            let size = parameter.typical_size(&scales).clamp(least, most);
            effect.set(parameter.key(Geometry::Rotary), size)?;
        }
        // a curve has no usual one, and what the actuator cannot have is refused
        if let Ok(with) = plain.clone().with_effects(&[effect]) {
            all.push((id, with));
        }
    }
    Ok(all)
}
