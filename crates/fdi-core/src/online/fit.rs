//! End of a search for the damage that explains a recording.

use nalgebra::DMatrix;

use crate::online::{
    beginning::Began,
    likelihood::{Likelihood, Slopes},
};

/// A fit of the low-fidelity model to a signal.
pub(crate) struct FitResult {
    /// Estimates of the coordinates looked for.
    pub(crate) estimate: Vec<f64>,
    /// Residual, A.
    pub(crate) residual_a: Vec<f64>,
    /// Mean square of the whitened residual.
    pub(crate) misfit: f64,
    pub(crate) evaluations: u64,
    /// True where the search ran out of evaluations.
    pub(crate) cut_short: bool,
    /// Slopes of the signal at the estimate, where they are known already.
    pub(crate) slopes: Option<Slopes>,
    /// How the recording begins and the covariance with that, where that is estimated.
    pub(crate) began: Option<(Began, DMatrix<f64>)>,
}

impl FitResult {
    /// `−2·ln` of the likelihood, less a constant.
    pub(crate) fn cost(&self, likelihood: &Likelihood) -> f64 {
        self.misfit * likelihood.size() as f64 + likelihood.log_determinant()
    }
}
