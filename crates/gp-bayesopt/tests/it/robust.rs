//! Data that are not as they should be.

use approx::assert_abs_diff_eq;
use gp_bayesopt::{
    Ask, Bounds, Criterion, Design, FitError, GaussianProcess, GpOptions, Matrix, Noise, Outcome,
    Study, StudyOptions,
};

fn values(points: &[Vec<f64>]) -> Vec<f64> {
    points.iter().map(|x| (3.0 * x[0]).sin() + x[1]).collect()
}

#[test]
fn duplicated_points_are_fitted_and_the_jitter_reported() {
    let bounds = Bounds::unit(2).unwrap();
    let mut points = Design::Sobol.points(&bounds, 20, 1).unwrap();
    points.extend(points.clone());
    let y = values(&points);
    let exact = GpOptions { noise: Noise::Ratio(0.0), ..GpOptions::default() };
    let gp = GaussianProcess::fit(&bounds, &points, &y, &exact).unwrap();
    assert!(gp.report().jitter > 0.0);
    let noisy = GaussianProcess::fit(&bounds, &points, &y, &GpOptions::default()).unwrap();
    for gp in [gp, noisy] {
        let at = gp.predict(&points[3]).unwrap();
        assert_abs_diff_eq!(at.mean[0], y[3], epsilon = 1e-3);
    }
}

#[test]
fn constant_outputs_predict_the_constant() {
    let bounds = Bounds::unit(2).unwrap();
    let points = Design::Sobol.points(&bounds, 10, 1).unwrap();
    let gp = GaussianProcess::fit(&bounds, &points, &[4.2; 10], &GpOptions::default()).unwrap();
    assert_eq!(gp.report().constant_outputs, 1);
    let at = gp.predict(&[0.3, 0.3]).unwrap();
    assert_eq!((at.mean[0], at.std[0]), (4.2, 0.0));
    // beside one that varies
    let rows: Vec<Vec<f64>> = values(&points).iter().map(|v| vec![*v, 7.0]).collect();
    let both = Matrix::from_rows(&rows).unwrap();
    let gp = GaussianProcess::fit_many(&bounds, &points, &both, &GpOptions::default()).unwrap();
    assert_eq!(gp.predict(&[0.3, 0.3]).unwrap().mean[1], 7.0);
    let mut study =
        Study::new(StudyOptions::scalar(bounds, Criterion::ExpectedImprovement, 14)).unwrap();
    while let Ask::Evaluate(x) = study.ask().unwrap() {
        study.tell(&x, Outcome::Value(1.0)).unwrap();
    }
    assert_eq!(study.evaluations(), 14);
}

/// Standardising rounds each value by an ε of its size.
const SCALE_REL: f64 = 1e-6;

#[test]
fn property_huge_and_tiny_scales_change_nothing() {
    let points = Design::Sobol.points(&Bounds::unit(2).unwrap(), 20, 1).unwrap();
    let y = values(&points);
    let plain = GaussianProcess::fit(&Bounds::unit(2).unwrap(), &points, &y, &GpOptions::default());
    let want = plain.unwrap().predict(&[0.4, 0.6]).unwrap();
    for scale in [1e-280, 1e-20, 1e20, 1e280] {
        for extent in [1e-100, 1e100] {
            let bounds = Bounds::new(&[0.0; 2], &[extent; 2]).unwrap();
            let stretched: Vec<Vec<f64>> =
                points.iter().map(|x| x.iter().map(|v| v * extent).collect()).collect();
            let scaled: Vec<f64> = y.iter().map(|v| v * scale).collect();
            let gp =
                GaussianProcess::fit(&bounds, &stretched, &scaled, &GpOptions::default()).unwrap();
            let at = gp.predict(&[0.4 * extent, 0.6 * extent]).unwrap();
            assert!((at.mean[0] / scale / want.mean[0] - 1.0).abs() < SCALE_REL, "{scale} {at:?}");
            assert!((at.std[0] / scale / want.std[0] - 1.0).abs() < 1e-2, "{scale} {at:?}");
        }
    }
}

#[test]
fn one_observation_is_enough() {
    let bounds = Bounds::unit(2).unwrap();
    let gp =
        GaussianProcess::fit(&bounds, &[vec![0.5, 0.5]], &[3.0], &GpOptions::default()).unwrap();
    assert_eq!(gp.predict(&[0.1, 0.9]).unwrap().mean[0], 3.0);
    let mut options = StudyOptions::scalar(bounds, Criterion::ExpectedImprovement, 5);
    options.design_points = 1;
    let mut study = Study::new(options).unwrap();
    while let Ask::Evaluate(x) = study.ask().unwrap() {
        study.tell(&x, Outcome::Value(x[0] + x[1])).unwrap();
    }
    assert_eq!(study.evaluations(), 5);
}

#[test]
fn two_thousand_points_are_fitted_on_a_subset() {
    let bounds = Bounds::unit(2).unwrap();
    let points = Design::Sobol.points(&bounds, 2000, 1).unwrap();
    let y = values(&points);
    let options = GpOptions { max_fit_points: 150, ..GpOptions::default() };
    let gp = GaussianProcess::fit(&bounds, &points, &y, &options).unwrap();
    assert_eq!(gp.report().fitted_on, 150);
    assert_eq!(gp.len(), 2000);
    let at = gp.predict(&[0.37, 0.58]).unwrap();
    assert_abs_diff_eq!(at.mean[0], ((3.0_f64 * 0.37).sin() + 0.58), epsilon = 1e-3);
}

#[test]
fn bad_data_are_named() {
    let bounds = Bounds::unit(2).unwrap();
    let points = vec![vec![0.1, 0.2], vec![0.3, 0.4]];
    let fit = |points: &[Vec<f64>], y: &[f64]| {
        GaussianProcess::fit(&bounds, points, y, &GpOptions::default()).unwrap_err()
    };
    assert_eq!(fit(&[], &[]), FitError::NoObservations);
    let nan = fit(&points, &[1.0, f64::NAN]);
    assert!(matches!(nan, FitError::NotFinite { observation: 1, .. }));
    let short = fit(&points, &[1.0]);
    assert!(matches!(short, FitError::CountMismatch { points: 2, observations: 1 }));
    let flat = fit(&[vec![0.1], vec![0.2]], &[1.0, 2.0]);
    assert!(matches!(flat, FitError::Point { point: 0, .. }));
    for (lower, upper) in [(0.0, 0.0), (1.0, 0.0), (f64::NAN, 1.0), (0.0, f64::INFINITY)] {
        assert!(Bounds::new(&[lower], &[upper]).is_err());
    }
}

#[test]
fn appending_a_copy_is_refused_and_changes_nothing() {
    let bounds = Bounds::unit(2).unwrap();
    let points = Design::Sobol.points(&bounds, 15, 1).unwrap();
    let exact = GpOptions { noise: Noise::Ratio(0.0), ..GpOptions::default() };
    let mut gp = GaussianProcess::fit(&bounds, &points, &values(&points), &exact).unwrap();
    let before = gp.predict(&[0.3, 0.3]).unwrap();
    let refused = gp.append(&points[4], &[values(&points)[4]]);
    assert!(refused.is_err() || gp.report().jitter > 0.0);
    if refused.is_err() {
        assert_eq!(gp.predict(&[0.3, 0.3]).unwrap(), before);
    }
}
