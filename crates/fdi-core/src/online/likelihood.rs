//! The likelihood of a recording: generalised least squares on the filtered envelope, whole or
//! encoded.
//!
//! ```text
//! r(c) = y − y_LF(c) − m(c),   r ~ N(0, Σ),   Σ = S + a²·C
//! ```
//!
//! with `S` the covariance of the low-fidelity model's error and `a²·C` that of the sensors' noise
//! after the filter. The stated uncertainty is that of the estimator on errors that it has not
//! seen: each reference error goes through the estimator built without its fold, and the scatter of
//! what comes out is the low-fidelity model's share.
//!
//! # Source
//!
//! Generalised least squares: Aitken (Proc. R. Soc. Edinburgh 55, 1935). The covariance by estimators
//! that have not seen an error is derived in `docs/models/diagnosis.md`, section "Covariance of the
//! estimate".

use std::sync::{Arc, OnceLock};

use inference::{BandedMatrix, NotPositiveDefinite, dot};
use nalgebra::{DMatrix, DVector};

use crate::offline::{
    encoding::Encoder,
    error_model::ErrorModel,
    estimator::{combined, gram, information, symmetric},
    factor::{Factor, joined},
};

/// A Gaussian model of residuals at one noise level.
#[derive(Debug)]
pub(crate) struct Likelihood {
    factor: Factor,
    noise: BandedMatrix,
    /// Mean variance of a sample, A².
    mean_variance: f64,
    folds: Vec<Fold>,
    /// Mean and variance of ln(misfit) over the reference errors, formed when first asked for.
    misfits: OnceLock<(f64, f64)>,
}

/// Slopes of the signal, one row a coordinate, the same as white numbers, and their information.
#[derive(Debug)]
pub(crate) struct Slopes {
    rows: Vec<Vec<f64>>,
    white: Vec<Vec<f64>>,
    /// `JᵀΣ⁻¹J`.
    information: DMatrix<f64>,
}

impl Slopes {
    /// Slopes of the signal.
    pub(crate) fn rows(&self) -> &[Vec<f64>] {
        &self.rows
    }

    /// The generalised least-squares step for a whitened residual.
    ///
    /// `None` when the slopes leave a coordinate undetermined.
    pub(crate) fn step(&self, white: &[f64]) -> Option<DVector<f64>> {
        let projections = self.white.iter().map(|row| dot(row, white));
        let projected = DVector::from_iterator(self.white.len(), projections);
        Some(self.information.clone().try_inverse()? * projected)
    }

    /// Whitened residual that a step leaves, to first order.
    pub(crate) fn left(&self, white: &[f64], step: &DVector<f64>) -> Vec<f64> {
        let mut left = white.to_vec();
        for (row, part) in self.white.iter().zip(step.iter()) {
            for (value, slope) in left.iter_mut().zip(row) {
                *value -= part * slope;
            }
        }
        left
    }
}

/// Mean square of white numbers: the misfit per sample.
pub(crate) fn misfit(white: &[f64]) -> f64 {
    dot(white, white) / white.len() as f64
}

/// Residuals with the factor of a covariance that does not know them.
#[derive(Debug)]
struct Fold {
    factor: Factor,
    residuals: Vec<Vec<f64>>,
    /// The residuals as white numbers, formed when first asked for.
    white: OnceLock<Vec<Vec<f64>>>,
}

impl Fold {
    fn white(&self) -> &[Vec<f64>] {
        self.white.get_or_init(|| self.factor.whiten_each(self.residuals.iter()))
    }

    /// Estimates from each residual of the fold, by the estimator that does not know the fold.
    fn shifts(&self, jacobian: &[Vec<f64>], prior: &DMatrix<f64>) -> Option<Vec<DVector<f64>>> {
        let rows = self.factor.whiten_each(jacobian.iter());
        let inverse = (gram(&rows) + prior).try_inverse()?;
        let project = |white: &Vec<f64>| {
            DVector::from_iterator(rows.len(), rows.iter().map(|row| dot(row, white)))
        };
        Some(self.white().iter().map(|white| &inverse * project(white)).collect())
    }
}

impl Likelihood {
    /// Joins model error and noise.
    pub(crate) fn new(
        error: &ErrorModel,
        unit_noise: &BandedMatrix,
        noise_a: f64,
        encoder: Option<&Arc<Encoder>>,
    ) -> Result<Self, NotPositiveDefinite> {
        let noise = unit_noise.scaled(noise_a * noise_a);
        let with_noise = |model: &BandedMatrix| joined(model, &noise);
        let whole = with_noise(&error.covariance());
        let mean_variance = whole.mean_diagonal();
        let folds = error
            .folds()
            .into_iter()
            .map(|(covariance, residuals)| {
                Ok(Fold {
                    factor: Factor::new(with_noise(&covariance), encoder)?,
                    residuals: residuals.iter().map(|r| r.to_vec()).collect(),
                    white: OnceLock::new(),
                })
            })
            .collect::<Result<_, _>>()?;
        Ok(Self {
            factor: Factor::new(whole, encoder)?,
            noise,
            mean_variance,
            folds,
            misfits: OnceLock::new(),
        })
    }

    /// The factor of the whole covariance.
    pub(crate) fn factor(&self) -> &Factor {
        &self.factor
    }

    /// Covariance of the sensors' noise.
    pub(crate) fn noise(&self) -> &BandedMatrix {
        &self.noise
    }

    /// Residuals, each fold with the factor that does not know it.
    pub(crate) fn folds(&self) -> impl Iterator<Item = (&Factor, &[Vec<f64>])> {
        self.folds.iter().map(|fold| (&fold.factor, fold.residuals.as_slice()))
    }

    /// The factor of noise and model error alone, without what uncertainty needs.
    pub(crate) fn plain(
        error: &ErrorModel,
        unit_noise: &BandedMatrix,
        noise_a: f64,
        encoder: Option<&Arc<Encoder>>,
    ) -> Result<Factor, NotPositiveDefinite> {
        Factor::new(joined(&error.covariance(), &unit_noise.scaled(noise_a * noise_a)), encoder)
    }

    /// `(JᵀΣ⁻¹J)⁻¹`, what no unbiased estimate can beat under this model.
    pub(crate) fn bound(&self, jacobian: &[Vec<f64>]) -> Option<DMatrix<f64>> {
        information(&self.factor, jacobian).try_inverse()
    }

    /// A residual as white numbers; their squared length is the misfit.
    pub(crate) fn whiten(&self, residual: &[f64]) -> Vec<f64> {
        self.factor.whiten(residual)
    }

    /// White numbers that a residual makes.
    pub(crate) fn size(&self) -> usize {
        self.factor.size()
    }

    /// Root of the mean variance that noise and model error explain, A.
    pub(crate) fn floor_a(&self) -> f64 {
        self.mean_variance.sqrt()
    }

    /// Logarithm of the determinant of `Σ`.
    pub(crate) fn log_determinant(&self) -> f64 {
        self.factor.log_determinant()
    }

    /// Slopes of the signal, one row a coordinate, with what is made of them here.
    pub(crate) fn slopes(&self, rows: Vec<Vec<f64>>) -> Slopes {
        let white = self.factor.whiten_each(rows.iter());
        Slopes { information: gram(&white), rows, white }
    }

    /// Covariance of the generalised least-squares estimate.
    ///
    /// `None` when the slopes leave a coordinate undetermined.
    pub(crate) fn estimate_covariance(&self, slopes: &Slopes) -> Option<DMatrix<f64>> {
        self.estimate_covariance_given(slopes, &vec![0.0; slopes.rows.len()])
    }

    /// Covariance where some coordinates are known to be near zero, `N(0, 1/p)` with `p` their
    /// prior precision; 0 for what nothing is known of. With `V = (JᵀΣ⁻¹J + P)⁻¹` the prior
    /// adds `V·P·V`.
    pub(crate) fn estimate_covariance_given(
        &self,
        slopes: &Slopes,
        precision: &[f64],
    ) -> Option<DMatrix<f64>> {
        let order = slopes.rows.len();
        let prior = diagonal(precision);
        let inverse = (&slopes.information + &prior).try_inverse()?;
        let samples = slopes.rows.first().map_or(0, Vec::len);
        let solved = self.factor.spread_each(slopes.white.clone(), samples);
        let weights = combined(&inverse, &solved);
        let noise_images: Vec<Vec<f64>> =
            weights.iter().map(|weight| self.noise.times(weight)).collect();
        let mut covariance = symmetric(order, |i, j| dot(&weights[i], &noise_images[j]));
        let mut count = 0.0;
        let mut scatter = DMatrix::zeros(order, order);
        for fold in &self.folds {
            for shift in fold.shifts(&slopes.rows, &prior)? {
                scatter += &shift * shift.transpose();
                count += 1.0;
            }
        }
        covariance += scatter / f64::max(count, 1.0);
        covariance += &inverse * prior * &inverse;
        Some(covariance)
    }

    /// The misfit per sample that a recording of the modelled machine hardly exceeds.
    ///
    /// The misfits of the reference errors, each through the fold that does not know it and with
    /// the expectation of the noise added, are taken as log-normal; `deviations` standard
    /// deviations above their mean is the limit. The noise's own scatter, `√(2/n)`, is included.
    pub(crate) fn largest_misfit(&self, deviations: f64) -> f64 {
        let (mean, scatter) = *self.misfits.get_or_init(|| self.misfits());
        let own = 2.0 / self.size() as f64;
        (mean + deviations * (scatter + own).sqrt()).exp()
    }

    /// Mean and variance of ln(misfit) over the reference errors.
    fn misfits(&self) -> (f64, f64) {
        let logs: Vec<f64> = self
            .folds
            .iter()
            .flat_map(|fold| {
                let noise = self.noise_share(&fold.factor);
                fold.white().iter().map(move |white| (misfit(white) + noise).ln())
            })
            .collect();
        let count = logs.len().max(2) as f64;
        let mean = logs.iter().sum::<f64>() / count;
        let scatter = logs.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (count - 1.0);
        (mean, scatter)
    }

    /// Expectation of the misfit per sample from noise alone, `tr(Σ⁻¹·N)/n`, from a few probing
    /// vectors of ±1 (Hutchinson, Commun. Stat. Simul. Comput. 19, 1990); their scatter is below
    /// a hundredth here.
    fn noise_share(&self, factor: &Factor) -> f64 {
        const PROBES: u64 = 4;
        if let Some(share) = factor.exact_share(&self.noise) {
            return share;
        }
        let order = self.noise.order();
        let mut sum = 0.0;
        for probe in 0..PROBES {
            let signs: Vec<f64> =
                (0..order as u64).map(|i| sign(i + probe * order as u64)).collect();
            let image = factor.solve(&self.noise.times(&signs));
            sum += dot(&signs, &image);
        }
        sum / (PROBES as f64 * order as f64)
    }
}

/// ±1 from a counter (the finaliser of SplitMix64): fixed probing vectors, not randomness.
fn sign(counter: u64) -> f64 {
    let mut z = counter.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    if (z ^ (z >> 31)) & 1 == 0 { 1.0 } else { -1.0 }
}

/// A matrix with these on its diagonal.
fn diagonal(values: &[f64]) -> DMatrix<f64> {
    DMatrix::from_diagonal(&DVector::from_column_slice(values))
}
