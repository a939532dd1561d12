//! To and from the matrices of other libraries, value by value.

use nalgebra::DMatrix;
use ndarray::{Array2, array};
use reduction::{Matrix, MatrixError, Snapshots};

fn snapshots() -> Snapshots {
    Snapshots::from_columns(&[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]).unwrap()
}

#[test]
fn nalgebra_takes_a_snapshot_a_column() {
    let theirs = DMatrix::from(&snapshots());
    assert_eq!((theirs.nrows(), theirs.ncols(), theirs[(0, 1)]), (3, 2, 4.0));
    assert_eq!(Snapshots::try_from(&theirs).unwrap(), snapshots());
}

#[test]
fn ndarray_takes_a_snapshot_a_column_in_either_order() {
    let theirs = Array2::from(&snapshots());
    assert_eq!((theirs.dim(), theirs[(0, 1)]), ((3, 2), 4.0));
    assert_eq!(Snapshots::try_from(theirs.view()).unwrap(), snapshots());
    let by_row = array![[1.0, 4.0], [2.0, 5.0], [3.0, 6.0]];
    assert_eq!(Snapshots::try_from(by_row.view()).unwrap(), snapshots());
}

#[test]
fn what_is_not_finite_is_refused() {
    let refused = Err(MatrixError::NotFinite { row: 1, column: 0 });
    assert_eq!(Matrix::try_from(&DMatrix::from_row_slice(2, 1, &[0.0, f64::NAN])), refused);
    assert_eq!(Matrix::try_from(array![[0.0], [f64::INFINITY]].view()), refused);
    let empty = Err(MatrixError::Empty { rows: 0, columns: 2 });
    assert_eq!(Matrix::try_from(Array2::<f64>::zeros((0, 2)).view()), empty);
}
