//! Damage far beyond the incipient: nothing breaks.

use ema_sim::{
    Actuator, FaultId, FaultLevel, HealthState, HighFidelity, LowFidelity, Scenario,
    presets::{BENCH, EMA_48},
};

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
