//! The dense decompositions, all sequential: the only file that calls faer's
//! factorisations.

use faer::{
    Conj, MatMut, MatRef, Par, Spec,
    diag::Diag,
    dyn_stack::{MemBuffer, MemStack},
    linalg::{
        evd::{self, ComputeEigenvectors},
        householder, qr,
        svd::{self, ComputeSvdVectors, SvdParams},
    },
    prelude::default,
};

use crate::Matrix;

/// A decomposition did not converge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("decomposition of a {rows} by {columns} matrix did not converge")]
pub struct NoConvergence {
    /// Rows of the matrix.
    pub rows: usize,
    /// Columns of the matrix.
    pub columns: usize,
}

/// `A = U·diag(σ)·Vᵀ`, thin, `σ` not increasing, signs as they come.
pub(crate) struct RawSvd {
    pub(crate) left: Matrix,
    pub(crate) singular_values: Vec<f64>,
    pub(crate) right: Matrix,
}

pub(crate) fn thin_svd(matrix: &Matrix) -> Result<RawSvd, NoConvergence> {
    let (rows, columns) = (matrix.rows(), matrix.columns());
    let size = rows.min(columns);
    let (mut left, mut right) = (Matrix::zeros(rows, size), Matrix::zeros(columns, size));
    let mut singular_values = Diag::zeros(size);
    let params: Spec<SvdParams, f64> = default();
    let thin = ComputeSvdVectors::Thin;
    let mut memory =
        MemBuffer::new(svd::svd_scratch::<f64>(rows, columns, thin, thin, Par::Seq, params));
    svd::svd(
        matrix.view(),
        singular_values.as_mut(),
        Some(left.view_mut()),
        Some(right.view_mut()),
        Par::Seq,
        MemStack::new(&mut memory),
        params,
    )
    .map_err(|svd::SvdError::NoConvergence| NoConvergence { rows, columns })?;
    let singular_values = singular_values.column_vector().iter().copied().collect();
    Ok(RawSvd { left, singular_values, right })
}

/// Householder factorisation `A = Q·R`.
pub(crate) struct Qr {
    basis: Matrix,
    coefficients: Matrix,
}

impl Qr {
    pub(crate) fn new(matrix: Matrix) -> Self {
        let mut basis = matrix;
        let (rows, columns) = (basis.rows(), basis.columns());
        let block = qr::no_pivoting::factor::recommended_block_size::<f64>(rows, columns);
        let mut coefficients = Matrix::zeros(block, rows.min(columns));
        let scratch = qr::no_pivoting::factor::qr_in_place_scratch::<f64>(
            rows,
            columns,
            block,
            Par::Seq,
            default(),
        );
        qr::no_pivoting::factor::qr_in_place(
            basis.view_mut(),
            coefficients.view_mut(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            default(),
        );
        Self { basis, coefficients }
    }

    /// Upper trapezoidal factor, `min(m, n)` rows.
    pub(crate) fn upper(&self) -> Matrix {
        let size = self.basis.rows().min(self.basis.columns());
        let mut upper = Matrix::zeros(size, self.basis.columns());
        for column in 0..self.basis.columns() {
            let count = (column + 1).min(size);
            upper.column_mut(column)[..count].copy_from_slice(&self.basis.column(column)[..count]);
        }
        upper
    }

    /// `Q·coordinates`, with as many rows as the factored matrix.
    pub(crate) fn lift(&self, coordinates: &Matrix) -> Matrix {
        let mut result = Matrix::zeros(self.basis.rows(), coordinates.columns());
        for column in 0..coordinates.columns() {
            result.column_mut(column)[..coordinates.rows()]
                .copy_from_slice(coordinates.column(column));
        }
        self.apply(result.view_mut());
        result
    }

    /// Orthonormal basis of `min(m, n)` columns.
    pub(crate) fn thin_basis(&self) -> Matrix {
        let size = self.coefficients.columns();
        let mut identity = Matrix::zeros(size, size);
        (0..size).for_each(|index| identity.set(index, index, 1.0));
        self.lift(&identity)
    }

    /// Gives the memory of the factored matrix back, to be filled anew.
    pub(crate) fn into_memory(self) -> Vec<f64> {
        self.basis.into_values()
    }

    fn apply(&self, matrix: MatMut<'_, f64>) {
        let size = self.coefficients.columns();
        let basis: MatRef<'_, f64> = self.basis.view().subcols(0, size);
        let scratch = householder::apply_block_householder_sequence_on_the_left_in_place_scratch::<
            f64,
        >(self.basis.rows(), self.coefficients.rows(), matrix.ncols());
        householder::apply_block_householder_sequence_on_the_left_in_place_with_conj(
            basis,
            self.coefficients.view(),
            Conj::No,
            matrix,
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
        );
    }
}

/// Eigenvalues, not decreasing, and orthonormal eigenvectors of a symmetric matrix.
pub(crate) struct SymmetricEigen {
    pub(crate) values: Vec<f64>,
    pub(crate) vectors: Matrix,
}

/// Decomposes a symmetric matrix, of which the lower triangle is read.
pub(crate) fn symmetric_eigen(matrix: &Matrix) -> Result<SymmetricEigen, NoConvergence> {
    let size = matrix.rows();
    let mut vectors = Matrix::zeros(size, size);
    let mut values = Diag::zeros(size);
    let scratch =
        evd::self_adjoint_evd_scratch::<f64>(size, ComputeEigenvectors::Yes, Par::Seq, default());
    evd::self_adjoint_evd(
        matrix.view(),
        values.as_mut(),
        Some(vectors.view_mut()),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        default(),
    )
    .map_err(|_| NoConvergence { rows: size, columns: size })?;
    Ok(SymmetricEigen { values: values.column_vector().iter().copied().collect(), vectors })
}

/// Eigenvalues and right eigenvectors of a real square matrix.
///
/// `packed` follows LAPACK's `dgeev`: a real eigenvalue has its vector in its
/// column; a conjugate pair has the real part of the vector of `re + i·im`,
/// `im > 0`, in the first of its two columns and the imaginary part in the
/// second.
pub(crate) struct RealEigen {
    pub(crate) re: Vec<f64>,
    pub(crate) im: Vec<f64>,
    pub(crate) packed: Matrix,
}

pub(crate) fn real_eigen(matrix: &Matrix) -> Result<RealEigen, NoConvergence> {
    let size = matrix.rows();
    let mut packed = Matrix::zeros(size, size);
    let (mut re, mut im) = (Diag::zeros(size), Diag::zeros(size));
    let scratch = evd::evd_scratch::<f64>(
        size,
        ComputeEigenvectors::No,
        ComputeEigenvectors::Yes,
        Par::Seq,
        default(),
    );
    evd::evd_real(
        matrix.view(),
        re.as_mut(),
        im.as_mut(),
        None,
        Some(packed.view_mut()),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        default(),
    )
    .map_err(|_| NoConvergence { rows: size, columns: size })?;
    Ok(RealEigen {
        re: re.column_vector().iter().copied().collect(),
        im: im.column_vector().iter().copied().collect(),
        packed,
    })
}

/// Minimum-norm least-squares solution of `matrix · x = right`, singular values
/// below `max(m, n)·ε·σ₁` taken as zero.
pub(crate) fn least_squares(matrix: &Matrix, right: &Matrix) -> Result<Matrix, NoConvergence> {
    let svd = thin_svd(matrix)?;
    let rank = crate::rank::numerical_rank(&svd.singular_values, matrix.rows(), matrix.columns());
    let mut coordinates = svd.left.leading_columns(rank.max(1)).transposed_times(right);
    for column in 0..coordinates.columns() {
        for (value, singular) in coordinates.column_mut(column).iter_mut().zip(&svd.singular_values)
        {
            *value = if rank == 0 { 0.0 } else { *value / singular };
        }
    }
    Ok(svd.right.leading_columns(rank.max(1)).times(&coordinates))
}
