//! Least squares from the products of columns.

use nalgebra::{DMatrix, DVector};

/// Ridge on columns of unit length, against columns that say the same.
const RIDGE: f64 = 1e-9;

/// Products of columns with each other and with what they explain.
#[derive(Clone, Debug)]
pub(super) struct Gram {
    products: DMatrix<f64>,
    with: DVector<f64>,
    squares: f64,
    pub(super) rows: usize,
}

impl Gram {
    /// Products of columns and a right-hand side.
    pub(super) fn of(columns: &[&[f64]], wanted: &[f64]) -> Self {
        let rows = wanted.len();
        let matrix = DMatrix::from_fn(rows, columns.len(), |n, m| columns[m][n]);
        let wanted = DVector::from_column_slice(wanted);
        Self {
            products: matrix.tr_mul(&matrix),
            with: matrix.tr_mul(&wanted),
            squares: wanted.norm_squared(),
            rows,
        }
    }

    /// Sizes of some columns that explain best.
    pub(super) fn solve(&self, active: &[usize]) -> Vec<f64> {
        self.solve_for(active, |n| self.with[n])
    }

    fn solve_for(&self, active: &[usize], with: impl Fn(usize) -> f64) -> Vec<f64> {
        let scale: Vec<f64> = active
            .iter()
            .map(|&n| self.products[(n, n)].sqrt())
            .map(|length| if length > 0.0 { 1.0 / length } else { 0.0 })
            .collect();
        let count = active.len();
        let mut products = DMatrix::from_fn(count, count, |i, j| {
            scale[i] * scale[j] * self.products[(active[i], active[j])]
        });
        for i in 0..count {
            // a column of zeros gets size zero
            products[(i, i)] = if scale[i] > 0.0 { products[(i, i)] + RIDGE } else { 1.0 };
        }
        let with = DVector::from_fn(count, |i, _| scale[i] * with(active[i]));
        let Some(factor) = products.cholesky() else { return vec![0.0; count] };
        factor.solve(&with).iter().zip(&scale).map(|(size, scale)| size * scale).collect()
    }

    /// Sum of squares left with sizes of some columns.
    pub(super) fn left(&self, active: &[usize], sizes: &[f64]) -> f64 {
        let with: f64 = active.iter().zip(sizes).map(|(&n, size)| size * self.with[n]).sum();
        (self.squares - 2.0 * with + self.between(active, sizes)).max(0.0)
    }

    /// Sizes of further columns beside given sizes of some.
    pub(super) fn solve_beside(&self, active: &[usize], sizes: &[f64], own: &[usize]) -> Vec<f64> {
        self.solve_for(own, |n| {
            let gone = active.iter().zip(sizes).map(|(&m, size)| size * self.products[(n, m)]);
            self.with[n] - gone.sum::<f64>()
        })
    }

    /// Squares of a column that others cannot make up for.
    pub(super) fn apart(&self, column: usize, others: &[usize]) -> f64 {
        let sizes = self.solve_for(others, |n| self.products[(n, column)]);
        let made: f64 =
            others.iter().zip(sizes).map(|(&n, size)| size * self.products[(n, column)]).sum();
        self.products[(column, column)] - made
    }

    /// Squares of what some columns make together.
    pub(super) fn between(&self, active: &[usize], sizes: &[f64]) -> f64 {
        let mut all = 0.0;
        for (&i, a) in active.iter().zip(sizes) {
            for (&j, b) in active.iter().zip(sizes) {
                all += a * b * self.products[(i, j)];
            }
        }
        all
    }

    /// Remainder of all after the first columns have taken their part: products of the others,
    /// numbered as before. The taken columns keep nothing.
    pub(super) fn after(&self, first: usize) -> Self {
        let taken: Vec<usize> = (0..first).collect();
        let count = self.products.ncols();
        let mut rest = self.clone();
        let sizes = self.solve(&taken);
        rest.squares = self.left(&taken, &sizes);
        for m in 0..count {
            let sizes = self.solve_for(&taken, |n| self.products[(n, m)]);
            let part =
                |n: usize| taken.iter().zip(&sizes).map(|(&t, s)| s * self.products[(n, t)]).sum();
            let column: Vec<f64> = (0..count).map(part).collect();
            for n in 0..count {
                rest.products[(n, m)] -= column[n];
            }
            let with: f64 = taken.iter().zip(&sizes).map(|(&t, s)| s * self.with[t]).sum();
            rest.with[m] -= with;
        }
        rest
    }

    /// Squares of the right-hand side.
    pub(super) fn squares(&self) -> f64 {
        self.squares
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    /// Three columns, a known mixture and something orthogonal to all of them.
    #[test]
    fn law_normal_equations() {
        let columns: [Vec<f64>; 3] = [
            (0..40).map(|n| f64::from(n % 4)).collect(),
            (0..40).map(|n| f64::from(n % 5) - 1.0).collect(),
            (0..40).map(|n| f64::from(n % 2)).collect(),
        ];
        let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let wanted: Vec<f64> = (0..40).map(|n| 2.0 * columns[0][n] - 3.0 * columns[1][n]).collect();
        let gram = Gram::of(&slices, &wanted);
        let sizes = gram.solve(&[0, 1, 2]);
        // the ridge moves sizes by about 1e-9 times the conditioning, which is below 100
        assert_abs_diff_eq!(sizes[..], [2.0, -3.0, 0.0][..], epsilon = 1e-6);
        let squares: f64 = wanted.iter().map(|w| w * w).sum();
        assert!(gram.left(&[0, 1, 2], &sizes) < 1e-9 * squares);
        // one column taken first leaves what both leave together
        let rest = gram.after(1);
        let one = rest.solve(&[1]);
        assert_abs_diff_eq!(one[0], -3.0, epsilon = 1e-6);
        assert!(rest.left(&[1], &one) < 1e-9 * squares);
        // what was taken is not there any more but for the ridge
        assert!(rest.between(&[0], &[1.0]).abs() < 1e-8 * gram.between(&[0], &[1.0]));
        // fitted beside given sizes
        let own = gram.solve_beside(&[0], &[2.0], &[1]);
        assert!(gram.left(&[0, 1], &[2.0, own[0]]) < 1e-9 * squares);
    }
}
