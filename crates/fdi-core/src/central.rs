//! Central differences.

/// Derivatives of a vector-valued function at a point, one row a coordinate:
/// `(f(x + h·e_i) − f(x − h·e_i))/(2·h)`.
pub(crate) fn differences(
    point: &[f64],
    step: f64,
    mut function: impl FnMut(&[f64]) -> Vec<f64>,
) -> Vec<Vec<f64>> {
    (0..point.len())
        .map(|place| {
            let mut side = |sign: f64| {
                let mut moved = point.to_vec();
                moved[place] += sign * step;
                function(&moved)
            };
            let (up, down) = (side(1.0), side(-1.0));
            up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * step)).collect()
        })
        .collect()
}
