//! The residual of the EMPS benchmark's own procedure: the force that the recorded voltage makes,
//! less the inverse dynamics of the measured position, linear in its numbers.

use core::f64::consts::TAU;

use anyhow::{Context, Result};
use greybox::rms;

use super::{
    filter::{LowPass, decimated_by_ten},
    recording::interpolated,
};

/// Force of the amplifier's volt, N/V, as published with the benchmark.
const FORCE_PER_VOLT: f64 = 35.150_651_882_485_47;
const SAMPLE_S: f64 = 1e-3;
/// Decimated samples left out at each end: 0.3 s.
const LEFT_OUT: usize = 30;

/// A force over the measured motion, of size one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Term {
    /// Acceleration.
    Mass,
    /// Speed.
    Viscous,
    /// Sign of the speed.
    Dry,
    /// A bristle's force in place of the sign, with this deflection at full friction, m.
    Bristle { deflection: f64 },
    /// One.
    Offset,
    /// Amount of the speed.
    ViscousAsymmetry,
    /// Sign of the speed times a power of its amount.
    Power { reference: f64, exponent: f64 },
    /// Sine of the time at a frequency, Hz.
    Sine { hz: f64 },
    /// Cosine of the same.
    Cosine { hz: f64 },
}

/// A recording as the procedure sees it.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    time_s: Vec<f64>,
    voltage: Vec<f64>,
    speed: Vec<f64>,
    acceleration: Vec<f64>,
}

impl Motion {
    /// Recording from the columns time, reference, position, voltage.
    pub(super) fn of(columns: &[Vec<f64>]) -> Self {
        let position = LowPass::butterworth(4, 100.0 / 500.0).without_delay(&columns[2]);
        let speed = gradient(&position);
        let acceleration = gradient(&speed);
        let time_s = columns[0].iter().map(|t| t - columns[0][0]).collect();
        Self { time_s, voltage: columns[3].clone(), speed, acceleration }
    }

    /// The force of the voltage that was written this much earlier.
    fn force(&self, delay_s: f64) -> Vec<f64> {
        let at = |t: &f64| FORCE_PER_VOLT * interpolated(&self.time_s, &self.voltage, t - delay_s);
        decimated(&self.time_s.iter().map(at).collect::<Vec<f64>>())
    }

    fn column(&self, term: Term) -> Vec<f64> {
        let of_speed = |f: &dyn Fn(f64) -> f64| self.speed.iter().map(|v| f(*v)).collect();
        let of_phase = |f: fn(f64) -> f64, hz: f64| {
            self.time_s.iter().map(|t| f(TAU * hz * t)).collect::<Vec<f64>>()
        };
        decimated(&match term {
            Term::Mass => self.acceleration.clone(),
            Term::Viscous => self.speed.clone(),
            Term::Dry => of_speed(&sign),
            Term::Bristle { deflection } => bristle(&self.speed, deflection),
            Term::Offset => vec![1.0; self.speed.len()],
            Term::ViscousAsymmetry => of_speed(&f64::abs),
            Term::Power { reference, exponent } => {
                of_speed(&|v| sign(v) * (v.abs() / reference).powf(exponent))
            }
            Term::Sine { hz } => of_phase(f64::sin, hz),
            Term::Cosine { hz } => of_phase(f64::cos, hz),
        })
    }
}

/// Force over friction of a bristle that is bent by the motion and full at this deflection, the
/// speed constant over a sample: `z' = v − |v|·z/z_0`.
fn bristle(speed: &[f64], deflection: f64) -> Vec<f64> {
    let mut bent = 0.0;
    let step = |v: &f64| {
        let full = sign(*v);
        bent = full + (bent - full) * (-v.abs() * SAMPLE_S / deflection).exp();
        bent
    };
    speed.iter().map(step).collect()
}

fn sign(v: f64) -> f64 {
    if v == 0.0 { 0.0 } else { v.signum() }
}

/// Central differences, one-sided at the ends.
fn gradient(values: &[f64]) -> Vec<f64> {
    let last = values.len() - 1;
    let slope = |n: usize| {
        let (before, after) = (n.saturating_sub(1), (n + 1).min(last));
        (values[after] - values[before]) / ((after - before) as f64 * SAMPLE_S)
    };
    (0..=last).map(slope).collect()
}

fn decimated(signal: &[f64]) -> Vec<f64> {
    let all = decimated_by_ten(signal);
    all[LEFT_OUT..all.len() - LEFT_OUT].to_vec()
}

/// Terms fitted to one recording and judged on another.
#[derive(Clone, Debug)]
pub(super) struct Refit {
    /// Sizes, in the order of the terms.
    pub(super) sizes: Vec<f64>,
    /// Root mean square that is left of the recording fitted, N.
    pub(super) train_n: f64,
    /// Residual of the other recording, nothing fitted there, N.
    pub(super) test_n: f64,
}

/// Least squares on `train`, judged on `test`, with a delay of the voltage in both.
pub(super) fn refit(
    (train, test): (&Motion, &Motion),
    terms: &[Term],
    delay_s: f64,
) -> Result<Refit> {
    let columns = |motion: &Motion| terms.iter().map(|term| motion.column(*term)).collect();
    let fitted: Vec<Vec<f64>> = columns(train);
    let force = train.force(delay_s);
    let sizes = least_squares(&fitted, &force).context("forces that cannot be told apart")?;
    let left = |force: &[f64], columns: &[Vec<f64>]| {
        let of = |n: usize| {
            force[n] - columns.iter().zip(&sizes).map(|(c, size)| size * c[n]).sum::<f64>()
        };
        rms(&(0..force.len()).map(of).collect::<Vec<f64>>())
    };
    let train_n = left(&force, &fitted);
    let test_n = left(&test.force(delay_s), &columns(test));
    Ok(Refit { sizes, train_n, test_n })
}

/// Sizes of columns, orthogonalised one after another (modified Gram-Schmidt); `None` where a
/// column is made of those before it.
fn least_squares(columns: &[Vec<f64>], target: &[f64]) -> Option<Vec<f64>> {
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
    let count = columns.len();
    let (mut basis, mut left) = (columns.to_vec(), target.to_vec());
    let mut upper = vec![vec![0.0; count]; count];
    let mut along = vec![0.0; count];
    for n in 0..count {
        let length = dot(&basis[n], &basis[n]).sqrt();
        if length <= 1e-9 * dot(&columns[n], &columns[n]).sqrt() {
            return None;
        }
        upper[n][n] = length;
        let unit: Vec<f64> = basis[n].iter().map(|x| x / length).collect();
        for m in n + 1..count {
            upper[n][m] = dot(&unit, &basis[m]);
            let share = upper[n][m];
            basis[m].iter_mut().zip(&unit).for_each(|(x, u)| *x -= share * u);
        }
        along[n] = dot(&unit, &left);
        left.iter_mut().zip(&unit).for_each(|(x, u)| *x -= along[n] * u);
    }
    for n in (0..count).rev() {
        for m in n + 1..count {
            along[n] -= upper[n][m] * along[m];
        }
        along[n] /= upper[n][n];
    }
    Some(along)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn least_squares_finds_what_a_signal_was_made_of() {
        let column = |f: fn(f64) -> f64| (0..400).map(|n| f(0.01 * f64::from(n))).collect();
        let columns: Vec<Vec<f64>> = vec![column(f64::sin), column(|x| x), column(|_| 1.0)];
        let made: Vec<f64> =
            (0..400).map(|n| 2.0 * columns[0][n] - 0.5 * columns[1][n] + 3.0).collect();
        let sizes = least_squares(&columns, &made).unwrap();
        assert_abs_diff_eq!(sizes[..], [2.0, -0.5, 3.0][..], epsilon = 1e-10);
        let twice = vec![columns[0].clone(), columns[0].clone()];
        assert_eq!(least_squares(&twice, &made), None);
    }

    /// At constant speed the force rises as `1 − exp(−x/z_0)` with the way, and reverses over twice
    /// the way.
    #[test]
    fn law_a_bristle_is_bent_by_the_way_it_went() {
        let there = bristle(&[0.01; 30], 1e-4);
        let expected = 1.0 - (-3e-4_f64 / 1e-4).exp();
        assert_abs_diff_eq!(there[29], expected, epsilon = 1e-12);
        let back = bristle(&[[0.01; 30], [-0.01; 30]].concat(), 1e-4);
        assert!(back[31] > 0.0 && back[59] < -0.85, "{} {}", back[31], back[59]);
    }
}
