//! How well a Jacobian determines the inputs.

use crate::{
    error::CovarianceError,
    linalg::{eigen, solve_positive},
    matrix::Matrix,
};

/// Covariance of the inputs for independent noise of standard deviation
/// `noise_std` on every residual: `σ²·(JᵀJ)⁻¹` (the Laplace approximation of
/// the posterior, and the Cramér-Rao bound).
///
/// For correlated noise, whiten the residual before the Jacobian is taken and
/// pass 1.
///
/// # Errors
/// [`CovarianceError::Singular`] when an input is not determined,
/// [`CovarianceError::Noise`] unless the level is positive and finite.
pub fn covariance(jacobian: &Matrix, noise_std: f64) -> Result<Matrix, CovarianceError> {
    if !(noise_std.is_finite() && noise_std > 0.0) {
        return Err(CovarianceError::Noise { value: noise_std });
    }
    let mut inverse = solve_positive(&jacobian.gram())
        .map_err(|(pivot, largest)| CovarianceError::Singular { pivot, largest })?;
    for i in 0..inverse.rows() {
        for v in inverse.row_mut(i) {
            *v *= noise_std * noise_std;
        }
    }
    Ok(inverse)
}

/// Condition number of a Jacobian, largest over smallest singular value;
/// infinite when an input has no effect of its own.
///
/// # Accuracy
/// From the eigenvalues of `JᵀJ`: good to about half the digits, up to 1e7.
pub fn condition_number(jacobian: &Matrix) -> f64 {
    let (values, _) = eigen(&jacobian.gram());
    match (values.first(), values.last()) {
        (Some(&low), Some(&high)) if low > 0.0 => (high / low).sqrt(),
        _ => f64::INFINITY,
    }
}
