//! The shape of the back-EMF as a table over the electrical angle.

use core::f64::consts::TAU;

use crate::parameter_error::ParameterError;

/// Most samples of a table.
const MOST_SAMPLES: usize = 72;
/// Fewest.
const FEWEST_SAMPLES: usize = 6;

/// Samples of a back-EMF over one electrical turn, evenly spaced, the first at the zero of
/// phase A; times the motor's peak value.
///
/// Between the samples runs the periodic cubic spline: slope and bend are continuous, so that the
/// series of the simulation converge as they do on a sine but for the third derivative's steps.
///
/// # Examples
///
/// ```
/// use ema_sim::BackEmfTable;
///
/// let turn = core::f64::consts::TAU;
/// let samples: Vec<f64> = (0..36).map(|n| f64::sin(turn * f64::from(n) / 36.0)).collect();
/// let table = BackEmfTable::new(&samples)?;
/// assert_eq!(table.samples(), samples);
/// assert!((table.fundamental_ratio() - 1.0).abs() < 1e-12);
/// # Ok::<_, ema_sim::ParameterError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BackEmfTable {
    samples: [f64; MOST_SAMPLES],
    len: usize,
}

impl BackEmfTable {
    /// A table of 6 to 72 samples.
    ///
    /// # Errors
    ///
    /// [`ParameterError`] for too few or too many samples, for one outside −2 to 2, and where the
    /// part of it that follows a sine is not at least a tenth: a machine without torque.
    pub fn new(samples: &[f64]) -> Result<Self, ParameterError> {
        let field = "motor.back-emf-shape";
        let within = |value: f64, least: f64, most: f64| {
            if value >= least && value <= most {
                Ok(())
            } else {
                Err(ParameterError::OutOfBounds { field, value, least, most })
            }
        };
        within(samples.len() as f64, FEWEST_SAMPLES as f64, MOST_SAMPLES as f64)?;
        for sample in samples {
            within(*sample, -2.0, 2.0)?;
        }
        let mut table = Self { samples: [0.0; MOST_SAMPLES], len: samples.len() };
        table.samples[..samples.len()].copy_from_slice(samples);
        within(table.fundamental_ratio(), 0.1, 2.0)?;
        Ok(table)
    }

    /// The samples.
    pub fn samples(&self) -> &[f64] {
        &self.samples[..self.len]
    }

    /// Amplitude of the part that follows a sine of the electrical angle: what a field-oriented
    /// drive makes torque with.
    pub fn fundamental_ratio(&self) -> f64 {
        let n = self.len as f64;
        let sum: f64 = self
            .samples()
            .iter()
            .enumerate()
            .map(|(k, sample)| sample * libm::sin(TAU * k as f64 / n))
            .sum();
        2.0 / n * sum
    }

    /// The spline through the samples.
    pub(crate) fn spline(&self) -> Spline {
        Spline::through(self.samples())
    }
}

/// A periodic cubic spline over the electrical turn.
#[derive(Clone, Debug)]
pub(crate) struct Spline {
    /// Coefficients of each piece in the angle from its knot.
    pieces: Vec<[f64; 4]>,
    per_knot: f64,
    knot_rad: f64,
}

impl Spline {
    /// Natural in nothing, periodic in everything: value, slope and bend agree at the seam.
    fn through(samples: &[f64]) -> Self {
        let n = samples.len();
        let h = TAU / n as f64;
        let bends = bends(samples, h);
        let pieces = (0..n)
            .map(|k| {
                let next = (k + 1) % n;
                let (y, m) = (samples[k], bends[k]);
                let (rise, turn) = (samples[next] - y, bends[next] - m);
                [y, rise / h - h * (m / 2.0 + turn / 6.0), m / 2.0, turn / (6.0 * h)]
            })
            .collect();
        Self { pieces, per_knot: 1.0 / h, knot_rad: h }
    }

    /// Value and the three coefficients of a small turn's powers, at an electrical angle.
    #[inline]
    pub(crate) fn near(&self, electrical_rad: f64) -> [f64; 4] {
        let n = self.pieces.len();
        let knot = libm::floor(electrical_rad * self.per_knot);
        let d = electrical_rad - knot * self.knot_rad;
        let place = (knot as i64).rem_euclid(n as i64) as usize;
        let [c0, c1, c2, c3] = self.pieces[place];
        [
            c0 + d * (c1 + d * (c2 + d * c3)),
            c1 + d * (2.0 * c2 + 3.0 * d * c3),
            c2 + 3.0 * d * c3,
            c3,
        ]
    }
}

/// Second derivatives at the knots: `m_{k−1} + 4·m_k + m_{k+1} = 6·(y_{k−1} − 2·y_k + y_{k+1})/h²`,
/// periodic; by sweeps of Gauss and Seidel, which shrink the error at least fourfold each.
fn bends(y: &[f64], h: f64) -> Vec<f64> {
    let n = y.len();
    let (before, after) = (|k: usize| (k + n - 1) % n, |k: usize| (k + 1) % n);
    let mut m = vec![0.0; n];
    for _ in 0..60 {
        for k in 0..n {
            let right = 6.0 * (y[before(k)] - 2.0 * y[k] + y[after(k)]) / (h * h);
            m[k] = 0.25 * (right - m[before(k)] - m[after(k)]);
        }
    }
    m
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    /// Rounding of a spline's coefficients at its knots, which differences of powers enlarge.
    const KNOT: f64 = 1e-6;
    /// Rounding of a spline's value at its knots.
    const VALUE: f64 = 1e-12;

    fn sine(n: u32) -> BackEmfTable {
        let samples: Vec<f64> =
            (0..n).map(|k| libm::sin(TAU * f64::from(k) / f64::from(n))).collect();
        BackEmfTable::new(&samples).unwrap()
    }

    #[test]
    fn order_the_spline_of_a_sine() {
        let worst = |n: u32| {
            let spline = sine(n).spline();
            (0..1000).fold(0.0_f64, |most, k| {
                let x = 0.0137 * f64::from(k) - 5.0;
                most.max((spline.near(x)[0] - libm::sin(x)).abs())
            })
        };
        // h⁴/384 of the fourth derivative, which is one
        let h: f64 = TAU / 36.0;
        assert!(worst(36) < h.powi(4) / 384.0 * 1.1, "{:e}", worst(36));
        assert!(worst(18) / worst(36) > 13.0, "fourth order: {}", worst(18) / worst(36));
    }

    #[test]
    fn value_slope_and_bend_go_on_through_the_knots() {
        let samples: Vec<f64> = (0..12)
            .map(|k| [0.0, 1.0, 1.0, 0.9, 1.0, 1.1][k % 6] * if k < 6 { 1.0 } else { -1.0 })
            .collect();
        let spline = BackEmfTable::new(&samples).unwrap().spline();
        for knot in -12_i32..13 {
            let x = f64::from(knot) * TAU / 12.0;
            let (left, right) = (spline.near(x - 1e-9), spline.near(x + 1e-9));
            for order in 0..3 {
                assert_abs_diff_eq!(left[order], right[order], epsilon = KNOT);
            }
            let sample = samples[knot.rem_euclid(12) as usize];
            assert_abs_diff_eq!(spline.near(x)[0], sample, epsilon = VALUE);
        }
    }

    #[test]
    fn tables_that_make_no_torque_are_refused() {
        assert!(BackEmfTable::new(&[0.0, 1.0, -1.0]).is_err());
        assert!(BackEmfTable::new(&[f64::NAN; 12]).is_err());
        assert!(BackEmfTable::new(&[1.0; 12]).is_err());
        let reversed: Vec<f64> = sine(12).samples().iter().map(|x| -x).collect();
        let message = BackEmfTable::new(&reversed).unwrap_err().to_string();
        assert!(message.starts_with("`motor.back-emf-shape` is -"), "{message}");
    }
}
