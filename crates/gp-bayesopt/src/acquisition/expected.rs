//! Expected improvement and confidence bounds of one output that is minimised.

use std::f64::consts::{PI, SQRT_2};

use crate::{
    error::AcquisitionError,
    gp::GaussianProcess,
    normal::{density, distribution, improvement, ln_improvement},
};

/// The weight of the standard deviation in a confidence bound.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Confidence {
    /// As printed in the FREEDOM paper, eq. 13: `√β_n = 1/(√2·n²·π²)` for `n`
    /// evaluations so far. It shrinks with `n`; kept for comparison.
    Printed,
    /// `β_n = 2·ln(d·n²·π²/(6·δ))`, for `d` inputs and a failure probability `δ`.
    ///
    /// Source: Srinivas et al., IEEE Trans. Inf. Theory 58 (2012) 3250, theorem
    /// 1, with the number of inputs for the size of the finite set.
    Srinivas {
        /// Failure probability `δ`, in `(0, 1)`.
        delta: f64,
    },
}

impl Confidence {
    /// The weight `√β_n` after `evaluations` evaluations on `inputs` inputs.
    pub fn weight(self, evaluations: usize, inputs: usize) -> f64 {
        let n2 = (evaluations as f64).powi(2);
        match self {
            Self::Printed => 1.0 / (SQRT_2 * n2 * PI * PI),
            Self::Srinivas { delta } => {
                let inside = inputs as f64 * n2 * PI * PI / (6.0 * delta);
                (2.0 * libm::log(inside)).max(0.0).sqrt()
            }
        }
    }
}

/// A criterion of the next point, for an output that is minimised.
///
/// The paper prints EI for a maximum (eq. 12) and a lower bound that would
/// have to be minimised (eq. 13 under the arg max of eq. 11); here both are
/// turned so that larger is better.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Acquisition {
    /// `E[(best − y)⁺] = σ·h(z)`, `z = (best − μ)/σ`, `h(z) = φ(z) + z·Φ(z)`.
    ExpectedImprovement,
    /// The logarithm of the above, which neither vanishes nor loses its gradient.
    LogExpectedImprovement,
    /// `−(μ − √β·σ)` with this `√β`.
    LowerConfidence {
        /// The weight `√β`.
        weight: f64,
    },
}

/// A value of a criterion with its gradient in the inputs' units.
#[derive(Clone, Debug, PartialEq)]
pub struct Scored {
    /// The value; larger is better.
    pub value: f64,
    /// The gradient.
    pub gradient: Vec<f64>,
}

/// A criterion of mean and standard deviation, with both partial derivatives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Partial {
    pub(crate) value: f64,
    pub(crate) by_mean: f64,
    pub(crate) by_std: f64,
}

impl Acquisition {
    /// The criterion for a prediction.
    ///
    /// With `std = 0` the improvement is certain: `(best − mean)⁺`, in the
    /// logarithm minus infinity when nothing is gained.
    ///
    /// # Errors
    /// [`AcquisitionError::Prediction`] or [`AcquisitionError::Incumbent`] when a
    /// number is not finite or the standard deviation is negative.
    pub fn of_prediction(&self, mean: f64, std: f64, best: f64) -> Result<f64, AcquisitionError> {
        if !(mean.is_finite() && std.is_finite() && std >= 0.0) {
            return Err(AcquisitionError::Prediction { mean, std });
        }
        if !best.is_finite() {
            return Err(AcquisitionError::Incumbent { value: best });
        }
        Ok(self.value(mean, std, best))
    }

    /// The criterion of a prediction that is known to be finite.
    pub(crate) fn value(&self, mean: f64, std: f64, best: f64) -> f64 {
        let gain = best - mean;
        match self {
            Self::LowerConfidence { weight } => weight * std - mean,
            Self::ExpectedImprovement if std == 0.0 => gain.max(0.0),
            Self::LogExpectedImprovement if std == 0.0 => libm::log(gain.max(0.0)),
            Self::ExpectedImprovement => std * improvement(gain / std),
            Self::LogExpectedImprovement => libm::log(std) + ln_improvement(gain / std).value,
        }
    }

    /// The criterion with its partial derivatives; `std` must be positive.
    pub(crate) fn partial(&self, mean: f64, std: f64, best: f64) -> Partial {
        let z = (best - mean) / std;
        match self {
            Self::LowerConfidence { weight } => {
                Partial { value: weight * std - mean, by_mean: -1.0, by_std: *weight }
            }
            Self::ExpectedImprovement => Partial {
                value: std * improvement(z),
                by_mean: -distribution(z),
                by_std: density(z),
            },
            Self::LogExpectedImprovement => {
                let ln = ln_improvement(z);
                Partial {
                    value: libm::log(std) + ln.value,
                    by_mean: -ln.distribution_ratio / std,
                    by_std: ln.density_ratio / std,
                }
            }
        }
    }

    /// The criterion at a point of a surrogate with one output.
    ///
    /// # Errors
    /// [`AcquisitionError`]: an unusable point, several outputs, or a prediction that is not
    /// finite.
    pub fn evaluate(
        &self,
        gp: &GaussianProcess,
        point: &[f64],
        best: f64,
    ) -> Result<f64, AcquisitionError> {
        one_output(gp)?;
        let at = gp.predict(point)?;
        self.of_prediction(at.mean[0], at.std[0], best)
    }

    /// The criterion with its gradient; the gradient is zero where the
    /// standard deviation is zero.
    ///
    /// # Errors
    /// Those of [`Self::evaluate`].
    pub fn evaluate_with_gradient(
        &self,
        gp: &GaussianProcess,
        point: &[f64],
        best: f64,
    ) -> Result<Scored, AcquisitionError> {
        one_output(gp)?;
        let (at, slope) = gp.predict_with_slope(point)?;
        let (mean, std) = (at.mean[0], at.std[0]);
        let value = self.of_prediction(mean, std, best)?;
        if std == 0.0 {
            return Ok(Scored { value, gradient: vec![0.0; point.len()] });
        }
        let partial = self.partial(mean, std, best);
        let gradient = (0..point.len())
            .map(|i| partial.by_mean * slope.mean.get(0, i) + partial.by_std * slope.std.get(0, i))
            .collect();
        Ok(Scored { value, gradient })
    }
}

/// Refuses a surrogate with several outputs.
pub(crate) fn one_output(gp: &GaussianProcess) -> Result<(), AcquisitionError> {
    match gp.outputs() {
        1 => Ok(()),
        found => Err(AcquisitionError::Outputs { expected: 1, found }),
    }
}
