//! Features of a point that a surrogate works on: circles unrolled, polar pairs in the plane.

use std::f64::consts::TAU;

use crate::{
    bounds::{Bounds, InputKind},
    matrix::Matrix,
};

/// The map from the unit cube to features.
///
/// ```text
/// linear    z = u
/// periodic  z = (cos 2πu, sin 2πu)/2π      chord ≈ arc for short arcs; one length scale
/// polar     z = (ρ·cos 2πu, ρ·sin 2πu)     ρ the radius; a length scale each
/// ```
#[derive(Clone, Debug)]
pub(crate) struct Features {
    blocks: Vec<Block>,
    /// Length scale of each feature.
    groups: Vec<usize>,
    scales: usize,
}

#[derive(Clone, Copy, Debug)]
enum Block {
    Linear(usize),
    Periodic(usize),
    /// Radius, angle, radius at the lower limit as a share of the interval.
    Polar(usize, usize, f64),
}

impl Features {
    pub(crate) fn new(bounds: &Bounds) -> Self {
        let (mut blocks, mut groups, mut scales) = (Vec::new(), Vec::new(), 0);
        for input in 0..bounds.dimension() {
            match bounds.kind(input) {
                InputKind::Linear => {
                    blocks.push(Block::Linear(input));
                    groups.push(scales);
                    scales += 1;
                }
                InputKind::Periodic => {
                    blocks.push(Block::Periodic(input));
                    groups.extend([scales, scales]);
                    scales += 1;
                }
                InputKind::PolarRadius { angle } => {
                    let start = bounds.lower()[input] / bounds.width(input);
                    blocks.push(Block::Polar(input, angle, start));
                    groups.extend([scales, scales + 1]);
                    scales += 2;
                }
                InputKind::PolarAngle { .. } => {}
            }
        }
        Self { blocks, groups, scales }
    }

    /// Number of features.
    pub(crate) fn len(&self) -> usize {
        self.groups.len()
    }

    /// Number of length scales.
    pub(crate) fn scales(&self) -> usize {
        self.scales
    }

    /// The length scale of each feature.
    pub(crate) fn groups(&self) -> &[usize] {
        &self.groups
    }

    /// The features of a point of the unit cube.
    pub(crate) fn of(&self, unit: &[f64]) -> Vec<f64> {
        let mut z = Vec::with_capacity(self.len());
        for block in &self.blocks {
            match *block {
                Block::Linear(i) => z.push(unit[i]),
                Block::Periodic(i) => {
                    let (sin, cos) = libm::sincos(TAU * unit[i]);
                    z.extend([cos / TAU, sin / TAU]);
                }
                Block::Polar(radius, angle, start) => {
                    let (sin, cos) = libm::sincos(TAU * unit[angle]);
                    let rho = start + unit[radius];
                    z.extend([rho * cos, rho * sin]);
                }
            }
        }
        z
    }

    /// `∂z/∂u`, features × inputs.
    pub(crate) fn jacobian(&self, unit: &[f64]) -> Matrix {
        let mut j = Matrix::zeros(self.len(), unit.len());
        let mut row = 0;
        for block in &self.blocks {
            match *block {
                Block::Linear(i) => {
                    j.set(row, i, 1.0);
                    row += 1;
                }
                Block::Periodic(i) => {
                    let (sin, cos) = libm::sincos(TAU * unit[i]);
                    j.set(row, i, -sin);
                    j.set(row + 1, i, cos);
                    row += 2;
                }
                Block::Polar(radius, angle, start) => {
                    let (sin, cos) = libm::sincos(TAU * unit[angle]);
                    let turn = TAU * (start + unit[radius]);
                    j.set(row, radius, cos);
                    j.set(row, angle, -turn * sin);
                    j.set(row + 1, radius, sin);
                    j.set(row + 1, angle, turn * cos);
                    row += 2;
                }
            }
        }
        j
    }
}
