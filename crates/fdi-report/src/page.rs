//! Reports: one HTML file that needs nothing else, for people who decide.
//!
//! A [`Page`] says what a report holds (`content`), and `html` how it looks. Each kind of answer
//! has one file that makes its page.

mod content;
mod decisions;
mod diagnosis;
mod evaluation;
mod explanation;
mod findings;
mod html;
mod setup;
mod together;

pub use content::{Figure, Page};
pub use diagnosis::{DiagnosisPage, SettingRow};

use content::{Block, Section};

use crate::{Evaluation, Explanation, SetupSummary};

impl Page {
    /// The report of one of the paper's experiments, made by the program `tool`.
    pub fn of_evaluation(result: &Evaluation, tool: &str) -> Self {
        evaluation::page(result, tool)
    }

    /// The report of what a model misses.
    pub fn of_explanation(answer: &Explanation) -> Self {
        explanation::page(answer)
    }

    /// The report of a machine that was set up, or why not.
    pub fn of_setup(answer: &SetupSummary) -> Self {
        setup::page(answer)
    }

    /// The document: HTML with style, script and drawings inside.
    pub fn html(&self) -> String {
        html::document(self)
    }

    /// The drawings of the report.
    pub fn figures<'a>(&'a self) -> impl Iterator<Item = &'a Figure> {
        let of = |section: &'a Section| section.blocks.iter().chain(&section.details);
        self.sections.iter().flat_map(of).filter_map(|block| match block {
            Block::Figure(figure) => Some(figure),
            _ => None,
        })
    }
}
