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

/// Lines that are looked at for the properties of channels.
const PROPERTY_LINES: usize = 200;
/// Lines of properties after that of the names.
const LOOKED_FOR_PERIOD: usize = 40;

/// A text whose channels stand in pairs of a time and a value under lines of properties, as `TwinCAT`
/// Scope writes them, with one line of names in place of that of `Name`; the lines of properties between
/// it and the numbers are emptied, so that all others keep their numbers.
pub(super) fn with_names_of_pairs(bytes: Cow<'_, [u8]>) -> Cow<'_, [u8]> {
    let Some((place, named)) = names_of_pairs(&bytes) else { return bytes };
    let mut lines: Vec<&[u8]> = bytes.split(|&byte| byte == b'\n').collect();
    lines[place] = named.as_bytes();
    let is_property = |line: &[u8]| !matches!(line.first(), None | Some(b'0'..=b'9' | b'-' | b'+'));
    let properties =
        lines[place + 1..].iter().take_while(|line| line.is_empty() || is_property(line));
    let end = place + 1 + properties.count();
    lines[place + 1..end].fill(b"");
    lines.join(&b'\n').into()
}

/// The line of `Name` before each of two channels or more, and the names that take its place.
fn names_of_pairs(bytes: &[u8]) -> Option<(usize, String)> {
    let lines: Vec<&[u8]> = bytes.split(|&byte| byte == b'\n').take(PROPERTY_LINES).collect();
    let cells = |line: &[u8]| -> Vec<String> {
        String::from_utf8_lossy(line).trim().split('\t').map(str::to_owned).collect()
    };
    let is_paired = |cells: &Vec<String>| {
        cells.len() >= 4
            && cells.len().is_multiple_of(2)
            && cells.iter().step_by(2).all(|cell| *cell == cells[0])
            && cells[0] == "Name"
    };
    // nearly no text has such a line, and each is looked at
    let may_name = |(_, line): &(usize, &&[u8])| line.trim_ascii_start().starts_with(b"Name\t");
    let named = lines.iter().enumerate().filter(may_name);
    let (place, names) =
        named.map(|(place, line)| (place, cells(line))).find(|(_, cells)| is_paired(cells))?;
    let rest = lines[place + 1..].iter().map(|line| cells(line));
    let period = rest.take(LOOKED_FOR_PERIOD).find(|cells| cells[0].starts_with("SampleTime"))?;
    let unit = period[0].trim_start_matches("SampleTime");
    let pair = |(index, pair): (usize, &[String])| match index {
        0 => format!("Time {unit}\t{}", pair[1]),
        _ => format!("Time {} {unit}\t{}", index + 1, pair[1]),
    };
    let named: Vec<String> = names.chunks(2).enumerate().map(pair).collect();
    Some((place, named.join("\t")))
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
