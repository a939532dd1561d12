//! The report of one of the paper's experiments.

use super::content::{Block, Cell, Column, Figure, Page, Section, Table};
use crate::{
    Evaluation, FaultEvaluation, MethodEvaluation, convergence_figure_svg, detection_figure_svg,
};

/// The page of a result.
pub(super) fn page(result: &Evaluation, tool: &str) -> Page {
    let mut sections = vec![methods(result)];
    sections.extend(result.methods.iter().map(|method| faults(result, method)));
    let source = source(result);
    let figure = |name: &str, svg: Option<String>, caption: &str| {
        svg.map(|svg| {
            Block::Figure(Figure {
                name: format!("{}-{name}", result.protocol),
                svg,
                caption: caption.to_owned(),
                source: source.clone(),
            })
        })
    };
    let figures = [
        figure(
            "convergence",
            convergence_figure_svg(result),
            "Least discrepancy in A (norm of the residual on the mask's points), and the error of each \
             fault in % where it was, against evaluations of the monitor and time in s: median, and \
             the middle half of the conditions as a band.",
        ),
        figure(
            "detection",
            detection_figure_svg(result),
            "Share of the recordings in which a fault is detected, against its level (0 as new, 1 \
             full damage).",
        ),
    ];
    let blocks: Vec<Block> = figures.into_iter().flatten().collect();
    if !blocks.is_empty() {
        sections.insert(1, Section::new("Figures", blocks));
    }
    sections.push(basis(result, tool));
    let title = format!("Experiment “{}”", result.protocol);
    Page { title, answer: answer(result), sections, ..Page::default() }
}

/// The answer in a sentence.
fn answer(result: &Evaluation) -> String {
    let by_average = |a: &&MethodEvaluation, b: &&MethodEvaluation| {
        a.average_percent.total_cmp(&b.average_percent)
    };
    let Some(best) = result.methods.iter().min_by(by_average) else {
        return "No method was evaluated.".to_owned();
    };
    let among = match result.methods.len() {
        1 => String::new(),
        count => format!(", the least of {count} methods"),
    };
    format!(
        "`{}` finds the levels of {} simulated conditions with a median error of {:.3} % (mean over \
         the faults){among}, with {} evaluations of the model.",
        best.method, result.conditions, best.average_percent, best.evaluations_median
    )
}

/// Where all figures are from.
fn source(result: &Evaluation) -> String {
    let settings = &result.settings;
    let on = |switch: bool| if switch { "on" } else { "off" };
    format!(
        "{} simulated conditions of the experiment “{}”, seed {}; controller noise {}, digitisation \
         {}, {} A of noise on each phase sample at {} Hz; {} + {} reference signals.",
        result.conditions,
        result.protocol,
        result.seed,
        on(settings.controller_noise),
        on(settings.digitisation),
        settings.sensor_noise_a,
        settings.phase_rate_hz,
        settings.snapshots,
        settings.sparse_snapshots
    )
}

fn methods(result: &Evaluation) -> Section {
    let mut columns = vec![Column::text("method")];
    let numbers = ["average error, %", "evaluations", "discrepancy, A", "time, s", "coverage, %"];
    columns.extend(numbers.map(Column::number));
    let row = |method: &MethodEvaluation| {
        vec![
            Cell::text(method.method.as_str()),
            Cell::number(Some(method.average_percent), percent),
            Cell::number(Some(method.evaluations_median), |v| v.to_string()),
            Cell::number(method.discrepancy_median, |v| format!("{v:.5}")),
            Cell::number(method.wall_time_s, |v| format!("{v:.4}")),
            Cell::number(method.coverage_95, |v| format!("{:.1}", 100.0 * v)),
        ]
    };
    let table = said(Table {
        caption: "Mean over the faults of the median percentage error; medians over the \
                  conditions of evaluations, of the discrepancy at the end and of wall time; share \
                  of 95 % intervals that hold the truth, where intervals are given."
            .to_owned(),
        columns,
        rows: result.methods.iter().map(row).collect(),
    });
    let blocks = vec![Block::Table(table), Block::Text(format!("From: {}", source(result)))];
    Section::new("Methods", blocks)
}

fn faults(result: &Evaluation, method: &MethodEvaluation) -> Section {
    let numbers = [
        "median error, %",
        "quartiles, %",
        "largest, %",
        "median error, level",
        "rms / bound",
        "coverage, %",
        "false alarms",
    ];
    let mut columns = vec![Column::text("fault")];
    columns.extend(numbers.map(Column::number));
    let row = |fault: &FaultEvaluation| {
        let error = fault.error_percent;
        let quartiles = Cell::number(error.map(|q| q.p75), |high| {
            format!("{} to {}", percent(error.map_or(0.0, |q| q.p25)), percent(high))
        });
        vec![
            Cell::text(format!("{} {}", fault.id, fault.id.name())),
            Cell::number(error.map(|q| q.median), percent),
            quartiles,
            Cell::number(error.map(|q| q.max), percent),
            Cell::number(fault.error_abs.map(|q| q.median), |v| format!("{v:.1e}")),
            Cell::number(fault.rmse_over_bound, |v| format!("{v:.2}")),
            Cell::number(fault.coverage_95, |v| format!("{:.1}", 100.0 * v)),
            Cell::number(fault.false_alarms.map(|count| count as f64), |v| v.to_string()),
        ]
    };
    let bounded = method.faults.iter().any(|fault| fault.rmse_over_bound.is_some());
    let bound = if bounded { "; rms of the error over the Cramér-Rao bound" } else { "" };
    let table = said(Table {
        caption: format!(
            "Errors of `{}` over {} conditions (eq. 20 of the FREEDOM paper){bound}.",
            method.method, result.conditions
        ),
        columns,
        rows: method.faults.iter().map(row).collect(),
    });
    Section::new(format!("Faults, `{}`", method.method), vec![Block::Table(table)])
}

/// Makes the section on the basis of the figures.
fn basis(result: &Evaluation, tool: &str) -> Section {
    let facts = vec![
        format!("Program: {tool}, seed {}.", result.seed),
        format!("Conditions: {}", source(result)),
        "Everything is simulated: no machine was measured for this page.".to_owned(),
    ];
    Section::new("What this rests on", vec![Block::List(facts)])
}

/// The table without the columns of numbers that the experiment does not say.
fn said(table: Table) -> Table {
    let Table { caption, columns, rows } = table;
    let keep: Vec<bool> = columns
        .iter()
        .enumerate()
        .map(|(place, column)| !column.numeric || rows.iter().any(|row| row[place].value.is_some()))
        .collect();
    let columns = columns.into_iter().zip(&keep).filter(|(_, keep)| **keep).map(|(c, _)| c);
    let kept = |row: Vec<Cell>| {
        row.into_iter().zip(&keep).filter(|(_, keep)| **keep).map(|(cell, _)| cell).collect()
    };
    Table { caption, columns: columns.collect(), rows: rows.into_iter().map(kept).collect() }
}

/// A percentage to what it says: thousandths of small ones, whole ones of large ones.
fn percent(value: f64) -> String {
    if value < 100.0 { format!("{value:.3}") } else { format!("{value:.0}") }
}
