use approx::assert_abs_diff_eq;
use reduction::{Matrix, NoiseCovariance, NoiseError, NoiseModel};

/// Whitening of a few dozen samples with a condition below 10³.
const WHITENING_ABS: f64 = 1e-12;

fn identity(size: usize) -> Matrix {
    Matrix::from_fn(size, size, |row, column| f64::from(u8::from(row == column))).unwrap()
}

fn models(size: usize) -> Vec<NoiseModel> {
    let autocovariance = vec![2.0, 1.1, 0.4, 0.1];
    let dense = Matrix::from_fn(size, size, |row, column| {
        (1.0 + row as f64 / 10.0).sqrt()
            * (1.0 + column as f64 / 10.0).sqrt()
            * 0.6_f64.powf(row.abs_diff(column) as f64)
    })
    .unwrap();
    let factor = Matrix::from_fn(size, size + 3, |row, column| {
        if column < row { 0.0 } else { 0.5_f64.powf((column - row) as f64) }
    })
    .unwrap();
    vec![
        NoiseModel::White { variance: 0.25 },
        NoiseModel::Diagonal((0..size).map(|at| 1.0 + at as f64).collect()),
        NoiseModel::Stationary { autocovariance },
        NoiseModel::Banded(vec![
            (0..size).map(|at| 1.0 + 0.1 * at as f64).collect(),
            vec![0.4; size - 1],
            vec![-0.2; size - 2],
        ]),
        NoiseModel::Dense(dense),
        NoiseModel::Factor(factor),
    ]
}

#[test]
fn property_whitened_noise_has_unit_covariance() {
    for model in models(25) {
        let noise = NoiseCovariance::new(&model, 25, 0.0).unwrap();
        let covariance = noise.of_projection(&identity(25)).unwrap();
        for column in 0..25 {
            let stated = noise.covariance_column(column);
            for (row, stated) in stated.iter().enumerate() {
                assert!((covariance.get(row, column) - stated).abs() < WHITENING_ABS, "{model:?}");
            }
            assert_abs_diff_eq!(noise.variances()[column], stated[column], epsilon = WHITENING_ABS);
        }
        // L⁻¹·Σ·L⁻ᵀ = 1.
        let half = noise.whiten(&covariance).unwrap().transposed();
        let unit = noise.whiten(&half).unwrap();
        for column in 0..25 {
            for row in 0..25 {
                let ideal = f64::from(u8::from(row == column));
                assert!((unit.get(row, column) - ideal).abs() < WHITENING_ABS, "{model:?}");
            }
        }
    }
}

#[test]
fn banded_and_dense_factorisations_agree() {
    let autocovariance = vec![2.0, 1.1, 0.4, 0.1];
    let dense = Matrix::from_fn(30, 30, |row, column| {
        autocovariance.get(row.abs_diff(column)).copied().unwrap_or(0.0)
    })
    .unwrap();
    let banded = NoiseCovariance::new(&NoiseModel::Stationary { autocovariance }, 30, 0.1).unwrap();
    let dense = NoiseCovariance::new(&NoiseModel::Dense(dense), 30, 0.1).unwrap();
    let (one, other) =
        (banded.whiten(&identity(30)).unwrap(), dense.whiten(&identity(30)).unwrap());
    for (a, b) in one.values().iter().zip(other.values()) {
        assert_abs_diff_eq!(a, b, epsilon = WHITENING_ABS);
    }
}

#[test]
fn unsound_models_are_refused() {
    let new = |model: &NoiseModel, floor| NoiseCovariance::new(model, 4, floor).unwrap_err();
    assert_eq!(
        new(&NoiseModel::White { variance: 0.0 }, 0.0),
        NoiseError::Variance { found: 0.0, location: 0 }
    );
    assert_eq!(
        new(&NoiseModel::Diagonal(vec![1.0, 1.0, -2.0, 1.0]), 0.0),
        NoiseError::Variance { found: -2.0, location: 2 }
    );
    assert_eq!(
        new(&NoiseModel::Diagonal(vec![1.0; 3]), 0.0),
        NoiseError::Size { found: 3, expected: 4 }
    );
    assert_eq!(new(&NoiseModel::White { variance: 1.0 }, -1.0), NoiseError::Floor { found: -1.0 });
    assert!(matches!(
        new(&NoiseModel::Stationary { autocovariance: vec![1.0, f64::NAN] }, 0.0),
        NoiseError::Values(_)
    ));
    assert!(matches!(
        new(&NoiseModel::Stationary { autocovariance: vec![] }, 0.0),
        NoiseError::Values(_)
    ));
    assert_eq!(
        new(&NoiseModel::Banded(vec![vec![1.0; 4], vec![0.1; 4]]), 0.0),
        NoiseError::Band { lag: 1, found: 4, expected: 3 }
    );
    let slanted = Matrix::from_fn(4, 4, |row, column| (row + 2 * column) as f64).unwrap();
    assert!(matches!(new(&NoiseModel::Dense(slanted), 0.0), NoiseError::NotSymmetric { .. }));
    let flat = Matrix::from_fn(4, 3, |_, _| 1.0).unwrap();
    assert_eq!(
        new(&NoiseModel::Dense(flat.clone()), 0.0),
        NoiseError::NotSquare { rows: 4, columns: 3 }
    );
}

#[test]
fn directions_without_noise_need_a_floor() {
    let singular = [
        NoiseModel::Factor(Matrix::from_fn(6, 2, |row, column| (row + column) as f64).unwrap()),
        NoiseModel::Stationary { autocovariance: vec![1.0, 1.0, 1.0, 1.0, 1.0, 1.0] },
    ];
    for model in singular {
        assert!(matches!(
            NoiseCovariance::new(&model, 6, 0.0),
            Err(NoiseError::NotPositiveDefinite { .. })
        ));
        assert!(NoiseCovariance::new(&model, 6, 1e-6).is_ok());
    }
}
