//! One run of each simulator: `cargo bench -p fdi-benches --bench simulate`.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use fdi_benches::simulate::{batch, cases};

fn simulate(criterion: &mut Criterion) {
    for case in cases().expect("valid cases") {
        let samples = case.high.simulate(&case.faults).motor_angle_rad.len();
        assert_eq!(samples, case.samples, "{}", case.id);
        criterion.bench_function(&format!("high/{}", case.id), |bencher| {
            bencher.iter(|| black_box(case.high.simulate(&case.faults)));
        });
        let mut current_a = Vec::new();
        case.low.simulate_current(&case.faults, &mut current_a);
        assert_eq!(current_a.len(), case.samples, "{}", case.id);
        criterion.bench_function(&format!("low/{}", case.id), |bencher| {
            bencher.iter(|| case.low.simulate_current(black_box(&case.faults), &mut current_a));
        });
    }
}

/// Sixty-four fault vectors in low fidelity, side by side and one by one.
fn batches(criterion: &mut Criterion) {
    let faults = batch(64);
    for case in cases().expect("valid cases").iter().filter(|case| case.id.ends_with("healthy")) {
        let test = case.id.trim_end_matches("/healthy");
        let (mut currents_a, mut current_a) = (Vec::new(), Vec::new());
        case.low.simulate_currents(&faults, &mut currents_a);
        for (faults, of_batch) in faults.iter().zip(&currents_a) {
            case.low.simulate_current(faults, &mut current_a);
            assert_eq!(&current_a, of_batch, "{test}");
        }
        criterion.bench_function(&format!("low-batch/{test}/n=64"), |bencher| {
            bencher.iter(|| case.low.simulate_currents(black_box(&faults), &mut currents_a));
        });
        criterion.bench_function(&format!("low-one-by-one/{test}/n=64"), |bencher| {
            bencher.iter(|| {
                for faults in black_box(&faults) {
                    case.low.simulate_current(faults, &mut current_a);
                }
            });
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = simulate, batches
}
criterion_main!(benches);
