//! The inference budgets of the FREEDOM paper: 25 s for seven faults, 6 s for two.

use criterion::{Criterion, criterion_group, criterion_main};
use fdi_benches::diagnose::BudgetCase;

fn budgets(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("diagnose");
    group.sample_size(10);
    for case in BudgetCase::both() {
        let evaluations = case.run().evaluations;
        assert_eq!(evaluations, case.evaluations, "{}", case.name);
        group.bench_function(case.name, |bencher| bencher.iter(|| case.run()));
    }
    group.finish();
}

criterion_group!(benches, budgets);
criterion_main!(benches);
