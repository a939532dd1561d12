//! Apache Parquet files, as pandas, polars and pyarrow write them.
//!
//! Read column by column, without Arrow: only what a channel needs is decoded.

mod elapsed;
mod pages;

use std::{fmt::Display, ops::Range};

use ::parquet::{
    basic::{ConvertedType, LogicalType, TimeUnit, Type},
    column::reader::{ColumnReader, ColumnReaderImpl},
    data_type::DataType,
    errors::ParquetError,
    file::{
        reader::{FileReader, RowGroupReader, SerializedFileReader},
        serialized_reader::ReadOptionsBuilder,
    },
    schema::types::ColumnDescriptor,
};
use bytes::Bytes;

use crate::{
    ColumnMap, FileFormat, RecordError, Recording,
    metadata_key::keys,
    property::Property,
    reader::container::{Clock, Container, Head, LIMIT_NUMBERS, Samples, assemble, each_number},
    row_choice::choice_of,
};

use elapsed::elapsed_per_second;
use pages::check_pages;

/// Rows decoded at a time.
const BATCH_ROWS: usize = 1 << 14;
/// Key under which Arrow keeps the types that Parquet has not.
const ARROW_SCHEMA: &str = "ARROW:schema";
/// Key under which pandas keeps what the user has said of a table.
const PANDAS_ATTRIBUTES: &str = "PANDAS_ATTRS";

/// Reads a recording.
pub(super) fn read(
    name: String,
    bytes: Vec<u8>,
    map: &ColumnMap,
) -> Result<Recording, RecordError> {
    let selects_rows = !map.rows().is_empty();
    assemble(name, &ParquetFile { selects_rows, ..ParquetFile::open(bytes)? }, map)
}

/// A file, open for reading.
struct ParquetFile {
    reader: SerializedFileReader<Bytes>,
    bytes: Bytes,
    heads: Vec<Head>,
    /// Columns of elapsed times, by their names, and units of them in a second.
    elapsed: Vec<(String, f64)>,
    /// True where lists of other rows may stand beside those that are read.
    selects_rows: bool,
}

impl ParquetFile {
    fn open(bytes: Vec<u8>) -> Result<Self, RecordError> {
        let options = ReadOptionsBuilder::new().build();
        let bytes = Bytes::from(bytes);
        let reader = SerializedFileReader::new_with_options(bytes.clone(), options);
        let reader = reader.map_err(|error| damaged(&error))?;
        let metadata = reader.metadata();
        let columns = metadata.file_metadata().schema_descr().columns();
        let heads = columns.iter().enumerate().map(|(index, column)| {
            let parts = column.path().parts();
            // of a list only the name counts, the rest is how lists are written
            let path = if is_list(column) { parts[0].clone() } else { parts.join(".") };
            let own = if is_list(column) { &parts[0] } else { &parts[parts.len() - 1] };
            let groups = metadata.row_groups().iter();
            let samples = groups
                .filter_map(|group| group.columns().get(index))
                .map(|chunk| usize::try_from(chunk.num_values()).unwrap_or(usize::MAX))
                .fold(0, usize::saturating_add);
            Head {
                group: None,
                name: last_level(own).to_owned(),
                path,
                samples,
                clock: Clock::Unstated,
                unit: None,
            }
        });
        let heads = heads.collect();
        let pairs = metadata.file_metadata().key_value_metadata();
        let arrow = pairs.into_iter().flatten().find(|pair| pair.key == ARROW_SCHEMA);
        let elapsed = arrow.and_then(|pair| pair.value.as_deref()).map(elapsed_per_second);
        let elapsed = elapsed.unwrap_or_default();
        Ok(Self { reader, bytes, heads, elapsed, selects_rows: false })
    }

    fn descriptor(&self, column: usize) -> &ColumnDescriptor {
        &self.reader.metadata().file_metadata().schema_descr().columns()[column]
    }

    /// Tells whether the file is a table of recordings, one a row, their samples in lists.
    fn is_one_row_of_lists(&self) -> bool {
        let schema = self.reader.metadata().file_metadata().schema_descr();
        let lists = schema.columns().iter().any(|column| is_list(column));
        lists && self.reader.metadata().file_metadata().num_rows() == 1
    }

    /// Visits the readers of a column, one for each row group.
    fn each_group(
        &self,
        column: usize,
        mut visit: impl FnMut(ColumnReader) -> Result<(), RecordError>,
    ) -> Result<(), RecordError> {
        for group in 0..self.reader.num_row_groups() {
            self.check_claims(group, column)?;
            let group: Box<dyn RowGroupReader + '_> =
                self.reader.get_row_group(group).map_err(|error| damaged(&error))?;
            visit(group.get_column_reader(column).map_err(|error| damaged(&error))?)?;
        }
        Ok(())
    }

    /// Refuses a column whose pages claim too much.
    fn check_claims(&self, group: usize, column: usize) -> Result<(), RecordError> {
        let outside = || RecordError::Damaged {
            format: FileFormat::Parquet,
            reason: "a column stands outside of the file".to_owned(),
        };
        let chunk = self.reader.metadata().row_group(group).columns().get(column);
        let chunk = chunk.ok_or_else(outside)?;
        let start = chunk.dictionary_page_offset().unwrap_or(chunk.data_page_offset());
        let start = usize::try_from(start).map_err(|_| outside())?;
        let size = usize::try_from(chunk.compressed_size()).map_err(|_| outside())?;
        let end = start.checked_add(size).ok_or_else(outside)?;
        check_pages(self.bytes.get(start..end).ok_or_else(outside)?)
    }

    /// Decodes a column.
    fn gather(&self, column: usize) -> Result<Gathered, RecordError> {
        let descriptor = self.descriptor(column);
        let name = || self.heads[column].path.clone();
        let rows = self.reader.metadata().file_metadata().num_rows();
        if is_list(descriptor) && rows != 1 && !self.selects_rows {
            return Err(lists_in_rows(rows, &name(), self.choice_of_first_row()));
        }
        let name_of_elapsed = descriptor.path().parts().last();
        let elapsed = self.elapsed.iter().find(|(name, _)| Some(name) == name_of_elapsed);
        let meaning =
            elapsed.map_or_else(|| meaning(descriptor), |(_, per)| Meaning::Decimal(*per));
        let single = descriptor.physical_type() == Type::FLOAT;
        let samples = Samples { single, ..Samples::default() };
        let there = descriptor.max_def_level();
        let mut all = Gathered { samples, there, start: None, starts: Vec::new() };
        let whole = |value: i64, start: &mut Option<i64>| match meaning {
            Meaning::Time(per_second) => {
                let elapsed = i128::from(value) - i128::from(*start.get_or_insert(value));
                elapsed as f64 / per_second
            }
            Meaning::Decimal(scale) => value as f64 / scale,
            Meaning::Unsigned => value.cast_unsigned() as f64,
            Meaning::Plain | Meaning::Half => value as f64,
        };
        let of_bytes = |bytes: &[u8]| match meaning {
            // what is no number is refused beyond any actuator
            Meaning::Decimal(scale) => big_endian(bytes).map_or(f64::NAN, |value| value / scale),
            _ => half(bytes).unwrap_or(f64::NAN),
        };
        let are_numbers = matches!(meaning, Meaning::Decimal(_) | Meaning::Half);
        self.each_group(column, |reader| match reader {
            ColumnReader::DoubleColumnReader(reader) => all.take(reader, |&value, _| value),
            ColumnReader::FloatColumnReader(reader) => all.take(reader, |&v, _| f64::from(v)),
            ColumnReader::Int64ColumnReader(reader) => {
                all.take(reader, |&v, start| whole(v, start))
            }
            ColumnReader::Int32ColumnReader(reader) => all.take(reader, |&value, start| {
                let unsigned = meaning == Meaning::Unsigned;
                let wide = if unsigned { i64::from(value.cast_unsigned()) } else { value.into() };
                whole(wide, start)
            }),
            ColumnReader::BoolColumnReader(reader) => {
                all.take(reader, |&value, _| f64::from(u8::from(value)))
            }
            ColumnReader::Int96ColumnReader(reader) => all.take(reader, |value, start| {
                let now = value.to_nanos();
                let elapsed = i128::from(now) - i128::from(*start.get_or_insert(now));
                elapsed as f64 / 1e9
            }),
            ColumnReader::FixedLenByteArrayColumnReader(reader) if are_numbers => {
                all.take(reader, |value, _| of_bytes(value.data()))
            }
            ColumnReader::ByteArrayColumnReader(reader) if are_numbers => {
                all.take(reader, |value, _| of_bytes(value.data()))
            }
            ColumnReader::ByteArrayColumnReader(_)
            | ColumnReader::FixedLenByteArrayColumnReader(_) => {
                Err(RecordError::NotNumbers { column: name(), found: "text or bytes" })
            }
        })?;
        Ok(all)
    }

    /// The choice of rows that takes the first and no other, by a column that is no list.
    fn choice_of_first_row(&self) -> Option<String> {
        let choice = |(column, head): (usize, &Head)| {
            let mut cells: Vec<String> = Vec::new();
            self.each_cell(column, &mut |cell| cells.push(cell.to_owned())).ok()?;
            let (first, others) = cells.split_first()?;
            (!others.contains(first)).then(|| choice_of(&head.path, first)).flatten()
        };
        let heads = self.heads.iter().enumerate();
        heads.filter(|(column, _)| !is_list(self.descriptor(*column))).find_map(choice)
    }

    /// The text in the only row of a column.
    fn only_text(&self, column: usize) -> Option<String> {
        let mut text = None;
        let read = self.each_group(column, |reader| {
            if let ColumnReader::ByteArrayColumnReader(mut reader) = reader {
                let mut batch = Batch::default();
                batch.next(&mut reader)?;
                let value = batch.values.first();
                text = value.and_then(|value| Some(value.as_utf8().ok()?.to_owned()));
            }
            Ok(())
        });
        read.ok().and(text)
    }
}

fn damaged(error: &ParquetError) -> RecordError {
    let reason = error.to_string().lines().next().unwrap_or_default().to_owned();
    RecordError::Damaged { format: FileFormat::Parquet, reason }
}

/// The last of the levels that pandas joins to a name: `('drive', 'current_a')`.
fn last_level(name: &str) -> &str {
    let levels = name.strip_prefix("('").and_then(|rest| rest.strip_suffix("')"));
    levels.and_then(|levels| levels.rsplit("', '").next()).unwrap_or(name)
}

/// A whole number of any length, the highest byte first.
fn big_endian(bytes: &[u8]) -> Option<f64> {
    let (first, rest) = bytes.split_first()?;
    let start = f64::from(first.cast_signed());
    (bytes.len() <= 16).then(|| rest.iter().fold(start, |sum, &byte| sum * 256.0 + f64::from(byte)))
}

/// A number of half precision, IEEE 754 binary16, the lowest byte first.
fn half(bytes: &[u8]) -> Option<f64> {
    let bits = u16::from_le_bytes(bytes.try_into().ok()?);
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f64::from(bits & 0x3ff));
    let size = match exponent {
        0 => fraction * 2f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction / 1024.0) * 2f64.powi(exponent - 15),
    };
    Some(if bits >> 15 == 1 { -size } else { size })
}

/// The error of lists in several rows, each row a recording.
fn lists_in_rows(rows: impl Display, column: &str, choice: Option<String>) -> RecordError {
    let first = choice.map(|choice| format!(", of which `--where {choice}` reads the first,"));
    RecordError::Unsupported {
        format: FileFormat::Parquet,
        what: format!("lists in {rows} rows (`{column}`){}", first.unwrap_or_default()),
        advice: "`--where COLUMN=VALUE` chooses the row that is read",
    }
}

fn is_list(column: &ColumnDescriptor) -> bool {
    column.max_rep_level() > 0
}

/// Meaning of the numbers of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Meaning {
    Plain,
    Unsigned,
    /// Points in time, so many to a second.
    Time(f64),
    /// Whole numbers of this.
    Decimal(f64),
    /// Half precision.
    Half,
}

fn meaning(column: &ColumnDescriptor) -> Meaning {
    let per_second = |unit: &TimeUnit| match unit {
        TimeUnit::MILLIS => 1e3,
        TimeUnit::MICROS => 1e6,
        TimeUnit::NANOS => 1e9,
    };
    match column.logical_type_ref() {
        Some(LogicalType::Timestamp(time) | LogicalType::Time(time)) => {
            return Meaning::Time(per_second(&time.unit));
        }
        Some(LogicalType::Integer(kind)) if !kind.is_signed => return Meaning::Unsigned,
        Some(LogicalType::Float16) => return Meaning::Half,
        Some(LogicalType::Decimal(kind)) => return Meaning::Decimal(10f64.powi(kind.scale)),
        _ => {}
    }
    match column.converted_type() {
        ConvertedType::TIMESTAMP_MILLIS | ConvertedType::TIME_MILLIS => Meaning::Time(1e3),
        ConvertedType::TIMESTAMP_MICROS | ConvertedType::TIME_MICROS => Meaning::Time(1e6),
        ConvertedType::UINT_8
        | ConvertedType::UINT_16
        | ConvertedType::UINT_32
        | ConvertedType::UINT_64 => Meaning::Unsigned,
        ConvertedType::DECIMAL => Meaning::Decimal(10f64.powi(column.type_scale())),
        _ => Meaning::Plain,
    }
}

/// Values of a column as they are decoded.
struct Batch<T> {
    values: Vec<T>,
    definitions: Vec<i16>,
    repetitions: Vec<i16>,
}

impl<T> Default for Batch<T> {
    fn default() -> Self {
        Self { values: Vec::new(), definitions: Vec::new(), repetitions: Vec::new() }
    }
}

impl<T> Batch<T> {
    /// Decodes some more rows and says how many levels they have; 0 at the end.
    fn next<D: DataType<T = T>>(
        &mut self,
        reader: &mut ColumnReaderImpl<D>,
    ) -> Result<usize, RecordError> {
        self.values.clear();
        self.definitions.clear();
        self.repetitions.clear();
        let levels = (Some(&mut self.definitions), Some(&mut self.repetitions));
        let read = reader.read_records(BATCH_ROWS, levels.0, levels.1, &mut self.values);
        read.map(|(_, _, levels)| levels).map_err(|error| damaged(&error))
    }
}

/// The numbers of a column while its row groups arrive.
struct Gathered {
    samples: Samples,
    /// Definition level of a value that is there.
    there: i16,
    /// First point in time, in its own unit.
    start: Option<i64>,
    /// First sample of each row of lists.
    starts: Vec<usize>,
}

impl Gathered {
    fn take<D: DataType>(
        &mut self,
        mut reader: ColumnReaderImpl<D>,
        number: impl Fn(&D::T, &mut Option<i64>) -> f64,
    ) -> Result<(), RecordError> {
        let mut batch = Batch::default();
        loop {
            let levels = batch.next(&mut reader)?;
            if levels == 0 {
                return Ok(());
            }
            if self.samples.values.len() + levels > LIMIT_NUMBERS {
                return Err(RecordError::TooManyNumbers { limit: LIMIT_NUMBERS });
            }
            let before = self.samples.values.len();
            let starts = batch.repetitions.iter().enumerate().filter(|(_, level)| **level == 0);
            self.starts.extend(starts.map(|(index, _)| before + index));
            let start = &mut self.start;
            if batch.values.len() == levels {
                let values = batch.values.iter().map(|value| number(value, start));
                self.samples.values.extend(values);
                if let Some(present) = &mut self.samples.present {
                    present.extend(std::iter::repeat_n(true, levels));
                }
                continue;
            }
            let present = self.samples.present.get_or_insert_with(|| vec![true; before]);
            let mut values = batch.values.iter();
            for &definition in &batch.definitions {
                let value = if definition == self.there { values.next() } else { None };
                present.push(value.is_some());
                self.samples.values.push(value.map_or(0.0, |value| number(value, start)));
            }
        }
    }
}

impl Container for ParquetFile {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    /// Keys beside the table, what pandas calls its attributes, and in a table of
    /// recordings the columns that are no lists.
    fn properties(&self) -> Vec<(String, Property)> {
        let mut found = Vec::new();
        let pairs = self.reader.metadata().file_metadata().key_value_metadata();
        for pair in pairs.into_iter().flatten() {
            let Some(value) = &pair.value else { continue };
            if pair.key == PANDAS_ATTRIBUTES {
                found.extend(attributes(value));
            } else {
                found.push((pair.key.clone(), Property::Text(value.clone())));
            }
        }
        if self.is_one_row_of_lists() {
            for (column, head) in self.heads.iter().enumerate() {
                let key = head.name.replace('_', "-");
                if is_list(self.descriptor(column)) || !keys().contains(&key.as_str()) {
                    continue;
                }
                let number = self.read(column).ok().and_then(|samples| match &*samples.values {
                    [value] if samples.present.is_none() => Some(Property::Number(*value)),
                    _ => None,
                });
                let property = number.or_else(|| self.only_text(column).map(Property::Text));
                found.extend(property.map(|property| (head.name.clone(), property)));
            }
        }
        found
    }

    fn read(&self, column: usize) -> Result<Samples, RecordError> {
        self.gather(column).map(|all| all.samples)
    }

    fn each_cell(&self, column: usize, visit: &mut dyn FnMut(&str)) -> Result<(), RecordError> {
        let descriptor = self.descriptor(column);
        if descriptor.physical_type() != Type::BYTE_ARRAY || meaning(descriptor) != Meaning::Plain {
            each_number(&self.read(column)?, visit);
            return Ok(());
        }
        self.each_group(column, |reader| {
            let ColumnReader::ByteArrayColumnReader(mut reader) = reader else {
                unreachable!("a column of bytes has a reader of bytes")
            };
            let mut batch = Batch::default();
            loop {
                let levels = batch.next(&mut reader)?;
                if levels == 0 {
                    return Ok(());
                }
                let mut values = batch.values.iter();
                for index in 0..levels {
                    let definition = batch.definitions.get(index);
                    let is_there = definition.is_none_or(|own| *own == descriptor.max_def_level());
                    let value = if is_there { values.next() } else { None };
                    visit(value.and_then(|value| value.as_utf8().ok()).unwrap_or_default());
                }
            }
        })
    }

    fn in_rows(&self, column: usize, rows: &[usize]) -> Result<Option<Range<usize>>, RecordError> {
        if !is_list(self.descriptor(column)) {
            return Ok(None);
        }
        let &[row] = rows else {
            return Err(lists_in_rows(rows.len(), &self.heads[column].path, None));
        };
        let Gathered { samples, starts, .. } = self.gather(column)?;
        let end = |row: usize| starts.get(row).copied().unwrap_or(samples.values.len());
        Ok(Some(end(row)..end(row + 1)))
    }
}

/// The attributes of a data frame, which pandas writes as JSON.
fn attributes(json: &str) -> Vec<(String, Property)> {
    let Ok(serde_json::Value::Object(all)) = serde_json::from_str(json) else {
        return Vec::new();
    };
    all.into_iter()
        .filter_map(|(key, value)| {
            let text = || value.as_str().map(|text| Property::Text(text.to_owned()));
            Some((key, value.as_f64().map(Property::Number).or_else(text)?))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use ::parquet::{
        data_type::{ByteArray, ByteArrayType, DoubleType},
        file::writer::SerializedFileWriter,
        schema::parser::parse_message_type,
    };

    use super::*;
    use crate::ChannelName;

    #[test]
    fn halves_and_decimals_are_numbers() {
        assert_eq!(half(&[0x00, 0x3c]), Some(1.0));
        assert_eq!(half(&[0x00, 0xc2]), Some(-3.0));
        assert_eq!(half(&[0x01, 0x00]), Some(2f64.powi(-24)));
        assert_eq!(big_endian(&[0xff, 0xfe]), Some(-2.0));
        assert_eq!(big_endian(&[0x01, 0x00]), Some(256.0));
        assert_eq!(big_endian(&[0; 17]), None);
    }

    /// A table of two recordings, one a row, the second one sample shorter.
    fn two_rows_of_lists() -> Vec<u8> {
        const SCHEMA: &str = "message table {
            required binary run (UTF8);
            required group time_s (LIST) { repeated group list { required double element; } }
            required group current_a (LIST) { repeated group list { required double element; } }
        }";
        let schema = Arc::new(parse_message_type(SCHEMA).unwrap());
        let mut bytes = Vec::new();
        let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::default()).unwrap();
        let mut group = writer.next_row_group().unwrap();
        let mut names = group.next_column().unwrap().unwrap();
        let runs = ["first", "second"].map(ByteArray::from);
        names.typed::<ByteArrayType>().write_batch(&runs, None, None).unwrap();
        names.close().unwrap();
        for values in [[0.0, 0.1, 0.2, 0.0, 0.1], [1.0, 2.0, 3.0, 4.0, 5.0]] {
            let mut lists = group.next_column().unwrap().unwrap();
            let (there, begins) = ([1; 5], [0, 1, 1, 0, 1]);
            let column = lists.typed::<DoubleType>();
            column.write_batch(&values, Some(&there), Some(&begins)).unwrap();
            lists.close().unwrap();
        }
        group.close().unwrap();
        writer.close().unwrap();
        bytes
    }

    #[test]
    fn a_row_of_lists_is_chosen_by_its_name() {
        let of = |choices: &[&str]| {
            let map = ColumnMap::default().with_rows(choices).unwrap();
            read("r.parquet".to_owned(), two_rows_of_lists(), &map)
        };
        for (choice, values) in [("run=first", &[1.0, 2.0, 3.0][..]), ("run=second", &[4.0, 5.0])] {
            let recording = of(&[choice]).unwrap();
            let current = recording.channel(ChannelName::Current).unwrap();
            let times = &[0.0, 0.1, 0.2][..values.len()];
            assert_eq!((current.values(), current.times_s()), (values, times), "{choice}");
        }
        assert_eq!(
            of(&["run=third"]).unwrap_err().to_string(),
            "no row has `run=third` (`--where`); values of `run`: `first`, `second`"
        );
        let several = of(&[]).unwrap_err().to_string();
        assert!(several.contains("`--where COLUMN=VALUE` chooses the row"), "{several}");
        let told = of(&[]).unwrap_err().to_string();
        assert!(told.contains("of which `--where run=first` reads the first,"), "{told}");
    }

    #[test]
    fn the_last_level_of_a_name_counts() {
        assert_eq!(last_level("('drive', 'current_a')"), "current_a");
        assert_eq!(last_level("current_a"), "current_a");
    }
}
