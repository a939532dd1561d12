//! Many states of health side by side give what each gives alone.

use core::f64::consts::TAU;

use ema_sim::{
    Actuator, BackEmfShape, BackEmfTable, ControlMode, Effect, EffectId, Geometry, HealthState,
    InitialState, Load, LowFidelity, PhysicalFaults, PositionSensor, Scenario,
    presets::{BENCH, EMA_48},
};

/// Uniform numbers, the same in every run.
struct Uniform(u64);

impl Uniform {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Damage over the whole scale: levels `largest·u`, and now and then none or all of it.
fn damage(count: usize, largest: f64, seed: u64) -> Vec<PhysicalFaults> {
    let mut uniform = Uniform(seed);
    let mut level = || match uniform.next() {
        u if u < 0.1 => 0.0,
        u if u > 0.95 => largest,
        _ => largest * uniform.next(),
    };
    (0..count)
        .map(|_| {
            let levels = core::array::from_fn(|_| level());
            (&HealthState::new(levels).expect("on the scale")).into()
        })
        .collect()
}

/// Bits of a current, so that even a NaN would have to agree.
fn bits(current_a: &[f64]) -> Vec<u64> {
    current_a.iter().map(|x| x.to_bits()).collect()
}

fn assert_same(model: &LowFidelity, faults: &[PhysicalFaults], what: &str) {
    let mut currents_a = Vec::new();
    model.simulate_currents(faults, &mut currents_a);
    assert_eq!(currents_a.len(), faults.len(), "{what}");
    for (lane, (faults, current_a)) in faults.iter().zip(&currents_a).enumerate() {
        let alone_a = model.simulate(faults).current_a;
        let off = alone_a.iter().zip(current_a).position(|(a, b)| a.to_bits() != b.to_bits());
        assert_eq!(bits(&alone_a), bits(current_a), "{what}, lane {lane}, first off at {off:?}");
    }
}

fn model(actuator: &Actuator, scenario: &Scenario) -> LowFidelity {
    LowFidelity::new(actuator, scenario).expect("valid")
}

#[test]
fn property_lanes_give_the_bits_of_runs_alone_up_to_full_damage() {
    let model = model(&EMA_48, &Scenario::chirp());
    assert_same(&model, &damage(200, 1.0, 1), "chirp, whole scale");
    assert_same(&model, &damage(64, 0.05, 2), "chirp, incipient");
}

#[test]
fn property_lanes_give_the_bits_of_runs_alone_on_the_bench() {
    let chirp = model(&BENCH, &Scenario::chirp().turned_to(0.4));
    assert_same(&chirp, &damage(100, 1.0, 6), "chirp, whole scale");
    let sine = model(&BENCH, &Scenario { duration_s: 1.5, ..Scenario::sine() });
    assert_same(&sine, &damage(20, 0.05, 7), "sine, incipient");
}

#[test]
fn lanes_give_the_bits_of_runs_alone_in_other_tests() {
    let turned = Scenario::chirp().turned_to(1.3);
    let loaded = Scenario {
        load_n_m: -400.0,
        brake_n_m: 0.02,
        initial: InitialState {
            motor_speed_rad_per_s: -30.0,
            speed_integral_a: 0.4,
            ..InitialState::default()
        },
        backlash_side_ratio: -0.5,
        ..Scenario::chirp()
    };
    let speed = Scenario { mode: ControlMode::Speed, ..Scenario::chirp() };
    let sine = Scenario { duration_s: 1.5, ..Scenario::sine() };
    let mut on_the_motor = EMA_48;
    on_the_motor.controller.position_sensor = PositionSensor::MotorShaft;
    // a supply and a current limit that are used up, and stops that are met
    let mut weak = EMA_48;
    weak.inverter.bus_voltage_v = 9.0;
    weak.controller.current_limit_a = 3.0;
    weak.transmission.stop_rad = 5.5e-3;
    weak.controller.position_gain_per_s = 200.0;
    for (what, actuator, scenario) in [
        ("turned", &EMA_48, &turned),
        ("loaded", &EMA_48, &loaded),
        ("speed", &EMA_48, &speed),
        ("sine", &EMA_48, &sine),
        ("encoder on the motor", &on_the_motor, &Scenario::chirp()),
        ("weak", &weak, &Scenario::chirp()),
    ] {
        assert_same(&model(actuator, scenario), &damage(20, 1.0, 3), what);
    }
}

#[test]
fn what_the_lanes_cannot_do_is_done_one_by_one() {
    let short = Scenario { duration_s: 0.05, ..Scenario::chirp() };
    let faults = damage(5, 0.1, 4);
    let mut derivative = EMA_48;
    derivative.controller.speed_derivative_a_s2_per_rad = 1e-5;
    assert_same(&model(&derivative, &short), &faults, "derivative part");
    assert_same(&model(&EMA_48, &short.clone().with_real_electronics(3)), &faults, "electronics");
    let mut measured = BENCH;
    let wave: Vec<f64> = (0..24).map(|n| (TAU * f64::from(n) / 24.0).sin()).collect();
    let table = BackEmfTable::new(&wave).expect("smooth");
    measured.motor.back_emf_shape = BackEmfShape::Tabulated(table);
    assert_same(&model(&measured, &short), &faults, "tabulated back-EMF");
    let effect = Effect::new(EffectId::Stribeck, Geometry::Rotary)
        .with("stribeck_n_m", 0.01)
        .expect("in bounds");
    let effects = model(&EMA_48, &short).with_effects(&[effect]).expect("taken");
    assert_same(&effects, &faults, "effects");
    let load = Load::Recorded { values_n_m: vec![0.0, 30.0, -20.0], rate_hz: 60.0 };
    let loaded = model(&EMA_48, &short).with_load(load).expect("in bounds");
    assert_same(&loaded, &faults, "a load that changes");
}

#[test]
fn any_number_of_lanes_will_do() {
    let model = model(&EMA_48, &Scenario { duration_s: 0.05, ..Scenario::chirp() });
    let faults = damage(33, 1.0, 5);
    // buffers that held another batch are used again
    let mut currents_a = vec![vec![7.0; 3]; 40];
    for count in [33, 1, 16, 17, 0] {
        model.simulate_currents(&faults[..count], &mut currents_a);
        assert_eq!(currents_a.len(), count);
        for (faults, current_a) in faults.iter().zip(&currents_a) {
            assert_eq!(&model.simulate(faults).current_a, current_a);
        }
    }
}
