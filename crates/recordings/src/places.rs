//! Places of samples on the clock behind their stamps: a rough period, and the losses since the first.

use crate::clock::{median, roundest};

/// Samples that the first estimate of the period spans.
const SPAN_SAMPLES: usize = 64;
/// Standard deviations that half a period has to be, for a shift of one period to be seen.
const SHIFT_STDS: f64 = 6.0;
/// Variance of a median over that of a mean, normal deviates.
const MEDIAN_VARIANCE_RATIO: f64 = 1.6;
/// Standard deviation over median absolute deviation, normal deviates.
const STD_PER_MAD: f64 = 1.482_6;
/// Fewest samples that show a shift: one or two late stamps are none.
const LEAST_WINDOW: usize = 5;
/// Share of a period from which rounded stamps do not tell steps of one from steps of two periods.
const COARSE_QUANTUM: f64 = 0.25;
/// Share of a period by which a step may be off whole periods for it to be told how many.
const WHOLE_WITHIN: f64 = 0.4;
/// Share of a period by which a step of coarse stamps may be off whole periods.
const EXACT_WITHIN: f64 = 1e-3;
/// Fewest losses that tell chance from a slower clock, whose long steps are evenly apart.
const LEAST_LOSSES: usize = 4;
/// Most places without a sample in a row that are looked for by their stamps.
const MOST_SKIPPED: usize = 1000;
/// Periods of a step of coarse stamps that is no short gap.
const LONG_STEP: f64 = 9.0;
/// Share of a period that the level of rounded stamps may scatter for a shift to be read off it.
const SETTLED_STD: f64 = 0.1;

/// A period near enough to find shifts of whole periods with.
pub(crate) struct RoughClock<'a> {
    stamps_s: &'a [f64],
    /// Samples that repeat the one before, values and all.
    is_repeated: &'a [bool],
    quantum_s: f64,
    period_s: f64,
    /// Standard deviation of a residual, s.
    std_s: f64,
    is_coarse: bool,
    /// Samples that residuals are means of: those that have one stamp.
    alike: usize,
    residuals_s: Vec<f64>,
}

impl<'a> RoughClock<'a> {
    /// The period of stamps in the order of time, which are written to a multiple of `quantum_s`.
    pub(crate) fn of(sorted: &'a [f64], is_repeated: &'a [bool], quantum_s: f64) -> Option<Self> {
        let mut steps: Vec<f64> = sorted.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let intervals = steps.len();
        let counted_s = (sorted[intervals] - sorted[0]) / intervals as f64;
        let is_coarse = quantum_s >= COARSE_QUANTUM * counted_s;
        let coarseness = (4.0 * quantum_s / counted_s).max(1.0);
        let most = if is_coarse { most_span(&steps, quantum_s, counted_s) } else { usize::MAX };
        let span = (SPAN_SAMPLES as f64 * coarseness) as usize;
        let span = span.min(most).clamp(1, intervals.div_ceil(2));
        let mut spans: Vec<f64> = sorted.windows(span + 1).map(|all| all[span] - all[0]).collect();
        // spans with losses are longer; of coarse stamps a loss does not show in one span
        let from_below = if is_coarse { spans.len() / 2 } else { spans.len() / 4 };
        let typical_s = *spans.select_nth_unstable_by(from_below, f64::total_cmp).1;
        let median_step_s = median(&mut steps);
        for step_s in &mut steps {
            *step_s = (*step_s - median_step_s).abs();
        }
        let spread_s = STD_PER_MAD * median(&mut steps) / 2f64.sqrt();
        let within_s = quantum_s.max(4.0 * spread_s);
        let mean_near = |middle_s: f64| {
            let near = spans.iter().filter(|span_s| (**span_s - middle_s).abs() <= within_s);
            let (sum, count) =
                near.fold((0.0, 0), |(sum, count), span_s| (sum + span_s, count + 1));
            if count == 0 { middle_s } else { sum / f64::from(count) }
        };
        let mut period_s = mean_near(mean_near(typical_s)) / span as f64;
        if is_coarse {
            let rate_hz = period_s.recip();
            period_s = roundest(rate_hz, rate_hz * quantum_s / (span as f64 * period_s)).recip();
        }
        if !(period_s > 0.0 && period_s.is_finite()) {
            return None;
        }
        let alike = ((quantum_s / period_s).round() as usize).clamp(1, sorted.len() / 4);
        let residual_s = |index: usize| sorted[index] - sorted[0] - index as f64 * period_s;
        let residuals_s =
            moving_means(&(0..sorted.len()).map(residual_s).collect::<Vec<_>>(), alike);
        let block = (SPAN_SAMPLES * alike).min(sorted.len() / 4).max(2);
        let std_s = if is_coarse { std_in_blocks(&residuals_s, block) } else { spread_s };
        Some(Self {
            stamps_s: sorted,
            is_repeated,
            quantum_s,
            period_s,
            std_s,
            is_coarse,
            alike,
            residuals_s,
        })
    }

    /// Samples by which the place of a loss that the level shows may be off: as many as have one stamp.
    fn misplaced_by_level(&self) -> usize {
        if self.alike == 1 { 0 } else { self.alike }
    }

    /// Tells whether the level of rounded stamps is steady enough to read a shift off it.
    fn is_settled(&self) -> bool {
        self.std_s <= SETTLED_STD * self.period_s
    }

    /// Samples that show a shift of one period.
    fn window(&self, count: usize) -> usize {
        let variances = (2.0 * SHIFT_STDS * self.std_s / self.period_s).powi(2);
        let samples = (2.0 * variances * MEDIAN_VARIANCE_RATIO).ceil() as usize * self.alike;
        // a tie that is rounded the other way moves as many means as samples are alike
        let least = LEAST_WINDOW.max(2 * self.alike + 3);
        samples.clamp(least, (count / 4).max(least))
    }

    /// The places of samples in the order of time; nothing where a shift is backwards.
    pub(crate) fn places(&self) -> Option<Placed> {
        if let Some(places) = self.places_by_steps() {
            return Some(Placed { places, misplaced: Misplaced::Each(0) });
        }
        let by_level = || {
            let misplaced = Misplaced::Each(self.misplaced_by_level());
            Some(Placed { places: self.places_by_level()?, misplaced })
        };
        if !self.is_coarse {
            return by_level();
        }
        self.places_by_rule()
            .or_else(|| self.is_settled().then(by_level).flatten())
            .or_else(|| self.places_by_range())
    }

    /// Places by single steps, where each is near a whole number of periods. Coarse stamps show it
    /// where their quantum is a whole number of times in the period, the shortest step; a row that
    /// repeats the one before, its stamp too, is no step.
    fn places_by_steps(&self) -> Option<Vec<Option<usize>>> {
        let is_repeated = |index: usize| {
            self.is_coarse
                && self.is_repeated[index]
                && self.stamps_s[index] == self.stamps_s[index - 1]
        };
        let apart = (1..self.stamps_s.len()).filter(|&index| !is_repeated(index));
        let step_s = |index: usize| self.stamps_s[index] - self.stamps_s[index - 1];
        let (period_s, within) = if self.is_coarse {
            (apart.map(step_s).fold(f64::INFINITY, f64::min), EXACT_WITHIN)
        } else {
            (self.period_s, WHOLE_WITHIN)
        };
        if period_s <= 0.0 {
            return None;
        }
        let mut places = vec![Some(0)];
        let mut place = 0;
        for index in 1..self.stamps_s.len() {
            if is_repeated(index) {
                places.push(None);
                continue;
            }
            let step = step_s(index) / period_s;
            if step.round() < 1.0 || (step - step.round()).abs() > within {
                return None;
            }
            place += step.round() as usize;
            places.push(Some(place));
        }
        let kept: Vec<usize> = places.iter().flatten().copied().collect();
        let is_known = || {
            let has_repeated = kept.len() < places.len();
            has_repeated && place + 1 == kept.len() || are_by_chance(&kept)
        };
        (!self.is_coarse || is_known()).then_some(places)
    }

    /// Places by the very numbers that a program writes for the samples of a counted clock, where one
    /// way of computing and rounding them gives each stamp: ties do not hide a loss then.
    fn places_by_rule(&self) -> Option<Placed> {
        let rate_hz = self.period_s.recip();
        let first = (self.stamps_s[0] * rate_hz).round() as i64;
        // counted from nought, or from any sample whose time is written so
        let reach = if self.stamps_s[0] == 0.0 { 0 } else { self.alike as i64 };
        let starts = (first - reach..=first + reach).filter(|start| *start >= 0);
        let tried = starts.flat_map(|start| WrittenBy::ALL.map(|way| (start, way)));
        let found = tried.filter_map(|(start, way)| {
            let stamp_s =
                |place: usize| way.stamp_s(start as usize + place, rate_hz, self.quantum_s);
            self.places_as_written(stamp_s)
        });
        // a recording may begin at any sample of its first stamp: what is not there is not lost
        let places = found.min_by_key(|places| places.iter().flatten().last().copied())?;
        Some(Placed { places, misplaced: Misplaced::Each(self.misplaced_by_level()) })
    }

    /// The places whose stamps are these, as early as they can be; nothing where one is not written.
    fn places_as_written(&self, written_s: impl Fn(usize) -> f64) -> Option<Vec<Option<usize>>> {
        let least_s = 0.5 * self.quantum_s;
        let mut places: Vec<Option<usize>> = Vec::with_capacity(self.stamps_s.len());
        let mut next = 0;
        for (index, &stamp_s) in self.stamps_s.iter().enumerate() {
            let mut expected_s = written_s(next);
            if expected_s > stamp_s + least_s {
                // a row too many: this one, or the last before that repeats another
                next = next.checked_sub(1)?;
                if self.is_repeated[index] {
                    places.push(None);
                    continue;
                }
                self.take_out_repeated(&mut places, index.saturating_sub(2 * self.alike))?;
                expected_s = written_s(next);
            }
            let most = if index == 0 { next } else { next + MOST_SKIPPED };
            while expected_s < stamp_s - least_s && next < most {
                next += 1;
                expected_s = written_s(next);
            }
            if (expected_s - stamp_s).abs() > least_s {
                return None;
            }
            places.push(Some(next));
            next += 1;
        }
        Some(places)
    }

    /// Places by the range of stamps that rounding leaves them: residuals lie within one quantum,
    /// until a sample is lost or doubled.
    ///
    /// A loss shows when a residual leaves the range above. It is after the last residual at the lower
    /// end, which a residual after the loss does not reach, and is placed half way from there.
    fn places_by_range(&self) -> Option<Placed> {
        let tolerance_s = COARSE_QUANTUM * self.period_s;
        let most_s = self.quantum_s + tolerance_s;
        let (mut least_s, mut greatest_s) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut shift: isize = 0;
        let mut places: Vec<Option<usize>> = Vec::with_capacity(self.stamps_s.len());
        let mut misplaced = Vec::new();
        // no sample is lost up to here that is not counted
        let mut whole = 0;
        for (index, stamp_s) in self.stamps_s.iter().enumerate() {
            let mut residual_s = stamp_s - (index as f64 + shift as f64) * self.period_s;
            if residual_s < greatest_s - most_s {
                self.take_out_repeated(&mut places, 1)?;
                shift -= 1;
                residual_s += self.period_s;
            }
            let above_s = residual_s - least_s - most_s;
            let periods = (above_s / self.period_s).ceil().max(0.0);
            if periods > 0.0 {
                let from = whole + 1 + (index - whole - 1) / 2;
                for place in &mut places[from..] {
                    *place = place.map(|place| place + periods as usize);
                }
                misplaced.push(((index - whole) / 2).max(self.alike));
                shift += periods as isize;
                residual_s -= periods * self.period_s;
            }
            (least_s, greatest_s) = (residual_s.min(least_s), residual_s.max(greatest_s));
            if periods > 0.0 || residual_s <= least_s + tolerance_s {
                whole = index;
            }
            places.push(index.checked_add_signed(shift));
        }
        Some(Placed { places, misplaced: Misplaced::One(misplaced) })
    }

    /// Takes the place of the last row, of those from one on, that repeats the one before, and moves
    /// those after it up; nothing where there is none.
    fn take_out_repeated(&self, places: &mut [Option<usize>], from: usize) -> Option<()> {
        let is_placed = |&at: &usize| self.is_repeated[at] && places[at].is_some();
        let repeated = (from..places.len()).rev().find(is_placed)?;
        for place in &mut places[repeated..] {
            *place = place.map(|place| place - 1);
        }
        places[repeated] = None;
        Some(())
    }

    /// Places by the level of the residuals.
    fn places_by_level(&self) -> Option<Vec<Option<usize>>> {
        let residuals_s = &self.residuals_s;
        let count = residuals_s.len();
        let window = self.window(count);
        let mut places: Vec<Option<usize>> = Vec::with_capacity(count);
        let mut shift = 0;
        // the residuals since the last shift begin here
        let mut since = 0;
        while places.len() < count {
            let at = places.len();
            let before = &residuals_s[since.max(at.saturating_sub(window))..at];
            let ahead = &residuals_s[at..(at + window).min(count)];
            let found = if !before.is_empty() && self.is_shift(before, ahead) {
                self.shift(at, window, self.level(before))?
            } else {
                Shift { from: at, periods: 0 }
            };
            match found.periods {
                0 => places.push(at.checked_add_signed(shift)),
                1.. => {
                    places.extend((at..found.from).map(|index| index.checked_add_signed(shift)));
                    shift += found.periods;
                    since = found.from;
                    places.push(since.checked_add_signed(shift));
                }
                _ => {
                    let near = since.max(found.from.saturating_sub(window))
                        ..(found.from + window).min(count);
                    let dropped = self.repeated_near(found.from, near)?;
                    places.truncate(dropped);
                    let more = places.len()..dropped;
                    places.extend(more.map(|index| index.checked_add_signed(shift)));
                    places.push(None);
                    shift -= 1;
                    // means over the samples ahead are of both levels up to there
                    since = (dropped + 1).max(found.from);
                    let more = places.len()..since.min(count);
                    places.extend(more.map(|index| index.checked_add_signed(shift)));
                }
            }
        }
        Some(places)
    }

    /// The sample nearest to `from` within a range that repeats the one before.
    fn repeated_near(&self, from: usize, range: std::ops::Range<usize>) -> Option<usize> {
        range.filter(|&index| self.is_repeated[index]).min_by_key(|index| index.abs_diff(from))
    }

    /// Tells whether residuals are half a period off those before, and that is no chance.
    fn is_shift(&self, before: &[f64], ahead: &[f64]) -> bool {
        let step_s = (self.level(ahead) - self.level(before)).abs();
        let independent = |residuals_s: &[f64]| residuals_s.len() as f64 / self.alike as f64;
        let variance = independent(before).recip() + independent(ahead).recip();
        let chance_s = SHIFT_STDS * self.std_s * (MEDIAN_VARIANCE_RATIO * variance).sqrt();
        step_s >= (0.5 * self.period_s).max(chance_s * (1.0 - 1e-9))
    }

    /// The shift that the samples after `at` show, of 0 periods where it does not stay; `None` where
    /// none of them is after it.
    fn shift(&self, at: usize, window: usize, level_s: f64) -> Option<Shift> {
        let residuals_s = &self.residuals_s;
        let end = (at + 2 * window).min(residuals_s.len());
        let after = &residuals_s[(at + window).min(end - (window / 2).max(1)).max(at)..end];
        let periods = ((self.level(after) - level_s) / self.period_s).round();
        let shifted_s = level_s + periods * self.period_s;
        // least squares: the sum over what is before less what it would be after
        let excess =
            |residual_s: f64| (residual_s - level_s).powi(2) - (residual_s - shifted_s).powi(2);
        let (mut from, mut sum, mut least) = (at, 0.0, 0.0);
        for (index, &residual_s) in residuals_s[..end].iter().enumerate().skip(at) {
            sum += excess(residual_s);
            if sum < least {
                (least, from) = (sum, index + 1);
            }
        }
        // means over the samples ahead see a shift early
        let from = from + self.alike / 2;
        (from < residuals_s.len()).then_some(Shift { from, periods: periods as isize })
    }

    /// Level of residuals: the median, but the mean of those that rounding spreads evenly.
    fn level(&self, residuals_s: &[f64]) -> f64 {
        if self.is_coarse && self.alike == 1 {
            return residuals_s.iter().sum::<f64>() / residuals_s.len() as f64;
        }
        median(&mut residuals_s.to_vec())
    }
}

/// How programs write the time of a sample by its number.
#[derive(Clone, Copy, Debug, PartialEq)]
struct WrittenBy {
    /// `n/f`, else `n·(1/f)`.
    divides: bool,
    /// By the decimals of the number itself, as `printf` does; else by the whole number nearest to it
    /// times a power of ten, as arrays are rounded.
    prints: bool,
}

impl WrittenBy {
    const ALL: [Self; 4] = [
        Self { divides: true, prints: true },
        Self { divides: false, prints: true },
        Self { divides: true, prints: false },
        Self { divides: false, prints: false },
    ];

    /// The stamp of a sample, written to a multiple of a quantum, s.
    fn stamp_s(self, sample: usize, rate_hz: f64, quantum_s: f64) -> f64 {
        let sample = sample as f64;
        let time_s = if self.divides { sample / rate_hz } else { sample * rate_hz.recip() };
        let scale = quantum_s.recip().round();
        if self.prints {
            // the product is rounded to a tie where the number itself is beside it
            let ticks = (time_s * scale).round_ties_even();
            let beyond = |tie: f64| time_s.mul_add(scale, -tie);
            let up = f64::from(u8::from(beyond(ticks + 0.5) > 0.0));
            let down = f64::from(u8::from(beyond(ticks - 0.5) < 0.0));
            (ticks + up - down) / scale
        } else {
            (time_s * scale).round_ties_even() / scale
        }
    }
}

/// Samples with their places.
pub(crate) struct Placed {
    /// Places of the samples in the order of time; `None` for one that only repeats the one before.
    pub(crate) places: Vec<Option<usize>>,
    pub(crate) misplaced: Misplaced,
}

/// Samples by which the places of losses may be off, where stamps are coarser than samples.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Misplaced {
    /// Every loss by as many.
    Each(usize),
    /// One after the other.
    One(Vec<usize>),
}

impl Misplaced {
    /// Samples by which one loss may be off, by its number from 0.
    pub(crate) fn of(&self, loss: usize) -> usize {
        match self {
            Self::Each(samples) => *samples,
            Self::One(samples) => samples.get(loss).copied().unwrap_or(0),
        }
    }
}

/// Most samples of a span of coarse stamps, of which most are to have no long gap.
fn most_span(steps_s: &[f64], quantum_s: f64, counted_s: f64) -> usize {
    let longest = (LONG_STEP * counted_s / quantum_s).ceil();
    let whole =
        steps_s.split(|step_s| *step_s > (longest + 0.5) * quantum_s).map(<[f64]>::len).max();
    whole.filter(|&whole| whole < steps_s.len()).map_or(usize::MAX, |whole| whole / 3)
}

/// Tells whether long steps are not as evenly apart as those of a slower clock.
fn are_by_chance(places: &[usize]) -> bool {
    let long = places.windows(2).enumerate().filter(|(_, pair)| pair[1] > pair[0] + 1);
    let long: Vec<usize> = long.map(|(index, _)| index).collect();
    let apart = || long.windows(2).map(|pair| pair[1] - pair[0]);
    let (least, most) = (apart().min().unwrap_or(0), apart().max().unwrap_or(0));
    long.len() >= LEAST_LOSSES && most > least + 2
}

/// A shift of the level of residuals by whole periods.
struct Shift {
    /// The first sample after it.
    from: usize,
    /// Above zero where samples are lost.
    periods: isize,
}

/// Means over so many numbers ahead; at the end over the last ones.
fn moving_means(numbers: &[f64], count: usize) -> Vec<f64> {
    let mean = |all: &[f64]| all.iter().sum::<f64>() / count as f64;
    let last = numbers.len() - count;
    (0..numbers.len()).map(|index| mean(&numbers[index.min(last)..][..count])).collect()
}

/// Standard deviation of numbers whose level may shift: the median over blocks.
fn std_in_blocks(numbers: &[f64], block: usize) -> f64 {
    let of_block = |all: &[f64]| {
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        (all.iter().map(|one| (one - mean).powi(2)).sum::<f64>() / all.len() as f64).sqrt()
    };
    median(&mut numbers.chunks_exact(block).map(of_block).collect::<Vec<_>>())
}
