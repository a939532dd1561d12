//! `docs/guide/a-fleet-of-real-machines.md` as it stands: its tables go into a model file, its
//! commands are run one after another.

#![cfg(unix)]

use std::fs;

use fdi_core::{
    Schema,
    report::{Diagnosis, FindingKind, Verdict},
};
use tempfile::TempDir;

use crate::{
    commands::{answer, output, whole},
    guides::{blocks, run},
    servo_axis::fixture,
};

const GUIDE: &str = include_str!("../../../../docs/guide/a-fleet-of-real-machines.md");

/// The machine that is recorded: within the tolerances of the guide, but not that of the data
/// sheet.
const MACHINE: &str = "base = \"my-actuator.toml\"\n[motor]\nback-emf-v-s-per-rad = 0.1150\n\
                       [transmission]\nbacklash-rad = 2.3e-4\n";

/// Records the machine with damage.
fn record(folder: &TempDir, name: &str, faults: &str, seed: &str) {
    let test = ["simulate", "--model", "machine.toml", "--command", "flap.csv"];
    let noise = ["--noise-a", "0.03", "--adc-bits", "12", "--faults", faults];
    let all = [&test[..], &noise, &["--seed", seed, "-o", name]].concat();
    let made = output(folder.path(), &all);
    assert!(made.status.success(), "{}", whole(&made));
}

/// A folder with what the guides take for granted: model file, command, recordings.
pub(crate) fn prepared() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    let tolerances = blocks(GUIDE, "toml")[0];
    let base = fixture("models/ema-270.toml");
    write("my-actuator.toml", &format!("base = '{base}'\n{tolerances}"));
    write("machine.toml", MACHINE);
    fs::copy(fixture("commands/flap.csv"), folder.path().join("flap.csv")).unwrap();
    fs::create_dir(folder.path().join("recordings")).unwrap();
    record(&folder, "recordings/first.csv", "", "1");
    for (day, seed) in [("02", "2"), ("03", "3"), ("05", "4"), ("09", "5")] {
        record(&folder, &format!("A-7_2026-11-{day}.csv"), "", seed);
    }
    record(&folder, "A-7_2027-05-02.csv", "", "6");
    record(&folder, "A-7_2027-11-04.csv", "k4=0.05", "7");
    record(&folder, "twin.csv", "", "8");
    folder
}

/// A year later, before the unit learns on: the short is found, the machine as new is not.
fn check_a_year_later(folder: &TempDir) {
    let asked = ["diagnose", "--bundle", "mine.fdi-bundle", "--unit", "units/"];
    let named = ["--id-from", "{id}_{date}", "--output-format", "json", "--stable"];
    let days = ["A-7_2027-05-02.csv", "A-7_2027-11-04.csv"];
    let said = output(folder.path(), &[&asked[..], &named, &days].concat());
    let later: Diagnosis = answer(&said, Schema::Diagnosis);
    let verdicts: Vec<Verdict> = later.records.iter().map(|record| record.verdict).collect();
    assert_eq!(verdicts, [Verdict::Healthy, Verdict::Faulty], "{:?}", later.records);
    let found: Vec<_> = later.records[1].findings.iter().filter(|one| one.detected).collect();
    assert_eq!((found[0].id.as_str(), found[0].kind), ("imbalance-b", FindingKind::Changed));
}

#[test]
fn every_command_of_the_guide_does_what_it_says() {
    let folder = prepared();
    let mut said = String::new();
    for block in blocks(GUIDE, "sh") {
        said += &run(folder.path(), block);
        if block.contains("--unit units/") {
            check_a_year_later(&folder);
        }
    }
    for line in blocks(GUIDE, "text").iter().flat_map(|printed| printed.lines()) {
        assert!(said.contains(line), "`{line}` is not in\n{said}");
    }
}
