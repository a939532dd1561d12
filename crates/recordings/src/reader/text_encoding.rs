//! Encodings of the texts that loggers and spreadsheets write.

use std::{borrow::Cow, string::FromUtf16Error};

/// UTF-8 byte-order mark, which spreadsheets put before the text.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
/// Characters that Windows-1252 has from 0x80 to 0x9f; a blank where it has none.
const WINDOWS_1252: &str = "€ ‚ƒ„…†‡ˆ‰Š‹Œ Ž  ‘’“”•–—˜™š›œ žŸ";

/// Encoding of a text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum TextEncoding {
    #[default]
    Utf8,
    Utf16,
    /// Latin-1 with more signs, as European spreadsheets write it.
    Windows1252,
}

impl TextEncoding {
    /// The text in UTF-8 without a byte-order mark, and its encoding; `None` where it says to be
    /// UTF-16 and is not. What is no text stays as it is.
    pub(super) fn decoded(bytes: &[u8]) -> Option<(Cow<'_, [u8]>, Self)> {
        if let Some(text) = of_utf16(bytes) {
            return Some((text.ok()?.into_bytes().into(), Self::Utf16));
        }
        let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
        let other = || str::from_utf8(bytes).is_err().then(|| of_windows_1252(bytes))?;
        Some(match other() {
            Some(text) => (text.into_bytes().into(), Self::Windows1252),
            None => (bytes.into(), Self::Utf8),
        })
    }
}

/// The text, if the first bytes are of UTF-16.
fn of_utf16(bytes: &[u8]) -> Option<Result<String, FromUtf16Error>> {
    let little = |pair: &[u8]| u16::from_le_bytes([pair[0], pair[1]]);
    let big = |pair: &[u8]| u16::from_be_bytes([pair[0], pair[1]]);
    let (units, is_little) = match bytes {
        [0xff, 0xfe, rest @ ..] => (rest, true),
        [0xfe, 0xff, rest @ ..] => (rest, false),
        // without a mark: the high bytes of Latin letters
        [first, 0, second, 0, ..] if *first != 0 && *second != 0 => (bytes, true),
        [0, first, 0, second, ..] if *first != 0 && *second != 0 => (bytes, false),
        _ => return None,
    };
    let pairs = units.chunks_exact(2);
    let units: Vec<u16> =
        pairs.map(|pair| if is_little { little(pair) } else { big(pair) }).collect();
    Some(String::from_utf16(&units))
}

/// The text, if all bytes are letters or signs of Windows-1252.
fn of_windows_1252(bytes: &[u8]) -> Option<String> {
    let signs: Vec<char> = WINDOWS_1252.chars().collect();
    let letter = |&byte: &u8| match byte {
        b'\t' | b'\n' | b'\r' | 0x0c | 0x1a | 0x20..=0x7e | 0xa0.. => Some(char::from(byte)),
        0x80..=0x9f => Some(signs[usize::from(byte - 0x80)]).filter(|sign| *sign != ' '),
        _ => None,
    };
    bytes.iter().map(letter).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn utf_16_is_known_by_its_mark_or_its_zeros() {
        for (mark, big) in [(true, false), (true, true), (false, false), (false, true)] {
            let text = if mark { "\u{feff}t;°C\n" } else { "t;°C\n" };
            let bytes = |unit: u16| if big { unit.to_be_bytes() } else { unit.to_le_bytes() };
            let bytes: Vec<u8> = text.encode_utf16().flat_map(bytes).collect();
            let (decoded, encoding) = TextEncoding::decoded(&bytes).unwrap();
            assert_eq!(
                (&*decoded, encoding),
                ("t;°C\n".as_bytes(), TextEncoding::Utf16),
                "{mark} {big}"
            );
        }
        let marked = TextEncoding::decoded(b"\xef\xbb\xbft,x").unwrap();
        assert_eq!(marked, (b"t,x".as_slice().into(), TextEncoding::Utf8));
        assert_eq!(TextEncoding::decoded(b"\xff\xfe\x00\xd8"), None);
    }

    #[test]
    fn windows_1252_is_what_is_text_and_not_utf_8() {
        assert_eq!(WINDOWS_1252.chars().count(), 32);
        let (decoded, encoding) = TextEncoding::decoded(b"Pr\xfcfstand \x80\n").unwrap();
        assert_eq!((&*decoded, encoding), ("Prüfstand €\n".as_bytes(), TextEncoding::Windows1252));
        for no_text in [&b"\xfc\0"[..], b"\xfc\x81"] {
            let (same, encoding) = TextEncoding::decoded(no_text).unwrap();
            assert_eq!((&*same, encoding), (no_text, TextEncoding::Utf8));
        }
    }
}
