//! The clock behind the stamps of a channel: a robust line, and the place of each sample on it.

use core::f64::consts::TAU;

use crate::places::{Misplaced, Placed, RoughClock};

/// Fewest samples that tell a clock from steps of chance, whose sum strays.
const LEAST_SAMPLES: usize = 100;
/// Share of a period that stamps may be off the clock, root mean square, for it to be one.
const MOST_JITTER: f64 = 0.4;
/// Share of a period below which the stamps of even samples may be off their clock.
const EVEN_WITHIN: f64 = 1e-3;
/// Share of the places of a clock that may lack their sample.
const MOST_LOST_SHARE: f64 = 0.5;
/// Rows by which a sample may be late where others follow one another.
const MOST_LATE_ROWS: usize = 64;
/// Share of the samples that may be late by so much.
const MOST_DISORDER_SHARE: f64 = 0.1;
/// Places by which the first count of lost samples may be off.
const MOST_MISCOUNTED: f64 = 3.0;
/// Standard errors that the rate of a clock may be off a round number.
const RATE_STD_ERRORS: f64 = 3.0;

/// Even clock that stamps were written by, and the place of each sample on it.
///
/// ```text
/// s_i = t_0 + p·n_i + e_i
/// ```
///
/// with stamps `s_i`, the period `p`, whole numbers `n_i` (places) that increase, and errors `e_i`
/// from rounding and jitter. A lost sample is a place that no `n_i` has.
///
/// # Method
///
/// The period is the mean step over 64 samples where no sample lacks. Where each step is near a
/// whole number of periods, that number is the step of `n_i`. Else `n_i − i` is constant between
/// losses: it rises by `c` where the mean or median of the next `w` residuals `s_i − i·p` is at least
/// half a period above those before, and falls at a doubled sample. `w` is the least number for which
/// half a period is six standard deviations of that difference. Then `t_0` and `p` are the least
/// squares of all stamps on their places.
///
/// # Valid for
///
/// Stamps with errors of up to 0.4 periods, root mean square, rounded to any number of decimals.
/// Where they are rounded to a period or more, a lost sample and a slower clock write the same
/// stamps; a round rate with losses is preferred.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Clock {
    /// Time of place 0, s.
    pub(crate) start_s: f64,
    /// Places per second.
    pub(crate) rate_hz: f64,
    /// Samples in the order of time, as indices of the stamps, without doubled ones.
    pub(crate) kept: Vec<usize>,
    /// Place of each kept sample, from 0.
    pub(crate) places: Vec<usize>,
    /// Samples whose stamp another has too, as indices of the stamps: the one that is kept and the
    /// one that is not.
    pub(crate) doubled: Vec<(usize, usize)>,
    /// Samples that stand after one of a later time.
    pub(crate) late: usize,
    /// Samples by which the place of a loss may be off, where stamps are coarser than samples.
    pub(crate) misplaced: Misplaced,
    /// Root mean square distance of the stamps from the clock, s.
    pub(crate) error_s: f64,
    /// True where the stamps are farther off the clock than rounding explains.
    pub(crate) is_jittered: bool,
}

impl Clock {
    /// The clock of stamps that are written to a multiple of `quantum_s`, in the order of the file;
    /// `None` where they show none.
    pub(crate) fn of(stamps_s: &[f64], quantum_s: f64) -> Option<Self> {
        Self::of_rows(stamps_s, quantum_s, &[])
    }

    /// As [`of`](Self::of), with the rows, in their order, that repeat the one before to the last
    /// cell: stamps that are coarser than the samples do not tell them.
    pub(crate) fn of_rows(stamps_s: &[f64], quantum_s: f64, repeated: &[usize]) -> Option<Self> {
        if stamps_s.len() < LEAST_SAMPLES {
            return None;
        }
        let mut order = Order::of(stamps_s, quantum_s)?;
        let sorted: Vec<f64> = order.kept.iter().map(|&index| stamps_s[index]).collect();
        let is_repeated: Vec<bool> =
            order.kept.iter().map(|index| repeated.binary_search(index).is_ok()).collect();
        let rough = RoughClock::of(&sorted, &is_repeated, quantum_s)?;
        let Placed { places, misplaced } = rough.places()?;
        let (places, sorted) = order.keep_placed(&places, &sorted);
        let line = Line::of(&places, &sorted);
        let is_fine = quantum_s < 0.5 * line.step_s_per_place;
        let (places, line) = match is_fine.then(|| line.replaced(&sorted)).flatten() {
            Some(nearest) => nearest,
            None => (places, line),
        };
        let period_s = line.step_s_per_place;
        let last = *places.last()?;
        let is_understood = period_s > 0.0
            && line.error_s <= MOST_JITTER * period_s + quantum_s
            && (last + 1 - places.len()) as f64 <= MOST_LOST_SHARE * (last + 1) as f64;
        if !is_understood {
            return None;
        }
        let std_error_s = line.error_s * (12.0 / (places.len() as f64).powi(3)).sqrt();
        let tolerance_s =
            RATE_STD_ERRORS * std_error_s + rounding_s(quantum_s, &sorted) / last as f64;
        let rate_hz = roundest(period_s.recip(), tolerance_s / (period_s * period_s));
        let most_s = rounding_s(quantum_s, &sorted) + EVEN_WITHIN * period_s;
        let is_jittered = quantum_s < 0.5 * period_s && line.most_s > most_s;
        let Order { kept, doubled, late } = order;
        // rounding moves the first stamp by up to half its quantum
        let start_s =
            if (line.start_s - sorted[0]).abs() <= most_s { sorted[0] } else { line.start_s };
        let error_s = line.error_s;
        Some(Self {
            start_s,
            rate_hz,
            kept,
            places,
            doubled,
            late,
            misplaced,
            error_s,
            is_jittered,
        })
    }

    /// Places that lack their sample.
    pub(crate) fn lost(&self) -> usize {
        self.places.last().map_or(0, |last| last + 1 - self.places.len())
    }

    /// Tells whether the samples stand in the order of time, none twice.
    pub(crate) fn is_in_order(&self) -> bool {
        self.late == 0 && self.doubled.is_empty()
    }

    /// The first sample that stands after a later one, or is another's double, as an index of the
    /// stamps.
    pub(crate) fn first_out_of_order(&self, stamps_s: &[f64]) -> Option<usize> {
        let late = stamps_s.windows(2).position(|pair| pair[1] < pair[0]).map(|before| before + 1);
        let doubled = self.doubled.iter().map(|&(_, double)| double);
        doubled.chain(late).min()
    }

    /// The first sample after which places are empty, as an index of the stamps, and how many.
    pub(crate) fn first_gap(&self) -> Option<(usize, usize)> {
        let at = self.places.windows(2).position(|pair| pair[1] > pair[0] + 1)?;
        Some((self.kept[at], self.places[at + 1] - self.places[at] - 1))
    }
}

/// Distance of two stamps that rounding alone explains, s.
fn rounding_s(quantum_s: f64, sorted: &[f64]) -> f64 {
    let (first_s, last_s) = (sorted[0], sorted[sorted.len() - 1]);
    // sums of steps are off by as much a step, with one sign
    let summed_s = f64::EPSILON * (last_s - first_s) * sorted.len() as f64;
    quantum_s + 4.0 * f64::EPSILON * first_s.abs().max(last_s.abs()) + summed_s
}

/// The samples in the order of their stamps.
struct Order {
    kept: Vec<usize>,
    doubled: Vec<(usize, usize)>,
    late: usize,
}

impl Order {
    fn of(stamps_s: &[f64], quantum_s: f64) -> Option<Self> {
        let count = stamps_s.len();
        let is_reversed = stamps_s.windows(2).all(|pair| pair[1] <= pair[0]);
        let mut order: Vec<usize> = (0..count).collect();
        if is_reversed {
            order.reverse();
        }
        order.sort_by(|&a, &b| stamps_s[a].total_cmp(&stamps_s[b]));
        let mut latest_s = f64::NEG_INFINITY;
        let late = stamps_s.iter().filter(|stamp_s| {
            latest_s = latest_s.max(**stamp_s);
            **stamp_s < latest_s
        });
        let late = late.count();
        let is_near =
            order.iter().enumerate().all(|(row, &from)| row.abs_diff(from) <= MOST_LATE_ROWS)
                && late as f64 <= MOST_DISORDER_SHARE * count as f64;
        let span_s = stamps_s[order[count - 1]] - stamps_s[order[0]];
        // stamps that are coarser than the samples are equal without being doubled
        let is_coarse = quantum_s >= 0.5 * span_s / (count - 1) as f64;
        let are_apart = order.windows(2).all(|pair| stamps_s[pair[0]] < stamps_s[pair[1]]);
        let is_told =
            is_near || is_reversed || (are_apart || !is_coarse) && !has_long_runs_mixed(&order);
        let mut doubled = Vec::new();
        let mut kept: Vec<usize> = Vec::with_capacity(count);
        for index in order {
            match kept.last() {
                Some(&before) if !is_coarse && stamps_s[before] == stamps_s[index] => {
                    doubled.push((before, index));
                }
                _ => kept.push(index),
            }
        }
        (is_told && kept.len() >= LEAST_SAMPLES).then_some(Self { kept, doubled, late })
    }

    /// Drops the samples without a place; places and stamps of the others.
    fn keep_placed(&mut self, places: &[Option<usize>], sorted: &[f64]) -> (Vec<usize>, Vec<f64>) {
        let mut kept = Vec::with_capacity(self.kept.len());
        let (mut own_places, mut own_stamps_s) = (Vec::new(), Vec::new());
        for ((&index, place), &stamp_s) in self.kept.iter().zip(places).zip(sorted) {
            if let Some(place) = place {
                kept.push(index);
                own_places.push(*place);
                own_stamps_s.push(stamp_s);
            } else if let Some(&before) = kept.last() {
                self.doubled.push((before, index));
            }
        }
        self.doubled.sort_unstable();
        self.kept = kept;
        (own_places, own_stamps_s)
    }
}

/// Tells whether rows that follow one another in the file, more of them than may be late, have others
/// between them in the order of time: those of another recording.
fn has_long_runs_mixed(order: &[usize]) -> bool {
    let mut row_of = vec![0; order.len()];
    for (row, &index) in order.iter().enumerate() {
        row_of[index] = row;
    }
    let mut runs = row_of.chunk_by(|before, after| before < after);
    let is_mixed = |run: &[usize]| run[run.len() - 1] - run[0] >= run.len();
    runs.any(|run| run.len() > MOST_LATE_ROWS && is_mixed(run))
}

/// Least squares of stamps on their places.
struct Line {
    /// Time of place 0, s.
    start_s: f64,
    step_s_per_place: f64,
    /// Root mean square distance from the line, s.
    error_s: f64,
    /// Largest distance from the line, s.
    most_s: f64,
}

impl Line {
    fn of(places: &[usize], stamps_s: &[f64]) -> Self {
        let count = places.len() as f64;
        let middle = places.iter().map(|&place| place as f64).sum::<f64>() / count;
        let first_s = stamps_s[0];
        let middle_s = stamps_s.iter().map(|stamp_s| stamp_s - first_s).sum::<f64>() / count;
        let (mut products, mut squares) = (0.0, 0.0);
        for (&place, stamp_s) in places.iter().zip(stamps_s) {
            let off = place as f64 - middle;
            products += off * (stamp_s - first_s - middle_s);
            squares += off * off;
        }
        let step_s_per_place = products / squares;
        let start_s = first_s + middle_s - step_s_per_place * middle;
        let distance = |(&place, stamp_s): (&usize, &f64)| {
            (stamp_s - start_s - place as f64 * step_s_per_place).abs()
        };
        let distances = || places.iter().zip(stamps_s).map(distance);
        let error_s = (distances().map(|off_s| off_s * off_s).sum::<f64>() / count).sqrt();
        Self { start_s, step_s_per_place, error_s, most_s: distances().fold(0.0, f64::max) }
    }

    /// Nearest places on an even clock of the line's period, or of the round one to which a few
    /// places too many or too few would lead, with the line through them: losses that are near one
    /// another confuse the level of the residuals. Nothing where neither is nearer to the stamps than
    /// this line.
    fn replaced(&self, stamps_s: &[f64]) -> Option<(Vec<usize>, Self)> {
        let (own_hz, span_s) =
            (self.step_s_per_place.recip(), stamps_s[stamps_s.len() - 1] - stamps_s[0]);
        let round_hz = roundest(own_hz, MOST_MISCOUNTED / span_s);
        let on_clocks = [own_hz, round_hz].into_iter().filter_map(|rate_hz| {
            let places = nearest_places(stamps_s, rate_hz)?;
            let line = Self::of(&places, stamps_s);
            Some((places, line))
        });
        let nearest = on_clocks.min_by(|a, b| a.1.error_s.total_cmp(&b.1.error_s))?;
        (nearest.1.error_s < self.error_s).then_some(nearest)
    }
}

/// The places of stamps on a clock of a rate, whose phase is the mean of theirs; nothing where two
/// have one place.
fn nearest_places(stamps_s: &[f64], rate_hz: f64) -> Option<Vec<usize>> {
    let turns = |stamp_s: &f64| (stamp_s - stamps_s[0]) * rate_hz;
    let (sin, cos) = stamps_s
        .iter()
        .map(|stamp_s| (TAU * turns(stamp_s)).sin_cos())
        .fold((0.0, 0.0), |(sin_sum, cos_sum), (sin, cos)| (sin_sum + sin, cos_sum + cos));
    let phase = sin.atan2(cos) / TAU;
    let places: Vec<f64> =
        stamps_s.iter().map(|stamp_s| (turns(stamp_s) - phase).round()).collect();
    let increase = places.windows(2).all(|pair| pair[1] > pair[0]);
    increase.then(|| places.iter().map(|place| (place - places[0]) as usize).collect())
}

/// Median; of an even number the upper of the two in the middle.
pub(super) fn median(numbers: &mut [f64]) -> f64 {
    let middle = numbers.len() / 2;
    *numbers.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The number with the fewest significant digits within `tolerance` of `value`.
pub(super) fn roundest(value: f64, tolerance: f64) -> f64 {
    let rounded = |digits: usize| format!("{value:.digits$e}").parse::<f64>();
    let close = |candidate: &f64| (candidate - value).abs() <= tolerance;
    (0..17).filter_map(|digits| rounded(digits).ok()).find(close).unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 10_000.0;

    fn rounded(time_s: f64, decimals: i32) -> f64 {
        let scale = 10f64.powi(decimals);
        (time_s * scale).round() / scale
    }

    /// Stamps at 10 kHz without the samples of these places, rounded.
    fn stamps(count: usize, without: &[usize], decimals: i32) -> Vec<f64> {
        let places = (0..count).filter(|place| !without.contains(place));
        places.map(|place| rounded(place as f64 / RATE_HZ, decimals)).collect()
    }

    /// A number in ±1 that looks like chance.
    fn scatter(index: usize) -> f64 {
        2.0 * ((index as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0) - 1.0
    }

    #[test]
    fn a_lost_sample_is_found_whatever_the_decimals() {
        for decimals in 4..=9 {
            for lost in [3, 700, 2500, 4990] {
                let stamps = stamps(5000, &[lost], decimals);
                let clock = Clock::of(&stamps, 10f64.powi(-decimals)).unwrap();
                assert_eq!((clock.lost(), clock.rate_hz), (1, RATE_HZ), "{decimals} {lost}");
                let place = clock.first_gap().unwrap().0 + 1;
                assert!(place.abs_diff(lost) <= 2, "{decimals}: {place} for {lost}");
            }
        }
    }

    #[test]
    fn three_decimals_show_a_lost_sample_and_refuse_no_clean_clock() {
        let clean = Clock::of(&stamps(5000, &[], 3), 1e-3).unwrap();
        assert_eq!((clean.lost(), clean.rate_hz, clean.is_jittered), (0, RATE_HZ, false));
        for lost in [103, 1858, 2500, 4573, 4900] {
            let clock = Clock::of(&stamps(5000, &[lost], 3), 1e-3).unwrap();
            assert_eq!((clock.lost(), clock.rate_hz), (1, RATE_HZ), "{lost}");
            let place = clock.first_gap().unwrap().0 + 1;
            assert!(place.abs_diff(lost) <= 10, "{place} for {lost}");
        }
    }

    #[test]
    fn jitter_hides_no_lost_sample_and_is_none() {
        for size in [0.0005, 0.01, 0.1, 0.3] {
            let off_s = |(index, time_s): (usize, f64)| time_s + size / RATE_HZ * scatter(index);
            let off = |without: &[usize]| -> Vec<f64> {
                stamps(5000, without, 9).into_iter().enumerate().map(off_s).collect()
            };
            let clean = Clock::of(&off(&[]), 1e-12).unwrap();
            assert_eq!((clean.lost(), clean.is_jittered), (0, size > 0.001), "{size}");
            let lost = Clock::of(&off(&[1000, 3000, 3001]), 1e-12).unwrap();
            assert_eq!(lost.lost(), 3, "{size}");
        }
    }

    /// Normal jitter of 0.3 samples: of 20 recordings with 3 samples lost, none is read otherwise.
    #[test]
    fn normal_jitter_hides_no_lost_sample() {
        let normal = |seed: usize| (0..12).map(|k| 0.5 * scatter(seed * 12 + k)).sum::<f64>();
        for case in 0..20 {
            let lost = [200 + 100 * case, 2500 + 7 * case, 4900];
            let off_s = |(index, time_s): (usize, f64)| {
                time_s + 0.3 / RATE_HZ * normal(index + 5000 * case)
            };
            let off: Vec<f64> = stamps(5000, &lost, 9).into_iter().enumerate().map(off_s).collect();
            let clock = Clock::of(&off, 1e-12).unwrap();
            assert_eq!(clock.lost(), 3, "{case}");
        }
    }

    #[test]
    fn sums_of_steps_are_no_jitter() {
        let mut time_s = 0.0;
        let sums: Vec<f64> = (0..5000)
            .map(|_| {
                time_s += 1e-4;
                time_s
            })
            .collect();
        let clock = Clock::of(&sums, 1e-12).unwrap();
        assert_eq!((clock.lost(), clock.rate_hz, clock.is_jittered), (0, RATE_HZ, false));
    }

    #[test]
    fn another_rate_is_no_loss() {
        for rate_hz in [10_001.0, 9999.0, 4800.0] {
            let stamps: Vec<f64> = (0..5000).map(|i| rounded(f64::from(i) / rate_hz, 6)).collect();
            let clock = Clock::of(&stamps, 1e-6).unwrap();
            assert_eq!((clock.lost(), clock.rate_hz), (0, rate_hz));
        }
    }

    #[test]
    fn swapped_and_doubled_samples_are_put_in_order() {
        let mut mixed = stamps(1000, &[], 6);
        mixed.swap(400, 401);
        mixed.insert(700, mixed[699]);
        let clock = Clock::of(&mixed, 1e-6).unwrap();
        assert_eq!((clock.late, clock.doubled.as_slice()), (1, &[(699, 700)][..]));
        assert_eq!((clock.kept[400], clock.kept[401], clock.lost()), (401, 400, 0));
    }

    /// Of 20 recordings with 1 % of the samples lost by chance, each loss is found.
    #[test]
    fn many_lost_samples_are_found() {
        for case in 0..20 {
            let lost: Vec<usize> = (1..51)
                .map(|k| 100 * k - 50 + (45.0 * scatter(k + 100 * case)) as usize)
                .chain([2000 + case, 2001 + case, 2003 + case])
                .collect();
            let stamps = stamps(5000, &lost, 6);
            let clock = Clock::of(&stamps, 1e-6).unwrap();
            assert_eq!((clock.lost(), clock.rate_hz), (5000 - stamps.len(), RATE_HZ), "{case}");
            assert!(!clock.is_jittered, "{case}");
        }
    }

    #[test]
    fn many_lost_samples_are_found_where_stamps_are_as_coarse_as_samples() {
        let lost: Vec<usize> = (1..25).map(|k| 200 * k + (95.0 * scatter(k)) as usize).collect();
        let stamps = stamps(5000, &lost, 4);
        let clock = Clock::of(&stamps, 1e-4).unwrap();
        assert_eq!((clock.lost(), clock.rate_hz), (24, RATE_HZ));
        // the long steps of a slower clock are evenly apart
        let slower: Vec<f64> = (0..5000).map(|i| rounded(f64::from(i) / 9600.0, 4)).collect();
        let clock = Clock::of(&slower, 1e-4).unwrap();
        assert_eq!((clock.lost(), clock.rate_hz), (0, 9600.0));
    }

    #[test]
    fn a_repeated_row_is_found_where_stamps_are_coarse() {
        for (decimals, within) in [(4, 0), (3, 10)] {
            for at in [103, 1858, 4900] {
                let mut twice = stamps(5000, &[], decimals);
                twice.insert(at, twice[at - 1]);
                let quantum_s = 10f64.powi(-decimals);
                let clock = Clock::of_rows(&twice, quantum_s, &[at]).unwrap();
                assert_eq!((clock.lost(), clock.rate_hz), (0, RATE_HZ), "{decimals} {at}");
                assert_eq!(clock.doubled, [(at - 1, at)], "{decimals}");
                // a row that only looks like the one before is no doubled sample
                let clean = stamps(5000, &[], decimals);
                let clock = Clock::of_rows(&clean, quantum_s, &[at, at + within]).unwrap();
                assert_eq!((clock.doubled.len(), clock.lost()), (0, 0), "{decimals}");
            }
        }
    }

    #[test]
    fn repeated_rows_near_one_another_are_found() {
        let mut twice = stamps(5000, &[], 4);
        let rows = [638, 1421, 1426, 4948];
        for at in rows {
            twice.insert(at, twice[at - 1]);
        }
        let clock = Clock::of_rows(&twice, 1e-4, &rows).unwrap();
        assert_eq!((clock.lost(), clock.rate_hz), (0, RATE_HZ));
        assert_eq!(clock.doubled, rows.map(|at| (at - 1, at)));
    }

    /// Two losses with two samples between, at a jitter whose steps stray by half a sample.
    #[test]
    fn jitter_hides_no_losses_near_one_another() {
        for case in 0..10 {
            let lost = [40 + case, 43 + case, 2100, 3500, 3503];
            let off_s = |(index, time_s): (usize, f64)| {
                time_s + 0.28 / RATE_HZ * scatter(index + 5000 * case)
            };
            let off: Vec<f64> = stamps(5000, &lost, 9).into_iter().enumerate().map(off_s).collect();
            let clock = Clock::of(&off, 1e-12).unwrap();
            assert_eq!((clock.lost(), clock.rate_hz), (5, RATE_HZ), "{case}");
            let empty: Vec<usize> = (0..5000).filter(|n| !clock.places.contains(n)).collect();
            assert_eq!(empty, lost, "{case}");
        }
    }

    /// Each of 16 lost samples is found to ten, in 20 recordings that begin anywhere, whatever way their
    /// times are made.
    #[test]
    fn losses_are_found_where_stamps_are_coarser_than_samples() {
        let printed = |time_s: f64| format!("{time_s:.3}").parse().unwrap();
        let ways: [&dyn Fn(usize) -> f64; 4] = [
            &|n| printed(n as f64 / RATE_HZ),
            &|n| printed(n as f64 * 1e-4),
            &|n| (n as f64 / RATE_HZ * 1e3).round_ties_even() / 1e3,
            &|n| (n as f64 * 1e-4 * 1e3).round_ties_even() / 1e3,
        ];
        for case in 0..20 {
            let lost: Vec<usize> = (0..16)
                .map(|k| 300 * k + 100 + (99.0 * scatter(k + 100 * case)) as usize)
                .collect();
            let first = 137 * case;
            for way in ways {
                let kept = (0..5000).filter(|place| !lost.contains(place));
                let stamps: Vec<f64> = kept.map(|place| way(first + place)).collect();
                let clock = Clock::of(&stamps, 1e-3).unwrap();
                assert_eq!((clock.lost(), clock.rate_hz), (16, RATE_HZ), "{case}");
                let empty: Vec<usize> = (0..5000).filter(|n| !clock.places.contains(n)).collect();
                for (found, lost) in empty.iter().zip(&lost) {
                    assert!(found.abs_diff(*lost) <= 10, "{case}: {found} {lost}");
                }
            }
        }
    }

    #[test]
    fn sums_of_steps_that_lack_a_sample_have_a_round_rate() {
        let mut time_s = 1.0;
        let mut sums: Vec<f64> = (0..5000)
            .map(|_| {
                time_s += 1e-4;
                time_s
            })
            .collect();
        sums.remove(2222);
        let clock = Clock::of(&sums, 1e-12).unwrap();
        assert_eq!((clock.lost(), clock.rate_hz, clock.is_jittered), (1, RATE_HZ, false));
    }

    #[test]
    fn a_long_gap_is_seen_where_stamps_are_coarse() {
        for lost in [20, 50, 500] {
            for first in [500, 2000, 4000] {
                let places: Vec<usize> = (first..first + lost).collect();
                let clock = Clock::of(&stamps(5000, &places, 3), 1e-3).unwrap();
                assert_eq!((clock.lost(), clock.rate_hz), (lost, RATE_HZ), "{first}");
            }
        }
    }

    #[test]
    fn reversed_and_scattered_rows_are_put_in_order() {
        let in_order = stamps(1000, &[500], 6);
        let reversed: Vec<f64> = in_order.iter().rev().copied().collect();
        let clock = Clock::of(&reversed, 1e-6).unwrap();
        assert_eq!((clock.lost(), clock.late, clock.kept[0]), (1, 998, 998));
        // rows whose time is that of others are told by their place
        let coarse: Vec<f64> = stamps(5000, &[], 3).into_iter().rev().collect();
        let clock = Clock::of(&coarse, 1e-3).unwrap();
        assert_eq!((clock.lost(), clock.rate_hz), (0, RATE_HZ));
        assert!(clock.kept.windows(2).all(|pair| pair[1] + 1 == pair[0]));
        let mut scattered: Vec<usize> = (0..999).collect();
        scattered.sort_by(|&a, &b| scatter(a).total_cmp(&scatter(b)));
        let stamps_s: Vec<f64> = scattered.iter().map(|&row| in_order[row]).collect();
        let clock = Clock::of(&stamps_s, 1e-6).unwrap();
        assert_eq!(clock.lost(), 1);
        assert!((0..999).all(|row| scattered[clock.kept[row]] == row));
        // parts of a recording in another order
        let parts = [&in_order[600..], &in_order[..600]].concat();
        assert_eq!(Clock::of(&parts, 1e-6).unwrap().kept[..2], [399, 400]);
    }

    /// Times of one between those of the other are no reason to take both for one recording.
    #[test]
    fn recordings_under_one_another_are_not_put_in_one_order() {
        let one = stamps(1000, &[], 6);
        for off_s in [0.0, 3e-5, 5e-5] {
            let other = one.iter().map(|time_s| time_s + off_s);
            let both: Vec<f64> = one.iter().copied().chain(other).collect();
            assert_eq!(Clock::of(&both, 1e-6), None, "{off_s}");
        }
    }

    #[test]
    fn rows_that_all_stand_twice_are_dropped() {
        let twice: Vec<f64> =
            stamps(1000, &[], 6).into_iter().flat_map(|time_s| [time_s; 2]).collect();
        let rows: Vec<usize> = (0..1000).map(|row| 2 * row + 1).collect();
        for quantum_s in [1e-6, 1e-4] {
            let clock = Clock::of_rows(&twice, quantum_s, &rows).unwrap();
            assert_eq!((clock.doubled.len(), clock.lost(), clock.rate_hz), (1000, 0, RATE_HZ));
        }
    }

    #[test]
    fn what_is_no_clock_is_none() {
        let wild: Vec<f64> = (0..1000).map(|i| f64::from(i) + 3.0 * scatter(i as usize)).collect();
        assert_eq!(Clock::of(&wild, 0.0), None);
        let again: Vec<f64> = [stamps(500, &[], 6), stamps(500, &[], 6)].concat();
        assert_eq!(Clock::of(&again, 1e-6), None);
        assert_eq!(Clock::of(&[0.0; 100], 1e-6), None);
    }
}
