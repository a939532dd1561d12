//! Cholesky factors and their inverses by blocks, for matrices beyond the inner caches: the only
//! file that calls faer, always on one thread.
//!
//! faer fuses multiply and add where the machine can, so that these results agree between machines
//! to rounding only; on one machine they are the same bits on any number of threads.

use faer::{
    Accum, MatMut, MatRef, Par,
    dyn_stack::{MemBuffer, MemStack},
    linalg::{
        cholesky::llt::factor,
        matmul::triangular::{BlockStructure, matmul},
        triangular_inverse::invert_lower_triangular,
    },
    prelude::{Reborrow, ReborrowMut, default},
};

/// Rows from which blocks are taken. A whole fit of seven inputs takes the same time by both ways
/// at 200 rows and 1.3 times longer by the kernels of [`super::cholesky`] at 300.
pub(super) const BLOCKED_FROM: usize = 256;

/// Replaces the upper half of a symmetric matrix, row by row, by its factor `U`, `A = UᵀU`.
/// What stands below the diagonal is not read.
///
/// Fails with the pivot that is not positive, or with the diagonal entry that it came from.
pub(super) fn factor_in_place(a: &mut [f64], n: usize) -> Result<(), f64> {
    // the upper half by rows is the lower half by columns
    let lower = MatMut::from_column_major_slice_mut(a, n, n);
    let request = factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, default());
    let mut memory = MemBuffer::new(request);
    let stack = MemStack::new(&mut memory);
    match factor::cholesky_in_place(lower, default(), Par::Seq, stack, default()) {
        Ok(_) => Ok(()),
        Err(factor::LltError::NonPositivePivot { index }) => Err(a[index * n + index]),
    }
}

/// Writes the upper half of `A⁻¹`, row by row, into `p`, with `x` for the inverse of the factor.
/// The lower half of `p` is left zero.
pub(super) fn inverse_upper_into(upper: &[f64], n: usize, x: &mut Vec<f64>, p: &mut Vec<f64>) {
    x.resize(n * n, 0.0);
    p.clear();
    p.resize(n * n, 0.0);
    let mut inverse = MatMut::from_column_major_slice_mut(x, n, n);
    let lower = MatRef::from_column_major_slice(upper, n, n);
    invert_lower_triangular(inverse.rb_mut(), lower, Par::Seq);
    let inverse = inverse.rb();
    matmul(
        MatMut::from_column_major_slice_mut(p, n, n),
        BlockStructure::TriangularLower,
        Accum::Replace,
        inverse.transpose(),
        BlockStructure::TriangularUpper,
        inverse,
        BlockStructure::TriangularLower,
        1.0,
        Par::Seq,
    );
}
