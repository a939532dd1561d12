//! A recording in memory, and its numbers as numpy sees them.

use fdi_core::{
    Channel, ChannelName, ColumnMap, CsvFormat, FileFormat, Metadata, Recording as Inner,
    SharedNumbers,
};
use pyo3::{
    exceptions::{PyIndexError, PyKeyError},
    prelude::*,
    types::{PyBytes, PyDict},
};
use recordings::Property;

use crate::{
    error::{OrRaise, raised},
    python_in,
    table::{Reading, one},
    waiting::{guarded, waited},
};

/// A recording: channels with times, and metadata.
#[pyclass(frozen, module = "fdi._fdi", name = "Recording")]
#[derive(Clone, Debug)]
pub(crate) struct Recording {
    pub(crate) inner: Inner,
}

/// Metadata of a dictionary, by their keys with `-` or `_`.
pub(crate) fn metadata_of(given: Option<&Bound<'_, PyDict>>) -> PyResult<Metadata> {
    let mut metadata = Metadata::default();
    let Some(given) = given else { return Ok(metadata) };
    for (key, value) in given.iter() {
        let key = key.extract::<String>()?.replace('_', "-");
        if value.is_none() {
            continue;
        }
        let property = match value.extract::<f64>() {
            Ok(number) => Property::Number(number),
            Err(_) => Property::Text(value.str()?.to_string()),
        };
        metadata.set_property(&key, &property).or_raise(given.py())?;
    }
    Ok(metadata)
}

#[pymethods]
impl Recording {
    /// Reads a file of any format that `fdi diagnose` reads.
    #[staticmethod]
    fn read(py: Python<'_>, path: String, map: Vec<String>) -> PyResult<Self> {
        let map = ColumnMap::new(&map).or_raise(py)?;
        let file = path.clone();
        let read = move |_: &_| {
            Inner::read(std::path::Path::new(&file), &map).map_err(|error| error.to_string())
        };
        let read = waited::<(), _>(py, read, |_, ()| Ok(()))?;
        let inner = read.map_err(|error| raised(py, &error, Some(&path), None))?;
        Ok(Self { inner })
    }

    /// The bytes of a file, by the ending of its name.
    #[staticmethod]
    fn of_bytes(py: Python<'_>, name: &str, bytes: &[u8], map: Vec<String>) -> PyResult<Self> {
        guarded(py, || {
            let map = ColumnMap::new(&map).or_raise(py)?;
            let format = FileFormat::of(std::path::Path::new(name)).ok_or_else(|| {
                raised(
                    py,
                    &fdi_core::RecordError::UnknownFormat { advice: "" }.to_string(),
                    Some(name),
                    None,
                )
            })?;
            let read = Inner::from_bytes(name, format, bytes.to_vec(), &map);
            let inner = read.map_err(|error| raised(py, &error.to_string(), Some(name), None))?;
            Ok(Self { inner })
        })
    }

    /// A recording of the columns of a table.
    #[staticmethod]
    fn of_table(
        table: &Bound<'_, PyAny>,
        name: &str,
        metadata: Option<&Bound<'_, PyDict>>,
        map: Vec<String>,
        nan_is_gap: bool,
    ) -> PyResult<Self> {
        let py = table.py();
        guarded(py, || {
            let map = ColumnMap::new(&map).or_raise(py)?;
            let columns = python_in::columns(table, nan_is_gap)?;
            let metadata = metadata_of(metadata)?;
            let reading = Reading { map: &map, group: None, metadata: &metadata, name };
            let read = one(name, &columns, None, &reading);
            let inner = read.map_err(|error| raised(py, &error, Some(name), None))?;
            Ok(Self { inner })
        })
    }

    /// A recording as it was taken apart by `state`.
    #[staticmethod]
    fn of_state(
        py: Python<'_>,
        name: String,
        metadata: &Bound<'_, PyDict>,
        channels: Vec<(String, Vec<u8>, Vec<u8>)>,
    ) -> PyResult<Self> {
        let numbers = |bytes: &[u8]| -> Vec<f64> {
            let of = |eight: &[u8]| f64::from_le_bytes(eight.try_into().unwrap_or_default());
            bytes.chunks_exact(8).map(of).collect()
        };
        let metadata = metadata_of(Some(metadata))?;
        let mut made = Vec::new();
        for (channel, times, values) in &channels {
            let channel = ChannelName::from_column(channel)
                .ok_or_else(|| PyKeyError::new_err(channel.clone()))?;
            made.push(Channel::new(channel, &numbers(times), numbers(values)).or_raise(py)?);
        }
        Ok(Self { inner: Inner::new(name, metadata, made).or_raise(py)? })
    }

    /// The channels as bytes: name, times, values.
    fn state(&self, py: Python<'_>) -> Vec<(String, Py<PyBytes>, Py<PyBytes>)> {
        let bytes = |numbers: &[f64]| {
            let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
            PyBytes::new(py, &bytes).unbind()
        };
        let state = |channel: &Channel| {
            let name = channel.name().column().to_owned();
            (name, bytes(channel.times_s()), bytes(channel.values()))
        };
        self.inner.channels().iter().map(state).collect()
    }

    /// Name in answers.
    #[getter]
    fn name(&self) -> &str {
        &self.inner.name
    }

    /// Names of the channels.
    #[getter]
    fn channels(&self) -> Vec<&'static str> {
        self.inner.channels().iter().map(|channel| channel.name().column()).collect()
    }

    /// Metadata as lines of TOML.
    #[getter]
    fn metadata_toml(&self) -> String {
        self.inner.metadata.to_toml()
    }

    /// Values of a channel, where they lie.
    fn values(&self, channel: &str) -> PyResult<Samples> {
        Ok(Samples { numbers: self.channel(channel)?.shared_values() })
    }

    /// Times of a channel, s, where they lie.
    fn times(&self, channel: &str) -> PyResult<Samples> {
        Ok(Samples { numbers: self.channel(channel)?.shared_times_s() })
    }

    /// The recording as CSV.
    fn to_csv(&self, py: Python<'_>, time_decimals: u8, value_decimals: u8) -> PyResult<String> {
        let format = CsvFormat { time_decimals, value_decimals };
        guarded(py, || self.inner.to_csv(format).or_raise(py))
    }
}

impl Recording {
    fn channel(&self, name: &str) -> PyResult<&Channel> {
        let channel = ChannelName::from_column(name).and_then(|name| self.inner.channel(name));
        channel.ok_or_else(|| PyKeyError::new_err(name.to_owned()))
    }
}

/// Numbers of a channel; `numpy.asarray` of it is a view.
#[pyclass(frozen, module = "fdi._fdi")]
pub(crate) struct Samples {
    numbers: SharedNumbers,
}

#[pymethods]
impl Samples {
    /// The numbers as numpy's array interface tells them: read only, and alive with this object.
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("typestr", "<f8")?;
        interface.set_item("shape", (self.numbers.len(),))?;
        interface.set_item("data", (self.numbers.as_ptr() as usize, true))?;
        Ok(interface)
    }

    fn __len__(&self) -> usize {
        self.numbers.len()
    }

    fn __getitem__(&self, index: isize) -> PyResult<f64> {
        let count = self.numbers.len() as isize;
        let index = if index < 0 { index + count } else { index };
        let found = usize::try_from(index).ok().and_then(|index| self.numbers.get(index));
        found.copied().ok_or_else(|| PyIndexError::new_err("no such sample"))
    }
}
