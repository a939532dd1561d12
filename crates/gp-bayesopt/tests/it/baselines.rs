//! The scalar population methods and the derivative-free solver.

use std::convert::Infallible;

use gp_bayesopt::{
    Bounds, DerivativeFreeGaussNewton, Population, PopulationOptions, SolveError, StopReason,
};

const METHODS: [Population; 5] = [
    Population::Genetic,
    Population::Swarm,
    Population::DifferentialEvolution,
    Population::GreyWolves,
    Population::CmaEs,
];

/// A badly scaled bowl off the middle, minimum 0.
fn bowl(x: &[f64]) -> f64 {
    x.iter()
        .enumerate()
        .map(|(i, x)| (1.0 + 9.0 * i as f64) * (x - 0.3 - 0.1 * i as f64).powi(2))
        .sum()
}

#[test]
fn every_method_finds_the_bowl_within_its_budget() {
    let bounds = Bounds::new(&[-1.0; 4], &[1.0; 4]).unwrap();
    for method in METHODS {
        let options = PopulationOptions { max_evaluations: 12_000, seed: 3, ..Default::default() };
        let mut calls = 0;
        let run = method.minimise(
            |x| {
                calls += 1;
                assert!(bounds.contains(x), "{method:?} left the box: {x:?}");
                Ok::<_, Infallible>(bowl(x))
            },
            &bounds,
            &options,
        );
        let solution = run.unwrap();
        assert_eq!(solution.evaluations, calls);
        assert_eq!(calls, 12_000, "{method:?}");
        assert_eq!(solution.stop, StopReason::BudgetSpent);
        assert!(solution.value < 1e-4, "{method:?} {solution:?}");
        assert_eq!(bowl(&solution.point), solution.value);
    }
}

#[test]
fn seeds_repeat_and_differ() {
    let bounds = Bounds::unit(3).unwrap();
    for method in METHODS {
        let run = |seed| {
            let options = PopulationOptions { max_evaluations: 500, seed, ..Default::default() };
            method.minimise(|x| Ok::<_, Infallible>(bowl(x)), &bounds, &options).unwrap()
        };
        assert_eq!(run(1), run(1), "{method:?}");
        assert_ne!(run(1), run(2), "{method:?}");
    }
}

#[test]
fn threads_change_nothing() {
    let bounds = Bounds::unit(3).and_then(|b| b.with_periodic(2)).unwrap();
    let run = || {
        let options = PopulationOptions { max_evaluations: 2000, seed: 5, ..Default::default() };
        METHODS.map(|m| m.minimise(|x| Ok::<_, Infallible>(bowl(x)), &bounds, &options).unwrap())
    };
    let alone = run();
    std::thread::scope(|scope| {
        let beside: Vec<_> = (0..4).map(|_| scope.spawn(run)).collect();
        for thread in beside {
            assert_eq!(thread.join().unwrap(), alone);
        }
    });
}

#[test]
fn targets_nan_and_errors() {
    let bounds = Bounds::unit(2).unwrap();
    for method in METHODS {
        let options = PopulationOptions { target: 1e-3, ..Default::default() };
        let nan_left = |x: &[f64]| if x[0] < 0.1 { f64::NAN } else { bowl(x) };
        let run = method.minimise(|x| Ok::<_, Infallible>(nan_left(x)), &bounds, &options).unwrap();
        assert_eq!(run.stop, StopReason::TargetReached, "{method:?} {run:?}");
        let only_nan = method.minimise(|_| Ok::<_, Infallible>(f64::NAN), &bounds, &options);
        assert!(matches!(only_nan, Err(SolveError::UnusableStart)), "{method:?}");
    }
}

#[test]
fn derivative_free_solver_needs_no_steps() {
    let bounds = Bounds::new(&[0.0, -2.0, 10.0], &[1.0, 2.0, 30.0]).unwrap();
    let root = [0.3, 1.1, 17.0];
    let curved = |x: &[f64]| -> Vec<f64> {
        (0..6)
            .map(|i| {
                let t = 0.4 + 0.3 * f64::from(i);
                let wave = |x: &[f64]| (t * x[0]).exp() + (t + x[1]).sin() + 0.1 * t * t * x[2];
                wave(x) - wave(&root)
            })
            .collect()
    };
    let solver = DerivativeFreeGaussNewton { target: 1e-9, ..Default::default() };
    let mut calls = 0;
    let run = |x: &[f64]| {
        calls += 1;
        Ok::<_, Infallible>(curved(x))
    };
    let solution = solver.solve(run, &[0.8, 0.0, 25.0], &bounds).unwrap();
    assert_eq!(solution.evaluations, calls);
    assert_eq!(solution.stop, StopReason::TargetReached, "{solution:?}");
    assert!(calls < 60, "{calls}");
    for (x, r) in solution.point.iter().zip(root) {
        assert!((x - r).abs() < 1e-6, "{solution:?}");
    }
    for budget in 1..30 {
        let solver = DerivativeFreeGaussNewton { max_evaluations: budget, ..Default::default() };
        let mut calls = 0;
        let run = |x: &[f64]| {
            calls += 1;
            Ok::<_, Infallible>(curved(x))
        };
        let solution = solver.solve(run, &[0.8, 0.0, 25.0], &bounds).unwrap();
        assert!(calls <= budget && solution.evaluations == calls);
    }
}
