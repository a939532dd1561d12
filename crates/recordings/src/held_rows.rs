//! Rows in which an acquisition has held its last samples in place of new ones.

use core::f64::consts::{PI, TAU};
use std::ops::Range;

use crate::{
    ChannelName, RecordError, clock::median, evened::MOST_BRIDGED, rows_beside::TimedRows,
};

/// Fewest rows with the same currents, the first of them measured, that are no chance.
const LEAST_ROWS: usize = 8;
/// Share of the other rows below which repeating the row before is not how this recording is.
const MOST_REPEATED_SHARE: f64 = 0.01;
/// Median steps by which a channel jumps when it goes on: what only stands still goes on from there.
const LEAST_JUMP: f64 = 6.0;

/// Rows whose currents are held, in runs.
#[derive(Debug, PartialEq)]
pub(crate) struct HeldRows(Vec<Range<usize>>);

impl HeldRows {
    /// The held rows of a table; `None` where there are none.
    ///
    /// All currents repeat the row before to the digit, in 7 rows or more between others, and one of
    /// them or an angle or position jumps at their end. Where other rows repeat too, as of a machine that
    /// stands still, without noise or behind a coarse converter, nothing is told.
    pub(crate) fn of(table: &TimedRows<'_>) -> Option<Self> {
        let currents: Vec<&[f64]> = table.currents().map(|(_, values)| values).collect();
        let rows = currents.first()?.len();
        let is_repeated = |row: usize| currents.iter().all(|values| values[row] == values[row - 1]);
        let repeated: Vec<usize> = (1..rows).filter(|&row| is_repeated(row)).collect();
        let runs = repeated.chunk_by(|before, after| before + 1 == *after);
        let long: Vec<Range<usize>> = runs
            .filter(|run| run.len() + 1 >= LEAST_ROWS)
            .map(|run| run[0]..run[run.len() - 1] + 1)
            .filter(|run| run.start > 1 && run.end < rows)
            .collect();
        if long.is_empty() {
            return None;
        }
        let jumps = Jumps::of(table);
        let held: Vec<Range<usize>> =
            long.into_iter().filter(|run| jumps.is_one(run.end)).collect();
        let others = repeated.len() - held.iter().map(Range::len).sum::<usize>();
        let is_told = !held.is_empty() && (others as f64) < MOST_REPEATED_SHARE * rows as f64;
        is_told.then_some(Self(held))
    }

    /// Refuses held rows where they are not bridged or too many in a row, with the line of a row.
    ///
    /// # Errors
    /// [`RecordError::Held`].
    pub(crate) fn check(
        &self,
        times_s: &[f64],
        is_bridged: bool,
        line: impl Fn(usize) -> Option<u64>,
    ) -> Result<(), RecordError> {
        let is_short = |run: &&Range<usize>| run.len() <= MOST_BRIDGED;
        let can_be_bridged = self.0.iter().all(|run| is_short(&run));
        let mut refused = self.0.iter().filter(|run| !(is_bridged && is_short(run)));
        let Some(first) = refused.next() else { return Ok(()) };
        Err(RecordError::Held {
            line: line(first.start),
            rows: first.len(),
            after_s: times_s[first.start - 1],
            can_be_bridged,
        })
    }

    /// The rows of a channel that are not held; `None` where all are measured.
    pub(crate) fn measured(&self, values: &[f64]) -> Option<Vec<usize>> {
        let is_held = |run: &&Range<usize>| {
            values[run.start..run.end].iter().all(|value| *value == values[run.start - 1])
        };
        let held: Vec<&Range<usize>> = self.0.iter().filter(is_held).collect();
        let is_measured = |row: &usize| !held.iter().any(|run| run.contains(row));
        (!held.is_empty()).then(|| (0..values.len()).filter(is_measured).collect())
    }
}

/// Steps of what moves, by the median of each channel.
struct Jumps<'a>(Vec<(ChannelName, &'a [f64], f64)>);

impl<'a> Jumps<'a> {
    fn of(table: &TimedRows<'a>) -> Self {
        let typical = |(name, values): (ChannelName, &'a [f64])| {
            let mut steps: Vec<f64> =
                (1..values.len()).map(|row| step(name, values, row)).collect();
            let typical = median(&mut steps);
            (typical > 0.0).then_some((name, values, typical))
        };
        Self(table.moving().filter_map(typical).collect())
    }

    /// Tells whether a channel jumps to a row.
    fn is_one(&self, row: usize) -> bool {
        let jumps = |&(name, values, typical): &(ChannelName, &[f64], f64)| {
            step(name, values, row) > LEAST_JUMP * typical
        };
        self.0.iter().any(jumps)
    }
}

/// Size of the step to a row; a jump by a turn is none of the shaft.
fn step(name: ChannelName, values: &[f64], row: usize) -> f64 {
    let step = values[row] - values[row - 1];
    if name == ChannelName::MotorAngle {
        return ((step + PI).rem_euclid(TAU) - PI).abs();
    }
    step.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number in ±1 that looks like chance.
    fn scatter(index: usize) -> f64 {
        2.0 * ((index as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0) - 1.0
    }

    /// A current of a converter with this step, and the angle of its motor.
    fn moved(noise: f64, step: f64) -> [Vec<f64>; 2] {
        let rounded = |value: f64| (value / step).round() * step;
        let phase = |row: usize| row as f64 / 200.0;
        let current = |row: usize| rounded(2.0 * phase(row).sin() + noise * scatter(row));
        [(0..3000).map(current).collect(), (0..3000).map(|row| 0.1 * phase(row).cos()).collect()]
    }

    fn held(channels: &[Vec<f64>; 2]) -> Option<HeldRows> {
        let names = [ChannelName::PhaseACurrent, ChannelName::MotorAngle];
        let channels = names.into_iter().zip(channels.iter().map(Vec::as_slice));
        let times_s: Vec<f64> = (0..3000).map(|row| f64::from(row) / 1e4).collect();
        HeldRows::of(&TimedRows::new(&times_s, channels.collect()))
    }

    fn hold(values: &mut [f64], rows: Range<usize>) {
        let value = values[rows.start - 1];
        values[rows].fill(value);
    }

    fn hold_all(channels: &mut [Vec<f64>; 2], rows: &Range<usize>) {
        for values in channels {
            hold(values, rows.clone());
        }
    }

    #[test]
    fn held_rows_are_told() {
        for rows in [1000..1100, 1570..1577, 300..320] {
            let mut all = moved(0.05, 0.0005);
            assert_eq!(held(&all), None);
            hold_all(&mut all, &rows);
            let found = held(&all).unwrap();
            assert_eq!(found, HeldRows(vec![rows.clone()]));
            let measured = found.measured(&all[0]).unwrap();
            assert_eq!((measured.len(), measured[rows.start]), (3000 - rows.len(), rows.end));
            // fewer are chance, and those at the ends may be a machine that is off
            let mut few = moved(0.05, 0.0005);
            hold_all(&mut few, &(1000..1006));
            assert_eq!(held(&few), None);
            for ends in [1..200, 2900..3000] {
                let mut at_end = moved(0.05, 0.0005);
                hold_all(&mut at_end, &ends);
                assert_eq!(held(&at_end), None);
            }
        }
    }

    #[test]
    fn a_channel_that_goes_on_is_kept() {
        let mut all = moved(0.05, 0.0005);
        hold(&mut all[0], 1000..1100);
        let found = held(&all).unwrap();
        assert_eq!(found.measured(&all[1]), None);
        let error = found.check(&vec![0.0; 3000], true, |_| None).unwrap_err().to_string();
        assert_eq!(
            error,
            "the currents are the same to the digit in the 100 rows after 0 s and jump then: held \
             samples, not measured ones; more than 8 in a row are not filled"
        );
    }

    /// Standstill, coarse converters and recordings without noise repeat rows as well.
    #[test]
    fn what_stands_still_is_not_held() {
        let with_hold = |noise: f64, step: f64| {
            let mut all = moved(noise, step);
            hold_all(&mut all, &(1000..1040));
            held(&all)
        };
        assert_eq!(held(&moved(0.0, 0.1)), None);
        assert_eq!(with_hold(0.0, 0.1), None);
        assert_eq!(with_hold(0.03, 0.1), None);
        // a machine that stands, and goes on from where it stood
        let mut all = moved(0.05, 0.0005);
        for values in &mut all {
            let offset = values[1039] - values[1000];
            hold(values, 1000..1040);
            values[1040..].iter_mut().for_each(|value| *value -= offset);
        }
        assert_eq!(held(&all), None);
    }
}
