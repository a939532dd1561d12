//! The servo axis against closed solutions, and its model file.

use approx::assert_abs_diff_eq;
use ema_sim::{
    AxisController, AxisInput, AxisParameter, AxisScenario, AxisStart, AxisTrace, Command,
    Coordinate, Curve, CurveKind, Drive, Effect, EffectId, FaultId, FaultLevel, Feedback, Geometry,
    HealthState, ServoAxis, ServoAxisSimulation, SimulationError,
    model_file::{MachineModel, parse_machine, parse_machine_onto},
};
use libm::exp;
use proptest::prelude::*;

/// Share of the end speed that the series of a tick of 1 ms miss: `(c·t/J)⁵/120` each.
const SERIES_REL: f64 = 1e-9;
/// Error of the series over 2 s of an axis that is pushed to 190 rad/s, rad/s.
const SERIES_SPEED: f64 = 1e-6;
/// Rounding of sums over 2000 ticks, in A, rad/s or steps.
const ROUNDING: f64 = 1e-9;
/// Phase that the midpoint rule over a tick misses, `(ω·T)²/24` over 20 rad, of a swing of 0.4 rad.
const SWING_RAD: f64 = 1e-4 * 0.4;

fn axis(drive: Drive) -> ServoAxis {
    ServoAxis {
        geometry: Geometry::Rotary,
        inertia: 2e-3,
        viscous: 4e-3,
        kinetic_friction: 0.02,
        static_friction: 0.03,
        offset: 0.0,
        backlash: 0.0,
        drive,
        force_constant: 0.1,
        resistance_ohm: 2.0,
        controller: AxisController {
            sample_hz: 1e3,
            position_gain_per_s: 20.0,
            position_integral_per_s2: 0.0,
            position_derivative_ratio: 0.0,
            speed_limit: 50.0,
            speed_gain: 1.0,
            speed_integral: 20.0,
            output_limit: 8.0,
            speed_samples: 0,
            encoder_step: 0.0,
            feedback: Feedback::Motor,
        },
    }
}

fn scenario(input: AxisInput) -> AxisScenario {
    AxisScenario { input, load: 0.0, duration_s: 2.0, start: AxisStart::default() }
}

fn sine() -> AxisScenario {
    scenario(AxisInput::Position(Command::Sine { amplitude_rad: 1.0, frequency_hz: 0.7 }))
}

fn held(value: f64) -> AxisInput {
    AxisInput::Output(Command::Recorded { values_rad: vec![value], rate_hz: 1.0 })
}

fn run(axis: &ServoAxis, scenario: &AxisScenario, effects: &[Effect]) -> AxisTrace {
    let simulation = ServoAxisSimulation::new(axis, scenario);
    let simulation = simulation.and_then(|s| s.with_effects(effects)).expect("valid");
    simulation.simulate(&(&HealthState::HEALTHY).into())
}

#[test]
fn law_a_held_torque_brings_the_axis_to_its_end_speed() {
    let mut axis = axis(Drive::Current);
    axis.offset = 0.01;
    let trace = run(&axis, &scenario(held(2.0)), &[]);
    let (rate, end) = (axis.viscous / axis.inertia, (0.2 - 0.02 - 0.01) / axis.viscous);
    for (n, speed) in trace.speed.iter().enumerate() {
        let wanted = end * (1.0 - exp(-rate * n as f64 * 1e-3));
        // each tick of 1 ms misses (c·t/J)⁵/120
        assert_abs_diff_eq!(*speed, wanted, epsilon = SERIES_REL * end);
    }
    let pushed = run(&axis, &scenario(held(-2.0)), &[]);
    let end = (0.2 - 0.02 + 0.01) / axis.viscous;
    assert_abs_diff_eq!(
        pushed.speed[1999],
        -(end * (1.0 - exp(-rate * 1.999))),
        epsilon = SERIES_SPEED
    );
}

#[test]
fn law_a_winding_brakes_by_its_back_emf() {
    let axis = axis(Drive::Winding);
    let trace = run(&axis, &scenario(held(6.0)), &[]);
    let drag = axis.viscous + 0.1 * 0.1 / 2.0;
    let (rate, end) = (drag / axis.inertia, (0.1 * 6.0 / 2.0 - 0.02) / drag);
    for (n, speed) in trace.speed.iter().enumerate() {
        let wanted = end * (1.0 - exp(-rate * n as f64 * 1e-3));
        assert_abs_diff_eq!(*speed, wanted, epsilon = SERIES_REL * end);
        if n > 0 {
            // the current at the start of the last segment, a tick ago
            let before = trace.speed[n - 1];
            assert_abs_diff_eq!(trace.current[n], (6.0 - 0.1 * before) / 2.0, epsilon = ROUNDING);
        }
    }
}

#[test]
fn law_the_axis_sticks_below_its_static_friction() {
    let axis = axis(Drive::Current);
    assert!(run(&axis, &scenario(held(0.29)), &[]).position.iter().all(|x| *x == 0.0));
    assert!(run(&axis, &scenario(held(0.31)), &[]).position[1999] > 0.0);
}

#[test]
fn a_replayed_output_gives_the_same_motion() {
    for drive in [Drive::Current, Drive::Amplifier, Drive::Winding] {
        let axis = axis(drive);
        let simulation = ServoAxisSimulation::new(&axis, &sine()).unwrap();
        let healthy = (&HealthState::HEALTHY).into();
        let closed = simulation.simulate(&healthy);
        let open = simulation.with_replayed_output(&closed.output).unwrap().simulate(&healthy);
        assert_eq!(open.position, closed.position);
        assert_eq!(open.speed, closed.speed);
    }
}

#[test]
fn a_controller_shown_its_own_trace_makes_its_own_output() {
    let sensor = Effect::new(EffectId::CurrentSensor, Geometry::Rotary);
    let lag = sensor.with("gain_error_ratio", 0.1).and_then(|sensor| sensor.with("in_loop", 1.0));
    let stretch = Effect::new(EffectId::ControllerMismatch, Geometry::Rotary)
        .with("speed_gain_error_ratio", 0.2);
    for (drive, samples) in [(Drive::Current, 0), (Drive::Amplifier, 2), (Drive::Winding, 1)] {
        let mut axis = axis(drive);
        (axis.controller.speed_samples, axis.controller.encoder_step) = (samples, 1e-5);
        for effects in [vec![], lag.iter().chain(&stretch).cloned().collect::<Vec<_>>()] {
            let simulation = ServoAxisSimulation::new(&axis, &sine());
            let simulation = simulation.and_then(|s| s.with_effects(&effects)).expect("valid");
            let trace = simulation.simulate(&(&HealthState::HEALTHY).into());
            assert_eq!(simulation.replayed_output(&trace), trace.output, "{drive:?} {effects:?}");
        }
    }
}

#[test]
fn faults_and_effects_act_on_the_axis() {
    let mut axis = axis(Drive::Current);
    axis.backlash = 1e-4;
    let base = run(&axis, &sine(), &[]);
    for fault in [FaultId::Friction, FaultId::Backlash] {
        let health = HealthState::HEALTHY.with(fault, FaultLevel::new(0.3).unwrap());
        let mut axis = axis;
        axis.controller.feedback = Feedback::Load;
        let simulation = ServoAxisSimulation::new(&axis, &sine()).unwrap();
        let trace = simulation.simulate(&(&health).into());
        assert_ne!(trace.output, base.output, "{fault:?}");
    }
    for id in EffectId::ALL {
        let off = Effect::new(id, Geometry::Rotary);
        let simulation = ServoAxisSimulation::new(&axis, &sine()).unwrap();
        match simulation.with_effects(&[off]) {
            Ok(with) => assert_eq!(with.simulate(&(&HealthState::HEALTHY).into()), base, "{id:?}"),
            Err(SimulationError::Effect(error)) => {
                assert!(error.to_string().contains("does not act in the servo axis"), "{error}");
            }
            Err(other) => panic!("{other}"),
        }
    }
}

/// The torque balance of the axis with a cogging of order 7 and a direction-dependent drag.
#[test]
fn law_effects_enter_the_torque_balance() {
    let axis = axis(Drive::Current);
    let effects = [
        Effect::new(EffectId::Cogging, Geometry::Rotary)
            .with("cogging_sin_n_m", 5e-3)
            .and_then(|e| e.with("order", 7.0))
            .unwrap(),
        Effect::new(EffectId::DirectionalFriction, Geometry::Rotary)
            .with("viscous_asymmetry_n_m_s_per_rad", 1e-3)
            .unwrap(),
    ];
    let trace = run(&axis, &sine(), &effects);
    let (mut off, mut whole) = (0.0, 0.0);
    for n in 1..trace.speed.len() {
        let (a, b) = (trace.speed[n - 1], trace.speed[n]);
        if a * b <= 0.0 || a.abs() < 0.1 {
            continue;
        }
        let (w, x) = (0.5 * (a + b), 0.5 * (trace.position[n - 1] + trace.position[n]));
        let known = 0.1 * trace.output[n - 1] - 0.02f64.copysign(w) - 4e-3 * w;
        let shown = known - 2e-3 * (b - a) / 1e-3;
        let wanted = 5e-3 * libm::sin(7.0 * x) + 1e-3 * w.abs();
        (off, whole) = (off + (shown - wanted).powi(2), whole + wanted.powi(2));
    }
    // the midpoint of a tick against its mean: (7·4.4·1e-3)²/24
    assert!((off / whole).sqrt() < 5e-4, "{}", (off / whole).sqrt());
}

/// A mass on a spring, let go away from the spring's rest: the position that the spring feels is
/// the axis', wherever the test begins.
#[test]
fn law_a_spring_pulls_to_the_origin_of_the_axis() {
    let mut axis = axis(Drive::Current);
    (axis.viscous, axis.kinetic_friction, axis.static_friction) = (0.0, 0.0, 0.0);
    let spring =
        Effect::new(EffectId::Imbalance, Geometry::Rotary).with("spring_n_m_per_rad", 0.2).unwrap();
    let start = AxisStart { position: 0.4, ..AxisStart::default() };
    let trace = run(&axis, &AxisScenario { start, ..scenario(held(0.0)) }, &[spring]);
    let swing = libm::sqrt(0.2 / axis.inertia);
    for (n, position) in trace.position.iter().enumerate() {
        let wanted = 0.4 * libm::cos(swing * n as f64 * 1e-3);
        // the midpoint rule over a tick: (ω·T)²/24 of the phase, 20 rad long
        assert_abs_diff_eq!(*position, wanted, epsilon = SWING_RAD);
    }
}

#[test]
fn law_effects_over_position_do_not_care_where_a_test_begins() {
    let shifted = |by: f64| {
        let worn = Effect::new(EffectId::WornRegion, Geometry::Rotary)
            .with("worn_n_m", 0.05)
            .and_then(|e| e.with("centre_rad", 0.3 + by))
            .and_then(|e| e.with("width_rad", 0.1))
            .unwrap();
        let points = [[-0.5, 0.0], [0.2, 0.01], [0.9, -0.02]].map(|[x, y]| [x + by, y]).to_vec();
        let curve = Curve::new(Coordinate::Position, CurveKind::Torque, points).unwrap();
        let effects = [worn, Effect::tabulated(curve, Geometry::Rotary)];
        let start = AxisStart { position: by, ..AxisStart::default() };
        run(&axis(Drive::Current), &AxisScenario { start, ..scenario(held(0.9)) }, &effects)
    };
    let (here, there) = (shifted(0.0), shifted(7.0));
    assert!(here.speed[1999] > 0.0);
    for (a, b) in here.speed.iter().zip(&there.speed) {
        assert_abs_diff_eq!(a, b, epsilon = ROUNDING);
    }
    // the curve acts: without the shift of its points the motion is another
    let start = AxisStart { position: 7.0, ..AxisStart::default() };
    let bare = run(&axis(Drive::Current), &AxisScenario { start, ..scenario(held(0.9)) }, &[]);
    assert!((bare.speed[1999] - there.speed[1999]).abs() > 1e-3);
}

#[test]
fn law_a_position_sensor_has_its_steps_where_zero_is() {
    let step = 0.01;
    let sensor =
        Effect::new(EffectId::PositionSensor, Geometry::Rotary).with("step_rad", step).unwrap();
    let start = AxisStart { position: 0.123, ..AxisStart::default() };
    let mut axis = axis(Drive::Current);
    axis.controller.feedback = Feedback::Load;
    let trace = run(&axis, &AxisScenario { start, ..scenario(held(0.5)) }, &[sensor]);
    for position in trace.position {
        let steps = position / step;
        assert_abs_diff_eq!(steps, libm::round(steps), epsilon = ROUNDING);
    }
}

const EMPS: &str = include_str!("../../../../fixtures/models/emps.toml");

#[test]
fn a_model_file_of_an_axis_reads_what_it_wrote() {
    let model = parse_machine(EMPS).unwrap();
    assert_eq!(parse_machine(&model.write()).unwrap(), model);
    let MachineModel::ServoAxis(emps) = &model else { panic!("{model:?}") };
    assert_eq!(emps.axis.inertia, 95.1089);
    assert_eq!(emps.axis.static_friction, 20.3935);
    assert_eq!(emps.faults, [FaultId::Friction]);
    let text = "[[effect]]\nid = \"E03\"\n\
                parameters = { viscous-asymmetry-n-s-per-m = 30.0 }\n[axis]\noffset-n = 0.0\n";
    let extended = parse_machine_onto(text, &model).unwrap();
    let MachineModel::ServoAxis(axis) = &extended else { panic!("{extended:?}") };
    assert_eq!(axis.axis.offset, 0.0);
    assert_eq!(extended.switched_on()[0].get("viscous_asymmetry_n_s_per_m"), Some(30.0));
    assert_eq!(parse_machine(&extended.write()).unwrap(), extended);
    let mut without = extended;
    without.effects_mut().clear();
    let MachineModel::ServoAxis(base) = &without else { panic!("{without:?}") };
    assert_eq!(ServoAxis { offset: -3.1648, ..base.axis }, emps.axis);
}

#[test]
fn a_slip_in_an_axis_file_is_named() {
    let cases = [
        ("mass-kg", "inertia-kg-m2", "unknown key `axis.inertia-kg-m2`"),
        ("mass-kg = 95.1089", "mass-kg = -1.0", "`axis.mass-kg` is -1, expected"),
        ("\"amplifier\"", "\"steam\"", "`drive.kind` is `steam`, which is none of"),
        ("speed-samples = 2", "speed-samples = 1.5", "`controller.speed-samples` is 1.5"),
        ("sample-hz = 1000.0\n", "", "`controller.sample-hz` is missing"),
        ("[axis]", "static-friction-n = 1.0\n[axis]", "unknown key `static-friction-n`"),
    ];
    for (from, to, wanted) in cases {
        let error = parse_machine(&EMPS.replace(from, to)).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
}

/// The two masses of E08 under a held torque: the motor's rises with both, and swings about that
/// by the elastic shaft.
#[test]
fn law_two_inertias_swing_about_their_common_speed() {
    let mut axis = axis(Drive::Current);
    (axis.viscous, axis.kinetic_friction, axis.static_friction) = (0.0, 0.0, 0.0);
    let (motor, load, compliance) = (1.2e-3, 0.8e-3, 0.6);
    let numbers = [("compliance_rad_per_n_m", compliance), ("load_inertia_kg_m2", load)];
    let effect = numbers
        .iter()
        .fold(Effect::new(EffectId::Compliance, Geometry::Rotary), |effect, (key, value)| {
            effect.with(key, *value).unwrap()
        });
    let scenario = AxisScenario { duration_s: 0.5, ..scenario(held(2.0)) };
    let error = |finer: f64| {
        let simulation = ServoAxisSimulation::new(&axis, &scenario).unwrap();
        let simulation = simulation.with_effects(core::slice::from_ref(&effect)).unwrap();
        let trace = simulation.with_finer_segments(finer).simulate(&(&HealthState::HEALTHY).into());
        let swing = libm::sqrt((1.0 / motor + 1.0 / load) / compliance);
        let common = 0.2 / (motor + load);
        let twisting = load / (motor + load) * 0.2 / (motor * swing);
        let speeds = trace.speed.iter().enumerate();
        let errors = speeds.map(|(n, speed)| {
            let time_s = n as f64 * 1e-3;
            (speed - common * time_s - twisting * libm::sin(swing * time_s)).abs() / twisting
        });
        errors.fold(0.0, f64::max)
    };
    let (coarse, fine) = (error(1.0), error(0.25));
    // the midpoint rule over 0.05 rad of the swing, five periods long: 0.05²/24·2π·5
    assert!(coarse < 4e-3 && fine < coarse / 12.0, "{coarse:e} {fine:e}");
}

#[test]
fn a_mass_too_small_for_the_tick_is_named() {
    let MachineModel::ServoAxis(emps) = parse_machine(EMPS).unwrap() else { panic!() };
    for mass_kg in [1e-3, 1e-12] {
        let axis = ServoAxis { inertia: mass_kg, ..emps.axis };
        let message = ServoAxisSimulation::new(&axis, &sine()).unwrap_err().to_string();
        assert!(
            message.starts_with("`axis.mass-kg` is ")
                && message.contains("expected at least 0.407")
                && message.ends_with("within the controller's tick of 0.001 s"),
            "{message}"
        );
    }
    // without drag nothing bounds it, and the run ends all the same
    let axis = ServoAxis { inertia: 1e-12, viscous: 0.0, ..emps.axis };
    let trace = run(&axis, &sine(), &[]);
    assert!(trace.position.iter().all(|x| x.is_finite()));
    // a tick has at most twice the events of its limit
    assert!(trace.segments < 2000 * 8192, "{}", trace.segments);
}

#[test]
fn a_command_that_no_gain_follows_is_refused() {
    let refused = |axis: &ServoAxis, input: AxisInput| {
        ServoAxisSimulation::new(axis, &scenario(input)).unwrap_err().to_string()
    };
    let ramp = || Command::Sine { amplitude_rad: 1.0, frequency_hz: 0.7 };
    let mut open = axis(Drive::Current);
    open.controller.position_gain_per_s = 0.0;
    assert_eq!(
        refused(&open, AxisInput::Position(ramp())),
        "the axis is given a position, and `controller.position-gain-per-s` is 0: it would stand \
         still"
    );
    assert!(ServoAxisSimulation::new(&open, &scenario(AxisInput::Speed(ramp()))).is_ok());
    (open.controller.speed_gain, open.controller.speed_integral) = (0.0, 0.0);
    let message = refused(&open, AxisInput::Speed(ramp()));
    assert!(message.contains("a speed, and `controller.speed-gain-a-s-per-rad` is 0"), "{message}");
    assert!(ServoAxisSimulation::new(&open, &scenario(held(1.0))).is_ok());
}

#[test]
fn a_fault_without_its_cause_is_told() {
    let mut axis = axis(Drive::Current);
    let told = |axis: &ServoAxis, fault| axis.check_fault(fault).map_err(|e| e.to_string());
    assert_eq!(told(&axis, FaultId::Friction), Ok(()));
    (axis.kinetic_friction, axis.static_friction) = (0.0, 0.0);
    let wanted = "k1 changes nothing in this axis: it has no dry friction";
    assert_eq!(told(&axis, FaultId::Friction), Err(wanted.to_owned()));
    assert!(told(&axis, FaultId::Backlash).is_err());
    axis.backlash = 1e-4;
    assert_eq!(told(&axis, FaultId::Backlash), Ok(()));
    for fault in FaultId::ALL.into_iter().skip(2) {
        assert!(told(&axis, fault).is_err(), "{fault:?}");
    }
}

/// An effect with its numbers anywhere between their bounds, on a scale of powers of ten.
fn drawn(id: EffectId, geometry: Geometry, draws: &[f64]) -> Effect {
    let mut effect = Effect::new(id, geometry);
    for (parameter, draw) in id.info().parameters.iter().zip(draws) {
        let (least, most) = parameter.bounds();
        let sign = if *draw < 0.0 { least.signum() } else { 1.0 };
        let size = most.max(-least) * libm::pow(10.0, -8.0 * (1.0 - draw.abs()));
        effect
            .set(parameter.key(geometry), (sign * size).clamp(least, most))
            .expect("within bounds");
    }
    effect
}

fn effects() -> impl Strategy<Value = Vec<(EffectId, [f64; 5])>> {
    let each = EffectId::ALL.map(|id| {
        let on = prop::array::uniform5(-1.0..1.0_f64).prop_map(move |draws| Some((id, draws)));
        prop_oneof![4 => Just(None), 1 => on]
    });
    each.to_vec().prop_map(|effects| effects.into_iter().flatten().collect())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..Default::default() })]

    /// Every number of the axis over two decades, every drive, input and fault up to full damage,
    /// with whatever effects it takes: what is accepted runs to its end, in bounded work.
    #[test]
    fn property_whatever_axis_is_accepted_runs(
        scale in prop::collection::vec(-1.0_f64..1.0, AxisParameter::ALL.len()),
        (drive, input, linear, load_side) in (0..3_usize, 0..3_usize, any::<bool>(), any::<bool>()),
        levels in prop::array::uniform7(prop_oneof![Just(1.0), 0.0..1.0_f64]),
        start in prop::array::uniform4(-1.0_f64..1.0),
        load in -0.5_f64..0.5,
        speed_samples in 0..4_u32,
        effects in effects(),
    ) {
        let mut axis = axis([Drive::Current, Drive::Amplifier, Drive::Winding][drive]);
        (axis.backlash, axis.offset, axis.controller.encoder_step) = (1e-4, 0.01, 1e-5);
        axis.geometry = if linear { Geometry::Linear } else { Geometry::Rotary };
        axis.controller.feedback = if load_side { Feedback::Load } else { Feedback::Motor };
        axis.controller.speed_samples = speed_samples;
        for (parameter, exponent) in AxisParameter::ALL.iter().zip(scale) {
            let value = parameter.get(&axis) * libm::pow(10.0, exponent);
            parameter.set(&mut axis, value);
        }
        axis.static_friction = axis.static_friction.max(axis.kinetic_friction);
        let command = Command::Sine { amplitude_rad: 1.0, frequency_hz: 3.0 };
        let input = [AxisInput::Position(command.clone()), AxisInput::Speed(command), held(2.0)]
            [input].clone();
        let start = AxisStart {
            position: start[0],
            speed: 10.0 * start[1],
            output: start[2],
            backlash_side_ratio: start[3],
        };
        let ticks = 40.0;
        let duration_s = ticks / axis.controller.sample_hz;
        let scenario = AxisScenario { input, load, duration_s, start };
        let Ok(mut simulation) = ServoAxisSimulation::new(&axis, &scenario) else { return Ok(()) };
        let mut taken = Vec::new();
        for (id, draws) in effects {
            taken.push(drawn(id, axis.geometry, &draws));
            match simulation.clone().with_effects(&taken) {
                Ok(with) => simulation = with,
                Err(_) => drop(taken.pop()),
            }
        }
        let faults = (&HealthState::new(levels).unwrap()).into();
        let trace = simulation.simulate(&faults);
        prop_assert_eq!(trace.position.len(), libm::round(ticks) as usize);
        if let Some(runaway) = trace.runaway {
            prop_assert!(!runaway.feeding.is_empty(), "{runaway} {axis:?} {taken:?}");
            return Ok(());
        }
        for channel in [&trace.position, &trace.speed, &trace.output, &trace.current, &trace.force] {
            prop_assert!(channel.iter().all(|x| x.is_finite()), "{:?} {:?}", axis, taken);
        }
        // E21 raises the limit to ten times itself
        prop_assert!(trace.output.iter().all(|u| u.abs() <= 10.0 * axis.controller.output_limit));
        // at most a thousandth of a tick a segment, and two events of its limit
        prop_assert!(trace.segments < 40 * 10_000, "{} {:?}", trace.segments, taken);
    }
}
