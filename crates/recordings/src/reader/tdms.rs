//! NI TDMS files, as `LabVIEW` and its relatives write them.
//!
//! "The NI TDMS File Format" (National Instruments, tutorial 5696): segments, each with a
//! lead-in, metadata of its objects and raw data in chunks.

use std::collections::BTreeMap;

use crate::{
    ColumnMap, FileFormat, RecordError, Recording,
    property::Property,
    reader::container::{Clock, Container, Head, Samples, assemble},
};

const LEAD_IN_BYTES: usize = 28;
/// Data of a DAQ device before its scaling, in a layout of their own.
const DAQMX: [u32; 2] = [0x0000_1269, 0x0000_126a];
/// An object without data in this segment.
const NO_DATA: u32 = 0xffff_ffff;
/// Length of a segment whose writer was interrupted.
const UNFINISHED: u64 = u64::MAX;
/// Longest path of an object.
const LONGEST_NAME: usize = 1024;
/// Most pieces that the data of all channels may be in.
const MOST_RUNS: usize = 1 << 22;

/// Bits of the table of contents.
mod contents {
    pub(super) const METADATA: u32 = 1 << 1;
    pub(super) const NEW_OBJECTS: u32 = 1 << 2;
    pub(super) const RAW_DATA: u32 = 1 << 3;
    pub(super) const INTERLEAVED: u32 = 1 << 5;
    pub(super) const BIG_ENDIAN: u32 = 1 << 6;
}

/// Reads a recording.
pub(super) fn read(
    name: String,
    bytes: Vec<u8>,
    map: &ColumnMap,
) -> Result<Recording, RecordError> {
    assemble(name, &TdmsFile::open(bytes)?, map)
}

/// A type of data, by its number in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct DataType(u32);

impl DataType {
    const STRING: Self = Self(0x20);
    const TIME: Self = Self(0x44);

    /// Bytes of one value, where all values take as many.
    fn size(self) -> Option<usize> {
        match self.0 {
            1 | 5 | 0x21 => Some(1),
            2 | 6 => Some(2),
            3 | 7 | 9 | 0x19 => Some(4),
            4 | 8 | 10 | 0x1a | 0x0008_000c => Some(8),
            0x44 | 0x0010_000d => Some(16),
            _ => None,
        }
    }

    /// Name of the type, where it is no number.
    fn not_a_number(self) -> Option<&'static str> {
        match self.0 {
            1..=10 | 0x19 | 0x1a | 0x21 | 0x44 => None,
            0x20 => Some("text"),
            0x0008_000c | 0x0010_000d => Some("complex numbers"),
            _ => Some("values of an unknown type"),
        }
    }
}

/// Where some values of a channel stand: the same place in each of several chunks.
#[derive(Clone, Copy, Debug)]
struct Run {
    offset: usize,
    chunks: usize,
    chunk_bytes: usize,
    values: usize,
    /// From one value to the next.
    stride: usize,
    kind: DataType,
    big_endian: bool,
}

/// Data of an object in each chunk of a segment.
#[derive(Clone, Copy, Debug)]
struct Layout {
    kind: DataType,
    values: usize,
    bytes: usize,
}

/// An object of the file: itself, a group or a channel.
#[derive(Debug, Default)]
struct Object {
    properties: BTreeMap<String, Property>,
    layout: Option<Layout>,
    runs: Vec<Run>,
    daqmx: bool,
    /// True where the chunks of the current segment hold data of the object.
    listed: bool,
    /// When its waveform began.
    started: Option<Instant>,
}

/// A point in time: whole seconds since 1904, and 2⁻⁶⁴ of a second.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Instant {
    seconds: i64,
    fraction: u64,
}

impl Instant {
    fn of(bytes: &[u8], big_endian: bool) -> Self {
        let (low, high) = bytes.split_at(8);
        let (seconds, fraction) = if big_endian { (low, high) } else { (high, low) };
        let seconds = word(seconds, big_endian).cast_signed();
        Self { seconds, fraction: word(fraction, big_endian) }
    }

    /// Seconds since an earlier one.
    fn since_s(self, start: Self) -> f64 {
        let whole = i128::from(self.seconds) - i128::from(start.seconds);
        let part = i128::from(self.fraction) - i128::from(start.fraction);
        whole as f64 + part as f64 / 2f64.powi(64)
    }
}

/// A file, open for reading.
#[derive(Debug)]
struct TdmsFile {
    bytes: Vec<u8>,
    objects: Vec<(String, Object)>,
    /// Which object a column is.
    columns: Vec<usize>,
    heads: Vec<Head>,
}

impl TdmsFile {
    /// Reads the metadata of all segments.
    fn open(bytes: Vec<u8>) -> Result<Self, RecordError> {
        let mut index = Index::default();
        let mut at = 0;
        while bytes.len() - at >= LEAD_IN_BYTES {
            at = index.segment(&bytes, at)?;
        }
        if at == 0 || at < bytes.len() {
            return Err(damaged("truncated: ends within the lead-in of a segment"));
        }
        let mut file =
            Self { bytes, objects: index.objects, columns: Vec::new(), heads: Vec::new() };
        let earliest = file.objects.iter().filter_map(|(_, object)| object.started).min();
        for (place, (path, object)) in file.objects.iter().enumerate() {
            let Some((group, name)) = split_path(path) else { continue };
            let samples = object.runs.iter().map(|run| run.chunks.saturating_mul(run.values));
            let samples = samples.fold(0, usize::saturating_add);
            file.columns.push(place);
            file.heads.push(Head {
                path: format!("{group}/{name}"),
                group: Some(group),
                name,
                samples,
                clock: clock(object, earliest),
                unit: match object.properties.get("unit_string") {
                    Some(Property::Text(unit)) => Some(unit.clone()),
                    _ => None,
                },
            });
        }
        Ok(file)
    }
}

/// The axis of a waveform: `wf_increment` is the time between samples, and the first one is
/// `wf_start_offset` after `wf_start_time`. Time 0 is when the earliest waveform started.
fn clock(object: &Object, earliest: Option<Instant>) -> Clock {
    let number = |key: &str| match object.properties.get(key) {
        Some(Property::Number(value)) => Some(*value),
        _ => None,
    };
    let later_s = object.started.zip(earliest).map_or(0.0, |(own, first)| own.since_s(first));
    let start_s = number("wf_start_offset").unwrap_or(0.0) + later_s;
    // files without a clock of their own state an increment of 0
    let step = number("wf_increment").filter(|step_s| *step_s > 0.0);
    step.map_or(Clock::Unstated, |step_s| Clock::Uniform { start_s, step_s })
}

/// Group and channel of a path `/'group'/'channel'`, where quotes inside are doubled.
fn split_path(path: &str) -> Option<(String, String)> {
    let inner = path.strip_prefix("/'")?.strip_suffix('\'')?;
    let (group, channel) = inner.split_once("'/'")?;
    Some((group.replace("''", "'"), channel.replace("''", "'")))
}

fn damaged(reason: &str) -> RecordError {
    RecordError::Damaged { format: FileFormat::Tdms, reason: reason.to_owned() }
}

/// Index of the file, from the segments read so far.
#[derive(Default)]
struct Index {
    objects: Vec<(String, Object)>,
    by_path: BTreeMap<String, usize>,
    /// Objects with data in the chunks of the current segment, in their order.
    listed: Vec<usize>,
    runs: usize,
}

impl Index {
    /// Reads a segment and gives the place of the next.
    fn segment(&mut self, bytes: &[u8], at: usize) -> Result<usize, RecordError> {
        if &bytes[at..at + 4] != b"TDSm" {
            return Err(damaged("no segment where one should begin"));
        }
        let mut lead_in = Parser { bytes: &bytes[at + 4..], big_endian: false };
        let flags = lead_in.u32()?;
        lead_in.big_endian = flags & contents::BIG_ENDIAN != 0;
        let _version = lead_in.u32()?;
        let (next, data) = (lead_in.u64()?, lead_in.u64()?);
        let rest = bytes.len() - at - LEAD_IN_BYTES;
        if next != UNFINISHED && next > rest as u64 {
            let missing = next - rest as u64;
            return Err(damaged(&format!("truncated: its last {missing} bytes are not there")));
        }
        // a writer that was interrupted has not filled in the length
        let length = usize::try_from(next).unwrap_or(usize::MAX).min(rest);
        let data = usize::try_from(data).unwrap_or(usize::MAX);
        if data > length {
            return Err(damaged("data of a segment begin behind its end"));
        }
        if flags & contents::NEW_OBJECTS != 0 {
            for place in self.listed.drain(..) {
                self.objects[place].1.listed = false;
            }
        }
        let body = &bytes[at + LEAD_IN_BYTES..at + LEAD_IN_BYTES + length];
        if flags & contents::METADATA != 0 {
            self.metadata(&mut Parser { bytes: &body[..data], big_endian: lead_in.big_endian })?;
        }
        if flags & contents::RAW_DATA != 0 {
            self.raw_data(at + LEAD_IN_BYTES + data, length - data, flags)?;
        }
        Ok(at + LEAD_IN_BYTES + length)
    }

    fn metadata(&mut self, parser: &mut Parser<'_>) -> Result<(), RecordError> {
        let count = parser.u32()?;
        for _ in 0..count {
            let path = parser.name()?;
            let place = *self.by_path.entry(path.clone()).or_insert_with(|| {
                self.objects.push((path, Object::default()));
                self.objects.len() - 1
            });
            let object = &mut self.objects[place].1;
            match parser.u32()? {
                NO_DATA => {}
                0 => self.list(place),
                size if DAQMX.contains(&size) => {
                    parser.skip_daqmx()?;
                    object.daqmx = true;
                    self.list(place);
                }
                _ => {
                    object.layout = Some(parser.layout()?);
                    self.list(place);
                }
            }
            let properties = parser.u32()?;
            for _ in 0..properties {
                let name = parser.name()?;
                let object = &mut self.objects[place].1;
                match parser.property()? {
                    Found::Property(value) => {
                        object.properties.insert(name, value);
                    }
                    Found::Instant(instant) if name == "wf_start_time" => {
                        object.started = Some(instant);
                    }
                    Found::Instant(_) | Found::Other => {}
                }
            }
        }
        Ok(())
    }

    fn list(&mut self, place: usize) {
        if !std::mem::replace(&mut self.objects[place].1.listed, true) {
            self.listed.push(place);
        }
    }

    /// Notes where the values of the listed objects stand.
    fn raw_data(&mut self, start: usize, length: usize, flags: u32) -> Result<(), RecordError> {
        // what a lead-in without metadata says anew is counted too
        self.runs += self.listed.len();
        if self.runs > MOST_RUNS {
            return Err(damaged("data in too many pieces"));
        }
        let listed = self.listed.iter().map(|&place| (place, &self.objects[place].1));
        if listed.clone().any(|(_, object)| object.daqmx) {
            // their channels are refused when they are asked for
            return Ok(());
        }
        let layouts: Option<Vec<_>> =
            listed.map(|(place, object)| Some((place, object.layout?))).collect();
        let layouts = layouts.ok_or_else(|| damaged("data of an object without a type"))?;
        let chunk_bytes = layouts.iter().map(|(_, layout)| layout.bytes);
        let chunk_bytes = chunk_bytes.fold(0, usize::saturating_add);
        if chunk_bytes == 0 {
            return Ok(());
        }
        let interleaved = flags & contents::INTERLEAVED != 0;
        let row_bytes: Option<usize> = layouts.iter().map(|(_, layout)| layout.kind.size()).sum();
        let row_bytes = match row_bytes {
            Some(row_bytes) if interleaved => row_bytes,
            None if interleaved => return Err(damaged("interleaved text")),
            _ => 0,
        };
        let chunks = length / chunk_bytes;
        let mut offset = start;
        for (place, layout) in layouts.into_iter().filter(|_| chunks > 0) {
            let size = layout.kind.size().unwrap_or(0);
            if layout.values > 0 {
                self.objects[place].1.runs.push(Run {
                    offset,
                    chunks,
                    chunk_bytes,
                    values: layout.values,
                    stride: if interleaved { row_bytes } else { size },
                    kind: layout.kind,
                    big_endian: flags & contents::BIG_ENDIAN != 0,
                });
            }
            offset += if interleaved { size } else { layout.bytes };
        }
        Ok(())
    }
}

/// Value of a property.
enum Found {
    Property(Property),
    Instant(Instant),
    Other,
}

/// Takes the parts of metadata off their front.
struct Parser<'a> {
    bytes: &'a [u8],
    big_endian: bool,
}

impl<'a> Parser<'a> {
    fn take(&mut self, size: usize) -> Result<&'a [u8], RecordError> {
        let (taken, rest) = self
            .bytes
            .split_at_checked(size)
            .ok_or_else(|| damaged("ends within the metadata of a segment"))?;
        self.bytes = rest;
        Ok(taken)
    }

    fn u32(&mut self) -> Result<u32, RecordError> {
        let big_endian = self.big_endian;
        Ok(word(self.take(4)?, big_endian) as u32)
    }

    fn u64(&mut self) -> Result<u64, RecordError> {
        let big_endian = self.big_endian;
        Ok(word(self.take(8)?, big_endian))
    }

    fn text(&mut self) -> Result<&'a [u8], RecordError> {
        let size = self.u32()? as usize;
        self.take(size)
    }

    fn name(&mut self) -> Result<String, RecordError> {
        let text = self.text()?;
        if text.len() > LONGEST_NAME {
            return Err(damaged("a name that is too long"));
        }
        Ok(String::from_utf8_lossy(text).into_owned())
    }

    fn layout(&mut self) -> Result<Layout, RecordError> {
        let kind = DataType(self.u32()?);
        let _dimensions = self.u32()?;
        let values = usize::try_from(self.u64()?).unwrap_or(usize::MAX);
        let bytes = if kind == DataType::STRING {
            usize::try_from(self.u64()?).unwrap_or(usize::MAX)
        } else {
            let size = kind.size().ok_or_else(|| damaged("data of an unknown type"))?;
            values.saturating_mul(size)
        };
        Ok(Layout { kind, values, bytes })
    }

    /// Skips the index of data of a DAQ device: dimension, values, scalers, widths.
    fn skip_daqmx(&mut self) -> Result<(), RecordError> {
        self.take(4 + 4 + 8)?;
        for entry_bytes in [20, 4] {
            let count = self.u32()? as usize;
            self.take(count.saturating_mul(entry_bytes))?;
        }
        Ok(())
    }

    fn property(&mut self) -> Result<Found, RecordError> {
        let kind = DataType(self.u32()?);
        if kind == DataType::STRING {
            let text = self.text()?;
            return Ok(Found::Property(Property::Text(String::from_utf8_lossy(text).into_owned())));
        }
        let size = kind.size().ok_or_else(|| damaged("a property of an unknown type"))?;
        let big_endian = self.big_endian;
        let bytes = self.take(size)?;
        Ok(match kind.not_a_number() {
            _ if kind == DataType::TIME => Found::Instant(Instant::of(bytes, big_endian)),
            None => Found::Property(Property::Number(value(bytes, kind, big_endian))),
            Some(_) => Found::Other,
        })
    }
}

/// Up to eight bytes as a whole number.
fn word(bytes: &[u8], big_endian: bool) -> u64 {
    let shift = |word: u64, &byte: &u8| word << 8 | u64::from(byte);
    if big_endian { bytes.iter().fold(0, shift) } else { bytes.iter().rev().fold(0, shift) }
}

/// A number, from as many bytes as its type has.
fn value(bytes: &[u8], kind: DataType, big_endian: bool) -> f64 {
    let word = word(bytes, big_endian);
    match kind.0 {
        1 => f64::from((word as u8).cast_signed()),
        2 => f64::from((word as u16).cast_signed()),
        3 => f64::from((word as u32).cast_signed()),
        4 => word.cast_signed() as f64,
        9 | 0x19 => f64::from(f32::from_bits(word as u32)),
        10 | 0x1a => f64::from_bits(word),
        _ => word as f64,
    }
}

impl TdmsFile {
    /// The bytes of each value of a channel.
    fn each(&self, object: &Object, mut visit: impl FnMut(&[u8], &Run)) -> Result<(), RecordError> {
        for run in &object.runs {
            let size = run.kind.size().unwrap_or(0);
            for chunk in 0..run.chunks {
                let start = run.offset + chunk * run.chunk_bytes;
                for index in 0..run.values {
                    let at = index.checked_mul(run.stride).and_then(|at| at.checked_add(start));
                    let value = at.and_then(|at| self.bytes.get(at..at.checked_add(size)?));
                    visit(value.ok_or_else(|| damaged("ends within its data"))?, run);
                }
            }
        }
        Ok(())
    }
}

impl Container for TdmsFile {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    fn properties(&self) -> Vec<(String, Property)> {
        let of_file = self.objects.iter().filter(|(path, _)| path == "/");
        let all = of_file.flat_map(|(_, object)| &object.properties);
        all.map(|(key, value)| (key.clone(), value.clone())).collect()
    }

    fn read(&self, column: usize) -> Result<Samples, RecordError> {
        let path = &self.heads[column].path;
        let object = &self.objects[self.columns[column]].1;
        if object.daqmx {
            return Err(RecordError::Unsupported {
                format: FileFormat::Tdms,
                what: format!("raw data of a DAQ device in `{path}`"),
                advice: "save it with the scaled values",
            });
        }
        let found = object.runs.iter().find_map(|run| run.kind.not_a_number());
        if let Some(found) = found {
            return Err(RecordError::NotNumbers { column: path.clone(), found });
        }
        let first = object.runs.first().map(|run| run.kind);
        let mut samples = Samples::of(Vec::new());
        samples.single = matches!(first, Some(DataType(9 | 0x19)));
        let mut start = None;
        self.each(object, |bytes, run| {
            samples.values.push(if run.kind == DataType::TIME {
                let now = Instant::of(bytes, run.big_endian);
                now.since_s(*start.get_or_insert(now))
            } else {
                value(bytes, run.kind, run.big_endian)
            });
        })?;
        if let Some(scaling) = Scaling::of(&object.properties, path)? {
            samples.values.iter_mut().for_each(|value| *value = scaling.apply(*value));
            samples.single = false;
        }
        Ok(samples)
    }
}

/// Steps from the numbers in the file to physical values: polynomials, one after the other.
struct Scaling {
    steps: Vec<Vec<f64>>,
}

impl Scaling {
    fn of(
        properties: &BTreeMap<String, Property>,
        path: &str,
    ) -> Result<Option<Self>, RecordError> {
        let number = |key: String| match properties.get(&key) {
            Some(Property::Number(value)) => Some(*value),
            _ => None,
        };
        let count = number("NI_Number_Of_Scales".to_owned()).unwrap_or(0.0);
        if count < 1.0 || count.is_nan() {
            return Ok(None);
        }
        let refused = |kind: &str| RecordError::Unsupported {
            format: FileFormat::Tdms,
            what: format!("the scaling `{kind}` of `{path}`"),
            advice: "save it with the scaled values",
        };
        // the last scale gives the value; each names the one whose result it takes
        let mut steps = Vec::new();
        let mut next = count - 1.0;
        while steps.len() < 16 {
            let key = |rest: &str| format!("NI_Scale[{next}]_{rest}");
            let kind = match properties.get(&key("Scale_Type")) {
                Some(Property::Text(kind)) => kind.as_str(),
                _ => return Err(refused("none")),
            };
            let coefficients: Option<Vec<f64>> = match kind {
                "Linear" => ["Linear_Y_Intercept", "Linear_Slope"]
                    .into_iter()
                    .map(|rest| number(key(rest)))
                    .collect(),
                "Polynomial" => {
                    let size = number(key("Polynomial_Coefficients_Size")).unwrap_or(4.0);
                    (0..size.clamp(0.0, 32.0) as usize)
                        .map(|index| number(key(&format!("Polynomial_Coefficients[{index}]"))))
                        .collect()
                }
                _ => None,
            };
            steps.push(coefficients.ok_or_else(|| refused(kind))?);
            match number(key(&format!("{kind}_Input_Source"))) {
                Some(source) if source >= 0.0 && source < next => next = source,
                // the raw data
                _ => {
                    steps.reverse();
                    return Ok(Some(Self { steps }));
                }
            }
        }
        Err(refused("of many steps"))
    }

    fn apply(&self, value: f64) -> f64 {
        let polynomial = |value: f64, coefficients: &Vec<f64>| {
            coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * value + coefficient)
        };
        self.steps.iter().fold(value, polynomial)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_name_group_and_channel() {
        let split = |path: &str| split_path(path);
        assert_eq!(split("/'g'/'it''s'"), Some(("g".to_owned(), "it's".to_owned())));
        assert_eq!(split("/'g'"), None);
        assert_eq!(split("/"), None);
    }

    #[test]
    fn scales_follow_their_sources() {
        let text = |value: &str| Property::Text(value.to_owned());
        let number = Property::Number;
        let properties: BTreeMap<String, Property> = [
            ("NI_Number_Of_Scales", number(2.0)),
            ("NI_Scale[0]_Scale_Type", text("Linear")),
            ("NI_Scale[0]_Linear_Slope", number(2.0)),
            ("NI_Scale[0]_Linear_Y_Intercept", number(1.0)),
            ("NI_Scale[1]_Scale_Type", text("Polynomial")),
            ("NI_Scale[1]_Polynomial_Coefficients_Size", number(3.0)),
            ("NI_Scale[1]_Polynomial_Coefficients[0]", number(0.5)),
            ("NI_Scale[1]_Polynomial_Coefficients[1]", number(0.0)),
            ("NI_Scale[1]_Polynomial_Coefficients[2]", number(1.0)),
            ("NI_Scale[1]_Polynomial_Input_Source", number(0.0)),
        ]
        .map(|(key, value)| (key.to_owned(), value))
        .into();
        let scaling = Scaling::of(&properties, "g/c").unwrap().unwrap();
        assert_eq!(scaling.apply(3.0), 49.5);
        let mut other = properties;
        other.insert("NI_Scale[1]_Scale_Type".to_owned(), text("Thermocouple"));
        let error = Scaling::of(&other, "g/c").err().unwrap().to_string();
        assert_eq!(
            error,
            "`.tdms` with the scaling `Thermocouple` of `g/c` is not read (save it with the \
             scaled values)"
        );
    }

    #[test]
    fn what_is_no_file_of_this_kind_is_refused() {
        let error = |bytes: &[u8]| TdmsFile::open(bytes.to_vec()).unwrap_err().to_string();
        assert_eq!(
            error(b"TDSm"),
            "damaged `.tdms` file: truncated: ends within the lead-in of a segment"
        );
        assert_eq!(error(&[0; 40]), "damaged `.tdms` file: no segment where one should begin");
    }

    fn text(bytes: &mut Vec<u8>, text: &str) {
        bytes.extend((text.len() as u32).to_le_bytes());
        bytes.extend(text.as_bytes());
    }

    /// A file of one segment with one channel, in the layout of the tutorial.
    fn file(values: &[f64], unit: &str) -> Vec<u8> {
        let mut metadata = 1_u32.to_le_bytes().to_vec();
        text(&mut metadata, "/'g'/'current_a'");
        for word in [20_u32, 10, 1] {
            metadata.extend(word.to_le_bytes());
        }
        metadata.extend((values.len() as u64).to_le_bytes());
        metadata.extend(2_u32.to_le_bytes());
        text(&mut metadata, "unit_string");
        metadata.extend(0x20_u32.to_le_bytes());
        text(&mut metadata, unit);
        text(&mut metadata, "wf_increment");
        metadata.extend(10_u32.to_le_bytes());
        metadata.extend(0.5_f64.to_le_bytes());
        let data: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let mut bytes = b"TDSm".to_vec();
        bytes.extend(0b1110_u32.to_le_bytes());
        bytes.extend(4713_u32.to_le_bytes());
        bytes.extend(((metadata.len() + data.len()) as u64).to_le_bytes());
        bytes.extend((metadata.len() as u64).to_le_bytes());
        [bytes, metadata, data].concat()
    }

    fn read(bytes: Vec<u8>) -> Result<Vec<f64>, String> {
        let map = crate::ColumnMap::default();
        let read = crate::Recording::from_bytes("r", FileFormat::Tdms, bytes, &map);
        let recording = read.map_err(|error| error.to_string())?;
        Ok(recording.channels()[0].values().to_vec())
    }

    #[test]
    fn units_rows_and_ends_are_looked_at() {
        let values = [1000.0, -250.0];
        assert_eq!(read(file(&values, "A")), Ok(values.to_vec()));
        assert_eq!(read(file(&values, "mA")), Ok(vec![1.0, -0.25]));
        let refused = read(file(&values, "psi")).unwrap_err();
        assert!(
            refused.starts_with("column `g/current_a` is in `psi` as the file says"),
            "{refused}"
        );
        assert_eq!(
            read(file(&[], "A")),
            Err("no samples: the file has `g/current_a` and no rows of it".to_owned())
        );
        let mut short = file(&values, "A");
        short.truncate(short.len() - 3);
        assert_eq!(
            read(short),
            Err("damaged `.tdms` file: truncated: its last 3 bytes are not there".to_owned())
        );
    }
}
