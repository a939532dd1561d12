//! Effects that feed the motion end a run by name; nothing else does.

use approx::assert_abs_diff_eq;
use ema_sim::{
    AxisInput, AxisScenario, AxisStart, Command, Coordinate, Curve, CurveKind, Drive, Effect,
    EffectId, Geometry, HealthState, HighFidelity, LowFidelity, Runaway, Scenario,
    ServoAxisSimulation, SimulationError,
    presets::{BENCH, EMA_48},
};

use super::effect_table::axis;

/// Two ticks of the controller, within which a run ends, s.
const TWO_TICKS_S: f64 = 2e-4;

fn healthy() -> ema_sim::PhysicalFaults {
    (&HealthState::HEALTHY).into()
}

fn effect(id: EffectId, numbers: &[(&str, f64)]) -> Effect {
    let mut effect = Effect::new(id, Geometry::Rotary);
    for (key, value) in numbers {
        effect.set(key, *value).expect("within bounds");
    }
    effect
}

/// What feeds the motion of EMA-48 beyond its supply, and what of it is named.
fn driving() -> Vec<(Vec<Effect>, Vec<EffectId>)> {
    let brake = effect(EffectId::InductanceEddy, &[("eddy_n_m_s_per_rad", 1e-4)]);
    let against = effect(EffectId::NonlinearViscous, &[("viscous_at_reference_n_m", -0.5)]);
    let steep = effect(
        EffectId::NonlinearViscous,
        &[("viscous_at_reference_n_m", -2.0), ("viscous_exponent", 2.5)],
    );
    let one_way =
        effect(EffectId::DirectionalFriction, &[("viscous_asymmetry_n_m_s_per_rad", -0.1)]);
    vec![
        (vec![against.clone()], vec![EffectId::NonlinearViscous]),
        (vec![brake, steep], vec![EffectId::NonlinearViscous]),
        (vec![one_way; 3], vec![EffectId::DirectionalFriction]),
    ]
}

/// Not all can be checked by figures: what is told is that it is beyond the bound.
fn told(error: &SimulationError, feeding: &[EffectId]) -> String {
    let SimulationError::Runaway(runaway) = error else { panic!("{error}") };
    let Runaway { time_s, speed, most, .. } = **runaway;
    assert!(time_s > 0.0 && time_s < 0.5 && speed.abs() > most, "{error}");
    assert_eq!(runaway.feeding, feeding);
    error.to_string()
}

#[test]
fn a_shaft_that_is_driven_away_ends_the_run_in_low_fidelity() {
    for (effects, feeding) in driving() {
        let model = LowFidelity::new(&EMA_48, &Scenario::chirp()).unwrap();
        let model = model.with_effects(&effects).unwrap();
        let message = told(
            &model.try_simulate(&healthy()).map(drop).expect_err(&format!("{effects:?}")),
            &feeding,
        );
        assert!(message.contains(feeding[0].info().symbol), "{message}");
        let trace = model.simulate(&healthy());
        assert_eq!(trace.current_a.len(), 5000);
        let finite = trace.current_a.iter().take_while(|i| i.is_finite()).count();
        let runaway = trace.runaway.expect("driven away");
        assert_abs_diff_eq!(finite as f64 * 1e-4, runaway.time_s, epsilon = TWO_TICKS_S);
        let mut current_a = Vec::new();
        model.simulate_current(&healthy(), &mut current_a);
        assert!(current_a.len() == 5000 && current_a[4999].is_nan());
    }
}

#[test]
fn a_shaft_that_is_driven_away_ends_the_run_in_high_fidelity() {
    for (effects, feeding) in driving() {
        let model = HighFidelity::new(&EMA_48, &Scenario::chirp()).unwrap();
        let model = model.with_effects(&effects).unwrap();
        told(
            &model.try_simulate(&healthy()).map(drop).expect_err(&format!("{effects:?}")),
            &feeding,
        );
        let trace = model.simulate(&healthy());
        assert!(trace.runaway.is_some() && trace.phase_currents_a[2][4999].is_nan());
        assert_eq!(trace.surface_angle_rad.len(), 5000);
    }
}

#[test]
fn the_bench_is_driven_away_in_both_fidelities() {
    let numbers = [
        ("viscous_at_reference_n_m", -0.02),
        ("reference_speed_rad_per_s", 1.0),
        ("viscous_exponent", 2.5),
    ];
    let effects = [effect(EffectId::NonlinearViscous, &numbers)];
    let mut scenario = Scenario::sine();
    scenario.duration_s = 0.5;
    let low = LowFidelity::new(&BENCH, &scenario).unwrap().with_effects(&effects).unwrap();
    let message = told(&low.try_simulate(&healthy()).unwrap_err(), &[EffectId::NonlinearViscous]);
    assert!(
        message.starts_with("the machine is driven away: ")
            // a hundred times 0.75·48 V over 1.5·0.050133 V·s/rad
            && message.contains("beyond the 47870 rad/s")
            && message.ends_with("E02 (non-linear viscous friction) can feed the motion"),
        "{message}"
    );
    let high = HighFidelity::new(&BENCH, &scenario).unwrap().with_effects(&effects).unwrap();
    told(&high.try_simulate(&healthy()).unwrap_err(), &[EffectId::NonlinearViscous]);
}

#[test]
fn an_axis_that_is_driven_away_ends_the_run() {
    let curve = Curve::new(
        Coordinate::Speed,
        CurveKind::Torque,
        vec![[-1.0, 0.05], [1.0, -0.05], [2.0, 0.0]],
    );
    let curve = Effect::tabulated(curve.unwrap(), Geometry::Rotary);
    let spring = effect(EffectId::Imbalance, &[("spring_n_m_per_rad", -50.0)]);
    let drag = effect(EffectId::DirectionalFriction, &[("viscous_asymmetry_n_m_s_per_rad", -0.2)]);
    for drive in [Drive::Current, Drive::Winding] {
        for (effects, feeding) in [
            (vec![spring.clone()], vec![EffectId::Imbalance]),
            (
                vec![curve.clone(), drag.clone(), drag.clone()],
                vec![EffectId::Tabulated, EffectId::DirectionalFriction],
            ),
        ] {
            let input =
                AxisInput::Position(Command::Sine { amplitude_rad: 1.0, frequency_hz: 0.5 });
            let scenario =
                AxisScenario { input, load: 0.0, duration_s: 0.4, start: AxisStart::default() };
            let axis = ServoAxisSimulation::new(&axis(drive), &scenario).unwrap();
            let axis = axis.with_effects(&effects).unwrap();
            told(&axis.try_simulate(&healthy()).unwrap_err(), &feeding);
            let trace = axis.simulate(&healthy());
            assert!(trace.force.len() == 400 && trace.force[399].is_nan());
        }
    }
}

/// As much as is accepted of what only brakes, and of torques that only swing.
#[test]
fn what_brakes_drives_nothing_away() {
    let peak_n_m = EMA_48.torque_constant_n_m_per_a() * EMA_48.controller.current_limit_a;
    let effects = [
        effect(EffectId::NonlinearViscous, &[("viscous_at_reference_n_m", 99.0 * peak_n_m)]),
        effect(EffectId::InductanceEddy, &[("eddy_n_m_s_per_rad", 0.25)]),
        effect(EffectId::MagnetLoss, &[("torque_constant_loss_ratio", 0.9)]),
        effect(EffectId::Cogging, &[("cogging_sin_n_m", peak_n_m)]),
    ];
    let mut scenario = Scenario::chirp();
    scenario.load_n_m = -1e4;
    scenario.initial.motor_speed_rad_per_s = 1e5;
    for effect in effects {
        let effects = core::slice::from_ref(&effect);
        let low = LowFidelity::new(&EMA_48, &scenario).unwrap().with_effects(effects).unwrap();
        assert_eq!(low.simulate(&healthy()).runaway, None, "{effect:?}");
        let high = HighFidelity::new(&EMA_48, &scenario).unwrap().with_effects(effects).unwrap();
        assert_eq!(high.simulate(&healthy()).runaway, None, "{effect:?}");
    }
}
