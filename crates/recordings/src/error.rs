//! Why a recording cannot be read or used.

mod wording;

use std::io;

use crate::{ChannelName, FileFormat};

use wording::{
    LACKING_NOTE, at, cell_at, chosen, columns_are, in_brackets, lacking_note, list,
    lost_and_doubled, order_note, rate_note, row_note, rowless, seen_note, time,
};

/// Why a recording cannot be read or used.
///
/// The messages name line, column and what was expected, and leave the file to
/// the caller, who knows its path.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// There is no such file or folder.
    #[error("no such file or folder")]
    NotFound,
    /// The operating system refused.
    #[error("cannot be read: {reason}")]
    Unreadable {
        /// Message of the operating system.
        reason: io::Error,
    },
    /// A folder, a pipe or a device.
    #[error("not a regular file")]
    NotAFile,
    /// The extension is not that of a recording.
    #[error("not a recording: expected {}{}", FileFormat::listed(), in_brackets(advice))]
    UnknownFormat {
        /// How to save such a file, or nothing.
        advice: &'static str,
    },
    /// A form of recording that this build leaves out.
    #[error(
        "`{}` is not read by this build: it lacks the feature `{feature}` (build with it, or save the \
         recording as Parquet or CSV)",
        format.extension()
    )]
    NotBuiltIn {
        /// The form.
        format: FileFormat,
        /// The feature of this crate that reads it.
        feature: &'static str,
    },
    /// A folder holds no recording.
    #[error("holds no recordings: expected {} files in the folder", FileFormat::listed())]
    NoRecordings,
    /// No file matches a pattern.
    #[error("no file matches the pattern")]
    NoMatch,
    /// More data than is reasonable, perhaps a decompression bomb.
    #[error("more than {limit_bytes} bytes of text")]
    TooLarge {
        /// The limit.
        limit_bytes: u64,
    },
    /// The compressed data are damaged.
    #[error("damaged gzip data: {reason}")]
    Gzip {
        /// Message of the decoder.
        reason: io::Error,
    },
    /// A file that is not text is damaged, or is not what its name says.
    #[error("damaged `{}` file: {reason}", format.extension())]
    Damaged {
        /// The form that its name tells.
        format: FileFormat,
        /// Description of the damage.
        reason: String,
    },
    /// A file that is not text holds its data in a way that is not read.
    #[error("`{}` with {what} is not read{}", format.extension(), in_brackets(advice))]
    Unsupported {
        /// The form.
        format: FileFormat,
        /// Part of the format that is not read.
        what: String,
        /// Advice on a way out, or nothing.
        advice: &'static str,
    },
    /// More numbers in the channels than is reasonable.
    #[error("more than {limit} numbers in the channels")]
    TooManyNumbers {
        /// The limit.
        limit: usize,
    },
    /// A column that should be a channel holds no numbers.
    #[error(
        "column `{column}` holds {found}, expected numbers{}",
        if *found == "text or bytes" { " (pandas: `astype(float)` before it is saved)" } else { "" }
    )]
    NotNumbers {
        /// The column.
        column: String,
        /// Content of the column.
        found: &'static str,
    },
    /// A name stands for several columns.
    #[error(
        "column `{column}` is in the file more than once: say which of {} is meant \
         (`--map NAME=COLUMN`)",
        list(columns)
    )]
    ColumnAmbiguous {
        /// The name.
        column: String,
        /// Columns that the name may stand for.
        columns: Vec<String>,
    },
    /// No column `time_s` is as long as a channel, or several are.
    #[error(
        "no time axis for column `{column}` of {samples} samples: {alike} columns `time_s` are as \
         long, expected one"
    )]
    NoAxis {
        /// The column.
        column: String,
        /// Samples of the column.
        samples: usize,
        /// Time columns of that length.
        alike: usize,
    },
    /// Columns that a map adds up do not all have their samples at the same times.
    #[error(
        "the columns that `{channel}` is the sum of do not all have their samples at the same times"
    )]
    SumTimes {
        /// The channel.
        channel: ChannelName,
    },
    /// The step of an evenly spaced time axis is not positive.
    #[error("column `{column}` has the sample period {step_s} s, expected a positive one")]
    Step {
        /// The column.
        column: String,
        /// The period, s.
        step_s: f64,
    },
    /// A sample stands where the time axis has none.
    #[error("`{channel}` has a sample without a time: sample {index}")]
    SampleWithoutTime {
        /// The channel.
        channel: ChannelName,
        /// The sample, from 0.
        index: usize,
    },
    /// A property of a file that is not text is no metadata of that name.
    #[error("metadata `{key}`: expected {expected}, found {found}")]
    Property {
        /// The key.
        key: &'static str,
        /// Form of value that the key takes.
        expected: &'static str,
        /// Value that stands there.
        found: String,
    },
    /// There is no text.
    #[error("empty file: expected a header row with `time_s` and channels")]
    Empty,
    /// There are metadata but no header row.
    #[error("no header row: expected one with `time_s` and channels after the metadata")]
    NoHeader,
    /// A line is not UTF-8.
    #[error("line {line} is not UTF-8 text")]
    NotUtf8 {
        /// Line, from 1.
        line: u64,
    },
    /// A text that begins as UTF-16 and goes on otherwise.
    #[error("the text begins as UTF-16 and is not")]
    NotUtf16,
    /// The header has no comma but another usual separator.
    #[error("line {line}: cells are separated by {found:?}, expected commas")]
    Separator {
        /// Line, from 1.
        line: u64,
        /// The separator that the header seems to use.
        found: char,
    },
    /// No column is the time.
    #[error(
        "{}no column `time_s`; the columns are {} (`--map time_s=COLUMN` names one{})",
        at(*line),
        list(columns),
        row_note(columns)
    )]
    NoTime {
        /// Line of the header, from 1, in a file that is text.
        line: Option<u64>,
        /// The columns.
        columns: Vec<String>,
        /// Time between samples that the file seems to state elsewhere, s.
        step_s: Option<f64>,
    },
    /// A table has a row for each value, and a column that says of which channel.
    #[error(
        "a row for each value, not for each time; the columns are {}: pivot the table to a column \
         a channel (pandas: `table.pivot(index=TIME, columns=NAME, values=VALUE)`)",
        list(columns)
    )]
    LongForm {
        /// The columns.
        columns: Vec<String>,
    },
    /// Two columns have one name.
    #[error("line {line}: column `{column}` appears twice")]
    DuplicateColumn {
        /// Line of the header, from 1.
        line: u64,
        /// The name.
        column: String,
    },
    /// A mapped column is not in the file.
    #[error(
        "{}no column `{column}` to read `{channel}` from; the columns are {}",
        at(*line),
        list(columns)
    )]
    MappedColumnMissing {
        /// Line of the header, from 1, in a file that is text.
        line: Option<u64>,
        /// The column asked for.
        column: String,
        /// The channel it should have been.
        channel: &'static str,
        /// The columns.
        columns: Vec<String>,
    },
    /// A column that rows are chosen by is not in the file.
    #[error(
        "{}no column `{column}` to choose rows by (`--where`); the columns are {}",
        at(*line),
        list(columns)
    )]
    ChoiceColumnMissing {
        /// Line of the header, from 1, in a file that is text.
        line: Option<u64>,
        /// The column asked for.
        column: String,
        /// The columns.
        columns: Vec<String>,
    },
    /// Several columns have the name that rows are chosen by.
    #[error(
        "column `{column}` is in the file more than once: say by which of {} rows are chosen \
         (`--where PATH=VALUE`)",
        list(columns)
    )]
    ChoiceAmbiguous {
        /// The name.
        column: String,
        /// The paths.
        columns: Vec<String>,
    },
    /// No row has the values that rows are chosen by.
    #[error("no row has {} (`--where`){}", list(wanted), seen_note(column, found, *is_more))]
    NoRowChosen {
        /// The conditions.
        wanted: Vec<String>,
        /// The column of the first that no row meets; empty where each has rows, but none has all.
        column: String,
        /// Values in it, the first few.
        found: Vec<String>,
        /// True where there are others.
        is_more: bool,
    },
    /// Rows that are not read stand between those that are, and times count rows.
    #[error(
        "rows that `--where` leaves out stand between those that it reads, and the time of a row is \
         its place: name a column of times (`--map time_s=COLUMN`)"
    )]
    RowsApart,
    /// No row follows the header.
    #[error("no samples after the header on line {line}")]
    HeaderOnly {
        /// Line of the header, from 1.
        line: u64,
    },
    /// The columns of a file that is not text hold no samples.
    #[error("no samples: {}", rowless(columns))]
    NoRows {
        /// Columns that would be channels.
        columns: Vec<String>,
    },
    /// A file states a unit for a column that is not one of its channel.
    #[error(
        "column `{column}` is in `{unit}` as the file says, `{channel}` in {expected}: say by what \
         it is to be multiplied (`--map {channel}={column}*FACTOR`)"
    )]
    UnitUnknown {
        /// The column.
        column: String,
        /// The unit as stated.
        unit: String,
        /// The channel that it would be.
        channel: &'static str,
        /// The channel's unit.
        expected: &'static str,
    },
    /// A row has more or fewer cells than the header.
    #[error(
        "line {line} has {found} cells, the header has {expected}{}",
        if *found == 2 * expected || *found + 1 == 2 * expected {
            " (decimals after a comma need another separator between cells, such as `;`)"
        } else {
            ""
        }
    )]
    RaggedRow {
        /// Line, from 1.
        line: u64,
        /// Cells of the row.
        found: usize,
        /// Cells of the header.
        expected: usize,
    },
    /// A cell is not a number.
    #[error(
        "line {line}, column `{column}`: expected a number, found `{found}`{}",
        if RecordError::is_lacking(found) { in_brackets(LACKING_NOTE) } else { String::new() }
    )]
    NotANumber {
        /// Line, from 1.
        line: u64,
        /// The column.
        column: String,
        /// The cell, shortened.
        found: String,
    },
    /// A cell is NaN, infinite, or too large for a double.
    #[error(
        "line {line}, column `{column}`: expected a finite number, found `{found}` \
         (an empty cell means no sample{})",
        lacking_note(found)
    )]
    NotFinite {
        /// Line, from 1.
        line: u64,
        /// The column.
        column: String,
        /// The cell, shortened.
        found: String,
    },
    /// A number that no actuator shows.
    #[error(
        "{}column `{column}`: {found:e} is beyond any actuator, expected at most {limit:e} in size",
        cell_at(*line)
    )]
    Implausible {
        /// Line, from 1, in a file that is text.
        line: Option<u64>,
        /// The column.
        column: String,
        /// The number, in the unit of the channel.
        found: f64,
        /// The largest that is taken.
        limit: f64,
    },
    /// A channel lacks samples between others that are evenly spaced.
    #[error(
        "{}no sample of `{channel}` between {} s and {} s; the others are {step_s} s apart{}",
        at(*line),
        time(*after_s, *step_s),
        time(*next_s, *step_s),
        if *can_be_bridged { " (`--gaps bridge` fills what is lost)" } else { "" }
    )]
    Gap {
        /// Line after that of the last sample before the gap, in a file that is text.
        line: Option<u64>,
        /// The channel.
        channel: ChannelName,
        /// Time of the last sample before the gap, s.
        after_s: f64,
        /// Time of the first sample after it, s.
        next_s: f64,
        /// Time between the other samples, s.
        step_s: f64,
        /// True where [`Gaps::Bridge`](crate::Gaps::Bridge) reads the channel.
        can_be_bridged: bool,
    },
    /// Rows hold the last samples of the currents in place of new ones.
    #[error(
        "{}the currents are the same to the digit in the {rows} rows after {after_s} s and jump then: held \
         samples, not measured ones{}",
        at(*line),
        if *can_be_bridged {
            " (`--gaps bridge` fills what is held)"
        } else {
            "; more than 8 in a row are not filled"
        }
    )]
    Held {
        /// Line of the first of them, from 1, in a file that is text.
        line: Option<u64>,
        /// How many there are.
        rows: usize,
        /// Time of the last row before, s.
        after_s: f64,
        /// True where [`Gaps::Bridge`](crate::Gaps::Bridge) reads the recording.
        can_be_bridged: bool,
    },
    /// Times are even, and the recorded command is not that of its test at these times.
    #[error(
        "{}the times are even, but `command_rad` shows {} after {after_s} s{}",
        at(*line),
        lost_and_doubled(*lost, *doubled),
        if *can_be_bridged {
            " (`--gaps bridge` fills what is lost and drops what is twice)"
        } else {
            "; more than 8 in a row are not filled"
        }
    )]
    CommandShowsGap {
        /// Line after that of the last row that is in order, in a file that is text.
        line: Option<u64>,
        /// Samples that are lost.
        lost: usize,
        /// Rows that are twice in the file.
        doubled: usize,
        /// Time of the last row that is in order, s.
        after_s: f64,
        /// True where [`Gaps::Bridge`](crate::Gaps::Bridge) reads the recording.
        can_be_bridged: bool,
    },
    /// A row has no time.
    #[error("line {line}, column `{column}`: expected a time, found an empty cell")]
    MissingTime {
        /// Line, from 1.
        line: u64,
        /// The column.
        column: String,
    },
    /// Time stands still or runs backwards.
    #[error(
        "line {line}: time {found_s} s is not after {previous_s} s{}{}",
        rate_note(*rate_before_hz),
        order_note(*can_be_bridged, *begins_again, rows_before.as_deref())
    )]
    TimeNotIncreasing {
        /// Line, from 1.
        line: u64,
        /// Time of the row before, s.
        previous_s: f64,
        /// Time of this row, s.
        found_s: f64,
        /// Rate of the rows up to there, Hz, where there are two or more.
        rate_before_hz: Option<f64>,
        /// True where [`Gaps::Bridge`](crate::Gaps::Bridge) reads the recording.
        can_be_bridged: bool,
        /// True where times go back to the first or before it.
        begins_again: bool,
        /// The rows before as a choice of rows, `COLUMN=VALUE`, where a column tells them apart.
        rows_before: Option<String>,
    },
    /// Each time is that of several rows, which are of several recordings.
    #[error(
        "{}time {time_s} s is that of {rows} rows, as is each, and `{channel}` does not go on from one \
         to the next; of several recordings beside one another `--where {}` reads one; in Python \
         `fdi.diagnose(table, group=COLUMN)` reads all",
        at(*line),
        chosen(rows_of_one.as_deref())
    )]
    RecordingsBeside {
        /// Line of the second row, from 1, in a file that is text.
        line: Option<u64>,
        /// The first time, s.
        time_s: f64,
        /// Rows of each time.
        rows: usize,
        /// The channel that shows it.
        channel: ChannelName,
        /// The rows of one recording as a choice of rows, `COLUMN=VALUE`, where a column tells them
        /// apart.
        rows_of_one: Option<String>,
    },
    /// A commutation sector outside 1 to 6.
    #[error("{}column `{column}`: expected a sector from 1 to 6, found `{found}`", cell_at(*line))]
    HallState {
        /// Line, from 1, in a file that is text.
        line: Option<u64>,
        /// The column.
        column: String,
        /// The value.
        found: f64,
    },
    /// The metadata are not TOML.
    #[error(
        "line {line}: metadata (`#` lines before the header) are TOML: {reason} \
         (`## …` is a comment, `--skip-lines N` leaves out the first N lines)"
    )]
    MetadataSyntax {
        /// Line, from 1.
        line: u64,
        /// Message of the parser.
        reason: String,
    },
    /// A line of the metadata has a colon where TOML has `=`.
    #[error("line {line}: metadata `{key}`: expected `{expected}`, found a colon after the key")]
    MetadataColon {
        /// Line, from 1.
        line: u64,
        /// The key.
        key: &'static str,
        /// The line as TOML.
        expected: String,
    },
    /// A metadata key is not known.
    #[error("line {line}: unknown metadata key `{key}`; the keys are {}", list(&crate::metadata_key::keys()))]
    MetadataKey {
        /// Line, from 1.
        line: u64,
        /// The key.
        key: String,
    },
    /// A metadata key is not known, and spelt almost like one that is.
    #[error("line {line}: unknown metadata key `{key}`; did you mean `{nearest}`?")]
    MetadataKeyMisspelt {
        /// Line, from 1.
        line: u64,
        /// The key.
        key: String,
        /// The key that it is almost spelt like.
        nearest: &'static str,
    },
    /// A metadata value is of the wrong type or out of range.
    #[error("line {line}: metadata `{key}`: expected {expected}, found {found}")]
    MetadataValue {
        /// Line, from 1.
        line: u64,
        /// The key.
        key: &'static str,
        /// Form of value that the key takes.
        expected: &'static str,
        /// Value that stands there.
        found: String,
    },
    /// The metadata state a rate that the time axis does not have.
    #[error("metadata say `rate-hz` {stated_hz}, the times of `{channel}` are at {found_hz} Hz")]
    RateContradiction {
        /// Rate in the metadata, Hz.
        stated_hz: f64,
        /// Rate of the time axis, Hz.
        found_hz: f64,
        /// The channel looked at.
        channel: ChannelName,
    },
    /// No channel is a current that can be diagnosed from.
    #[error(
        "no current channel: expected `phase_a_current_a`, `phase_b_current_a` and \
         `phase_c_current_a`, or `current_a`, or `q_axis_current_a` of a field-oriented drive; {} (`--map current_a=COLUMN[*FACTOR]` names one)",
        columns_are(columns)
    )]
    NoCurrent {
        /// The columns but time.
        columns: Vec<String>,
    },
    /// One or two phase currents without the others.
    #[error(
        "{} without {}: the envelope needs all three, or two on the same times",
        list(found),
        list(missing)
    )]
    PhaseMissing {
        /// The phases that are there.
        found: Vec<ChannelName>,
        /// The phases that are not.
        missing: Vec<ChannelName>,
    },
    /// A channel with too few samples to have a rate.
    #[error("`{channel}` has {samples} samples, too few to have a rate")]
    TooFewSamples {
        /// The channel.
        channel: ChannelName,
        /// Samples of the channel.
        samples: usize,
    },
    /// A recording made in memory has a channel twice.
    #[error("`{channel}` appears twice")]
    DuplicateChannel {
        /// The channel.
        channel: ChannelName,
    },
    /// Times and values of a channel made in memory differ in number.
    #[error("`{channel}` has {times} times and {values} values")]
    ChannelLength {
        /// The channel.
        channel: ChannelName,
        /// Number of times.
        times: usize,
        /// Number of values.
        values: usize,
    },
    /// A channel made in memory has no samples.
    #[error("`{channel}` has no samples")]
    ChannelEmpty {
        /// The channel.
        channel: ChannelName,
    },
    /// A time or value of a channel made in memory is not finite.
    #[error(
        "`{channel}` is not finite at sample {index}{}",
        if *is_lacking { in_brackets(LACKING_NOTE) } else { String::new() }
    )]
    ChannelNotFinite {
        /// The channel.
        channel: ChannelName,
        /// The sample, from 0.
        index: usize,
        /// True for a NaN that [`Gaps::Bridge`](crate::Gaps::Bridge) takes for a missing sample.
        is_lacking: bool,
    },
    /// A sample stands off the grid of its channel.
    #[error(
        "column `{}` is sampled irregularly: a sample is {deviation_s:.2e} s off its grid, expected \
         at most {most_s:.2e} s",
        .channel.column()
    )]
    OffGrid {
        /// The channel.
        channel: ChannelName,
        /// Largest distance of a sample from the grid.
        deviation_s: f64,
        /// Largest distance that is compared.
        most_s: f64,
    },
    /// The metadata and the column disagree on where the motor starts.
    #[error(
        "`start-angle-rad` is {told_rad}, but `motor_angle_rad` begins at {first_rad}: expected \
         the same angle within {most_rad} rad"
    )]
    StartAngle {
        /// Angle in the metadata.
        told_rad: f64,
        /// First sample of the column.
        first_rad: f64,
        /// Largest difference, whole turns apart.
        most_rad: f64,
    },
    /// The times of a channel made in memory do not increase.
    #[error(
        "time of `{channel}` does not increase at sample {index}{}",
        order_note(*can_be_bridged, *begins_again, rows_before.as_deref())
    )]
    ChannelTime {
        /// The channel.
        channel: ChannelName,
        /// The sample, from 0.
        index: usize,
        /// True where [`Gaps::Bridge`](crate::Gaps::Bridge) reads the channel.
        can_be_bridged: bool,
        /// True where times go back to the first or before it.
        begins_again: bool,
        /// The rows before as a choice of rows, `COLUMN=VALUE`, where a column tells them apart.
        rows_before: Option<String>,
    },
}

/// Relative difference of two rates below which they may be of one clock.
const SAME_CLOCK_FRAC: f64 = 0.01;

impl RecordError {
    /// Tells whether a cell is a word for a missing sample, which
    /// [`Gaps::Bridge`](crate::Gaps::Bridge) takes for one.
    pub fn is_lacking(cell: &str) -> bool {
        crate::reader::is_lacking(cell)
    }

    /// Adds the choice of the rows before one at which times begin again.
    pub(crate) fn with_rows_before(mut self, choice: Option<String>) -> Self {
        if let Self::TimeNotIncreasing { begins_again: true, rows_before, .. }
        | Self::ChannelTime { begins_again: true, rows_before, .. } = &mut self
        {
            *rows_before = choice;
        }
        self
    }

    /// Tells whether the rows up to where the times stop increasing are at another rate than any
    /// of those expected, Hz: 1 % or more from each.
    ///
    /// False for any other error, and where no rate is expected.
    pub fn is_of_another_rate(&self, expected_hz: &[f64]) -> bool {
        let Self::TimeNotIncreasing { rate_before_hz, can_be_bridged: false, .. } = self else {
            return false;
        };
        let Some(found_hz) = rate_before_hz else { return false };
        let near = |rate_hz: &f64| (rate_hz / found_hz - 1.0).abs() < SAME_CLOCK_FRAC;
        !expected_hz.is_empty() && !expected_hz.iter().any(near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_within_a_percent_may_be_of_one_clock() {
        let broken = |rate_before_hz| RecordError::TimeNotIncreasing {
            line: 9,
            previous_s: 0.2,
            found_s: 0.1,
            rate_before_hz,
            can_be_bridged: false,
            begins_again: false,
            rows_before: None,
        };
        assert!(broken(Some(4800.0)).is_of_another_rate(&[2000.0, 10_000.0]));
        assert!(!broken(Some(2010.0)).is_of_another_rate(&[2000.0, 10_000.0]));
        assert!(!broken(Some(4800.0)).is_of_another_rate(&[]));
        assert!(!broken(None).is_of_another_rate(&[2000.0]));
        let other = RecordError::ChannelEmpty { channel: ChannelName::Current };
        assert!(!other.is_of_another_rate(&[2000.0]));
    }

    #[test]
    fn a_gap_is_told_in_times_finer_than_the_step_and_no_finer() {
        let message = |after_s: f64, next_s: f64, step_s: f64| {
            let gap = RecordError::Gap {
                line: None,
                channel: ChannelName::Current,
                after_s,
                next_s,
                step_s,
                can_be_bridged: false,
            };
            gap.to_string()
        };
        assert_eq!(
            message(0.1 + 0.2, 0.4, 0.0005),
            "no sample of `current_a` between 0.3 s and 0.4 s; the others are 0.0005 s apart"
        );
        assert_eq!(
            message(12.000_050_1, 12.000_200_1, 0.00005),
            "no sample of `current_a` between 12.0000501 s and 12.0002001 s; the others are \
             0.00005 s apart"
        );
        assert!(message(100.0, 130.0, 10.0).contains("between 100 s and 130 s"));
    }
}
