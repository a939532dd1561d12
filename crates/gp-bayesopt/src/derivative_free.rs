//! Derivative-free Gauss-Newton with a trust region.

use crate::{
    bounds::{Bounds, Walls},
    error::{SettingError, SolveError},
    levenberg::Solution,
    linalg::damped_step,
    matrix::{Matrix, dot, norm},
    stop::StopReason,
};

/// A solver for `min ‖r(x)‖` on a box that interpolates the residual on
/// `d + 1` points and keeps them well placed: no difference steps to choose,
/// and robust against rough residuals, whose noise the spread points average.
///
/// ```text
/// J·(y_t − x) = r(y_t) − r(x)   for the d other points y_t
/// min ‖r + J·s‖   on   |s_i| ≤ Δ,  x + s in the box
/// ```
///
/// Distances are fractions of the inputs' intervals. After a step that fails,
/// the farthest point is moved to where its Lagrange polynomial is largest,
/// unless all points are near; only then `Δ` shrinks.
///
/// # Source
/// After Cartis and Roberts, Math. Prog. Comp. 11 (2019) 631 (DFO-GN), without
/// its restarts and regression.
#[derive(Clone, Debug, PartialEq)]
pub struct DerivativeFreeGaussNewton {
    /// First radius `Δ`, as a fraction of the intervals.
    pub initial_radius: f64,
    /// Radius that ends the run.
    pub final_radius: f64,
    /// Evaluations allowed.
    pub max_evaluations: usize,
    /// Norm of the residual that ends the run.
    pub target: f64,
}

impl Default for DerivativeFreeGaussNewton {
    fn default() -> Self {
        Self { initial_radius: 0.1, final_radius: 1e-9, max_evaluations: 500, target: 0.0 }
    }
}

/// The interpolation set; the best point is first.
struct Set {
    points: Vec<Vec<f64>>,
    residuals: Vec<Vec<f64>>,
}

impl Set {
    fn offset(&self, t: usize) -> Vec<f64> {
        self.points[t].iter().zip(&self.points[0]).map(|(a, b)| a - b).collect()
    }

    fn distance(&self, t: usize) -> f64 {
        self.offset(t).iter().fold(0.0, |m, s| f64::max(m, s.abs()))
    }

    /// Rows `y_t − x` for `t ≥ 1`, inverted: column `t − 1` is the gradient of
    /// the Lagrange polynomial of `y_t`. `None` when the points lie in a plane.
    fn lagrange(&self) -> Option<Matrix> {
        let d = self.points.len() - 1;
        let rows: Vec<Vec<f64>> = (1..=d).map(|t| self.offset(t)).collect();
        invert(rows)
    }

    /// The interpolated Jacobian.
    fn jacobian(&self, lagrange: &Matrix) -> Matrix {
        let d = self.points.len() - 1;
        let mut jacobian = Matrix::zeros(self.residuals[0].len(), d);
        for i in 0..jacobian.rows() {
            for j in 0..d {
                let slope = (0..d)
                    .map(|t| lagrange.get(j, t) * (self.residuals[t + 1][i] - self.residuals[0][i]))
                    .sum();
                jacobian.set(i, j, slope);
            }
        }
        jacobian
    }

    /// Puts the best point first.
    fn sort(&mut self) {
        let mut best = 0;
        for t in 1..self.residuals.len() {
            if norm(&self.residuals[t]) < norm(&self.residuals[best]) {
                best = t;
            }
        }
        self.points.swap(0, best);
        self.residuals.swap(0, best);
    }

    fn replace(&mut self, t: usize, point: Vec<f64>, residual: Vec<f64>) {
        (self.points[t], self.residuals[t]) = (point, residual);
    }
}

impl DerivativeFreeGaussNewton {
    /// Runs from `start`. A residual with NaN or infinity is refused.
    ///
    /// # Errors
    /// As [`LevenbergMarquardt::solve`](crate::LevenbergMarquardt::solve).
    pub fn solve<E, F>(
        &self,
        residual: F,
        start: &[f64],
        bounds: &Bounds,
    ) -> Result<Solution, SolveError<E>>
    where
        E: std::error::Error + 'static,
        F: FnMut(&[f64]) -> Result<Vec<f64>, E>,
    {
        self.check()?;
        let centre = bounds.to_unit(&bounds.project(start)?);
        let mut search = Search {
            residual,
            bounds,
            set: Set { points: Vec::new(), residuals: Vec::new() },
            radius: self.initial_radius,
            left: self.max_evaluations,
            jacobian: None,
            evaluations: 0,
            refused: 0,
        };
        search.first_points(&centre)?;
        let mut stop = search.steps(self)?;
        if norm(&search.set.residuals[0]) <= self.target {
            stop = StopReason::TargetReached;
        }
        Ok(search.solution(stop))
    }

    fn check(&self) -> Result<(), SettingError> {
        let needs = "0 < final_radius < initial_radius <= 0.25";
        let radii = [("final_radius", self.final_radius), ("initial_radius", self.initial_radius)];
        for (name, value) in radii {
            if !(value > 0.0 && value <= 0.25) {
                return Err(SettingError::OutOfRange { name, value, needs });
            }
        }
        if self.max_evaluations == 0 {
            let (name, value) = ("max_evaluations", 0.0);
            return Err(SettingError::OutOfRange { name, value, needs: "at least 1" });
        }
        Ok(())
    }
}

/// A run: the interpolation set and what is left of the budget.
struct Search<'a, F> {
    residual: F,
    bounds: &'a Bounds,
    set: Set,
    radius: f64,
    /// Evaluations that are left.
    left: usize,
    jacobian: Option<Matrix>,
    evaluations: usize,
    refused: usize,
}

impl<F> Search<'_, F> {
    /// One evaluation; `None` when the residual is not finite.
    fn evaluate<E>(&mut self, unit: &[f64]) -> Result<Option<Vec<f64>>, SolveError<E>>
    where
        E: std::error::Error + 'static,
        F: FnMut(&[f64]) -> Result<Vec<f64>, E>,
    {
        self.left -= 1;
        self.evaluations += 1;
        let (evaluation, bounds, set) = (self.evaluations, self.bounds, &self.set);
        let best = || Some((bounds.at_unit(set.points.first()?), set.residuals[0].clone()));
        let there = (self.residual)(&bounds.at_unit(unit))
            .map_err(|source| SolveError::Evaluation { evaluation, best: best(), source })?;
        let expected = set.residuals.first().map_or(there.len(), Vec::len);
        if there.len() != expected {
            let found = there.len();
            return Err(SolveError::LengthChanged { evaluation, expected, found });
        }
        if there.is_empty() || !norm(&there).is_finite() {
            self.refused += 1;
            return Ok(None);
        }
        Ok(Some(there))
    }

    /// The start and one point beside it along each input.
    fn first_points<E>(&mut self, centre: &[f64]) -> Result<(), SolveError<E>>
    where
        E: std::error::Error + 'static,
        F: FnMut(&[f64]) -> Result<Vec<f64>, E>,
    {
        for t in 0..=centre.len() {
            if self.left == 0 {
                break;
            }
            let mut unit = centre.to_vec();
            if t > 0 {
                let inward =
                    if unit[t - 1] + self.radius > 1.0 { -self.radius } else { self.radius };
                unit[t - 1] = (unit[t - 1] + inward).clamp(0.0, 1.0);
            }
            let there = self.evaluate(&unit)?.ok_or(SolveError::UnusableStart)?;
            self.set.points.push(unit);
            self.set.residuals.push(there);
        }
        self.set.sort();
        Ok(())
    }

    /// Steps until something ends the run.
    fn steps<E>(
        &mut self,
        settings: &DerivativeFreeGaussNewton,
    ) -> Result<StopReason, SolveError<E>>
    where
        E: std::error::Error + 'static,
        F: FnMut(&[f64]) -> Result<Vec<f64>, E>,
    {
        let d = self.bounds.dimension();
        while self.left > 0 && self.set.points.len() == d + 1 {
            if norm(&self.set.residuals[0]) <= settings.target {
                return Ok(StopReason::TargetReached);
            }
            if self.radius < settings.final_radius {
                return Ok(StopReason::Converged);
            }
            let Some(lagrange) = self.set.lagrange() else {
                return Ok(StopReason::Stalled);
            };
            let tried = self.try_step(&lagrange)?;
            if tried.gain >= 0.7 {
                let radius = self.radius;
                self.radius = (2.0 * radius).min((4.0 * tried.reach).max(radius)).min(0.5);
            } else if tried.gain < 0.1 && !self.spread_or_shrink(tried.reach)? {
                return Ok(StopReason::Stalled);
            }
        }
        Ok(StopReason::BudgetSpent)
    }

    /// The step that the linear model promises most of, taken where it is worth an evaluation.
    fn try_step<E>(&mut self, lagrange: &Matrix) -> Result<Tried, SolveError<E>>
    where
        E: std::error::Error + 'static,
        F: FnMut(&[f64]) -> Result<Vec<f64>, E>,
    {
        let size = norm(&self.set.residuals[0]);
        let model = self.set.jacobian(lagrange);
        let step = box_step(&model, &self.set, self.radius);
        let reach = step.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
        let linear: Vec<f64> =
            model.times(&step).iter().zip(&self.set.residuals[0]).map(|(a, r)| a + r).collect();
        let promised = size * size - dot(&linear, &linear);
        self.jacobian = Some(model);
        let mut gain = f64::NEG_INFINITY;
        if reach > 0.01 * self.radius && promised > 0.0 {
            let unit = moved(&self.set.points[0], &step);
            if let Some(there) = self.evaluate(&unit)? {
                gain = (size * size - dot(&there, &there)) / promised;
                let leaving = leaver(&self.set, lagrange, &step, self.radius);
                if gain > 0.0 || leaving.1 > 1.0 {
                    self.set.replace(leaving.0, unit, there);
                    self.set.sort();
                }
            }
        }
        Ok(Tried { gain, reach })
    }

    /// After a poor step: a far point is brought back, or the region shrinks. `false` when the
    /// points no longer span the inputs.
    fn spread_or_shrink<E>(&mut self, reach: f64) -> Result<bool, SolveError<E>>
    where
        E: std::error::Error + 'static,
        F: FnMut(&[f64]) -> Result<Vec<f64>, E>,
    {
        let (set, radius) = (&self.set, self.radius);
        let d = self.bounds.dimension();
        let far = (1..=d).max_by(|&a, &b| set.distance(a).total_cmp(&set.distance(b)));
        let far = far.filter(|&t| set.distance(t) > 2.0 * radius);
        let (Some(t), 1..) = (far, self.left) else {
            self.radius *= 0.2_f64.max((reach / radius).min(0.5));
            return Ok(true);
        };
        let Some(lagrange) = set.lagrange() else { return Ok(false) };
        let unit = spread_point(set, &lagrange, t, radius);
        match self.evaluate(&unit)? {
            Some(there) => self.set.replace(t, unit, there),
            None => self.radius *= 0.5,
        }
        self.set.sort();
        Ok(true)
    }

    /// The best point, in the units of the box.
    fn solution(mut self, stop: StopReason) -> Solution {
        let (bounds, set) = (self.bounds, &mut self.set);
        let (unit, residual) = (set.points.swap_remove(0), set.residuals.swap_remove(0));
        let jacobian = self.jacobian.map(|mut j: Matrix| {
            for i in 0..j.rows() {
                for k in 0..unit.len() {
                    j.set(i, k, j.get(i, k) / bounds.width(k));
                }
            }
            j
        });
        Solution {
            norm: norm(&residual),
            at_bound: unit.iter().map(|u| *u <= 0.0 || *u >= 1.0).collect(),
            point: bounds.at_unit(&unit),
            residual,
            jacobian,
            evaluations: self.evaluations,
            difference_evaluations: 0,
            refused_evaluations: self.refused,
            stop,
        }
    }
}

/// A step that was tried: gain over promise, and length.
struct Tried {
    gain: f64,
    reach: f64,
}

/// The Gauss-Newton step within the trust region and the box: the damping is
/// raised until the step is about as long as the radius, then it is cut.
fn box_step(model: &Matrix, set: &Set, radius: f64) -> Vec<f64> {
    let at = &set.points[0];
    let walls = Walls {
        lower: at.iter().map(|x| -x).collect(),
        upper: at.iter().map(|x| 1.0 - x).collect(),
    };
    let size = norm(model.as_slice()).max(f64::MIN_POSITIVE);
    let mut damping = 1e-12 * size;
    loop {
        let step = damped_step(model, &set.residuals[0], &vec![damping; at.len()], &walls);
        let reach = step.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
        if reach <= 1.5 * radius || damping > 1e9 * size {
            let cut = (radius / reach).min(1.0);
            return step.iter().map(|s| s * cut).collect();
        }
        damping *= if reach > 100.0 * radius { 4.0 } else { 1.5 };
    }
}

/// The point that a new one at `step` best replaces, and the merit of that.
fn leaver(set: &Set, lagrange: &Matrix, step: &[f64], radius: f64) -> (usize, f64) {
    let d = step.len();
    let mut merits: Vec<f64> = (0..d)
        .map(|t| {
            let slope: Vec<f64> = (0..d).map(|j| lagrange.get(j, t)).collect();
            let far = (set.distance(t + 1) / radius).max(1.0);
            dot(&slope, step).abs() * far * far
        })
        .collect();
    // the polynomial of the centre is one minus the others
    merits.insert(0, 0.0);
    let mut best = 1;
    for t in 2..=d {
        if merits[t] > merits[best] {
            best = t;
        }
    }
    (best, merits[best])
}

/// Where the Lagrange polynomial of point `t` is largest in the trust region.
fn spread_point(set: &Set, lagrange: &Matrix, t: usize, radius: f64) -> Vec<f64> {
    let at = &set.points[0];
    let corner = |sign: f64| -> Vec<f64> {
        (0..at.len())
            .map(|j| {
                let slope = sign * lagrange.get(j, t - 1);
                (radius * slope.signum()).clamp(-at[j], 1.0 - at[j])
            })
            .collect()
    };
    let merit =
        |step: &[f64]| (0..step.len()).map(|j| lagrange.get(j, t - 1) * step[j]).sum::<f64>().abs();
    let (up, down) = (corner(1.0), corner(-1.0));
    moved(at, if merit(&up) >= merit(&down) { &up } else { &down })
}

fn moved(point: &[f64], step: &[f64]) -> Vec<f64> {
    point.iter().zip(step).map(|(x, s)| (x + s).clamp(0.0, 1.0)).collect()
}

/// Gauss-Jordan elimination with row pivoting.
fn invert(mut a: Vec<Vec<f64>>) -> Option<Matrix> {
    let n = a.len();
    for (i, row) in a.iter_mut().enumerate() {
        row.extend((0..n).map(|j| if i == j { 1.0 } else { 0.0 }));
    }
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs()))?;
        a.swap(k, pivot);
        let top = a[k].clone();
        if top[k] == 0.0 || !top[k].is_finite() {
            return None;
        }
        for (i, row) in a.iter_mut().enumerate() {
            let factor = if i == k { 1.0 - 1.0 / top[k] } else { row[k] / top[k] };
            for (x, t) in row.iter_mut().zip(&top) {
                *x -= factor * t;
            }
        }
    }
    Matrix::from_rows(&a.iter().map(|row| row[n..].to_vec()).collect::<Vec<_>>()).ok()
}
