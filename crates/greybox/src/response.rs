//! Which orders, frequencies and places the residual shows: a linear picture of the loop, good
//! enough to choose shapes by.

use core::f64::consts::TAU;

use ema_sim::{Coordinate, Curve, CurveKind, Effect};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use crate::{
    error::GreyboxError,
    fit::whitened,
    gram::{Gram, dot},
    hypothesis::{Leads, Scales},
    machine::{Prediction, State},
    noise::Whitener,
    problem::{PerRecord, Problem},
    random::normal,
};

/// Taps of the loop's answer to a torque.
const TAPS: usize = 40;
/// Largest order of the motor's angle looked at.
const MOST_ORDER: u32 = 144;
/// Frequencies looked at go up by this share of the resolution of the longest recording.
const FREQUENCY_STEP: f64 = 0.7;
/// Largest frequency looked at, Hz.
const MOST_HZ: f64 = 60.0;
const REGIONS: usize = 16;

/// What the drive signal does when a torque acts on the shaft: a filter at the compared rate,
/// learnt from a simulation under a small random torque.
fn response(
    problem: &Problem<'_>,
    state: &State,
    drive: &PerRecord,
    scales: &Scales,
) -> Result<Vec<f64>, GreyboxError> {
    let Some(first) = problem.records.first() else { return Ok(vec![0.0; TAPS]) };
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let samples = first.record.drive.len() / first.factor;
    let step_s = 1.0 / first.rate_hz();
    let torque: Vec<f64> =
        (0..=samples).map(|_| 0.05 * scales.torque * normal(&mut random)).collect();
    let points = torque.iter().enumerate().map(|(n, t)| [n as f64 * step_s, *t]).collect();
    let Ok(curve) = Curve::new(Coordinate::Time, CurveKind::Torque, points) else {
        return Ok(vec![0.0; TAPS]);
    };
    let mut shaken = state.clone();
    shaken.add(&Effect::tabulated(curve, problem.machine.geometry()));
    let after = problem.machine.simulate(&shaken, first.record, first.place)?;
    let after = first.reduce(&after.drive);
    let change: Vec<f64> = after.iter().zip(&drive[0]).map(|(a, b)| a - b).collect();
    // the mean of the torque over each averaged stretch, from where the comparison begins
    let offset = samples - change.len();
    let mean: Vec<f64> = torque.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
    let lagged: Vec<Vec<f64>> = (0..TAPS)
        .map(|lag| {
            (0..change.len())
                .map(|n| if n + offset >= lag { mean[n + offset - lag] } else { 0.0 })
                .collect()
        })
        .collect();
    let mut columns = lagged;
    columns.push(change);
    let by: Vec<usize> = (0..TAPS).collect();
    Ok(Gram::new(&columns).explained(TAPS, &by).1)
}

/// A torque through the loop.
fn through(response: &[f64], torque: &[f64]) -> Vec<f64> {
    (0..torque.len())
        .map(|n| response.iter().take(n + 1).enumerate().map(|(lag, h)| h * torque[n - lag]).sum())
        .collect()
}

/// A residual from which everything else that may explain it is projected off.
struct Screen<'a> {
    problem: &'a Problem<'a>,
    whitener: &'a Whitener,
    response: Vec<f64>,
    /// Orthonormal columns of what is free.
    known: Vec<Vec<f64>>,
    residual: Vec<f64>,
}

impl Screen<'_> {
    /// Energy of the residual that torques, given for each recording, explain together.
    fn energy(&self, torques: &[PerRecord]) -> f64 {
        let mut columns: Vec<Vec<f64>> = torques
            .iter()
            .map(|torque| {
                let shaken = torque.iter().map(|t| through(&self.response, t)).collect();
                without(&self.known, whitened(self.whitener, &shaken))
            })
            .collect();
        columns.push(self.residual.clone());
        let by: Vec<usize> = (0..torques.len()).collect();
        Gram::new(&columns).explained(torques.len(), &by).0
    }

    /// A torque of the trajectory, averaged as the signals are.
    fn torque(
        &self,
        predictions: &[Prediction],
        of: impl Fn(&Prediction, usize) -> f64,
    ) -> PerRecord {
        let records = self.problem.records.iter().zip(predictions);
        records
            .map(|(prepared, prediction)| {
                let full: Vec<f64> =
                    (0..prediction.drive.len()).map(|n| of(prediction, n)).collect();
                prepared.reduce(&full)
            })
            .collect()
    }
}

/// What is left of a column beside orthonormal ones.
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
    (residual, known): (&PerRecord, Vec<Vec<f64>>),
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
        response: response(problem, state, &drive, scales)?,
        residual: without(&known, residual),
        known,
    };
    let orders: Vec<f64> = orders(problem, &predictions);
    let constant = problem.machine.constant();
    let by_order = |ripple: bool| {
        best(&orders, problem.jobs, 3, |&n| {
            let factor =
                |p: &Prediction, k: usize| if ripple { constant * p.drive[k] } else { 1.0 };
            let sine = screen.torque(&predictions, |p, k| factor(p, k) * libm::sin(n * p.motor[k]));
            let cosine =
                screen.torque(&predictions, |p, k| factor(p, k) * libm::cos(n * p.motor[k]));
            screen.energy(&[sine, cosine])
        })
    };
    let longest_s = problem.records.iter().map(|r| r.record.duration_s()).fold(1.0, f64::max);
    let spacing = FREQUENCY_STEP / longest_s;
    let count = libm::floor((MOST_HZ - 0.5) / spacing) as usize;
    let frequencies: Vec<f64> = (0..count).map(|n| 0.5 + n as f64 * spacing).collect();
    let frequencies_hz =
        best(&frequencies, problem.jobs, 2, |&f| screen.energy(&tones(problem, f)));
    let regions = candidate_regions(&predictions);
    let chosen = best(&regions, problem.jobs, 2, |&(centre, width)| {
        let torque = screen.torque(&predictions, |p, k| {
            let z = (p.surface[k] - centre) / width;
            sign(p.speed[k], scales.speed) * libm::exp(-0.5 * z * z)
        });
        screen.energy(&[torque])
    });
    Ok(Leads {
        orders: by_order(false),
        ripple_orders: by_order(true),
        orders_looked_at: orders.len() as f64,
        frequencies_hz,
        frequencies_looked_at: frequencies.len() as f64,
        regions: chosen,
        regions_looked_at: regions.len() as f64,
        speed: scales.speed,
        inertia: problem.machine.inertia(),
    })
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
    let scores = crate::parallel::map(items, jobs, score);
    let mut order: Vec<usize> = (0..items.len()).collect();
    order.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]));
    order.into_iter().take(keep).map(|place| items[place]).collect()
}

/// Orders whose period is resolved: whole numbers of periods a turn; of a linear axis wave
/// numbers of whole periods over the travel.
fn orders(problem: &Problem<'_>, predictions: &[Prediction]) -> Vec<f64> {
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
    predictions: &[Prediction],
    of: impl Fn(&Prediction) -> &Vec<f64>,
) -> (f64, f64) {
    let all = || predictions.iter().flat_map(|p| of(p).iter().copied());
    let (least, most) =
        (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    (0.5 * (least + most), 0.5 * (most - least))
}

fn candidate_regions(predictions: &[Prediction]) -> Vec<(f64, f64)> {
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
