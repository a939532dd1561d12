//! Rows that have one time: samples between two stamps, one row several times, or rows of several
//! recordings beside one another.

use core::f64::consts::{PI, TAU};

use crate::{ChannelName, OtherColumn, RecordError, row_choice::choice_of};

/// Fewest times that tell by their rows.
const LEAST_TIMES: usize = 100;
/// Share of the movement between times that has to go the way of the slower movement around it:
/// else the channel holds ripple or noise, and which row is before which does not show.
const LEAST_DIRECTED: f64 = 0.3;
/// Least share of directed movement where no column tells the recordings apart.
const LEAST_DIRECTED_ALONE: f64 = 0.4;
/// Share of what one recording moves from the first to the last row of a time, below which currents are
/// of several: ripple makes it 0.7 to 1.4 of one.
const LEAST_MOVED: f64 = 0.5;
/// Shares between which what turns or slides is of one recording.
const SMOOTHLY_MOVED: [f64; 2] = [0.8, 1.25];
/// Standard errors that the sum has to be off such a share.
const STD_ERRORS: f64 = 5.0;
/// Mean square step between rows of a time over that between times that no recording has.
const MOST_STEPS_RATIO: f64 = 8.0;
/// Share of the steps between rows of a time that are none while the channel moves: it is held.
const MOST_HELD_SHARE: f64 = 0.3;
/// Channels that move evenly, the best first; currents come after them.
const SMOOTH: [ChannelName; 3] =
    [ChannelName::MotorAngle, ChannelName::SurfaceAngle, ChannelName::Position];
const CURRENTS: [ChannelName; 5] = [
    ChannelName::PhaseACurrent,
    ChannelName::PhaseBCurrent,
    ChannelName::PhaseCCurrent,
    ChannelName::Current,
    ChannelName::QAxisCurrent,
];

/// Channels that have a sample in each row of a table.
pub(crate) struct TimedRows<'a> {
    times_s: &'a [f64],
    channels: Vec<(ChannelName, &'a [f64])>,
}

impl<'a> TimedRows<'a> {
    pub(crate) fn new(times_s: &'a [f64], channels: Vec<(ChannelName, &'a [f64])>) -> Self {
        Self { times_s, channels }
    }

    /// The channels that are currents.
    pub(crate) fn currents(&self) -> impl Iterator<Item = (ChannelName, &'a [f64])> {
        self.channels.iter().copied().filter(|(name, _)| CURRENTS.contains(name))
    }

    /// The currents, and what turns or slides.
    pub(crate) fn moving(&self) -> impl Iterator<Item = (ChannelName, &'a [f64])> {
        let smooth = self.channels.iter().copied().filter(|(name, _)| SMOOTH.contains(name));
        self.currents().chain(smooth)
    }

    /// Rows that have the time and the samples of the row before.
    pub(crate) fn repeated(&self) -> Vec<usize> {
        let is_repeated = |&row: &usize| {
            self.times_s[row - 1] == self.times_s[row]
                && self.channels.iter().all(|(_, values)| values[row - 1] == values[row])
        };
        if self.channels.is_empty() {
            return Vec::new();
        }
        (1..self.times_s.len()).filter(is_repeated).collect()
    }

    /// The rows of several recordings that have the same times.
    ///
    /// Rows of one recording go on from the first to the last of a time, as they do from time to time;
    /// those of several begin anew with each.
    ///
    /// # Method
    ///
    /// ```text
    /// R = Σ s_i·(x_i,n − x_i,1) / Σ s_i·(x_{i+1},1 − x_i,1),   s_i = sgn(x̄_{i+2} − x̄_{i−1})
    /// ```
    ///
    /// with the values `x_i,1` to `x_i,n` at time `i` and their mean `x̄_i`. One recording has
    /// `R = (n − 1)/n`; several that move alike have 0, as `s_i` says nothing of how they differ.
    /// Several that differ by more than they move have far longer steps within a time than between
    /// times.
    ///
    /// # Valid for
    ///
    /// Recordings with all times in common, but for those after the end of the shorter. A channel whose
    /// ripple is as fast as its samples says nothing, nor do two recordings of which one is about half a
    /// sample ahead of the other (0.4 to 0.6).
    fn of_several(&self) -> Option<Beside> {
        let Beside { each, rows, .. } = self.alike()?;
        let channels = |names: &[ChannelName]| -> Vec<(ChannelName, &[f64])> {
            let named = self.channels.iter().filter(|(name, _)| names.contains(name));
            named.map(|&(name, values)| (name, &values[..rows])).collect()
        };
        let smooth = SMOOTH.iter().map(|name| channels(&[*name]));
        smooth.chain([channels(&CURRENTS)]).find_map(|channels| {
            let moved = channels.iter().filter_map(|&(name, values)| {
                Moved::of(values, each, name == ChannelName::MotorAngle)
            });
            let moved = moved.reduce(Moved::plus)?;
            let (channel, _) = channels[0];
            let (is_smooth, is_directed) =
                (SMOOTH.contains(&channel), moved.is_directed(LEAST_DIRECTED));
            let begins_anew = is_directed
                && if is_smooth {
                    moved.is_off(SMOOTHLY_MOVED)
                } else {
                    moved.is_below(LEAST_MOVED)
                };
            // ripple that is as fast as the samples is as far apart as recordings
            let is_certain = is_smooth || begins_anew && moved.is_directed(LEAST_DIRECTED_ALONE);
            let beside = Beside { each, rows, channel, is_certain };
            let is_far_apart = moved.is_far_apart();
            (is_directed || is_far_apart).then(|| (begins_anew || is_far_apart).then_some(beside))
        })?
    }

    /// Rows of which as many have each time, up to the first time that has others.
    fn alike(&self) -> Option<Beside> {
        let first_s = self.times_s.first()?;
        let each = self.times_s.iter().take_while(|time_s| *time_s == first_s).count();
        let is_next = |pair: &[f64], at: usize| {
            if (at + 1).is_multiple_of(each) { pair[1] > pair[0] } else { pair[1] == pair[0] }
        };
        let pairs = self.times_s.windows(2).enumerate();
        let alike = 1 + pairs.take_while(|&(at, pair)| is_next(pair, at)).count();
        let times = alike / each.max(1);
        if each < 2 || times < LEAST_TIMES || alike < self.times_s.len() / 2 {
            return None;
        }
        let &(channel, _) = self.channels.first()?;
        Some(Beside { each, rows: times * each, channel, is_certain: false })
    }
}

/// Rows of several recordings beside one another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Beside {
    /// Rows of each time.
    each: usize,
    /// Rows up to the end of the shortest recording.
    rows: usize,
    /// The channel that shows it.
    channel: ChannelName,
    /// False where only a column that tells the recordings apart makes sure that there are several.
    is_certain: bool,
}

impl TimedRows<'_> {
    /// Refuses rows of several recordings that have the same times, by a choice of rows among the other
    /// columns of the table.
    ///
    /// # Errors
    /// [`RecordError::RecordingsBeside`].
    pub(crate) fn check(
        &self,
        line: impl Fn() -> Option<u64>,
        choice: impl Fn(&dyn Fn(&OtherColumn) -> Option<String>) -> Option<String>,
    ) -> Result<(), RecordError> {
        let Some(alike) = self.alike() else { return Ok(()) };
        if let Some(found) = choice(&|other| alike.choice_in_any_order(other)) {
            return alike.check(line(), self.times_s[0], Some(found));
        }
        let Some(beside) = self.of_several() else { return Ok(()) };
        beside.check(line(), self.times_s[0], choice(&|other| beside.choice_by(other)))
    }
}

impl Beside {
    /// The choice by a column whose values are the same at each time and in another order at some: what
    /// counts samples within a time has them in one order.
    fn choice_in_any_order(self, column: &OtherColumn) -> Option<String> {
        let choice = self.choice_by(column)?;
        let cells: Vec<&str> = column.cells().take(self.rows).collect();
        let (first, others) = cells.split_at(self.each);
        others.chunks_exact(self.each).any(|of_time| of_time != first).then_some(choice)
    }

    /// The choice of rows that reads the recording of the first row, by a column whose values are
    /// others in each row of a time and the same at each time.
    fn choice_by(self, column: &OtherColumn) -> Option<String> {
        if column.samples() < self.rows {
            return None;
        }
        let mut first: Vec<&str> = column.cells().take(self.each).collect();
        let choice = choice_of(column.name(), first[0]);
        let cells: Vec<&str> = column.cells().take(self.rows).collect();
        first.sort_unstable();
        let are_apart = first.windows(2).all(|pair| pair[0] != pair[1]);
        let is_same = |cells: &[&str]| {
            let mut cells = cells.to_vec();
            cells.sort_unstable();
            cells == first
        };
        choice.filter(|_| are_apart && cells.chunks_exact(self.each).all(is_same))
    }

    /// Refuses the rows, from the first time on, with the choice of rows that reads one recording.
    ///
    /// # Errors
    /// [`RecordError::RecordingsBeside`], unless there may be one recording alone.
    fn check(
        self,
        line: Option<u64>,
        time_s: f64,
        choice: Option<String>,
    ) -> Result<(), RecordError> {
        let Self { each: rows, channel, is_certain, .. } = self;
        if !is_certain && choice.is_none() {
            return Ok(());
        }
        Err(RecordError::RecordingsBeside { line, time_s, rows, channel, rows_of_one: choice })
    }
}

/// Sums of how a channel moves, from the first to the last row of a time (within) and from the first
/// row of a time to that of the next (between).
#[derive(Clone, Copy, Debug, Default)]
struct Moved {
    /// Share of the movement between times that one recording makes within them, (n − 1)/n.
    share: f64,
    /// In the direction of the slower movement.
    within: f64,
    between: f64,
    /// Sum of the sizes of the movements between.
    sizes: f64,
    within_squares: f64,
    products: f64,
    between_squares: f64,
    /// Mean square steps from row to row within a time.
    step_squares: f64,
}

impl Moved {
    /// The sums of a channel with `each` rows a time; `None` where it is held between times.
    fn of(values: &[f64], each: usize, is_angle: bool) -> Option<Self> {
        let step = |from: f64, to: f64| match to - from {
            turned if is_angle => (turned + PI).rem_euclid(TAU) - PI,
            step => step,
        };
        let of_times: Vec<&[f64]> = values.chunks_exact(each).collect();
        let mean = |rows: &[f64]| {
            rows[0] + rows.iter().map(|value| step(rows[0], *value)).sum::<f64>() / each as f64
        };
        let means: Vec<f64> = of_times.iter().map(|rows| mean(rows)).collect();
        let steps_of_time = (each - 1) as f64;
        let mut sums = Self { share: steps_of_time / each as f64, ..Self::default() };
        let (mut steps, mut held) = (0.0, 0.0);
        for (at, pair) in of_times.windows(2).enumerate().skip(1).take(of_times.len() - 3) {
            let way = step(means[at - 1], means[at + 2]);
            let sign = if way == 0.0 { 0.0 } else { way.signum() };
            let within = step(pair[0][0], pair[0][each - 1]);
            let between = step(pair[0][0], pair[1][0]);
            let squares = pair[0].windows(2).map(|rows| step(rows[0], rows[1]).powi(2));
            if between != 0.0 {
                steps += steps_of_time;
                held += squares.clone().filter(|square| *square == 0.0).count() as f64;
            }
            sums.within += sign * within;
            sums.between += sign * between;
            sums.sizes += between.abs();
            sums.within_squares += within * within;
            sums.products += within * between;
            sums.between_squares += between * between;
            sums.step_squares += squares.sum::<f64>() / steps_of_time;
        }
        (held <= MOST_HELD_SHARE * steps).then_some(sums)
    }

    fn plus(self, other: Self) -> Self {
        Self {
            share: self.share,
            within: self.within + other.within,
            between: self.between + other.between,
            sizes: self.sizes + other.sizes,
            within_squares: self.within_squares + other.within_squares,
            products: self.products + other.products,
            between_squares: self.between_squares + other.between_squares,
            step_squares: self.step_squares + other.step_squares,
        }
    }

    /// Tells whether the channel moves from time to time by more than ripple and noise.
    fn is_directed(&self, least: f64) -> bool {
        self.sizes > 0.0 && self.between >= least * self.sizes
    }

    /// Standard errors that the movement within times is above so much of that of one recording.
    fn errors_above(&self, moved: f64) -> f64 {
        let by = moved * self.share;
        let squares =
            self.within_squares - 2.0 * by * self.products + by * by * self.between_squares;
        (self.within - by * self.between) / squares.max(f64::MIN_POSITIVE).sqrt()
    }

    fn is_below(&self, moved: f64) -> bool {
        self.errors_above(moved) < -STD_ERRORS
    }

    fn is_off(&self, [least, most]: [f64; 2]) -> bool {
        self.is_below(least) || self.errors_above(most) > STD_ERRORS
    }

    /// Tells whether the rows of a time are farther apart than those of one recording are.
    fn is_far_apart(&self) -> bool {
        self.step_squares > MOST_STEPS_RATIO * self.between_squares
    }
}

#[cfg(test)]
mod tests;
