//! Analytic gradients against finite differences.

use gp_bayesopt::{
    Acquisition, Bounds, Design, Fantasies, GaussianProcess, GpOptions, Kernel, Matrix, Noise,
    NormImprovement, TwoStep,
};

/// Central differences with `h = 1e-5` on functions whose third derivative is
/// of order 1e3 of their size: truncation 1e-7, rounding ε·κ/h below 1e-7.
const DIFFERENCE_REL: f64 = 2e-5;
const H: f64 = 1e-5;

/// The norm's improvement is an eight-point quadrature whose substitution is
/// held fixed in the gradient: exact up to the quadrature's relative error.
const QUADRATURE_REL: f64 = 2e-4;

/// A box with every kind of input and a smooth function on it.
fn case(kernel: Kernel, outputs: usize) -> (Bounds, GaussianProcess, f64) {
    let bounds = Bounds::new(&[0.0, -1.0, 0.0, 0.0], &[2.0, 1.0, 1.0, 1.0])
        .and_then(|b| b.with_periodic(1))
        .and_then(|b| b.with_polar(2, 3))
        .unwrap();
    let points = Design::Sobol.points(&bounds, 40, 3).unwrap();
    let rows: Vec<Vec<f64>> = points
        .iter()
        .map(|x| {
            let turn = std::f64::consts::TAU * x[3];
            (0..outputs)
                .map(|o| {
                    let o = o as f64;
                    (x[0] + 0.3 * o).sin() + 0.4 * (3.1 * x[1]).cos() + x[2] * (turn + o).cos()
                })
                .collect()
        })
        .collect();
    let best = rows.iter().map(|r| r[0]).fold(f64::INFINITY, f64::min);
    let options = GpOptions { kernel, noise: Noise::Ratio(1e-6), ..GpOptions::default() };
    let gp =
        GaussianProcess::fit_many(&bounds, &points, &Matrix::from_rows(&rows).unwrap(), &options)
            .unwrap();
    (bounds, gp, best)
}

fn probes(bounds: &Bounds) -> Vec<Vec<f64>> {
    // away from the walls, where a central difference fits
    let points = Design::LatinHypercube.points(bounds, 12, 8).unwrap();
    points.iter().map(|p| p.iter().map(|x| 0.9 * x + 0.05).collect()).collect()
}

/// Compares a gradient with central differences, relative to the largest slope.
fn compare(what: &str, x: &[f64], gradient: &[f64], f: impl Fn(&[f64]) -> f64) {
    compare_within(DIFFERENCE_REL, what, x, (gradient, f));
}

fn compare_within(
    tolerance: f64,
    what: &str,
    x: &[f64],
    (gradient, f): (&[f64], impl Fn(&[f64]) -> f64),
) {
    let scale = gradient.iter().fold(1e-3 * f(x).abs() + 1e-9, |m, g| m.max(g.abs()));
    for i in 0..x.len() {
        let moved = |h: f64| {
            let mut y = x.to_vec();
            y[i] += h;
            f(&y)
        };
        let slope = (moved(H) - moved(-H)) / (2.0 * H);
        let error = (slope - gradient[i]).abs() / scale;
        assert!(error < tolerance, "{what} input {i}: {slope} against {}", gradient[i]);
    }
}

#[test]
fn property_prediction_slopes() {
    for kernel in [Kernel::SquaredExponential, Kernel::Matern32, Kernel::Matern52] {
        let (bounds, gp, _) = case(kernel, 2);
        for x in probes(&bounds) {
            let (_, slope) = gp.predict_with_slope(&x).unwrap();
            for o in 0..2 {
                compare("mean", &x, slope.mean.row(o), |y| gp.predict(y).unwrap().mean[o]);
                compare("std", &x, slope.std.row(o), |y| gp.predict(y).unwrap().std[o]);
            }
        }
    }
}

#[test]
fn property_acquisition_slopes() {
    let (bounds, gp, best) = case(Kernel::SquaredExponential, 1);
    for acquisition in [
        Acquisition::ExpectedImprovement,
        Acquisition::LogExpectedImprovement,
        Acquisition::LowerConfidence { weight: 1.7 },
    ] {
        for x in probes(&bounds) {
            let scored = acquisition.evaluate_with_gradient(&gp, &x, best).unwrap();
            compare("acquisition", &x, &scored.gradient, |y| {
                acquisition.evaluate(&gp, y, best).unwrap()
            });
        }
    }
}

#[test]
fn property_two_step_slopes() {
    let (bounds, gp, best) = case(Kernel::Matern52, 1);
    let second = Design::Sobol.points(&bounds, 64, 5).unwrap();
    for fantasies in [Fantasies::GaussHermite(8), Fantasies::MonteCarlo { draws: 20, seed: 4 }] {
        let rule = TwoStep::new(fantasies).unwrap();
        for x in probes(&bounds) {
            let scored = rule.evaluate_with_gradient(&gp, &x, &second, best).unwrap();
            compare("two-step", &x, &scored.gradient, |y| {
                rule.evaluate_with_gradient(&gp, y, &second, best).unwrap().value
            });
        }
    }
}

#[test]
fn property_norm_improvement_slopes() {
    let (bounds, gp, _) = case(Kernel::SquaredExponential, 5);
    for x in probes(&bounds) {
        for best_norm in [0.05, 0.7, 3.0] {
            let scored = NormImprovement.evaluate_with_gradient(&gp, &x, best_norm).unwrap();
            let value = |y: &[f64]| {
                NormImprovement.evaluate_with_gradient(&gp, y, best_norm).unwrap().value
            };
            compare_within(QUADRATURE_REL, "norm", &x, (&scored.gradient, value));
        }
    }
}
