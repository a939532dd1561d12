use crate::{
    Complex, Matrix, RankRule, Snapshots, SvdError,
    decomposition::{self, NoConvergence, Qr, RawSvd},
    matrix::norm,
    svd::checked_rank,
};

/// Why a dynamic mode decomposition could not be had.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DmdError {
    /// A sequence needs two snapshots.
    #[error("{found} snapshot has no successor: at least 2 are needed")]
    TooFewSnapshots {
        /// Snapshots given.
        found: usize,
    },
    /// The decomposition of the snapshots failed, or they are all zero.
    #[error("snapshots could not be decomposed")]
    Svd(#[from] SvdError),
    /// The eigenvalue iteration did not converge.
    #[error("eigenvalues of the reduced operator not found")]
    Eigen(#[source] NoConvergence),
    /// The first modes asked for end between the two of a conjugate pair.
    #[error("the first {count} modes cut a conjugate pair in half")]
    PairCutInHalf {
        /// Modes asked for.
        count: usize,
    },
    /// More modes asked for than there are.
    #[error("{wanted} modes asked for, {found} found")]
    TooFewModes {
        /// Modes asked for.
        wanted: usize,
        /// Modes found.
        found: usize,
    },
}

/// Which vectors stand for the modes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum DmdKind {
    /// `Υ = U·W`: eigenvectors of the operator restricted to the leading left
    /// singular vectors (FREEDOM paper, eqs 2 and 3).
    #[default]
    Projected,
    /// `Υ = Y'·V·Σ⁻¹·W`: eigenvectors of the full least-squares operator
    /// `Y'·Y⁺` (Tu et al., J. Comput. Dyn. 1(2), 2014).
    Exact,
}

/// Settings of a [`Dmd`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DmdConfig {
    /// How many singular values of the first `n − 1` snapshots to keep.
    pub rank: RankRule,
    /// Which vectors stand for the modes.
    pub kind: DmdKind,
}

impl Default for DmdConfig {
    /// The paper's reading: projected modes, 30 of them.
    fn default() -> Self {
        Self { rank: RankRule::Fixed(30), kind: DmdKind::Projected }
    }
}

/// Dynamic mode decomposition of a sequence of snapshots.
///
/// ```text
/// Y = [y_0 … y_{n−1}],  Y' = [y_1 … y_n],  Y ≈ U·Σ·Vᵀ  (rank r)
/// A = Uᵀ·Y'·V·Σ⁻¹,      A·W = W·diag(λ)
/// y_j ≈ Σ_i b_i·υ_i·λ_i^j
/// ```
///
/// The result depends on the order of the snapshots: it is that of the columns
/// given, and nothing here changes it.
///
/// # Conventions
///
/// - Order: decreasing `|λ|`; equal moduli by increasing `|arg λ|`. The two of
///   a conjugate pair are neighbours, positive imaginary part first.
/// - Each mode has unit Euclidean norm, and its entry of largest modulus is
///   real and positive (the first of them in a tie). The second mode of a pair
///   is the conjugate of the first.
/// - Amplitudes `b` are the least-squares fit of the modes to the first
///   snapshot, as in `PyDMD`'s default.
///
/// # Valid for
///
/// Real snapshots. The rank applies to a real matrix, so that a truncation
/// never separates a conjugate pair. An [exact](DmdKind::Exact) mode with
/// `λ = 0` to rounding has no direction of its own; the projected mode stands
/// for it.
///
/// # Source
///
/// FREEDOM paper, eqs 1 to 3; Schmid, J. Fluid Mech. 656, 2010.
///
/// # Examples
///
/// ```
/// use reduction::{Dmd, DmdConfig, RankRule, Snapshots};
///
/// // One decaying shape: y_j = 0.9^j · (1, 2, 2).
/// let snapshots =
///     Snapshots::from_fn(3, 5, |row, j| [1.0, 2.0, 2.0][row] * 0.9_f64.powi(j as i32))?;
/// let config = DmdConfig { rank: RankRule::Full, ..DmdConfig::default() };
/// let dmd = Dmd::fit(&snapshots, &config)?;
/// assert!((dmd.eigenvalues()[0].re - 0.9).abs() < 1e-12);
/// assert!((dmd.mode(0)[1].re - 2.0 / 3.0).abs() < 1e-12);
/// assert!((dmd.amplitudes()[0].re - 3.0).abs() < 1e-12);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Dmd {
    eigenvalues: Vec<Complex>,
    amplitudes: Vec<Complex>,
    /// Real modes as they are; a pair as its real and its imaginary part.
    packed: Matrix,
    singular_values: Vec<f64>,
}

impl Dmd {
    /// Decomposes the snapshots in the order of their columns.
    ///
    /// # Errors
    ///
    /// [`DmdError::TooFewSnapshots`] for a single snapshot, [`DmdError::Svd`]
    /// when all but the last are zero or the rank rule is unsound,
    /// [`DmdError::Eigen`].
    ///
    /// # Cost
    ///
    /// One Householder factorisation of the snapshots, `2·m·n²` operations;
    /// everything else happens in its `n` coordinates, and only the `r` modes
    /// are brought back, `4·m·n·r`.
    pub fn fit(snapshots: &Snapshots, config: &DmdConfig) -> Result<Self, DmdError> {
        let count = snapshots.count();
        if count < 2 {
            return Err(DmdError::TooFewSnapshots { found: count });
        }
        // X = Q·R: the columns of R are the snapshots in coordinates of Q.
        let qr = Qr::new(snapshots.matrix().clone());
        let coordinates = qr.upper();
        let first = coordinates.leading_columns(count - 1);
        let next = Matrix::raw(
            coordinates.rows(),
            count - 1,
            coordinates.values()[coordinates.rows()..].to_vec(),
        );
        let svd = decomposition::thin_svd(&first).map_err(SvdError::from)?;
        let rank =
            checked_rank(config.rank, &svd.singular_values, snapshots.locations(), count - 1)?;
        let reduced = Reduced::new(&svd, &next, rank)?;
        let mut modes = reduced.modes(config.kind);
        reduced.normalise(&mut modes);
        let fitted = decomposition::least_squares(&modes, &coordinates.leading_columns(1))
            .map_err(SvdError::from)?;
        let packed = fix_phases(&reduced.eigenvalues, qr.lift(&modes), fitted.column(0));
        Ok(Self {
            amplitudes: packed.1,
            packed: packed.0,
            eigenvalues: reduced.eigenvalues,
            singular_values: svd.singular_values,
        })
    }

    /// Number of modes, the rank kept.
    pub fn rank(&self) -> usize {
        self.eigenvalues.len()
    }

    /// Eigenvalues: growth and turn from one snapshot to the next.
    pub fn eigenvalues(&self) -> &[Complex] {
        &self.eigenvalues
    }

    /// Share of each mode in the first snapshot.
    pub fn amplitudes(&self) -> &[Complex] {
        &self.amplitudes
    }

    /// All singular values of the first `n − 1` snapshots, kept or not.
    pub fn singular_values(&self) -> &[f64] {
        &self.singular_values
    }

    /// One mode.
    ///
    /// # Panics
    ///
    /// If there is no such mode.
    pub fn mode(&self, index: usize) -> Vec<Complex> {
        let (re, im, sign) = match pair_position(&self.eigenvalues, index) {
            PairPosition::Real => (index, None, 0.0),
            PairPosition::First => (index, Some(index + 1), 1.0),
            PairPosition::Second => (index - 1, Some(index), -1.0),
        };
        let re = self.packed.column(re).iter();
        match im {
            None => re.map(|&re| Complex::new(re, 0.0)).collect(),
            Some(im) => re
                .zip(self.packed.column(im))
                .map(|(&re, &im)| Complex::new(re, sign * im))
                .collect(),
        }
    }

    /// The modes as real columns: a real mode as it is, a conjugate pair as its
    /// real part and its imaginary part. The same span, the same number of
    /// columns as there are modes.
    pub fn real_modes(&self) -> &Matrix {
        &self.packed
    }

    /// The first `count` [real columns](Self::real_modes).
    ///
    /// # Errors
    ///
    /// [`DmdError::TooFewModes`], and [`DmdError::PairCutInHalf`] when the
    /// columns would end with a real part whose imaginary part is left out.
    pub fn leading_real_modes(&self, count: usize) -> Result<Matrix, DmdError> {
        if count > self.rank() {
            return Err(DmdError::TooFewModes { wanted: count, found: self.rank() });
        }
        if count > 0 && matches!(pair_position(&self.eigenvalues, count - 1), PairPosition::First) {
            return Err(DmdError::PairCutInHalf { count });
        }
        Ok(self.packed.leading_columns(count))
    }

    /// `Σ_i b_i·υ_i·λ_i^j` for `j = 0 … count − 1`, one a column.
    pub fn reconstruct(&self, count: usize) -> Matrix {
        let mut weights = Matrix::zeros(self.rank(), count);
        for step in 0..count {
            for index in 0..self.rank() {
                let exponent = u32::try_from(step).unwrap_or(u32::MAX);
                let weight = self.amplitudes[index] * self.eigenvalues[index].power(exponent);
                match pair_position(&self.eigenvalues, index) {
                    PairPosition::Real => weights.set(index, step, weight.re),
                    PairPosition::First => {
                        weights.set(index, step, 2.0 * weight.re);
                        weights.set(index + 1, step, -2.0 * weight.im);
                    }
                    PairPosition::Second => {}
                }
            }
        }
        self.packed.times(&weights)
    }
}

enum PairPosition {
    Real,
    First,
    Second,
}

fn pair_position(eigenvalues: &[Complex], index: usize) -> PairPosition {
    match eigenvalues[index].im {
        im if im > 0.0 => PairPosition::First,
        im if im < 0.0 => PairPosition::Second,
        _ => PairPosition::Real,
    }
}

/// The operator restricted to the kept singular vectors, eigenvalues in order.
struct Reduced {
    eigenvalues: Vec<Complex>,
    /// Eigenvectors in the coordinates of the kept singular vectors, packed.
    vectors: Matrix,
    left: Matrix,
    /// `Y'·V·Σ⁻¹` in coordinates of the factorisation.
    image: Matrix,
}

impl Reduced {
    fn new(svd: &RawSvd, next: &Matrix, rank: usize) -> Result<Self, DmdError> {
        let left = svd.left.leading_columns(rank);
        let mut image = next.times(&svd.right.leading_columns(rank));
        for (index, singular) in svd.singular_values[..rank].iter().enumerate() {
            image.column_mut(index).iter_mut().for_each(|value| *value /= singular);
        }
        let operator = left.transposed_times(&image);
        let eigen = decomposition::real_eigen(&operator).map_err(DmdError::Eigen)?;
        let mut eigenvalues = Vec::with_capacity(rank);
        let mut vectors = Matrix::zeros(rank, rank);
        for start in unit_order(&eigen.re, &eigen.im) {
            let to = eigenvalues.len();
            let width = if eigen.im[start] == 0.0 { 1 } else { 2 };
            for offset in 0..width {
                vectors
                    .column_mut(to + offset)
                    .copy_from_slice(eigen.packed.column(start + offset));
                eigenvalues.push(Complex::new(eigen.re[start + offset], eigen.im[start + offset]));
            }
        }
        Ok(Self { eigenvalues, vectors, left, image })
    }

    fn modes(&self, kind: DmdKind) -> Matrix {
        let projected = self.left.times(&self.vectors);
        if kind == DmdKind::Projected {
            return projected;
        }
        let mut exact = self.image.times(&self.vectors);
        // Y'·V·Σ⁻¹·w = λ·υ: with λ lost in rounding there is no direction in it.
        let floor = self.image.frobenius_norm() * self.left.rows() as f64 * f64::EPSILON;
        for unit in units(&self.eigenvalues) {
            if unit.clone().all(|column| norm(exact.column(column)) <= floor) {
                for column in unit {
                    exact.column_mut(column).copy_from_slice(projected.column(column));
                }
            }
        }
        exact
    }

    /// Gives each mode unit Euclidean norm.
    fn normalise(&self, modes: &mut Matrix) {
        for unit in units(&self.eigenvalues) {
            let length =
                unit.clone().map(|column| norm(modes.column(column))).fold(0.0, f64::hypot);
            for column in unit {
                modes.column_mut(column).iter_mut().for_each(|value| *value /= length);
            }
        }
    }
}

/// The packed columns of each real mode and of each pair.
fn units(eigenvalues: &[Complex]) -> impl Iterator<Item = std::ops::Range<usize>> + '_ {
    (0..eigenvalues.len()).filter_map(|index| match pair_position(eigenvalues, index) {
        PairPosition::Real => Some(index..index + 1),
        PairPosition::First => Some(index..index + 2),
        PairPosition::Second => None,
    })
}

/// First indices of the real eigenvalues and pairs, in the order of the
/// conventions.
fn unit_order(re: &[f64], im: &[f64]) -> Vec<usize> {
    let mut starts: Vec<usize> = (0..re.len()).filter(|&index| im[index] >= 0.0).collect();
    let key = |index: usize| {
        let value = Complex::new(re[index], im[index]);
        (-value.modulus(), value.argument_rad().abs())
    };
    starts.sort_by(|&a, &b| {
        let (a, b) = (key(a), key(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    starts
}

/// Turns each mode so that its largest entry is real and positive, and brings
/// the packed least-squares coefficients to complex amplitudes.
fn fix_phases(
    eigenvalues: &[Complex],
    mut packed: Matrix,
    fitted: &[f64],
) -> (Matrix, Vec<Complex>) {
    let mut amplitudes = vec![Complex::default(); eigenvalues.len()];
    for index in 0..eigenvalues.len() {
        match pair_position(eigenvalues, index) {
            PairPosition::Real => {
                let sign = crate::svd::largest_entry(packed.column(index)).signum();
                packed.column_mut(index).iter_mut().for_each(|value| *value *= sign);
                amplitudes[index] = Complex::new(fitted[index] * sign, 0.0);
            }
            PairPosition::First => {
                let phase = largest_phase(packed.column(index), packed.column(index + 1));
                turn(&mut packed, index, phase.conjugate());
                // c_re·Re υ + c_im·Im υ = b·υ + conj, so b = (c_re − i·c_im)/2.
                let amplitude = Complex::new(fitted[index] / 2.0, -fitted[index + 1] / 2.0) * phase;
                amplitudes[index] = amplitude;
                amplitudes[index + 1] = amplitude.conjugate();
            }
            PairPosition::Second => {}
        }
    }
    (packed, amplitudes)
}

/// Unit phase of the entry of largest modulus.
fn largest_phase(re: &[f64], im: &[f64]) -> Complex {
    let mut top = Complex::new(1.0, 0.0);
    let mut largest = 0.0;
    for (&re, &im) in re.iter().zip(im) {
        let modulus = re.hypot(im);
        if modulus > largest {
            largest = modulus;
            top = Complex::new(re / modulus, im / modulus);
        }
    }
    top
}

/// Multiplies the mode in columns `index` and `index + 1` by `factor`.
fn turn(packed: &mut Matrix, index: usize, factor: Complex) {
    for row in 0..packed.rows() {
        let turned = Complex::new(packed.get(row, index), packed.get(row, index + 1)) * factor;
        packed.set(row, index, turned.re);
        packed.set(row, index + 1, turned.im);
    }
}
