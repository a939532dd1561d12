//! The sinusoidal machine and its loops in another simulator: `fixtures/references/motulator`.

use core::f64::consts::{FRAC_PI_4, TAU};

use ema_sim::{
    Actuator, Command, ControlMode, CurrentControl, HealthState, HighFidelity, HighFidelityTrace,
    Scenario, presets::BENCH,
};

/// The bar between simulators of the same physics, of a signal's range.
const BAR: f64 = 0.01;
/// A segment of 50 µs misses (t/τ)⁵/120 = 6e-7 of V/R = 23 A, and τ remembers seven of them: 4e-5
/// of a range of 2 A and more. The reference is good to 1.5e-8 and has nine digits.
const AVERAGED: f64 = 5e-5;

macro_rules! fixture {
    ($name:literal) => {
        include_str!(concat!("../../../../fixtures/references/motulator/", $name, ".csv"))
    };
}

/// The motor shaft alone, sampled at a rate.
fn shaft(sample_hz: f64) -> Actuator {
    let mut a = BENCH;
    a.motor.inertia_kg_m2 = BENCH.total_inertia_kg_m2();
    a.transmission.gear_ratio = 1.0;
    a.transmission.surface_inertia_kg_m2 = 0.0;
    a.transmission.backlash_rad = 0.0;
    a.transmission.efficiency_ratio = 1.0;
    a.transmission.kinetic_friction_n_m = 0.0;
    a.transmission.static_friction_n_m = 0.0;
    a.transmission.surface_friction_n_m = 0.0;
    a.transmission.stop_rad = 1e6;
    a.controller.sample_hz = sample_hz;
    a
}

fn scenario() -> Scenario {
    Scenario { load_n_m: 0.0, start_angle_rad: FRAC_PI_4, ..Scenario::sine() }
}

fn column(csv: &str, name: &str) -> Vec<f64> {
    let mut lines = csv.lines();
    let header = lines.next().expect("a header");
    let place = header.split(',').position(|head| head == name).expect("the column");
    let cell = |line: &str| line.split(',').nth(place).and_then(|cell| cell.parse().ok());
    lines.map(|line| cell(line).expect("a number")).collect()
}

/// Largest difference of speed, currents and torque over the reference's ranges.
fn off(trace: &HighFidelityTrace, csv: &str, every: usize) -> f64 {
    let [a, b, c] = &trace.phase_currents_a;
    let torque: Vec<f64> = (0..a.len())
        .map(|n| {
            let theta_e = 4.0 * trace.motor_angle_rad[n];
            let k = |j: f64| (theta_e - TAU / 3.0 * j).sin();
            0.0752 / 1.5 * (k(0.0) * a[n] + k(1.0) * b[n] + k(2.0) * c[n])
        })
        .collect();
    let pairs = [
        ("speed_rad_per_s", &trace.motor_speed_rad_per_s),
        ("phase_a_current_a", a),
        ("phase_b_current_a", b),
        ("phase_c_current_a", c),
        ("torque_n_m", &torque),
    ];
    let most = |(name, ours): (&str, &Vec<f64>)| {
        let reference = column(csv, name);
        let (low, high) = reference
            .iter()
            .fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(*x), high.max(*x)));
        let ours = ours.iter().step_by(every);
        ours.zip(&reference).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) / (high - low)
    };
    pairs.into_iter().map(most).fold(0.0, f64::max)
}

#[test]
fn versus_motulator_the_machine_under_its_duties() {
    let csv = fixture!("speed-sine-native.motulator");
    let duties = ["duty_a_frac", "duty_b_frac", "duty_c_frac"]
        .map(|name| column(fixture!("speed-sine-native.duty"), name));
    // what is computed in a period acts in the next
    let mut replayed = vec![[0.5; 3]];
    replayed.extend((0..duties[0].len()).map(|k| [duties[0][k], duties[1][k], duties[2][k]]));
    let model = HighFidelity::new(&shaft(20e3), &scenario()).unwrap();
    let healthy = (&HealthState::HEALTHY).into();
    let switched = model.simulate_duties(&healthy, &replayed).unwrap();
    let averaged = model.with_current_control(CurrentControl::Averaged).unwrap();
    let averaged = averaged.simulate_duties(&healthy, &replayed).unwrap();
    let (carrier, mean) = (off(&switched, csv, 4), off(&averaged, csv, 4));
    assert!(mean < AVERAGED, "{mean:e}");
    assert!(carrier < BAR, "{carrier}");
}

#[test]
fn versus_motulator_a_voltage_step_against_a_load() {
    let csv = fixture!("voltage-step.motulator");
    // 12 V along the rotor's q axis at the beginning of each period
    let duties = |theta_e: &f64| {
        [0.0, 1.0, 2.0].map(|j| 0.5 + 12.0 / 48.0 * (theta_e - TAU / 3.0 * j).sin())
    };
    let duties: Vec<_> = column(csv, "electrical_angle_rad").iter().map(duties).collect();
    let test = Scenario { load_n_m: 0.05, ..scenario() };
    let model = HighFidelity::new(&shaft(20e3), &test).unwrap();
    let model = model.with_current_control(CurrentControl::Averaged).unwrap();
    let trace = model.simulate_duties(&(&HealthState::HEALTHY).into(), &duties).unwrap();
    // without friction the load turns the rotor back before the current holds it
    assert!(trace.motor_angle_rad[1] < FRAC_PI_4);
    let mean = off(&trace, csv, 1);
    assert!(mean < AVERAGED, "{mean:e}");
}

#[test]
fn versus_motulator_the_drive_in_speed_mode() {
    let command = Command::Sine { amplitude_rad: 150.0, frequency_hz: 5.0 };
    let test = Scenario { command, mode: ControlMode::Speed, duration_s: 0.4, ..scenario() };
    let model = HighFidelity::new(&shaft(10e3), &test).unwrap();
    let carrier = model.simulate(&(&HealthState::HEALTHY).into());
    let averaged = model.with_current_control(CurrentControl::Averaged).unwrap();
    let averaged = averaged.simulate(&(&HealthState::HEALTHY).into());
    let csv = fixture!("speed-sine.motulator");
    let (carrier, mean) = (off(&carrier, csv, 4), off(&averaged, csv, 4));
    assert!(mean < AVERAGED, "{mean:e}");
    assert!(carrier < BAR, "{carrier}");
}
