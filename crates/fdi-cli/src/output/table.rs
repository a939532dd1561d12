//! Columns of text for a terminal.

use std::{fmt, fmt::Write};

/// Writes rows under a header, columns padded to their widest cell and two spaces
/// apart; the first column is to the left, the others too. Nothing is wrapped or
/// cut: a pager or a wider window shows it all.
///
/// Escape sequences in a cell take no room.
pub(crate) fn table(out: &mut impl Write, header: &[String], rows: &[Vec<String>]) -> fmt::Result {
    let widest = |column: usize| {
        let cells = rows.iter().map(|row| row[column].as_str());
        cells.chain([header[column].as_str()]).map(width).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..header.len()).map(widest).collect();
    line(out, header, &widths)?;
    let rule: Vec<String> = widths.iter().map(|&width| "-".repeat(width)).collect();
    line(out, &rule, &widths)?;
    rows.iter().try_for_each(|row| line(out, row, &widths))
}

fn line(out: &mut impl Write, cells: &[String], widths: &[usize]) -> fmt::Result {
    let mut text = String::new();
    for (cell, &wide) in cells.iter().zip(widths) {
        text.push_str(cell);
        text.extend(std::iter::repeat_n(' ', wide - width(cell) + 2));
    }
    writeln!(out, "{}", text.trim_end())
}

/// Characters that are seen.
fn width(cell: &str) -> usize {
    anstream::adapter::strip_str(cell).to_string().chars().count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escape_sequences_do_not_shift_columns() {
        let mut text = String::new();
        let rows = [vec!["\u{1b}[1mab\u{1b}[0m".to_owned(), "±1".to_owned()]];
        table(&mut text, &["long".to_owned(), "x".to_owned()], &rows).unwrap();
        let shown = anstream::adapter::strip_str(&text).to_string();
        assert_eq!(shown, "long  x\n----  --\nab    ±1\n");
    }
}
