//! Writes recordings in the format that they are read in.

use std::{
    fs, io,
    io::Write,
    path::{Path, PathBuf},
};

use flate2::{Compression, GzBuilder};

use super::{ChannelName, FileFormat, Recording, column_map::Target};

/// How numbers are written.
///
/// Fixed decimals, so that a file does not depend on how a number is held, and
/// compresses well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CsvFormat {
    /// Decimal places of the time, at most 12.
    pub time_decimals: u8,
    /// Decimal places of all other channels.
    pub value_decimals: u8,
}

impl Default for CsvFormat {
    /// A microsecond and a millionth of each unit: below any sensor here.
    fn default() -> Self {
        Self { time_decimals: 6, value_decimals: 6 }
    }
}

/// Why a recording cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// More decimals of time than a double resolves.
    #[error("{found} decimals of time, at most {MAX_TIME_DECIMALS} are written")]
    TimeDecimals {
        /// Decimals asked for.
        found: u8,
    },
    /// Two samples of a channel fall on one time when rounded.
    #[error("{decimals} decimals of time merge two samples of `{column}` at {time_s} s")]
    TimeResolution {
        /// The column.
        column: String,
        /// Decimals of the time.
        decimals: u8,
        /// Time of the second sample, s.
        time_s: f64,
    },
    /// A time is too large to be written with these decimals.
    #[error("time {time_s} s is too large for {decimals} decimals")]
    TimeRange {
        /// The time, s.
        time_s: f64,
        /// Decimals of the time.
        decimals: u8,
    },
    /// The extension is not that of a recording.
    #[error("`{}` does not end in `.csv` or `.csv.gz`", path.display())]
    UnknownFormat {
        /// The path.
        path: PathBuf,
    },
    /// The operating system refused.
    #[error("`{}` cannot be written: {reason}", path.display())]
    Io {
        /// The path.
        path: PathBuf,
        /// Message of the operating system.
        reason: io::Error,
    },
}

/// Beyond this a second is no longer resolved near a thousand seconds.
const MAX_TIME_DECIMALS: u8 = 12;

/// Largest tick: beyond, a double no longer holds every integer.
const MAX_TICK: f64 = 9_007_199_254_740_992.0;

impl Recording {
    /// The text of the recording: metadata, header, one row for each time at
    /// which any channel has a sample.
    ///
    /// Reading it again gives the recording with its numbers rounded.
    ///
    /// # Errors
    /// [`WriteError::TimeDecimals`], [`WriteError::TimeResolution`] or
    /// [`WriteError::TimeRange`].
    pub fn to_csv(&self, format: CsvFormat) -> Result<String, WriteError> {
        if format.time_decimals > MAX_TIME_DECIMALS {
            return Err(WriteError::TimeDecimals { found: format.time_decimals });
        }
        let mut columns = self.columns(format)?;
        let mut out = String::new();
        for line in self.metadata.to_toml().lines() {
            out.extend(["# ", line, "\n"]);
        }
        out.push_str("time_s");
        for column in &columns {
            out.push(',');
            push_quoted(&mut out, column.name());
        }
        out.push('\n');
        while let Some(tick) = columns.iter().filter_map(Column::tick).min() {
            push_tick(&mut out, tick, format.time_decimals);
            for column in &mut columns {
                out.push(',');
                if column.tick() == Some(tick) {
                    column.push_cell(&mut out, format.value_decimals);
                }
            }
            out.push('\n');
        }
        Ok(out)
    }

    /// The bytes of a `.csv.gz` file: always the same for the same recording,
    /// since neither time nor file name is put into them.
    ///
    /// # Errors
    /// As [`to_csv`](Self::to_csv).
    pub fn to_csv_gz(&self, format: CsvFormat) -> Result<Vec<u8>, WriteError> {
        self.to_csv(format).map(|text| gzip(text.as_bytes()))
    }

    /// Writes a file; compressed if its name ends in `.csv.gz`.
    ///
    /// # Errors
    /// Any [`WriteError`].
    pub fn write(&self, path: &Path, format: CsvFormat) -> Result<(), WriteError> {
        let bytes = match FileFormat::of(path) {
            Some(FileFormat::Csv) => self.to_csv(format)?.into_bytes(),
            Some(FileFormat::CsvGz) => self.to_csv_gz(format)?,
            _ => return Err(WriteError::UnknownFormat { path: path.to_owned() }),
        };
        fs::write(path, bytes).map_err(|reason| WriteError::Io { path: path.to_owned(), reason })
    }

    fn columns(&self, format: CsvFormat) -> Result<Vec<Column<'_>>, WriteError> {
        let mut columns = Vec::new();
        for channel in &self.channels {
            let cells = Cells::Numbers(channel.name(), channel.values());
            columns.push(Column::new(cells, channel.times_s(), format.time_decimals)?);
        }
        // a column that a mapping has put aside would come back as the channel it is not
        let spare = |name: &str| Target::from_column(name).is_none();
        for other in self.other_columns.iter().filter(|other| spare(other.name())) {
            let cells = Cells::Text(other);
            columns.push(Column::new(cells, other.times_s(), format.time_decimals)?);
        }
        Ok(columns)
    }
}

/// Compresses without a time, a file name or an operating system.
fn gzip(text: &[u8]) -> Vec<u8> {
    const UNKNOWN_SYSTEM: u8 = 255;
    let builder = GzBuilder::new().mtime(0).operating_system(UNKNOWN_SYSTEM);
    let mut encoder = builder.write(Vec::new(), Compression::best());
    let finished = encoder.write_all(text).and_then(|()| encoder.finish());
    finished.expect("writing to memory does not fail")
}

enum Cells<'a> {
    Numbers(ChannelName, &'a [f64]),
    Text(&'a super::OtherColumn),
}

/// A column on the way out: its times as whole numbers of the last decimal.
struct Column<'a> {
    cells: Cells<'a>,
    ticks: Vec<i64>,
    next: usize,
}

impl<'a> Column<'a> {
    fn new(cells: Cells<'a>, times_s: &[f64], decimals: u8) -> Result<Self, WriteError> {
        let scale = 10f64.powi(i32::from(decimals));
        let mut ticks = Vec::with_capacity(times_s.len());
        for &time_s in times_s {
            let tick = (time_s * scale).round();
            if tick.abs() > MAX_TICK {
                return Err(WriteError::TimeRange { time_s, decimals });
            }
            let tick = tick as i64;
            if ticks.last().is_some_and(|&last| last >= tick) {
                let column = name_of(&cells).to_owned();
                return Err(WriteError::TimeResolution { column, decimals, time_s });
            }
            ticks.push(tick);
        }
        Ok(Self { cells, ticks, next: 0 })
    }

    fn name(&self) -> &str {
        name_of(&self.cells)
    }

    /// Time of the next cell.
    fn tick(&self) -> Option<i64> {
        self.ticks.get(self.next).copied()
    }

    fn push_cell(&mut self, out: &mut String, decimals: u8) {
        match &self.cells {
            Cells::Numbers(ChannelName::HallState, values) => {
                push_number(out, values[self.next], 0);
            }
            Cells::Numbers(_, values) => push_number(out, values[self.next], decimals),
            Cells::Text(column) => push_quoted(out, column.cell(self.next)),
        }
        self.next += 1;
    }
}

fn name_of<'a>(cells: &Cells<'a>) -> &'a str {
    match cells {
        Cells::Numbers(name, _) => name.column(),
        Cells::Text(column) => column.name(),
    }
}

/// A whole number of units of the last decimal place.
fn push_tick(out: &mut String, tick: i64, decimals: u8) {
    use std::fmt::Write;
    let scale = 10u64.pow(u32::from(decimals));
    let (whole, part) = (tick.unsigned_abs() / scale, tick.unsigned_abs() % scale);
    let sign = if tick < 0 { "-" } else { "" };
    let width = usize::from(decimals);
    let point = if decimals == 0 { "" } else { "." };
    write!(out, "{sign}{whole}{point}").expect("a String takes all text");
    if decimals > 0 {
        write!(out, "{part:0width$}").expect("a String takes all text");
    }
}

/// A number with fixed decimals; what rounds to zero has no sign.
fn push_number(out: &mut String, value: f64, decimals: u8) {
    use std::fmt::Write;
    let start = out.len();
    write!(out, "{value:.*}", usize::from(decimals)).expect("a String takes all text");
    let zero = !out[start..].contains(|digit: char| digit.is_ascii_digit() && digit != '0');
    if zero && out[start..].starts_with('-') {
        out.remove(start);
    }
}

/// Text with the quotes that CSV needs.
fn push_quoted(out: &mut String, text: &str) {
    if text.contains([',', '"', '\n', '\r']) {
        out.push('"');
        out.push_str(&text.replace('"', "\"\""));
        out.push('"');
    } else {
        out.push_str(text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channel, ColumnMap, Metadata};

    fn recording() -> Recording {
        let fast = vec![1.25, -0.000_000_4, 3.0, 4.0, 5.0];
        let channels = vec![
            Channel::uniform(ChannelName::PhaseACurrent, -0.1, 10.0, fast).unwrap(),
            Channel::uniform(ChannelName::HallState, 0.0, 5.0, vec![1.0, 6.0]).unwrap(),
        ];
        let metadata = Metadata { noise_a: Some(0.02), ..Metadata::default() };
        Recording::new("r.csv", metadata, channels).unwrap()
    }

    #[test]
    fn writes_each_channel_at_its_own_times() {
        let text = recording().to_csv(CsvFormat { time_decimals: 2, value_decimals: 4 }).unwrap();
        assert_eq!(
            text,
            "# noise-a = 0.02\ntime_s,phase_a_current_a,hall_state\n-0.10,1.2500,\n0.00,0.0000,1\n\
             0.10,3.0000,\n0.20,4.0000,6\n0.30,5.0000,\n"
        );
    }

    #[test]
    fn what_is_read_is_written_again() {
        let text = "time_s,current_a,\"no,te\"\n0.000000,1.000000,\"a \"\"b\"\"\"\n0.500000,,c\n";
        let read = Recording::parse("r", text.as_bytes(), &ColumnMap::default()).unwrap();
        assert_eq!(read.to_csv(CsvFormat::default()).unwrap(), text);
    }

    #[test]
    fn compressed_files_do_not_depend_on_the_day() {
        let bytes = recording().to_csv_gz(CsvFormat::default()).unwrap();
        assert_eq!(bytes[4..8], [0; 4], "modification time, RFC 1952 2.3.1");
        assert_eq!(bytes[3] & 0x08, 0, "no file name");
        assert_eq!(bytes, recording().to_csv_gz(CsvFormat::default()).unwrap());
    }

    #[test]
    fn refuses_decimals_that_lose_samples() {
        let error = |time_decimals| {
            let format = CsvFormat { time_decimals, value_decimals: 1 };
            recording().to_csv(format).unwrap_err().to_string()
        };
        assert_eq!(error(0), "0 decimals of time merge two samples of `phase_a_current_a` at 0 s");
        assert_eq!(error(13), "13 decimals of time, at most 12 are written");
    }
}
