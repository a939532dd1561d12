//! Part of the low-fidelity model's error that looks like another machine.
//!
//! The taper of the error's covariance `S` (`error_model`) leaves out what the error has in common at
//! times far apart. A play that the model crosses a little too late at every reversal is such a part: it
//! looks like a wider play. It is an error of the quantities `q`,
//!
//! ```text
//! y_HF − y_LF(q) − m(q) = J·e + r        e ~ N(0, D),  r ~ N(0, S)
//! ```
//!
//! with `J` the slopes in the quantities that damage moves. Of each unit left out, with its residual `d`
//! and noise in `Σ = S + N`,
//!
//! ```text
//! ê = I⁻¹·Jᵀ·Σ⁻¹·d        I = Jᵀ·Σ⁻¹·J        V = I⁻¹·Jᵀ·Σ⁻¹·S·Σ⁻¹·J·I⁻¹
//! ```
//!
//! `D` is what the scatter of `ê` has beyond the mean of `V`, in those directions in which the ratio of
//! the two is beyond the largest that chance alone gives.
//!
//! # Source
//!
//! Error of a model embedded in its parameters: Sargsyan, Najm and Ghanem, *International Journal of
//! Chemical Kinetics* 47, 246, 2015. Largest eigenvalue: Johnstone, *The Annals of Statistics* 29, 295,
//! 2001.

use ema_sim::SimulationError;
use inference::{BandedCholesky, BandedMatrix, dot};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::{
    offline::estimator::gram,
    unit::{evidence::InCommon, monitor::UnitMonitor},
};

/// Error of the model in the quantities that damage moves.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EmbeddedError {
    /// `D` of machines with a narrow play.
    pub(crate) narrow: DMatrix<f64>,
    /// `D` of machines with a wide play.
    pub(crate) wide: DMatrix<f64>,
    /// Shares of it that recordings of one unit have in common.
    pub(crate) in_common: InCommon,
}

impl EmbeddedError {
    /// None, of so many quantities.
    pub(crate) fn none(quantities: usize) -> Self {
        let none = DMatrix::zeros(quantities, quantities);
        Self { narrow: none.clone(), wide: none, in_common: InCommon::default() }
    }

    /// `D` with a share of that of a wide play.
    pub(crate) fn of(&self, wideness: f64) -> DMatrix<f64> {
        mixed(&self.narrow, &self.wide, wideness)
    }
}

/// Covariance of a narrow play with a share of that of a wide one.
pub(crate) fn mixed(narrow: &DMatrix<f64>, wide: &DMatrix<f64>, wideness: f64) -> DMatrix<f64> {
    narrow * (1.0 - wideness) + wide * wideness
}

/// A machine with what its signal is off the model and the trend of the others.
#[derive(Clone, Debug)]
pub(crate) struct Off<'a> {
    pub(crate) monitor: UnitMonitor<'a>,
    pub(crate) at: &'a [f64],
    pub(crate) residual_a: &'a [f64],
}

/// Learnt error beside which that of the quantities is learnt, of machines with a play of one kind.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beside<'a> {
    /// Places of the quantities that damage moves.
    pub(crate) places: &'a [usize],
    /// Spread of every quantity.
    pub(crate) spread: &'a [f64],
    /// `S`.
    pub(crate) covariance: &'a BandedMatrix,
    /// Factor of `Σ`.
    pub(crate) whole: &'a BandedCholesky,
}

/// Score of a machine.
#[derive(Clone, Debug)]
pub(crate) struct Score {
    /// `ê`.
    pub(crate) estimate: DVector<f64>,
    /// `V`.
    pub(crate) expected: DMatrix<f64>,
}

/// Directions of the quantities in which machines of one kind scatter.
#[derive(Clone, Debug)]
pub(crate) struct Scatter {
    /// From quantities to directions in which the mean of `V` is one.
    white: DMatrix<f64>,
    /// Variance beyond that; zero where it is no more than chance gives.
    beyond: DVector<f64>,
    /// `D`.
    pub(crate) excess: DMatrix<f64>,
}

impl Beside<'_> {
    /// Covariance of the products of white rows with a white signal by the error, `R·L⁻¹·S·L⁻ᵀ·Rᵀ`.
    pub(crate) fn error_in(&self, mut rows: Vec<Vec<f64>>) -> DMatrix<f64> {
        self.whole.whiten_transposed_each(&mut rows);
        let through: Vec<Vec<f64>> = rows.iter().map(|row| self.covariance.times(row)).collect();
        // one order of each product, so that the matrix is its own transpose to the last bit
        let entry = |i: usize, j: usize| dot(&rows[i.max(j)], &through[i.min(j)]);
        DMatrix::from_fn(rows.len(), rows.len(), entry)
    }
}

impl Off<'_> {
    /// `None` where the signal does not show all of the quantities.
    pub(crate) fn score(&self, beside: &Beside<'_>) -> Result<Option<Score>, SimulationError> {
        let &Beside { places, spread, whole, .. } = beside;
        let mut slopes = self.monitor.slopes(self.at, places.iter().copied(), spread)?;
        whole.whiten_each(&mut slopes);
        let mut white = self.residual_a.to_vec();
        whole.whiten(&mut white);
        let count = places.len();
        let information = gram(&slopes);
        let descent = DVector::from_iterator(count, slopes.iter().map(|row| dot(row, &white)));
        let error = beside.error_in(slopes);
        let Some(inverse) = information.cholesky().map(|factor| factor.inverse()) else {
            return Ok(None);
        };
        let (estimate, expected) = (&inverse * descent, &inverse * error * &inverse);
        let is_finite = estimate.iter().chain(expected.iter()).all(|value| value.is_finite());
        Ok(is_finite.then_some(Score { estimate, expected }))
    }
}

impl Scatter {
    /// Scatter of the scores of machines; `None` of too few.
    pub(crate) fn of(scores: &[&Score]) -> Option<Self> {
        let (count, size) = (scores.len() as f64, scores.first()?.estimate.len());
        let mut expected = DMatrix::zeros(size, size);
        let mut found = DMatrix::zeros(size, size);
        for score in scores {
            expected += &score.expected / count;
            found += &score.estimate * score.estimate.transpose() / count;
        }
        let lower = expected.cholesky()?.l();
        let half = lower.solve_lower_triangular(&found)?;
        let ratio = lower.solve_lower_triangular(&half.transpose())?;
        let ratio = SymmetricEigen::new(0.5 * (&ratio + ratio.transpose()));
        let edge = largest_by_chance(scores.len(), size);
        let beyond = ratio.eigenvalues.map(|value| if value > edge { value - 1.0 } else { 0.0 });
        let directions = &lower * &ratio.eigenvectors;
        let excess = &directions * DMatrix::from_diagonal(&beyond) * directions.transpose();
        let inverse = lower.solve_lower_triangular(&DMatrix::identity(size, size))?;
        Some(Self { white: ratio.eigenvectors.transpose() * inverse, beyond, excess })
    }

    /// Covariance of two recordings of a machine beyond that of the rest of the error, of which they
    /// have a share in common, and the variance beyond it: each summed over the directions that have any.
    pub(crate) fn in_common(&self, [first, second]: [&Score; 2], rest: f64) -> [f64; 2] {
        let [first, second] = [first, second].map(|score| &self.white * &score.estimate);
        let mut sums = [0.0; 2];
        for (direction, &beyond) in self.beyond.iter().enumerate() {
            if beyond > 0.0 {
                sums[0] += first[direction] * second[direction] - rest;
                sums[1] += beyond;
            }
        }
        sums
    }
}

/// Largest eigenvalue that the scatter of some normal vectors of unit covariance has, but for a chance of
/// 1 %.
fn largest_by_chance(vectors: usize, size: usize) -> f64 {
    /// 99 % quantile of the Tracy–Widom distribution of order 1.
    const QUANTILE: f64 = 2.023;
    let [a, b] = [(vectors as f64 - 1.0).sqrt(), (size as f64).sqrt()];
    let scale = (a + b) * (1.0 / a + 1.0 / b).cbrt();
    ((a + b).powi(2) + QUANTILE * scale) / vectors as f64
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::seed::{Draws, Purpose, RootSeed};

    fn scores(beyond: f64) -> Vec<Score> {
        let mut random = Draws::new(RootSeed(5).derive(Purpose::Units, 0));
        let expected = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 2.0]);
        let lower = expected.clone().cholesky().unwrap().l();
        let one = |_| {
            let mut estimate = &lower * DVector::from_fn(2, |_, _| random.normal());
            estimate[0] += beyond.sqrt() * random.normal();
            Score { estimate, expected: expected.clone() }
        };
        (0..2000).map(one).collect()
    }

    fn excess(scores: &[Score]) -> Option<DMatrix<f64>> {
        Scatter::of(&scores.iter().collect::<Vec<_>>()).map(|scatter| scatter.excess)
    }

    #[test]
    fn recordings_of_a_machine_have_their_share_in_common() {
        let all = scores(9.0);
        let scatter = Scatter::of(&all.iter().collect::<Vec<_>>()).unwrap();
        let share = |pairs: &[[&Score; 2]]| {
            let sums = pairs.iter().map(|&pair| scatter.in_common(pair, 0.0));
            let [common, beyond] =
                sums.fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
            common / beyond
        };
        // a recording and itself have the rest in common too
        let itself: Vec<_> = all.iter().map(|one| [one, one]).collect();
        assert!(share(&itself) > 1.0, "{}", share(&itself));
        let others: Vec<_> = all.iter().zip(&all[1..]).map(|(one, other)| [one, other]).collect();
        assert!(share(&others).abs() < 0.1, "{}", share(&others));
    }

    #[test]
    fn the_excess_is_what_the_scatter_has_beyond_the_expected() {
        let found = excess(&scores(9.0)).unwrap();
        assert_relative_eq!(found[(0, 0)], 9.0, max_relative = 0.1);
        assert!(found[(1, 1)].abs() < 0.5, "{found}");
        assert_eq!(found, found.transpose());
    }

    #[test]
    fn no_excess_is_found_where_there_is_none() {
        assert_eq!(excess(&scores(0.0)).unwrap(), DMatrix::zeros(2, 2));
    }
}
