use crate::{
    Matrix, RankRule, Snapshots, Svd, SvdError,
    decomposition::{self, Qr},
    svd::thin_svd,
};

/// Most singular values, as a share of the snapshots, for which the route over the Gram matrix is
/// taken.
const MOST_SHARE: usize = 3;
/// Least wanted singular value over the largest for which it is taken.
const LEAST_RATIO: f64 = 1e-4;

/// Leading part of the singular value decomposition, the `rank` largest singular values.
///
/// ```text
/// G = Xᵀ·X = V·Λ·Vᵀ      B = X·V_r = Q·R      R = U_R·diag(σ)·Wᵀ
/// X ≈ (Q·U_R)·diag(σ)·(V_r·W)ᵀ
/// ```
///
/// Where at most a third of the snapshots' number is asked for and the last wanted singular value
/// is at least 1e-4 of the largest, the leading right vectors come from the Gram matrix; otherwise
/// the whole decomposition is made and cut. At most as many singular values come back as the matrix
/// has; signs as in [`Svd`].
///
/// # Errors
///
/// [`SvdError::RankZero`], [`SvdError::NoConvergence`].
///
/// # Accuracy
///
/// The Gram matrix has half the digits: a right vector is off by `ε·n·(σ₁/σ)²` over its relative
/// distance from those left out, at most some 1e-6 of that here. The second decomposition makes both
/// sets of vectors orthonormal to rounding and the singular values right to the square of it:
/// 1e-11 relative.
///
/// # Source
///
/// Method of snapshots: Sirovich, Quarterly of Applied Mathematics 45(3), 1987, with a
/// Rayleigh-Ritz step.
///
/// # Examples
///
/// ```
/// use reduction::{Snapshots, leading_svd, thin_svd};
///
/// let snapshots =
///     Snapshots::from_fn(300, 60, |row, column| ((row * column) as f64 * 0.01).sin())?;
/// let leading = leading_svd(&snapshots, 5)?;
/// let whole = thin_svd(&snapshots)?;
/// let error = leading.singular_values()[4] / whole.singular_values()[4] - 1.0;
/// assert!(error.abs() < 1e-11);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
pub fn leading_svd(snapshots: &Snapshots, rank: usize) -> Result<Svd, SvdError> {
    if rank == 0 {
        return Err(SvdError::RankZero);
    }
    let matrix = snapshots.matrix();
    if matrix.rows() >= matrix.columns()
        && rank * MOST_SHARE <= matrix.columns()
        && let Some(svd) = by_gram_matrix(matrix, rank)?
    {
        return Ok(svd);
    }
    let whole = thin_svd(snapshots)?;
    let kept = rank.min(whole.singular_values().len());
    match whole.truncated(RankRule::Fixed(kept)) {
        // all singular values are zero: any directions do
        Err(SvdError::Zero) => Ok(whole),
        cut => cut,
    }
}

/// The route over the Gram matrix; `None` where the singular values fall too far for it.
fn by_gram_matrix(matrix: &Matrix, rank: usize) -> Result<Option<Svd>, SvdError> {
    let eigen = decomposition::symmetric_eigen(&matrix.gram())?;
    let count = eigen.values.len();
    let largest = eigen.values[count - 1];
    let last = eigen.values[count - rank];
    // not a number compares as too small
    if !(largest.is_finite() && largest > 0.0 && last >= LEAST_RATIO * LEAST_RATIO * largest) {
        return Ok(None);
    }
    let mut right = Matrix::zeros(count, rank);
    for place in 0..rank {
        right.column_mut(place).copy_from_slice(eigen.vectors.column(count - 1 - place));
    }
    let qr = Qr::new(matrix.times(&right));
    let small = decomposition::thin_svd(&qr.upper())?;
    let mut svd = Svd {
        left: qr.lift(&small.left),
        singular_values: small.singular_values,
        right: right.times(&small.right),
    };
    svd.fix_signs();
    Ok(Some(svd))
}
