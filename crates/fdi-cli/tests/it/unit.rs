//! Units as in `docs/guide/a-fleet-of-real-machines.md`: learnt, diagnosed a year later, learnt on.

use std::fs::{self, File};

use fdi_core::{
    Schema,
    report::{Diagnosis, FindingKind, NoticeCode, RecordDiagnosis, Verdict},
};
use serde_json::Value;
use tempfile::TempDir;

use crate::commands::{answer, output, whole};

/// A machine within the tolerances of EMA-48: magnets 2 % weak, a play a fifth wider.
const MACHINE: &str = "base = \"ema-48\"\n[motor]\nback-emf-v-s-per-rad = 0.0368\n\
                       inertia-kg-m2 = 2.55e-5\n[transmission]\nbacklash-rad = 6.0e-5\n";

/// A folder with a machine of the fleet.
fn fleet() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("machine.toml"), MACHINE).unwrap();
    folder
}

/// Records a machine with damage on a day, as `A-7_2026-11-02.csv`.
fn record(folder: &TempDir, id: &str, day: &str, faults: &str, seed: &str) -> String {
    let name = format!("{id}_{day}.csv");
    let test = ["simulate", "--model", "machine.toml", "--faults", faults, "--noise-a", "0.02"];
    let all = [&test[..], &["--adc-bits", "12", "--seed", seed, "-o", &name]].concat();
    let made = output(folder.path(), &all);
    assert!(made.status.success(), "{}", whole(&made));
    name
}

/// Four recordings of a machine as new, of four days, and the unit learnt from them.
fn learnt() -> TempDir {
    let folder = fleet();
    let days = ["2026-11-02", "2026-11-03", "2026-11-05", "2026-11-09"];
    let seeds = ["1", "2", "3", "4"];
    let names: Vec<String> =
        days.iter().zip(seeds).map(|(day, seed)| record(&folder, "A-7", day, "", seed)).collect();
    let mut learn = vec!["unit", "learn", "--id-from", "{id}_{date}", "-o", "A-7.fdi-unit"];
    learn.extend(names.iter().map(String::as_str));
    let told = whole(&output(folder.path(), &learn));
    let expected = "exit 0\n--- stdout\n--- stderr\n\
                    learnt of `A-7` from 4 recordings as new, 4 sessions\n";
    assert_eq!(told, expected);
    folder
}

/// Diagnoses one recording with further options.
fn diagnosed(folder: &TempDir, name: &str, options: &[&str]) -> RecordDiagnosis {
    let asked =
        ["diagnose", name, "--id-from", "{id}_{date}", "--output-format", "json", "--stable"];
    let said = output(folder.path(), &[&asked[..], options].concat());
    let document: Diagnosis = answer(&said, Schema::Diagnosis);
    assert_eq!(document.records.len(), 1, "{}", whole(&said));
    document.records.into_iter().next().unwrap()
}

fn refusal(folder: &TempDir, arguments: &[&str]) -> String {
    let said = output(folder.path(), arguments);
    assert_eq!(said.status.code(), Some(2), "{}", whole(&said));
    String::from_utf8_lossy(&said.stderr).into_owned()
}

#[test]
fn a_unit_is_learnt_and_diagnosed_a_year_later() {
    let folder = learnt();
    let unit = ["--unit", "A-7.fdi-unit"];
    // nothing has changed: what is unlike the data sheet was so as new
    let well = record(&folder, "A-7", "2027-11-02", "", "11");
    let answer = diagnosed(&folder, &well, &unit);
    assert_eq!(answer.verdict, Verdict::Healthy, "{answer:?}");
    let used = answer.notices.iter().find(|one| one.code == NoticeCode::ReferenceUsed).unwrap();
    let told = "levels are changes since 4 recordings as new of `A-7`, 4 sessions in all";
    assert_eq!(used.message, told);
    // a play that has grown by a fifth of itself shows, which no recording alone can tell
    let worn = record(&folder, "A-7", "2027-11-03", "k2=0.002", "12");
    assert_ne!(diagnosed(&folder, &worn, &[]).verdict, Verdict::Faulty);
    let answer = diagnosed(&folder, &worn, &unit);
    assert_eq!(answer.verdict, Verdict::Faulty, "{answer:?}");
    let found: Vec<_> = answer.findings.iter().filter(|one| one.detected).collect();
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].id.as_str(), found[0].kind), ("play", FindingKind::Changed));
    // friction differs from day to day far more than a recording leaves open
    let friction = &answer.findings[0];
    assert_eq!((friction.id.as_str(), friction.kind), ("friction", FindingKind::Ambiguous));
    assert_eq!(friction.would_tell.as_deref(), Some("recordings of other days"));
    assert!(friction.prior_std > 10.0 * friction.posterior_std, "{friction:?}");
    let [least, most] = answer.faults[1].interval_95.unwrap();
    assert!(least < 0.002 && 0.002 < most && most - least < 0.002, "{answer:?}");
    // the references themselves, and a folder of units, say as much
    let reference = ["--reference", "A-7_2026-11-02.csv", "--reference", "A-7_2026-11-05.csv"];
    assert_eq!(diagnosed(&folder, &worn, &reference).verdict, Verdict::Faulty);
    assert_eq!(diagnosed(&folder, &worn, &["--unit", "."]).verdict, Verdict::Faulty);
    // of another machine the folder has no unit: it is diagnosed by its type
    let other = record(&folder, "B-1", "2027-11-03", "k2=0.002", "13");
    let answer = diagnosed(&folder, &other, &["--unit", "."]);
    assert!(answer.notices.iter().all(|one| one.code != NoticeCode::ReferenceUsed));
}

#[test]
fn a_unit_is_learnt_on_without_faulty_recordings() {
    let folder = learnt();
    let well = record(&folder, "A-7", "2027-05-02", "", "21");
    let worn = record(&folder, "A-7", "2027-11-03", "k4=0.04", "22");
    let update = ["unit", "update", "A-7.fdi-unit", &well, &worn, "--id-from", "{id}_{date}"];
    let said = whole(&output(folder.path(), &update));
    assert!(said.contains("left out: A-7_2027-11-03.csv: imbalance of phase B (k4)"), "{said}");
    assert!(said.ends_with("learnt of `A-7` from 4 recordings as new and 1 later, 5 sessions\n"));
    let show = ["unit", "show", "A-7.fdi-unit", "--output-format", "json"];
    let shown: Value = serde_json::from_slice(&output(folder.path(), &show).stdout).unwrap();
    let as_new: Vec<_> = shown["recordings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| (one["session"].as_str().unwrap().to_owned(), one["as_new"].as_bool().unwrap()))
        .collect();
    assert_eq!(as_new.len(), 5);
    assert_eq!(as_new[4], ("2027-05-02".to_owned(), false));
    // the same recording is not taken twice, nor diagnosed against itself
    let again = refusal(&folder, &["unit", "update", "A-7.fdi-unit", &well]);
    assert!(again.contains("the unit was learnt from this recording"), "{again}");
    let own = refusal(&folder, &["diagnose", "--unit", "A-7.fdi-unit", &well]);
    assert!(own.contains("the unit was learnt from this recording, as"), "{own}");
    // a new motor: its eccentricity is that of a data sheet again, the play is known
    let std = |folder: &TempDir, fault: usize| {
        let later = "A-7_2027-11-03.csv";
        diagnosed(folder, later, &["--unit", "A-7.fdi-unit"]).faults[fault].std.unwrap()
    };
    let before = [std(&folder, 1), std(&folder, 5)];
    let reset = ["unit", "reset", "A-7.fdi-unit", "--replaced", "motor"];
    assert_eq!(output(folder.path(), &reset).status.code(), Some(0));
    let after = [std(&folder, 1), std(&folder, 5)];
    assert!(after[0] < 1.5 * before[0] && after[1] > 4.0 * before[1], "{before:?} {after:?}");
}

#[test]
fn a_reference_that_is_faulty_is_told() {
    let folder = fleet();
    let mut names: Vec<String> = ["1", "2", "3"]
        .map(|seed| record(&folder, "A-7", &format!("2026-11-0{seed}"), "", seed))
        .into();
    names.push(record(&folder, "A-7", "2026-11-04", "k5=0.04", "4"));
    let mut learn = vec!["unit", "learn", "--id-from", "{id}_{date}", "-o", "A-7.fdi-unit"];
    learn.extend(names.iter().map(String::as_str));
    let said = whole(&output(folder.path(), &learn));
    let told = "warning: A-7_2026-11-04.csv disagrees with its type: imbalance of phase C (k5)";
    assert!(said.contains(told), "{said}");
    // small enough to pass as a machine of its type, it stands out among the others
    names[3] = record(&folder, "A-7", "2026-11-04", "k2=0.004", "5");
    let mut learn = vec!["unit", "learn", "--id-from", "{id}_{date}", "-o", "A-7.fdi-unit"];
    learn.extend(names.iter().map(String::as_str));
    let said = whole(&output(folder.path(), &learn));
    let told = "warning: A-7_2026-11-04.csv disagrees with the other recordings: backlash (k2)";
    assert!(said.contains(told), "{said}");
}

#[test]
fn bad_units_are_refused_in_one_line() {
    let folder = learnt();
    let well = record(&folder, "A-7", "2027-11-02", "", "31");
    let bytes = fs::read(folder.path().join("A-7.fdi-unit")).unwrap();
    fs::write(folder.path().join("cut.fdi-unit"), &bytes[..bytes.len() - 7]).unwrap();
    let told = refusal(&folder, &["diagnose", "--unit", "cut.fdi-unit", &well]);
    assert!(told.starts_with("error: cut.fdi-unit: truncated: "), "{told}");
    let told = refusal(&folder, &["diagnose", "--unit", ".", &well]);
    assert!(told.starts_with("error: ./cut.fdi-unit: truncated: "), "{told}");
    fs::remove_file(folder.path().join("cut.fdi-unit")).unwrap();
    let told = refusal(&folder, &["diagnose", "--unit", &well, &well]);
    assert_eq!(told, format!("error: {well}: not an artefact of this tool: expected a unit\n"));
    // of another actuator
    let other = record(&folder, "B-1", "2027-11-02", "", "32");
    let named = ["diagnose", "--unit", "A-7.fdi-unit", "--id-from", "{id}_{date}", &other];
    let told = refusal(&folder, &named);
    assert!(told.contains("the recording is of actuator `B-1`, `A-7.fdi-unit` of `A-7`"), "{told}");
    let mixed = ["unit", "learn", "--id-from", "{id}_{date}", "-o", "mixed.fdi-unit"];
    let told = refusal(&folder, &[&mixed[..], &["A-7_2026-11-02.csv", &other]].concat());
    let expected = "error: B-1_2027-11-02.csv: is of actuator `B-1`, expected `A-7`\n";
    assert_eq!(told, expected);
    // one recording in two roles
    let twice = ["unit", "learn", "-o", "twice.fdi-unit", &well, &well];
    assert!(refusal(&folder, &twice).contains("the unit has learnt from it already"));
    // two files of one actuator
    fs::copy(folder.path().join("A-7.fdi-unit"), folder.path().join("copy.fdi-unit")).unwrap();
    let told = refusal(&folder, &["diagnose", "--unit", ".", &well]);
    let expected = "error: ./A-7.fdi-unit and ./copy.fdi-unit are both of actuator `A-7`\n";
    assert_eq!(told, expected);
    // a folder without any
    fs::create_dir(folder.path().join("empty")).unwrap();
    let told = refusal(&folder, &["diagnose", "--unit", "empty", &well]);
    assert_eq!(told, "error: empty: no file `*.fdi-unit` in this folder\n");
    // the temperature in another unit
    let text = fs::read_to_string(folder.path().join(&well)).unwrap();
    fs::write(folder.path().join("hot.csv"), format!("# winding-temperature-k = 25\n{text}"))
        .unwrap();
    let told = refusal(&folder, &["diagnose", "--unit", "A-7.fdi-unit", "hot.csv"]);
    assert!(told.contains("expected a temperature of 150 to 600 K"), "{told}");
    // somebody else is writing it
    let held = File::open(folder.path().join("A-7.fdi-unit")).unwrap();
    held.lock().unwrap();
    let told = refusal(&folder, &["unit", "update", "A-7.fdi-unit", &well]);
    assert_eq!(told, "error: A-7.fdi-unit: another program is writing it; run this again\n");
    held.unlock().unwrap();
    assert_eq!(
        output(folder.path(), &["unit", "update", "A-7.fdi-unit", &well]).status.code(),
        Some(0)
    );
}

/// What the learnt error does not know of a recording is told within tolerances too.
#[test]
fn rate_noise_and_damage_beyond_what_is_learnt_are_told() {
    let folder = fleet();
    let told = |name: &str, simulated: &[&str]| {
        let test = ["simulate", "--model", "machine.toml", "--adc-bits", "12", "-o", name];
        let made = output(folder.path(), &[&test[..], simulated].concat());
        assert!(made.status.success(), "{}", whole(&made));
        let answer = diagnosed(&folder, name, &[]);
        (answer.verdict, answer.notices.iter().map(|one| one.code).collect::<Vec<_>>())
    };
    let quiet = ["--noise-a", "0.02", "--seed", "3"];
    let (_, plain) = told("quiet_1.csv", &quiet);
    let limits = [
        NoticeCode::NoiseAboveBundle,
        NoticeCode::PhasesSampledSlowly,
        NoticeCode::OutsideTraining,
    ];
    assert!(limits.iter().all(|code| !plain.contains(code)), "{plain:?}");
    let (verdict, loud) = told("loud_1.csv", &["--noise-a", "0.5", "--seed", "3"]);
    assert_ne!(verdict, Verdict::Healthy);
    assert!(loud.contains(&NoticeCode::NoiseAboveBundle), "{loud:?}");
    let (_, slow) = told("slow_1.csv", &[&quiet[..], &["--rate-hz", "4000"]].concat());
    assert!(slow.contains(&NoticeCode::PhasesSampledSlowly), "{slow:?}");
    let (_, far) = told("far_1.csv", &[&quiet[..], &["--faults", "k4=0.2"]].concat());
    assert!(far.contains(&NoticeCode::OutsideTraining), "{far:?}");
}
