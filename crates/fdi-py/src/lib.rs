//! The wheel `fdi`: what the command line does, for Python.
//!
//! Answers are made by the library of the command line (`fdi_cli::Session`), so that they are the
//! same bit for bit. What is Python's alone stands here: tables of any kind in, Arrow out, work
//! without the interpreter's lock, and every failure as `fdi.FdiError`. Of the whole project this
//! crate alone has `unsafe` code, where memory is another program's; each use says why it holds.

mod arrow_in;
mod arrow_out;
mod column;
mod error;
mod own_document;
mod own_model;
mod python_in;
mod recording;
mod session;
mod table;
mod waiting;

use pyo3::{prelude::*, types::PyBytes};

use error::OrRaise;
use waiting::waited;

/// Allocator that `fdi` has too, so that simulations take the same time.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Status, product and messages of a command.
type Ran<'py> = (u8, Bound<'py, PyBytes>, String);

/// Runs a command of the command line.
#[pyfunction]
fn command(py: Python<'_>, name: String, words: Vec<String>) -> PyResult<Ran<'_>> {
    let run = move |_: &_| -> anyhow::Result<(u8, Vec<u8>, Vec<u8>)> {
        let cli = fdi_cli::parsed(&name, &words)?;
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let mut streams = fdi_cli::Streams { out: &mut out, err: &mut err, is_terminal: false };
        let status = fdi_cli::run(&cli, &mut streams)?;
        Ok((status.code(), out, err))
    };
    let (status, out, err) = waited::<(), _>(py, run, |_, ()| Ok(()))?.or_raise(py)?;
    Ok((status, PyBytes::new(py, &out), String::from_utf8_lossy(&err).into_owned()))
}

/// A simulated recording, with what is to be said of it.
#[pyfunction]
fn simulated(py: Python<'_>, words: Vec<String>) -> PyResult<(recording::Recording, Vec<String>)> {
    let run = move |_: &_| fdi_cli::simulated(&words);
    let (inner, notices) = waited::<(), _>(py, run, |_, ()| Ok(()))?.or_raise(py)?;
    Ok((recording::Recording { inner }, notices))
}

/// Names and kinds of the columns of a table of answers.
#[pyfunction]
fn table_columns() -> Vec<(String, &'static str)> {
    let kind = |kind| match kind {
        fdi_cli::Kind::Text => "text",
        fdi_cli::Kind::Number => "number",
        fdi_cli::Kind::Count => "count",
        fdi_cli::Kind::Truth => "truth",
    };
    fdi_cli::Answers::columns().into_iter().map(|(name, one)| (name, kind(one))).collect()
}

/// Panics, so that a test can see what becomes of it.
#[pyfunction]
fn _panic(py: Python<'_>, here: bool) -> PyResult<()> {
    if here {
        return waiting::guarded(py, || panic!("asked for"));
    }
    waited::<(), ()>(py, |_| panic!("asked for"), |_, ()| Ok(()))
}

/// Computes for that many milliseconds, so that a test can see that the interpreter is free.
#[pyfunction]
fn _busy(py: Python<'_>, milliseconds: u64) -> PyResult<f64> {
    let busy = move |_: &_| {
        let end = std::time::Duration::from_millis(milliseconds);
        let (start, mut sum) = (clock(), 0.0_f64);
        while start.elapsed() < end {
            sum = (sum + 1.0).sqrt();
        }
        sum
    };
    waited::<(), _>(py, busy, |_, ()| Ok(()))
}

#[expect(clippy::disallowed_methods, reason = "a test of the interpreter's lock needs the time")]
fn clock() -> std::time::Instant {
    std::time::Instant::now()
}

/// The module in Rust.
#[pymodule]
fn _fdi(module: &Bound<'_, PyModule>) -> PyResult<()> {
    // a panic is told as an error: its trace on standard error helps nobody who calls from Python
    std::panic::set_hook(Box::new(|_| {}));
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<recording::Recording>()?;
    module.add_class::<recording::Samples>()?;
    module.add_class::<session::Session>()?;
    module.add_class::<session::Answers>()?;
    module.add_function(wrap_pyfunction!(command, module)?)?;
    module.add_function(wrap_pyfunction!(simulated, module)?)?;
    module.add_function(wrap_pyfunction!(own_model::of_own_model, module)?)?;
    module.add_function(wrap_pyfunction!(table_columns, module)?)?;
    module.add_function(wrap_pyfunction!(_panic, module)?)?;
    module.add_function(wrap_pyfunction!(_busy, module)?)?;
    Ok(())
}
