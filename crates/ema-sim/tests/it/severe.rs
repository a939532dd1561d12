//! Damage far beyond the incipient: nothing breaks.

use ema_sim::{
    Actuator, Coordinate, Curve, CurveKind, Effect, EffectId, FaultId, FaultLevel, Geometry,
    HealthState, HighFidelity, LowFidelity, Runaway, Scenario,
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
        // the set-point is within 20 A; a loop whose winding is gone overshoots it by a hundredth
        let (least_a, most_a) = low
            .simulate(&faults)
            .current_a
            .iter()
            .fold((0.0_f64, 0.0_f64), |(low, high), x| (low.min(*x), high.max(*x)));
        assert!(least_a > -20.5 && most_a < 20.5, "{health:?} {least_a} {most_a}");
    }
}

/// The cogging that once held the solution at one instant for ever: the torque's edge lies where
/// the open terminal comes to a rail.
#[test]
fn cogging_beyond_the_motor_comes_to_an_end() {
    let healthy = (&HealthState::HEALTHY).into();
    for scenario in [Scenario::chirp(), Scenario::chirp().with_real_electronics(1)] {
        for size_n_m in [-2.5, -3.0, -4.0] {
            let cogging = Effect::new(EffectId::Cogging, Geometry::Rotary)
                .with("cogging_sin_n_m", size_n_m)
                .and_then(|e| e.with("order", 24.0))
                .expect("within bounds");
            let model = HighFidelity::new(&EMA_48, &scenario).expect("valid");
            let trace = model.with_effects(&[cogging]).expect("taken").simulate(&healthy);
            // without cogging there are 5e4
            assert!(trace.segments < 60_000, "{size_n_m}: {}", trace.segments);
            assert!(trace.surface_angle_rad.iter().all(|x| x.abs() < 1e-3), "{size_n_m}");
        }
    }
}

/// A level of damage, full as often as not.
fn level() -> impl Strategy<Value = f64> {
    prop_oneof![Just(1.0), 0.0..1.0_f64]
}

/// The effect with its numbers anywhere between their bounds, on a scale of powers of ten.
fn drawn(id: EffectId, draws: &[f64]) -> Effect {
    let mut effect = Effect::new(id, Geometry::Rotary);
    if id == EffectId::Tabulated {
        let (over, kind) =
            (Coordinate::ALL[places(draws[1], 4)].1, CurveKind::ALL[places(draws[2], 2)].1);
        let points = vec![[-0.1, draws[3]], [0.0, draws[4]], [0.1, draws[3] - draws[4]]];
        effect =
            Effect::tabulated(Curve::new(over, kind, points).expect("in order"), Geometry::Rotary);
    }
    for (parameter, draw) in id.info().parameters.iter().zip(draws) {
        let (least, most) = parameter.bounds();
        let sign = if *draw < 0.0 { least.signum() } else { 1.0 };
        let size = most.max(-least) * libm::pow(10.0, -8.0 * (1.0 - draw.abs()));
        let key = parameter.key(Geometry::Rotary);
        effect.set(key, (sign * size).clamp(least, most)).expect("within bounds");
    }
    effect
}

/// One of so many places, by a draw from −1 to 1.
fn places(draw: f64, many: usize) -> usize {
    ((draw.abs() * many as f64) as usize).min(many - 1)
}

/// Effects of which each is on once in four.
fn effects() -> impl Strategy<Value = Vec<Effect>> {
    let each = EffectId::ALL.map(|id| {
        let on =
            prop::array::uniform5(-1.0..1.0_f64).prop_map(move |draws| Some(drawn(id, &draws)));
        prop_oneof![3 => Just(None), 1 => on]
    });
    each.to_vec().prop_map(|effects| effects.into_iter().flatten().collect())
}

/// Whether a run ended early and says which effects feed the motion.
fn driven(runaway: Option<&Runaway>) -> bool {
    runaway.is_some_and(|runaway| !runaway.feeding.is_empty())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, ..Default::default() })]

    /// Torques, circuit, sensors, commutation, an elastic shaft: whatever a model takes, on a
    /// machine with any damage.
    #[test]
    fn property_effects_within_bounds_leave_numbers(
        effects in effects(),
        levels in prop::array::uniform7(level()),
    ) {
        let scenario = Scenario { duration_s: 4e-3, ..Scenario::chirp() };
        let faults = (&HealthState::new(levels).expect("on the scale")).into();
        let mut rigid = BENCH;
        rigid.transmission.surface_friction_n_m = 0.0;
        for actuator in [EMA_48, rigid] {
            let mut high = HighFidelity::new(&actuator, &scenario).expect("valid");
            let mut low = LowFidelity::new(&actuator, &scenario).expect("valid");
            let (mut in_high, mut in_low) = (Vec::new(), Vec::new());
            for effect in &effects {
                in_high.push(effect.clone());
                match high.clone().with_effects(&in_high) {
                    Ok(with) => high = with,
                    Err(_) => drop(in_high.pop()),
                }
                in_low.push(effect.clone());
                match low.clone().with_effects(&in_low) {
                    Ok(with) => low = with,
                    Err(_) => drop(in_low.pop()),
                }
            }
            let trace = high.simulate(&faults);
            let [a, b, c] = &trace.phase_currents_a;
            for x in a.iter().chain(b).chain(c).chain(&trace.surface_angle_rad) {
                prop_assert!(x.is_finite() || driven(trace.runaway.as_ref()), "{in_high:?}");
            }
            let trace = low.simulate(&faults);
            for x in trace.current_a.iter().chain(&trace.surface_angle_rad) {
                prop_assert!(x.is_finite() || driven(trace.runaway.as_ref()), "{in_low:?}");
            }
        }
    }
}
