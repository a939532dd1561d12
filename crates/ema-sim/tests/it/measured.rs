//! Machines of other laboratories, described by a model file alone. The recordings are not part of
//! this repository: `FDI_MEASURED_DATA` names the folder that holds them.

use std::{fs::File, io::Read, path::PathBuf};

use ema_sim::{
    AxisInput, AxisScenario, AxisStart, AxisTrace, Command, HealthState, ServoAxis,
    ServoAxisSimulation,
    model_file::{MachineModel, parse_machine},
};
use skipped_tests::skip;

#[expect(clippy::print_stderr, reason = "a figure is shown")]
fn say(what: &str) {
    eprintln!("{what}");
}

/// The columns of a recording; none where no folder is named.
#[track_caller]
fn recording(path: &str) -> Option<Vec<Vec<f64>>> {
    let Some(folder) = std::env::var_os("FDI_MEASURED_DATA") else {
        skip("FDI_MEASURED_DATA is not set");
        return None;
    };
    let file = File::open(PathBuf::from(folder).join(path)).expect("the recording is there");
    let mut text = String::new();
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).expect("a text");
    let mut columns = Vec::new();
    for line in text.lines().skip(1) {
        let cells = line.split(',').map(|cell| cell.parse::<f64>().expect("a number"));
        for (place, value) in cells.enumerate() {
            if columns.len() <= place {
                columns.push(Vec::new());
            }
            columns[place].push(value);
        }
    }
    Some(columns)
}

fn axis(text: &str) -> ServoAxis {
    match parse_machine(text).expect("a model") {
        MachineModel::ServoAxis(model) => model.axis,
        other @ MachineModel::Actuator(_) => panic!("{other:?}"),
    }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), x| (sum + x * x, count + 1.0));
    (sum / count).sqrt()
}

const EMPS: &str = include_str!("../../../../fixtures/models/emps.toml");

/// The rig's own reference through its own controller, from its first position and speed.
fn emps(reference: &[f64], position: &[f64]) -> AxisTrace {
    let axis = axis(EMPS);
    let sample_hz = axis.controller.sample_hz;
    let speed = (position[10] - position[0]) * sample_hz / 10.0;
    let scenario = AxisScenario {
        input: AxisInput::Position(Command::Recorded {
            values_rad: reference.to_vec(),
            rate_hz: sample_hz,
        }),
        load: 0.0,
        duration_s: reference.len() as f64 / sample_hz,
        start: AxisStart { position: position[0], speed, ..AxisStart::default() },
    };
    let simulation = ServoAxisSimulation::new(&axis, &scenario).expect("valid");
    simulation.simulate(&(&HealthState::HEALTHY).into())
}

#[test]
fn published_emps_follows_its_training_reference() {
    let Some(columns) = recording("emps/emps_train.csv.gz") else { return };
    let (reference, position, voltage) = (&columns[1], &columns[2], &columns[3]);
    let trace = emps(reference, position);
    // the start of the record is under way already, with a transient of the filters in it
    let after_start = 300;
    let share = |found: &[f64], measured: &[f64]| {
        let apart = found.iter().zip(measured).map(|(a, b)| a - b);
        rms(apart.skip(after_start)) / rms(measured.iter().copied().skip(after_start))
    };
    let force = share(&trace.output, voltage);
    let apart_m = trace.position.iter().zip(position).map(|(a, b)| a - b);
    let apart_m = rms(apart_m.skip(after_start));
    let lag_m = reference.iter().zip(position).map(|(a, b)| a - b);
    let lag_m = rms(lag_m.skip(after_start));
    say(&format!("EMPS: force {force}, position {apart_m} m rms, reference {lag_m} m ahead"));
    // 4.55 % measured here, in closed loop and without any filter; published 4.08 % of the force
    // that the measured position asks for
    assert!(force < 0.046, "{force}");
    // 1.6 µm of 580 µm
    assert!(apart_m < 1.7e-6, "{apart_m}");
    assert!((5e-4..7e-4).contains(&lag_m), "{lag_m}");
}

const LAAS: &str = include_str!("../../../../fixtures/models/laas.toml");

/// The recorded current of a motor through inertia and viscous drag alone: what is left is what
/// the recordings have to teach (dry friction, cogging).
#[test]
fn laas_motor_turns_with_its_recorded_current() {
    let Some(columns) = recording("laas_cogging/acc_current.csv.gz") else { return };
    let axis = axis(LAAS);
    // the record has gaps of up to 7 ms: onto the rate of the model, straight between samples
    let (time_s, sample_hz) = (&columns[0], axis.controller.sample_hz);
    let ticks = (4.0 * sample_hz) as usize;
    let resampled = |column: &[f64]| -> Vec<f64> {
        let at = |tick: usize| {
            let when = time_s[0] + tick as f64 / sample_hz;
            let after = time_s.partition_point(|t| *t <= when).clamp(1, time_s.len() - 1);
            let share = (when - time_s[after - 1]) / (time_s[after] - time_s[after - 1]);
            column[after - 1] + share * (column[after] - column[after - 1])
        };
        (0..ticks).map(at).collect()
    };
    let (speed, current) = (resampled(&columns[2]), resampled(&columns[3]));
    let scenario = AxisScenario {
        input: AxisInput::Output(Command::Steps(Vec::new())),
        load: 0.0,
        duration_s: 4.0,
        start: AxisStart { speed: speed[0], ..AxisStart::default() },
    };
    let simulation = ServoAxisSimulation::new(&axis, &scenario)
        .and_then(|simulation| simulation.with_replayed_output(&current))
        .expect("valid");
    let trace = simulation.simulate(&(&HealthState::HEALTHY).into());
    let apart = rms(trace.speed.iter().zip(&speed).map(|(a, b)| a - b));
    let share = apart / rms(speed.iter().copied());
    say(&format!("LAAS: speed {share} of its rms from the recorded current alone"));
    // 5.0 % measured
    assert!(share < 0.055, "{share}");
}
