//! Central differences.

use std::convert::Infallible;

/// Derivatives of a vector-valued function at a point, one row a coordinate:
/// `(f(x + h·e_i) − f(x − h·e_i))/(2·h)`.
///
/// # Examples
///
/// ```
/// let rows = inference::central_differences(&[3.0, 1.0], 1e-3, |at| vec![at[0] * at[1]]);
/// assert!((rows[0][0] - 1.0).abs() < 1e-9 && (rows[1][0] - 3.0).abs() < 1e-9);
/// ```
pub fn central_differences(
    point: &[f64],
    step: f64,
    mut function: impl FnMut(&[f64]) -> Vec<f64>,
) -> Vec<Vec<f64>> {
    central_differences_together(point, step, |points| {
        points.iter().map(|at| function(at)).collect()
    })
}

/// Derivatives of a function of several points at once, which is asked for all of them together.
pub fn central_differences_together(
    point: &[f64],
    step: f64,
    function: impl FnOnce(&[Vec<f64>]) -> Vec<Vec<f64>>,
) -> Vec<Vec<f64>> {
    let steps = vec![step; point.len()];
    let Ok(rows) = of_all(point, &steps, |points| Ok::<_, Infallible>(function(points)));
    rows
}

/// Derivatives of a function that can fail, with a step for each coordinate.
///
/// # Errors
///
/// The first error of the function.
///
/// # Panics
///
/// When there are more steps than coordinates.
pub fn try_central_differences<E>(
    point: &[f64],
    steps: &[f64],
    mut function: impl FnMut(&[f64]) -> Result<Vec<f64>, E>,
) -> Result<Vec<Vec<f64>>, E> {
    of_all(point, steps, |points| points.iter().map(|at| function(at)).collect())
}

fn of_all<E>(
    point: &[f64],
    steps: &[f64],
    function: impl FnOnce(&[Vec<f64>]) -> Result<Vec<Vec<f64>>, E>,
) -> Result<Vec<Vec<f64>>, E> {
    let sides = |(place, step): (usize, &f64)| {
        [*step, -step].map(|by| {
            let mut moved = point.to_vec();
            moved[place] += by;
            moved
        })
    };
    let points: Vec<Vec<f64>> = steps.iter().enumerate().flat_map(sides).collect();
    let values = function(&points)?;
    let slope = |(pair, step): (&[Vec<f64>], &f64)| {
        pair[0].iter().zip(&pair[1]).map(|(u, d)| (u - d) / (2.0 * step)).collect()
    };
    Ok(values.chunks_exact(2).zip(steps).map(slope).collect())
}
