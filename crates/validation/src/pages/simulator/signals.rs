//! Machines, faults and signals that the parts of the simulators' page share.

use anyhow::Result;
use ema_sim::{
    Envelope, EnvelopeFilter, FaultCoordinates, HealthState, HighFidelity, LowFidelity,
    PhysicalFaults, Scenario, presets::EMA_48,
};
use greybox::rms;

use crate::pages::figure::Figure;

/// Rounding of another machine's compiler may move a figure by this much.
pub(super) const SETTLED_REL: f64 = 1e-3;
/// A figure that is itself an error may come out several times as large.
pub(super) const ERROR_REL: f64 = 10.0;
/// Fault level of a signature.
pub(super) const LEVEL: f64 = 0.05;
/// Base points at which derivatives are compared.
pub(super) const BASE_POINTS: usize = 20;
/// Coordinates of a fault vector, as the tables name them.
pub(super) const NAMES: [&str; 7] = FaultCoordinates::NAMES;

pub(super) fn figure(id: impl Into<String>, value: f64, tolerance_rel: f64, unit: &str) -> Figure {
    Figure { id: id.into(), value, tolerance_rel, unit: unit.to_owned() }
}

pub(super) fn worn() -> Result<PhysicalFaults> {
    Ok((&HealthState::new([0.04, 0.02, 0.05, 0.0, 0.03, 0.05, 0.7])?).into())
}

pub(super) fn healthy() -> PhysicalFaults {
    (&HealthState::HEALTHY).into()
}

pub(super) fn high(scenario: &Scenario) -> Result<HighFidelity> {
    Ok(HighFidelity::new(&EMA_48, scenario)?)
}

pub(super) fn low(scenario: &Scenario) -> Result<LowFidelity> {
    Ok(LowFidelity::new(&EMA_48, scenario)?)
}

/// The filtered envelope of a run.
pub(super) fn high_signal(
    model: &HighFidelity,
    faults: &PhysicalFaults,
    envelope: Envelope,
) -> Vec<f64> {
    let trace = model.simulate(faults);
    let raw = trace.envelope_a(envelope, EMA_48.motor.pole_pairs);
    EnvelopeFilter::DEFAULT.apply(&raw, trace.rate_hz)
}

pub(super) fn low_signal(model: &LowFidelity, faults: &PhysicalFaults) -> Vec<f64> {
    let trace = model.simulate(faults);
    EnvelopeFilter::DEFAULT.apply(&trace.current_a, trace.rate_hz)
}

pub(super) fn combine(a: &[f64], b: &[f64], of: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| of(*a, *b)).collect()
}

/// Distance of two signals over the size of the second.
pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    rms(&combine(a, b, |a, b| a - b)) / rms(b)
}

/// A fault vector with one coordinate at a level.
pub(super) fn single(coordinate: usize, level: f64) -> PhysicalFaults {
    let mut coordinates = [0.0; 7];
    coordinates[coordinate] = level;
    (&FaultCoordinates(coordinates)).into()
}

/// Pseudo-random base points: k1..k6 between 0.004 and 0.046, k7 anywhere.
pub(super) fn base_points() -> Result<Vec<FaultCoordinates>> {
    let mut state = 12345_u64;
    let mut uniform = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64
    };
    (0..BASE_POINTS)
        .map(|_| {
            let mut levels = [0.0; 7];
            for level in levels.iter_mut().take(6) {
                *level = 0.004 + 0.042 * uniform();
            }
            levels[6] = uniform();
            Ok(HealthState::new(levels)?.coordinates())
        })
        .collect()
}

/// Central difference of a signal along a coordinate.
pub(super) fn slope(
    signal: &dyn Fn(&PhysicalFaults) -> Vec<f64>,
    base: &FaultCoordinates,
    coordinate: usize,
    step: f64,
) -> Vec<f64> {
    let at = |by: f64| {
        let mut moved = *base;
        moved.0[coordinate] += by;
        signal(&(&moved).into())
    };
    combine(&at(step), &at(-step), |a, b| (a - b) / (2.0 * step))
}

/// Relative differences between central differences at two steps, sorted over the base points.
pub(super) fn disagreements(
    signal: &dyn Fn(&PhysicalFaults) -> Vec<f64>,
    bases: &[FaultCoordinates],
    coordinate: usize,
    (wide, narrow): (f64, f64),
) -> Vec<f64> {
    let mut all: Vec<f64> = bases
        .iter()
        .map(|base| {
            distance(
                &slope(signal, base, coordinate, narrow),
                &slope(signal, base, coordinate, wide),
            )
        })
        .collect();
    all.sort_by(f64::total_cmp);
    all
}

/// Stored figures by name.
pub(super) struct Lookup<'a>(pub(super) &'a [Figure]);

impl Lookup<'_> {
    pub(super) fn get(&self, id: &str) -> Result<f64> {
        let found = self.0.iter().find(|figure| figure.id == id);
        Ok(found.ok_or_else(|| anyhow::anyhow!("no figure `{id}`"))?.value)
    }

    pub(super) fn percent(&self, id: &str) -> Result<f64> {
        Ok(100.0 * self.get(id)?)
    }
}
