//! Files of a report: the page, its drawings, and the trends beside it.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use fdi_report::Page;

use crate::streams::{Worth, in_place_of};

/// Where a report and its drawings go.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Places<'a> {
    pub(crate) report: Option<&'a Path>,
    pub(crate) figures: Option<&'a Path>,
}

/// Writes the report and its drawings to their places; the page is made only where one is given.
pub(crate) fn write(places: Places<'_>, page: impl FnOnce() -> Result<Page>) -> Result<()> {
    if places.report.is_none() && places.figures.is_none() {
        return Ok(());
    }
    let page = page()?;
    if let Some(file) = places.report {
        put(file, &page.html())?;
    }
    if let Some(folder) = places.figures {
        let named = || format!("`{}` cannot be made", folder.display());
        fs::create_dir_all(folder).with_context(named)?;
        for figure in page.figures() {
            put(&folder.join(format!("{}.svg", figure.name)), &figure.svg)?;
        }
    }
    Ok(())
}

/// The files of the trends beside a report: `report.html`, `report-fleet.json` and `.csv`.
pub(crate) fn trends_beside(report: &Path) -> [PathBuf; 2] {
    let stem = report.file_stem().unwrap_or_default().to_string_lossy();
    ["json", "csv"].map(|extension| report.with_file_name(format!("{stem}-fleet.{extension}")))
}

/// Writes a file.
pub(crate) fn put(path: &Path, text: &str) -> Result<()> {
    let written = in_place_of(path, |out| out.write_all(text.as_bytes()).map(|()| Worth::Keeping));
    written.map(|_| ()).with_context(|| format!("`{}` cannot be written", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trends_stand_beside_the_report() {
        let [json, csv] = trends_beside(Path::new("out/x.html"));
        assert_eq!(json, Path::new("out/x-fleet.json"));
        assert_eq!(csv, Path::new("out/x-fleet.csv"));
    }
}
