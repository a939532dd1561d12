//! To and from the matrices of other libraries, entry by entry.

use gp_bayesopt::Matrix;
use nalgebra::DMatrix;
use ndarray::Array2;

fn matrix() -> Matrix {
    Matrix::from_rows(&[vec![1.0, 2.0, 3.0], vec![4.0, 5.0, 6.0]]).unwrap()
}

#[test]
fn nalgebra_keeps_rows_and_columns() {
    let theirs = DMatrix::from(&matrix());
    assert_eq!((theirs.nrows(), theirs.ncols(), theirs[(1, 0)]), (2, 3, 4.0));
    assert_eq!(Matrix::from(&theirs), matrix());
}

#[test]
fn ndarray_keeps_rows_and_columns_in_either_order() {
    let theirs = Array2::from(&matrix());
    assert_eq!((theirs.dim(), theirs[(1, 0)]), ((2, 3), 4.0));
    assert_eq!(Matrix::from(theirs.view()), matrix());
    let turned = Matrix::from(theirs.t());
    assert_eq!((turned.rows(), turned.get(0, 1)), (3, 4.0));
}

#[test]
fn rows_are_points() {
    assert_eq!(matrix().to_rows(), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    assert_eq!(Matrix::from_rows(&matrix().to_rows()).unwrap(), matrix());
}
