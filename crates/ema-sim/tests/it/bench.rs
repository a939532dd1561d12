//! The bench of the FREEDOM paper: a sinusoidal machine under a field-oriented drive.

use ema_sim::{
    Command, CurrentControl, Envelope, EnvelopeFilter, FaultCoordinates, HealthState, HighFidelity,
    LowFidelity, PhysicalFaults, Scenario,
    presets::{BENCH, EMA_48},
};

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
    assert!(gap < 0.02, "healthy gap {gap}");
    for (coordinate, name) in FaultCoordinates::NAMES.iter().enumerate() {
        let faults = single(coordinate, 0.05);
        let h = minus(&high_signal(&high, &faults), &high_zero);
        let l = minus(&low_signal(&low, &faults), &low_zero);
        let dot = h.iter().zip(&l).map(|(a, b)| a * b).sum::<f64>() / h.len() as f64;
        let cosine = dot / (rms(&h) * rms(&l));
        assert!(rms(&h) > 1e-3, "{name} acts");
        assert!(cosine > 0.95, "{name}: {cosine}");
    }
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
