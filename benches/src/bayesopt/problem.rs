//! The parts of an inverse problem.

use gp_bayesopt::Bounds;

/// Inputs are sought whose simulated record is that of a hidden truth.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Name of the problem.
    pub name: &'static str,
    /// The box that is searched.
    pub bounds: Bounds,
    /// The simulator.
    pub simulate: fn(&[f64]) -> Vec<f64>,
    /// Hidden truths, one for each seed.
    pub truths: Vec<Vec<f64>>,
    /// The point that a user would start from.
    pub nominal: Vec<f64>,
    /// Exponents and extent of the scaled Latin hypercube around the lower
    /// limits that a user who expects small values would draw; an extent of 1
    /// and exponent of 1 is the whole interval.
    pub near: Vec<(f64, f64)>,
    /// Coordinates without seams, in which a local solver works.
    pub chart: Chart,
}

/// Coordinates of a local solver.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Box of the coordinates.
    pub bounds: Bounds,
    /// The point of the problem's box for some coordinates.
    pub to_point: fn(&[f64]) -> Vec<f64>,
    /// The coordinates where the solver starts.
    pub start: Vec<f64>,
}

impl Chart {
    /// The box itself, from a start.
    pub fn identity(bounds: &Bounds, start: &[f64]) -> Self {
        Self { bounds: bounds.clone(), to_point: <[f64]>::to_vec, start: start.to_vec() }
    }
}

impl Problem {
    /// Error of each input relative to its truth, on circles the shorter way
    /// (FREEDOM paper, eq. 20).
    pub fn errors(&self, point: &[f64], truth: &[f64]) -> Vec<f64> {
        (0..point.len())
            .map(|i| {
                let mut error = (point[i] - truth[i]).abs();
                if self.bounds.wraps(i) {
                    let turn = self.bounds.width(i);
                    error %= turn;
                    error = error.min(turn - error);
                }
                error / truth[i].abs()
            })
            .collect()
    }
}
