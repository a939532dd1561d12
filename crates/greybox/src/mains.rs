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
/// Mean square of a sine below which the others make it up.
const LEAST_SQUARE: f64 = 1e-6;

/// The sines of the lines in stretches of a recording, orthonormal: signals are projected off them.
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
        for stretch in 0..stretches {
            let range = stretch * samples / stretches..(stretch + 1) * samples / stretches;
            for hz in LINES_HZ.into_iter().filter(|hz| left(*hz / rate_hz, factor) >= LEAST_LEFT) {
                for (phase_turns, grows) in [(0.0, false), (0.25, false), (0.0, true), (0.25, true)]
                {
                    let middle = 0.5 * (range.len() as f64 - 1.0);
                    let at = |n: usize| {
                        let sine = libm::sin(TAU * (hz * n as f64 * sample_s + phase_turns));
                        if grows { sine * (n as f64 - middle) / middle } else { sine }
                    };
                    let mut sine = vec![0.0; samples];
                    sine[range.clone()].iter_mut().enumerate().for_each(|(n, x)| *x = at(n));
                    mains.take_off(&mut sine);
                    let sine = sine[range.clone()].to_vec();
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

    /// Share of a tone's amplitude that is left, of four seconds at 500 Hz.
    fn share(hz: f64) -> f64 {
        let (mains, mut signal) = (Mains::new(1000.0, 2, 2000), tone(hz, 500.0));
        mains.take_off(&mut signal);
        libm::sqrt(dot(&signal, &signal) / dot(&tone(hz, 500.0), &tone(hz, 500.0)))
    }

    #[test]
    fn law_a_line_is_gone_and_what_is_beside_it_stays() {
        assert!(share(50.0) < 1e-9 && share(150.0) < 1e-9);
        assert!(share(49.0) > 0.95 && share(7.0) > 0.999);
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
