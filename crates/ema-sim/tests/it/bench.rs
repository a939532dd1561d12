//! The bench of the FREEDOM paper: a sinusoidal machine under a field-oriented drive.

use approx::assert_abs_diff_eq;
use ema_sim::{
    Actuator, BackEmfShape, BackEmfTable, Command, ControlMode, CurrentControl, Envelope,
    EnvelopeFilter, FaultCoordinates, HealthState, HighFidelity, HighFidelityTrace, LowFidelity,
    PhysicalFaults, Scenario,
    presets::{BENCH, EMA_48},
};

/// Rounding of the speed that is left after 0.5 s of settling, over it.
const SETTLED_REL: f64 = 1e-9;

/// The monitor has the current loop along q, without its delay and without what the d axis does
/// to it: rms over rms on a healthy machine, and of the magnitude of a fault's signature.
const HEALTHY_GAP: f64 = 0.005;
const MAGNITUDE: f64 = 0.03;
const COSINE: f64 = 0.98;

/// Central differences of the envelope at steps of 1e-3 and 1e-4, rms of their difference over rms.
const SMOOTH: f64 = 0.02;

/// A second of a motion as fast as the bench's: 0.12 rad at 0.2 Hz has the same peak speed.
fn motion() -> Scenario {
    Scenario {
        command: Command::Sine { amplitude_rad: 0.024, frequency_hz: 1.0 },
        load_n_m: 0.0,
        duration_s: 1.0,
        ..Scenario::chirp()
    }
}

fn single(coordinate: usize, level: f64) -> PhysicalFaults {
    let mut coordinates = [0.0; 7];
    coordinates[coordinate] = level;
    (&FaultCoordinates(coordinates)).into()
}

fn healthy() -> PhysicalFaults {
    (&HealthState::HEALTHY).into()
}

fn high_signal(model: &HighFidelity, faults: &PhysicalFaults) -> Vec<f64> {
    let trace = model.simulate(faults);
    let raw = trace.envelope_a(Envelope::QAxis, BENCH.motor.pole_pairs);
    EnvelopeFilter::DEFAULT.apply(&raw, trace.rate_hz)
}

fn low_signal(model: &LowFidelity, faults: &PhysicalFaults) -> Vec<f64> {
    let trace = model.simulate(faults);
    EnvelopeFilter::DEFAULT.apply(&trace.current_a, trace.rate_hz)
}

fn rms(signal: &[f64]) -> f64 {
    (signal.iter().map(|x| x * x).sum::<f64>() / signal.len() as f64).sqrt()
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

#[test]
fn law_energy_is_balanced_under_field_orientation() {
    let levels = [0.04, 0.02, 0.05, 0.0, 0.03, 0.05, 0.7];
    let worn = PhysicalFaults::from(&HealthState::new(levels).unwrap());
    let model = HighFidelity::new(&BENCH, &Scenario::chirp().with_real_electronics(3)).unwrap();
    for faults in [healthy(), worn] {
        let (trace, energy) = model.simulate_with_ledger(&faults);
        let off = energy.residual_j() / energy.dissipated_j();
        assert!(off.abs() < 1e-6, "{off:e} {energy:?}");
        assert_eq!(energy.diode_supply_j, 0.0, "no leg is ever open");
        assert_eq!(trace, model.simulate(&faults), "watching changes no bit");
    }
}

#[test]
fn order_finer_segments_change_nothing_on_the_bench() {
    let model = HighFidelity::new(&BENCH, &Scenario::chirp()).unwrap();
    let coarse = model.simulate(&healthy());
    let (fine, _) = model.simulate_finer(&healthy(), 1.0 / 40.0);
    assert!(fine.segments > 4 * coarse.segments, "{} {}", fine.segments, coarse.segments);
    for (a, b) in coarse.phase_currents_a.iter().zip(&fine.phase_currents_a) {
        let gap = rms(&minus(a, b)) / rms(b);
        assert!(gap < 1e-5, "{gap:e}");
    }
}

#[test]
fn the_current_is_in_quadrature_to_the_rotor() {
    let trace = HighFidelity::new(&BENCH, &motion()).unwrap().simulate(&healthy());
    let (mut direct, mut quadrature) = (Vec::new(), Vec::new());
    for sample in 0..trace.motor_angle_rad.len() {
        let [a, b, c] = trace.phases_a(sample);
        let theta_e = 4.0 * trace.motor_angle_rad[sample];
        let third = core::f64::consts::TAU / 3.0;
        let along =
            |f: fn(f64) -> f64| a * f(theta_e) + b * f(theta_e - third) + c * f(theta_e + third);
        direct.push(-2.0 / 3.0 * along(f64::cos));
        quadrature.push(2.0 / 3.0 * along(f64::sin));
    }
    let envelope = trace.envelope_a(Envelope::QAxis, 4);
    assert!(rms(&minus(&quadrature, &envelope)) < 1e-12);
    // the delay of one and a half periods leaks 1.5·T·P·ω of the voltage, 0.0225 at 75 rad/s;
    // the loop's integral takes most of it back
    assert!(rms(&direct) < 0.02 * rms(&quadrature), "{} {}", rms(&direct), rms(&quadrature));
}

#[test]
fn law_low_and_high_fidelity_agree_on_the_bench() {
    let (high, low) = (
        HighFidelity::new(&BENCH, &motion()).unwrap(),
        LowFidelity::new(&BENCH, &motion()).unwrap(),
    );
    let (high_zero, low_zero) = (high_signal(&high, &healthy()), low_signal(&low, &healthy()));
    let gap = rms(&minus(&high_zero, &low_zero)) / rms(&high_zero);
    assert!(gap < HEALTHY_GAP, "healthy gap {gap}");
    for (coordinate, name) in FaultCoordinates::NAMES.iter().enumerate() {
        let faults = single(coordinate, 0.05);
        let h = minus(&high_signal(&high, &faults), &high_zero);
        let l = minus(&low_signal(&low, &faults), &low_zero);
        let dot = h.iter().zip(&l).map(|(a, b)| a * b).sum::<f64>() / h.len() as f64;
        let cosine = dot / (rms(&h) * rms(&l));
        assert!(rms(&h) > 1e-3, "{name} acts");
        assert!(cosine > COSINE, "{name}: {cosine}");
        let magnitude = rms(&l) / rms(&h);
        assert!((magnitude - 1.0).abs() < MAGNITUDE, "{name}: {magnitude}");
    }
}

/// A shaft at rest breaks away while the current rises within a tick, not at a tick.
#[test]
fn law_the_instant_of_breaking_away_moves_with_the_friction() {
    let low = LowFidelity::new(&BENCH, &Scenario::chirp()).unwrap();
    let mut all: Vec<f64> = (0..9)
        .map(|base| {
            let slope = |step: f64| {
                let at =
                    |by: f64| low_signal(&low, &single(0, 0.005 + 0.005 * f64::from(base) + by));
                minus(&at(step), &at(-step)).iter().map(|d| d / (2.0 * step)).collect::<Vec<_>>()
            };
            let (wide, narrow) = (slope(1e-3), slope(1e-4));
            rms(&minus(&narrow, &wide)) / rms(&wide)
        })
        .collect();
    all.sort_by(f64::total_cmp);
    assert!(all[4] < SMOOTH, "{all:?}");
}

#[test]
fn law_no_load_speed_of_the_bench() {
    let mut free = BENCH;
    free.motor.viscous_n_m_s_per_rad = 0.0;
    free.transmission.kinetic_friction_n_m = 0.0;
    free.transmission.static_friction_n_m = 0.0;
    free.transmission.surface_friction_n_m = 0.0;
    free.transmission.stop_rad = 1e3;
    free.controller.speed_limit_rad_per_s = 1e4;
    let command = Command::Recorded { values_rad: vec![2.0], rate_hz: 1.0 };
    let test = Scenario { command, mode: ControlMode::Speed, duration_s: 0.5, ..motion() };
    let low = LowFidelity::new(&free, &test).unwrap().simulate(&healthy());
    let high = HighFidelity::new(&free, &test).unwrap().simulate(&healthy());
    let wanted = 0.5 * BENCH.inverter.bus_voltage_v / BENCH.motor.back_emf_v_s_per_rad;
    let reached = |speed: &[f64]| speed.last().copied().unwrap() / wanted;
    assert_abs_diff_eq!(reached(&low.motor_speed_rad_per_s), 1.0, epsilon = SETTLED_REL);
    // one and a half periods of delay turn the voltage by 1.5·T·P·ω = 0.14 rad away from the
    // back-EMF, and the current that this drives along the d axis takes more
    let high = reached(&high.motor_speed_rad_per_s);
    assert!((0.95..0.99).contains(&high), "{high}");
}

#[test]
fn a_brake_acts_before_the_play_and_no_fault_scales_it() {
    let braked = |brake_n_m: f64| Scenario { brake_n_m, ..motion() };
    let worn = single(0, 0.5);
    let of = |actuator, scenario: &Scenario, faults: &PhysicalFaults| {
        HighFidelity::new(actuator, scenario).unwrap().simulate(faults)
    };
    // a brake of F is a friction of F more
    let mut stiff = BENCH;
    stiff.transmission.kinetic_friction_n_m += 0.03;
    stiff.transmission.static_friction_n_m += 0.03;
    assert_eq!(of(&BENCH, &braked(0.03), &healthy()), of(&stiff, &motion(), &healthy()));
    assert_ne!(of(&BENCH, &braked(0.03), &worn), of(&stiff, &motion(), &worn));
}

#[test]
fn controls_of_the_other_drive_are_refused() {
    let control = CurrentControl::Hysteresis { half_band_a: 0.15 };
    let model = HighFidelity::new(&BENCH, &motion()).unwrap();
    let error = model.with_current_control(control).unwrap_err();
    assert_eq!(
        error.to_string(),
        "hysteresis control is not for a drive whose `inverter.commutation` is field-oriented"
    );
    let model = HighFidelity::new(&EMA_48, &motion()).unwrap();
    assert!(model.with_current_control(CurrentControl::Averaged).is_err());
}

#[test]
fn the_carrier_without_its_ripple_is_its_average() {
    let model = HighFidelity::new(&BENCH, &motion()).unwrap();
    let averaged = model.clone().with_current_control(CurrentControl::Averaged).unwrap();
    let (a, b) = (high_signal(&averaged, &healthy()), high_signal(&model, &healthy()));
    let gap = rms(&minus(&a, &b)) / rms(&b);
    assert!(gap < 0.01, "{gap}");
}

/// A table of a sine with a fifth and a seventh harmonic.
fn tabulated(fifth: f64, seventh: f64) -> Actuator {
    let samples: Vec<f64> = (0..72)
        .map(|n| {
            let x = core::f64::consts::TAU * f64::from(n) / 72.0;
            x.sin() + fifth * (5.0 * x).sin() + seventh * (7.0 * x).sin()
        })
        .collect();
    let mut actuator = BENCH;
    actuator.motor.back_emf_shape =
        BackEmfShape::Tabulated(BackEmfTable::new(&samples).expect("a machine"));
    actuator
}

#[test]
fn law_a_table_of_a_sine_is_the_sine() {
    let worn =
        PhysicalFaults::from(&HealthState::new([0.04, 0.02, 0.05, 0.0, 0.03, 0.05, 0.7]).unwrap());
    let of = |actuator: &Actuator| {
        let high = HighFidelity::new(actuator, &Scenario::chirp()).unwrap();
        let low = LowFidelity::new(actuator, &Scenario::chirp()).unwrap();
        (high_signal(&high, &worn), low_signal(&low, &worn))
    };
    let (sine, tabulated) = (of(&BENCH), of(&tabulated(0.0, 0.0)));
    // the spline of 72 samples misses h⁴/384 = 1.5e-7 of the peak, and the shaft follows
    assert!(rms(&minus(&sine.0, &tabulated.0)) < 1e-5 * rms(&sine.0));
    assert!(rms(&minus(&sine.1, &tabulated.1)) < 1e-5 * rms(&sine.1));
}

#[test]
fn law_energy_and_fidelities_with_a_measured_shape() {
    let actuator = tabulated(0.03, -0.02);
    let model = HighFidelity::new(&actuator, &Scenario::chirp()).unwrap();
    let (_, energy) = model.simulate_with_ledger(&healthy());
    let off = energy.residual_j() / energy.dissipated_j();
    assert_abs_diff_eq!(off, 0.0, epsilon = 1e-6);
    let (high, low) = (
        HighFidelity::new(&actuator, &motion()).unwrap(),
        LowFidelity::new(&actuator, &motion()).unwrap(),
    );
    let (h, l) = (high_signal(&high, &healthy()), low_signal(&low, &healthy()));
    let gap = rms(&minus(&h, &l)) / rms(&h);
    assert!(gap < HEALTHY_GAP, "{gap}");
    let sine = high_signal(&HighFidelity::new(&BENCH, &motion()).unwrap(), &healthy());
    assert!(rms(&minus(&h, &sine)) > 1e-3 * rms(&h), "the harmonics act");
}

/// The bench's machine without friction, its terminals joined, from 200 rad/s for 5 ms.
fn braked(carrier_hz: f64, inertia_kg_m2: f64) -> HighFidelityTrace {
    let mut actuator = BENCH;
    actuator.motor.inertia_kg_m2 = inertia_kg_m2;
    actuator.inverter.carrier_hz = carrier_hz;
    let t = &mut actuator.transmission;
    (t.kinetic_friction_n_m, t.static_friction_n_m, t.surface_friction_n_m) = (0.0, 0.0, 0.0);
    t.stop_rad = 1e6;
    let mut scenario = Scenario { load_n_m: 0.0, ..Scenario::sine() }.turned_to(0.3);
    scenario.initial.motor_speed_rad_per_s = 200.0;
    let model = HighFidelity::new(&actuator, &scenario).expect("valid");
    let model = model.with_current_control(CurrentControl::Averaged).expect("field-oriented");
    let duties = vec![[0.5; 3]; (5e-3 * carrier_hz).round() as usize];
    model.simulate_duties(&healthy(), &duties).expect("within 0 to 1")
}

/// Largest error of each phase against the closed solution at constant speed.
///
/// ```text
/// L·i' = −R·i − k·ω·sin(P·ω·t + φ)      a right-hand side that depends on time
/// ```
fn errors_of_segments(carrier_hz: f64) -> [f64; 3] {
    // a flywheel keeps the speed to 1e-12 of it
    let trace = braked(carrier_hz, 1e9);
    let (r, l) = (BENCH.motor.resistance_ohm, BENCH.motor.inductance_henry);
    let (speed, electrical) = (200.0, 800.0);
    let amplitude = -BENCH.motor.back_emf_v_s_per_rad * speed / r.hypot(electrical * l);
    let lag = (electrical * l).atan2(r);
    let third = core::f64::consts::TAU / 3.0;
    core::array::from_fn(|phase| {
        let start = 4.0 * 0.3 - lag - third * phase as f64;
        let steady = |t: f64| amplitude * (electrical * t + start).sin();
        let error = |n: usize| {
            let t = n as f64 / trace.rate_hz;
            let exact = steady(t) - steady(0.0) * (-r / l * t).exp();
            (trace.phase_currents_a[phase][n] - exact).abs()
        };
        (0..trace.motor_angle_rad.len()).map(error).fold(0.0, f64::max)
    })
}

/// A series to the fourth power: half the length, a sixteenth of the error.
const ORDERS: core::ops::Range<f64> = 3.8..4.4;

#[test]
fn order_segments_of_a_turning_machine() {
    let errors = [20e3, 40e3, 80e3].map(errors_of_segments);
    for pair in errors.windows(2) {
        for (coarse, fine) in pair[0].iter().zip(&pair[1]) {
            let order = (coarse / fine).log2();
            assert!(ORDERS.contains(&order), "{order} of {errors:?}");
        }
    }
}

/// The rotor braked by its currents, against segments whose error is a 4096th of the shortest here.
#[test]
fn order_of_the_speed_of_a_braked_machine() {
    let own = BENCH.motor.inertia_kg_m2;
    let finest = braked(640e3, own).motor_speed_rad_per_s;
    let errors = [20e3, 40e3, 80e3].map(|carrier_hz| {
        let speed = braked(carrier_hz, own).motor_speed_rad_per_s;
        minus(&speed, &finest).iter().fold(0.0, |most: f64, x| most.max(x.abs()))
    });
    assert!(finest[49] < 190.0, "{}", finest[49]);
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!(ORDERS.contains(&order), "{order} of {errors:?}");
    }
}
