//! How a text writes a table: encoding, separator, decimals, and where its header stands.

use std::{borrow::Cow, fmt};

use csv::{ByteRecord, ReaderBuilder};

use super::{stamp::Stamp, text_encoding::TextEncoding};
use crate::unit;

/// Lines within which the header of a table is looked for.
const LOOKED_AT_LINES: usize = 400;
/// Rows after a header that have to be numbers.
const ROWS_OF_NUMBERS: usize = 3;
/// Separators, the likelier before the others where two make a table.
const SEPARATORS: [u8; 4] = [b',', b';', b'\t', b' '];

/// Way in which a text writes a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dialect {
    /// Byte between cells; a blank stands for any number of them.
    pub(super) separator: u8,
    /// True where decimals stand after a comma.
    pub(super) has_decimal_comma: bool,
    /// Lines before the header.
    pub(super) skipped: usize,
    /// True where the line after the header has the units of the columns.
    pub(super) has_units: bool,
    /// True where the header stands behind a `#`.
    pub(super) has_marked_header: bool,
    pub(super) encoding: TextEncoding,
}

impl Default for Dialect {
    fn default() -> Self {
        Self {
            separator: b',',
            has_decimal_comma: false,
            skipped: 0,
            has_units: false,
            has_marked_header: false,
            encoding: TextEncoding::Utf8,
        }
    }
}

impl fmt::Display for Dialect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let separator = match self.separator {
            b';' => "semicolons",
            b'\t' => "tabs",
            b' ' => "blanks",
            _ => "commas",
        };
        write!(f, "cells are separated by {separator}")?;
        if self.has_decimal_comma {
            f.write_str(", decimals stand after a comma")?;
        }
        match self.skipped {
            0 => {}
            1 => f.write_str(", one line before the header is skipped")?,
            lines => write!(f, ", {lines} lines before the header are skipped")?,
        }
        if self.has_marked_header {
            f.write_str(", the header stands behind `#`")?;
        }
        if self.has_units {
            f.write_str(", the line after the header has the units")?;
        }
        match self.encoding {
            TextEncoding::Utf8 => Ok(()),
            TextEncoding::Utf16 => f.write_str(", the text is UTF-16"),
            TextEncoding::Windows1252 => f.write_str(", the text is Windows-1252"),
        }
    }
}

/// A table in a text.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Found {
    pub(super) dialect: Dialect,
    /// Byte at which the header begins.
    pub(super) header: usize,
}

/// Looks for the table in a text whose metadata end at `body`; `is_header` tells the cells of a
/// line that is a header for sure.
///
/// A first line that is the header of a plain file is taken as it is. Else the table is where the
/// most cells follow one another as numbers, under a line of as many words.
pub(super) fn find(
    bytes: &[u8],
    body: usize,
    is_header: impl Fn(&[String]) -> bool,
) -> Option<Found> {
    let lines = Line::all(bytes, body);
    let first = lines.first()?;
    if is_header(&first.cells(bytes, b',')?) {
        let table = Table::of(bytes, &lines, b',').filter(|table| table.header == first.start);
        let (has_units, has_decimal_comma) =
            table.map_or((false, false), |table| (table.has_units, table.has_decimal_comma));
        return Some(Found {
            dialect: Dialect { has_decimal_comma, has_units, ..Dialect::default() },
            header: first.start,
        });
    }
    let tables = SEPARATORS.iter().filter_map(|&separator| Table::of(bytes, &lines, separator));
    // of two the one with more cells; of as many the first
    let best = tables.reduce(|best, next| if next.width > best.width { next } else { best });
    let marked = || Table::under_mark(bytes, body, &lines);
    let table = best.or_else(marked)?;
    let skipped = lines.iter().filter(|line| line.start < table.header).count();
    let dialect = Dialect {
        separator: table.separator,
        has_decimal_comma: table.has_decimal_comma,
        skipped,
        has_units: table.has_units,
        has_marked_header: table.is_marked,
        encoding: TextEncoding::Utf8,
    };
    Some(Found { dialect, header: table.header })
}

/// The text with cells apart by one byte, its lines where they were.
pub(super) fn separated<'a>(
    bytes: Cow<'a, [u8]>,
    header: usize,
    dialect: &Dialect,
) -> Cow<'a, [u8]> {
    if dialect.separator != b' ' && !dialect.has_marked_header {
        return bytes;
    }
    let mut bytes = bytes.into_owned();
    if dialect.has_marked_header {
        bytes[header] = b' ';
    }
    if dialect.separator == b' ' {
        let table = single_spaced(&bytes[header..]);
        bytes.truncate(header);
        bytes.extend(table);
    }
    bytes.into()
}

/// The cells of a line.
fn cells(line: &[u8], separator: u8) -> Option<Vec<String>> {
    let spaced;
    let line = if separator == b' ' {
        spaced = single_spaced(line);
        &spaced
    } else {
        line
    };
    if is_plain(line) { split_cells(line, separator) } else { read_cells(line, separator) }
}

/// The cells of a line in which nothing is quoted.
fn split_cells(line: &[u8], separator: u8) -> Option<Vec<String>> {
    line.split(|&byte| byte == separator).map(text_of).collect()
}

/// The cells of a line, by a reader of CSV.
fn read_cells(line: &[u8], separator: u8) -> Option<Vec<String>> {
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(separator)
        .from_reader(line);
    let mut record = ByteRecord::new();
    reader.read_byte_record(&mut record).ok()?;
    record.iter().map(text_of).collect()
}

fn text_of(cell: &[u8]) -> Option<String> {
    Some(str::from_utf8(cell).ok()?.trim().to_owned())
}

/// Tells whether every separator of a line parts two cells: nothing is quoted, no mark stands
/// before the text, and it is one line. A reader of CSV, whose tables take longer to make than a
/// line to read, gives such cells too.
fn is_plain(line: &[u8]) -> bool {
    let is_special = |byte: &u8| matches!(byte, b'"' | b'\r' | b'\n');
    !line.is_empty() && !line.starts_with(b"\xef\xbb\xbf") && !line.iter().any(is_special)
}

/// A text whose cells stand apart by any number of blanks, with one between them.
fn single_spaced(text: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(text.len());
    for line in text.split_inclusive(|&byte| byte == b'\n') {
        let words = line.split(|&byte| byte == b' ' || byte == b'\t');
        let content = words.filter(|word| !word.is_empty() && *word != b"\n" && *word != b"\r\n");
        let mut is_first = true;
        for word in content {
            if !is_first {
                out.push(b' ');
            }
            is_first = false;
            out.extend_from_slice(word.trim_ascii_end());
        }
        if line.ends_with(b"\n") {
            out.push(b'\n');
        }
    }
    out
}

/// A line that is not blank.
#[derive(Clone, Copy, Debug)]
struct Line {
    start: usize,
    end: usize,
}

impl Line {
    fn all(bytes: &[u8], body: usize) -> Vec<Self> {
        let mut start = body;
        let mut lines = Vec::new();
        for line in bytes[body..].split_inclusive(|&byte| byte == b'\n').take(LOOKED_AT_LINES) {
            let end = start + line.len();
            if !line.trim_ascii().is_empty() {
                lines.push(Self { start, end });
            }
            start = end;
        }
        lines
    }

    fn text(self, bytes: &[u8]) -> &[u8] {
        bytes[self.start..self.end].trim_ascii_end()
    }

    fn cells(self, bytes: &[u8], separator: u8) -> Option<Vec<String>> {
        cells(self.text(bytes), separator)
    }
}

/// A table found in a text.
#[derive(Debug)]
struct Table {
    separator: u8,
    width: usize,
    header: usize,
    has_units: bool,
    has_decimal_comma: bool,
    is_marked: bool,
}

/// Rows of numbers that follow one another.
struct NumberRows {
    /// Index of the first among the lines.
    first: usize,
    width: usize,
    has_decimal_comma: bool,
}

impl NumberRows {
    fn of(bytes: &[u8], lines: &[Line], separator: u8) -> Option<Self> {
        let rows: Vec<_> = lines
            .iter()
            .map(|line| line.cells(bytes, separator).filter(|cells| is_numbers(cells)))
            .collect();
        let width = |row: &Option<Vec<String>>| row.as_ref().map_or(0, Vec::len);
        let is_start = |&at: &usize| {
            let here = width(&rows[at]);
            let run = rows[at..].iter().take(ROWS_OF_NUMBERS);
            here > 1 && run.into_iter().all(|row| width(row) == here)
        };
        let first = (0..rows.len()).find(is_start)?;
        let all = || rows[first..].iter().flatten().flatten();
        // between commas a number with one is quoted, and may be of thousands
        let are_thousands = separator == b','
            && all().filter(|cell| cell.contains(',')).all(|cell| is_of_thousands(cell));
        let has_point = all().any(|cell| cell.contains('.') && is_number(cell, false));
        let has_comma = all().any(|cell| cell.contains(',') && is_number(cell, true));
        if has_comma && (has_point || are_thousands) {
            return None;
        }
        Some(Self { first, width: width(&rows[first]), has_decimal_comma: has_comma })
    }
}

impl Table {
    fn of(bytes: &[u8], lines: &[Line], separator: u8) -> Option<Self> {
        let NumberRows { first, width, has_decimal_comma } =
            NumberRows::of(bytes, lines, separator)?;
        let words = |at: usize| {
            let cells = lines[at].cells(bytes, separator)?;
            (cells.len() == width && !is_numbers(&cells)).then_some(cells)
        };
        let above = words(first.checked_sub(1)?)?;
        let higher = first.checked_sub(2).and_then(words);
        let is_named = |cells: &Vec<String>| {
            // after a separator at the end of each line there is no name
            let named = cells.strip_suffix(&[String::new()]).unwrap_or(cells);
            let alike = |(at, cell): (usize, &String)| named[..at].contains(cell);
            // a row with a remark is none of names
            let numbers = named.iter().filter(|cell| is_number(cell, false)).count();
            2 * numbers < named.len()
                && named.iter().all(|cell| !cell.is_empty())
                && !named.iter().enumerate().any(alike)
        };
        // under names, words that are no names are units; so are they if they are known
        let has_units = higher.as_ref().is_some_and(is_named) && is_units(&above);
        if !has_units && !is_named(&above) {
            return None;
        }
        let header = lines[first - 1 - usize::from(has_units)].start;
        let is_marked = false;
        Some(Self { separator, width, header, has_units, has_decimal_comma, is_marked })
    }

    /// A table whose header is the last line of the metadata.
    fn under_mark(bytes: &[u8], body: usize, lines: &[Line]) -> Option<Self> {
        let text = bytes[..body].trim_ascii_end();
        let header = text.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
        let words = text[header..].strip_prefix(b"#")?;
        SEPARATORS.iter().find_map(|&separator| {
            let rows = NumberRows::of(bytes, lines, separator)?;
            let cells = cells(words, separator)?;
            let is_header = rows.first == 0
                && cells.len() == rows.width
                && cells.iter().all(|cell| !cell.is_empty());
            is_header.then_some(Self {
                separator,
                width: rows.width,
                header,
                has_units: false,
                has_decimal_comma: rows.has_decimal_comma,
                is_marked: true,
            })
        })
    }
}

/// Tells whether cells under a header are units: at least one that is known, and no numbers but
/// those of pure numbers.
fn is_units(cells: &[String]) -> bool {
    const LONGEST: usize = 8;
    let is_bracketed = |cell: &str| cell.starts_with(['[', '(']) && cell.ends_with([']', ')']);
    let is_short = |cell: &str| cell.chars().count() <= LONGEST && !cell.contains(['_', '=']);
    let is_pure = |cell: &str| cell == "1" || !is_number(cell, false) && !is_number(cell, true);
    cells.iter().any(|cell| unit::is_known(cell) || is_bracketed(cell))
        && cells.iter().all(|cell| is_bracketed(cell) || is_short(cell) && is_pure(cell))
}

/// Tells whether a number with a comma may be one of thousands: three digits follow a first digit
/// that is not 0.
fn is_of_thousands(cell: &str) -> bool {
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let Some((whole, rest)) = cell.trim_start_matches(['-', '+']).split_once(',') else {
        return false;
    };
    rest.len() == 3 && digits(rest) && digits(whole) && !whole.is_empty() && !whole.starts_with('0')
}

/// Tells whether a row is one of samples: numbers or nothing, after a number or a point in time.
fn is_numbers(cells: &[String]) -> bool {
    let number = |cell: &String| is_number(cell, false) || is_number(cell, true);
    let numbers = cells.iter().filter(|cell| number(cell)).count();
    let others = cells.iter().filter(|cell| !cell.is_empty() && !number(cell));
    let are_times = others.clone().all(|cell| Stamp::parse(cell).is_some());
    numbers >= 1 && others.count() <= 1 && are_times
}

/// Tells whether a cell is a number, with a comma for the point if it is `comma`.
fn is_number(cell: &str, comma: bool) -> bool {
    let is_form =
        |text: &str| text.bytes().any(|byte| byte.is_ascii_digit()) && text.parse::<f64>().is_ok();
    if comma {
        return cell.matches(',').count() == 1
            && !cell.contains('.')
            && is_form(&cell.replace(',', "."));
    }
    is_form(cell)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(text: &str) -> Option<(Dialect, &str)> {
        let is_header = |cells: &[String]| cells.iter().any(|cell| cell == "time_s");
        let found = find(text.as_bytes(), 0, is_header)?;
        Some((found.dialect, text[found.header..].lines().next()?))
    }

    #[test]
    fn plain_lines_have_the_cells_that_a_reader_finds() {
        let lines: [&[u8]; 8] =
            [b"a", b"a,b", b"a,,b,", b",", b" a ; b,c ", b"1 2 3", b"1\t2", b"a,\xff"];
        for line in lines {
            assert!(is_plain(line));
            for separator in SEPARATORS {
                assert_eq!(split_cells(line, separator), read_cells(line, separator), "{line:?}");
            }
        }
        // where they would differ, the reader is asked
        for line in [b"\"a,b\",c".as_slice(), b"\xef\xbb\xbfa,b", b"a\rb,c", b""] {
            assert!(!is_plain(line));
            assert_ne!(split_cells(line, b','), read_cells(line, b','), "{line:?}");
        }
    }

    #[test]
    fn tables_are_found_under_what_loggers_write_above_them() {
        let plain = Dialect::default();
        assert_eq!(found("time_s,x\n0,1\n"), Some((plain, "time_s,x")));
        let (dialect, header) = found("Zeit;I_A\n0,0001;1,5\n0,0002;1,5\n").unwrap();
        assert_eq!((dialect.separator, dialect.has_decimal_comma), (b';', true));
        assert_eq!(header, "Zeit;I_A");
        let text =
            "Drive X, trace 7\nDate;2026-11-21\n\nt\tia\n[s]\t[mA]\n0\t1.5\n1e-4\t2\n2e-4\t1\n";
        let (dialect, header) = found(text).unwrap();
        assert_eq!((dialect.separator, dialect.skipped, dialect.has_units), (b'\t', 2, true));
        assert_eq!(header, "t\tia");
        let (dialect, header) = found("t   ia\n0.0  1.5\n0.1  2\n").unwrap();
        assert_eq!((dialect.separator, header), (b' ', "t   ia"));
    }

    #[test]
    fn a_row_of_samples_is_no_row_of_units() {
        let (dialect, _) = found("time_s,x,rem\n0,1.5,start\n1,2,\n2,3,\n3,4,\n").unwrap();
        assert!(!dialect.has_units);
        let (dialect, _) = found("time_s,x,n\ns,A,1\n1,2,0\n2,3,0\n3,4,0\n").unwrap();
        assert!(dialect.has_units);
    }

    #[test]
    fn quoted_numbers_may_have_a_decimal_comma() {
        let text = |rows: &str| format!("time_s,x\n{rows}");
        let rows = "\"0,000\",\"1,500\"\n\"0,001\",\"2,500\"\n\"0,002\",\"3,5\"\n";
        assert!(found(&text(rows)).unwrap().0.has_decimal_comma);
        let thousands = "0,\"1,500\"\n1,\"2,500\"\n2,\"3,500\"\n";
        assert!(!found(&text(thousands)).unwrap().0.has_decimal_comma);
    }

    #[test]
    fn separators_at_the_end_of_lines_are_no_column() {
        let (dialect, header) = found("t;ia;\n0;1,5;\n1;2,5;\n2;3;\n").unwrap();
        assert_eq!((dialect.separator, header), (b';', "t;ia;"));
    }

    #[test]
    fn what_is_no_table_is_none() {
        assert_eq!(found("a,b\nc,d\ne,f\n"), None);
        assert_eq!(found("t,x,rem\n0,1,start\n1,2,\n"), None);
        assert_eq!(found("t;x\n0,5;1.5\n0,6;1.5\n"), None);
        assert_eq!(found("1;2\n3;4\n5;6\n"), None);
    }
}
