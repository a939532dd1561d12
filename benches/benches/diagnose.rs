//! The inference budgets: the FREEDOM paper's, 25 s for seven faults and 6 s for two, and ours.

use criterion::{Criterion, criterion_group, criterion_main};
use fdi_benches::diagnose::BUDGETS;

fn budgets(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("diagnose");
    group.sample_size(10);
    for budget in BUDGETS {
        let case = budget.prepare().expect("the recording and its bundle are committed");
        let run = || case.run().expect("the recording fits the bundle");
        assert_eq!(run().evaluations, budget.evaluations, "{}", budget.name);
        group.bench_function(budget.name, |bencher| bencher.iter(run));
    }
    group.finish();
}

criterion_group!(benches, budgets);
criterion_main!(benches);
