//! Parts of a batch and the whole that they make.

use std::{fs, path::Path};

use clap::Parser;
use fdi_cli::{Cli, Streams, run};
use serde_json::Value;

use crate::{
    batch::mixed,
    schema::violations,
    stand_in::{GOOD, Outcome, diagnose, folder},
};

/// What a command came to, or its error.
fn merge(arguments: &[&str]) -> Result<Outcome, String> {
    let cli = Cli::try_parse_from(["fdi", "merge"].iter().chain(arguments)).unwrap();
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let mut streams = Streams { out: &mut out, err: &mut err, is_terminal: false };
    let status = run(&cli, &mut streams).map_err(|error| format!("{error:#}"))?;
    let text = |bytes| anstream::adapter::strip_str(&String::from_utf8(bytes).unwrap()).to_string();
    Ok(Outcome { code: status.code(), out: text(out), err: text(err) })
}

/// Makes the parts of a batch, in files of `--resume` or in documents.
fn parts(recordings: &Path, of: usize, in_lines: bool, kept: &Path) -> Vec<String> {
    let part = |index: usize| {
        let ending = if in_lines { "jsonl" } else { "json" };
        let path = kept.join(format!("part-{index}.{ending}")).display().to_string();
        let to = if in_lines { "--resume" } else { "--output" };
        let shard = format!("{index}/{of}");
        let recordings = recordings.display().to_string();
        let form = ["--output-format", "json", "--stable", "--shard", &shard];
        diagnose(&[&form[..], &[to, &path, &recordings]].concat());
        path
    };
    (1..=of).map(part).collect()
}

fn words(parts: &[String]) -> Vec<&str> {
    parts.iter().map(String::as_str).collect()
}

#[test]
fn the_parts_make_what_one_run_would_have_made() {
    let recordings = mixed();
    let path = recordings.path().display().to_string();
    for of in [1, 3, 14, 16] {
        for in_lines in [false, true] {
            let kept = tempfile::tempdir().unwrap();
            let mut parts = parts(recordings.path(), of, in_lines, kept.path());
            // their order is told by themselves
            parts.rotate_left(of / 2);
            for form in ["json", "jsonl", "csv", "human"] {
                let again = kept.path().join("whole.jsonl").display().to_string();
                let mut command = vec!["--stable", "--output-format", form, &path];
                if in_lines {
                    command.extend(["--resume", &again]);
                }
                let whole = diagnose(&command);
                let merged = merge(&[&["--output-format", form], &words(&parts)[..]].concat());
                let merged = merged.unwrap();
                assert_eq!(merged.out, whole.out, "{of} {in_lines} {form}");
                assert_eq!(merged.code, 0);
                let noun = if of == 1 { "part" } else { "parts" };
                let said = format!("{of} {noun} merged: 6 recordings diagnosed");
                assert!(merged.err.starts_with(&said), "{}", merged.err);
                let _ = fs::remove_file(&again);
            }
        }
    }
}

#[test]
fn a_part_is_of_the_published_form() {
    let (recordings, kept) = (mixed(), tempfile::tempdir().unwrap());
    let schema: Value = serde_json::from_str(&fdi_core::Schema::Diagnosis.text()).unwrap();
    for part in parts(recordings.path(), 3, false, kept.path()) {
        let document: Value = serde_json::from_str(&fs::read_to_string(part).unwrap()).unwrap();
        assert_eq!(violations(&document, &schema, &schema, ""), Vec::<String>::new());
        assert_eq!(document["shard"]["recordings"], 14);
    }
}

#[test]
fn missing_and_doubled_parts_are_named() {
    let (recordings, kept) = (mixed(), tempfile::tempdir().unwrap());
    let parts = parts(recordings.path(), 5, true, kept.path());
    let said = |parts: &[&str]| merge(parts).err().unwrap_or_default();
    let [one, two, three, four, five] = words(&parts)[..] else { panic!("five parts") };
    assert_eq!(
        said(&[one, three, five]),
        "parts 2, 4 of 5 are missing: `fdi diagnose --shard 2/5` makes the first of them"
    );
    assert!(said(&[one, two, three, five]).starts_with("part 4 of 5 is missing"));
    let copy = kept.path().join("copy.jsonl").display().to_string();
    fs::copy(three, &copy).unwrap();
    assert_eq!(
        said(&[one, two, three, &copy, four, five]),
        format!("part 3 of 5 is there twice: `{three}` and `{copy}`")
    );
    // an older product stays where the parts are refused
    let older = kept.path().join("older.json").display().to_string();
    fs::write(&older, "older").unwrap();
    assert_ne!(said(&[one, "--output", &older]), "");
    assert_eq!(fs::read_to_string(&older).unwrap(), "older");
}

#[test]
fn a_part_whose_run_did_not_end_is_named() {
    let (recordings, kept) = (mixed(), tempfile::tempdir().unwrap());
    let parts = parts(recordings.path(), 2, true, kept.path());
    let whole = fs::read_to_string(&parts[1]).unwrap();
    let lines: Vec<&str> = whole.split_inclusive('\n').collect();
    assert_eq!(lines.len(), 8);
    let said = |text: &str| {
        fs::write(&parts[1], text).unwrap();
        merge(&words(&parts)).err().unwrap_or_default()
    };
    let name = &parts[1];
    let of = |found: &str| {
        format!("`{name}`, part 2 of 2, has {found}: its run did not end, so run it again")
    };
    assert_eq!(said(&lines[..6].concat()), of("5 of its 7 recordings"));
    let cut = lines.concat();
    assert_eq!(said(&cut[..cut.len() - 9]), of("6 of its 7 recordings"));
    // the right number of lines, with one recording in place of another
    let doubled = [&lines[..7], &lines[1..2]].concat().concat();
    let first: Value = serde_json::from_str(lines[1]).unwrap();
    assert_eq!(said(&doubled), of(&format!("`{}` twice", first["recording"].as_str().unwrap())));
    // in another order than that of the batch
    let turned = [&lines[..1], &lines[2..], &lines[1..2]].concat().concat();
    assert!(said(&turned).contains("not those of the batch"));
    assert_eq!(said(&whole), "");
}

#[test]
fn what_is_no_part_of_this_batch_is_refused() {
    let (recordings, kept) = (mixed(), tempfile::tempdir().unwrap());
    let one = parts(recordings.path(), 2, false, kept.path()).swap_remove(0);
    let others = tempfile::tempdir().unwrap();
    let path = recordings.path().display().to_string();
    let said = |other: &str| merge(&[&one, other]).err().unwrap_or_default();
    let file = others.path().join("other").display().to_string();
    let made = |options: &[&str], path: &str| {
        let _ = fs::remove_file(&file);
        diagnose(&[&["--stable", "--output", &file, path], options].concat());
        said(&file)
    };
    let json = ["--output-format", "json"];
    let with = |more: &[&'static str]| [&json[..], more].concat();
    assert!(made(&with(&[]), &path).contains("is the answer to a whole batch"));
    assert!(made(&["--output-format", "csv"], &path).contains("merge takes files of `--resume`"));
    assert!(made(&with(&["--shard", "2/3"]), &path).contains("is a part of 2, "));
    let seeded = made(&with(&["--shard", "2/2", "--seed", "7"]), &path);
    assert!(seeded.contains("was made with `--seed` `0`"), "{seeded}");
    let noisy = made(&with(&["--shard", "2/2", "--noise-a", "0.03"]), &path);
    assert!(noisy.contains("was made without `--noise-a`"), "{noisy}");
    let more = folder(&[("healthy-1.csv", GOOD), ("healthy-2.csv", GOOD)]);
    let more = made(&with(&["--shard", "2/2"]), &more.path().display().to_string());
    assert!(more.contains("the lists differ"), "{more}");
    let lines = parts(recordings.path(), 2, true, others.path());
    assert!(said(&lines[1]).contains("give one kind"));
    assert!(said("nowhere.json").contains("cannot be opened"));
}

#[test]
fn a_file_of_answers_stays_of_its_part() {
    let (recordings, kept) = (mixed(), tempfile::tempdir().unwrap());
    let parts = parts(recordings.path(), 2, true, kept.path());
    let path = recordings.path().display().to_string();
    let again = |shard: &[&str]| {
        let options = ["--stable", "--resume", &parts[0], &path];
        let arguments = [&options[..], shard].concat();
        crate::stand_in::try_diagnose(&arguments).err().map(|error| format!("{error:#}"))
    };
    assert_eq!(again(&["--shard", "1/2"]), None);
    assert!(again(&["--shard", "2/2"]).unwrap().contains("it is part 1 of 2 of a batch of 14"));
    assert!(again(&[]).unwrap().contains("this run is a whole batch"));
    fs::write(recordings.path().join("healthy-9.csv"), GOOD).unwrap();
    fs::remove_file(recordings.path().join("partial-2.csv")).unwrap();
    assert!(again(&["--shard", "1/2"]).unwrap().contains("has other recordings now"));
}
