//! The ask-and-tell loop.

use approx::assert_abs_diff_eq;
use gp_bayesopt::{
    Ask, Bounds, Confidence, Criterion, Design, Fantasies, Outcome, RunError, Stall, StopReason,
    Study, StudyOptions, Told,
};

fn bowl(x: &[f64]) -> f64 {
    (x[0] - 0.3).powi(2) + 2.0 * (x[1] - 0.7).powi(2) + 0.05 * (9.0 * x[0]).sin()
}

fn options(criterion: Criterion) -> StudyOptions {
    StudyOptions::scalar(Bounds::unit(2).unwrap(), criterion, 24)
}

fn residual(x: &[f64]) -> Vec<f64> {
    let k = [0.21, 0.63];
    (0..5)
        .map(|i| {
            let t = 0.5 + 0.4 * f64::from(i);
            let y = |x: &[f64]| (t * x[0]).sin() + (t * x[1] * x[1]).exp();
            y(x) - y(&k)
        })
        .collect()
}

#[test]
fn every_criterion_finds_the_bowl() {
    // minimum of the bowl by a fine grid
    let mut least = f64::INFINITY;
    for i in 0..=400 {
        for j in 0..=400 {
            least = least.min(bowl(&[f64::from(i) / 400.0, f64::from(j) / 400.0]));
        }
    }
    for criterion in [
        Criterion::ExpectedImprovement,
        Criterion::LowerConfidence(Confidence::Printed),
        Criterion::LowerConfidence(Confidence::Srinivas { delta: 0.1 }),
        Criterion::TwoStep(Fantasies::GaussHermite(8)),
    ] {
        let mut study = Study::new(options(criterion.clone())).unwrap();
        while let Ask::Evaluate(x) = study.ask().unwrap() {
            study.tell(&x, Outcome::Value(bowl(&x))).unwrap();
        }
        assert_eq!(study.stopped(), Some(StopReason::BudgetSpent));
        assert_eq!(study.evaluations(), 24);
        let best = study.best().unwrap();
        assert!(best.value < least + 2e-3, "{criterion:?} {best:?} {least}");
    }
}

#[test]
fn residual_study_reaches_its_target() {
    let mut options = StudyOptions::residual(Bounds::unit(2).unwrap(), 40);
    options.target = 1e-4;
    let mut study = Study::new(options).unwrap();
    let stop = study.run(|x| Ok::<_, std::convert::Infallible>(Outcome::Residual(residual(x))));
    assert_eq!(stop.unwrap(), StopReason::TargetReached);
    assert!(study.evaluations() < 20, "{}", study.evaluations());
}

#[test]
fn resume_equals_uninterrupted_bit_for_bit() {
    let one_go = |mut study: Study| {
        while let Ask::Evaluate(x) = study.ask().unwrap() {
            study.tell(&x, Outcome::Value(bowl(&x))).unwrap();
        }
        study.state().clone()
    };
    let options = options(Criterion::ExpectedImprovement);
    let whole = one_go(Study::new(options.clone()).unwrap());
    for cut in [3, 10, 17] {
        let mut study = Study::new(options.clone()).unwrap();
        for _ in 0..cut {
            let Ask::Evaluate(x) = study.ask().unwrap() else { panic!("too early") };
            study.tell(&x, Outcome::Value(bowl(&x))).unwrap();
        }
        // cut between an ask and its tell
        let Ask::Evaluate(x) = study.ask().unwrap() else { panic!("too early") };
        let mut later = Study::resume(options.clone(), study.state().clone()).unwrap();
        later.tell(&x, Outcome::Value(bowl(&x))).unwrap();
        assert_eq!(one_go(later), whole, "cut at {cut}");
    }
    let other = StudyOptions { seed: 1, ..options };
    assert_ne!(one_go(Study::new(other).unwrap()), whole, "another seed differs");
}

#[test]
fn a_batch_holds_different_points() {
    let mut study = Study::new(options(Criterion::ExpectedImprovement)).unwrap();
    let mut told = 0;
    loop {
        let batch = study.ask_batch(4).unwrap();
        if batch.is_empty() {
            break;
        }
        for (i, a) in batch.iter().enumerate() {
            for b in &batch[..i] {
                assert!(a.iter().zip(b).any(|(x, y)| (x - y).abs() > 1e-9), "{a:?} {b:?}");
            }
        }
        // out of order
        for x in batch.iter().rev() {
            study.tell(x, Outcome::Value(bowl(x))).unwrap();
            told += 1;
        }
    }
    assert_eq!(told, 24);
    assert_eq!(study.stopped(), Some(StopReason::BudgetSpent));
}

#[test]
fn earlier_data_replace_the_search() {
    let mut options = options(Criterion::ExpectedImprovement);
    (options.design_points, options.budget) = (0, 8);
    let mut study = Study::new(options.clone()).unwrap();
    for x in Design::Sobol.points(&options.bounds, 20, 5).unwrap() {
        study.tell_earlier(&x, Outcome::Value(bowl(&x))).unwrap();
    }
    let before = study.best().unwrap().value;
    while let Ask::Evaluate(x) = study.ask().unwrap() {
        study.tell(&x, Outcome::Value(bowl(&x))).unwrap();
    }
    assert_eq!(study.evaluations(), 8);
    assert!(study.best().unwrap().value < before);
    assert!(study.tell_earlier(&[0.5, 0.5], Outcome::Value(0.0)).is_err());
}

#[test]
fn failures_are_kept_and_avoided() {
    let mut study = Study::new(options(Criterion::ExpectedImprovement)).unwrap();
    let mut failed = 0;
    while let Ask::Evaluate(x) = study.ask().unwrap() {
        let value = if x[0] < 0.25 { f64::NAN } else { bowl(&x) };
        if study.tell(&x, Outcome::Value(value)).unwrap() == Told::Failed {
            failed += 1;
        }
    }
    assert!(failed > 0);
    assert_eq!(study.state().points.len(), 24);
    let kept = study.state().outcomes.iter().filter(|o| **o == Outcome::Failed).count();
    assert_eq!(kept, failed);
    assert!(study.best().unwrap().value < 0.05);
}

#[test]
fn a_panic_loses_nothing() {
    let mut study = Study::new(options(Criterion::ExpectedImprovement)).unwrap();
    let mut calls = 0;
    let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        study.run(|x| {
            calls += 1;
            assert!(calls < 13, "the simulator breaks");
            Ok::<_, std::convert::Infallible>(Outcome::Value(bowl(x)))
        })
    }));
    assert!(caught.is_err());
    assert_eq!(study.evaluations(), 12);
    let mut saved = Study::resume(study.options().clone(), study.state().clone()).unwrap();
    while let Ask::Evaluate(x) = saved.ask().unwrap() {
        saved.tell(&x, Outcome::Value(bowl(&x))).unwrap();
    }
    assert_eq!(saved.evaluations(), 24);
}

#[test]
fn a_cancelled_study_says_so() {
    let mut study = Study::new(options(Criterion::ExpectedImprovement)).unwrap();
    study.cancel();
    assert_eq!(study.ask().unwrap(), Ask::Stop(StopReason::Cancelled));
}

#[test]
fn outcomes_of_another_kind_are_refused() {
    let mut study = Study::new(options(Criterion::ExpectedImprovement)).unwrap();
    assert!(study.tell(&[0.5, 0.5], Outcome::Residual(vec![1.0, 2.0])).is_err());
    assert!(study.tell(&[0.5], Outcome::Value(1.0)).is_err());
    let mut study = Study::new(StudyOptions::residual(Bounds::unit(2).unwrap(), 5)).unwrap();
    study.tell(&[0.5, 0.5], Outcome::Residual(vec![1.0, 2.0])).unwrap();
    assert!(study.tell(&[0.5, 0.6], Outcome::Residual(vec![1.0])).is_err());
    assert!(study.tell(&[0.5, 0.6], Outcome::Value(1.0)).is_err());
}

#[test]
fn a_study_without_progress_stalls() {
    let mut options = options(Criterion::ExpectedImprovement);
    options.budget = 60;
    options.stall = Some(Stall { evaluations: 5, relative_gain: 1e-3 });
    let design = options.design_points;
    let mut study = Study::new(options).unwrap();
    // the first value is the best for good
    let mut next = 0.0;
    let stop = study.run(|_| {
        next += 1.0;
        Ok::<_, std::convert::Infallible>(Outcome::Value(next))
    });
    assert_eq!(stop.unwrap(), StopReason::Stalled);
    assert_eq!(study.evaluations(), design + 5);
}

#[test]
fn an_objective_that_fails_hands_its_error_on() {
    #[derive(Debug, thiserror::Error)]
    #[error("no licence")]
    struct NoLicence;
    let mut study = Study::new(options(Criterion::ExpectedImprovement)).unwrap();
    let mut calls = 0;
    let result = study.run(|x| {
        calls += 1;
        if calls > 6 { Err(NoLicence) } else { Ok(Outcome::Value(bowl(x))) }
    });
    let Err(RunError::Objective { evaluations: 6, .. }) = result else { panic!("{result:?}") };
    assert_eq!(study.evaluations(), 6);
}

/// FREEDOM paper, eq. 13, and theorem 1 of Srinivas et al. for d = 7, n = 10, δ = 0.1:
/// 2·ln(7·100·π²/0.6) = 2·ln 11514.5 = 18.7027.
#[test]
fn published_confidence_weights() {
    let printed = Confidence::Printed.weight(10, 7);
    assert_abs_diff_eq!(printed, 7.164_484e-4, epsilon = 1e-9);
    let srinivas = Confidence::Srinivas { delta: 0.1 }.weight(10, 7);
    assert_abs_diff_eq!(srinivas * srinivas, 18.703, epsilon = 1e-3);
}

#[test]
fn a_checkpoint_of_another_shape_is_refused() {
    let options = options(Criterion::ExpectedImprovement);
    let mut study = Study::new(options.clone()).unwrap();
    study.tell(&[0.2, 0.3], Outcome::Value(1.0)).unwrap();
    let mut state = study.state().clone();
    state.outcomes.clear();
    assert!(Study::resume(options.clone(), state.clone()).is_err());
    state.outcomes = vec![Outcome::Residual(vec![1.0, 2.0])];
    assert!(Study::resume(options.clone(), state.clone()).is_err());
    state.outcomes = vec![Outcome::Value(1.0)];
    state.points = vec![vec![0.1]];
    assert!(Study::resume(options, state).is_err());
}
