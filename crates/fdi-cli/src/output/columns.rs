//! The table of answers: one row a recording, the same columns in every form of table.

use fdi_core::report::{Fault, FaultId, RecordDiagnosis};

use super::answer::Answer;

/// Type of the cells of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Texts.
    Text,
    /// Numbers.
    Number,
    /// Numbers of things.
    Count,
    /// Truth values.
    Truth,
}

/// One cell; `None` where there is nothing to say.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// A text.
    Text(Option<String>),
    /// A number.
    Number(Option<f64>),
    /// A number of things.
    Count(Option<u64>),
    /// A truth value.
    Truth(Option<bool>),
}

impl Cell {
    fn nothing(kind: Kind) -> Self {
        match kind {
            Kind::Text => Self::Text(None),
            Kind::Number => Self::Number(None),
            Kind::Count => Self::Count(None),
            Kind::Truth => Self::Truth(None),
        }
    }

    fn text(text: &impl ToString) -> Self {
        Self::Text(Some(text.to_string()))
    }
}

/// Names, with their units, and kinds of the columns.
pub(crate) fn columns() -> Vec<(String, Kind)> {
    use Kind::{Count, Number, Text, Truth};
    let named = |(name, kind): (&str, Kind)| (name.to_owned(), kind);
    let before = [
        ("recording", Text),
        ("actuator_id", Text),
        ("date", Text),
        ("status", Text),
        ("verdict", Text),
    ];
    let of_fault = [
        ("", Number),
        ("_std", Number),
        ("_low_95", Number),
        ("_high_95", Number),
        ("_detected", Truth),
    ];
    let faults = FaultId::ALL
        .iter()
        .flat_map(|id| of_fault.map(|(column, kind)| (format!("{id}{column}"), kind)))
        // the direction of the eccentricity is not a fault of its own
        .filter(|(column, _)| column != "k7_detected");
    let after = [
        ("discrepancy", Number),
        ("rms_a", Number),
        ("noise_floor_a", Number),
        ("noise_a", Number),
        ("noise_source", Text),
        ("adequate", Truth),
        ("method", Text),
        ("fidelity", Text),
        ("evaluations", Count),
        ("elapsed_s", Number),
        ("action_severity", Text),
        ("action_fault", Text),
        ("action_above_watch", Number),
        ("action_above_act", Number),
        ("action_reason", Text),
        ("action_next", Text),
        ("error", Text),
    ];
    before.map(named).into_iter().chain(faults).chain(after.map(named)).collect()
}

/// Place of the status.
const STATUS: usize = 3;

/// The row of an answer, a cell for each of the [`columns`].
pub(crate) fn row(answer: &Answer) -> Vec<Cell> {
    match answer {
        Answer::Diagnosed(record) => diagnosed(record),
        Answer::Failed(failure) => {
            let mut row: Vec<_> =
                columns().into_iter().map(|(_, kind)| Cell::nothing(kind)).collect();
            row[0] = Cell::text(&failure.recording);
            row[1] = Cell::Text(failure.actuator_id.clone());
            row[2] = Cell::Text(failure.date.clone());
            row[STATUS] = Cell::text(&"failed");
            if let Some(last) = row.last_mut() {
                *last = Cell::text(&failure.error);
            }
            row
        }
    }
}

fn diagnosed(record: &RecordDiagnosis) -> Vec<Cell> {
    let mut row = vec![
        Cell::text(&record.recording),
        Cell::Text(record.actuator_id.clone()),
        Cell::Text(record.date.clone()),
        Cell::text(&record.status),
        Cell::text(&record.verdict),
    ];
    for id in FaultId::ALL {
        let undetermined = Fault::undetermined(id);
        let fault = record.fault(id).unwrap_or(&undetermined);
        let interval = fault.interval_95;
        row.extend([
            Cell::Number(fault.value),
            Cell::Number(fault.std),
            Cell::Number(interval.map(|[low, _]| low)),
            Cell::Number(interval.map(|[_, high]| high)),
        ]);
        if id != FaultId::K7 {
            row.push(Cell::Truth(fault.detected));
        }
    }
    let fit = record.fit;
    let action = record.action.as_ref();
    let above = action.and_then(|action| action.probability_above);
    row.extend([
        Cell::Number(Some(record.discrepancy)),
        Cell::Number(Some(fit.rms_a)),
        Cell::Number(Some(fit.noise_floor_a)),
        Cell::Number(Some(fit.noise_a)),
        Cell::text(&fit.noise_source),
        Cell::Truth(Some(fit.adequate)),
        Cell::text(&record.method),
        Cell::text(&record.fidelity),
        Cell::Count(Some(record.evaluations)),
        Cell::Number(record.elapsed_s),
        Cell::Text(action.map(|action| action.severity.to_string())),
        Cell::Text(action.and_then(|action| action.fault).map(|id| id.to_string())),
        Cell::Number(above.map(|above| above.watch)),
        Cell::Number(above.map(|above| above.act)),
        Cell::Text(action.map(|action| action.reason.clone())),
        Cell::Text(action.map(|action| action.next.clone())),
        Cell::Text(None),
    ]);
    row
}
