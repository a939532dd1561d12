//! From a model file and a recorded command to a diagnosis: an actuator that nothing here was
//! made for.

use std::{fs, path::Path};

use assert_cmd::Command;
use fdi_core::report::{Diagnosis, FaultId, NoticeCode, RecordDiagnosis, Verdict};
use tempfile::TempDir;

/// Exit code and standard error of `fdi` in a folder; standard output must be empty.
fn fdi_in(folder: &TempDir, arguments: &[&str]) -> (i32, String) {
    let mut command = Command::cargo_bin("fdi").unwrap();
    for variable in ["FDI_SEED", "FDI_JOBS", "FDI_OUTPUT_FORMAT", "CLICOLOR_FORCE", "NO_COLOR"] {
        command.env_remove(variable);
    }
    let output = command.current_dir(folder).args(arguments).output().unwrap();
    assert!(output.stdout.is_empty(), "{arguments:?}");
    (output.status.code().unwrap(), String::from_utf8(output.stderr).unwrap())
}

/// What must work.
fn done(folder: &TempDir, arguments: &[&str]) -> String {
    let (code, err) = fdi_in(folder, arguments);
    assert_eq!(code, 0, "{arguments:?}: {err}");
    err
}

/// The error, in one line, of what must not.
fn refused(folder: &TempDir, arguments: &[&str]) -> String {
    let (code, err) = fdi_in(folder, arguments);
    assert_eq!(code, 2, "{arguments:?}: {err}");
    assert_eq!(err.lines().count(), 1, "{err}");
    err
}

/// A folder with the second actuator and its command under short names.
fn bench() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    for (from, to) in [("models/ema-270.toml", "m.toml"), ("commands/flap.csv", "c.csv")] {
        fs::copy(fixtures.join(from), folder.path().join(to)).unwrap();
    }
    folder
}

fn write(folder: &TempDir, name: &str, text: &str) {
    fs::write(folder.path().join(name), text).unwrap();
}

/// The second actuator in its test.
const BENCH: [&str; 4] = ["--model", "m.toml", "--command", "c.csv"];

/// A bundle from a dataset of the bench, learnt with further options.
fn learn(folder: &TempDir, options: &[&str]) {
    let dataset = [&["dataset"], &BENCH[..], options, &["-o", "d"]].concat();
    done(folder, &dataset);
    done(folder, &["bundle", "build", "--dataset", "d", "-o", "b"]);
}

/// A recording of the bench: noise of 30 mA, 12 bit over the range of the drive.
fn record(folder: &TempDir, name: &str, options: &[&str]) {
    let noise = ["--noise-a", "0.03", "--adc-bits", "12", "-o", name];
    done(folder, &[&["simulate"], &BENCH[..], options, &noise].concat());
}

fn diagnose(folder: &TempDir, name: &str) -> RecordDiagnosis {
    let told = ["--stable", "--output-format", "json", "-o", "answer.json"];
    done(
        folder,
        &[&["diagnose", "--tolerance", "none", "--bundle", "b"], &told[..], &[name]].concat(),
    );
    let text = fs::read_to_string(folder.path().join("answer.json")).unwrap();
    let mut diagnosis: Diagnosis = serde_json::from_str(&text).unwrap();
    diagnosis.records.remove(0)
}

/// Standard deviations that an estimate may be off: by chance once in 1.7e6 for each of six levels,
/// and the recordings are seeded.
const DEVIATIONS: f64 = 5.0;

/// The levels k1 to k6 are found.
fn assert_found(answer: &RecordDiagnosis, levels: [f64; 6]) {
    let mut covered = 0;
    for (fault, level) in answer.faults.iter().zip(levels) {
        let (value, std) = (fault.value.unwrap(), fault.std.unwrap());
        assert!((value - level).abs() < DEVIATIONS * std, "{}: {value} ± {std}", fault.id);
        assert_eq!(fault.detected, Some(level > 0.0), "{}: {value} ± {std}", fault.id);
        let [low, high] = fault.interval_95.unwrap();
        covered += u8::from((low..=high).contains(&level));
    }
    // a level outside its interval of 95 % is no failure, three of six come by chance once in 500
    assert!(covered >= 4, "{:?}", answer.faults);
    let faulty = levels.iter().any(|level| *level > 0.0);
    assert_eq!(answer.verdict, if faulty { Verdict::Faulty } else { Verdict::Healthy });
}

#[test]
fn three_commands_lead_from_a_data_sheet_to_a_diagnosis() {
    let folder = bench();
    learn(&folder, &[]);
    record(&folder, "healthy.csv", &["--seed", "1"]);
    assert_found(&diagnose(&folder, "healthy.csv"), [0.0; 6]);
    record(&folder, "worn.csv", &["--seed", "2", "--faults", "k1=0.02,k4=0.03"]);
    assert_found(&diagnose(&folder, "worn.csv"), [0.02, 0.0, 0.0, 0.03, 0.0, 0.0]);
    record(&folder, "bent.csv", &["--seed", "3", "--faults", "k2=0.03,k3=0.03,k6=0.03,k7=0.3"]);
    let bent = diagnose(&folder, "bent.csv");
    assert_found(&bent, [0.0, 0.03, 0.03, 0.0, 0.0, 0.03]);
    let direction = &bent.faults[FaultId::K7 as usize];
    let (value, std) = (direction.value.unwrap(), direction.std.unwrap());
    assert!((value - 0.3).abs() < DEVIATIONS * std, "k7: {value} ± {std}");
}

#[cfg(unix)]
#[test]
fn what_the_guide_prints_is_what_its_commands_print() {
    let folder = tempfile::tempdir().unwrap();
    let guide = include_str!("../../../../docs/guide/your-actuator.md");
    crate::guides::check(guide, folder.path());
}

#[test]
fn a_bundle_for_a_start_angle_is_for_recordings_that_start_there() {
    let folder = bench();
    learn(&folder, &["--conditions", "40", "--start-angle-rad", "0.5"]);
    let faults = ["--faults", "k1=0.02,k4=0.03"];
    let outside = |answer: &RecordDiagnosis| {
        answer.notices.iter().any(|notice| notice.code == NoticeCode::StartAngleNotLearnt)
    };
    record(&folder, "there.csv", &[&faults[..], &["--start-angle-rad", "0.5"]].concat());
    let there = diagnose(&folder, "there.csv");
    assert!(!outside(&there), "{:?}", there.notices);
    assert_found(&there, [0.02, 0.0, 0.0, 0.03, 0.0, 0.0]);
    record(&folder, "elsewhere.csv", &faults);
    let elsewhere = diagnose(&folder, "elsewhere.csv");
    assert!(outside(&elsewhere));
    assert_eq!(elsewhere.verdict, Verdict::ModelInadequate);
}

#[test]
fn the_number_of_threads_does_not_matter_and_the_seed_does() {
    let folder = bench();
    let made = |more: &[&str]| {
        let few = ["--conditions", "3", "-o", "d"];
        done(&folder, &[&["dataset"], &BENCH[..], &few, more].concat());
        fs::read(folder.path().join("d")).unwrap()
    };
    assert_eq!(made(&["--jobs", "1"]), made(&["--jobs", "3"]));
    assert_ne!(made(&["--seed", "1"]), made(&["--seed", "2"]));
}

#[test]
fn only_faults_that_the_model_lists_are_looked_for() {
    let folder = bench();
    write(&folder, "few.toml", "base = \"m.toml\"\nfaults = [\"k1\", \"k2\"]\n");
    let of = ["--model", "few.toml", "--command", "c.csv"];
    let err = done(&folder, &[&["dataset"], &of[..], &["--conditions", "10", "-o", "d"]].concat());
    assert_eq!(
        err,
        "few, recorded of 0.6 s under 2 N·m, start angle 0 rad: 10 conditions each of \
         incipient, sparse, for k1, k2\n"
    );
    let simulate = [&["simulate"], &of[..], &["--faults", "k3=0.1", "-o", "r.csv"]].concat();
    assert_eq!(
        refused(&folder, &simulate),
        "error: `--faults k3=…`: `faults` of few.toml does not list k3\n"
    );
}

#[test]
fn a_wrong_model_file_is_named_with_line_and_key() {
    let folder = bench();
    let cases = [
        (
            "base = \"m.toml\"\n[motor]\nresistence-ohm = 1.0\n",
            "line 3: unknown key `motor.resistence-ohm`, did you mean `motor.resistance-ohm`",
        ),
        (
            "base = \"m.toml\"\n[motor]\nresistance-ohm = \"1\"\n",
            "line 3: `motor.resistance-ohm` is string, expected a number",
        ),
        (
            "base = \"m.toml\"\n[motor]\nresistance-ohm = -1.0\n",
            "`motor.resistance-ohm` is -1, expected a number above 0",
        ),
        ("[motor]\nresistance-ohm = 1.0\n", "is missing; give it, or a `base`"),
        (
            "base = \"m.toml\"\nfaults = []\n",
            "`faults` of the model lists none that the test `recorded` shows",
        ),
        ("base = \"m.toml\"\nfaults = [\"k6\"]\n", "`faults` of the model lists k6 without k7"),
        (
            "base = \"m.toml\"\n[inverter]\ncarrier-hz = 17e3\n",
            "`inverter.carrier-hz` is 17000, expected a whole multiple",
        ),
        ("base = \"w.toml\"\n", "`base` leads through more than 8 files"),
    ];
    for (text, expected) in cases {
        write(&folder, "w.toml", text);
        let of = ["--model", "w.toml", "--command", "c.csv", "-o", "d"];
        for command in ["dataset", "simulate"] {
            let error = refused(&folder, &[&[command], &of[..]].concat());
            assert!(error.starts_with("error: w.toml: ") && error.contains(expected), "{error}");
        }
    }
    let error = refused(&folder, &["dataset", "--model", "none.toml", "-o", "d"]);
    assert!(error.starts_with("error: none.toml: neither a preset (`ema-48`, `bench`)"), "{error}");
}

#[test]
fn a_wrong_command_file_is_named() {
    let folder = bench();
    let long = |values: fn(f64) -> String| {
        let rows =
            (0..100).map(|n| format!("{:.2},{}\n", f64::from(n) * 0.01, values(f64::from(n))));
        rows.collect::<String>()
    };
    let column = |values| format!("time_s,command_rad\n{}", long(values));
    let loaded = |values| format!("time_s,command_rad,load_n_m\n{}", long(values));
    let cases = [
        (column(|n| format!("{}", 0.01 * n)), "the command reaches 0.6"),
        (column(|n| format!("{}", 0.01 * n)), "beyond the stops at 0.6 rad"),
        (loaded(|n| format!("0,{n}")), "`load_n_m` runs from 0 to 99 N·m, expected one value"),
        ("time_s,load_n_m\n0,1\n0.1,1\n".to_owned(), "no column `command_rad`"),
        (
            "time_s,command_rad\n0,0\n0.1,0\n0.5,0\n".to_owned(),
            "`command_rad` is sampled irregularly",
        ),
        (
            "time_s,command_rad\n0,0\n0.001,0\n".to_owned(),
            "the command lasts 0.002 s, expected at least 0.015 s",
        ),
        ("command_rad\n0\n".to_owned(), "no column `time_s`"),
    ];
    for (text, expected) in cases {
        write(&folder, "w.csv", &text);
        for command in ["dataset", "simulate"] {
            let of = [command, "--model", "m.toml", "--command", "w.csv", "-o", "d.csv"];
            let error = refused(&folder, &of);
            assert!(error.starts_with("error: w.csv: ") && error.contains(expected), "{error}");
        }
    }
    let error = refused(&folder, &["dataset", "--command", "chrip", "-o", "d"]);
    assert_eq!(
        error,
        "error: chrip: neither a command (`chirp`, `sine`, `planned`) nor a recording\n"
    );
}

#[test]
fn datasets_that_do_not_go_together_are_named() {
    let folder = bench();
    write(&folder, "other.toml", "base = \"m.toml\"\n[motor]\nresistance-ohm = 0.7\n");
    write(&folder, "same.toml", "base = \"m.toml\"\n");
    let make = |name: &str, options: &[&str]| {
        done(&folder, &[&["dataset", "--conditions", "8", "-o", name], options].concat());
    };
    let of_bench = |name: &str, more: &[&str]| make(name, &[&BENCH[..], more].concat());
    of_bench("d", &[]);
    make("model", &["--model", "other.toml", "--command", "c.csv"]);
    make("name", &["--model", "same.toml", "--command", "c.csv"]);
    make("command", &["--model", "m.toml"]);
    of_bench("load", &["--load-n-m", "3"]);
    of_bench("angle", &["--seed", "1", "--start-angle-rad", "0.5"]);
    of_bench("sparse", &["--design", "sparse"]);
    of_bench("turned", &["--design", "turned"]);
    let cases: [(&[&str], &str); 9] = [
        (
            &["d", "model"],
            "model: `motor.resistance-ohm` of the model `other` is 0.7, expected 0.6 as in d",
        ),
        (&["d", "name"], "name: the model is same, expected ema-270 as in d"),
        (&["d", "command"], "command: the command is chirp, expected recorded as in d"),
        (&["d", "load"], "load: the load in N·m is 3, expected 2 as in d"),
        (
            &["d", "angle"],
            "the dataset of the design `incipient` starts at 0.5 rad, expected 0 rad as the others do",
        ),
        (&["d", "d"], "the dataset of the design `incipient`, seed 0, is given twice"),
        (
            &["sparse"],
            "no dataset of the design `incipient`: offset and discrepancy are learnt on it",
        ),
        (
            &["d", "turned"],
            "8 conditions of the designs `turned` and `turned-sparse`, expected at least 16 for 7 faults",
        ),
        (&["m.toml"], "m.toml: not an artefact of this tool: expected a dataset"),
    ];
    for (files, expected) in cases {
        let error =
            refused(&folder, &[&["bundle", "build", "-o", "b", "--dataset"], files].concat());
        assert_eq!(error, format!("error: {expected}\n"));
    }
}

#[test]
fn what_cannot_be_made_is_refused_before_it_is_run() {
    let folder = bench();
    let cases: [(&[&str], &str); 4] = [
        (&["--design", "sparse,sparse", "-o", "d"], "`--design`: `sparse` is given twice"),
        (
            &["--design", "turned", "--start-angle-rad", "1", "-o", "d"],
            "`--start-angle-rad`: the designs asked for start anywhere",
        ),
        (&["--conditions", "1000000", "-o", "d"], "`--conditions 1000000`: 2000000 signals of"),
        (&[], "`--output FILE` says where the dataset goes"),
    ];
    for (options, expected) in cases {
        let error = refused(&folder, &[&["dataset"], options].concat());
        assert!(error.starts_with(&format!("error: {expected}")), "{error}");
    }
}

#[test]
fn a_recording_of_another_command_is_refused() {
    let folder = bench();
    learn(&folder, &["--conditions", "8"]);
    let text = fs::read_to_string(folder.path().join("c.csv")).unwrap();
    let doubled: String = text
        .lines()
        .map(|line| match line.split(',').collect::<Vec<_>>()[..] {
            [time, command, load] if command != "command_rad" => {
                format!("{time},{},{load}\n", 2.0 * command.parse::<f64>().unwrap())
            }
            _ => format!("{line}\n"),
        })
        .collect();
    write(&folder, "twice.csv", &doubled);
    done(&folder, &["simulate", "--model", "m.toml", "--command", "twice.csv", "-o", "r.csv"]);
    let error = refused(&folder, &["diagnose", "-q", "--bundle", "b", "-o", "a", "r.csv"]);
    assert!(error.contains("the bundle's command `recorded`"), "{error}");
    done(&folder, &["simulate", "--model", "m.toml", "--command", "sine", "-o", "r.csv"]);
    let error = refused(&folder, &["diagnose", "-q", "--bundle", "b", "-o", "a", "r.csv"]);
    assert!(error.contains("of the command `sine`, the bundle is for `recorded`"), "{error}");
}

#[test]
fn effects_of_a_model_are_simulated_and_kept() {
    let folder = bench();
    let with = |symbol: &str, numbers: &str| {
        let block = format!("[[effect]]\nid = \"{symbol}\"\nparameters = {{ {numbers} }}\n");
        write(&folder, "e.toml", &format!("base = \"m.toml\"\n\n{block}"));
    };
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let simulated = |model: &str, fidelity: &str| {
        let of = ["--model", model, "--command", "c.csv", "--fidelity", fidelity, "-o", "r.csv"];
        done(&folder, &[&["simulate"], &of[..]].concat());
        // the comments name the model
        read("r.csv").lines().filter(|line| !line.starts_with('#')).collect::<String>()
    };
    with("E11", "cogging-sin-n-m = 0.02, order = 42.0");
    for fidelity in ["high", "low"] {
        assert_ne!(simulated("e.toml", fidelity), simulated("m.toml", fidelity));
    }
    with("E11", "cogging-sin-n-m = 0.0, order = 42.0");
    for fidelity in ["high", "low"] {
        assert_eq!(simulated("e.toml", fidelity), simulated("m.toml", fidelity));
    }
    with("E13", "saturation-per-a2 = 0.001");
    assert_ne!(simulated("e.toml", "high"), simulated("m.toml", "high"));
    with("E24", "commutation-dip-ratio = 0.1");
    assert_ne!(simulated("e.toml", "low"), simulated("m.toml", "low"));
    let of = ["--model", "e.toml", "--command", "c.csv", "-o", "d"];
    for command in ["dataset", "simulate"] {
        let error = refused(&folder, &[&[command], &of[..]].concat());
        assert!(
            error.contains("effect E24 (commutation overlap) does not act in the high"),
            "{error}"
        );
    }
    with("E11", "cogging-sin-n-m = 0.02, order = 42.0");
    let few = ["--conditions", "20"];
    done(&folder, &[&["dataset"], &of[..], &few].concat());
    done(&folder, &["bundle", "build", "--dataset", "d", "-o", "b"]);
    let bundle = fdi_core::Bundle::from_bytes(&fs::read(folder.path().join("b")).unwrap()).unwrap();
    let [cogging] = &bundle.experiment.effects[..] else { panic!() };
    assert_eq!(cogging.get("cogging_sin_n_m"), Some(0.02));
}

#[test]
fn a_simulation_beyond_what_an_effect_is_known_for_is_told() {
    let folder = bench();
    let simulated = |range: &str, options: &[&str]| {
        let block = "[[effect]]\nid = \"E11\"\nparameters = { cogging-sin-n-m = 0.02 }\n";
        let text = format!("base = \"m.toml\"\n{block}valid-range = {{ {range} }}\n");
        write(&folder, "e.toml", &text);
        let of = ["--model", "e.toml", "--command", "c.csv", "-o", "r.csv"];
        fdi_in(&folder, &[&["simulate"], &of[..], options].concat())
    };
    let wide = "speed = [-1e4, 1e4], position = [-1.0, 1.0], load = [2.0, 2.0]";
    assert_eq!(simulated(wide, &[]), (0, String::new()));
    let narrow = "speed = [-1e4, 1e4], position = [-0.001, 1.0], load = [0.0, 1.5]";
    for fidelity in ["high", "low"] {
        let (code, told) = simulated(narrow, &["--fidelity", fidelity]);
        let lines: Vec<_> = told.lines().collect();
        assert_eq!((code, lines.len()), (0, 2), "{told}");
        let position = "notice: effect E11 (cogging) is known for a position from -0.001 to 1 \
                        rad, and the simulation goes from ";
        assert!(lines[0].starts_with(position), "{told}");
        assert_eq!(
            lines[1],
            "notice: effect E11 (cogging) is known for a load from 0 to 1.5 N·m, and the \
             simulation goes from 2.0000 to 2.0000"
        );
    }
    assert_eq!(simulated(narrow, &["--quiet"]), (0, String::new()));
    let (code, told) = simulated("velocity = [0.0, 1.0]", &[]);
    assert_eq!(code, 2);
    assert!(told.contains("is `velocity`, expected speed, position or load"), "{told}");
}
