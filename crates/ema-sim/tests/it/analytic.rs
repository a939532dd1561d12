//! Cases with a closed solution.

use approx::assert_abs_diff_eq;
use ema_sim::{
    Actuator, Command, HealthState, HighFidelity, HighFidelityTrace, LowFidelity, PhysicalFaults,
    Scenario, presets::EMA_48,
};

/// Current that segments of 25 µs miss, A: `(t/τ)⁵/120` of 23.7 A, over the thirteen that τ spans.
const SEGMENT_A: f64 = 7e-6;
/// Share of the speed that the ripple of a commutated current leaves open.
const RIPPLE_REL: f64 = 1e-3;
/// Rounding of an exponential's difference over 1000 rad/s.
const EXPONENTIAL: f64 = 1e-9;
/// Rounding of a turn at constant speed, rad, over 40 segments.
const TURN_RAD: f64 = 1e-12;

/// A step to an angle at the start, without load.
fn step(angle_rad: f64, duration_s: f64) -> Scenario {
    Scenario {
        command: Command::Recorded { values_rad: vec![angle_rad], rate_hz: 1.0 },
        load_n_m: 0.0,
        duration_s,
        ..Scenario::chirp()
    }
}

fn healthy() -> PhysicalFaults {
    (&HealthState::HEALTHY).into()
}

fn run(actuator: &Actuator, scenario: &Scenario, faults: &PhysicalFaults) -> HighFidelityTrace {
    HighFidelity::new(actuator, scenario).expect("valid").simulate(faults)
}

/// The supply all used from the second carrier period on.
fn full_voltage() -> Actuator {
    let mut actuator = EMA_48;
    actuator.controller.current_limit_a = 1000.0;
    actuator.controller.speed_limit_rad_per_s = 1e5;
    actuator.controller.speed_gain_a_s_per_rad = 100.0;
    actuator.transmission.stop_rad = 10.0;
    actuator
}

#[test]
fn law_locked_rotor_current_rises_as_in_a_coil() {
    let mut actuator = full_voltage();
    actuator.transmission.static_friction_n_m = 1e3;
    let motor = actuator.motor;
    // phase A short-circuited by a tenth: unequal resistances and inductances
    let health = HealthState::new([0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.5]).unwrap();
    // at −30° electrical plus a little the pair is C and B; at 30° A and B
    let scenario = step(1.0, 0.01).turned_to(0.6 / 4.0);
    let trace = run(&actuator, &scenario, &(&health).into());
    let ohm = motor.resistance_ohm * 1.9;
    let henry = motor.inductance_henry * (0.81 + 1.0);
    for (tick, &current_a) in trace.phase_currents_a[0].iter().enumerate() {
        // the duty acts one carrier period after the sample
        let time_s = (tick as f64 * 1e-4 - 50e-6).max(0.0);
        let wanted_a = 48.0 / ohm * (1.0 - libm::exp(-time_s * ohm / henry));
        // each 25 µs segment misses (t/τ)⁵/120 of 23.7 A, and τ remembers thirteen of them
        assert_abs_diff_eq!(current_a, wanted_a, epsilon = SEGMENT_A);
        assert_eq!(trace.phase_currents_a[1][tick], -current_a);
        assert_eq!(trace.phase_currents_a[2][tick], 0.0);
    }
    assert!(trace.motor_speed_rad_per_s.iter().all(|w| *w == 0.0));
}

#[test]
fn law_no_load_speed_is_supply_over_torque_constant() {
    let mut actuator = full_voltage();
    actuator.motor.viscous_n_m_s_per_rad = 0.0;
    actuator.transmission.kinetic_friction_n_m = 0.0;
    actuator.transmission.static_friction_n_m = 0.0;
    let trace = run(&actuator, &step(9.0, 0.3), &healthy());
    let speed = trace.motor_speed_rad_per_s.last().copied().unwrap();
    let wanted = 48.0 / actuator.motor.torque_constant_n_m_per_a();
    // thirty mechanical time constants; commutation leaves a ripple of current
    assert_abs_diff_eq!(speed / wanted, 1.0, epsilon = RIPPLE_REL);
}

#[test]
fn law_coasting_ends_where_friction_says() {
    let mut actuator = EMA_48;
    actuator.controller.speed_gain_a_s_per_rad = 0.0;
    actuator.controller.speed_integral_a_per_rad = 0.0;
    let mut scenario = step(0.0, 0.2);
    scenario.initial.motor_speed_rad_per_s = 100.0;
    scenario.backlash_side_ratio = 1.0;
    let low = LowFidelity::new(&actuator, &scenario).unwrap().simulate(&healthy());
    let (j, c) = (actuator.total_inertia_kg_m2(), actuator.motor.viscous_n_m_s_per_rad);
    let f = actuator.transmission.kinetic_friction_n_m;
    let stops_s = j / c * libm::log(1.0 + c * 100.0 / f);
    for (tick, &speed) in low.motor_speed_rad_per_s.iter().enumerate() {
        let time_s = tick as f64 * 1e-4;
        let wanted = if time_s < stops_s {
            (100.0 + f / c) * libm::exp(-c / j * time_s) - f / c
        } else {
            0.0
        };
        // rounding of the exponential's difference over f/c = 1000 rad/s
        assert_abs_diff_eq!(speed, wanted, epsilon = EXPONENTIAL);
    }
    let turned = low.motor_angle_rad.last().copied().unwrap();
    let wanted = j / c * (100.0 - f * stops_s / j);
    assert_abs_diff_eq!(turned, wanted, epsilon = EXPONENTIAL);
}

#[test]
fn law_the_surface_rests_while_the_play_is_open() {
    let health = HealthState::new([0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.5]).unwrap();
    let trace = run(&EMA_48, &Scenario::chirp(), &(&health).into());
    let half_play = 0.5 * EMA_48.transmission.backlash_rad * (1.0 + 99.0 * 0.5);
    let samples = trace.motor_angle_rad.iter().zip(&trace.surface_angle_rad);
    let mut first_contact = false;
    for (motor_rad, surface_rad) in samples {
        let apart = motor_rad / EMA_48.transmission.gear_ratio - surface_rad;
        assert!(apart.abs() <= half_play * (1.0 + 1e-12), "{apart}");
        first_contact |= apart.abs() >= half_play * (1.0 - 1e-12);
        assert!(first_contact || *surface_rad == 0.0, "{surface_rad} before contact");
    }
    assert!(first_contact);
}

#[test]
fn a_flank_met_at_the_end_of_a_segment_costs_no_turn() {
    // at 200 rad/s half of the play, 12.5 mrad, is five periods of 12.5 µs to the last bit
    let mut actuator = EMA_48;
    actuator.motor.inertia_kg_m2 = 1e9;
    actuator.inverter.carrier_hz = 80e3;
    actuator.transmission.stop_rad = 10.0;
    let mut scenario = step(0.0, 0.01);
    scenario.initial.motor_speed_rad_per_s = 200.0;
    let model = HighFidelity::new(&actuator, &scenario).expect("valid");
    let trace = model.simulate_duties(&healthy(), &[[0.5; 3]; 80]).expect("within 0 to 1");
    for (tick, angle_rad) in trace.motor_angle_rad.iter().enumerate() {
        let wanted = 200.0 * 1e-4 * tick as f64;
        assert_abs_diff_eq!(*angle_rad, wanted, epsilon = TURN_RAD);
    }
}

#[test]
fn property_currents_sum_to_zero_with_unequal_phases() {
    let health = HealthState::new([0.0, 0.0, 0.5, 0.1, 0.0, 0.3, 0.2]).unwrap();
    let trace = run(&EMA_48, &Scenario::chirp(), &(&health).into());
    for sample in 0..trace.motor_angle_rad.len() {
        let sum: f64 = trace.phases_a(sample).iter().sum();
        assert_abs_diff_eq!(sum, 0.0, epsilon = 1e-14);
    }
}

#[test]
fn law_low_and_high_fidelity_agree_on_slow_motion() {
    // far from the supply's limit ripple and commutation are all that is between the two
    let command = Command::Sine { amplitude_rad: 0.02, frequency_hz: 1.0 };
    let scenario = Scenario { command, ..step(0.0, 0.5) };
    let high = run(&EMA_48, &scenario, &healthy());
    let low = LowFidelity::new(&EMA_48, &scenario).unwrap().simulate(&healthy());
    let pairs = high.motor_speed_rad_per_s.iter().zip(&low.motor_speed_rad_per_s);
    let (gap, size) =
        pairs.fold((0.0, 0.0), |(gap, size), (h, l)| (gap + (h - l) * (h - l), size + h * h));
    assert!((gap / size).sqrt() < 0.01, "{}", (gap / size).sqrt());
}
