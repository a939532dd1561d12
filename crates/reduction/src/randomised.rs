use rand::RngExt;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use crate::{
    Matrix, Snapshots, Svd, SvdError,
    decomposition::{self, Qr},
    leading::leading_svd,
};

/// Smaller dimension from which random directions are quicker than all of them.
const LEAST_SIZE: usize = 150;

/// Smaller dimension, in directions drawn, from which they are quicker with up to two power
/// iterations; with more of them it grows as their number.
const LEAST_SHARE: usize = 3;

/// Settings of [`randomised_svd`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RandomisedConfig {
    /// Singular values wanted.
    pub rank: usize,
    /// Directions drawn beyond them.
    pub oversampling: usize,
    /// Multiplications by `X·Xᵀ`, each of which sharpens the separation of the
    /// wanted directions from the rest by its square.
    pub power_iterations: usize,
    /// Seed of the directions.
    pub seed: u64,
}

impl Default for RandomisedConfig {
    /// Rank 30, the customary 10 more, two power iterations.
    fn default() -> Self {
        Self { rank: 30, oversampling: 10, power_iterations: 2, seed: 0 }
    }
}

/// Leading part of the singular value decomposition from random directions.
///
/// Signs as in [`Svd`]. At most as many singular values come back as the
/// snapshots have. A matrix whose smaller dimension is below 150, or below three
/// times the directions drawn (more with more than two power iterations), is
/// decomposed without random directions, by [`leading_svd`]: that is quicker.
///
/// # Errors
///
/// [`SvdError::RankZero`], [`SvdError::NoConvergence`].
///
/// # Accuracy
///
/// With `q` power iterations a wanted direction of singular value `σ` is off by
/// some `(σ_{k+1}/σ)^{2q+1}`, `k` the rank and oversampling together.
///
/// # Source
///
/// Halko, Martinsson, Tropp, SIAM Review 53(2), 2011, algorithms 4.4 and 5.1,
/// with random signs for the directions.
///
/// # Examples
///
/// ```
/// use reduction::{RandomisedConfig, Snapshots, randomised_svd, thin_svd};
///
/// let snapshots =
///     Snapshots::from_fn(300, 60, |row, column| 1.0 / (1.0 + row as f64 + column as f64))?;
/// let config = RandomisedConfig { rank: 5, ..RandomisedConfig::default() };
/// let fast = randomised_svd(&snapshots, &config)?;
/// let direct = thin_svd(&snapshots)?;
/// let error = fast.singular_values()[4] - direct.singular_values()[4];
/// assert!(error.abs() < 1e-12 * direct.singular_values()[0]);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
pub fn randomised_svd(snapshots: &Snapshots, config: &RandomisedConfig) -> Result<Svd, SvdError> {
    if config.rank == 0 {
        return Err(SvdError::RankZero);
    }
    let matrix = snapshots.matrix();
    let size = matrix.rows().min(matrix.columns());
    let width = config.rank.saturating_add(config.oversampling);
    let share = config.power_iterations.saturating_add(1).max(LEAST_SHARE);
    if size < LEAST_SIZE || width.saturating_mul(share) > size {
        return leading_svd(snapshots, config.rank);
    }
    let mut random = ChaCha8Rng::seed_from_u64(config.seed);
    let signs = (0..matrix.columns() * width)
        .map(|_| if random.random::<bool>() { 1.0 } else { -1.0 })
        .collect();
    let directions = Matrix::raw(matrix.columns(), width, signs);
    let mut basis = Qr::new(matrix.times(&directions)).thin_basis();
    for _ in 0..config.power_iterations {
        let back = Qr::new(matrix.transposed_times(&basis)).thin_basis();
        basis = Qr::new(matrix.times(&back)).thin_basis();
    }
    let small = decomposition::thin_svd(&basis.transposed_times(matrix))?;
    let kept = config.rank;
    let mut svd = Svd {
        left: basis.times(&small.left.leading_columns(kept)),
        singular_values: small.singular_values[..kept].to_vec(),
        right: small.right.leading_columns(kept),
    };
    svd.fix_signs();
    Ok(svd)
}
