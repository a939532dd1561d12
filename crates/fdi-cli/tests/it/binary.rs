//! The program itself.

use std::process::Stdio;

use assert_cmd::Command;

use crate::stand_in::folder;

pub(crate) fn fdi(arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("fdi").unwrap();
    for variable in ["FDI_SEED", "FDI_JOBS", "FDI_OUTPUT_FORMAT", "CLICOLOR_FORCE", "NO_COLOR"] {
        command.env_remove(variable);
    }
    let output = command.args(arguments).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

#[test]
fn version_and_schemas_go_to_standard_output() {
    let (code, out, err) = fdi(&["--version"]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert_eq!(out, format!("fdi {}\n", env!("CARGO_PKG_VERSION")));
    for form in [
        "recording",
        "diagnosis",
        "bundle",
        "evaluation",
        "explanation",
        "calibration",
        "effects",
        "fleet",
    ] {
        let (code, out, err) = fdi(&["schema", form]);
        assert_eq!((code, err.as_str()), (0, ""));
        assert!(out.len() > 500, "{form}");
    }
}

#[test]
fn a_wrong_command_line_is_told_on_standard_error() {
    for arguments in [
        &["diagnose"][..],
        &["diagnose", "--method", "guess", "x.csv"],
        &["diagnose", "--noise-a", "-1", "x.csv"],
        &["diagnose", "--noise-a", "1e300", "x.csv"],
        &["evaluate", "noisy", "--noise-a", "1e300"],
        &["evaluate", "noisy", "--noise-a", "-1"],
        &["diagnose", "--jobs", "0", "x.csv"],
        &["simulate", "--faults", "k9=1"],
        &["simulate", "--adc-range-a", "10"],
        &["frobnicate"],
    ] {
        let (code, out, err) = fdi(arguments);
        assert_eq!((code, out.as_str()), (2, ""), "{arguments:?}");
        assert!(err.starts_with("error: "), "{err}");
    }
}

#[test]
fn inspect_says_what_a_file_holds() {
    let text = "# noise-a = 0.02\n# actuator-id = \"A-7\"\ntime_s,phase_a_current_a,load_n_m,rem\n\
                0,1.5,0.25,start\n0.0005,-1.5,,\n0.0010,0.5,0.5,\n0.0030,0.5,0.5,\n";
    let folder = folder(&[("r.csv", text)]);
    let (code, out, err) = fdi(&["inspect", &folder.path().join("r.csv").display().to_string()]);
    insta::assert_snapshot!(format!("exit {code}\n--- stdout\n{out}--- stderr\n{err}"));
}

#[test]
fn inspect_guesses_what_foreign_columns_are() {
    let folder = folder(&[("r.csv", "Time [ms],I_A,I_B,I_C,rem\n0,1,2,-3,x\n0.5,1,2,-3,\n")]);
    let file = folder.path().join("r.csv").display().to_string();
    let text = |arguments: &[&str]| {
        let (code, out, err) = fdi(arguments);
        let text = format!("exit {code}\n--- stdout\n{out}--- stderr\n{err}");
        text.replace(&folder.path().display().to_string(), "[folder]")
    };
    insta::assert_snapshot!(text(&["inspect", &file]));
    insta::assert_snapshot!(text(&["inspect", "--map", "time_s=Time [ms]*0.001", &file]));
}

#[test]
fn a_file_that_cannot_be_read_is_named() {
    let (code, out, err) = fdi(&["inspect", "none.csv"]);
    assert_eq!((code, out.as_str()), (2, ""));
    assert_eq!(err, "error: none.csv: no such file or folder\n");
}

#[test]
fn colours_are_for_those_who_want_them() {
    let coloured = |arguments: &[&str]| fdi(arguments).2.contains('\u{1b}');
    assert!(!coloured(&["frobnicate"]));
    assert!(!coloured(&["--color", "never", "frobnicate"]));
}

#[test]
fn shells_and_manuals_know_the_commands() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let (code, out, err) = fdi(&["completions", shell]);
        assert_eq!((code, err.as_str()), (0, ""));
        assert!(out.contains("diagnose"), "{shell}");
    }
    let (code, out, err) = fdi(&["man"]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.contains(".TH fdi 1") && out.contains("diagnose"));
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let program = assert_cmd::cargo::cargo_bin!("fdi");
    let mut child = std::process::Command::new(program)
        .args(["schema", "diagnosis"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), output.stderr.as_slice()), (Some(0), &b""[..]));
}
