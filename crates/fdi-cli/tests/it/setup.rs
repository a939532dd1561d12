//! A machine that is set up as in `docs/guide/a-fleet-of-real-machines.md`, and what cannot be.

use std::fs;

use fdi_core::{
    Schema,
    report::{Diagnosis, NoticeCode, SetupRefusalCode, SetupSummary, Verdict},
};
use tempfile::TempDir;

use crate::commands::{answer, output, whole};
#[cfg(unix)]
use crate::{
    fleet_guide::prepared,
    guides::{blocks, run},
};

/// A machine within the tolerances of EMA-48.
const MACHINE: &str = "base = \"ema-48\"\n[motor]\nback-emf-v-s-per-rad = 0.0368\n\
                       inertia-kg-m2 = 2.55e-5\n[transmission]\nbacklash-rad = 6.0e-5\n";

/// A folder with four recordings of a machine as new, of which a bench has swapped two phases and names
/// the columns otherwise.
fn bench(machine: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("machine.toml"), machine).unwrap();
    for day in 1..=4 {
        record(&folder, &format!("B-2_2026-11-0{day}.csv"), "", &day.to_string());
    }
    folder
}

fn record(folder: &TempDir, name: &str, faults: &str, seed: &str) {
    let path = folder.path().join(name);
    let made = output(
        folder.path(),
        &[
            "simulate",
            "--model",
            "machine.toml",
            "--faults",
            faults,
            "--noise-a",
            "0.02",
            "--adc-bits",
            "12",
            "--seed",
            seed,
            "-o",
            path.to_str().unwrap(),
        ],
    );
    assert!(made.status.success(), "{}", whole(&made));
    let text = fs::read_to_string(&path).unwrap();
    let text = text.replace("phase_a_current_a", "ib_A").replace("phase_b_current_a", "ia_A");
    fs::write(path, text.replace("phase_c_current_a", "ic_A")).unwrap();
}

/// Sets the machine of a folder up with the columns as the bench names them.
fn set_up(folder: &TempDir, recordings: &[&str]) -> SetupSummary {
    let mut words = vec!["setup", "--id-from", "{id}_{date}", "--output-format", "json"];
    for map in ["phase_a_current_a=ia_A", "phase_b_current_a=ib_A", "phase_c_current_a=ic_A"] {
        words.extend(["--map", map]);
    }
    words.extend(["--tests", "8", "-o", "b2"]);
    words.extend(recordings);
    answer(&output(folder.path(), &words), Schema::Setup)
}

#[test]
fn later_recordings_need_no_options() {
    let folder = bench(MACHINE);
    let names = [1, 2, 3, 4].map(|day| format!("B-2_2026-11-0{day}.csv"));
    let summary = set_up(&folder, &names.each_ref().map(String::as_str));
    assert!(summary.accepted, "{summary:?}");
    let tests = summary.acceptance.unwrap();
    assert_eq!((tests.sound, tests.false_alarms, tests.unanswered), (8, 0, 0));
    assert!(tests.faults.iter().all(|fault| fault.found == fault.tests), "{tests:?}");
    assert!(tests.held * 10 >= tests.intervals * 9, "{tests:?}");
    let settings = fs::read_to_string(folder.path().join("b2/fdi.toml")).unwrap();
    let maps = "map = [\"phase_c_current_a=ic_A\", \"phase_a_current_a=ib_A\", \
                \"phase_b_current_a=ia_A\"]";
    assert!(settings.contains(maps), "{settings}");
    let report = fs::read_to_string(folder.path().join("b2/setup.html")).unwrap();
    assert!(report.contains("Accepted"), "{report}");

    // from elsewhere, and after the folder was moved
    fs::rename(folder.path().join("b2"), folder.path().join("hall-3")).unwrap();
    record(&folder, "hall-3/B-2_2027-05-02.csv", "k4=0.03", "9");
    let asked = ["diagnose", "hall-3/B-2_2027-05-02.csv", "--output-format", "json", "--stable"];
    let said = output(folder.path(), &asked);
    assert!(whole(&said).contains("settings of hall-3/fdi.toml"), "{}", whole(&said));
    let diagnosis: Diagnosis = answer(&said, Schema::Diagnosis);
    let record = &diagnosis.records[0];
    assert_eq!(record.verdict, Verdict::Faulty);
    assert!((record.faults[3].value.unwrap() - 0.03).abs() < 0.015, "{:?}", record.faults[3]);
    let has = |code| record.notices.iter().any(|notice| notice.code == code);
    assert!(has(NoticeCode::ReferenceUsed) && !has(NoticeCode::PhasesRewired));
}

#[test]
fn a_machine_that_is_another_is_refused_with_the_reason() {
    let other = MACHINE.replace("[transmission]", "[transmission]\ngear-ratio = 560");
    let folder = bench(&other);
    let summary = set_up(&folder, &["B-2_2026-11-01.csv"]);
    let refused = summary.refused.unwrap();
    assert_eq!(refused.code, SetupRefusalCode::WrongGear);
    assert_eq!(refused.recording.as_deref(), Some("B-2_2026-11-01.csv"));
    assert!(refused.reason.contains("1.12 times"), "{}", refused.reason);
    assert!(!summary.accepted && !folder.path().join("b2/unit.fdi-unit").exists());
    let report = fs::read_to_string(folder.path().join("b2/setup.html")).unwrap();
    assert!(report.contains("Not set up (wrong-gear)"), "{report}");
}

#[cfg(unix)]
#[test]
fn the_guide_goes_from_recordings_to_a_decision() {
    const GUIDE: &str = include_str!("../../../../docs/guide/set-up-and-decide.md");

    let folder = prepared();
    let [inspect, set_up, decide, follow, plan] = &blocks(GUIDE, "sh")[..] else {
        panic!("five blocks")
    };
    let commands = GUIDE.lines().filter(|line| line.starts_with("fdi ") || line.starts_with("cp "));
    assert!(commands.count() <= 10);
    run(folder.path(), inspect);
    assert!(run(folder.path(), set_up).contains("accepted; report: A-7/setup.html"));
    let decided = run(folder.path(), decide);
    assert!(decided.contains("watch: short circuit of phase B"), "{decided}");
    run(folder.path(), follow);
    assert!(folder.path().join("A-7.html").is_file());
    assert!(run(folder.path(), plan).contains("k1 friction"));
    assert!(folder.path().join("test.csv").is_file());
}
