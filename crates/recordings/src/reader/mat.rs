//! MATLAB files of level 5 (versions 5 to 7), plain and compressed.
//!
//! "MAT-File Format", The `MathWorks`, chapter 1 (level 5): a header of 128 bytes, then data
//! elements, each a tag and its bytes; a compressed element holds another one.

use std::io::Read;

use flate2::read::ZlibDecoder;

use crate::{
    ColumnMap, FileFormat, RecordError, Recording,
    format::HDF5_MAGIC,
    metadata_key::keys,
    property::Property,
    reader::container::{Clock, Container, Head, LIMIT_NUMBERS, Samples, assemble},
};

const HEADER_BYTES: usize = 128;
/// Header of MATLAB 7.3 before its HDF5.
const HDF5_HEADER_BYTES: usize = 512;
/// Arrays inside arrays; what is deeper was not made by a person.
const MAX_DEPTH: u32 = 32;
/// Most bytes that one file may unpack to.
const LIMIT_BYTES: usize = 1 << 30;
/// Longest name: four times that of MATLAB itself.
const LONGEST_NAME: usize = 252;
/// Most arrays, those within others counted.
const MOST_ARRAYS: usize = 1 << 16;
/// Widest matrix whose columns are taken for signals.
const MOST_COLUMNS: usize = 64;

/// Types of stored data (table 1-1).
mod stored {
    pub(super) const INT8: u32 = 1;
    pub(super) const UINT8: u32 = 2;
    pub(super) const INT16: u32 = 3;
    pub(super) const UINT16: u32 = 4;
    pub(super) const INT32: u32 = 5;
    pub(super) const UINT32: u32 = 6;
    pub(super) const SINGLE: u32 = 7;
    pub(super) const DOUBLE: u32 = 9;
    pub(super) const INT64: u32 = 12;
    pub(super) const UINT64: u32 = 13;
    pub(super) const MATRIX: u32 = 14;
    pub(super) const COMPRESSED: u32 = 15;
    pub(super) const UTF8: u32 = 16;
    pub(super) const UTF16: u32 = 17;
}

/// Classes of arrays (table 1-3).
mod class {
    pub(super) const CELL: u8 = 1;
    pub(super) const STRUCT: u8 = 2;
    pub(super) const CHAR: u8 = 4;
    pub(super) const SPARSE: u8 = 5;
    pub(super) const SINGLE: u8 = 7;
    pub(super) const UINT64: u8 = 15;
}

/// Reads a recording.
#[cfg_attr(
    not(feature = "hdf5"),
    expect(clippy::needless_pass_by_value, reason = "all readers have one signature")
)]
pub(super) fn read(
    name: String,
    bytes: Vec<u8>,
    map: &ColumnMap,
) -> Result<Recording, RecordError> {
    #[cfg(feature = "hdf5")]
    if is_hdf5(&bytes) {
        return super::hdf5::read_matlab(name, bytes, map);
    }
    assemble(name, &MatFile::open(&bytes)?, map)
}

/// The arrays of a file, flattened.
#[derive(Debug, Default)]
struct MatFile {
    heads: Vec<Head>,
    columns: Vec<Column>,
    properties: Vec<(String, Property)>,
}

#[derive(Debug)]
enum Column {
    Numbers(Samples),
    Other(&'static str),
}

impl MatFile {
    /// Reads the arrays of a file.
    fn open(bytes: &[u8]) -> Result<Self, RecordError> {
        let order = byte_order(bytes)?;
        let mut reader = Reader { order, arrays: 0, numbers: 0, bytes: 0 };
        let mut file = Self::default();
        let mut rest = Cursor { bytes: &bytes[HEADER_BYTES..], order };
        while !rest.bytes.is_empty() {
            let element = rest.element()?;
            let (name, value) = match element.kind {
                stored::COMPRESSED => {
                    let inner = reader.inflate(element.bytes)?;
                    let element = Cursor { bytes: &inner, order }.element()?;
                    reader.top(&element)?
                }
                _ => reader.top(&element)?,
            };
            file.flatten(None, &name, value);
        }
        Ok(file)
    }

    /// Adds an array under the name by which MATLAB reaches it.
    fn flatten(&mut self, group: Option<&str>, name: &str, value: Value) {
        let path = group.map_or_else(|| name.to_owned(), |group| format!("{group}.{name}"));
        match value {
            Value::Struct(elements) => {
                let single = elements.len() == 1;
                for (index, fields) in elements.into_iter().enumerate() {
                    let place =
                        if single { path.clone() } else { format!("{path}({})", index + 1) };
                    let stated = StatedName::of(&fields);
                    for (field, value) in fields {
                        self.flatten(Some(&place), &field, value);
                    }
                    if let Some(stated) = stated {
                        self.call(&place, stated);
                    }
                }
            }
            Value::Cell(elements) => {
                for (index, value) in elements.into_iter().enumerate() {
                    self.flatten(group, &format!("{name}{{{}}}", index + 1), value);
                }
            }
            Value::Numbers { rows, columns, samples } if is_matrix(rows, columns) => {
                for (index, values) in samples.values.chunks_exact(rows).enumerate() {
                    let name = format!("{name}(:,{})", index + 1);
                    let samples = Samples { values: values.to_vec(), ..samples.clone_kind() };
                    self.push(group, name, Column::Numbers(samples));
                }
            }
            Value::Numbers { samples, .. } => {
                if let [value] = samples.values.as_slice()
                    && keys().contains(&name.replace('_', "-").as_str())
                {
                    self.properties.push((name.to_owned(), Property::Number(*value)));
                    return;
                }
                self.push(group, name.to_owned(), Column::Numbers(samples));
            }
            Value::Text(text) => {
                self.properties.push((name.to_owned(), Property::Text(text)));
            }
            Value::Other(what) => self.push(group, name.to_owned(), Column::Other(what)),
        }
    }

    /// Gives the only column in a struct the name and the unit that stand beside it.
    fn call(&mut self, place: &str, StatedName { name, unit }: StatedName) {
        let mut own = self.heads.iter_mut().filter(|head| head.group.as_deref() == Some(place));
        if let (Some(head), None) = (own.next(), own.next()) {
            head.name = name;
            head.unit = unit;
            // structs of one signal each share the axis of their length
            head.group = None;
        }
    }

    fn push(&mut self, group: Option<&str>, name: String, column: Column) {
        let path = group.map_or_else(|| name.clone(), |group| format!("{group}.{name}"));
        let samples = match &column {
            Column::Numbers(samples) => samples.values.len(),
            Column::Other(_) => 0,
        };
        let group = group.map(str::to_owned);
        self.heads.push(Head { group, name, path, samples, clock: Clock::Unstated, unit: None });
        self.columns.push(column);
    }
}

/// Name and unit of a signal that stand beside its numbers, as dSPACE writes them.
struct StatedName {
    name: String,
    unit: Option<String>,
}

impl StatedName {
    fn of(fields: &[(String, Value)]) -> Option<Self> {
        let text = |names: &[&str]| {
            fields.iter().find_map(|(field, value)| match value {
                Value::Text(text) if names.contains(&field.as_str()) && !text.is_empty() => {
                    Some(text.clone())
                }
                _ => None,
            })
        };
        let has_data = fields.iter().any(|(field, value)| {
            matches!(value, Value::Numbers { .. })
                && ["Data", "data", "values", "Values"].contains(&field.as_str())
        });
        let name = text(&["Name", "name"]).filter(|_| has_data)?;
        Some(Self { name, unit: text(&["Unit", "unit", "Units", "units"]) })
    }
}

/// Tells whether an array is several signals side by side.
fn is_matrix(rows: usize, columns: usize) -> bool {
    rows > 1 && (2..=MOST_COLUMNS).contains(&columns)
}

impl Container for MatFile {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    fn properties(&self) -> Vec<(String, Property)> {
        self.properties.clone()
    }

    fn read(&self, column: usize) -> Result<Samples, RecordError> {
        match &self.columns[column] {
            Column::Numbers(samples) => Ok(samples.clone()),
            Column::Other(found) => {
                let column = self.heads[column].path.clone();
                Err(RecordError::NotNumbers { column, found })
            }
        }
    }
}

impl Samples {
    /// Nothing yet, of the same kind.
    fn clone_kind(&self) -> Self {
        Self { single: self.single, ..Self::default() }
    }
}

/// The order of bytes that the header tells.
fn byte_order(bytes: &[u8]) -> Result<Order, RecordError> {
    if is_hdf5(bytes) || bytes.starts_with(b"MATLAB 7.3") {
        return Err(RecordError::Unsupported {
            format: FileFormat::Mat,
            what: "version 7.3 (HDF5)".to_owned(),
            advice: "save it with `-v7`, or build with the feature `hdf5`",
        });
    }
    if bytes.len() < HEADER_BYTES {
        return Err(damaged("ends within the header"));
    }
    // level 4 begins with a number below 10 000 in four bytes, level 5 with text
    if bytes[..4].contains(&0) {
        return Err(RecordError::Unsupported {
            format: FileFormat::Mat,
            what: "version 4".to_owned(),
            advice: "save it with `-v7`",
        });
    }
    match &bytes[126..128] {
        b"IM" => Ok(Order::Little),
        b"MI" => Ok(Order::Big),
        _ => Err(damaged("no mark of the order of bytes in the header")),
    }
}

/// Tells whether a file is one of HDF5, with or without the header of MATLAB 7.3.
fn is_hdf5(bytes: &[u8]) -> bool {
    let begins = |from: usize| bytes.get(from..).is_some_and(|rest| rest.starts_with(HDF5_MAGIC));
    begins(0) || begins(HDF5_HEADER_BYTES)
}

fn damaged(reason: &str) -> RecordError {
    RecordError::Damaged { format: FileFormat::Mat, reason: reason.to_owned() }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Order {
    Little,
    Big,
}

macro_rules! number {
    ($name:ident $type:ty) => {
        fn $name(self, bytes: &[u8]) -> $type {
            let mut array = [0; size_of::<$type>()];
            array.copy_from_slice(bytes);
            match self {
                Self::Little => <$type>::from_le_bytes(array),
                Self::Big => <$type>::from_be_bytes(array),
            }
        }
    };
}

impl Order {
    number!(u16 u16);
    number!(i16 i16);
    number!(u32 u32);
    number!(i32 i32);
    number!(u64 u64);
    number!(i64 i64);
    number!(f32 f32);
    number!(f64 f64);
}

/// A data element: what its bytes are, and the bytes.
struct Element<'a> {
    kind: u32,
    bytes: &'a [u8],
}

/// Elements one after the other.
struct Cursor<'a> {
    bytes: &'a [u8],
    order: Order,
}

impl<'a> Cursor<'a> {
    /// The next element (figures 1-2 and 1-3: the tag of a small one holds its data).
    fn element(&mut self) -> Result<Element<'a>, RecordError> {
        let early = || damaged("ends within an element");
        let word = |at: usize| self.bytes.get(at..at + 4).map(|bytes| self.order.u32(bytes));
        let first = word(0).ok_or_else(early)?;
        if first >> 16 != 0 {
            let (kind, size) = (first & 0xffff, (first >> 16) as usize);
            let bytes = self.bytes.get(4..4 + size.min(5)).filter(|bytes| bytes.len() == size);
            let bytes = bytes.ok_or_else(|| damaged("a small element of more than four bytes"))?;
            self.bytes = self.bytes.get(8..).ok_or_else(early)?;
            return Ok(Element { kind, bytes });
        }
        let size = word(4).ok_or_else(early)? as usize;
        let body = &self.bytes[8..];
        let bytes = body.get(..size).ok_or_else(early)?;
        let padded = if first == stored::COMPRESSED { size } else { size.next_multiple_of(8) };
        // the last element of a file may lack its padding
        self.bytes = body.get(padded..).unwrap_or(&[]);
        Ok(Element { kind: first, bytes })
    }
}

/// An array.
enum Value {
    Numbers { rows: usize, columns: usize, samples: Samples },
    Text(String),
    Struct(Vec<Vec<(String, Value)>>),
    Cell(Vec<Value>),
    Other(&'static str),
}

/// Reads arrays and counts what they take.
struct Reader {
    order: Order,
    arrays: usize,
    numbers: usize,
    bytes: usize,
}

impl Reader {
    fn inflate(&mut self, compressed: &[u8]) -> Result<Vec<u8>, RecordError> {
        let mut inner = Vec::new();
        let room = (LIMIT_BYTES - self.bytes) as u64;
        let mut decoder = ZlibDecoder::new(compressed).take(room + 1);
        decoder.read_to_end(&mut inner).map_err(|error| damaged(&error.to_string()))?;
        if inner.len() as u64 > room {
            return Err(RecordError::TooLarge { limit_bytes: LIMIT_BYTES as u64 });
        }
        self.bytes += inner.len();
        Ok(inner)
    }

    /// An array of the outermost level, with its name.
    fn top(&mut self, element: &Element<'_>) -> Result<(String, Value), RecordError> {
        if element.kind != stored::MATRIX {
            return Err(damaged("an element that is no array"));
        }
        self.array(element.bytes, 0)
    }

    /// An array and its name (figure 1-4).
    fn array(&mut self, bytes: &[u8], depth: u32) -> Result<(String, Value), RecordError> {
        if bytes.is_empty() {
            return Ok((String::new(), Value::Other("nothing")));
        }
        if depth > MAX_DEPTH {
            return Err(damaged("arrays within arrays, too deep"));
        }
        self.arrays += 1;
        if self.arrays > MOST_ARRAYS {
            return Err(damaged("too many arrays"));
        }
        let mut parts = Cursor { bytes, order: self.order };
        let flags = parts.element()?.bytes;
        let flags = flags.get(..4).map(|word| self.order.u32(word));
        let flags = flags.ok_or_else(|| damaged("an array without flags"))?;
        let (class, complex) = ((flags & 0xff) as u8, flags & 0x0800 != 0);
        if class > class::UINT64 {
            // functions and objects of newer versions have their own layout
            return Ok((String::new(), Value::Other("an object")));
        }
        let dimensions = parts.element()?.bytes.chunks_exact(4);
        let dimensions: Vec<usize> =
            dimensions.map(|size| self.order.i32(size).max(0) as usize).collect();
        let count = dimensions.iter().try_fold(1usize, |count, &size| count.checked_mul(size));
        let count = count.ok_or_else(|| damaged("an array of impossible size"))?;
        let name = parts.element()?.bytes;
        if name.len() > LONGEST_NAME {
            return Err(damaged("a name that is too long"));
        }
        let name = String::from_utf8_lossy(name).into_owned();
        let value = match class {
            class::CELL => Value::Cell(self.elements(&mut parts, count, depth)?),
            class::STRUCT => Value::Struct(self.structs(&mut parts, count, depth)?),
            class::CHAR => Value::Text(self.text(&parts.element()?)),
            class::SPARSE => Value::Other("a sparse matrix"),
            3 => Value::Other("an object"),
            _ if complex => Value::Other("complex numbers"),
            class::SINGLE.. | 6 => {
                let samples = self.numbers(&parts.element()?, class == class::SINGLE)?;
                if samples.values.len() != count {
                    return Err(damaged("an array with other data than its size says"));
                }
                let rows = dimensions.first().copied().unwrap_or(0);
                Value::Numbers { rows, columns: count.checked_div(rows).unwrap_or(0), samples }
            }
            _ => return Err(damaged("an array of an unknown class")),
        };
        Ok((name, value))
    }

    fn elements(
        &mut self,
        parts: &mut Cursor<'_>,
        count: usize,
        depth: u32,
    ) -> Result<Vec<Value>, RecordError> {
        let mut values = Vec::new();
        for _ in 0..count {
            values.push(self.array(parts.element()?.bytes, depth + 1)?.1);
        }
        Ok(values)
    }

    fn structs(
        &mut self,
        parts: &mut Cursor<'_>,
        count: usize,
        depth: u32,
    ) -> Result<Vec<Vec<(String, Value)>>, RecordError> {
        let length = parts.element()?.bytes;
        let length = length.get(..4).map_or(0, |size| self.order.i32(size).max(0) as usize);
        let names = parts.element()?.bytes;
        if length == 0 {
            return Ok(Vec::new());
        }
        if length > LONGEST_NAME {
            return Err(damaged("a name that is too long"));
        }
        let name = |field: &[u8]| {
            let end = field.iter().position(|&byte| byte == 0).unwrap_or(field.len());
            String::from_utf8_lossy(&field[..end]).into_owned()
        };
        let names: Vec<String> = names.chunks_exact(length).map(name).collect();
        if names.is_empty() {
            return Ok(Vec::new());
        }
        let mut structs = Vec::new();
        for _ in 0..count {
            let mut fields = Vec::with_capacity(names.len());
            for name in &names {
                let value = self.array(parts.element()?.bytes, depth + 1)?.1;
                fields.push((name.clone(), value));
            }
            structs.push(fields);
        }
        Ok(structs)
    }

    /// Text, in the order of its storage: one line is expected.
    fn text(&self, element: &Element<'_>) -> String {
        match element.kind {
            stored::UINT16 | stored::UTF16 => {
                let units = element.bytes.chunks_exact(2).map(|unit| self.order.u16(unit));
                char::decode_utf16(units)
                    .map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER))
                    .collect()
            }
            stored::INT8 | stored::UINT8 | stored::UTF8 => {
                String::from_utf8_lossy(element.bytes).into_owned()
            }
            _ => String::new(),
        }
    }

    /// Numbers as doubles; they may be stored in a smaller type than that of the array.
    fn numbers(&mut self, element: &Element<'_>, single: bool) -> Result<Samples, RecordError> {
        let (order, bytes) = (self.order, element.bytes);
        let size = match element.kind {
            stored::INT8 | stored::UINT8 => 1,
            stored::INT16 | stored::UINT16 => 2,
            stored::INT32 | stored::UINT32 | stored::SINGLE => 4,
            stored::DOUBLE | stored::INT64 | stored::UINT64 => 8,
            _ => return Err(damaged("an array of numbers that holds none")),
        };
        self.numbers += bytes.len() / size;
        if self.numbers > LIMIT_NUMBERS {
            return Err(RecordError::TooManyNumbers { limit: LIMIT_NUMBERS });
        }
        let number = |bytes: &[u8]| match element.kind {
            stored::INT8 => f64::from(bytes[0].cast_signed()),
            stored::UINT8 => f64::from(bytes[0]),
            stored::INT16 => f64::from(order.i16(bytes)),
            stored::UINT16 => f64::from(order.u16(bytes)),
            stored::INT32 => f64::from(order.i32(bytes)),
            stored::UINT32 => f64::from(order.u32(bytes)),
            stored::SINGLE => f64::from(order.f32(bytes)),
            stored::INT64 => order.i64(bytes) as f64,
            stored::UINT64 => order.u64(bytes) as f64,
            _ => order.f64(bytes),
        };
        Ok(Samples {
            values: bytes.chunks_exact(size).map(number).collect(),
            present: None,
            single,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn element(kind: u32, bytes: &[u8]) -> Vec<u8> {
        let mut out = [kind.to_le_bytes(), (bytes.len() as u32).to_le_bytes()].concat();
        out.extend(bytes);
        out.resize(out.len().next_multiple_of(8), 0);
        out
    }

    fn header() -> Vec<u8> {
        let mut bytes = vec![b' '; 124];
        bytes.extend([0x00, 0x01, b'I', b'M']);
        bytes
    }

    /// An array of the given class, with the parts after its name.
    fn array(class: u8, dimensions: [i32; 2], name: &str, parts: &[u8]) -> Vec<u8> {
        let flags = [u32::from(class).to_le_bytes(), [0; 4]].concat();
        let sizes = dimensions.map(i32::to_le_bytes).concat();
        let head = [element(6, &flags), element(5, &sizes), element(1, name.as_bytes())].concat();
        element(stored::MATRIX, &[&head, parts].concat())
    }

    fn doubles(values: &[f64]) -> Vec<u8> {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        element(stored::DOUBLE, &bytes)
    }

    #[test]
    fn arrays_in_structs_have_paths() {
        let fields: Vec<u8> = [*b"time_s\0\0", *b"m\0\0\0\0\0\0\0"].concat();
        let parts = [
            // a small element: length of a field name
            vec![5, 0, 4, 0, 8, 0, 0, 0],
            element(1, &fields),
            array(6, [1, 2], "", &doubles(&[0.0, 1.0])),
            array(6, [2, 2], "", &doubles(&[1.0, 2.0, 3.0, 4.0])),
        ];
        let bytes = [header(), array(class::STRUCT, [1, 1], "rec", &parts.concat())].concat();
        let file = MatFile::open(&bytes).unwrap();
        let paths: Vec<_> = file.heads.iter().map(|head| head.path.as_str()).collect();
        assert_eq!(paths, ["rec.time_s", "rec.m(:,1)", "rec.m(:,2)"]);
        assert_eq!(file.read(2).unwrap().values, [3.0, 4.0]);
    }

    #[test]
    fn other_versions_are_refused_by_name() {
        let error = |bytes: &[u8]| MatFile::open(bytes).unwrap_err().to_string();
        assert_eq!(
            error(b"MATLAB 7.3 MAT-file"),
            "`.mat` with version 7.3 (HDF5) is not read (save it with `-v7`, or build with the \
             feature `hdf5`)"
        );
        assert_eq!(error(&[0; 200]), "`.mat` with version 4 is not read (save it with `-v7`)");
        assert_eq!(error(b"MATLAB 5.0"), "damaged `.mat` file: ends within the header");
        let big = array(6, [1, 2], "x", &doubles(&[0.0]));
        assert_eq!(
            error(&[header(), big].concat()),
            "damaged `.mat` file: an array with other data than its size says"
        );
    }

    #[test]
    fn nesting_has_an_end() {
        let mut inner = array(6, [1, 1], "", &doubles(&[0.0]));
        for _ in 0..40 {
            inner = array(class::CELL, [1, 1], "", &inner);
        }
        let error = MatFile::open(&[header(), inner].concat()).unwrap_err().to_string();
        assert_eq!(error, "damaged `.mat` file: arrays within arrays, too deep");
    }
}
