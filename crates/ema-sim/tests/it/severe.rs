//! Damage far beyond the incipient: nothing breaks.

use ema_sim::{
    Actuator, Effect, EffectId, FaultId, FaultLevel, Geometry, HealthState, HighFidelity,
    LowFidelity, Scenario,
    presets::{BENCH, EMA_48},
};
use proptest::prelude::*;

#[test]
fn full_damage_of_every_fault_runs() {
    full_damage(&EMA_48);
}

#[test]
fn full_damage_of_every_fault_runs_on_the_bench() {
    full_damage(&BENCH);
}

fn full_damage(actuator: &Actuator) {
    let scenario = Scenario { duration_s: 0.1, ..Scenario::chirp() };
    let high = HighFidelity::new(actuator, &scenario).expect("valid");
    let low = LowFidelity::new(actuator, &scenario).expect("valid");
    let every = HealthState::new([1.0; 7]).expect("on the scale");
    let single = FaultId::ALL.map(|fault| HealthState::HEALTHY.with(fault, FaultLevel::FULL));
    for health in single.into_iter().chain([every]) {
        let faults = (&health).into();
        let trace = high.simulate(&faults);
        // with every winding shorted only the supply over what resistance is left bounds it
        let bound_a = if health == every { 5000.0 } else { 60.0 };
        for channel in &trace.phase_currents_a {
            assert!(
                channel.iter().all(|x| x.abs() < bound_a),
                "{health:?} {:?}",
                channel.iter().fold(0.0_f64, |m, x| m.max(x.abs()))
            );
        }
        assert!(trace.surface_angle_rad.iter().all(|x| x.abs() < 0.1), "{health:?}");
        assert!(low.simulate(&faults).current_a.iter().all(|x| x.abs() <= 20.0), "{health:?}");
    }
}

/// Effects with a place of their own in the high-fidelity model.
const IN_PLACE: [EffectId; 8] = [
    EffectId::Compliance,
    EffectId::Saturation,
    EffectId::ResistanceDrift,
    EffectId::DeadTime,
    EffectId::BusSag,
    EffectId::CurrentSensor,
    EffectId::BackEmfShape,
    EffectId::HallOffset,
];

/// The effect with its numbers anywhere between their bounds, on a scale of powers of ten.
fn drawn(id: EffectId, draws: &[f64]) -> Effect {
    let mut effect = Effect::new(id, Geometry::Rotary);
    for (parameter, draw) in id.info().parameters.iter().zip(draws) {
        let (least, most) = parameter.bounds();
        let sign = if *draw < 0.0 { least.signum() } else { 1.0 };
        let size = most.max(-least) * libm::pow(10.0, -8.0 * (1.0 - draw.abs()));
        let key = parameter.key(Geometry::Rotary);
        effect.set(key, (sign * size).clamp(least, most)).expect("within bounds");
    }
    effect
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, ..Default::default() })]

    #[test]
    fn property_effects_within_bounds_leave_numbers(
        on in prop::array::uniform8(any::<bool>()),
        draws in prop::array::uniform32(-1.0..1.0_f64),
        levels in prop::array::uniform7(0.0..1.0_f64),
    ) {
        let scenario = Scenario { duration_s: 4e-3, ..Scenario::chirp() };
        let faults = (&HealthState::new(levels).expect("on the scale")).into();
        let mut rigid = BENCH;
        rigid.transmission.surface_friction_n_m = 0.0;
        for actuator in [EMA_48, rigid] {
            let mut model = HighFidelity::new(&actuator, &scenario).expect("valid");
            let mut taken = Vec::new();
            for (n, id) in IN_PLACE.into_iter().enumerate().filter(|(n, _)| on[*n]) {
                taken.push(drawn(id, &draws[4 * n..]));
                match model.clone().with_effects(&taken) {
                    Ok(with) => model = with,
                    Err(_) => drop(taken.pop()),
                }
            }
            let trace = model.simulate(&faults);
            let [a, b, c] = &trace.phase_currents_a;
            for x in a.iter().chain(b).chain(c).chain(&trace.surface_angle_rad) {
                prop_assert!(x.is_finite(), "{taken:?}");
            }
        }
    }
}
