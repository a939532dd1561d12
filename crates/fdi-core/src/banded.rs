//! Symmetric banded matrices and their Cholesky factor: the covariances of a filtered signal.

/// A symmetric matrix of order `n` with `b` diagonals below the main one.
///
/// Row `i` keeps the columns `i − b ..= i`; those left of the matrix are zero.
#[derive(Clone, Debug, PartialEq)]
pub struct BandedMatrix {
    order: usize,
    half_band: usize,
    rows: Vec<f64>,
}

/// A covariance without a Cholesky factor.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("covariance is not positive definite: pivot {pivot:e} in row {row}")]
pub struct NotPositiveDefinite {
    /// Row of the pivot.
    pub row: usize,
    /// The pivot.
    pub pivot: f64,
}

impl BandedMatrix {
    /// The zero matrix.
    pub fn zeros(order: usize, half_band: usize) -> Self {
        let half_band = half_band.min(order.saturating_sub(1));
        Self { order, half_band, rows: vec![0.0; order * (half_band + 1)] }
    }

    /// Rows and columns.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Diagonals below the main one.
    pub fn half_band(&self) -> usize {
        self.half_band
    }

    /// Element at `row ≥ column` within the band.
    ///
    /// # Panics
    ///
    /// Outside the band or above the diagonal.
    pub fn at_mut(&mut self, row: usize, column: usize) -> &mut f64 {
        assert!(column <= row && row - column <= self.half_band && row < self.order);
        &mut self.rows[row * (self.half_band + 1) + self.half_band - (row - column)]
    }

    /// Element anywhere; zero outside the band.
    pub fn at(&self, row: usize, column: usize) -> f64 {
        let (row, column) = if row >= column { (row, column) } else { (column, row) };
        if row - column > self.half_band {
            return 0.0;
        }
        self.rows[row * (self.half_band + 1) + self.half_band - (row - column)]
    }

    /// Adds `scale` times another matrix, whose band may be narrower.
    ///
    /// # Panics
    ///
    /// When the orders differ or the other band is wider.
    pub fn add_scaled(&mut self, scale: f64, other: &Self) {
        assert!(other.order == self.order && other.half_band <= self.half_band);
        let (wide, narrow) = (self.half_band + 1, other.half_band + 1);
        for (into, from) in self.rows.chunks_exact_mut(wide).zip(other.rows.chunks_exact(narrow)) {
            for (a, b) in into[wide - narrow..].iter_mut().zip(from) {
                *a += scale * b;
            }
        }
    }

    /// The matrix times a scalar.
    #[must_use]
    pub fn scaled(&self, scale: f64) -> Self {
        let rows = self.rows.iter().map(|value| scale * value).collect();
        Self { rows, ..*self }
    }

    /// The sum of two matrices.
    ///
    /// # Panics
    ///
    /// When the orders differ.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        let mut sum = Self::zeros(self.order, self.half_band.max(other.half_band));
        sum.add_scaled(1.0, self);
        sum.add_scaled(1.0, other);
        sum
    }

    /// Adds a constant to the diagonal.
    pub fn add_to_diagonal(&mut self, value: f64) {
        let wide = self.half_band + 1;
        for row in self.rows.chunks_exact_mut(wide) {
            row[wide - 1] += value;
        }
    }

    /// `A·x`.
    ///
    /// # Panics
    ///
    /// When the length is not the matrix order.
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        assert_eq!(x.len(), self.order);
        let (b, wide) = (self.half_band, self.half_band + 1);
        let mut product = vec![0.0; self.order];
        for i in 0..self.order {
            let row = &self.rows[i * wide..(i + 1) * wide];
            let first = i.saturating_sub(b);
            let below = &row[first + b - i..b];
            product[i] += dot(below, &x[first..i]) + row[b] * x[i];
            for (value, a) in product[first..i].iter_mut().zip(below) {
                *value += a * x[i];
            }
        }
        product
    }

    /// Mean of the diagonal.
    pub fn mean_diagonal(&self) -> f64 {
        let wide = self.half_band + 1;
        self.rows.chunks_exact(wide).map(|row| row[wide - 1]).sum::<f64>() / self.order as f64
    }

    /// The factor `L` of `A = L·Lᵀ`.
    ///
    /// # Cost
    ///
    /// `n·b²/2` multiplications.
    ///
    /// # Errors
    ///
    /// [`NotPositiveDefinite`] at the first pivot that is not above zero.
    pub fn cholesky(mut self) -> Result<BandedCholesky, NotPositiveDefinite> {
        let (b, wide) = (self.half_band, self.half_band + 1);
        for i in 0..self.order {
            let (above, rest) = self.rows.split_at_mut(i * wide);
            let row = &mut rest[..wide];
            let first = i.saturating_sub(b);
            for j in first..i {
                let other = &above[j * wide..(j + 1) * wide];
                // columns `first..j` of both rows
                let count = j - first;
                let sum = dot(
                    &row[first + b - i..first + b - i + count],
                    &other[first + b - j..first + b - j + count],
                );
                let place = j + b - i;
                row[place] = (row[place] - sum) / other[b];
            }
            let left = &row[first + b - i..b];
            let pivot = row[b] - dot(left, left);
            if pivot.is_nan() || pivot <= 0.0 {
                return Err(NotPositiveDefinite { row: i, pivot });
            }
            row[b] = pivot.sqrt();
        }
        Ok(BandedCholesky { factor: self })
    }
}

/// Cholesky factor of a banded matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct BandedCholesky {
    factor: BandedMatrix,
}

impl BandedCholesky {
    /// Solves `L·z = r` in place: white noise from coloured.
    ///
    /// # Panics
    ///
    /// When the length is not the matrix order.
    pub fn whiten(&self, r: &mut [f64]) {
        self.whiten_each(&mut [r]);
    }

    /// The same for several right-hand sides: the factor, which is larger than a cache, is read
    /// once for all of them.
    ///
    /// # Panics
    ///
    /// When a length is not the matrix order.
    pub fn whiten_each<R: AsMut<[f64]>>(&self, all: &mut [R]) {
        let (b, wide) = (self.factor.half_band, self.factor.half_band + 1);
        let mut all: Vec<&mut [f64]> = all.iter_mut().map(AsMut::as_mut).collect();
        assert!(all.iter().all(|r| r.len() == self.factor.order));
        for i in 0..self.factor.order {
            let row = &self.factor.rows[i * wide..(i + 1) * wide];
            let first = i.saturating_sub(b);
            for r in &mut all {
                let sum = dot(&row[first + b - i..b], &r[first..i]);
                r[i] = (r[i] - sum) / row[b];
            }
        }
    }

    /// Solves `Lᵀ·x = z` in place; after [`whiten`](Self::whiten) this gives `A⁻¹·r`.
    ///
    /// # Panics
    ///
    /// When the length is not the matrix order.
    pub fn whiten_transposed(&self, z: &mut [f64]) {
        self.whiten_transposed_each(&mut [z]);
    }

    /// The same for several right-hand sides.
    ///
    /// # Panics
    ///
    /// When a length is not the matrix order.
    pub fn whiten_transposed_each<R: AsMut<[f64]>>(&self, all: &mut [R]) {
        let (b, wide) = (self.factor.half_band, self.factor.half_band + 1);
        let mut all: Vec<&mut [f64]> = all.iter_mut().map(AsMut::as_mut).collect();
        assert!(all.iter().all(|z| z.len() == self.factor.order));
        for i in (0..self.factor.order).rev() {
            let row = &self.factor.rows[i * wide..(i + 1) * wide];
            let first = i.saturating_sub(b);
            for z in &mut all {
                let (before, rest) = z.split_at_mut(i);
                rest[0] /= row[b];
                let x = rest[0];
                for (value, l) in before[first..].iter_mut().zip(&row[first + b - i..b]) {
                    *value -= l * x;
                }
            }
        }
    }

    /// `L·z` in place: coloured noise from white.
    ///
    /// # Panics
    ///
    /// When the length is not the matrix order.
    pub fn colour(&self, z: &mut [f64]) {
        let (b, wide) = (self.factor.half_band, self.factor.half_band + 1);
        assert_eq!(z.len(), self.factor.order);
        for i in (0..z.len()).rev() {
            let row = &self.factor.rows[i * wide..(i + 1) * wide];
            let first = i.saturating_sub(b);
            z[i] = dot(&row[first + b - i..], &z[first..=i]);
        }
    }

    /// Logarithm of the determinant of `A`.
    pub fn log_determinant(&self) -> f64 {
        let wide = self.factor.half_band + 1;
        2.0 * self.factor.rows.chunks_exact(wide).map(|row| row[wide - 1].ln()).sum::<f64>()
    }
}

/// Scalar product in eight running sums, a fixed order that the compiler can vectorise.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let tail: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a8.zip(b8) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    (sums[0] + sums[4]) + (sums[1] + sums[5]) + (sums[2] + sums[6]) + (sums[3] + sums[7]) + tail
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Backward error of a Cholesky factor of order 40, with room.
    const FACTOR_REL: f64 = 1e-13;

    fn example(order: usize, half_band: usize) -> BandedMatrix {
        let mut a = BandedMatrix::zeros(order, half_band);
        for i in 0..order {
            for j in i.saturating_sub(half_band)..=i {
                *a.at_mut(i, j) = if i == j { 3.0 } else { 0.7 / (1.0 + (i - j) as f64) };
            }
        }
        a
    }

    #[test]
    fn colour_undoes_whiten_and_the_factor_gives_the_matrix() {
        let a = example(40, 4);
        let factor = a.clone().cholesky().unwrap();
        let r: Vec<f64> = (0..40).map(|i| (f64::from(i) * 0.7).sin()).collect();
        let mut z = r.clone();
        factor.whiten(&mut z);
        factor.colour(&mut z);
        for (x, y) in r.iter().zip(&z) {
            assert!((x - y).abs() < FACTOR_REL);
        }
        // column j of A is L·(Lᵀ e_j): colour what whiten's transpose would give
        for j in 0..40 {
            let mut column = vec![0.0; 40];
            for (i, value) in column.iter_mut().enumerate() {
                *value = if i >= j { 0.0 } else { *value };
            }
            let row: Vec<f64> =
                (0..40).map(|k| if k <= j { l(&factor, j, k) } else { 0.0 }).collect();
            column.copy_from_slice(&row);
            factor.colour(&mut column);
            for (i, value) in column.iter().enumerate() {
                assert!((value - a.at(i, j)).abs() < FACTOR_REL * 3.0, "{i} {j}");
            }
        }
    }

    #[test]
    fn both_solves_invert_the_product() {
        let a = example(40, 4);
        let x: Vec<f64> = (0..40).map(|i| (f64::from(i) * 0.3).cos()).collect();
        let mut b = a.times(&x);
        let factor = a.cholesky().unwrap();
        factor.whiten(&mut b);
        factor.whiten_transposed(&mut b);
        for (got, want) in b.iter().zip(&x) {
            assert!((got - want).abs() < FACTOR_REL * 10.0);
        }
    }

    fn l(factor: &BandedCholesky, row: usize, column: usize) -> f64 {
        if row - column > factor.factor.half_band { 0.0 } else { factor.factor.at(row, column) }
    }

    #[test]
    fn several_right_hand_sides_give_the_bits_of_each_alone() {
        let factor = example(40, 4).cholesky().unwrap();
        let side = |k: u32| -> Vec<f64> { (0..40).map(|i| f64::from(i * k).sin()).collect() };
        let mut all: Vec<Vec<f64>> = (1..4).map(side).collect();
        factor.whiten_each(&mut all);
        factor.whiten_transposed_each(&mut all);
        for (k, together) in (1..4).zip(all) {
            let mut alone = side(k);
            factor.whiten(&mut alone);
            factor.whiten_transposed(&mut alone);
            assert_eq!(together, alone);
        }
    }

    #[test]
    fn the_determinant_of_a_diagonal() {
        let mut a = BandedMatrix::zeros(3, 0);
        for (i, d) in [2.0, 3.0, 4.0].into_iter().enumerate() {
            *a.at_mut(i, i) = d;
        }
        let log_determinant = a.cholesky().unwrap().log_determinant();
        assert!((log_determinant - 24f64.ln()).abs() < 1e-14);
    }

    #[test]
    fn an_indefinite_matrix_is_refused_with_its_row() {
        let mut a = example(10, 2);
        *a.at_mut(6, 6) = -1.0;
        assert_eq!(a.cholesky().unwrap_err().row, 6);
    }
}
