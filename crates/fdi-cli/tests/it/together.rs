//! One answer to several recordings of an actuator.

use std::fs;

use fdi_core::{
    Schema,
    report::{Diagnosis, Further, NoticeCode, RecordDiagnosis, Severity, Verdict},
};
use tempfile::TempDir;

use crate::{
    commands::{answer, output, whole},
    unit::{learnt, record, refusal},
};

const TOGETHER: [&str; 8] = [
    "diagnose",
    "--id-from",
    "{id}_{date}",
    "--output-format",
    "json",
    "--stable",
    "--unit",
    "A-7.fdi-unit",
];

fn together(folder: &TempDir, by: &str, names: &[&str]) -> Diagnosis {
    let said = output(folder.path(), &[&TOGETHER[..], &["--together", by], names].concat());
    answer(&said, Schema::Diagnosis)
}

fn std_of(record: &RecordDiagnosis, fault: usize) -> f64 {
    record.faults[fault].std.unwrap()
}

fn has(record: &RecordDiagnosis, code: NoticeCode) -> bool {
    record.notices.iter().any(|notice| notice.code == code)
}

#[test]
fn recordings_of_one_state_of_health_have_one_answer() {
    let folder = learnt();
    let days = ["2027-11-02", "2027-11-03", "2027-11-04"];
    let names: Vec<String> = days
        .iter()
        .zip(["21", "22", "23"])
        .map(|(day, seed)| record(&folder, "A-7", day, "k2=0.002", seed))
        .collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let all = together(&folder, "actuator", &names);
    let [one] = &all.records[..] else { panic!("{:?}", all.records) };
    assert_eq!(one.recording, "3 recordings of A-7");
    assert_eq!((one.verdict, one.date.as_deref()), (Verdict::Faulty, Some("2027-11-04")));
    assert_eq!(one.faults[1].detected, Some(true));
    // friction differs from day to day: three days tell more than one, though not as three fresh ones
    assert_eq!(one.together.len(), 3);
    for (told, name) in one.together.iter().zip(&names) {
        assert_eq!((told.recording.as_str(), &told.left_out), (*name, &None));
        let friction = &told.levels[0];
        let (alone, without) = (friction.std, friction.std_without.unwrap());
        let joined = std_of(one, 0);
        assert!(joined < without && without < alone, "{joined} {without} {alone}");
        assert!(joined > alone / 3_f64.sqrt(), "{joined} {alone}");
    }
    // each day by itself
    let each = together(&folder, "session", &names);
    assert_eq!(each.records.len(), 3);
    assert_eq!(each.records[0].recording, names[0]);
    let alone = one.together[0].levels[0].std;
    assert!((std_of(&each.records[0], 0) / alone - 1.0).abs() < 1e-9);
}

/// A recording of a test, as new or with a fault, without the test's name where it is not to be told.
fn record_test(folder: &TempDir, test: &str, day: &str, faults: &str, is_named: bool) -> String {
    let name = format!("A-7_{day}_{test}.csv");
    let asked = ["simulate", "--command", test, "--faults", faults, "--noise-a", "0.02"];
    let made = output(folder.path(), &[&asked[..], &["--seed", day, "-o", &name]].concat());
    assert!(made.status.success(), "{}", whole(&made));
    let path = folder.path().join(&name);
    let text = fs::read_to_string(&path).unwrap();
    let command = format!("# command = \"{test}\"\n");
    let head = format!("# actuator-id = \"A-7\"\n# session = \"{day}\"\n");
    let kept = if is_named { text } else { text.replace(&command, "") };
    fs::write(path, head + &kept).unwrap();
    name
}

#[test]
fn recordings_of_several_tests_have_one_answer() {
    let folder = TempDir::new().unwrap();
    let mut asked = vec!["diagnose".to_owned()];
    for day in ["11", "12", "13", "14"] {
        for test in ["chirp", "planned"] {
            let name = record_test(&folder, test, day, "", true);
            asked.extend(["--reference".to_owned(), name]);
        }
    }
    let later =
        ["chirp", "planned"].map(|test| record_test(&folder, test, "21", "k3=0.006", false));
    asked.extend(later.clone());
    let told = |asked: &[String], options: &[&str]| {
        let asked: Vec<&str> =
            asked.iter().map(String::as_str).chain(options.iter().copied()).collect();
        let said =
            output(folder.path(), &[&asked[..], &["--output-format", "json", "--stable"]].concat());
        answer::<Diagnosis>(&said, Schema::Diagnosis)
    };
    let said = told(&asked, &["--together", "session"]);
    let [one] = &said.records[..] else { panic!("{:?} {:?}", said.records, said.failed) };
    assert_eq!(one.verdict, Verdict::Faulty);
    let [chirp, planned] = &one.together[..] else { panic!("{:?}", one.together) };
    assert_eq!((&chirp.left_out, &planned.left_out), (&None, &None));
    // the planned test knows an eccentricity better than the chirp, and both together know it best
    let place = 5;
    let joined = std_of(one, place);
    assert!(
        joined <= planned.levels[place].std
            && planned.levels[place].std < 0.5 * chirp.levels[place].std
    );
    // each was diagnosed with the bundle of its test
    let each = told(&asked, &[]);
    let bundles: Vec<bool> = each.records.iter().map(|record| record.bundle.is_some()).collect();
    assert_eq!(bundles, [false, true]);
    // a recording whose test no reference is of fails by itself
    let mut chirps = vec!["diagnose".to_owned()];
    chirps.extend(["--reference".to_owned(), "A-7_11_chirp.csv".to_owned()]);
    chirps.extend(later);
    let said = told(&chirps, &[]);
    assert_eq!((said.records.len(), said.failed.len()), (1, 1));
    let expected = "the references: none is of the test `planned` of this recording";
    assert_eq!(said.failed[0].error, expected);
}

#[test]
fn a_machine_that_changed_and_what_is_no_second_recording_are_told() {
    let folder = learnt();
    let sound = record(&folder, "A-7", "2027-11-02", "", "31");
    let worn = record(&folder, "A-7", "2027-11-03", "k2=0.01", "32");
    fs::copy(folder.path().join(&sound), folder.path().join("A-7_2027-11-04.csv")).unwrap();
    fs::write(folder.path().join("A-7_2027-11-05.csv"), "time_s\n0\n").unwrap();
    let said =
        together(&folder, "actuator", &[&sound, &worn, "A-7_2027-11-04.csv", "A-7_2027-11-05.csv"]);
    let [one] = &said.records[..] else { panic!("{:?}", said.records) };
    assert_eq!(one.verdict, Verdict::ModelInadequate);
    assert!(has(one, NoticeCode::RecordingsDisagree) && has(one, NoticeCode::RecordingsRepeated));
    assert!(!has(one, NoticeCode::RecordingsLeftOut));
    let again = one.together[2].left_out.as_deref();
    assert_eq!(again, Some("it is `A-7_2027-11-02.csv` again"));
    // what cannot be read is told beside, and takes nothing with it
    let [failed] = &said.failed[..] else { panic!("{:?}", said.failed) };
    assert_eq!(failed.recording, "A-7_2027-11-05.csv");
    // anti-test: without the change they agree
    let same = record(&folder, "A-7", "2027-11-06", "", "33");
    let said = together(&folder, "actuator", &[&sound, &same]);
    assert_eq!(said.records[0].verdict, Verdict::Healthy, "{:?}", said.records[0]);
}

#[test]
fn a_day_with_damage_that_the_others_exclude_is_named() {
    let folder = learnt();
    let day = |day: &str, faults: &str, seed: &str| record(&folder, "A-7", day, faults, seed);
    let mut names = vec![
        day("2027-11-02", "", "71"),
        day("2027-11-03", "", "72"),
        day("2027-11-04", "", "73"),
        day("2027-11-20", "k1=0.2", "74"),
    ];
    let ask = |names: &[String]| {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        together(&folder, "actuator", &names).records.remove(0)
    };
    let one = ask(&names);
    let verdicts: Vec<Verdict> = one.together.iter().map(|one| one.verdict).collect();
    assert_eq!(verdicts[3], Verdict::Faulty);
    assert!(!verdicts[..3].contains(&Verdict::Faulty), "{verdicts:?}");
    assert_eq!(one.verdict, Verdict::ModelInadequate);
    let told = &one.notice(NoticeCode::RecordingsDisagree).unwrap().message;
    assert!(told.starts_with(&format!("{} shows friction", names[3])), "{told}");
    assert!(one.faults.iter().all(|fault| fault.detected.is_none()), "{:?}", one.faults);
    assert!(one.findings.iter().all(|finding| !finding.detected), "{:?}", one.findings);
    // anti-test: friction that is there on every day is one state of health
    names =
        vec![day("2027-11-21", "k1=0.2", "75"), day("2027-11-22", "k1=0.2", "76"), names.remove(3)];
    let one = ask(&names);
    assert_eq!(one.verdict, Verdict::Faulty, "{:?}", one.notices);
    assert_eq!(one.faults[0].detected, Some(true));
}

#[test]
fn references_are_of_the_actuator() {
    let folder = TempDir::new().unwrap();
    let reference = record_test(&folder, "chirp", "11", "", true);
    let own = record_test(&folder, "chirp", "21", "", true);
    let text = fs::read_to_string(folder.path().join(&own)).unwrap();
    fs::write(folder.path().join("other.csv"), text.replace("\"A-7\"", "\"B-1\"")).unwrap();
    let asked = ["diagnose", "--reference", &reference, &own, "other.csv"];
    let said = output(folder.path(), &[&asked[..], &["--output-format", "json"]].concat());
    let said: Diagnosis = answer(&said, Schema::Diagnosis);
    assert_eq!(said.records.len(), 1);
    let told = &said.failed[0].error;
    assert!(told.starts_with("it is of actuator `B-1`, the references are of `A-7`"), "{told}");
}

#[test]
fn no_machine_is_healthy_where_a_recording_of_it_is_not_explained() {
    let folder = learnt();
    let sound = record(&folder, "A-7", "2027-11-02", "", "31");
    let severe = record(&folder, "A-7", "2027-11-03", "k1=0.5,k2=0.3", "32");
    let alone = together(&folder, "actuator", &[&sound]);
    assert_eq!(alone.records[0].verdict, Verdict::Healthy);
    let alone = together(&folder, "actuator", &[&severe]);
    assert_eq!(alone.records[0].verdict, Verdict::Faulty);
    // the two contradict one another
    let said = together(&folder, "actuator", &["--decide", &sound, &severe]);
    let [one] = &said.records[..] else { panic!("{:?}", said.records) };
    assert_eq!(one.verdict, Verdict::ModelInadequate);
    let disagree = one.notice(NoticeCode::RecordingsDisagree).unwrap();
    let expected =
        format!("{severe} is faulty by itself, and the other recordings show a healthy machine");
    assert!(disagree.message.starts_with(&expected), "{}", disagree.message);
    // what one of them asks for is not lost
    let action = one.action.as_ref().unwrap();
    assert_eq!(action.severity, Severity::Act);
    assert!(action.reason.starts_with(&format!("{severe} by itself: ")), "{}", action.reason);
    // one that nothing explains leaves the machine open
    let text = fs::read_to_string(folder.path().join(&sound)).unwrap();
    let doubled = "A-7_2027-11-05.csv";
    let (head, rows) = text.split_at(text.find("\n0").unwrap() + 1);
    let double = |row: &str| {
        let (time, rest) = row.split_once(',').unwrap();
        let [a, b, c, angle] =
            rest.split(',').map(|x| x.parse::<f64>().unwrap()).collect::<Vec<_>>()[..]
        else {
            panic!("{row}")
        };
        format!("{time},{},{},{},{angle}\n", 3.0 * a, 3.0 * b, 3.0 * c)
    };
    let rows: String = rows.lines().map(double).collect();
    fs::write(folder.path().join(doubled), head.to_owned() + &rows).unwrap();
    let said = together(&folder, "actuator", &["--decide", &sound, doubled]);
    let [one] = &said.records[..] else { panic!("{:?}", said.records) };
    assert_ne!(one.verdict, Verdict::Healthy, "{one:?}");
    assert!(has(one, NoticeCode::RecordingsLeftOut));
    let action = one.action.as_ref().unwrap();
    assert_eq!(action.severity, Severity::Act);
    assert!(action.reason.starts_with(&format!("{doubled} by itself: ")), "{}", action.reason);
}

#[test]
fn how_well_a_session_tells_each_fault_is_told() {
    let folder = learnt();
    let names = [
        record(&folder, "A-7", "2027-11-02", "", "61"),
        record(&folder, "A-7", "2027-11-03", "", "62"),
    ];
    let asked = |names: &[&str]| {
        let names = [&["--identifiability"], names].concat();
        together(&folder, "actuator", &names).records.remove(0)
    };
    let [alone, both] = [asked(&[&names[0]]), asked(&[&names[0], &names[1]])];
    assert_eq!(both.identifiability.len(), 6);
    for (alone, both) in alone.identifiability.iter().zip(&both.identifiability) {
        assert!(both.std < alone.std, "{both:?} {alone:?}");
        assert!(both.least_std <= both.std);
    }
    // the first recording is told of a second day as the second day then shows it
    let friction = alone.identifiability[0].would_help.as_ref().unwrap();
    assert_eq!(friction.what, Further::Day);
    assert!(
        (friction.std / both.identifiability[0].std - 1.0).abs() < 0.1,
        "{friction:?} {both:?}"
    );
    let told = output(
        folder.path(),
        &[
            "diagnose",
            "--id-from",
            "{id}_{date}",
            "--unit",
            "A-7.fdi-unit",
            "--identifiability",
            &names[0],
        ],
    );
    let told = whole(&told);
    assert!(told.contains("standard deviation of each fault:"), "{told}");
    assert!(told.contains("the same test on another day: "), "{told}");
}

#[test]
fn people_are_told_what_each_recording_contributes() {
    let folder = learnt();
    let names = [
        record(&folder, "A-7", "2027-11-02", "", "41"),
        record(&folder, "A-7", "2027-11-03", "", "42"),
    ];
    let asked = ["diagnose", "--id-from", "{id}_{date}", "--unit", "A-7.fdi-unit"];
    let by = ["--together", "actuator", "--report", "r.html", &names[0], &names[1]];
    let told = whole(&output(folder.path(), &[&asked[..], &by].concat()));
    assert!(told.contains("1 answer to 2 recordings: 1 healthy"), "{told}");
    assert!(told.contains("each by itself (in brackets ± of the answer without it):"), "{told}");
    let page = fs::read_to_string(folder.path().join("r.html")).unwrap();
    assert!(page.contains("Recordings that the answer is of"), "{page}");
}

#[test]
fn settings_without_an_answer_to_several_are_refused() {
    let folder = learnt();
    let name = record(&folder, "A-7", "2027-11-02", "", "51");
    let ask = |more: &[&str]| {
        refusal(&folder, &[&["diagnose", &name, "--together", "session"], more].concat())
    };
    assert_eq!(ask(&["--tolerance", "none"]), "error: `--together` needs `--tolerance model`\n");
    assert_eq!(ask(&["--method", "ei"]), "error: `--together` needs `--method gls`\n");
    assert!(ask(&["--resume", "kept.jsonl"]).contains("cannot be used with"));
}
