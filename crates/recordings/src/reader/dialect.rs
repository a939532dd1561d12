//! How a text writes a table: encoding, separator, decimals, and where its header stands.

use std::{borrow::Cow, fmt};

use csv::{ByteRecord, ReaderBuilder};

use super::{number_text, stamp::Stamp, text_encoding::TextEncoding};
use crate::unit;

/// Lines within which the header of a table is looked for.
const LOOKED_AT_LINES: usize = 400;
/// Rows after a header that have to be numbers.
const ROWS_OF_NUMBERS: usize = 3;
/// Separators, the likelier before the others where two make a table.
const SEPARATORS: [u8; 5] = [b',', b';', b'\t', b'|', b' '];
/// Marks before a header that make a remark of it for other programs.
const REMARK_MARKS: [u8; 3] = [b'#', b'%', b'!'];
/// Lines over which the quoted names of one header may go.
const MOST_LINES_OF_NAMES: usize = 20;
/// Lines between a header and the samples that are looked at for units.
const MOST_UNDER_HEADER: usize = 3;

/// Way in which a text writes a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dialect {
    /// Byte between cells; a blank stands for any number of them.
    pub(super) separator: u8,
    /// True where decimals stand after a comma.
    pub(super) has_decimal_comma: bool,
    /// Lines before the header.
    pub(super) skipped: usize,
    /// The line after the header that has the units of the columns, from 1.
    pub(super) units_line: Option<usize>,
    /// Lines between the header and the samples.
    pub(super) under_header: usize,
    /// The mark, such as `#`, behind which the header stands.
    pub(super) header_mark: Option<u8>,
    /// True where there is no header, and columns are called by their numbers.
    pub(super) has_no_header: bool,
    /// Lines after the samples that are no samples.
    pub(super) left_after: usize,
    pub(super) encoding: TextEncoding,
}

impl Default for Dialect {
    fn default() -> Self {
        Self {
            separator: b',',
            has_decimal_comma: false,
            skipped: 0,
            units_line: None,
            under_header: 0,
            header_mark: None,
            has_no_header: false,
            left_after: 0,
            encoding: TextEncoding::Utf8,
        }
    }
}

impl fmt::Display for Dialect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let separator = match self.separator {
            b';' => "semicolons",
            b'\t' => "tabs",
            b'|' => "bars",
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
        if let Some(mark) = self.header_mark {
            write!(f, ", the header stands behind `{}`", char::from(mark))?;
        }
        if self.has_no_header {
            f.write_str(", there is no header and columns are called by their numbers")?;
        }
        match self.units_line {
            Some(1) => f.write_str(", the line after the header has the units")?,
            Some(line) => write!(f, ", line {line} after the header has the units")?,
            None => {}
        }
        match self.left_after {
            0 => {}
            1 => f.write_str(", the last line is no sample and left out")?,
            lines => write!(f, ", the last {lines} lines are no samples and left out")?,
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
        let table = Table::of(bytes, &lines, b',', RowForm::Numbers);
        let table = table.filter(|table| table.header == first.start);
        let plain = Dialect::default();
        let dialect = table.map_or(plain, |table| Dialect {
            has_decimal_comma: table.has_decimal_comma,
            units_line: table.units_line,
            under_header: table.under_header,
            ..plain
        });
        return Some(Found { dialect, header: first.start });
    }
    let widest = |form: RowForm| {
        let of = |&separator: &u8| Table::of(bytes, &lines, separator, form);
        let tables = SEPARATORS.iter().filter_map(of);
        // of two the one with more cells; of as many the first
        tables.reduce(|best, next| if next.width > best.width { next } else { best })
    };
    let marked = || Table::under_mark(bytes, body, &lines);
    let bare = || {
        let of = |&separator: &u8| Table::without_header(bytes, &lines, separator);
        let tables = SEPARATORS.iter().filter_map(of);
        tables.reduce(|best, next| if next.width > best.width { next } else { best })
    };
    let table = widest(RowForm::Numbers)
        .or_else(marked)
        .or_else(|| widest(RowForm::WordsToo))
        .or_else(bare)?;
    let skipped = lines.iter().filter(|line| line.start < table.header).count();
    let dialect = Dialect {
        separator: table.separator,
        has_decimal_comma: table.has_decimal_comma,
        skipped,
        units_line: table.units_line,
        under_header: table.under_header,
        header_mark: table.mark,
        has_no_header: table.has_no_header,
        left_after: 0,
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
    if dialect.separator != b' ' && dialect.header_mark.is_none() {
        return bytes;
    }
    let mut bytes = bytes.into_owned();
    if dialect.header_mark.is_some() {
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
        while lines.len() < LOOKED_AT_LINES && start < bytes.len() {
            let end = start + Self::length(&bytes[start..]);
            if !bytes[start..end].trim_ascii().is_empty() {
                lines.push(Self { start, end });
            }
            start = end;
        }
        lines
    }

    /// Bytes of the first line with its end. A quoted name may have several lines; a quote that does not end
    /// soon is none.
    fn length(bytes: &[u8]) -> usize {
        let (mut length, mut first, mut is_quoted) = (0, None, false);
        for line in bytes.split_inclusive(|&byte| byte == b'\n').take(MOST_LINES_OF_NAMES) {
            length += line.len();
            first.get_or_insert(length);
            is_quoted = line.iter().filter(|&&byte| byte == b'"').fold(is_quoted, |is, _| !is);
            if !is_quoted {
                return length;
            }
        }
        first.unwrap_or(length)
    }

    fn text(self, bytes: &[u8]) -> &[u8] {
        let line = &bytes[self.start..self.end];
        // tabs at the end part cells
        let end = line.iter().rposition(|byte| !matches!(byte, b'\r' | b'\n' | b' '));
        &line[..end.map_or(0, |last| last + 1)]
    }

    fn cells(self, bytes: &[u8], separator: u8) -> Option<Vec<String>> {
        cells(self.text(bytes), separator)
    }
}

/// Cells that a row of samples may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RowForm {
    /// Numbers or nothing, and one point in time.
    Numbers,
    /// At least two numbers, and words in no more cells than these.
    WordsToo,
}

impl RowForm {
    fn is_samples(self, cells: &[String]) -> bool {
        let is_lacking = |cell: &&String| cell.is_empty() || number_text::is_lacking(cell);
        let number = |cell: &&String| is_number(cell, false) || is_number(cell, true);
        let numbers = cells.iter().filter(number).count();
        let others = || cells.iter().filter(|cell| !is_lacking(cell) && !number(cell));
        let are_times = || others().all(|cell| Stamp::parse(cell).is_some());
        match self {
            Self::Numbers => numbers >= 1 && others().count() <= 1 && are_times(),
            Self::WordsToo => numbers >= 2 && others().count() <= numbers,
        }
    }
}

/// A table found in a text.
#[derive(Debug)]
struct Table {
    separator: u8,
    width: usize,
    header: usize,
    units_line: Option<usize>,
    under_header: usize,
    has_decimal_comma: bool,
    mark: Option<u8>,
    has_no_header: bool,
}

/// Rows of numbers that follow one another.
struct NumberRows {
    /// Index of the first among the lines.
    first: usize,
    width: usize,
    /// Cells up to the last that is not empty in one of the first rows.
    filled: usize,
    has_decimal_comma: bool,
}

impl NumberRows {
    fn of(bytes: &[u8], lines: &[Line], separator: u8, form: RowForm) -> Option<Self> {
        let rows: Vec<_> = lines
            .iter()
            .map(|line| line.cells(bytes, separator).filter(|cells| form.is_samples(cells)))
            .collect();
        let width = |row: &Option<Vec<String>>| row.as_ref().map_or(0, Vec::len);
        let is_start = |&at: &usize| {
            let here = width(&rows[at]);
            let mut run = rows[at..].iter().take(ROWS_OF_NUMBERS);
            here > 1 && run.all(|row| width(row) == here)
        };
        let first = (0..rows.len()).find(is_start)?;
        let all = || rows[first..].iter().flatten().flatten();
        // between commas a number with one is quoted, and may be of thousands
        let are_thousands = separator == b','
            && all().filter(|cell| cell.contains(',')).all(|cell| is_of_thousands(cell));
        let has_point = all().any(|cell| {
            cell.contains('.')
                && is_number(cell, false)
                && !is_of_thousands(&cell.replace('.', ","))
        });
        let has_comma = all().any(|cell| cell.contains(',') && is_number(cell, true));
        if has_comma && (has_point || are_thousands) {
            return None;
        }
        let filled = rows[first..].iter().take(ROWS_OF_NUMBERS).flatten().map(|row| filled(row));
        let filled = filled.max().unwrap_or(0);
        Some(Self { first, width: width(&rows[first]), filled, has_decimal_comma: has_comma })
    }

    /// Tells whether a line with these cells stands over the rows: as many of them, but for empty
    /// ones at the end, or, just over them, one fewer, where rows begin with a name of their own.
    fn are_under(&self, cells: &[String], up: usize) -> bool {
        let named = filled(cells);
        let is_as_long = cells.len() == self.width;
        let covers = named >= self.filled && named <= self.width;
        let is_shifted = up == 1 && named > 1 && named + 1 == self.width;
        is_as_long || covers || is_shifted && self.filled == self.width
    }
}

/// Cells up to the last that is not empty.
fn filled(cells: &[String]) -> usize {
    cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1)
}

impl Table {
    fn of(bytes: &[u8], lines: &[Line], separator: u8, form: RowForm) -> Option<Self> {
        let rows = NumberRows::of(bytes, lines, separator, form)?;
        let words = |up: usize| {
            let at = rows.first.checked_sub(up)?;
            let (_, text) = marked(lines[at].text(bytes));
            let cells = cells(text, separator)?;
            (rows.are_under(&cells, up) && !form.is_samples(&cells)).then_some(cells)
        };
        // under names, words that are no names are units; so are they if they are known
        let over = |up: usize| -> Option<(usize, Option<usize>)> {
            let header = words(up)?;
            let under: Vec<_> = (1..up).map(words).collect::<Option<Vec<_>>>()?;
            // the lines under the header, from above
            let units = under.iter().rev().position(|cells| is_units(cells));
            let are_known = under.iter().any(|cells| cells.iter().any(|cell| unit::is_known(cell)));
            let is_header = is_named(&header, are_known) && (up == 1 || units.is_some());
            is_header.then_some((up, units.map(|line| line + 1)))
        };
        let (up, units_line) = (1..=MOST_UNDER_HEADER + 1).rev().find_map(over)?;
        let line = lines[rows.first - up];
        let (mark, _) = marked(line.text(bytes));
        Some(Self {
            separator,
            width: rows.width,
            header: line.start,
            units_line,
            under_header: up - 1,
            has_decimal_comma: rows.has_decimal_comma,
            mark,
            has_no_header: false,
        })
    }

    /// A table whose header is the last line of the metadata.
    fn under_mark(bytes: &[u8], body: usize, lines: &[Line]) -> Option<Self> {
        let text = bytes[..body].trim_ascii_end();
        let header = text.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
        let words = text[header..].strip_prefix(b"#")?;
        SEPARATORS.iter().find_map(|&separator| {
            let rows = NumberRows::of(bytes, lines, separator, RowForm::Numbers)?;
            let cells = cells(words, separator)?;
            let is_header = rows.first == 0
                && cells.len() == rows.width
                && cells.iter().all(|cell| !cell.is_empty());
            is_header.then_some(Self {
                separator,
                width: rows.width,
                header,
                units_line: None,
                under_header: 0,
                has_decimal_comma: rows.has_decimal_comma,
                mark: Some(b'#'),
                has_no_header: false,
            })
        })
    }

    /// A table without names: numbers under nothing, or under lines of other forms. Words over as
    /// many cells are a header, if a bad one.
    fn without_header(bytes: &[u8], lines: &[Line], separator: u8) -> Option<Self> {
        let rows = NumberRows::of(bytes, lines, separator, RowForm::Numbers)?;
        if lines.len() < rows.first + ROWS_OF_NUMBERS {
            return None;
        }
        let above = rows.first.checked_sub(1).and_then(|at| lines[at].cells(bytes, separator));
        let is_header = above.is_some_and(|cells| cells.len() == rows.width);
        Some(Self {
            separator,
            width: rows.width,
            header: lines[rows.first - usize::from(is_header)].start,
            units_line: None,
            under_header: 0,
            has_decimal_comma: rows.has_decimal_comma,
            mark: None,
            has_no_header: !is_header,
        })
    }
}

/// The mark before a line that makes a remark of it, and the line without it.
fn marked(line: &[u8]) -> (Option<u8>, &[u8]) {
    match line {
        [mark, rest @ ..] if REMARK_MARKS.contains(mark) => (Some(*mark), rest),
        _ => (None, line),
    }
}

/// Tells whether cells are names of columns: none twice, few that are numbers, and none empty but
/// the first and those at the end.
fn is_named(cells: &[String], has_units: bool) -> bool {
    let named = &cells[..filled(cells)];
    let alike = |(at, cell): (usize, &String)| named[..at].contains(cell);
    // a row with a remark is none of names; under numbers of channels there are units
    let numbers = named.iter().filter(|cell| is_number(cell, false)).count();
    (has_units || 2 * numbers < named.len())
        && numbers < named.len()
        && named.iter().skip(1).all(|cell| !cell.is_empty())
        && !named.iter().enumerate().any(alike)
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

/// Tells whether a cell is a number, with a comma for the point if it is `comma`.
fn is_number(cell: &str, comma: bool) -> bool {
    let is_form = cell.bytes().any(|byte| byte.is_ascii_digit())
        && (!comma || cell.matches(',').count() == 1);
    is_form && number_text::parse(cell, comma).is_some()
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
        assert_eq!(
            (dialect.separator, dialect.skipped, dialect.units_line.is_some()),
            (b'\t', 2, true)
        );
        assert_eq!(header, "t\tia");
        let (dialect, header) = found("t   ia\n0.0  1.5\n0.1  2\n").unwrap();
        assert_eq!((dialect.separator, header), (b' ', "t   ia"));
    }

    #[test]
    fn a_row_of_samples_is_no_row_of_units() {
        let (dialect, _) = found("time_s,x,rem\n0,1.5,start\n1,2,\n2,3,\n3,4,\n").unwrap();
        assert!(dialect.units_line.is_none());
        let (dialect, _) = found("time_s,x,n\ns,A,1\n1,2,0\n2,3,0\n3,4,0\n").unwrap();
        assert!(dialect.units_line.is_some());
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
        assert_eq!(found("t;x\n0,5;1.5\n0,6;1.5\n"), None);
        assert_eq!(found("1;2\n3;4\n"), None);
    }

    #[test]
    fn numbers_without_names_are_a_table_without_a_header() {
        let (dialect, first) = found("1;2\n3;4\n5;6\n").unwrap();
        assert!(dialect.has_no_header);
        assert_eq!((dialect.separator, first), (b';', "1;2"));
        // names that stand twice are a bad header, and no reason to forget them
        let (dialect, first) = found("a;a\n3;4\n5;6\n7;8\n").unwrap();
        assert!(!dialect.has_no_header);
        assert_eq!(first, "a;a");
    }

    #[test]
    fn names_may_have_several_lines_and_lines_may_end_with_tabs() {
        let (dialect, header) = found("\"t\n[s]\",\"i\n[A]\"\n0,1\n1,1\n2,1\n").unwrap();
        assert!(!dialect.has_no_header);
        assert_eq!(header, "\"t");
        let (dialect, header) = found("t\ti\tremark\n0\t1\t\n1\t1\t\n2\t1\t\n").unwrap();
        assert_eq!((dialect.has_no_header, header), (false, "t\ti\tremark"));
    }

    #[test]
    fn words_may_stand_between_samples() {
        let (dialect, header) =
            found("X 7\nd;t;a;b;s\nx;0,1;1,5;2;ON\nx;0,2;1;2;ON\nx;0,3;1;2;OFF\n").unwrap();
        assert_eq!((dialect.separator, dialect.has_decimal_comma), (b';', true));
        assert_eq!(header, "d;t;a;b;s");
    }

    #[test]
    fn lines_under_a_header_may_be_of_units_and_types() {
        let text = "t;ia;ib\ns;A;A\nREAL;REAL;REAL\n0;1;2\n1;1;2\n2;1;2\n";
        let (dialect, header) = found(text).unwrap();
        assert_eq!((header, dialect.units_line, dialect.under_header), ("t;ia;ib", Some(1), 2));
        let (dialect, header) =
            found("x-axis,1,2\nsecond,Ampere,Ampere\n0,1,2\n1,1,2\n2,1,2\n").unwrap();
        assert_eq!((header, dialect.units_line), ("x-axis,1,2", Some(1)));
    }

    #[test]
    fn headers_may_stand_behind_marks_and_beside_unnamed_columns() {
        let (dialect, _) = found("% t ia\n0 1\n1 1\n2 1\n").unwrap();
        assert_eq!((dialect.header_mark, dialect.separator), (Some(b'%'), b' '));
        let (dialect, header) = found("\"\";t;ia\n1;0,5;1\n2;1,5;1\n3;2,5;1\n").unwrap();
        assert_eq!((dialect.separator, header), (b';', "\"\";t;ia"));
        assert_eq!(found("t|ia;;\n").map(|found| found.1), None);
        assert_eq!(found("t;ia;;\n0;1;;\n1;1;;\n2;1;;\n").unwrap().1, "t;ia;;");
        assert_eq!(found("t;ia\n0;1;\n1;1;\n2;1;\n").unwrap().1, "t;ia");
    }
}
