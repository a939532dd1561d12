//! The motor's voltage: a second signal of a test, as a few numbers.
//!
//! ```text
//! V = Σ_j e^(δ_j)·(e^κ·E_j + e^ρ·D_j) + l·L·I' + m·L·p·|ω|·I + s·sgn I + o + r
//! E_j = k_p·w_j·F_ecc·ω      D_j = R_p·w_j·I      δ_A + δ_B + δ_C = 0
//! w_j = |s_j| of six steps, ⅔·sin²(θ_e − δ_j) of a field-oriented drive
//! ```
//!
//! with the current, the angle and the speed that the low-fidelity model has at the quantities that
//! the current shows. `κ` and `ρ` are the logarithms of torque constant and resistance over their
//! nominal values, `δ_j` the imbalance of a phase. All eight are found by least squares over filtered
//! samples. The first four are numbers of the machine ([`Quantities::volts_at`]); the others take what
//! the inductance, the commutation and the dead time do.
//!
//! How far the eight are off those of the machine is learnt on the units that the error of the
//! current is learnt on: a mean, straight in quantities and voltage, and a covariance. Of a recording
//! the first four are kept, given what the others are:
//!
//! ```text
//! z₁ − C₁₂·C₂₂⁻¹·z₂ ~ N(v, C₁₁ − C₁₂·C₂₂⁻¹·C₂₁)
//! ```
//!
//! # Source
//!
//! Equation 18 of the FREEDOM paper, phase by phase; numbers in place of a signal whose error is
//! learnt by simulation: Beaumont, Zhang and Balding, *Genetics* 162, 2002, 2025.
#![expect(
    clippy::inline_always,
    reason = "the kernel is compiled once for each instruction set, which inlining makes possible"
)]

use ema_sim::{
    Commutation, MotorMotion, Sector,
    vector_math::{exp_of_lanes, sincos_of_lanes},
};
use inference::dot;
use nalgebra::{DMatrix, DVector};
use pulp::{Arch, NullaryFnOnce};

use crate::{
    offline::error_model::ErrorModelError,
    simulation::experiment::Experiment,
    unit::{
        evidence::InCommon,
        quantities::{UnitMachine, VoltageNumbers},
        trend::{FARTHEST, LEAST_MACHINES, Rows, trend_of_numbers},
    },
};

/// Numbers that the voltage shows of the machine.
pub(crate) const SHOWN: usize = 4;
/// Numbers that are found altogether.
pub(crate) const FOUND: usize = 8;
/// Share of the current limit over which a current changes its sign.
const SIGN_WIDTH: f64 = 0.005;
/// Steps of the search, which is nearly straight: the second changes the ninth digit.
const STEPS: usize = 4;
/// Standard deviations of ln(rms of what is left) beyond which the voltage is not that of the motor.
const MOST_DEVIATIONS: f64 = 4.0;

/// Parts that a voltage is made of: back-EMF and drop of each phase, then those of the inductance, the
/// commutation and the current's sign, and a constant.
const PARTS: usize = 10;
/// Place of the first part that no phase has.
const OTHERS: usize = 6;

/// Samples that are looked at side by side.
const LANES: usize = 8;
/// A number at each of these samples.
type Samples = [f64; LANES];

/// A run of the model, whose voltage is looked at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VoltageRun<'a> {
    pub(crate) motion: &'a MotorMotion,
    pub(crate) machine: &'a UnitMachine,
    pub(crate) experiment: &'a Experiment,
}

/// Parts of the voltage of one run of the model, filtered.
#[derive(Clone, Debug)]
pub(crate) struct VoltageParts(Vec<Vec<f64>>);

/// The numbers that a voltage shows.
#[derive(Clone, Debug)]
pub(crate) struct VoltageFit {
    pub(crate) numbers: [f64; FOUND],
    /// Inverse of the normal matrix, over the square of a volt.
    inverse: DMatrix<f64>,
    /// Root mean square of what is left, V.
    pub(crate) left_v: f64,
}

impl VoltageRun<'_> {
    fn samples(&self) -> usize {
        self.motion.current_a.len()
    }

    /// Parts of the voltage at the samples from one on, V; places beyond the last sample repeat it.
    #[inline(always)]
    fn parts(&self, begin: usize) -> [Samples; PARTS] {
        let Self { motion, machine, experiment } = *self;
        let (motor, faults) = (&experiment.actuator.motor, &machine.faults);
        let controller = &experiment.actuator.controller;
        let pole_pairs = f64::from(motor.pole_pairs);
        let last = self.samples().saturating_sub(1);
        let of = |channel: &[f64]| core::array::from_fn(|lane| channel[(begin + lane).min(last)]);
        let current_a: Samples = of(&motion.current_a);
        let speed: Samples = of(&motion.motor_speed_rad_per_s);
        let angle_rad: Samples = of(&motion.motor_angle_rad);
        let electrical_rad = angle_rad.map(|angle_rad| pole_pairs * angle_rad);
        let weights = match experiment.actuator.inverter.commutation {
            Commutation::FieldOriented => core::array::from_fn(|phase| {
                let axis_rad = core::f64::consts::TAU / 3.0 * phase as f64;
                let [sin, _] = sincos_of_lanes(&electrical_rad.map(|angle| angle - axis_rad));
                sin.map(|sin| 2.0 / 3.0 * (sin * sin))
            }),
            _ => six_step_weights(&electrical_rad),
        };
        let [sin, cos] = sincos_of_lanes(&angle_rad);
        let sign = tanh_of_lanes(&current_a.map(|i| i / (SIGN_WIDTH * controller.current_limit_a)));
        let mut parts = [[0.0; LANES]; PARTS];
        for lane in 0..LANES {
            let sample = (begin + lane).min(last);
            let (before, after) = (sample.saturating_sub(1), (sample + 1).min(last));
            let (i, speed) = (current_a[lane], speed[lane]);
            let gap =
                1.0 + faults.eccentricity_cos * cos[lane] - faults.eccentricity_sin * sin[lane];
            let back_emf = motor.back_emf_v_s_per_rad * gap * speed;
            let drop = motor.resistance_ohm * i;
            for phase in 0..3 {
                parts[phase][lane] = weights[phase][lane] * back_emf;
                parts[3 + phase][lane] = weights[phase][lane] * drop;
            }
            let rise_a = motion.current_a[after] - motion.current_a[before];
            let per_s = controller.sample_hz / (after - before).max(1) as f64;
            parts[OTHERS][lane] = motor.inductance_henry * rise_a * per_s;
            parts[OTHERS + 1][lane] = motor.inductance_henry * pole_pairs * speed.abs() * i;
            parts[OTHERS + 2][lane] = sign[lane];
            parts[OTHERS + 3][lane] = 1.0;
        }
        parts
    }

    /// The voltage at some numbers, V.
    pub(crate) fn voltage_v(&self, numbers: &[f64; FOUND]) -> Vec<f64> {
        let shares = shares(numbers);
        let mut voltage_v = vec![0.0; self.samples().next_multiple_of(LANES)];
        self.each(|begin, parts| {
            let values = &mut voltage_v[begin..begin + LANES];
            for (part, share) in parts.iter().zip(shares) {
                for (value, part) in values.iter_mut().zip(part) {
                    *value += part * share;
                }
            }
        });
        voltage_v.truncate(self.samples());
        voltage_v
    }

    /// The parts through a filter, which takes them all at once.
    pub(crate) fn filtered(&self, filter: impl Fn(&[Vec<f64>]) -> Vec<Vec<f64>>) -> VoltageParts {
        let mut channels = vec![vec![0.0; self.samples().next_multiple_of(LANES)]; PARTS];
        self.each(|begin, parts| {
            for (channel, part) in channels.iter_mut().zip(parts) {
                channel[begin..begin + LANES].copy_from_slice(part);
            }
        });
        for channel in &mut channels {
            channel.truncate(self.samples());
        }
        VoltageParts(filter(&channels))
    }

    /// Shows the parts of all samples, several at a time with the place of the first.
    fn each(&self, take: impl FnMut(usize, &[Samples; PARTS])) {
        Arch::new().dispatch(EachSample { run: *self, take });
    }
}

/// [`VoltageRun::each`] as a kernel.
struct EachSample<'a, T> {
    run: VoltageRun<'a>,
    take: T,
}

impl<T: FnMut(usize, &[Samples; PARTS])> NullaryFnOnce for EachSample<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        for begin in (0..self.run.samples()).step_by(LANES) {
            (self.take)(begin, &self.run.parts(begin));
        }
    }
}

/// Shares of the phases in six steps, a row a phase.
#[inline(always)]
fn six_step_weights(electrical_rad: &Samples) -> [Samples; 3] {
    let mut weights = [[0.0; LANES]; 3];
    for lane in 0..LANES {
        let pattern = Sector::of_electrical_angle(electrical_rad[lane]).pattern();
        for (of_phase, share) in weights.iter_mut().zip(pattern) {
            of_phase[lane] = share.abs();
        }
    }
    weights
}

/// Hyperbolic tangents, to the last digits of one.
#[inline(always)]
fn tanh_of_lanes(x: &Samples) -> Samples {
    let below = exp_of_lanes(&x.map(|x| -2.0 * x.abs()));
    core::array::from_fn(|lane| ((1.0 - below[lane]) / (1.0 + below[lane])).copysign(x[lane]))
}

/// Shares of the parts in the voltage at some numbers.
fn shares(numbers: &[f64; FOUND]) -> [f64; PARTS] {
    let [scale, drop, a, b, others @ ..] = *numbers;
    let turns = [a.exp(), b.exp(), (-a - b).exp()];
    let [back_emf, drop] = [scale, drop].map(|log| turns.map(|turns| turns * log.exp()));
    core::array::from_fn(|part| match part {
        0..3 => back_emf[part],
        3..OTHERS => drop[part - 3],
        _ => others[part - OTHERS],
    })
}

impl VoltageParts {
    /// The numbers that a filtered voltage shows; `None` where the test does not show all of them.
    pub(crate) fn fit(&self, voltage_v: &[f64]) -> Option<VoltageFit> {
        let samples = voltage_v.len().min(self.samples());
        let mut numbers = [0.0; FOUND];
        let mut inverse = DMatrix::zeros(FOUND, FOUND);
        let mut left = DVector::zeros(samples);
        for _ in 0..STEPS {
            let (model, columns) = self.at(&numbers, samples);
            left = DVector::from_fn(samples, |n, _| voltage_v[n] - model[n]);
            let mut normal = columns.tr_mul(&columns);
            let sizes: Vec<f64> = (0..FOUND).map(|n| normal[(n, n)].sqrt()).collect();
            if sizes.iter().any(|size| !(*size > 0.0 && size.is_finite())) {
                return None;
            }
            for (row, a) in sizes.iter().enumerate() {
                for (column, b) in sizes.iter().enumerate() {
                    normal[(row, column)] /= a * b;
                }
            }
            inverse = normal.cholesky()?.inverse();
            for (row, a) in sizes.iter().enumerate() {
                for (column, b) in sizes.iter().enumerate() {
                    inverse[(row, column)] /= a * b;
                }
            }
            let step = &inverse * columns.tr_mul(&left);
            for (number, step) in numbers.iter_mut().zip(step.iter()) {
                *number += step;
            }
        }
        let left_v = (left.norm_squared() / samples as f64).sqrt();
        let is_finite = numbers.iter().all(|number| number.is_finite()) && left_v.is_finite();
        is_finite.then_some(VoltageFit { numbers, inverse, left_v })
    }

    fn samples(&self) -> usize {
        self.0[0].len()
    }

    /// The voltage at some numbers, and its slopes, a column each.
    fn at(&self, numbers: &[f64; FOUND], samples: usize) -> (Vec<f64>, DMatrix<f64>) {
        let shares = shares(numbers);
        let mut columns = DMatrix::zeros(samples, FOUND);
        let mut model = vec![0.0; samples];
        for (n, value) in model.iter_mut().enumerate() {
            let parts: [f64; PARTS] = core::array::from_fn(|part| shares[part] * self.0[part][n]);
            let phase = |phase: usize| parts[phase] + parts[phase + 3];
            *value = parts.iter().sum();
            columns[(n, 0)] = parts[..3].iter().sum();
            columns[(n, 1)] = parts[3..OTHERS].iter().sum();
            columns[(n, 2)] = phase(0) - phase(2);
            columns[(n, 3)] = phase(1) - phase(2);
            for other in OTHERS..PARTS {
                columns[(n, SHOWN + other - OTHERS)] = self.0[other][n];
            }
        }
        (model, columns)
    }

    /// Changes of the numbers found by changes of what the model makes of the voltage at these numbers,
    /// one a change.
    pub(crate) fn found_by(&self, fit: &VoltageFit, changes_v: &[Vec<f64>]) -> Rows {
        let samples = changes_v.first().map_or(0, Vec::len).min(self.samples());
        let (_, columns) = self.at(&fit.numbers, samples);
        let found = |change_v: &Vec<f64>| {
            let change_v = DVector::from_column_slice(&change_v[..samples]);
            (-(&fit.inverse * columns.tr_mul(&change_v))).data.into()
        };
        changes_v.iter().map(found).collect()
    }
}

/// Numbers of the machine that a recorded voltage shows, with their covariance.
///
/// They are found with the motion that the most probable quantities `q₀` make. With others they are
/// others, so that kept are
///
/// ```text
/// z − G·q₀ ~ N(v − G·q, C)      G = ∂z/∂q at the same voltage
/// ```
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VoltageReading {
    /// `z − G·q₀`.
    pub(crate) numbers: VoltageNumbers,
    /// `G`, a column a quantity.
    pub(crate) by_quantities: DMatrix<f64>,
    pub(crate) covariance: DMatrix<f64>,
    /// Shares of the covariance that other recordings of the unit have too.
    pub(crate) in_common: InCommon,
}

/// How well the motor's voltage shows numbers of a machine, as it was learnt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoltageWorth {
    /// Standard deviation of the torque constant, relative.
    pub torque_constant: f64,
    /// Standard deviation of the resistance, relative.
    pub resistance: f64,
    /// Standard deviation of the turns of phase A less the mean of all, relative; that of phase B is
    /// alike.
    pub imbalance: f64,
    /// Shares of the variance that recordings of one unit have in common, of one state of health, and
    /// of one session.
    pub in_common: [f64; 3],
    /// Usual root mean square of what is left of the filtered voltage, V.
    pub left_v: f64,
}

/// Learnt error of what a voltage shows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VoltageError {
    /// Mean and spread of torque constant and resistance over the units, as found.
    pub(crate) centre: [f64; 2],
    pub(crate) spread: [f64; 2],
    /// One row a term.
    pub(crate) coefficients: Rows,
    /// Covariance of machines with a narrow play, or of all.
    pub(crate) covariance: DMatrix<f64>,
    /// Covariance of machines with a wide play, where it was learnt apart.
    pub(crate) wide: Option<DMatrix<f64>>,
    pub(crate) in_common: InCommon,
    /// Mean and standard deviation of ln(rms of what is left), of V.
    pub(crate) ln_left: [f64; 2],
}

/// Voltages of units beside the numbers of their machines.
#[derive(Clone, Debug, Default)]
pub(crate) struct UnitVoltages {
    pub(crate) fits: Vec<Option<VoltageFit>>,
    pub(crate) shown: Vec<VoltageNumbers>,
}

impl UnitVoltages {
    /// The numbers found less those of the machine; `None` where a unit has no voltage.
    fn differences(&self) -> Option<Rows> {
        let difference = |(fit, shown): (&Option<VoltageFit>, &VoltageNumbers)| {
            let mut difference = fit.as_ref()?.numbers.to_vec();
            for (value, shown) in difference.iter_mut().zip(shown) {
                *value -= shown;
            }
            Some(difference)
        };
        self.fits.iter().zip(&self.shown).map(difference).collect()
    }
}

impl VoltageError {
    /// Learns from units with the terms of the current's mean error on each, some of them with a wide
    /// play; `None` where they have no voltage, or the test does not show its numbers.
    pub(crate) fn learn(
        of_current: &[Vec<f64>],
        is_wide: &[bool],
        voltages: &UnitVoltages,
    ) -> Result<Option<(Self, Rows)>, ErrorModelError> {
        let Some(differences) = voltages.differences().filter(|rows| !rows.is_empty()) else {
            return Ok(None);
        };
        let count = differences.len() as f64;
        let fits: Vec<&VoltageFit> = voltages.fits.iter().flatten().collect();
        let mean =
            |of: &dyn Fn(&VoltageFit) -> f64| fits.iter().map(|fit| of(fit)).sum::<f64>() / count;
        let std = |of: &dyn Fn(&VoltageFit) -> f64| {
            let centre = mean(of);
            (mean(&|fit| (of(fit) - centre).powi(2)) * count / (count - 1.0)).sqrt()
        };
        let number = |place: usize| move |fit: &VoltageFit| fit.numbers[place];
        let left = |fit: &VoltageFit| fit.left_v.max(f64::MIN_POSITIVE).ln();
        let mut learnt = Self {
            centre: [0, 1].map(|place| mean(&number(place))),
            spread: [0, 1].map(|place| std(&number(place)).max(f64::MIN_POSITIVE)),
            coefficients: Vec::new(),
            covariance: DMatrix::zeros(FOUND, FOUND),
            wide: None,
            in_common: InCommon::default(),
            ln_left: [mean(&left), std(&left)],
        };
        let terms =
            of_current.iter().zip(&fits).map(|(of_current, fit)| learnt.terms(of_current, fit));
        let (coefficients, residuals) = trend_of_numbers(&terms.collect::<Vec<_>>(), &differences)?;
        learnt.coefficients = coefficients;
        let (wide, narrow): (Vec<_>, Vec<_>) =
            residuals.iter().zip(is_wide).partition(|(_, is_wide)| **is_wide);
        let covariance = |of: &mut dyn Iterator<Item = &Vec<f64>>| {
            let rows: Vec<f64> = of.flatten().copied().collect();
            let units = rows.len() / FOUND;
            let rows = DMatrix::from_row_slice(units, FOUND, &rows);
            rows.tr_mul(&rows) / units as f64
        };
        if wide.len().min(narrow.len()) < LEAST_MACHINES {
            learnt.covariance = covariance(&mut residuals.iter());
        } else {
            let [narrow, wide] = [narrow, wide]
                .map(|of| covariance(&mut of.into_iter().map(|(residual, _)| residual)));
            (learnt.covariance, learnt.wide) = (narrow, Some(wide));
        }
        Ok(Some((learnt, residuals)))
    }

    /// Number of terms of the mean beside so many of the current's.
    pub(crate) fn terms_beside(of_current: usize) -> usize {
        of_current + 5
    }

    /// Terms of the mean: those of the current's, torque constant and resistance, and how these bend.
    fn terms(&self, of_current: &[f64], fit: &VoltageFit) -> Vec<f64> {
        let own = |place: usize| {
            let away = (fit.numbers[place] - self.centre[place]) / self.spread[place];
            away.clamp(-FARTHEST, FARTHEST)
        };
        let [a, b] = [own(0), own(1)];
        [of_current, &[a, b, a * a, a * b, b * b]].concat()
    }

    /// Differences of other recordings from the mean.
    pub(crate) fn beside_mean(
        &self,
        of_current: &[Vec<f64>],
        voltages: &UnitVoltages,
    ) -> Option<Rows> {
        let mut differences = voltages.differences()?;
        for ((difference, terms), fit) in differences.iter_mut().zip(of_current).zip(&voltages.fits)
        {
            self.take_mean(terms, fit.as_ref()?, difference);
        }
        Some(differences)
    }

    /// Takes the mean error off numbers.
    pub(crate) fn take_mean(&self, of_current: &[f64], fit: &VoltageFit, numbers: &mut [f64]) {
        for (row, term) in self.coefficients.iter().zip(self.terms(of_current, fit)) {
            for (number, coefficient) in numbers.iter_mut().zip(row) {
                *number -= term * coefficient;
            }
        }
    }

    /// Share of the error that units have again in other recordings, `Σ r₁ᵀ·C⁻¹·r₂ / Σ |L⁻¹·r₁|·|L⁻¹·r₂|`
    /// over what is kept of the numbers.
    pub(crate) fn share_in_common(
        &self,
        is_wide: &[bool],
        first: &[Vec<f64>],
        second: &[Vec<f64>],
    ) -> Option<f64> {
        let factor = |wideness: f64| {
            let (gain, covariance) = given_others(&self.covariance_of(wideness))?;
            Some((gain, covariance.cholesky()?.l()))
        };
        let factors = [factor(0.0)?, factor(1.0)?];
        let (mut together, mut own) = (0.0, 0.0);
        for ((first, second), is_wide) in first.iter().zip(second).zip(is_wide) {
            let (gain, lower) = &factors[usize::from(*is_wide)];
            let white = |of: &Vec<f64>| lower.solve_lower_triangular(&kept(gain, of));
            let (first, second) = (white(first)?, white(second)?);
            together += first.dot(&second);
            own += first.norm() * second.norm();
        }
        Some(together / own.max(f64::MIN_POSITIVE))
    }

    /// Covariance with a share of that of a wide play.
    fn covariance_of(&self, wideness: f64) -> DMatrix<f64> {
        match &self.wide {
            Some(wide) => (1.0 - wideness) * &self.covariance + wideness * wide,
            None => self.covariance.clone(),
        }
    }

    /// Reads the numbers of the machine off what a voltage shows, with their slopes in the quantities at
    /// which they are found.
    ///
    /// Noise beyond that of the units counts as white over the samples; a share of the covariance is
    /// that of a wide play.
    pub(crate) fn reading(
        &self,
        of_current: &[f64],
        wideness: f64,
        fit: &VoltageFit,
        slopes: &[Vec<f64>],
    ) -> Option<VoltageReading> {
        let [mean, _] = self.ln_left;
        let beyond_v2 = (fit.left_v.powi(2) - (2.0 * mean).exp()).max(0.0);
        let covariance = self.covariance_of(wideness) + beyond_v2 * &fit.inverse;
        let (gain, covariance) = given_others(&covariance)?;
        let mut numbers = fit.numbers.to_vec();
        self.take_mean(of_current, fit, &mut numbers);
        let by_quantities: Vec<DVector<f64>> =
            slopes.iter().map(|slope| kept(&gain, slope)).collect();
        let kept = kept(&gain, &numbers);
        let in_common = self.in_common;
        Some(VoltageReading {
            numbers: core::array::from_fn(|place| kept[place]),
            by_quantities: DMatrix::from_columns(&by_quantities),
            covariance,
            in_common,
        })
    }

    /// Reading of a voltage that is not there yet.
    pub(crate) fn expected(&self, numbers: VoltageNumbers) -> Option<VoltageReading> {
        let (_, covariance) = given_others(&self.covariance)?;
        let (in_common, by_quantities) = (self.in_common, DMatrix::zeros(SHOWN, 0));
        Some(VoltageReading { numbers, by_quantities, covariance, in_common })
    }

    /// Information on what is kept of the numbers.
    pub(crate) fn information(&self) -> Option<DMatrix<f64>> {
        let (_, covariance) = given_others(&self.covariance)?;
        Some(covariance.cholesky()?.inverse())
    }

    /// How well it shows numbers of a machine.
    pub(crate) fn worth(&self) -> Option<VoltageWorth> {
        let (_, covariance) = given_others(&self.covariance)?;
        let std = |place: usize| covariance[(place, place)].max(0.0).sqrt();
        Some(VoltageWorth {
            torque_constant: std(0),
            resistance: std(1),
            imbalance: std(2),
            in_common: self.in_common.shares(),
            left_v: self.ln_left[0].exp(),
        })
    }

    /// Largest root mean square that is left of the voltage of a machine like those learnt, V.
    pub(crate) fn most_left_v(&self) -> f64 {
        let [mean, std] = self.ln_left;
        (mean + MOST_DEVIATIONS * std).exp()
    }
}

/// `C₁₂·C₂₂⁻¹`, and the covariance of the first numbers given the others.
fn given_others(covariance: &DMatrix<f64>) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let block =
        |rows: (usize, usize), columns: (usize, usize)| covariance.view(rows, columns).into_owned();
    let (others, cross) =
        (block((SHOWN, SHOWN), (SHOWN, SHOWN)), block((0, SHOWN), (SHOWN, SHOWN)));
    let gain = &cross * others.cholesky()?.inverse();
    let covariance = block((0, 0), (SHOWN, SHOWN)) - &gain * cross.transpose();
    Some((gain, 0.5 * (&covariance + covariance.transpose())))
}

/// `z₁ − C₁₂·C₂₂⁻¹·z₂`.
fn kept(gain: &DMatrix<f64>, numbers: &[f64]) -> DVector<f64> {
    DVector::from_fn(SHOWN, |row, _| {
        let others: Vec<f64> = gain.row(row).iter().copied().collect();
        numbers[row] - dot(&others, &numbers[SHOWN..])
    })
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;
    use ema_sim::{HighFidelity, presets};

    use super::*;
    use crate::unit::{design::built, monitor::UnitMonitor, quantities::Quantities};

    /// Run of the nominal machine's low-fidelity model, through the filter.
    fn parts(experiment: &Experiment) -> VoltageParts {
        let quantities = Quantities::new(experiment);
        let monitor = UnitMonitor::new(experiment, &quantities, 0.0);
        let at = quantities.nominal();
        let (motion, machine) = monitor.run(&at).unwrap();
        VoltageRun { motion: &motion, machine: &machine, experiment }
            .filtered(|channels| monitor.filtered_each(channels))
    }

    #[test]
    fn numbers_of_a_voltage_that_is_the_equation_come_back() {
        let parts = parts(&Experiment::chirp());
        let numbers = [0.04, -0.11, 0.02, -0.03, 1.3, 0.9, 0.05, -0.02];
        let (voltage_v, _) = parts.at(&numbers, parts.samples());
        let fit = parts.fit(&voltage_v).unwrap();
        for (found, expected) in fit.numbers.iter().zip(numbers) {
            assert_abs_diff_eq!(*found, expected, epsilon = 1e-6);
        }
        assert!(fit.left_v < 1e-6, "{}", fit.left_v);
    }

    /// Numbers that the high-fidelity model's voltage shows of a machine, less those of the nominal one,
    /// and what the machine is said to show.
    fn shown(set: &[(&str, f64)]) -> [[f64; SHOWN]; 2] {
        let tolerance = presets::ema_48_tolerance();
        let experiment = Experiment { tolerance, ..Experiment::chirp() };
        let quantities = Quantities::new(&experiment);
        let layout = quantities.layout();
        let fitted = |set: &[(&str, f64)]| {
            let point = layout.point(set);
            let monitor = UnitMonitor::new(&experiment, &quantities, 0.0);
            let (motion, machine) = monitor.run(&quantities.at(&point)).unwrap();
            let run = VoltageRun { motion: &motion, machine: &machine, experiment: &experiment };
            let parts = run.filtered(|channels| monitor.filtered_each(channels));
            let machine = built(&experiment, layout, &point);
            let model = HighFidelity::new(&machine.actuator, &machine.scenario).unwrap();
            let trace = model.try_simulate(&machine.faults).unwrap();
            let fit = parts.fit(&monitor.filtered(&trace.motor_voltage_v)).unwrap();
            (fit.numbers, quantities.volts_at(&point))
        };
        let ((changed, expected), (nominal, _)) = (fitted(set), fitted(&[]));
        [core::array::from_fn(|place| changed[place] - nominal[place]), expected]
    }

    fn assert_shown(set: &[(&str, f64)]) {
        let [found, expected] = shown(set);
        assert!(expected.iter().any(|number| number.abs() > 0.01), "{expected:?}");
        // the resistance takes a part of the commutation's drop, which is learnt
        let epsilons = [0.002, 0.010, 0.006, 0.006];
        for ((found, expected), epsilon) in found.into_iter().zip(expected).zip(epsilons) {
            assert_abs_diff_eq!(found, expected, epsilon = epsilon);
        }
    }

    #[test]
    fn a_large_resistance_shows_as_one() {
        assert_shown(&[("motor.resistance-ohm", 0.08)]);
    }

    #[test]
    fn weak_magnets_show_in_the_torque_constant() {
        assert_shown(&[("motor.back-emf-v-s-per-rad", -0.04)]);
    }

    #[test]
    fn shorted_turns_of_a_phase_show_in_all_numbers() {
        assert_shown(&[("k3", 0.04)]);
    }

    #[test]
    fn a_voltage_is_that_of_its_equation_at_every_sample() {
        let experiment = Experiment::chirp();
        let quantities = Quantities::new(&experiment);
        let monitor = UnitMonitor::new(&experiment, &quantities, 0.3);
        let (mut motion, mut machine) = monitor.run(&quantities.nominal()).unwrap();
        // one sample is left of the last eight
        let samples = motion.current_a.len() / LANES * LANES - LANES + 1;
        motion.current_a.truncate(samples);
        (machine.faults.eccentricity_cos, machine.faults.eccentricity_sin) = (0.03, -0.02);
        let run = VoltageRun { motion: &motion, machine: &machine, experiment: &experiment };
        let numbers = [0.04, -0.11, 0.02, -0.03, 1.3, 0.9, 0.05, -0.02];
        let voltage_v = run.voltage_v(&numbers);
        assert_eq!(voltage_v.len(), samples);
        let [scale, drop, a, b, rise, commutation, sign, offset] = numbers;
        let motor = &experiment.actuator.motor;
        let controller = &experiment.actuator.controller;
        let pole_pairs = f64::from(motor.pole_pairs);
        for (n, found) in voltage_v.iter().enumerate() {
            let (i, speed) = (motion.current_a[n], motion.motor_speed_rad_per_s[n]);
            let angle_rad = motion.motor_angle_rad[n];
            let pattern = Sector::of_electrical_angle(pole_pairs * angle_rad).pattern();
            let turns: f64 =
                pattern.iter().zip([a, b, -a - b]).map(|(s, log)| s.abs() * log.exp()).sum();
            let gap = 1.0 + 0.03 * angle_rad.cos() + 0.02 * angle_rad.sin();
            let back_emf = scale.exp() * motor.back_emf_v_s_per_rad * gap * speed;
            let (before, after) = (n.saturating_sub(1), (n + 1).min(samples - 1));
            let slope = (motion.current_a[after] - motion.current_a[before]) * controller.sample_hz
                / (after - before) as f64;
            let width_a = SIGN_WIDTH * controller.current_limit_a;
            let expected = turns * (back_emf + drop.exp() * motor.resistance_ohm * i)
                + motor.inductance_henry
                    * (rise * slope + commutation * pole_pairs * speed.abs() * i)
                + sign * (i / width_a).tanh()
                + offset;
            assert_abs_diff_eq!(*found, expected, epsilon = 1e-12);
        }
    }

    #[test]
    fn a_test_without_motion_shows_nothing() {
        let parts = parts(&Experiment::chirp());
        let mut still = parts;
        for part in &mut still.0[..3] {
            part.fill(0.0);
        }
        assert!(still.fit(&vec![1.0; still.samples()]).is_none());
    }
}
