use approx::assert_abs_diff_eq;
use reduction::{Matrix, RankRule, Snapshots, SvdError, thin_svd};

/// Backward error of a Householder-based thin SVD: a modest multiple of
/// `ε·max(m, n)` for matrices of a few hundred rows.
const BACKWARD_REL: f64 = 200.0 * 16.0 * f64::EPSILON;

fn waves(rows: usize, columns: usize) -> Snapshots {
    Snapshots::from_fn(rows, columns, |row, column| {
        let (x, t) = (row as f64 / rows as f64, column as f64 / columns as f64);
        (7.0 * x + 3.0 * t).sin() + t * (11.0 * x * x).cos() + 1e-3 * (97.0 * x * t).sin()
    })
    .unwrap()
}

fn orthogonality_defect(basis: &Matrix) -> f64 {
    let gram = basis.transposed_times(basis);
    let mut worst: f64 = 0.0;
    for column in 0..gram.columns() {
        for row in 0..gram.rows() {
            let ideal = f64::from(u8::from(row == column));
            worst = worst.max((gram.get(row, column) - ideal).abs());
        }
    }
    worst
}

fn difference(left: &Matrix, right: &Matrix) -> f64 {
    let pairs = left.values().iter().zip(right.values());
    pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn property_thin_svd_reconstructs_and_is_orthonormal() {
    for (rows, columns) in [(200, 12), (12, 200), (30, 30), (5, 1), (1, 5)] {
        let snapshots = waves(rows, columns);
        let svd = thin_svd(&snapshots).unwrap();
        let scale = snapshots.matrix().frobenius_norm();
        let error = difference(&svd.reconstruct(), snapshots.matrix()) / scale;
        assert!(error < BACKWARD_REL, "{rows}x{columns}: reconstruction {error:e}");
        assert!(orthogonality_defect(svd.left()) < BACKWARD_REL, "{rows}x{columns}");
        assert!(orthogonality_defect(svd.right()) < BACKWARD_REL, "{rows}x{columns}");
        assert!(svd.singular_values().windows(2).all(|pair| pair[0] >= pair[1]));
    }
}

#[test]
fn closed_form_singular_values_of_scaled_columns() {
    let svd =
        thin_svd(&Snapshots::from_columns(&[[0.0, 3.0, 0.0, 4.0], [2.0, 0.0, 0.0, 0.0]]).unwrap())
            .unwrap();
    assert_abs_diff_eq!(svd.singular_values()[0], 5.0, epsilon = 1e-14);
    assert_abs_diff_eq!(svd.singular_values()[1], 2.0, epsilon = 1e-14);
    assert_abs_diff_eq!(svd.left().get(3, 0), 0.8, epsilon = 1e-15);
}

#[test]
fn property_largest_entry_of_each_mode_is_positive() {
    let svd = thin_svd(&waves(50, 9)).unwrap();
    for index in 0..9 {
        let column = svd.left().column(index);
        let largest =
            column.iter().fold(0.0_f64, |top, &v| if v.abs() > top.abs() { v } else { top });
        assert!(largest > 0.0, "mode {index}");
    }
}

#[test]
fn rank_deficient_snapshots_keep_their_rank() {
    let snapshots = Snapshots::from_fn(40, 10, |row, column| (row * column) as f64 + 1.0).unwrap();
    let svd = thin_svd(&snapshots).unwrap();
    assert_eq!(svd.rank(RankRule::Full).unwrap(), 2);
    assert_eq!(svd.rank(RankRule::Fixed(7)).unwrap(), 2);
    assert_eq!(svd.truncated(RankRule::Full).unwrap().left().columns(), 2);
}

#[test]
fn unsound_rules_and_zeros_are_refused() {
    let svd = thin_svd(&waves(20, 4)).unwrap();
    assert_eq!(svd.rank(RankRule::Fixed(0)), Err(SvdError::RankZero));
    assert_eq!(svd.rank(RankRule::Energy(1.5)), Err(SvdError::EnergyOutOfRange { found: 1.5 }));
    assert!(matches!(svd.rank(RankRule::Energy(f64::NAN)), Err(SvdError::EnergyOutOfRange { .. })));
    let zeros = thin_svd(&Snapshots::from_columns(&[[0.0; 5], [0.0; 5]]).unwrap()).unwrap();
    assert_eq!(zeros.singular_values(), [0.0, 0.0]);
    assert_eq!(zeros.rank(RankRule::Full), Err(SvdError::Zero));
}
