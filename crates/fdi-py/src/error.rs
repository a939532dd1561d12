//! Failures on their way to Python: always `fdi.FdiError`.

use std::{any::Any, fmt::Display};

use pyo3::{prelude::*, types::PyDict};

/// An error that stands for itself.
pub(crate) fn plain(py: Python<'_>, message: &str) -> PyErr {
    raised(py, message, None, None)
}

/// An error of a file or a table, and of one of its columns.
pub(crate) fn raised(
    py: Python<'_>,
    message: &str,
    file: Option<&str>,
    column: Option<&str>,
) -> PyErr {
    let make = || -> PyResult<PyErr> {
        let class = py.import("fdi._error")?.getattr("FdiError")?;
        let named = PyDict::new(py);
        named.set_item("file", file)?;
        named.set_item("column", column)?;
        Ok(PyErr::from_value(class.call((message,), Some(&named))?))
    };
    // an interpreter that cannot make an error has one of its own to tell
    make().unwrap_or_else(|error| error)
}

/// Results whose error Python is told.
pub(crate) trait OrRaise<T> {
    /// The value, or `fdi.FdiError`.
    fn or_raise(self, py: Python<'_>) -> PyResult<T>;
}

impl<T, E: Display> OrRaise<T> for Result<T, E> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T> {
        // with `#`, anyhow tells the whole chain
        self.map_err(|error| plain(py, &format!("{error:#}")))
    }
}

/// A panic in one line.
pub(crate) fn of_panic(panic: &(dyn Any + Send)) -> String {
    let told = panic.downcast_ref::<String>().map(String::as_str);
    let told = told.or_else(|| panic.downcast_ref::<&str>().copied());
    format!("internal error, please report it: {}", told.unwrap_or("a panic without a message"))
}
