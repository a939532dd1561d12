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

/// The recordings that a path stands for: the file itself, or those directly in
/// the folder in the order of their names.
///
/// `truth.csv` and hidden files are no recordings.
///
/// # Errors
/// [`RecordError::NotFound`], [`RecordError::Unreadable`], or
/// [`RecordError::NoRecordings`] for a folder without any.
pub fn list_recordings(path: &Path) -> Result<Vec<PathBuf>, RecordError> {
    if !fs::metadata(path).map_err(unreadable)?.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let mut found = Vec::new();
    for entry in fs::read_dir(path).map_err(unreadable)? {
        let entry = entry.map_err(unreadable)?;
        let name = entry.file_name();
        if is_recording(&name.to_string_lossy()) && entry.path().is_file() {
            found.push(entry.path());
        }
    }
    if found.is_empty() {
        return Err(RecordError::NoRecordings);
    }
    found.sort();
    Ok(found)
}

/// Tells whether a file of that name in a folder is a recording.
fn is_recording(name: &str) -> bool {
    let lower = name.to_ascii_lowercase();
    let truth = lower == "truth.csv" || lower == "truth.csv.gz";
    let format = FileFormat::of(Path::new(name)).filter(|format| format.is_built_in());
    format.is_some() && !truth && !name.starts_with('.')
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
        return Err(RecordError::UnknownFormat);
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
