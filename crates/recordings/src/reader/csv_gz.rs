//! CSV compressed with gzip (RFC 1952).

use std::io::BufReader;

use flate2::bufread::MultiGzDecoder;

use crate::{
    ColumnMap, RecordError, Recording,
    reader::csv,
    source::{LIMIT_BYTES, read_up_to},
};

/// First bytes of gzip data (RFC 1952, 2.3.1).
const MAGIC: [u8; 2] = [0x1f, 0x8b];

/// Reads a recording.
#[expect(clippy::needless_pass_by_value, reason = "all readers have one signature")]
pub(super) fn read(
    name: String,
    bytes: Vec<u8>,
    map: &ColumnMap,
) -> Result<Recording, RecordError> {
    csv::parse(name, &unpacked(&bytes, LIMIT_BYTES)?, map)
}

/// True where the bytes are gzip data, whatever the name of their file.
pub(super) fn is_compressed(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

fn unpacked(bytes: &[u8], limit_bytes: u64) -> Result<Vec<u8>, RecordError> {
    let decoder = MultiGzDecoder::new(BufReader::new(bytes));
    let text = read_up_to(limit_bytes, decoder).map_err(|reason| RecordError::Gzip { reason })?;
    csv::check_size(&text, limit_bytes)?;
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_unpacks_to_too_much_is_refused_before_it_does() {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
        std::io::Write::write_all(&mut encoder, &vec![b' '; 100_000]).unwrap();
        let bomb = encoder.finish().unwrap();
        assert!(bomb.len() < 1000);
        let error = unpacked(&bomb, 1000).unwrap_err();
        assert_eq!(error.to_string(), "more than 1000 bytes of text");
        assert_eq!(unpacked(&bomb, 100_000).unwrap().len(), 100_000);
        let plain = csv::check_size(&[b' '; 1001], 1000).unwrap_err();
        assert!(matches!(plain, RecordError::TooLarge { limit_bytes: 1000 }));
    }
}
