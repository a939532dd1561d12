//! Batches: order, forms, failures, exit codes.

use std::{
    fs,
    io::{self, Write},
    path::Path,
};

use clap::Parser;
use fdi_cli::{Cli, ExitStatus, Streams, args::Command, diagnose_with};
use fdi_core::{RecordingDate, report::Diagnosis};

use crate::stand_in::{GOOD, StandIn, diagnose, diagnose_coloured, folder, try_diagnose};

/// One of each, and every way in which a recording cannot be read.
pub(crate) fn mixed() -> tempfile::TempDir {
    folder(&[
        ("faulty-1.csv", GOOD),
        ("half-1.csv", GOOD),
        ("healthy-1.csv", GOOD),
        ("partial-1.csv", GOOD),
        ("partial-2.csv", GOOD),
        ("strange-1.csv", GOOD),
        ("x1-empty.csv", ""),
        ("x2-header.csv", "time_s,current_a\n"),
        ("x3-text.csv", "time_s,current_a\n0,one\n"),
        ("x4-nan.csv", "time_s,current_a\n0,nan\n"),
        ("x5-time.csv", "time_s,current_a\n0,1\n0.04,1\n0,1\n"),
        ("x6-current.csv", "time_s,load_n_m\n0,1\n"),
        ("x7-key.csv", "# rate = 2000\ntime_s,current_a\n0,1\n"),
        ("x8-rate.csv", GOOD),
    ])
}

#[test]
fn people_get_a_table_sentences_and_one_line_for_each_failure() {
    let folder = mixed();
    let path = folder.path().display().to_string();
    let missing = folder.path().join("none.csv").display().to_string();
    let outcome = diagnose(&["--stable", &path, &missing]);
    insta::assert_snapshot!(outcome.text(folder.path()));
}

#[test]
fn findings_stand_below_the_table_once_for_recordings_that_share_them() {
    let folder = folder(&[("healthy-1.csv", GOOD), ("unit-1.csv", GOOD), ("unit-2.csv", GOOD)]);
    let path = folder.path().display().to_string();
    insta::assert_snapshot!(diagnose(&["--stable", &path]).out);
}

#[test]
fn scripts_get_rows() {
    let folder = mixed();
    let path = folder.path().display().to_string();
    let outcome = diagnose(&["--stable", "--output-format", "csv", "-q", &path]);
    insta::assert_snapshot!(outcome.text(folder.path()));
}

#[test]
fn scripts_get_a_document_of_the_published_form() {
    let folder = mixed();
    let path = folder.path().display().to_string();
    let outcome = diagnose(&["--stable", "--seed", "7", "--output-format", "json", &path]);
    insta::assert_snapshot!(outcome.text(folder.path()));
    let document: Diagnosis = serde_json::from_str(&outcome.out).unwrap();
    assert_eq!((document.records.len(), document.failed.len()), (6, 8));
    assert_eq!((document.seed, document.bundle.as_str()), (7, "00ff"));
    assert!(document.records.iter().all(|record| record.elapsed_s.is_none()));
}

#[test]
fn scripts_get_one_object_a_line_in_the_order_of_the_input() {
    let folder = mixed();
    let path = folder.path().display().to_string();
    let outcome = diagnose(&["--output-format", "jsonl", &path]);
    let lines: Vec<serde_json::Value> =
        outcome.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let of = |line: &serde_json::Value| line["recording"].as_str().unwrap().to_owned();
    let names: Vec<String> = lines.iter().map(of).collect();
    assert_eq!(names.len(), 14);
    assert!(names.is_sorted(), "{names:?}");
    assert!(lines[0]["elapsed_s"].is_f64());
    assert_eq!(lines[6]["error"], "empty file: expected a header row with `time_s` and channels");
}

#[test]
fn determinism_any_number_of_jobs_gives_the_same_bytes() {
    let names: Vec<String> = (0..40)
        .map(|i| format!("{}-{i:02}.csv", ["healthy", "faulty", "partial", "x"][i % 4]))
        .collect();
    let files: Vec<_> = names.iter().map(|name| (name.as_str(), GOOD)).collect();
    let folder = folder(&files);
    let path = folder.path().display().to_string();
    for format in ["human", "json", "jsonl", "csv"] {
        let with = |jobs| {
            let arguments = ["--stable", "--output-format", format, "--jobs", jobs, &path];
            let outcome = diagnose(&arguments);
            (outcome.code, outcome.out, outcome.err)
        };
        let one = with("1");
        assert_eq!(one, with("2"), "{format}");
        assert_eq!(one, with("7"), "{format}");
    }
}

/// A pipe that nobody writes into would be waited for.
#[cfg(unix)]
#[test]
fn pipes_are_no_recordings() {
    let folder = folder(&[("healthy.csv", GOOD)]);
    let pipe = folder.path().join("pipe.csv");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
    assert!(made.success());
    let outcome = diagnose(&[&pipe.display().to_string()]);
    assert!(
        outcome.code == 2 && outcome.err.contains("pipe.csv: not a regular file"),
        "{}",
        outcome.err
    );
}

/// A row is of its actuator and its day, also where there is nothing more to say.
#[test]
fn what_failed_keeps_its_actuator_and_its_date() {
    let folder = folder(&[
        ("A7_2026-02-28.csv", ""),
        ("A7_2026-02-30.csv", GOOD),
        ("x_y.csv", "# actuator-id = \"B2\"\n# date = 2026-03-01\ntime_s,current_a\n0,1\n1,2\n"),
    ]);
    let path = folder.path().display().to_string();
    let pattern = ["--id-from", "{id}_*", "--date-from", "*_{date}"];
    let outcome = diagnose(&[&pattern[..], &["--output-format", "csv", &path]].concat());
    let rows: Vec<_> = outcome.out.lines().skip(1).collect();
    let begins =
        |row: usize, cells: &str| rows[row].split_once(".csv,").unwrap().1.starts_with(cells);
    assert!(begins(0, "A7,2026-02-28,failed,"), "{}", rows[0]);
    assert!(begins(1, "A7,,failed,"), "{}", rows[1]);
    let reason = "the name says the date `2026-02-30`, and there is no such day";
    assert!(rows[1].contains(reason), "{}", rows[1]);
    let outcome = diagnose(&["--output-format", "csv", &path]);
    let last = outcome.out.lines().last().unwrap();
    assert!(last.contains("x_y.csv,B2,2026-03-01,failed,"), "{last}");
}

#[test]
fn a_defect_is_the_failure_of_one_recording() {
    let folder = folder(&[("broken.csv", GOOD), ("healthy.csv", GOOD), ("panic.csv", GOOD)]);
    let outcome = diagnose(&["--output-format", "json", &folder.path().display().to_string()]);
    let document: Diagnosis = serde_json::from_str(&outcome.out).unwrap();
    assert_eq!((outcome.code, document.records.len()), (2, 1));
    let errors: Vec<_> = document.failed.iter().map(|failure| failure.error.as_str()).collect();
    assert_eq!(
        errors,
        [
            "internal error, please report it: `k2` is not finite",
            "internal error, please report it"
        ]
    );
}

#[test]
fn exit_codes_tell_what_was_found_only_when_asked() {
    let folder = folder(&[
        ("faulty.csv", GOOD),
        ("healthy.csv", GOOD),
        ("partial.csv", GOOD),
        ("strange.csv", GOOD),
    ]);
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (faulty, healthy, strange) = (path("faulty.csv"), path("healthy.csv"), path("strange.csv"));
    assert_eq!(diagnose(&[&faulty]).code, 0);
    assert_eq!(diagnose(&["--exit-code", &healthy]).code, 0);
    assert_eq!(diagnose(&["--exit-code", &healthy, &faulty]).code, 1);
    assert_eq!(diagnose(&["--exit-code", &strange]).code, 1);
    assert_eq!(diagnose(&["--exit-code", &faulty, &path("none.csv")]).code, 2);
    // nothing concluded is not healthy; what is found goes before, what failed before that
    let open = path("partial.csv");
    assert_eq!(diagnose(&["--exit-code", &healthy, &open]).code, 3);
    assert_eq!(diagnose(&["--exit-code", &faulty, &open]).code, 1);
    assert_eq!(diagnose(&["--exit-code", &open, &path("none.csv")]).code, 2);
    let plain = diagnose(&["--stable", &open]);
    assert_eq!(plain.code, 0);
    assert_eq!(plain.err, "1 recording diagnosed: 1 undetermined; no conclusion on 1\n");
}

#[test]
fn the_product_goes_to_a_file() {
    let folder = folder(&[("faulty.csv", GOOD)]);
    let recording = folder.path().join("faulty.csv").display().to_string();
    let target = folder.path().join("answer.json").display().to_string();
    let arguments = ["--output-format", "json", "--stable", "--output", &target, &recording];
    let outcome = diagnose(&arguments);
    assert_eq!(
        (outcome.out.as_str(), outcome.err.as_str()),
        ("", "1 recording diagnosed: 1 faulty\n")
    );
    let document: Diagnosis = serde_json::from_str(&fs::read_to_string(target).unwrap()).unwrap();
    assert_eq!(document.records.len(), 1);
}

#[test]
fn a_table_in_a_file_has_no_colours() {
    let folder = folder(&[("faulty.csv", GOOD)]);
    let recording = folder.path().join("faulty.csv").display().to_string();
    let target = folder.path().join("answer.txt").display().to_string();
    diagnose_coloured(&["--output", &target, &recording]);
    let text = fs::read_to_string(target).unwrap();
    assert!(text.contains("0.031±0.002 *") && !text.contains('\u{1b}'), "{text}");
}

/// Wherever a run is killed, what it has written is a beginning of the file, down to
/// a byte: going on from any such beginning ends in the same file and answer.
#[test]
fn determinism_a_resumed_batch_ends_like_an_uninterrupted_one() {
    let folder = mixed();
    let path = folder.path().display().to_string();
    let kept = tempfile::tempdir().unwrap();
    let kept = kept.path().join("kept.jsonl");
    let run = |form: &str| {
        let kept = kept.display().to_string();
        let outcome = diagnose(&["--stable", "--output-format", form, "--resume", &kept, &path]);
        // the first line says how much was done before, the last how much now
        let (begin, rest) = outcome.err.split_once('\n').unwrap();
        assert!(begin.starts_with("diagnosing 14 recordings"), "{begin}");
        let (last, others): (Vec<_>, Vec<_>) =
            rest.lines().partition(|line| line.contains("diagnosed"));
        let others = others.join("\n");
        ((outcome.code, outcome.out, others), last.join("\n"))
    };
    for form in ["json", "jsonl", "csv", "human"] {
        let _ = fs::remove_file(&kept);
        let (whole, _) = run(form);
        let file = fs::read(&kept).unwrap();
        assert_eq!(String::from_utf8(file.clone()).unwrap().lines().count(), 15);
        for length in (0..=file.len()).step_by(297).chain([file.len() - 1, file.len()]) {
            fs::write(&kept, &file[..length]).unwrap();
            assert_eq!(run(form).0, whole, "{form} {length} bytes");
            assert_eq!(fs::read(&kept).unwrap(), file, "{form} {length} bytes");
        }
        assert_eq!(
            run(form).1,
            "0 recordings diagnosed now, 6 taken over: 1 healthy, 2 faulty, 2 undetermined, \
             1 model-inadequate; no conclusion on 3; 8 failed"
        );
    }
}

/// What has changed since is done again in its place: a recording whose file was replaced, one
/// that could not be read, and one that was not there.
#[test]
fn what_is_not_the_same_recording_is_diagnosed_again() {
    let folder = folder(&[
        ("faulty-1.csv", GOOD),
        ("healthy-1.csv", GOOD),
        ("healthy-2.csv", ""),
        ("partial-1.csv", GOOD),
    ]);
    let elsewhere = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let kept = |name: &str| elsewhere.path().join(name).display().to_string();
    let batch = folder.path().display().to_string();
    let run = |name: &str| {
        let outcome = diagnose(&["--stable", "--resume", &kept(name), &batch]);
        outcome.err.trim_end().rsplit('\n').next().unwrap().to_owned()
    };
    assert_eq!(
        run("a"),
        "3 recordings diagnosed: 1 healthy, 1 faulty, 1 undetermined; no conclusion on 1; 1 failed"
    );
    // as long and as old as before
    let was = fs::metadata(path("faulty-1.csv")).unwrap().modified().unwrap();
    fs::write(path("faulty-1.csv"), GOOD.replace(",3", ",4")).unwrap();
    let file = fs::File::options().write(true).open(path("faulty-1.csv")).unwrap();
    file.set_modified(was).unwrap();
    fs::write(path("healthy-2.csv"), GOOD).unwrap();
    fs::write(path("healthy-0.csv"), GOOD).unwrap();
    assert_eq!(
        run("a"),
        "3 recordings diagnosed now, 2 taken over: 3 healthy, 1 faulty, 1 undetermined; no \
         conclusion on 1"
    );
    run("b");
    assert_eq!(fs::read(kept("a")).unwrap(), fs::read(kept("b")).unwrap());
}

#[test]
fn answers_of_another_batch_are_not_gone_on_with() {
    let folder = folder(&[("faulty.csv", GOOD), ("healthy.csv", GOOD), ("new.csv", GOOD)]);
    let path = |name: &str| folder.path().join(name).display().to_string();
    let kept = path("kept.jsonl");
    diagnose(&["--resume", &kept, &path("faulty.csv")]);
    let text = fs::read_to_string(&kept).unwrap();
    let error = |arguments: &[&str]| {
        let error = try_diagnose(&[&["--resume", &kept], arguments].concat()).err().unwrap();
        format!("{error:#}").replace(&folder.path().display().to_string(), "[folder]")
    };
    assert_eq!(
        error(&[&path("healthy.csv")]),
        "`[folder]/kept.jsonl`: line 2 is of `[folder]/faulty.csv`, which is not in this batch"
    );
    let faulty = path("faulty.csv");
    let made = |before: &str, now: &str| {
        format!(
            "`[folder]/kept.jsonl`: its answers were made {before}, this run is {now}: give the \
             same, or another file"
        )
    };
    for (option, before, now) in [
        ("--method=ei", "with `--method` `gls`", "with `--method` `ei`"),
        ("--seed=7", "with `--seed` `0`", "with `--seed` `7`"),
        ("--noise-a=0.02", "without `--noise-a`", "with `--noise-a` `0.02`"),
        ("--map=current_a=I", "without `--map`", "with `--map` `current_a=I`"),
        ("--max-delay-s=0.01", "without `--max-delay-s`", "with `--max-delay-s` `0.01`"),
        ("--free-start", "without `--free-start`", "with `--free-start` `on`"),
        ("--stable", "without `--stable`", "with `--stable` `on`"),
        ("--id-from={id}_*", "without `--id-from`", "with `--id-from` `{id}_*`"),
    ] {
        assert_eq!(error(&[option, &faulty]), made(before, now));
    }
    let reference = fdi_core::recording_sha256(Path::new(&path("new.csv"))).unwrap();
    assert_eq!(
        error(&["--reference", &path("new.csv"), &faulty]),
        made("without `--reference`", &format!("with `--reference` `{reference}`"))
    );
    fs::write(&kept, text.replace("\"00ff\"", "\"11ff\"")).unwrap();
    assert_eq!(error(&[&faulty]), made("with `--bundle` `11ff`", "with `--bundle` `00ff`"));
    for (other, why) in [
        (text.lines().next().unwrap().to_owned() + "\n{}\n", "line 2: is no answer"),
        ("{}\n".to_owned(), "its first line is not that of a file of `--resume`"),
        ("my notes, not a line of answers".to_owned(), "its first line is not that"),
        (text.replace(concat!("fdi ", env!("CARGO_PKG_VERSION")), "fdi 0.0.1"), "`fdi 0.0.1`"),
    ] {
        fs::write(&kept, &other).unwrap();
        let error = error(&[&faulty]);
        assert!(error.contains(why), "{error}");
        assert_eq!(fs::read_to_string(&kept).unwrap(), other, "it is left as it was");
    }
}

/// Two runs into one file would mix.
#[test]
fn a_file_of_answers_is_of_one_run_at_a_time() {
    let folder = folder(&[("faulty.csv", GOOD), ("kept.jsonl", "")]);
    let path = |name: &str| folder.path().join(name).display().to_string();
    let file = fs::File::open(path("kept.jsonl")).unwrap();
    file.lock().unwrap();
    let error = try_diagnose(&["--resume", &path("kept.jsonl"), &path("faulty.csv")]);
    let error = format!("{:#}", error.err().unwrap());
    assert!(error.ends_with("is written by another run"), "{error}");
}

/// An older product outlives a run in which nothing could be read.
#[test]
fn an_older_product_is_replaced_only_by_something() {
    let folder = folder(&[("faulty.csv", GOOD), ("x.csv", "")]);
    let path = |name: &str| folder.path().join(name).display().to_string();
    for form in ["human", "json", "jsonl", "csv"] {
        let (target, report) = (path("answers.out"), path("report.html"));
        fs::write(&target, "of yesterday").unwrap();
        fs::write(&report, "of yesterday").unwrap();
        let options = ["--output-format", form, "--output", &target, "--report", &report];
        let run = |recordings: &[&str]| diagnose(&[&options, recordings].concat());
        let outcome = run(&[&path("x.csv"), &path("none.csv")]);
        let said = format!("`{target}` is left as it was: no recording could be diagnosed\n");
        assert!(outcome.code == 2 && outcome.err.contains(&said), "{form}: {}", outcome.err);
        for file in [&target, &report] {
            assert_eq!(fs::read_to_string(file).unwrap(), "of yesterday", "{form}");
        }
        run(&[&path("x.csv"), &path("faulty.csv")]);
        for file in [&target, &report] {
            assert!(fs::read_to_string(file).unwrap().contains("faulty"), "{form}");
        }
        fs::remove_file(&target).unwrap();
        run(&[&path("x.csv")]);
        let told = fs::read_to_string(&target).unwrap();
        assert_eq!(told.contains("empty file"), form != "human", "{form}: {told}");
    }
    let left = fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 4, "two recordings and two products");
}

#[test]
fn shards_share_out_the_batch() {
    let folder =
        folder(&[("healthy-1.csv", GOOD), ("healthy-2.csv", GOOD), ("healthy-3.csv", GOOD)]);
    let path = folder.path().display().to_string();
    let count = |shard| {
        let arguments = ["--output-format", "json", "--shard", shard, &path];
        let document: Diagnosis = serde_json::from_str(&diagnose(&arguments).out).unwrap();
        document.records.len()
    };
    assert_eq!((count("1/2"), count("2/2")), (2, 1));
}

#[test]
fn more_is_said_when_asked_and_less_too() {
    let folder = folder(&[("healthy.csv", GOOD)]);
    let path = folder.path().join("healthy.csv").display().to_string();
    let quiet = diagnose(&["-q", &path]);
    assert_eq!(quiet.err, "");
    let verbose = diagnose(&["-v", "--stable", &path]);
    assert_eq!(verbose.err, format!("{path}: healthy\n1 recording diagnosed: 1 healthy\n"));
}

#[test]
fn columns_are_mapped() {
    let folder = folder(&[("healthy.csv", "t_ms,I\n0,1\n0.5,2\n")]);
    let path = folder.path().join("healthy.csv").display().to_string();
    let mapped = ["--map", "time_s=t_ms*0.001", "--map", "current_a=I", &path];
    assert_eq!(diagnose(&mapped).code, 0);
    let unmapped = diagnose(&[&path]);
    assert_eq!(unmapped.code, 2);
    assert!(unmapped.err.contains("no column `time_s`"), "{}", unmapped.err);
}

#[test]
fn the_date_is_written_only_when_asked() {
    let folder = folder(&[("healthy.csv", GOOD)]);
    let path = folder.path().join("healthy.csv").display().to_string();
    let stamp = |arguments: &[&str]| {
        let arguments = [&["--output-format", "json", &path], arguments].concat();
        serde_json::from_str::<Diagnosis>(&diagnose(&arguments).out).unwrap().stamp
    };
    assert_eq!(stamp(&[]), None);
    let stamped = stamp(&["--stamp"]).unwrap();
    assert!(RecordingDate::parse(&stamped).is_some(), "{stamped}");
}

#[test]
fn colours_add_nothing_but_colour() {
    let folder = mixed();
    let path = folder.path().display().to_string();
    let plain = diagnose(&["--stable", &path]);
    let coloured = diagnose_coloured(&["--stable", &path]);
    assert!(coloured.out.contains("\u{1b}[1m\u{1b}[31m0.031±0.002 *"), "{}", coloured.out);
    assert_eq!(anstream::adapter::strip_str(&coloured.out).to_string(), plain.out);
}

/// A real recording of another machine: its text breaks off where its runs begin
/// anew, and the message names its rate and that of the bundle. Skipped, and said
/// so, where the data are not at hand.
#[test]
fn a_real_recording_of_another_machine_names_both_rates() {
    let Some(data) = std::env::var_os("FDI_MEASURED_DATA") else {
        skipped_tests::skip("FDI_MEASURED_DATA does not name the folder of measured data");
        return;
    };
    let path = Path::new(&data).join("cranfield_ema/normal.csv.gz").display().to_string();
    let outcome = diagnose(&["-q", "--map", "time_s=time", "--map", "current_a=current", &path]);
    assert_eq!(outcome.code, 2);
    assert!(outcome.err.contains("(the rows before are at 25 Hz)"), "{}", outcome.err);
    assert!(outcome.err.ends_with("; the bundle is for 2000 Hz\n"), "{}", outcome.err);
}

/// A reader that has seen enough.
struct Closed;

impl Write for Closed {
    fn write(&mut self, _: &[u8]) -> io::Result<usize> {
        Err(io::ErrorKind::BrokenPipe.into())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_broken_pipe_is_success() {
    let files: Vec<_> = (0..30).map(|i| format!("healthy-{i}.csv")).collect();
    let files: Vec<_> = files.iter().map(|name| (name.as_str(), GOOD)).collect();
    let folder = folder(&files);
    let path = folder.path().display().to_string();
    for format in ["human", "json", "jsonl", "csv"] {
        let cli = Cli::parse_from(["fdi", "diagnose", "-q", "--output-format", format, &path]);
        let Command::Diagnose(args) = &cli.command else { panic!("diagnose") };
        let mut err = Vec::new();
        let mut streams = Streams { out: &mut Closed, err: &mut err, is_terminal: false };
        let status = diagnose_with(&StandIn, args, &cli.global, &mut streams).unwrap();
        assert_eq!((status, err.as_slice()), (ExitStatus::Done, &b""[..]), "{format}");
    }
}

/// The rows of the CSV with their types, read back by the format's own reader.
#[cfg(feature = "parquet")]
#[test]
fn data_frames_get_typed_columns() {
    use parquet::{
        file::reader::{FileReader, SerializedFileReader},
        record::RowAccessor,
    };
    let folder = mixed();
    let elsewhere = tempfile::tempdir().unwrap();
    let (path, file) = (folder.path().display().to_string(), elsewhere.path().join("a.parquet"));
    let out = file.display().to_string();
    let table = ["--stable", "-q", "--output-format", "parquet", "--output", &out, &path];
    assert_eq!(diagnose(&table).code, 2, "some recordings cannot be read");
    let first = fs::read(&file).unwrap();
    let reader = SerializedFileReader::new(fs::File::open(&file).unwrap()).unwrap();
    let metadata = reader.metadata().file_metadata();
    let keys = metadata.key_value_metadata().unwrap();
    let key = |name: &str| keys.iter().find(|pair| pair.key == name).unwrap().value.clone();
    assert_eq!((key("bundle").as_deref(), key("seed").as_deref()), (Some("00ff"), Some("0")));
    let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
    let csv = diagnose(&["--stable", "-q", "--output-format", "csv", &path]).out;
    let mut lines = csv::Reader::from_reader(csv.as_bytes());
    let header: Vec<_> = lines.headers().unwrap().iter().map(str::to_owned).collect();
    let columns: Vec<_> = metadata.schema().get_fields().iter().map(|f| f.name()).collect();
    assert_eq!(columns, header);
    for (row, line) in rows.iter().zip(lines.records()) {
        for (index, cell) in line.unwrap().iter().enumerate() {
            let same = row.get_string(index).is_ok_and(|text| text == cell)
                || row.get_double(index).is_ok_and(|number| Ok(number) == cell.parse())
                || row.get_long(index).is_ok_and(|count| Ok(count) == cell.parse())
                || row.get_bool(index).is_ok_and(|truth| Ok(truth) == cell.parse())
                || cell.is_empty();
            assert!(same, "{} `{cell}`", columns[index]);
        }
    }
    assert_eq!(rows.len(), csv.lines().count() - 1);
    diagnose(&table);
    assert_eq!(first, fs::read(&file).unwrap(), "the same answers give the same bytes");
}
