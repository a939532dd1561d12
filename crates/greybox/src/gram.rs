//! Inner products of whitened columns, and columns with others projected off.

use inference::SymmetricMatrix;
use nalgebra::{DMatrix, DVector};

/// Share of a column's energy below which nothing of it is left.
const NOTHING_LEFT: f64 = 1e-9;

/// Inner products of a set of columns with one another.
#[derive(Clone, Debug)]
pub(crate) struct Gram {
    products: DMatrix<f64>,
}

impl Gram {
    /// Inner products of columns of equal length.
    pub(crate) fn new(columns: &[Vec<f64>]) -> Self {
        let n = columns.len();
        let mut products = DMatrix::zeros(n, n);
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns[..=i].iter().enumerate() {
                let product = dot(a, b);
                products[(i, j)] = product;
                products[(j, i)] = product;
            }
        }
        Self { products }
    }

    /// Products of so many columns without a sample.
    pub(crate) fn zeros(columns: usize) -> Self {
        Self { products: DMatrix::zeros(columns, columns) }
    }

    pub(crate) fn get(&self, a: usize, b: usize) -> f64 {
        self.products[(a, b)]
    }

    /// Adds to a product of two columns.
    pub(crate) fn add(&mut self, a: usize, b: usize, more: f64) {
        self.products[(a, b)] += more;
        if a != b {
            self.products[(b, a)] += more;
        }
    }

    /// Product of a column with a combination of all.
    pub(crate) fn with(&self, column: usize, combination: &[f64]) -> f64 {
        dot(self.products.column(column).as_slice(), combination)
    }

    /// Energy of a combination of all columns.
    pub(crate) fn energy(&self, combination: &[f64]) -> f64 {
        let along = |(column, part): (usize, &f64)| part * self.with(column, combination);
        combination.iter().enumerate().map(along).sum::<f64>().max(0.0)
    }

    /// Products of the first columns and of a combination of all, which is the last.
    pub(crate) fn beside(&self, first: usize, combination: &[f64]) -> Self {
        let product = |i: usize, j: usize| match (i < first, j < first) {
            (true, true) => self.products[(i, j)],
            (true, false) => self.with(i, combination),
            (false, true) => self.with(j, combination),
            (false, false) => self.energy(combination),
        };
        Self { products: DMatrix::from_fn(first + 1, first + 1, product) }
    }

    /// All columns with some of them projected off; those become zero.
    ///
    /// A column of `off` that the others of `off` make up already is passed over.
    pub(crate) fn without(&self, off: &[usize]) -> Self {
        let mut products = self.products.clone();
        let n = products.nrows();
        let before: Vec<f64> = (0..n).map(|i| products[(i, i)]).collect();
        for &pivot in off {
            let size = products[(pivot, pivot)];
            if size > NOTHING_LEFT * before[pivot] {
                let column: DVector<f64> = products.column(pivot).into_owned();
                for j in 0..n {
                    let share = column[j] / size;
                    for i in 0..n {
                        products[(i, j)] -= column[i] * share;
                    }
                }
            }
            products.row_mut(pivot).fill(0.0);
            products.column_mut(pivot).fill(0.0);
        }
        for (i, size) in before.iter().enumerate() {
            if products[(i, i)] < NOTHING_LEFT * size {
                products.row_mut(i).fill(0.0);
                products.column_mut(i).fill(0.0);
            }
        }
        Self { products }
    }

    /// Energy of a column that some others explain, and their weights: least squares.
    pub(crate) fn explained(&self, target: usize, by: &[usize]) -> (f64, Vec<f64>) {
        let along: Vec<f64> = by.iter().map(|&i| self.products[(i, target)]).collect();
        self.explained_by(by, &along)
    }

    /// As [`Self::explained`], of what has these products with the others.
    pub(crate) fn explained_by(&self, by: &[usize], along: &[f64]) -> (f64, Vec<f64>) {
        let along = DVector::from_column_slice(along);
        let weights = solve(&self.block(by), &along);
        (along.dot(&weights), weights.iter().copied().collect())
    }

    /// The products with those of other samples of the same columns.
    pub(crate) fn plus(mut self, other: &Self) -> Self {
        self.products += &other.products;
        self
    }

    /// The products among the first columns.
    pub(crate) fn first(&self, count: usize) -> DMatrix<f64> {
        self.products.view((0, 0), (count, count)).into_owned()
    }

    /// The products among some columns.
    pub(crate) fn block(&self, of: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(of.len(), of.len(), |i, j| self.products[(of[i], of[j])])
    }
}

/// Inner product.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(x, y)| x * y).sum();
    let mut sums = [0.0; 4];
    for (x, y) in a.zip(b) {
        for lane in 0..4 {
            sums[lane] += x[lane] * y[lane];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Solves a symmetric positive semidefinite system; what has no size gets no weight.
pub(crate) fn solve(matrix: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    DVector::from_vec(symmetric(matrix).solve_semidefinite(right.as_slice()))
}

/// A matrix as `inference` takes it.
pub(crate) fn symmetric(matrix: &DMatrix<f64>) -> SymmetricMatrix {
    SymmetricMatrix::from_fn(matrix.nrows(), |row, column| matrix[(row, column)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_projected_off_explains_nothing_any_more() {
        let s = vec![1.0, 1.0, 1.0, 1.0, 1.0];
        let c = vec![1.0, 2.0, 3.0, 4.0, 5.0];
        let e = vec![3.0, 5.0, 7.0, 9.0, 11.0];
        let gram = Gram::new(&[s, c, e]);
        let rest = gram.without(&[0]);
        assert_eq!(rest.get(0, 2), 0.0);
        let (energy, weights) = rest.explained(2, &[1]);
        assert!((weights[0] - 2.0).abs() < 1e-8, "{weights:?}");
        assert!((energy - 40.0).abs() < 1e-6, "{energy}");
        // both together explain all
        assert!(gram.without(&[0, 1]).get(2, 2).abs() < 1e-8);
    }

    #[test]
    fn a_column_that_others_make_up_has_nothing_left() {
        let gram = Gram::new(&[vec![1.0, 2.0, 0.0], vec![2.0, 4.0, 0.0], vec![0.0, 1.0, 1.0]]);
        let rest = gram.without(&[0, 1]);
        assert!(rest.get(2, 2) > 0.1);
        assert_eq!(gram.without(&[0]).get(1, 1), 0.0);
    }
}
