//! Files and folders on disk.

use std::{fs, path::Path};

use recordings::{
    Channel, ChannelName, ColumnMap, CsvFormat, Metadata, Recording, list_recordings,
};

fn read_error(path: &Path) -> String {
    Recording::read(path, &ColumnMap::default()).unwrap_err().to_string()
}

fn recording() -> Recording {
    let values = (0..200).map(|i| f64::from(i).sin()).collect();
    let current = Channel::uniform(ChannelName::Current, 0.0, 2000.0, values).unwrap();
    Recording::new("memory", Metadata::default(), vec![current]).unwrap()
}

#[test]
fn a_folder_gives_its_recordings_in_name_order() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["r10.csv", "r02.csv.gz", "r1.CSV", "truth.csv", "notes.txt", ".hidden.csv"] {
        fs::write(folder.path().join(name), "").unwrap();
    }
    fs::create_dir(folder.path().join("deeper.csv")).unwrap();
    let found = list_recordings(folder.path()).unwrap();
    let names: Vec<_> = found.iter().map(|path| path.file_name().unwrap()).collect();
    assert_eq!(names, ["r02.csv.gz", "r1.CSV", "r10.csv"]);
}

#[test]
fn folders_in_a_folder_and_patterns_give_their_recordings() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["b.csv", "day 1/a.csv", "day 1/note.txt", "day 1/deep/c.csv", ".git/d.csv"] {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "").unwrap();
    }
    let list = |path: &str| {
        let found = list_recordings(&folder.path().join(path))?;
        let inside = |path: &std::path::PathBuf| {
            path.strip_prefix(folder.path()).unwrap().display().to_string()
        };
        Ok::<Vec<String>, recordings::RecordError>(found.iter().map(inside).collect())
    };
    assert_eq!(list("").unwrap(), ["b.csv", "day 1/a.csv", "day 1/deep/c.csv"]);
    assert_eq!(list("day*").unwrap(), ["day 1/a.csv", "day 1/deep/c.csv"]);
    assert_eq!(list("**/?.csv").unwrap(), ["b.csv", "day 1/a.csv", "day 1/deep/c.csv"]);
    assert_eq!(list("day*/*.txt").unwrap(), ["day 1/note.txt"]);
    assert_eq!(list("x*.csv").unwrap_err().to_string(), "no file matches the pattern");
}

#[test]
fn a_file_stands_for_itself_and_an_empty_folder_for_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let message = list_recordings(folder.path()).unwrap_err().to_string();
    assert!(message.starts_with("holds no recordings: expected `.csv`"), "{message}");
    assert!(message.ends_with(" files in the folder"), "{message}");
    let missing = folder.path().join("no.csv");
    assert_eq!(list_recordings(&missing).unwrap_err().to_string(), "no such file or folder");
    fs::write(&missing, "").unwrap();
    assert_eq!(list_recordings(&missing).unwrap(), [missing]);
}

#[test]
fn compressed_and_plain_files_hold_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str| {
        let path = folder.path().join(name);
        recording().write(&path, CsvFormat::default()).unwrap();
        let mut read = Recording::read(&path, &ColumnMap::default()).unwrap();
        assert_eq!(std::mem::take(&mut read.name), path.display().to_string());
        read
    };
    assert_eq!(read("r.csv"), read("r.csv.gz"));
}

#[test]
fn a_compressed_file_under_a_plain_name_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r.csv");
    fs::write(&path, recording().to_csv_gz(CsvFormat::default()).unwrap()).unwrap();
    assert!(Recording::read(&path, &ColumnMap::default()).is_ok());
}

#[test]
fn damaged_files_have_one_clear_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    assert_eq!(read_error(&path("none.csv")), "no such file or folder");
    assert_eq!(read_error(&path("none.mat")), "no such file or folder");
    fs::write(path("r.doc"), "time_s,current_a\n").unwrap();
    assert!(read_error(&path("r.doc")).starts_with("not a recording: expected `.csv`"));
    fs::write(path("plain.csv.gz"), "time_s,current_a\n").unwrap();
    assert!(read_error(&path("plain.csv.gz")).starts_with("damaged gzip data: "));
    let whole = recording().to_csv_gz(CsvFormat::default()).unwrap();
    fs::write(path("short.csv.gz"), &whole[..whole.len() / 2]).unwrap();
    assert!(read_error(&path("short.csv.gz")).starts_with("damaged gzip data: "));
    // what a caller prints with its causes says it once
    let error = Recording::read(&path("short.csv.gz"), &ColumnMap::default()).unwrap_err();
    assert!(std::error::Error::source(&error).is_none());
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 0x10;
    fs::write(path("flipped.csv.gz"), &flipped).unwrap();
    assert!(read_error(&path("flipped.csv.gz")).starts_with("damaged gzip data: "));
}

#[test]
fn only_known_names_are_written() {
    let error = recording().write(Path::new("r.mat"), CsvFormat::default()).unwrap_err();
    assert_eq!(error.to_string(), "`r.mat` does not end in `.csv` or `.csv.gz`");
}

/// A real recording of another machine: several runs in one file, so its time
/// starts again, at 25 Hz. Skipped, and said so, where the data are not at hand.
#[test]
fn a_real_recording_of_another_machine_is_refused_with_its_rate() {
    let Some(data) = std::env::var_os("FDI_MEASURED_DATA") else {
        skipped_tests::skip("FDI_MEASURED_DATA does not name the folder of measured data");
        return;
    };
    let path = Path::new(&data).join("cranfield_ema/normal.csv.gz");
    let map = ColumnMap::new(["time_s=time", "current_a=current"]).unwrap();
    let message = Recording::read(&path, &map).unwrap_err().to_string();
    let begins =
        "line 326: time 0 s is not after 12.920000000000002 s (the rows before are at 25 Hz)";
    assert!(message.starts_with(begins), "{message}");
}
