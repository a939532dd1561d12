//! Small symmetric matrices.

use crate::matrix::Matrix;

/// Eigenvalues (ascending) and eigenvectors (columns) of a symmetric matrix,
/// by Jacobi rotations: slow and accurate, for a few dozen rows.
pub(crate) fn eigen(symmetric: &Matrix) -> (Vec<f64>, Matrix) {
    let n = symmetric.rows();
    let mut a = symmetric.clone();
    let mut vectors = Matrix::zeros(n, n);
    for i in 0..n {
        vectors.set(i, i, 1.0);
    }
    for _sweep in 0..64 {
        if rotate_all(&mut a, &mut vectors) {
            break;
        }
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| a.get(i, i).total_cmp(&a.get(j, j)));
    let mut sorted = Matrix::zeros(n, n);
    for (to, &from) in order.iter().enumerate() {
        for i in 0..n {
            sorted.set(i, to, vectors.get(i, from));
        }
    }
    (order.iter().map(|&i| a.get(i, i)).collect(), sorted)
}

/// One sweep; true when nothing was left to rotate.
fn rotate_all(a: &mut Matrix, vectors: &mut Matrix) -> bool {
    let n = a.rows();
    let mut done = true;
    for p in 0..n {
        for q in p + 1..n {
            let off = a.get(p, q);
            let size = (a.get(p, p) * a.get(q, q)).abs().sqrt();
            if off.abs() <= f64::EPSILON * size || off == 0.0 {
                continue;
            }
            done = false;
            let theta = (a.get(q, q) - a.get(p, p)) / (2.0 * off);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let t = if theta == 0.0 { 1.0 } else { t };
            let c = 1.0 / (t * t + 1.0).sqrt();
            rotate(a, vectors, [p, q], [c, t * c]);
        }
    }
    done
}

/// One rotation in the plane of `p` and `q`, by cosine and sine.
fn rotate(a: &mut Matrix, vectors: &mut Matrix, [p, q]: [usize; 2], [c, s]: [f64; 2]) {
    let n = a.rows();
    for k in 0..n {
        let (x, y) = (a.get(k, p), a.get(k, q));
        a.set(k, p, c * x - s * y);
        a.set(k, q, s * x + c * y);
    }
    for k in 0..n {
        let (x, y) = (a.get(p, k), a.get(q, k));
        a.set(p, k, c * x - s * y);
        a.set(q, k, s * x + c * y);
        let (x, y) = (vectors.get(k, p), vectors.get(k, q));
        vectors.set(k, p, c * x - s * y);
        vectors.set(k, q, s * x + c * y);
    }
}

/// Solves a small positive definite system; `None` when it is not definite.
pub(crate) fn solve_small(mut a: Matrix, mut b: Vec<f64>) -> Option<Vec<f64>> {
    let n = b.len();
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| a.get(i, k) * a.get(j, k)).sum();
            let rest = a.get(i, j) - sum;
            if i == j {
                if rest.is_nan() || rest <= 0.0 {
                    return None;
                }
                a.set(i, i, rest.sqrt());
            } else {
                a.set(i, j, rest / a.get(j, j));
            }
        }
        let known: f64 = (0..i).map(|k| a.get(i, k) * b[k]).sum();
        b[i] = (b[i] - known) / a.get(i, i);
    }
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|k| a.get(k, i) * b[k]).sum();
        b[i] = (b[i] - known) / a.get(i, i);
    }
    Some(b)
}

/// The inverse of a symmetric positive definite matrix, or the smallest pivot
/// and the largest diagonal entry when it is numerically singular.
pub(crate) fn solve_positive(matrix: &Matrix) -> Result<Matrix, (f64, f64)> {
    let n = matrix.rows();
    let scale: Vec<f64> = (0..n).map(|i| matrix.get(i, i).max(0.0).sqrt()).collect();
    let largest = (0..n).fold(0.0_f64, |m, i| m.max(matrix.get(i, i)));
    if scale.contains(&0.0) {
        return Err((0.0, largest));
    }
    // unit diagonal: the pivots then measure dependence, not units
    let mut scaled = Matrix::zeros(n, n);
    for i in 0..n {
        for j in 0..n {
            scaled.set(i, j, matrix.get(i, j) / (scale[i] * scale[j]));
        }
    }
    let (values, vectors) = eigen(&scaled);
    let floor = f64::EPSILON * n as f64 * values[n - 1];
    if values[0] <= floor {
        return Err((values[0], largest));
    }
    let mut inverse = Matrix::zeros(n, n);
    for i in 0..n {
        for j in 0..n {
            let sum: f64 = (0..n).map(|k| vectors.get(i, k) * vectors.get(j, k) / values[k]).sum();
            inverse.set(i, j, sum / (scale[i] * scale[j]));
        }
    }
    Ok(inverse)
}
