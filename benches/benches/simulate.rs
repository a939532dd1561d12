//! One run of each simulator: `cargo bench -p fdi-benches --bench simulate`.

use std::{hint::black_box, time::Duration};

use criterion::{Criterion, criterion_group, criterion_main};
use ema_sim::{LowFidelity, PhysicalFaults};
use fdi_benches::simulate::{batch, cases, with_each_effect};

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

/// Sixteen fault vectors with one effect in low fidelity, side by side and one by one.
fn effects(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("low-effect");
    group.warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_secs(1));
    let faults = batch(16);
    for (id, model) in with_each_effect().expect("valid effects") {
        let tests: Vec<(&LowFidelity, &PhysicalFaults)> =
            faults.iter().map(|faults| (&model, faults)).collect();
        let (mut currents_a, mut current_a) = (Vec::new(), Vec::new());
        LowFidelity::simulate_tests(&tests, &mut currents_a);
        for (faults, together) in faults.iter().zip(&currents_a) {
            model.simulate_current(faults, &mut current_a);
            let same =
                current_a.iter().map(|x| x.to_bits()).eq(together.iter().map(|x| x.to_bits()));
            assert!(same, "{id:?}");
        }
        group.bench_function(format!("{}/side-by-side", id.info().symbol), |bencher| {
            bencher.iter(|| LowFidelity::simulate_tests(black_box(&tests), &mut currents_a));
        });
        group.bench_function(format!("{}/one-by-one", id.info().symbol), |bencher| {
            bencher.iter(|| {
                for faults in black_box(&faults) {
                    model.simulate_current(faults, &mut current_a);
                }
            });
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = simulate, batches, effects
}
criterion_main!(benches);
