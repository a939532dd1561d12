use crate::{Matrix, RankRule, Snapshots, decomposition};

/// Why a singular value decomposition could not be had.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SvdError {
    /// The iteration did not converge.
    #[error(transparent)]
    NoConvergence(#[from] decomposition::NoConvergence),
    /// Every value is zero, so that there is no direction to keep.
    #[error("every value is zero: no rank to keep")]
    Zero,
    /// A rank of zero was asked for.
    #[error("rank 0 was asked for")]
    RankZero,
    /// An energy fraction outside (0, 1].
    #[error("energy fraction {found} is not in (0, 1]")]
    EnergyOutOfRange {
        /// The fraction given.
        found: f64,
    },
}

/// Singular value decomposition, thin or truncated.
///
/// ```text
/// X ≈ U·diag(σ)·Vᵀ
/// ```
///
/// | symbol | accessor | shape | meaning |
/// |---|---|---|---|
/// | `U` | [`left`](Self::left) | locations × rank | orthonormal modes |
/// | `σ` | [`singular_values`](Self::singular_values) | rank | not increasing |
/// | `V` | [`right`](Self::right) | snapshots × rank | orthonormal coordinates |
///
/// **Signs.** The entry of largest magnitude of each column of `U` is positive
/// (the first of them in a tie), and the column of `V` follows.
#[derive(Clone, Debug, PartialEq)]
pub struct Svd {
    pub(crate) left: Matrix,
    pub(crate) singular_values: Vec<f64>,
    pub(crate) right: Matrix,
}

/// Thin decomposition of all singular values, zeros included.
///
/// # Errors
///
/// [`SvdError::NoConvergence`].
///
/// # Accuracy
///
/// Backward stable: `‖X − U·diag(σ)·Vᵀ‖` and the departure of `UᵀU` from the
/// identity are modest multiples of `ε·max(m, n)·σ₁` and `ε·max(m, n)`.
///
/// # Examples
///
/// ```
/// use reduction::{Snapshots, thin_svd};
///
/// let snapshots = Snapshots::from_columns(&[[3.0, 0.0, 0.0], [0.0, -4.0, 0.0]])?;
/// let svd = thin_svd(&snapshots)?;
/// assert!((svd.singular_values()[0] - 4.0).abs() < 1e-14);
/// assert!((svd.left().get(1, 0) - 1.0).abs() < 1e-14); // largest entry is positive
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
pub fn thin_svd(snapshots: &Snapshots) -> Result<Svd, SvdError> {
    let raw = decomposition::thin_svd(snapshots.matrix())?;
    let mut svd = Svd { left: raw.left, singular_values: raw.singular_values, right: raw.right };
    svd.fix_signs();
    Ok(svd)
}

impl Svd {
    /// Left singular vectors, one a column: the modes of the signals.
    pub fn left(&self) -> &Matrix {
        &self.left
    }

    /// Singular values, not increasing.
    pub fn singular_values(&self) -> &[f64] {
        &self.singular_values
    }

    /// Right singular vectors, one a column: the coordinates of the snapshots
    /// are `diag(σ)·Vᵀ`.
    pub fn right(&self) -> &Matrix {
        &self.right
    }

    /// The rank that `rule` keeps, at least one.
    ///
    /// # Errors
    ///
    /// [`SvdError::Zero`] when every singular value is zero,
    /// [`SvdError::RankZero`], [`SvdError::EnergyOutOfRange`].
    pub fn rank(&self, rule: RankRule) -> Result<usize, SvdError> {
        checked_rank(rule, &self.singular_values, self.left.rows(), self.right.rows())
    }

    /// The leading part that `rule` keeps.
    ///
    /// # Errors
    ///
    /// As [`rank`](Self::rank).
    pub fn truncated(&self, rule: RankRule) -> Result<Self, SvdError> {
        let rank = self.rank(rule)?;
        Ok(Self {
            left: self.left.leading_columns(rank),
            singular_values: self.singular_values[..rank].to_vec(),
            right: self.right.leading_columns(rank),
        })
    }

    /// `U·diag(σ)·Vᵀ`.
    pub fn reconstruct(&self) -> Matrix {
        let mut scaled = self.left.clone();
        for (index, &singular) in self.singular_values.iter().enumerate() {
            scaled.column_mut(index).iter_mut().for_each(|value| *value *= singular);
        }
        scaled.times(&self.right.transposed())
    }

    /// Makes the largest entry of each left vector positive.
    pub(crate) fn fix_signs(&mut self) {
        for index in 0..self.left.columns() {
            if largest_entry(self.left.column(index)) < 0.0 {
                self.left.column_mut(index).iter_mut().for_each(|value| *value = -*value);
                self.right.column_mut(index).iter_mut().for_each(|value| *value = -*value);
            }
        }
    }
}

/// The rank of a rule whose own parameters are sound, at least one.
pub(crate) fn checked_rank(
    rule: RankRule,
    singular_values: &[f64],
    rows: usize,
    columns: usize,
) -> Result<usize, SvdError> {
    match rule {
        RankRule::Fixed(0) => return Err(SvdError::RankZero),
        RankRule::Energy(found) if !(found > 0.0 && found <= 1.0) => {
            return Err(SvdError::EnergyOutOfRange { found });
        }
        _ => {}
    }
    match rule.rank(singular_values, rows, columns) {
        0 => Err(SvdError::Zero),
        rank => Ok(rank),
    }
}

/// The entry of largest magnitude, the first in a tie.
pub(crate) fn largest_entry(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |top: f64, &value| if value.abs() > top.abs() { value } else { top })
}
