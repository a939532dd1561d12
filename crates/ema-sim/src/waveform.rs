//! A trapezoidal back-EMF with shorter flat tops and harmonics, and where its corners lie.

use core::f64::consts::{FRAC_PI_2, FRAC_PI_3, FRAC_PI_6, PI, TAU};

use libm::{floor, sin, sincos};

/// `f(x)`: flat tops of `120° − 2δ`, straight flanks, and `h5·sin 5x + h7·sin 7x`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Waveform {
    /// δ, what a flat top lacks at each end.
    pub(crate) flat_loss_rad: f64,
    pub(crate) fifth: f64,
    pub(crate) seventh: f64,
}

impl Waveform {
    /// Value at an electrical angle.
    pub(crate) fn at(&self, x: f64) -> f64 {
        let turned = x - TAU * floor(x / TAU);
        // by symmetry the rising flank about 0 is enough
        let from = if turned < FRAC_PI_2 {
            turned
        } else if turned < PI + FRAC_PI_2 {
            PI - turned
        } else {
            turned - TAU
        };
        let top = (from / (FRAC_PI_6 + self.flat_loss_rad)).clamp(-1.0, 1.0);
        top + self.fifth * sin(5.0 * x) + self.seventh * sin(7.0 * x)
    }

    /// Taylor coefficients about an angle, on the straight piece that holds another angle.
    pub(crate) fn near(&self, x: f64, on_piece_of: f64) -> [f64; 4] {
        let half_flank = FRAC_PI_6 + self.flat_loss_rad;
        let turns = floor((on_piece_of + FRAC_PI_2) / TAU);
        let place = on_piece_of - TAU * turns;
        let (value, slope) = if place.abs() < half_flank {
            ((x - TAU * turns) / half_flank, 1.0 / half_flank)
        } else if (place - PI).abs() < half_flank {
            ((PI + TAU * turns - x) / half_flank, -1.0 / half_flank)
        } else {
            (if (0.0..PI).contains(&place) { 1.0 } else { -1.0 }, 0.0)
        };
        let mut series = [value, slope, 0.0, 0.0];
        for (size, n) in [(self.fifth, 5.0), (self.seventh, 7.0)] {
            if size != 0.0 {
                let (s, c) = sincos(n * x);
                series[0] += size * s;
                series[1] += size * n * c;
                series[2] -= size * n * n * s / 2.0;
                series[3] -= size * n * n * n * c / 6.0;
            }
        }
        series
    }
}

/// The corners of three phases' waves, and between which two the rotor stands.
///
/// In every 60° of electrical angle, counted from 30° on as sectors are, there is one at δ and one
/// at 60° − δ; without δ they are one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Corners {
    /// Places of the corners in 60°, 0 to 1, in order.
    places: [f64; 2],
    count: i64,
    /// The rotor is between this corner and the next.
    index: i64,
}

impl Corners {
    /// The corners about an electrical angle.
    pub(crate) fn about(wave: &Waveform, electrical_rad: f64) -> Self {
        let place = wave.flat_loss_rad / FRAC_PI_3;
        let place = place - floor(place);
        let (low, high) = (place.min(1.0 - place), place.max(1.0 - place));
        // places that rounding alone keeps apart are one
        let (places, count) = if low < 1e-9 {
            ([0.0; 2], 1)
        } else if high - low < 1e-9 {
            ([low; 2], 1)
        } else {
            ([low, high], 2)
        };
        let mut corners = Self { places, count, index: 0 };
        let sixths = (electrical_rad - FRAC_PI_6) / FRAC_PI_3;
        corners.index = floor(sixths) as i64 * count - 1;
        while corners.at_sixths(corners.index + 1) <= sixths {
            corners.index += 1;
        }
        corners
    }

    fn at_sixths(&self, index: i64) -> f64 {
        let whole = index.div_euclid(self.count);
        whole as f64 + self.places[index.rem_euclid(self.count) as usize]
    }

    /// Electrical angles of the two corners.
    pub(crate) fn span_rad(&self) -> (f64, f64) {
        let at = |index| FRAC_PI_6 + FRAC_PI_3 * self.at_sixths(index);
        (at(self.index), at(self.index + 1))
    }

    /// Goes on by a corner.
    pub(crate) fn cross(&mut self, step: i64) {
        self.index += step;
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    /// Rounding of the wave's value.
    const VALUE: f64 = 1e-12;
    /// Fourth power left out of the wave's series.
    const SERIES: f64 = 1e-9;

    /// Between two corners every phase is on one piece, whose series gives the wave.
    #[test]
    fn law_between_corners_a_series_gives_the_wave() {
        for (flat_loss_rad, fifth, seventh) in
            [(0.0, 0.0, 0.0), (0.17, 0.03, -0.02), (0.6, 0.0, 0.0), (1.0, 0.1, 0.0)]
        {
            let wave = Waveform { flat_loss_rad, fifth, seventh };
            let mut corners = Corners::about(&wave, -9.0);
            for _ in 0..60 {
                let (low, high) = corners.span_rad();
                assert!(high > low, "{corners:?}");
                let middle = 0.5 * (low + high);
                for phase in 0..3 {
                    let shift = TAU / 3.0 * f64::from(phase);
                    for share in [0.0, 0.3, 1.0] {
                        let x = low + share * (high - low) - shift;
                        let c = wave.near(x, middle - shift);
                        assert_abs_diff_eq!(c[0], wave.at(x), epsilon = VALUE);
                        // towards the middle, along the series
                        let d = 1e-3 * (middle - shift - x).signum();
                        let there = c[0] + d * (c[1] + d * (c[2] + d * c[3]));
                        assert_abs_diff_eq!(there, wave.at(x + d), epsilon = SERIES);
                    }
                }
                corners.cross(1);
            }
        }
    }

    #[test]
    fn the_corners_hold_the_angle() {
        for loss in [0.0, 0.2, FRAC_PI_6, 0.9] {
            let wave = Waveform { flat_loss_rad: loss, ..Waveform::default() };
            for step in -40..40 {
                let electrical_rad = 0.31 * f64::from(step);
                let (low, high) = Corners::about(&wave, electrical_rad).span_rad();
                assert!(low <= electrical_rad + 1e-12 && electrical_rad < high);
            }
        }
    }
}
