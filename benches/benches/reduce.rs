//! Singular values, dynamic modes and maps; ids carry the shapes.

use std::{hint::black_box, time::Duration};

use criterion::{Criterion, criterion_group, criterion_main};
use fdi_benches::reduce::{samples, waves};
use reduction::{
    Dmd, DmdConfig, DmdKind, Grid, RandomisedConfig, RankRule, Som, SomConfig, Training,
    randomised_svd, thin_svd,
};

fn decompositions(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("reduce");
    group.sample_size(10).measurement_time(Duration::from_secs(3));
    for rows in [5000, 20_000] {
        let snapshots = waves(rows, 100).expect("the case has rows and columns");
        let exact = DmdConfig { rank: RankRule::Fixed(30), kind: DmdKind::Exact };
        let projected = DmdConfig { kind: DmdKind::Projected, ..exact };
        let random = RandomisedConfig::default();

        let direct = thin_svd(&snapshots).expect("the case converges");
        let fast = randomised_svd(&snapshots, &random).expect("the case converges");
        let first = direct.singular_values()[0];
        assert!((fast.singular_values()[0] - first).abs() < 1e-9 * first);
        assert_eq!(Dmd::fit(&snapshots, &exact).expect("the case converges").rank(), 30);

        group.bench_function(format!("thin-svd/{rows}x100"), |bencher| {
            bencher.iter(|| black_box(thin_svd(&snapshots).is_ok()));
        });
        group.bench_function(format!("randomised-svd/rank=30/{rows}x100"), |bencher| {
            bencher.iter(|| black_box(randomised_svd(&snapshots, &random).is_ok()));
        });
        group.bench_function(format!("dmd/exact/rank=30/{rows}x100"), |bencher| {
            bencher.iter(|| black_box(Dmd::fit(&snapshots, &exact).is_ok()));
        });
        group.bench_function(format!("dmd/projected/rank=30/{rows}x100"), |bencher| {
            bencher.iter(|| black_box(Dmd::fit(&snapshots, &projected).is_ok()));
        });
    }
    group.finish();
}

fn maps(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("reduce");
    group.sample_size(10).measurement_time(Duration::from_secs(3));
    let samples = samples(5000, 31).expect("the case has rows and columns");
    let online = SomConfig { grid: Grid::rectangular(6, 5), ..SomConfig::default() };
    let batch = SomConfig { training: Training::Batch, ..online.clone() };
    for (name, config) in [("online", online), ("batch", batch)] {
        let map = Som::fit(&samples, &config).expect("the case trains");
        let error = map.quantisation_error(&samples).expect("the features agree");
        assert!(error.is_finite() && error > 0.0);
        group.bench_function(format!("som/{name}/5000x31/neurons=30/epochs=100"), |bencher| {
            bencher.iter(|| black_box(Som::fit(&samples, &config).is_ok()));
        });
    }
    group.finish();
}

criterion_group!(benches, decompositions, maps);
criterion_main!(benches);
