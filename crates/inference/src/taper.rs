//! Covariances of few residuals, tapered.

use pulp::{Arch, NullaryFnOnce};

use crate::banded::BandedMatrix;

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
    let taper: Vec<f64> =
        (0..=half_band).map(|lag| gaspari_cohn(lag as f64 / support as f64) * per_count).collect();
    let padded: Vec<Vec<f64>> =
        residuals.iter().map(|r| [&[0.0; COLUMNS], &r.as_ref()[..samples]].concat()).collect();
    Arch::new().dispatch(Products { padded: &padded, taper: &taper, covariance: &mut covariance });
    covariance
}

/// Rows and columns whose products are summed in one pass over the residuals.
const ROWS: usize = 4;
const COLUMNS: usize = 8;

/// `w_{i−j}·Σ_r r_i·r_j` as a kernel: summed in the order of the residuals, so that results are the
/// same at every vector width.
struct Products<'a> {
    /// Residuals behind as many zeros as a block has columns.
    padded: &'a [Vec<f64>],
    taper: &'a [f64],
    covariance: &'a mut BandedMatrix,
}

impl NullaryFnOnce for Products<'_> {
    type Output = ();

    #[inline(always)]
    #[expect(clippy::inline_always, reason = "compiled for each instruction set by being inlined")]
    fn call(self) {
        let Self { padded, taper, covariance } = self;
        let (order, half_band) = (covariance.order(), covariance.half_band());
        for top in (0..order).step_by(ROWS) {
            let rows = top..order.min(top + ROWS);
            let left = top.saturating_sub(half_band);
            // blocks end at the diagonal's last column and begin before the band, or in the padding
            let blocks = (rows.end - left).div_ceil(COLUMNS);
            for block in 1..=blocks {
                let start = rows.end + COLUMNS - block * COLUMNS;
                let sums = products(padded, COLUMNS + top, rows.len(), start);
                for (i, sums) in rows.clone().zip(&sums) {
                    for (column, sum) in (start..).zip(sums) {
                        let within = column.checked_sub(COLUMNS).and_then(|j| i.checked_sub(j));
                        if let Some(lag) = within.filter(|lag| *lag <= half_band) {
                            *covariance.at_mut(i, i - lag) = taper[lag] * sum;
                        }
                    }
                }
            }
        }
    }
}

/// Sums of the products of some rows and columns over the residuals.
#[inline(always)]
#[expect(clippy::inline_always, reason = "compiled for each instruction set by being inlined")]
fn products(padded: &[Vec<f64>], top: usize, rows: usize, start: usize) -> [[f64; COLUMNS]; ROWS] {
    let mut sums = [[0.0; COLUMNS]; ROWS];
    for residual in padded {
        let own: [f64; ROWS] = core::array::from_fn(|row| residual[top + row.min(rows - 1)]);
        let others: &[f64; COLUMNS] =
            residual[start..].first_chunk().expect("blocks end within a residual");
        for row in 0..ROWS {
            for column in 0..COLUMNS {
                sums[row][column] += own[row] * others[column];
            }
        }
    }
    sums
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
