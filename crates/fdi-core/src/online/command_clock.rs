//! The clock of a recording whose stamps were counted and not measured, by its recorded command.
//!
//! ```text
//! v_n = c(ρ·(n + s_n)/f − τ) + e_n
//! ```
//!
//! with `v_n` the command in row `n`, `c` that of the test, `f` the rate of the stamps, `ρ` how much
//! slower than its stamps the clock ran, `τ` where the command begins, and `s_n` the rows that were
//! lost before row `n`, less those that are twice: whole numbers.
//!
//! # Method
//!
//! `s` is the cheapest path through a table of rows and shifts (Viterbi): each row costs the square of its
//! difference from `c` in standard deviations, at most [`MOST_COST`], and each change of `s`
//! [`CHANGE_COST`]. A fall by one is only in rows that repeat the one before in all channels. `τ` and `ρ`
//! are then the least squares over the rows that fit, and both are done in turn while the tolerance for
//! `τ` and `ρ` shrinks. What does not explain the command to its noise and digits is not taken.
//!
//! # Source
//!
//! `docs/decisions/0161-the-clock-that-the-command-shows.md`.

use std::borrow::Cow;

use recordings::{Channel, ChannelName, RecordError, Recording, RowPlaces};

use crate::{
    online::{command_start::CommandStart, ripple::white_noise},
    simulation::experiment::Experiment,
    statistics::range,
};

/// Fewest rows in which a clock is looked for.
const LEAST_ROWS: usize = 100;
/// Most of the cost of one row: five standard deviations.
const MOST_COST: f64 = 25.0;
/// Cost of a change of the shift: more than one row can cost, less than two.
const CHANGE_COST: f64 = 40.0;
/// Cost of a row by which a recording begins earlier or later than its start was seen: a command that
/// stands before the test, and hardly moves at its beginning, leaves that open.
const START_COST: f64 = 1.0;
/// Difference in cost up to which a change may stand in another row: two standard deviations.
const OPEN_COST: f64 = 4.0;
/// Shifts looked for to either side, rows.
const MOST_SHIFT: usize = 80;
/// Parts of a sample by which `τ` and `ρ` may still be off, one round after the other.
const TOLERANCES: [f64; 4] = [0.5, 0.25, 0.1, SAME_SAMPLE];
/// Part of a sample that a time may be off by.
const SAME_SAMPLE: f64 = 0.02;
/// Most by which a clock runs fast or slow: a resonator without quartz.
const MOST_OFF: f64 = 1e-3;
/// Most while rows are lost, each of which looks like a slower clock: two clocks of quartz.
const MOST_OFF_BESIDE_LOSSES: f64 = 2e-4;
/// Share of the rows that may cost the most, for a clock to explain the command.
const MOST_STRAY: f64 = 2e-3;
/// Mean cost of the other rows up to which a clock explains the command.
const MOST_MEAN_COST: f64 = 2.0;
/// Standard deviation of the command's noise, as a share of its range, below which it is not looked at.
const LEAST_NOISE: f64 = 1e-7;
/// Drift over a recording up to which a clock is right, rows: two thousandths are 0.2 µs at 10 kHz, a
/// hundredth of a period of the carrier's ripple.
const LEAST_DRIFT: f64 = 2e-3;
/// Standard errors beyond which a clock is told to be off.
const TOLD_STDS: f64 = 5.0;
/// Drift of a clock up to which no row can be lost instead, rows.
const NO_ROW: f64 = 0.5;
/// Ratios of the clock with which a search for lost rows begins: each finds what is within half a row
/// over 5000 of them.
const FIRST_RATIOS: [f64; 3] = [1.0, 1.0 - 1.5e-4, 1.0 + 1.5e-4];
/// Share of the command's variance that stamps as they are may leave in a recording of the test.
const MOST_LEFT: f64 = 0.5;
/// Rows of the test at which a recording of it may begin.
const MOST_INTO_TEST: f64 = 0.5;
/// Steps of Gauss and Newton's method in each round.
const STEPS: usize = 4;

/// The recording of an experiment at the times that its command shows: rows that were lost filled, rows
/// that are twice left out, a clock that ran fast or slow set right. The recording itself where its
/// command shows nothing of these, or it has none. Each diagnosis begins with it.
///
/// # Errors
///
/// [`RecordError::CommandShowsGap`] where rows are lost or twice and the recording was not read with
/// gaps bridged.
pub fn timed_by_command<'a>(
    recording: &'a Recording,
    experiment: &Experiment,
) -> Result<Cow<'a, Recording>, RecordError> {
    timed(recording, experiment, CommandStart::of(recording, experiment))
}

/// The recording at the times that its command shows, and where in it the command begins.
pub(crate) fn begun_by_command<'a>(
    recording: &'a Recording,
    experiment: &Experiment,
) -> Result<(Cow<'a, Recording>, Option<CommandStart>), RecordError> {
    let seen = CommandStart::of(recording, experiment);
    let timed = timed(recording, experiment, seen)?;
    let start = match &timed {
        Cow::Borrowed(_) => seen,
        Cow::Owned(timed) => CommandStart::of(timed, experiment),
    };
    Ok((timed, start))
}

/// [`timed_by_command`] of a recording whose command was seen to begin somewhere.
fn timed<'a>(
    recording: &'a Recording,
    experiment: &Experiment,
    start: Option<CommandStart>,
) -> Result<Cow<'a, Recording>, RecordError> {
    let as_it_is = Cow::Borrowed(recording);
    let Some(channel) = command_on_the_current_s_axis(recording) else { return Ok(as_it_is) };
    let late_s = start.map_or(0.0, |start| start.at_s() - channel.times_s()[0]);
    let repeated = || recording.repeated_rows(channel);
    let Some(found) = ClockFit::of(channel, late_s, repeated, experiment) else {
        return Ok(as_it_is);
    };
    let placed = if found.is_shifted() {
        let rows = found.row_places();
        Cow::Owned(recording.with_places_by_command(channel, &rows)?)
    } else {
        as_it_is
    };
    match placed.channel(ChannelName::Command) {
        Some(channel) if found.is_off() => {
            Ok(Cow::Owned(placed.with_rate_by_command(channel, found.clock_ratio)?))
        }
        _ => Ok(placed),
    }
}

/// The recorded command, where it has the times of the current and these were not mended before.
fn command_on_the_current_s_axis(recording: &Recording) -> Option<&Channel> {
    let command = recording.channel(ChannelName::Command)?;
    let current = recording.require_current().ok()?.channel();
    let is_untouched = recording.clock_notes().iter().all(|note| note.taken.is_some());
    (is_untouched && command.times_s() == current.times_s()).then_some(command)
}

/// How the rows of a recording stand in the time of its command.
#[derive(Clone, Debug, PartialEq)]
struct ClockFit {
    /// `s_n`, 0 in the first row.
    shifts: Vec<i32>,
    /// `τ·f`, in rows.
    late_rows: f64,
    /// `ρ`.
    clock_ratio: f64,
    /// Standard error of `ρ`.
    ratio_std: f64,
    /// Rows by which each rise of the shift may stand elsewhere.
    uncertain_rows: Vec<usize>,
}

impl ClockFit {
    /// The clock that a command shows which was seen to begin late by some time, with the rows that repeat
    /// the one before; `None` where the stamps are right as they are, or no clock
    /// explains the command.
    fn of(
        channel: &Channel,
        late_s: f64,
        repeated: impl Fn() -> Vec<bool>,
        experiment: &Experiment,
    ) -> Option<Self> {
        let (values, rate_hz) = (channel.values(), channel.sampling().ok()?.rate_hz);
        if values.len() < LEAST_ROWS {
            return None;
        }
        let command = |row: f64| experiment.scenario.command.at((row / rate_hz).max(0.0));
        let last_row = experiment.scenario.duration_s * rate_hz;
        let view = View { values, command: &command, last_row };
        let plain = Self {
            shifts: vec![0; values.len()],
            late_rows: late_s * rate_hz,
            clock_ratio: 1.0,
            ratio_std: 0.0,
            uncertain_rows: Vec::new(),
        };
        let mut even = plain.clone();
        if view.explained_cost(&plain, 0.0).is_some() {
            view.fit_line(&mut even, SAME_SAMPLE, MOST_OFF);
            return even.is_off().then_some(even);
        }
        if !view.is_alike(&plain) {
            return None;
        }
        for tolerance in TOLERANCES {
            view.fit_line(&mut even, tolerance, MOST_OFF);
        }
        let of_even = view.explained_cost(&even, MOST_STRAY);
        if of_even.is_some() && even.drift_rows() < NO_ROW {
            return Some(even);
        }
        let repeated = repeated();
        let shifted = FIRST_RATIOS.into_iter().find_map(|clock_ratio| {
            let mut fit = Self { clock_ratio, ..plain.clone() };
            for tolerance in TOLERANCES {
                view.fit_shifts(&mut fit, tolerance, &repeated)?;
                view.fit_line(&mut fit, tolerance, MOST_OFF_BESIDE_LOSSES);
            }
            view.fit_shifts(&mut fit, SAME_SAMPLE, &repeated)?;
            Some((view.explained_cost(&fit, MOST_STRAY)?, fit))
        });
        let fits = of_even.map(|cost| (cost, even)).into_iter().chain(shifted);
        fits.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, fit)| fit)
    }

    /// Rows by which the clock runs off its stamps over the recording.
    fn drift_rows(&self) -> f64 {
        (self.clock_ratio - 1.0).abs() * self.shifts.len() as f64
    }

    /// True where the clock is off its stamps, as far as the command shows it.
    fn is_off(&self) -> bool {
        self.drift_rows() > LEAST_DRIFT
            && (self.clock_ratio - 1.0).abs() > TOLD_STDS * self.ratio_std
    }

    fn is_shifted(&self) -> bool {
        self.shifts.iter().any(|&shift| shift != 0)
    }

    /// Time of a row in rows of the test.
    fn row_of_test(&self, row: usize) -> f64 {
        self.clock_ratio * (row as f64 + f64::from(self.shifts[row])) - self.late_rows
    }

    fn row_places(&self) -> RowPlaces {
        let place = |(row, &shift): (usize, &i32)| row.saturating_add_signed(shift as isize);
        RowPlaces {
            places: self.shifts.iter().enumerate().map(place).collect(),
            uncertain_rows: self.uncertain_rows.clone(),
        }
    }
}

/// A recorded command beside that of the test.
struct View<'a> {
    values: &'a [f64],
    /// The test's command at a row after its start.
    command: &'a dyn Fn(f64) -> f64,
    /// Row at which the test ends.
    last_row: f64,
}

impl View<'_> {
    /// Standard deviation of the command's noise and digits beside a fit: by second differences, which
    /// shifts do not move.
    fn noise(&self, fit: &ClockFit) -> f64 {
        let within = (0..self.values.len()).filter_map(|row| {
            let row_of_test = fit.row_of_test(row);
            let is_within = (0.0..=self.last_row).contains(&row_of_test);
            is_within.then(|| self.values[row] - (self.command)(row_of_test))
        });
        let off: Vec<f64> = within.collect();
        white_noise(&off).max(LEAST_NOISE * range(self.values))
    }

    /// The value expected at a row of the test, whose time may be off by a part of a row.
    fn expected(&self, row_of_test: f64, noise: f64, tolerance: f64) -> Expected {
        if row_of_test > self.last_row {
            return Expected { value: 0.0, slope: 0.0, variance: 0.0, is_behind: true };
        }
        let slope = (self.command)(row_of_test + 0.5) - (self.command)(row_of_test - 0.5);
        Expected {
            value: (self.command)(row_of_test),
            slope,
            variance: noise * noise + (tolerance * slope).powi(2),
            is_behind: false,
        }
    }

    /// Tells whether a fit leaves little of the command.
    fn is_alike(&self, fit: &ClockFit) -> bool {
        let (mut left, mut all) = (0.0, 0.0);
        for (row, &value) in self.values.iter().enumerate() {
            let row_of_test = fit.row_of_test(row);
            if row_of_test <= self.last_row {
                let expected = (self.command)(row_of_test);
                left += (value - expected).powi(2);
                all += expected * expected;
            }
        }
        left <= MOST_LEFT * all
    }

    /// Cost of a fit, its changes included, where it explains the command but for a share of its rows.
    fn explained_cost(&self, fit: &ClockFit, most_stray: f64) -> Option<f64> {
        let noise = self.noise(fit);
        let (mut stray, mut cost) = (0usize, 0.0);
        for (row, &value) in self.values.iter().enumerate() {
            let of_row = self.expected(fit.row_of_test(row), noise, SAME_SAMPLE).cost(value);
            if of_row < MOST_COST {
                cost += of_row;
            } else if row == 0 {
                // what begins within the test is no recording of it
                return None;
            } else {
                stray += 1;
            }
        }
        let count = self.values.len() as f64;
        let changes = fit.shifts.windows(2).filter(|pair| pair[0] != pair[1]).count() as f64;
        let is_explained = stray as f64 <= most_stray * count && cost <= MOST_MEAN_COST * count;
        is_explained.then_some(cost + MOST_COST * stray as f64 + CHANGE_COST * changes)
    }

    /// Sets `τ` and `ρ`, the latter up to so far from 1, to their least squares over the rows that fit.
    fn fit_line(&self, fit: &mut ClockFit, tolerance: f64, most_off: f64) {
        let is_shifted = fit.is_shifted();
        for _ in 0..STEPS {
            let noise = self.noise(fit);
            let mut normal = [0.0; 3];
            let mut right = [0.0; 2];
            for (row, &value) in self.values.iter().enumerate() {
                let expected = self.expected(fit.row_of_test(row), noise, tolerance);
                // of a shift of rows no clock is the cause: it is left out, once all others fit
                let is_stray = expected.cost(value) >= MOST_COST;
                if expected.is_behind || is_stray && is_shifted {
                    continue;
                }
                let slope = expected.slope;
                let of = [-slope, slope * (row as f64 + f64::from(fit.shifts[row]))];
                let off = value - expected.value;
                normal[0] += of[0] * of[0];
                normal[1] += of[0] * of[1];
                normal[2] += of[1] * of[1];
                right[0] += of[0] * off;
                right[1] += of[1] * off;
            }
            let determinant = normal[0] * normal[2] - normal[1] * normal[1];
            if determinant <= f64::EPSILON * normal[0] * normal[2] {
                return;
            }
            let by = [
                (right[0] * normal[2] - right[1] * normal[1]) / determinant,
                (right[1] * normal[0] - right[0] * normal[1]) / determinant,
            ];
            let ratio = (fit.clock_ratio + by[1]).clamp(1.0 - most_off, 1.0 + most_off);
            if ratio == fit.clock_ratio + by[1] {
                fit.late_rows += by[0];
            } else if normal[0] > 0.0 {
                fit.late_rows += right[0] / normal[0];
            }
            fit.clock_ratio = ratio;
            fit.ratio_std = noise * (normal[0] / determinant).sqrt();
        }
        // rows that lack at the start are lost behind the first, with which the recording begins
        fit.late_rows += (-fit.late_rows - MOST_INTO_TEST).ceil().max(0.0);
    }

    /// Sets the shifts to those of the cheapest path; `None` where it runs along the last ones that are
    /// looked for.
    fn fit_shifts(&self, fit: &mut ClockFit, tolerance: f64, repeated: &[bool]) -> Option<()> {
        let noise = self.noise(fit);
        let (count, width) = (self.values.len(), 2 * MOST_SHIFT + 1);
        let expected: Vec<Expected> = (0..count + width)
            .map(|place| {
                let row = place as f64 - MOST_SHIFT as f64;
                self.expected(fit.clock_ratio * row - fit.late_rows, noise, tolerance)
            })
            .collect();
        let cost = |row: usize, shift: usize| expected[row + shift].cost(self.values[row]);
        let (clock_ratio, late_rows) = (fit.clock_ratio, fit.late_rows);
        let may_begin = |shift: usize| {
            clock_ratio * (shift as f64 - MOST_SHIFT as f64) - late_rows <= MOST_INTO_TEST
        };
        let from_seen = |shift: usize| shift.abs_diff(MOST_SHIFT) as f64;
        let of_first = |shift| {
            let begun = cost(0, shift) + START_COST * from_seen(shift);
            if may_begin(shift) { begun } else { f64::INFINITY }
        };
        let mut least: Vec<f64> = (0..width).map(of_first).collect();
        // the shift of the row before, of each row and shift
        let mut from: Vec<u8> = vec![0; count * width];
        for row in 1..count {
            let mut next = vec![0.0; width];
            let mut lowest = (f64::INFINITY, 0);
            for shift in 0..width {
                let mut best = (least[shift], shift);
                if lowest.0 + CHANGE_COST < best.0 {
                    best = (lowest.0 + CHANGE_COST, lowest.1);
                }
                if repeated[row] && shift + 1 < width && least[shift + 1] + CHANGE_COST < best.0 {
                    best = (least[shift + 1] + CHANGE_COST, shift + 1);
                }
                next[shift] = best.0 + cost(row, shift);
                from[row * width + shift] = best.1 as u8;
                if least[shift] < lowest.0 {
                    lowest = (least[shift], shift);
                }
            }
            least = next;
        }
        let mut shift = (0..width).min_by(|a, b| least[*a].total_cmp(&least[*b]))?;
        let mut path = vec![0; count];
        for row in (0..count).rev() {
            path[row] = shift;
            if row > 0 {
                shift = usize::from(from[row * width + shift]);
            }
        }
        if path.iter().any(|&shift| shift == 0 || shift == width - 1) {
            return None;
        }
        begin_late(&mut path, cost, may_begin);
        let first = path[0] as i32;
        fit.uncertain_rows = rises(&path).map(|row| open_rows(row, count, cost, &path)).collect();
        fit.late_rows -= fit.clock_ratio * f64::from(first - MOST_SHIFT as i32);
        fit.shifts = path.iter().map(|&shift| shift as i32 - first).collect();
        Some(())
    }
}

/// A value of the command at some time.
struct Expected {
    value: f64,
    /// Rise in a row.
    slope: f64,
    variance: f64,
    is_behind: bool,
}

impl Expected {
    /// Cost of a recorded value; behind the test more than noise costs, so that no rows go there to
    /// be rid of it.
    fn cost(&self, value: f64) -> f64 {
        if self.is_behind {
            return MOST_MEAN_COST;
        }
        ((value - self.value).powi(2) / self.variance).min(MOST_COST)
    }
}

/// First rows of higher shifts than those before.
fn rises(path: &[usize]) -> impl Iterator<Item = usize> {
    (1..path.len()).filter(|&row| path[row] > path[row - 1])
}

/// Begins a path as late as little more cost allows: where the command hardly moves, the beginning that
/// lacks the fewest rows.
fn begin_late(
    path: &mut [usize],
    cost: impl Fn(usize, usize) -> f64,
    may_begin: impl Fn(usize) -> bool,
) {
    let rise = rises(path).next().unwrap_or(0);
    if path[..rise].iter().any(|&shift| shift != path[0]) {
        return;
    }
    let of_start = |shift: usize| (0..rise).map(|row| cost(row, shift)).sum::<f64>();
    let most = of_start(path[0]) + OPEN_COST;
    let is_as_good = |&shift: &usize| may_begin(shift) && of_start(shift) <= most;
    if let Some(later) = (path[0] + 1..path[rise]).rev().find(is_as_good) {
        path[..rise].fill(later);
    }
}

/// Rows by which a rise may stand earlier or later at little more cost.
fn open_rows(
    rise: usize,
    count: usize,
    cost: impl Fn(usize, usize) -> f64,
    path: &[usize],
) -> usize {
    let (before, after) = (path[rise - 1], path[rise]);
    let reach = |rows: &mut dyn Iterator<Item = usize>, [other, own]: [usize; 2]| {
        let mut more = 0.0;
        let is_open = |row: &usize| {
            more += cost(*row, other) - cost(*row, own);
            more < OPEN_COST && path[*row] == own
        };
        rows.take_while(is_open).count()
    };
    let earlier = reach(&mut (0..rise).rev(), [after, before]);
    let later = reach(&mut (rise..count), [before, after]);
    earlier.max(later)
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use approx::assert_abs_diff_eq;
    use recordings::{ClockNote, ColumnMap, Gaps, TakenRate};

    use super::*;

    const RATE_HZ: f64 = 10e3;

    /// A recording of the chirp in rows that were taken at some times of the test, with counted stamps.
    fn counted(taken_rows: &[f64], gaps: Gaps) -> Recording {
        let command = Experiment::chirp().scenario.command;
        let mut text = "time_s,current_a,command_rad\n".to_owned();
        for (row, &taken) in taken_rows.iter().enumerate() {
            let at_s = taken / RATE_HZ;
            let (stamp_s, current_a) = (row as f64 / RATE_HZ, (40.0 * at_s).sin());
            let command_rad = command.at(at_s.max(0.0));
            let _ = writeln!(text, "{stamp_s:.4},{current_a:.6},{command_rad:.7}");
        }
        let map = ColumnMap::default().with_gaps(gaps);
        Recording::parse("r.csv", text.as_bytes(), &map).unwrap()
    }

    fn rows(from: i32, to: i32) -> Vec<f64> {
        (from..to).map(f64::from).collect()
    }

    fn timed(taken_rows: &[f64]) -> Recording {
        let recording = counted(taken_rows, Gaps::Bridge);
        timed_by_command(&recording, &Experiment::chirp()).unwrap().into_owned()
    }

    fn notes(recording: &Recording) -> Vec<(usize, usize, Option<f64>)> {
        let of = |note: &ClockNote| (note.lost, note.doubled, note.taken.map(TakenRate::hz));
        recording.clock_notes().iter().map(of).collect()
    }

    /// Largest distance of the current from what it is at its times, A.
    fn error_a(recording: &Recording, late_s: f64) -> f64 {
        let current = recording.channel(ChannelName::Current).unwrap();
        let off = current.times_s().iter().zip(current.values());
        off.map(|(t, a)| (a - (40.0 * (t - late_s)).sin()).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn a_command_that_agrees_with_its_stamps_changes_nothing() {
        for before in [0, -400] {
            let recording = counted(&rows(before, 5200), Gaps::Refuse);
            let timed = timed_by_command(&recording, &Experiment::chirp()).unwrap();
            assert!(matches!(timed, Cow::Borrowed(_)), "{before}");
        }
    }

    #[test]
    fn lost_and_doubled_rows_are_found_where_they_are() {
        for before in [0, -700] {
            let mut taken = rows(before, 5300);
            let of_test = |row: i32| (row - before) as usize;
            for (row, lost) in [(4000, 1), (2500, 6), (1200, 2), (300, 1)] {
                taken.drain(of_test(row)..of_test(row) + lost);
            }
            let twice = taken[of_test(3300)];
            taken.insert(of_test(3300), twice);
            let timed = timed(&taken);
            assert_eq!(notes(&timed), [(10, 1, None)], "{before}");
            assert!(error_a(&timed, f64::from(-before) / RATE_HZ) < 1e-4, "{before}");
        }
    }

    /// The chirp begins at 0 Hz: in its first rows the command does not show which of them is lost.
    #[test]
    fn a_row_that_is_lost_where_the_command_hardly_moves_is_counted() {
        let mut taken = rows(0, 5300);
        taken.remove(5);
        let timed = timed(&taken);
        assert_eq!(notes(&timed), [(1, 0, None)]);
        let whole = rows(0, 5300).len();
        assert_eq!(timed.channel(ChannelName::Current).unwrap().values().len(), whole);
    }

    #[test]
    fn rows_that_are_lost_are_refused_unless_gaps_are_bridged() {
        let mut taken = rows(0, 5300);
        taken.drain(1234..1237);
        let recording = counted(&taken, Gaps::Refuse);
        let refused = timed_by_command(&recording, &Experiment::chirp()).unwrap_err().to_string();
        assert_eq!(
            refused,
            "line 1236: the times are even, but `command_rad` shows 3 rows lost, the first after \
             0.1233 s (`--gaps bridge` fills what is lost and drops what is twice)"
        );
    }

    #[test]
    fn a_clock_that_runs_fast_is_set_right() {
        for ppm in [-100.0, -3.0, 40.0, 600.0] {
            let factor = 1.0 + 1e-6 * ppm;
            let taken: Vec<f64> = rows(0, 5300).iter().map(|row| factor * row).collect();
            let timed = timed(&taken);
            let notes = notes(&timed);
            assert_eq!((notes.len(), notes[0].0, notes[0].1), (1, 0, 0), "{ppm}");
            assert_abs_diff_eq!(notes[0].2.unwrap(), RATE_HZ / factor, epsilon = 1e-3);
            assert!(error_a(&timed, 0.0) < 1e-4, "{ppm}");
            let current = timed.channel(ChannelName::Current).unwrap();
            let rate_hz = current.sampling().unwrap().rate_hz;
            assert_abs_diff_eq!(rate_hz, RATE_HZ / factor, epsilon = 1e-3);
        }
    }

    #[test]
    fn lost_rows_of_a_fast_clock_are_found() {
        let mut taken: Vec<f64> = rows(0, 5300).iter().map(|row| (1.0 - 1e-4) * row).collect();
        taken.remove(3000);
        taken.remove(800);
        let timed = timed(&taken);
        let found = notes(&timed);
        assert_eq!((found.len(), found[0].0), (2, 2));
        assert_abs_diff_eq!(found[1].2.unwrap(), RATE_HZ / (1.0 - 1e-4), epsilon = 1e-3);
    }

    /// A command that is none of the test, or is off by more than times explain, shows no clock.
    #[test]
    fn a_command_that_no_clock_explains_changes_nothing() {
        let command = Experiment::chirp().scenario.command;
        let text = |of: &dyn Fn(f64) -> f64| {
            let row = |n: i32| {
                let t = f64::from(n) / RATE_HZ;
                format!("{t:.4},0.1,{:.7}\n", of(t))
            };
            let rows: Vec<String> = (0..5300).map(row).collect();
            format!("time_s,current_a,command_rad\n{}", rows.concat())
        };
        let half_a_percent_more = |t: f64| 1.005 * command.at(t);
        let sine = |t: f64| 0.005 * (30.0 * t).sin();
        for of in [&half_a_percent_more as &dyn Fn(f64) -> f64, &sine] {
            let map = ColumnMap::default().with_gaps(Gaps::Bridge);
            let recording = Recording::parse("r.csv", text(of).as_bytes(), &map).unwrap();
            let timed = timed_by_command(&recording, &Experiment::chirp()).unwrap();
            assert!(matches!(timed, Cow::Borrowed(_)));
        }
    }
}
