//! HDF5 files, as h5py and MATLAB 7.3 write them.
//!
//! A data set is a column, one of two axes several; its group is a table of its own. Attributes of
//! the file and of its groups, and data sets of one number or text, may be metadata.

use std::cell::RefCell;

use ::hdf5_pure::{AttrValue, DType, Dataset, Error, File, Group};

use crate::{
    ColumnMap, FileFormat, RecordError, Recording,
    metadata_key::keys,
    property::Property,
    reader::{
        container::{Clock, Container, Head, LIMIT_NUMBERS, Samples, assemble},
        guarded::guarded,
    },
};

/// Groups within groups; what is deeper was not made by a person.
const MAX_DEPTH: usize = 32;
/// Most columns of a file.
const MOST_COLUMNS: usize = 1 << 16;
/// Widest table whose columns are taken for signals.
const WIDEST: usize = 64;
/// Longest text that may be metadata.
const LONGEST_TEXT: usize = 1 << 12;
/// Names of attributes that say a unit.
const UNITS: [&str; 4] = ["unit", "units", "Unit", "Units"];

/// Reads a recording.
pub(super) fn read(
    name: String,
    bytes: Vec<u8>,
    map: &ColumnMap,
) -> Result<Recording, RecordError> {
    assemble(name, &Hdf5File::open(bytes, Writer::Any)?, map)
}

/// Reads a recording that MATLAB 7.3 has written.
pub(super) fn read_matlab(
    name: String,
    bytes: Vec<u8>,
    map: &ColumnMap,
) -> Result<Recording, RecordError> {
    guarded(FileFormat::Mat, || assemble(name, &Hdf5File::open(bytes, Writer::Matlab)?, map))
}

/// Program that wrote a file.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Writer {
    Any,
    /// Axes are the other way round, and names are joined by points.
    Matlab,
}

/// The columns of a file, whose numbers are read when they are asked for.
struct Hdf5File {
    file: File,
    writer: Writer,
    heads: Vec<Head>,
    columns: Vec<Column>,
    properties: Vec<(String, Property)>,
    /// Data set that was read last: the columns of a table are asked for one after another.
    last: RefCell<Option<(String, Vec<f64>)>>,
}

/// Content of a column.
#[derive(Clone, Debug)]
enum Column {
    Numbers {
        /// Path of its data set in the file.
        path: String,
        part: Part,
        single: bool,
    },
    Other(&'static str),
}

/// Numbers of a data set that are one signal.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Part {
    first: usize,
    samples: usize,
    /// Numbers from one sample to the next.
    stride: usize,
}

impl Part {
    /// As many numbers from one on.
    fn from(first: usize, samples: usize) -> Self {
        Self { first, samples, stride: 1 }
    }
}

/// A data set while it is looked at.
struct Seen<'a> {
    dataset: &'a Dataset,
    kind: DType,
    shape: Vec<usize>,
    /// MATLAB's class of it; empty where the file states none.
    class: String,
    /// True where MATLAB says that it has no values.
    is_empty: bool,
    unit: Option<String>,
}

impl<'a> Seen<'a> {
    fn of(dataset: &'a Dataset) -> Result<Self, RecordError> {
        let attributes = dataset.attrs().map_err(damaged)?;
        let text = |name: &str| attributes.get(name).and_then(AttrValue::as_str);
        let shape = dataset.shape().map_err(damaged)?;
        let axis = |axis: &u64| usize::try_from(*axis).unwrap_or(usize::MAX);
        Ok(Self {
            dataset,
            kind: dataset.dtype().map_err(damaged)?,
            shape: shape.iter().map(axis).collect(),
            class: text("MATLAB_class").unwrap_or_default().to_owned(),
            is_empty: attributes.contains_key("MATLAB_empty"),
            unit: UNITS.iter().find_map(|name| text(name)).map(str::to_owned),
        })
    }

    fn numbers(&self) -> usize {
        self.shape.iter().fold(1, |product: usize, axis| product.saturating_mul(*axis))
    }

    /// The text, where it is one.
    fn text(&self) -> Option<String> {
        if self.class == "char" && self.numbers() <= LONGEST_TEXT {
            return String::from_utf16(&self.dataset.read_u16().ok()?).ok();
        }
        let is_text = matches!(self.kind, DType::String | DType::VariableLengthString);
        let texts = (is_text && self.numbers() == 1).then(|| self.dataset.read_string().ok())?;
        texts?.pop().filter(|text| text.len() <= LONGEST_TEXT)
    }

    /// Content in place of numbers, in words; `None` where it holds numbers.
    fn other(&self) -> Option<&'static str> {
        match &self.kind {
            _ if self.is_empty => Some("nothing"),
            _ if self.class == "char" => Some("text"),
            DType::String | DType::VariableLengthString => Some("text"),
            DType::ObjectReference if self.class == "cell" => Some("a cell array"),
            DType::ObjectReference => Some("references"),
            DType::Compound(_) => Some("records of several fields"),
            DType::Array(..) | DType::Enum(_) | DType::Other(_) => {
                Some("values of a type of its own")
            }
            _ if self.shape.len() > 2 => Some("an array of three or more axes"),
            _ => None,
        }
    }

    /// The signals in it, each with what follows the name.
    fn parts(&self, writer: Writer) -> Vec<(String, Part)> {
        let whole = vec![(String::new(), Part::from(0, self.numbers()))];
        let &[outer, inner] = self.shape.as_slice() else { return whole };
        let rows = |name: &dyn Fn(usize) -> String| -> Vec<(String, Part)> {
            (0..outer).map(|k| (name(k + 1), Part::from(k * inner, inner))).collect()
        };
        let is_table =
            |samples: usize, columns: usize| samples > 1 && (2..=WIDEST).contains(&columns);
        match writer {
            Writer::Matlab if is_table(inner, outer) => rows(&|k| format!("(:,{k})")),
            Writer::Any if outer >= inner && is_table(outer, inner) => {
                let part = |k| Part { first: k, samples: outer, stride: inner };
                (0..inner).map(|k| (format!("(:,{})", k + 1), part(k))).collect()
            }
            Writer::Any if is_table(inner, outer) => rows(&|k| format!("({k},:)")),
            _ => whole,
        }
    }
}

impl Hdf5File {
    fn open(bytes: Vec<u8>, writer: Writer) -> Result<Self, RecordError> {
        let file = File::from_bytes(bytes).map_err(damaged)?;
        let root = file.root();
        let mut own = Self {
            file,
            writer,
            heads: Vec::new(),
            columns: Vec::new(),
            properties: Vec::new(),
            last: RefCell::default(),
        };
        own.visit(&root, &[])?;
        Ok(own)
    }

    /// Adds what a group holds, whose names from the file down are these.
    fn visit(&mut self, group: &Group, names: &[&str]) -> Result<(), RecordError> {
        if names.len() > MAX_DEPTH {
            return Err(beyond(format!("groups within groups, more than {MAX_DEPTH} deep")));
        }
        let attributes = group.attrs().map_err(damaged)?;
        let known =
            attributes.into_iter().filter_map(|(name, value)| Some((name, property(&value)?)));
        self.properties.extend(known);
        let mut datasets = group.datasets().map_err(damaged)?;
        datasets.sort_unstable();
        for name in &datasets {
            let dataset = group.dataset(name).map_err(damaged)?;
            self.add(&Seen::of(&dataset)?, names, name)?;
        }
        let mut groups = group.groups().map_err(damaged)?;
        groups.sort_unstable();
        // MATLAB keeps what cells refer to in groups whose names begin so
        groups.retain(|name| self.writer != Writer::Matlab || !name.starts_with('#'));
        for name in &groups {
            let inner = group.group(name).map_err(damaged)?;
            self.visit(&inner, &[names, &[name]].concat())?;
        }
        Ok(())
    }

    /// Adds the columns of a data set.
    fn add(&mut self, seen: &Seen<'_>, groups: &[&str], name: &str) -> Result<(), RecordError> {
        if let Some(text) = seen.text() {
            self.properties.push((name.to_owned(), Property::Text(text)));
            return Ok(());
        }
        let is_key = keys().contains(&name.replace('_', "-").as_str());
        if is_key && seen.numbers() == 1 && seen.other().is_none() {
            let value = seen.dataset.read_f64().map_err(damaged)?;
            let value = value.into_iter().map(|value| (name.to_owned(), Property::Number(value)));
            self.properties.extend(value);
            return Ok(());
        }
        let separator = if self.writer == Writer::Matlab { "." } else { "/" };
        let group = (!groups.is_empty()).then(|| groups.join(separator));
        let path = [groups, &[name]].concat().join("/");
        let columns: Vec<(String, usize, Column)> = if let Some(found) = seen.other() {
            vec![(String::new(), 0, Column::Other(found))]
        } else {
            let single = seen.kind == DType::F32;
            let column = |(place, part): (String, Part)| {
                (place, part.samples, Column::Numbers { path: path.clone(), part, single })
            };
            seen.parts(self.writer).into_iter().map(column).collect()
        };
        for (place, samples, column) in columns {
            if self.columns.len() >= MOST_COLUMNS {
                return Err(beyond(format!("more than {MOST_COLUMNS} columns")));
            }
            let name = format!("{name}{place}");
            let path = [group.clone(), Some(name.clone())].into_iter().flatten();
            self.heads.push(Head {
                path: path.collect::<Vec<_>>().join(separator),
                group: group.clone(),
                name,
                samples,
                clock: Clock::Unstated,
                unit: seen.unit.clone(),
            });
            self.columns.push(column);
        }
        Ok(())
    }

    /// The numbers of a data set.
    fn all(&self, path: &str) -> Result<Vec<f64>, RecordError> {
        let dataset = self.file.dataset(path).map_err(damaged)?;
        if Seen::of(&dataset)?.numbers() > LIMIT_NUMBERS {
            return Err(RecordError::TooManyNumbers { limit: LIMIT_NUMBERS });
        }
        dataset.read_f64().map_err(damaged)
    }
}

impl Container for Hdf5File {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    fn properties(&self) -> Vec<(String, Property)> {
        self.properties.clone()
    }

    fn read(&self, column: usize) -> Result<Samples, RecordError> {
        let (path, part, single) = match &self.columns[column] {
            Column::Numbers { path, part, single } => (path, *part, *single),
            Column::Other(found) => {
                let column = self.heads[column].path.clone();
                return Err(RecordError::NotNumbers { column, found });
            }
        };
        let mut last = self.last.borrow_mut();
        let kept = last.take().filter(|(of, _)| of == path);
        let all = kept.map_or_else(|| self.all(path), |(_, all)| Ok(all))?;
        let values: Vec<f64> =
            all.iter().skip(part.first).step_by(part.stride).take(part.samples).copied().collect();
        if values.len() < part.samples {
            return Err(beyond(format!("`{path}` ends within its samples")));
        }
        *last = Some((path.clone(), all));
        Ok(Samples { single, ..Samples::of(values) })
    }
}

/// Metadata that an attribute may be.
fn property(value: &AttrValue) -> Option<Property> {
    let number = match *value {
        AttrValue::F32(value) => f64::from(value),
        AttrValue::F64(value) => value,
        AttrValue::I8(value) => value.into(),
        AttrValue::I16(value) => value.into(),
        AttrValue::I32(value) => value.into(),
        AttrValue::I64(value) => value as f64,
        AttrValue::U8(value) => value.into(),
        AttrValue::U16(value) => value.into(),
        AttrValue::U32(value) => value.into(),
        AttrValue::U64(value) => value as f64,
        _ => return value.as_str().map(|text| Property::Text(text.to_owned())),
    };
    Some(Property::Number(number))
}

#[expect(clippy::needless_pass_by_value, reason = "what `map_err` hands over")]
fn damaged(error: Error) -> RecordError {
    beyond(error.to_string().lines().next().unwrap_or_default().to_owned())
}

fn beyond(reason: String) -> RecordError {
    RecordError::Damaged { format: FileFormat::Hdf5, reason }
}
