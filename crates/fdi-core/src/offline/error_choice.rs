//! Which error model a bundle has: the one with which a diagnosis errs least, told by the
//! reference signals alone.
//!
//! For every candidate each reference signal `y_i` is diagnosed, to first order, by the model that
//! does not know it:
//!
//! ```text
//! δ_i = (JᵀΣ⁻¹J)⁻¹·JᵀΣ⁻¹·r_i      Σ = S without the fold of i, with the noise expected
//! ```
//!
//! with `r_i` the leave-one-out residual and `J` the slopes of low-fidelity model and mean at the
//! true damage. The score is the mean over the coordinates of `ln(mean of δ²)`, the noise's own
//! share of the variance included: half of it is the logarithm of the error to be expected. A model
//! that explains the residuals better but lends the search slopes of its own noise loses here,
//! while it wins on the likelihood of left-out signals.
//!
//! # Source
//!
//! Derived in `docs/models/diagnosis.md`, section "Error of the monitor"; compared with other criteria
//! in `docs/decisions/0040-error-model-by-cross-fitted-error.md`.

use std::{sync::Arc, thread};

use inference::{BandedMatrix, NotPositiveDefinite, dot};

use crate::offline::{
    error_model::{CovarianceShape, ErrorModel, ErrorModelError, FOLDS, Trend},
    estimator::Estimator,
    factor::{Factor, joined},
};

/// Shares of the electronics' covariance that are tried.
const ELECTRONICS_SHARES: [f64; 4] = [0.0, 0.25, 0.5, 0.75];
/// Reach of the tapers that are tried, s.
const TAPER_SUPPORTS_S: [f64; 5] = [0.010, 0.020, 0.040, 0.080, 0.120];
/// Most reference signals that are diagnosed for a score.
const MOST_DIAGNOSED: usize = 60;

/// Reference less low-fidelity model at conditions, with the low-fidelity model's slopes there.
pub(crate) struct References {
    /// One a condition, A.
    pub(crate) differences: Vec<Vec<f64>>,
    /// Coordinates looked for, one row a condition.
    pub(crate) coordinates: Vec<Vec<f64>>,
    /// Slopes of the low-fidelity model, one row a coordinate, for every condition; empty where
    /// there is no such model.
    pub(crate) jacobians: Vec<Vec<Vec<f64>>>,
    /// Covariance of the noise of the electronics; none for signals without it.
    pub(crate) electronics: Option<Arc<BandedMatrix>>,
}

/// Trend and covariance with the least error of cross-fitted diagnoses.
///
/// `rate_hz` is that of the signal, `noise` the covariance of the noise expected of sensors.
/// Trends are compared, each on a thread of its own, with the covariance that suits it: the best
/// taper, the best share of the electronics with it, and the best taper with that share.
///
/// # Errors
///
/// [`ErrorModelError`] when no candidate can be learnt.
pub(crate) fn choose(
    references: &References,
    trends: &[Trend],
    rate_hz: f64,
    noise: &BandedMatrix,
) -> Result<(Trend, CovarianceShape), ErrorModelError> {
    let supports: Vec<usize> = TAPER_SUPPORTS_S
        .iter()
        .map(|support_s| (support_s * rate_hz).round().max(2.0) as usize)
        .collect();
    let tried: Vec<Result<_, ErrorModelError>> = thread::scope(|scope| {
        let supports = &supports;
        let handles: Vec<_> = trends
            .iter()
            .map(|&trend| {
                scope.spawn(move || {
                    let (shape, score) = Trial::new(trend, references, noise)?.improve(supports)?;
                    Ok((score, trend, shape))
                })
            })
            .collect();
        handles.into_iter().map(|handle| handle.join().expect("a trial does not panic")).collect()
    });
    let mut best: Option<(f64, Trend, CovarianceShape)> = None;
    let mut failure = ErrorModelError::DegenerateConditions;
    for trial in tried {
        match trial {
            Ok(candidate) if best.is_none_or(|(least, ..)| candidate.0 < least) => {
                best = Some(candidate);
            }
            Ok(_) => {}
            Err(error @ ErrorModelError::TooFewSignals { .. }) => failure = error,
            Err(error) => return Err(error),
        }
    }
    best.map(|(_, trend, shape)| (trend, shape)).ok_or(failure)
}

/// Longest taper that is tried, in samples.
pub(crate) fn longest_support(rate_hz: f64) -> usize {
    TAPER_SUPPORTS_S.iter().map(|s| (s * rate_hz).round() as usize).max().unwrap_or(2)
}

/// A trend under trial.
struct Trial<'a> {
    folds: Vec<Fold>,
    electronics: Option<&'a BandedMatrix>,
    noise: &'a BandedMatrix,
}

/// A model that does not know some reference signals, and these.
struct Fold {
    model: ErrorModel,
    left_out: Vec<LeftOut>,
}

/// A reference signal less the low-fidelity model and the mean that does not know it, with the
/// slopes there.
struct LeftOut {
    residual: Vec<f64>,
    jacobian: Vec<Vec<f64>>,
}

impl<'a> Trial<'a> {
    fn new(
        trend: Trend,
        references: &'a References,
        noise: &'a BandedMatrix,
    ) -> Result<Self, ErrorModelError> {
        let count = references.coordinates.len();
        let every = count.div_ceil(MOST_DIAGNOSED).max(1);
        let folds = (0..FOLDS)
            .map(|fold| {
                let model = references.model_without(fold, trend)?;
                let left_out = (fold..count)
                    .step_by(FOLDS * every)
                    .map(|row| references.left_out(row, &model))
                    .collect();
                Ok(Fold { model, left_out })
            })
            .collect::<Result<_, ErrorModelError>>()?;
        Ok(Self { folds, electronics: references.electronics.as_deref(), noise })
    }

    /// The best shape with its score.
    fn improve(&self, supports: &[usize]) -> Result<(CovarianceShape, f64), NotPositiveDefinite> {
        let shares = if self.electronics.is_some() { &ELECTRONICS_SHARES[..] } else { &[0.0] };
        let mut best = None;
        self.offer(&mut best, supports.iter().map(|&s| CovarianceShape::tapered(s)));
        let from = best.map_or(CovarianceShape::tapered(2), |(shape, _)| shape);
        let of_share = |&electronics_share| CovarianceShape { electronics_share, ..from };
        self.offer(&mut best, shares.iter().map(of_share));
        let from = best.map_or(from, |(shape, _)| shape);
        if from.electronics_share > 0.0 {
            let of_taper =
                |&taper_support_samples| CovarianceShape { taper_support_samples, ..from };
            self.offer(&mut best, supports.iter().map(of_taper));
        }
        best.ok_or(NotPositiveDefinite { row: 0, pivot: 0.0 })
    }

    /// Scores candidates and keeps the best; one without a factor is passed over.
    fn offer(
        &self,
        best: &mut Option<(CovarianceShape, f64)>,
        candidates: impl Iterator<Item = CovarianceShape>,
    ) {
        for shape in candidates {
            if best.is_some_and(|(kept, _)| kept == shape) {
                continue;
            }
            if let Some(score) = self.score(shape)
                && best.is_none_or(|(_, least)| score < least)
            {
                *best = Some((shape, score));
            }
        }
    }

    /// Mean over the coordinates of `ln(mean of δ²)`.
    fn score(&self, shape: CovarianceShape) -> Option<f64> {
        let order = self.folds.iter().flat_map(|f| &f.left_out).next()?.jacobian.len();
        let (mut squares, mut count) = (vec![0.0; order], 0.0);
        let noisy = self.noise.mean_diagonal() > 0.0;
        for fold in &self.folds {
            let modelled = shape.covariance(fold.model.residuals(), self.electronics);
            let factor = Factor::new(joined(&modelled, self.noise), None).ok()?;
            let jacobians: Vec<&[Vec<f64>]> =
                fold.left_out.iter().map(|one| one.jacobian.as_slice()).collect();
            let estimators = Estimator::each(&factor, &jacobians)?;
            for (LeftOut { residual, .. }, estimator) in fold.left_out.iter().zip(estimators) {
                let shift = estimator.apply(residual);
                for (coordinate, square) in squares.iter_mut().enumerate() {
                    *square += shift[coordinate] * shift[coordinate];
                    if noisy {
                        let weight = estimator.weight(coordinate);
                        *square += dot(weight, &self.noise.times(weight));
                    }
                }
                count += 1.0;
            }
        }
        Some(squares.iter().map(|square| (square / count).ln()).sum::<f64>() / order as f64)
    }
}

impl References {
    /// The error model of a trend learnt without a fold.
    fn model_without(&self, fold: usize, trend: Trend) -> Result<ErrorModel, ErrorModelError> {
        let others = |rows: &[Vec<f64>]| -> Vec<Vec<f64>> {
            let kept = rows.iter().enumerate().filter(|(row, _)| row % FOLDS != fold);
            kept.map(|(_, values)| values.clone()).collect()
        };
        let (differences, coordinates) = (others(&self.differences), others(&self.coordinates));
        ErrorModel::learn(&differences, &coordinates, trend, CovarianceShape::tapered(2), None)
    }

    /// The error model that was chosen.
    pub(crate) fn learn(
        &self,
        trend: Trend,
        shape: CovarianceShape,
    ) -> Result<ErrorModel, ErrorModelError> {
        let electronics = self.electronics.clone();
        ErrorModel::learn(&self.differences, &self.coordinates, trend, shape, electronics)
    }

    /// A reference signal as a model sees it that does not know it.
    fn left_out(&self, row: usize, model: &ErrorModel) -> LeftOut {
        let point = &self.coordinates[row];
        let mut residual = self.differences[row].clone();
        for (value, mean) in residual.iter_mut().zip(model.mean_at(point)) {
            *value -= mean;
        }
        let mut jacobian = model.mean_jacobian(point);
        for (whole, part) in jacobian.iter_mut().zip(self.jacobians.get(row).into_iter().flatten())
        {
            for (value, slope) in whole.iter_mut().zip(part) {
                *value += slope;
            }
        }
        LeftOut { residual, jacobian }
    }
}
