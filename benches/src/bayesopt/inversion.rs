//! The problem that the methods were developed on: seven faults of an
//! actuator-like current, thirty samples. Its reference implementation and
//! tables are in `fixtures/references/inversion/`.

use std::f64::consts::{PI, TAU};

use gp_bayesopt::Bounds;

use crate::bayesopt::{Chart, Problem};

const INSTANTS: &str = include_str!("../../../fixtures/references/inversion/instants.csv");
const TRUTHS: &str = include_str!("../../../fixtures/references/inversion/truths.csv");
const WIDE: &str = include_str!("../../../fixtures/references/inversion/wide-points.csv");
const VALUES: &str = include_str!("../../../fixtures/references/inversion/values.csv");

const DURATION_S: f64 = 0.5;
const START_HZ: f64 = 2.0;
const END_HZ: f64 = 15.0;

/// The problem with its fifty truths.
///
/// # Panics
/// When the stored tables are broken.
pub fn inversion() -> Problem {
    let bounds = Bounds::unit(7).and_then(|b| b.with_polar(5, 6)).expect("a unit cube");
    let mut lower = vec![0.0; 7];
    (lower[5], lower[6]) = (-1.0, -1.0);
    let chart = Chart {
        bounds: Bounds::new(&lower, &[1.0; 7]).expect("a box"),
        to_point: from_plane,
        start: vec![0.02, 0.02, 0.02, 0.02, 0.02, 0.01, 0.0],
    };
    let mut near = vec![(3.0, 0.3); 7];
    near[6] = (1.0, 1.0);
    Problem {
        name: "inversion",
        bounds,
        simulate,
        truths: table(TRUTHS),
        nominal: vec![0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.5],
        near,
        chart,
    }
}

/// Points and values that the reference implementation stored.
///
/// # Panics
/// When the stored tables are broken.
pub fn reference_values() -> Vec<(Vec<f64>, Vec<f64>)> {
    let points = table(TRUTHS).into_iter().chain(table(WIDE));
    points.zip(table(VALUES)).collect()
}

/// Eccentricity in the plane to amplitude and phase.
fn from_plane(z: &[f64]) -> Vec<f64> {
    let mut k = z.to_vec();
    k[5] = z[5].hypot(z[6]).min(1.0);
    k[6] = (0.5 + 0.5 * z[6].atan2(z[5]) / PI).clamp(0.0, 1.0);
    k
}

fn table(text: &str) -> Vec<Vec<f64>> {
    let number = |v: &str| v.parse().expect("a number");
    text.lines().map(|line| line.split(',').map(number).collect()).collect()
}

fn phase(t: f64) -> f64 {
    TAU * (START_HZ * t + 0.5 * (END_HZ - START_HZ) / DURATION_S * t * t)
}

/// Thirty samples of the current.
fn simulate(k: &[f64]) -> Vec<f64> {
    thread_local! {
        static AT: Vec<f64> = table(INSTANTS).concat();
    }
    AT.with(|at| at.iter().map(|&t| sample(k, t)).collect())
}

fn sample(k: &[f64], instant_s: f64) -> f64 {
    let gap = 1.0 + 99.0 * k[1];
    let t = instant_s - 1.2e-4 * gap / (1.0 + 0.02 * gap);
    let w = (START_HZ + (END_HZ - START_HZ) / DURATION_S * t) / END_HZ;
    let drive = (phase(t).cos() / 0.15).tanh();
    let motor = 9.0 * phase(t).sin() / (0.3 + w);
    let base = -phase(t).sin() * w + 0.25 + 0.30 * drive;
    let torque = base
        + 2.0 * k[0] * (0.03 * drive + 0.35 * base)
        + 0.10 * (gap / 40.0).tanh() * (2.0 * phase(t) + 0.7).sin();
    let phi = (2.0 * k[6] - 1.0) * PI;
    let short: f64 = (0..3)
        .map(|i| {
            let axis = TAU * f64::from(i) / 3.0;
            k[2 + i as usize] * 0.5 * (1.0 + 0.35 * (2.0 * (2.0 * motor - axis)).cos())
        })
        .sum();
    let ke = 1.0
        + 0.9 * short / (1.0 + 0.35 * short)
        + 0.6 * k[5] * (motor + phi).cos()
        + 0.15 * k[5] * k[5] * (2.0 * motor + 2.0 * phi).cos();
    let out = torque / ke.max(0.05);
    out + 0.15 * out * out.abs() * short
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A dozen transcendental functions, each within 1 ulp of numpy's, on
    /// arguments up to 60: a few hundred ε.
    const SAME_VALUE: f64 = 1e-12;

    #[test]
    fn versus_numpy_value_by_value() {
        let stored = reference_values();
        assert_eq!(stored.len(), 100);
        for (point, values) in stored {
            let ours = simulate(&point);
            assert_eq!(ours.len(), 30);
            for (a, b) in ours.iter().zip(&values) {
                assert!((a - b).abs() <= SAME_VALUE * b.abs().max(1.0), "{point:?}: {a} {b}");
            }
        }
    }
}
