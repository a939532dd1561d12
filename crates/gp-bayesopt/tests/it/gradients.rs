//! Analytic gradients against finite differences.

use gp_bayesopt::{
    Acquisition, Bounds, Design, Fantasies, GaussianProcess, GpOptions, Kernel, Matrix, Noise,
    NormImprovement, TwoStep,
};

/// Central differences with `h = 1e-5` on functions whose third derivative is
/// of order 1e3 of their size: truncation 1e-7, rounding ε·κ/h below 1e-7.
const DIFFERENCE_REL: f64 = 2e-5;
const H: f64 = 1e-5;

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

/// Central difference of `f` along input `i`.
fn central(f: &impl Fn(&[f64]) -> f64, x: &[f64], i: usize, h: f64) -> f64 {
    let moved = |h: f64| {
        let mut y = x.to_vec();
        y[i] += h;
        f(&y)
    };
    (moved(h) - moved(-h)) / (2.0 * h)
}

/// Compares a gradient with slopes found otherwise, relative to the largest of it.
fn compare_within(
    tolerance: f64,
    what: &str,
    size: f64,
    gradient: &[f64],
    slope: impl Fn(usize) -> f64,
) {
    let scale = gradient.iter().fold(1e-3 * size.abs() + 1e-9, |m, g| m.max(g.abs()));
    for (i, g) in gradient.iter().enumerate() {
        let slope = slope(i);
        let error = (slope - g).abs() / scale;
        assert!(error < tolerance, "{what} input {i}: {slope} against {g}, {error:e}");
    }
}

/// Compares a gradient with central differences.
fn compare(what: &str, x: &[f64], gradient: &[f64], f: impl Fn(&[f64]) -> f64) {
    compare_within(DIFFERENCE_REL, what, f(x), gradient, |i| central(&f, x, i, H));
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

/// Richardson's extrapolation of central differences at `h` and `h/2`, for a function whose
/// slopes change within 1e-3 of the interval beside an observation: truncation of order
/// `(h/1e-3)⁴/480` = 2e-7, rounding κ·ε/h = 4e7·1e-16/1e-4 = 4e-5 at worst. The formula itself,
/// free of the surrogate's rounding, is held to 1e-8 in `src/acquisition/norm.rs`.
const RICHARDSON_REL: f64 = 4e-5;
const RICHARDSON_H: f64 = 1e-4;

#[test]
fn property_norm_improvement_slopes() {
    let (bounds, gp, _) = case(Kernel::SquaredExponential, 5);
    for x in probes(&bounds) {
        for best_norm in [0.05, 0.7, 3.0] {
            let at = |y: &[f64]| NormImprovement.evaluate_with_gradient(&gp, y, best_norm).unwrap();
            let scored = at(&x);
            let value = |y: &[f64]| at(y).value;
            let slope = |i: usize| {
                let coarse = central(&value, &x, i, RICHARDSON_H);
                let fine = central(&value, &x, i, 0.5 * RICHARDSON_H);
                (4.0 * fine - coarse) / 3.0
            };
            compare_within(RICHARDSON_REL, "norm", scored.value, &scored.gradient, slope);
        }
    }
}
