//! Streams 20 000 × 5 000 snapshots that are never held together, says what
//! memory that took, then holds them and compares with the direct decomposition.
//!
//! The peak of resident memory is read from `/proc/self/status` before the direct
//! decomposition starts. Arguments: locations, snapshots (default as above).

#![expect(clippy::print_stdout, reason = "its output is what it is for")]
#![expect(clippy::disallowed_methods, reason = "it measures time")]

use std::time::Instant;

use anyhow::{Context, Result};
use reduction::{Matrix, Snapshots, StreamingConfig, StreamingSvd, thin_svd};

const WAVES: usize = 24;
/// Snapshots that are made at a time.
const BLOCK: usize = 100;

struct Source {
    locations: usize,
    count: usize,
    shapes: Matrix,
}

impl Source {
    fn new(locations: usize, count: usize) -> Result<Self> {
        let shapes = Matrix::from_fn(locations, 2 * WAVES, |row, column| {
            let (x, k) = (row as f64 / locations as f64, (column / 2 + 1) as f64);
            let phase = 6.0 * k * x + k * k;
            0.8_f64.powf(k) * if column % 2 == 0 { phase.sin() } else { phase.cos() }
        })?;
        Ok(Self { locations, count, shapes })
    }

    /// Decaying waves over pseudo-noise of 10⁻⁶.
    fn block(&self, first: usize) -> Result<Snapshots> {
        let width = BLOCK.min(self.count - first);
        let course = Matrix::from_fn(2 * WAVES, width, |row, column| {
            let (t, k) = ((first + column) as f64 / self.count as f64, (row / 2 + 1) as f64);
            let phase = 11.0 * k * t;
            if row % 2 == 0 { phase.cos() } else { phase.sin() }
        })?;
        let mut values = self.shapes.times(&course).into_values();
        for (at, value) in values.iter_mut().enumerate() {
            let (row, column) =
                ((at % self.locations) as f64, (first + at / self.locations) as f64);
            *value += 1e-6 * (12.9898 * row + 78.233 * column + 0.37 * row * column).sin();
        }
        Ok(Snapshots::from_column_major(self.locations, width, values)?)
    }
}

fn main() -> Result<()> {
    let mut sizes = std::env::args().skip(1).map(|size| size.parse::<usize>());
    let locations = sizes.next().transpose()?.unwrap_or(20_000);
    let count = sizes.next().transpose()?.unwrap_or(5_000);
    let source = Source::new(locations, count)?;

    let start = Instant::now();
    let mut stream = StreamingSvd::new(StreamingConfig { rank: 60, block: 100 })?;
    for first in (0..count).step_by(BLOCK) {
        stream.push(&source.block(first)?)?;
    }
    let streamed = stream.finish()?;
    println!("shape {locations}x{count}");
    println!("stream-seconds {:.1}", start.elapsed().as_secs_f64());
    println!("stream-peak-mib {:.0}", peak_mib()?);
    println!("dropped {:.3e}", streamed.dropped());
    let bound = (0..30).filter_map(|index| streamed.mode_error(index)).fold(0.0, f64::max);
    println!("worst-mode-bound-30 {bound:.3e}");

    let start = Instant::now();
    let mut values = Vec::with_capacity(locations * count);
    for first in (0..count).step_by(BLOCK) {
        values.extend_from_slice(source.block(first)?.matrix().values());
    }
    let direct = thin_svd(&Snapshots::from_column_major(locations, count, values)?)?;
    println!("direct-seconds {:.1}", start.elapsed().as_secs_f64());
    println!("direct-peak-mib {:.0}", peak_mib()?);
    let (mut worst_value, mut worst_mode) = (0.0_f64, 0.0_f64);
    for index in 0..30 {
        let (found, true_value) =
            (streamed.singular_values()[index], direct.singular_values()[index]);
        worst_value = worst_value.max((found - true_value).abs() / true_value);
        let pairs = streamed.left().column(index).iter().zip(direct.left().column(index));
        let chord = pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        worst_mode = worst_mode.max(chord);
    }
    println!("sigma-30-over-1 {:.3e}", direct.singular_values()[29] / direct.singular_values()[0]);
    println!("worst-value-rel-30 {worst_value:.3e}");
    println!("worst-mode-30 {worst_mode:.3e}");
    Ok(())
}

fn peak_mib() -> Result<f64> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).context("no VmHWM line")?;
    let kib: f64 = line.split_whitespace().nth(1).context("no number")?.parse()?;
    Ok(kib / 1024.0)
}
