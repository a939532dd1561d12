//! The dead time of the inverter.

use approx::assert_abs_diff_eq;
use ema_sim::{
    Actuator, Envelope, EnvelopeFilter, HealthState, HighFidelity, PhysicalFaults, Scenario,
    SimulationError,
    presets::{BENCH, EMA_48},
};

const DEAD_TIME_S: f64 = 1e-6;

fn with_dead_time(mut actuator: Actuator, dead_time_s: f64) -> Actuator {
    actuator.inverter.dead_time_s = dead_time_s;
    actuator
}

fn healthy() -> PhysicalFaults {
    (&HealthState::HEALTHY).into()
}

#[test]
fn law_a_leg_loses_dead_time_times_carrier_of_the_supply() {
    let mut locked = BENCH;
    locked.transmission.static_friction_n_m = 1e3;
    let scenario = Scenario { load_n_m: 0.0, ..Scenario::sine() };
    // phase A carries a current in, B and C half of it out each, and the other way round
    for sign in [1.0, -1.0] {
        let duties = [0.5 + 0.3 * sign, 0.5 - 0.15 * sign, 0.5 - 0.15 * sign];
        let settled_a = |dead_time_s: f64| {
            let model = HighFidelity::new(&with_dead_time(locked, dead_time_s), &scenario).unwrap();
            let trace = model.simulate_duties(&healthy(), &vec![duties; 400]).unwrap();
            trace.phase_currents_a[0].last().copied().unwrap()
        };
        let (motor, inverter) = (&locked.motor, &locked.inverter);
        // the star point takes a third of the legs' errors, which are −, + and +
        let lost_v = 4.0 / 3.0 * inverter.bus_voltage_v * DEAD_TIME_S * inverter.carrier_hz * sign;
        let (none_a, dead_a) = (settled_a(0.0), settled_a(DEAD_TIME_S));
        let wanted_a = lost_v / motor.resistance_ohm;
        // while all legs are low the current falls by R·i/L; edges that move by a dead time move
        // the sample along that slope
        let slack_a = motor.resistance_ohm * none_a.abs() / motor.inductance_henry * DEAD_TIME_S;
        assert_abs_diff_eq!(none_a - dead_a, wanted_a, epsilon = slack_a);
    }
}

#[test]
fn law_energy_is_balanced_with_a_dead_time() {
    let levels = [0.04, 0.02, 0.05, 0.0, 0.03, 0.05, 0.7];
    let worn = PhysicalFaults::from(&HealthState::new(levels).unwrap());
    for (preset, envelope) in [(EMA_48, Envelope::ConductingPhase), (BENCH, Envelope::QAxis)] {
        let run = |dead_time_s: f64| {
            let actuator = with_dead_time(preset, dead_time_s);
            let model = HighFidelity::new(&actuator, &Scenario::chirp()).unwrap();
            let (trace, energy) = model.simulate_with_ledger(&worn);
            let off = energy.residual_j() / energy.dissipated_j();
            assert_abs_diff_eq!(off, 0.0, epsilon = 1e-6);
            let raw = trace.envelope_a(envelope, preset.motor.pole_pairs);
            EnvelopeFilter::DEFAULT.apply(&raw, trace.rate_hz)
        };
        let (none, dead) = (run(0.0), run(DEAD_TIME_S));
        let size: f64 = none.iter().map(|x| x * x).sum();
        let gap: f64 = none.iter().zip(&dead).map(|(a, b)| (a - b) * (a - b)).sum();
        let gap = (gap / size).sqrt();
        // a volt at each zero of a current, which the current loop rejects all but the edge of
        assert!(gap > 1e-4 && gap < 0.05, "{gap}");
    }
}

#[test]
fn a_dead_time_longer_than_a_tenth_of_the_period_is_refused() {
    let error = HighFidelity::new(&with_dead_time(EMA_48, 6e-6), &Scenario::chirp()).unwrap_err();
    assert!(matches!(error, SimulationError::Parameter(_)));
    assert!(error.to_string().contains("inverter.dead-time-s"), "{error}");
}
