//! The balance of torques: the drive signal against what the measured motion asks for.

use ema_sim::MotionTerm;

use super::{
    regression::{Estimate, Regression, least},
    shift::shifted,
    view::{BLOCK_S, MOST_SHIFT_S, View},
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
/// Share of the drive's energy up to which a balance says something.
const MOST_LEFT: f64 = 0.3;

/// The equation of motion of a recording, with numbers of its own:
///
/// ```text
/// u = (M·a + d·v + F·tanh(v/v₀) + d'·|v| + F₀ + g·load)/c
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
    block: usize,
    fit: Regression,
    /// Inertia over that of the model file.
    pub(super) inertia: Estimate,
    /// Dry friction, in the unit of the drive.
    dry: Estimate,
    /// Dry friction over that of the model file; `None` where that has none.
    pub(super) friction_ratio: Option<f64>,
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
        let load = view.record.load.as_ref().map(|load| smoothed(load, reach));
        for more in [Some(along(&f64::abs)), load.as_ref().map(|load| of(&|n| load[n]))] {
            columns.extend(more.filter(|column| is_apart(column)));
        }
        let signal = of(&|n| drive[n]);
        let block = (libm::round(BLOCK_S * rate_hz / stride as f64) as usize).max(1);
        let fit = Regression::of(&signal, &columns, block)?;
        let inertia = fit.estimate(0).scaled(machine.constant() / machine.inertia());
        let dry = fit.estimate(2);
        let of_file = machine.motion_number(MotionTerm::KineticFriction).filter(|f| *f > 0.0);
        let friction_ratio = of_file.map(|file| dry.value * machine.constant() / file);
        Some(Self {
            columns,
            drive,
            rate_hz,
            stride,
            from,
            block,
            fit,
            inertia,
            dry,
            friction_ratio,
        })
    }

    /// Tells whether the equation explains the drive well enough to judge by it.
    pub(super) fn says_something(&self) -> bool {
        self.fit.left < MOST_LEFT
    }

    /// Tells whether inertia and dry friction have the wrong sign.
    pub(super) fn is_turned(&self, chance: f64) -> bool {
        self.says_something() && self.inertia.is_negative(chance) && self.dry.value < 0.0
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
        Regression::of(&signal, &self.columns, self.block).map_or(1.0, |fit| fit.left)
    }

    /// Share left as it is.
    pub(super) fn left(&self) -> f64 {
        self.fit.left
    }

    /// By how much the drive is late against the motion, with the share left then. The standard
    /// deviation counts a block as one sample.
    pub(super) fn late_s(&self) -> (Estimate, f64) {
        let at = least([-MOST_SHIFT_S, MOST_SHIFT_S], 50, 1e-4, |late_s| self.left_if_late(late_s));
        let left = self.left_if_late(at);
        let step = 2e-3;
        let bend = (self.left_if_late(at - step) + self.left_if_late(at + step) - 2.0 * left)
            / (step * step);
        let blocks = self.columns[0].len() as f64 / self.block as f64;
        let std = libm::sqrt(2.0 * left / bend.max(f64::MIN_POSITIVE) / blocks);
        let degrees = self.columns[0].len() as f64;
        (Estimate { value: at, std, degrees }, left)
    }
}

/// Tells whether a column is none of a constant.
fn is_apart(column: &[f64]) -> bool {
    let size: f64 = column.iter().map(|x| x * x).sum();
    super::regression::spread(column) > 1e-6 * size
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
