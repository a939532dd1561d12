//! A smooth function of seven inputs.

use gp_bayesopt::{Bounds, Design};

/// The unit cube, `n` points of it and their values.
///
/// # Panics
/// Never: seven inputs have a Sobol' sequence.
pub fn regression(n: usize) -> (Bounds, Vec<Vec<f64>>, Vec<f64>) {
    let bounds = Bounds::unit(7).expect("a cube");
    let points = Design::Sobol.points(&bounds, n, 1).expect("a design");
    let values = points.iter().map(|x| value(x)).collect();
    (bounds, points, values)
}

fn value(x: &[f64]) -> f64 {
    (3.0 * x[0]).sin()
        + x[1] * x[2]
        + (2.0 * x[3] - 1.0).powi(2)
        + 0.5 * (4.0 * x[4] * x[5]).cos()
        + 0.1 * x[6]
}
