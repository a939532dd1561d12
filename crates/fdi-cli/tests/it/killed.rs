//! A batch that is killed in the middle, as a cluster does, and run again.

use std::{
    fs,
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::Duration,
};

/// Recordings of the batch.
const RECORDINGS: usize = 40;

/// Answers after which the first run is killed.
const KILLED_AFTER: usize = 10;

/// Answers in a file: its lines after the first.
fn answers(path: &Path) -> usize {
    fs::read_to_string(path).map_or(0, |text| text.matches('\n').count().saturating_sub(1))
}

/// Starts the batch with its files in a folder of its own.
fn start(recordings: &Path, files: &Path) -> Child {
    fs::create_dir_all(files).unwrap();
    Command::new(assert_cmd::cargo::cargo_bin!("fdi"))
        .args([
            "diagnose",
            "--tolerance",
            "none",
            "--stable",
            "--jobs",
            "2",
            "--output-format",
            "json",
        ])
        .args(["--resume", "kept.jsonl", "--output", "out.json", "--report", "r.html"])
        .arg(recordings)
        .current_dir(files)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

#[test]
fn determinism_a_batch_that_is_killed_goes_on_as_if_it_had_not_been() {
    let folder = tempfile::tempdir().unwrap();
    let recordings = folder.path().join("recordings");
    fs::create_dir(&recordings).unwrap();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/recordings");
    for index in 0..RECORDINGS {
        // the first 24 are of one test
        let from = fixtures.join(format!("r{:02}.csv.gz", index % 24 + 1));
        fs::copy(from, recordings.join(format!("{index:03}.csv.gz"))).unwrap();
    }
    let (whole, killed) = (folder.path().join("whole"), folder.path().join("killed"));
    assert!(start(&recordings, &whole).wait().unwrap().success());

    let mut child = start(&recordings, &killed);
    let kept = killed.join("kept.jsonl");
    while answers(&kept) < KILLED_AFTER {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it could be killed");
        thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    assert!(!child.wait().unwrap().success());
    let done = answers(&kept);
    assert!((KILLED_AFTER..RECORDINGS).contains(&done), "{done}");
    assert!(!killed.join("r.html").exists());

    assert!(start(&recordings, &killed).wait().unwrap().success());
    for file in ["kept.jsonl", "out.json", "r.html"] {
        let read = |folder: &Path| fs::read(folder.join(file)).unwrap();
        assert!(read(&whole) == read(&killed), "{file}");
    }
    assert_eq!(answers(&kept), RECORDINGS);
}
