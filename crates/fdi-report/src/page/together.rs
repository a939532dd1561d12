//! The table of the recordings that one answer is of.

use super::content::{Cell, Column, Table};
use crate::{FaultId, PooledLevel, PooledRecording, RecordDiagnosis};

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
        cells.extend(ids.iter().map(|&id| {
            let level = one.level(id);
            let words = |_| level.map(PooledLevel::in_words).unwrap_or_default();
            Cell::number(level.map(|level| level.value), words)
        }));
        cells.push(text(&one.left_out));
        cells
    };
    let rows = record.together.iter().map(row).collect();
    Some(Table { caption: CAPTION.to_owned(), columns, rows })
}
