//! One run of each simulator: `cargo bench -p fdi-benches --bench simulate`.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use fdi_benches::simulate::cases;

fn simulate(criterion: &mut Criterion) {
    for case in cases().expect("valid cases") {
        let samples = case.high.simulate(&case.faults).motor_angle_rad.len();
        assert_eq!(samples, case.samples, "{}", case.id);
        criterion.bench_function(&format!("high/{}", case.id), |bencher| {
            bencher.iter(|| black_box(case.high.simulate(&case.faults)));
        });
        let mut current_a = Vec::new();
        criterion.bench_function(&format!("low/{}", case.id), |bencher| {
            bencher.iter(|| case.low.simulate_current(black_box(&case.faults), &mut current_a));
        });
        assert_eq!(current_a.len(), case.samples, "{}", case.id);
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = simulate
}
criterion_main!(benches);
