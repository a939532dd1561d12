//! Whole commands: exit code, standard output and standard error, with and without a terminal.

use std::{
    fs,
    path::Path,
    process::{Command, Output, Stdio},
};

use fdi_core::{
    Schema,
    report::{BundleSummary, Calibration, Evaluation, Explanation, Standing},
};
use serde::de::DeserializeOwned;
use serde_json::Value;
use tempfile::TempDir;

use crate::{
    explained::{EXPLAIN, machine},
    schema::violations,
    stand_in::{GOOD, folder},
};

/// The program in a folder, without the variables of whoever runs the test.
fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("fdi"));
    for (name, _) in std::env::vars() {
        if name.starts_with("FDI_") || name == "CLICOLOR_FORCE" || name == "NO_COLOR" {
            command.env_remove(name);
        }
    }
    command.current_dir(folder).args(arguments);
    command
}

pub(crate) fn output(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

/// All that a command came to.
pub(crate) fn whole(output: &Output) -> String {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    let (code, out, err) =
        (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr));
    format!("exit {code}\n--- stdout\n{out}--- stderr\n{err}").replace(&version(), "fdi [version]")
}

fn version() -> String {
    format!("fdi {}", env!("CARGO_PKG_VERSION"))
}

/// With every number that is computed as `#`: the last digits are another processor's.
fn without_numbers(text: &str) -> String {
    let (code, text) = text.split_once('\n').unwrap();
    let mut shown = String::new();
    let mut letters = text.chars().peekable();
    let mut after_letter = false;
    while let Some(letter) = letters.next() {
        if letter.is_ascii_digit() && !after_letter {
            let of_number = |c: &char| c.is_ascii_digit() || *c == '.';
            let mut ends_with_point = false;
            while let Some(next) = letters.next_if(of_number) {
                ends_with_point = next == '.';
            }
            if letters.peek() == Some(&'e') {
                let rest: String = letters.clone().skip(1).take_while(|c| *c != ' ').collect();
                if rest.starts_with('-') && rest.len() > 1 {
                    letters.by_ref().take(2).for_each(drop);
                    while letters.next_if(char::is_ascii_digit).is_some() {}
                }
            }
            shown.push('#');
            if ends_with_point {
                shown.push('.');
            }
            after_letter = false;
            continue;
        }
        after_letter = letter.is_ascii_alphanumeric() || letter == '_';
        shown.push(letter);
    }
    // columns are as wide as their numbers, and signs are of numbers near zero
    let squeezed = shown.replace("-#", "#");
    let lines = squeezed.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "));
    format!("{code}\n{}", lines.collect::<Vec<_>>().join("\n"))
}

/// An answer read back into its type, and held against the schema that is published for it.
pub(crate) fn answer<T: DeserializeOwned>(output: &Output, schema: Schema) -> T {
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    let schema: Value = serde_json::from_str(&schema.text()).unwrap();
    assert_eq!(violations(&value, &schema, &schema, ""), Vec::<String>::new());
    serde_json::from_value(value).unwrap()
}

/// A small dataset, and the bundle learnt from it.
fn learnt() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let made = ["dataset", "-q", "--conditions", "24", "--output", "d.fdi-dataset"];
    assert_eq!(whole(&output(folder.path(), &made)), "exit 0\n--- stdout\n--- stderr\n");
    folder
}

/// The controller of the model file is not used: what the measured motion asks for is compared.
#[test]
fn explain_does_without_the_controller_and_without_effects_that_cannot_be() {
    let machine = machine();
    let folder = machine.path();
    let json = [&EXPLAIN[..], &["--stable", "--output-format", "json"]].concat();
    let moved = output(folder, &[&json[..], &["--inverse-dynamics"]].concat());
    let found: Explanation = answer(&moved, Schema::Explanation);
    // averaged as it is, the signal does not show what is missed at the reversals
    let fits: Vec<f64> = found.records.iter().map(|record| record.fit_percent_after).collect();
    assert!(!fits.is_empty() && fits.iter().all(|fit| *fit > 70.0), "{fits:?}");
    let left_out = output(folder, &[&json[..], &["--without", "E01"]].concat());
    let found: Explanation = answer(&left_out, Schema::Explanation);
    assert!(found.effects.iter().all(|effect| effect.id != "E01"), "{}", found.sentence);
    let unknown = whole(&output(folder, &[&EXPLAIN[..], &["--without", "E99"]].concat()));
    let said = "`--without E99`: no effect of the catalogue, expected one of E01 to E25";
    assert!(unknown.starts_with("exit 2") && unknown.contains(said), "{unknown}");
}

#[test]
fn explain_says_what_is_missed() {
    let machine = machine();
    let folder = machine.path();
    let human = output(folder, &EXPLAIN);
    insta::assert_snapshot!(without_numbers(&whole(&human)));
    let json = [&EXPLAIN[..], &["--stable", "--output-format", "json"]].concat();
    let one = output(folder, &[&json[..], &["--jobs", "1"]].concat());
    let found: Explanation = answer(&one, Schema::Explanation);
    assert_eq!(found.effects[0].id, "E01");
    assert_eq!(found.hypotheses[0].standing, Standing::Found);
    let speed = found.curves.iter().find(|curve| curve.coordinate == "speed").unwrap();
    // means of thirty bins follow noise a little too
    assert!(speed.share_before > 0.5 && speed.share_after < 0.1, "{speed:?}");
    assert!(found.elapsed_s.is_none());
    // the same bytes on any number of threads, with and without colour
    let two = output(folder, &[&json[..], &["--jobs", "2"]].concat());
    assert_eq!(one.stdout, two.stdout);
    let plain = command(folder, &EXPLAIN).env("NO_COLOR", "1").output().unwrap();
    assert_eq!(whole(&plain), whole(&human));
}

#[test]
fn explain_says_what_the_recordings_lack() {
    let machine = machine();
    let alone = ["explain", "--model", "nominal.toml", "--train", "a.csv"];
    insta::assert_snapshot!(whole(&output(machine.path(), &alone)));
    let table = [&EXPLAIN[..], &["--output-format", "csv"]].concat();
    insta::assert_snapshot!(whole(&output(machine.path(), &table)));
}

#[test]
fn calibrate_gives_numbers_with_intervals() {
    let machine = machine();
    let calibrate =
        ["calibrate", "--model", "nominal.toml", "--train", "a.csv", "b.csv", "--holdout", "c.csv"];
    let human = output(machine.path(), &calibrate);
    insta::assert_snapshot!(without_numbers(&whole(&human)));
    let json = [&calibrate[..], &["--stable", "--output-format", "json"]].concat();
    let one = output(machine.path(), &[&json[..], &["--jobs", "1"]].concat());
    let calibration: Calibration = answer(&one, Schema::Calibration);
    assert!(calibration.parameters.contains_key("axis.mass-kg"), "{calibration:?}");
    assert_eq!(one.stdout, output(machine.path(), &[&json[..], &["--jobs", "2"]].concat()).stdout);
}

#[test]
fn simulate_writes_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let simulate = ["simulate", "--fidelity", "low", "--faults", "k1=0.02"];
    let made = output(folder.path(), &simulate);
    let text = whole(&made);
    let (head, _) = text.match_indices('\n').nth(11).map(|(at, _)| text.split_at(at)).unwrap();
    insta::assert_snapshot!(format!("{head}\n…\n{}", text.rsplit_once("---").unwrap().1));
    let colour = [&["--color", "always"], &simulate[..]].concat();
    assert_eq!(output(folder.path(), &colour).stdout, made.stdout);
    insta::assert_snapshot!(whole(&output(folder.path(), &["simulate", "--faults", "k1=2"])));
}

#[test]
fn simulate_lets_a_current_circulate_in_shorted_turns() {
    let folder = tempfile::tempdir().unwrap();
    let asked = |more: &[&str]| output(folder.path(), &[&["simulate"], more].concat());
    let short = ["--faults", "k3=0.05", "--short-resistance-ohm", "0.05"];
    let (closed, removed) = (asked(&short), asked(&short[..2]));
    assert!(closed.status.success() && closed.stdout != removed.stdout);
    // the same from a model file
    let text = "base = \"ema-48\"\nname = \"ema-48\"\n[short-circuit]\nresistance-ohm = 0.05\n";
    fs::write(folder.path().join("short.toml"), text).unwrap();
    let of_file = asked(&["--faults", "k3=0.05", "--model", "short.toml"]);
    assert_eq!(of_file.stdout, closed.stdout);
    let more = [&short[..], &["--short-leakage-ratio", "0.2"]].concat();
    assert_ne!(asked(&more).stdout, closed.stdout);
    let refused = |more: &[&str]| whole(&asked(more));
    let none = refused(&short[2..]);
    assert!(none.contains("no turns are shorted; give k3, k4 or k5 in `--faults`"), "{none}");
    let low = refused(&[&short[..], &["--fidelity", "low"]].concat());
    assert!(low.contains("in the low-fidelity model shorted turns are gone"), "{low}");
}

#[test]
fn dataset_and_bundle_say_what_they_made() {
    let folder = learnt();
    let dataset = ["dataset", "--conditions", "24", "--output"];
    let of = |name: &str, jobs: &str| {
        let made = output(folder.path(), &[&dataset[..], &[name, "--jobs", jobs]].concat());
        (whole(&made), fs::read(folder.path().join(name)).unwrap())
    };
    let (one, two) = (of("1.fdi-dataset", "1"), of("2.fdi-dataset", "2"));
    insta::assert_snapshot!(one.0);
    assert_eq!(one, two);
    assert_eq!(one.1, fs::read(folder.path().join("d.fdi-dataset")).unwrap());
    let build = ["bundle", "build", "--dataset", "d.fdi-dataset", "--output", "b.fdi-bundle"];
    let told = without_numbers(&whole(&output(folder.path(), &build)));
    // a fast machine has no time left worth telling
    let steps = told.lines().map(|line| line.split(", about ").next().unwrap());
    insta::assert_snapshot!(steps.collect::<Vec<_>>().join("\n"));
    let show = ["bundle", "show", "b.fdi-bundle", "--output-format", "json"];
    let summary: BundleSummary = answer(&output(folder.path(), &show), Schema::Bundle);
    assert_eq!(summary.datasets[0].conditions, 24);
    insta::assert_snapshot!(whole(&output(
        folder.path(),
        &["bundle", "build", "--dataset", "d.fdi-dataset"]
    )));
    fs::write(folder.path().join("no.fdi-dataset"), "no dataset").unwrap();
    let broken = ["bundle", "build", "--dataset", "no.fdi-dataset", "--output", "b.fdi-bundle"];
    insta::assert_snapshot!(whole(&output(folder.path(), &broken)));
}

/// The shortest that the experiment allows.
const EVALUATE: [&str; 8] =
    ["evaluate", "low", "--conditions", "3", "--snapshots", "24", "--methods", "gls"];

#[test]
fn evaluate_gives_a_table_a_method() {
    let folder = tempfile::tempdir().unwrap();
    let human = output(folder.path(), &[&EVALUATE[..], &["--stable"]].concat());
    insta::assert_snapshot!(without_numbers(&whole(&human)));
    let json = [&EVALUATE[..], &["--stable", "--output-format", "json"]].concat();
    let one = output(folder.path(), &[&json[..], &["--jobs", "1"]].concat());
    let evaluation: Evaluation = answer(&one, Schema::Evaluation);
    assert_eq!((evaluation.conditions, evaluation.methods.len()), (3, 1));
    assert_eq!(one.stdout, output(folder.path(), &[&json[..], &["--jobs", "2"]].concat()).stdout);
    let unknown = ["evaluate", "low", "--methods", "luck"];
    insta::assert_snapshot!(whole(&output(folder.path(), &unknown)));
}

#[test]
fn inspect_config_says_where_each_value_is_from() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("fdi.toml"), "seed = 5\n[diagnose]\nmethod = \"ei\"\n").unwrap();
    let config = ["--jobs", "3", "inspect", "config"];
    let shown = command(folder.path(), &config).env("FDI_OUTPUT_FORMAT", "human").output().unwrap();
    insta::assert_snapshot!(whole(&shown));
    fs::write(folder.path().join("fdi.toml"), "sed = 5\n").unwrap();
    insta::assert_snapshot!(whole(&output(folder.path(), &config)));
}

#[test]
fn a_reader_that_goes_away_is_no_error_of_any_command() {
    let machine = machine();
    let short = [&EXPLAIN[..], &["--output-format", "json"]].concat();
    let calibrate = ["calibrate", "--model", "nominal.toml", "--train", "a.csv", "b.csv"];
    for arguments in [
        &short[..],
        &calibrate,
        &["simulate", "--fidelity", "low"],
        &["bundle", "show"],
        &["inspect", "config"],
        &["inspect", "a.csv"],
        &["schema", "explanation"],
        &["completions", "bash"],
        &["man"],
        &[&EVALUATE[..], &["--stable"]].concat(),
    ] {
        let mut child = command(machine.path(), &[arguments, &["--quiet"]].concat())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let err = String::from_utf8_lossy(&output.stderr);
        assert_eq!((output.status.code(), err.as_ref()), (Some(0), ""), "{arguments:?}");
    }
}

/// What a terminal shows of a command line, or nothing and why where none can be had.
#[track_caller]
fn on_a_terminal(folder: &Path, arguments: &[&str], variables: &[(&str, &str)]) -> Option<String> {
    let words: Vec<String> = arguments.iter().map(|word| format!("'{word}'")).collect();
    let program = assert_cmd::cargo::cargo_bin!("fdi").display().to_string();
    let line = format!("'{program}' {}", words.join(" "));
    let mut script = Command::new("script");
    script.args(["--quiet", "--return", "--command", &line, "/dev/null"]);
    for variable in ["FDI_SEED", "FDI_JOBS", "FDI_OUTPUT_FORMAT", "CLICOLOR_FORCE", "NO_COLOR"] {
        script.env_remove(variable);
    }
    script.env("TERM", "xterm-256color").envs(variables.iter().copied());
    match script.current_dir(folder).stdin(Stdio::null()).output() {
        Ok(output) if output.status.code().is_some_and(|code| code < 3) => {
            Some(String::from_utf8_lossy(&output.stdout).into_owned())
        }
        other => {
            skipped_tests::skip(&format!("`script` gives no terminal here: {other:?}"));
            None
        }
    }
}

/// Two recordings that the embedded bundle is for.
fn recordings() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/recordings");
    for name in ["r01.csv.gz", "r12.csv.gz"] {
        fs::copy(fixtures.join(name), folder.path().join(name)).unwrap();
    }
    folder
}

#[test]
fn a_terminal_is_told_how_far_a_batch_is_and_gets_colours() {
    let recordings = recordings();
    let batch = ["diagnose", "--tolerance", "none", "--stable", "r01.csv.gz", "r12.csv.gz"];
    let Some(coloured) = on_a_terminal(recordings.path(), &batch, &[]) else { return };
    assert!(coloured.contains("\r0 of 2 recordings, 0 %"), "{coloured:?}");
    let (_, second) = coloured.split_once("\r2 of 2 recordings, 100 %, ").unwrap();
    assert!(second.contains(" a second, 0 s left"), "{coloured:?}");
    assert!(coloured.contains('\u{1b}'), "{coloured:?}");
    let plain = on_a_terminal(recordings.path(), &batch, &[("NO_COLOR", "1")]).unwrap();
    assert!(!plain.contains('\u{1b}') && plain.contains("2 of 2 recordings"), "{plain:?}");
    // what stays on the screen is what a pipe gets, without the line of progress
    let piped = output(recordings.path(), &batch);
    let stays: Vec<&str> = plain
        .split('\n')
        .map(|line| line.trim_end_matches('\r').rsplit('\r').next().unwrap_or_default())
        .collect();
    for line in String::from_utf8(piped.stdout).unwrap().lines() {
        assert!(stays.contains(&line), "{line:?} in {stays:?}");
    }
    let err = String::from_utf8(piped.stderr).unwrap();
    assert!(err.starts_with("diagnosing 2 recordings\n"), "{err}");
    assert!(!err.contains('\r') && !plain.contains("diagnosing"), "{err}");
    let quiet = on_a_terminal(recordings.path(), &[&batch[..], &["-q"]].concat(), &[]).unwrap();
    assert!(!quiet.contains("2 of 2"), "{quiet:?}");
}

#[test]
fn rows_carry_actuator_and_date() {
    let text = format!("# actuator-id = \"A-7\"\n# date = 2026-05-05\n{GOOD}");
    let folder = folder(&[("healthy-1.csv", &text), ("healthy-2.csv", GOOD)]);
    let path = folder.path().display().to_string();
    let rows = crate::stand_in::diagnose(&["-q", "--output-format", "csv", &path]).out;
    let mut rows = csv::Reader::from_reader(rows.as_bytes());
    let names: Vec<String> = rows.headers().unwrap().iter().map(str::to_owned).collect();
    assert_eq!(names[..4], ["recording", "actuator_id", "date", "status"]);
    let cells: Vec<_> = rows.records().map(|row| row.unwrap()).collect();
    assert_eq!((&cells[0][1], &cells[0][2]), ("A-7", "2026-05-05"));
    assert_eq!((&cells[1][1], &cells[1][2]), ("", ""));
}

/// Its decoder panics on a page of values whose dictionary is called an index.
#[cfg(feature = "parquet")]
#[test]
fn a_file_whose_decoder_panics_is_one_error() {
    let folder = tempfile::tempdir().unwrap();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/readers");
    let mut bytes = fs::read(fixtures.join("pandas-zstd.parquet")).unwrap();
    // the kind of the first page, after the magic number and the head of its field
    assert_eq!(bytes[..6], *b"PAR1\x15\x04");
    bytes[5] = 0x02;
    fs::write(folder.path().join("r.parquet"), bytes).unwrap();
    assert_eq!(
        whole(&output(folder.path(), &["inspect", "r.parquet"])),
        "exit 2\n--- stdout\n--- stderr\n\
         error: r.parquet: damaged `.parquet` file: the decoder gave up on it\n"
    );
}
