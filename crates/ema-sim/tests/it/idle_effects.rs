//! What a machine takes changes something of what is recorded; what would do nothing is refused.

use ema_sim::{
    Actuator, AxisInput, AxisScenario, AxisStart, Command, Coordinate, Curve, CurveKind, Drive,
    Effect, EffectError, EffectId, Geometry, HealthState, HighFidelity, Knot, LowFidelity, Role,
    Scenario, ServoAxis, ServoAxisSimulation, SimulationError,
    model_file::{MachineModel, parse_machine},
    presets::{BENCH, EMA_48},
};

/// Every channel that a recording has, `None` for a run that ended early.
type Recorded = Option<Vec<Vec<f64>>>;

/// A machine in a few tests: slow ones, and one that uses all of its drive.
enum Subject {
    Low(Actuator),
    High(Actuator),
    Axis(ServoAxis),
}

fn steps(value_rad: f64) -> Command {
    Command::Steps(vec![Knot { time_s: 2e-3, value_rad }, Knot { time_s: 0.06, value_rad: 0.0 }])
}

impl Subject {
    fn all() -> Vec<(&'static str, Self)> {
        let axis = |text: &str| match parse_machine(text).expect("a model of ours") {
            MachineModel::ServoAxis(model) => Self::Axis(model.axis),
            MachineModel::Actuator(_) => panic!("an axis"),
        };
        vec![
            ("ema-48, low", Self::Low(EMA_48)),
            ("ema-48, high", Self::High(EMA_48)),
            ("bench, low", Self::Low(BENCH)),
            ("bench, high", Self::High(BENCH)),
            ("emps", axis(include_str!("../../../../fixtures/models/emps.toml"))),
            ("laas", axis(include_str!("../../../../fixtures/models/laas.toml"))),
        ]
    }

    fn geometry(&self) -> Geometry {
        match self {
            Self::Axis(axis) => axis.geometry,
            _ => Geometry::Rotary,
        }
    }

    /// What is recorded with effects, test by test.
    fn recorded(&self, effects: &[Effect]) -> Result<Vec<Recorded>, SimulationError> {
        let healthy = (&HealthState::HEALTHY).into();
        let test = |command: Command| Scenario {
            command,
            load_n_m: 2.0,
            duration_s: 0.1,
            start_angle_rad: 0.3,
            ..Scenario::chirp()
        };
        let sine = Command::Sine { amplitude_rad: 4e-3, frequency_hz: 20.0 };
        let tests = [test(sine), test(steps(0.2))];
        match self {
            Self::Low(actuator) => tests
                .iter()
                .map(|test| {
                    let model = LowFidelity::new(actuator, test)?.with_effects(effects)?;
                    let trace = model.simulate(&healthy);
                    Ok(trace.runaway.is_none().then(|| vec![trace.current_a]))
                })
                .collect(),
            Self::High(actuator) => tests
                .iter()
                .map(|test| {
                    let model = HighFidelity::new(actuator, test)?.with_effects(effects)?;
                    let trace = model.simulate(&healthy);
                    let [a, b, c] = trace.phase_currents_a;
                    Ok(trace.runaway.is_none().then(|| vec![a, b, c, trace.motor_angle_rad]))
                })
                .collect(),
            Self::Axis(axis) => Self::recorded_axis(axis, effects),
        }
    }

    fn recorded_axis(
        axis: &ServoAxis,
        effects: &[Effect],
    ) -> Result<Vec<Recorded>, SimulationError> {
        let law = &axis.controller;
        let commands = [
            Command::Sine { amplitude_rad: 0.1, frequency_hz: 2.0 },
            steps(0.5 * law.speed_limit.min(200.0)),
        ];
        let one = |command: Command| {
            let input = if law.position_gain_per_s > 0.0 {
                AxisInput::Position(command)
            } else {
                AxisInput::Speed(command)
            };
            let load = 0.05 * axis.force_constant * law.output_limit;
            let test = AxisScenario { input, load, duration_s: 0.4, start: AxisStart::default() };
            let simulation = ServoAxisSimulation::new(axis, &test)?.with_effects(effects)?;
            let trace = simulation.simulate(&(&HealthState::HEALTHY).into());
            let mut channels = vec![trace.position, trace.speed, trace.output];
            if axis.drive != Drive::Amplifier {
                channels.push(trace.current);
            }
            Ok(trace.runaway.is_none().then_some(channels))
        };
        commands.into_iter().map(one).collect()
    }

    /// The effect with one of its sizes, and with what it cannot do without.
    fn effect(&self, id: EffectId, key: &str, size: f64, in_loop: bool) -> Effect {
        let mut effect = Effect::new(id, self.geometry());
        if id == EffectId::Tabulated {
            let points = vec![[-1.0, -0.5], [1.0, 1.0]];
            let curve = Curve::new(Coordinate::Speed, CurveKind::Torque, points).expect("in order");
            effect = Effect::tabulated(curve, self.geometry());
        }
        if let (EffectId::Compliance, Self::Axis(axis)) = (id, self) {
            let key = id.info().parameters[2].key(self.geometry());
            effect.set(key, 0.4 * axis.inertia).expect("within bounds");
        }
        if id == EffectId::CurrentSensor {
            effect.set("in_loop", f64::from(u8::from(in_loop))).expect("a switch");
        }
        effect.set(key, size).expect("within bounds");
        effect
    }
}

/// Sizes from the middle of a number's range down to where it does nothing in any machine.
fn sizes(most: f64) -> impl Iterator<Item = f64> {
    (0..14).map(move |n| 0.5 * most * 10.0_f64.powi(-n))
}

/// Share of a channel's largest value that a change must have: shorter segments, which an effect
/// asks for whether or not it acts, change the current by up to 7e-8 in low fidelity and 5e-6 in
/// high (`docs/validation/simulator.md`).
const NOTICED_REL: f64 = 1e-4;

/// Largest change of any channel over its largest value.
fn change_rel(with: &[Recorded], base: &[Recorded]) -> f64 {
    let channels = with.iter().flatten().flatten().zip(base.iter().flatten().flatten());
    let relative = channels.map(|(with, base)| {
        let most = base.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let change = with.iter().zip(base).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        if change == 0.0 { 0.0 } else { change / most }
    });
    relative.fold(0.0, f64::max)
}

/// What a machine does with a number of an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Found {
    Acts,
    Refused,
    Idle,
}

fn found(subject: &Subject, base: &[Recorded], of: impl Fn(f64) -> Effect, most: f64) -> Found {
    for size in sizes(most) {
        match subject.recorded(&[of(size)]) {
            Ok(with) => {
                // driven away, or ever smaller, it shows nothing
                if with.iter().any(Option::is_none) {
                    continue;
                }
                return if change_rel(&with, base) > NOTICED_REL {
                    Found::Acts
                } else {
                    Found::Idle
                };
            }
            Err(SimulationError::Effect(EffectError::NotInModel { reason, .. })) => {
                if !reason.contains("longer than a tenth") {
                    return Found::Refused;
                }
            }
            Err(SimulationError::Effect(EffectError::TooStrong { .. })) => {}
            Err(other) => panic!("{other}"),
        }
    }
    panic!("no size is taken");
}

#[test]
fn every_number_of_an_effect_acts_or_is_refused() {
    let mut refused = Vec::new();
    for (name, subject) in Subject::all() {
        let base = subject.recorded(&[]).expect("runs");
        assert!(base.iter().all(Option::is_some), "{name}");
        for id in EffectId::ALL {
            for parameter in id.info().parameters {
                if parameter.role() != Role::Amplitude {
                    continue;
                }
                let key = parameter.key(subject.geometry());
                for in_loop in [false, true] {
                    if in_loop && id != EffectId::CurrentSensor {
                        continue;
                    }
                    let of = |size: f64| subject.effect(id, key, size, in_loop);
                    let found = found(&subject, &base, of, parameter.bounds().1);
                    assert_ne!(found, Found::Idle, "{name}: {key} of {id:?}, in loop: {in_loop}");
                    if found == Found::Refused {
                        let inside = if in_loop { ", in the loop" } else { "" };
                        refused.push(format!("{name}: {} {key}{inside}", id.info().symbol));
                    }
                }
            }
        }
    }
    // what acts nowhere would be refused everywhere, and this test pass
    for expected in [
        "emps: E16 inductance_henry",
        "emps: E19 gain_error_ratio",
        "emps: E19 lag_s, in the loop",
        "emps: E21 integral_error_ratio",
        "laas: E16 inductance_henry",
        "laas: E07 friction_drop_ratio",
        "laas: E21 position_gain_error_ratio",
        "ema-48, high: E16 inductance_henry",
    ] {
        assert!(refused.iter().any(|told| told == expected), "{expected}: {refused:#?}");
    }
    let six_step = refused.iter().filter(|told| told.starts_with("ema-48, low")).count();
    assert_eq!(six_step, 0, "{refused:#?}");
    assert_eq!(refused.len(), 50, "{refused:#?}");
}
