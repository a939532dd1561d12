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
    let after = record.reduce(after);
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

/// A torque, or an error of the position, through the loop.
fn through(response: &[f64], torque: &[f64]) -> Vec<f64> {
    let mut shown = vec![0.0; torque.len()];
    if torque.iter().all(|t| *t == 0.0) {
        return shown;
    }
    for (lag, h) in response.iter().enumerate() {
        for (y, t) in shown.iter_mut().skip(lag).zip(torque) {
            *y += h * t;
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
    /// Energy of the residual that torques, given for each recording, explain together.
    fn energy(&self, torques: &[PerRecord]) -> f64 {
        self.energy_by(&self.of_torque, torques)
    }

    /// Energy of the residual that signals explain which a filter makes seen.
    fn energy_by(&self, response: &[f64], torques: &[PerRecord]) -> f64 {
        let mut columns: Vec<Vec<f64>> = torques
            .iter()
            .map(|torque| {
                let shaken = self.problem.records.iter().zip(torque);
                let shaken =
                    shaken.map(|(record, t)| record.of_equal_noise(through(response, t))).collect();
                without(&self.known, whitened(self.whitener, &shaken))
            })
            .collect();
        columns.push(self.residual.clone());
        let by: Vec<usize> = (0..torques.len()).collect();
        Gram::new(&columns).explained(torques.len(), &by).0
    }

    /// Energy that a torque of an order of the motor's angle explains, a ripple of torque, and an
    /// error of the position, where it is controlled.
    fn energies_of_order(&self, predictions: &[MachineSignals], order: f64) -> [f64; 3] {
        let waves = |p: &MachineSignals| p.motor.iter().map(|x| libm::sincos(order * x)).collect();
        let waves: Vec<Vec<(f64, f64)>> = predictions.iter().map(waves).collect();
        let constant = self.problem.machine.constant();
        let motor = |record: usize, n: usize| constant * predictions[record].drive[n];
        let plain = [
            self.torque(predictions, |record, n| waves[record][n].0),
            self.torque(predictions, |record, n| waves[record][n].1),
        ];
        let ripple = [
            self.torque(predictions, |record, n| motor(record, n) * waves[record][n].0),
            self.torque(predictions, |record, n| motor(record, n) * waves[record][n].1),
        ];
        let torque = self.energy(&plain);
        let error =
            self.of_position.as_ref().map_or(torque, |filter| self.energy_by(filter, &plain));
        [torque, self.energy(&ripple), error]
    }

    /// A torque at each sample of each recording, averaged as the signals are.
    fn torque(
        &self,
        predictions: &[MachineSignals],
        of: impl Fn(usize, usize) -> f64,
    ) -> PerRecord {
        let reduced = |(record, prepared): (usize, &Prepared<'_>)| {
            let samples = predictions[record].drive.len();
            prepared.average(&(0..samples).map(|n| of(record, n)).collect::<Vec<_>>())
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
        .map(|(prepared, prediction)| prepared.reduce(&prediction.drive))
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
    let energies = crate::parallel::map(&orders, problem.jobs, |&order| {
        screen.energies_of_order(&predictions, order)
    });
    let by_order = |place: usize| {
        best_of(&orders, 3, &energies.iter().map(|energy| energy[place]).collect::<Vec<_>>())
    };
    let longest_s = problem.records.iter().map(|r| r.record.duration_s()).fold(1.0, f64::max);
    let spacing = FREQUENCY_STEP / longest_s;
    let most_hz = MOST_HZ.min(most_shown_hz(problem));
    let count = libm::floor((most_hz - 0.5).max(0.0) / spacing) as usize;
    let frequencies: Vec<f64> = (0..count).map(|n| 0.5 + n as f64 * spacing).collect();
    let mut frequencies_hz =
        best(&frequencies, problem.jobs, MOST_TONES, |&f| screen.energy(&tones(problem, f)));
    frequencies_hz.retain(|&f| !is_of_command(problem, f));
    frequencies_hz.truncate(2);
    let regions = candidate_regions(&predictions);
    let chosen = best(&regions, problem.jobs, 2, |&(centre, width)| {
        let torque = screen.torque(&predictions, |record, n| {
            let p = &predictions[record];
            let z = (p.surface[n] - centre) / width;
            sign(p.speed[n], scales.speed) * libm::exp(-0.5 * z * z)
        });
        screen.energy(&[torque])
    });
    Ok(Leads {
        orders: by_order(0),
        ripple_orders: by_order(1),
        error_orders: with_lowest(&orders, by_order(2)),
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
    let silent: PerRecord = problem.records.iter().map(|r| vec![0.0; r.measured.len()]).collect();
    let wave: fn(f64) -> f64 = libm::sin;
    let mut tones = Vec::new();
    for (place, prepared) in problem.records.iter().enumerate() {
        let pace = TAU * frequency_hz / prepared.rate_hz();
        for shift in [0.0, 0.25 * TAU] {
            let mut tone = silent.clone();
            tone[place] =
                (0..prepared.measured.len()).map(|n| wave(pace * n as f64 + shift)).collect();
            tones.push(tone);
        }
    }
    tones
}

/// Direction of motion, none at standstill.
fn sign(speed: f64, typical: f64) -> f64 {
    if speed.abs() < 1e-4 * typical { 0.0 } else { speed.signum() }
}

/// The items of the largest scores, best first.
fn best<T: Copy + Sync>(
    items: &[T],
    jobs: usize,
    keep: usize,
    score: impl Fn(&T) -> f64 + Sync,
) -> Vec<T> {
    best_of(items, keep, &crate::parallel::map(items, jobs, score))
}

/// Items with the largest of scores that are known.
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
