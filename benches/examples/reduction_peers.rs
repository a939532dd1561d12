//! Timings of the reduction crate for `benches/peers/reduction/compare.sh`, which
//! runs the peers in the same way: one warm-up, then as many runs as said, wall
//! time in milliseconds, `job shape runs minimum median` a line on stdout.

#![expect(clippy::print_stdout, reason = "its output is what it is for")]
#![expect(clippy::disallowed_methods, reason = "it measures time")]

use std::{hint::black_box, time::Instant};

use anyhow::Result;
use fdi_benches::reduce::{samples, waves};
use reduction::{
    Dmd, DmdConfig, DmdKind, Grid, RankRule, Som, SomConfig, SomStart, Training, randomised_svd,
    thin_svd,
};

fn main() -> Result<()> {
    for (rows, runs) in [(5000, 15), (20_000, 7)] {
        let snapshots = waves(rows, 100)?;
        let shape = format!("{rows}x100");
        time("thin-svd", &shape, runs, || thin_svd(&snapshots).is_ok());
        time("randomised-svd-30", &shape, runs, || {
            randomised_svd(&snapshots, &reduction::RandomisedConfig::default()).is_ok()
        });
        for (name, kind) in
            [("exact-dmd-30", DmdKind::Exact), ("projected-dmd-30", DmdKind::Projected)]
        {
            let config = DmdConfig { rank: RankRule::Fixed(30), kind };
            time(name, &shape, runs, || Dmd::fit(&snapshots, &config).is_ok());
        }
    }
    let samples = samples(5000, 31)?;
    let online = SomConfig { grid: Grid::rectangular(6, 5), ..SomConfig::default() };
    let batch =
        SomConfig { training: Training::Batch, start: SomStart::RandomSamples, ..online.clone() };
    time("som-online-100-epochs", "5000x31", 5, || Som::fit(&samples, &online).is_ok());
    time("som-batch-100-epochs", "5000x31", 5, || Som::fit(&samples, &batch).is_ok());
    Ok(())
}

fn time(job: &str, shape: &str, runs: usize, mut work: impl FnMut() -> bool) {
    assert!(work(), "{job} failed");
    let mut spent: Vec<f64> = (0..runs)
        .map(|_| {
            let start = Instant::now();
            assert!(black_box(work()), "{job} failed");
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    spent.sort_by(f64::total_cmp);
    println!("{job} {shape} {runs} {:.3} {:.3}", spent[0], spent[runs / 2]);
}
