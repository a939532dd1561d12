//! Columns of the recordings in the folder that `FDI_MEASURED_DATA` names.

use std::{ffi::OsString, fs::File, io::Read, path::PathBuf};

use anyhow::{Context, Result};
use flate2::read::GzDecoder;

/// The folder, where one is named.
pub(super) fn folder() -> Option<OsString> {
    std::env::var_os("FDI_MEASURED_DATA")
}

/// The rows of a compressed table below its head, as text.
pub(crate) fn rows(path: &str) -> Result<Vec<Vec<String>>> {
    let folder = folder().context("`FDI_MEASURED_DATA` does not name the measured recordings")?;
    let file = PathBuf::from(folder).join(path);
    let opened = File::open(&file).with_context(|| file.display().to_string())?;
    let mut text = String::new();
    GzDecoder::new(opened).read_to_string(&mut text).with_context(|| file.display().to_string())?;
    let cells = |line: &str| line.split(',').map(str::to_owned).collect();
    Ok(text.lines().skip(1).map(cells).collect())
}

/// The columns of a compressed table.
pub(crate) fn columns(path: &str) -> Result<Vec<Vec<f64>>> {
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for row in rows(path)? {
        for (place, cell) in row.iter().enumerate() {
            let value = cell.parse().with_context(|| format!("{path}: `{cell}`"))?;
            match columns.get_mut(place) {
                Some(column) => column.push(value),
                None => columns.push(vec![value]),
            }
        }
    }
    Ok(columns)
}

/// A signal at other times, straight between its samples, held at its ends.
pub(super) fn interpolated(times: &[f64], values: &[f64], at: f64) -> f64 {
    let after = times.partition_point(|t| *t <= at);
    if after == 0 || after == times.len() {
        return values[after.min(times.len() - 1)];
    }
    let share = (at - times[after - 1]) / (times[after] - times[after - 1]);
    values[after - 1] + share * (values[after] - values[after - 1])
}
