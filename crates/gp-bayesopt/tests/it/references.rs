//! The Gaussian process against other software and against direct formulas.

use approx::assert_abs_diff_eq;
use gp_bayesopt::{
    Bounds, Design, GaussianProcess, GpOptions, Hyperparameters, Kernel, Matrix, Noise,
};

const TRAIN: &str = include_str!("../../../../fixtures/references/sklearn/train.csv");
const PROBE: &str = include_str!("../../../../fixtures/references/sklearn/probe.csv");
const SKLEARN: &str = include_str!("../../../../fixtures/references/sklearn/posterior.csv");
const GPYTORCH: &str = include_str!("../../../../fixtures/references/gpytorch/posterior.csv");
const GPYTORCH_LIKELIHOOD: &str =
    include_str!("../../../../fixtures/references/gpytorch/likelihood.csv");
const EGOBOX: &str = include_str!("../../../../fixtures/references/egobox/posterior.csv");

/// Those of `fixtures/references/sklearn/generate.py`.
const LENGTHS: [f64; 7] = [0.9, 1.4, 1.1, 0.7, 1.6, 2.0, 3.0];
const NOISE: f64 = 1e-4;

/// Two Cholesky solves of a matrix with condition near 1e6: 1e6·ε·√n is
/// 3e-9, for the standard deviation twice that after its root is taken.
const POSTERIOR_REL: f64 = 1e-8;

fn table(text: &str) -> Vec<Vec<f64>> {
    text.lines().map(|l| l.split(',').map(|v| v.parse().unwrap()).collect()).collect()
}

fn case() -> (Bounds, Vec<Vec<f64>>, Vec<f64>) {
    let rows = table(TRAIN);
    let points = rows.iter().map(|r| r[..7].to_vec()).collect();
    (Bounds::unit(7).unwrap(), points, rows.iter().map(|r| r[7]).collect())
}

fn column(values: &[f64]) -> Matrix {
    Matrix::from_vec(values.len(), 1, values.to_vec()).unwrap()
}

/// The process at the hyperparameters of the stored references, one kernel after the other.
fn fixed_processes() -> Vec<(Kernel, GaussianProcess)> {
    let (bounds, points, values) = case();
    let outputs = column(&values);
    [Kernel::SquaredExponential, Kernel::Matern32, Kernel::Matern52]
        .into_iter()
        .map(|kernel| {
            let options = GpOptions { kernel, ..GpOptions::default() };
            let fixed = Hyperparameters { length_scales: &LENGTHS, noise_ratio: NOISE };
            let gp =
                GaussianProcess::with_hyperparameters(&bounds, &points, &outputs, &options, fixed);
            (kernel, gp.unwrap())
        })
        .collect()
}

/// Compares with mean and standard deviation at each probe, two columns a kernel.
fn compare_posterior(theirs: &str) {
    let theirs = table(theirs);
    assert_eq!(theirs.len(), 50);
    for (k, (kernel, gp)) in fixed_processes().into_iter().enumerate() {
        for (x, row) in table(PROBE).iter().zip(&theirs) {
            let ours = gp.predict(x).unwrap();
            let (mean, std) = (row[2 * k], row[2 * k + 1]);
            assert!(
                (ours.mean[0] / mean - 1.0).abs() < POSTERIOR_REL,
                "{kernel:?} {ours:?} {row:?}"
            );
            assert!((ours.std[0] / std - 1.0).abs() < POSTERIOR_REL, "{kernel:?} {ours:?} {row:?}");
        }
    }
}

#[test]
fn versus_sklearn_posterior() {
    compare_posterior(SKLEARN);
}

#[test]
fn versus_gpytorch_posterior() {
    compare_posterior(GPYTORCH);
}

/// A quadratic form and a determinant of 200 data with condition 1e6: 200·1e6·ε.
const LN_LIKELIHOOD_ABS: f64 = 5e-8;

#[test]
fn versus_gpytorch_ln_likelihood() {
    let theirs = &table(GPYTORCH_LIKELIHOOD)[0];
    for ((kernel, gp), theirs) in fixed_processes().iter().zip(theirs) {
        let ours = gp.report().ln_likelihood;
        assert!((ours - theirs).abs() < LN_LIKELIHOOD_ABS, "{kernel:?} {ours} {theirs}");
    }
}

/// Two maximum-likelihood fits with their own optimisers and nugget rules on a smooth
/// function known to 200 points: both means are within a few of egobox's own standard
/// deviations (3e-3 to 0.04) of each other. Wrong length scales are eleven of them away.
const EGOBOX_STDS: f64 = 3.0;

#[test]
fn versus_egobox_fitted_mean() {
    let (bounds, points, values) = case();
    let gp = GaussianProcess::fit(&bounds, &points, &values, &GpOptions::default()).unwrap();
    for (x, row) in table(PROBE).iter().zip(table(EGOBOX)) {
        let ours = gp.predict(x).unwrap().mean[0];
        let std = row[1].sqrt();
        assert!((ours - row[0]).abs() < EGOBOX_STDS * std, "{x:?} {ours} {row:?}");
    }
}

/// Gaussian elimination, the slow way to a posterior.
fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for k in 0..n {
        for i in k + 1..n {
            let f = a[i][k] / a[k][k];
            for j in k..n {
                a[i][j] -= f * a[k][j];
            }
            b[i] -= f * b[k];
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| a[k][j] * b[j]).sum();
        b[k] = (b[k] - known) / a[k][k];
    }
    b
}

#[test]
fn law_posterior_with_circles_and_polar_pairs_by_the_direct_formula() {
    let bounds = Bounds::new(&[0.0, -1.0, 0.0, 0.0], &[2.0, 1.0, 1.0, 1.0])
        .and_then(|b| b.with_periodic(1))
        .and_then(|b| b.with_polar(2, 3))
        .unwrap();
    let points = Design::LatinHypercube.points(&bounds, 25, 2).unwrap();
    let values: Vec<f64> = points.iter().map(|x| x[0] + (3.0 * x[1]).sin() * x[2]).collect();
    let lengths = [0.8, 0.3, 0.6, 0.9];
    let noise = 1e-3;
    let gp = GaussianProcess::with_hyperparameters(
        &bounds,
        &points,
        &column(&values),
        &GpOptions::default(),
        Hyperparameters { length_scales: &lengths, noise_ratio: noise },
    )
    .unwrap();
    let tau = std::f64::consts::TAU;
    let kernel = |a: &[f64], b: &[f64]| {
        let linear = (a[0] - b[0]) / 2.0 / lengths[0];
        let chord = 2.0 * (tau * (a[1] - b[1]) / 4.0).sin() / tau / lengths[1];
        let plane = |x: &[f64]| [x[2] * (tau * x[3]).cos(), x[2] * (tau * x[3]).sin()];
        let (p, q) = (plane(a), plane(b));
        let (u, v) = ((p[0] - q[0]) / lengths[2], (p[1] - q[1]) / lengths[3]);
        (-0.5 * (linear * linear + chord * chord + u * u + v * v)).exp()
    };
    let k: Vec<Vec<f64>> = (0..25)
        .map(|i| {
            (0..25)
                .map(|j| kernel(&points[i], &points[j]) + if i == j { noise } else { 0.0 })
                .collect()
        })
        .collect();
    let ones = solve(k.clone(), vec![1.0; 25]);
    let mean = ones.iter().zip(&values).map(|(o, y)| o * y).sum::<f64>() / ones.iter().sum::<f64>();
    let rest: Vec<f64> = values.iter().map(|y| y - mean).collect();
    let alpha = solve(k.clone(), rest.clone());
    let s2 = alpha.iter().zip(&rest).map(|(a, r)| a * r).sum::<f64>() / 25.0;
    for x in Design::LatinHypercube.points(&bounds, 20, 7).unwrap() {
        let cross: Vec<f64> = points.iter().map(|p| kernel(&x, p)).collect();
        let want = mean + cross.iter().zip(&alpha).map(|(c, a)| c * a).sum::<f64>();
        let known: f64 =
            solve(k.clone(), cross.clone()).iter().zip(&cross).map(|(a, b)| a * b).sum();
        let ours = gp.predict(&x).unwrap();
        assert_abs_diff_eq!(ours.mean[0], want, epsilon = POSTERIOR_REL);
        assert_abs_diff_eq!(ours.std[0].powi(2) / (s2 * (1.0 - known)), 1.0, epsilon = 1e-7);
        // the seam and the centre are no places
        let mut turned = x.clone();
        turned[1] = if x[1] > 0.0 { -1.0 } else { 1.0 };
        let mut other = turned.clone();
        other[1] = -turned[1];
        let (a, b) = (gp.predict(&turned).unwrap(), gp.predict(&other).unwrap());
        assert_abs_diff_eq!(a.mean[0], b.mean[0], epsilon = 1e-12);
    }
}

#[test]
fn property_evidence_gradient_is_flat_at_the_fit() {
    // at the maximum no small change of a length scale may gain anything
    let (bounds, points, values) = case();
    let gp = GaussianProcess::fit(&bounds, &points, &values, &GpOptions::default()).unwrap();
    let report = gp.report().clone();
    for j in 0..7 {
        for factor in [0.98, 1.02] {
            let mut lengths = report.length_scales.clone();
            lengths[j] *= factor;
            if lengths[j] > 20.0 {
                continue;
            }
            let moved = GaussianProcess::with_hyperparameters(
                &bounds,
                &points,
                &column(&values),
                &GpOptions { length_scales: (0.02, 30.0), ..GpOptions::default() },
                Hyperparameters { length_scales: &lengths, noise_ratio: report.noise_ratio },
            )
            .unwrap();
            // stopping rule: 1e-7 of the likelihood per datum, 200 data
            assert!(moved.report().ln_likelihood < report.ln_likelihood + 1e-3, "{j} {factor}");
        }
    }
}

#[test]
fn property_many_outputs_equal_one_by_one() {
    let (bounds, points, values) = case();
    let rows: Vec<Vec<f64>> = values.iter().map(|v| vec![*v, 3.0 - 2.0 * v, v * v]).collect();
    let all = Matrix::from_rows(&rows).unwrap();
    let fixed = Hyperparameters { length_scales: &LENGTHS, noise_ratio: NOISE };
    let options = GpOptions::default();
    let gp =
        GaussianProcess::with_hyperparameters(&bounds, &points, &all, &options, fixed).unwrap();
    for o in 0..3 {
        let one: Vec<f64> = rows.iter().map(|r| r[o]).collect();
        let alone =
            GaussianProcess::with_hyperparameters(&bounds, &points, &column(&one), &options, fixed)
                .unwrap();
        for x in table(PROBE) {
            let (a, b) = (gp.predict(&x).unwrap(), alone.predict(&x).unwrap());
            assert_abs_diff_eq!(a.mean[o], b.mean[0], epsilon = 1e-9 * b.mean[0].abs().max(1.0));
            assert_abs_diff_eq!(a.std[o] / b.std[0], 1.0, epsilon = 1e-9);
        }
    }
    let batch = gp.predict_many(&table(PROBE)).unwrap();
    for (x, many) in table(PROBE).iter().zip(batch) {
        let one = gp.predict(x).unwrap();
        for o in 0..3 {
            assert_abs_diff_eq!(one.mean[o], many.mean[o], epsilon = 1e-9);
            assert_abs_diff_eq!(one.std[o], many.std[o], epsilon = 1e-9);
        }
    }
}

#[test]
fn property_appending_equals_fitting_all() {
    let (bounds, points, values) = case();
    let fixed = Hyperparameters { length_scales: &LENGTHS, noise_ratio: NOISE };
    let options = GpOptions::default();
    let of = |n: usize| {
        let part = column(&values[..n]);
        GaussianProcess::with_hyperparameters(&bounds, &points[..n], &part, &options, fixed)
            .unwrap()
    };
    let mut grown = of(190);
    for i in 190..200 {
        grown.append(&points[i], &[values[i]]).unwrap();
    }
    let whole = of(200);
    assert_abs_diff_eq!(grown.report().ln_likelihood, whole.report().ln_likelihood, epsilon = 1e-6);
    for x in table(PROBE) {
        let (a, b) = (grown.predict(&x).unwrap(), whole.predict(&x).unwrap());
        assert_abs_diff_eq!(a.mean[0], b.mean[0], epsilon = POSTERIOR_REL);
        assert_abs_diff_eq!(a.std[0] / b.std[0], 1.0, epsilon = POSTERIOR_REL);
    }
    assert_eq!(grown.len(), 200);
}

#[test]
fn law_leave_one_out_is_what_leaving_one_out_gives() {
    let (bounds, points, values) = case();
    let n = 30;
    let fixed = Hyperparameters { length_scales: &LENGTHS, noise_ratio: NOISE };
    let options = GpOptions { noise: Noise::Ratio(NOISE), ..GpOptions::default() };
    let all = column(&values[..n]);
    let gp = GaussianProcess::with_hyperparameters(&bounds, &points[..n], &all, &options, fixed)
        .unwrap();
    let loo = gp.leave_one_out(0);
    for i in [0, 11, 29] {
        let keep: Vec<usize> = (0..n).filter(|k| *k != i).collect();
        let part: Vec<Vec<f64>> = keep.iter().map(|&k| points[k].clone()).collect();
        // the mean is held at that of all data: shift it away and predict the rest
        let mean = gp.prior_mean()[0];
        let kernel = |a: &[f64], b: &[f64]| {
            let r2: f64 = (0..7).map(|j| ((a[j] - b[j]) / LENGTHS[j]).powi(2)).sum();
            (-0.5 * r2).exp()
        };
        let k: Vec<Vec<f64>> = part
            .iter()
            .enumerate()
            .map(|(a, p)| {
                part.iter()
                    .enumerate()
                    .map(|(b, q)| kernel(p, q) + if a == b { NOISE } else { 0.0 })
                    .collect()
            })
            .collect();
        let rest: Vec<f64> = keep.iter().map(|&k| values[k] - mean).collect();
        let cross: Vec<f64> = part.iter().map(|p| kernel(p, &points[i])).collect();
        let guess: f64 = mean + solve(k, rest).iter().zip(&cross).map(|(a, c)| a * c).sum::<f64>();
        assert!((loo.error[i] - (values[i] - guess)).abs() < 1e-8, "{i}");
    }
    assert!(loo.q2.unwrap() > 0.5);
}
