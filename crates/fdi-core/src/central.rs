//! Central differences.

use std::convert::Infallible;

/// Derivatives of a vector-valued function at a point, one row a coordinate:
/// `(f(x + h·e_i) − f(x − h·e_i))/(2·h)`.
pub(crate) fn differences(
    point: &[f64],
    step: f64,
    mut function: impl FnMut(&[f64]) -> Vec<f64>,
) -> Vec<Vec<f64>> {
    let steps = vec![step; point.len()];
    let Ok(rows) = differences_of(point, &steps, |at| Ok::<_, Infallible>(function(at)));
    rows
}

/// The same of a function of several points at once, which is asked for all of them together.
pub(crate) fn differences_together(
    point: &[f64],
    step: f64,
    function: impl FnOnce(&[Vec<f64>]) -> Vec<Vec<f64>>,
) -> Vec<Vec<f64>> {
    let side = |(place, sign): (usize, f64)| {
        let mut moved = point.to_vec();
        moved[place] += sign * step;
        moved
    };
    let points: Vec<Vec<f64>> =
        (0..point.len()).flat_map(|place| [(place, 1.0), (place, -1.0)]).map(side).collect();
    let slope = |pair: &[Vec<f64>]| {
        pair[0].iter().zip(&pair[1]).map(|(u, d)| (u - d) / (2.0 * step)).collect()
    };
    function(&points).chunks_exact(2).map(slope).collect()
}

/// The same of a function that can fail, with a step for each coordinate.
pub(crate) fn differences_of<E>(
    point: &[f64],
    steps: &[f64],
    mut function: impl FnMut(&[f64]) -> Result<Vec<f64>, E>,
) -> Result<Vec<Vec<f64>>, E> {
    let row = |(place, step): (usize, &f64)| {
        let mut side = |sign: f64| {
            let mut moved = point.to_vec();
            moved[place] += sign * step;
            function(&moved)
        };
        let (up, down) = (side(1.0)?, side(-1.0)?);
        Ok(up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * step)).collect())
    };
    steps.iter().enumerate().map(row).collect()
}
