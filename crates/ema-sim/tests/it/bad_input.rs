//! What cannot be simulated is refused by name; what can, runs.

use ema_sim::{
    AxisInput, AxisScenario, AxisStart, BackEmfShape, BackEmfTable, Command, Coordinate, Curve,
    CurveKind, Drive, Effect, EffectId, Geometry, HealthState, HighFidelity, Knot, LowFidelity,
    Parameter, ParameterError, Scenario, ServoAxisSimulation, SimulationError,
    presets::{BENCH, EMA_48},
};
use proptest::prelude::*;

#[test]
fn every_number_is_guarded() {
    for parameter in Parameter::ALL {
        if parameter.key() == "motor.pole-pairs" {
            continue;
        }
        for bad in [f64::NAN, f64::INFINITY, -1.0] {
            let mut actuator = EMA_48;
            parameter.set(&mut actuator, bad);
            let error = HighFidelity::new(&actuator, &Scenario::chirp()).unwrap_err();
            assert!(error.to_string().contains(parameter.key()), "{bad}: {error}");
            assert!(LowFidelity::new(&actuator, &Scenario::chirp()).is_err());
        }
    }
    let mut actuator = EMA_48;
    actuator.motor.pole_pairs = 0;
    let message = actuator.check().unwrap_err().to_string();
    assert_eq!(message, "`motor.pole-pairs` is 0, expected a number from 1 to 1000");
}

#[test]
fn bounds_are_told_in_words() {
    let told = |change: fn(&mut ema_sim::Actuator)| {
        let mut actuator = EMA_48;
        change(&mut actuator);
        actuator.check().unwrap_err().to_string()
    };
    assert_eq!(
        told(|a| a.motor.resistance_ohm = -1.0),
        "`motor.resistance-ohm` is -1, expected a number above 0"
    );
    assert_eq!(
        told(|a| a.inverter.carrier_hz = 1e12),
        "`inverter.carrier-hz` is 1e12, expected a number above 0, to 10000000"
    );
    assert_eq!(
        told(|a| a.transmission.backlash_rad = 2.0),
        "`transmission.backlash-rad` is 2, expected a number from 0 to 0.35"
    );
}

/// Machines so fast that a run would take for ever, or leave what a series holds.
#[test]
fn machines_that_cannot_be_followed_are_refused() {
    let told = |change: fn(&mut ema_sim::Actuator)| {
        let mut actuator = EMA_48;
        change(&mut actuator);
        actuator.check().unwrap_err().to_string()
    };
    let message = told(|a| a.motor.back_emf_v_s_per_rad = 1e-9);
    assert!(
        message.starts_with("`motor.back-emf-v-s-per-rad` is 1e-9, expected at least 0.0000"),
        "{message}"
    );
    assert!(message.contains("it makes a time constant of 1.04"), "{message}");
    let message = told(|a| {
        a.motor.inertia_kg_m2 = 1e-300;
        a.transmission.surface_inertia_kg_m2 = 0.0;
    });
    assert!(
        message.starts_with("`motor.inertia-kg-m2` is 1e-300, expected at least 1.9"),
        "{message}"
    );
    let light = |a: &mut ema_sim::Actuator| {
        (a.motor.inertia_kg_m2, a.transmission.surface_inertia_kg_m2) = (1e-7, 0.0);
    };
    let message = told(light);
    assert!(
        message.starts_with("`motor.inertia-kg-m2` is 1e-7, expected at least 5.3698")
            && message.ends_with("within the controller's tick of 0.0001 s"),
        "{message}"
    );
    let message = told(|a| a.motor.viscous_n_m_s_per_rad = 1.0);
    assert!(message.starts_with("`motor.inertia-kg-m2` is 0.000025, expected"), "{message}");
}

#[test]
fn a_test_has_an_end() {
    let mut scenario = Scenario::chirp();
    scenario.duration_s = 1e9;
    let message = LowFidelity::new(&EMA_48, &scenario).unwrap_err().to_string();
    assert_eq!(
        message,
        "`scenario.duration-s` is 1000000000, expected a number from 0.0001 to 4000"
    );
    let mut fast = EMA_48;
    (fast.inverter.carrier_hz, fast.controller.sample_hz) = (1e7, 1e4);
    scenario.duration_s = 1000.0;
    let message = HighFidelity::new(&fast, &scenario).unwrap_err().to_string();
    assert_eq!(message, "`scenario.duration-s` is 1000, expected a number from 0.0001 to 100");
    assert!(LowFidelity::new(&fast, &scenario).is_ok());
}

#[test]
fn rules_between_numbers_are_guarded() {
    let mut actuator = EMA_48;
    actuator.transmission.static_friction_n_m = 0.01;
    assert!(matches!(actuator.check(), Err(ParameterError::KineticAboveStatic { .. })));
    let mut actuator = EMA_48;
    actuator.inverter.carrier_hz = 15e3;
    assert!(matches!(actuator.check(), Err(ParameterError::CarrierNotMultiple { .. })));
    let mut actuator = EMA_48;
    actuator.motor.inductance_henry = 1e-5;
    assert!(matches!(actuator.check(), Err(ParameterError::WindingTooFast { .. })));
}

/// What the message of a machine too fast for its carrier says is least, is taken by that rule.
#[test]
fn the_bound_that_is_told_is_the_bound() {
    type Field = fn(&mut ema_sim::Actuator) -> &mut f64;
    let fields: [Field; 2] =
        [|a| &mut a.motor.inertia_kg_m2, |a| &mut a.motor.back_emf_v_s_per_rad];
    for field in fields {
        let mut actuator = EMA_48;
        actuator.transmission.surface_inertia_kg_m2 = 1e-8;
        *field(&mut actuator) = 1e-12;
        let Err(ParameterError::TooFast { least, .. }) = actuator.check() else {
            panic!("{:?}", actuator.check())
        };
        *field(&mut actuator) = 0.9999 * least;
        assert!(matches!(actuator.check(), Err(ParameterError::TooFast { .. })));
        *field(&mut actuator) = 1.0001 * least;
        assert!(!matches!(actuator.check(), Err(ParameterError::TooFast { .. })));
    }
}

#[test]
fn a_friction_out_of_order_names_both() {
    let mut actuator = EMA_48;
    actuator.transmission.kinetic_friction_n_m = 1e4;
    assert_eq!(
        actuator.check().unwrap_err().to_string(),
        "`transmission.kinetic-friction-n-m` is 10000, above `transmission.static-friction-n-m` \
         0.045, expected at most as much"
    );
    let mut axis = super::effect_table::axis(Drive::Current);
    axis.kinetic_friction = 1e300;
    assert_eq!(
        axis.check().unwrap_err().to_string(),
        "`axis.kinetic-friction-n-m` is 1e300, above `axis.static-friction-n-m` 0.03, expected at \
         most as much"
    );
}

#[test]
fn noise_and_steps_beyond_any_sensor_are_refused() {
    for key in [
        "sensing.surface-step-rad",
        "sensing.current-reference-step-a",
        "sensing.speed-noise-rad-per-s",
        "sensing.current-noise-half-width-a",
    ] {
        let mut actuator = EMA_48;
        Parameter::find(key).expect("a parameter").set(&mut actuator, 1e300);
        let message = actuator.check().unwrap_err().to_string();
        assert_eq!(message, format!("`{key}` is 1e300, expected a number from 0 to 1000000"));
    }
    let mut axis = super::effect_table::axis(Drive::Current);
    axis.offset = -1e300;
    assert_eq!(
        axis.check().unwrap_err().to_string(),
        "`axis.offset-n-m` is -1e300, expected a number from -1000000000 to 1000000000"
    );
    (axis.offset, axis.controller.encoder_step) = (0.0, 1e300);
    let message = axis.check().unwrap_err().to_string();
    assert!(message.starts_with("`controller.encoder-step-rad` is 1e300"), "{message}");
}

#[test]
fn a_voltage_beyond_the_supply_and_a_friction_beyond_any_are_refused() {
    let low = || LowFidelity::new(&EMA_48, &Scenario::chirp()).expect("valid");
    let dead = |volt: f64| {
        let effect = Effect::new(EffectId::DeadTime, Geometry::Rotary);
        [effect.with("dead_time_v", volt).expect("within bounds")]
    };
    assert!(low().with_effects(&dead(47.0)).is_ok());
    assert_eq!(
        low().with_effects(&dead(1000.0)).unwrap_err().to_string(),
        "`dead_time_v` of effect E17 is 1000, and this machine takes at most 48: all of its supply"
    );
    let bench = LowFidelity::new(&BENCH, &Scenario::sine()).expect("valid");
    assert!(bench.with_effects(&dead(37.0)).is_err());
    let twice = [dead(1.0), dead(1.0)].concat();
    let message = low().with_effects(&twice).unwrap_err().to_string();
    assert_eq!(message, "effect E17 acts in a model once only");
    let input = AxisInput::Position(Command::SINE);
    let test = AxisScenario { input, load: 0.0, duration_s: 1.0, start: AxisStart::default() };
    let axis = super::effect_table::axis(Drive::Winding);
    let axis = ServoAxisSimulation::new(&axis, &test).expect("valid");
    let message = axis.with_effects(&dead(6.0)).unwrap_err().to_string();
    assert!(message.ends_with("this machine takes at most 5: all of its supply"), "{message}");
    let sensor = |offset_a: f64| {
        let effect = Effect::new(EffectId::CurrentSensor, Geometry::Rotary);
        let effect = effect.with("offset_a", offset_a).and_then(|e| e.with("in_loop", 1.0));
        [effect.expect("within bounds")]
    };
    let limit_a = EMA_48.controller.current_limit_a;
    assert!(low().with_effects(&sensor(-limit_a)).is_ok());
    let message = low().with_effects(&sensor(-1000.0)).unwrap_err().to_string();
    assert!(
        message.starts_with("`offset_a` of effect E19 is -1000, and this machine takes at most")
            && message.ends_with("all that its controller asks for"),
        "{message}"
    );

    let friction = |most: f64| {
        let points = vec![[-1.0, 0.0], [1.0, most]];
        let curve = Curve::new(Coordinate::Speed, CurveKind::Friction, points).expect("in order");
        [Effect::tabulated(curve, Geometry::Rotary)]
    };
    assert!(low().with_effects(&friction(1e9)).is_ok());
    let message = low().with_effects(&friction(1e308)).unwrap_err().to_string();
    assert!(
        message
            .starts_with("`scale_ratio` of effect U is 1, and this machine takes at most 1e-299"),
        "{message}"
    );
}

/// A scenario's field and what makes it bad.
type Spoilt = (&'static str, fn(&mut Scenario));

#[test]
fn tests_that_cannot_be_run_are_refused() {
    let refused = |change: &dyn Fn(&mut Scenario)| {
        let mut scenario = Scenario::chirp();
        change(&mut scenario);
        HighFidelity::new(&EMA_48, &scenario).expect_err("refused")
    };
    let beyond = refused(&|s| s.command = Command::Sine { amplitude_rad: 0.4, frequency_hz: 1.0 });
    assert!(matches!(beyond, SimulationError::CommandBeyondStops { stop_rad: 0.35, .. }));
    let cases: [Spoilt; 8] = [
        ("scenario.brake-n-m", |s| s.brake_n_m = -0.1),
        ("scenario.load-n-m", |s| s.load_n_m = f64::NAN),
        ("scenario.duration-s", |s| s.duration_s = 0.0),
        ("scenario.start-angle-rad", |s| s.start_angle_rad = f64::INFINITY),
        ("scenario.backlash-side-ratio", |s| s.backlash_side_ratio = 2.0),
        ("scenario.speed-integral-a", |s| s.initial.speed_integral_a = f64::NAN),
        ("command.time-s", |s| {
            let knot = |time_s| Knot { time_s, value_rad: 0.0 };
            s.command = Command::Steps(vec![knot(2.0), knot(1.0)]);
        }),
        ("command.rate-hz", |s| {
            s.command = Command::Recorded { values_rad: vec![0.0], rate_hz: 0.0 };
        }),
    ];
    for (field, change) in cases {
        let message = refused(&change).to_string();
        assert!(message.contains(field), "{message}");
    }
}

#[test]
fn an_effect_too_strong_for_its_machine_is_refused_by_name() {
    let peak_n_m = EMA_48.torque_constant_n_m_per_a() * EMA_48.controller.current_limit_a;
    let drag = EMA_48.total_inertia_kg_m2() * EMA_48.controller.sample_hz;
    let cases = [
        (EffectId::Cogging, "cogging_cos_n_m", 100.0 * peak_n_m),
        (EffectId::Vibration, "vibration_sin_n_m", 100.0 * peak_n_m),
        (EffectId::Imbalance, "spring_n_m_per_rad", 100.0 * peak_n_m / 0.35),
        (EffectId::DirectionalFriction, "viscous_asymmetry_n_m_s_per_rad", drag),
    ];
    for (id, key, most) in cases {
        let made = |size: f64| {
            let effect = Effect::new(id, Geometry::Rotary).with(key, size).expect("within bounds");
            LowFidelity::new(&EMA_48, &Scenario::chirp()).expect("valid").with_effects(&[effect])
        };
        assert!(made(0.999 * most).is_ok(), "{key}");
        let message = made(-1.001 * most).unwrap_err().to_string();
        assert!(message.starts_with(&format!("`{key}` of effect {} is -", id.info().symbol)));
        assert!(message.contains("and this machine takes at most"), "{message}");
    }
    let points = vec![[-1.0, 0.0], [1.0, 1e4]];
    let curve = Curve::new(Coordinate::Speed, CurveKind::Torque, points).expect("in order");
    let curve = [Effect::tabulated(curve, Geometry::Rotary)];
    let high = HighFidelity::new(&EMA_48, &Scenario::chirp()).expect("valid");
    let message = high.with_effects(&curve).unwrap_err().to_string();
    assert!(message.starts_with("`scale_ratio` of effect U is 1, and"), "{message}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..Default::default() })]

    #[test]
    fn property_whatever_is_accepted_runs(
        scale in prop::collection::vec(-0.5_f64..0.5, Parameter::ALL.len()),
        levels in prop::array::uniform7(0.0_f64..=1.0),
        start_angle_rad in -10.0_f64..10.0,
        side in -1.0_f64..=1.0,
        load_n_m in -50.0_f64..50.0,
        seed in any::<u64>(),
        bench in any::<bool>(),
        table in prop::collection::vec(-1.5_f64..1.5, 6..72),
        dead_time_frac in prop_oneof![Just(0.0), 0.0_f64..0.1],
    ) {
        let mut actuator = if bench { BENCH } else { EMA_48 };
        for (parameter, exponent) in Parameter::ALL.iter().zip(scale) {
            if !["inverter.carrier-hz", "controller.sample-hz"].contains(&parameter.key()) {
                let value = parameter.get(&actuator) * libm::pow(10.0, exponent);
                parameter.set(&mut actuator, value);
            }
        }
        if bench && let Ok(table) = BackEmfTable::new(&table) {
            actuator.motor.back_emf_shape = BackEmfShape::Tabulated(table);
        }
        actuator.inverter.dead_time_s = dead_time_frac / actuator.inverter.carrier_hz;
        let mut scenario = Scenario::chirp().with_real_electronics(seed).turned_to(start_angle_rad);
        scenario.command = Command::Sine { amplitude_rad: 4e-3, frequency_hz: 20.0 };
        scenario.duration_s = 0.03;
        scenario.backlash_side_ratio = side;
        scenario.load_n_m = load_n_m;
        let Ok(model) = HighFidelity::new(&actuator, &scenario) else { return Ok(()) };
        let faults = (&HealthState::new(levels).expect("on the scale")).into();
        let trace = model.simulate(&faults);
        for sample in 0..trace.motor_angle_rad.len() {
            let phases = trace.phases_a(sample);
            prop_assert!(phases.iter().all(|i| i.is_finite()));
            prop_assert!(phases.iter().sum::<f64>().abs() <= 1e-9);
            let surface_rad = trace.surface_angle_rad[sample];
            prop_assert!(surface_rad.abs() <= actuator.transmission.stop_rad * (1.0 + 1e-12));
            prop_assert!(trace.motor_speed_rad_per_s[sample].is_finite());
        }
        let low = LowFidelity::new(&actuator, &scenario).expect("accepted").simulate(&faults);
        prop_assert!(low.current_a.iter().all(|i| i.is_finite()));
    }
}
