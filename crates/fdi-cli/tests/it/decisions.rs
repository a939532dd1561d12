//! Decisions about machines.

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use fdi_core::{
    Bundle, EMBEDDED_BUNDLES,
    ema_sim::model_file::ActionLevel,
    report::{Diagnosis, FaultId, Severity},
};

fn recording(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../fixtures/recordings/{name}.csv.gz"))
}

fn diagnose(names: &[&str], words: &[&str]) -> std::process::Output {
    let always = ["diagnose", "--tolerance", "none", "--stable"];
    let paths = names.iter().map(|name| recording(name));
    Command::cargo_bin("fdi").unwrap().args(always).args(words).args(paths).output().unwrap()
}

#[test]
fn a_decision_names_the_worst_fault_with_its_probability() {
    let names = ["r01", "r12", "r20"];
    let output = diagnose(&names, &["--decide", "--output-format", "json"]);
    let document: Diagnosis = serde_json::from_slice(&output.stdout).unwrap();
    let actions: Vec<_> =
        document.records.iter().map(|record| record.action.as_ref().unwrap()).collect();
    let told: Vec<_> = actions.iter().map(|one| one.severity).collect();
    // true levels of `fixtures/recordings/truth.csv`: none, 4.4 % of the turns of B, 30 % of them
    assert_eq!(told, [Severity::Nothing, Severity::Watch, Severity::Act]);
    assert_eq!(actions[2].fault, Some(FaultId::K4));
    assert!(actions[2].next.contains("take the machine out of service"), "{}", actions[2].next);
    let short = &actions[2].faults[3];
    assert!((short.size - 30.0).abs() < 1.0 && short.unit == "% of the turns shorted", "{short:?}");
    assert!(short.probability_above.act > 0.999);
    let without = diagnose(&names[..1], &["--output-format", "json"]);
    assert!(!String::from_utf8(without.stdout).unwrap().contains("\"action\""));
}

#[test]
fn the_exit_code_tells_a_decision_where_it_is_asked_for() {
    let by_decision = ["--exit-code=decision"];
    assert_eq!(diagnose(&["r01"], &by_decision).status.code(), Some(0));
    let watched = diagnose(&["r12"], &by_decision);
    assert_eq!(watched.status.code(), Some(0));
    let told = String::from_utf8(watched.stderr).unwrap();
    assert!(told.contains("warning: to be watched: ") && told.contains("r12"), "{told}");
    assert_eq!(diagnose(&["r01", "r20"], &by_decision).status.code(), Some(1));
    assert_eq!(diagnose(&["r12"], &["--exit-code"]).status.code(), Some(1));
}

#[test]
fn levels_are_asked_for_to_decide() {
    let output = diagnose(&["r12"], &["--watch", "k4=0.5", "--act", "k4=0.6"]);
    let told = String::from_utf8(output.stdout).unwrap();
    assert!(told.contains("watch: ") && !told.contains("short circuit of phase B 4"), "{told}");
}

#[test]
fn levels_of_the_machine_s_owner_decide_unless_others_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("owned.fdib");
    let mut bundle = Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes).unwrap();
    bundle.experiment.stated_levels[3] = Some(ActionLevel { watch: 0.3, act: 0.4 });
    std::fs::write(&path, bundle.to_bytes()).unwrap();
    let path = path.to_str().unwrap();
    let decided = |words: &[&str]| {
        let words = [&["--bundle", path, "--output-format", "json"], words].concat();
        let output = diagnose(&["r12"], &words);
        let document: Result<Diagnosis, _> = serde_json::from_slice(&output.stdout);
        document.map_err(|_| String::from_utf8(output.stderr).unwrap())
    };
    let of_k4 = |words: &[&str]| {
        decided(words).unwrap().records[0].action.clone().unwrap().faults[3].clone()
    };
    // in percent of the turns: a short of 4.4 %
    let own = of_k4(&[]);
    assert_eq!((own.severity, own.levels.watch, own.levels.act), (Severity::Nothing, 30.0, 40.0));
    let asked = of_k4(&["--watch", "k4=0.02"]);
    let levels = [asked.levels.watch, asked.levels.act];
    assert_eq!((asked.severity, levels), (Severity::Watch, [2.0, 40.0]));
    let crossed = decided(&["--act", "k4=0.2"]).unwrap_err();
    assert!(crossed.contains("watched from 0.3 and acted on from 0.2"), "{crossed}");
}

#[test]
fn levels_that_are_none_are_refused() {
    let refused = |words: &[&str]| {
        let output = diagnose(&["r01"], words);
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).unwrap()
    };
    assert!(refused(&["--decide", "--watch", "k9=0.1"]).contains("`k9`, expected k1 to k6"));
    assert!(refused(&["--decide", "--watch", "k1=2"]).contains("at most 1"));
    let crossed = refused(&["--decide", "--watch", "k1=0.5"]);
    assert!(crossed.contains("watched from 0.5 and acted on from 0.2"), "{crossed}");
}
