//! The report of a machine that was set up, on one page.

use super::{
    content::{Block, Cell, Column, Page, Section, Table},
    diagnosis::capitalised,
};
use crate::{Acceptance, FaultTests, SetupChoice, SetupSummary};

/// The page of an answer.
pub(super) fn page(answer: &SetupSummary) -> Page {
    let mut sections = Vec::new();
    if let Some(tests) = &answer.acceptance {
        sections.push(section("What this test tells of this machine", told(tests)));
    }
    if !answer.warnings.is_empty() {
        sections.push(section("To look at", vec![Block::List(answer.warnings.clone())]));
    }
    if !answer.choices.is_empty() {
        sections.push(section("Choices", vec![choices(&answer.choices)]));
    }
    sections.push(section("Basis", vec![Block::Text(basis(answer))]));
    Page {
        subject: String::new(),
        title: format!("Setup of “{}” in “{}”", answer.model, answer.command),
        answer: sentence(answer),
        sections,
    }
}

fn section(heading: &str, blocks: Vec<Block>) -> Section {
    Section::new(heading, blocks)
}

/// The answer in a sentence.
fn sentence(answer: &SetupSummary) -> String {
    if let Some(refused) = &answer.refused {
        let of = refused.recording.as_ref().map(|name| format!("{name}: ")).unwrap_or_default();
        return format!("Not set up ({}): {of}{}.", refused.code.word(), refused.reason);
    }
    let Some(tests) = &answer.acceptance else { return "Not set up.".to_owned() };
    let all: usize = tests.faults.iter().map(|fault| fault.tests).sum();
    let found: usize = tests.faults.iter().map(|fault| fault.found).sum();
    format!(
        "Accepted: later recordings can be diagnosed. In simulated tests of this machine {found} of {all} \
         faults are found at the level from which they are to be watched; {} of {} machines without \
         damage are called faulty.",
        tests.false_alarms, tests.sound
    )
}

fn told(tests: &Acceptance) -> Vec<Block> {
    let columns = vec![
        Column::text("fault"),
        Column::number("level tested"),
        Column::number("standard deviation"),
        Column::number("found"),
        Column::number("tests"),
    ];
    let row = |fault: &FaultTests| {
        let count = |count: usize| Cell::number(Some(count as f64), |count| format!("{count}"));
        let level = |level: f64| format!("{level:.3}");
        let name = if fault.id.name().starts_with("short") {
            "short circuit of a phase"
        } else {
            fault.id.name()
        };
        vec![
            Cell::text(capitalised(name)),
            Cell::number(Some(fault.level), level),
            Cell::number(fault.std, |std| format!("{std:.4}")),
            count(fault.found).marked(2 * fault.found < fault.tests),
            count(fault.tests),
        ]
    };
    let table = Table {
        caption: "Each at the level from which it is to be watched. Levels are changes since the machine \
                  was new, as shares of each fault's full damage."
            .to_owned(),
        columns,
        rows: tests.faults.iter().map(row).collect(),
    };
    let text = format!(
        "Without damage {} of {} tests are called healthy and {} faulty. Of the {} intervals of 95 % {} \
         hold the truth. {} tests are left without an answer. Each test is a day of its own, simulated in \
         high fidelity with the numbers that were learnt and the {:.4} A of noise on each phase sample \
         that the recordings have. Physics that the model file does not have these tests do not show.",
        tests.healthy,
        tests.sound,
        tests.false_alarms,
        tests.intervals,
        tests.held,
        tests.unanswered,
        tests.noise_a
    );
    vec![Block::Table(table), Block::Text(text)]
}

fn choices(choices: &[SetupChoice]) -> Block {
    let row = |choice: &SetupChoice| {
        let pin = choice.pin.as_deref().unwrap_or("–");
        let texts = [choice.what.as_str(), &choice.choice, &choice.reason, pin];
        texts.map(Cell::text).into()
    };
    Block::Table(Table {
        caption: "What was chosen, on what grounds, and the option that chooses otherwise."
            .to_owned(),
        columns: ["what", "choice", "grounds", "to pin"].map(Column::text).into(),
        rows: choices.iter().map(row).collect(),
    })
}

fn basis(answer: &SetupSummary) -> String {
    format!(
        "Recordings of the machine as new: {}. Model {}, command {}, seed {}; {}.",
        answer.recordings.join(", "),
        answer.model,
        answer.command,
        answer.seed,
        answer.tool
    )
}
