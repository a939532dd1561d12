//! The table of answers for other programs.

use std::sync::Arc;

use arrow_array::{
    ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch, RecordBatchIterator,
    StringArray, ffi_stream::FFI_ArrowArrayStream,
};
use arrow_schema::{DataType, Field, Schema};
use fdi_cli::{Answers, Cell, Kind};
use pyo3::{
    prelude::*,
    types::{PyCapsule, PyDict},
};

use crate::error::OrRaise;

/// The table as a stream of the Arrow C interface.
pub(crate) fn stream<'py>(py: Python<'py>, answers: &Answers) -> PyResult<Bound<'py, PyCapsule>> {
    let batch = batch(answers).or_raise(py)?;
    let schema = batch.schema();
    let reader = RecordBatchIterator::new([Ok(batch)], schema);
    let stream = FFI_ArrowArrayStream::new(Box::new(reader));
    PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
}

/// The table in one piece.
fn batch(answers: &Answers) -> Result<RecordBatch, arrow_schema::ArrowError> {
    let rows = answers.rows();
    let columns = Answers::columns();
    let field = |(name, kind): &(String, Kind)| {
        let kind = match kind {
            Kind::Text => DataType::Utf8,
            Kind::Number => DataType::Float64,
            Kind::Count => DataType::Int64,
            Kind::Truth => DataType::Boolean,
        };
        Field::new(name, kind, true)
    };
    let schema = Schema::new(columns.iter().map(field).collect::<Vec<_>>());
    let array = |(place, (_, kind)): (usize, &(String, Kind))| -> ArrayRef {
        let cells = rows.iter().map(|row| &row[place]);
        match kind {
            Kind::Text => Arc::new(cells.map(text).collect::<StringArray>()),
            Kind::Number => Arc::new(cells.map(number).collect::<Float64Array>()),
            Kind::Count => Arc::new(cells.map(count).collect::<Int64Array>()),
            Kind::Truth => Arc::new(cells.map(truth).collect::<BooleanArray>()),
        }
    };
    RecordBatch::try_new(Arc::new(schema), columns.iter().enumerate().map(array).collect())
}

/// Names of the columns, and the cells of each as a list.
pub(crate) fn lists<'py>(py: Python<'py>, answers: &Answers) -> PyResult<Bound<'py, PyDict>> {
    let rows = answers.rows();
    let table = PyDict::new(py);
    for (place, (name, kind)) in Answers::columns().into_iter().enumerate() {
        let cells = rows.iter().map(|row| &row[place]);
        match kind {
            Kind::Text => table.set_item(name, cells.map(text).collect::<Vec<_>>())?,
            Kind::Number => table.set_item(name, cells.map(number).collect::<Vec<_>>())?,
            Kind::Count => table.set_item(name, cells.map(count).collect::<Vec<_>>())?,
            Kind::Truth => table.set_item(name, cells.map(truth).collect::<Vec<_>>())?,
        }
    }
    Ok(table)
}

fn text(cell: &Cell) -> Option<&str> {
    if let Cell::Text(text) = cell { text.as_deref() } else { None }
}

fn number(cell: &Cell) -> Option<f64> {
    if let Cell::Number(number) = cell { *number } else { None }
}

fn count(cell: &Cell) -> Option<i64> {
    if let Cell::Count(Some(count)) = cell { i64::try_from(*count).ok() } else { None }
}

fn truth(cell: &Cell) -> Option<bool> {
    if let Cell::Truth(truth) = cell { *truth } else { None }
}
