//! Files and folders of recordings.

use std::{
    fs::{self, File},
    io::{self, BufReader, ErrorKind, Read},
    path::{Path, PathBuf},
};

use flate2::bufread::MultiGzDecoder;

use super::{FileFormat, RecordError};

/// Most text that one recording may hold: a day of four channels at 2 kHz is
/// about 6 GB, a manoeuvre below 10 MB; what is larger is a mistake or a
/// decompression bomb.
const LIMIT_BYTES: u64 = 1 << 30;

/// First bytes of gzip data (RFC 1952, 2.3.1).
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

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

/// Whether a file of that name in a folder is a recording.
fn is_recording(name: &str) -> bool {
    let lower = name.to_ascii_lowercase();
    let truth = lower == "truth.csv" || lower == "truth.csv.gz";
    let format = FileFormat::of(Path::new(name)).filter(|format| format.is_built_in());
    format.is_some() && !truth && !name.starts_with('.')
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

/// The text in the bytes of a file, decompressed where it is compressed.
pub(super) fn text(raw: Vec<u8>, format: FileFormat) -> Result<Vec<u8>, RecordError> {
    unpack(raw, format, LIMIT_BYTES)
}

fn unpack(raw: Vec<u8>, format: FileFormat, limit_bytes: u64) -> Result<Vec<u8>, RecordError> {
    let bytes = if format == FileFormat::CsvGz || raw.starts_with(&GZIP_MAGIC) {
        let decoder = MultiGzDecoder::new(BufReader::new(raw.as_slice()));
        read_up_to(limit_bytes, decoder).map_err(|reason| RecordError::Gzip { reason })?
    } else {
        raw
    };
    if bytes.len() as u64 > limit_bytes {
        return Err(RecordError::TooLarge { limit_bytes });
    }
    Ok(bytes)
}

/// Reads to the end or to one byte past the limit.
fn read_up_to(limit_bytes: u64, from: impl Read) -> io::Result<Vec<u8>> {
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
    fn what_unpacks_to_too_much_is_refused_before_it_does() {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
        io::Write::write_all(&mut encoder, &vec![b' '; 100_000]).unwrap();
        let bomb = encoder.finish().unwrap();
        assert!(bomb.len() < 1000);
        let error = unpack(bomb.clone(), FileFormat::CsvGz, 1000).unwrap_err();
        assert_eq!(error.to_string(), "more than 1000 bytes of text");
        assert_eq!(unpack(bomb, FileFormat::CsvGz, 100_000).unwrap().len(), 100_000);
        let plain = unpack(vec![b' '; 1001], FileFormat::Csv, 1000).unwrap_err();
        assert!(matches!(plain, RecordError::TooLarge { limit_bytes: 1000 }));
    }

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
