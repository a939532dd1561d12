//! Cholesky factors, their solves and inverses, on contiguous rows.

#![expect(
    clippy::inline_always,
    reason = "kernels are compiled once for each instruction set, which inlining makes possible"
)]

use pulp::NullaryFnOnce;

use super::blocked::{self, BLOCKED_FROM};

/// Rows that one pass over a row subtracts at once.
pub(crate) const GROUP: usize = 8;

/// Runs a kernel with the widest vectors of this machine.
pub(crate) fn wide<K: NullaryFnOnce>(kernel: K) -> K::Output {
    pulp::Arch::new().dispatch(kernel)
}

/// `y −= Σ_b c_b·x_b`, element by element in the order of `b`.
#[inline(always)]
fn subtract_group(y: &mut [f64], c: [f64; GROUP], x: [&[f64]; GROUP]) {
    let n = y.len();
    let [c0, c1, c2, c3, c4, c5, c6, c7] = c;
    let [x0, x1, x2, x3, x4, x5, x6, x7] = x;
    // slices of one length, so that the loop needs no checks
    let (x0, x1, x2, x3) = (&x0[..n], &x1[..n], &x2[..n], &x3[..n]);
    let (x4, x5, x6, x7) = (&x4[..n], &x5[..n], &x6[..n], &x7[..n]);
    for i in 0..n {
        let first = ((y[i] - c0 * x0[i]) - c1 * x1[i]) - c2 * x2[i];
        let second = ((first - c3 * x3[i]) - c4 * x4[i]) - c5 * x5[i];
        y[i] = (second - c6 * x6[i]) - c7 * x7[i];
    }
}

/// `y −= c·x`.
#[inline(always)]
fn subtract_one(y: &mut [f64], c: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y -= c * x;
    }
}

/// `y −= Σ_r c(r)·row(r)` over all `rows`, in groups.
#[inline(always)]
pub(crate) fn subtract_rows<'a>(
    y: &mut [f64],
    rows: std::ops::Range<usize>,
    c: impl Fn(usize) -> f64,
    row: impl Fn(usize) -> &'a [f64],
) {
    let mut r = rows.start;
    while r + GROUP <= rows.end {
        // written out: an array's map is not always inlined into the kernel
        let (r1, r2, r3) = (r + 1, r + 2, r + 3);
        let (r4, r5, r6, r7) = (r + 4, r + 5, r + 6, r + 7);
        let factors = [c(r), c(r1), c(r2), c(r3), c(r4), c(r5), c(r6), c(r7)];
        let rows = [row(r), row(r1), row(r2), row(r3), row(r4), row(r5), row(r6), row(r7)];
        subtract_group(y, factors, rows);
        r += GROUP;
    }
    while r < rows.end {
        subtract_one(y, c(r), row(r));
        r += 1;
    }
}

/// The inner product on eight lanes, added up in a fixed order.
#[inline(always)]
pub(crate) fn lanes_dot(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let (a, b) = (&a[..n], &b[..n]);
    let mut lanes = [0.0; GROUP];
    let whole = n - n % GROUP;
    for (x, y) in a[..whole].chunks_exact(GROUP).zip(b[..whole].chunks_exact(GROUP)) {
        for l in 0..GROUP {
            lanes[l] += x[l] * y[l];
        }
    }
    let rest: f64 = a[whole..].iter().zip(&b[whole..]).map(|(x, y)| x * y).sum();
    let [l0, l1, l2, l3, l4, l5, l6, l7] = lanes;
    ((l0 + l4) + (l1 + l5)) + ((l2 + l6) + (l3 + l7)) + rest
}

/// The upper factor `U` of `A = UᵀU`, row by row.
#[derive(Clone, Debug)]
pub(crate) struct Factor {
    n: usize,
    upper: Vec<f64>,
}

/// Factors a symmetric matrix given by its upper half, row by row.
///
/// Fails with the pivot that is not positive.
pub(crate) fn factor(mut a: Vec<f64>, n: usize) -> Result<Factor, f64> {
    if n < BLOCKED_FROM {
        return wide(FactorKernel { a, n });
    }
    blocked::factor_in_place(&mut a, n)?;
    clear_below(&mut a, n);
    Ok(Factor { n, upper: a })
}

/// Zeros below the diagonal.
#[inline(always)]
fn clear_below(a: &mut [f64], n: usize) {
    for i in 1..n {
        a[i * n..i * n + i].fill(0.0);
    }
}

struct FactorKernel {
    a: Vec<f64>,
    n: usize,
}

impl NullaryFnOnce for FactorKernel {
    type Output = Result<Factor, f64>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Self { mut a, n } = self;
        let mut start = 0;
        while start < n {
            let end = (start + GROUP).min(n);
            for k in start..end {
                let (above, at) = a.split_at_mut(k * n);
                let row = &mut at[k..n];
                subtract_rows(
                    row,
                    start..k,
                    |p| above[p * n + k],
                    |p| &above[p * n + k..p * n + n],
                );
                let pivot = row[0];
                if pivot.is_nan() || pivot <= 0.0 {
                    return Err(pivot);
                }
                let inverse = 1.0 / pivot.sqrt();
                for v in row {
                    *v *= inverse;
                }
            }
            let (done, rest) = a.split_at_mut(end * n);
            for (i, row) in (end..n).zip(rest.chunks_exact_mut(n)) {
                subtract_rows(
                    &mut row[i..],
                    start..end,
                    |p| done[p * n + i],
                    |p| &done[p * n + i..p * n + n],
                );
            }
            start = end;
        }
        clear_below(&mut a, n);
        Ok(Factor { n, upper: a })
    }
}

impl Factor {
    /// Row `i` from its diagonal on.
    #[inline(always)]
    fn row(&self, i: usize) -> &[f64] {
        &self.upper[i * self.n + i..(i + 1) * self.n]
    }

    /// `½·ln det A`.
    pub(crate) fn half_ln_det(&self) -> f64 {
        (0..self.n).map(|i| libm::log(self.row(i)[0])).sum()
    }

    /// Smallest and largest pivot.
    pub(crate) fn pivots(&self) -> (f64, f64) {
        let pivots = (0..self.n).map(|i| self.row(i)[0]);
        pivots.fold((f64::INFINITY, 0.0), |(low, high), p| (p.min(low), p.max(high)))
    }

    /// Solves `Uᵀ·v = b` in place.
    #[inline(always)]
    pub(crate) fn solve_lower(&self, v: &mut [f64]) {
        let n = self.n;
        let mut start = 0;
        while start < n {
            let end = (start + GROUP).min(n);
            for j in start..end {
                v[j] /= self.upper[j * n + j];
                let solved = v[j];
                for i in j + 1..end {
                    v[i] -= self.upper[j * n + i] * solved;
                }
            }
            let (head, tail) = v.split_at_mut(end);
            subtract_rows(tail, start..end, |j| head[j], |j| &self.upper[j * n + end..j * n + n]);
            start = end;
        }
    }

    /// Solves `U·v = b` in place.
    #[inline(always)]
    pub(crate) fn solve_upper(&self, v: &mut [f64]) {
        for i in (0..self.n).rev() {
            let row = self.row(i);
            v[i] = (v[i] - lanes_dot(&row[1..], &v[i + 1..self.n])) / row[0];
        }
    }

    /// Solves `A·v = b` in place.
    pub(crate) fn solve(&self, v: &mut [f64]) {
        wide(SolveKernel { factor: self, v });
    }

    /// Solves `U·v = b` in place, with the widest vectors.
    pub(crate) fn solve_upper_wide(&self, v: &mut [f64]) {
        wide(UpperKernel { factor: self, v });
    }

    /// Solves `Uᵀ·V = B` in place for the `columns` columns of a row-major `B`.
    #[inline(always)]
    pub(crate) fn solve_lower_many(&self, b: &mut [f64], columns: usize) {
        for i in 0..self.n {
            let (above, at) = b.split_at_mut(i * columns);
            let row = &mut at[..columns];
            subtract_rows(
                row,
                0..i,
                |j| self.upper[j * self.n + i],
                |j| &above[j * columns..(j + 1) * columns],
            );
            let inverse = 1.0 / self.upper[i * self.n + i];
            for v in row {
                *v *= inverse;
            }
        }
    }

    /// Gives back the memory.
    pub(crate) fn into_buffer(self) -> Vec<f64> {
        self.upper
    }

    /// The upper half of `A⁻¹`, row by row; the lower half is left zero.
    pub(crate) fn inverse_upper(&self) -> Vec<f64> {
        let (mut x, mut p) = (Vec::new(), Vec::new());
        wide(InverseKernel { factor: self, x: &mut x, p: &mut p });
        p
    }

    /// Writes that inverse into `p`, with `x` for the triangular inverse.
    #[inline(always)]
    pub(crate) fn inverse_upper_into(&self, x: &mut Vec<f64>, p: &mut Vec<f64>) {
        let n = self.n;
        if n >= BLOCKED_FROM {
            blocked::inverse_upper_into(&self.upper, n, x, p);
            return;
        }
        self.lower_inverse(x);
        p.clear();
        p.resize(n * n, 0.0);
        for i in 0..n {
            let row = &mut p[i * n..(i + 1) * n];
            let mut k = i;
            while k < n {
                let end = (k + GROUP).min(n);
                subtract_rows(
                    &mut row[i..end],
                    k..end,
                    |r| -x[r * n + i],
                    |r| &x[r * n + i..r * n + end],
                );
                k = end;
            }
        }
    }

    /// `U⁻ᵀ`, lower triangular, row by row.
    #[inline(always)]
    fn lower_inverse(&self, x: &mut Vec<f64>) {
        let n = self.n;
        x.clear();
        x.resize(n * n, 0.0);
        for i in 0..n {
            let (above, at) = x.split_at_mut(i * n);
            let mut j = 0;
            while j < i {
                let end = (j + GROUP).min(i);
                subtract_rows(
                    &mut at[..end],
                    j..end,
                    |r| self.upper[r * n + i],
                    |r| &above[r * n..r * n + end],
                );
                j = end;
            }
            let inverse = 1.0 / self.upper[i * n + i];
            for v in &mut at[..i] {
                *v *= inverse;
            }
            at[i] = inverse;
        }
    }

    /// Extends the factor by one row and column: `column` is the covariance
    /// with the rows so far, `corner` the new diagonal entry.
    ///
    /// Fails with the pivot that is not positive.
    pub(crate) fn append(&mut self, column: &[f64], corner: f64) -> Result<(), f64> {
        let n = self.n;
        let mut v = column.to_vec();
        wide(LowerKernel { factor: self, v: &mut v });
        let pivot = corner - v.iter().map(|x| x * x).sum::<f64>();
        if pivot.is_nan() || pivot <= 0.0 {
            return Err(pivot);
        }
        let mut upper = vec![0.0; (n + 1) * (n + 1)];
        for i in 0..n {
            upper[i * (n + 1)..i * (n + 1) + n].copy_from_slice(&self.upper[i * n..(i + 1) * n]);
            upper[i * (n + 1) + n] = v[i];
        }
        upper[n * (n + 1) + n] = pivot.sqrt();
        (self.n, self.upper) = (n + 1, upper);
        Ok(())
    }
}

struct SolveKernel<'a> {
    factor: &'a Factor,
    v: &'a mut [f64],
}

impl NullaryFnOnce for SolveKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.factor.solve_lower(self.v);
        self.factor.solve_upper(self.v);
    }
}

struct UpperKernel<'a> {
    factor: &'a Factor,
    v: &'a mut [f64],
}

impl NullaryFnOnce for UpperKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.factor.solve_upper(self.v);
    }
}

struct InverseKernel<'a> {
    factor: &'a Factor,
    x: &'a mut Vec<f64>,
    p: &'a mut Vec<f64>,
}

impl NullaryFnOnce for InverseKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.factor.inverse_upper_into(self.x, self.p);
    }
}

struct LowerKernel<'a> {
    factor: &'a Factor,
    v: &'a mut [f64],
}

impl NullaryFnOnce for LowerKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.factor.solve_lower(self.v);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, Stream};
    use approx::assert_abs_diff_eq;

    /// Backward error of Cholesky and triangular inversion for a matrix of
    /// condition below 100: a modest multiple of n·ε.
    const RECONSTRUCTION_ABS: f64 = 1e-12;

    fn case(n: usize) -> Vec<f64> {
        let mut stream = Stream::new(3, Purpose::Design, n as u64);
        let b: Vec<f64> = (0..n * n).map(|_| stream.normal()).collect();
        let mut a = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..n {
                let sum: f64 = (0..n).map(|k| b[i * n + k] * b[j * n + k]).sum();
                a[i * n + j] = sum / n as f64 + if i == j { 1.0 } else { 0.0 };
            }
        }
        a
    }

    #[test]
    fn property_factor_and_inverse_reconstruct() {
        for n in [1, 2, 7, 8, 9, 40, 67, BLOCKED_FROM - 1, BLOCKED_FROM, BLOCKED_FROM + 45] {
            let a = case(n);
            let f = factor(a.clone(), n).unwrap();
            let p = f.inverse_upper();
            for i in 0..n {
                for j in i..n {
                    let sum: f64 = (0..=i).map(|k| f.upper[k * n + i] * f.upper[k * n + j]).sum();
                    assert!((sum - a[i * n + j]).abs() < RECONSTRUCTION_ABS, "{n} {i} {j}");
                    let full = |r: usize, c: usize| p[r.min(c) * n + r.max(c)];
                    let unit: f64 = (0..n).map(|k| full(i, k) * a[k * n + j]).sum();
                    let want = if i == j { 1.0 } else { 0.0 };
                    assert!((unit - want).abs() < RECONSTRUCTION_ABS, "{n} {i} {j} {unit}");
                }
            }
        }
    }

    #[test]
    fn property_both_ways_give_one_factor_and_inverse() {
        let n = BLOCKED_FROM;
        let a = case(n);
        let rows = wide(FactorKernel { a: a.clone(), n }).unwrap();
        let blocks = factor(a, n).unwrap();
        let (mut x, mut p) = (vec![f64::NAN; n * n], Vec::new());
        blocks.inverse_upper_into(&mut x, &mut p);
        let mut triangle = Vec::new();
        rows.lower_inverse(&mut triangle);
        for i in 0..n {
            for j in 0..n {
                let sum: f64 =
                    (i.max(j)..n).map(|k| triangle[k * n + i] * triangle[k * n + j]).sum();
                let want = if i <= j { sum } else { 0.0 };
                assert_abs_diff_eq!(
                    rows.upper[i * n + j],
                    blocks.upper[i * n + j],
                    epsilon = RECONSTRUCTION_ABS
                );
                assert_abs_diff_eq!(want, p[i * n + j], epsilon = RECONSTRUCTION_ABS);
            }
        }
    }

    #[test]
    fn an_indefinite_matrix_fails_by_both_ways() {
        for n in [BLOCKED_FROM - 1, BLOCKED_FROM] {
            let mut a = case(n);
            a[(n / 2) * (n + 1)] = -1.0;
            let pivot = factor(a, n).unwrap_err();
            assert!(pivot <= 0.0, "{n}: {pivot}");
        }
    }

    #[test]
    fn property_appending_equals_factoring_anew() {
        let n = 23;
        let a = case(n);
        let lead: Vec<f64> = (0..n - 1).flat_map(|i| a[i * n..i * n + n - 1].to_vec()).collect();
        let mut grown = factor(lead, n - 1).unwrap();
        let column: Vec<f64> = (0..n - 1).map(|i| a[i * n + n - 1]).collect();
        grown.append(&column, a[n * n - 1]).unwrap();
        let whole = factor(a, n).unwrap();
        for (x, y) in grown.upper.iter().zip(&whole.upper) {
            assert_abs_diff_eq!(x, y, epsilon = RECONSTRUCTION_ABS);
        }
    }

    #[test]
    fn property_solves_agree() {
        let n = 29;
        let a = case(n);
        let f = factor(a.clone(), n).unwrap();
        let mut v: Vec<f64> = (0..n).map(|i| i as f64).collect();
        f.solve(&mut v);
        for i in 0..n {
            let back: f64 = (0..n).map(|j| a[i * n + j] * v[j]).sum();
            assert_abs_diff_eq!(back, i as f64, epsilon = 1e-10);
        }
        let mut many: Vec<f64> = (0..n).flat_map(|i| [i as f64, 1.0, -2.0 * i as f64]).collect();
        f.solve_lower_many(&mut many, 3);
        let mut one: Vec<f64> = (0..n).map(|i| i as f64).collect();
        f.solve_lower(&mut one);
        for i in 0..n {
            assert_abs_diff_eq!(many[3 * i], one[i], epsilon = RECONSTRUCTION_ABS * n as f64);
        }
    }
}
