//! Remainder of a recording, described: fit, whiteness, and which coordinate it follows.

use ema_sim::MachineSignals;
use inference::{Whitener, ljung_box_chance, rms};

use crate::{
    error::GreyboxError,
    machine::{Machine, State},
    problem::{PerRecord, Prepared, Problem},
};

/// How well a recording is explained.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordFit {
    /// Name of the recording.
    pub record: String,
    /// Root mean square of measured less predicted.
    pub rms: f64,
    /// `100·(1 − |residual|/|measured − mean|)`.
    pub fit_percent: f64,
    /// Chance of as much correlation in white noise (Ljung and Box 1978, 20 lags, of the
    /// residual through the noise's own whitener).
    pub whiteness_p: f64,
}

/// The fits of the recordings of a problem with these residuals.
pub(crate) fn record_fits(
    problem: &Problem<'_>,
    residuals: &PerRecord,
    whitener: &Whitener,
) -> Vec<RecordFit> {
    let of = |(prepared, residual): (&Prepared<'_>, &Vec<f64>)| {
        let measured = &prepared.averaged;
        let plain = prepared.in_its_unit(residual);
        let mean = measured.iter().sum::<f64>() / measured.len().max(1) as f64;
        let spread: Vec<f64> = measured.iter().map(|y| y - mean).collect();
        RecordFit {
            record: prepared.record.name.clone(),
            rms: rms(&plain),
            fit_percent: 100.0 * (1.0 - rms(&plain) / rms(&spread).max(f64::MIN_POSITIVE)),
            whiteness_p: ljung_box_chance(&whitener.apply(residual)),
        }
    };
    problem.records.iter().zip(residuals).map(of).collect()
}

/// Share of a residual that follows a coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct CoordinateShare {
    /// `time`, `speed`, `motor-angle`, `position`, `drive` or `load`.
    pub coordinate: &'static str,
    /// Share of the variance, beyond chance, that means over bins of the coordinate explain.
    pub share: f64,
}

/// Description of what is left of the recordings fitted.
#[non_exhaustive]
#[derive(Clone, Debug, PartialEq)]
pub struct Remainder {
    /// Share of the residual's variance beyond chance that each coordinate explains alone,
    /// largest first.
    pub shares: Vec<CoordinateShare>,
    /// Mean residual over bins of the leading coordinate.
    pub curve: Vec<[f64; 2]>,
    /// Fourth moment over the square of the second: 3 for normal noise.
    pub kurtosis: f64,
}

/// Bins of a coordinate.
const BINS: usize = 16;

/// Describes what is left of recordings in a state.
pub(crate) fn remainder(
    machine: &Machine,
    problem: &Problem<'_>,
    state: &State,
) -> Result<Remainder, GreyboxError> {
    let predictions = problem.predictions(state)?;
    let mut residual = Vec::new();
    let mut coordinates: Vec<(&'static str, Vec<f64>)> =
        NAMES.map(|name| (name, Vec::new())).into();
    for (prepared, prediction) in problem.records.iter().zip(&predictions) {
        let drive = prepared.moved(prepared.reduce(&prediction.drive));
        residual.extend(prepared.averaged.iter().zip(&drive).map(|(y, s)| y - s));
        for ((_, all), values) in
            coordinates.iter_mut().zip(coordinates_of(machine, prepared, prediction))
        {
            all.extend(values);
        }
    }
    let mut shares: Vec<(usize, f64, Vec<[f64; 2]>)> = coordinates
        .iter()
        .enumerate()
        .map(|(place, (_, values))| {
            let (share, curve) = explained_by(values, &residual);
            (place, share, curve)
        })
        .collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    let curve = shares.first().map_or_else(Vec::new, |(_, _, curve)| curve.clone());
    let share = |(place, share, _): &(usize, f64, Vec<[f64; 2]>)| CoordinateShare {
        coordinate: coordinates[*place].0,
        share: *share,
    };
    let shares = shares.iter().map(share).collect();
    let second = residual.iter().map(|x| x * x).sum::<f64>() / residual.len().max(1) as f64;
    let fourth = residual.iter().map(|x| x * x * x * x).sum::<f64>() / residual.len().max(1) as f64;
    Ok(Remainder { shares, curve, kurtosis: fourth / (second * second).max(f64::MIN_POSITIVE) })
}

/// The coordinates.
pub(crate) const NAMES: [&str; 6] = ["time", "speed", "motor-angle", "position", "drive", "load"];

/// Each coordinate over the samples of all recordings in a state.
pub(crate) fn along_coordinates(
    machine: &Machine,
    problem: &Problem<'_>,
    state: &State,
) -> Result<[Vec<f64>; NAMES.len()], GreyboxError> {
    let predictions = problem.predictions(state)?;
    let mut all = NAMES.map(|_| Vec::new());
    for (prepared, prediction) in problem.records.iter().zip(&predictions) {
        for (all, values) in all.iter_mut().zip(coordinates_of(machine, prepared, prediction)) {
            all.extend(values);
        }
    }
    Ok(all)
}

fn coordinates_of(
    machine: &Machine,
    prepared: &Prepared<'_>,
    prediction: &MachineSignals,
) -> [Vec<f64>; NAMES.len()] {
    let samples = prediction.drive.len();
    let time: Vec<f64> = (0..samples).map(|n| n as f64 / prepared.record.rate_hz).collect();
    let turn = machine.current_period_rad();
    let angle: Vec<f64> =
        prediction.motor.iter().map(|a| a - turn * libm::floor(a / turn)).collect();
    let none = vec![0.0; samples];
    let load = prepared.record.load.as_ref().unwrap_or(&none);
    [&time, &prediction.speed, &angle, &prediction.surface, &prediction.drive, load]
        .map(|signal| prepared.average(signal))
}

/// Share of the variance that means over bins explain, less what chance does; and the means.
fn explained_by(coordinate: &[f64], residual: &[f64]) -> (f64, Vec<[f64; 2]>) {
    let mut order: Vec<usize> = (0..residual.len()).collect();
    order.sort_by(|a, b| coordinate[*a].total_cmp(&coordinate[*b]));
    let total: f64 = residual.iter().map(|x| x * x).sum();
    let (least, most) = match (order.first(), order.last()) {
        (Some(&a), Some(&b)) if coordinate[b] > coordinate[a] => (coordinate[a], coordinate[b]),
        _ => return (0.0, Vec::new()),
    };
    let mut sums = [(0.0, 0.0_f64); BINS];
    for &place in &order {
        let share = (coordinate[place] - least) / (most - least);
        let bin = ((share * BINS as f64) as usize).min(BINS - 1);
        sums[bin].0 += residual[place];
        sums[bin].1 += 1.0;
    }
    let explained: f64 = sums.iter().filter(|s| s.1 > 0.0).map(|(sum, n)| sum * sum / n).sum();
    let by_chance = BINS as f64 / residual.len().max(1) as f64;
    let width = (most - least) / BINS as f64;
    let centre = |bin: usize| least + (bin as f64 + 0.5) * width;
    let curve = sums
        .iter()
        .enumerate()
        .filter(|(_, (_, n))| *n > 0.0)
        .map(|(bin, (sum, n))| [centre(bin), sum / n])
        .collect();
    ((explained / total.max(f64::MIN_POSITIVE) - by_chance).max(0.0), curve)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_residual_follows_its_own_coordinate() {
        let coordinate: Vec<f64> = (0..4000).map(|n| libm::sin(0.01 * f64::from(n))).collect();
        let other: Vec<f64> = (0..4000).map(|n| libm::sin(0.037 * f64::from(n))).collect();
        let residual: Vec<f64> = coordinate.iter().map(|x| x * x - 0.5).collect();
        assert!(explained_by(&coordinate, &residual).0 > 0.95);
        assert!(explained_by(&other, &residual).0 < 0.1);
    }
}
