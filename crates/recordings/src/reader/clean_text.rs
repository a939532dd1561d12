//! Bytes of a text as the reader of tables takes them.

use std::borrow::Cow;

/// Bytes without what fills up a file after its text: `NUL` bytes and the end mark of DOS. Those
/// of UTF-16 letters stay.
pub(super) fn without_padding(bytes: &[u8]) -> &[u8] {
    const CTRL_Z: u8 = 0x1a;
    let last = bytes.iter().rposition(|&byte| byte != 0 && byte != CTRL_Z);
    let end = last.map_or(0, |at| at + 1);
    // the second byte of a letter of UTF-16 is NUL as well
    let end = if end % 2 == 1 && bytes[..end].contains(&0) { end + 1 } else { end };
    &bytes[..end.min(bytes.len())]
}

/// A text whose lines end with CR alone, with LF in its place.
pub(super) fn with_line_feeds(bytes: Cow<'_, [u8]>) -> Cow<'_, [u8]> {
    if bytes.contains(&b'\n') || !bytes.contains(&b'\r') {
        return bytes;
    }
    let mut bytes = bytes.into_owned();
    bytes.iter_mut().filter(|byte| **byte == b'\r').for_each(|byte| *byte = b'\n');
    bytes.into()
}

/// A text whose first line has its names in single quotes, with double ones in their place.
pub(super) fn with_double_quotes(bytes: Cow<'_, [u8]>) -> Cow<'_, [u8]> {
    let line = bytes.split(|&byte| byte == b'\n').next().unwrap_or_default().trim_ascii_end();
    let is_single = line.len() > 2 && line.starts_with(b"'") && line.ends_with(b"'");
    if !is_single || bytes.contains(&b'"') {
        return bytes;
    }
    let mut bytes = bytes.into_owned();
    bytes.iter_mut().filter(|byte| **byte == b'\'').for_each(|byte| *byte = b'"');
    bytes.into()
}

/// Names of the columns of a text with the annotations of `InfluxDB`.
pub(super) fn annotated_columns(bytes: &[u8]) -> Option<Vec<String>> {
    let mut lines = bytes.split(|&byte| byte == b'\n');
    let marks = [b"#group,".as_slice(), b"#datatype,"];
    let is_annotated = lines.clone().take(3).any(|line| marks.iter().any(|m| line.starts_with(m)));
    let header = lines.find(|line| !line.starts_with(b"#")).filter(|_| is_annotated)?;
    let names = String::from_utf8_lossy(header);
    Some(names.trim().split(',').filter(|name| !name.is_empty()).map(str::to_owned).collect())
}
