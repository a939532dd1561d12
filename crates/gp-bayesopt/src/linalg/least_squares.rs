//! Damped linear least squares on a box.

use crate::{bounds::Walls, matrix::Matrix};

/// The step `s` that minimises `‖r + J·s‖² + λ·‖D·s‖²` between the walls.
///
/// The input that would leave the box farthest is pinned to its face and the
/// others solved again, at most once for each input. A QR factorisation of the
/// stacked matrix keeps the conditioning of `J` rather than of `JᵀJ`.
pub(crate) fn damped_step(
    jacobian: &Matrix,
    residual: &[f64],
    damping: &[f64],
    walls: &Walls,
) -> Vec<f64> {
    let (low, high) = (&walls.lower, &walls.upper);
    let d = jacobian.columns();
    let mut step = vec![0.0; d];
    let mut free: Vec<usize> = (0..d).collect();
    while !free.is_empty() {
        let right = shifted(jacobian, residual, &step, &free);
        let part = solve_free(jacobian, &right, damping, &free);
        let excess = |i: usize| (low[free[i]] - part[i]).max(part[i] - high[free[i]]);
        let worst = (0..free.len()).max_by(|&a, &b| excess(a).total_cmp(&excess(b)));
        for (&input, &s) in free.iter().zip(&part) {
            step[input] = s.clamp(low[input], high[input]);
        }
        match worst {
            Some(i) if excess(i) > 0.0 => free.remove(i),
            _ => break,
        };
    }
    step
}

/// `r + J·s` with only the pinned part of `s`.
fn shifted(jacobian: &Matrix, residual: &[f64], step: &[f64], free: &[usize]) -> Vec<f64> {
    let mut pinned = step.to_vec();
    for &input in free {
        pinned[input] = 0.0;
    }
    jacobian.times(&pinned).iter().zip(residual).map(|(a, r)| a + r).collect()
}

/// The unconstrained damped step of the free inputs.
fn solve_free(jacobian: &Matrix, right: &[f64], damping: &[f64], free: &[usize]) -> Vec<f64> {
    let (m, f) = (jacobian.rows(), free.len());
    // column-major stack of J and the damping, right-hand side last
    let rows = m + f;
    let mut a = vec![0.0; rows * (f + 1)];
    for (k, &input) in free.iter().enumerate() {
        for i in 0..m {
            a[k * rows + i] = jacobian.get(i, input);
        }
        a[k * rows + m + k] = damping[input];
    }
    for (slot, r) in a[f * rows..].iter_mut().zip(right) {
        *slot = -r;
    }
    triangularise(&mut a, rows, f);
    back_substitute(&a, rows, f)
}

/// Householder reflections on the first `columns` columns, applied to all.
fn triangularise(a: &mut [f64], rows: usize, columns: usize) {
    for k in 0..columns {
        let (head, tail) = a.split_at_mut((k + 1) * rows);
        let pivot = &mut head[k * rows + k..];
        let norm = crate::matrix::norm(pivot);
        if norm == 0.0 {
            continue;
        }
        let alpha = if pivot[0] > 0.0 { -norm } else { norm };
        let mut v: Vec<f64> = pivot.iter().map(|x| x / norm).collect();
        v[0] -= alpha / norm;
        let vv: f64 = v.iter().map(|x| x * x).sum();
        pivot[0] = alpha;
        pivot[1..].fill(0.0);
        for column in tail.chunks_exact_mut(rows) {
            let below = &mut column[k..];
            let factor = 2.0 * crate::matrix::dot(&v, below) / vv;
            for (x, w) in below.iter_mut().zip(&v) {
                *x -= factor * w;
            }
        }
    }
}

/// Solves the triangle; an input whose pivot is zero stays where it is.
fn back_substitute(a: &[f64], rows: usize, columns: usize) -> Vec<f64> {
    let largest = (0..columns).fold(0.0_f64, |m, k| m.max(a[k * rows + k].abs()));
    let mut x = vec![0.0; columns];
    for k in (0..columns).rev() {
        let pivot = a[k * rows + k];
        if pivot.abs() <= largest * f64::EPSILON * rows as f64 {
            continue;
        }
        let known: f64 = (k + 1..columns).map(|j| a[j * rows + k] * x[j]).sum();
        x[k] = (a[columns * rows + k] - known) / pivot;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn solves_a_square_system() {
        let j = Matrix::from_rows(&[vec![2.0, 1.0], vec![1.0, 3.0]]).unwrap();
        let walls = Walls { lower: vec![-1e9; 2], upper: vec![1e9; 2] };
        let s = damped_step(&j, &[-5.0, -10.0], &[0.0, 0.0], &walls);
        assert_abs_diff_eq!(s[..], [1.0, 3.0][..], epsilon = 1e-14);
    }

    #[test]
    fn pinned_input_moves_the_others() {
        // minimise (s0 + s1 - 4)² + (s0 - s1)² with s0 ≤ 1: s1 = (4 - 1 + 1)/2 = 2
        let j = Matrix::from_rows(&[vec![1.0, 1.0], vec![1.0, -1.0]]).unwrap();
        let walls = Walls { lower: vec![-9.0; 2], upper: vec![1.0, 9.0] };
        let s = damped_step(&j, &[-4.0, 0.0], &[0.0, 0.0], &walls);
        assert_abs_diff_eq!(s[..], [1.0, 2.0][..], epsilon = 1e-14);
    }
}
