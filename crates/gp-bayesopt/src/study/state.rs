//! The ask-and-tell loop and its checkpoint.

#[cfg(feature = "serde")]
use super::layout::Layout;
use super::{
    options::{Criterion, Objective, Reach, StudyOptions, SurrogateRule},
    region,
};
use crate::{
    acquisition::{Acquisition, TwoStep},
    bounds::{Bounds, Walls},
    error::StudyError,
    gp::{ChosenSurrogate, GaussianProcess, SurrogateChoice},
    matrix::{Matrix, norm},
    maximise::{Maximiser, Proposal},
    random::{Purpose, Stream},
    stop::StopReason,
};

/// A proposal nearer than this to a known point, as a fraction of the
/// intervals, is moved: the surrogate could not tell them apart.
const SAME_POINT: f64 = 1e-8;

/// A proposal nearer than this to a point that failed is refused.
const FAILED_RADIUS: f64 = 0.02;

/// Outcome of an evaluation.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Outcome {
    /// A number, for [`Objective::Scalar`].
    Value(f64),
    /// A vector, for [`Objective::Residual`].
    Residual(Vec<f64>),
    /// Nothing usable. The point is kept, and its neighbourhood avoided.
    Failed,
}

/// The answer to [`Study::ask`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Ask {
    /// Evaluate here.
    Evaluate(Vec<f64>),
    /// The study is over.
    Stop(StopReason),
}

/// Use made of an outcome that was told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Told {
    /// An outcome that informs the surrogate.
    Used,
    /// An outcome that was not finite, or [`Outcome::Failed`]; it is kept as failed.
    Failed,
}

/// The best observation.
#[derive(Clone, Debug, PartialEq)]
pub struct Best {
    /// The point.
    pub point: Vec<f64>,
    /// The value, or the norm of the residual.
    pub value: f64,
    /// Index in [`StudyState::points`].
    pub index: usize,
}

/// All that a study knows, as plain data: save it, and [`Study::resume`]
/// continues as if nothing had happened.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Layout", into = "Layout"))]
pub struct StudyState {
    /// Points told, in order.
    pub points: Vec<Vec<f64>>,
    /// Outcomes of the points.
    pub outcomes: Vec<Outcome>,
    /// How many of them, from the front, came from earlier runs.
    pub earlier: usize,
    /// Points asked and not yet told.
    pub pending: Vec<Vec<f64>>,
    /// Points asked so far.
    pub asked: usize,
    /// Logarithms of the hyperparameters of the last fit.
    pub hyperparameters: Option<Vec<f64>>,
    /// Usable observations at the last fit.
    pub fitted_at: usize,
    /// Kernel and form of the outputs of the last fit, where they are chosen.
    pub chosen: Option<SurrogateChoice>,
    /// Set once the study is cancelled.
    pub cancelled: bool,
}

/// Why [`Study::run`] ended early; the study keeps all data.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError<E: std::error::Error + 'static> {
    /// The study could not go on.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// The objective failed.
    #[error("objective failed after {evaluations} evaluations")]
    Objective {
        /// Evaluations told before.
        evaluations: usize,
        /// The error of the objective.
        #[source]
        source: E,
    },
}

/// Sequential optimisation of a function that is expensive to evaluate (FREEDOM
/// paper, Algorithm 1, and its form on the residual vector).
///
/// The same options, data and seed give the same points, bit for bit, also
/// across [`Self::state`] and [`Self::resume`].
///
/// # Examples
///
/// ```
/// use gp_bayesopt::{Ask, Bounds, Criterion, Outcome, Study, StudyOptions};
///
/// let bounds = Bounds::new(&[0.0], &[4.0])?;
/// let mut study = Study::new(StudyOptions::scalar(bounds, Criterion::ExpectedImprovement, 20))?;
/// while let Ask::Evaluate(x) = study.ask()? {
///     let value = (x[0] - 1.0).powi(2) + 0.1 * (5.0 * x[0]).sin();
///     study.tell(&x, Outcome::Value(value))?;
/// }
/// let best = study.best().expect("twenty evaluations");
/// assert!((best.point[0] - 0.964).abs() < 0.02);
/// # Ok::<_, gp_bayesopt::StudyError>(())
/// ```
///
/// An inverse problem told as a vector, here 2000 whitened samples, with an angle on a circle. Every
/// entry is modelled with one kernel, so that the surrogate carries the slopes of all of them:
///
/// ```
/// use gp_bayesopt::{Ask, Bounds, Outcome, Study, StudyOptions, covariance};
///
/// let (samples, noise) = (2000, 0.05);
/// let simulate = |k: &[f64]| -> Vec<f64> {
///     let time = (0..samples).map(|i| 4.0 * f64::from(i) / f64::from(samples));
///     time.map(|t| (-k[0] * t).exp() + k[1] * (3.0 * t + k[2].to_radians()).cos()).collect()
/// };
/// let truth = [0.7, 0.4, 170.0];
/// let measured = simulate(&truth);
///
/// let bounds = Bounds::new(&[0.0, 0.0, -180.0], &[2.0, 1.0, 180.0])?.with_periodic(2)?;
/// let mut study = Study::new(StudyOptions::residual(bounds, 30))?;
/// while let Ask::Evaluate(k) = study.ask()? {
///     let residual = simulate(&k).iter().zip(&measured).map(|(y, m)| (y - m) / noise).collect();
///     study.tell(&k, Outcome::Residual(residual))?;
/// }
/// let best = study.best().expect("thirty evaluations");
/// assert!(best.point.iter().zip(truth).all(|(k, t)| (k - t).abs() < 1e-2 * t));
///
/// // the posterior, from the slopes of the surrogate: no further evaluation
/// let surrogate = study.surrogate()?.expect("thirty evaluations");
/// let (_, slope) = surrogate.predict_with_slope(&best.point)?;
/// let deviation = covariance(&slope.mean, 1.0)?.get(0, 0).sqrt();
/// assert!(deviation > 1e-4 && deviation < 1e-2);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
///
/// # Cost of a vector
/// Memory `n·q` and about `n²·q` operations for each likelihood of a fit, `n` evaluations of `q`
/// entries. Measured with `q` = 5000 and seven inputs: 3.5 s for 60 evaluations, 16 s for 150, the
/// function's own time not counted.
#[derive(Clone, Debug)]
pub struct Study {
    options: StudyOptions,
    design: Vec<Vec<f64>>,
    state: StudyState,
}

impl Study {
    /// A study without data.
    ///
    /// # Errors
    /// [`StudyError`] for unusable settings.
    pub fn new(options: StudyOptions) -> Result<Self, StudyError> {
        options.check()?;
        let design = options.design.points(&options.bounds, options.design_points, options.seed)?;
        Ok(Self { options, design, state: StudyState::default() })
    }

    /// Continues from a checkpoint, with the options of the study that made it.
    ///
    /// # Errors
    /// [`StudyError`] for unusable settings or a checkpoint of another shape.
    pub fn resume(options: StudyOptions, state: StudyState) -> Result<Self, StudyError> {
        let mut study = Self::new(options)?;
        let (expected, found) = (state.points.len(), state.outcomes.len());
        if expected != found || state.earlier > found {
            return Err(StudyError::Checkpoint { what: "outcomes", expected, found });
        }
        for point in state.points.iter().chain(&state.pending) {
            study.options.bounds.check(point)?;
        }
        for (i, outcome) in state.outcomes.iter().enumerate() {
            study.check_outcome(&state.outcomes[..i], outcome)?;
        }
        study.state = state;
        Ok(study)
    }

    /// The settings.
    pub fn options(&self) -> &StudyOptions {
        &self.options
    }

    /// All that the study knows.
    pub fn state(&self) -> &StudyState {
        &self.state
    }

    /// Adds an observation of an earlier run: it informs the surrogate and is
    /// not charged to the budget. Only before anything is asked.
    ///
    /// # Errors
    /// Those of [`Self::tell`]; [`StudyError::Checkpoint`] once a point was asked.
    pub fn tell_earlier(&mut self, point: &[f64], outcome: Outcome) -> Result<Told, StudyError> {
        if self.state.asked > 0 || self.state.earlier < self.state.points.len() {
            let found = self.state.asked;
            return Err(StudyError::Checkpoint { what: "points asked", expected: 0, found });
        }
        let told = self.record(point, outcome)?;
        self.state.earlier += 1;
        Ok(told)
    }

    /// Tells what an evaluation gave, in any order, at any point of the box.
    /// A value with NaN or infinity is kept as [`Outcome::Failed`].
    ///
    /// # Errors
    /// [`StudyError::Point`] for an unusable point, [`StudyError::OutcomeLength`] for an
    /// outcome of another kind or length than the study models.
    pub fn tell(&mut self, point: &[f64], outcome: Outcome) -> Result<Told, StudyError> {
        self.record(point, outcome)
    }

    fn record(&mut self, point: &[f64], outcome: Outcome) -> Result<Told, StudyError> {
        self.options.bounds.check(point)?;
        self.check_outcome(&self.state.outcomes, &outcome)?;
        let usable = match &outcome {
            Outcome::Value(value) => value.is_finite(),
            Outcome::Residual(values) => norm(values).is_finite(),
            Outcome::Failed => false,
        };
        if let Some(at) = self.state.pending.iter().position(|p| p == point) {
            self.state.pending.remove(at);
        }
        self.state.points.push(point.to_vec());
        self.state.outcomes.push(if usable { outcome } else { Outcome::Failed });
        Ok(if usable { Told::Used } else { Told::Failed })
    }

    /// Checks that an outcome is of the study's kind and of the length so far.
    fn check_outcome(&self, before: &[Outcome], outcome: &Outcome) -> Result<(), StudyError> {
        let known = before.iter().find_map(|o| match o {
            Outcome::Residual(values) => Some(values.len()),
            _ => None,
        });
        let (expected, found) = match (&self.options.objective, outcome) {
            (_, Outcome::Failed) | (Objective::Scalar(_), Outcome::Value(_)) => return Ok(()),
            (Objective::Scalar(_), Outcome::Residual(values)) => (1, values.len()),
            (Objective::Residual, Outcome::Value(_)) => (known.unwrap_or(2), 1),
            (Objective::Residual, Outcome::Residual(values)) => {
                (known.unwrap_or(values.len()), values.len())
            }
        };
        if expected == found && found > 0 {
            return Ok(());
        }
        Err(StudyError::OutcomeLength { expected, found })
    }

    /// Ends the study at the next [`Self::ask`].
    pub fn cancel(&mut self) {
        self.state.cancelled = true;
    }

    /// Evaluations charged to the budget so far.
    pub fn evaluations(&self) -> usize {
        self.state.points.len() - self.state.earlier
    }

    /// The best observation, `None` while nothing usable was told.
    pub fn best(&self) -> Option<Best> {
        let rated = self.state.outcomes.iter().enumerate().filter_map(|(i, o)| Some((i, rate(o)?)));
        let (index, value) = rated.min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(Best { point: self.state.points[index].clone(), value, index })
    }

    /// The observed point with the least predicted mean, and that mean: the best one where
    /// observations are noisy. `None` while nothing usable was told, and for a residual.
    ///
    /// # Errors
    /// [`StudyError::Fit`].
    pub fn best_believed(&self) -> Result<Option<Best>, StudyError> {
        if self.options.objective == Objective::Residual {
            return Ok(None);
        }
        let chosen = self.chosen_surrogate()?;
        let transformation = chosen.as_ref().map(|chosen| chosen.transformation);
        let surrogate = match chosen {
            Some(chosen) => Some(chosen.process),
            None => self.surrogate()?,
        };
        let Some(gp) = surrogate else { return Ok(None) };
        let (at, mean) = gp.least_belief();
        let mut usable =
            (0..self.state.outcomes.len()).filter(|&i| rate(&self.state.outcomes[i]).is_some());
        let value = transformation.map_or(mean, |map| map.back(mean));
        Ok(usable.nth(at).map(|index| Best {
            point: self.state.points[index].clone(),
            value,
            index,
        }))
    }

    /// Why the study is over, if it is.
    pub fn stopped(&self) -> Option<StopReason> {
        if self.state.cancelled {
            return Some(StopReason::Cancelled);
        }
        if self.best().is_some_and(|best| best.value <= self.options.target) {
            return Some(StopReason::TargetReached);
        }
        if self.evaluations() >= self.options.budget {
            return Some(StopReason::BudgetSpent);
        }
        let stalled = self
            .options
            .stall
            .is_some_and(|stall| self.since_progress(stall.relative_gain) >= stall.evaluations);
        stalled.then_some(StopReason::Stalled)
    }

    /// Evaluations beyond the first points since the best value last fell.
    fn since_progress(&self, relative_gain: f64) -> usize {
        let (mut best, mut since) = (f64::INFINITY, 0);
        for (i, outcome) in self.state.outcomes.iter().enumerate() {
            since += usize::from(i >= self.state.earlier + self.design.len());
            let Some(value) = rate(outcome) else { continue };
            if best.is_infinite() || best - value > relative_gain * best.abs() {
                (best, since) = (value, 0);
            }
        }
        since
    }

    /// Where to evaluate next, or why not.
    ///
    /// First the design, then the maximum of the criterion. Points asked and
    /// not yet told are taken into account with their predicted outcome, so
    /// asking again gives another point.
    ///
    /// # Errors
    /// [`StudyError`] when the surrogate or the criterion fails; the data stay.
    pub fn ask(&mut self) -> Result<Ask, StudyError> {
        if let Some(reason) = self.stopped() {
            return Ok(Ask::Stop(reason));
        }
        let point = match self.design.get(self.state.asked) {
            Some(point) => point.clone(),
            None => self.propose()?,
        };
        self.state.asked += 1;
        self.state.pending.push(point.clone());
        Ok(Ask::Evaluate(point))
    }

    /// Several points at once, at most what the budget leaves; none when the
    /// study is over.
    ///
    /// # Errors
    /// Those of [`Self::ask`].
    pub fn ask_batch(&mut self, count: usize) -> Result<Vec<Vec<f64>>, StudyError> {
        let mut batch = Vec::new();
        let open = self.evaluations() + self.state.pending.len();
        let room = self.options.budget.saturating_sub(open);
        for _ in 0..count.min(room) {
            match self.ask()? {
                Ask::Evaluate(point) => batch.push(point),
                Ask::Stop(_) => break,
            }
        }
        Ok(batch)
    }

    /// Asks, evaluates and tells until the study is over. When the objective
    /// panics the study, which is only borrowed, keeps what was told.
    ///
    /// # Errors
    /// [`RunError::Objective`] with the objective's error, [`RunError::Study`].
    pub fn run<E: std::error::Error + 'static>(
        &mut self,
        mut objective: impl FnMut(&[f64]) -> Result<Outcome, E>,
    ) -> Result<StopReason, RunError<E>> {
        loop {
            let point = match self.ask()? {
                Ask::Evaluate(point) => point,
                Ask::Stop(reason) => return Ok(reason),
            };
            let evaluations = self.evaluations();
            let outcome =
                objective(&point).map_err(|source| RunError::Objective { evaluations, source })?;
            self.tell(&point, outcome)?;
        }
    }

    /// The surrogate of the usable observations; `None` while there are none. With
    /// [`SurrogateRule::Chosen`] its outputs are transformed ([`Self::chosen_surrogate`]).
    ///
    /// # Errors
    /// [`StudyError::Fit`].
    pub fn surrogate(&self) -> Result<Option<GaussianProcess>, StudyError> {
        if self.chooses() {
            return Ok(self.chosen_surrogate()?.map(|chosen| chosen.process));
        }
        let Usable { points, rows } = self.usable();
        let Some(width) = rows.first().map(Vec::len) else { return Ok(None) };
        let observations = rows.len();
        let mut outputs = Matrix::zeros(observations, width);
        for (i, row) in rows.iter().enumerate() {
            outputs.row_mut(i).copy_from_slice(row);
        }
        let options = &self.options;
        let warm = self.state.hyperparameters.as_deref();
        let fit = match warm {
            Some(theta) if !self.fit_due(observations) => {
                GaussianProcess::at(&options.bounds, &points, &outputs, &options.gp, theta)
            }
            _ => GaussianProcess::fit_from(&options.bounds, &points, &outputs, &options.gp, warm),
        };
        fit.map(Some).map_err(|source| StudyError::Fit { observations, source })
    }

    /// The surrogate with the kernel and the transformation that predict best; `None` while
    /// nothing usable was told, and unless [`SurrogateRule::Chosen`] is set for a scalar.
    ///
    /// # Errors
    /// [`StudyError::Fit`].
    pub fn chosen_surrogate(&self) -> Result<Option<ChosenSurrogate>, StudyError> {
        let Usable { points, rows } = self.usable();
        if rows.is_empty() || !self.chooses() {
            return Ok(None);
        }
        let values = rows.concat();
        let (bounds, gp) = (&self.options.bounds, &self.options.gp);
        let warm = self.state.hyperparameters.as_deref();
        let held = match (warm, self.state.chosen) {
            (Some(theta), Some(choice)) if !self.fit_due(values.len()) => {
                ChosenSurrogate::at(bounds, &points, &values, (gp, theta), choice)
            }
            _ => None,
        };
        let fit =
            held.unwrap_or_else(|| ChosenSurrogate::fit_from(bounds, &points, &values, gp, warm));
        let observations = values.len();
        fit.map(Some).map_err(|source| StudyError::Fit { observations, source })
    }

    /// Tells whether the surrogate is chosen.
    fn chooses(&self) -> bool {
        matches!(self.options.objective, Objective::Scalar(_))
            && self.options.surrogate == SurrogateRule::Chosen
    }

    /// Observations that inform a surrogate.
    fn usable(&self) -> Usable {
        let told = self.state.points.iter().zip(&self.state.outcomes);
        let (points, rows) = told.filter_map(|(p, o)| Some((p.clone(), outputs(o)?))).unzip();
        Usable { points, rows }
    }

    /// Tells whether hyperparameters are to be fitted anew.
    fn fit_due(&self, observations: usize) -> bool {
        let beyond = observations.saturating_sub(self.design.len());
        observations != self.state.fitted_at
            && (beyond <= self.options.always_fit || observations >= self.state.fitted_at + 5)
    }

    /// The next point from the surrogate.
    fn propose(&mut self) -> Result<Vec<f64>, StudyError> {
        let maximiser = Maximiser {
            seed: self.options.seed ^ (self.state.asked as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15),
            ..self.options.maximiser.clone()
        };
        let chosen = self.chosen_surrogate()?;
        let choice = chosen.as_ref().map(|chosen| chosen.choice);
        let surrogate = match chosen {
            Some(chosen) => Some(chosen.process),
            None => self.surrogate()?,
        };
        let (Some(mut gp), Some(best)) = (surrogate, self.best()) else {
            return Ok(self.random_point(0));
        };
        let observations = gp.len();
        if self.state.hyperparameters.is_none() || self.fit_due(observations) {
            self.state.hyperparameters = Some(gp.theta().to_vec());
            self.state.fitted_at = observations;
            self.state.chosen = choice;
        }
        let incumbent = if self.chooses() { gp.least_belief().1 } else { best.value };
        for point in &self.state.pending {
            let believed = gp.predict(point)?.mean;
            // a pending point on top of an observed one adds nothing
            let _known = gp.append(point, &believed);
        }
        let proposal = self.maximise(&maximiser, &gp, incumbent)?;
        Ok(self.apart(proposal.point))
    }

    fn maximise(
        &self,
        maximiser: &Maximiser,
        gp: &GaussianProcess,
        best: f64,
    ) -> Result<Proposal, StudyError> {
        let d = self.options.bounds.dimension();
        let proposal = match &self.options.objective {
            Objective::Residual => maximiser.maximise_norm(gp, best)?,
            Objective::Scalar(Criterion::ExpectedImprovement) => {
                let criterion = Acquisition::LogExpectedImprovement;
                match self.region(gp) {
                    Some(walls) if self.is_ending() => {
                        let least = Acquisition::LowerConfidence { weight: 0.0 };
                        maximiser.maximise_within(&least, gp, best, walls)?
                    }
                    Some(walls) => maximiser.maximise_within(&criterion, gp, best, walls)?,
                    None => maximiser.maximise(&criterion, gp, best)?,
                }
            }
            Objective::Scalar(Criterion::LowerConfidence(confidence)) => {
                let weight = confidence.weight(gp.len(), d);
                maximiser.maximise(&Acquisition::LowerConfidence { weight }, gp, best)?
            }
            Objective::Scalar(Criterion::TwoStep(fantasies)) => {
                maximiser.maximise_two_step(&TwoStep::new(*fantasies)?, gp, best)?
            }
        };
        Ok(proposal)
    }

    /// The region in which the next point is looked for; `None` for the whole box.
    fn region(&self, gp: &GaussianProcess) -> Option<Walls> {
        let searched = self.state.asked.saturating_sub(self.design.len());
        let centre = gp.best_points(1).pop().filter(|_| self.is_local(searched))?;
        let bounds = &self.options.bounds;
        let half_width = region::half_width(self.gains(), bounds.dimension());
        Some(region::walls(bounds, gp, &centre, half_width))
    }

    /// Tells whether the next point is of the last tenth beyond the first ones, in turns, and no
    /// other is pending: two minimisers of one mean would be the same point.
    fn is_ending(&self) -> bool {
        let searched = self.state.asked.saturating_sub(self.design.len());
        let total = self.options.budget.saturating_sub(self.design.len());
        let alone = self.state.pending.is_empty();
        self.options.reach == Reach::InTurns && alone && searched >= total - total / 10
    }

    /// Tells whether the point of this number beyond the first ones is looked for in a region.
    fn is_local(&self, searched: usize) -> bool {
        let total = self.options.budget.saturating_sub(self.design.len());
        match self.options.reach {
            Reach::Box => false,
            Reach::TrustRegion => true,
            Reach::InTurns => searched % 2 == 1 || searched >= total - total / 5 * 2,
        }
    }

    /// Tells for each outcome of a point that was looked for in a region whether it was better
    /// than all before.
    fn gains(&self) -> Vec<bool> {
        let first = self.state.earlier + self.design.len();
        let (mut best, mut gains) = (f64::INFINITY, Vec::new());
        for (i, outcome) in self.state.outcomes.iter().enumerate() {
            let value = rate(outcome).unwrap_or(f64::INFINITY);
            if i >= first && self.is_local(i - first) {
                gains.push(value < best);
            }
            best = best.min(value);
        }
        gains
    }

    /// The point, moved when it repeats a known one and replaced when it lies
    /// beside one that failed.
    fn apart(&self, point: Vec<f64>) -> Vec<f64> {
        let bounds = &self.options.bounds;
        let mut point = point;
        for attempt in 1..64 {
            let near = |other: &Vec<f64>, radius: f64| distance(bounds, &point, other) < radius;
            let failed = self.state.points.iter().zip(&self.state.outcomes);
            if failed.filter(|(_, o)| rate(o).is_none()).any(|(p, _)| near(p, FAILED_RADIUS)) {
                point = self.random_point(attempt);
            } else if self
                .state
                .points
                .iter()
                .chain(&self.state.pending)
                .any(|p| near(p, SAME_POINT))
            {
                let mut stream = self.stream(attempt);
                let unit = bounds.to_unit(&point);
                let moved = unit.iter().map(|u| u + 1e-6 * stream.normal()).collect();
                point = bounds.at_unit(&bounds.wrap_unit(moved));
            } else {
                break;
            }
        }
        point
    }

    fn random_point(&self, attempt: u64) -> Vec<f64> {
        let mut stream = self.stream(attempt);
        let unit: Vec<f64> = self.options.bounds.lower().iter().map(|_| stream.uniform()).collect();
        self.options.bounds.at_unit(&unit)
    }

    fn stream(&self, attempt: u64) -> Stream {
        Stream::new(self.options.seed, Purpose::Starts, (self.state.asked as u64) << 8 | attempt)
    }
}

/// Points and outputs.
struct Usable {
    points: Vec<Vec<f64>>,
    rows: Vec<Vec<f64>>,
}

/// The number that is minimised.
fn rate(outcome: &Outcome) -> Option<f64> {
    match outcome {
        Outcome::Value(value) => Some(*value),
        Outcome::Residual(values) => Some(norm(values)),
        Outcome::Failed => None,
    }
}

/// Outputs that the surrogate models.
fn outputs(outcome: &Outcome) -> Option<Vec<f64>> {
    match outcome {
        Outcome::Value(value) => Some(vec![*value]),
        Outcome::Residual(values) => Some(values.clone()),
        Outcome::Failed => None,
    }
}

/// Largest difference of two points as a fraction of the intervals.
fn distance(bounds: &Bounds, a: &[f64], b: &[f64]) -> f64 {
    (0..a.len()).fold(0.0, |m, i| f64::max(m, ((a[i] - b[i]) / bounds.width(i)).abs()))
}
