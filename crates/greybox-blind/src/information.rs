//! Information of the recordings on an effect, by the generator's own plant and noise.
//!
//! ```text
//! λ = |(I − P)·W·d|²      d = current with the effect − without,  P projects on W·S
//! ```
//!
//! `W` whitens the noise, `S` are the current's slopes over all faults and over the nuisance
//! parameters (numbers with a tolerance).
//!
//! # Source
//!
//! Noncentrality of a linear hypothesis beside nuisance parameters; `docs/models/blind-test.md`.

use crate::{
    chance::{Chance, Purpose},
    effect::Hidden,
    machine::{Machine, Nuisance, Numbers},
    noise::Noise,
    plant::{Faults, Subject, Test, simulate},
};

/// Contents of a recording without its noise.
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    pub(crate) course: crate::command::Course,
    pub(crate) start_rad: f64,
    pub(crate) disturbance_seed: u64,
}

impl Setting {
    pub(crate) fn test(&self, steps: usize) -> Test<'_> {
        Test { course: &self.course, start_rad: self.start_rad, seed: self.disturbance_seed, steps }
    }

    /// Setting of a machine that stands elsewhere at the start.
    fn started_off(&self, by_rad: f64) -> Self {
        let mut setting = self.clone();
        setting.start_rad += by_rad;
        setting.course.command_rad.iter_mut().for_each(|command| *command -= by_rad);
        setting
    }
}

pub(crate) fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Orthonormal columns, with what makes the originals of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Space {
    columns: Vec<Vec<f64>>,
    /// Upper triangle: `original_j = Σ_i triangle[j][i]·column_i`.
    triangle: Vec<Vec<f64>>,
    /// Place of each original among the columns; none where it adds nothing.
    kept: Vec<Option<usize>>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

impl Space {
    pub(crate) fn add(&mut self, column: &[f64]) {
        let mut rest = column.to_vec();
        let shares = self.take_off(&mut rest);
        let size = libm::sqrt(dot(&rest, &rest));
        if size <= 1e-7 * libm::sqrt(dot(column, column)) {
            self.kept.push(None);
            return;
        }
        for value in &mut rest {
            *value /= size;
        }
        let mut row = shares;
        row.push(size);
        self.kept.push(Some(self.columns.len()));
        self.columns.push(rest);
        self.triangle.push(row);
    }

    /// Takes a vector's part in the space off it, twice for rounding; returns the shares.
    pub(crate) fn take_off(&self, vector: &mut [f64]) -> Vec<f64> {
        let mut shares = vec![0.0; self.columns.len()];
        for _ in 0..2 {
            for (share, column) in shares.iter_mut().zip(&self.columns) {
                let part = dot(column, vector);
                *share += part;
                for (v, c) in vector.iter_mut().zip(column) {
                    *v -= part * c;
                }
            }
        }
        shares
    }

    /// How much of each original is in what has these shares.
    pub(crate) fn coefficients(&self, shares: &[f64]) -> Vec<f64> {
        let n = self.columns.len();
        let mut c = shares.to_vec();
        for j in (0..n).rev() {
            c[j] /= self.triangle[j][j];
            let cj = c[j];
            for (i, value) in c.iter_mut().enumerate().take(j) {
                *value -= self.triangle[j][i] * cj;
            }
        }
        self.kept.iter().map(|kept| kept.map_or(0.0, |place| c[place])).collect()
    }
}

/// A machine with recordings: everything that lambda needs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outlook<'a> {
    pub(crate) numbers: Numbers,
    pub(crate) faults: Faults,
    pub(crate) noise: Noise,
    pub(crate) settings: &'a [Setting],
}

/// Integrator steps in a tick for slopes of the machine without effects.
const COARSE: usize = 1;

/// Integrator steps in a tick for what goes into recordings: 50 µs and 125 µs.
pub(crate) fn fine(machine: Machine) -> usize {
    match machine {
        Machine::Ema48 => 2,
        Machine::Servo => 4,
    }
}

/// Change of a fault for a slope.
const FAULT_STEP: [f64; 7] = [0.005, 0.004, 0.005, 0.005, 0.005, 0.005, 0.005];
const NUISANCE_STEP: f64 = 0.005;
/// Place of the first coordinate of an eccentricity among the faults.
const ECCENTRICITY: usize = 5;

impl Outlook<'_> {
    fn currents(
        &self,
        change: impl Fn(&mut Subject<'_>),
        hidden: &[Hidden],
        steps: usize,
    ) -> Vec<Vec<f64>> {
        let mut subject = Subject { numbers: self.numbers, faults: self.faults, hidden };
        change(&mut subject);
        self.settings.iter().map(|s| simulate(&subject, &s.test(steps)).current).collect()
    }

    fn difference(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
        a.iter().zip(b).map(|(a, b)| minus(a, b)).collect()
    }

    /// Whitened and put one after the other.
    pub(crate) fn pooled(&self, parts: &[Vec<f64>]) -> Vec<f64> {
        parts.iter().flat_map(|part| self.noise.whitened(part)).collect()
    }

    /// Currents without anything hidden.
    pub(crate) fn plain(&self) -> Vec<Vec<f64>> {
        self.currents(|_| {}, &[], fine(self.numbers.machine))
    }

    /// Change by effects of the current of a machine that stands at the start where the
    /// recording shows it: an error of the position there is no sign of anything.
    pub(crate) fn signature(&self, plain: &[Vec<f64>], hidden: &[Hidden]) -> Vec<Vec<f64>> {
        let steps = fine(self.numbers.machine);
        let of = |(setting, plain): (&Setting, &Vec<f64>)| -> Vec<f64> {
            let subject = Subject { numbers: self.numbers, faults: self.faults, hidden };
            let with = simulate(&subject, &setting.test(steps));
            let off_rad = with.position.first().map_or(0.0, |shown| shown - setting.start_rad);
            if off_rad == 0.0 {
                return minus(&with.current, plain);
            }
            let plain = Subject { hidden: &[], ..subject };
            minus(
                &with.current,
                &simulate(&plain, &setting.started_off(off_rad).test(steps)).current,
            )
        };
        self.settings.iter().zip(plain).map(of).collect()
    }

    /// Holds moves of faults and nuisance parameters, in the order of the slopes, where a machine
    /// can be: damage between none and all, a number within twice its tolerance of the true one.
    pub(crate) fn hold(&self, by: &mut [f64]) {
        let (faults, nuisances) = by.split_at_mut(self.numbers.machine.fault_count());
        for (place, by) in faults.iter_mut().enumerate() {
            let (now, least) = (self.faults[place], if place < ECCENTRICITY { 0.0 } else { -1.0 });
            *by = (now + *by).clamp(least, 1.0) - now;
        }
        for (of, by) in Nuisance::ALL.into_iter().zip(nuisances) {
            let most = 2.0 * of.half_width(self.numbers.machine);
            *by = by.clamp(-most, most);
        }
    }

    /// Change by faults and nuisance parameters moved by so much, in the order of the slopes.
    pub(crate) fn imitated(&self, plain: &[Vec<f64>], by: &[f64]) -> Vec<Vec<f64>> {
        let (faults, nuisances) = by.split_at(self.numbers.machine.fault_count());
        let moved = |subject: &mut Subject<'_>| {
            subject.faults.iter_mut().zip(faults).for_each(|(level, by)| *level += by);
            for (of, by) in Nuisance::ALL.into_iter().zip(nuisances) {
                of.change(&mut subject.numbers, *by);
            }
        };
        Self::difference(&self.currents(moved, &[], fine(self.numbers.machine)), plain)
    }

    /// Slopes over all faults and nuisance parameters, each recording by recording.
    pub(crate) fn slopes(&self) -> Vec<Vec<Vec<f64>>> {
        let base = self.currents(|_| {}, &[], COARSE);
        let faults = (0..self.numbers.machine.fault_count()).map(|place| {
            let moved = self.currents(|s| s.faults[place] += FAULT_STEP[place], &[], COARSE);
            (moved, FAULT_STEP[place])
        });
        let nuisances = Nuisance::ALL.into_iter().map(|nuisance| {
            let move_it = |s: &mut Subject<'_>| nuisance.change(&mut s.numbers, NUISANCE_STEP);
            (self.currents(move_it, &[], COARSE), NUISANCE_STEP)
        });
        let scaled = |(moved, step): (Vec<Vec<f64>>, f64)| {
            let mut slope = Self::difference(&moved, &base);
            slope.iter_mut().flatten().for_each(|value| *value /= step);
            slope
        };
        faults.chain(nuisances).map(scaled).collect()
    }
}

/// The space of slopes over some of the recordings.
pub(crate) fn space(outlook: &Outlook<'_>, slopes: &[Vec<Vec<f64>>], records: usize) -> Space {
    let mut space = Space::default();
    for slope in slopes {
        space.add(&outlook.pooled(&slope[..records]));
    }
    space
}

/// Energy of a whitened signature that a space cannot imitate, and of all of it.
pub(crate) fn lambda(space: &Space, whitened: &[f64]) -> (f64, f64) {
    let mut rest = whitened.to_vec();
    space.take_off(&mut rest);
    (dot(&rest, &rest), dot(whitened, whitened))
}

/// Rms over the noise of a recording that was used neither for fitting nor for choosing, after
/// faults and nuisance parameters were fitted to the others.
pub(crate) fn excess(
    outlook: &Outlook<'_>,
    space: &Space,
    slopes: &[Vec<Vec<f64>>],
    signature: &[Vec<f64>],
    held_out: usize,
) -> f64 {
    let mut rest = outlook.pooled(&signature[..held_out]);
    let shares = space.take_off(&mut rest);
    let coefficients = space.coefficients(&shares);
    let mut left = signature[held_out].clone();
    for (c, slope) in coefficients.iter().zip(slopes) {
        for (value, s) in left.iter_mut().zip(&slope[held_out]) {
            *value -= c * s;
        }
    }
    let power = dot(&left, &left) / left.len() as f64;
    libm::sqrt(1.0 + power / (outlook.noise.rms_a * outlook.noise.rms_a))
}

/// A seed for each recording.
pub(crate) fn seeds(seed: u64, count: usize) -> Vec<u64> {
    let mut chance = Chance::new(seed, Purpose::Disturbance, 1);
    (0..count).map(|_| chance.bits()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_in_the_space_is_taken_off_and_given_back_as_coefficients() {
        let n = 50;
        let wave = |k: f64| -> Vec<f64> { (0..n).map(|i| (k * f64::from(i)).sin()).collect() };
        let (a, b, c) = (wave(0.1), wave(0.13), wave(0.5));
        let mut space = Space::default();
        space.add(&a);
        space.add(&a);
        space.add(&b);
        let mixed: Vec<f64> = (0..n as usize).map(|i| 3.0 * a[i] - 2.0 * b[i] + c[i]).collect();
        let mut rest = mixed.clone();
        let shares = space.take_off(&mut rest);
        assert!(dot(&rest, &a).abs() < 1e-9 && dot(&rest, &b).abs() < 1e-9);
        let mut alone = c.clone();
        let of_c = space.coefficients(&space.take_off(&mut alone));
        let found = space.coefficients(&shares);
        assert!((found[0] - of_c[0] - 3.0).abs() < 1e-9 && found[1] == 0.0);
        assert!((found[2] - of_c[2] + 2.0).abs() < 1e-9);
        let (left, whole) = lambda(&space, &mixed);
        assert!((left - dot(&alone, &alone)).abs() < 1e-9 && whole > left);
    }
}
