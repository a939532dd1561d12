//! The balance of torques: what drives the machine against what its measured motion asks for.

use super::{
    least_squares::{Fit, least},
    view::{MOST_SHIFT_S, View, shifted},
};
use crate::machine::Machine;

/// Rate that motion and drive are averaged down to, three times over, Hz.
const RESOLVED_HZ: f64 = 30.0;
/// Rate that a signal is worth after three averages, times their length.
const RESOLVED_TIMES_LENGTH: f64 = 0.9;
/// Rate at which the balance is sampled, Hz.
const SAMPLED_HZ: f64 = 120.0;
/// Share of the largest speed below which dry friction goes over from one direction to the other.
const CREEP: f64 = 0.01;
/// Share of the drive's energy that acceleration has to explain for the inertia to be told.
const LEAST_OWN: f64 = 0.02;
/// Share of the drive's energy up to which a balance says something.
const MOST_LEFT: f64 = 0.3;

/// The equation of motion of a recording, with numbers of its own:
///
/// ```text
/// c·u = M·a + d·v + F·tanh(v/v₀) + d'·|v| + F₀ + g·load
/// ```
///
/// Position and drive are averaged alike, so that neither is late.
#[derive(Clone, Debug)]
pub(super) struct Balance {
    columns: Vec<Vec<f64>>,
    drive: Vec<f64>,
    rate_hz: f64,
    stride: usize,
    from: usize,
    fit: Fit,
    /// Inertia over that of the model file, where acceleration shows.
    pub(super) inertia_ratio: Option<f64>,
}

impl Balance {
    /// `None` where nothing moves.
    pub(super) fn of(machine: &Machine, view: &View<'_>) -> Option<Self> {
        let rate_hz = view.rate_hz();
        let reach = (0.5 * (RESOLVED_TIMES_LENGTH * rate_hz / RESOLVED_HZ - 1.0)).max(1.0) as usize;
        let position = smoothed(view.position, reach);
        let drive = smoothed(&view.record.drive, reach);
        let stride = (rate_hz / SAMPLED_HZ).max(1.0) as usize;
        let kept = view.kept();
        let (from, last) = (kept.start.max(1), position.len() - 2);
        let places: Vec<usize> = (from..kept.end.min(last)).step_by(stride).collect();
        let of = |at: &dyn Fn(usize) -> f64| places.iter().map(|n| at(*n)).collect::<Vec<f64>>();
        let speed = of(&|n| 0.5 * (position[n + 1] - position[n - 1]) * rate_hz);
        let second = |n: usize| position[n + 1] - 2.0 * position[n] + position[n - 1];
        let acceleration = of(&|n| second(n) * rate_hz * rate_hz);
        let fastest = speed.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        if fastest <= 0.0 {
            return None;
        }
        let along = |law: &dyn Fn(f64) -> f64| speed.iter().map(|v| law(*v)).collect::<Vec<f64>>();
        let mut columns = vec![
            acceleration,
            speed.clone(),
            along(&|v| libm::tanh(v / (CREEP * fastest))),
            vec![1.0; places.len()],
        ];
        for more in [Some(along(&f64::abs)), view.record.load.as_ref().map(|load| of(&|n| load[n]))]
        {
            columns.extend(more.filter(|column| is_apart(column)));
        }
        let signal = of(&|n| drive[n]);
        let fit = Fit::new(&signal, &columns)?;
        let without = Fit::new(&signal, &columns[1..])?;
        let own = without.left - fit.left;
        let inertia = fit.coefficients[0] * machine.constant();
        let inertia_ratio = (fit.left < MOST_LEFT && own > fit.left && own > LEAST_OWN)
            .then(|| inertia / machine.inertia());
        Some(Self { columns, drive, rate_hz, stride, from, fit, inertia_ratio })
    }

    /// Share of the drive's energy that the equation leaves.
    pub(super) fn left(&self) -> f64 {
        self.fit.left
    }

    /// Tells whether the equation explains the drive well enough to judge by it.
    pub(super) fn says_something(&self) -> bool {
        self.fit.left < MOST_LEFT
    }

    /// True where dry friction and inertia have the wrong sign.
    pub(super) fn is_turned(&self) -> bool {
        self.inertia_ratio.is_some_and(|ratio| ratio < 0.0) && self.fit.coefficients[2] < 0.0
    }

    /// Share left where the drive is taken to be late by a time.
    pub(super) fn left_if_late(&self, late_s: f64) -> f64 {
        let drive = shifted(&self.drive, self.rate_hz, -late_s);
        let signal: Vec<f64> = drive[self.from..]
            .iter()
            .step_by(self.stride)
            .take(self.columns[0].len())
            .copied()
            .collect();
        Fit::new(&signal, &self.columns).map_or(1.0, |fit| fit.left)
    }

    /// By how much the drive is late against the motion, with the share left then.
    pub(super) fn late_s(&self) -> (f64, f64) {
        least(-MOST_SHIFT_S, MOST_SHIFT_S, 20, 1e-4, |late_s| self.left_if_late(late_s))
    }
}

/// Tells whether a column is none of a constant.
fn is_apart(column: &[f64]) -> bool {
    let size: f64 = column.iter().map(|x| x * x).sum();
    super::least_squares::spread(column) > 1e-6 * size
}

/// Means over as many samples before as after, three times over; over less at the ends.
fn smoothed(signal: &[f64], reach: usize) -> Vec<f64> {
    (0..3).fold(signal.to_vec(), |signal, _| averaged(&signal, reach))
}

fn averaged(signal: &[f64], reach: usize) -> Vec<f64> {
    let last = signal.len().saturating_sub(1);
    // sums from the first sample keep the digits that a difference of two of them needs
    let base = signal.first().copied().unwrap_or(0.0);
    let mut sums = Vec::with_capacity(signal.len() + 1);
    let mut sum = 0.0;
    sums.push(sum);
    for value in signal {
        sum += value - base;
        sums.push(sum);
    }
    let mean = |n: usize| {
        let reach = reach.min(n).min(last - n);
        base + (sums[n + reach + 1] - sums[n - reach]) / (2 * reach + 1) as f64
    };
    (0..signal.len()).map(mean).collect()
}
