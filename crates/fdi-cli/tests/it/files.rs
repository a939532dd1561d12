//! What is read outlives what is written, and what is no file is not waited for.

use std::{fs, path::Path, process::Command, time::Duration};

use crate::stand_in::{GOOD, diagnose, folder, try_diagnose};

/// Exit code and standard error of the program in a folder; ended where it waits for ever.
fn fdi(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let mut command = assert_cmd::Command::cargo_bin("fdi").unwrap();
    let command = command.current_dir(folder).timeout(Duration::from_secs(20)).args(arguments);
    let output = command.output().unwrap();
    (output.status.code().unwrap_or(-1), String::from_utf8(output.stderr).unwrap())
}

/// What `diagnose` says where it is not done at all.
fn refused(arguments: &[&str]) -> String {
    format!("{:#}", try_diagnose(arguments).err().expect("it is refused"))
}

/// A folder in which no file can be made beside `x.jsonl` and `x.out`.
fn without_room_beside(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = folder(files);
    for name in [".x.jsonl.part", ".x.out.part"] {
        fs::create_dir(folder.path().join(name)).unwrap();
    }
    folder
}

/// The answers of the earlier run are read while the file is put into order.
#[test]
fn answers_outlive_a_folder_that_takes_no_file() {
    let names = ["healthy-0.csv", "healthy-1.csv", "healthy-2.csv"];
    let folder = without_room_beside(&names.map(|name| (name, GOOD)));
    let path = |name: &str| folder.path().join(name).display().to_string();
    let [r0, r1, r2] = names.map(path);
    for name in ["x.jsonl", "whole.jsonl"] {
        let kept = path(name);
        if name == "x.jsonl" {
            // the last one first, so that the file has to be put into order
            diagnose(&["--stable", "--resume", &kept, &r2]);
        }
        let outcome = diagnose(&["--stable", "--resume", &kept, &r0, &r1, &r2]);
        assert_eq!(outcome.code, 0, "{}", outcome.err);
    }
    let read = |name: &str| fs::read_to_string(path(name)).unwrap();
    assert_eq!(read("x.jsonl").lines().count(), 4);
    assert_eq!(read("x.jsonl"), read("whole.jsonl"));
}

/// Nothing is still worth no more than an older product.
#[test]
fn an_older_product_outlives_a_folder_that_takes_no_file() {
    let folder =
        without_room_beside(&[("x.csv", ""), ("healthy.csv", GOOD), ("x.out", "of yesterday")]);
    let path = |name: &str| folder.path().join(name).display().to_string();
    let target = path("x.out");
    let outcome = diagnose(&["--output", &target, &path("x.csv")]);
    assert!(outcome.err.contains("is left as it was"), "{}", outcome.err);
    assert_eq!(fs::read_to_string(&target).unwrap(), "of yesterday");
    fs::write(&target, "of yesterday\n".repeat(1000)).unwrap();
    diagnose(&["--output", &target, "--output-format", "csv", &path("healthy.csv")]);
    let text = fs::read_to_string(&target).unwrap();
    assert!(text.contains("healthy") && !text.contains("yesterday"), "{text}");
}

/// A file has many names.
#[cfg(unix)]
#[test]
fn products_of_one_file_are_told_apart_from_those_of_two() {
    use std::os::unix::fs::symlink;

    let folder = folder(&[("r.csv", GOOD), ("old.jsonl", "")]);
    let path = |name: &str| folder.path().join(name).display().to_string();
    symlink("new.jsonl", path("dangling.jsonl")).unwrap();
    symlink("old.jsonl", path("link.jsonl")).unwrap();
    fs::hard_link(path("old.jsonl"), path("hard.jsonl")).unwrap();
    for (resume, product) in [
        ("new.jsonl", "./new.jsonl"),
        ("new.jsonl", "dangling.jsonl"),
        ("old.jsonl", "./old.jsonl"),
        ("old.jsonl", "link.jsonl"),
        ("old.jsonl", "hard.jsonl"),
    ] {
        for option in ["--output", "--report"] {
            let arguments = ["--resume", &path(resume), option, &path(product), &path("r.csv")];
            let error = refused(&arguments);
            assert!(error.contains("both write"), "{resume} {product}: {error}");
        }
    }
    assert!(!Path::new(&path("new.jsonl")).exists());
    // the trends stand beside the report
    let trends = ["--resume", &path("r-fleet.json"), "--report", &path("r.html"), &path("r.csv")];
    assert!(refused(&trends).contains("both write"));
}

/// The head is what it is, not what this run would have written.
#[test]
fn a_head_of_other_bytes_is_kept() {
    let folder =
        folder(&[("healthy-0.csv", GOOD), ("healthy-1.csv", GOOD), ("healthy-2.csv", GOOD)]);
    let path = |name: &str| folder.path().join(name).display().to_string();
    let [r0, r1, r2, kept] =
        ["healthy-0.csv", "healthy-1.csv", "healthy-2.csv", "kept.jsonl"].map(path);
    let run = |recordings: &[&str]| {
        diagnose(&[&["--stable", "--resume", &kept], recordings].concat());
        fs::read_to_string(&kept).unwrap()
    };
    let text = run(&[&r2]);
    for (other, what) in [
        (text.replace('\n', "\r\n"), "line ends of another system"),
        (text.replacen(':', " : ", 1), "blanks"),
    ] {
        fs::write(&kept, &other).unwrap();
        let after = run(&[&r0, &r1, &r2]);
        let lines: Vec<_> = after.lines().collect();
        assert_eq!(lines[0], other.lines().next().unwrap(), "{what}");
        for (line, name) in lines[1..].iter().zip([&r0, &r1, &r2]) {
            let answer: serde_json::Value = serde_json::from_str(line).expect(what);
            assert_eq!(answer["recording"], **name, "{what}");
        }
        assert_eq!(run(&[&r0, &r1, &r2]), after, "{what}");
    }
    let later = text.replacen("\"schema_version\":", "\"schema_version\":9", 1);
    assert_ne!(later, text);
    fs::write(&kept, &later).unwrap();
    let error = refused(&["--stable", "--resume", &kept, &r2]);
    assert!(error.contains("form"), "{error}");
    assert_eq!(fs::read_to_string(&kept).unwrap(), later);
}

/// Every command keeps what it reads.
#[test]
fn what_a_command_reads_is_not_written_over() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["r.csv", "c.toml", "m.toml", "b", "d", "x-fleet.csv"] {
        fs::write(folder.path().join(name), "# as it was\n").unwrap();
    }
    fs::write(folder.path().join("c.toml"), "# as it was\n").unwrap();
    fs::write(folder.path().join("derived.toml"), "base = \"m.toml\"\n").unwrap();
    for (arguments, what) in [
        (&["inspect", "r.csv", "-o", "./r.csv"][..], "a recording"),
        (&["simulate", "--command", "r.csv", "-o", "r.csv"], "the command"),
        (&["simulate", "--model", "m.toml", "-o", "m.toml"], "the model"),
        (&["simulate", "--model", "derived.toml", "-o", "m.toml"], "the model"),
        (&["dataset", "--command", "r.csv", "-o", "r.csv"], "the command"),
        (&["bundle", "build", "--dataset", "d", "-o", "d"], "a dataset"),
        (&["bundle", "show", "b", "-o", "b"], "the bundle"),
        (&["bundle", "show", "b", "--figure", "b"], "the bundle"),
        (&["diagnose", "r.csv", "--config", "c.toml", "-o", "c.toml"], "the file of settings"),
        (&["schema", "fleet", "--config", "c.toml", "-o", "c.toml"], "the file of settings"),
        (&["diagnose", "r.csv", "--bundle", "b", "-o", "b"], "the bundle"),
        (&["diagnose", "r.csv", "--bundle", "b", "--report", "b"], "the bundle"),
        (&["diagnose", "r.csv", "--reference", "d", "-o", "d"], "the reference"),
        (&["diagnose", "r.csv", "-o", "r.csv"], "a recording"),
        (&["diagnose", "x-fleet.csv", "--report", "x.html"], "a recording"),
        (&["calibrate", "--model", "m.toml", "--train", "r.csv", "-o", "m.toml"], "the model"),
        (&["explain", "--train", "r.csv", "--command", "d", "-o", "d"], "the command"),
        (&["propose", "--train", "r.csv", "-o", "r.csv"], "a recording"),
    ] {
        let before = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
        let (code, err) = fdi(folder.path(), arguments);
        let said = format!("would write over {what} that");
        assert!(code == 2 && err.contains(&said), "{arguments:?}: {code} {err}");
        for name in ["r.csv", "c.toml", "m.toml", "b", "d"] {
            assert_eq!(before(name), "# as it was\n", "{arguments:?}");
        }
    }
    // a preset is no file, whatever lies there
    fs::write(folder.path().join("ema-48"), "").unwrap();
    let (code, err) = fdi(folder.path(), &["simulate", "-o", "ema-48.csv"]);
    assert_eq!(code, 0, "{err}");
    // settings that are found are read as those that are named
    fs::rename(folder.path().join("c.toml"), folder.path().join("fdi.toml")).unwrap();
    let (code, err) = fdi(folder.path(), &["schema", "fleet", "-o", "fdi.toml"]);
    assert!(code == 2 && err.contains("would write over the file of settings that"), "{err}");
}

/// A pipe has no place of its own, whatever links lead to it.
#[cfg(target_os = "linux")]
#[test]
fn products_go_into_pipes() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let mut command = assert_cmd::Command::cargo_bin("fdi").unwrap();
        let output = command.current_dir(folder.path()).args(arguments).output().unwrap();
        (output.status.code(), String::from_utf8(output.stdout).unwrap())
    };
    let plain = run(&["schema", "fleet"]);
    assert!(plain.0 == Some(0) && plain.1.len() > 500);
    assert_eq!(run(&["schema", "fleet", "-o", "/dev/stdout"]), plain);
}

/// A recording takes the place of an older one and is not written into it.
#[cfg(unix)]
#[test]
fn a_simulated_recording_takes_the_place_of_an_older_one() {
    let folder = folder(&[("r.csv", GOOD)]);
    let path = |name: &str| folder.path().join(name);
    fs::hard_link(path("r.csv"), path("older.csv")).unwrap();
    let (code, err) = fdi(folder.path(), &["simulate", "-o", "r.csv"]);
    assert_eq!(code, 0, "{err}");
    assert!(fs::read_to_string(path("older.csv")).unwrap() == GOOD);
    assert!(fs::read_to_string(path("r.csv")).unwrap() != GOOD);
    let (code, err) = fdi(folder.path(), &["simulate", "-o", "r.txt"]);
    assert_eq!((code, err.as_str()), (2, "error: `r.txt` does not end in `.csv` or `.csv.gz`\n"));
}

/// A pipe that nobody writes into would be waited for.
#[cfg(unix)]
#[test]
fn what_is_no_file_is_not_waited_for() {
    let folder = folder(&[("r.csv", GOOD)]);
    let pipe = folder.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for (arguments, name) in [
        (&["diagnose", "r.csv", "--resume", "pipe"][..], "pipe"),
        (&["diagnose", "r.csv", "--resume", "/dev/full"], "/dev/full"),
        (&["diagnose", "r.csv", "--resume", "/dev/null"], "/dev/null"),
        (&["diagnose", "r.csv", "--bundle", "pipe"], "pipe"),
        (&["diagnose", "r.csv", "--reference", "pipe"], "pipe"),
        (&["bundle", "show", "pipe"], "pipe"),
        (&["bundle", "build", "--dataset", "pipe", "-o", "b"], "pipe"),
        (&["simulate", "--model", "pipe"], "pipe"),
        (&["simulate", "--config", "pipe"], "pipe"),
        (&["explain", "--model", "pipe", "--train", "r.csv"], "pipe"),
    ] {
        let (code, err) = fdi(folder.path(), arguments);
        assert!(code == 2 && err.contains("not a regular file"), "{arguments:?}: {code} {err}");
        assert!(err.contains(name), "{arguments:?}: {err}");
    }
}

/// `--where` chooses one recording of a table, and the refusal of the whole table names that option.
#[test]
fn one_recording_of_a_table_is_chosen() {
    let row = |run: usize, row: usize| format!("{run},{},{row}\n", row as f64 * 5e-4);
    let rows = (1..=2).flat_map(|run| (0..120).map(move |at| row(run, at)));
    let table = format!("run,time_s,current_a\n{}", rows.collect::<String>());
    let folder = folder(&[("healthy.csv", &table)]);
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (table, kept) = (path("healthy.csv"), path("kept.jsonl"));
    let told = diagnose(&[&table]).err;
    assert!(told.contains("`--where run=1` reads one"), "{told}");
    assert!(told.contains("hint: `--where run=1` reads `"), "{told}");
    let outcome = diagnose(&["--where", "run=2", "--resume", &kept, &table]);
    assert_eq!(outcome.code, 0, "{}", outcome.err);
    let told = refused(&["--where", "run=1", "--resume", &kept, &table]);
    assert!(told.contains("where"), "{told}");
    let outcome = diagnose(&["--where", "run=3", &table]);
    assert!(outcome.err.contains("values of `run`: `1`, `2`"), "{}", outcome.err);
}
