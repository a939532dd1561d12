//! Hum at the frequency of the mains: it is no machine's, and has a phase of its own in each
//! recording.

use core::{f64::consts::TAU, ops::Range};

use crate::gram::dot;

/// Frequencies of the mains with their first overtones, Hz.
const LINES_HZ: [f64; 6] = [50.0, 60.0, 100.0, 120.0, 150.0, 180.0];
/// Longest stretch over which the phase of a line goes straight on, s: a grid is off its frequency
/// by some hundredths of a hertz.
const STRETCH_S: f64 = 3.0;
/// Shortest recording in which they are lines, s: in less, much else is near them.
const SHORTEST_S: f64 = 1.0;
/// Share of a line that an average has to leave for it to be looked for.
const LEAST_LEFT: f64 = 0.3;
/// Share of the compared rate below which a line that looks like a lower frequency there is left
/// alone: the rate is eight bandwidths of the control, and below one of them the machine moves.
const LEAST_ALIAS: f64 = 0.125;
/// Mean square of a sine below which the others make it up.
const LEAST_SQUARE: f64 = 1e-6;

/// The sines of the lines in stretches of a recording, orthonormal, without mean and slope: signals
/// are projected off them.
#[derive(Clone, Debug)]
pub(crate) struct Mains {
    sines: Vec<(Range<usize>, Vec<f64>)>,
}

impl Mains {
    /// For a signal of so many samples, each the average of `factor` at a rate.
    pub(crate) fn new(rate_hz: f64, factor: usize, samples: usize) -> Self {
        let mut mains = Self { sines: Vec::new() };
        let sample_s = factor as f64 / rate_hz;
        let duration_s = samples as f64 * sample_s;
        if duration_s <= SHORTEST_S {
            return mains;
        }
        let stretches = libm::ceil(duration_s / STRETCH_S) as usize;
        let shows = |hz: &f64| {
            left(*hz / rate_hz, factor) >= LEAST_LEFT && is_apart(*hz, rate_hz / factor as f64)
        };
        for stretch in 0..stretches {
            let range = stretch * samples / stretches..(stretch + 1) * samples / stretches;
            let course = Course::of(range.len());
            for hz in LINES_HZ.into_iter().filter(shows) {
                for (phase_turns, grows) in [(0.0, false), (0.25, false), (0.0, true), (0.25, true)]
                {
                    let at = |n: usize| {
                        let sine = libm::sin(TAU * (hz * n as f64 * sample_s + phase_turns));
                        if grows { sine * course.ramp(n) } else { sine }
                    };
                    let mut sine: Vec<f64> = (0..range.len()).map(at).collect();
                    // twice: once leaves what rounding brings back
                    for _ in 0..2 {
                        course.take_off(&mut sine);
                        mains.take_off_stretch(&range, &mut sine);
                    }
                    let square = dot(&sine, &sine);
                    if square > LEAST_SQUARE * sine.len() as f64 {
                        let size = libm::sqrt(square);
                        let sine = sine.iter().map(|x| x / size).collect();
                        mains.sines.push((range.clone(), sine));
                    }
                }
            }
        }
        mains
    }

    /// Takes the lines of one stretch off a signal of its length.
    fn take_off_stretch(&self, of: &Range<usize>, stretch: &mut [f64]) {
        for (_, sine) in self.sines.iter().filter(|(range, _)| range == of) {
            let part = dot(sine, stretch);
            for (value, s) in stretch.iter_mut().zip(sine) {
                *value -= part * s;
            }
        }
    }

    /// Takes what a signal has of the lines off it.
    pub(crate) fn take_off(&self, signal: &mut [f64]) {
        for (range, sine) in &self.sines {
            let Some(stretch) = signal.get_mut(range.clone()) else { continue };
            let part = dot(sine, stretch);
            for (value, s) in stretch.iter_mut().zip(sine) {
                *value -= part * s;
            }
        }
    }
}

/// Mean and slope over a stretch: a machine's, and no line's.
struct Course {
    middle: f64,
    /// Sum of the squares of the ramp.
    square: f64,
}

impl Course {
    fn of(samples: usize) -> Self {
        let middle = (0.5 * (samples as f64 - 1.0)).max(0.5);
        let mut course = Self { middle, square: 0.0 };
        course.square = (0..samples).map(|n| course.ramp(n) * course.ramp(n)).sum();
        course
    }

    /// From −1 to 1 over the stretch.
    fn ramp(&self, n: usize) -> f64 {
        (n as f64 - self.middle) / self.middle
    }

    fn take_off(&self, signal: &mut [f64]) {
        let mean = signal.iter().sum::<f64>() / signal.len().max(1) as f64;
        let along = signal.iter().enumerate().map(|(n, x)| x * self.ramp(n)).sum::<f64>();
        let slope = along / self.square.max(f64::MIN_POSITIVE);
        for (n, value) in signal.iter_mut().enumerate() {
            *value -= mean + slope * self.ramp(n);
        }
    }
}

/// Tells whether a line shows at its own frequency in a signal of a rate, or as one at which the
/// machine hardly moves.
fn is_apart(hz: f64, rate_hz: f64) -> bool {
    let alias_hz = libm::fabs(hz - libm::round(hz / rate_hz) * rate_hz);
    hz <= 0.5 * rate_hz || alias_hz >= LEAST_ALIAS * rate_hz
}

/// Share that an average over so many samples leaves of a sine of so many turns a sample.
fn left(turns: f64, factor: usize) -> f64 {
    let half = 0.5 * TAU * turns;
    libm::fabs(libm::sin(factor as f64 * half) / (factor as f64 * libm::sin(half)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tone(hz: f64, rate_hz: f64) -> Vec<f64> {
        (0..2000).map(|n| libm::sin(TAU * hz * f64::from(n) / rate_hz + 0.4)).collect()
    }

    /// Slope of a sine of 100 periods in a stretch of 2 s, which stays: √6/(π·100) of its amplitude.
    const SLOPE: f64 = 8e-3;

    /// Most that a stretch of 75 samples may lose of a swing that ends within a period: four sines and
    /// their growths at each of two lines are a tenth of its degrees of freedom.
    const SWING: f64 = 0.1;

    /// Share of a tone's amplitude that is left, of four seconds at 500 Hz.
    fn share(hz: f64) -> f64 {
        let (mains, mut signal) = (Mains::new(1000.0, 2, 2000), tone(hz, 500.0));
        mains.take_off(&mut signal);
        libm::sqrt(dot(&signal, &signal) / dot(&tone(hz, 500.0), &tone(hz, 500.0)))
    }

    #[test]
    fn law_a_line_is_gone_and_what_is_beside_it_stays() {
        assert!(share(50.0) < SLOPE && share(150.0) < SLOPE);
        assert!(share(49.0) > 0.95 && share(7.0) > 0.999);
    }

    /// At rates that divide a line, or come near it, a line looks like a mean, a slope or a slow
    /// swing.
    #[test]
    fn mean_and_slope_stay_at_any_rate() {
        let rates = [10.0, 20.0, 25.0, 30.0, 48.0, 50.0, 60.0, 75.0, 90.0, 100.0, 120.0, 200.0];
        for (rate_hz, factor) in rates.into_iter().flat_map(|hz| [(hz, 1), (10.0 * hz, 10)]) {
            let samples = (12.0 * rate_hz) as usize / factor;
            let mains = Mains::new(rate_hz, factor, samples);
            let at = |n: usize| n as f64 * factor as f64 / rate_hz;
            let swing = |t: f64| libm::sin(TAU * 0.4 * t);
            let courses = [(|_| 1.0) as fn(f64) -> f64, |t| t - 3.0, swing];
            for (course, most) in courses.into_iter().zip([1e-9, 1e-9, SWING]) {
                let whole: Vec<f64> = (0..samples).map(|n| course(at(n))).collect();
                let mut signal = whole.clone();
                mains.take_off(&mut signal);
                let off: Vec<f64> = signal.iter().zip(&whole).map(|(a, b)| a - b).collect();
                let off = libm::sqrt(dot(&off, &off) / dot(&whole, &whole));
                assert!(off < most, "{rate_hz} Hz by {factor}: {off}");
            }
        }
    }

    #[test]
    fn a_grid_may_be_off_by_hundredths() {
        assert!(share(50.05) < 0.05 && share(59.95) < 0.05);
    }

    /// At 200 Hz the third of 50 Hz looks like the first, and the third of 60 Hz is averaged away.
    #[test]
    fn lines_beyond_half_the_rate_are_looked_for_where_they_show() {
        let columns = |factor: usize| {
            let mains = Mains::new(2000.0, factor, 400);
            mains.sines.len()
        };
        // 50, 60 and 120 Hz, and 100 Hz at half the rate with one phase
        assert_eq!(columns(10), 14);
        assert!(Mains::new(2000.0, 4, 400).sines.is_empty());
    }
}
