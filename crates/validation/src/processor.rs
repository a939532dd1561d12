//! Processors: threads, processor time of this process, and of a loop that it is compared with.

use std::{fs, hint::black_box, thread, time::Instant};

/// Ticks of the processor time in `/proc/self/stat`, per second: `USER_HZ` of Linux on every
/// architecture it runs on today.
const TICKS_PER_S: f64 = 100.0;
/// Numbers of the loop's vectors: within the first-level cache.
const NUMBERS: usize = 1024;
/// Rounds of the loop: some tenths of a second.
const ROUNDS: usize = 4_000_000;

/// Threads of an experiment: as many as run side by side here.
pub(crate) fn jobs() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}

/// Processor time of all threads so far, s; the time of the clock where the system has no `/proc`.
pub(crate) fn processor_s() -> f64 {
    let stat = fs::read_to_string("/proc/self/stat").ok();
    stat.as_deref().and_then(ticks).map_or_else(clock_s, |ticks| ticks / TICKS_PER_S)
}

/// User and system time of a line of `/proc/PID/stat`; the name in brackets may hold blanks.
fn ticks(stat: &str) -> Option<f64> {
    let (_, after) = stat.rsplit_once(") ")?;
    let mut fields = after.split(' ').skip(11);
    let user: f64 = fields.next()?.parse().ok()?;
    let system: f64 = fields.next()?.parse().ok()?;
    Some(user + system)
}

fn clock_s() -> f64 {
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    START.get_or_init(crate::terminal::clock).elapsed().as_secs_f64()
}

/// Processor time of the reference loop, s: multiplications and additions over a short vector with
/// a division each, as in the factors and simulations of a diagnosis.
pub(crate) fn reference_s() -> f64 {
    let start_s = processor_s();
    let mut values: Vec<f64> = (0..NUMBERS).map(|n| 1.0 + n as f64 / NUMBERS as f64).collect();
    let mut sum = 0.0;
    for round in 0..ROUNDS {
        let scale = 1.0 / (1.0 + (round % 7) as f64);
        for value in &mut values {
            *value = 0.999 * *value + scale;
        }
        sum += values[round % NUMBERS] / (1.0 + sum * sum);
    }
    black_box((values, sum));
    processor_s() - start_s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_is_read_after_the_name() {
        let stat = "1 (a) b) R 0 0 0 0 0 0 0 0 0 0 250 50 0 0 20";
        assert_eq!(ticks(stat), Some(300.0));
        assert!(processor_s() >= 0.0);
    }
}
