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
    let mut covariance = BandedMatrix::zeros(samples, support.saturating_sub(1));
    add_tapered_covariance(&mut covariance, 1.0, residuals, support);
    covariance
}

/// Adds `scale` times the [`tapered_covariance`] of residuals to a matrix, in its memory.
///
/// # Panics
///
/// When a residual is shorter than the matrix, or the matrix's band narrower than the taper's.
pub fn add_tapered_covariance<R: AsRef<[f64]>>(
    to: &mut BandedMatrix,
    scale: f64,
    residuals: &[R],
    support: usize,
) {
    let (samples, half_band) = (to.order(), to.half_band());
    assert!(support.saturating_sub(1).min(samples.saturating_sub(1)) <= half_band);
    let per_count = scale / residuals.len().max(1) as f64;
    let taper = |lag: usize| gaspari_cohn(lag as f64 / support as f64) * per_count;
    let weights: Vec<f64> = (0..=half_band).rev().map(taper).collect();
    let padded: Vec<Vec<f64>> =
        residuals.iter().map(|r| [&[0.0; COLUMNS], &r.as_ref()[..samples]].concat()).collect();
    let reach = half_band.min(support.saturating_sub(1));
    Arch::new().dispatch(Products { padded: &padded, reach, weights: &weights, to });
}

/// Rows and columns whose products are summed in one pass over the residuals.
const ROWS: usize = 4;
const COLUMNS: usize = 8;

/// `w_{i−j}·Σ_r r_i·r_j` as a kernel: summed in the order of the residuals, so that results are the
/// same at every vector width.
struct Products<'a> {
    /// Residuals behind as many zeros as a block has columns.
    padded: &'a [Vec<f64>],
    /// Diagonals below the main one that the taper reaches.
    reach: usize,
    /// One an element of a row in its band.
    weights: &'a [f64],
    to: &'a mut BandedMatrix,
}

impl NullaryFnOnce for Products<'_> {
    type Output = ();

    #[inline(always)]
    #[expect(clippy::inline_always, reason = "compiled for each instruction set by being inlined")]
    fn call(self) {
        let Self { padded, reach, weights, to } = self;
        let (order, half_band) = (to.order(), to.half_band());
        for top in (0..order).step_by(ROWS) {
            let rows = top..order.min(top + ROWS);
            let left = top.saturating_sub(reach);
            // blocks end at the diagonal's last column and begin before the band, or in the padding
            let blocks = (rows.end - left).div_ceil(COLUMNS);
            for block in 1..=blocks {
                let start = rows.end + COLUMNS - block * COLUMNS;
                let sums = products(padded, COLUMNS + top, rows.len(), start);
                for (i, sums) in rows.clone().zip(&sums) {
                    // columns of the block in the band of the row, counted with the padding
                    let first = start.max(i.saturating_sub(reach) + COLUMNS);
                    let end = (start + COLUMNS).min(i + 1 + COLUMNS);
                    if first >= end {
                        continue;
                    }
                    let in_band = first + half_band - COLUMNS - i..end + half_band - COLUMNS - i;
                    let row = &mut to.row_mut(i)[in_band.clone()];
                    let sums = &sums[first - start..end - start];
                    for ((value, weight), sum) in row.iter_mut().zip(&weights[in_band]).zip(sums) {
                        *value += weight * sum;
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
