use crate::{
    Matrix, NoiseCovariance, NoiseError,
    decomposition::{self, NoConvergence},
    matrix::norm,
    rank::numerical_rank,
};

/// Why information or a bound could not be had.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InformationError {
    /// The noise covariance does not fit the sensitivities.
    #[error("noise covariance not applied")]
    Noise(#[from] NoiseError),
    /// Weights, parameters or transformations of another size.
    #[error("{found} given where {expected} are needed")]
    Size {
        /// Rows or columns given.
        found: usize,
        /// Rows or columns needed.
        expected: usize,
    },
    /// Some combination of parameters leaves no trace in what is kept.
    #[error("only {rank} of {parameters} parameters can be told apart")]
    Unidentifiable {
        /// Rank of the information.
        rank: usize,
        /// Number of parameters.
        parameters: usize,
    },
    /// A decomposition did not converge.
    #[error(transparent)]
    NoConvergence(#[from] NoConvergence),
}

/// Fisher information about parameters in a signal with Gaussian noise, or in
/// the numbers that are kept of it.
///
/// ```text
/// whole signal:  I = Jᵀ·Σ⁻¹·J
/// kept z = E·y:  I = (E·J)ᵀ·(E·Σ·Eᵀ)⁻¹·(E·J)
/// ```
///
/// `J` has the change of the signal per unit of each parameter, one parameter a
/// column ([`Sensitivities`](crate::Sensitivities)), `Σ` is the covariance of
/// the noise. It is held as a root `G`, `I = Gᵀ·G`: with `Σ = L·Lᵀ` and `Q` an
/// orthonormal basis of `Lᵀ·Eᵀ`, `G = Qᵀ·L⁻¹·J`, so that nothing is squared.
///
/// # Examples
///
/// Two samples of one constant tell its value with half the variance of one.
///
/// ```
/// use reduction::{Information, Matrix, NoiseCovariance, NoiseModel};
///
/// let noise = NoiseCovariance::new(&NoiseModel::White { variance: 4.0 }, 2, 0.0)?;
/// let constant = Matrix::from_columns(&[[1.0, 1.0]])?;
/// let both = Information::of_signal(&constant, &noise)?;
/// let first = Matrix::from_columns(&[[1.0, 0.0]])?;
/// let one = Information::of_encoding(&constant, &noise, &first)?;
/// assert!((both.cramer_rao()?.deviations()[0] - 2.0_f64.sqrt()).abs() < 1e-14);
/// assert!((one.cramer_rao()?.deviations()[0] - 2.0).abs() < 1e-14);
/// assert!((one.fraction_of(&both)? - 0.5).abs() < 1e-14);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Information {
    root: Matrix,
}

impl Information {
    /// Information in the whole signal.
    ///
    /// # Errors
    ///
    /// [`InformationError::Noise`].
    pub fn of_signal(
        sensitivities: &Matrix,
        noise: &NoiseCovariance,
    ) -> Result<Self, InformationError> {
        Ok(Self { root: noise.whiten(sensitivities)? })
    }

    /// Information in the numbers that the columns of `weights` weigh out of
    /// the signal ([`CompressionMap::weights`](crate::CompressionMap::weights)).
    ///
    /// # Errors
    ///
    /// [`InformationError::Noise`], [`InformationError::NoConvergence`].
    pub fn of_encoding(
        sensitivities: &Matrix,
        noise: &NoiseCovariance,
        weights: &Matrix,
    ) -> Result<Self, InformationError> {
        Ok(Self::of_signal(sensitivities, noise)?.seen_by(&seen(noise, weights)?))
    }

    /// Information that is left in a subspace of the whitened signals.
    pub(crate) fn seen_by(&self, basis: &Matrix) -> Self {
        Self { root: basis.transposed_times(&self.root) }
    }

    /// `I`, one parameter a row and a column.
    pub fn matrix(&self) -> Matrix {
        self.root.transposed_times(&self.root)
    }

    /// Mean over all directions of parameter space of the share of `whole` that
    /// is here, `tr(I_whole⁻¹·I)/p`: 1 when nothing is lost.
    ///
    /// # Errors
    ///
    /// [`InformationError::Unidentifiable`] when `whole` lacks a direction,
    /// [`InformationError::Size`].
    pub fn fraction_of(&self, whole: &Self) -> Result<f64, InformationError> {
        let (found, expected) = (self.root.columns(), whole.root.columns());
        if found != expected {
            return Err(InformationError::Size { found, expected });
        }
        let inverse = whole.inverse_root()?;
        Ok(self.root.times(&inverse).frobenius_norm().powi(2) / found as f64)
    }

    /// The least covariance that unbiased estimates can have.
    ///
    /// # Errors
    ///
    /// [`InformationError::Unidentifiable`], [`InformationError::NoConvergence`].
    pub fn cramer_rao(&self) -> Result<CramerRao, InformationError> {
        Ok(CramerRao { root: self.inverse_root()? })
    }

    /// `B` with `I⁻¹ = B·Bᵀ`, by a decomposition of `G` with its columns scaled
    /// to unit norm, so that the units of the parameters do not matter.
    fn inverse_root(&self) -> Result<Matrix, InformationError> {
        let parameters = self.root.columns();
        let scale: Vec<f64> = (0..parameters).map(|index| norm(self.root.column(index))).collect();
        let mut scaled = self.root.clone();
        for (index, &length) in scale.iter().enumerate() {
            if length > 0.0 {
                scaled.column_mut(index).iter_mut().for_each(|value| *value /= length);
            }
        }
        let svd = decomposition::thin_svd(&scaled)?;
        let rank = numerical_rank(&svd.singular_values, self.root.rows(), parameters);
        if rank < parameters {
            return Err(InformationError::Unidentifiable { rank, parameters });
        }
        let mut inverse = svd.right;
        for (column, singular) in svd.singular_values.iter().enumerate() {
            for (value, length) in inverse.column_mut(column).iter_mut().zip(&scale) {
                *value /= singular * length;
            }
        }
        Ok(inverse)
    }
}

/// Orthonormal basis of `Lᵀ·Eᵀ`: what an encoding sees of the whitened signals.
pub(crate) fn seen(noise: &NoiseCovariance, weights: &Matrix) -> Result<Matrix, InformationError> {
    let svd = decomposition::thin_svd(&noise.times_transposed(weights)?)?;
    let rank = numerical_rank(&svd.singular_values, weights.rows(), weights.columns());
    Ok(svd.left.leading_columns(rank.max(1)))
}

/// Cramér–Rao bound: the covariance that no unbiased estimate undercuts.
///
/// # Source
///
/// Kay, Fundamentals of Statistical Signal Processing: Estimation Theory,
/// Prentice Hall 1993, section 3.9 (Gaussian noise).
#[derive(Clone, Debug, PartialEq)]
pub struct CramerRao {
    /// `B`, covariance `B·Bᵀ`.
    root: Matrix,
}

impl CramerRao {
    /// Least standard deviation of each parameter.
    pub fn deviations(&self) -> Vec<f64> {
        let rows = self.root.transposed();
        (0..rows.columns()).map(|index| norm(rows.column(index))).collect()
    }

    /// The covariance.
    pub fn covariance(&self) -> Matrix {
        self.root.times(&self.root.transposed())
    }

    /// Bound of other quantities, whose change per unit of each parameter is
    /// given one quantity a row (first order).
    ///
    /// # Errors
    ///
    /// [`InformationError::Size`].
    pub fn of_derived(&self, derivatives: &Matrix) -> Result<Self, InformationError> {
        let (found, expected) = (derivatives.columns(), self.root.rows());
        if found != expected {
            return Err(InformationError::Size { found, expected });
        }
        Ok(Self { root: derivatives.times(&self.root) })
    }
}
