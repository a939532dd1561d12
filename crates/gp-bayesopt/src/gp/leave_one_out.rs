//! Leave-one-out errors: each observation against the surrogate of the others.

use super::fit::GaussianProcess;

/// Leave-one-out diagnostics of one output, hyperparameters held.
///
/// ```text
/// e_i = y_i − μ_{−i}(x_i) = α_i / K⁻¹_ii,   s_i² = s²/K⁻¹_ii
/// ```
///
/// # Source
/// Rasmussen and Williams (2006), equations 5.12.
#[derive(Clone, Debug, PartialEq)]
pub struct LeaveOneOut {
    /// Error of each observation, observed minus predicted.
    pub error: Vec<f64>,
    /// Standard deviation predicted for each error, noise included.
    pub std: Vec<f64>,
    /// `1 − Σe²/Σ(y − ȳ)²`: 1 is perfect, 0 no better than the mean. `None`
    /// when the output never varied.
    pub q2: Option<f64>,
    /// Mean of `(e/s)²`: 1 when the standard deviations are right.
    pub mean_square_z: Option<f64>,
    /// Share of errors within 1.96 standard deviations.
    pub coverage_95: Option<f64>,
}

impl LeaveOneOut {
    /// Sum of the log predictive densities of the observations, each given the others.
    ///
    /// ```text
    /// −½·Σ_i [ln(2π·s_i²) + (e_i/s_i)²]
    /// ```
    ///
    /// Minus infinity when a standard deviation is zero.
    ///
    /// # Source
    /// Rasmussen and Williams (2006), equations 5.10 and 5.11.
    #[must_use]
    pub fn ln_density(&self) -> f64 {
        let of = |(e, s): (&f64, &f64)| {
            if *s == 0.0 {
                return f64::NEG_INFINITY;
            }
            -0.5 * (libm::log(std::f64::consts::TAU) + (e / s) * (e / s)) - libm::log(*s)
        };
        self.error.iter().zip(&self.std).map(of).sum()
    }
}

impl GaussianProcess {
    /// Leave-one-out diagnostics of output `output`.
    ///
    /// # Panics
    /// When `output` is out of range.
    pub fn leave_one_out(&self, output: usize) -> LeaveOneOut {
        let n = self.len();
        let inverse = self.solved.factor.inverse_upper();
        let spread = self.data.scaling[output].spread;
        let alpha = &self.solved.alpha[output * n..(output + 1) * n];
        let error: Vec<f64> = (0..n).map(|i| spread * alpha[i] / inverse[i * n + i]).collect();
        let signal = self.signal_std()[output];
        let std: Vec<f64> = (0..n).map(|i| signal / inverse[i * n + i].sqrt()).collect();
        if spread == 0.0 {
            return LeaveOneOut { error, std, q2: None, mean_square_z: None, coverage_95: None };
        }
        let scaled: Vec<f64> = error.iter().map(|e| e / spread).collect();
        let y = &self.data.columns[output * n..(output + 1) * n];
        let mean = y.iter().sum::<f64>() / n as f64;
        let total: f64 = y.iter().map(|v| (v - mean) * (v - mean)).sum();
        let left: f64 = scaled.iter().map(|e| e * e).sum();
        let z2: Vec<f64> = error.iter().zip(&std).map(|(e, s)| (e / s) * (e / s)).collect();
        let inside = z2.iter().filter(|z| **z <= 1.96 * 1.96).count();
        LeaveOneOut {
            q2: Some(1.0 - left / total),
            mean_square_z: Some(z2.iter().sum::<f64>() / n as f64),
            coverage_95: Some(inside as f64 / n as f64),
            error,
            std,
        }
    }
}
