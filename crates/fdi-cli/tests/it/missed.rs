//! `docs/guide/what-a-model-misses.md` as it stands, and answers that it does not show.

use std::{fs, process::Output};

use fdi_core::{
    Schema,
    report::{Explanation, ExplanationVerdict, SignalCode},
};
use tempfile::TempDir;

use crate::{
    commands::{answer, output},
    servo_axis::fixture,
};

/// How recordings are used.
const RECORDINGS: [&str; 8] = [
    "--train",
    "axis/swing.csv",
    "axis/stairs.csv",
    "--repeat",
    "axis/swing-again.csv",
    "--holdout",
    "axis/ramps.csv",
    "-q",
];

/// Runs `fdi` in the folder; what must work.
fn done(folder: &TempDir, arguments: &[&str]) -> Output {
    let output = output(folder.path(), arguments);
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {complaint}");
    output
}

/// Asks for JSON of the recordings.
fn asked(folder: &TempDir, command: &[&str]) -> Output {
    done(folder, &[command, &RECORDINGS, &["--output-format", "json", "--stable"]].concat())
}

/// What is missed by a model; with what was found the model is written to `extended.toml`.
fn explained(folder: &TempDir, model: &str) -> Explanation {
    let explain = ["explain", "--model", model, "--exact", "all", "-o", "extended.toml"];
    answer(&asked(folder, &explain), Schema::Explanation)
}

/// What is still missed by `extended.toml`.
fn explained_again(folder: &TempDir) -> Explanation {
    let explain = ["explain", "--model", "extended.toml", "--exact", "all"];
    answer(&asked(folder, &explain), Schema::Explanation)
}

/// Recordings of the guide's bench, worn.
fn bench() -> TempDir {
    recorded(&fixture("models/axis-on-the-bench.toml"), "k1=0.03")
}

/// The same of a machine with something else hidden in it.
fn hiding(effect: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("true.toml");
    let base = fixture("models/axis.toml");
    let inertia = "[axis]\ninertia-kg-m2 = 2.3e-4\n";
    fs::write(&model, format!("base = '{base}'\n{inertia}[[effect]]\n{effect}\n")).unwrap();
    recorded(&model.display().to_string(), "")
}

/// Recordings of a machine.
fn recorded(model: &str, faults: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("axis")).unwrap();
    for (seed, command, name) in [
        ("1", "swing", "swing"),
        ("2", "swing", "swing-again"),
        ("3", "stairs", "stairs"),
        ("4", "ramps", "ramps"),
    ] {
        let command = fixture(&format!("commands/axis-{command}.csv"));
        let file = format!("axis/{name}.csv");
        let test = ["simulate", "--model", model, "--command", &command, "--faults", faults];
        done(&folder, &[&test[..], &["--noise-a", "0.02", "--seed", seed, "-o", &file]].concat());
    }
    folder
}

#[cfg(unix)]
#[test]
fn what_the_guide_prints_is_what_its_commands_print() {
    let folder = tempfile::tempdir().unwrap();
    let guide = include_str!("../../../../docs/guide/what-a-model-misses.md");
    crate::guides::check(guide, folder.path());
}

/// With nothing to tell apart no command is written, and that is said.
#[test]
fn a_proposal_that_is_none_is_not_written() {
    let folder = bench();
    explained(&folder, &fixture("models/axis.toml"));
    let proposed = asked(&folder, &["propose", "--model", "extended.toml", "-o", "next.csv"]);
    assert!(!folder.path().join("next.csv").exists());
    assert_eq!(
        String::from_utf8_lossy(&proposed.stderr),
        "next.csv: not written, no recording is proposed\n"
    );
}

/// What is found can be read back, a vibration too, of which each recording has a phase of its own.
#[test]
fn the_model_with_a_vibration_is_read_back() {
    let hidden = "id = \"E22\"\nparameters = { vibration-sin-n-m = 0.002, frequency-hz = 23 }";
    let folder = hiding(hidden);
    let explained = explained(&folder, &fixture("models/axis.toml"));
    assert_eq!(
        (explained.verdict, explained.effects[0].id.as_str()),
        (ExplanationVerdict::Named, "E22")
    );
    let command = fixture("commands/axis-ramps.csv");
    done(
        &folder,
        &["simulate", "--model", "extended.toml", "--command", &command, "-o", "run.csv"],
    );
}

/// What no effect explains is written as a curve that is called unknown, and explains it.
#[test]
fn what_is_unknown_becomes_a_curve() {
    // friction in a band of speeds alone
    let folder = hiding(
        "id = \"U\"\ncurve = { over = \"speed\", acts-as = \"friction\", points = [[-1.5, 0.0], \
         [-1.4, 0.005], [-1, 0.005], [-0.9, 0], [0.9, 0], [1, 0.005], [1.4, 0.005], [1.5, 0]] }",
    );
    let explained = explained(&folder, &fixture("models/axis.toml"));
    assert_eq!((explained.verdict, explained.effects.len()), (ExplanationVerdict::Unknown, 0));
    assert!(explained.sentence.contains("it follows the speed most"), "{}", explained.sentence);
    let written = fs::read_to_string(folder.path().join("extended.toml")).unwrap();
    assert!(written.contains("over = \"speed\"") && written.contains("status = \"unknown\""));
    let again = explained_again(&folder);
    let left = |answer: &Explanation| {
        let holdout = answer.holdout.as_ref().unwrap();
        holdout.rms_before - holdout.noise_floor
    };
    assert!(left(&again) < 0.3 * left(&explained), "{} {}", left(&again), left(&explained));
}

#[test]
fn recordings_of_no_use_are_refused() {
    let folder = bench();
    let refused = |recordings: &[&str]| {
        let nominal = fixture("models/axis.toml");
        let explain = [&["explain", "--model", &nominal], recordings].concat();
        let output = output(folder.path(), &explain);
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).unwrap()
    };
    let swing = "axis/swing.csv";
    assert_eq!(
        refused(&["--train", swing, "--holdout", swing]),
        "error: axis/swing.csv and axis/swing.csv are one recording, expected one use of each\n"
    );
    let text = fs::read_to_string(folder.path().join(swing)).unwrap();
    let short: Vec<&str> = text.lines().take(603).collect();
    fs::write(folder.path().join("short.csv"), short.join("\n")).unwrap();
    assert_eq!(
        refused(&["--train", "short.csv", "--holdout", swing]),
        "error: short.csv: lasts 0.300 s, expected 0.4 s at least\n"
    );
    let nowhere = refused(&["--train", swing, "--holdout", "short.csv", "-o", "no/e.toml"]);
    assert_eq!(nowhere, "error: `--output no/e.toml`: there is no folder `no`\n");
}

/// Rewrites the rows of `axis/swing.csv` into another recording.
fn rewritten(folder: &TempDir, name: &str, change: impl Fn(&mut Vec<Vec<String>>)) {
    let text = fs::read_to_string(folder.path().join("axis/swing.csv")).unwrap();
    let head = text.lines().take_while(|line| !line.starts_with(char::is_numeric));
    let head: Vec<&str> = head.collect();
    let cells = |line: &str| line.split(',').map(str::to_owned).collect();
    let mut rows: Vec<Vec<String>> = text.lines().skip(head.len()).map(cells).collect();
    change(&mut rows);
    let body = rows.iter().map(|row| row.join(",")).collect::<Vec<_>>().join("\n");
    let written = format!("{}\n{body}\n", head.join("\n"));
    fs::write(folder.path().join(name), written).unwrap();
}

/// Ten samples of 2 kHz.
fn late(rows: &mut [Vec<String>]) {
    let current: Vec<String> = rows.iter().map(|row| row.last().unwrap().clone()).collect();
    for (n, row) in rows.iter_mut().enumerate() {
        row.last_mut().unwrap().clone_from(&current[n.saturating_sub(10)]);
    }
}

/// Asks a command for JSON of the late recording beside two others.
fn asked_of_late(folder: &TempDir, command: &str, more: &[&str]) -> Output {
    let model = fixture("models/axis.toml");
    let set = ["--train", "axis/late.csv", "axis/stairs.csv", "--holdout", "axis/ramps.csv"];
    let form = ["--output-format", "json", "--stable", "-q"];
    let asked = [&[command, "--model", &model], &set[..], &form, more].concat();
    output(folder.path(), &asked)
}

/// What the guide says of a current that is 5 ms late.
#[test]
fn a_late_channel_is_told_and_set_right() {
    let folder = bench();
    rewritten(&folder, "axis/late.csv", |rows| late(rows));
    let told: Explanation = answer(&asked_of_late(&folder, "explain", &[]), Schema::Explanation);
    let signal = told.signal.as_ref().expect("a find");
    assert_eq!((told.verdict, signal.code), (ExplanationVerdict::Inconclusive, SignalCode::Late));
    assert!(told.effects.is_empty() && signal.correctable && !signal.corrected);
    // the period of the recording is half a millisecond
    assert!((signal.value - 5e-3).abs() < 2.5e-4, "{signal:?}");
    let sentence = "No conclusion: axis/late.csv: the current channel is 5.0 ms late";
    assert!(told.sentence.starts_with(sentence), "{}", told.sentence);

    let right = asked_of_late(&folder, "explain", &["--correct"]);
    let right: Explanation = answer(&right, Schema::Explanation);
    assert_eq!(right.effects[0].id, "E11");
    assert!(right.signals.iter().all(|signal| signal.corrected) && right.signals.len() == 1);

    for command in ["calibrate", "propose"] {
        let refused = asked_of_late(&folder, command, &[]);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{said}");
        assert!(said.contains("late: axis/late.csv: the current channel is 5.0 ms"), "{said}");
    }
}

#[test]
fn stamps_with_a_gap_are_no_conclusion() {
    let folder = bench();
    rewritten(&folder, "axis/late.csv", |rows| {
        rows.drain(4000..4040);
    });
    let told: Explanation = answer(&asked_of_late(&folder, "explain", &[]), Schema::Explanation);
    let signal = told.signal.expect("a find");
    assert_eq!((told.verdict, signal.code), (ExplanationVerdict::Inconclusive, SignalCode::Gap));
    // 40 samples of 2 kHz
    assert!((signal.value - 0.02).abs() < 1e-9, "{}", signal.value);
}
