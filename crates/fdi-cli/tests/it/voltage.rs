//! The motor's voltage beside the current, and how well each fault is told.

use std::fs;

use fdi_core::{
    Schema,
    report::{Diagnosis, FaultId, Further, NoticeCode, RecordDiagnosis},
};
use tempfile::TempDir;

use crate::{
    commands::{answer, output, whole},
    unit::refusal,
};

/// Simulates a chirp, with the motor's voltage or without.
fn simulated(folder: &TempDir, name: &str, seed: &str, options: &[&str]) {
    let plain = ["simulate", "--noise-a", "0.02", "--seed", seed, "-o", name];
    let said = output(folder.path(), &[&plain, options].concat());
    assert_eq!(said.status.code(), Some(0), "{}", whole(&said));
}

fn diagnosed(folder: &TempDir, options: &[&str]) -> Vec<RecordDiagnosis> {
    let plain = ["diagnose", "--output-format", "json", "--stable", "--identifiability"];
    let said = output(folder.path(), &[&plain, options].concat());
    let answer: Diagnosis = answer(&said, Schema::Diagnosis);
    answer.records
}

fn std_of(record: &RecordDiagnosis, id: FaultId) -> f64 {
    record.identifiability.iter().find(|one| one.id == id).unwrap().std
}

#[test]
fn references_and_recording_with_voltage_tell_a_small_short() {
    let folder = TempDir::new().unwrap();
    let mut options: Vec<Vec<String>> = vec![Vec::new(), Vec::new()];
    for (place, extra) in [&["--motor-voltage"][..], &[]].into_iter().enumerate() {
        for seed in ["11", "12", "13", "14"] {
            let name = format!("ref-{place}-{seed}.csv");
            simulated(&folder, &name, seed, extra);
            let text = fs::read_to_string(folder.path().join(&name)).unwrap();
            let dated = format!("# session = \"day {seed}\"\n{text}");
            fs::write(folder.path().join(&name), dated).unwrap();
            options[place].extend(["--reference".to_owned(), name]);
        }
        let name = format!("later-{place}.csv");
        simulated(&folder, &name, "3", &[&["--faults", "k4=0.01"], extra].concat());
        options[place].push(name);
    }
    let [with, without] = [0, 1].map(|place| {
        let options: Vec<&str> = options[place].iter().map(String::as_str).collect();
        diagnosed(&folder, &options).remove(0)
    });
    assert_eq!(with.notice(NoticeCode::VoltageUnused), None);
    assert_eq!(with.faults[3].detected, Some(true), "{with:?}");
    for id in [FaultId::K3, FaultId::K4, FaultId::K5] {
        let (with, without) = (std_of(&with, id), std_of(&without, id));
        assert!(with < 0.6 * without, "{id}: {with} {without}");
    }
    assert!((with.faults[3].value.unwrap() - 0.01).abs() < 3.0 * std_of(&with, FaultId::K4));
}

/// The load changes the current and with it the voltage: neither looks like a short, nor hides one.
#[test]
fn a_voltage_under_another_load_than_the_references_is_no_short() {
    let folder = TempDir::new().unwrap();
    let mut options = Vec::new();
    for seed in ["1", "2", "3", "4"] {
        let name = format!("ref-{seed}.csv");
        simulated(&folder, &name, seed, &["--motor-voltage"]);
        options.extend(["--reference".to_owned(), name]);
    }
    let later = [("0", "k3=0"), ("0", "k3=0.01"), ("1", "k3=0"), ("1", "k3=0.01")];
    for (place, (load, faults)) in later.into_iter().enumerate() {
        for seed in 3..6 {
            let name = format!("later-{place}-{seed}.csv");
            let extra = ["--motor-voltage", "--load-n-m", load, "--faults", faults];
            simulated(&folder, &name, &(100 + seed).to_string(), &extra);
            options.push(name);
        }
    }
    let options: Vec<&str> = options.iter().map(String::as_str).collect();
    let records = diagnosed(&folder, &options);
    for (record, (load, faults)) in records.iter().zip(later.iter().flat_map(|case| [case; 3])) {
        assert_eq!(record.notice(NoticeCode::VoltageUnused), None);
        let is_short = record.faults[2].detected == Some(true);
        assert_eq!(is_short, *faults != "k3=0", "{load} N·m: {:?}", record.faults[2]);
    }
}

#[test]
fn a_report_shows_how_well_each_fault_is_told() {
    let folder = TempDir::new().unwrap();
    simulated(&folder, "r.csv", "5", &[]);
    let records = diagnosed(&folder, &["r.csv"]);
    let further: Vec<Option<Further>> = records[0]
        .identifiability
        .iter()
        .map(|one| one.would_help.as_ref().map(|further| further.what))
        .collect();
    assert_eq!(further, [Some(Further::References); 6]);
    let said = output(folder.path(), &["diagnose", "r.csv", "--report", "r.html"]);
    assert_eq!(said.status.code(), Some(0), "{}", whole(&said));
    let page = fs::read_to_string(folder.path().join("r.html")).unwrap();
    assert!(page.contains("How well this recording tells each fault"));
    assert!(page.contains("shared with transmission.kinetic-friction-n-m"));
}

#[test]
fn a_duty_without_its_supply_is_told() {
    let folder = TempDir::new().unwrap();
    simulated(&folder, "r.csv", "5", &["--motor-voltage"]);
    let map = ["r.csv", "--map", "duty_frac=motor_voltage_v*0.0208"];
    let records = diagnosed(&folder, &map);
    let told = &records[0].notice(NoticeCode::VoltageUnused).unwrap().message;
    assert!(told.contains("`duty_frac` is recorded without `bus_voltage_v`"), "{told}");
}

/// Columns of a row that a voltage is written as, by the row and the voltage, V.
type Written<'a> = &'a dyn Fn(usize, f64) -> String;

#[test]
fn what_is_wrong_with_a_duty_is_told() {
    let folder = TempDir::new().unwrap();
    simulated(&folder, "r.csv", "5", &["--motor-voltage"]);
    let text = fs::read_to_string(folder.path().join("r.csv")).unwrap();
    let told = |columns: &str, of: Written<'_>| {
        let mut rows = 0;
        let line = |line: &str| match line.rsplit_once(',') {
            Some((rest, "motor_voltage_v")) => format!("{rest},{columns}\n"),
            Some((rest, value)) if !line.starts_with('#') => {
                rows += 1;
                format!("{rest},{}\n", of(rows, value.parse().unwrap()))
            }
            _ => format!("{line}\n"),
        };
        let text: String = text.lines().map(line).collect();
        fs::write(folder.path().join("d.csv"), text).unwrap();
        let records = diagnosed(&folder, &["d.csv"]);
        records[0].notice(NoticeCode::VoltageUnused).map(|notice| notice.message.clone())
    };
    let both = "duty_frac,bus_voltage_v";
    let cases: [(&str, Written<'_>, &str); 6] = [
        (
            "motor_voltage_v",
            &|_, v| v.clamp(-14.0, 14.0).to_string(),
            "an end of its range; record it with a wider range",
        ),
        (
            both,
            &|_, v| format!("{},48", (v / 48.0).clamp(-0.3, 0.3)),
            "an end of its range; record it with a wider range",
        ),
        (
            "bus_voltage_v",
            &|_, _| "48".to_owned(),
            "`bus_voltage_v` is recorded without `duty_frac`",
        ),
        (
            both,
            &|row, v| format!("{},{}", v / 48.0, if row == 9 { 0 } else { 48 }),
            "`bus_voltage_v` is 0 at 0.0008 s, expected a positive supply",
        ),
        (
            both,
            &|row, v| format!("{},48", if row == 9 { 1.06 } else { v / 48.0 }),
            "`duty_frac` is 1.06 at 0.0008 s, expected −1 to 1",
        ),
        (both, &|_, v| format!("{},48", v / 0.48), "of percent, `--map duty_frac=COLUMN*0.01`"),
    ];
    for (columns, of, expected) in cases {
        let message = told(columns, of).unwrap();
        assert!(message.ends_with(expected), "{message}");
    }
    assert_eq!(told(both, &|_, v| format!("{},48", v / 48.0)), None);
}

#[test]
fn a_unit_says_whose_voltage_is_not_used() {
    let folder = TempDir::new().unwrap();
    for (name, seed) in [("a.csv", "5"), ("b.csv", "6")] {
        simulated(&folder, name, seed, &["--motor-voltage"]);
    }
    let learn = ["unit", "learn", "a.csv", "b.csv", "-o", "unit.fdi-unit"];
    let said = output(folder.path(), &learn);
    assert!(!whole(&said).contains("voltage"), "{}", whole(&said));
    let map = ["--map", "duty_frac=motor_voltage_v*0.0208"];
    let said = output(folder.path(), &[&learn, &map[..]].concat());
    let told = whole(&said);
    assert!(told.contains("b.csv: the motor's voltage is not used; `fdi diagnose`"), "{told}");
}

#[test]
fn recordings_of_one_session_do_not_disagree_by_their_voltages() {
    let folder = TempDir::new().unwrap();
    let names: Vec<String> = (31..=36).map(|seed| format!("k{seed}.csv")).collect();
    for (name, seed) in names.iter().zip(31..) {
        simulated(&folder, name, &seed.to_string(), &["--motor-voltage"]);
    }
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let records = diagnosed(&folder, &[&["--together", "actuator"], &names[..]].concat());
    assert_eq!(records[0].together.len(), 6);
    assert!(
        records[0].notice(NoticeCode::RecordingsDisagree).is_none(),
        "{:?}",
        records[0].notices
    );
}

#[test]
fn a_voltage_that_nothing_reads_is_told() {
    let folder = TempDir::new().unwrap();
    simulated(&folder, "r.csv", "5", &["--motor-voltage"]);
    let records = diagnosed(&folder, &["r.csv", "--tolerance", "none"]);
    let told = &records[0].notice(NoticeCode::VoltageUnused).unwrap().message;
    assert!(told.contains("exactly its model file"), "{told}");
}

#[test]
fn models_without_a_current_loop_record_no_voltage() {
    let folder = TempDir::new().unwrap();
    let said = refusal(&folder, &["simulate", "--fidelity", "low", "--motor-voltage"]);
    assert!(
        said.contains("`--motor-voltage`: the low-fidelity model has no current loop"),
        "{said}"
    );
}
