//! Content of a report: sections of text, tables and figures.

/// Content of a report: a title, the answer, and sections of text, tables and figures.
///
/// ```
/// use fdi_report::{Evaluation, EvaluationSettings, Page};
///
/// let result = Evaluation {
///     schema_version: 1,
///     protocol: "low".to_owned(),
///     conditions: 0,
///     seed: 0,
///     settings: EvaluationSettings {
///         controller_noise: false,
///         digitisation: false,
///         sensor_noise_a: 0.0,
///         phase_rate_hz: 1e4,
///         envelope_rate_hz: 2e3,
///         snapshots: 100,
///         sparse_snapshots: 0,
///         largest_level: 0.05,
///     },
///     methods: Vec::new(),
/// };
/// let page = Page::of_evaluation(&result, "fdi 0.1.0");
/// assert!(page.html().starts_with("<!DOCTYPE html>"));
/// ```
#[derive(Debug, Default)]
pub struct Page {
    /// Title of the report.
    pub(crate) title: String,
    /// Subject: machine, test, dates; empty where that is not known.
    pub(crate) subject: String,
    /// The answer in a sentence.
    pub(crate) answer: String,
    pub(crate) sections: Vec<Section>,
}

/// A part of a report under a heading.
#[derive(Debug, Default)]
pub(crate) struct Section {
    pub(crate) heading: String,
    pub(crate) blocks: Vec<Block>,
    /// Blocks that follow on the screen and are left out on paper.
    pub(crate) details: Vec<Block>,
}

impl Section {
    pub(crate) fn new(heading: impl Into<String>, blocks: Vec<Block>) -> Self {
        Self { heading: heading.into(), blocks, details: Vec::new() }
    }

    pub(crate) fn with_details(self, details: Vec<Block>) -> Self {
        Self { details, ..self }
    }
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
    /// Key that the column is sorted by, where that is a number; missing ones come last.
    pub(crate) value: Option<f64>,
    /// True where the cell is to be seen at a glance.
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
pub struct Figure {
    /// Name of its file, without `.svg`.
    pub name: String,
    /// The drawing.
    pub svg: String,
    /// Explanation of the drawing, in words.
    pub caption: String,
    /// The recordings, or the experiment, that it was made from.
    pub source: String,
}
