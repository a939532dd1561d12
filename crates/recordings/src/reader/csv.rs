//! The text of a recording, row by row.

mod chooser;

use std::collections::BTreeMap;

use csv::{ByteRecord, ReaderBuilder};

use crate::{
    Channel, ChannelName, ClockNote, ColumnMap, Gaps, Metadata, OtherColumn, RecordError,
    Recording, Sampling, SharedNumbers,
    column_map::{Entry, Target},
    evened::{Evener, Untimely},
    held_rows::HeldRows,
    lines::Lines,
    long_form::is_long_form,
    reader::{
        clean_text::{
            annotated_columns, with_double_quotes, with_line_feeds, with_names_of_pairs,
            without_padding,
        },
        csv_gz,
        dialect::{self, Dialect, Found},
        number_text, preamble,
        single_precision::SinglePrecision,
        stamp::{Stamp, StampClock},
        text_encoding::TextEncoding,
        time_decimals::TimeDecimals,
    },
    recording::MOST_PLAUSIBLE,
    rows_beside::TimedRows,
    source::LIMIT_BYTES,
    unit::{self, Scale, StatedUnit},
};

use chooser::Chooser;

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
    let bytes = with_names_of_pairs(with_double_quotes(with_line_feeds(bytes)));
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
        gaps: map.gaps(),
    };
    recording.complete_star();
    recording.settle_rate()?;
    Ok(recording)
}

/// Times between samples that a text states apart from its table, s.
#[derive(Clone, Copy, Debug)]
struct Steps {
    /// Inverse of `rate-hz` in the metadata.
    stated: Option<f64>,
    /// Guess from the lines before the header.
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
    let mut chooser = Chooser::new(map.rows(), &columns, header_line)?;
    let mut pending: Option<(RowProblem, u64, usize)> = None;
    while (has_row && is_read) || next(&mut record) {
        is_read = false;
        if record.iter().all(|cell| cell.trim_ascii().is_empty()) || is_of_header(&record, &columns)
        {
            continue;
        }
        if !chooser.takes(&record) {
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
    chooser.check(table.time_column.is_some())?;
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
    scale: Scale,
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
    decimals: TimeDecimals,
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
            Self::MissingTime { column } => RecordError::MissingTime { line, column: name(column) },
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
        let by_row = |entry: &&Entry| entry.is_of_rows() && !columns.contains(&entry.column);
        let mapped_step_s = map.entries().iter().find(by_row).map(Entry::row_step_s);
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
            let mut scale = Scale::ONE;
            if let Some(target) = target {
                let (by, stated) = unit::stated_scale(column, unit, target, map.of_column(column))?;
                scale = by;
                stated_units.extend(stated);
            }
            roles.push(match target {
                Some(Target::Time) => {
                    (time_column, time_factor) = (Some(index), scale.factor);
                    Role::Time
                }
                Some(Target::Channel(name)) => {
                    let (values, own_rows) = (Vec::new(), None);
                    Role::Known(KnownColumn { name, scale, values, own_rows })
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
            decimals: TimeDecimals::default(),
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
                    let read = number(cell, column, has_decimal_comma);
                    let value = read.or_else(|problem| {
                        known.with_unit(cell, has_decimal_comma).ok_or(problem)
                    })?;
                    known.push(row, value, column)?;
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
            self.decimals.look_at_stamp(stamp.ns, stamp.decimals);
            return Ok(self.stamps.get_or_insert_default().seconds(stamp));
        }
        if self.stamps.is_some() {
            return Err(RowProblem::NotATime { column, cell: shown(cell) });
        }
        let found =
            number(cell, column, self.has_decimal_comma).map_err(|problem| match problem {
                RowProblem::NotANumber { column, cell } => RowProblem::NotATime { column, cell },
                other => other,
            })?;
        self.decimals.look_at(cell);
        self.single.look_at(found);
        Ok(found * self.time_factor)
    }

    /// The unit of the last decimal place that the times use, or that of single precision, s.
    fn time_quantum_s(&self) -> f64 {
        if self.time_column.is_none() {
            return 0.0;
        }
        if self.stamps.is_some() {
            return self.decimals.quantum_s(&self.times_s, 1.0);
        }
        let unit_s = self.time_factor.abs();
        self.decimals.quantum_s(&self.times_s, unit_s).max(self.single.quantum() * unit_s)
    }

    /// The channels that have a sample in each row.
    fn timed_rows(&self) -> TimedRows<'_> {
        let known = self.roles.iter().filter_map(Role::known);
        let whole = known.filter(|known| known.own_rows.is_none());
        TimedRows::new(&self.times_s, whole.map(|known| (known.name, &known.values[..])).collect())
    }

    /// Rows that have the time and the samples of the row before.
    fn repeated_rows(&self) -> Vec<usize> {
        let mut known = self.roles.iter().filter_map(Role::known);
        let is_whole = known.all(|known| known.own_rows.is_none());
        if is_whole { self.timed_rows().repeated() } else { Vec::new() }
    }

    /// Refuses rows of several recordings that have the same times.
    fn check_rows_beside(&self) -> Result<(), RecordError> {
        let lines = || Lines::new(self.times_s.clone().into(), self.line_runs.clone());
        let others = || self.roles.iter().filter_map(Role::other);
        self.timed_rows().check(|| Some(lines().of_row(1)), |choice| others().find_map(choice))
    }

    /// Refuses rows whose samples are held, or takes these for missing where gaps are bridged.
    fn take_out_held(&mut self, gaps: Gaps) -> Result<(), RecordError> {
        let Some(held) = HeldRows::of(&self.timed_rows()) else { return Ok(()) };
        let lines = Lines::new(self.times_s.clone().into(), self.line_runs.clone());
        held.check(&self.times_s, gaps == Gaps::Bridge, |row| Some(lines.of_row(row)))?;
        for role in &mut self.roles {
            if let Role::Known(known) = role
                && known.own_rows.is_none()
                && let Some(rows) = held.measured(&known.values)
            {
                known.values = rows.iter().map(|&row| known.values[row]).collect();
                known.own_rows = Some(rows);
            }
        }
        Ok(())
    }

    fn finish(mut self, header_line: u64, gaps: Gaps) -> Result<Rows, RecordError> {
        if self.times_s.is_empty() {
            return Err(RecordError::HeaderOnly { line: header_line });
        }
        let (quantum_s, repeated) = (self.time_quantum_s(), self.repeated_rows());
        self.check_rows_beside()?;
        self.take_out_held(gaps)?;
        let stated_units = self.stated_units;
        let times_s = SharedNumbers::from(self.times_s);
        let lines = Lines::new(times_s.clone(), self.line_runs);
        let mut evener = Evener::new(gaps);
        let axis = TextAxis { times_s: &times_s, lines: &lines, quantum_s };
        // rows without a sample of any channel have times too
        evener.check(&times_s, quantum_s, &repeated).map_err(|problem| {
            let mut others = self.roles.iter().filter_map(Role::other);
            let row = problem.at;
            let choice = others.find_map(|other| other.choice_of_rows_before(row));
            axis.error(row, problem.can_be_bridged).with_rows_before(choice)
        })?;
        let (mut known, mut others): (Vec<KnownColumn>, Vec<_>) = (Vec::new(), Vec::new());
        for role in self.roles {
            match role {
                Role::Time => {}
                Role::Other(other) => others.push(other),
                Role::Known(column) => match known.iter_mut().find(|sum| sum.name == column.name) {
                    Some(sum) => sum.add(&column, evener.bridges())?,
                    None => known.push(column),
                },
            }
        }
        // a column without a single sample is a channel that is not there
        known.retain(|column| !column.values.is_empty());
        let channel = |KnownColumn { name, values, own_rows, .. }| {
            let own_s = own_rows.as_ref().map_or_else(
                || times_s.clone(),
                |rows: &Vec<usize>| rows.iter().map(|&row| times_s[row]).collect(),
            );
            let row = |index: usize| own_rows.as_ref().map_or(index, |rows| rows[index]);
            evener.channel(name, own_s, values.into(), quantum_s).map_err(|problem| match problem {
                Untimely::NotAfter(order) => axis.error(row(order.at), order.can_be_bridged),
                Untimely::Lacking(gap) => gap.error(name, Some(lines.of_row(row(gap.before)) + 1)),
            })
        };
        let channels = known.into_iter().map(channel).collect::<Result<_, _>>()?;
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
            rows_before: None,
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

    fn other(&self) -> Option<&OtherColumn> {
        match self {
            Self::Other(other) => Some(other),
            _ => None,
        }
    }
}

impl KnownColumn {
    /// The number of a cell with a unit behind it, `1.5 mA`; `None` where a factor is known already.
    fn with_unit(&self, cell: &[u8], has_decimal_comma: bool) -> Option<f64> {
        let (value, stated) = str::from_utf8(cell).ok()?.rsplit_once(' ')?;
        let scale = unit::scale(stated, self.name.unit())?;
        let value = number_text::parse(value.trim_end(), has_decimal_comma)?;
        (self.scale == Scale::ONE && self.name.unit() != "1").then_some(scale.of(value))
    }

    /// Adds a part of the sum that the channel is, whose samples stand in the same rows; where gaps
    /// are bridged, in the rows that have a sample of each.
    ///
    /// # Errors
    /// [`RecordError::SumTimes`].
    fn add(&mut self, part: &Self, is_bridged: bool) -> Result<(), RecordError> {
        if self.own_rows == part.own_rows {
            self.values.iter_mut().zip(&part.values).for_each(|(sum, value)| *sum += value);
            return Ok(());
        }
        let others: BTreeMap<usize, f64> = part.samples().collect();
        let both = |(row, value)| others.get(&row).map(|other| (row, value + other));
        let (rows, values): (Vec<usize>, Vec<f64>) = self.samples().filter_map(both).unzip();
        if !is_bridged || rows.is_empty() {
            return Err(RecordError::SumTimes { channel: self.name });
        }
        (self.own_rows, self.values) = (Some(rows), values);
        Ok(())
    }

    /// The samples, each with its row.
    fn samples(&self) -> impl Iterator<Item = (usize, f64)> {
        let row = |index: usize| self.own_rows.as_ref().map_or(index, |rows| rows[index]);
        self.values.iter().enumerate().map(move |(index, &value)| (row(index), value))
    }

    fn push(&mut self, row: usize, value: f64, column: usize) -> Result<(), RowProblem> {
        let value = self.scale.of(value);
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

#[cfg(test)]
mod tests;
