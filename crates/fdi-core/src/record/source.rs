//! Files and folders of recordings.

use std::{
    fs::{self, File},
    io::{self, BufReader, ErrorKind, Read},
    path::{Path, PathBuf},
};

use flate2::bufread::MultiGzDecoder;

use super::RecordError;

/// Most text that one recording may hold: a day of four channels at 2 kHz is
/// about 6 GB, a manoeuvre below 10 MB; what is larger is a mistake or a
/// decompression bomb.
const LIMIT_BYTES: u64 = 1 << 30;

/// First bytes of gzip data (RFC 1952, 2.3.1).
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// How the text of a recording is packed, by the name of its file.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Packing {
    /// `.csv`
    Plain,
    /// `.csv.gz`
    Gzip,
}

impl Packing {
    pub(super) fn of(path: &Path) -> Option<Self> {
        let ends_in = |path: &Path, with: &str| {
            path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(with))
        };
        if ends_in(path, "csv") {
            return Some(Self::Plain);
        }
        let inner = Path::new(path.file_stem()?);
        (ends_in(path, "gz") && ends_in(inner, "csv")).then_some(Self::Gzip)
    }
}

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
    Packing::of(Path::new(name)).is_some() && !truth && !name.starts_with('.')
}

/// The text of a recording, decompressed where it is compressed.
pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>, RecordError> {
    let Some(packing) = Packing::of(path) else {
        // what does not exist is said so first
        fs::metadata(path).map_err(unreadable)?;
        return Err(RecordError::UnknownFormat);
    };
    let file = File::open(path).map_err(unreadable)?;
    let raw = read_up_to(LIMIT_BYTES, file).map_err(unreadable)?;
    unpack(raw, packing, LIMIT_BYTES)
}

/// The text in the bytes of a file.
fn unpack(raw: Vec<u8>, packing: Packing, limit_bytes: u64) -> Result<Vec<u8>, RecordError> {
    let bytes = if packing == Packing::Gzip || raw.starts_with(&GZIP_MAGIC) {
        let decoder = MultiGzDecoder::new(BufReader::new(raw.as_slice()));
        read_up_to(limit_bytes, decoder).map_err(|source| RecordError::Gzip { source })?
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

fn unreadable(source: io::Error) -> RecordError {
    if source.kind() == ErrorKind::NotFound {
        return RecordError::NotFound;
    }
    RecordError::Unreadable { source }
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
        let error = unpack(bomb.clone(), Packing::Gzip, 1000).unwrap_err();
        assert_eq!(error.to_string(), "more than 1000 bytes of text");
        assert_eq!(unpack(bomb, Packing::Gzip, 100_000).unwrap().len(), 100_000);
        let plain = unpack(vec![b' '; 1001], Packing::Plain, 1000).unwrap_err();
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
