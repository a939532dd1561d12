//! Columns that another program hands over by the Arrow C interface.

use std::{ffi::CStr, ptr::NonNull};

use arrow_array::{
    Array, ArrayReader, ArrayRef, ArrowPrimitiveType, FixedSizeListArray, GenericBinaryArray,
    GenericListArray, GenericStringArray, OffsetSizeTrait, StructArray,
    cast::AsArray,
    ffi::{FFI_ArrowArray, FFI_ArrowSchema, from_ffi},
    ffi_stream::{ArrayStreamReader, FFI_ArrowArrayStream},
    make_array, new_empty_array, types,
};
use arrow_schema::{ArrowError, DataType, TimeUnit};
use fdi_core::SharedNumbers;
use pyo3::{
    prelude::*,
    types::{PyCapsule, PyTuple},
};

use crate::column::{Cells, Column, Numbers};

const STREAM: &CStr = c"arrow_array_stream";
const ARRAY: &CStr = c"arrow_array";
const SCHEMA: &CStr = c"arrow_schema";

/// Arrays that an object hands over; `None` where it knows no Arrow.
pub(crate) fn arrays(object: &Bound<'_, PyAny>) -> PyResult<Option<Vec<ArrayRef>>> {
    let arrow = |error: ArrowError| crate::error::plain(object.py(), &error.to_string());
    if object.hasattr("__arrow_c_stream__")? {
        let capsule = object.call_method0("__arrow_c_stream__")?;
        let raw = pointer::<FFI_ArrowArrayStream>(&capsule, STREAM)?;
        // SAFETY: the capsule's name says that it holds a stream of the C interface, which the
        // capsule keeps alive here; the stream is moved out, and what stays is marked as released
        let reader = unsafe { ArrayStreamReader::from_raw(raw.as_ptr()) }.map_err(arrow)?;
        // a stream without a part still has its columns
        let nothing = new_empty_array(reader.field().data_type());
        let parts = reader.collect::<Result<Vec<_>, _>>().map_err(arrow)?;
        return Ok(Some(if parts.is_empty() { vec![nothing] } else { parts }));
    }
    if object.hasattr("__arrow_c_array__")? {
        let pair = object.call_method0("__arrow_c_array__")?.cast_into::<PyTuple>()?;
        let schema = pointer::<FFI_ArrowSchema>(&pair.get_item(0)?, SCHEMA)?;
        let array = pointer::<FFI_ArrowArray>(&pair.get_item(1)?, ARRAY)?;
        // SAFETY: the capsule's name says that it holds an array of the C interface; it is moved
        // out, and what stays is marked as released
        let array = unsafe { FFI_ArrowArray::from_raw(array.as_ptr()) };
        // SAFETY: the capsule's name says that it holds a schema, which the capsule keeps alive
        // until the end of this function
        let schema = unsafe { schema.as_ref() };
        // SAFETY: array and schema are of one pair, which its maker promises to fit together
        let data = unsafe { from_ffi(array, schema) }.map_err(arrow)?;
        return Ok(Some(vec![make_array(data)]));
    }
    Ok(None)
}

/// Target of a capsule of that name.
fn pointer<T>(capsule: &Bound<'_, PyAny>, name: &CStr) -> PyResult<NonNull<T>> {
    Ok(capsule.cast::<PyCapsule>()?.pointer_checked(Some(name))?.cast())
}

/// Columns of tables, one part after another.
pub(crate) fn columns(parts: &[ArrayRef]) -> Option<Vec<Column>> {
    let tables: Vec<&StructArray> =
        parts.iter().map(|part| part.as_struct_opt()).collect::<Option<_>>()?;
    let names = tables.first().map(|table| table.column_names()).unwrap_or_default();
    let column = |(place, name): (usize, &&str)| {
        let parts = tables.iter().map(|table| cells(table.column(place))).collect();
        Column { name: (*name).to_owned(), cells: Cells::joined(parts) }
    };
    Some(names.iter().enumerate().map(column).collect())
}

/// Cells of one column.
pub(crate) fn cells(array: &ArrayRef) -> Cells {
    use DataType::{
        Binary, BinaryView, Dictionary, FixedSizeList, LargeBinary, LargeList, LargeUtf8, List,
        Utf8, Utf8View,
    };
    if let Some(numbers) = numbers(array) {
        return Cells::Numbers(numbers);
    }
    match array.data_type() {
        Utf8 => Cells::Texts(texts(array.as_string::<i32>())),
        LargeUtf8 => Cells::Texts(texts(array.as_string::<i64>())),
        Utf8View => {
            Cells::Texts(array.as_string_view().iter().map(|t| t.map(str::to_owned)).collect())
        }
        Binary => Cells::Files(files(array.as_binary::<i32>())),
        LargeBinary => Cells::Files(files(array.as_binary::<i64>())),
        BinaryView => {
            Cells::Files(array.as_binary_view().iter().map(|f| f.map(<[u8]>::to_vec)).collect())
        }
        List(_) => lists(array.as_list::<i32>()),
        LargeList(_) => lists(array.as_list::<i64>()),
        FixedSizeList(..) => fixed_lists(array.as_fixed_size_list()),
        Dictionary(..) => of_dictionary(array),
        other => Cells::Other { rows: array.len(), what: other.to_string() },
    }
}

fn texts<O: OffsetSizeTrait>(array: &GenericStringArray<O>) -> Vec<Option<String>> {
    array.iter().map(|text| text.map(str::to_owned)).collect()
}

fn files<O: OffsetSizeTrait>(array: &GenericBinaryArray<O>) -> Vec<Option<Vec<u8>>> {
    array.iter().map(|file| file.map(<[u8]>::to_vec)).collect()
}

/// Texts or numbers that stand once for many rows.
fn of_dictionary(array: &ArrayRef) -> Cells {
    let dictionary = array.as_any_dictionary();
    let keys = dictionary.normalized_keys();
    let place = |row: usize| array.is_valid(row).then(|| keys[row]);
    match cells(dictionary.values()) {
        Cells::Texts(texts) => {
            let text = |row| place(row).and_then(|key| texts[key].clone());
            Cells::Texts((0..array.len()).map(text).collect())
        }
        Cells::Numbers(numbers) => {
            let number = |row| place(row).and_then(|key| numbers.at(key));
            Cells::Numbers(of_options((0..array.len()).map(number), numbers.single))
        }
        _ => Cells::Other { rows: array.len(), what: array.data_type().to_string() },
    }
}

/// Numbers of cells that may be empty.
pub(crate) fn of_options(cells: impl Iterator<Item = Option<f64>>, single: bool) -> Numbers {
    let cells: Vec<Option<f64>> = cells.collect();
    let present: Vec<bool> = cells.iter().map(Option::is_some).collect();
    let present = Some(present).filter(|present| present.contains(&false));
    let values = cells.into_iter().map(Option::unwrap_or_default).collect();
    Numbers { values, present, single }
}

fn lists<O: OffsetSizeTrait>(array: &GenericListArray<O>) -> Cells {
    let Some(all) = numbers(array.values()) else {
        return Cells::Other { rows: array.len(), what: array.data_type().to_string() };
    };
    let offsets = array.value_offsets();
    let row = |row: usize| {
        let [from, to] = [offsets[row].as_usize(), offsets[row + 1].as_usize()];
        array.is_valid(row).then(|| all.slice(from, to))
    };
    Cells::Lists((0..array.len()).map(row).collect())
}

fn fixed_lists(array: &FixedSizeListArray) -> Cells {
    let Some(all) = numbers(array.values()) else {
        return Cells::Other { rows: array.len(), what: array.data_type().to_string() };
    };
    let size = usize::try_from(array.value_length()).unwrap_or(0);
    let row = |row: usize| array.is_valid(row).then(|| all.slice(row * size, (row + 1) * size));
    Cells::Lists((0..array.len()).map(row).collect())
}

/// Numbers of an array of any numeric type; points in time as seconds since the first.
fn numbers(array: &ArrayRef) -> Option<Numbers> {
    use DataType::{
        Boolean, Duration, Float16, Float32, Float64, Int8, Int16, Int32, Int64, Timestamp, UInt8,
        UInt16, UInt32, UInt64,
    };
    let numbers = match array.data_type() {
        Float64 => {
            let values = array.as_primitive::<types::Float64Type>().values().clone();
            Numbers { present: present(array), ..Numbers::of(SharedNumbers::of(values)) }
        }
        Float32 => Numbers { single: true, ..converted::<types::Float32Type>(array, f64::from) },
        Float16 => Numbers { single: true, ..converted::<types::Float16Type>(array, f64::from) },
        Int8 => converted::<types::Int8Type>(array, f64::from),
        Int16 => converted::<types::Int16Type>(array, f64::from),
        Int32 => converted::<types::Int32Type>(array, f64::from),
        Int64 => converted::<types::Int64Type>(array, |x| x as f64),
        UInt8 => converted::<types::UInt8Type>(array, f64::from),
        UInt16 => converted::<types::UInt16Type>(array, f64::from),
        UInt32 => converted::<types::UInt32Type>(array, f64::from),
        UInt64 => converted::<types::UInt64Type>(array, |x| x as f64),
        Boolean => {
            let truths = array.as_boolean();
            let number = |truth: Option<bool>| truth.map(f64::from);
            of_options(truths.iter().map(number), false)
        }
        Timestamp(unit, _) => ticks(array, *unit, true)?,
        Duration(unit) => ticks(array, *unit, false)?,
        _ => return None,
    };
    Some(numbers)
}

fn present(array: &ArrayRef) -> Option<Vec<bool>> {
    let nulls = array.nulls().filter(|nulls| nulls.null_count() > 0)?;
    Some(nulls.iter().collect())
}

fn converted<T: ArrowPrimitiveType>(array: &ArrayRef, number: fn(T::Native) -> f64) -> Numbers {
    let values = array.as_primitive::<T>().values().iter().map(|&value| number(value));
    Numbers { present: present(array), ..Numbers::of(values.collect()) }
}

/// Whole ticks as seconds, from the first where they are points in time.
fn ticks(array: &ArrayRef, unit: TimeUnit, from_first: bool) -> Option<Numbers> {
    use types::{
        DurationMicrosecondType, DurationMillisecondType, DurationNanosecondType,
        DurationSecondType, TimestampMicrosecondType, TimestampMillisecondType,
        TimestampNanosecondType, TimestampSecondType,
    };
    fn whole<T: ArrowPrimitiveType<Native = i64>>(array: &ArrayRef) -> Option<Vec<i64>> {
        array.as_primitive_opt::<T>().map(|array| array.values().to_vec())
    }
    let per_second = match unit {
        TimeUnit::Second => 1.0,
        TimeUnit::Millisecond => 1e3,
        TimeUnit::Microsecond => 1e6,
        TimeUnit::Nanosecond => 1e9,
    };
    let ticks = whole::<TimestampSecondType>(array)
        .or_else(|| whole::<TimestampMillisecondType>(array))
        .or_else(|| whole::<TimestampMicrosecondType>(array))
        .or_else(|| whole::<TimestampNanosecondType>(array))
        .or_else(|| whole::<DurationSecondType>(array))
        .or_else(|| whole::<DurationMillisecondType>(array))
        .or_else(|| whole::<DurationMicrosecondType>(array))
        .or_else(|| whole::<DurationNanosecondType>(array))?;
    let first = if from_first { ticks.first().copied().unwrap_or(0) } else { 0 };
    let values = ticks.iter().map(|tick| tick.wrapping_sub(first) as f64 / per_second);
    Some(Numbers { present: present(array), ..Numbers::of(values.collect()) })
}
