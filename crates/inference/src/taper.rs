//! Covariances of few residuals, tapered.

use crate::banded::{BandedMatrix, dot};

/// Mean outer product of residuals, tapered.
///
/// Element `i, j` is the mean of `r_i·r_j` times [`gaspari_cohn`] of `|i − j|/support`: the matrix
/// is zero from `support` diagonals on.
///
/// # Panics
///
/// When a residual is shorter than the first.
pub fn tapered_covariance<R: AsRef<[f64]>>(residuals: &[R], support: usize) -> BandedMatrix {
    let samples = residuals.first().map_or(0, |r| r.as_ref().len());
    let half_band = support.saturating_sub(1);
    let mut covariance = BandedMatrix::zeros(samples, half_band);
    let per_count = 1.0 / residuals.len().max(1) as f64;
    // by columns of a transposed copy, so that a scalar product runs over contiguous memory
    let by_sample: Vec<Vec<f64>> =
        (0..samples).map(|i| residuals.iter().map(|r| r.as_ref()[i]).collect()).collect();
    let taper: Vec<f64> =
        (0..=half_band).map(|lag| gaspari_cohn(lag as f64 / support as f64) * per_count).collect();
    for i in 0..samples {
        for j in i.saturating_sub(covariance.half_band())..=i {
            *covariance.at_mut(i, j) = taper[i - j] * dot(&by_sample[i], &by_sample[j]);
        }
    }
    covariance
}

/// Compactly supported correlation of Gaspari and Cohn (Q. J. R. Meteorol. Soc. 125, 1999,
/// eq. 4.10), 1 at 0 and 0 from 1 on: the fifth-order piecewise rational, positive definite.
pub fn gaspari_cohn(distance: f64) -> f64 {
    let r = 2.0 * distance.abs();
    if r <= 1.0 {
        1.0 + r * r * (-5.0 / 3.0 + r * (5.0 / 8.0 + r * (0.5 - r * 0.25)))
    } else if r < 2.0 {
        4.0 - 5.0 * r + r * r * (5.0 / 3.0 + r * (5.0 / 8.0 + r * (-0.5 + r / 12.0)))
            - 2.0 / (3.0 * r)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn published_gaspari_cohn_values() {
        // the two pieces meet at half the support; value 5/24 there by eq. 4.10
        assert_eq!(gaspari_cohn(0.0), 1.0);
        assert_abs_diff_eq!(gaspari_cohn(0.5), 5.0 / 24.0, epsilon = 1e-15);
        assert_abs_diff_eq!(gaspari_cohn(0.5 + 1e-12), 5.0 / 24.0, epsilon = 1e-10);
        assert_abs_diff_eq!(gaspari_cohn(1.0 - 1e-12), 0.0, epsilon = 1e-9);
        assert_eq!(gaspari_cohn(1.0), 0.0);
    }
}
