//! Tests of machines, effects and numbers of their own side by side give what each gives alone.

use ema_sim::{
    Actuator, CommandKind, DriveRun, Effect, EffectId, FaultCoordinates, Geometry, HealthState,
    Load, LowFidelity, MachineKind, MachineScales, MachineTest, NumberValue, PhysicalFaults, Role,
    Scenario,
    model_file::{MachineModel, parse_machine},
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

    fn between(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * self.next()
    }

    fn of<'a, T>(&mut self, items: &'a [T]) -> &'a T {
        &items[(self.next() * items.len() as f64) as usize]
    }
}

/// An effect of about the size that is worth trying on a machine, up to thirty times as much.
fn effect(uniform: &mut Uniform, scales: &MachineScales) -> Effect {
    let id = *uniform.of(&EffectId::ALL);
    let mut effect = Effect::new(id, Geometry::Rotary);
    for parameter in id.info().parameters {
        let key = parameter.key(Geometry::Rotary);
        let value = match parameter.role() {
            Role::Amplitude => {
                let size = parameter.typical_size(scales) * uniform.between(0.1, 3.0);
                let large = if uniform.next() < 0.2 { 10.0 } else { 1.0 };
                if uniform.next() < 0.3 { -large * size } else { large * size }
            }
            Role::Order => libm::floor(uniform.between(1.0, 40.0)),
            Role::Frequency => uniform.between(0.5, 60.0),
            Role::Place => uniform.between(-scales.travel, scales.travel),
            _ => effect.get(key).unwrap_or_default(),
        };
        let (least, most) = parameter.bounds();
        effect.set(key, value.clamp(least, most)).expect("within its bounds");
    }
    effect
}

fn faults(uniform: &mut Uniform) -> PhysicalFaults {
    let levels = core::array::from_fn(|_| 0.3 * uniform.next() * uniform.next());
    (&FaultCoordinates(levels)).into()
}

/// EMA-48 with numbers that are a little off.
fn actuator(uniform: &mut Uniform) -> Actuator {
    let mut actuator = EMA_48;
    let mut off = |x: &mut f64| *x *= uniform.between(0.8, 1.25);
    off(&mut actuator.motor.inertia_kg_m2);
    off(&mut actuator.motor.viscous_n_m_s_per_rad);
    off(&mut actuator.motor.resistance_ohm);
    off(&mut actuator.motor.back_emf_v_s_per_rad);
    off(&mut actuator.transmission.backlash_rad);
    off(&mut actuator.transmission.gear_ratio);
    off(&mut actuator.controller.position_gain_per_s);
    off(&mut actuator.controller.speed_gain_a_s_per_rad);
    off(&mut actuator.controller.current_limit_a);
    actuator
}

fn bits(signal: &[f64]) -> Vec<u64> {
    signal.iter().map(|x| x.to_bits()).collect()
}

fn assert_same_bits(together: &[f64], alone: &[f64], what: &dyn Fn() -> String) {
    let off = together.iter().zip(alone).position(|(a, b)| a.to_bits() != b.to_bits());
    assert_eq!(bits(together), bits(alone), "first off at {off:?} of {}: {}", alone.len(), what());
}

#[test]
fn property_tests_of_actuators_give_the_bits_of_each_alone() {
    let uniform = &mut Uniform(39);
    let scales = {
        let model = LowFidelity::new(&EMA_48, &Scenario::chirp()).expect("valid");
        model.scales(&model.simulate(&(&HealthState::HEALTHY).into()))
    };
    let (mut tests, mut seen) = (Vec::new(), std::collections::BTreeSet::new());
    while tests.len() < 120 {
        let scenario = Scenario {
            duration_s: uniform.between(0.1, 0.4),
            start_angle_rad: uniform.next(),
            load_n_m: uniform.between(-1.0, 1.0),
            ..Scenario::chirp()
        };
        let load = match uniform.next() {
            u if u < 0.2 => Load::Recorded { values_n_m: vec![0.3, -0.2, 0.9], rate_hz: 9.0 },
            u if u < 0.3 => Load::Aerodynamic(ema_sim::HingeMoment::F16),
            _ => Load::None,
        };
        let model = LowFidelity::new(&actuator(uniform), &scenario).and_then(|m| m.with_load(load));
        let count = *uniform.of(&[0_usize, 1, 1, 1, 1, 2, 3]);
        let effects: Vec<Effect> = (0..count).map(|_| effect(uniform, &scales)).collect();
        // some effects do not go together
        let Ok(model) = model.and_then(|model| model.with_effects(&effects)) else { continue };
        seen.extend(effects.iter().map(Effect::id));
        tests.push((model, faults(uniform)));
    }
    assert!(seen.len() >= 23, "{seen:?}");
    let borrowed: Vec<_> = tests.iter().map(|(model, faults)| (model, faults)).collect();
    let mut together_a = Vec::new();
    LowFidelity::simulate_tests(&borrowed, &mut together_a);
    let mut alone_a = Vec::new();
    for ((model, faults), together_a) in tests.iter().zip(&together_a) {
        model.simulate_current(faults, &mut alone_a);
        assert_same_bits(together_a, &alone_a, &|| format!("{model:?}"));
    }
    let motions = LowFidelity::simulate_motions(&borrowed);
    for ((model, faults), together) in tests.iter().zip(&motions) {
        let alone = model.simulate(faults);
        let pairs = [
            (&together.current_a, &alone.current_a),
            (&together.motor_angle_rad, &alone.motor_angle_rad),
            (&together.motor_speed_rad_per_s, &alone.motor_speed_rad_per_s),
        ];
        for (together, alone) in pairs {
            assert_same_bits(together, alone, &|| format!("{model:?}"));
        }
    }
}

#[test]
fn property_a_machine_that_is_driven_away_ends_as_alone() {
    let feeding = Effect::new(EffectId::NonlinearViscous, Geometry::Rotary)
        .with("viscous_at_reference_n_m", -0.5)
        .expect("within its bounds");
    let plain = LowFidelity::new(&EMA_48, &Scenario::chirp()).expect("valid");
    let away = plain.clone().with_effects(&[feeding]).expect("it can have it");
    let healthy = PhysicalFaults::from(&HealthState::HEALTHY);
    let tests = [(&plain, &healthy), (&away, &healthy), (&plain, &healthy)];
    let (mut together_a, mut alone_a) = (Vec::new(), Vec::new());
    LowFidelity::simulate_tests(&tests, &mut together_a);
    for ((model, faults), together_a) in tests.iter().zip(&together_a) {
        model.simulate_current(faults, &mut alone_a);
        assert_same_bits(together_a, &alone_a, &|| "driven away".to_owned());
    }
    assert!(together_a[1].last().is_some_and(|x| x.is_nan()));
}

fn axes() -> [MachineModel; 3] {
    let texts = [
        include_str!("../../../../fixtures/models/axis.toml"),
        include_str!("../../../../fixtures/models/emps.toml"),
        include_str!("../../../../fixtures/models/laas.toml"),
    ];
    texts.map(|text| parse_machine(text).expect("a model file"))
}

#[test]
fn property_drives_of_machines_are_the_bits_of_each_alone() {
    let uniform = &mut Uniform(40);
    let mut machines = axes().to_vec();
    machines.extend([EMA_48, BENCH].map(|actuator| MachineModel::Actuator(actuator.into())));
    for machine in &machines {
        let kind = machine.kind();
        let linear = kind.geometry() == Geometry::Linear;
        let travel = if linear { 0.1 } else { 0.3 };
        let scales = MachineScales {
            torque: 0.2 * kind.torque_per_drive(),
            drive: 0.2,
            speed: 10.0 * travel,
            travel,
            motor_travel: travel,
            sample_s: 1e-3,
        };
        for asks_for in [CommandKind::Position, CommandKind::Speed, CommandKind::Motion] {
            let tests: Vec<Vec<f64>> = (1_u32..5)
                .map(|n| {
                    let samples = 200 * n as usize;
                    let wave = |k: usize| travel * libm::sin(1e-2 * f64::from(n) * k as f64);
                    (0..samples).map(wave).collect()
                })
                .collect();
            let loads: Vec<Vec<f64>> =
                tests.iter().map(|test| vec![0.1 * scales.torque; test.len()]).collect();
            let tests: Vec<MachineTest<'_>> = tests
                .iter()
                .zip(&loads)
                .enumerate()
                .map(|(n, (command, load))| MachineTest {
                    asks_for,
                    load: (n % 2 == 0).then_some(load.as_slice()),
                    ..MachineTest::of_position(1e3, command)
                })
                .collect();
            compare(kind, &tests, &scales, uniform);
        }
    }
}

/// Runs a machine on tests with random numbers, damage and effects, together and each alone.
fn compare(
    kind: &dyn MachineKind,
    tests: &[MachineTest<'_>],
    scales: &MachineScales,
    uniform: &mut Uniform,
) {
    let prepared: Vec<_> = tests.iter().map(|test| kind.prepare(test)).collect();
    let numbers = kind.numbers();
    let mut drawn = Vec::new();
    for n in 0..40 {
        let off: Vec<NumberValue> = (0..numbers.len())
            .filter(|&place| numbers[place].motion_term.is_some() && kind.number(place) > 0.0)
            .map(|place| NumberValue {
                place,
                value: kind.number(place) * uniform.between(0.8, 1.2),
            })
            .collect();
        let count = *uniform.of(&[0_usize, 1, 1, 2]);
        let effects: Vec<Effect> = (0..count)
            .map(|_| {
                let drawn = effect(uniform, scales);
                let mut effect = Effect::new(drawn.id(), kind.geometry());
                for (parameter, value) in drawn.id().info().parameters.iter().zip(drawn.values()) {
                    effect.set(parameter.key(kind.geometry()), *value).expect("as drawn");
                }
                effect
            })
            .collect();
        drawn.push((n % tests.len(), off, faults(uniform), effects));
    }
    let runs: Vec<DriveRun<'_>> = drawn
        .iter()
        .map(|(test, numbers, faults, effects)| DriveRun {
            numbers,
            test: &tests[*test],
            prepared: &prepared[*test],
            faults,
            effects,
        })
        .collect();
    assert_eq!(kind.drives(&[]), []);
    for (run, together) in runs.iter().zip(kind.drives(&runs)) {
        let mut machine = parse_machine(&kind.write()).expect("its own text");
        machine.kind_mut().set_numbers(run.numbers);
        let alone = machine.kind().drive(run.test, run.prepared, run.faults, run.effects);
        match (together, alone) {
            (Ok(together), Ok(alone)) => {
                assert_same_bits(&together, &alone, &|| format!("{:?} {run:?}", kind.name()));
            }
            (together, alone) => assert_eq!(together, alone),
        }
    }
}
