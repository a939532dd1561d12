//! Model files against presets, and what they refuse.

use approx::assert_abs_diff_eq;
use ema_sim::{
    Actuator, BackEmfShape, Coordinate, Curve, CurveKind, Effect, EffectId, FaultId, Geometry,
    HealthState, HighFidelity, Level, LowFidelity, MachineKind, NumberTolerance, Parameter,
    RangeOf, Scenario, ShortedTurns, Spread, ThermalCoefficient, ThermalNumber, Tolerance,
    UncertainNumber, VisitedRange,
    model_file::{self, ActionLevel, MachineModel, Model, ModelFileError},
    presets::{BENCH, EMA_48, bench_tolerance, ema_48_temperature, ema_48_tolerance},
};
use proptest::prelude::*;

fn message(text: &str) -> String {
    model_file::parse(text).expect_err(text).to_string()
}

#[test]
fn the_presets_equal_their_files() {
    let files = [
        (include_str!("../../../../fixtures/models/ema-48.toml"), EMA_48, "ema-48"),
        (include_str!("../../../../fixtures/models/bench.toml"), BENCH, "bench"),
    ];
    for (text, preset, name) in files {
        let model = model_file::parse(text).unwrap();
        assert_eq!(model.actuator, preset);
        assert_eq!(model.faults, FaultId::ALL);
        let again = model_file::parse(&model_file::write(&model)).unwrap();
        assert_eq!(again, model);
        let based = model_file::parse(&format!("base = \"{name}\"\n")).unwrap();
        assert_eq!(based.actuator, preset);
    }
}

#[test]
fn what_may_be_left_out_is_written_only_where_it_says_something() {
    let text = model_file::write(&EMA_48.into());
    for key in ["commutation", "position-sensor", "speed-derivative-a-s2-per-rad"] {
        assert!(!text.contains(key), "{text}");
    }
    let mut actuator = BENCH;
    actuator.controller.speed_derivative_a_s2_per_rad = 1e-5;
    let text = model_file::write(&actuator.into());
    assert!(text.contains("speed-derivative-a-s2-per-rad = 1e-5"), "{text}");
    assert_eq!(model_file::parse(&text).unwrap().actuator, actuator);
}

#[test]
fn a_number_is_told_as_it_stands() {
    let told = |text: &str| message(&format!("base = \"ema-48\"\n{text}\n"));
    assert_eq!(
        told("motor.pole-pairs = -4"),
        "`motor.pole-pairs` is -4, expected a number from 1 to 1000"
    );
    assert_eq!(
        told("motor.pole-pairs = nan"),
        "line 2: `motor.pole-pairs` is NaN, expected a number"
    );
    let block = "[[effect]]\nid = \"E01\"\nvalid-range = { speed = [nan, 5.0] }";
    assert_eq!(told(block), "line 4: `effect.valid-range` is NaN, expected a number");
}

#[test]
fn a_measured_back_emf_is_a_list() {
    let text = "base = \"bench\"\n[motor]\nback-emf-shape = [0.0, 0.9, 0.9, 0, -0.9, -0.9]\n";
    let model = model_file::parse(text).unwrap();
    let BackEmfShape::Tabulated(table) = model.actuator.motor.back_emf_shape else {
        panic!("{:?}", model.actuator.motor.back_emf_shape);
    };
    assert_eq!(table.samples(), [0.0, 0.9, 0.9, 0.0, -0.9, -0.9]);
    assert_eq!(model_file::parse(&model_file::write(&model)).unwrap(), model);
    let short = "base = \"bench\"\n[motor]\nback-emf-shape = [0.0, 1.0]\n";
    assert_eq!(message(short), "`motor.back-emf-shape` is 2, expected a number from 6 to 72");
    let word = "base = \"bench\"\n[motor]\nback-emf-shape = [0.0, \"a\"]\n";
    assert!(message(word).starts_with("line 3: `motor.back-emf-shape` is string"));
}

#[test]
fn a_base_fills_what_is_left_out() {
    let model = model_file::parse(
        "base = \"ema-48\"\nname = \"left \\\"aileron\\\"\"\nfaults = [\"k1\", \"k2\"]\n\
         [motor]\npole-pairs = 5\n[tolerance.motor]\nresistance-ohm = 0.05\n",
    )
    .unwrap();
    let mut wanted = EMA_48;
    wanted.motor.pole_pairs = 5;
    assert_eq!(model.actuator, wanted);
    assert_eq!(model.faults, [FaultId::Friction, FaultId::Backlash]);
    assert_eq!(model.tolerance[0].key(), "motor.resistance-ohm");
    assert_eq!(model_file::parse(&model_file::write(&model)).unwrap(), model);
    let onto = model_file::parse_onto("base = \"left.toml\"\n[motor]\npole-pairs = 6\n", &model);
    let onto = onto.unwrap();
    assert_eq!((onto.actuator.motor.pole_pairs, onto.name), (6, model.name));
    assert_eq!(model_file::base_of("base = \"left.toml\"").unwrap().unwrap(), "left.toml");
}

#[test]
fn shorted_turns_stay_in_the_machine_where_a_block_says_so() {
    let turns = |text: &str| model_file::parse(text).unwrap().actuator.motor.shorted_turns;
    assert_eq!(turns("base = \"ema-48\"\n"), ShortedTurns::Removed);
    let text = "base = \"ema-48\"\n[short-circuit]\nresistance-ohm = 0.05\n";
    assert_eq!(turns(text), ShortedTurns::closed_over(0.05));
    let model = model_file::parse(&format!("{text}leakage-ratio = 0.3\n")).unwrap();
    let told = format!("{:?}", model.actuator.motor.shorted_turns);
    assert_eq!(told, "Closed { resistance_ohm: 0.05, leakage_ratio: 0.3 }");
    assert_eq!(model_file::parse(&model_file::write(&model)).unwrap(), model);
    // what the block leaves out is the base's
    let onto = model_file::parse_onto("[short-circuit]\nresistance-ohm = 0.1\n", &model).unwrap();
    assert!(
        model_file::write(&onto)
            .contains("[short-circuit]\nresistance-ohm = 0.1\nleakage-ratio = 0.3")
    );
    let wrong = |block: &str| message(&format!("base = \"ema-48\"\n[short-circuit]\n{block}\n"));
    assert_eq!(
        wrong("leakage-ratio = 0.3"),
        "`short-circuit.resistance-ohm` is missing; give it, or a `base`"
    );
    assert_eq!(
        wrong("resistance-ohm = -1"),
        "`short-circuit.resistance-ohm` is -1, expected a number from 0 to 1000000"
    );
    assert_eq!(
        wrong("resistence-ohm = 1"),
        "line 3: unknown key `short-circuit.resistence-ohm`, did you mean `resistance-ohm`"
    );
}

#[test]
fn levels_for_decisions_are_stated_for_each_fault_apart() {
    let text = "base = \"ema-48\"\n[action-levels]\nk1 = { watch = 0.05, act = 0.1 }\n";
    let model = model_file::parse(text).unwrap();
    let ActionLevel { watch, act } = model.action_levels[0].unwrap();
    assert_eq!([watch, act], [0.05, 0.1]);
    assert!(model.action_levels[1..].iter().all(Option::is_none));
    assert_eq!(model_file::parse(&model_file::write(&model)).unwrap(), model);
    // what the block leaves out is the base's
    let more = "[action-levels]\nk6 = { watch = 0.02, act = 0.02 }\n";
    let onto = model_file::parse_onto(more, &model).unwrap();
    assert_eq!(onto.action_levels[0], model.action_levels[0]);
    assert_eq!(onto.action_levels[5], Some(ActionLevel { watch: 0.02, act: 0.02 }));
    let wrong = |level: &str| message(&format!("base = \"ema-48\"\n[action-levels]\n{level}\n"));
    let cases = [
        ("k7 = { watch = 0.1, act = 0.2 }", "line 3: unknown key `action-levels.k7`"),
        ("k1 = { wach = 0.1 }", "`action-levels.k1.wach`, did you mean `watch`"),
        (
            "k1 = { watch = 0, act = 0.2 }",
            "`action-levels.k1.watch` is 0, expected a level above 0",
        ),
        ("k1 = { watch = 0.1 }", "`action-levels.k1` is without `act`, expected a table with"),
        ("k1 = { watch = 0.3, act = 0.2 }", "is watched from 0.3 and acted on from 0.2, expected"),
        ("k1 = 0.2", "`action-levels.k1` is float, expected a table"),
    ];
    for (level, told) in cases {
        let found = wrong(level);
        assert!(found.contains(told), "{found}");
    }
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    let cases = [
        ("[motor\n", "line 1: "),
        (
            "base = \"ema-48\"\n[motor]\nresistence-ohm = 1.0\n",
            "line 3: unknown key `motor.resistence-ohm`, did you mean `motor.resistance-ohm`",
        ),
        ("base = \"ema-48\"\n[moter]\n", "line 2: unknown key `moter`, did you mean `motor`"),
        ("base = \"ema-49\"\n", "line 1: base `ema-49` is not one of ema-48"),
        ("base = 3\n", "line 1: `base` is integer, expected a text"),
        (
            "base = \"ema-48\"\n[motor]\nresistance-ohm = \"1\"\n",
            "line 3: `motor.resistance-ohm` is string, expected a number",
        ),
        (
            "base = \"ema-48\"\n[motor]\npole-pairs = 2.5\n",
            "line 3: `motor.pole-pairs` is 2.5, expected a whole number",
        ),
        (
            "base = \"ema-48\"\n[motor]\nback-emf-shape = \"square\"\n",
            "line 3: `motor.back-emf-shape` is square, expected \"trapezoid\" or \"sinusoid\"",
        ),
        (
            "base = \"bench\"\n[motor]\nback-emf-shape = \"trapezoid\"\n",
            "`inverter.commutation` is \"field-oriented\", which a machine with a trapezoidal \
             `motor.back-emf-shape` cannot have",
        ),
        (
            "base = \"ema-48\"\n[inverter]\ncommutation = \"foc\"\n",
            "line 3: `inverter.commutation` is foc, expected \"six-step\" or \"field-oriented\"",
        ),
        (
            "base = \"ema-48\"\nfaults = [\"k9\"]\n",
            "line 2: `faults` is \"k9\", expected a list of \"k1\" to \"k7\"",
        ),
        (
            "base = \"ema-48\"\n[tolerance.motor]\nresistance-ohm = 5\n",
            "line 3: `tolerance.motor.resistance-ohm` is 5, expected a share of the value, \
             from 0 to 1",
        ),
        (
            "base = \"ema-48\"\n\n[[effect]]\nid = \"E99\"\n",
            "line 3: effect `E99` is not one that this version simulates",
        ),
        ("[motor]\npole-pairs = 4\n", "`motor.resistance-ohm` is missing; give it, or a `base`"),
    ];
    for (text, wanted) in cases {
        let found = message(text);
        assert!(found.starts_with(wanted), "{text:?}: {found}");
    }
}

#[test]
fn parameters_that_no_machine_has_are_refused() {
    for value in ["-1.0", "inf", "0.0"] {
        let text = format!("base = \"ema-48\"\n[motor]\ninertia-kg-m2 = {value}\n");
        let error = model_file::parse(&text).unwrap_err();
        assert!(matches!(error, ModelFileError::Parameter(_)), "{value}: {error}");
        assert!(error.to_string().contains("motor.inertia-kg-m2"));
    }
}

proptest! {
    #[test]
    fn property_any_model_survives_its_file(scale in prop::collection::vec(0.9_f64..1.1, Parameter::ALL.len())) {
        let mut actuator: Actuator = EMA_48;
        let keep = ["motor.pole-pairs", "inverter.carrier-hz", "controller.sample-hz",
            "transmission.kinetic-friction-n-m", "transmission.efficiency-ratio"];
        let free = Parameter::ALL.iter().filter(|p| !keep.contains(&p.key()));
        for (parameter, factor) in free.zip(scale) {
            let value = parameter.get(&actuator);
            parameter.set(&mut actuator, value * factor);
        }
        let model = Model::from(actuator);
        prop_assert_eq!(model_file::parse(&model_file::write(&model)).unwrap(), model);
    }
}

const WITH_EFFECTS: &str = r#"
base = "ema-48"

[[effect]]
id = "E11"
name = "cogging of the new rotor"
port = "motor-torque"
parameters = { cogging-sin-n-m = 0.004, order = 24.0 }
interval-95 = { cogging-sin-n-m = [0.0038, 0.0042] }
status = "named"
alternatives = []
valid-range = { speed = [-55.0, 55.0] }
[effect.evidence]
p-familywise = 0.001
holdout-gain-nats = 597.0
[effect.faults]
k1 = { before = [0.256, 0.002], after = [0.174, 0.001] }
[effect.provenance]
records = ["r01.csv:sha256"]
quiet = true

[[effect]]
id = "U"
parameters = { scale-ratio = 0.5 }
curve = { over = "position", acts-as = "friction", points = [[-0.1, 0.0], [0.1, 2e-3]] }
"#;

#[test]
fn effects_are_read_and_written_back() {
    let model = model_file::parse(WITH_EFFECTS).unwrap();
    assert_eq!(model_file::parse(&model_file::write(&model)).unwrap(), model);
    let [cogging, unknown] = &model.effects[..] else { panic!("{model:?}") };
    assert_eq!(cogging.effect.id(), EffectId::Cogging);
    assert_eq!(cogging.effect.get("cogging_sin_n_m"), Some(0.004));
    assert_eq!(cogging.interval_95, [("cogging_sin_n_m".to_owned(), [0.0038, 0.0042])]);
    let keys: Vec<_> = cogging.annotations.iter().map(|(key, _)| key.as_str()).collect();
    for key in ["status", "alternatives", "valid-range", "evidence", "faults", "provenance"] {
        assert!(keys.contains(&key), "{key}");
    }
    let speed = cogging.valid_range().unwrap();
    assert_eq!((speed.speed, speed.position, speed.load), (Some([-55.0, 55.0]), None, None));
    assert_eq!((unknown.valid_range(), unknown.effect.get("scale_ratio")), (None, Some(0.5)));
    assert_eq!(unknown.effect.curve().unwrap().at(0.0), 1e-3);
}

#[test]
fn a_simulation_says_where_it_has_been() {
    let model = model_file::parse(WITH_EFFECTS).unwrap();
    let known = model.effects[0].valid_range().unwrap();
    let scenario = Scenario::chirp();
    let healthy = (&HealthState::HEALTHY).into();
    let low = LowFidelity::new(&EMA_48, &scenario).unwrap().simulate(&healthy).visited_range(0.5);
    let high = HighFidelity::new(&EMA_48, &scenario).unwrap().simulate(&healthy).visited_range(0.5);
    for visited in [low, high] {
        let [left] = &known.left_by(&visited)[..] else { panic!("{visited:?}") };
        assert_eq!((left.of, left.valid), (RangeOf::Speed, [-55.0, 55.0]));
        assert!(left.visited[0] < -55.0 && left.visited[1] > 55.0, "{left:?}");
        assert_eq!(visited.load, [0.5; 2]);
        let slow = VisitedRange { speed: [-55.0, 55.0], ..visited };
        assert_eq!(known.left_by(&slow), []);
    }
    for (range, found) in [
        ("velocity = [0.0, 1.0]", "is `velocity`, expected speed, position or load"),
        ("speed = [1.0, 0.0]", "is 1 to 0, expected the least and the largest value"),
        ("speed = 1.0", "expected a list of two numbers"),
    ] {
        let text =
            format!("base = \"ema-48\"\n[[effect]]\nid = \"E11\"\nvalid-range = {{ {range} }}\n");
        let error = model_file::parse(&text).unwrap_err().to_string();
        assert!(error.starts_with("line 4: ") && error.contains(found), "{error}");
    }
}

#[test]
fn every_effect_survives_a_file() {
    for id in EffectId::ALL {
        let mut effect = Effect::new(id, Geometry::Rotary);
        if id == EffectId::Tabulated {
            let points = vec![[0.0, 1.0]];
            let curve = Curve::new(Coordinate::Time, CurveKind::Torque, points).unwrap();
            effect = Effect::tabulated(curve, Geometry::Rotary);
        }
        for parameter in id.info().parameters {
            let (key, (least, most)) = (parameter.key(Geometry::Rotary), parameter.bounds());
            effect.set(key, (least + 0.123).min(most)).unwrap();
        }
        let mut model = Model::from(EMA_48);
        model.effects.push(effect.into());
        assert_eq!(model_file::parse(&model_file::write(&model)).unwrap(), model, "{id:?}");
    }
}

#[test]
fn without_its_effects_a_file_is_the_base_model() {
    let scenario = Scenario::chirp();
    let healthy = (&HealthState::HEALTHY).into();
    let simulated = |model: &Model| {
        let low = LowFidelity::new(&model.actuator, &scenario).unwrap();
        low.with_effects(&model.switched_on()).unwrap().simulate(&healthy)
    };
    let mut model = model_file::parse(WITH_EFFECTS).unwrap();
    let base = LowFidelity::new(&EMA_48, &scenario).unwrap().simulate(&healthy);
    assert_ne!(simulated(&model), base);
    model.effects.clear();
    assert_eq!(model, Model::from(EMA_48));
    assert_eq!(simulated(&model), base);
}

#[test]
fn an_effect_without_a_size_is_refused_with_its_keys() {
    let told = |block: &str| {
        let text = format!("base = \"ema-48\"\n\n[[effect]]\n{block}\n");
        model_file::parse(&text).map(drop).unwrap_err().to_string()
    };
    let message = "line 4: effect E11 (cogging) has no size and would do nothing: give \
                   `cogging-sin-n-m` or `cogging-cos-n-m` in `parameters`, and `order` if need be";
    assert_eq!(told("id = \"E11\""), message);
    assert_eq!(told("id = \"E11\"\nparameters = { order = 3.0 }"), message);
    assert_eq!(
        told("id = \"E13\""),
        "line 4: effect E13 (torque constant saturation) has no size and would do nothing: give \
         `saturation-per-a2` in `parameters`"
    );
    let message = told("id = \"U\"\nparameters = { scale-ratio = 2.0 }");
    assert!(
        message.starts_with("line 4: effect U (tabulated) has no `curve` and would do nothing")
            && message.contains("over = \"motor-angle\" or \"speed\""),
        "{message}"
    );
    // a size that stands there as zero is an effect that waits for its size
    let text = "base = \"ema-48\"\n[[effect]]\nid = \"E13\"\n\
                parameters = { saturation-per-a2 = 0.0 }\n";
    assert!(model_file::parse(text).unwrap().effects[0].effect.is_off());
}

#[test]
fn a_slip_in_an_effect_is_named() {
    let cases = [
        (
            "cogging-sin-n-m = 0.004",
            "cogging = 0.004",
            "line 8: effect E11 has no parameter `cogging`",
        ),
        ("order = 24.0", "order = -1.0", "`order` of effect E11 is -1, expected a number from 0"),
        (
            "\"motor-torque\"",
            "\"sensor\"",
            "line 7: `effect.port` is sensor, expected motor-torque",
        ),
        ("status =", "verdict =", "line 10: `effect` is `verdict`, expected id, name"),
        ("\"position\"", "\"place\"", "`effect.curve.over` is `place`, which is none of"),
        ("[-0.1, 0.0]", "[0.2, 0.0]", "is point 1 of a curve is not finite or not beyond"),
    ];
    for (from, to, wanted) in cases {
        let error = model_file::parse(&WITH_EFFECTS.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}\n{wanted}");
    }
    let error = model_file::parse("kind = \"servo-axis\"\n").unwrap_err().to_string();
    assert_eq!(error, "line 1: a `servo-axis` where an actuator is expected");
}

const TOLERANCES: &str = r#"
base = "ema-48"

[tolerance.motor]
inertia-kg-m2 = 0.1
resistance-ohm = { sd = 0.05 }
viscous-n-m-s-per-rad = { half-width = 0.05, level = "session" }

[tolerance.transmission]
static-over-kinetic = [{ sd = 0.1, level = "unit" }, { sd = 0.03, level = "session" }]

[tolerance.test]
load-n-m = { sd = 2.5, level = "recording" }

[tolerance.sensors]
phase-gain = { sd = 0.01 }
phase-offset-a = [
    { sd = 0.005, level = "type" },
    { half-width = 0.02, level = "unit" },
    { sd = 0.01, level = "session" },
    { sd = 0.001, level = "recording" },
]

[tolerance.as-built]
turns = { sd = 0.003 }
eccentricity = { sd = 0.02 }
"#;

fn tolerance(key: &str, spread: Spread, level: Level) -> Tolerance {
    Tolerance { number: UncertainNumber::find(key).expect(key), spread, level }
}

#[test]
fn tolerances_are_read_at_their_levels() {
    let model = model_file::parse(TOLERANCES).unwrap();
    let wanted = [
        ("motor.inertia-kg-m2", Spread::HalfWidth(0.1), Level::Unit),
        ("motor.resistance-ohm", Spread::Std(0.05), Level::Unit),
        ("motor.viscous-n-m-s-per-rad", Spread::HalfWidth(0.05), Level::Session),
        ("transmission.static-over-kinetic", Spread::Std(0.1), Level::Unit),
        ("transmission.static-over-kinetic", Spread::Std(0.03), Level::Session),
        ("test.load-n-m", Spread::Std(2.5), Level::Recording),
        ("sensors.phase-gain", Spread::Std(0.01), Level::Unit),
        ("sensors.phase-offset-a", Spread::Std(0.005), Level::Type),
        ("sensors.phase-offset-a", Spread::HalfWidth(0.02), Level::Unit),
        ("sensors.phase-offset-a", Spread::Std(0.01), Level::Session),
        ("sensors.phase-offset-a", Spread::Std(0.001), Level::Recording),
        ("as-built.turns", Spread::Std(0.003), Level::Unit),
        ("as-built.eccentricity", Spread::Std(0.02), Level::Unit),
    ];
    assert_eq!(model.tolerance.len(), wanted.len());
    for (key, spread, level) in wanted {
        assert!(model.tolerance.contains(&tolerance(key, spread, level)), "{key} {level:?}");
    }
    assert_eq!(model_file::parse(&model_file::write(&model)).unwrap(), model);
}

#[test]
fn a_tolerance_of_the_file_replaces_all_levels_of_its_base() {
    let base = model_file::parse(TOLERANCES).unwrap();
    let text = "[tolerance.sensors]\nphase-offset-a = { sd = 0.03, level = \"session\" }\n";
    let onto = model_file::parse_onto(text, &base).unwrap();
    let (new, old): (Vec<Tolerance>, Vec<Tolerance>) =
        onto.tolerance.into_iter().partition(|one| one.key() == "sensors.phase-offset-a");
    let session = tolerance("sensors.phase-offset-a", Spread::Std(0.03), Level::Session);
    assert_eq!(new, [session]);
    assert_eq!(old.len(), base.tolerance.len() - 4);
}

#[test]
fn a_plain_tolerance_is_written_as_it_was() {
    let text = model_file::write(&model_file::parse(TOLERANCES).unwrap());
    for line in [
        "\ninertia-kg-m2 = 0.1\n",
        "\nresistance-ohm = { sd = 0.05, level = \"unit\" }\n",
        "\nstatic-over-kinetic = [{ sd = 0.1, level = \"unit\" }, { sd = 0.03, level = \"session\" }]\n",
    ] {
        assert!(text.contains(line), "{text}");
    }
}

#[test]
fn a_slip_in_a_tolerance_is_named_with_its_line() {
    let told = |block: &str, line: &str| {
        message(&format!("base = \"ema-48\"\n[tolerance.{block}]\n{line}\n"))
    };
    let cases = [
        (
            "motor",
            "inertia-kg-m2 = { level = \"unit\" }",
            "`tolerance.motor.inertia-kg-m2` is a table with neither of `sd` and `half-width`, \
             expected a table with one of them",
        ),
        (
            "motor",
            "inertia-kg-m2 = { sd = 0.1, half-width = 0.1 }",
            "`tolerance.motor.inertia-kg-m2` is a table with both of `sd` and `half-width`, \
             expected a table with one of them",
        ),
        (
            "motor",
            "inertia-kg-m2 = { sd = 0.1, level = \"batch\" }",
            "`tolerance.motor.inertia-kg-m2.level` is \"batch\", expected \"type\", \"unit\", \
             \"session\" or \"recording\"",
        ),
        (
            "motor",
            "inertia-kg-m2 = { sd = 0.1, levle = \"unit\" }",
            "unknown key `tolerance.motor.inertia-kg-m2.levle`",
        ),
        (
            "motor",
            "inertia-kg-m2 = { half-with = 0.1 }",
            "unknown key `tolerance.motor.inertia-kg-m2.half-with`, did you mean `half-width`",
        ),
        (
            "sensors",
            "phase-gian = 0.1",
            "unknown key `sensors.phase-gian`, did you mean `sensors.phase-gain`",
        ),
        (
            "sensor",
            "phase-gain = 0.1",
            "unknown key `sensor.phase-gain`, did you mean `sensors.phase-gain`",
        ),
        (
            "as-built",
            "turns = { sd = 1.0 }",
            "`tolerance.as-built.turns.sd` is 1, expected a share of the value, from 0 to 1",
        ),
        (
            "test",
            "load-n-m = -0.1",
            "`tolerance.test.load-n-m` is -0.1, expected a finite number from 0",
        ),
        (
            "sensors",
            "phase-offset-a = { sd = inf }",
            "`tolerance.sensors.phase-offset-a.sd` is inf, expected a finite number from 0",
        ),
        (
            "sensors",
            "phase-gain = [{ sd = 0.01 }, { half-width = 0.02, level = \"unit\" }]",
            "`tolerance.sensors.phase-gain` is given twice for level \"unit\", \
             expected one table for each level",
        ),
        (
            "sensors",
            "phase-gain = [0.01]",
            "`tolerance.sensors.phase-gain` is a list with float, expected tables with `sd` or \
             `half-width`, one for each level",
        ),
        ("sensors", "phase-gain = []", "`tolerance.sensors.phase-gain` is an empty list, expected"),
        (
            "sensors",
            "phase-gain = \"1 %\"",
            "`tolerance.sensors.phase-gain` is string, expected a number",
        ),
    ];
    for (block, line, wanted) in cases {
        let found = told(block, line);
        assert!(found.starts_with(&format!("line 3: {wanted}")), "{line}: {found}");
    }
}

#[test]
fn numbers_with_a_tolerance_are_parameters_of_type_and_unit() {
    let text = "base = \"ema-48\"\n[tolerance.motor]\n\
                inertia-kg-m2 = 0.1\n\
                resistance-ohm = [{ half-width = 0.03, level = \"type\" }, { half-width = 0.04 }, \
                { sd = 0.3, level = \"session\" }]\n\
                viscous-n-m-s-per-rad = { sd = 0.2 }\n\
                inductance-henry = { sd = 0.1, level = \"recording\" }\n\
                [tolerance.sensors]\nphase-gain = { sd = 0.01 }\n";
    let model = model_file::parse(text).unwrap();
    let half_width = |key| {
        let place = Parameter::ALL.iter().position(|p| p.key() == key).expect("a parameter");
        let one = model.rough().into_iter().find(|one: &NumberTolerance| one.place == place);
        one.map(|one| one.half_width_frac)
    };
    assert_eq!(model.rough().len(), 3);
    assert_eq!(half_width("motor.inertia-kg-m2"), Some(0.1));
    // 3-4-5
    assert_eq!(half_width("motor.resistance-ohm"), Some(0.05));
    assert_eq!(half_width("motor.viscous-n-m-s-per-rad"), Some(0.2 * 3.0_f64.sqrt()));
}

#[test]
fn an_axis_has_tolerances_at_levels_too() {
    let text = include_str!("../../../../fixtures/models/axis.toml");
    let plain = model_file::parse_machine(text).unwrap();
    let text = text.replace(
        "viscous-n-m-s-per-rad = 0.3",
        "viscous-n-m-s-per-rad = [{ sd = 0.3, level = \"unit\" }, \
         { sd = 0.05, level = \"session\" }]",
    );
    let levels = model_file::parse_machine(&text).unwrap();
    assert_eq!(model_file::parse_machine(&levels.write()).unwrap(), levels);
    let MachineModel::ServoAxis(axis) = &levels else { panic!("{levels:?}") };
    assert_eq!(axis.tolerance.len(), 3);
    let half_widths = |model: &MachineModel| -> Vec<f64> {
        model.kind().rough().iter().map(|one| one.half_width_frac).collect()
    };
    assert_eq!(half_widths(&plain), [0.1, 0.3]);
    assert_eq!(half_widths(&levels), [0.1, 0.3 * 3.0_f64.sqrt()]);
    let twice = text.replace("level = \"session\"", "level = \"unit\"");
    let error = model_file::parse_machine(&twice).unwrap_err().to_string();
    assert!(error.contains("given twice for level \"unit\""), "{error}");
}

#[test]
fn a_spread_has_a_standard_deviation() {
    assert_eq!(Spread::Std(0.03).std(), 0.03);
    assert_eq!(Spread::HalfWidth(0.3).std(), 0.3 / 3.0_f64.sqrt());
    assert_eq!(Spread::HalfWidth(0.3).half_width(), 0.3);
    for number in UncertainNumber::BESIDES_PARAMETERS {
        assert_eq!(UncertainNumber::find(number.key()), Some(number));
        assert!(Parameter::find(number.key()).is_none(), "{number:?}");
    }
    for level in Level::ALL {
        assert_eq!(Level::find(level.key()), Some(level));
    }
}

#[test]
fn the_tolerances_of_the_presets_survive_a_file() {
    for (actuator, tolerance) in [(EMA_48, ema_48_tolerance()), (BENCH, bench_tolerance())] {
        assert_eq!(Model::from(actuator).tolerance, []);
        let temperature = Some(ema_48_temperature());
        let model = Model { tolerance, temperature, ..actuator.into() };
        assert_eq!(model_file::parse(&model_file::write(&model)).unwrap(), model);
    }
    let play = tolerance("transmission.backlash-rad", Spread::Std(0.3), Level::Unit);
    assert!(ema_48_tolerance().contains(&play));
    assert_eq!(bench_tolerance().len(), ema_48_tolerance().len() + 2);
}

#[test]
fn a_law_of_temperature_is_read_and_checked() {
    let read = |block: &str| {
        let text = format!("base = \"ema-48\"\n{block}\n");
        model_file::parse(&text).map_err(|error| error.to_string())
    };
    let model = read(
        "[temperature]\nnominal-k = 293\nback-emf-per-k = { value = -0.001, sd = 0.0002 }\n\
         viscous-per-k = -0.02",
    );
    let law = model.unwrap().temperature.unwrap();
    let back_emf = law.coefficient(ThermalNumber::BackEmf);
    assert_eq!((back_emf.per_k, back_emf.std_per_k), (-0.001, 0.0002));
    assert_eq!(law.coefficient(ThermalNumber::Viscous).per_k, -0.02);
    assert_eq!(law.coefficient(ThermalNumber::Resistance), ThermalCoefficient::default());
    // 50 K warmer: magnets 5 % weaker, a drag of e^-1
    assert_abs_diff_eq!(ThermalNumber::BackEmf.ratio(back_emf.per_k, 50.0), 0.95, epsilon = 1e-12);
    assert_abs_diff_eq!(
        ThermalNumber::Viscous.ratio(-0.02, 50.0),
        (-1.0f64).exp(),
        epsilon = 1e-12
    );
    let scatter = "[tolerance.test]\nwinding-temperature-k = { sd = 15.0, level = \"session\" }";
    for (block, told) in [
        (scatter.to_owned(), "given without one, expected a block `[temperature]`"),
        ("[temperature]\nviscous-per-k = -0.02".to_owned(), "`temperature.nominal-k` is missing"),
        (
            "[temperature]\nnominal-k = 20".to_owned(),
            "line 3: `temperature.nominal-k` is 20, expected 150 to 600 K",
        ),
        (
            "[temperature]\nnominal-k = 293\nviscous-per-k = -2".to_owned(),
            "line 4: `temperature.viscous-per-k` is -2, expected a share per kelvin of at most 0.1",
        ),
        (
            "[temperature]\nnominal-k = 293\nviscous-per-k = { sd = 0.01 }".to_owned(),
            "line 4: `temperature.viscous-per-k` is without it, expected a table with `value`",
        ),
        (
            "[temperature]\nnominal-k = 293\nviscus-per-k = -0.02".to_owned(),
            "unknown key `temperature.viscus-per-k`, did you mean `viscous-per-k`",
        ),
    ] {
        let error = read(&block).unwrap_err();
        assert!(error.contains(told), "{error}");
    }
    let law = "[temperature]\nnominal-k = 293\nviscous-per-k = -0.02\n";
    assert!(read(&format!("{law}{scatter}")).is_ok());
}
