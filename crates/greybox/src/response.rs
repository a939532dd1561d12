//! Which orders, frequencies and places the residual shows: a linear picture of the loop, good
//! enough to choose shapes by.

use core::f64::consts::TAU;

use ema_sim::{CommandKind, Coordinate, Curve, CurveKind, Effect, MachineSignals};
use inference::Whitener;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use crate::{
    error::GreyboxError,
    fit::whitened,
    gram::{Gram, dot},
    hypothesis::{Leads, Scales},
    machine::State,
    plausible::{is_of_command, most_shown_hz},
    problem::{PerRecord, Prepared, Problem},
    random::normal,
};

/// Taps of the loop's answer to a torque.
const TAPS: usize = 40;
/// Largest order of the motor's angle looked at.
const MOST_ORDER: u32 = 144;
/// Lowest orders of an error of the position that are tried whatever the residual shows.
const LOWEST_ORDERS: usize = 3;
/// Frequencies looked at go up by this share of the resolution of the longest recording.
const FREQUENCY_STEP: f64 = 0.7;
/// Largest frequency looked at, Hz.
const MOST_HZ: f64 = 60.0;
/// Frequencies among which those of the command are passed over.
const MOST_TONES: usize = 8;
const REGIONS: usize = 16;
/// Orders, frequencies or regions that are looked at together.
const TOGETHER: usize = 8;

/// Answer of the drive signal to a torque on the shaft: a filter at the compared rate,
/// learnt from a simulation under a small random torque.
fn of_torque(
    problem: &Problem<'_>,
    state: &State,
    drive: &PerRecord,
    scales: &Scales,
) -> Result<Vec<f64>, GreyboxError> {
    let Some(first) = problem.records.first() else { return Ok(vec![0.0; TAPS]) };
    let torque = shaking(first, 0.05 * scales.torque);
    let step_s = 1.0 / first.rate_hz();
    let points = torque.iter().enumerate().map(|(n, t)| [n as f64 * step_s, *t]).collect();
    let Ok(curve) = Curve::new(Coordinate::Time, CurveKind::Torque, points) else {
        return Ok(vec![0.0; TAPS]);
    };
    let mut shaken = state.clone();
    shaken.add(&Effect::tabulated(curve, problem.machine.geometry()));
    let after = problem.machine.simulate(&shaken, first.record, first.place)?;
    Ok(taps(first, &torque, &drive[0], &after.drive))
}

/// Answer of the drive signal to an error in the position that the controller is shown, learnt by
/// shaking the
/// command the other way; nothing where that is no position.
fn of_position(
    problem: &Problem<'_>,
    state: &State,
    drive: &PerRecord,
    scales: &Scales,
) -> Result<Option<Vec<f64>>, GreyboxError> {
    let Some(first) = problem.records.first() else { return Ok(None) };
    if first.record.kind != CommandKind::Position {
        return Ok(None);
    }
    let error = shaking(first, 3e-4 * scales.travel);
    let mut record = first.record.clone();
    for (n, command) in record.command.iter_mut().enumerate() {
        let (before, part) = (n / first.factor, (n % first.factor) as f64 / first.factor as f64);
        let last = error.len() - 1;
        let (a, b) = (error[before.min(last)], error[(before + 1).min(last)]);
        *command -= a + part * (b - a);
    }
    let after = problem.machine.simulate(state, &record, first.place)?;
    Ok(Some(taps(first, &error, &drive[0], &after.drive)))
}

/// A random signal with a value at each end of each averaged stretch of a recording.
fn shaking(record: &Prepared<'_>, size: f64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let samples = record.record.drive.len() / record.factor;
    (0..=samples).map(|_| size * normal(&mut random)).collect()
}

/// The filter that makes of a signal what it did to a recording's drive.
fn taps(record: &Prepared<'_>, signal: &[f64], before: &[f64], after: &[f64]) -> Vec<f64> {
    let after = record.evenly_reduced(after);
    let change: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
    // the mean of the signal over each averaged stretch, from where the comparison begins
    let mean: Vec<f64> = signal.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
    let offset = mean.len() - change.len();
    let lagged = |lag: usize| {
        let at = |n: usize| if n + offset >= lag { mean[n + offset - lag] } else { 0.0 };
        (0..change.len()).map(at).collect::<Vec<f64>>()
    };
    let mut columns: Vec<Vec<f64>> = (0..TAPS).map(lagged).collect();
    columns.push(change);
    let by: Vec<usize> = (0..TAPS).collect();
    Gram::new(&columns).explained(TAPS, &by).1
}

fn is_silent(torque: &[f64]) -> bool {
    torque.iter().all(|t| *t == 0.0)
}

/// Taps of a filter that are taken at a time.
const TAPS_AT_ONCE: usize = 4;

/// A torque, or an error of the position, through the loop.
fn through(response: &[f64], torque: &[f64]) -> Vec<f64> {
    let before = response.len() + TAPS_AT_ONCE;
    let padded = [&vec![0.0; before], torque].concat();
    let mut shown = vec![0.0; torque.len()];
    for (place, taps) in response.chunks(TAPS_AT_ONCE).enumerate() {
        let [h0, h1, h2, h3] = core::array::from_fn(|n| taps.get(n).copied().unwrap_or(0.0));
        let begin = before - (place + 1) * TAPS_AT_ONCE + 1;
        for (y, t) in shown.iter_mut().zip(padded[begin..].windows(TAPS_AT_ONCE)) {
            *y += h0 * t[3] + h1 * t[2] + h2 * t[1] + h3 * t[0];
        }
    }
    shown
}

/// A residual from which everything else that may explain it is projected off.
struct Screen<'a> {
    problem: &'a Problem<'a>,
    whitener: &'a Whitener,
    of_torque: Vec<f64>,
    of_position: Option<Vec<f64>>,
    /// Orthonormal columns of what is free.
    known: Vec<Vec<f64>>,
    residual: Vec<f64>,
}

impl Screen<'_> {
    /// Energy of the residual that the signals of each group explain together which a filter makes
    /// seen. Signals of all groups are seen side by side.
    fn energies(&self, response: &[f64], groups: Vec<Vec<PerRecord>>) -> Vec<f64> {
        let sizes: Vec<usize> = groups.iter().map(Vec::len).collect();
        let mut columns: Vec<PerRecord> = groups.into_iter().flatten().collect();
        for (place, record) in self.problem.records.iter().enumerate() {
            let mut sounding: Vec<&mut Vec<f64>> = Vec::new();
            for signal in columns.iter_mut().map(|column| &mut column[place]) {
                let is_silent = is_silent(signal);
                if !is_silent {
                    *signal = through(response, signal);
                }
                *signal = record.below_limit(core::mem::take(signal));
                if !is_silent {
                    sounding.push(signal);
                }
            }
            record.give_equal_noise(&mut sounding);
        }
        let mut columns = columns
            .iter()
            .map(|column| without(&self.known, whitened(self.whitener, column)))
            .collect::<Vec<_>>()
            .into_iter();
        let energy = |size: usize| {
            let mut own: Vec<Vec<f64>> = columns.by_ref().take(size).collect();
            own.push(self.residual.clone());
            let by: Vec<usize> = (0..size).collect();
            Gram::new(&own).explained(size, &by).0
        };
        sizes.into_iter().map(energy).collect()
    }

    /// Energies that a torque of each of some orders of the motor's angle explains, a ripple of
    /// torque, and an error of the position, where it is controlled. The orders are a `step` apart,
    /// of which the waves are given.
    fn energies_of_orders(
        &self,
        predictions: &[MachineSignals],
        step: &[Vec<(f64, f64)>],
        orders: &[f64],
    ) -> Vec<[f64; 3]> {
        let constant = self.problem.machine.constant();
        let mut waves = waves(predictions, orders[0]);
        let (mut plain, mut ripple) = (Vec::new(), Vec::new());
        for place in 0..orders.len() {
            if place > 0 {
                let steps = step.iter().flatten();
                let waves = waves.iter_mut().flatten();
                waves.zip(steps).for_each(|(wave, step)| *wave = turned(*wave, *step));
            }
            let motor = |record: usize, n: usize| constant * predictions[record].drive[n];
            plain.push(vec![
                self.torque(predictions, |record, n| waves[record][n].0),
                self.torque(predictions, |record, n| waves[record][n].1),
            ]);
            ripple.push(vec![
                self.torque(predictions, |record, n| motor(record, n) * waves[record][n].0),
                self.torque(predictions, |record, n| motor(record, n) * waves[record][n].1),
            ]);
        }
        let errors = self.of_position.as_ref().map(|filter| self.energies(filter, plain.clone()));
        let torques = self.energies(&self.of_torque, plain);
        let ripples = self.energies(&self.of_torque, ripple);
        let errors = errors.unwrap_or_else(|| torques.clone());
        (0..orders.len()).map(|n| [torques[n], ripples[n], errors[n]]).collect()
    }

    /// A torque at each sample of each recording, averaged as the signals are.
    fn torque(
        &self,
        predictions: &[MachineSignals],
        of: impl Fn(usize, usize) -> f64,
    ) -> PerRecord {
        let reduced = |(record, prepared): (usize, &Prepared<'_>)| {
            prepared.evenly_averaged_of(predictions[record].drive.len(), |n| of(record, n))
        };
        self.problem.records.iter().enumerate().map(reduced).collect()
    }
}

/// Rest of a column beside orthonormal ones.
pub(crate) fn without(known: &[Vec<f64>], mut column: Vec<f64>) -> Vec<f64> {
    for basis in known {
        let share = dot(basis, &column);
        for (x, b) in column.iter_mut().zip(basis) {
            *x -= share * b;
        }
    }
    column
}

/// Columns made orthonormal; what is left of none is dropped.
pub(crate) fn orthonormal(columns: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for column in columns {
        let before = dot(&column, &column);
        let mut rest = without(&basis, without(&basis, column));
        let size = dot(&rest, &rest);
        if size > 1e-10 * before {
            let scale = 1.0 / libm::sqrt(size);
            for x in &mut rest {
                *x *= scale;
            }
            basis.push(rest);
        }
    }
    basis
}

/// Looks for the orders, frequencies and regions that explain most of a residual.
pub(crate) fn leads(
    problem: &Problem<'_>,
    state: &State,
    residual: &PerRecord,
    known: Vec<Vec<f64>>,
    whitener: &Whitener,
    scales: &Scales,
) -> Result<Leads, GreyboxError> {
    let predictions = problem.predictions(state)?;
    let drive: PerRecord = problem
        .records
        .iter()
        .zip(&predictions)
        .map(|(prepared, prediction)| prepared.evenly_reduced(&prediction.drive))
        .collect();
    let known = orthonormal(known);
    let residual = whitened(whitener, residual);
    let screen = Screen {
        problem,
        whitener,
        of_torque: of_torque(problem, state, &drive, scales)?,
        of_position: of_position(problem, state, &drive, scales)?,
        residual: without(&known, residual),
        known,
    };
    let orders: Vec<f64> = orders(problem, &predictions);
    let step = orders.get(1).map_or(0.0, |second| second - orders[0]);
    let step = waves(&predictions, step);
    let energies: Vec<[f64; 3]> = in_groups(&orders, problem.jobs, |orders| {
        screen.energies_of_orders(&predictions, &step, orders)
    });
    let by_order = |place: usize| {
        best_of(&orders, 3, &energies.iter().map(|energy| energy[place]).collect::<Vec<_>>())
    };
    let [torque_orders, ripple_orders, error_orders] = [0, 1, 2].map(by_order);
    let longest_s = problem.records.iter().map(|r| r.record.duration_s()).fold(1.0, f64::max);
    let spacing = FREQUENCY_STEP / longest_s;
    let most_hz = MOST_HZ.min(most_shown_hz(problem));
    let count = libm::floor((most_hz - 0.5).max(0.0) / spacing) as usize;
    let frequencies: Vec<f64> = (0..count).map(|n| 0.5 + n as f64 * spacing).collect();
    let energies = in_groups(&frequencies, problem.jobs, |frequencies| {
        // a filter makes tones of the same frequency of them, with which they explain as much
        let tones = frequencies.iter().map(|&f| tones(problem, f)).collect();
        screen.energies(&[1.0], tones)
    });
    let mut frequencies_hz = best_of(&frequencies, MOST_TONES, &energies);
    frequencies_hz.retain(|&f| !is_of_command(problem, f));
    frequencies_hz.truncate(2);
    let regions = candidate_regions(&predictions);
    let of_region = |&(centre, width): &(f64, f64)| {
        vec![screen.torque(&predictions, |record, n| {
            let p = &predictions[record];
            let z = (p.surface[n] - centre) / width;
            sign(p.speed[n], scales.speed) * libm::exp(-0.5 * z * z)
        })]
    };
    let of_regions = in_groups(&regions, problem.jobs, |regions| {
        screen.energies(&screen.of_torque, regions.iter().map(of_region).collect())
    });
    let chosen = best_of(&regions, 2, &of_regions);
    Ok(Leads {
        orders: torque_orders,
        ripple_orders,
        error_orders: with_lowest(&orders, error_orders),
        orders_looked_at: orders.len() as f64,
        frequencies_hz,
        frequencies_looked_at: frequencies.len() as f64,
        regions: chosen,
        regions_looked_at: regions.len() as f64,
        speed: scales.speed,
        inertia: problem.machine.inertia(),
    })
}

/// Orders of an error of the position with the lowest of all beside them: a drive that sticks shows
/// the error where it stands and little of it on its way, which a linear picture does not see, and
/// what a shaft does wrong it does once, twice or thrice a turn most often.
fn with_lowest(orders: &[f64], mut chosen: Vec<f64>) -> Vec<f64> {
    for order in orders.iter().take(LOWEST_ORDERS) {
        if !chosen.contains(order) {
            chosen.push(*order);
        }
    }
    chosen
}

/// A tone, free in phase in each recording, at the compared rate.
fn tones(problem: &Problem<'_>, frequency_hz: f64) -> Vec<PerRecord> {
    let silent: PerRecord = problem.records.iter().map(|r| vec![0.0; r.even_samples()]).collect();
    let mut tones = Vec::new();
    for (place, prepared) in problem.records.iter().enumerate() {
        let pace = libm::sincos(TAU * frequency_hz / prepared.rate_hz());
        let waves = core::iter::successors(Some((0.0, 1.0)), |wave| Some(turned(*wave, pace)));
        let (sines, cosines) = waves.take(prepared.even_samples()).unzip();
        for wave in [sines, cosines] {
            let mut tone = silent.clone();
            tone[place] = wave;
            tones.push(tone);
        }
    }
    tones
}

/// Direction of motion, none at standstill.
fn sign(speed: f64, typical: f64) -> f64 {
    if speed.abs() < 1e-4 * typical { 0.0 } else { speed.signum() }
}

/// Scores of items that are looked at some at a time.
fn in_groups<T: Sync, S: Send>(
    items: &[T],
    jobs: usize,
    scores: impl Fn(&[T]) -> Vec<S> + Sync,
) -> Vec<S> {
    let groups: Vec<&[T]> = items.chunks(TOGETHER).collect();
    crate::parallel::map(&groups, jobs, |group| scores(group)).into_iter().flatten().collect()
}

/// Sine and cosine of an order of the motor's angle at each sample of each recording.
fn waves(predictions: &[MachineSignals], order: f64) -> Vec<Vec<(f64, f64)>> {
    let of = |p: &MachineSignals| p.motor.iter().map(|x| libm::sincos(order * x)).collect();
    predictions.iter().map(of).collect()
}

/// Sine and cosine of the sum of two angles.
fn turned((sin, cos): (f64, f64), (by_sin, by_cos): (f64, f64)) -> (f64, f64) {
    (sin * by_cos + cos * by_sin, cos * by_cos - sin * by_sin)
}

/// Items with the largest scores, best first.
fn best_of<T: Copy>(items: &[T], keep: usize, scores: &[f64]) -> Vec<T> {
    let mut order: Vec<usize> = (0..items.len()).collect();
    order.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]));
    order.into_iter().take(keep).map(|place| items[place]).collect()
}

/// Orders whose period is resolved: whole numbers of periods a turn; of a linear axis wave
/// numbers of whole periods over the travel.
fn orders(problem: &Problem<'_>, predictions: &[MachineSignals]) -> Vec<f64> {
    // of an axis one period a turn is an imbalance
    let least = if problem.machine.is_axis() { 2 } else { 1 };
    let whole = (least..=MOST_ORDER).map(f64::from);
    if problem.machine.geometry() == ema_sim::Geometry::Rotary {
        return whole.collect();
    }
    let travel = 2.0 * travel(predictions, |p| &p.surface).1;
    whole.map(|n| 4.0 * n * TAU / (4.0 * travel.max(1e-12))).collect()
}

/// Middle and half of the way that something went.
pub(crate) fn travel(
    predictions: &[MachineSignals],
    of: impl Fn(&MachineSignals) -> &Vec<f64>,
) -> (f64, f64) {
    let all = || predictions.iter().flat_map(|p| of(p).iter().copied());
    let (least, most) =
        (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    (0.5 * (least + most), 0.5 * (most - least))
}

fn candidate_regions(predictions: &[MachineSignals]) -> Vec<(f64, f64)> {
    let (middle, half) = travel(predictions, |p| &p.surface);
    let mut regions = Vec::new();
    for width in [0.05, 0.12, 0.3] {
        for n in 0..REGIONS {
            let place = (n as f64 + 0.5) / REGIONS as f64 * 2.0 - 1.0;
            regions.push((middle + half * place, 2.0 * half * width));
        }
    }
    regions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taps_taken_together_are_the_sum_of_each() {
        let torque: Vec<f64> = (0..30).map(|n| libm::sin(0.7 * f64::from(n))).collect();
        for (taps, samples) in [(1, 30), (4, 30), (7, 30), (40, 30), (8, 9), (4, 3), (8, 6)] {
            let response: Vec<f64> = (0..taps).map(|n| 1.0 / (1.0 + f64::from(n))).collect();
            let shown = through(&response, &torque[..samples]);
            for (n, y) in shown.iter().enumerate() {
                let last = n.min(response.len() - 1);
                let want: f64 = (0..=last).map(|lag| response[lag] * torque[n - lag]).sum();
                assert!((y - want).abs() < 1e-14, "{taps} taps, sample {n}: {y} {want}");
            }
        }
    }

    #[test]
    fn waves_are_turned_from_order_to_order() {
        let angle: f64 = 2.4;
        let step = libm::sincos(angle);
        let mut wave = step;
        for order in 2..=8 {
            wave = turned(wave, step);
            let (sin, cos) = libm::sincos(f64::from(order) * angle);
            assert!((wave.0 - sin).abs() + (wave.1 - cos).abs() < 1e-14, "{order}");
        }
    }
}
