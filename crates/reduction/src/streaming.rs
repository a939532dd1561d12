use crate::{
    Matrix, RankRule, Snapshots, SvdError,
    decomposition::{self, Qr},
    svd::{checked_rank, largest_entry},
};

/// Why a streamed decomposition could not go on.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StreamingError {
    /// A block of another length than the ones before.
    #[error("snapshots of {found} locations after ones of {expected}")]
    Locations {
        /// Locations of the block.
        found: usize,
        /// Locations of the blocks before.
        expected: usize,
    },
    /// No direction to keep, or no block to gather.
    #[error("rank {rank} and block {block} must both be positive")]
    Config {
        /// Directions to keep.
        rank: usize,
        /// Snapshots to gather before a decomposition.
        block: usize,
    },
    /// Nothing was pushed.
    #[error("no snapshot was pushed")]
    Nothing,
    /// A decomposition failed, or all snapshots were zero.
    #[error(transparent)]
    Svd(#[from] SvdError),
}

/// Settings of a [`StreamingSvd`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamingConfig {
    /// Directions carried from block to block. What lies beyond is lost, so
    /// keep more than are wanted in the end.
    pub rank: usize,
    /// Snapshots gathered before each decomposition.
    pub block: usize,
}

/// Singular value decomposition of snapshots that come a few at a time.
///
/// ```text
/// [U·Σ | block] = Q·R,  R = U_R·Σ'·V_Rᵀ,  U' = Q·U_R   (leading columns)
/// ```
///
/// Memory is `locations · 2·(rank + block)` numbers, whatever the number of
/// snapshots. Right vectors are not kept; a second reading gives them as
/// `Vᵀ = Σ⁻¹·Uᵀ·X`.
///
/// # Accuracy
///
/// A truncation takes away squares alone: the outer product `X·Xᵀ` that is left
/// differs from the true one by at most the sum of the squares of the first
/// singular value dropped at each step, in the spectral norm. That sum is
/// [reported](StreamedSvd::dropped), and with it what it can do to each mode.
///
/// # Source
///
/// Levy, Lindenbaum, IEEE Trans. Image Process. 9(8), 2000 (sequential
/// Karhunen–Loève basis extraction); the bound is Weyl's and Davis and Kahan's.
///
/// # Examples
///
/// ```
/// use reduction::{Snapshots, StreamingConfig, StreamingSvd, thin_svd};
///
/// let snapshots =
///     Snapshots::from_fn(50, 30, |row, column| 1.0 / (1.0 + row as f64 + column as f64))?;
/// let mut stream = StreamingSvd::new(StreamingConfig { rank: 12, block: 7 })?;
/// for index in 0..snapshots.count() {
///     stream.push(&snapshots.reordered(&[index]))?; // one at a time
/// }
/// let streamed = stream.finish()?;
/// let direct = thin_svd(&snapshots)?;
/// let error = streamed.singular_values()[3] - direct.singular_values()[3];
/// assert!(error.abs() < 1e-12);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct StreamingSvd {
    config: StreamingConfig,
    locations: usize,
    /// `U·Σ` so far, then the snapshots gathered since.
    columns: Vec<f64>,
    carried: usize,
    gathered: usize,
    state: StreamedSvd,
}

/// Result of a [`StreamingSvd`].
#[derive(Clone, Debug, PartialEq)]
pub struct StreamedSvd {
    left: Matrix,
    singular_values: Vec<f64>,
    snapshots: usize,
    dropped: f64,
}

impl StreamingSvd {
    /// Starts without a snapshot.
    ///
    /// # Errors
    ///
    /// [`StreamingError::Config`].
    pub fn new(config: StreamingConfig) -> Result<Self, StreamingError> {
        let StreamingConfig { rank, block } = config;
        if rank == 0 || block == 0 {
            return Err(StreamingError::Config { rank, block });
        }
        let state = StreamedSvd {
            left: Matrix::zeros(0, 0),
            singular_values: Vec::new(),
            snapshots: 0,
            dropped: 0.0,
        };
        Ok(Self { config, locations: 0, columns: Vec::new(), carried: 0, gathered: 0, state })
    }

    /// Takes in snapshots, any number at a time.
    ///
    /// # Errors
    ///
    /// [`StreamingError::Locations`], [`StreamingError::Svd`].
    pub fn push(&mut self, snapshots: &Snapshots) -> Result<(), StreamingError> {
        if self.state.snapshots == 0 {
            self.locations = snapshots.locations();
        }
        let (found, expected) = (snapshots.locations(), self.locations);
        if found != expected {
            return Err(StreamingError::Locations { found, expected });
        }
        for index in 0..snapshots.count() {
            self.columns.extend_from_slice(snapshots.snapshot(index));
            self.gathered += 1;
            self.state.snapshots += 1;
            if self.gathered == self.config.block {
                self.decompose()?;
            }
        }
        Ok(())
    }

    /// Works in what was gathered last, and ends.
    ///
    /// # Errors
    ///
    /// [`StreamingError::Nothing`], [`StreamingError::Svd`].
    pub fn finish(mut self) -> Result<StreamedSvd, StreamingError> {
        if self.state.snapshots == 0 {
            return Err(StreamingError::Nothing);
        }
        if self.gathered > 0 {
            self.decompose()?;
        }
        let StreamedSvd { left, singular_values, snapshots, .. } = &mut self.state;
        checked_rank(RankRule::Full, singular_values, self.locations, *snapshots)?;
        for index in 0..left.columns() {
            if largest_entry(left.column(index)) < 0.0 {
                left.column_mut(index).iter_mut().for_each(|value| *value = -*value);
            }
        }
        Ok(self.state)
    }

    fn decompose(&mut self) -> Result<(), StreamingError> {
        let count = self.carried + self.gathered;
        let qr = Qr::new(Matrix::raw(self.locations, count, std::mem::take(&mut self.columns)));
        let svd = decomposition::thin_svd(&qr.upper()).map_err(SvdError::from)?;
        let kept = self.config.rank.min(svd.singular_values.len());
        self.state.dropped += svd.singular_values.get(kept).map_or(0.0, |value| value * value);
        self.state.left = qr.lift(&svd.left.leading_columns(kept));
        self.state.singular_values = svd.singular_values[..kept].to_vec();
        self.columns = qr.into_memory();
        self.columns.clear();
        for (index, singular) in self.state.singular_values.iter().enumerate() {
            self.columns.extend(self.state.left.column(index).iter().map(|value| value * singular));
        }
        (self.carried, self.gathered) = (kept, 0);
        Ok(())
    }
}

impl StreamedSvd {
    /// Left singular vectors, one a column; the largest entry of each is
    /// positive.
    pub fn left(&self) -> &Matrix {
        &self.left
    }

    /// Singular values, not increasing; none is larger than the true one beyond
    /// rounding.
    pub fn singular_values(&self) -> &[f64] {
        &self.singular_values
    }

    /// Number of snapshots that went in.
    pub fn snapshots(&self) -> usize {
        self.snapshots
    }

    /// Bound on how far `X·Xᵀ` was changed by truncation, in the spectral norm.
    pub fn dropped(&self) -> f64 {
        self.dropped
    }

    /// Bound on the sine of the angle between mode `index` and the true one
    /// that truncation can have caused; none when the modes beside it are too
    /// close to be told from it. Rounding comes on top.
    pub fn mode_error(&self, index: usize) -> Option<f64> {
        let square = |at: usize| self.singular_values.get(at).map(|value| value * value);
        let own = square(index)?;
        let above = index.checked_sub(1).and_then(square).map_or(f64::INFINITY, |up| up - own);
        let below = own - square(index + 1).unwrap_or(0.0);
        let gap = above.min(below) - self.dropped;
        (gap > 0.0).then(|| self.dropped / gap)
    }
}
