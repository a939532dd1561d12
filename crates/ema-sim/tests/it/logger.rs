//! Currents as a logger samples them.

use approx::assert_abs_diff_eq;
use ema_sim::{
    Actuator, EffectId, FaultCoordinates, HealthState, HighFidelity, PhysicalFaults, Scenario,
    SimulationError,
    presets::{BENCH, EMA_48},
};

use super::effects::effect;

/// Rounding of the times of ticks that are summed up, times the rate of the currents, A.
const TICK_A: f64 = 1e-8;

fn short(scenario: Scenario) -> Scenario {
    Scenario { duration_s: 0.2, ..scenario }
}

fn damaged() -> PhysicalFaults {
    (&FaultCoordinates([0.1, 0.2, 0.05, 0.0, 0.1, 0.1, 0.3])).into()
}

fn model(actuator: &Actuator) -> HighFidelity {
    HighFidelity::new(actuator, &short(Scenario::chirp())).expect("a model")
}

/// Instants at a share of each tick.
fn instants_s(share: f64) -> Vec<f64> {
    (0..2000).map(|tick| (f64::from(tick) + share) / 10e3).collect()
}

#[test]
fn a_logger_in_step_with_the_ticks_sees_what_the_controller_sees() {
    let sensor = effect(EffectId::CurrentSensor, &[("offset_a", 0.1)]);
    let biased = model(&EMA_48).with_effects(&[sensor]).unwrap();
    let mut dead = EMA_48;
    dead.inverter.dead_time_s = 1e-6;
    for model in [model(&EMA_48), model(&BENCH), model(&dead), biased] {
        let (trace, logged) = model.simulate_logged(&damaged(), &instants_s(0.0)).unwrap();
        assert_eq!(trace, model.simulate(&damaged()));
        for (own, seen) in logged.phase_currents_a.iter().zip(&trace.phase_currents_a) {
            assert_eq!(own.len(), seen.len());
            for (own, seen) in own.iter().zip(seen) {
                assert_abs_diff_eq!(own, seen, epsilon = TICK_A);
            }
        }
        for (own, seen) in logged.motor_angle_rad.iter().zip(&trace.motor_angle_rad) {
            assert_abs_diff_eq!(own, seen, epsilon = TICK_A);
        }
    }
}

/// Ticks of the controller stand where the ripple crosses its mean, and so does the middle of a period
/// of the carrier, of which a tick has two. Where the legs are switched it is farthest from that.
#[test]
fn between_ticks_a_logger_sees_the_ripple() {
    let model = model(&EMA_48);
    let healthy = (&HealthState::HEALTHY).into();
    let mean_a = |share: f64| {
        let (_, logged) = model.simulate_logged(&healthy, &instants_s(share)).unwrap();
        let [a, b, c] = logged.phase_currents_a;
        let half = |n: usize| 0.5 * (a[n].abs() + b[n].abs() + c[n].abs());
        (0..2000).map(half).sum::<f64>() / 2000.0
    };
    let [tick, low, middle, high, next] = [0.0, 3.0 / 32.0, 0.25, 5.0 / 32.0, 0.5].map(mean_a);
    assert!(high - low > 0.05, "{low} {high}");
    for same in [middle, next, 0.5 * (low + high)] {
        assert_abs_diff_eq!(same, tick, epsilon = 1e-3);
    }
}

#[test]
fn instants_outside_the_test_or_out_of_order_are_refused() {
    let model = model(&EMA_48);
    let healthy = (&HealthState::HEALTHY).into();
    for instants_s in [vec![-1e-6], vec![0.2], vec![0.01, 0.009], vec![f64::NAN]] {
        let refused = model.simulate_logged(&healthy, &instants_s).unwrap_err();
        let of_logger =
            matches!(refused, SimulationError::Scenario { field: "logger.instants-s", .. });
        assert!(of_logger, "{refused} {instants_s:?}");
    }
}
