//! `fdi explain`: what it says of recordings in other units, with electronics, cut or lacking
//! something.

use std::{fs, path::Path, process::Command};

use fdi_core::report::{Explanation, ExplanationVerdict, Prediction};
use greybox_blind::Class;

use crate::sealed::{
    self,
    case::{Kind, Name},
    is_name,
};

/// A recording in milliseconds, degrees and milliamperes.
fn in_other_units(text: &str) -> String {
    let mut lines = Vec::new();
    let mut columns: Vec<(String, f64)> = Vec::new();
    for line in text.lines() {
        let cells = line.split(',');
        if line.starts_with('#') {
            lines.push(line.to_owned());
        } else if columns.is_empty() {
            columns = cells
                .map(|name| match name {
                    "time_s" => ("t_ms".to_owned(), 1e3),
                    "q_axis_current_a" => ("iq_ma".to_owned(), 1e3),
                    _ if name.ends_with("_rad") => {
                        (name.replace("_rad", "_deg"), 1f64.to_degrees())
                    }
                    _ => (name.to_owned(), 1.0),
                })
                .collect();
            let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
            lines.push(names.join(","));
        } else {
            let scaled = cells.zip(&columns).map(|(cell, (_, factor))| {
                let value: f64 = cell.parse().unwrap();
                (value * factor).to_string()
            });
            lines.push(scaled.collect::<Vec<_>>().join(","));
        }
    }
    lines.join("\n") + "\n"
}

#[test]
fn other_units_change_nothing() {
    let degree = format!("{}", 1f64.to_radians());
    let [motor, command] =
        ["motor_angle", "command"].map(|name| format!("{name}_rad={name}_deg*{degree}"));
    let map = [
        "--map",
        "time_s=t_ms*0.001",
        "--map",
        "q_axis_current_a=iq_ma*0.001",
        "--map",
        &motor,
        "--map",
        &command,
    ];
    // of the last, E03, another cause (E19) is 5.0 nats behind, where a tie ends: rounding may
    // bring it in
    for (class, number, exact) in
        [(Class::Null, 1, true), (Class::Single, 7, true), (Class::Single, 5, false)]
    {
        let folder = tempfile::tempdir().unwrap();
        Name { kind: Kind::Blind(class), number }.draw().write(folder.path());
        let plain = sealed::read(&sealed::explain(folder.path(), "nominal.toml", &[]));
        for number in 1..=4 {
            let path = folder.path().join(format!("rec{number:02}.csv"));
            let text = fs::read_to_string(&path).unwrap();
            let other = in_other_units(&text);
            assert_ne!(other, text);
            fs::write(path, other).unwrap();
        }
        let scaled = sealed::read(&sealed::explain(folder.path(), "nominal.toml", &map));
        if exact {
            assert_eq!(scaled.verdict, plain.verdict, "{class:?}");
        }
        assert_eq!(is_name(scaled.verdict), is_name(plain.verdict), "{class:?}");
        assert_eq!(scaled.effects.len(), plain.effects.len());
        for (a, b) in scaled.effects.iter().zip(&plain.effects) {
            assert_eq!(a.id, b.id);
        }
        let rms = |answer: &Explanation| answer.holdout.as_ref().map(|h| h.rms_after);
        let (a, b) = (rms(&scaled).unwrap(), rms(&plain).unwrap());
        assert!((a / b - 1.0).abs() < 1e-3, "{a} {b}");
        assert_eq!(class.hides(), !plain.effects.is_empty(), "{:?}", plain.verdict);
    }
}

fn explain_in(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("fdi"));
    command.current_dir(folder).arg("explain").args(arguments);
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn what_recordings_lack_is_said_and_what_is_wrong_with_them_too() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: String| fs::write(folder.path().join(name), text).unwrap();
    let rows = |columns: &str, row: fn(usize) -> String| {
        let lines: Vec<String> = (0..1000).map(row).collect();
        format!("{columns}\n{}\n", lines.join("\n"))
    };
    write(
        "no-command.csv",
        rows("time_s,motor_angle_rad,current_a", |n| format!("{},0,0.1", n as f64 * 5e-4)),
    );
    write(
        "no-angle.csv",
        rows("time_s,command_rad,current_a", |n| format!("{},0,{}", n as f64 * 5e-4, n % 7)),
    );
    write(
        "one.csv",
        rows("time_s,command_rad,motor_angle_rad,current_a", |n| {
            format!("{},0,0,{}", n as f64 * 5e-4, n % 7)
        }),
    );
    let sentence = |arguments: &[&str]| {
        let (code, out, err) = explain_in(folder.path(), &[&["-q"], arguments].concat());
        assert_eq!((code, err.as_str()), (Some(0), ""));
        out.lines().next().unwrap_or_default().to_owned()
    };
    assert_eq!(
        sentence(&["--train", "no-command.csv"]),
        "No conclusion: no-command.csv: no command (`command_rad`, `command_m` or a speed \
         command): what the controller was asked for is not known (`--command` names it; of a \
         servo axis `--inverse-dynamics` does without it)."
    );
    assert_eq!(
        sentence(&["--train", "one.csv"]),
        "No conclusion: one recording alone cannot be fitted and judged on: give a second one, of \
         another command, with `--holdout`."
    );
    assert_eq!(
        sentence(&["--train", "no-angle.csv", "--holdout", "one.csv"]),
        "No conclusion: no-angle.csv: no position of the motor: causes cannot be told apart by \
         the current alone."
    );
    let turned = fs::read_to_string(folder.path().join("one.csv")).unwrap();
    write("turned.csv", format!("# start-angle-rad = 1.5\n{turned}"));
    let (code, _, err) = explain_in(folder.path(), &["--train", "turned.csv"]);
    assert_eq!(code, Some(2));
    let told = "turned.csv: `start-angle-rad` is 1.5, but `motor_angle_rad` begins at 0";
    assert!(err.contains(told), "{err}");
    // of an axis it says nothing
    let axis = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/models/laas.toml");
    let said = sentence(&["--model", axis, "--train", "turned.csv"]);
    assert!(said.starts_with("No conclusion: one recording alone"), "{said}");
    let (code, _, err) = explain_in(folder.path(), &["--train", "none.csv"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("none.csv"), "{err}");
    let (code, _, err) =
        explain_in(folder.path(), &["--train", "one.csv", "--output-format", "csv"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("no table of this"), "{err}");
}

/// The last line of `fdi diagnose`, run as it stands by a shell.
#[test]
fn the_hint_of_a_diagnosis_leads_to_an_explanation() {
    let folder = tempfile::tempdir().unwrap();
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/models");
    let nominal = fs::read_to_string(models.join("ema-48.toml")).unwrap();
    let hidden = "[[effect]]\nid = \"E11\"\nparameters = { cogging-sin-n-m = 0.02 }\n";
    fs::write(folder.path().join("true.toml"), format!("{nominal}\n{hidden}")).unwrap();
    let program = assert_cmd::cargo::cargo_bin!("fdi");
    let shell = |line: &str| {
        let line = format!("fdi() {{ '{}' \"$@\"; }}\n{line}", program.display());
        let mut command = Command::new("sh");
        let output = command.current_dir(folder.path()).args(["-c", &line]).output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    for seed in ["1", "2"] {
        let options = "--model true.toml --noise-a 0.02 --adc-bits 12";
        let (code, _, err) = shell(&format!("fdi simulate {options} --seed {seed} -o {seed}.csv"));
        assert_eq!(code, Some(0), "{err}");
        // a logger does not know what the controller was asked for
        let file = folder.path().join(format!("{seed}.csv"));
        let text = fs::read_to_string(&file).unwrap();
        fs::write(&file, text.replacen("# command = \"chirp\"\n", "", 1)).unwrap();
    }
    let (code, _, err) = shell("fdi diagnose --tolerance none 1.csv 2.csv");
    assert_eq!(code, Some(0), "{err}");
    let hint = err.lines().last().unwrap_or_default();
    let line = hint.split('`').nth(1).unwrap_or_default();
    assert_eq!(line, "fdi explain --model ema-48 --command chirp --train 1.csv 2.csv");
    let (code, out, err) = shell(line);
    assert_eq!(code, Some(0), "{err}");
    assert!(out.starts_with("The model misses cogging (E11)"), "{out}");
    // one alone needs a second, and the hint says so
    let (_, _, err) = shell("fdi diagnose --tolerance none 1.csv");
    let line = err.lines().last().unwrap_or_default();
    assert!(line.contains("--holdout SECOND.csv`, where `SECOND.csv` is a second"), "{line}");
    let line = line.split('`').nth(1).unwrap_or_default().replace("SECOND", "2");
    let (code, out, err) = shell(&line);
    assert_eq!(code, Some(0), "{err}");
    assert!(out.starts_with("The model misses cogging (E11)"), "{out}");
    // no conclusion is not that the model is right
    let open = "fdi explain --exit-code --train 1.csv --holdout 2.csv";
    assert_eq!(shell(open).0, Some(3));
    let (code, _, err) = shell("fdi explain --command 1.csv --train 1.csv --holdout 2.csv");
    assert!(code == Some(2) && err.contains("1.csv: no command (`command_rad`"), "{err}");
}

/// Recordings of EMA-48 in high fidelity, whose inverter, noise and steps the low-fidelity model
/// does not have: what they leave is no effect, and an effect is found beside them.
#[test]
fn electronics_are_no_cause_and_hide_none() {
    use std::f64::consts::TAU;

    let folder = tempfile::tempdir().unwrap();
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/models");
    let nominal = fs::read_to_string(models.join("ema-48.toml")).unwrap();
    fs::write(folder.path().join("nominal.toml"), &nominal).unwrap();
    let hidden = "[[effect]]\nid = \"E11\"\nparameters = { cogging-sin-n-m = 0.005, order = 12 }\n";
    fs::write(folder.path().join("true.toml"), format!("{nominal}\n{hidden}")).unwrap();
    let sines = |t: f64| 4e-3 * (TAU * 0.7 * t).sin() + 2e-3 * (TAU * 2.3 * t).sin();
    let stairs = |t: f64| 3e-3 * (3.0 - ((t / 0.4).floor() - 3.0).abs()).max(0.0);
    let triangle = |t: f64| 6e-3 * (TAU * 0.5 * t).sin().asin();
    let commands: [(&str, &dyn Fn(f64) -> f64); 3] =
        [("sines", &sines), ("stairs", &stairs), ("triangle", &triangle)];
    for (name, at) in commands {
        let row = |n: usize| format!("{},{}", n as f64 * 1e-3, at(n as f64 * 1e-3));
        let rows: Vec<String> = (0..2500).map(row).collect();
        let text = format!("time_s,command_rad\n{}\n", rows.join("\n"));
        fs::write(folder.path().join(format!("{name}.csv")), text).unwrap();
    }
    let run = |arguments: &[&str]| {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("fdi"));
        let output = command.current_dir(folder.path()).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    };
    let explained = |model: &str| -> Explanation {
        for (seed, (name, _)) in ["1", "2", "3"].into_iter().zip(commands) {
            let (command, file) = (format!("{name}.csv"), format!("recorded-{name}.csv"));
            let sensors = ["--noise-a", "0.02", "--adc-bits", "12", "--seed", seed];
            let of = ["simulate", "--model", model, "--command", &command, "-o", &file];
            run(&[&of[..], &sensors].concat());
        }
        let recordings = ["--train", "recorded-sines.csv", "recorded-stairs.csv"];
        let held_out = ["--holdout", "recorded-triangle.csv", "--output-format", "json"];
        let asked = [&["explain", "--model", "nominal.toml"][..], &recordings, &held_out];
        serde_json::from_slice(&run(&asked.concat())).unwrap()
    };
    let healthy = explained("nominal.toml");
    assert_eq!(healthy.verdict, ExplanationVerdict::Adequate, "{healthy:?}");
    assert_eq!(healthy.prediction, Some(Prediction::High));
    let found = explained("true.toml");
    let symbols: Vec<&str> = found.effects.iter().map(|effect| effect.id.as_str()).collect();
    assert_eq!(symbols, ["E11"], "{}", found.sentence);
}

/// Noise of the loop that is alike throughout, as on the bench: the mean of a few runs has some of
/// it, which must not count against the model that made the recordings.
#[test]
fn the_model_that_made_a_recording_predicts_it() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("fdi"));
        let output = command.current_dir(folder.path()).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    };
    // from 0.7 to 5 Hz, and from 0.9 to 6 Hz
    for (name, from_hz, growth) in [("train", 0.7, 4.3), ("holdout", 0.9, 5.1)] {
        let at = |t: f64| {
            let (hz, turns) = (from_hz + growth * t, from_hz * t + 0.5 * growth * t * t);
            (t / 0.2).min(1.0).powi(2) * 0.02 / (1.0 + hz) * (std::f64::consts::TAU * turns).sin()
        };
        let row = |n: usize| format!("{},{}", n as f64 * 5e-4, at(n as f64 * 5e-4));
        let rows: Vec<String> = (0..2001).map(row).collect();
        let text = format!("time_s,command_rad\n{}\n", rows.join("\n"));
        fs::write(folder.path().join(format!("{name}.csv")), text).unwrap();
    }
    let explained = |electronics: &[&str]| -> Explanation {
        for (seed, name) in [("1", "train"), ("2", "holdout")] {
            let (command, file) = (format!("{name}.csv"), format!("recorded-{name}.csv"));
            let of = ["simulate", "--model", "bench", "--command", &command, "-o", &file];
            let sensors = ["--noise-a", "0.02", "--adc-bits", "12", "--seed", seed];
            run(&[&of[..], &sensors, electronics].concat());
        }
        let recordings = ["--train", "recorded-train.csv", "--holdout", "recorded-holdout.csv"];
        let asked = ["explain", "--model", "bench", "--output-format", "json"];
        serde_json::from_slice(&run(&[&asked[..], &recordings].concat())).unwrap()
    };
    for (electronics, is_high) in [
        (&[][..], true),
        (&["--fidelity", "low"], false),
        (&["--fidelity", "low", "--ideal-electronics"], false),
    ] {
        let healthy = explained(electronics);
        assert_eq!(healthy.prediction == Some(Prediction::High), is_high, "{electronics:?}");
        assert_eq!(healthy.verdict, ExplanationVerdict::Adequate, "{healthy:?}");
    }
}

/// The text of a recording whose currents were cut at a level.
fn cut_at(level_a: f64, text: &str) -> String {
    let cut = |line: &str| -> String {
        let of = |(column, cell): (usize, &str)| match cell.parse::<f64>() {
            Ok(ampere) if (1..=3).contains(&column) => ampere.clamp(-level_a, level_a).to_string(),
            _ => cell.to_owned(),
        };
        line.split(',').enumerate().map(of).collect::<Vec<_>>().join(",")
    };
    text.lines()
        .map(|line| if line.starts_with('#') { line.to_owned() } else { cut(line) } + "\n")
        .collect()
}

/// Recordings of the embedded chirp are compared with the low-fidelity model and its learnt error:
/// a machine that is its model file has nothing, and of one with cogging that is named.
#[test]
fn recordings_of_a_bundles_test_are_predicted_with_its_learnt_error() {
    let folder = tempfile::tempdir().unwrap();
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/models");
    let nominal = fs::read_to_string(models.join("ema-48.toml")).unwrap();
    let hidden = "[[effect]]\nid = \"E11\"\nparameters = { cogging-sin-n-m = 0.0008 }\n";
    fs::write(folder.path().join("true.toml"), format!("{nominal}\n{hidden}")).unwrap();
    let run = |arguments: &[&str]| {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("fdi"));
        let output = command.current_dir(folder.path()).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    };
    for (model, name) in [("ema-48", "new"), ("true.toml", "cogged")] {
        for seed in ["1", "2", "3", "4"] {
            let file = format!("{name}-{seed}.csv");
            let of = ["simulate", "--model", model, "--seed", seed, "-o", &file];
            run(&[&of[..], &["--noise-a", "0.02", "--adc-bits", "12"]].concat());
        }
    }
    let explain = |name: &str, options: &[&str]| -> (Explanation, Vec<u8>) {
        let [a, b, c, d] = ["1", "2", "3", "4"].map(|seed| format!("{name}-{seed}.csv"));
        let records = ["explain", "--train", &a, &b, "--holdout", &c, "--repeat", &d];
        let form = ["--output-format", "json", "--stable"];
        let bytes = run(&[&records[..], &form, options].concat());
        (serde_json::from_slice(&bytes).unwrap(), bytes)
    };
    let (healthy, _) = explain("new", &[]);
    assert_eq!(healthy.verdict, ExplanationVerdict::Adequate, "{healthy:?}");
    assert_eq!(healthy.prediction, Some(Prediction::Learnt));
    // from other starts of the rotor the model errs in another way
    for (seed, start_rad) in [("1", "5.239"), ("2", "0.337"), ("3", "3.166"), ("4", "2.0")] {
        let file = format!("turned-{seed}.csv");
        let of = ["simulate", "--seed", seed, "--start-angle-rad", start_rad, "-o", &file];
        run(&[&of[..], &["--noise-a", "0.02", "--adc-bits", "12"]].concat());
    }
    let (turned, _) = explain("turned", &[]);
    assert_eq!(turned.verdict, ExplanationVerdict::Adequate, "{}", turned.sentence);
    let twice = ["--train", "new-1.csv", "new-1.csv", "--holdout", "new-2.csv"];
    let (code, _, err) = explain_in(folder.path(), &twice);
    assert!(code == Some(2) && err.contains("are one recording"), "{err}");
    // nothing is concluded from a log that was cut at four fifths of its peak
    let cut = cut_at(3.9, &fs::read_to_string(folder.path().join("new-2.csv")).unwrap());
    fs::write(folder.path().join("cut.csv"), cut).unwrap();
    let cut = ["--train", "new-1.csv", "cut.csv", "--holdout", "new-3.csv", "--exit-code"];
    let (code, told, err) = explain_in(folder.path(), &cut);
    assert!(code == Some(3) && told.contains("cut.csv: the signal is clipped"), "{told} {err}");
    let (found, one) = explain("cogged", &["--jobs", "1"]);
    let [cogging] = &found.effects[..] else { panic!("{}", found.sentence) };
    assert_eq!((cogging.id.as_str(), found.verdict), ("E11", ExplanationVerdict::Named));
    let [from, to] = cogging.parameters["cogging_sin_n_m"].interval_95.unwrap();
    assert!(from <= 0.0008 && 0.0008 <= to && to - from < 0.0005, "{cogging:?}");
    let roles: Vec<&str> = found.records.iter().map(|record| record.role.as_str()).collect();
    assert_eq!(roles, ["train", "train", "repeat", "holdout"]);
    // the same bytes on any number of threads
    assert_eq!(explain("cogged", &["--jobs", "2"]).1, one);
    // where it may not be, something is there that nothing else explains as well
    let (other, _) = explain("cogged", &["--without", "E11"]);
    assert!(other.effects.iter().all(|effect| effect.id != "E11"));
    assert_ne!(other.verdict, ExplanationVerdict::Adequate, "{}", other.sentence);
    // another model on request, and this one only where a bundle knows it
    let (ideal, _) = explain("cogged", &["--fidelity", "ideal"]);
    assert_eq!(ideal.prediction, Some(Prediction::Ideal));
    let bench = ["--model", "bench", "--train", "new-1.csv", "new-2.csv", "--fidelity", "learnt"];
    let (code, _, err) = explain_in(folder.path(), &bench);
    assert!(
        code == Some(2) && err.contains("`--fidelity learnt`: no bundle of this model"),
        "{err}"
    );
}
