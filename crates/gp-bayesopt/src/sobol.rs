//! The Sobol' sequence.

use crate::{
    error::DesignError,
    random::{Purpose, Stream},
};

const BITS: usize = 32;

/// Primitive polynomials and initial direction numbers of inputs 2 to 21:
/// degree, coefficients, `m_1 …`.
///
/// Source: Joe and Kuo, `new-joe-kuo-6.21201`.
const DIRECTIONS: [(usize, u32, &[u32]); 20] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
    (5, 11, &[1, 1, 5, 1, 1]),
    (5, 13, &[1, 1, 1, 3, 11]),
    (5, 14, &[1, 3, 5, 5, 31]),
    (6, 1, &[1, 3, 3, 9, 7, 49]),
    (6, 13, &[1, 1, 1, 15, 21, 21]),
    (6, 16, &[1, 3, 1, 13, 27, 49]),
    (6, 19, &[1, 1, 1, 15, 7, 5]),
    (6, 22, &[1, 3, 1, 15, 13, 25]),
    (6, 25, &[1, 1, 5, 5, 19, 61]),
    (7, 1, &[1, 3, 7, 11, 23, 15, 103]),
    (7, 4, &[1, 3, 7, 13, 13, 15, 69]),
];

/// Inputs that the table of directions reaches.
pub(crate) const MAX_INPUTS: usize = DIRECTIONS.len() + 1;

/// The sequence with its state.
#[derive(Clone, Debug)]
pub(crate) struct Sobol {
    directions: Vec<[u32; BITS]>,
    state: Vec<u32>,
    index: u32,
}

impl Sobol {
    /// The sequence as published, from the origin.
    pub(crate) fn plain(dimension: usize) -> Result<Self, DesignError> {
        if dimension > MAX_INPUTS {
            return Err(DesignError::TooManyInputs { supported: MAX_INPUTS, found: dimension });
        }
        let directions = (0..dimension).map(direction_numbers).collect();
        Ok(Self { directions, state: vec![0; dimension], index: 0 })
    }

    /// The sequence scrambled and shifted by `seed`.
    pub(crate) fn scrambled(dimension: usize, seed: u64) -> Result<Self, DesignError> {
        let mut sobol = Self::plain(dimension)?;
        for input in 0..dimension {
            let mut stream = Stream::new(seed, Purpose::Scramble, input as u64);
            let rows: Vec<u32> = (0..BITS).map(|row| lower_row(&mut stream, row)).collect();
            for direction in &mut sobol.directions[input] {
                *direction = apply(&rows, *direction);
            }
            sobol.state[input] = stream.bits();
        }
        Ok(sobol)
    }

    /// The next point of the unit cube, in Gray-code order.
    pub(crate) fn next_point(&mut self) -> Vec<f64> {
        let scale = 1.0 / (1_u64 << BITS) as f64;
        let point = self.state.iter().map(|&s| f64::from(s) * scale).collect();
        let bit = self.index.trailing_ones() as usize;
        for (state, directions) in self.state.iter_mut().zip(&self.directions) {
            *state ^= directions[bit.min(BITS - 1)];
        }
        self.index = self.index.wrapping_add(1);
        point
    }
}

/// Row `row` of a random lower-triangular bit matrix with unit diagonal; the
/// highest bit is column zero.
fn lower_row(stream: &mut Stream, row: usize) -> u32 {
    let diagonal = 1_u32 << (BITS - 1 - row);
    let above = !(diagonal | (diagonal - 1));
    (stream.bits() & above) | diagonal
}

/// A bit matrix times a bit vector.
fn apply(rows: &[u32], vector: u32) -> u32 {
    rows.iter().fold(0, |out, row| (out << 1) | ((row & vector).count_ones() & 1))
}

/// The 32 direction numbers of one input.
fn direction_numbers(input: usize) -> [u32; BITS] {
    let mut v = [0_u32; BITS];
    if input == 0 {
        for (i, v) in v.iter_mut().enumerate() {
            *v = 1 << (BITS - 1 - i);
        }
        return v;
    }
    let (degree, coefficients, initial) = DIRECTIONS[input - 1];
    for i in 0..degree {
        v[i] = initial[i] << (BITS - 1 - i);
    }
    for i in degree..BITS {
        v[i] = v[i - degree] ^ (v[i - degree] >> degree);
        for k in 1..degree {
            if (coefficients >> (degree - 1 - k)) & 1 == 1 {
                v[i] ^= v[i - k];
            }
        }
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_first_points() {
        let mut sobol = Sobol::plain(3).unwrap();
        let points: Vec<_> = (0..4).map(|_| sobol.next_point()).collect();
        assert_eq!(points[1], [0.5, 0.5, 0.5]);
        assert_eq!(points[2], [0.75, 0.25, 0.25]);
        assert_eq!(points[3], [0.25, 0.75, 0.75]);
    }

    #[test]
    fn versus_scipy_points() {
        let table = include_str!("../../../fixtures/references/scipy/sobol.csv");
        let mut sobol = Sobol::plain(MAX_INPUTS).unwrap();
        let points: Vec<_> = (0..1024).map(|_| sobol.next_point()).collect();
        for line in table.lines() {
            let row: Vec<usize> = line.split(',').map(|v| v.parse().unwrap()).collect();
            let ours: Vec<usize> =
                points[row[0]].iter().map(|u| (u * f64::from(1_u32 << 30)) as usize).collect();
            assert_eq!(ours, row[1..], "point {}", row[0]);
        }
    }

    /// Every prefix of 2^m points has one point in each slice of 2^-m, for
    /// any scrambling.
    #[test]
    fn property_scrambling_keeps_the_slices() {
        let mut sobol = Sobol::scrambled(MAX_INPUTS, 9).unwrap();
        let points: Vec<_> = (0..64).map(|_| sobol.next_point()).collect();
        for input in 0..MAX_INPUTS {
            let mut slices: Vec<usize> =
                points.iter().map(|p| (p[input] * 64.0) as usize).collect();
            slices.sort_unstable();
            assert_eq!(slices, (0..64).collect::<Vec<_>>(), "input {input}");
        }
        let other = Sobol::scrambled(MAX_INPUTS, 10).unwrap().next_point();
        assert_ne!(points[0], other, "another seed scrambles differently");
    }
}
