//! The layout of the readers.

use std::{fs, path::Path, process::Command};

/// `cargo fmt` follows `mod` lines; those of the readers are made by the table of formats.
#[test]
fn law_every_reader_is_formatted() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/reader");
    let files = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let files: Vec<_> = files.filter(|path| path.extension().is_some_and(|e| e == "rs")).collect();
    assert!(files.len() > 5, "readers are in {}", folder.display());
    let edition = ["--edition", "2024", "--check"];
    match Command::new("rustfmt").args(edition).args(files).current_dir(folder).output() {
        Ok(output) => {
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
        }
        Err(error) => eprintln!("skipped: rustfmt cannot be started: {error}"),
    }
}
