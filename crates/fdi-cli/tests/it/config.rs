//! Settings: flag over environment over file over default.

use std::{fs, path::Path};

use assert_cmd::Command;

/// Exit code, standard output and standard error in a folder, with variables.
fn fdi(folder: &Path, variables: &[(&str, &str)], arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("fdi").unwrap();
    for (name, _) in std::env::vars() {
        if name.starts_with("FDI_") || name == "CLICOLOR_FORCE" || name == "NO_COLOR" {
            command.env_remove(name);
        }
    }
    command.envs(variables.iter().copied()).current_dir(folder);
    let output = command.args(arguments).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// Value and origin of a setting.
fn setting(folder: &Path, variables: &[(&str, &str)], flags: &[&str], name: &str) -> String {
    let arguments = [flags, &["inspect", "config"]].concat();
    let (code, out, err) = fdi(folder, variables, &arguments);
    assert_eq!((code, err.as_str()), (0, ""));
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let row = out.lines().map(words).find(|row| row.first().is_some_and(|first| first == name));
    row.unwrap()[1..].join(" ")
}

#[test]
fn flag_goes_before_environment_before_file_before_default() {
    let folder = tempfile::tempdir().unwrap();
    let seed = |variables: &[(&str, &str)], flags: &[&str]| {
        setting(folder.path(), variables, flags, "seed")
    };
    assert_eq!(seed(&[], &[]), "0 default");
    fs::write(folder.path().join("fdi.toml"), "seed = 5\n").unwrap();
    assert_eq!(seed(&[], &[]), "5 fdi.toml line 1");
    assert_eq!(seed(&[("FDI_SEED", "6")], &[]), "6 FDI_SEED");
    assert_eq!(seed(&[("FDI_SEED", "6")], &["--seed", "7"]), "7 flag");
    fs::write(folder.path().join("other.toml"), "\nseed = 8\n").unwrap();
    assert_eq!(seed(&[], &["--config", "other.toml"]), "8 other.toml line 2");
    assert_eq!(seed(&[("FDI_CONFIG", "other.toml")], &[]), "8 other.toml line 2");
}

#[test]
fn settings_of_commands_have_origins_too() {
    let folder = tempfile::tempdir().unwrap();
    let text = "[diagnose]\nmethod = \"ei\"\nmap = [\"time_s=t\", \"current_a=I\"]\n";
    fs::write(folder.path().join("fdi.toml"), text).unwrap();
    let of = |name: &str| setting(folder.path(), &[("FDI_SIMULATE_NOISE_A", "0.03")], &[], name);
    assert_eq!(of("diagnose.method"), "ei fdi.toml line 2");
    assert_eq!(of("diagnose.map"), "time_s=t, current_a=I fdi.toml line 3");
    assert_eq!(of("diagnose.encoding"), "full default");
    assert_eq!(of("simulate.noise-a"), "0.03 FDI_SIMULATE_NOISE_A");
}

#[test]
fn a_setting_of_the_file_is_acted_on() {
    let folder = tempfile::tempdir().unwrap();
    let rows = |variables: &[(&str, &str)], flags: &[&str]| {
        let arguments = [&["simulate"], flags].concat();
        let (code, out, err) = fdi(folder.path(), variables, &arguments);
        assert_eq!(code, 0, "{err}");
        out.lines().filter(|line| !line.starts_with('#')).count() - 1
    };
    // half a second
    assert_eq!(rows(&[], &[]), 5000);
    fs::write(folder.path().join("fdi.toml"), "[simulate]\nrate-hz = 5000\n").unwrap();
    assert_eq!(rows(&[], &[]), 2500);
    assert_eq!(rows(&[("FDI_SIMULATE_RATE_HZ", "2000")], &[]), 1000);
    assert_eq!(rows(&[("FDI_SIMULATE_RATE_HZ", "2000")], &["--rate-hz", "10000"]), 5000);
}

#[test]
fn a_wrong_file_is_refused_before_anything_runs() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("fdi.toml"), "[diagnose]\nnoise = 0.02\n").unwrap();
    let wrong = fdi(folder.path(), &[], &["diagnose", "none.csv"]);
    let message = "error: `fdi.toml` line 2: unknown key `noise`; did you mean `noise-a`?\n";
    assert_eq!(wrong, (2, String::new(), message.to_owned()));
    let (code, _, err) = fdi(folder.path(), &[], &["--config", "none.toml", "man"]);
    assert_eq!(code, 2);
    assert!(err.starts_with("error: `none.toml` cannot be read: "), "{err}");
    let (code, _, err) = fdi(
        folder.path(),
        &[("FDI_DIAGNOSE_METHOD", "gess")],
        &["--config", "/dev/null", "inspect", "config"],
    );
    assert_eq!(code, 2);
    assert!(err.starts_with("error: `FDI_DIAGNOSE_METHOD`: invalid value 'gess'"), "{err}");
}

#[test]
fn a_report_tells_the_settings_it_was_made_with() {
    let folder = tempfile::tempdir().unwrap();
    let recording = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../fixtures/recordings/r01.csv.gz")
        .display()
        .to_string();
    fs::write(folder.path().join("fdi.toml"), "[diagnose]\nnoise-a = 0.02\n").unwrap();
    let arguments = ["--seed", "3", "diagnose", "-q", "--report", "r.html", &recording];
    let (code, _, err) = fdi(folder.path(), &[], &arguments);
    assert_eq!(code, 0, "{err}");
    let html = fs::read_to_string(folder.path().join("r.html")).unwrap();
    let html = html.replace(" class=\"word\"", "");
    for row in [
        "<td>seed</td><td>3</td><td>flag</td>",
        "<td>diagnose.noise-a</td><td>0.02</td><td>fdi.toml line 2</td>",
    ] {
        assert!(html.contains(row), "{row}");
    }
    assert!(!html.contains("<td>default</td>"));
    // how many at the same time changes nothing
    let with = |jobs: &str| {
        let arguments = ["--jobs", jobs, "--stable", "diagnose", "-q", "--report", "r.html"];
        let (code, _, err) = fdi(folder.path(), &[], &[&arguments[..], &[&recording]].concat());
        assert_eq!(code, 0, "{err}");
        fs::read(folder.path().join("r.html")).unwrap()
    };
    assert!(with("1") == with("2"));
}

#[test]
fn variables_are_checked_and_blamed() {
    let folder = tempfile::tempdir().unwrap();
    let error = |variables: &[(&str, &str)], arguments: &[&str]| {
        let (code, out, err) = fdi(folder.path(), variables, arguments);
        assert_eq!((code, out.as_str()), (2, ""));
        err
    };
    assert_eq!(
        error(&[("FDI_DIAGNOSE_NOISE", "0.1")], &["schema", "recording"]),
        "error: `FDI_DIAGNOSE_NOISE` in the environment is no setting; did you mean \
         `FDI_DIAGNOSE_NOISE_A`?\n"
    );
    assert_eq!(
        error(&[("FDI_WEATHER", "fine")], &["schema", "recording"]),
        "error: `FDI_WEATHER` in the environment is no setting; `docs/config.md` lists them\n"
    );
    let seed = error(&[("FDI_SEED", "x")], &["schema", "recording"]);
    assert!(seed.starts_with("error: `FDI_SEED`: invalid value 'x'"), "{seed}");
    let noise = error(&[("FDI_DIAGNOSE_NOISE_A", "-1")], &["diagnose", "r.csv"]);
    assert!(noise.starts_with("error: `FDI_DIAGNOSE_NOISE_A`: invalid value '-1'"), "{noise}");
    let method = error(&[("FDI_DIAGNOSE_METHOD", "eis")], &["diagnose", "r.csv"]);
    assert!(method.starts_with("error: `FDI_DIAGNOSE_METHOD`: invalid value 'eis'"), "{method}");
    assert!(method.contains("[possible values: gls"), "{method}");
    let map = error(&[("FDI_DIAGNOSE_MAP", "current_a")], &["diagnose", "r.csv"]);
    assert!(map.starts_with("error: `FDI_DIAGNOSE_MAP`: invalid value 'current_a'"), "{map}");
    let map = error(&[("FDI_INSPECT_MAP", "weather=I")], &["inspect", "r.csv"]);
    assert!(map.starts_with("error: `FDI_INSPECT_MAP`: invalid value 'weather=I'"), "{map}");
    let empty = error(&[("FDI_CONFIG", "")], &["schema", "recording"]);
    assert_eq!(empty, "error: `FDI_CONFIG` is empty; expected a file\n");
    let none = error(&[("FDI_CONFIG", "none.toml")], &["schema", "recording"]);
    assert!(none.starts_with("error: `FDI_CONFIG`: `none.toml` cannot be read"), "{none}");
    // the flag is to blame where it is the flag's value
    let flag = error(&[("FDI_SEED", "x")], &["--seed", "x", "schema", "recording"]);
    assert!(flag.starts_with("error: invalid value 'x' for '--seed"), "{flag}");
    let (code, out, _) = fdi(folder.path(), &[("FDI_WEATHER", "fine")], &["--help"]);
    assert!(code == 0 && out.contains("Usage: fdi"), "help is there whatever is set");
}

#[test]
fn help_keeps_to_the_colour_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let help = |variables: &[(&str, &str)], arguments: &[&str]| {
        let (code, out, _) = fdi(folder.path(), variables, arguments);
        assert!(code == 0 && out.contains("Usage:"), "{out}");
        out.contains('\u{1b}')
    };
    let forced = [("CLICOLOR_FORCE", "1")];
    assert!(help(&[], &["--color", "always", "--help"]));
    assert!(help(&forced, &["--help"]));
    assert!(!help(&forced, &["--color", "never", "--help"]));
    assert!(!help(&forced, &["diagnose", "--help", "--color=never"]));
    assert!(!help(&[("CLICOLOR_FORCE", "1"), ("FDI_COLOR", "never")], &["help"]));
    fs::write(folder.path().join("fdi.toml"), "color = \"never\"\n").unwrap();
    assert!(!help(&forced, &["--help"]));
}

#[test]
fn settings_of_one_folder_are_not_used_for_another() {
    let root = tempfile::tempdir().unwrap();
    for name in ["P", "Q"] {
        fs::create_dir(root.path().join(name)).unwrap();
        fs::write(root.path().join(name).join("fdi.toml"), "seed = 5\n").unwrap();
        fs::write(root.path().join(name).join("r.csv"), "nothing\n").unwrap();
    }
    let told = |arguments: &[&str]| {
        let (code, _, err) = fdi(root.path(), &[], &[&["diagnose"], arguments].concat());
        assert_eq!(code, 2, "{err}");
        err
    };
    let of_first = told(&["P/r.csv", "Q/r.csv"]);
    assert!(of_first.contains("`Q/fdi.toml`") && of_first.contains("those of `P/fdi.toml`"));
    assert!(told(&["."]).contains("they would not be used"));
    // nor from within one
    let (code, _, err) = fdi(&root.path().join("P"), &[], &["diagnose", "r.csv", "../Q/r.csv"]);
    assert_eq!(code, 2);
    assert!(err.contains("`../Q/fdi.toml`") && err.contains("those of `fdi.toml`"), "{err}");
    // each by itself, or one that is named: the recording is what fails
    for arguments in [&["P"][..], &["--config", "P/fdi.toml", "."]] {
        assert!(told(arguments).contains("0 recordings diagnosed"), "{arguments:?}");
    }
}
