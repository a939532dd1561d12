//! The page of effects names them and says where they act as the code does.

use std::{fs, path::Path};

use ema_sim::{
    Actuator, AxisController, AxisInput, AxisScenario, AxisStart, Command, Drive, Effect, EffectId,
    Feedback, Geometry, HighFidelity, LowFidelity, Scenario, ServoAxis, ServoAxisSimulation,
    SimulationError,
    presets::{BENCH, EMA_48},
};

use super::effects::examples;

pub(crate) fn axis(drive: Drive) -> ServoAxis {
    ServoAxis {
        geometry: Geometry::Rotary,
        inertia: 1e-3,
        viscous: 1e-3,
        kinetic_friction: 0.02,
        static_friction: 0.03,
        offset: 0.0,
        backlash: 0.0,
        drive,
        force_constant: 0.1,
        resistance_ohm: 1.0,
        controller: AxisController {
            sample_hz: 1e3,
            position_gain_per_s: 20.0,
            position_integral_per_s2: 0.0,
            position_derivative_ratio: 0.0,
            speed_limit: 50.0,
            speed_gain: 1.0,
            speed_integral: 20.0,
            output_limit: 5.0,
            speed_samples: 0,
            encoder_step: 0.0,
            feedback: Feedback::Motor,
        },
    }
}

/// Whether a model takes an effect.
fn takes(column: &str, effect: &Effect) -> bool {
    let effects = core::slice::from_ref(effect);
    let low =
        |a: &Actuator| LowFidelity::new(a, &Scenario::chirp())?.with_effects(effects).map(drop);
    let high =
        |a: &Actuator| HighFidelity::new(a, &Scenario::chirp())?.with_effects(effects).map(drop);
    let servo = |drive| {
        let scenario = AxisScenario {
            input: AxisInput::Position(Command::SINE),
            load: 0.0,
            duration_s: 1.0,
            start: AxisStart::default(),
        };
        ServoAxisSimulation::new(&axis(drive), &scenario)?.with_effects(effects).map(drop)
    };
    let taken = match column {
        "six-step, low" => low(&EMA_48),
        "six-step, high" => high(&EMA_48),
        "field-oriented, low" => low(&BENCH),
        "field-oriented, high" => high(&BENCH),
        "axis, current" => servo(Drive::Current),
        "axis, winding" => servo(Drive::Winding),
        other => panic!("a column `{other}`"),
    };
    match taken {
        Ok(()) => true,
        Err(SimulationError::Effect(_)) => false,
        Err(other) => panic!("{other}"),
    }
}

/// Effects of a cell: `E17, E18`, `E01 to E07`.
fn named(cell: &str) -> Vec<EffectId> {
    let place = |symbol: &str| {
        let found = EffectId::ALL.iter().position(|id| id.info().symbol == symbol);
        found.unwrap_or_else(|| panic!("no effect {symbol}"))
    };
    let range = |part: &str| match part.split_once(" to ") {
        Some((first, last)) => EffectId::ALL[place(first)..=place(last)].to_vec(),
        None => vec![EffectId::ALL[place(part)]],
    };
    cell.split(", ").flat_map(range).collect()
}

#[test]
fn the_table_of_effects_is_true() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/models/effects.md");
    let page = fs::read_to_string(page).unwrap();
    let cells = |line: &str| -> Vec<String> {
        line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()
    };
    let lines = page.lines().skip_while(|line| !line.starts_with("| effect | six-step, low"));
    let mut lines = lines.take_while(|line| line.starts_with('|')).map(cells);
    let columns = lines.next().expect("the table");
    let mut told = Vec::new();
    for row in lines.skip(1) {
        for id in named(&row[0]) {
            let mut effect =
                examples().into_iter().find(|effect| effect.id() == id).expect("one of each");
            for (column, cell) in columns.iter().zip(&row).skip(1) {
                if id == EffectId::Compliance {
                    let part = if column.starts_with("axis") { 4e-4 } else { 0.0 };
                    effect.set("load_inertia_kg_m2", part).unwrap();
                }
                if id == EffectId::InductanceEddy {
                    // of it high fidelity and an axis without voltage have the eddy loss alone
                    let alone = column.ends_with("high") || column == "axis, current";
                    let henry = if alone { 0.0 } else { 7.2e-4 };
                    effect.set("inductance_henry", henry).unwrap();
                }
                let said = match cell.as_str() {
                    "yes" => true,
                    "no" => false,
                    other => panic!("a cell `{other}`"),
                };
                assert_eq!(takes(column, &effect), said, "{id:?} in {column}");
            }
            told.push(id);
        }
    }
    assert_eq!(told, EffectId::ALL);
}

#[test]
fn the_page_calls_each_effect_what_the_catalogue_does() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/models/effects.md");
    let page = fs::read_to_string(page).unwrap();
    let lines = page.lines().skip_while(|line| !line.starts_with("| id | effect | adds |"));
    let rows: Vec<&str> = lines.skip(2).take_while(|line| line.starts_with('|')).collect();
    assert_eq!(rows.len(), EffectId::ALL.len());
    for (row, id) in rows.into_iter().zip(EffectId::ALL) {
        let info = id.info();
        let (start, end) =
            (format!("| {} | {} | ", info.symbol, info.name), format!(" | {} |", info.mimics));
        assert!(row.starts_with(&start) && row.ends_with(&end), "{row}\n{start}…{end}");
    }
}

#[test]
fn what_an_effect_is_confounded_with_is_in_the_catalogue() {
    for id in EffectId::ALL {
        for word in id.info().mimics.split(|c: char| !c.is_ascii_alphanumeric()) {
            let digits = word.strip_prefix('E').filter(|rest| rest.len() == 2);
            if digits.is_some_and(|rest| rest.bytes().all(|byte| byte.is_ascii_digit())) {
                assert!(EffectId::find(word).is_some_and(|other| other != id), "{id:?}: {word}");
            }
        }
    }
}
