//! Part of the low-fidelity model's error that looks like an effect of the catalogue.
//!
//! The covariance `S` of the error is tapered (`error_model`): what the error has in common at times far
//! apart is no part of it, and may have the form of an effect that the machine does not have. Of each unit
//! left out, with its residual `d` at the machine as it is, in the notation of `unmodelled`,
//!
//! ```text
//! z = Cᵀ·Q·L⁻¹·d        Q = 1 − J·(Jᵀ·J + P⁻¹)⁻¹·Jᵀ        L·Lᵀ = S + N
//! â = M⁺·z              V = M⁺·Cᵀ·Q·L⁻¹·S·L⁻ᵀ·Q·C·M⁺
//! ```
//!
//! `A`, by which the model's error is taken to look like the effect, is what the scatter of `â` has
//! beyond the mean of `V` and beyond chance, learnt as that of the quantities is (`embedded_error`).
//!
//! # Source
//!
//! As `embedded_error`; score test: `unmodelled`.

use ema_sim::{EffectId, SimulationError};
use inference::dot;
use nalgebra::{DMatrix, DVector};

use crate::{
    offline::{
        error_model::{add_scaled, combination},
        estimator::gram,
    },
    unit::{
        embedded_error::{Beside, Off, Scatter, Score, mixed},
        quantities::Quantities,
        unmodelled::{EffectSlopes, Open},
    },
};

/// Covariance of an effect's amplitudes by which the model's error looks like it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EffectError {
    pub(crate) effect: EffectId,
    /// `A` of machines with a narrow play.
    pub(crate) narrow: DMatrix<f64>,
    /// `A` of machines with a wide play.
    pub(crate) wide: DMatrix<f64>,
}

impl EffectError {
    /// Learns from the scores of machines with a narrow play and with a wide one; `None` where the error
    /// does not look like the effect.
    pub(crate) fn of(effect: EffectId, narrow: &[&Score], wide: &[&Score]) -> Option<Self> {
        let amplitudes = narrow.iter().chain(wide).next()?.estimate.len();
        let [narrow, wide] = [narrow, wide].map(|scores| {
            let none = || DMatrix::zeros(amplitudes, amplitudes);
            Scatter::of(scores).map_or_else(none, |scatter| scatter.excess)
        });
        let is_some = narrow.iter().chain(&wide).any(|value| *value != 0.0);
        is_some.then_some(Self { effect, narrow, wide })
    }

    /// `A` with a share of that of a wide play.
    pub(crate) fn mixed(&self, wideness: f64) -> DMatrix<f64> {
        mixed(&self.narrow, &self.wide, wideness)
    }
}

impl Off<'_> {
    /// Scores of a machine in the amplitudes of each effect, by slopes in them; `None` of one whose score
    /// is not finite.
    pub(crate) fn effect_scores(
        &self,
        quantities: &Quantities,
        point: &[f64],
        effects: &[EffectSlopes],
        beside: &Beside<'_>,
    ) -> Result<Vec<Option<Score>>, SimulationError> {
        let mut shown = self.monitor.slopes(self.at, 0..self.at.len(), beside.spread)?;
        beside.whole.whiten_each(&mut shown);
        let mut white = self.residual_a.to_vec();
        beside.whole.whiten(&mut white);
        let by_unknown = quantities.slopes(point);
        let slopes: Vec<Vec<f64>> =
            by_unknown.iter().map(|by| combination(by, &shown, white.len())).collect();
        let Some(covariance) = covariance(quantities, &slopes) else {
            return Ok(vec![None; effects.len()]);
        };
        let score = |effect: &EffectSlopes| {
            let mut rows = effect.rows.clone();
            beside.whole.whiten_each(&mut rows);
            let open = Open::of(&rows, &slopes, &covariance)?;
            let explained = &covariance * &open.shared;
            for (row, by) in rows.iter_mut().zip(explained.column_iter()) {
                for (slope, by) in slopes.iter().zip(by.iter()) {
                    add_scaled(row, -by, slope);
                }
            }
            let seen = DVector::from_iterator(rows.len(), rows.iter().map(|row| dot(row, &white)));
            let estimate = &open.to_amplitudes * open.white(&seen)?;
            let of_score = beside.error_in(rows);
            let inverse = &open.to_amplitudes * open.to_amplitudes.transpose();
            // a direction that is not open has an error of its own size, so that none is found there
            let closed = &open.closed * open.closed.transpose();
            let expected = &inverse * of_score * &inverse + closed;
            let is_finite = estimate.iter().chain(&expected).all(|value| value.is_finite());
            is_finite.then_some(Score { estimate, expected })
        };
        Ok(effects.iter().map(score).collect())
    }
}

/// `(Jᵀ·J + P⁻¹)⁻¹` of white slopes in the unknowns, with no prior on damage.
fn covariance(quantities: &Quantities, slopes: &[Vec<f64>]) -> Option<DMatrix<f64>> {
    let (count, layout) = (slopes.len(), quantities.layout());
    let mut information = gram(slopes);
    for (number, place) in layout.numbers.iter().zip(layout.sought.len()..count) {
        information[(place, place)] += number.scatter.together().powi(-2);
    }
    Some(information.cholesky()?.inverse())
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::seed::{Draws, Purpose, RootSeed};

    /// Scores that scatter with a variance beyond the expected one.
    fn scores(beyond: f64) -> Vec<Score> {
        let mut random = Draws::new(RootSeed(9).derive(Purpose::Units, 0));
        let expected = DMatrix::from_row_slice(1, 1, &[4.0]);
        let estimate = |_| DVector::from_element(1, (4.0 + beyond).sqrt() * random.normal());
        let all = (0..1000).map(estimate);
        all.map(|estimate| Score { estimate, expected: expected.clone() }).collect()
    }

    fn error(narrow: f64, wide: f64) -> Option<EffectError> {
        let [narrow, wide] = [narrow, wide].map(scores);
        let [narrow, wide] = [&narrow, &wide].map(|all| all.iter().collect::<Vec<_>>());
        EffectError::of(EffectId::Cogging, &narrow, &wide)
    }

    #[test]
    fn an_error_is_kept_where_scores_scatter_beyond_chance() {
        assert_eq!(error(0.0, 0.0), None);
        let found = error(0.0, 12.0).unwrap();
        assert_eq!(found.mixed(0.0)[(0, 0)], 0.0);
        assert_relative_eq!(found.mixed(1.0)[(0, 0)], 12.0, max_relative = 0.15);
        assert_relative_eq!(found.mixed(0.5), 0.5 * &found.wide);
    }
}
