//! What recordings say of the numbers fitted to them, and what others make of that.

use nalgebra::{DMatrix, DVector};

use crate::{
    elsewhere::elsewhere,
    error::GreyboxError,
    fit::{Fitted, Normal, whitened},
    gram::{Gram, dot},
    noise::{Whitener, rms},
    problem::{PerRecord, Problem},
    structure::{Free, Structure},
};

/// The free numbers of a fit that are one number in all recordings, with what the recordings say
/// of them. What has another size in each is not known in a new one: it is left out, and
/// projected off what they say of the others.
#[derive(Clone, Debug)]
pub(crate) struct Known {
    pub(crate) structure: Structure,
    pub(crate) values: Vec<f64>,
    /// Inverse of their covariance.
    pub(crate) information: DMatrix<f64>,
}

impl Known {
    pub(crate) fn new(fitted: &Fitted, noise: &Whitener) -> Self {
        let kept = fitted.structure.same_everywhere();
        let structure = fitted.structure.only(&kept);
        let values: Vec<f64> = kept.iter().map(|&place| fitted.values[place]).collect();
        let columns: Vec<Vec<f64>> =
            fitted.sensitivities.iter().map(|column| whitened(noise, column)).collect();
        let others: Vec<usize> = (0..columns.len()).filter(|n| !kept.contains(n)).collect();
        let mut information = Gram::new(&columns).without(&others).block(&kept);
        for (i, free) in structure.free.iter().enumerate() {
            information[(i, i)] += beforehand(free);
        }
        Self { structure, values, information }
    }
}

/// Information on a number before any recording: its prior, else that of the uniform distribution
/// within its bounds.
fn beforehand(free: &Free) -> f64 {
    let range = free.most - free.least;
    free.prior.map_or(12.0 / (range * range), |(_, std)| 1.0 / (std * std))
}

/// Recordings that were not fitted, before numbers known as well as the others tell.
///
/// With whitened residual `r` at the fitted numbers, the sensitivities `J` there, the information
/// `F` of the recordings fitted and noise of unit size their log-likelihood is, but for a constant,
///
/// ```text
/// ln p(r) = −½·|r − J·δ|² − ½·δᵀ·F·δ − ½·ln det(I + F⁻¹·Jᵀ·J)
/// ```
///
/// at its largest over the change `δ` of the numbers, within their bounds: of all recordings
/// together less that of those fitted (Laplace).
#[derive(Clone, Debug)]
pub(crate) struct HeldOut {
    /// `r − J·δ`, not whitened.
    pub(crate) residuals: PerRecord,
    /// The numbers changed by `δ`, of [`Structure::same_everywhere`].
    pub(crate) values: Vec<f64>,
    /// Root mean square of the residual through the noise.
    pub(crate) size: f64,
    /// Both later terms, nats.
    pub(crate) price_nats: f64,
}

impl HeldOut {
    /// With the noise of the recordings fitted, `own`; that of those held out has the colour of
    /// `noise` and a size of its own.
    pub(crate) fn new(
        problem: &Problem<'_>,
        fitted: &Fitted,
        own: &Whitener,
        noise: &Whitener,
    ) -> Result<Self, GreyboxError> {
        let known = Known::new(fitted, own);
        let Known { structure, values, information } = &known;
        let off = structure.state(problem.machine, values);
        let drive = problem.drives(&[off])?.remove(0);
        let sensitivities = problem.sensitivities(structure, (0, 1.0), values, &drive)?;
        let mut held_out = Self {
            residuals: elsewhere(problem, &fitted.structure, &fitted.values, own)?,
            values: values.clone(),
            size: 0.0,
            price_nats: 0.0,
        };
        let white = whitened(noise, &held_out.residuals);
        held_out.size = rms(&white).max(f64::MIN_POSITIVE);
        let columns: Vec<Vec<f64>> = sensitivities.iter().map(|c| whitened(noise, c)).collect();
        let products = Gram::new(&columns).block(&(0..columns.len()).collect::<Vec<_>>());
        let descent = DVector::from_iterator(columns.len(), columns.iter().map(|c| dot(c, &white)));
        // the noise is as large as what is left, and what is left goes by the noise
        for _ in 0..PASSES {
            let weight = 1.0 / (held_out.size * held_out.size);
            let curvature = information + &products * weight;
            let normal = Normal { curvature, descent: &descent * weight };
            held_out.values = normal.bounded(&structure.free, values, 0.0);
            let moved = DVector::from_fn(values.len(), |n, _| held_out.values[n] - values[n]);
            let fell = 2.0 * descent.dot(&moved) - moved.dot(&(&products * &moved));
            let left = dot(&white, &white) - fell;
            held_out.size =
                libm::sqrt(left.max(0.0) / white.len().max(1) as f64).max(f64::MIN_POSITIVE);
            held_out.price_nats = 0.5 * moved.dot(&(information * &moved))
                + 0.5 * log_ratio(&normal.curvature, information);
        }
        for (record, residual) in held_out.residuals.iter_mut().enumerate() {
            for ((column, from), to) in sensitivities.iter().zip(values).zip(&held_out.values) {
                for (r, slope) in residual.iter_mut().zip(&column[record]) {
                    *r -= (to - from) * slope;
                }
            }
        }
        Ok(held_out)
    }

    /// Root mean square of the residual.
    pub(crate) fn rms(&self) -> f64 {
        rms(&self.residuals.concat())
    }
}

/// How often size and numbers are found from one another.
const PASSES: usize = 3;

/// Logarithm of the ratio of two determinants, both in units of the first.
fn log_ratio(more: &DMatrix<f64>, less: &DMatrix<f64>) -> f64 {
    let unit: Vec<f64> =
        more.diagonal().iter().map(|d| 1.0 / libm::sqrt(d.max(f64::MIN_POSITIVE))).collect();
    let half_log = |matrix: &DMatrix<f64>| {
        let n = matrix.nrows();
        let jitter = |i, j| if i == j { ROUNDING } else { 0.0 };
        let scaled =
            DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * unit[i] * unit[j] + jitter(i, j));
        scaled.cholesky().map(|c| c.l_dirty().diagonal().iter().map(|d| libm::log(*d)).sum::<f64>())
    };
    match (half_log(more), half_log(less)) {
        (Some(more), Some(less)) => 2.0 * (more - less),
        _ => 0.0,
    }
}

/// What rounding may take from the eigenvalues of a scaled matrix.
const ROUNDING: f64 = 1e-9;
