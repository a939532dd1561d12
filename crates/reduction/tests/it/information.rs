use approx::assert_abs_diff_eq;
use reduction::{
    CompressionMap, Encoding, Information, InformationError, Matrix, NoiseCovariance, NoiseModel,
    Placement, Regression, Sensitivities, SensitivityError, TrainingData,
};

use crate::compression::{config, smooth_signals};

/// Closed forms of a few parameters with a condition below 10⁴.
const CLOSED_FORM_REL: f64 = 1e-11;

#[test]
fn closed_form_straight_line_in_white_noise() {
    // y = a + b·t at t = 0 … n−1: var a = 2s²(2n−1)/(n(n+1)), var b = 12s²/(n(n²−1)).
    let (n, s) = (50.0_f64, 0.3);
    let line = Matrix::from_fn(50, 2, |row, column| [1.0, row as f64][column]).unwrap();
    let noise = NoiseCovariance::new(&NoiseModel::White { variance: s * s }, 50, 0.0).unwrap();
    let bound = Information::of_signal(&line, &noise).unwrap().cramer_rao().unwrap();
    let expected = [
        (2.0 * s * s * (2.0 * n - 1.0) / (n * (n + 1.0))).sqrt(),
        (12.0 * s * s / (n * (n * n - 1.0))).sqrt(),
    ];
    for (found, expected) in bound.deviations().iter().zip(expected) {
        assert_abs_diff_eq!(found / expected, 1.0, epsilon = CLOSED_FORM_REL);
    }
    // The value of the line at its middle has the variance of a mean.
    let middle = Matrix::from_fn(1, 2, |_, column| [1.0, 24.5][column]).unwrap();
    let at_middle = bound.of_derived(&middle).unwrap().deviations()[0];
    assert_abs_diff_eq!(at_middle / (s / n.sqrt()), 1.0, epsilon = CLOSED_FORM_REL);
    let wrong = Matrix::from_fn(1, 3, |_, _| 1.0).unwrap();
    assert_eq!(bound.of_derived(&wrong), Err(InformationError::Size { found: 3, expected: 2 }));
}

#[test]
fn closed_form_mean_in_first_order_autoregressive_noise() {
    // Σ_ij = ρ^|i−j|: 1ᵀ·Σ⁻¹·1 = (n − (n−2)ρ)/(1+ρ).
    let (n, rho) = (40, 0.7_f64);
    let dense = Matrix::from_fn(n, n, |row, column| rho.powf(row.abs_diff(column) as f64)).unwrap();
    let noise = NoiseCovariance::new(&NoiseModel::Dense(dense), n, 0.0).unwrap();
    let constant = Matrix::from_fn(n, 1, |_, _| 1.0).unwrap();
    let found = Information::of_signal(&constant, &noise).unwrap().matrix().get(0, 0);
    let expected = (n as f64 - (n as f64 - 2.0) * rho) / (1.0 + rho);
    assert_abs_diff_eq!(found / expected, 1.0, epsilon = CLOSED_FORM_REL);
}

#[test]
fn property_no_encoding_beats_the_signal_and_sensitivities_lose_nothing() {
    let (snapshots, parameters) = smooth_signals(40);
    let autocovariance = vec![1e-4, 0.6e-4, 0.2e-4];
    let noise = NoiseCovariance::new(&NoiseModel::Stationary { autocovariance }, 240, 0.0).unwrap();
    let sensitivities =
        Sensitivities::regress(&snapshots, &parameters, Regression::Linear).unwrap().at_centre();
    let whole = Information::of_signal(&sensitivities, &noise).unwrap();
    let data = TrainingData::new(&snapshots).with_parameters(&parameters).with_noise(&noise);
    let kept = |encoding| {
        let map = CompressionMap::fit(&data, &config(encoding)).unwrap();
        Information::of_encoding(&sensitivities, &noise, &map.weights()).unwrap()
    };
    let bound = |information: &Information| information.cramer_rao().unwrap().deviations();
    for encoding in [
        Encoding::Points(Placement::DmdSom),
        Encoding::Points(Placement::PodSom),
        Encoding::Points(Placement::Qdeim),
        Encoding::Points(Placement::GreedyAOptimal),
        Encoding::Points(Placement::GreedyDOptimal),
        Encoding::Points(Placement::Uniform),
        Encoding::Points(Placement::Random),
        Encoding::ClusterMeans,
        Encoding::Modes,
    ] {
        let information = kept(encoding);
        let fraction = information.fraction_of(&whole).unwrap();
        assert!(fraction > 0.0 && fraction < 1.0 + CLOSED_FORM_REL, "{encoding:?} {fraction}");
        for (found, least) in bound(&information).iter().zip(bound(&whole)) {
            assert!(*found > least * (1.0 - CLOSED_FORM_REL), "{encoding:?}");
        }
    }
    let sufficient = kept(Encoding::Sensitivities);
    assert_abs_diff_eq!(sufficient.fraction_of(&whole).unwrap(), 1.0, epsilon = CLOSED_FORM_REL);
    for (found, least) in bound(&sufficient).iter().zip(bound(&whole)) {
        assert_abs_diff_eq!(found / least, 1.0, epsilon = CLOSED_FORM_REL);
    }
    let trace = |encoding| bound(&kept(encoding)).iter().map(|d| d * d).sum::<f64>();
    let optimal = trace(Encoding::Points(Placement::GreedyAOptimal));
    assert!(optimal < trace(Encoding::Points(Placement::Uniform)));
    assert!(optimal < trace(Encoding::Points(Placement::Random)));
}

#[test]
fn closed_form_polynomial_sensitivities_are_recovered() {
    let (_, parameters) = smooth_signals(30);
    let signal = |row: usize, p: &[f64]| {
        let x = row as f64;
        3.0 + x * p[0] - 2.0 * p[1] + 0.5 * x * p[0] * p[2] + p[1] * p[1]
    };
    let snapshots =
        reduction::Snapshots::from_fn(12, 30, |row, j| signal(row, &parameters.row(j))).unwrap();
    let fit = Sensitivities::regress(&snapshots, &parameters, Regression::Quadratic).unwrap();
    assert!(fit.residual_rms() < 1e-12);
    let p = [0.02, 0.07, 0.05];
    let found = fit.at(&p).unwrap();
    for row in 0..12 {
        let x = row as f64;
        let expected = [x + 0.5 * x * p[2], -2.0 + 2.0 * p[1], 0.5 * x * p[0]];
        for (column, expected) in expected.iter().enumerate() {
            // Coefficients in units of a spread of 0.03, squared: 10³ of ε·10².
            assert!((found.get(row, column) - expected).abs() < 1e-9, "row {row} {column}");
        }
    }
    assert_eq!(fit.at(&[0.1]), Err(SensitivityError::Parameters { found: 1, expected: 3 }));
    let linear = Sensitivities::regress(&snapshots, &parameters, Regression::Linear).unwrap();
    assert!(linear.residual_rms() > 1e-4);
}

#[test]
fn what_leaves_no_trace_is_said_so() {
    let noise = NoiseCovariance::new(&NoiseModel::White { variance: 1.0 }, 5, 0.0).unwrap();
    let twins =
        Matrix::from_fn(5, 2, |row, column| (row + 1) as f64 * [1.0, -3.0][column]).unwrap();
    let information = Information::of_signal(&twins, &noise).unwrap();
    assert_eq!(
        information.cramer_rao(),
        Err(InformationError::Unidentifiable { rank: 1, parameters: 2 })
    );
    let silent = Matrix::from_fn(5, 2, |row, column| (row * column) as f64).unwrap();
    assert!(matches!(
        Information::of_signal(&silent, &noise).unwrap().cramer_rao(),
        Err(InformationError::Unidentifiable { rank: 1, parameters: 2 })
    ));
    let short = Matrix::from_fn(4, 1, |_, _| 1.0).unwrap();
    assert!(matches!(Information::of_signal(&short, &noise), Err(InformationError::Noise(_))));
}
