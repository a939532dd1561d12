//! Locations chosen by other rules than the self-organising map.

use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use crate::{Matrix, NoiseCovariance, matrix::dot, som::shuffle};

/// Criterion that a greedy choice of locations improves at each step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Optimality {
    /// Sum of the variances of the (scaled) parameters.
    A,
    /// Volume of their confidence region.
    D,
}

/// The first locations of a QR factorisation of `modesᵀ` with column pivoting;
/// past the number of modes, the locations of greatest leverage.
///
/// # Source
///
/// Drmač, Gugercin, SIAM J. Sci. Comput. 38(2), 2016 (Q-DEIM).
pub(crate) fn qdeim(modes: &Matrix, count: usize) -> Vec<usize> {
    let mut rows: Vec<Vec<f64>> = (0..modes.rows()).map(|row| modes.row(row)).collect();
    let mut chosen = Vec::with_capacity(count);
    for _ in 0..count.min(modes.columns()) {
        let pivot = first_largest(rows.iter().map(|row| dot(row, row)), &chosen);
        let length = dot(&rows[pivot], &rows[pivot]).sqrt();
        if length == 0.0 {
            break;
        }
        let direction: Vec<f64> = rows[pivot].iter().map(|value| value / length).collect();
        for row in &mut rows {
            let share = dot(row, &direction);
            row.iter_mut().zip(&direction).for_each(|(value, unit)| *value -= share * unit);
        }
        chosen.push(pivot);
    }
    let mut information = Information::new(modes.columns());
    for &row in &chosen {
        information.add(&modes.row(row));
    }
    while chosen.len() < count {
        let gains = (0..modes.rows()).map(|row| information.leverage(&modes.row(row)));
        let next = first_largest(gains, &chosen);
        information.add(&modes.row(next));
        chosen.push(next);
    }
    chosen
}

/// Greedy choice of locations by what they tell about the parameters.
///
/// With correlated noise a location tells only what the chosen ones do not
/// already: sensitivities and variances are conditioned on them (one column of
/// a Cholesky factorisation a step), which keeps neighbours of strongly
/// correlated noise apart without a gap to tune.
pub(crate) fn greedy(
    sensitivities: &Matrix,
    noise: Option<&NoiseCovariance>,
    count: usize,
    optimality: Optimality,
) -> Vec<usize> {
    let locations = sensitivities.rows();
    let mut rows: Vec<Vec<f64>> = (0..locations).map(|row| sensitivities.row(row)).collect();
    let prior = noise.map_or_else(|| vec![1.0; locations], NoiseCovariance::variances);
    let mut variances = prior.clone();
    let mut factor: Vec<Vec<f64>> = Vec::with_capacity(count);
    let mut information = Information::new(sensitivities.columns());
    let mut chosen = Vec::with_capacity(count);
    while chosen.len() < count {
        let gains = (0..locations).map(|row| {
            if variances[row] <= CONDITIONAL_REL * prior[row] {
                return f64::NEG_INFINITY;
            }
            match optimality {
                Optimality::D => information.leverage(&rows[row]) / variances[row],
                Optimality::A => information.variance_drop(&rows[row], variances[row]),
            }
        });
        let pivot = first_largest(gains, &chosen);
        let root = variances[pivot].max(f64::MIN_POSITIVE).sqrt();
        let told: Vec<f64> = rows[pivot].iter().map(|value| value / root).collect();
        information.add(&told);
        chosen.push(pivot);
        let Some(noise) = noise else { continue };
        let mut column = noise.covariance_column(pivot);
        for known in &factor {
            let share = known[pivot];
            column.iter_mut().zip(known).for_each(|(value, other)| *value -= share * other);
        }
        for value in &mut column {
            *value /= root;
        }
        for (row, &share) in column.iter().enumerate() {
            variances[row] -= share * share;
            rows[row].iter_mut().zip(&told).for_each(|(value, other)| *value -= share * other);
        }
        factor.push(column);
    }
    chosen
}

/// Below this share of its variance, what is left of a location's noise after
/// conditioning is rounding.
const CONDITIONAL_REL: f64 = 1e-10;

/// `count` locations at equal steps, half a step from the ends.
pub(crate) fn uniform(locations: usize, count: usize) -> Vec<usize> {
    (0..count).map(|index| (2 * index + 1) * locations / (2 * count)).collect()
}

/// `count` different locations by chance.
pub(crate) fn random(locations: usize, count: usize, seed: u64) -> Vec<usize> {
    let mut all: Vec<usize> = (0..locations).collect();
    shuffle(&mut all, &mut ChaCha8Rng::seed_from_u64(seed));
    all.truncate(count);
    all
}

/// Index of the largest value that is not taken, the first in a tie.
fn first_largest(values: impl Iterator<Item = f64>, taken: &[usize]) -> usize {
    let mut top: Option<(usize, f64)> = None;
    for (index, value) in values.enumerate() {
        if !taken.contains(&index) && top.is_none_or(|(_, largest)| value > largest) {
            top = Some((index, value));
        }
    }
    top.map_or(0, |(index, _)| index)
}

/// Inverse of an information matrix that grows by one row at a time.
struct Information {
    inverse: Matrix,
}

impl Information {
    /// Prior knowledge of `1/WEAK`: weak enough to leave the choice to the
    /// data, strong enough to be invertible.
    fn new(parameters: usize) -> Self {
        const WEAK: f64 = 1e9;
        let mut inverse = Matrix::zeros(parameters, parameters);
        (0..parameters).for_each(|index| inverse.set(index, index, WEAK));
        Self { inverse }
    }

    fn leverage(&self, row: &[f64]) -> f64 {
        dot(&self.inverse.times_vector(row), row)
    }

    /// By how much the trace of the inverse falls with a row of some variance.
    fn variance_drop(&self, row: &[f64], variance: f64) -> f64 {
        let direction = self.inverse.times_vector(row);
        dot(&direction, &direction) / (variance + dot(&direction, row))
    }

    fn add(&mut self, row: &[f64]) {
        let direction = self.inverse.times_vector(row);
        let scale = 1.0 + dot(&direction, row);
        for column in 0..row.len() {
            for entry in 0..row.len() {
                let value =
                    self.inverse.get(entry, column) - direction[entry] * direction[column] / scale;
                self.inverse.set(entry, column, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Optimality, greedy, qdeim, uniform};
    use crate::{Matrix, NoiseCovariance, NoiseModel};

    const LOCATIONS: usize = 14;

    fn covariance(one: usize, other: usize) -> f64 {
        (1.0 + 0.05 * one as f64)
            * (1.0 + 0.05 * other as f64)
            * 0.7_f64.powf(one.abs_diff(other) as f64)
    }

    fn sensitivity(row: usize, column: usize) -> f64 {
        (0.9 * row as f64 + 1.3 * column as f64).sin() + 0.1 * row as f64
    }

    /// Information of a set with the prior of `Information::new`, from scratch.
    fn information(set: &[usize]) -> [f64; 3] {
        let count = set.len();
        let noise = Matrix::from_fn(count, count, |a, b| covariance(set[a], set[b])).unwrap();
        let noise = NoiseCovariance::new(&NoiseModel::Dense(noise), count, 0.0).unwrap();
        let rows = Matrix::from_fn(count, 2, |a, column| sensitivity(set[a], column)).unwrap();
        let whitened = noise.whiten(&rows).unwrap();
        let gram = whitened.transposed_times(&whitened);
        [gram.get(0, 0) + 1e-9, gram.get(0, 1), gram.get(1, 1) + 1e-9]
    }

    fn worth(set: &[usize], optimality: Optimality) -> f64 {
        let [a, b, c] = information(set);
        let determinant = a * c - b * b;
        match optimality {
            Optimality::D => determinant,
            Optimality::A => -(a + c) / determinant,
        }
    }

    #[test]
    fn greedy_choice_equals_the_choice_by_recomputation() {
        let dense = Matrix::from_fn(LOCATIONS, LOCATIONS, covariance).unwrap();
        let noise = NoiseCovariance::new(&NoiseModel::Dense(dense), LOCATIONS, 0.0).unwrap();
        let rows = Matrix::from_fn(LOCATIONS, 2, sensitivity).unwrap();
        for optimality in [Optimality::A, Optimality::D] {
            let chosen = greedy(&rows, Some(&noise), 6, optimality);
            // From the second on: the first compares numbers of the size of the prior.
            for step in 1..6 {
                let best =
                    (0..LOCATIONS).filter(|at| !chosen[..step].contains(at)).max_by(|&a, &b| {
                        let with = |at| worth(&[&chosen[..step], &[at]].concat(), optimality);
                        with(a).total_cmp(&with(b))
                    });
                assert_eq!(best, Some(chosen[step]), "{optimality:?} step {step}");
            }
        }
    }

    #[test]
    fn closed_form_pivots_of_unit_modes() {
        // Two modes that live on one location each, the second weaker.
        let modes = Matrix::from_columns(&[[0.0, 1.0, 0.1, 0.0], [0.0, 0.0, 0.0, 0.9]]).unwrap();
        assert_eq!(qdeim(&modes, 2), [1, 3]);
        // A third location beyond the modes: the greatest leverage left.
        assert_eq!(qdeim(&modes, 3), [1, 3, 2]);
    }

    #[test]
    fn uniform_locations_keep_half_a_step_from_the_ends() {
        assert_eq!(uniform(100, 4), [12, 37, 62, 87]);
        assert_eq!(uniform(5, 5), [0, 1, 2, 3, 4]);
    }
}
