//! Symmetric banded matrices and their Cholesky factor: the covariances of a filtered signal.

#![expect(
    clippy::inline_always,
    reason = "kernels are compiled once for each instruction set, which inlining makes possible"
)]

use core::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use crate::sides::{SIDES, Side, take_products_off};

/// Rows whose share of the unknowns before them is taken off in one pass.
const GROUP: usize = 4;
/// Right-hand sides that are solved one by one: fewer than pay for being laid side by side.
const FEW_SIDES: usize = 2;

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
    #[inline]
    pub fn order(&self) -> usize {
        self.order
    }

    /// Diagonals below the main one.
    #[inline]
    pub fn half_band(&self) -> usize {
        self.half_band
    }

    /// Element at `row ≥ column` within the band.
    ///
    /// # Panics
    ///
    /// Outside the band or above the diagonal.
    #[inline]
    pub fn at_mut(&mut self, row: usize, column: usize) -> &mut f64 {
        assert!(column <= row && row - column <= self.half_band && row < self.order);
        &mut self.rows[row * (self.half_band + 1) + self.half_band - (row - column)]
    }

    /// Element anywhere; zero outside the band.
    #[inline]
    pub fn at(&self, row: usize, column: usize) -> f64 {
        let (row, column) = if row >= column { (row, column) } else { (column, row) };
        if row - column > self.half_band {
            return 0.0;
        }
        self.rows[row * (self.half_band + 1) + self.half_band - (row - column)]
    }

    /// Elements of a row in its band, the last one on the diagonal.
    #[inline(always)]
    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [f64] {
        let wide = self.half_band + 1;
        &mut self.rows[row * wide..(row + 1) * wide]
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

    /// Multiplies every element by a scalar.
    pub fn scale(&mut self, scale: f64) {
        for value in &mut self.rows {
            *value *= scale;
        }
    }

    /// The matrix with `scale` times another added, in the same memory where its band is as wide.
    ///
    /// # Panics
    ///
    /// When the orders differ.
    #[must_use]
    pub fn plus_scaled(self, scale: f64, other: &Self) -> Self {
        let mut sum = if self.half_band >= other.half_band {
            self
        } else {
            let mut wider = Self::zeros(self.order, other.half_band);
            wider.add_scaled(1.0, &self);
            wider
        };
        sum.add_scaled(scale, other);
        sum
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
    pub fn cholesky(self) -> Result<BandedCholesky, NotPositiveDefinite> {
        Arch::new().dispatch(Factorise { matrix: self })
    }

    /// Elements of a row in columns that lie in its band.
    #[inline(always)]
    fn part(&self, row: usize, columns: Range<usize>) -> &[f64] {
        let start = row * self.half_band + self.half_band;
        &self.rows[start + columns.start..start + columns.end]
    }

    /// First column of a row.
    #[inline(always)]
    fn first(&self, row: usize) -> usize {
        row.saturating_sub(self.half_band)
    }

    #[inline(always)]
    fn diagonal(&self, row: usize) -> f64 {
        self.rows[row * (self.half_band + 1) + self.half_band]
    }
}

/// [`BandedMatrix::cholesky`] as a kernel.
struct Factorise {
    matrix: BandedMatrix,
}

impl WithSimd for Factorise {
    type Output = Result<BandedCholesky, NotPositiveDefinite>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let mut factor = self.matrix;
        let mut z = Vec::with_capacity(factor.half_band + SIDES);
        for start in (0..factor.order).step_by(SIDES) {
            let rows = start..factor.order.min(start + SIDES);
            let first = factor.first(start);
            gather(&factor, first, rows.clone(), &mut z);
            let (before, block) = z.split_at_mut(start - first);
            whiten_rows(&factor, first..start, before);
            for z in &*before {
                for (c, column) in block.iter_mut().enumerate() {
                    take_off_side(column, z[c], z);
                }
            }
            factor_block(block)
                .map_err(|(row, pivot)| NotPositiveDefinite { row: start + row, pivot })?;
            scatter(&z, first, rows, &mut factor);
        }
        Ok(BandedCholesky { factor })
    }
}

/// Lays the lower triangle of some rows side by side: from a first column on, one side a row.
fn gather(matrix: &BandedMatrix, first: usize, rows: Range<usize>, z: &mut Vec<Side>) {
    z.clear();
    z.resize(rows.end - first, [0.0; SIDES]);
    for (lane, row) in rows.enumerate() {
        let columns = matrix.first(row)..row + 1;
        for (z, value) in z[columns.start - first..].iter_mut().zip(matrix.part(row, columns)) {
            z[lane] = *value;
        }
    }
}

/// Puts rows that [`gather`] laid side by side back.
fn scatter(z: &[Side], first: usize, rows: Range<usize>, matrix: &mut BandedMatrix) {
    for (lane, row) in rows.enumerate() {
        for column in matrix.first(row)..=row {
            *matrix.at_mut(row, column) = z[column - first][lane];
        }
    }
}

/// The factor of a block on the diagonal, its columns side by side; else row and value of the
/// first pivot that is not above zero.
#[inline(always)]
fn factor_block(block: &mut [Side]) -> Result<(), (usize, f64)> {
    for c in 0..block.len() {
        let (left, right) = block.split_at_mut(c);
        let column = &mut right[0];
        for before in &*left {
            take_off_side(column, before[c], before);
        }
        let pivot = column[c];
        if pivot.is_nan() || pivot <= 0.0 {
            return Err((c, pivot));
        }
        let root = pivot.sqrt();
        *column = column.map(|value| value / root);
    }
    Ok(())
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

    /// Whitens several right-hand sides: the factor, which is larger than a cache, is read
    /// once for all of them.
    ///
    /// # Panics
    ///
    /// When a length is not the matrix order.
    pub fn whiten_each<R: AsMut<[f64]>>(&self, all: &mut [R]) {
        let mut all = self.sides(all);
        for all in all.chunks_mut(SIDES) {
            match all.len() {
                ..=FEW_SIDES => Arch::new().dispatch(Whiten { factor: &self.factor, all }),
                _ => self.together(all, |factor, z| {
                    Arch::new().dispatch(WhitenTogether { factor, z });
                }),
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

    /// Solves the transposed factor for several right-hand sides.
    ///
    /// # Panics
    ///
    /// When a length is not the matrix order.
    pub fn whiten_transposed_each<R: AsMut<[f64]>>(&self, all: &mut [R]) {
        let mut all = self.sides(all);
        Arch::new().dispatch(WhitenTransposed { factor: &self.factor, all: &mut all });
    }

    /// Solves at most [`SIDES`] right-hand sides laid side by side.
    fn together(&self, all: &mut [&mut [f64]], solve: impl FnOnce(&BandedMatrix, &mut [Side])) {
        let mut z = vec![[0.0; SIDES]; self.factor.order];
        for (lane, side) in all.iter().enumerate() {
            for (to, from) in z.iter_mut().zip(side.iter()) {
                to[lane] = *from;
            }
        }
        solve(&self.factor, &mut z);
        for (lane, side) in all.iter_mut().enumerate() {
            for (to, from) in side.iter_mut().zip(&z) {
                *to = from[lane];
            }
        }
    }

    /// Right-hand sides as slices of the matrix order.
    fn sides<'r, R: AsMut<[f64]>>(&self, all: &'r mut [R]) -> Vec<&'r mut [f64]> {
        let all: Vec<&mut [f64]> = all.iter_mut().map(AsMut::as_mut).collect();
        assert!(all.iter().all(|side| side.len() == self.factor.order));
        all
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

/// [`BandedCholesky::whiten_each`] as a kernel.
struct Whiten<'a, 'r> {
    factor: &'a BandedMatrix,
    all: &'a mut [&'r mut [f64]],
}

impl WithSimd for Whiten<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { factor, all } = self;
        for i in 0..factor.order {
            let first = factor.first(i);
            let (row, pivot) = (factor.part(i, first..i), factor.diagonal(i));
            for r in &mut *all {
                let sum = wide_dot(simd, row, &r[first..i]);
                r[i] = (r[i] - sum) / pivot;
            }
        }
    }
}

/// [`BandedCholesky::whiten_transposed_each`] as a kernel.
struct WhitenTransposed<'a, 'r> {
    factor: &'a BandedMatrix,
    all: &'a mut [&'r mut [f64]],
}

impl WithSimd for WhitenTransposed<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { factor, all } = self;
        // rows of a narrower band have no columns in common
        let groups = if factor.half_band >= GROUP { factor.order / GROUP } else { 0 };
        for i in (groups * GROUP..factor.order).rev() {
            for z in &mut *all {
                settle(factor, i, factor.first(i)..i, z);
            }
        }
        for i in (0..groups * GROUP).step_by(GROUP).rev() {
            for z in &mut *all {
                settle_group(factor, i, z);
            }
        }
    }
}

/// [`BandedCholesky::whiten_each`] of right-hand sides side by side.
struct WhitenTogether<'a> {
    factor: &'a BandedMatrix,
    z: &'a mut [Side],
}

impl WithSimd for WhitenTogether<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { factor, z } = self;
        whiten_rows(factor, 0..factor.order, z);
    }
}

/// Solves some rows of `L·z = r` for right-hand sides side by side, all unknowns before them zero.
#[inline(always)]
fn whiten_rows(factor: &BandedMatrix, rows: Range<usize>, z: &mut [Side]) {
    let start = rows.start;
    let first = |i: usize| factor.first(i).max(start);
    let groups = if factor.half_band >= GROUP { rows.len() / GROUP } else { 0 };
    let grouped = start + groups * GROUP;
    for i in (start..grouped).step_by(GROUP) {
        let common = first(i + 3)..i;
        let (before, now) = z.split_at_mut(i - start);
        let mut values = [now[0], now[1], now[2], now[3]];
        let row = |r: usize| factor.part(i + r, common.clone());
        take_products_off(
            &mut values,
            [row(0), row(1), row(2), row(3)],
            &before[common.start - start..],
        );
        for r in 0..GROUP {
            let alone = first(i + r)..common.start;
            let before = &before[alone.start - start..alone.end - start];
            for (l, z) in factor.part(i + r, alone).iter().zip(before) {
                take_off_side(&mut values[r], *l, z);
            }
            for (c, l) in factor.part(i + r, i..i + r).iter().enumerate() {
                let z = values[c];
                take_off_side(&mut values[r], *l, &z);
            }
            let pivot = factor.diagonal(i + r);
            values[r] = values[r].map(|value| value / pivot);
        }
        now[..GROUP].copy_from_slice(&values);
    }
    for i in grouped..rows.end {
        let (before, now) = z.split_at_mut(i - start);
        let first = first(i);
        for (l, z) in factor.part(i, first..i).iter().zip(&before[first - start..]) {
            take_off_side(&mut now[0], *l, z);
        }
        let pivot = factor.diagonal(i);
        now[0] = now[0].map(|value| value / pivot);
    }
}

/// `value −= l·z` for right-hand sides side by side.
#[inline(always)]
fn take_off_side(value: &mut Side, l: f64, z: &Side) {
    for lane in 0..SIDES {
        value[lane] -= l * z[lane];
    }
}

/// The unknown of a row of `Lᵀ·x = z`, and what it takes from some of those before it.
#[inline(always)]
fn settle(factor: &BandedMatrix, row: usize, columns: Range<usize>, z: &mut [f64]) {
    z[row] /= factor.diagonal(row);
    take_off(factor, row, columns, z);
}

#[inline(always)]
fn take_off(factor: &BandedMatrix, row: usize, columns: Range<usize>, z: &mut [f64]) {
    let x = z[row];
    for (value, l) in z[columns.clone()].iter_mut().zip(factor.part(row, columns)) {
        *value -= l * x;
    }
}

/// [`settle`] of four rows: first among themselves and in the columns that not all of them have,
/// then in one pass over the columns that they share.
#[inline(always)]
fn settle_group(factor: &BandedMatrix, i: usize, z: &mut [f64]) {
    let (i1, i2, i3) = (i + 1, i + 2, i + 3);
    let shared = factor.first(i3)..i;
    settle(factor, i3, i..i3, z);
    settle(factor, i2, i..i2, z);
    settle(factor, i1, i..i1, z);
    settle(factor, i, factor.first(i)..shared.start, z);
    take_off(factor, i1, factor.first(i1)..shared.start, z);
    take_off(factor, i2, factor.first(i2)..shared.start, z);
    let (x0, x1, x2, x3) = (z[i], z[i1], z[i2], z[i3]);
    let count = shared.len();
    // slices of one length, so that the loop needs no checks
    let l0 = &factor.part(i, shared.clone())[..count];
    let l1 = &factor.part(i1, shared.clone())[..count];
    let l2 = &factor.part(i2, shared.clone())[..count];
    let l3 = &factor.part(i3, shared.clone())[..count];
    let z = &mut z[shared][..count];
    for j in 0..count {
        z[j] = ((z[j] - l3[j] * x3) - l2[j] * x2) - l1[j] * x1 - l0[j] * x0;
    }
}

/// Running sums of a scalar product: several of the widest vectors, so that none waits for another.
const SUMS: usize = 16;

/// Scalar product in sixteen running sums, a fixed order whatever the machine's vectors are.
///
/// Of slices of different length, the shorter one counts.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    Arch::new().dispatch(Dot { a, b })
}

/// [`dot`] as a kernel.
struct Dot<'a> {
    a: &'a [f64],
    b: &'a [f64],
}

impl WithSimd for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        wide_dot(simd, self.a, self.b)
    }
}

/// [`dot`] within a kernel.
#[inline(always)]
fn wide_dot<S: Simd>(simd: S, a: &[f64], b: &[f64]) -> f64 {
    let count = a.len().min(b.len());
    let whole = count - count % SUMS;
    let mut sums = [simd.splat_f64s(0.0); SUMS];
    for (x, y) in a[..whole].chunks_exact(SUMS).zip(b[..whole].chunks_exact(SUMS)) {
        let (x, y) = (S::as_simd_f64s(x).0, S::as_simd_f64s(y).0);
        for v in 0..SUMS / S::F64_LANES {
            sums[v] = simd.add_f64s(sums[v], simd.mul_f64s(x[v], y[v]));
        }
    }
    // halves are added to halves, as vectors first and then as numbers
    let mut vectors = SUMS / S::F64_LANES;
    while vectors > 1 {
        vectors /= 2;
        for v in 0..vectors {
            sums[v] = simd.add_f64s(sums[v], sums[v + vectors]);
        }
    }
    let mut lanes = [0.0; SUMS];
    S::as_mut_simd_f64s(&mut lanes[..S::F64_LANES]).0[0] = sums[0];
    let mut half = S::F64_LANES;
    while half > 1 {
        half /= 2;
        for k in 0..half {
            lanes[k] += lanes[k + half];
        }
    }
    let tail: f64 = a[whole..count].iter().zip(&b[whole..count]).map(|(x, y)| x * y).sum();
    lanes[0] + tail
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

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
            assert_abs_diff_eq!(x, y, epsilon = FACTOR_REL);
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
            assert_abs_diff_eq!(got, want, epsilon = FACTOR_REL * 10.0);
        }
    }

    #[test]
    fn rows_beyond_the_last_group_and_narrow_bands_are_solved_as_well() {
        for (order, half_band) in [(41, 5), (43, 4), (42, 3), (7, 1), (3, 2), (9, 0)] {
            let a = example(order, half_band);
            let x: Vec<f64> = (0..order).map(|i| (i as f64 * 0.3).cos()).collect();
            let mut b = a.times(&x);
            let factor = a.cholesky().unwrap();
            factor.whiten(&mut b);
            factor.whiten_transposed(&mut b);
            for (got, want) in b.iter().zip(&x) {
                assert!((got - want).abs() < FACTOR_REL * 10.0, "{order} {half_band}");
            }
        }
    }

    fn l(factor: &BandedCholesky, row: usize, column: usize) -> f64 {
        if row - column > factor.factor.half_band { 0.0 } else { factor.factor.at(row, column) }
    }

    #[test]
    fn several_right_hand_sides_give_what_each_gives_alone() {
        let factor = example(43, 5).cholesky().unwrap();
        let side = |k: u32| -> Vec<f64> { (0..43).map(|i| f64::from(i * k).sin()).collect() };
        for count in [1, 2, 3, 8, 9, 20] {
            let mut all: Vec<Vec<f64>> = (1..=count).map(side).collect();
            factor.whiten_each(&mut all);
            factor.whiten_transposed_each(&mut all);
            for (k, together) in (1..).zip(all) {
                let mut alone = side(k);
                factor.whiten(&mut alone);
                factor.whiten_transposed(&mut alone);
                for (a, b) in together.iter().zip(&alone) {
                    assert_abs_diff_eq!(a, b, epsilon = FACTOR_REL);
                }
            }
        }
    }

    #[test]
    fn sums_in_place_are_sums() {
        let (wide, narrow) = (example(12, 4), example(12, 2));
        for (a, b) in [(&wide, &narrow), (&narrow, &wide)] {
            let sum = a.clone().plus_scaled(0.5, b);
            assert_eq!(sum, a.plus(&b.scaled(0.5)));
        }
        let mut scaled = wide.clone();
        scaled.scale(3.0);
        assert_eq!(scaled, wide.scaled(3.0));
    }

    #[test]
    fn the_determinant_of_a_diagonal() {
        let mut a = BandedMatrix::zeros(3, 0);
        for (i, d) in [2.0, 3.0, 4.0].into_iter().enumerate() {
            *a.at_mut(i, i) = d;
        }
        let log_determinant = a.cholesky().unwrap().log_determinant();
        assert_abs_diff_eq!(log_determinant, 24f64.ln(), epsilon = 1e-14);
    }

    #[test]
    fn an_indefinite_matrix_is_refused_with_its_row() {
        let mut a = example(10, 2);
        *a.at_mut(6, 6) = -1.0;
        assert_eq!(a.cholesky().unwrap_err().row, 6);
    }
}
