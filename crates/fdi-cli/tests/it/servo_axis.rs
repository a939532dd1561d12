//! A servo axis, described by a model file alone, in `fdi simulate`.

use std::{fmt::Write as _, fs, path::Path};

use tempfile::TempDir;

use crate::binary::fdi;

pub(crate) fn fixture(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures").join(name).display().to_string()
}

/// A folder with a command in m, over a second at 500 Hz.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..500).fold("time_s,command_m\n".to_owned(), |mut rows, n| {
        let time_s = f64::from(n) / 500.0;
        let command_m = 0.05 + 0.01 * (1.0 - (6.0 * time_s).cos());
        writeln!(rows, "{time_s:.3},{command_m:.9}").unwrap();
        rows
    });
    fs::write(folder.path().join("c.csv"), rows).unwrap();
    folder
}

/// Exit code, the first and the last lines of standard output, standard error.
fn shown(arguments: &[&str], folder: &TempDir) -> String {
    let (code, out, err) = fdi(arguments);
    let lines: Vec<_> = out.lines().collect();
    let kept = if lines.len() > 12 {
        let (head, tail) = (lines[..8].join("\n"), lines[lines.len() - 3..].join("\n"));
        format!("{head}\n… {} lines …\n{tail}\n", lines.len() - 11)
    } else {
        out
    };
    let text = format!("exit {code}\n--- stdout\n{kept}--- stderr\n{err}");
    let fixtures = fixture("models/");
    text.replace(&folder.path().display().to_string(), "[folder]").replace(&fixtures, "[models]/")
}

#[test]
fn a_linear_axis_follows_a_sine() {
    let model = fixture("models/emps.toml");
    insta::assert_snapshot!(shown(
        &["simulate", "--model", &model, "--command", "sine"],
        &folder()
    ));
}

#[test]
fn a_linear_axis_follows_a_recording_and_wears() {
    let (folder, model) = (folder(), fixture("models/emps.toml"));
    let command = folder.path().join("c.csv").display().to_string();
    let simulate = ["simulate", "--model", &model, "--command", &command];
    let healthy = shown(&simulate, &folder);
    insta::assert_snapshot!(healthy);
    let worn = shown(&[&simulate[..], &["--faults", "k1=0.1"]].concat(), &folder);
    assert_ne!(worn, healthy);
    // what is written can be read, and be the command of the next simulation
    let written = folder.path().join("r.csv").display().to_string();
    let (code, out, err) = fdi(&[&simulate[..], &["-o", &written]].concat());
    assert_eq!((code, out, err), (0, String::new(), String::new()));
    let (code, out, _) = fdi(&["inspect", &written]);
    assert!(code == 0 && out.contains("voltage_v") && out.contains("position_m"), "{out}");
    let again = ["simulate", "--model", &model, "--command", &written];
    // as written the command is rounded to a nanometre
    let head = |text: &str| text.split('…').next().unwrap().to_owned();
    assert_eq!(head(&shown(&again, &folder)), head(&healthy));
}

#[test]
fn a_rotary_axis_holds_a_recorded_speed() {
    let (folder, model) = (folder(), fixture("models/laas.toml"));
    let command = folder.path().join("w.csv").display().to_string();
    fs::write(&command, "time_s,speed_command_rad_per_s\n0.0,10\n0.1,20\n0.2,20\n").unwrap();
    insta::assert_snapshot!(shown(
        &["simulate", "--model", &model, "--command", &command],
        &folder
    ));
}

#[test]
fn a_file_may_stand_on_that_of_an_axis() {
    let folder = folder();
    let (base, model) = (fixture("models/emps.toml"), folder.path().join("m.toml"));
    let text = "[axis]\nmass-kg = 150.0\n\n[[effect]]\nid = \"E11\"\n\
                parameters = { cogging-sin-n = 1.0, wavenumber-rad-per-m = 300.0 }\n\
                valid-range = { speed = [-0.05, 0.05], position = [-0.2, 0.2] }\n";
    fs::write(&model, format!("base = \"{base}\"\n{text}")).unwrap();
    let model = model.display().to_string();
    let (code, heavier, err) = fdi(&["simulate", "--model", &model, "--command", "sine"]);
    let (_, lighter, _) = fdi(&["simulate", "--model", &base, "--command", "sine"]);
    assert!(code == 0 && heavier != lighter);
    assert!(
        err.starts_with(
            "notice: effect E11 (cogging) is known for a speed from -0.05 to 0.05 m/s, and the \
             simulation goes from -0.15"
        ),
        "{err}"
    );
}

#[test]
fn what_an_axis_does_not_have_is_refused() {
    let (folder, model) = (folder(), fixture("models/emps.toml"));
    let empty = folder.path().join("e.csv").display().to_string();
    fs::write(&empty, "time_s,command_rad\n0.0,1\n0.1,2\n").unwrap();
    let mut told = String::new();
    for options in [
        &[][..],
        &["--command", "sine", "--noise-a", "0.1"],
        &["--command", "sine", "--adc-bits", "12"],
        &["--command", "sine", "--rate-hz", "500"],
        &["--command", "sine", "--fidelity", "low"],
        &["--command", "sine", "--start-angle-rad", "1"],
        &["--command", "sine", "--load-n-m", "1"],
        &["--command", "sine", "--faults", "k3=0.1"],
        &["--command", "sine", "--faults", "k2=0.1"],
        &["--command", "none"],
        &["--command", &empty],
    ] {
        let all = [&["simulate", "--model", &model], options].concat();
        let (code, out, err) = fdi(&all);
        assert_eq!((code, out.as_str()), (2, ""), "{options:?}");
        told.push_str(&err);
    }
    let smooth = fixture("models/laas.toml");
    for options in [&["--faults", "k1=0.1"][..], &[]] {
        let (code, out, err) =
            fdi(&[&["simulate", "--model", &smooth, "--command", "sine"], options].concat());
        assert_eq!((code, out.as_str()), (2, ""), "{options:?}");
        told.push_str(&err);
    }
    let (code, _, err) = fdi(&["dataset", "--model", &model, "-o", "d"]);
    assert_eq!(code, 2);
    told.push_str(&err);
    let told = told.replace(&folder.path().display().to_string(), "[folder]");
    insta::assert_snapshot!(told.replace(&fixture("models/"), "[models]/"));
}
