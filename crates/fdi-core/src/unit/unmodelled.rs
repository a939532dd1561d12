//! Physics that the model file does not have, as a residual shows it.
//!
//! ```text
//! r = y − J·x̂ − C·s        M = Cᵀ·C − Cᵀ·J·(Jᵀ·J + P⁻¹)⁻¹·Jᵀ·C        z = Cᵀ·r
//! D = zᵀ·M⁻¹·z ~ χ²        one degree of freedom an amplitude
//! ```
//!
//! with all rows white, `J` the slopes of the signal in damage and numbers, `P` the numbers' prior,
//! and `C` the slopes in the amplitudes of one effect of the catalogue on the nominal machine, its
//! shapes as usual. `D` is twice the logarithm of the likelihood ratio that the effect is worth
//! beside damage and tolerances, to first order: a residual as large as noise and learnt error allow
//! may still have the form of an effect, whose other part was taken for damage. Where the model's own
//! error looks like the effect beyond what its covariance says (`effect_error`), with a covariance `A` of
//! the amplitudes,
//!
//! ```text
//! D = zᵀ·(M + M·A·M)⁻¹·z
//! ```
//!
//! # Source
//!
//! Score test: Rao, Proc. Camb. Phil. Soc. 44, 1948; Bonferroni's inequality over the effects.

use ema_sim::{Effect, EffectId, Geometry, MachineScales, Role};
use inference::{MostProbable, SymmetricMatrix, Unknown, dot};
use nalgebra::{DMatrix, DVector, DVectorView, SymmetricEigen};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Chance that any effect is seen in the residual of a machine that has none.
const FALSE_ALARM_RATE: f64 = 1e-3;
/// Share of an effect's white size below which a direction of it counts as one that damage and
/// numbers explain.
const LEAST_SHARE: f64 = 1e-3;
/// Size of an effect for its slope, over its typical size.
const STEP_OF_TYPICAL: f64 = 0.1;
/// Difference of `D` over its limit below which two effects are as good an explanation.
pub(crate) const AS_GOOD: f64 = 10.0;

/// Slopes of a signal in the amplitudes of one effect.
#[derive(Clone, Debug)]
pub(crate) struct EffectSlopes {
    pub(crate) effect: EffectId,
    pub(crate) rows: Vec<Vec<f64>>,
}

/// A most probable explanation as white rows.
#[derive(Clone, Debug)]
pub(crate) struct Explanation<'a> {
    residual: &'a [f64],
    /// One row an unknown, `J`.
    slopes: &'a [Vec<f64>],
    /// Covariance of the unknowns.
    covariance: DMatrix<f64>,
    /// The step that a search ends before, whose gain is no effect's.
    step: DVector<f64>,
}

/// Each effect with its amplitudes, one at a time at a small size.
pub(crate) fn small_effects(
    scales: &MachineScales,
    effects: &[EffectId],
) -> Vec<(EffectId, Vec<(Effect, f64)>)> {
    let small = |&id: &EffectId| {
        let parameters = id.info().parameters.iter();
        let amplitudes = parameters.filter(|parameter| parameter.role() == Role::Amplitude);
        let one = amplitudes.filter_map(|parameter| {
            let size = STEP_OF_TYPICAL * parameter.typical_size(scales);
            let mut effect = Effect::new(id, Geometry::Rotary);
            effect.set(parameter.key(Geometry::Rotary), size).ok()?;
            Some((effect, size))
        });
        (id, one.collect())
    };
    effects.iter().map(small).collect()
}

/// Effects of the catalogue that a machine with some effects does not have.
pub(crate) fn absent(present: &[Effect]) -> Vec<EffectId> {
    let is_absent =
        |id: &EffectId| !id.info().takes_curve && present.iter().all(|effect| effect.id() != *id);
    EffectId::ALL.into_iter().filter(is_absent).collect()
}

/// Effects that a residual has the form of beyond chance: the clearest, then those that are as good.
/// Given for each effect is the covariance of its amplitudes by which the model's own error looks like it,
/// where it does.
pub(crate) fn unmodelled(
    explanation: &Explanation<'_>,
    effects: &[EffectSlopes],
    own_error: impl Fn(EffectId) -> Option<DMatrix<f64>>,
) -> Vec<EffectId> {
    let excess = |effect: &EffectSlopes| {
        let gain = explanation.gain(&effect.rows, own_error(effect.effect).as_ref())?;
        Some((effect.effect, gain.value - gain.limit(effects.len())))
    };
    let mut beyond: Vec<_> =
        effects.iter().filter_map(excess).filter(|(_, excess)| *excess > 0.0).collect();
    beyond.sort_by(|(_, one), (_, other)| other.total_cmp(one));
    let most = beyond.first().map_or(0.0, |(_, excess)| *excess);
    beyond.retain(|(_, excess)| most - excess < AS_GOOD);
    beyond.into_iter().map(|(effect, _)| effect).collect()
}

/// Gain of an effect.
#[derive(Clone, Debug)]
pub(crate) struct Gain {
    /// Twice the logarithm of the likelihood ratio, `D`.
    pub(crate) value: f64,
    pub(crate) degrees: f64,
    /// Most probable amplitudes, in the unit of the slopes.
    pub(crate) amplitudes: Vec<f64>,
    /// Moves of the unknowns beside these amplitudes.
    pub(crate) moves: Vec<f64>,
    /// Share of the effect's white size that damage and numbers leave open.
    pub(crate) open_share: f64,
    /// White square of one unit of the first amplitude, as far as it is open.
    pub(crate) open_square: f64,
}

impl Gain {
    /// Value that chance exceeds at the rate allowed, where so many effects are looked at.
    pub(crate) fn limit(&self, effects: usize) -> f64 {
        limit(self.degrees, effects)
    }
}

/// Gain that chance exceeds at the rate allowed, by the amplitudes of an effect among so many that are
/// looked at.
pub(crate) fn limit(degrees: f64, effects: usize) -> f64 {
    let rate = FALSE_ALARM_RATE / effects.max(1) as f64;
    ChiSquared::new(degrees).map_or(f64::INFINITY, |law| law.inverse_cdf(1.0 - rate))
}

impl<'a> Explanation<'a> {
    /// An explanation, by half of the descent of the sum of squares at it.
    fn new(
        residual: &'a [f64],
        slopes: &'a [Vec<f64>],
        covariance: &SymmetricMatrix,
        descent: Vec<f64>,
    ) -> Self {
        let unknowns = slopes.len();
        let covariance = DMatrix::from_fn(unknowns, unknowns, |i, j| covariance.at(i, j));
        let step = &covariance * DVector::from_vec(descent);
        Self { residual, slopes, covariance, step }
    }

    /// The explanation at a most probable point, by the white slopes in its unknowns.
    pub(crate) fn at(
        found: &'a MostProbable,
        slopes: &'a [Vec<f64>],
        unknowns: &[Unknown],
    ) -> Self {
        let descent = slopes.iter().zip(unknowns).zip(&found.numbers).map(|((row, one), x)| {
            dot(row, &found.white) - one.prior_std.map_or(0.0, |std| x / (std * std))
        });
        Self::new(&found.white, slopes, &found.covariance, descent.collect())
    }

    /// `D` of an effect, beside an own error of the model that looks like it; `None` where it is not
    /// finite.
    pub(crate) fn gain(&self, rows: &[Vec<f64>], own_error: Option<&DMatrix<f64>>) -> Option<Gain> {
        let open = Open::of(rows, self.slopes, &self.covariance)?;
        let seen = DVector::from_fn(rows.len(), |i, _| dot(&rows[i], self.residual))
            - open.shared.tr_mul(&self.step);
        let white = open.white(&seen)?;
        let value = match own_error {
            Some(own_error) => {
                let with = DMatrix::identity(white.len(), white.len()) + open.whitened(own_error);
                white.dot(&with.cholesky()?.solve(&white))
            }
            None => white.norm_squared(),
        };
        let amplitudes = &open.to_amplitudes * &white;
        let moves = &self.step - &self.covariance * (&open.shared * &amplitudes);
        let (amplitudes, moves) = (amplitudes.data.into(), moves.data.into());
        let (open_share, open_square) = (open.share, open.square);
        let degrees = white.len() as f64;
        Some(Gain { value, degrees, amplitudes, moves, open_share, open_square })
    }
}

/// Part of an effect that damage and numbers leave open: directions of its amplitudes in which its
/// score has unit variance.
#[derive(Clone, Debug)]
pub(crate) struct Open {
    /// `Jᵀ·C`.
    pub(crate) shared: DMatrix<f64>,
    /// From directions to amplitudes, `T`: `Tᵀ·M·T = 1`.
    pub(crate) to_amplitudes: DMatrix<f64>,
    /// Directions that are not open, an amplitude each of the effect's white size.
    pub(crate) closed: DMatrix<f64>,
    /// `M·T`.
    scored: DMatrix<f64>,
    /// Share of the effect's white size that is open.
    share: f64,
    /// White square of one unit of the first amplitude, as far as it is open.
    square: f64,
}

impl Open {
    /// Part that white slopes in the amplitudes leave open, by those in the unknowns and their covariance;
    /// `None` where it is not finite.
    pub(crate) fn of(
        rows: &[Vec<f64>],
        slopes: &[Vec<f64>],
        covariance: &DMatrix<f64>,
    ) -> Option<Self> {
        let (count, unknowns) = (rows.len(), slopes.len());
        let shared = DMatrix::from_fn(unknowns, count, |i, j| dot(&slopes[i], &rows[j]));
        let own = DMatrix::from_fn(count, count, |i, j| dot(&rows[i], &rows[j]));
        // each amplitude by its own white size, so that units do not matter
        let size =
            DVector::from_fn(count, |i, _| own[(i, i)].sqrt().max(f64::MIN_POSITIVE).recip());
        let open = &own - shared.tr_mul(&(covariance * &shared));
        let sized = DMatrix::from_fn(count, count, |i, j| size[i] * size[j] * open[(i, j)]);
        if !sized.iter().all(|value| value.is_finite()) {
            return None;
        }
        let (share, square) = (
            sized.trace() / count.max(1) as f64,
            sized.get(0).map_or(0.0, |first| first / (size[0] * size[0])),
        );
        let parts = SymmetricEigen::new(sized);
        let columns = |is_open: bool| {
            let all = parts.eigenvalues.iter().zip(parts.eigenvectors.column_iter());
            let kept = all.filter(|(share, _)| (**share > LEAST_SHARE) == is_open);
            let column = |(share, along): (&f64, DVectorView<'_, f64>)| {
                let by = if is_open { share.sqrt().recip() } else { 1.0 };
                by * along.component_mul(&size)
            };
            let columns: Vec<DVector<f64>> = kept.map(column).collect();
            let filled = |row: usize, column: usize| columns[column][row];
            DMatrix::from_fn(count, columns.len(), filled)
        };
        let (to_amplitudes, closed) = (columns(true), columns(false));
        let scored = &open * &to_amplitudes;
        Some(Self { shared, to_amplitudes, closed, scored, share, square })
    }

    /// `Tᵀ·z`, of unit variance; `None` where it is not finite.
    pub(crate) fn white(&self, score: &DVector<f64>) -> Option<DVector<f64>> {
        let white = self.to_amplitudes.tr_mul(score);
        white.iter().all(|value| value.is_finite()).then_some(white)
    }

    /// Covariance of the white score by a covariance of the amplitudes, `Tᵀ·M·A·M·T`.
    fn whitened(&self, amplitudes: &DMatrix<f64>) -> DMatrix<f64> {
        self.scored.tr_mul(&(amplitudes * &self.scored))
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::seed::{Draws, RootSeed};

    /// Rows of normal numbers.
    fn rows(random: &mut Draws, count: usize, length: usize) -> Vec<Vec<f64>> {
        (0..count).map(|_| (0..length).map(|_| random.normal()).collect()).collect()
    }

    /// `(Jᵀ·J + 1)⁻¹`.
    fn covariance(slopes: &[Vec<f64>]) -> DMatrix<f64> {
        let count = slopes.len();
        let information = DMatrix::from_fn(count, count, |i, j| {
            dot(&slopes[i], &slopes[j]) + if i == j { 1.0 } else { 0.0 }
        });
        information.try_inverse().unwrap()
    }

    /// `D` of an effect in a signal, the unknowns with a prior of one.
    fn gain(signal: &[f64], slopes: &[Vec<f64>], effect: &EffectSlopes) -> f64 {
        gain_beside(signal, slopes, effect, None)
    }

    fn gain_beside(
        signal: &[f64],
        slopes: &[Vec<f64>],
        effect: &EffectSlopes,
        own_error: Option<&DMatrix<f64>>,
    ) -> f64 {
        let of_unknowns = covariance(slopes);
        // at zero, from which the one step leads to the most probable unknowns
        let descent: Vec<f64> = slopes.iter().map(|row| dot(row, signal)).collect();
        let of_unknowns = SymmetricMatrix::from_fn(slopes.len(), |i, j| of_unknowns[(i, j)]);
        let explanation = Explanation::new(signal, slopes, &of_unknowns, descent);
        explanation.gain(&effect.rows, own_error).unwrap().value
    }

    #[test]
    fn an_error_of_the_model_that_looks_like_the_effect_is_chance() {
        let mut random = Draws::new(RootSeed(7).derive(crate::seed::Purpose::Units, 0));
        let slopes = rows(&mut random, 3, 40);
        let effect = EffectSlopes { effect: EffectId::Cogging, rows: rows(&mut random, 2, 40) };
        let own_error = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 2.0]);
        let root = own_error.clone().cholesky().unwrap().l();
        let count = 2000;
        let mut means = [0.0; 2];
        for _ in 0..count {
            let mut signal = rows(&mut random, 1, 40).remove(0);
            let unknowns: Vec<f64> = slopes.iter().map(|_| random.normal()).collect();
            let amplitudes = &root * DVector::from_fn(2, |_, _| random.normal());
            let parts = slopes.iter().zip(&unknowns).chain(effect.rows.iter().zip(&amplitudes));
            for (row, by) in parts {
                signal.iter_mut().zip(row).for_each(|(value, slope)| *value += by * slope);
            }
            for (mean, own_error) in means.iter_mut().zip([Some(&own_error), None]) {
                *mean += gain_beside(&signal, &slopes, &effect, own_error) / f64::from(count);
            }
        }
        // a mean of 2000 numbers with a variance of four
        let [beside, alone] = means;
        assert!((beside - 2.0).abs() < 4.0 * (4.0 / f64::from(count)).sqrt(), "{beside}");
        assert!(alone > 50.0, "{alone}");
    }

    #[test]
    fn chance_gives_as_much_as_the_effect_has_amplitudes() {
        let mut random = Draws::new(RootSeed(3).derive(crate::seed::Purpose::Units, 0));
        let slopes = rows(&mut random, 4, 60);
        let effect = EffectSlopes { effect: EffectId::Cogging, rows: rows(&mut random, 2, 60) };
        let count = 2000;
        let gains = (0..count).map(|_| {
            let unknowns: Vec<f64> = (0..slopes.len()).map(|_| random.normal()).collect();
            let signal: Vec<f64> = (0..60)
                .map(|t| {
                    let explained: f64 =
                        slopes.iter().zip(&unknowns).map(|(row, x)| row[t] * x).sum();
                    explained + random.normal()
                })
                .collect();
            gain(&signal, &slopes, &effect)
        });
        let mean = gains.sum::<f64>() / f64::from(count);
        // a mean of 2000 numbers with a variance of four
        assert!((mean - 2.0).abs() < 4.0 * (4.0 / f64::from(count)).sqrt(), "{mean}");
    }

    #[test]
    fn units_of_an_amplitude_do_not_matter_and_what_is_explained_is_worth_nothing() {
        let mut random = Draws::new(RootSeed(5).derive(crate::seed::Purpose::Units, 0));
        let slopes = rows(&mut random, 3, 40);
        let signal = rows(&mut random, 1, 40).remove(0);
        let of = |rows: Vec<Vec<f64>>| EffectSlopes { effect: EffectId::Cogging, rows };
        let own = rows(&mut random, 2, 40);
        let scaled =
            own.iter().zip([1e6, 1e-3]).map(|(row, by)| row.iter().map(|x| x * by).collect());
        let (own, scaled) = (of(own.clone()), of(scaled.collect()));
        let found = gain(&signal, &slopes, &own);
        assert_relative_eq!(found, gain(&signal, &slopes, &scaled), max_relative = 1e-9);
        let mut with: Vec<f64> = signal.clone();
        for (value, slope) in with.iter_mut().zip(&own.rows[0]) {
            *value += 3.0 * slope;
        }
        assert!(gain(&with, &slopes, &own) > found + 100.0);
        // of what an unknown does, the prior alone tells a part
        let explained = of(vec![slopes[1].iter().map(|x| 7.0 * x).collect()]);
        let by_prior = gain(&slopes[1], &slopes, &explained);
        assert!(by_prior < 1.1, "{by_prior}");
    }
}
