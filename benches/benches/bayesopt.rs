//! Gaussian process, acquisitions and steps of a study.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use fdi_benches::bayesopt::{inversion, regression};
use gp_bayesopt::{
    Acquisition, Ask, Design, Fantasies, GaussianProcess, GpOptions, Maximiser, Outcome, Study,
    StudyOptions, TwoStep,
};

fn fit(c: &mut Criterion) {
    let mut group = c.benchmark_group("fit");
    group.sample_size(20);
    for n in [50, 200] {
        let (bounds, points, values) = regression(n);
        let options = GpOptions::default();
        let run = || GaussianProcess::fit(&bounds, &points, &values, &options).expect("a fit");
        assert!(run().leave_one_out(0).q2.expect("it varies") > 0.9);
        group.bench_function(BenchmarkId::new("ard-7d", format!("n={n}")), |b| b.iter(run));
    }
    group.finish();
}

fn acquisitions(c: &mut Criterion) {
    let (bounds, points, values) = regression(200);
    let gp = GaussianProcess::fit(&bounds, &points, &values, &GpOptions::default()).expect("a fit");
    let best = values.iter().copied().fold(f64::INFINITY, f64::min);
    let maximiser = Maximiser::default();
    let ei = Acquisition::LogExpectedImprovement;
    let rule = TwoStep::new(Fantasies::GaussHermite(8)).expect("eight nodes");
    let found = maximiser.maximise(&ei, &gp, best).expect("a maximum");
    let at = ei.evaluate(&gp, &found.point, best).expect("a value");
    assert!((at - found.value).abs() < 1e-6);
    let mut group = c.benchmark_group("maximise");
    group.sample_size(20);
    group.bench_function("log-ei/n=200", |b| {
        b.iter(|| maximiser.maximise(&ei, &gp, best).expect("a maximum"));
    });
    group.bench_function("two-step/n=200", |b| {
        b.iter(|| maximiser.maximise_two_step(&rule, &gp, best).expect("a maximum"));
    });
    group.finish();
    let probe = Design::LatinHypercube.points(&bounds, 1000, 3).expect("a design");
    c.bench_function("posterior/ard-7d/n=200/points=1000", |b| {
        b.iter(|| gp.predict_many(black_box(&probe)).expect("predictions"));
    });
}

fn composite(c: &mut Criterion) {
    let problem = inversion();
    let measured = (problem.simulate)(&problem.truths[0]);
    let residual = |x: &[f64]| -> Outcome {
        let simulated = (problem.simulate)(x);
        Outcome::Residual(simulated.iter().zip(&measured).map(|(y, m)| y - m).collect())
    };
    let mut group = c.benchmark_group("composite-step");
    for n in [20, 40] {
        let mut options = StudyOptions::residual(problem.bounds.clone(), 1000);
        options.design_points = 0;
        let mut study = Study::new(options).expect("usable");
        for x in Design::Sobol.points(&problem.bounds, n, 1).expect("a design") {
            study.tell_earlier(&x, residual(&x)).expect("a residual");
        }
        // hyperparameters warm, as in a running study
        if let Ask::Evaluate(x) = study.ask().expect("a proposal") {
            study.tell(&x, residual(&x)).expect("a residual");
        }
        group.bench_function(BenchmarkId::new("30-outputs", format!("n={n}")), |b| {
            b.iter(|| study.clone().ask().expect("a proposal"));
        });
    }
    group.finish();
}

criterion_group!(benches, fit, acquisitions, composite);
criterion_main!(benches);
