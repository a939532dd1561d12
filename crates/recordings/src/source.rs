//! Files and folders of recordings.

use std::{
    fs::{self, File},
    io::{self, ErrorKind, Read},
    path::{Path, PathBuf},
};

use crate::{FileFormat, RecordError, sha256::sha256_hex};

/// Most text that one recording may hold: a day of four channels at 2 kHz is
/// about 6 GB, a manoeuvre below 10 MB; what is larger is a mistake or a
/// decompression bomb.
pub(super) const LIMIT_BYTES: u64 = 1 << 30;

/// Folders within folders that are looked into.
const MOST_FOLDERS_DEEP: usize = 32;

/// The recordings that a path stands for, in the order of their names: the file itself, those in
/// the folder and the folders in it, or, where there is no such file, those that match a pattern
/// with `*`, `?`, `[a-z]` or `**` (folders of any depth).
///
/// `truth.csv`, trends beside a report, `.txt` files, hidden files, hidden folders and links to
/// folders are left out of folders.
///
/// # Errors
/// [`RecordError::NotFound`], [`RecordError::Unreadable`], [`RecordError::NoRecordings`] for a folder
/// without any, or [`RecordError::NoMatch`].
pub fn list_recordings(path: &Path) -> Result<Vec<PathBuf>, RecordError> {
    let found = match fs::metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return matching(path),
        other => other.map_err(unreadable)?,
    };
    if !found.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let mut found = Vec::new();
    add_folder(path, MOST_FOLDERS_DEEP, &mut found)?;
    if found.is_empty() {
        return Err(RecordError::NoRecordings);
    }
    found.sort();
    Ok(found)
}

/// Adds the recordings in a folder and the folders in it.
fn add_folder(folder: &Path, deep: usize, found: &mut Vec<PathBuf>) -> Result<(), RecordError> {
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let entry = entry.map_err(unreadable)?;
        let name = entry.file_name();
        let name = name.to_string_lossy();
        // a link to a folder may lead back to where it stands
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if is_folder && !name.starts_with('.') && deep > 0 {
            add_folder(&entry.path(), deep - 1, found)?;
        } else if is_recording(&name) && !is_of_a_report(&entry.path()) && entry.path().is_file() {
            found.push(entry.path());
        }
    }
    Ok(())
}

/// Tells whether a file holds the trends that `fdi diagnose --report` writes beside a page.
fn is_of_a_report(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.strip_suffix("-fleet.csv");
    stem.is_some_and(|stem| path.with_file_name(format!("{stem}.html")).is_file())
}

/// The recordings that match a pattern.
fn matching(pattern: &Path) -> Result<Vec<PathBuf>, RecordError> {
    let text = pattern.to_str().filter(|text| text.contains(['*', '?', '[']));
    let hidden = glob::MatchOptions { require_literal_leading_dot: true, ..Default::default() };
    let Some(paths) = text.and_then(|text| glob::glob_with(text, hidden).ok()) else {
        return Err(RecordError::NotFound);
    };
    let mut found = Vec::new();
    // what cannot be looked into matches nothing
    for path in paths.flatten() {
        if path.is_dir() {
            add_folder(&path, MOST_FOLDERS_DEEP, &mut found)?;
        } else {
            found.push(path);
        }
    }
    if found.is_empty() {
        return Err(RecordError::NoMatch);
    }
    found.sort();
    // a folder and a file in it may both match
    found.dedup();
    Ok(found)
}

/// Tells whether a file of that name in a folder is a recording.
fn is_recording(name: &str) -> bool {
    let lower = name.to_ascii_lowercase();
    let truth = lower == "truth.csv" || lower == "truth.csv.gz";
    let format = FileFormat::of(Path::new(name)).filter(|format| format.is_built_in());
    // a text beside recordings is mostly a note
    let is_table = format.is_some_and(|format| format != FileFormat::Txt);
    is_table && !truth && !name.starts_with('.')
}

/// SHA-256 of the bytes of a recording's file, hexadecimal.
///
/// # Errors
/// [`RecordError::NotFound`], [`RecordError::Unreadable`], [`RecordError::UnknownFormat`] or
/// [`RecordError::TooLarge`]; what the bytes mean is not looked at.
pub fn recording_sha256(path: &Path) -> Result<String, RecordError> {
    Ok(sha256_hex(&read_bytes(path)?.1))
}

/// The bytes of a recording as they are on disk, and their form.
pub(super) fn read_bytes(path: &Path) -> Result<(FileFormat, Vec<u8>), RecordError> {
    let Some(format) = FileFormat::of(path) else {
        // what does not exist is said so first
        fs::metadata(path).map_err(unreadable)?;
        return Err(RecordError::UnknownFormat { advice: FileFormat::advice(path) });
    };
    // a pipe without a writer would never open
    if !fs::metadata(path).map_err(unreadable)?.is_file() {
        return Err(RecordError::NotAFile);
    }
    let file = File::open(path).map_err(unreadable)?;
    let raw = read_up_to(LIMIT_BYTES, file).map_err(unreadable)?;
    if raw.len() as u64 > LIMIT_BYTES {
        return Err(RecordError::TooLarge { limit_bytes: LIMIT_BYTES });
    }
    let shown = FileFormat::of_bytes(&raw);
    let is_text = matches!(shown, FileFormat::Csv | FileFormat::CsvGz);
    // an ending such as `.dat` is that of many formats
    let format = if format == FileFormat::Txt && !is_text { shown } else { format };
    Ok((format, raw))
}

/// Reads to the end or to one byte past the limit.
pub(super) fn read_up_to(limit_bytes: u64, from: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    from.take(limit_bytes + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn unreadable(reason: io::Error) -> RecordError {
    if reason.kind() == ErrorKind::NotFound {
        return RecordError::NotFound;
    }
    RecordError::Unreadable { reason }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knows_recordings_by_their_names() {
        for name in ["r01.csv", "r01.csv.gz", "R02.CSV", "truth2.csv"] {
            assert!(is_recording(name), "{name}");
        }
        for name in ["truth.csv", "truth.csv.gz", "._r01.csv", ".csv", "r01.txt", "r01.gz", "csv"] {
            assert!(!is_recording(name), "{name}");
        }
    }
}
