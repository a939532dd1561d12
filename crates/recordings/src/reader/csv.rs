//! The text of a recording, row by row.

use std::borrow::Cow;

use csv::{ByteRecord, ReaderBuilder};

use crate::{
    Channel, ChannelName, ClockNote, ColumnMap, Gaps, Metadata, OtherColumn, RecordError,
    Recording, Sampling, SharedNumbers,
    column_map::{Entry, Target},
    evened::{Evener, Untimely},
    lines::Lines,
    long_form::is_long_form,
    reader::{
        csv_gz,
        dialect::{self, Dialect, Found},
        number_text,
        preamble,
        single_precision::SinglePrecision,
        stamp::{Stamp, StampClock},
        text_encoding::TextEncoding,
    },
    recording::MOST_PLAUSIBLE,
    source::LIMIT_BYTES,
    unit::{self, StatedUnit},
};

/// Lines after the samples that may be no samples.
const MOST_LEFT_AFTER: usize = 20;
/// Rows before a line that may be the end of the samples.
const LEAST_ROWS: usize = 100;
/// Longest cell that a message repeats.
const SHOWN_CHARS: usize = 24;

/// Reads a recording; compressed text is known by its first bytes.
pub(super) fn read(
    name: String,
    bytes: Vec<u8>,
    map: &ColumnMap,
) -> Result<Recording, RecordError> {
    if csv_gz::is_compressed(&bytes) {
        return csv_gz::read(name, bytes, map);
    }
    check_size(&bytes, LIMIT_BYTES)?;
    parse(name, &bytes, map)
}

/// Refuses more text than one recording may hold.
pub(super) fn check_size(bytes: &[u8], limit_bytes: u64) -> Result<(), RecordError> {
    if bytes.len() as u64 > limit_bytes {
        return Err(RecordError::TooLarge { limit_bytes });
    }
    Ok(())
}

/// Reads the text of a recording.
pub(super) fn parse(name: String, bytes: &[u8], map: &ColumnMap) -> Result<Recording, RecordError> {
    let bytes = without_padding(bytes);
    let (bytes, encoding) = TextEncoding::decoded(bytes).ok_or(RecordError::NotUtf16)?;
    let bytes = with_double_quotes(with_line_feeds(bytes));
    if bytes.trim_ascii().is_empty() {
        return Err(RecordError::Empty);
    }
    if let Some(columns) = annotated_columns(&bytes).filter(|columns| is_long_form(columns)) {
        return Err(RecordError::LongForm { columns });
    }
    let start = after_lines(&bytes, map.skipped_lines());
    let body = start + metadata_length(&bytes[start..]);
    let plain = Found { dialect: Dialect::default(), header: body };
    let found = dialect::find(&bytes, body, |cells| is_header(cells, map)).unwrap_or(plain);
    let Found { dialect, header } = found;
    let metadata = metadata(&bytes, start, header.min(body))?;
    let step_s = metadata.rate_hz.map(f64::recip);
    let preamble = preamble::step_s(&bytes[..header]);
    let bytes = dialect::separated(bytes, header, &dialect);
    let steps = Steps { stated: step_s, before_header: preamble };
    let Rows { channels, other_columns, lines, clock_notes, stated_units, left_after } =
        rows(&bytes, header, &dialect, map, steps)?;
    let dialect = Dialect { left_after, encoding, ..dialect };
    let mut recording = Recording {
        name,
        metadata,
        channels,
        other_columns,
        lines: Some(lines),
        stated_units,
        clock_notes,
        dialect: (dialect != Dialect::default()).then_some(dialect),
        computed_phase: None,
    };
    recording.complete_star();
    recording.settle_rate()?;
    Ok(recording)
}

/// Bytes without what fills up a file after its text: `NUL` bytes and the end mark of DOS. Those
/// of UTF-16 letters stay.
fn without_padding(bytes: &[u8]) -> &[u8] {
    const CTRL_Z: u8 = 0x1a;
    let last = bytes.iter().rposition(|&byte| byte != 0 && byte != CTRL_Z);
    let end = last.map_or(0, |at| at + 1);
    // the second byte of a letter of UTF-16 is NUL as well
    let end = if end % 2 == 1 && bytes[..end].contains(&0) { end + 1 } else { end };
    &bytes[..end.min(bytes.len())]
}

/// A text whose lines end with CR alone, with LF in its place.
fn with_line_feeds(bytes: Cow<'_, [u8]>) -> Cow<'_, [u8]> {
    if bytes.contains(&b'\n') || !bytes.contains(&b'\r') {
        return bytes;
    }
    let mut bytes = bytes.into_owned();
    bytes.iter_mut().filter(|byte| **byte == b'\r').for_each(|byte| *byte = b'\n');
    bytes.into()
}

/// A text whose first line has its names in single quotes, with double ones in their place.
fn with_double_quotes(bytes: Cow<'_, [u8]>) -> Cow<'_, [u8]> {
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
fn annotated_columns(bytes: &[u8]) -> Option<Vec<String>> {
    let mut lines = bytes.split(|&byte| byte == b'\n');
    let marks = [b"#group,".as_slice(), b"#datatype,"];
    let is_annotated = lines.clone().take(3).any(|line| marks.iter().any(|m| line.starts_with(m)));
    let header = lines.find(|line| !line.starts_with(b"#")).filter(|_| is_annotated)?;
    let names = String::from_utf8_lossy(header);
    Some(names.trim().split(',').filter(|name| !name.is_empty()).map(str::to_owned).collect())
}

/// Times between samples that a text states apart from its table, s.
#[derive(Clone, Copy, Debug)]
struct Steps {
    /// Inverse of `rate-hz` in the metadata.
    stated: Option<f64>,
    /// What the lines before the header seem to say.
    before_header: Option<f64>,
}

/// Reads the table that begins at a byte.
fn rows(
    bytes: &[u8],
    body: usize,
    dialect: &Dialect,
    map: &ColumnMap,
    steps: Steps,
) -> Result<Rows, RecordError> {
    let text = Text { bytes, body };
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(dialect.separator)
        .comment(Some(b'#'))
        .from_reader(&bytes[body..]);
    let mut record = ByteRecord::new();
    let mut next = |record: &mut ByteRecord| {
        // over bytes in memory, and with rows of any length, there is nothing to fail
        reader.read_byte_record(record).expect("reading from memory does not fail")
    };
    if !next(&mut record) {
        return Err(RecordError::NoHeader);
    }
    let mut cursor = LineCursor { bytes, offset: 0, line: 1 };
    let header_line = cursor.line_at(text.start_of(&record));
    let mut columns = header(&record, header_line, dialect.has_no_header)?;
    let mut units = Vec::new();
    let mut is_read = dialect.has_no_header;
    for under in 1..=dialect.under_header {
        let is_there = next(&mut record);
        if is_there && dialect.units_line == Some(under) {
            let text = |cell: &[u8]| String::from_utf8_lossy(cell).trim().to_owned();
            units = record.iter().map(text).collect();
        }
    }
    let has_row = is_read || next(&mut record);
    is_read = true;
    if has_row && filled(&record) == columns.len() + 1 && !record[0].trim_ascii().is_empty() {
        // rows begin with a name of their own, which the header lacks
        columns.insert(0, "column 1".to_owned());
    }
    let mut table = Table::new(&columns, &units, map, header_line, steps)?;
    table.has_decimal_comma = dialect.has_decimal_comma;
    let mut pending: Option<(RowProblem, u64, usize)> = None;
    while (has_row && is_read) || next(&mut record) {
        is_read = false;
        if record.iter().all(|cell| cell.trim_ascii().is_empty()) || is_of_header(&record, &columns)
        {
            continue;
        }
        let line = cursor.line_at(text.start_of(&record));
        match (table.push(&record, line), pending.take()) {
            (Ok(()), None) => {}
            (Err(_), Some((problem, line, lines))) if lines < MOST_LEFT_AFTER => {
                pending = Some((problem, line, lines + 1));
            }
            // samples follow, so that it is not the end; or too many other lines do
            (_, Some((problem, line, _))) => return Err(problem.at(line, &table)),
            (Err(problem), None) if problem.may_end() && table.times_s.len() >= LEAST_ROWS => {
                pending = Some((problem, line, 1));
            }
            (Err(problem), None) => return Err(problem.at(line, &table)),
        }
    }
    let left_after = pending.map_or(0, |(.., lines)| lines);
    let rows = table.finish(header_line, map.gaps())?;
    Ok(Rows { left_after, ..rows })
}

/// Cells up to the last that is not empty.
fn filled(record: &ByteRecord) -> usize {
    let last = record.iter().rposition(|cell| !cell.trim_ascii().is_empty());
    last.map_or(0, |last| last + 1)
}

/// Tells whether a row is the header once more, as parts of a file that were appended have it.
fn is_of_header(record: &ByteRecord, columns: &[String]) -> bool {
    let same = |(cell, name): (&[u8], &String)| cell.trim_ascii() == name.as_bytes();
    record.len() >= columns.len() && record.iter().zip(columns).all(same)
}

/// Tells whether cells are the header of a plain recording.
fn is_header(cells: &[String], map: &ColumnMap) -> bool {
    cells.iter().any(|cell| target_of(cell, map) == Some(Target::Time))
}

/// Byte after so many lines.
fn after_lines(bytes: &[u8], lines: usize) -> usize {
    bytes.split_inclusive(|&byte| byte == b'\n').take(lines).map(<[u8]>::len).sum()
}

/// Bytes of the `#` lines and blank ones at the start.
fn metadata_length(bytes: &[u8]) -> usize {
    let lines = bytes.split_inclusive(|&byte| byte == b'\n');
    let is_metadata = |line: &&[u8]| {
        let content = line.trim_ascii();
        content.is_empty() || content[0] == b'#'
    };
    lines.take_while(is_metadata).map(<[u8]>::len).sum()
}

/// The whole text, to turn a record into a line number when one is needed.
struct Text<'a> {
    bytes: &'a [u8],
    body: usize,
}

impl Text<'_> {
    /// Byte at which a record starts; blank lines before it are skipped.
    fn start_of(&self, record: &ByteRecord) -> usize {
        let offset = record.position().map_or(0, |at| at.byte() as usize) + self.body;
        let blank = self.bytes[offset..].iter().take_while(|&&b| b == b'\r' || b == b'\n').count();
        offset + blank
    }
}

/// Counts lines on the way through a text.
struct LineCursor<'a> {
    bytes: &'a [u8],
    offset: usize,
    line: u64,
}

impl LineCursor<'_> {
    /// Line of a byte that is not before the last one asked for, from 1.
    fn line_at(&mut self, offset: usize) -> u64 {
        let passed = &self.bytes[self.offset..offset];
        self.line += passed.split(|&byte| byte == b'\n').count() as u64 - 1;
        self.offset = offset;
        self.line
    }
}

/// Line of a byte, from 1.
fn line_at(bytes: &[u8], offset: usize) -> u64 {
    bytes[..offset].split(|&byte| byte == b'\n').count() as u64
}

/// Reads the `#` lines between two bytes.
fn metadata(bytes: &[u8], start: usize, end: usize) -> Result<Metadata, RecordError> {
    let mut toml = String::new();
    let first_line = line_at(bytes, start);
    for (line, own) in bytes[start..end].split_inclusive(|&byte| byte == b'\n').enumerate() {
        let line = first_line + line as u64;
        let text = str::from_utf8(own.trim_ascii()).map_err(|_| RecordError::NotUtf8 { line })?;
        toml.push_str(text.strip_prefix('#').unwrap_or(""));
        toml.push('\n');
    }
    Metadata::parse(&toml, first_line)
}

/// The names of the columns; those without one are called by their place.
fn header(record: &ByteRecord, line: u64, is_absent: bool) -> Result<Vec<String>, RecordError> {
    let filled = filled(record);
    if is_absent {
        return Ok((1..=filled).map(|place| format!("column {place}")).collect());
    }
    let mut columns: Vec<String> = Vec::with_capacity(record.len());
    for (index, cell) in record.iter().take(filled).enumerate() {
        let name = str::from_utf8(cell).map_err(|_| RecordError::NotUtf8 { line })?.trim();
        let place;
        let name = if name.is_empty() {
            place = format!("column {}", index + 1);
            &place
        } else {
            name
        };
        if columns.iter().any(|earlier| earlier == name) {
            return Err(RecordError::DuplicateColumn { line, column: name.to_owned() });
        }
        columns.push(name.to_owned());
    }
    if let [only] = columns.as_slice()
        && let Some(found) = [';', '\t'].into_iter().find(|&separator| only.contains(separator))
    {
        return Err(RecordError::Separator { line, found });
    }
    Ok(columns)
}

/// Role of a column in reading.
enum Role {
    Time,
    Known(KnownColumn),
    Other(OtherColumn),
}

/// A channel while its rows arrive.
struct KnownColumn {
    name: ChannelName,
    factor: f64,
    values: Vec<f64>,
    /// Rows of the cells that are not empty, once one was empty; until then all.
    own_rows: Option<Vec<usize>>,
}

/// The columns while rows arrive.
struct Table {
    columns: Vec<String>,
    roles: Vec<Role>,
    /// None where times are those of the rows.
    time_column: Option<usize>,
    time_factor: f64,
    /// Points in time as text, once the first row has one.
    stamps: Option<StampClock>,
    has_decimal_comma: bool,
    /// True where words such as `NaN` stand for no sample.
    skips_lacking: bool,
    stated_units: Vec<StatedUnit>,
    times_s: Vec<f64>,
    time_decimals: i32,
    single: SinglePrecision,
    line_runs: Vec<(usize, u64)>,
}

/// Content of all rows, column by column.
struct Rows {
    channels: Vec<Channel>,
    other_columns: Vec<OtherColumn>,
    lines: Lines,
    clock_notes: Vec<ClockNote>,
    stated_units: Vec<StatedUnit>,
    left_after: usize,
}

/// Fault in a row.
enum RowProblem {
    Ragged { found: usize },
    NotUtf8,
    NotANumber { column: usize, cell: String },
    NotATime { column: usize, cell: String },
    NotFinite { column: usize, cell: String },
    MissingTime { column: usize },
    Hall { column: usize, found: f64 },
    Implausible { column: usize, found: f64 },
}

impl RowProblem {
    /// Tells whether a line with it may be the end of the samples.
    fn may_end(&self) -> bool {
        matches!(self, Self::Ragged { .. } | Self::NotATime { .. })
    }

    fn at(self, line: u64, table: &Table) -> RecordError {
        let name = |column: usize| table.columns[column].clone();
        match self {
            Self::Ragged { found } => {
                RecordError::RaggedRow { line, found, expected: table.columns.len() }
            }
            Self::NotUtf8 => RecordError::NotUtf8 { line },
            Self::NotANumber { column, cell } | Self::NotATime { column, cell } => {
                RecordError::NotANumber { line, column: name(column), found: cell }
            }
            Self::NotFinite { column, cell } => {
                RecordError::NotFinite { line, column: name(column), found: cell }
            }
            Self::MissingTime { column } => {
                RecordError::MissingTime { line, column: name(column) }
            }
            Self::Implausible { column, found } => RecordError::Implausible {
                line: Some(line),
                column: name(column),
                found,
                limit: MOST_PLAUSIBLE,
            },
            Self::Hall { column, found } => {
                RecordError::HallState { line: Some(line), column: name(column), found }
            }
        }
    }
}

impl Table {
    fn new(
        columns: &[String],
        units: &[String],
        map: &ColumnMap,
        line: u64,
        steps: Steps,
    ) -> Result<Self, RecordError> {
        let by_row = |entry: &&Entry| {
            entry.is_of_rows() && !columns.contains(&entry.column)
        };
        let mapped_step_s =
            map.entries().iter().find(by_row).map(|entry| entry.factor.unwrap_or(1.0));
        for entry in map.entries() {
            if !columns.contains(&entry.column) && !by_row(&entry) {
                return Err(RecordError::MappedColumnMissing {
                    line: Some(line),
                    column: entry.column.clone(),
                    channel: entry.target.column(),
                    columns: columns.to_vec(),
                });
            }
        }
        let mut roles = Vec::with_capacity(columns.len());
        let (mut time_column, mut time_factor) = (None, 1.0);
        let mut stated_units = Vec::new();
        for (index, column) in columns.iter().enumerate() {
            let target = target_of(column, map);
            let unit = units.get(index).map(String::as_str);
            let mut factor = 1.0;
            if let Some(target) = target {
                let (by, stated) =
                    unit::stated_factor(column, unit, target, map.of_column(column))?;
                factor = by;
                stated_units.extend(stated);
            }
            roles.push(match target {
                Some(Target::Time) => {
                    (time_column, time_factor) = (Some(index), factor);
                    Role::Time
                }
                Some(Target::Channel(name)) => {
                    let (values, own_rows) = (Vec::new(), None);
                    Role::Known(KnownColumn { name, factor, values, own_rows })
                }
                None => Role::Other(OtherColumn::new(column.clone())),
            });
        }
        let has_channel = roles.iter().any(|role| role.known().is_some());
        if !has_channel && is_long_form(columns) {
            return Err(RecordError::LongForm { columns: columns.to_vec() });
        }
        if time_column.is_none() {
            let step_s = mapped_step_s.or(steps.stated);
            let step_s = step_s.ok_or_else(|| RecordError::NoTime {
                line: Some(line),
                columns: columns.to_vec(),
                step_s: steps.before_header,
            })?;
            if !(step_s.is_finite() && step_s > 0.0) {
                return Err(RecordError::Step { column: "row".to_owned(), step_s });
            }
            time_factor = step_s;
        }
        Ok(Self {
            columns: columns.to_vec(),
            roles,
            time_column,
            time_factor,
            stamps: None,
            has_decimal_comma: false,
            skips_lacking: map.gaps() == Gaps::Bridge,
            stated_units,
            times_s: Vec::new(),
            time_decimals: 0,
            single: SinglePrecision::default(),
            line_runs: Vec::new(),
        })
    }

    fn push(&mut self, record: &ByteRecord, line: u64) -> Result<(), RowProblem> {
        // separators at the end of a row make no cells
        let found = if record.len() > self.columns.len() { filled(record) } else { record.len() };
        if record.len() < self.columns.len() || found > self.columns.len() {
            return Err(RowProblem::Ragged { found });
        }
        let time_s = match self.time_column {
            Some(column) => self.time(column, &record[column])?,
            None => self.row_time(),
        };
        let row = self.times_s.len();
        let has_decimal_comma = self.has_decimal_comma;
        self.times_s.push(time_s);
        let ahead = line - row as u64;
        if self.line_runs.last().is_none_or(|(_, last)| *last != ahead) {
            self.line_runs.push((row, ahead));
        }
        for (column, (role, cell)) in self.roles.iter_mut().zip(record).enumerate() {
            let cell = cell.trim_ascii();
            match role {
                Role::Time => {}
                Role::Other(_) if cell.is_empty() => {}
                Role::Other(other) => {
                    let text = str::from_utf8(cell).map_err(|_| RowProblem::NotUtf8)?;
                    other.push(time_s, text);
                }
                Role::Known(known) if cell.is_empty() => known.skip(row),
                Role::Known(known) if self.skips_lacking && is_lacking(cell) => known.skip(row),
                Role::Known(known) => {
                    known.push(row, number(cell, column, has_decimal_comma)?, column)?;
                }
            }
        }
        Ok(())
    }

    /// The time of the next row, of rows that state none.
    fn row_time(&self) -> f64 {
        let (row, rate_hz) = (self.times_s.len() as f64, self.time_factor.recip().round());
        // a step of 1e-4 s means 10 kHz, and i/10 000 is the nearer double
        let is_whole = (rate_hz * self.time_factor - 1.0).abs() < f64::EPSILON;
        if is_whole { row / rate_hz } else { row * self.time_factor }
    }

    /// Reads the time of a row.
    fn time(&mut self, column: usize, cell: &[u8]) -> Result<f64, RowProblem> {
        let cell = cell.trim_ascii();
        if cell.is_empty() {
            return Err(RowProblem::MissingTime { column });
        }
        let is_first = self.times_s.is_empty();
        if (is_first || self.stamps.is_some())
            && let Some(stamp) = str::from_utf8(cell).ok().and_then(Stamp::parse)
        {
            self.time_decimals = self.time_decimals.max(stamp.decimals);
            return Ok(self.stamps.get_or_insert_default().seconds(stamp));
        }
        if self.stamps.is_some() {
            return Err(RowProblem::NotATime { column, cell: shown(cell) });
        }
        let found = number(cell, column, self.has_decimal_comma).map_err(|problem| match problem {
            RowProblem::NotANumber { column, cell } => RowProblem::NotATime { column, cell },
            other => other,
        })?;
        self.time_decimals = self.time_decimals.max(decimals(cell));
        self.single.look_at(found);
        Ok(found * self.time_factor)
    }

    /// The unit of the last decimal place that the time column uses, or that of single precision, s.
    fn time_quantum_s(&self) -> f64 {
        if self.time_column.is_none() {
            return 0.0;
        }
        let of_decimals = 10f64.powi(-self.time_decimals);
        if self.stamps.is_some() {
            return of_decimals;
        }
        of_decimals.max(self.single.quantum()) * self.time_factor.abs()
    }

    /// Rows that have the time and the samples of the row before.
    fn repeated_rows(&self) -> Vec<usize> {
        let known = || self.roles.iter().filter_map(Role::known);
        let is_repeated = |&row: &usize| {
            self.times_s[row - 1] == self.times_s[row]
                && known().all(|known| known.is_repeated(row))
                && known().next().is_some()
        };
        (1..self.times_s.len()).filter(is_repeated).collect()
    }

    fn finish(self, header_line: u64, gaps: Gaps) -> Result<Rows, RecordError> {
        if self.times_s.is_empty() {
            return Err(RecordError::HeaderOnly { line: header_line });
        }
        let (quantum_s, repeated) = (self.time_quantum_s(), self.repeated_rows());
        let stated_units = self.stated_units;
        let times_s = SharedNumbers::from(self.times_s);
        let lines = Lines::new(times_s.clone(), self.line_runs);
        let mut evener = Evener::new(gaps);
        let axis = TextAxis { times_s: &times_s, lines: &lines, quantum_s };
        // rows without a sample of any channel have times too
        evener
            .check(&times_s, quantum_s, &repeated)
            .map_err(|problem| axis.error(problem.at, problem.can_be_bridged))?;
        let (mut channels, mut others) = (Vec::new(), Vec::new());
        for role in self.roles {
            match role {
                Role::Time => {}
                Role::Other(other) => others.push(other),
                // a column without a single sample is a channel that is not there
                Role::Known(known) if known.values.is_empty() => {}
                Role::Known(KnownColumn { name, values, own_rows, .. }) => {
                    let own_s = own_rows.as_ref().map_or_else(
                        || times_s.clone(),
                        |rows| rows.iter().map(|&row| times_s[row]).collect(),
                    );
                    let channel = evener.channel(name, own_s, values.into(), quantum_s);
                    let row = |index: usize| own_rows.as_ref().map_or(index, |rows| rows[index]);
                    channels.push(channel.map_err(|problem| match problem {
                        Untimely::NotAfter(order) => {
                            axis.error(row(order.at), order.can_be_bridged)
                        }
                        Untimely::Lacking(gap) => {
                            let line = lines.of_row(row(gap.before)) + 1;
                            gap.error(name, Some(line))
                        }
                    })?);
                }
            }
        }
        let clock_notes = evener.into_notes();
        let left_after = 0;
        Ok(Rows { channels, other_columns: others, lines, clock_notes, stated_units, left_after })
    }
}

/// Times of the rows of a text.
struct TextAxis<'a> {
    times_s: &'a [f64],
    lines: &'a Lines,
    quantum_s: f64,
}

impl TextAxis<'_> {
    /// The error of a row whose time is not after that of the row before.
    fn error(&self, row: usize, can_be_bridged: bool) -> RecordError {
        let before = Sampling::of(&self.times_s[..row], self.quantum_s);
        RecordError::TimeNotIncreasing {
            line: self.lines.of_row(row),
            previous_s: self.times_s[row - 1],
            found_s: self.times_s[row],
            rate_before_hz: before.map(|sampling| sampling.rate_hz),
            can_be_bridged,
            begins_again: row >= LEAST_ROWS && self.times_s[row] <= self.times_s[0],
        }
    }
}

impl Role {
    fn known(&self) -> Option<&KnownColumn> {
        match self {
            Self::Known(known) => Some(known),
            _ => None,
        }
    }
}

impl KnownColumn {
    fn push(&mut self, row: usize, value: f64, column: usize) -> Result<(), RowProblem> {
        let value = value * self.factor;
        if !value.is_finite() {
            return Err(RowProblem::NotFinite { column, cell: value.to_string() });
        }
        if value.abs() > MOST_PLAUSIBLE {
            return Err(RowProblem::Implausible { column, found: value });
        }
        if self.name == ChannelName::HallState && !(1..=6).any(|sector| value == f64::from(sector))
        {
            return Err(RowProblem::Hall { column, found: value });
        }
        self.values.push(value);
        if let Some(own) = &mut self.own_rows {
            own.push(row);
        }
        Ok(())
    }

    /// Tells whether a row has the sample of the row before.
    fn is_repeated(&self, row: usize) -> bool {
        self.own_rows.is_none() && self.values.get(row - 1) == self.values.get(row)
    }

    /// Notes that a row has no sample of this channel.
    fn skip(&mut self, row: usize) {
        self.own_rows.get_or_insert_with(|| (0..row).collect());
    }
}

/// Target of a column, after mapping: a mapped channel hides the column of its own name.
fn target_of(column: &str, map: &ColumnMap) -> Option<Target> {
    if let Some(entry) = map.of_column(column) {
        return Some(entry.target);
    }
    Target::from_column(column).filter(|&target| !map.maps(target))
}

/// A finite number.
fn number(cell: &[u8], column: usize, has_decimal_comma: bool) -> Result<f64, RowProblem> {
    let text = str::from_utf8(cell).ok();
    let value = text.and_then(|text| number_text::parse(text, has_decimal_comma));
    match value {
        Some(value) if value.is_finite() => Ok(value),
        Some(_) => Err(RowProblem::NotFinite { column, cell: shown(cell) }),
        None => Err(RowProblem::NotANumber { column, cell: shown(cell) }),
    }
}

/// Tells whether a cell says that there is no sample.
fn is_lacking(cell: &[u8]) -> bool {
    str::from_utf8(cell).is_ok_and(number_text::is_lacking)
}

/// A cell as a message repeats it.
fn shown(cell: &[u8]) -> String {
    let text = String::from_utf8_lossy(cell);
    let printable = text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c });
    let mut shown: String = printable.take(SHOWN_CHARS).collect();
    if text.chars().count() > SHOWN_CHARS {
        shown.push('…');
    }
    shown
}

/// Decimal places of a number as written, less its exponent.
fn decimals(cell: &[u8]) -> i32 {
    let split = cell.iter().position(|&byte| byte == b'e' || byte == b'E');
    let (mantissa, exponent) = cell.split_at(split.unwrap_or(cell.len()));
    let point = mantissa.iter().position(|&byte| byte == b'.' || byte == b',');
    let places = point.map_or(0, |at| mantissa.len() - at - 1);
    let places = i32::try_from(places).unwrap_or(i32::MAX);
    let exponent = exponent.get(1..).and_then(|digits| str::from_utf8(digits).ok());
    let exponent: i32 = exponent.and_then(|digits| digits.parse().ok()).unwrap_or(0);
    places.saturating_sub(exponent).clamp(-300, 300)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &[u8]) -> Result<Recording, RecordError> {
        parse("r.csv".to_owned(), text, &ColumnMap::default())
    }

    fn error(text: &str) -> String {
        read(text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn channels_have_their_own_time_axes() {
        let text = "time_s,current_a,load_n_m,note\n0,1,,a\n1,2,,\n2,,5,\n3,4,6,d\n";
        let recording = read(text.as_bytes()).unwrap();
        let current = recording.channel(ChannelName::Current).unwrap();
        assert_eq!((current.times_s(), current.values()), (&[0., 1., 3.][..], &[1., 2., 4.][..]));
        let load = recording.channel(ChannelName::Load).unwrap();
        assert_eq!((load.times_s(), load.values()), (&[2., 3.][..], &[5., 6.][..]));
        let note = &recording.other_columns()[0];
        assert_eq!(note.times_s(), [0.0, 3.0]);
        assert_eq!(note.cells().collect::<Vec<_>>(), ["a", "d"]);
    }

    #[test]
    fn a_column_without_samples_is_not_a_channel() {
        let recording = read(b"time_s,current_a,load_n_m\n0,,1\n1,,1\n").unwrap();
        assert!(recording.channel(ChannelName::Current).is_none());
    }

    #[test]
    fn spreadsheets_are_understood() {
        let text =
            b"\xef\xbb\xbf# noise-a = 0.02\r\n\r\ntime_s, current_a ,\"a, b\"\r\n0, 1.5,x\r\n\
                     \r\n1,2.5,\"y \"\"z\"\"\"\r\n";
        let recording = read(text).unwrap();
        assert_eq!(recording.metadata.noise_a, Some(0.02));
        assert_eq!(recording.channel(ChannelName::Current).unwrap().values(), [1.5, 2.5]);
        assert_eq!(recording.other_columns()[0].name(), "a, b");
        assert_eq!(recording.other_columns()[0].cells().nth(1), Some("y \"z\""));
    }

    #[test]
    fn messages_name_line_and_column() {
        assert_eq!(error(""), "empty file: expected a header row with `time_s` and channels");
        assert_eq!(error(" \n\n"), error(""));
        assert_eq!(
            error("# rate-hz = 1\n"),
            "no header row: expected one with `time_s` and channels after the metadata"
        );
        assert_eq!(error("\n\ntime_s,current_a\n"), "no samples after the header on line 3");
        assert_eq!(
            error("time,current_a\n0,1\n"),
            "line 1: no column `time_s`; the columns are `time`, `current_a` \
             (`--map time_s=COLUMN` names one)"
        );
        assert_eq!(error("time_s,x,x\n"), "line 1: column `x` appears twice");
        assert_eq!(
            error("time_s;current_a\n"),
            "line 1: cells are separated by ';', expected commas"
        );
        assert_eq!(error("time_s,x\n0,1\n1\n"), "line 3 has 1 cells, the header has 2");
        assert_eq!(
            error("time_s,current_a\r\n0,1\r\n\r\n1,off\r\n"),
            "line 4, column `current_a`: expected a number, found `off`"
        );
        for bad in ["inf", "-Infinity", "1e999"] {
            assert_eq!(
                error(&format!("time_s,current_a\n0,{bad}\n")),
                format!(
                    "line 2, column `current_a`: expected a finite number, found `{bad}` \
                     (an empty cell means no sample)"
                )
            );
        }
        assert_eq!(
            error("time_s,current_a\n,1\n"),
            "line 2, column `time_s`: expected a time, found an empty cell"
        );
        assert_eq!(
            error("time_s,current_a\n0.0,1\n0.04,1\n0.08,1\n0.00,1\n"),
            "line 5: time 0 s is not after 0.08 s (the rows before are at 25 Hz)"
        );
        assert_eq!(error("time_s,x\n1,1\n1,1\n"), "line 3: time 1 s is not after 1 s");
        assert_eq!(
            error("time_s,hall_state\n1,7\n"),
            "line 2, column `hall_state`: expected a sector from 1 to 6, found `7`"
        );
        assert_eq!(
            error("time_s,x\n0,1\nend,2\n"),
            "line 3, column `time_s`: expected a number, found `end`"
        );
    }

    #[test]
    fn bytes_that_are_not_text_are_refused_with_their_line() {
        for text in [
            &b"# a\n# actuator-id = \"\x81\"\ntime_s\n"[..],
            &b"# noise-a = 1\nload \x81,time_s\n"[..],
            &b"time_s,unit\n1,\x81\n"[..],
        ] {
            let message = read(text).unwrap_err().to_string();
            assert_eq!(message, "line 2 is not UTF-8 text");
        }
    }

    #[test]
    fn times_of_single_precision_are_even() {
        let rows = |start_s: f64| -> String {
            let time_s = |row: u16| f64::from((start_s + f64::from(row) / 1e4) as f32);
            (0..500).map(|row| format!("{},1\n", time_s(row))).collect::<Vec<_>>().concat()
        };
        for start_s in [0.0, 100.0] {
            let recording =
                read(format!("time_s,current_a\n{}", rows(start_s)).as_bytes()).unwrap();
            let channel = &recording.channels()[0];
            assert_eq!(channel.sampling().unwrap().rate_hz, 10_000.0, "{start_s}");
            assert!(recording.require_no_gap(channel).is_ok());
            assert_eq!(recording.clock_notes(), [], "{start_s}");
        }
    }

    #[test]
    fn other_dialects_give_what_their_plain_twin_gives() {
        let twin = read(b"time_s,current_a\n0,1.5\n0.001,2.5\n0.002,-1e-3\n").unwrap();
        let map = ColumnMap::new(["time_s=t", "current_a=Strom"]).unwrap();
        for text in [
            "t;Strom\n0,000;1,5\n0,001;2,5\n0,002;-1E-3\n",
            "Bench 3\r\nrun;7\r\n\r\nt\tStrom\r\ns\tA\r\n0\t1.5\r\n0.001\t2.5\r\n0.002\t-1e-3\r\n",
            "\"t\";\"Strom\"\n\"ms\";\"mA\"\n0;1500\n1;2500\n2;-1\n",
            "# t Strom\n0.000 1.5\n  0.001   2.5\n0.002 -1e-3\n",
            "t,Strom\n[ms],[mA]\n0,1500\n1,2500\n2,-1\n",
            "t,Strom\n2026-11-21 09:30:00.000,1.5\n2026-11-21 09:30:00.001,2.5\n\
             2026-11-21 09:30:00.002,-0.001\n",
            "t|Strom|\n0|1.5|\n0.001|2.5|\n0.002|-1D-3|\n",
            "t;Strom\n0,000;1,5;;\n0,001;2,5;;\n0,002;-0,001;;\n;;;\nt;Strom\n;;\n",
            "\"t\" \"Strom\"\n\"1\" 0 1.5\n\"2\" 0.001 2.5\n\"3\" 0.002 -0.001\n",
            "t,state,Strom,x\nPT0S,ON,1.5,1\nPT0.001S,ON,2.5,1\nPT0.002S,OFF,-0.001,1\n",
            "'t','Strom'\n'0','1.5'\n'0.001','2.5'\n'0.002','-0.001'\n",
            "t;Strom\n23:59:59,999;1,5\n00:00:00,000;2,5\n00:00:00,001;-0,001\n",
        ] {
            for bytes in [text.as_bytes().to_vec(), utf16(text)] {
                let read = parse("r".to_owned(), &bytes, &map).unwrap();
                let [own, twin] = [&read, &twin].map(|one| &one.channels()[0]);
                assert_eq!(own.values().len(), 3, "{text}");
                for (own, twin) in own.times_s().iter().zip(twin.times_s()) {
                    approx::assert_abs_diff_eq!(own, twin, epsilon = 1e-15);
                }
                for (own, twin) in own.values().iter().zip(twin.values()) {
                    approx::assert_abs_diff_eq!(own, twin, epsilon = 1e-15);
                }
            }
        }
    }

    #[test]
    fn what_follows_the_samples_is_left_out_and_told() {
        let rows = (0..120).map(|i| format!("{},{}\n", f64::from(i) / 1000.0, i % 7));
        let rows = rows.collect::<Vec<_>>().concat();
        let text = format!("time_s,current_a\n{rows}");
        let samples = |text: &str| {
            let read = read(text.as_bytes()).unwrap();
            (read.channels()[0].values().len(), read.dialect().map_or(0, |one| one.left_after))
        };
        assert_eq!(samples(&text), (120, 0));
        assert_eq!(samples(&format!("{text}End of file\n")), (120, 1));
        assert_eq!(samples(&format!("{text}Samples,120\n\nmean,3,0\n")), (120, 2));
        assert_eq!(samples(&format!("{text}0.12")), (120, 1));
        assert_eq!(samples(&format!("{text}\u{0}\u{0}\u{1a}")), (120, 0));
        assert_eq!(samples(&text.replacen("0.05,", "# marker\n0.05,", 1)), (120, 0));
        let told = error(&text.replacen("0.05,", "marker\n0.05,", 1));
        assert_eq!(told, "line 52 has 1 cells, the header has 2");
    }

    #[test]
    fn times_may_be_those_of_rows() {
        let text = "phase_a_current_a,x\n1,2\n3,4\n5,6\n";
        let told = error(text);
        assert!(told.ends_with("`--map time_s=row*FACTOR` gives the time between rows in s)"), "{told}");
        let map = ColumnMap::new(["time_s=row*0.0001"]).unwrap();
        let mapped = parse("r".to_owned(), text.as_bytes(), &map).unwrap();
        assert_eq!(mapped.channels()[0].times_s(), [0.0, 0.0001, 0.0002]);
        let stated = read(format!("# rate-hz = 10000\n{text}").as_bytes()).unwrap();
        assert_eq!(stated.channels(), mapped.channels());
        let of_preamble = read(format!("Sampling rate;10000 Hz\n{text}").as_bytes()).unwrap_err();
        assert!(matches!(of_preamble, RecordError::NoTime { step_s: Some(1e-4), .. }));
        let own = "row,current_a\n0,1\n2,3\n4,5\n";
        let map = ColumnMap::new(["time_s=row*0.5"]).unwrap();
        let own = parse("r".to_owned(), own.as_bytes(), &map).unwrap();
        assert_eq!(own.channels()[0].times_s(), [0.0, 1.0, 2.0]);
    }

    #[test]
    fn words_for_missing_samples_need_an_option() {
        let text = "time_s,current_a,load_n_m\n0,1,NaN\n1,2,3\n2,3,n/a\n3,4,4\n";
        let told = error(text);
        assert_eq!(
            told,
            "line 2, column `load_n_m`: expected a finite number, found `NaN` (an empty cell means \
             no sample; `--gaps bridge` takes it for a missing sample)"
        );
        let bridged = ColumnMap::default().with_gaps(Gaps::Bridge);
        let read = parse("r".to_owned(), text.as_bytes(), &bridged).unwrap();
        assert_eq!(read.channel(ChannelName::Load).unwrap().times_s(), [1.0, 3.0]);
        assert_eq!(read.channel(ChannelName::Current).unwrap().values().len(), 4);
    }

    #[test]
    fn tables_of_other_shapes_are_told_by_what_they_are() {
        let told = error("time_s,variable,value\n0,a,1\n1,a,1\n2,a,1\n");
        assert!(told.contains("pivot the table to a column a channel"), "{told}");
        assert_eq!(
            error("#datatype,string,long\n,result,_time,_value,_field\n,,0,1,a\n")[..20],
            told[..20]
        );
        let rows = (0..300).map(|i| format!("{},1\n", f64::from(i % 150)));
        let rows = rows.collect::<Vec<_>>().concat();
        let told = error(&format!("time_s,current_a\n{rows}"));
        assert!(told.contains("fdi.diagnose(table, group=COLUMN)"), "{told}");
    }

    fn utf16(text: &str) -> Vec<u8> {
        [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect()
    }

    #[test]
    fn dialects_are_refused_with_their_line_and_column() {
        let map = ColumnMap::new(["time_s=t", "current_a=Strom"]).unwrap();
        let told =
            |text: &str| parse("r".to_owned(), text.as_bytes(), &map).unwrap_err().to_string();
        let rows = "Bench 3\nt;Strom\n0,0;1,5\n0,1;1,5\n0,2;1,5\n";
        assert_eq!(
            told(&format!("{rows}0,3;off\n")),
            "line 6, column `Strom`: expected a number, found `off`"
        );
        assert_eq!(
            told(&format!("{rows}0,3;1.000\n")),
            "line 6, column `Strom`: expected a number, found `1.000`"
        );
        let unit = told("t;Strom\ns;bar\n0;1\n1;1\n2;1\n");
        assert!(unit.starts_with("column `Strom` is in `bar` as the file says"), "{unit}");
        assert_eq!(
            told("t;Strom\n09:30:00;1\n09:30:01;1\n09:30:02;1\nnoon;1\n"),
            "line 5, column `t`: expected a number, found `noon`"
        );
    }

    #[test]
    fn lines_are_skipped_where_that_is_asked_for() {
        let map = ColumnMap::default().with_skipped_lines(2);
        let text =
            "# exported by hand\n# on bench 3\n# noise-a = 0.5\ntime_s,current_a\n0,1\n1,off\n";
        let read = |text: &str, map| parse("r".to_owned(), text.as_bytes(), map);
        let recording = read(&text.replace("off", "2"), &map).unwrap();
        assert_eq!(recording.metadata.noise_a, Some(0.5));
        let told = read(text, &map).unwrap_err().to_string();
        assert_eq!(told, "line 6, column `current_a`: expected a number, found `off`");
        let told = read(text, &ColumnMap::default()).unwrap_err().to_string();
        assert!(told.starts_with("line 1: metadata"), "{told}");
        assert!(told.ends_with("`--skip-lines N` leaves out the first N lines)"), "{told}");
    }

    #[test]
    fn mapped_columns_must_exist_and_hide_their_namesake() {
        let map = ColumnMap::new(["current_a=i*2"]).unwrap();
        let read = |text: &str| parse("r".to_owned(), text.as_bytes(), &map);
        let both = read("time_s,current_a,i\n0,1,10\n").unwrap();
        assert_eq!(both.channel(ChannelName::Current).unwrap().values(), [20.0]);
        assert_eq!(both.other_columns()[0].name(), "current_a");
        assert_eq!(
            read("time_s,j\n0,1\n").unwrap_err().to_string(),
            "line 1: no column `i` to read `current_a` from; the columns are `time_s`, `j`"
        );
        assert_eq!(
            error("time_s,current_a\n0,1\n1,1e300\n"),
            "line 3, column `current_a`: 1e300 is beyond any actuator, expected at most 1e12 in size"
        );
        let overflow = ColumnMap::new(["current_a=i*1e300"]).unwrap();
        let error = parse("r".to_owned(), b"time_s,i\n0,1e300\n", &overflow).unwrap_err();
        assert!(matches!(error, RecordError::NotFinite { line: 2, .. }));
    }

    #[test]
    fn decimals_as_written() {
        let cases = [("12", 0), ("0.0005", 4), ("1e-4", 4), ("2.5E-3", 4), ("1e3", -3), ("7.", 0)];
        for (cell, want) in cases {
            assert_eq!(decimals(cell.as_bytes()), want, "{cell}");
        }
    }
}
