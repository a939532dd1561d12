//! What hums at the frequency of the mains: it is no machine's, and has a phase of its own in each
//! recording.

use core::f64::consts::TAU;

use crate::gram::dot;

/// Frequencies of the mains with their first overtones, Hz.
const LINES_HZ: [f64; 6] = [50.0, 60.0, 100.0, 120.0, 150.0, 180.0];
/// Share of the sampling rate below which a line is looked for.
const LARGEST_SHARE: f64 = 0.45;
/// Shortest recording in which they are lines, s: in less, much else is near them.
const SHORTEST_S: f64 = 1.0;

/// The sines of the lines in a recording, orthonormal: signals are projected off them.
#[derive(Clone, Debug)]
pub(crate) struct Mains {
    sines: Vec<Vec<f64>>,
}

impl Mains {
    pub(crate) fn new(rate_hz: f64, samples: usize) -> Self {
        let mut mains = Self { sines: Vec::new() };
        if samples as f64 <= SHORTEST_S * rate_hz {
            return mains;
        }
        for hz in LINES_HZ.into_iter().filter(|hz| *hz < LARGEST_SHARE * rate_hz) {
            for phase_turns in [0.0, 0.25] {
                let at = |n: usize| libm::sin(TAU * (hz * n as f64 / rate_hz + phase_turns));
                let mut sine: Vec<f64> = (0..samples).map(at).collect();
                mains.take_off(&mut sine);
                let size = libm::sqrt(dot(&sine, &sine));
                for value in &mut sine {
                    *value /= size;
                }
                mains.sines.push(sine);
            }
        }
        mains
    }

    /// Takes what a signal has of the lines off it.
    pub(crate) fn take_off(&self, signal: &mut [f64]) {
        for sine in &self.sines {
            let part = dot(sine, signal);
            for (value, s) in signal.iter_mut().zip(sine) {
                *value -= part * s;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tone(hz: f64) -> Vec<f64> {
        (0..2000).map(|n| libm::sin(TAU * hz * f64::from(n) / 500.0 + 0.4)).collect()
    }

    #[test]
    fn law_a_line_is_gone_and_what_is_beside_it_stays() {
        let mains = Mains::new(500.0, 2000);
        assert_eq!(mains.sines.len(), 12);
        let left = |hz: f64| {
            let mut signal = tone(hz);
            mains.take_off(&mut signal);
            libm::sqrt(dot(&signal, &signal) / dot(&tone(hz), &tone(hz)))
        };
        assert!(left(50.0) < 1e-9 && left(150.0) < 1e-9);
        assert!(left(49.0) > 0.98 && left(7.0) > 0.999);
    }

    /// At 100 Hz the mains would be half of the sampling rate, and in half a second everything is
    /// near a line.
    #[test]
    fn no_line_is_looked_for_where_it_is_none() {
        assert!(Mains::new(100.0, 2000).sines.is_empty());
        assert!(Mains::new(500.0, 250).sines.is_empty());
    }
}
