//! Error of the low-fidelity model, learnt from reference signals: offset, trend and covariance.
//!
//! ```text
//! y_HF(k) − y_LF(k) = m + B·(c − c̄) + r,    r ~ N(0, S)
//! S = (1 − λ)·T + λ·S_e
//! T_ij = mean of the leave-one-out residuals r_i·r_j, times a taper in |t_i − t_j|
//! ```
//!
//! Without `m` healthy actuators show faults that they do not have; without `S` the stated
//! intervals are too narrow. The taper keeps what a hundred snapshots can tell, the covariance of
//! neighbouring samples, and drops what they cannot. `S_e` is what the low-fidelity model itself
//! says of the noise of its electronics (`electronics`), from as many runs as are wanted: the
//! scatter of a hundred signals is drawn towards it. What is best is chosen on the reference
//! signals (`error_choice`).
//!
//! # Source
//!
//! Derived in `docs/models/diagnosis.md`, section "Error of the monitor"; the taper is of Gaspari and
//! Cohn (Q. J. R. Meteorol. Soc. 125, 1999, eq. 4.10).

use std::sync::{Arc, OnceLock};

use inference::{BandedMatrix, NotPositiveDefinite, add_tapered_covariance, central_differences};
use nalgebra::DMatrix;

/// How the mean of the error depends on the damage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trend {
    /// Not at all.
    Constant,
    /// Linearly, in the coordinates.
    Linear,
    /// With squares and products of the coordinates too.
    Quadratic,
    /// With all products of up to four coordinates; of a low-fidelity model's signal, not of its
    /// error.
    Quartic,
}

impl Trend {
    /// Every trend of an error, from the simplest on.
    pub const ALL: [Self; 3] = [Self::Constant, Self::Linear, Self::Quadratic];

    /// The terms of the trend at a point away from the centre, the constant first.
    fn terms(self, away: &[f64]) -> Vec<f64> {
        let degree = match self {
            Self::Constant => 0,
            Self::Linear => 1,
            Self::Quadratic => 2,
            Self::Quartic => 4,
        };
        let mut terms = vec![1.0];
        // products of one degree, each with the place of its last factor
        let mut products = vec![(0, 1.0)];
        for _ in 0..degree {
            products = products
                .iter()
                .flat_map(|&(last, product)| {
                    away.iter().enumerate().skip(last).map(move |(i, a)| (i, product * a))
                })
                .collect();
            terms.extend(products.iter().map(|(_, product)| product));
        }
        terms
    }
}

/// Why an error model could not be learnt.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ErrorModelError {
    /// Too few reference signals for the trend.
    #[error("{found} reference signals cannot determine {needed} trend terms and a covariance")]
    TooFewSignals {
        /// Signals given.
        found: usize,
        /// Terms of the trend.
        needed: usize,
    },
    /// The conditions do not span the coordinates.
    #[error("the reference conditions do not span the damage coordinates")]
    DegenerateConditions,
    /// The tapered covariance has no factor.
    #[error(transparent)]
    Covariance(#[from] NotPositiveDefinite),
}

/// How the covariance is made of few residuals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CovarianceShape {
    /// Samples that the taper reaches.
    pub taper_support_samples: usize,
    /// Share of the electronics' covariance, `λ`, 0 to 1.
    pub electronics_share: f64,
}

impl CovarianceShape {
    /// A taper alone.
    pub fn tapered(taper_support_samples: usize) -> Self {
        Self { taper_support_samples, electronics_share: 0.0 }
    }

    /// `S` of residuals.
    pub(crate) fn covariance<R: AsRef<[f64]>>(
        self,
        residuals: &[R],
        electronics: Option<&BandedMatrix>,
    ) -> BandedMatrix {
        let samples = residuals.first().map_or(0, |residual| residual.as_ref().len());
        let electronics = electronics.filter(|_| self.electronics_share > 0.0);
        let half_band = electronics.map_or(0, BandedMatrix::half_band);
        let half_band = half_band.max(self.taper_support_samples.saturating_sub(1));
        let mut covariance = BandedMatrix::zeros(samples, half_band);
        self.add_covariance(&mut covariance, 1.0, residuals, electronics);
        covariance
    }

    /// Adds `scale` times `S` of residuals to a matrix with room for its band.
    fn add_covariance<R: AsRef<[f64]>>(
        self,
        to: &mut BandedMatrix,
        scale: f64,
        residuals: &[R],
        electronics: Option<&BandedMatrix>,
    ) {
        let electronics = electronics.filter(|_| self.electronics_share > 0.0);
        let share = electronics.map_or(0.0, |_| self.electronics_share);
        let support = self.taper_support_samples;
        add_tapered_covariance(to, scale * (1.0 - share), residuals, support);
        if let Some(electronics) = electronics {
            to.add_scaled(scale * share, electronics);
        }
    }
}

/// The learnt error of a low-fidelity model.
#[derive(Clone, Debug)]
pub struct ErrorModel {
    trend: Trend,
    /// One row a term of the trend.
    coefficients: Vec<Vec<f64>>,
    centre: Vec<f64>,
    /// Spread of the conditions in each coordinate, the unit that terms are formed in.
    spread: Vec<f64>,
    residuals: Vec<Vec<f64>>,
    shape: CovarianceShape,
    electronics: Option<Arc<BandedMatrix>>,
    /// `S`, formed when first asked for.
    covariance: OnceLock<BandedMatrix>,
}

impl ErrorModel {
    /// Learns from differences "reference less low-fidelity model" (one a condition, equal lengths)
    /// at damage coordinates (one row a condition), with the covariance of the electronics where
    /// the shape has a share of it.
    ///
    /// # Errors
    ///
    /// [`ErrorModelError`] for too few or degenerate conditions.
    pub(crate) fn learn(
        differences: &[Vec<f64>],
        coordinates: &[Vec<f64>],
        trend: Trend,
        shape: CovarianceShape,
        electronics: Option<Arc<BandedMatrix>>,
    ) -> Result<Self, ErrorModelError> {
        let count = differences.len();
        let dimension = coordinates.first().map_or(0, Vec::len);
        let moment = |power: i32, shift: &[f64]| -> Vec<f64> {
            (0..dimension)
                .map(|d| {
                    let sum: f64 = coordinates.iter().map(|c| (c[d] - shift[d]).powi(power)).sum();
                    sum / count.max(1) as f64
                })
                .collect()
        };
        let centre = moment(1, &vec![0.0; dimension]);
        let spread: Vec<f64> =
            moment(2, &centre).iter().map(|v| v.sqrt().max(f64::MIN_POSITIVE)).collect();
        let rows: Vec<Vec<f64>> =
            coordinates.iter().map(|c| trend.terms(&away(c, &centre, &spread))).collect();
        let terms = rows.first().map_or(1, Vec::len);
        if count < terms + 2 {
            return Err(ErrorModelError::TooFewSignals { found: count, needed: terms });
        }
        let design = DMatrix::from_fn(count, terms, |row, term| rows[row][term]);
        let gram = design.tr_mul(&design);
        let inverse = gram.cholesky().ok_or(ErrorModelError::DegenerateConditions)?.inverse();
        let pseudo = &inverse * design.transpose();
        let leverage: Vec<f64> =
            (0..count).map(|row| design.row(row).transpose().dot(&pseudo.column(row))).collect();
        let samples = differences[0].len();
        let mut fitted = vec![vec![0.0; samples]; terms];
        for (term, row) in fitted.iter_mut().enumerate() {
            for (weight, difference) in pseudo.row(term).iter().zip(differences) {
                add_scaled(row, *weight, difference);
            }
        }
        let residuals = differences
            .iter()
            .enumerate()
            .map(|(row, difference)| {
                let mut residual = difference.clone();
                for (term, values) in fitted.iter().enumerate() {
                    add_scaled(&mut residual, -design[(row, term)], values);
                }
                let left_out = 1.0 / (1.0 - leverage[row]).max(f64::EPSILON);
                for value in &mut residual {
                    *value *= left_out;
                }
                residual
            })
            .collect();
        let coefficients = fitted;
        let covariance = OnceLock::new();
        Ok(Self { trend, coefficients, centre, spread, residuals, shape, electronics, covariance })
    }

    /// The mean error at a point of the sought coordinates.
    pub fn mean_at(&self, coordinates: &[f64]) -> Vec<f64> {
        let terms = self.trend.terms(&away(coordinates, &self.centre, &self.spread));
        let mut mean = vec![0.0; self.coefficients[0].len()];
        for (coefficient, term) in self.coefficients.iter().zip(terms) {
            add_scaled(&mut mean, term, coefficient);
        }
        mean
    }

    /// Keeps the mean and takes other residuals, as learnt elsewhere; the taper reaches less far
    /// where there are fewer of them.
    #[must_use]
    pub(crate) fn with_residuals(&self, residuals: Vec<Vec<f64>>) -> Self {
        let reach = self.shape.taper_support_samples;
        let share = residuals.len() as f64 / self.residuals.len().max(1) as f64;
        let shorter = (reach as f64 * share.min(1.0)).round() as usize;
        Self {
            trend: self.trend,
            coefficients: self.coefficients.clone(),
            centre: self.centre.clone(),
            spread: self.spread.clone(),
            residuals,
            shape: CovarianceShape::tapered(shorter.max(2)),
            electronics: None,
            covariance: OnceLock::new(),
        }
    }

    /// Adds an offset to the mean, and makes the covariance larger by a factor.
    #[must_use]
    pub(crate) fn corrected(&self, offset: &[f64], factor: f64) -> Self {
        let mut corrected = self.clone();
        corrected.covariance = OnceLock::new();
        // the first term is the constant one
        add_scaled(&mut corrected.coefficients[0], 1.0, offset);
        for value in corrected.residuals.iter_mut().flatten() {
            *value *= factor.sqrt();
        }
        corrected.electronics =
            self.electronics.as_ref().map(|electronics| Arc::new(electronics.scaled(factor)));
        corrected
    }

    /// The covariance of the electronics, where the shape has a share of it.
    pub(crate) fn electronics(&self) -> Option<&Arc<BandedMatrix>> {
        self.electronics.as_ref()
    }

    /// Leave-one-out residuals, one a reference signal.
    pub fn residuals(&self) -> &[Vec<f64>] {
        &self.residuals
    }

    /// How the covariance is made.
    pub fn shape(&self) -> CovarianceShape {
        self.shape
    }

    /// The covariance `S`.
    pub fn covariance(&self) -> BandedMatrix {
        self.whole().clone()
    }

    fn whole(&self) -> &BandedMatrix {
        let electronics = self.electronics.as_deref();
        self.covariance.get_or_init(|| self.shape.covariance(&self.residuals, electronics))
    }

    /// Residuals that are dealt into a fold of [`FOLDS`].
    pub(crate) fn in_fold(&self, fold: usize) -> impl Iterator<Item = &Vec<f64>> {
        self.residuals.iter().skip(fold).step_by(FOLDS)
    }

    /// The covariance learnt without the residuals in a fold, from that of all and that of these:
    /// `(n·S − n_f·S_f)/(n − n_f)`.
    pub(crate) fn covariance_without(&self, fold: usize) -> BandedMatrix {
        let inside: Vec<&Vec<f64>> = self.in_fold(fold).collect();
        let (count, left) = (self.residuals.len(), self.residuals.len() - inside.len());
        if inside.is_empty() || left == 0 {
            return self.covariance();
        }
        let mut without = self.whole().scaled(count as f64 / left as f64);
        let of_fold = -(inside.len() as f64) / left as f64;
        self.shape.add_covariance(&mut without, of_fold, &inside, self.electronics.as_deref());
        without
    }

    /// The terms of the mean at a point of the sought coordinates, one a row of
    /// [`coefficients`](Self::coefficients).
    pub(crate) fn terms_at(&self, coordinates: &[f64]) -> Vec<f64> {
        self.trend.terms(&away(coordinates, &self.centre, &self.spread))
    }

    /// Derivatives of the terms at a point, one row a coordinate: central differences, exact for
    /// squares.
    pub(crate) fn slopes_at(&self, point: &[f64]) -> Vec<Vec<f64>> {
        const STEP: f64 = 1e-5;
        central_differences(point, STEP, |moved| self.terms_at(moved))
    }

    /// Derivatives of the mean at a point, one row a coordinate.
    pub(crate) fn mean_jacobian(&self, point: &[f64]) -> Vec<Vec<f64>> {
        let samples = self.coefficients[0].len();
        self.slopes_at(point)
            .into_iter()
            .map(|slopes| {
                let mut derivative = vec![0.0; samples];
                for (coefficient, slope) in self.coefficients.iter().zip(slopes) {
                    add_scaled(&mut derivative, slope, coefficient);
                }
                derivative
            })
            .collect()
    }

    /// The mean is the sum of these signals, each times its term.
    pub(crate) fn coefficients(&self) -> &[Vec<f64>] {
        &self.coefficients
    }
}

/// Distance from the centre in units of the spread.
fn away(coordinates: &[f64], centre: &[f64], spread: &[f64]) -> Vec<f64> {
    coordinates.iter().zip(centre).zip(spread).map(|((c, m), s)| (c - m) / s).collect()
}

/// Folds that the residuals are dealt into for cross-fitting.
pub(crate) const FOLDS: usize = 4;

/// A combination of rows of so many samples.
pub(crate) fn combination(by: &[f64], rows: &[Vec<f64>], samples: usize) -> Vec<f64> {
    let mut sum = vec![0.0; samples];
    for (by, row) in by.iter().zip(rows) {
        if *by != 0.0 {
            add_scaled(&mut sum, *by, row);
        }
    }
    sum
}

/// `a += scale·b`.
pub(crate) fn add_scaled(a: &mut [f64], scale: f64, b: &[f64]) {
    for (x, y) in a.iter_mut().zip(b) {
        *x += scale * y;
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;
    use inference::tapered_covariance;

    use super::*;

    #[test]
    fn a_linear_error_is_learnt_and_leaves_no_residual() {
        let coordinates: Vec<Vec<f64>> =
            (0..20).map(|i| vec![f64::from(i) * 0.01, f64::from(i * i % 7) * 0.01]).collect();
        let differences: Vec<Vec<f64>> = coordinates
            .iter()
            .map(|c| (0..5).map(|t| 1.0 + f64::from(t) * c[0] - 2.0 * c[1]).collect())
            .collect();
        let learn = |trend| {
            let shape = CovarianceShape::tapered(3);
            ErrorModel::learn(&differences, &coordinates, trend, shape, None).unwrap()
        };
        let model = learn(Trend::Linear);
        let at = model.mean_at(&[0.3, 0.1]);
        for (t, value) in at.iter().enumerate() {
            assert_abs_diff_eq!(*value, 1.0 + t as f64 * 0.3 - 0.2, epsilon = 1e-12);
        }
        assert!(model.covariance().mean_diagonal() < 1e-24);
        let constant = learn(Trend::Constant);
        assert!(constant.covariance().mean_diagonal() > 1e-5);
    }

    #[test]
    fn a_covariance_without_a_fold_is_that_of_the_other_residuals() {
        let coordinates: Vec<Vec<f64>> = (0..10).map(|i| vec![f64::from(i)]).collect();
        let differences: Vec<Vec<f64>> =
            (1..11).map(|k| (0..9).map(|t| f64::from(k * t).sin()).collect()).collect();
        let electronics = Arc::new(tapered_covariance(&differences[..3], 4));
        let shape = CovarianceShape { taper_support_samples: 3, electronics_share: 0.25 };
        let electronics = Some(electronics);
        let model =
            ErrorModel::learn(&differences, &coordinates, Trend::Constant, shape, electronics)
                .unwrap();
        for fold in 0..FOLDS {
            let others = model.residuals.iter().enumerate().filter(|(row, _)| row % FOLDS != fold);
            let others: Vec<&Vec<f64>> = others.map(|(_, residual)| residual).collect();
            let want = shape.covariance(&others, model.electronics.as_deref());
            let got = model.covariance_without(fold);
            for row in 0..9 {
                for column in 0..9 {
                    assert_abs_diff_eq!(got.at(row, column), want.at(row, column), epsilon = 1e-14);
                }
            }
        }
    }
}
