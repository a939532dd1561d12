//! Purpose of the term of the current loop, shown by taking it out of the monitor.

use std::fmt::Write as _;

use anyhow::Result;
use ema_sim::{
    HighFidelity, LowFidelity, Scenario,
    presets::{BENCH, EMA_48},
};
use greybox::rms;

use super::{
    bench::signal,
    signals::{
        LEVEL, Lookup, NAMES, SETTLED_REL, base_points, combine, disagreements, figure, healthy,
        low_signal, single,
    },
};
use crate::pages::figure::Figure;

/// Loops of the monitor, Hz; the drive has the first.
const LOOPS_HZ: [f64; 5] = [1e3, 2e3, 4e3, 8e3, 16e3];
/// Steps whose central differences in k1 are compared.
const STEPS: [(f64, f64); 3] = [(1e-3, 1e-4), (3e-3, 1e-3), (1e-2, 3e-3)];
/// The shorts among the coordinates.
const SHORTS: core::ops::Range<usize> = 2..5;

pub(super) fn figures() -> Result<Vec<Figure>> {
    let mut figures = Vec::new();
    let high = HighFidelity::new(&BENCH, &Scenario::sine())?;
    let of_high = |coordinate: usize, level: f64| signal(&high, &single(coordinate, level));
    let high_zero = signal(&high, &healthy());
    let mut high_shorts = Vec::new();
    for short in SHORTS {
        high_shorts.push(combine(&of_high(short, LEVEL), &high_zero, |a, b| a - b));
    }
    for loop_hz in LOOPS_HZ {
        let mut actuator = BENCH;
        actuator.inverter.current_bandwidth_hz = loop_hz;
        let id = format!("bench/loop/{loop_hz}");
        let low = LowFidelity::new(&actuator, &Scenario::sine())?;
        let low_zero = low_signal(&low, &healthy());
        let gap = rms(&combine(&low_zero, &high_zero, |a, b| a - b)) / rms(&high_zero);
        figures.push(figure(format!("{id}/healthy-gap"), gap, SETTLED_REL, "1"));
        for (short, high) in SHORTS.zip(&high_shorts) {
            let low = combine(&low_signal(&low, &single(short, LEVEL)), &low_zero, |a, b| a - b);
            figures.extend(likeness(&format!("{id}/{}", NAMES[short]), &low, high));
        }
        let low = LowFidelity::new(&actuator, &Scenario::chirp())?;
        let all = disagreements(&|f| low_signal(&low, f), &base_points()?, 0, STEPS[0]);
        figures.push(figure(format!("{id}/k1"), all[all.len() / 2], 0.05, "1"));
    }
    for (name, actuator) in [("ema-48", &EMA_48), ("bench", &BENCH)] {
        let low = LowFidelity::new(actuator, &Scenario::chirp())?;
        for steps in STEPS {
            let all = disagreements(&|f| low_signal(&low, f), &base_points()?, 0, steps);
            let above = all.iter().filter(|off| **off > 0.02).count() as f64;
            let id = format!("{name}/k1/{}", steps.0);
            figures.push(figure(format!("{id}/median"), all[all.len() / 2], 0.05, "1"));
            figures.push(figure(format!("{id}/above"), above, SETTLED_REL, "1"));
        }
    }
    Ok(figures)
}

/// Cosine and magnitude of a monitor's signature against the reference's.
fn likeness(id: &str, low: &[f64], high: &[f64]) -> [Figure; 2] {
    let dot = low.iter().zip(high).map(|(a, b)| a * b).sum::<f64>() / high.len() as f64;
    [
        figure(format!("{id}/cosine"), dot / (rms(low) * rms(high)), SETTLED_REL, "1"),
        figure(format!("{id}/magnitude"), rms(low) / rms(high), SETTLED_REL, "1"),
    ]
}

pub(super) fn text(page: &mut String, f: &Lookup<'_>) -> Result<()> {
    page.push_str(include_str!("limits.md"));
    writeln!(
        page,
        "Reference: high fidelity, loop of 1 kHz; signatures on the sine, smoothness of k1 on the chirp (central differences at\n\
         1e-3 and 1e-4, median of 20 base points).\n\n\
         | monitor's loop kHz | healthy gap % | k3: cosine | magnitude | k4: cosine | magnitude | k5: cosine | magnitude | smoothness of k1 % |\n\
         |--:|--:|--:|--:|--:|--:|--:|--:|--:|"
    )?;
    for loop_hz in LOOPS_HZ {
        let id = format!("bench/loop/{loop_hz}");
        write!(page, "| {} | {:.2} |", loop_hz / 1e3, f.percent(&format!("{id}/healthy-gap"))?)?;
        for name in &NAMES[SHORTS] {
            let at = |what: &str| f.get(&format!("{id}/{name}/{what}"));
            write!(page, " {:.4} | {:.4} |", at("cosine")?, at("magnitude")?)?;
        }
        writeln!(page, " {:.2} |", f.percent(&format!("{id}/k1"))?)?;
    }
    writeln!(
        page,
        "\n**k3 to k5.** In the rotor's axes a short of k in phase j adds the voltage e = k/3·(k_p·ω + R·I)·(cos 2(P·θ − δ_j) − 1): at the sine's\n\
         peak speed 63 mV at 95 Hz, of which a loop of 1 kHz lets 88 mA/V through.\n\n\
         **k1.** The cascade holds its set-point for a tick of 0.1 ms. Where the current steps to it, a shaft at rest breaks away\n\
         at a tick, and as k1 grows that tick changes by one; where the current rises through the static friction, the instant moves with k1. EMA-48's\n\
         monitor has no loop, and its median falls on the other side by chance. A step of 1e-2 holds a few of its jumps and spreads them:\n\n\
         | steps compared | EMA-48: median % | base points above 2 % | bench: median % | base points above 2 % |\n|---|--:|--:|--:|--:|"
    )?;
    for (wide, narrow) in STEPS {
        let at = |name: &str, what: &str| f.get(&format!("{name}/k1/{wide}/{what}"));
        writeln!(
            page,
            "| {wide:.0e} and {narrow:.0e} | {:.2} | {:.0} of 20 | {:.2} | {:.0} of 20 |",
            100.0 * at("ema-48", "median")?,
            at("ema-48", "above")?,
            100.0 * at("bench", "median")?,
            at("bench", "above")?,
        )?;
    }
    Ok(())
}
