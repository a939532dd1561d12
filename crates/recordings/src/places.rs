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
        let span = ((SPAN_SAMPLES as f64 * coarseness) as usize).clamp(1, intervals.div_ceil(2));
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

    /// Samples by which the place of a loss may be off: as many as have one stamp, and three times as
    /// many where ties that are rounded either way show it late.
    pub(crate) fn misplaced(&self) -> usize {
        match self.alike {
            1 => 0,
            alike if self.is_settled() => alike,
            alike => 3 * alike,
        }
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

    /// The places of samples in the order of time, `None` for those that only repeat the one before;
    /// nothing where a shift is backwards.
    pub(crate) fn places(&self) -> Option<Vec<Option<usize>>> {
        if let Some(places) = self.places_by_steps() {
            return Some(places.into_iter().map(Some).collect());
        }
        if !self.is_coarse {
            return self.places_by_level();
        }
        let by_level = self.is_settled().then(|| self.places_by_level());
        by_level.flatten().or_else(|| self.places_by_range())
    }

    /// Places by single steps, where each is near a whole number of periods. Coarse stamps show it
    /// where their quantum is a whole number of times in the period, the shortest step.
    fn places_by_steps(&self) -> Option<Vec<usize>> {
        let steps_s = || self.stamps_s.windows(2).map(|pair| pair[1] - pair[0]);
        let (period_s, within) = if self.is_coarse {
            (steps_s().fold(f64::INFINITY, f64::min), EXACT_WITHIN)
        } else {
            (self.period_s, WHOLE_WITHIN)
        };
        if period_s <= 0.0 {
            return None;
        }
        let mut places = vec![0];
        let mut place = 0;
        for step_s in steps_s() {
            let periods = (step_s / period_s).round();
            if periods < 1.0 || (step_s / period_s - periods).abs() > within {
                return None;
            }
            place += periods as usize;
            places.push(place);
        }
        (!self.is_coarse || are_by_chance(&places)).then_some(places)
    }

    /// Places by the range of stamps that rounding leaves them: residuals lie within one quantum,
    /// until a sample is lost or doubled.
    fn places_by_range(&self) -> Option<Vec<Option<usize>>> {
        let most_s = self.quantum_s + COARSE_QUANTUM * self.period_s;
        let (mut least_s, mut greatest_s) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut shift: isize = 0;
        let mut places: Vec<Option<usize>> = Vec::with_capacity(self.stamps_s.len());
        for (index, stamp_s) in self.stamps_s.iter().enumerate() {
            let mut residual_s = stamp_s - (index as f64 + shift as f64) * self.period_s;
            if residual_s < greatest_s - most_s {
                let is_doubled =
                    |&before: &usize| self.is_repeated[before] && places[before].is_some();
                let doubled = (1..index).rev().find(is_doubled)?;
                shift -= 1;
                for place in &mut places[doubled..] {
                    *place = place.map(|place| place - 1);
                }
                places[doubled] = None;
                residual_s += self.period_s;
            }
            let above_s = residual_s - least_s - most_s;
            let periods = (above_s / self.period_s).ceil().max(0.0);
            shift += periods as isize;
            residual_s -= periods * self.period_s;
            (least_s, greatest_s) = (residual_s.min(least_s), residual_s.max(greatest_s));
            places.push(index.checked_add_signed(shift));
        }
        Some(places)
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
