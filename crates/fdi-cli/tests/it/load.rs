//! Recordings under another load than that of the bundle's test.

use std::fs;

use fdi_core::{
    Schema,
    report::{Diagnosis, FindingKind, NoticeCode, RecordDiagnosis, Verdict},
};
use tempfile::TempDir;

use crate::commands::{answer, output, whole};

/// Simulates a test under a load.
fn simulated(folder: &TempDir, name: &str, options: &[&str]) -> String {
    let plain = ["simulate", "--noise-a", "0.02", "-o", name];
    let said = output(folder.path(), &[&plain, options].concat());
    assert_eq!(said.status.code(), Some(0), "{}", whole(&said));
    fs::read_to_string(folder.path().join(name)).unwrap()
}

fn diagnosed(folder: &TempDir, options: &[&str]) -> RecordDiagnosis {
    let plain = ["diagnose", "--output-format", "json", "--stable"];
    let said = output(folder.path(), &[&plain, options].concat());
    let answer: Diagnosis = answer(&said, Schema::Diagnosis);
    assert_eq!(answer.failed.len(), 0, "{:?}", answer.failed);
    answer.records.into_iter().next().unwrap()
}

#[test]
fn a_load_that_is_stated_is_no_fault() {
    let folder = TempDir::new().unwrap();
    let text = simulated(&folder, "loaded.csv", &["--load-n-m", "2", "--seed", "3"]);
    assert!(text.contains("# load-n-m = 2.0\n"), "{}", &text[..200]);
    let loaded = diagnosed(&folder, &["loaded.csv"]);
    assert!(loaded.findings.iter().all(|finding| !finding.detected), "{:?}", loaded.findings);
    let told = &loaded.notice(NoticeCode::LoadDiffers).unwrap().message;
    assert!(told.starts_with("the recording is under a load of 2.000 N·m, the test of the bundle"));
    // a column says it too
    let column = |line: &str| match line {
        "# load-n-m = 2.0" => String::new(),
        line if line.starts_with('#') => format!("{line}\n"),
        line if line.starts_with("time_s") => format!("{line},load_n_m\n"),
        line => format!("{line},2.0\n"),
    };
    fs::write(folder.path().join("column.csv"), text.lines().map(column).collect::<String>())
        .unwrap();
    let by_column = diagnosed(&folder, &["column.csv"]);
    assert_eq!(by_column.faults, loaded.faults);
    // anti-test: a load that nobody states looks like a torque constant
    fs::write(folder.path().join("silent.csv"), text.replace("# load-n-m = 2.0\n", "")).unwrap();
    let silent = diagnosed(&folder, &["silent.csv"]);
    assert_eq!((silent.verdict, silent.notice(NoticeCode::LoadDiffers)), (Verdict::Faulty, None));
}

#[test]
fn a_fault_is_told_under_another_load() {
    let folder = TempDir::new().unwrap();
    let mut asked: Vec<String> = Vec::new();
    for day in ["11", "12", "13", "14"] {
        let name = format!("{day}.csv");
        let text = simulated(&folder, &name, &["--seed", day]);
        fs::write(folder.path().join(&name), format!("# session = \"{day}\"\n{text}")).unwrap();
        asked.extend(["--reference".to_owned(), name]);
    }
    let with = |name: &str| {
        let asked: Vec<&str> = asked.iter().map(String::as_str).chain([name]).collect();
        diagnosed(&folder, &asked)
    };
    simulated(&folder, "sound.csv", &["--load-n-m", "1.5", "--seed", "21"]);
    assert_eq!(with("sound.csv").verdict, Verdict::Healthy);
    let faults = ["--load-n-m", "1.5", "--seed", "22", "--faults", "k2=0.006,k4=0.02"];
    simulated(&folder, "worn.csv", &faults);
    let worn = with("worn.csv");
    assert_eq!(worn.verdict, Verdict::Faulty, "{worn:?}");
    assert!(worn.findings.iter().any(|one| one.kind == FindingKind::Changed));
    for (fault, truth) in [(1, 0.006), (3, 0.02)] {
        let (value, std) = (worn.faults[fault].value.unwrap(), worn.faults[fault].std.unwrap());
        assert!((value - truth).abs() < 3.0 * std, "{fault}: {value} ± {std}");
        assert_eq!(worn.faults[fault].detected, Some(true), "{:?}", worn.faults[fault]);
    }
}
