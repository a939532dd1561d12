//! The least of a quadratic form in a box.

use nalgebra::{DMatrix, DVector};

use crate::symmetric::{SymmetricMatrix, solve};

/// Fall of the form, of the unit that it is in, below which no number is worth setting free.
const LEAST_FALL: f64 = 1e-9;
/// Steps for each number, of which two are the rule.
const MOST_STEPS: usize = 10;

/// A quadratic form `½·δᵀ·H·δ − gᵀ·δ`.
#[derive(Clone, Debug, PartialEq)]
pub struct QuadraticForm {
    /// `H`, positive semidefinite.
    pub curvature: SymmetricMatrix,
    /// `g`, as long as `H` has rows.
    pub descent: Vec<f64>,
}

/// The `δ` within `least ≤ δ ≤ most` at which a quadratic form is least. Both bounds hold zero
/// between them.
///
/// What would leave the box first stops at its bound, and what stands there is set free again where
/// the form falls inwards: the form never rises on the way, however alike two numbers are (BVLS,
/// Stark and Parker 1995). It is least but for what [`SymmetricMatrix::solve_semidefinite`]
/// gives up to stay regular.
///
/// # Panics
///
/// When descent or bounds are not as long as the curvature has rows.
///
/// # Examples
///
/// ```
/// use inference::{QuadraticForm, SymmetricMatrix, least_in_box};
///
/// let curvature = SymmetricMatrix::from_fn(2, |i, j| if i == j { 2.0 } else { 1.0 });
/// let form = QuadraticForm { curvature, descent: vec![5.0, 1.0] };
/// // the form is least at (3, −1), within the box at (2.5, 0)
/// let at = least_in_box(&form, &[0.0, 0.0], &[9.0, 9.0]);
/// assert!((at[0] - 2.5).abs() < 1e-8 && at[1] == 0.0);
/// ```
pub fn least_in_box(form: &QuadraticForm, least: &[f64], most: &[f64]) -> Vec<f64> {
    let (curvature, n) = (form.curvature.elements(), form.curvature.order());
    assert!([form.descent.len(), least.len(), most.len()] == [n; 3]);
    let descent = &DVector::from_column_slice(&form.descent);
    let mut at = DVector::<f64>::zeros(n);
    let mut held: Vec<bool> = (0..n)
        .map(|i| (least[i] >= 0.0 && descent[i] < 0.0) || (most[i] <= 0.0 && descent[i] > 0.0))
        .collect();
    for _ in 0..MOST_STEPS * n.max(1) {
        let slope = descent - curvature * &at;
        let open: Vec<usize> = (0..n).filter(|&i| !held[i]).collect();
        let matrix = DMatrix::from_fn(open.len(), open.len(), |i, j| curvature[(open[i], open[j])]);
        let step = solve(&matrix, &DVector::from_fn(open.len(), |i, _| slope[open[i]]));
        if step.iter().any(|step| !step.is_finite()) {
            break;
        }
        let room = |(i, &place): (usize, &usize)| {
            let bound = if step[i] < 0.0 { least[place] } else { most[place] };
            let share = if step[i] == 0.0 { 1.0 } else { (bound - at[place]) / step[i] };
            (share.max(0.0), place, bound)
        };
        let first = open.iter().enumerate().map(room).min_by(|a, b| a.0.total_cmp(&b.0));
        let first = first.filter(|(share, ..)| *share < 1.0);
        let share = first.map_or(1.0, |(share, ..)| share);
        for (i, &place) in open.iter().enumerate() {
            at[place] += share * step[i];
        }
        if let Some((_, place, bound)) = first {
            at[place] = bound;
            held[place] = true;
            continue;
        }
        let slope = descent - curvature * &at;
        let fall = |place: usize| {
            let inwards = if at[place] <= least[place] { slope[place] } else { -slope[place] };
            0.5 * inwards.max(0.0) * inwards / curvature[(place, place)].max(f64::MIN_POSITIVE)
        };
        let steepest = (0..n).filter(|&i| held[i] && least[i] < most[i]);
        let steepest = steepest.max_by(|&a, &b| fall(a).total_cmp(&fall(b)));
        match steepest.filter(|&place| fall(place) > LEAST_FALL) {
            Some(place) => held[place] = false,
            None => break,
        }
    }
    at.data.into()
}

#[cfg(test)]
mod tests {
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

    use super::*;
    use crate::random::normal;

    const NUMBERS: usize = 4;

    fn form(curvature: &DMatrix<f64>, descent: &DVector<f64>, at: &DVector<f64>) -> f64 {
        0.5 * at.dot(&(curvature * at)) - descent.dot(at)
    }

    /// The least of all corners, edges and faces that lie within the box.
    fn by_all_faces(
        curvature: &DMatrix<f64>,
        descent: &DVector<f64>,
        least: &[f64],
        most: &[f64],
    ) -> f64 {
        let mut lowest = f64::INFINITY;
        for code in 0..3_usize.pow(NUMBERS as u32) {
            let digit = |i: usize| code / 3_usize.pow(i as u32) % 3;
            let mut at = DVector::from_fn(NUMBERS, |i, _| [0.0, least[i], most[i]][digit(i)]);
            let open: Vec<usize> = (0..NUMBERS).filter(|&i| digit(i) == 0).collect();
            let slope = descent - curvature * &at;
            let pick = |i: usize, j: usize| curvature[(open[i], open[j])];
            let matrix = DMatrix::from_fn(open.len(), open.len(), pick);
            let step = solve(&matrix, &DVector::from_fn(open.len(), |i, _| slope[open[i]]));
            for (i, &place) in open.iter().enumerate() {
                at[place] = step[i];
            }
            if (0..NUMBERS).all(|i| (least[i]..=most[i]).contains(&at[i])) {
                lowest = lowest.min(form(curvature, descent, &at));
            }
        }
        lowest
    }

    /// Also where two columns are nearly one, of which least squares puts one far beyond its upper
    /// bound and the other far beyond its lower.
    #[test]
    fn law_no_point_of_the_box_is_lower() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        for draw in 0..500 {
            let apart = [1.0, 1e-1, 1e-3][draw % 3];
            let mut columns = DMatrix::from_fn(8, NUMBERS, |_, _| normal(&mut random));
            for row in 0..8 {
                columns[(row, 1)] = columns[(row, 0)] + apart * columns[(row, 1)];
            }
            let target = DVector::from_fn(8, |_, _| 3.0 * normal(&mut random));
            let (curvature, descent) =
                (columns.transpose() * &columns, columns.transpose() * target);
            let least: Vec<f64> =
                (0..NUMBERS).map(|i| if i % 2 == 0 { 0.0 } else { -0.3 }).collect();
            let most = [1.0; NUMBERS];
            let quadratic = QuadraticForm {
                curvature: SymmetricMatrix::from_fn(NUMBERS, |i, j| curvature[(i, j)]),
                descent: descent.as_slice().to_vec(),
            };
            let at = DVector::from_vec(least_in_box(&quadratic, &least, &most));
            assert!((0..NUMBERS).all(|i| (least[i]..=most[i]).contains(&at[i])), "{at}");
            let (ours, lowest) = (
                form(&curvature, &descent, &at),
                by_all_faces(&curvature, &descent, &least, &most),
            );
            assert!(ours <= lowest + 1e-6 * (1.0 + lowest.abs()), "{draw}: {ours} above {lowest}");
        }
    }
}
