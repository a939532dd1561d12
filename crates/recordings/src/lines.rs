//! Where the rows of a text stand, for messages about single samples.

use crate::SharedNumbers;

/// Lines of the rows of a text, by their times.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lines {
    times_s: SharedNumbers,
    /// Rows from which on the line is that many more than the row: one entry, and one
    /// more for each blank line or line break inside a cell.
    runs: Vec<(usize, u64)>,
}

impl Lines {
    /// Lines of the rows with these times, where row `i` of a run is at `i` plus its offset.
    pub(super) fn new(times_s: SharedNumbers, runs: Vec<(usize, u64)>) -> Self {
        Self { times_s, runs }
    }

    /// The line of the row at that time, from 1.
    pub(super) fn of(&self, time_s: f64) -> Option<u64> {
        let row = self.times_s.binary_search_by(|row_s| row_s.total_cmp(&time_s)).ok()?;
        Some(self.of_row(row))
    }

    /// The line of a row, both from the first.
    pub(super) fn of_row(&self, row: usize) -> u64 {
        let run = self.runs.partition_point(|(first, _)| *first <= row).saturating_sub(1);
        row as u64 + self.runs.get(run).map_or(1, |(_, ahead)| *ahead)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_found_by_their_times() {
        let lines = Lines::new(vec![0.0, 0.5, 1.0].into(), vec![(0, 3), (2, 4)]);
        assert_eq!([0.0, 0.5, 1.0].map(|t| lines.of(t)), [Some(3), Some(4), Some(6)]);
        assert_eq!(lines.of(0.7), None);
    }
}
