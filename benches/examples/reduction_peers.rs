//! Timings of the reduction crate for `benches/peers/reduction/compare.sh`, which
//! runs the peers in the same way: one warm-up, then as many runs as said, time on
//! the processor in milliseconds (from `/proc/thread-self/schedstat`, so that what
//! else runs on the machine counts little), `job shape runs minimum median` a line
//! on stdout. With the argument `leading` only the singular values, with the least and
//! the median wall time before the least time on the processor.

#![expect(clippy::print_stdout, reason = "its output is what it is for")]
#![expect(clippy::disallowed_methods, reason = "it measures time")]

use std::{hint::black_box, time::Instant};

use anyhow::{Context, Result};
use fdi_benches::reduce::{samples, waves};
use reduction::{
    Dmd, DmdConfig, DmdKind, Grid, RankRule, Som, SomConfig, SomStart, Training, leading_svd,
    randomised_svd, thin_svd,
};

fn main() -> Result<()> {
    if std::env::args().nth(1).as_deref() == Some("leading") {
        return leading();
    }
    for (rows, runs) in [(5000, 15), (20_000, 7)] {
        let snapshots = waves(rows, 100)?;
        let shape = format!("{rows}x100");
        time("thin-svd", &shape, runs, || thin_svd(&snapshots).is_ok())?;
        time("randomised-svd-30", &shape, runs, || {
            randomised_svd(&snapshots, &reduction::RandomisedConfig::default()).is_ok()
        })?;
        time("leading-svd-30", &shape, runs, || leading_svd(&snapshots, 30).is_ok())?;
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

/// All singular values and the leading thirty, for `benches/peers/reduction/leading.sh`.
fn leading() -> Result<()> {
    for (rows, runs) in [(5000, 9), (20_000, 5)] {
        let snapshots = waves(rows, 100)?;
        let shape = format!("{rows}x100");
        both_clocks("thin-svd", &shape, runs, || thin_svd(&snapshots).is_ok())?;
        both_clocks("leading-svd-30", &shape, runs, || leading_svd(&snapshots, 30).is_ok())?;
    }
    Ok(())
}

fn both_clocks(job: &str, shape: &str, runs: usize, work: impl Fn() -> bool) -> Result<()> {
    assert!(work(), "{job} failed");
    let (mut wall, mut spent) = (Vec::with_capacity(runs), Vec::with_capacity(runs));
    for _ in 0..runs {
        let (start, begun) = (Instant::now(), processor_ms()?);
        assert!(black_box(work()), "{job} failed");
        wall.push(start.elapsed().as_secs_f64() * 1e3);
        spent.push(processor_ms()? - begun);
    }
    wall.sort_by(f64::total_cmp);
    spent.sort_by(f64::total_cmp);
    println!("{job} {shape} {runs} {:.3} {:.3} {:.3}", wall[0], wall[runs / 2], spent[0]);
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
