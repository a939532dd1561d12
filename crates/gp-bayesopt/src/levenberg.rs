//! Levenberg-Marquardt with Broyden updates on a box.

use crate::{
    bounds::{Bounds, Walls},
    covariance::covariance,
    error::{CovarianceError, SettingError, SolveError},
    linalg::damped_step,
    matrix::{Matrix, dot, norm},
    stop::StopReason,
};

/// Origin of the Jacobian of a [`Solution`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FinalJacobian {
    /// The one that the solver worked with last (one-sided differences at an
    /// earlier point plus Broyden updates): no further evaluation.
    Working,
    /// Fresh central differences at the final point: two evaluations for each
    /// input, kept free of the budget from the start.
    Central,
}

/// A solver for `min ‖r(x)‖` on a box when evaluations are expensive.
///
/// One finite-difference Jacobian (or one that the caller brings), then
/// Broyden's rank-one update after every evaluation; a fresh Jacobian only when
/// progress stalls. Each step solves
///
/// ```text
/// min ‖r + J·s‖² + λ·Σ_i ‖J_i‖²·s_i²   on   lower ≤ x + s ≤ upper
/// J ← J + (r(x+s) − r(x) − J·s)·sᵀ / sᵀs
/// ```
///
/// # Accuracy
/// For a residual that vanishes at the solution, superlinear. With a residual
/// that does not vanish, linear once the Jacobian is that of the solution.
///
/// # Source
/// Marquardt, SIAM J. Appl. Math. 11 (1963) 431; Broyden, Math. Comp. 19
/// (1965) 577.
///
/// # Examples
///
/// ```
/// use gp_bayesopt::{Bounds, LevenbergMarquardt, StopReason};
///
/// let bounds = Bounds::new(&[-2.0, -2.0], &[2.0, 2.0])?;
/// let residual = |x: &[f64]| {
///     Ok::<_, std::convert::Infallible>(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]])
/// };
/// let solver = LevenbergMarquardt { target: 1e-8, ..LevenbergMarquardt::default() };
/// let solution = solver.solve(residual, &[-1.2, 1.0], &bounds)?;
/// assert_eq!(solution.stop, StopReason::TargetReached);
/// assert!((solution.point[0] - 1.0).abs() < 1e-7);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LevenbergMarquardt {
    /// Difference steps, one for each input in its own unit; `None`: 1e-6 of
    /// each input's width. With a quantised or noisy residual they must be
    /// large against the noise.
    pub steps: Option<Vec<f64>>,
    /// A Jacobian for the start that saves one evaluation for each input.
    pub start_jacobian: Option<Matrix>,
    /// Evaluations allowed, all included.
    pub max_evaluations: usize,
    /// Norm of the residual that ends the run.
    pub target: f64,
    /// A step shorter than this, as a fraction of each input's width, ends the run.
    pub step_tolerance: f64,
    /// A step that promises a smaller relative decrease of the norm than this
    /// ends the run, once the Jacobian has proved itself.
    pub gain_tolerance: f64,
    /// Damping `λ` of the first step.
    pub initial_damping: f64,
    /// A step that leaves more than this share of the norm asks for a fresh Jacobian.
    pub stall_ratio: f64,
    /// Steps in a row that are rejected, or gain less than a hundredth, that end the run.
    pub max_rejections: usize,
    /// The Jacobian to return.
    pub final_jacobian: FinalJacobian,
}

impl Default for LevenbergMarquardt {
    fn default() -> Self {
        Self {
            steps: None,
            start_jacobian: None,
            max_evaluations: 200,
            target: 0.0,
            step_tolerance: 1e-12,
            gain_tolerance: 1e-9,
            initial_damping: 1e-3,
            stall_ratio: 0.5,
            max_rejections: 12,
            final_jacobian: FinalJacobian::Working,
        }
    }
}

/// Where a solver for residual vectors ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// The best point found.
    pub point: Vec<f64>,
    /// The residual there.
    pub residual: Vec<f64>,
    /// Norm of that residual.
    pub norm: f64,
    /// `∂r/∂x`, residuals × inputs; `None` when the budget left no room for one.
    pub jacobian: Option<Matrix>,
    /// Evaluations made, every one counted.
    pub evaluations: usize,
    /// Evaluations among them that were spent on finite differences.
    pub difference_evaluations: usize,
    /// Evaluations that returned NaN or an infinity; their points were refused.
    pub refused_evaluations: usize,
    /// Inputs that rest on a limit of the box.
    pub at_bound: Vec<bool>,
    /// Why the run ended.
    pub stop: StopReason,
}

impl Solution {
    /// Covariance of the inputs for independent noise of one level on each
    /// residual, `σ²·(JᵀJ)⁻¹`; `None` without a Jacobian.
    ///
    /// # Errors
    /// [`CovarianceError`] when the Jacobian leaves an input undetermined.
    pub fn covariance(&self, noise_std: f64) -> Option<Result<Matrix, CovarianceError>> {
        self.jacobian.as_ref().map(|j| covariance(j, noise_std))
    }
}

impl LevenbergMarquardt {
    /// Runs from `start`.
    ///
    /// The result depends only on the arguments. A residual with NaN or an
    /// infinity refuses the step and raises the damping.
    ///
    /// # Errors
    /// [`SolveError`]: a start outside the rules, unusable settings, a start
    /// residual that is not finite, a residual that changes length, or the
    /// function's own error, with the best point so far.
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
        let steps = self.checked_steps(bounds)?;
        let point = bounds.project(start)?;
        let reserved = match self.final_jacobian {
            FinalJacobian::Central => 2 * bounds.dimension(),
            FinalJacobian::Working => 0,
        };
        let budget = self.max_evaluations.saturating_sub(reserved);
        if budget == 0 {
            let value = self.max_evaluations as f64;
            let needs = "at least one more than the final Jacobian takes";
            return Err(SettingError::OutOfRange { name: "max_evaluations", value, needs }.into());
        }
        let mut meter = Meter { function: residual, bounds, steps, count: Count::default() };
        let first = meter.evaluate(&point, None)?.ok_or(SolveError::UnusableStart)?;
        let mut run = Run { point, norm: norm(&first), residual: first, jacobian: None };
        let stop = self.iterate(&mut meter, &mut run, budget)?;
        if self.final_jacobian == FinalJacobian::Central {
            run.jacobian = meter.central(&run)?;
        }
        Ok(run.into_solution(bounds, &meter.count, stop))
    }

    /// The difference steps, checked.
    fn checked_steps(&self, bounds: &Bounds) -> Result<Vec<f64>, SettingError> {
        let expected = bounds.dimension();
        let needs = "it must be positive and finite";
        for (name, value) in
            [("initial_damping", self.initial_damping), ("stall_ratio", self.stall_ratio)]
        {
            if !(value.is_finite() && value > 0.0) {
                return Err(SettingError::OutOfRange { name, value, needs });
            }
        }
        for (name, value) in [
            ("target", self.target),
            ("step_tolerance", self.step_tolerance),
            ("gain_tolerance", self.gain_tolerance),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                let needs = "it must not be negative";
                return Err(SettingError::OutOfRange { name, value, needs });
            }
        }
        let Some(steps) = &self.steps else {
            return Ok((0..expected).map(|i| 1e-6 * bounds.width(i)).collect());
        };
        if steps.len() != expected {
            return Err(SettingError::Length { name: "steps", expected, found: steps.len() });
        }
        for (i, &value) in steps.iter().enumerate() {
            if !(value.is_finite() && value > 0.0 && value <= 0.25 * bounds.width(i)) {
                let needs = "it must be positive and at most a quarter of the input's width";
                return Err(SettingError::OutOfRange { name: "steps", value, needs });
            }
        }
        Ok(steps.clone())
    }

    /// The Jacobian to begin with, and whether it belongs to this very point.
    fn first_jacobian<E, F>(
        &self,
        meter: &mut Meter<'_, F>,
        run: &Run,
        budget: usize,
    ) -> Result<Option<Matrix>, SolveError<E>>
    where
        E: std::error::Error + 'static,
        F: FnMut(&[f64]) -> Result<Vec<f64>, E>,
    {
        let (rows, columns) = (run.residual.len(), run.point.len());
        match &self.start_jacobian {
            Some(given) if given.rows() == rows && given.columns() == columns => {
                Ok(Some(given.clone()))
            }
            Some(given) => Err(SettingError::JacobianShape {
                rows: given.rows(),
                columns: given.columns(),
                needed_rows: rows,
                needed_columns: columns,
            }
            .into()),
            None => meter.forward(run, budget),
        }
    }

    /// Steps until something ends the run.
    fn iterate<E, F>(
        &self,
        meter: &mut Meter<'_, F>,
        run: &mut Run,
        budget: usize,
    ) -> Result<StopReason, SolveError<E>>
    where
        E: std::error::Error + 'static,
        F: FnMut(&[f64]) -> Result<Vec<f64>, E>,
    {
        if run.norm <= self.target {
            return Ok(StopReason::TargetReached);
        }
        let Some(mut jacobian) = self.first_jacobian(meter, run, budget)? else {
            return Ok(StopReason::BudgetSpent);
        };
        let mut trust = Trust::new(self.start_jacobian.is_none());
        let mut lambda = self.initial_damping;
        let mut idle = 0;
        loop {
            run.jacobian = Some(jacobian.clone());
            if meter.count.all >= budget {
                return Ok(StopReason::BudgetSpent);
            }
            let step = boxed_step(&jacobian, run, lambda, meter.bounds);
            let promised = 1.0 - linear_norm(&jacobian, run, &step) / run.norm;
            let over = self.is_short(&step, meter.bounds) || promised <= self.gain_tolerance;
            if over && trust.proved {
                return Ok(StopReason::Converged);
            }
            if over || trust.exhausted {
                let Some(new) = meter.forward(run, budget)? else {
                    return Ok(StopReason::BudgetSpent);
                };
                (jacobian, trust) = (new, Trust::new(true));
                continue;
            }
            let trial = offset(meter.bounds, &run.point, &step);
            let Some(residual) = meter.evaluate(&trial, Some(run))? else {
                idle += 1;
                lambda *= 10.0;
                if idle > self.max_rejections {
                    return Ok(StopReason::Stalled);
                }
                continue;
            };
            broyden(&mut jacobian, &run.residual, &residual, &step);
            let now = norm(&residual);
            let gained = 1.0 - now / run.norm;
            idle = if gained > 0.01 { 0 } else { idle + 1 };
            if gained > 0.0 {
                (run.point, run.residual, run.norm) = (trial, residual, now);
                run.jacobian = Some(jacobian.clone());
                if now <= self.target {
                    return Ok(StopReason::TargetReached);
                }
                lambda = (lambda * 0.1).max(1e-14);
            } else if trust.fresh {
                lambda *= 10.0;
            }
            if idle > self.max_rejections {
                return Ok(StopReason::Stalled);
            }
            trust.after(gained, promised, self.stall_ratio);
        }
    }

    /// Tells whether a step is below the tolerance in every input.
    fn is_short(&self, step: &[f64], bounds: &Bounds) -> bool {
        step.iter().enumerate().all(|(i, s)| s.abs() <= self.step_tolerance * bounds.width(i))
    }
}

/// Minimises the norm of a cheap model with an exact Jacobian, in at most
/// fifteen steps; returns the best point.
pub(crate) fn on_surrogate(
    model: impl Fn(&[f64]) -> (Vec<f64>, Matrix),
    start: Vec<f64>,
    walls: &Walls,
) -> Vec<f64> {
    let mut point = start;
    let (mut residual, mut jacobian) = model(&point);
    let mut lambda = 1e-3;
    for _ in 0..15 {
        let damping = column_damping(&jacobian, lambda);
        let step = damped_step(&jacobian, &residual, &damping, &walls.seen_from(&point));
        let trial: Vec<f64> = point.iter().zip(&step).map(|(x, s)| x + s).collect();
        let (there, slope) = model(&trial);
        let (now, before) = (norm(&there), norm(&residual));
        if now < before {
            (point, residual, jacobian) = (trial, there, slope);
            lambda = (lambda * 0.1).max(1e-12);
            if now > before * (1.0 - 1e-9) {
                break;
            }
        } else {
            lambda *= 10.0;
            if lambda > 1e6 {
                break;
            }
        }
    }
    point
}

/// Marquardt's damping of each input: `√λ` times the norm of its column.
fn column_damping(jacobian: &Matrix, lambda: f64) -> Vec<f64> {
    let mut squares = vec![0.0; jacobian.columns()];
    for i in 0..jacobian.rows() {
        for (s, j) in squares.iter_mut().zip(jacobian.row(i)) {
            *s += j * j;
        }
    }
    let largest = squares.iter().fold(0.0_f64, |m, s| m.max(*s));
    // an input without effect is held by a small share of the largest column
    squares.iter().map(|s| (lambda * s.max(1e-12 * largest)).sqrt()).collect()
}

/// The damped step from a point within its box; circles have no walls.
fn boxed_step(jacobian: &Matrix, run: &Run, lambda: f64, bounds: &Bounds) -> Vec<f64> {
    let d = run.point.len();
    let damping = column_damping(jacobian, lambda);
    let room = |i: usize, limit: f64, open: f64| {
        if bounds.wraps(i) { open * 0.5 * bounds.width(i) } else { limit - run.point[i] }
    };
    let walls = Walls {
        lower: (0..d).map(|i| room(i, bounds.lower()[i], -1.0)).collect(),
        upper: (0..d).map(|i| room(i, bounds.upper()[i], 1.0)).collect(),
    };
    damped_step(jacobian, &run.residual, &damping, &walls)
}

/// A point plus a step, back in the box.
fn offset(bounds: &Bounds, point: &[f64], step: &[f64]) -> Vec<f64> {
    (0..point.len()).map(|i| bounds.project_input(i, point[i] + step[i])).collect()
}

/// `‖r + J·s‖`.
fn linear_norm(jacobian: &Matrix, run: &Run, step: &[f64]) -> f64 {
    let moved: Vec<f64> =
        jacobian.times(step).iter().zip(&run.residual).map(|(a, r)| a + r).collect();
    norm(&moved)
}

/// How far the working Jacobian may be relied on.
struct Trust {
    /// Differences were taken at this very point.
    fresh: bool,
    /// Fresh, or the last step gained what it promised.
    proved: bool,
    /// Progress has stalled since the differences were taken.
    exhausted: bool,
}

impl Trust {
    fn new(fresh: bool) -> Self {
        Self { fresh, proved: fresh, exhausted: false }
    }

    /// After a step that promised and gained these relative decreases.
    fn after(&mut self, gained: f64, promised: f64, stall_ratio: f64) {
        let kept = (gained - promised).abs() <= 0.25 * promised;
        let stalled = gained < 1.0 - stall_ratio && !kept;
        // a fresh Jacobian may fail once more with a shorter step
        self.exhausted = stalled && !self.fresh;
        self.fresh = self.fresh && gained <= 0.0;
        self.proved = self.fresh || kept;
    }
}

/// Broyden's update.
fn broyden(jacobian: &mut Matrix, before: &[f64], after: &[f64], step: &[f64]) {
    let length2 = dot(step, step);
    for i in 0..jacobian.rows() {
        let row = jacobian.row_mut(i);
        let miss = (after[i] - before[i] - dot(row, step)) / length2;
        for (j, s) in row.iter_mut().zip(step) {
            *j += miss * s;
        }
    }
}

/// The state of a run.
struct Run {
    point: Vec<f64>,
    residual: Vec<f64>,
    norm: f64,
    jacobian: Option<Matrix>,
}

impl Run {
    fn into_solution(self, bounds: &Bounds, count: &Count, stop: StopReason) -> Solution {
        let at_bound = (0..self.point.len())
            .map(|i| {
                let x = self.point[i];
                !bounds.wraps(i) && (x <= bounds.lower()[i] || x >= bounds.upper()[i])
            })
            .collect();
        Solution {
            point: self.point,
            residual: self.residual,
            norm: self.norm,
            jacobian: self.jacobian,
            evaluations: count.all,
            difference_evaluations: count.differences,
            refused_evaluations: count.refused,
            at_bound,
            stop,
        }
    }
}

/// Evaluations so far.
#[derive(Default)]
struct Count {
    all: usize,
    differences: usize,
    refused: usize,
}

/// The residual function with its counters.
struct Meter<'a, F> {
    function: F,
    bounds: &'a Bounds,
    steps: Vec<f64>,
    count: Count,
}

impl<F> Meter<'_, F> {
    /// One evaluation; `None` when the residual is not finite.
    fn evaluate<E>(
        &mut self,
        point: &[f64],
        best: Option<&Run>,
    ) -> Result<Option<Vec<f64>>, SolveError<E>>
    where
        E: std::error::Error + 'static,
        F: FnMut(&[f64]) -> Result<Vec<f64>, E>,
    {
        self.count.all += 1;
        let evaluation = self.count.all;
        let residual = (self.function)(point).map_err(|source| SolveError::Evaluation {
            evaluation,
            best: best.map(|run| (run.point.clone(), run.residual.clone())),
            source,
        })?;
        if let Some(run) = best
            && run.residual.len() != residual.len()
        {
            let (expected, found) = (run.residual.len(), residual.len());
            return Err(SolveError::LengthChanged { evaluation, expected, found });
        }
        if residual.is_empty() || !norm(&residual).is_finite() {
            self.count.refused += 1;
            return Ok(None);
        }
        Ok(Some(residual))
    }

    /// One-sided differences, `None` when the budget does not reach.
    fn forward<E>(&mut self, run: &Run, budget: usize) -> Result<Option<Matrix>, SolveError<E>>
    where
        E: std::error::Error + 'static,
        F: FnMut(&[f64]) -> Result<Vec<f64>, E>,
    {
        let d = run.point.len();
        if self.count.all + d > budget {
            return Ok(None);
        }
        let mut jacobian = Matrix::zeros(run.residual.len(), d);
        for input in 0..d {
            let step = self.signed_step(&run.point, input);
            if let Some(there) = self.displaced(run, input, step)? {
                for (i, (a, b)) in there.iter().zip(&run.residual).enumerate() {
                    jacobian.set(i, input, (a - b) / step);
                }
            }
        }
        Ok(Some(jacobian))
    }

    /// Central differences; a side that leaves the box is moved inside.
    fn central<E>(&mut self, run: &Run) -> Result<Option<Matrix>, SolveError<E>>
    where
        E: std::error::Error + 'static,
        F: FnMut(&[f64]) -> Result<Vec<f64>, E>,
    {
        let d = run.point.len();
        let mut jacobian = Matrix::zeros(run.residual.len(), d);
        for input in 0..d {
            let (down, up) = self.sides(&run.point, input);
            let below = self.displaced(run, input, down)?;
            let above = self.displaced(run, input, up)?;
            let (Some(below), Some(above)) = (below, above) else {
                return Ok(None);
            };
            for i in 0..below.len() {
                let slope = three_point(run.residual[i], [(down, below[i]), (up, above[i])]);
                jacobian.set(i, input, slope);
            }
        }
        Ok(Some(jacobian))
    }

    /// The residual with one input moved.
    fn displaced<E>(
        &mut self,
        run: &Run,
        input: usize,
        step: f64,
    ) -> Result<Option<Vec<f64>>, SolveError<E>>
    where
        E: std::error::Error + 'static,
        F: FnMut(&[f64]) -> Result<Vec<f64>, E>,
    {
        let mut there = run.point.clone();
        there[input] = self.bounds.project_input(input, there[input] + step);
        self.count.differences += 1;
        self.evaluate(&there, Some(run))
    }

    /// The difference step, turned inward at the upper limit.
    fn signed_step(&self, point: &[f64], input: usize) -> f64 {
        let step = self.steps[input];
        let wall = !self.bounds.wraps(input) && point[input] + step > self.bounds.upper()[input];
        if wall { -step } else { step }
    }

    /// Two different steps for a three-point difference, both inside the box.
    fn sides(&self, point: &[f64], input: usize) -> (f64, f64) {
        let step = self.steps[input];
        if self.bounds.wraps(input) {
            return (-step, step);
        }
        let (x, lower, upper) =
            (point[input], self.bounds.lower()[input], self.bounds.upper()[input]);
        if x - step < lower {
            (step, (2.0 * step).min(upper - x))
        } else if x + step > upper {
            ((-2.0 * step).max(lower - x), -step)
        } else {
            (-step, step)
        }
    }
}

/// Slope at zero of the parabola through two displaced values and the centre.
fn three_point(centre: f64, displaced: [(f64, f64); 2]) -> f64 {
    let [(h, a), (k, b)] = displaced;
    let (left, right) = ((a - centre) / h, (b - centre) / k);
    (left * k - right * h) / (k - h)
}
