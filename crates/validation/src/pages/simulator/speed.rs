//! Cost of a run, beside other simulators on the same command.

use std::{fmt::Write as _, process::Command};

use anyhow::{Context, Result, bail};
use ema_sim::{
    FaultCoordinates, HighFidelity, LowFidelity, PhysicalFaults, Scenario,
    presets::{BENCH, EMA_48},
};

use super::signals::{Lookup, healthy, worn};
use crate::pages::bar::met;

/// Times that a batch side by side is asked to be faster than one by one.
const SIDE_BY_SIDE: f64 = 4.0;
/// States of health in a batch.
const BATCH: u32 = 64;

/// Least time of several runs, in milliseconds.
#[expect(clippy::disallowed_methods, reason = "the page quotes the simulators' cost")]
pub(super) fn least_ms(runs: usize, mut run: impl FnMut()) -> f64 {
    let time = |run: &mut dyn FnMut()| {
        let start = std::time::Instant::now();
        run();
        start.elapsed().as_secs_f64() * 1e3
    };
    (0..runs).map(|_| time(&mut run)).fold(f64::INFINITY, f64::min)
}

/// Least processor time of several runs, in milliseconds: what a long run costs on a machine that
/// has other work, which would interrupt it. Wall time where the system does not tell.
pub(super) fn least_cpu_ms(runs: usize, mut run: impl FnMut()) -> f64 {
    let spent_ms = || {
        // giving way brings the account up to date
        std::thread::yield_now();
        let account = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        Some(account.split(' ').next()?.parse::<f64>().ok()? * 1e-6)
    };
    let mut least = f64::INFINITY;
    for _ in 0..runs {
        let before = spent_ms();
        let wall_ms = least_ms(1, &mut run);
        let cpu_ms = before.zip(spent_ms()).map(|(before, after)| after - before);
        least = least.min(cpu_ms.unwrap_or(wall_ms));
    }
    least
}

pub(super) fn text(page: &mut String, f: &Lookup<'_>) -> Result<()> {
    let chirp_ms = own_text(page, f)?;
    batch_text(page)?;
    peers_text(page, chirp_ms)
}

/// The simulators' own times; returns that of the healthy high-fidelity chirp.
fn own_text(page: &mut String, f: &Lookup<'_>) -> Result<f64> {
    let (chirp, sine) = (Scenario::chirp(), Scenario::sine());
    let time_high = |scenario: &Scenario, runs, faults: PhysicalFaults| -> Result<f64> {
        let model = HighFidelity::new(&EMA_48, scenario)?;
        Ok(least_cpu_ms(runs, || drop(std::hint::black_box(model.simulate(&faults)))))
    };
    let least_chirp_ms = |faults: PhysicalFaults| -> Result<f64> {
        let model = HighFidelity::new(&EMA_48, &chirp)?;
        Ok(least_ms(300, || drop(std::hint::black_box(model.simulate(&faults)))))
    };
    let time_low = |scenario: &Scenario, runs, faults: PhysicalFaults| -> Result<f64> {
        let model = LowFidelity::new(&EMA_48, scenario)?;
        let mut current_a = Vec::new();
        Ok(least_ms(runs, || model.simulate_current(&faults, &mut current_a)))
    };
    let chirp_ms = least_chirp_ms(healthy())?;
    writeln!(
        page,
        "\n## Speed\n\n\
         One core, least of several runs when this page was written, in a release build (runs above 4 ms in processor time); the benches are\n\
         `cargo bench -p fdi-benches --bench simulate`.\n\n\
         | run | simulated | healthy | worn | bar |\n|---|--:|--:|--:|--:|\n\
         | high fidelity, chirp | 500 ms | {chirp_ms:.2} ms | {:.2} ms | 3 ms |\n\
         | low fidelity, chirp | 500 ms | {:.3} ms | {:.3} ms | 0.25 ms |\n\
         | high fidelity, sine | 5000 ms | {:.1} ms | {:.1} ms | 30 ms |\n\
         | low fidelity, sine | 5000 ms | {:.2} ms | {:.2} ms | 2.5 ms |\n\n\
         The high-fidelity chirp takes {:.0} segments of about {:.0} ns, one after the other; nothing is allocated in the loops.",
        least_chirp_ms(worn()?)?,
        time_low(&chirp, 2000, healthy())?,
        time_low(&chirp, 2000, worn()?)?,
        time_high(&sine, 10, healthy())?,
        time_high(&sine, 10, worn()?)?,
        time_low(&sine, 300, healthy())?,
        time_low(&sine, 300, worn()?)?,
        f.get("healthy/segments")?,
        1e6 * chirp_ms / f.get("healthy/segments")?,
    )?;
    Ok(chirp_ms)
}

/// Different incipient damage of each member, spread by irrational steps.
fn members() -> Vec<PhysicalFaults> {
    let steps = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0].map(f64::sqrt);
    let vector = |n: u32| steps.map(|g| 0.05 * (f64::from(n) * g).fract());
    (0..BATCH).map(|n| (&FaultCoordinates(vector(n))).into()).collect()
}

fn batch_text(page: &mut String) -> Result<()> {
    let faults = members();
    writeln!(
        page,
        "\n**Side by side.** {BATCH} states of health with levels up to 0.05, low fidelity, `simulate_currents` against\n\
         `simulate_current` one by one, each group of sixteen and each run the least of many. The results are the same bit for bit\n\
         (`property_lanes_give_the_bits_of_runs_alone_up_to_full_damage`: 200 states of health with levels up to 1; `…_on_the_bench`). Bar: {SIDE_BY_SIDE} times.\n\n\
         | batch | one by one | side by side | times | | lane-ticks with an event % |\n|---|--:|--:|--:|---|--:|"
    )?;
    for (name, actuator, scenario, rounds) in [
        ("EMA-48, chirp", &EMA_48, Scenario::chirp(), 150),
        ("EMA-48, sine", &EMA_48, Scenario::sine(), 30),
        ("bench, chirp", &BENCH, Scenario::chirp(), 60),
        ("bench, sine", &BENCH, Scenario::sine(), 25),
    ] {
        let model = LowFidelity::new(actuator, &scenario)?;
        let (alone_ms, together_ms) = compare(&model, &faults, rounds);
        let times = alone_ms / together_ms;
        writeln!(
            page,
            "| {name} | {alone_ms:.2} ms | {together_ms:.2} ms | {times:.1} | {} | {:.1} |",
            met(times >= SIDE_BY_SIDE),
            events_percent(&model, &faults),
        )?;
    }
    page.push_str(BATCHES);
    Ok(())
}

const BATCHES: &str = "
An event is a commutation, a standstill, a contact, or in the field-oriented drive a second segment in the tick (above 125 rad/s); such a lane is
finished by its own scalar run.
";

/// Least time of the members one by one, and of sixteen at a time, in turn on the same core.
fn compare(model: &LowFidelity, faults: &[PhysicalFaults], rounds: usize) -> (f64, f64) {
    let groups = faults.chunks(16);
    let (mut currents_a, mut current_a) = (vec![Vec::new(); groups.len()], Vec::new());
    let mut each_ms = vec![f64::INFINITY; faults.len()];
    let mut group_ms = vec![f64::INFINITY; groups.len()];
    // a group that takes longer than a processor stays with one task is timed by the processor
    let long = least_ms(3, || model.simulate_currents(&faults[..16], &mut currents_a[0])) > 3.0;
    for _ in 0..rounds {
        for ((group, least), currents_a) in groups.clone().zip(&mut group_ms).zip(&mut currents_a) {
            let mut run = || model.simulate_currents(group, currents_a);
            let took = if long { least_cpu_ms(1, &mut run) } else { least_ms(3, &mut run) };
            *least = least.min(took);
        }
        for (faults, least) in faults.iter().zip(&mut each_ms) {
            *least = least.min(least_ms(1, || model.simulate_current(faults, &mut current_a)));
        }
    }
    (each_ms.iter().sum(), group_ms.iter().sum())
}

/// Percentage of ticks, over all members, that took more than one segment; those at rest take none.
fn events_percent(model: &LowFidelity, faults: &[PhysicalFaults]) -> f64 {
    let (mut more, mut ticks) = (0.0, 0.0);
    for faults in faults {
        let trace = model.simulate(faults);
        let moving = trace.motor_speed_rad_per_s.iter().filter(|speed| **speed != 0.0).count();
        more += trace.segments as f64 - moving as f64;
        ticks += trace.current_a.len() as f64;
    }
    100.0 * more / ticks
}

/// The peers' times, from the script that `benches/peers/simulate` documents.
#[expect(clippy::disallowed_methods, reason = "where Python is, only the caller knows")]
fn peers_text(page: &mut String, chirp_ms: f64) -> Result<()> {
    let script = "benches/peers/simulate/time_peers.py";
    let python = std::env::var("PEERS_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let output = Command::new(&python)
        .args([script, "--runs", "1", "--tsv"])
        .current_dir(root)
        .output()
        .with_context(|| format!("run {python} {script}"))?;
    if !output.status.success() {
        bail!("{script}: {}", String::from_utf8_lossy(&output.stderr));
    }
    writeln!(
        page,
        "\n**Beside others**, the same command, machine, cascade and current loop in the same run on the same core\n\
         (`benches/peers/simulate`: what each of them does and does not do; CPU time). They have neither dry\n\
         friction nor play nor stops.\n\n\
         | simulator | chirp of 500 ms | over ours, high fidelity ({chirp_ms:.2} ms) |\n|---|--:|--:|"
    )?;
    for line in String::from_utf8(output.stdout)?.lines() {
        let fields: Vec<_> = line.split('\t').collect();
        let [case, version, cpu_ms] = fields[..] else { bail!("{script}: `{line}`") };
        if version == "-" {
            writeln!(page, "| `{case}` | not installed | |")?;
            continue;
        }
        let cpu_ms: f64 = cpu_ms.parse()?;
        writeln!(
            page,
            "| `{case}`, version {version} | {cpu_ms:.0} ms | {:.0} |",
            cpu_ms / chirp_ms
        )?;
    }
    Ok(())
}
