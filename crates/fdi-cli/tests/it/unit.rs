//! Units as in `docs/guide/a-fleet-of-real-machines.md`: learnt, diagnosed a year later, learnt on.

use std::fs::{self, File};

use approx::assert_relative_eq;
use fdi_core::{
    Schema,
    ema_sim::model_file,
    report::{
        Calibration, Diagnosis, FindingKind, Notice, NoticeCode, RecordDiagnosis, UnitNumber,
        UnitSummary, Verdict,
    },
};
use serde_json::Value;
use tempfile::TempDir;

use crate::commands::{answer, output, whole};

/// A machine within the tolerances of EMA-48: magnets 2 % weak, a play a fifth wider.
const MACHINE: &str = "base = \"ema-48\"\n[motor]\nback-emf-v-s-per-rad = 0.0368\n\
                       inertia-kg-m2 = 2.55e-5\n[transmission]\nbacklash-rad = 6.0e-5\n";

/// A folder with a machine of the fleet.
pub(crate) fn fleet() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("machine.toml"), MACHINE).unwrap();
    folder
}

/// Records a machine with damage on a day, as `A-7_2026-11-02.csv`.
pub(crate) fn record(folder: &TempDir, id: &str, day: &str, faults: &str, seed: &str) -> String {
    let name = format!("{id}_{day}.csv");
    let test = ["simulate", "--model", "machine.toml", "--faults", faults, "--noise-a", "0.02"];
    let all = [&test[..], &["--adc-bits", "12", "--seed", seed, "-o", &name]].concat();
    let made = output(folder.path(), &all);
    assert!(made.status.success(), "{}", whole(&made));
    name
}

/// Four recordings of a machine as new, of four days, and the unit learnt from them.
pub(crate) fn learnt() -> TempDir {
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

pub(crate) fn refusal(folder: &TempDir, arguments: &[&str]) -> String {
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
fn references_that_contradict_one_another_are_not_used() {
    let folder = learnt();
    let worn = record(&folder, "A-7", "2026-12-01", "k2=0.01", "5");
    let own = record(&folder, "A-7", "2027-11-03", "k2=0.002", "12");
    let sound = ["A-7_2026-11-02.csv", "A-7_2026-11-03.csv", "A-7_2026-11-05.csv"];
    let beside = |references: &[&str], further: &[&str]| {
        let references = references.iter().flat_map(|&name| ["--reference", name]);
        let options: Vec<&str> = references.chain(further.iter().copied()).collect();
        diagnosed(&folder, &own, &options)
    };
    let told = |answer: &RecordDiagnosis| {
        answer.notice(NoticeCode::ReferencesDisagree).map(|notice| notice.message.clone())
    };
    let agreeing = beside(&sound, &[]);
    assert_eq!((told(&agreeing), agreeing.verdict), (None, Verdict::Faulty));
    let answer = beside(&[&sound[..], &[&worn]].concat(), &[]);
    let message = told(&answer).unwrap();
    let expected = format!(
        "the 4 recordings as new contradict one another; without `{worn}` the others agree"
    );
    assert!(message.starts_with(&expected) && !message.contains("`date`"), "{message}");
    assert!(answer.notice(NoticeCode::ReferenceUsed).is_none());
    // the answer is the one without references
    let alone = diagnosed(&folder, &own, &[]);
    assert_eq!((answer.verdict, &answer.faults), (alone.verdict, &alone.faults));
    // of two neither is the odd one, and an answer to several recordings uses them no more
    let several = ["--together", "actuator"];
    let message = told(&beside(&[sound[0], &worn], &several)).unwrap();
    assert!(!message.contains("the others agree"), "{message}");
    // names say no days: all count as of one
    let said = output(
        folder.path(),
        &["unit", "learn", sound[0], sound[1], &worn, "-o", "undated.fdi-unit"],
    );
    let said = whole(&said);
    let expected = "none of them states `date` or `session`";
    assert!(said.contains(expected) && said.contains("does not use such a unit"), "{said}");
}

#[test]
fn a_sensor_whose_gain_is_off_is_no_short() {
    let folder = fleet();
    let own = record(&folder, "A-7", "2026-11-02", "", "1");
    let read = |gain: f64| {
        let map = format!("phase_a_current_a=phase_a_current_a*{gain}");
        diagnosed(&folder, &own, &["--map", &map])
    };
    let told = |answer: &RecordDiagnosis| {
        answer.notice(NoticeCode::SensorsUneven).map(|notice| notice.message.clone())
    };
    let answer = read(0.9);
    assert_eq!(answer.verdict, Verdict::ModelInadequate);
    let message = told(&answer).unwrap();
    assert!(message.contains("the sensor of phase A reads -"), "{message}");
    // within its tolerance it is a number of the machine
    assert_eq!(told(&read(0.98)), None);
}

/// A number of a unit, or of a calibration, by its key.
fn number<'a>(all: &'a [UnitNumber], key: &str) -> &'a UnitNumber {
    all.iter().find(|number| number.key == key).unwrap_or_else(|| panic!("{key}: {all:?}"))
}

#[test]
fn a_unit_has_numbers_and_a_model_file() {
    let folder = learnt();
    let show = ["unit", "show", "A-7.fdi-unit", "--output-format", "json"];
    let shown: UnitSummary = answer(&output(folder.path(), &show), Schema::Unit);
    // the play of this machine is a fifth wider than the data sheet's 5e-5 rad
    let play = number(&shown.numbers, "transmission.backlash-rad");
    let [least, most] = play.interval_95;
    assert!(play.determined && least < 6.0e-5 && 6.0e-5 < most, "{play:?}");
    assert!(least > 5.0e-5, "the data sheet's play is told from it: {play:?}");
    // magnets and inertia show through their ratio alone
    let magnets = number(&shown.numbers, "motor.back-emf-v-s-per-rad");
    assert!(!magnets.determined, "{magnets:?}");
    let ratio = number(&shown.ratios, "motor.inertia-kg-m2 / motor.back-emf-v-s-per-rad");
    assert!(ratio.determined, "{ratio:?}");
    assert_relative_eq!(ratio.value, 2.55e-5 / 0.0368, max_relative = 0.02);
    // what does not show in this test stays as it was
    let resistance = number(&shown.numbers, "motor.resistance-ohm");
    assert!(!resistance.determined);
    assert_relative_eq!(resistance.std, resistance.prior_std, max_relative = 1e-6);

    // calibration says the same
    let recordings = ["A-7_2026-11-02.csv", "A-7_2026-11-03.csv"];
    let calibrate = ["calibrate", "--model", "ema-48", "--output-format", "json", "--train"];
    let said = output(folder.path(), &[&calibrate[..], &recordings].concat());
    let calibrated: Calibration = answer(&said, Schema::Calibration);
    let play = &calibrated.parameters["transmission.backlash-rad"];
    let [least, most] = play.interval_95;
    assert!(play.determined && least < 6.0e-5 && 6.0e-5 < most, "{play:?}");
    assert!(!calibrated.parameters["motor.back-emf-v-s-per-rad"].determined);

    // a damaged machine is told, as is a bundle of another test
    let short = record(&folder, "A-7", "2026-11-04", "k4=0.12", "9");
    let said = output(folder.path(), &[&calibrate[..], &recordings, &[&short]].concat());
    let told = String::from_utf8_lossy(&said.stderr).into_owned();
    assert!(told.contains("warning: A-7_2026-11-04.csv disagrees with"), "{told}");
    let asked = ["--bundle", "A-7.fdi-unit", "--command", "sine"];
    let refused = refusal(&folder, &[&calibrate[..], &recordings, &asked].concat());
    assert!(refused.contains("A-7.fdi-unit"), "{refused}");

    // the model file of the unit is one of which a machine can be made
    let written = output(folder.path(), &["unit", "model", "A-7.fdi-unit", "-o", "A-7.toml"]);
    assert!(written.status.success(), "{}", whole(&written));
    let model = fs::read_to_string(folder.path().join("A-7.toml")).unwrap();
    let model = model_file::parse(&model).unwrap();
    assert_eq!(model.name.as_deref(), Some("A-7"));
    assert_relative_eq!(model.actuator.transmission.backlash_rad, 6.0e-5, max_relative = 0.1);
    // and whose recordings it explains
    let explain = ["explain", "--unit", "A-7.fdi-unit", "--train", "A-7_2026-11-02.csv"];
    let said = output(folder.path(), &[&explain[..], &["A-7_2026-11-03.csv"]].concat());
    assert!(said.status.success(), "{}", whole(&said));
    let refused =
        refusal(&folder, &[&explain[..3], &["--model", "ema-48", "--train", "x"]].concat());
    assert!(refused.contains("cannot be used with"), "{refused}");

    // of a new gear nothing is known but its tolerances
    let reset = ["unit", "reset", "A-7.fdi-unit", "--replaced", "gear"];
    assert!(output(folder.path(), &reset).status.success());
    let shown: UnitSummary = answer(&output(folder.path(), &show), Schema::Unit);
    let play = number(&shown.numbers, "transmission.backlash-rad");
    assert_relative_eq!(play.std, play.prior_std, max_relative = 1e-6);
    assert_eq!(play.value, play.nominal);
    // the motor is the old one
    let turns = number(&shown.numbers, "as-built.eccentricity.cos");
    assert!(turns.determined, "{turns:?}");
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
fn physics_that_the_model_file_lacks_is_told_and_is_no_change_where_it_is_as_new() {
    let folder = learnt();
    let cogs = "[[effect]]\nid = \"E11\"\nparameters = { cogging-sin-n-m = 0.002, order = 24.0 }\n";
    fs::write(folder.path().join("machine.toml"), format!("{MACHINE}{cogs}")).unwrap();
    let days = ["2026-11-10", "2026-11-11", "2026-11-12", "2026-11-13"];
    let seeds = ["11", "12", "13", "14"];
    let names: Vec<String> =
        days.iter().zip(seeds).map(|(day, seed)| record(&folder, "A-7", day, "", seed)).collect();
    let since = diagnosed(&folder, &names[3], &["--unit", "A-7.fdi-unit"]);
    assert_eq!(since.verdict, Verdict::ModelInadequate, "{since:?}");
    let is_told = |notice: &&Notice| notice.code == NoticeCode::UnmodelledPhysics;
    let notice = since.notices.iter().find(is_told).expect("a notice");
    assert!(notice.message.contains("cogging (E11)"), "{}", notice.message);
    let mut learn = vec!["unit", "learn", "--id-from", "{id}_{date}", "-o", "cogs.fdi-unit"];
    learn.extend(names[..3].iter().map(String::as_str));
    let said = whole(&output(folder.path(), &learn));
    assert!(said.contains("warning: 3 of 3 recordings have the form of cogging (E11)"), "{said}");
    let as_new = diagnosed(&folder, &names[3], &["--unit", "cogs.fdi-unit"]);
    assert_eq!(as_new.verdict, Verdict::Healthy, "{as_new:?}");
    assert!(as_new.notices.iter().any(|notice| is_told(&notice)), "{as_new:?}");
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
    // of another test
    let planned = ["simulate", "--command", "planned", "--noise-a", "0.02", "-o", "planned.csv"];
    assert!(output(folder.path(), &planned).status.success());
    let told = refusal(&folder, &["diagnose", "--unit", "A-7.fdi-unit", "planned.csv"]);
    let expected = "learnt from recordings of `chirp` on `ema-48`, and the bundle is of `planned`";
    assert!(told.contains(expected), "{told}");
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

/// Notices of noise, rate and damage that the learnt error does not know, within tolerances too.
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
