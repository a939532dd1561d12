//! Elapsed times in Parquet, which has no type of its own for them.
//!
//! Arrow writes them as whole numbers and keeps their unit in its schema, a message of Arrow's IPC
//! format in base64: a `FlatBuffer` of which only the fields of the schema are walked through.
//!
//! # Source
//! Apache Arrow, `format/Message.fbs` and `format/Schema.fbs`; the layout of `FlatBuffers`.

/// Type `Duration` in the union of types.
const DURATION: u8 = 18;
/// Header `Schema` in the union of messages.
const SCHEMA: u8 = 1;
/// Fields of tables, in the order of their declaration.
const MESSAGE_HEADER_TYPE: usize = 1;
const MESSAGE_HEADER: usize = 2;
const SCHEMA_FIELDS: usize = 1;
const FIELD_NAME: usize = 0;
const FIELD_TYPE_TYPE: usize = 2;
const FIELD_TYPE: usize = 3;
const DURATION_UNIT: usize = 0;
/// Unit where none is written: milliseconds.
const DEFAULT_UNIT: u8 = 1;
/// Most columns that are looked at.
const MOST_FIELDS: usize = 10_000;

/// Columns of elapsed times by their names, with the units of each in a second; empty where the
/// text is no schema.
pub(super) fn elapsed_per_second(schema: &str) -> Vec<(String, f64)> {
    of_schema(schema).unwrap_or_default()
}

fn of_schema(schema: &str) -> Option<Vec<(String, f64)>> {
    let bytes = base64(schema)?;
    // a message begins with a mark of four bytes and its length
    let message = if bytes.starts_with(&[0xff; 4]) { bytes.get(8..)? } else { bytes.get(4..)? };
    let root = Table::at(message, word(message, 0)?)?;
    if root.byte(MESSAGE_HEADER_TYPE)? != SCHEMA {
        return None;
    }
    let fields = root.table(MESSAGE_HEADER)?.pointer(SCHEMA_FIELDS)?;
    let mut found = Vec::new();
    for index in 0..word(message, fields)?.min(MOST_FIELDS) {
        let at = fields + 4 + 4 * index;
        let field = Table::at(message, at.checked_add(word(message, at)?)?)?;
        if field.byte(FIELD_TYPE_TYPE) != Some(DURATION) {
            continue;
        }
        let unit = field.table(FIELD_TYPE)?.byte(DURATION_UNIT).unwrap_or(DEFAULT_UNIT);
        let per_second = [1.0, 1e3, 1e6, 1e9].get(usize::from(unit))?;
        found.push((field.text(FIELD_NAME)?, *per_second));
    }
    Some(found)
}

/// A table of a `FlatBuffer`.
struct Table<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Table<'a> {
    fn at(bytes: &'a [u8], at: usize) -> Option<Self> {
        bytes.get(at..at.checked_add(4)?)?;
        Some(Self { bytes, at })
    }

    /// Place of a field; `None` where it is not written.
    fn field(&self, index: usize) -> Option<usize> {
        let to_layout = i32::from_le_bytes(self.bytes.get(self.at..self.at + 4)?.try_into().ok()?);
        let layout = i64::try_from(self.at).ok()?.checked_sub(i64::from(to_layout))?;
        let layout = usize::try_from(layout).ok()?;
        let entry = layout.checked_add(4 + 2 * index)?;
        if entry + 2 > layout + short(self.bytes, layout)? {
            return None;
        }
        let offset = short(self.bytes, entry)?;
        (offset != 0).then_some(self.at + offset)
    }

    fn byte(&self, index: usize) -> Option<u8> {
        self.bytes.get(self.field(index)?).copied()
    }

    /// The place that a field points at.
    fn pointer(&self, index: usize) -> Option<usize> {
        let at = self.field(index)?;
        at.checked_add(word(self.bytes, at)?)
    }

    fn table(&self, index: usize) -> Option<Self> {
        Self::at(self.bytes, self.pointer(index)?)
    }

    fn text(&self, index: usize) -> Option<String> {
        let at = self.pointer(index)?;
        let length = word(self.bytes, at)?;
        let start = at.checked_add(4)?;
        let text = self.bytes.get(start..start.checked_add(length)?)?;
        String::from_utf8(text.to_vec()).ok()
    }
}

fn short(bytes: &[u8], at: usize) -> Option<usize> {
    let two = bytes.get(at..at.checked_add(2)?)?;
    Some(usize::from(u16::from_le_bytes(two.try_into().ok()?)))
}

fn word(bytes: &[u8], at: usize) -> Option<usize> {
    let four = bytes.get(at..at.checked_add(4)?)?;
    usize::try_from(u32::from_le_bytes(four.try_into().ok()?)).ok()
}

/// The bytes of a text in base64 (RFC 4648).
fn base64(text: &str) -> Option<Vec<u8>> {
    let digit = |letter: u8| match letter {
        b'A'..=b'Z' => Some(letter - b'A'),
        b'a'..=b'z' => Some(letter - b'a' + 26),
        b'0'..=b'9' => Some(letter - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    };
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut held) = (0u32, 0);
    for letter in text.trim_end_matches('=').bytes() {
        bits = bits << 6 | u32::from(digit(letter)?);
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held & 0xff) as u8);
        }
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Schema of pyarrow 26.0.1: `pa.schema([("time_s", pa.duration("us")), ("x", pa.float64())])`, serialised.
    const PYARROW: &str = "/////6gAAAAQAAAAAAAKAAwABgAFAAgACgAAAAABBAAMAAAACAAIAAAABAAIAAAABAAAAAIAAABA\
        AAAABAAAANj///8AAAEDEAAAABQAAAAEAAAAAAAAAAEAAAB4AAAAwv///wAAAgAQABQACAAGAAcA\
        DAAAABAAEAAAAAAAARIQAAAAIAAAAAQAAAAAAAAABgAAAHRpbWVfcwAAAAAGAAgABgAGAAAAAAAC\
        AAAAAAA=";

    #[test]
    fn arrow_schemas_name_their_elapsed_times() {
        assert_eq!(elapsed_per_second(PYARROW), [("time_s".to_owned(), 1e6)]);
        assert!(elapsed_per_second("").is_empty());
        assert!(elapsed_per_second("AAAA").is_empty());
        assert!(elapsed_per_second("no schema").is_empty());
    }

    #[test]
    fn no_cut_or_changed_schema_is_trusted() {
        for length in 0..PYARROW.len() {
            elapsed_per_second(&PYARROW[..length]);
            let mut other = PYARROW.as_bytes().to_vec();
            other[length] = b'/';
            elapsed_per_second(str::from_utf8(&other).unwrap());
        }
    }
}
