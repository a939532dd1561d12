//! Artefacts on disk (bundles, datasets): a container around encoded data.
//!
//! ```text
//! offset  size  content
//!      0     8  magic bytes  89 'F' 'D' 'I' 0D 0A 1A 0A
//!      8     4  format version, little endian
//!     12     4  kind of the artefact, little endian
//!     16     8  length n of the payload, little endian
//!     24    32  SHA-256 of bytes 8..24 and the payload
//!     56     n  payload
//! ```
//!
//! The magic bytes are those of PNG in spirit: they catch text-mode transfers
//! (PNG specification, third edition, 5.2). The payload is what this module's
//! codec makes of plain structs, deflated (RFC 1951); nothing else in the workspace knows the codec,
//! so that it can be replaced here (`docs/decisions/0001-bincode-pinned.md`).

use std::io::{self, BufReader, Read, Write};

use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
pub(crate) use bincode::{Decode, Encode};
use flate2::{Compression, bufread::DeflateDecoder, write::DeflateEncoder};
use sha2::{Digest, Sha256};

/// Version of the container and of the payloads' layout.
pub const FORMAT_VERSION: u32 = 10;

const MAGIC: [u8; 8] = *b"\x89FDI\r\n\x1a\n";
const CHECKSUM_START: usize = 24;
const PAYLOAD_START: usize = 56;

/// Most memory that decoding may claim: several times the largest artefact made
/// here, and little enough that damaged lengths cannot exhaust a machine.
pub const DECODE_LIMIT_BYTES: usize = 256 << 20;

/// Bytes that are inflated at a time.
const READ_BYTES: usize = 32 << 10;

/// Kind of an artefact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ArtefactKind {
    /// Snapshots of a reference model.
    Dataset,
    /// Result of the offline stage.
    Bundle,
    /// Evidence of recordings on one unit.
    Unit,
}

impl ArtefactKind {
    const ALL: [Self; 3] = [Self::Dataset, Self::Bundle, Self::Unit];

    fn code(self) -> u32 {
        match self {
            Self::Dataset => 1,
            Self::Bundle => 2,
            Self::Unit => 3,
        }
    }

    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dataset => "dataset",
            Self::Bundle => "bundle",
            Self::Unit => "unit",
        }
    }
}

/// Why an artefact cannot be opened.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// The magic bytes are missing.
    #[error("not an artefact of this tool: expected a {}", expected.name())]
    NotAnArtefact {
        /// Kind that was asked for.
        expected: ArtefactKind,
    },
    /// The file ends early.
    #[error("truncated: {found} bytes of {expected}")]
    Truncated {
        /// Bytes there are.
        found: u64,
        /// Bytes there should be.
        expected: u64,
    },
    /// Written by another version of the format.
    #[error("format version {found}, this tool reads version {expected}")]
    OtherVersion {
        /// Version of the file.
        found: u32,
        /// Version that can be read.
        expected: u32,
    },
    /// Something follows the payload.
    #[error("{extra} bytes follow the {}", kind.name())]
    TrailingBytes {
        /// Bytes that should not be there.
        extra: u64,
        /// Kind that was asked for.
        kind: ArtefactKind,
    },
    /// The content is not what was written.
    #[error("damaged: checksum of the content {found}, of the file {expected}")]
    Checksum {
        /// Checksum of the content, hexadecimal.
        found: String,
        /// Checksum in the file, hexadecimal.
        expected: String,
    },
    /// An artefact of another kind.
    #[error("is a {found}, expected a {}", expected.name())]
    OtherKind {
        /// Kind found.
        found: &'static str,
        /// Kind that was asked for.
        expected: ArtefactKind,
    },
    /// The payload is intact and yet not the data expected.
    #[error("content of the {} cannot be decoded: {reason}", kind.name())]
    Payload {
        /// Kind that was asked for.
        kind: ArtefactKind,
        /// Message of the decoder.
        reason: String,
    },
}

/// Puts a payload, which is deflated, into the container.
pub fn seal(kind: ArtefactKind, payload: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(PAYLOAD_START + payload.len());
    bytes.extend(MAGIC);
    bytes.extend(FORMAT_VERSION.to_le_bytes());
    bytes.extend(kind.code().to_le_bytes());
    bytes.extend((payload.len() as u64).to_le_bytes());
    let checksum = checksum(&bytes[MAGIC.len()..], payload);
    bytes.extend(checksum);
    bytes.extend(payload);
    bytes
}

/// Checks a container and gives its payload, which is deflated.
///
/// # Errors
/// Any [`StoreError`] but [`StoreError::Payload`].
pub fn open(bytes: &[u8], kind: ArtefactKind) -> Result<&[u8], StoreError> {
    if bytes.is_empty() || !bytes.starts_with(&MAGIC[..MAGIC.len().min(bytes.len())]) {
        return Err(StoreError::NotAnArtefact { expected: kind });
    }
    let found = bytes.len() as u64;
    let truncated = |expected| StoreError::Truncated { found, expected };
    let version = word(bytes, 8).ok_or_else(|| truncated(PAYLOAD_START as u64))?;
    if version != FORMAT_VERSION {
        return Err(StoreError::OtherVersion { found: version, expected: FORMAT_VERSION });
    }
    let header = bytes.get(..PAYLOAD_START).ok_or_else(|| truncated(PAYLOAD_START as u64))?;
    let length = u64::from_le_bytes(field(header, 16));
    let expected = length.saturating_add(PAYLOAD_START as u64);
    if found < expected {
        return Err(truncated(expected));
    }
    if found > expected {
        return Err(StoreError::TrailingBytes { extra: found - expected, kind });
    }
    let payload = &bytes[PAYLOAD_START..];
    let (stored, computed): ([u8; 32], _) =
        (field(header, CHECKSUM_START), checksum(&header[MAGIC.len()..CHECKSUM_START], payload));
    if stored != computed {
        let (found, expected) = (hex(&computed), hex(&stored));
        return Err(StoreError::Checksum { found, expected });
    }
    let code = u32::from_le_bytes(field(header, 12));
    if code != kind.code() {
        let other = ArtefactKind::ALL.into_iter().find(|other| other.code() == code);
        let found = other.map_or("artefact of an unknown kind", ArtefactKind::name);
        return Err(StoreError::OtherKind { found, expected: kind });
    }
    Ok(payload)
}

/// Encodes plain data into a container.
pub(crate) fn encode<T: Encode>(kind: ArtefactKind, data: &T) -> Vec<u8> {
    let content = bincode::encode_to_vec(data, codec());
    seal(kind, &deflated(&content.expect("plain data in memory can always be encoded")))
}

/// Decodes plain data from a container.
///
/// The payload is inflated while it is decoded, so memory is claimed for the data alone.
pub(crate) fn decode<T: Decode<()>>(bytes: &[u8], kind: ArtefactKind) -> Result<T, StoreError> {
    let (data, mut content) = decode_beginning(bytes, kind)?;
    let mut rest = content.by_ref().take(DECODE_LIMIT_BYTES as u64);
    let surplus = io::copy(&mut rest, &mut io::sink())
        .map_err(|error| StoreError::Payload { kind, reason: error.to_string() })?;
    let after = content.into_inner().into_inner();
    let extra = surplus + after.len() as u64;
    if extra > 0 {
        return Err(StoreError::TrailingBytes { extra, kind });
    }
    Ok(data)
}

/// Decodes what stands first in a container, without the rest.
pub(crate) fn decode_first<T: Decode<()>>(
    bytes: &[u8],
    kind: ArtefactKind,
) -> Result<T, StoreError> {
    decode_beginning(bytes, kind).map(|(data, _)| data)
}

/// Inflated content of a container.
type Content<'a> = BufReader<DeflateDecoder<&'a [u8]>>;

/// Decodes what stands first in a container, and gives what follows.
fn decode_beginning<T: Decode<()>>(
    bytes: &[u8],
    kind: ArtefactKind,
) -> Result<(T, Content<'_>), StoreError> {
    let mut content = BufReader::with_capacity(READ_BYTES, DeflateDecoder::new(open(bytes, kind)?));
    let data = bincode::decode_from_std_read(&mut content, codec())
        .map_err(|error| StoreError::Payload { kind, reason: error.to_string() })?;
    Ok((data, content))
}

/// Deflates a content as far as it goes.
fn deflated(content: &[u8]) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
    let written = encoder.write_all(content).and_then(|()| encoder.finish());
    written.expect("a Vec takes all bytes")
}

/// Fixed-width little-endian integers; no claim beyond the limit.
fn codec() -> Configuration<LittleEndian, Fixint, Limit<DECODE_LIMIT_BYTES>> {
    bincode::config::standard()
        .with_little_endian()
        .with_fixed_int_encoding()
        .with_limit::<DECODE_LIMIT_BYTES>()
}

fn checksum(header: &[u8], payload: &[u8]) -> [u8; 32] {
    let mut hasher = Sha256::new();
    hasher.update(header);
    hasher.update(payload);
    hasher.finalize().into()
}

/// The little-endian word at an offset, where the bytes reach so far.
fn word(bytes: &[u8], start: usize) -> Option<u32> {
    let bytes = bytes.get(start..start + 4)?;
    Some(u32::from_le_bytes(field(bytes, 0)))
}

/// A field of a header that is long enough.
fn field<const N: usize>(header: &[u8], start: usize) -> [u8; N] {
    header[start..start + N].try_into().expect("the range has N bytes")
}

/// Bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    use std::fmt::Write;
    bytes.iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").expect("a String takes all text");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ArtefactKind::{Bundle, Dataset};

    #[derive(Debug, PartialEq, Encode, Decode)]
    struct Sample {
        name: String,
        values: Vec<f64>,
    }

    fn sample() -> Sample {
        Sample { name: "incipient".to_owned(), values: vec![0.5, -0.0, f64::MIN_POSITIVE] }
    }

    #[test]
    fn data_come_back() {
        let bytes = encode(Bundle, &sample());
        assert_eq!(decode::<Sample>(&bytes, Bundle), Ok(sample()));
    }

    #[test]
    fn each_damage_has_its_message() {
        let good = encode(Bundle, &sample());
        let message = |bytes: &[u8]| decode::<Sample>(bytes, Bundle).unwrap_err().to_string();
        assert_eq!(message(b""), "not an artefact of this tool: expected a bundle");
        assert_eq!(message(b"time_s,current_a\n"), message(b""));
        assert_eq!(message(&good[..4]), "truncated: 4 bytes of 56");
        assert_eq!(message(&good[..20]), "truncated: 20 bytes of 56");
        assert_eq!(
            message(&good[..good.len() - 1]),
            format!("truncated: {} bytes of {}", good.len() - 1, good.len())
        );
        let mut newer = good.clone();
        newer[8] = 11;
        assert_eq!(message(&newer), "format version 11, this tool reads version 10");
        let longer = [&good[..], b"xy"].concat();
        assert_eq!(message(&longer), "2 bytes follow the bundle");
        let dataset = encode(Dataset, &sample());
        assert_eq!(message(&dataset), "is a dataset, expected a bundle");
        let mut flipped = good.clone();
        *flipped.last_mut().unwrap() ^= 1;
        // the two differ in print wherever they differ
        let mut late = good.clone();
        late[CHECKSUM_START + 31] ^= 1;
        for bad in [&flipped, &late] {
            let Err(StoreError::Checksum { found, expected }) = decode::<Sample>(bad, Bundle)
            else {
                panic!("damage goes unnoticed");
            };
            assert!(found.len() == 64 && expected.len() == 64 && found != expected);
        }
    }

    #[test]
    fn any_flipped_bit_is_noticed() {
        let good = encode(Bundle, &sample());
        for bit in 0..good.len() * 8 {
            let mut bad = good.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            assert!(decode::<Sample>(&bad, Bundle).is_err(), "bit {bit}");
        }
    }

    #[test]
    fn a_huge_length_inside_an_intact_container_claims_no_memory() {
        let lie = u64::MAX.to_le_bytes();
        let error = decode::<Vec<f64>>(&seal(Bundle, &deflated(&lie)), Bundle).unwrap_err();
        assert!(matches!(error, StoreError::Payload { .. }), "{error}");
        let half = (1u64 << 40).to_le_bytes();
        let error = decode::<Vec<f64>>(&seal(Bundle, &deflated(&half)), Bundle).unwrap_err();
        assert!(matches!(error, StoreError::Payload { .. }), "{error}");
    }

    #[test]
    fn a_payload_that_inflates_without_end_claims_no_memory() {
        // a length beyond the limit, followed by as many zeros: 1000 times smaller when deflated
        let content = [&(1u64 << 30).to_le_bytes()[..], &vec![0; 1 << 24]].concat();
        let sealed = seal(Bundle, &deflated(&content));
        assert!(sealed.len() < content.len() / 500);
        let error = decode::<Vec<u8>>(&sealed, Bundle).unwrap_err();
        assert!(matches!(error, StoreError::Payload { .. }), "{error}");
    }

    #[test]
    fn a_payload_that_is_not_deflated_or_ends_early_is_refused() {
        let whole = deflated(&[7; 64]);
        for payload in [&[0xff; 16][..], &whole[..whole.len() - 1], &[]] {
            let error = decode::<[u8; 64]>(&seal(Bundle, payload), Bundle).unwrap_err();
            assert!(matches!(error, StoreError::Payload { .. }), "{error}");
        }
    }

    #[test]
    fn a_payload_that_is_longer_than_its_data_is_refused() {
        let error = decode::<u8>(&seal(Bundle, &deflated(&[1, 2, 3])), Bundle).unwrap_err();
        assert_eq!(error, StoreError::TrailingBytes { extra: 2, kind: Bundle });
        let longer = [&deflated(&[1])[..], &[4, 5, 6]].concat();
        let error = decode::<u8>(&seal(Bundle, &longer), Bundle).unwrap_err();
        assert_eq!(error, StoreError::TrailingBytes { extra: 3, kind: Bundle });
    }
}
