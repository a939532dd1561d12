//! The report: one HTML file that needs nothing else, for people who decide.
//!
//! A [`Page`] says what a report holds, [`html`] how it looks. Each kind of answer has one file
//! that makes its page.

mod diagnosis;
mod evaluation;
mod explanation;
mod html;

pub(crate) use diagnosis::DiagnosisReport;
pub(crate) use evaluation::of_evaluation;
pub(crate) use explanation::of_explanation;

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};

use crate::{
    args::ReportArgs,
    streams::{Worth, in_place_of},
};

/// What a report holds.
#[derive(Debug, Default)]
pub(crate) struct Page {
    /// What the report is of.
    pub(crate) title: String,
    /// The answer in a sentence.
    pub(crate) answer: String,
    pub(crate) sections: Vec<Section>,
}

/// A part of a report under a heading.
#[derive(Debug, Default)]
pub(crate) struct Section {
    pub(crate) heading: String,
    pub(crate) blocks: Vec<Block>,
}

/// Something in a section.
#[derive(Debug)]
pub(crate) enum Block {
    /// A paragraph.
    Text(String),
    /// A list.
    List(Vec<String>),
    Table(Table),
    Figure(Figure),
}

/// Rows under a header that sorts them.
#[derive(Debug, Default)]
pub(crate) struct Table {
    pub(crate) caption: String,
    pub(crate) columns: Vec<Column>,
    pub(crate) rows: Vec<Vec<Cell>>,
}

/// A column of a table.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    pub(crate) name: String,
    /// Numbers stand to the right.
    pub(crate) numeric: bool,
}

impl Column {
    pub(crate) fn text(name: &str) -> Self {
        Self { name: name.to_owned(), numeric: false }
    }

    pub(crate) fn number(name: &str) -> Self {
        Self { name: name.to_owned(), numeric: true }
    }
}

/// A cell of a table.
#[derive(Debug, Default)]
pub(crate) struct Cell {
    pub(crate) text: String,
    /// What it is sorted by, where that is a number; missing ones come last.
    pub(crate) value: Option<f64>,
    /// Whether it is to be seen at a glance.
    pub(crate) marked: bool,
}

impl Cell {
    pub(crate) fn text(text: impl Into<String>) -> Self {
        Self { text: text.into(), ..Self::default() }
    }

    pub(crate) fn number(value: Option<f64>, show: impl Fn(f64) -> String) -> Self {
        let text = value.map_or_else(|| "–".to_owned(), show);
        Self { text, value, marked: false }
    }

    pub(crate) fn marked(self, marked: bool) -> Self {
        Self { marked, ..self }
    }
}

/// A drawing with what it shows and where that is from.
#[derive(Debug)]
pub(crate) struct Figure {
    /// Name of its file, without `.svg`.
    pub(crate) name: String,
    pub(crate) svg: String,
    pub(crate) caption: String,
    /// The recordings, or the experiment, that it was made from.
    pub(crate) source: String,
}

impl Page {
    fn figures(&self) -> impl Iterator<Item = &Figure> {
        self.sections.iter().flat_map(|section| &section.blocks).filter_map(|block| match block {
            Block::Figure(figure) => Some(figure),
            _ => None,
        })
    }
}

/// Writes the report and its drawings where the options want them; the page is made only then.
pub(crate) fn write(args: &ReportArgs, page: impl FnOnce() -> Result<Page>) -> Result<()> {
    if args.report.is_none() && args.figures.is_none() {
        return Ok(());
    }
    let page = page()?;
    if let Some(file) = &args.report {
        put(file, &html::document(&page))?;
    }
    if let Some(folder) = &args.figures {
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
