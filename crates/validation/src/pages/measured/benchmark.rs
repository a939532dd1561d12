//! Residuals of inverse dynamics, linear in their numbers: the force that the recorded drive signal
//! makes, less what the measured position asks for. That of EMPS is the benchmark's own procedure.

use core::f64::consts::TAU;

use anyhow::{Context, Result};
use greybox::rms;

use super::{
    filter::{LowPass, decimated_by_ten},
    recording::interpolated,
};

/// Force of the amplifier's volt, N/V, as published with the benchmark.
pub(super) const FORCE_PER_VOLT: f64 = 35.150_651_882_485_47;
/// Rate of the benchmark's recordings, Hz.
const BENCHMARK_HZ: f64 = 1000.0;
/// Corner of the low-pass behind the benchmark's position, Hz.
const BENCHMARK_CORNER_HZ: f64 = 100.0;
/// Speeds below are rest, m/s or rad/s.
const REST: f64 = 1e-9;
/// Left out at each end, s.
const LEFT_OUT_S: f64 = 0.3;

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
    /// Falls with the speed, `sgn(v)·exp(−(v/v_s)²)`, m/s or rad/s.
    Stribeck { speed: f64 },
    /// Position.
    Spring,
    /// Sign of the speed times the time since the start.
    Drift,
    /// Sign of the speed times the amount of the known load.
    LoadFriction,
    /// The known load: the constant of the motor is another.
    Load,
    /// Slope of the drive force: it acts later than it is recorded.
    Slope,
    /// Sine of so many times the position.
    SineOfAngle { order: f64 },
    /// Cosine of the same.
    CosineOfAngle { order: f64 },
    /// Sine of the time at a frequency, Hz.
    Sine { hz: f64 },
    /// Cosine of the same.
    Cosine { hz: f64 },
}

/// Samples of the columns that are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kept {
    /// All samples.
    All,
    /// Each tenth, behind a low-pass.
    Tenth,
}

/// Signals of a recording before any filter.
#[derive(Clone, Debug)]
pub(super) struct Raw {
    /// Rate of the samples, Hz.
    pub(super) rate_hz: f64,
    /// Position, m or rad.
    pub(super) position: Vec<f64>,
    /// Force of the drive, or its current where that is compared.
    pub(super) force: Vec<f64>,
    /// Load that is known, in the unit of the force.
    pub(super) load: Option<Vec<f64>>,
}

/// A recording as the procedure sees it.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    rate_hz: f64,
    kept: Kept,
    time_s: Vec<f64>,
    force: Vec<f64>,
    load: Vec<f64>,
    position: Vec<f64>,
    speed: Vec<f64>,
    acceleration: Vec<f64>,
}

impl Motion {
    /// Recording of EMPS from the columns time, reference, position, voltage, by the benchmark's
    /// procedure.
    pub(super) fn of(columns: &[Vec<f64>]) -> Self {
        let raw = Raw {
            rate_hz: BENCHMARK_HZ,
            position: columns[2].clone(),
            force: columns[3].iter().map(|volt| FORCE_PER_VOLT * volt).collect(),
            load: None,
        };
        let force = raw.force.clone();
        Self { kept: Kept::Tenth, force, ..Self::smoothed(&raw, BENCHMARK_CORNER_HZ) }
    }

    /// Recording whose signals all go through a Butterworth low-pass of order 4, forwards and
    /// backwards.
    pub(super) fn smoothed(raw: &Raw, corner_hz: f64) -> Self {
        let low_pass = LowPass::butterworth(4, 2.0 * corner_hz / raw.rate_hz);
        let position = low_pass.without_delay(&raw.position);
        let speed = gradient(&position, raw.rate_hz);
        let acceleration = gradient(&speed, raw.rate_hz);
        let none = || vec![0.0; position.len()];
        Self {
            rate_hz: raw.rate_hz,
            kept: Kept::All,
            time_s: (0..position.len()).map(|n| n as f64 / raw.rate_hz).collect(),
            force: low_pass.without_delay(&raw.force),
            load: raw.load.as_ref().map_or_else(none, |load| low_pass.without_delay(load)),
            position,
            speed,
            acceleration,
        }
    }

    /// Samples of the recording from one on, up to another.
    pub(super) fn part(&self, range: core::ops::Range<usize>) -> Self {
        let of = |all: &Vec<f64>| all[range.clone()].to_vec();
        Self {
            time_s: of(&self.time_s),
            force: of(&self.force),
            load: of(&self.load),
            position: of(&self.position),
            speed: of(&self.speed),
            acceleration: of(&self.acceleration),
            ..*self
        }
    }

    /// Samples of the recording.
    pub(super) fn samples(&self) -> usize {
        self.time_s.len()
    }

    /// The force of the drive less the known load, of a drive signal written this much earlier.
    pub(super) fn force(&self, delay_s: f64) -> Vec<f64> {
        let at =
            |(t, load): (&f64, &f64)| interpolated(&self.time_s, &self.force, t - delay_s) - load;
        self.kept(&self.time_s.iter().zip(&self.load).map(at).collect::<Vec<f64>>())
    }

    pub(super) fn column(&self, term: Term) -> Vec<f64> {
        let of_speed = |f: &dyn Fn(f64) -> f64| self.speed.iter().map(|v| f(*v)).collect();
        let of_phase = |f: fn(f64) -> f64, per: f64, of: &[f64]| {
            of.iter().map(|x| f(per * x)).collect::<Vec<f64>>()
        };
        let with_sign =
            |of: &[f64]| self.speed.iter().zip(of).map(|(v, x)| sign(*v) * x).collect::<Vec<f64>>();
        self.kept(&match term {
            Term::Mass => self.acceleration.clone(),
            Term::Viscous => self.speed.clone(),
            Term::Dry => of_speed(&sign),
            Term::Bristle { deflection } => bristle(&self.speed, deflection, self.rate_hz),
            Term::Offset => vec![1.0; self.speed.len()],
            Term::ViscousAsymmetry => of_speed(&f64::abs),
            Term::Power { reference, exponent } => {
                of_speed(&|v| sign(v) * (v.abs() / reference).powf(exponent))
            }
            Term::Stribeck { speed } => of_speed(&|v| sign(v) * (-(v / speed).powi(2)).exp()),
            Term::Spring => self.position.clone(),
            Term::Drift => with_sign(&self.time_s),
            Term::LoadFriction => {
                with_sign(&self.load.iter().map(|load| load.abs()).collect::<Vec<f64>>())
            }
            Term::Load => self.load.clone(),
            Term::Slope => gradient(&self.force, self.rate_hz),
            Term::SineOfAngle { order } => of_phase(f64::sin, order, &self.position),
            Term::CosineOfAngle { order } => of_phase(f64::cos, order, &self.position),
            Term::Sine { hz } => of_phase(f64::sin, TAU * hz, &self.time_s),
            Term::Cosine { hz } => of_phase(f64::cos, TAU * hz, &self.time_s),
        })
    }

    /// A column without its ends, decimated where the procedure says so.
    fn kept(&self, signal: &[f64]) -> Vec<f64> {
        let (all, rate_hz) = match self.kept {
            Kept::All => (signal.to_vec(), self.rate_hz),
            Kept::Tenth => (decimated_by_ten(signal), 0.1 * self.rate_hz),
        };
        let out = (LEFT_OUT_S * rate_hz).round() as usize;
        all[out..all.len() - out].to_vec()
    }
}

/// Force over friction of a bristle that is bent by the motion and full at this deflection, the
/// speed constant over a sample: `z' = v − |v|·z/z_0`.
fn bristle(speed: &[f64], deflection: f64, rate_hz: f64) -> Vec<f64> {
    let mut bent = 0.0;
    let step = |v: &f64| {
        let full = sign(*v);
        bent = full + (bent - full) * (-v.abs() / (deflection * rate_hz)).exp();
        bent
    };
    speed.iter().map(step).collect()
}

/// Sign of a speed, zero at rest: rounding of a filter turns rest into motion of either sign.
fn sign(v: f64) -> f64 {
    if v.abs() < REST { 0.0 } else { v.signum() }
}

/// Central differences, one-sided at the ends.
fn gradient(values: &[f64], rate_hz: f64) -> Vec<f64> {
    let last = values.len() - 1;
    let slope = |n: usize| {
        let (before, after) = (n.saturating_sub(1), (n + 1).min(last));
        (values[after] - values[before]) * rate_hz / (after - before) as f64
    };
    (0..=last).map(slope).collect()
}

/// Columns of the terms over recordings one after another.
pub(super) fn columns_of(motions: &[Motion], terms: &[Term]) -> Vec<Vec<f64>> {
    let of = |term: &Term| motions.iter().flat_map(|motion| motion.column(*term)).collect();
    terms.iter().map(of).collect()
}

/// Forces over recordings one after another.
pub(super) fn forces_of(motions: &[Motion], delay_s: f64) -> Vec<f64> {
    motions.iter().flat_map(|motion| motion.force(delay_s)).collect()
}

/// A force less columns of these sizes.
pub(super) fn left(force: &[f64], columns: &[Vec<f64>], sizes: &[f64]) -> Vec<f64> {
    let of =
        |n: usize| force[n] - columns.iter().zip(sizes).map(|(c, size)| size * c[n]).sum::<f64>();
    (0..force.len()).map(of).collect()
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

/// Least squares on `train`, judged on `test`, with a delay of the drive in both.
pub(super) fn refit(
    (train, test): (&[Motion], &[Motion]),
    terms: &[Term],
    delay_s: f64,
) -> Result<Refit> {
    let fitted = columns_of(train, terms);
    let force = forces_of(train, delay_s);
    let sizes = least_squares(&fitted, &force).context("forces that cannot be told apart")?;
    let train_n = rms(&left(&force, &fitted, &sizes));
    let test_n = rms(&left(&forces_of(test, delay_s), &columns_of(test, terms), &sizes));
    Ok(Refit { sizes, train_n, test_n })
}

/// Sizes of columns, orthogonalised one after another (modified Gram-Schmidt); `None` where a
/// column is made of those before it.
pub(super) fn least_squares(columns: &[Vec<f64>], target: &[f64]) -> Option<Vec<f64>> {
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
        let there = bristle(&[0.01; 30], 1e-4, 1000.0);
        let expected = 1.0 - (-3e-4_f64 / 1e-4).exp();
        assert_abs_diff_eq!(there[29], expected, epsilon = 1e-12);
        let back = bristle(&[[0.01; 30], [-0.01; 30]].concat(), 1e-4, 1000.0);
        assert!(back[31] > 0.0 && back[59] < -0.85, "{} {}", back[31], back[59]);
    }
}
