//! Sizes that the pages of a Parquet column claim to unpack to, read before they are unpacked.
//!
//! The decoder takes memory on the word of a page's header. The headers are Thrift structs in
//! the compact protocol (`parquet.thrift`, `PageHeader`; Thrift compact protocol encoding):
//! field 2 is the size unpacked, field 3 the size in the file.

use crate::{FileFormat, RecordError};

/// Most that one page may claim: writers make pages of about 1 MB, some one of a row group.
const LIMIT_PAGE_BYTES: i64 = 128 << 20;
/// Structs inside structs; a page header has two levels.
const MAX_DEPTH: u32 = 8;

/// Refuses the pages of a column chunk when one of them claims too much.
///
/// A header that is not understood is refused: the decoder may understand it differently, and
/// take a count from a number that is too long to be one.
pub(super) fn check_pages(mut chunk: &[u8]) -> Result<(), RecordError> {
    let damaged = |reason: String| RecordError::Damaged { format: FileFormat::Parquet, reason };
    while !chunk.is_empty() {
        let mut reader = Compact { bytes: chunk };
        let Some(Header { unpacked, packed, entries }) = reader.header() else {
            return Err(damaged("the header of a page cannot be read".to_owned()));
        };
        // an entry of a dictionary takes a byte or more
        if unpacked > LIMIT_PAGE_BYTES || entries.is_some_and(|entries| entries > unpacked) {
            return Err(damaged(format!("a page claims {unpacked} bytes")));
        }
        let Some(rest) = usize::try_from(packed).ok().and_then(|size| reader.bytes.get(size..))
        else {
            return Ok(());
        };
        chunk = rest;
    }
    Ok(())
}

/// Fields of a page header that matter here.
#[derive(Default)]
struct Header {
    unpacked: i64,
    packed: i64,
    /// Entries, where the page is a dictionary.
    entries: Option<i64>,
}

/// The compact protocol of Thrift.
struct Compact<'a> {
    bytes: &'a [u8],
}

impl Compact<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (&first, rest) = self.bytes.split_first()?;
        self.bytes = rest;
        Some(first)
    }

    fn unsigned(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        None
    }

    /// Signed numbers are stored as 0, -1, 1, -2, …
    fn signed(&mut self) -> Option<i64> {
        let value = self.unsigned()?;
        Some((value >> 1).cast_signed() ^ -(value & 1).cast_signed())
    }

    fn skip_bytes(&mut self, count: u64) -> Option<()> {
        self.bytes = self.bytes.get(usize::try_from(count).ok()?..)?;
        Some(())
    }

    /// Number and type of the next field; type 0 at the end.
    fn field(&mut self, before: i64) -> Option<(i64, u8)> {
        let head = self.byte()?;
        let (delta, kind) = (head >> 4, head & 0x0f);
        if kind == 0 {
            return Some((before, 0));
        }
        let id = if delta == 0 { self.signed()? } else { before + i64::from(delta) };
        Some((id, kind))
    }

    fn header(&mut self) -> Option<Header> {
        const DICTIONARY: i64 = 7;
        const STRUCT: u8 = 12;
        let mut header = Header::default();
        let mut id = 0;
        loop {
            let kind;
            (id, kind) = self.field(id)?;
            match (id, kind) {
                (_, 0) => return Some(header),
                (2, 5) => header.unpacked = self.signed()?,
                (3, 5) => header.packed = self.signed()?,
                (DICTIONARY, STRUCT) => header.entries = Some(self.first_number()?),
                _ => self.skip(kind, 0)?,
            }
        }
    }

    /// The first field of a struct, a number, and past the rest of it.
    fn first_number(&mut self) -> Option<i64> {
        let (mut number, mut id) = (0, 0);
        loop {
            let kind;
            (id, kind) = self.field(id)?;
            match (id, kind) {
                (_, 0) => return Some(number),
                (1, 5) => number = self.signed()?,
                _ => self.skip(kind, 1)?,
            }
        }
    }

    fn skip(&mut self, kind: u8, depth: u32) -> Option<()> {
        if depth > MAX_DEPTH {
            return None;
        }
        match kind {
            // truths stand in the type itself
            1 | 2 => Some(()),
            3 => self.skip_bytes(1),
            4..=6 => self.unsigned().map(|_| ()),
            7 => self.skip_bytes(8),
            8 => {
                let size = self.unsigned()?;
                self.skip_bytes(size)
            }
            12 => {
                let mut id = 0;
                loop {
                    let kind;
                    (id, kind) = self.field(id)?;
                    if kind == 0 {
                        return Some(());
                    }
                    self.skip(kind, depth + 1)?;
                }
            }
            // lists, sets and maps are in no page header
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A page header: type 0, sizes, and the header of a dictionary with some entries.
    fn page(unpacked: i32, entries: i32) -> Vec<u8> {
        let number = |value: i32| {
            let mut rest = ((value << 1) ^ (value >> 31)).cast_unsigned();
            let mut bytes = Vec::new();
            while rest >= 0x80 {
                bytes.push(rest as u8 | 0x80);
                rest >>= 7;
            }
            bytes.push(rest as u8);
            bytes
        };
        [
            &[0x15][..],
            &number(2),
            &[0x15],
            &number(unpacked),
            &[0x15],
            &number(3),
            // field 7, a struct of one number and one truth
            &[0x4c, 0x15],
            &number(entries),
            &[0x21, 0x00],
            &[0x00],
            b"abc",
        ]
        .concat()
    }

    #[test]
    fn pages_that_claim_too_much_are_refused() {
        assert!(check_pages(&[page(100, 10), page(1 << 20, 5)].concat()).is_ok());
        let error = check_pages(&[page(100, 10), page(i32::MAX, 5)].concat()).unwrap_err();
        let message = "damaged `.parquet` file: a page claims 2147483647 bytes";
        assert_eq!(error.to_string(), message);
        assert!(check_pages(&page(100, 1 << 30)).is_err());
    }

    #[test]
    fn headers_that_cannot_be_read_are_refused() {
        let message = "damaged `.parquet` file: the header of a page cannot be read";
        // a number of more bytes than any has, of which a decoder may take the lowest bits
        let mut long = page(100, 10);
        let count = long.iter().position(|&byte| byte == 20).unwrap();
        long.splice(count..count, [0xc0; 12]);
        for header in [&long[..], b"\xff\xff\xff", &page(100, 10)[..4]] {
            assert_eq!(check_pages(header).unwrap_err().to_string(), message);
        }
    }
}
