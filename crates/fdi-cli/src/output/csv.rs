//! CSV: one row a recording.

use std::io::{self, Write};

use csv::Writer;
use fdi_core::report::{Fault, FaultId, RecordDiagnosis};

use super::{Answer, AnswerWriter, Head};

/// Rows under a header whose names carry the units.
pub(super) struct Rows<'a> {
    writer: Writer<&'a mut dyn Write>,
}

impl<'a> Rows<'a> {
    pub(super) fn new(out: &'a mut dyn Write) -> Self {
        Self { writer: Writer::from_writer(out) }
    }
}

/// Columns before those of the faults.
const BEFORE: [&str; 3] = ["recording", "status", "verdict"];

/// Columns after those of the faults.
const AFTER: [&str; 11] = [
    "discrepancy",
    "rms_a",
    "noise_floor_a",
    "noise_a",
    "noise_source",
    "adequate",
    "method",
    "fidelity",
    "evaluations",
    "elapsed_s",
    "error",
];

/// Columns of a fault, after its name.
const OF_FAULT: [&str; 5] = ["", "_std", "_low_95", "_high_95", "_detected"];

impl AnswerWriter for Rows<'_> {
    fn begin(&mut self, _head: &Head) -> io::Result<()> {
        let faults = FaultId::ALL
            .iter()
            .flat_map(|id| OF_FAULT.map(|column| format!("{id}{column}")))
            // the direction of the eccentricity is not a fault of its own
            .filter(|column| column != "k7_detected");
        let columns = BEFORE.map(str::to_owned).into_iter().chain(faults);
        self.writer.write_record(columns.chain(AFTER.map(str::to_owned))).map_err(of_stream)
    }

    fn answer(&mut self, answer: &Answer) -> io::Result<()> {
        let row = match answer {
            Answer::Diagnosed(record) => row(record),
            Answer::Failed(failure) => {
                let columns = BEFORE.len() + OF_FAULT.len() * FaultId::ALL.len() - 1 + AFTER.len();
                let mut row = vec![String::new(); columns];
                row[0].clone_from(&failure.recording);
                "failed".clone_into(&mut row[1]);
                row[columns - 1].clone_from(&failure.error);
                row
            }
        };
        self.writer.write_record(row).map_err(of_stream)
    }

    fn end(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// The error of the stream itself, so that a broken pipe is known for one.
fn of_stream(error: csv::Error) -> io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => io::Error::other(format!("{other:?}")),
    }
}

fn row(record: &RecordDiagnosis) -> Vec<String> {
    let mut row =
        vec![record.recording.clone(), record.status.to_string(), record.verdict.to_string()];
    for id in FaultId::ALL {
        let undetermined = Fault::undetermined(id);
        let fault = record.fault(id).unwrap_or(&undetermined);
        let interval = fault.interval_95;
        row.extend([
            text(fault.value),
            text(fault.std),
            text(interval.map(|[low, _]| low)),
            text(interval.map(|[_, high]| high)),
        ]);
        if id != FaultId::K7 {
            row.push(text(fault.detected));
        }
    }
    let fit = record.fit;
    row.extend([
        record.discrepancy.to_string(),
        fit.rms_a.to_string(),
        fit.noise_floor_a.to_string(),
        fit.noise_a.to_string(),
        fit.noise_source.to_string(),
        fit.adequate.to_string(),
        record.method.to_string(),
        record.fidelity.to_string(),
        record.evaluations.to_string(),
        text(record.elapsed_s),
        String::new(),
    ]);
    row
}

/// An empty cell where there is nothing.
fn text(value: Option<impl ToString>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}
