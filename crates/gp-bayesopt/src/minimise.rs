//! A bounded quasi-Newton minimiser for a handful of smooth inputs.

use crate::{
    bounds::Walls,
    linalg::solve_small,
    matrix::{Matrix, dot},
};

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    pub(crate) evaluations: usize,
    /// Decrease, relative to `1 + |f|`, that counts as progress.
    pub(crate) decrease: f64,
    /// Largest entry of the projected gradient that counts as flat.
    pub(crate) gradient: f64,
    /// Longest first step, in any input.
    pub(crate) first_step: f64,
}

/// Where a minimisation ended.
#[derive(Clone, Debug)]
pub(crate) struct Minimum {
    pub(crate) point: Vec<f64>,
    pub(crate) value: f64,
    pub(crate) evaluations: usize,
}

/// A value and its gradient, `None` where the function has none.
type Valued = Option<(f64, Vec<f64>)>;

/// Minimises `f` on a box from `start` by BFGS with projected backtracking.
///
/// Inputs at a face with the gradient pointing out are held; the others take
/// the quasi-Newton step. `None` when `f` has no value at the start.
pub(crate) fn minimise(
    mut f: impl FnMut(&[f64]) -> Valued,
    start: &[f64],
    walls: &Walls,
    limits: Limits,
) -> Option<Minimum> {
    let (lower, upper) = (&walls.lower, &walls.upper);
    let d = start.len();
    let clamp = |x: f64, i: usize| x.clamp(lower[i], upper[i]);
    let mut x: Vec<f64> = (0..d).map(|i| clamp(start[i], i)).collect();
    let (mut value, mut gradient) = f(&x)?;
    let mut evaluations = 1;
    let mut hessian: Option<Matrix> = None;
    while evaluations < limits.evaluations {
        let free = free_inputs(&x, &gradient, lower, upper);
        if free.iter().all(|&i| gradient[i].abs() <= limits.gradient) {
            break;
        }
        let direction = descent(hessian.as_ref(), &gradient, &free, limits.first_step);
        let mut t = 1.0;
        let mut accepted = None;
        while evaluations < limits.evaluations && t > 1e-9 {
            let trial: Vec<f64> = (0..d).map(|i| clamp(x[i] + t * direction[i], i)).collect();
            let moved: Vec<f64> = trial.iter().zip(&x).map(|(a, b)| a - b).collect();
            let slope = dot(&gradient, &moved);
            evaluations += 1;
            match f(&trial) {
                Some((now, g)) if now <= value + 1e-4 * slope && now.is_finite() => {
                    accepted = Some((trial, moved, now, g));
                    break;
                }
                Some((now, _)) if now.is_finite() && slope < 0.0 => {
                    // minimum of the parabola through value, slope and trial
                    let best = -0.5 * slope / (now - value - slope);
                    t *= best.clamp(0.1, 0.5);
                }
                _ => t *= 0.1,
            }
        }
        let Some((point, moved, now, g)) = accepted else {
            if hessian.take().is_some() {
                continue; // once more along the steepest descent
            }
            break;
        };
        let change: Vec<f64> = g.iter().zip(&gradient).map(|(a, b)| a - b).collect();
        update(&mut hessian, &moved, &change);
        let gained = value - now;
        (x, value, gradient) = (point, now, g);
        if gained <= limits.decrease * (1.0 + value.abs()) {
            break;
        }
    }
    Some(Minimum { point: x, value, evaluations })
}

/// Inputs that are not held at a face.
fn free_inputs(x: &[f64], gradient: &[f64], lower: &[f64], upper: &[f64]) -> Vec<usize> {
    (0..x.len())
        .filter(|&i| {
            let held =
                (x[i] <= lower[i] && gradient[i] > 0.0) || (x[i] >= upper[i] && gradient[i] < 0.0);
            !held
        })
        .collect()
}

/// The quasi-Newton direction of the free inputs, else the steepest descent.
fn descent(hessian: Option<&Matrix>, gradient: &[f64], free: &[usize], first: f64) -> Vec<f64> {
    let mut direction = vec![0.0; gradient.len()];
    if let Some(h) = hessian {
        let mut part = Matrix::zeros(free.len(), free.len());
        for (a, &i) in free.iter().enumerate() {
            for (b, &j) in free.iter().enumerate() {
                part.set(a, b, h.get(i, j));
            }
        }
        let g: Vec<f64> = free.iter().map(|&i| -gradient[i]).collect();
        if let Some(step) = solve_small(part, g) {
            for (&i, p) in free.iter().zip(step) {
                direction[i] = p;
            }
            if dot(&direction, gradient) < 0.0 {
                return direction;
            }
        }
    }
    let largest = free.iter().fold(0.0_f64, |m, &i| m.max(gradient[i].abs()));
    for &i in free {
        direction[i] = -gradient[i] * (first / largest);
    }
    direction
}

/// The BFGS update of the Hessian, skipped without positive curvature.
fn update(hessian: &mut Option<Matrix>, step: &[f64], change: &[f64]) {
    let curvature = dot(step, change);
    let (ss, yy) = (dot(step, step), dot(change, change));
    if curvature <= 1e-10 * (ss * yy).sqrt() {
        return;
    }
    let n = step.len();
    let h = hessian.get_or_insert_with(|| {
        let mut start = Matrix::zeros(n, n);
        for i in 0..n {
            start.set(i, i, yy / curvature);
        }
        start
    });
    let hs = h.times(step);
    let shs = dot(step, &hs);
    for i in 0..n {
        for j in 0..n {
            let v = h.get(i, j) - hs[i] * hs[j] / shs + change[i] * change[j] / curvature;
            h.set(i, j, v);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits =
        Limits { evaluations: 300, decrease: 1e-15, gradient: 1e-9, first_step: 0.5 };

    #[expect(clippy::unnecessary_wraps, reason = "the minimiser allows for no value")]
    fn rosenbrock(x: &[f64]) -> Valued {
        let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
        let value = a * a + 100.0 * b * b;
        Some((value, vec![-2.0 * a - 400.0 * x[0] * b, 200.0 * b]))
    }

    fn walls(first_upper: f64) -> Walls {
        Walls { lower: vec![-2.0; 2], upper: vec![first_upper, 2.0] }
    }

    #[test]
    fn finds_an_inner_minimum() {
        let m = minimise(rosenbrock, &[-1.2, 1.0], &walls(2.0), LIMITS).unwrap();
        assert!((m.point[0] - 1.0).abs() < 1e-6, "{m:?}");
        assert!(m.evaluations < 80, "{m:?}");
    }

    #[test]
    fn finds_a_minimum_on_a_face() {
        // with x0 ≤ 1/2 the minimum is (1/2, 1/4)
        let m = minimise(rosenbrock, &[-1.2, 1.0], &walls(0.5), LIMITS).unwrap();
        assert!((m.point[0] - 0.5).abs() < 1e-12 && (m.point[1] - 0.25).abs() < 1e-6, "{m:?}");
    }
}
