//! Columns that Python holds: numpy arrays, lists, Arrow arrays.

use fdi_core::SharedNumbers;
use pyo3::{
    prelude::*,
    types::{PyBool, PyBytes, PyDict, PyFloat, PyInt, PyString, PyTuple},
};

use crate::{
    arrow_in,
    column::{Cells, Column, Numbers},
    error::raised,
};

/// Columns of a table: an object that hands over Arrow, or a mapping from names to cells.
pub(crate) fn columns(table: &Bound<'_, PyAny>, nan_is_gap: bool) -> PyResult<Vec<Column>> {
    if let Ok(mapping) = table.cast::<PyDict>() {
        let column = |(name, cells): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
            let name: String = name.extract().map_err(|_| {
                let message = format!("{name:?} is no name of a column, expected a text");
                raised(table.py(), &message, None, None)
            })?;
            let cells = self::cells(&name, &cells, nan_is_gap)?;
            Ok(Column { name, cells })
        };
        return mapping.iter().map(column).collect();
    }
    let py = table.py();
    let parts = arrow_in::arrays(table)?;
    let columns = parts.and_then(|parts| arrow_in::columns(&parts));
    columns.ok_or_else(|| {
        let kind = table.get_type().to_string();
        raised(py, &format!("{kind} is no table: expected columns by name"), None, None)
    })
}

/// Cells of one column.
fn cells(name: &str, object: &Bound<'_, PyAny>, nan_is_gap: bool) -> PyResult<Cells> {
    let cells = if let Some(numbers) = masked(name, object)? {
        Cells::Numbers(numbers)
    } else if let Some(numbers) = array(name, object)? {
        Cells::Numbers(numbers)
    } else if let Some(parts) = arrow_in::arrays(object)? {
        Cells::joined(parts.iter().map(arrow_in::cells).collect())
    } else {
        one_by_one(name, object, nan_is_gap)?
    };
    Ok(match cells {
        Cells::Numbers(numbers) if nan_is_gap => Cells::Numbers(numbers.without_nan()),
        other => other,
    })
}

/// Numbers of a numpy array with a mask, gaps where that is set; `None` for anything else.
fn masked(name: &str, object: &Bound<'_, PyAny>) -> PyResult<Option<Numbers>> {
    if !object.hasattr("mask")? || !object.hasattr("__array_interface__")? {
        return Ok(None);
    }
    let of =
        object.py().import("numpy")?.getattr("ma")?.getattr("getmaskarray")?.call1((object,))?;
    let mask: Vec<bool> = of.call_method0("ravel")?.call_method0("tolist")?.extract()?;
    let Some(numbers) = array(name, &object.getattr("data")?)? else { return Ok(None) };
    let present = mask.contains(&true).then(|| mask.iter().map(|is_masked| !is_masked).collect());
    Ok(Some(Numbers { present, ..numbers }))
}

/// Numbers of a numpy array, where they lie; `None` for anything else.
fn array(name: &str, object: &Bound<'_, PyAny>) -> PyResult<Option<Numbers>> {
    let py = object.py();
    let Ok(interface) = object.getattr("__array_interface__") else { return Ok(None) };
    let Ok(interface) = interface.cast_into::<PyDict>() else { return Ok(None) };
    let of = |key: &str| -> PyResult<Bound<'_, PyAny>> {
        interface.get_item(key)?.ok_or_else(|| {
            raised(py, &format!("column `{name}`: an array without {key}"), None, Some(name))
        })
    };
    let shape: Vec<usize> = of("shape")?.extract()?;
    let &[count] = shape.as_slice() else {
        let message = format!(
            "column `{name}` has {} dimensions, expected one: give a row or a column of it",
            shape.len()
        );
        return Err(raised(py, &message, None, Some(name)));
    };
    let kind: String = of("typestr")?.extract()?;
    let strides = interface.get_item("strides")?.filter(|strides| !strides.is_none());
    let strides: Option<Vec<isize>> = strides.map(|strides| strides.extract()).transpose()?;
    let is_dense = count < 2 || strides.is_none_or(|strides| strides == [8]);
    if kind == "<f8" && is_dense {
        let place: usize = of("data")?.cast_into::<PyTuple>()?.get_item(0)?.extract()?;
        if count == 0 {
            return Ok(Some(Numbers::of(Vec::new().into())));
        }
        if place.is_multiple_of(align_of::<f64>()) {
            let owner = object.clone().unbind();
            let array = NumpyArray { place: place as *const f64, count, owner };
            return Ok(Some(Numbers::of(SharedNumbers::of(array))));
        }
    }
    match kind.as_bytes().get(1) {
        Some(b'f' | b'i' | b'u' | b'b') => {
            let single = matches!(&kind[1..], "f4" | "f2");
            let dense = to_doubles(object)?;
            Ok(array(name, &dense)?.map(|numbers| Numbers { single, ..numbers }))
        }
        Some(b'M' | b'm') => {
            let seconds = py.import("fdi._times")?.getattr("seconds")?.call1((object,))?;
            Ok(array(name, &seconds)?.map(Numbers::without_nan))
        }
        // texts and objects are looked at one by one
        Some(b'O' | b'U' | b'S') => Ok(None),
        _ => {
            let dtype = object.getattr("dtype").map(|dtype| dtype.to_string()).unwrap_or(kind);
            let message = format!("column `{name}` holds {dtype}, expected real numbers");
            Err(raised(py, &message, None, Some(name)))
        }
    }
}

/// A copy in doubles, one after another.
fn to_doubles<'py>(array: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    array.py().import("numpy")?.getattr("ascontiguousarray")?.call1((array, "<f8"))
}

/// Doubles that numpy holds.
struct NumpyArray {
    place: *const f64,
    count: usize,
    /// Keeps the array, and so its memory, alive.
    owner: Py<PyAny>,
}

// SAFETY: the numbers are only read, from memory that no thread owns; `Py` may go to any thread
unsafe impl Send for NumpyArray {}
// SAFETY: as above; there is no interior mutability
unsafe impl Sync for NumpyArray {}

impl AsRef<[f64]> for NumpyArray {
    fn as_ref(&self) -> &[f64] {
        let _ = &self.owner;
        // SAFETY: the array interface promised `count` doubles at `place`, aligned as was checked,
        // for as long as the array lives, which `owner` holds. numpy does not move the memory of an
        // array that is referred to. A user who writes into it meanwhile reads torn numbers; that is
        // told where arrays are taken (docs/decisions/0130-python.md).
        unsafe { std::slice::from_raw_parts(self.place, self.count) }
    }
}

/// Cells of a sequence, looked at one by one: the first that is there says what they are.
fn one_by_one(name: &str, object: &Bound<'_, PyAny>, nan_is_gap: bool) -> PyResult<Cells> {
    let py = object.py();
    let refuse = |row: usize, found: &Bound<'_, PyAny>| {
        let kind = found.get_type().name().map(|name| name.to_string()).unwrap_or_default();
        let message = format!("column `{name}` holds {kind} at row {row}, expected numbers");
        raised(py, &message, None, Some(name))
    };
    if object.is_instance_of::<PyString>() {
        let message = format!("column `{name}` is a text, expected a sequence of numbers");
        return Err(raised(py, &message, None, Some(name)));
    }
    let Ok(items) = object.try_iter() else {
        let message = format!("column `{name}` is {}, expected a sequence", object.get_type());
        return Err(raised(py, &message, None, Some(name)));
    };
    let items: Vec<Bound<'_, PyAny>> = items.collect::<PyResult<_>>()?;
    let is_gap = |item: &Bound<'_, PyAny>| {
        item.is_none() || item.get_type().name().is_ok_and(|name| name == "NAType")
    };
    let is_nan = |item: &Bound<'_, PyAny>| {
        item.is_instance_of::<PyFloat>() && item.extract::<f64>().is_ok_and(f64::is_nan)
    };
    let is_number = |item: &Bound<'_, PyAny>| {
        item.is_instance_of::<PyFloat>()
            || item.is_instance_of::<PyInt>() && !item.is_instance_of::<PyBool>()
            // an array of numbers has it too, and a length
            || item.hasattr("__float__").unwrap_or(false) && item.len().is_err()
    };
    // no channel: kept, and ignored
    let other = |row: usize, found: &Bound<'_, PyAny>| {
        let kind = found.get_type().name().map(|name| name.to_string()).unwrap_or_default();
        Cells::Other { rows: items.len(), what: format!("{kind} at row {row}") }
    };
    let first = items.iter().find(|item| !is_gap(item) && !is_nan(item));
    match first {
        Some(first) if first.is_instance_of::<PyString>() => {
            let text = |(row, item): (usize, &Bound<'_, PyAny>)| match item.extract::<String>() {
                Ok(text) => Ok(Some(text)),
                Err(_) if is_gap(item) || is_nan(item) => Ok(None),
                Err(_) => Err(other(row, item)),
            };
            let texts: Result<_, Cells> = items.iter().enumerate().map(text).collect();
            Ok(texts.map_or_else(|other| other, Cells::Texts))
        }
        Some(first) if first.is_instance_of::<PyBytes>() => {
            let file = |item: &Bound<'_, PyAny>| item.extract::<Vec<u8>>().ok();
            Ok(Cells::Files(items.iter().map(file).collect()))
        }
        Some(first) if !is_number(first) => {
            let list = |item: &Bound<'_, PyAny>| -> PyResult<Option<Numbers>> {
                if is_gap(item) || is_nan(item) {
                    return Ok(None);
                }
                match cells(name, item, nan_is_gap)? {
                    Cells::Numbers(numbers) => Ok(Some(numbers)),
                    _ => Err(refuse(0, item)),
                }
            };
            if first.hasattr("__len__")? {
                return Ok(Cells::Lists(items.iter().map(list).collect::<PyResult<_>>()?));
            }
            Ok(other(0, first))
        }
        _ => {
            let number = |(row, item): (usize, &Bound<'_, PyAny>)| {
                if is_gap(item) {
                    return Ok(None);
                }
                item.extract::<f64>().map(Some).map_err(|_| other(row, item))
            };
            let numbers: Result<Vec<_>, Cells> = items.iter().enumerate().map(number).collect();
            let of =
                |numbers: Vec<_>| Cells::Numbers(arrow_in::of_options(numbers.into_iter(), false));
            Ok(numbers.map_or_else(|other| other, of))
        }
    }
}
