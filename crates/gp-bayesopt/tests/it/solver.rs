//! The solver for residual vectors.

use std::convert::Infallible;

use approx::assert_abs_diff_eq;
use gp_bayesopt::{
    Bounds, FinalJacobian, LevenbergMarquardt, Matrix, SolveError, StopReason, covariance,
};

/// A mildly curved residual with its root at `ROOT`.
const ROOT: [f64; 3] = [0.3, 0.6, 0.2];

fn curved(x: &[f64]) -> Vec<f64> {
    (0..6)
        .map(|i| {
            let t = 0.4 + 0.3 * f64::from(i);
            let wave = |x: &[f64]| (t * x[0]).exp() + (t + x[1]).sin() + x[2] * x[2] * t;
            wave(x) - wave(&ROOT)
        })
        .collect()
}

#[test]
fn cost_one_jacobian_then_single_evaluations() {
    let bounds = Bounds::unit(3).unwrap();
    let mut calls = 0;
    let solver = LevenbergMarquardt { target: 1e-9, ..LevenbergMarquardt::default() };
    let solution = solver
        .solve(
            |x| {
                calls += 1;
                Ok::<_, Infallible>(curved(x))
            },
            &[0.5; 3],
            &bounds,
        )
        .unwrap();
    assert_eq!(solution.stop, StopReason::TargetReached);
    assert_eq!(solution.evaluations, calls);
    assert_eq!(solution.difference_evaluations % 3, 0);
    for (x, root) in solution.point.iter().zip(ROOT) {
        assert!((x - root).abs() < 1e-6, "{solution:?}");
    }
    let again = solver.solve(|x| Ok::<_, Infallible>(curved(x)), &[0.5; 3], &bounds).unwrap();
    assert_eq!(solution, again, "deterministic");
}

#[test]
fn cost_a_given_jacobian_saves_its_evaluations() {
    let bounds = Bounds::unit(3).unwrap();
    let solver = LevenbergMarquardt { target: 1e-8, ..LevenbergMarquardt::default() };
    let f = |x: &[f64]| Ok::<_, Infallible>(curved(x));
    let at_start = LevenbergMarquardt {
        max_evaluations: 7,
        final_jacobian: FinalJacobian::Central,
        ..LevenbergMarquardt::default()
    };
    let first = at_start.solve(f, &[0.5; 3], &bounds).unwrap();
    assert_eq!(first.stop, StopReason::BudgetSpent);
    assert_eq!(first.evaluations, 7);
    let given = LevenbergMarquardt { start_jacobian: first.jacobian, ..solver.clone() };
    let cheap = given.solve(f, &[0.5; 3], &bounds).unwrap();
    let expensive = solver.solve(f, &[0.5; 3], &bounds).unwrap();
    assert_eq!(cheap.stop, StopReason::TargetReached);
    assert!(cheap.evaluations + 3 <= expensive.evaluations, "{cheap:?} {expensive:?}");
}

#[test]
fn property_budget_is_never_exceeded() {
    let bounds = Bounds::unit(3).unwrap();
    for budget in 1..40 {
        for last in [FinalJacobian::Working, FinalJacobian::Central] {
            let solver = LevenbergMarquardt {
                max_evaluations: budget,
                final_jacobian: last,
                ..LevenbergMarquardt::default()
            };
            let mut calls = 0;
            let result = solver.solve(
                |x| {
                    calls += 1;
                    Ok::<_, Infallible>(curved(x))
                },
                &[0.9, 0.1, 0.9],
                &bounds,
            );
            assert!(calls <= budget, "{calls} of {budget}");
            match result {
                Ok(solution) => {
                    assert_eq!(solution.evaluations, calls);
                    assert!(bounds.contains(&solution.point));
                    let start: f64 = curved(&[0.9, 0.1, 0.9]).iter().map(|r| r * r).sum();
                    assert!(solution.norm <= start.sqrt() * (1.0 + 4.0 * f64::EPSILON));
                }
                Err(error) => assert!(matches!(error, SolveError::Setting(_)), "{error}"),
            }
        }
    }
}

/// Central differences on a smooth function with h = 1e-6: truncation h²,
/// rounding ε/h = 2e-10.
const CENTRAL_ABS: f64 = 1e-8;

#[test]
fn property_central_jacobian_is_that_of_the_function() {
    let bounds = Bounds::unit(3).unwrap();
    // the root lies on a wall: the difference must turn inward
    let f = |x: &[f64]| Ok::<_, Infallible>(vec![x[0].exp() - 1.0, x[1] - 0.5, x[2] * x[2] - 1.0]);
    let solver = LevenbergMarquardt {
        final_jacobian: FinalJacobian::Central,
        ..LevenbergMarquardt::default()
    };
    let solution = solver.solve(f, &[0.4; 3], &bounds).unwrap();
    assert_eq!(solution.at_bound, [true, false, true]);
    let jacobian = solution.jacobian.clone().unwrap();
    for (i, want) in [1.0, 1.0, 2.0].into_iter().enumerate() {
        for j in 0..3 {
            let want = if i == j { want } else { 0.0 };
            assert!((jacobian.get(i, j) - want).abs() < CENTRAL_ABS, "{jacobian:?}");
        }
    }
    let cov = solution.covariance(0.1).unwrap().unwrap();
    assert_abs_diff_eq!(cov.get(2, 2), 0.01 / 4.0, epsilon = 1e-9);
}

#[test]
fn a_wall_holds_and_the_others_still_move() {
    // unconstrained root at x0 = 1.5; on the wall x0 = 1 the best x1 is 0.25
    let bounds = Bounds::unit(2).unwrap();
    let f = |x: &[f64]| Ok::<_, Infallible>(vec![x[0] - 1.5, x[0] + 2.0 * x[1] - 1.5]);
    let solution = LevenbergMarquardt::default().solve(f, &[0.2, 0.9], &bounds).unwrap();
    assert_abs_diff_eq!(solution.point[0], 1.0, epsilon = 1e-12);
    // a relative gain of 1e-9 of the norm ½ is a residual of 2e-5, half of it in x1
    assert_abs_diff_eq!(solution.point[1], 0.25, epsilon = 1e-5);
    assert_eq!(solution.stop, StopReason::Converged);
}

#[test]
fn a_circle_is_crossed() {
    // root at 0.95 from 0.1: the short way passes 0 = 1
    let bounds = Bounds::unit(1).unwrap().with_periodic(0).unwrap();
    let turn = |x: f64| std::f64::consts::TAU * (x - 0.95);
    let f = |x: &[f64]| Ok::<_, Infallible>(vec![turn(x[0]).sin(), turn(x[0]).cos() - 1.0]);
    let solver = LevenbergMarquardt { target: 1e-8, ..LevenbergMarquardt::default() };
    let solution = solver.solve(f, &[0.1], &bounds).unwrap();
    assert_abs_diff_eq!(solution.point[0], 0.95, epsilon = 1e-8);
}

#[derive(Debug, thiserror::Error)]
#[error("simulator stopped at call {0}")]
struct Broken(usize);

#[test]
fn a_failing_function_keeps_the_best_point() {
    let bounds = Bounds::unit(3).unwrap();
    let mut calls = 0;
    let error = LevenbergMarquardt::default()
        .solve(
            |x| {
                calls += 1;
                if calls == 7 { Err(Broken(calls)) } else { Ok(curved(x)) }
            },
            &[0.5; 3],
            &bounds,
        )
        .unwrap_err();
    let SolveError::Evaluation { evaluation: 7, best: Some((point, residual)), .. } = error else {
        panic!("{error:?}");
    };
    assert_eq!(curved(&point), residual);
}

#[test]
fn a_residual_with_nan_refuses_the_step() {
    let bounds = Bounds::unit(3).unwrap();
    let solver = LevenbergMarquardt { target: 1e-8, ..LevenbergMarquardt::default() };
    let mut calls = 0;
    let f = |x: &[f64]| {
        calls += 1;
        let mut r = curved(x);
        if calls == 5 {
            r[0] = f64::NAN; // the first step after the start and its three differences
        }
        Ok::<_, Infallible>(r)
    };
    let solution = solver.solve(f, &[0.9, 0.9, 0.9], &bounds).unwrap();
    assert_eq!(solution.stop, StopReason::TargetReached, "{solution:?}");
    assert_eq!(solution.refused_evaluations, 1);
    let nan = |_: &[f64]| Ok::<_, Infallible>(vec![f64::NAN]);
    assert!(matches!(solver.solve(nan, &[0.5; 3], &bounds), Err(SolveError::UnusableStart)));
}

/// With noise the norm has a floor: the run must notice and not spend its budget.
#[test]
fn cost_an_inconsistent_system_converges_early() {
    let bounds = Bounds::unit(3).unwrap();
    let offsets = [1e-3, -2e-3, 1.5e-3, -0.5e-3, 2e-3, -1e-3];
    let f = |x: &[f64]| {
        Ok::<_, Infallible>(curved(x).iter().zip(offsets).map(|(r, o)| r + o).collect())
    };
    let solution = LevenbergMarquardt::default().solve(f, &[0.5; 3], &bounds).unwrap();
    assert_eq!(solution.stop, StopReason::Converged, "{solution:?}");
    assert!(solution.evaluations < 30, "{solution:?}");
}

#[test]
fn an_undetermined_input_is_named() {
    let j = Matrix::from_rows(&[vec![1.0, 2.0], vec![2.0, 4.0]]).unwrap();
    assert!(covariance(&j, 1.0).is_err());
}
