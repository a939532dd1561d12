//! Timings of the reduction crate for `benches/peers/reduction/compare.sh`, which
//! runs the peers in the same way: one warm-up, then as many runs as said, time on
//! the processor in milliseconds (from `/proc/thread-self/schedstat`, so that what
//! else runs on the machine counts little), `job shape runs minimum median` a line
//! on stdout.

#![expect(clippy::print_stdout, reason = "its output is what it is for")]

use std::hint::black_box;

use anyhow::{Context, Result};
use fdi_benches::reduce::{samples, waves};
use reduction::{
    Dmd, DmdConfig, DmdKind, Grid, RankRule, Som, SomConfig, SomStart, Training, randomised_svd,
    thin_svd,
};

fn main() -> Result<()> {
    for (rows, runs) in [(5000, 15), (20_000, 7)] {
        let snapshots = waves(rows, 100)?;
        let shape = format!("{rows}x100");
        time("thin-svd", &shape, runs, || thin_svd(&snapshots).is_ok())?;
        time("randomised-svd-30", &shape, runs, || {
            randomised_svd(&snapshots, &reduction::RandomisedConfig::default()).is_ok()
        })?;
        for (name, kind) in
            [("exact-dmd-30", DmdKind::Exact), ("projected-dmd-30", DmdKind::Projected)]
        {
            let config = DmdConfig { rank: RankRule::Fixed(30), kind };
            time(name, &shape, runs, || Dmd::fit(&snapshots, &config).is_ok())?;
        }
    }
    let samples = samples(5000, 31)?;
    let online = SomConfig { grid: Grid::rectangular(6, 5), ..SomConfig::default() };
    let batch =
        SomConfig { training: Training::Batch, start: SomStart::RandomSamples, ..online.clone() };
    time("som-online-100-epochs", "5000x31", 5, || Som::fit(&samples, &online).is_ok())?;
    time("som-batch-100-epochs", "5000x31", 5, || Som::fit(&samples, &batch).is_ok())?;
    Ok(())
}

fn time(job: &str, shape: &str, runs: usize, mut work: impl FnMut() -> bool) -> Result<()> {
    assert!(work(), "{job} failed");
    let mut spent = Vec::with_capacity(runs);
    for _ in 0..runs {
        let start = processor_ms()?;
        assert!(black_box(work()), "{job} failed");
        spent.push(processor_ms()? - start);
    }
    spent.sort_by(f64::total_cmp);
    println!("{job} {shape} {runs} {:.3} {:.3}", spent[0], spent[runs / 2]);
    Ok(())
}

/// Time that this thread has been running. Giving way first makes the scheduler
/// bring its account up to date, which it otherwise does every few milliseconds.
fn processor_ms() -> Result<f64> {
    std::thread::yield_now();
    let text = std::fs::read_to_string("/proc/thread-self/schedstat")?;
    let nanoseconds: f64 = text.split(' ').next().context("schedstat is empty")?.parse()?;
    Ok(nanoseconds * 1e-6)
}
