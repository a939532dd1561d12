//! The table of the recordings that one answer is of.

use super::content::{Cell, Column, Table};
use crate::{FaultId, PooledRecording, RecordDiagnosis, plus_minus, to_digits_of};

const CAPTION: &str = "Recordings that the answer is of, each by itself: level before it is joined with the others, \
     ± standard deviation. In brackets: the standard deviation that the answer would have without \
     the recording.";

/// The recordings of an answer to several; `None` where it is of one.
pub(super) fn table(record: &RecordDiagnosis) -> Option<Table> {
    if record.together.len() < 2 {
        return None;
    }
    let ids = &FaultId::ALL[..6];
    let mut columns: Vec<Column> = ["recording", "session", "verdict"].map(Column::text).into();
    columns.extend(ids.iter().map(|id| Column::number(&id.short_name())));
    columns.push(Column::text("left out"));
    let row = |one: &PooledRecording| {
        let text = |text: &Option<String>| Cell::text(text.as_deref().unwrap_or("–"));
        let mut cells = vec![
            Cell::text(one.recording.as_str()),
            text(&one.session),
            Cell::text(one.verdict.word()),
        ];
        cells.extend(ids.iter().map(|id| level(one, *id)));
        cells.push(text(&one.left_out));
        cells
    };
    let rows = record.together.iter().map(row).collect();
    Some(Table { caption: CAPTION.to_owned(), columns, rows })
}

fn level(one: &PooledRecording, id: FaultId) -> Cell {
    let level = one.levels.iter().find(|level| level.id == id);
    Cell::number(level.map(|level| level.value), |value| {
        let std = level.map_or(0.0, |level| level.std);
        let without = level.and_then(|level| level.std_without);
        let without =
            without.map(|std| format!(" ({})", to_digits_of(std, std))).unwrap_or_default();
        plus_minus(value, std, "±") + &without
    })
}
