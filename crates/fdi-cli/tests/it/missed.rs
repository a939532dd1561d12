//! `docs/guide/what-a-model-misses.md` as it stands.

use std::path::Path;

use assert_cmd::Command;
use fdi_core::report::{Calibration, Explanation, ExplanationVerdict, Proposal};
use serde::de::DeserializeOwned;
use tempfile::TempDir;

/// How the guide's recordings are used.
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
fn done(folder: &TempDir, arguments: &[&str]) -> Vec<u8> {
    let mut command = Command::cargo_bin("fdi").unwrap();
    for variable in ["FDI_SEED", "FDI_JOBS", "FDI_OUTPUT_FORMAT", "CLICOLOR_FORCE", "NO_COLOR"] {
        command.env_remove(variable);
    }
    let output = command.current_dir(folder).args(arguments).output().unwrap();
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {complaint}");
    output.stdout
}

fn answer<T: DeserializeOwned>(folder: &TempDir, asked: &[&str]) -> T {
    let json = ["--output-format", "json", "--stable"];
    serde_json::from_slice(&done(folder, &[asked, &RECORDINGS, &json].concat())).unwrap()
}

fn fixture(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures").join(name).display().to_string()
}

/// The recordings of the guide.
fn bench() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("axis")).unwrap();
    let model = fixture("models/axis-on-the-bench.toml");
    for (seed, command, name) in [
        ("1", "swing", "swing"),
        ("2", "swing", "swing-again"),
        ("3", "stairs", "stairs"),
        ("4", "ramps", "ramps"),
    ] {
        let command = fixture(&format!("commands/axis-{command}.csv"));
        let file = format!("axis/{name}.csv");
        let test = ["simulate", "--model", &model, "--command", &command, "--faults", "k1=0.03"];
        done(&folder, &[&test[..], &["--noise-a", "0.02", "--seed", seed, "-o", &file]].concat());
    }
    folder
}

#[test]
fn what_the_guide_shows_comes_out() {
    let folder = bench();
    let nominal = fixture("models/axis.toml");
    let calibrated: Calibration = answer(&folder, &["calibrate", "--model", &nominal]);
    let inertia = &calibrated.parameters["axis.inertia-kg-m2"];
    let [least, most] = inertia.interval_95;
    assert!(least < 2.3e-4 && 2.3e-4 < most, "{inertia:?}");

    let explain = ["explain", "--model", &nominal, "-o", "extended.toml"];
    let explained: Explanation = answer(&folder, &explain);
    assert_eq!(explained.verdict, ExplanationVerdict::Named);
    assert_eq!(explained.effects.len(), 1);
    let cogging = &explained.effects[0];
    assert_eq!((cogging.id.as_str(), cogging.parameters["order"].value), ("E11", 12.0));
    let [least, most] = cogging.parameters["cogging_sin_n_m"].interval_95.unwrap();
    assert!(least < 0.004 && 0.004 < most, "{cogging:?}");
    let friction = &explained.faults["k1"];
    let [least, most] = friction.interval_95_after;
    assert!(least < 0.03 && 0.03 < most, "{friction:?}");
    let half_width = |[least, most]: [f64; 2]| 0.5 * (most - least);
    let gain = half_width(friction.interval_95_before) / half_width(friction.interval_95_after);
    assert!(gain > 5.0, "{friction:?}");

    // the model with what was found leaves nothing to be named
    let again: Explanation = answer(&folder, &["explain", "--model", "extended.toml"]);
    assert_eq!((again.verdict, again.effects.len()), (ExplanationVerdict::Absorbed, 0));

    let proposal: Proposal = answer(&folder, &["propose", "--model", &nominal, "-o", "next.csv"]);
    assert_eq!(proposal.open[0], "E11");
    assert!(proposal.menu[0].separation > 1000.0, "{:?}", proposal.menu[0]);
    // what is proposed can be run
    done(
        &folder,
        &["simulate", "--model", &nominal, "--command", "next.csv", "-o", "next-run.csv"],
    );
}

/// With nothing to tell apart no command is written, and that is said.
#[test]
fn a_proposal_that_is_none_is_not_written() {
    let folder = bench();
    done(
        &folder,
        &[
            &["explain", "--model", &fixture("models/axis.toml"), "-o", "extended.toml"],
            &RECORDINGS[..],
        ]
        .concat(),
    );
    let mut command = Command::cargo_bin("fdi").unwrap();
    let propose = ["propose", "--model", "extended.toml", "-o", "next.csv"];
    let output = command.current_dir(&folder).args(propose).args(RECORDINGS).output().unwrap();
    assert!(output.status.success() && !folder.path().join("next.csv").exists());
    assert_eq!(
        String::from_utf8_lossy(&output.stderr),
        "next.csv: not written, no recording is proposed\n"
    );
}
