//! Bounded least squares on whitened residuals.

use inference::{QuadraticForm, Whitener, least_in_box, rms};
use nalgebra::{DMatrix, DVector};

use crate::{
    error::{GreyboxError, if_run},
    gram::{dot, solve, symmetric},
    machine::State,
    problem::{PerRecord, Problem, rough_noise},
    structure::{Free, Structure, Target},
};

/// Most steps.
const MOST_STEPS: usize = 30;
/// Most attempts at one step.
const MOST_ATTEMPTS: usize = 8;
/// Fall of the objective, in nats, that ends the search.
const SETTLED_NATS: f64 = 0.2;
/// Shares of its step over which a difference is taken, one after the other, each until it leads
/// no further: fine ones show a way down that whole steps hide, and are misled by the jumps of a
/// drive that sticks and slips. The last are those of the result.
const SHARES: [f64; 3] = [1.0, 0.1, 1.0];
/// Share of the way to the bar below which a step is too short to go on.
const LEAST_APPROACH: f64 = 0.05;
/// Share of the foretold fall from which on a step shows the sensitivities to be good enough.
const FORETOLD_SHARE: f64 = 0.5;

/// A structure fitted to recordings.
#[derive(Clone, Debug)]
pub(crate) struct Fitted {
    pub(crate) structure: Structure,
    pub(crate) values: Vec<f64>,
    /// Measured less predicted.
    pub(crate) residuals: PerRecord,
    /// Change of the prediction with each free number.
    pub(crate) sensitivities: Vec<PerRecord>,
    /// Half the sum of squares of whitened residual and prior.
    pub(crate) objective: f64,
    /// Cost of the noise that the loop has where the predictions stood, nats.
    pub(crate) noise_nats: f64,
}

/// Standard deviations from which on a fault level is found, and its least.
const FOUND_STD: f64 = 3.0;
const LEAST_FOUND: f64 = 1e-3;

impl Fitted {
    /// Cost of the recordings, whatever noise the loop has where their predictions stood: fits of
    /// different places compare by it.
    pub(crate) fn nats(&self) -> f64 {
        self.objective + self.noise_nats
    }

    /// Cost of the recordings under white noise as large as what is left, nats.
    fn rough_cost(&self) -> f64 {
        let residual = self.residuals.concat();
        let noise = rms(&residual).max(f64::MIN_POSITIVE);
        residual.len() as f64 * libm::log(noise) + self.structure.cost_of(&self.values)
    }

    /// The fit with some of its numbers known but those that are kept.
    pub(crate) fn only(&self, kept: &[usize]) -> Self {
        Self {
            structure: self.structure.only(kept),
            values: kept.iter().map(|&place| self.values[place]).collect(),
            sensitivities: kept.iter().map(|&place| self.sensitivities[place].clone()).collect(),
            residuals: self.residuals.clone(),
            ..*self
        }
    }

    /// Tells whether a free number is damage that is found, by the covariance of all.
    pub(crate) fn finds_damage(&self, place: usize, covariance: &DMatrix<f64>) -> bool {
        let std = libm::sqrt(covariance[(place, place)].max(0.0));
        let level = self.values[place].abs();
        matches!(self.structure.free[place].target, Target::Fault(_))
            && level > FOUND_STD * std
            && level > LEAST_FOUND
    }
}

/// Signals of all recordings through the whitener, in one row.
pub(crate) fn whitened(whitener: &Whitener, signals: &PerRecord) -> Vec<f64> {
    each_whitened(whitener, signals).concat()
}

/// Signals of all recordings through the whitener.
pub(crate) fn each_whitened(whitener: &Whitener, signals: &PerRecord) -> PerRecord {
    signals.iter().map(|signal| whitener.apply(signal)).collect()
}

/// Fits from the starts of the structure, with the sensitivities taken anew at each step.
pub(crate) fn fit(
    problem: &Problem<'_>,
    structure: Structure,
    whitener: &Whitener,
) -> Result<Fitted, GreyboxError> {
    fit_below(problem, structure, whitener, f64::INFINITY)
}

/// Fit ended as well where two steps in a row are too short to reach the `bar`, an objective
/// that another start has reached.
pub(crate) fn fit_below(
    problem: &Problem<'_>,
    structure: Structure,
    whitener: &Whitener,
    bar: f64,
) -> Result<Fitted, GreyboxError> {
    Search { problem, whitener, secant: false, bar }.run(structure, &[])
}

/// Fits where the first of the free numbers do nearly what is known of them: each step mends the
/// sensitivities by what it showed (Broyden 1965), and they are taken anew only where a step
/// falls short. Those of the result are rough. The search ends as well where a step is too short
/// to reach the `bar`, an objective that another explanation has reached.
pub(crate) fn fit_near(
    problem: &Problem<'_>,
    structure: Structure,
    whitener: &Whitener,
    known: &[PerRecord],
    bar: f64,
) -> Result<Fitted, GreyboxError> {
    Search { problem, whitener, secant: true, bar }.run(structure, known)
}

/// Fits with white noise as large as what the fit leaves, and that noise. It begins with a guess that
/// jumps of a command make far too large, beside which recordings would say less than tolerances do.
pub(crate) fn fit_roughly(
    problem: &Problem<'_>,
    structure: &Structure,
) -> Result<(Fitted, Whitener), GreyboxError> {
    let mut noise = rough_noise(problem);
    let mut fitted = fit(problem, structure.clone(), &Whitener::white(noise))?;
    for _ in 0..MOST_PASSES {
        let left = rms(&fitted.residuals.concat());
        if left > LEAST_FALL * noise || left <= 0.0 {
            break;
        }
        noise = left;
        let structure = structure.clone().started_at(&fitted.values);
        fitted = fit(problem, structure, &Whitener::white(noise))?;
    }
    Ok((fitted, Whitener::white(noise)))
}

/// A rough fit that begins where damage alone leads or where numbers of the model file alone do, whichever
/// explains more: where both are free from the start, each hides ways on which the other leads on.
pub(crate) fn fit_from_afar(
    problem: &Problem<'_>,
    structure: &Structure,
) -> Result<(Fitted, Whitener), GreyboxError> {
    let kinds: [fn(Target) -> bool; 2] =
        [|target| matches!(target, Target::Fault(_)), |target| matches!(target, Target::Rough(_))];
    let mut best: Option<Fitted> = None;
    for is_of in kinds {
        let of = structure.free.iter().enumerate().filter(|(_, free)| is_of(free.target));
        let of: Vec<usize> = of.map(|(place, _)| place).collect();
        if of.is_empty() || of.len() == structure.free.len() {
            continue;
        }
        let Some((part, _)) = if_run(fit_roughly(problem, &structure.only(&of)))? else { continue };
        if best.as_ref().is_none_or(|best| part.rough_cost() < best.rough_cost()) {
            best = Some(part);
        }
    }
    match best {
        Some(Fitted { structure: part, values, .. }) => {
            fit_roughly(problem, &structure.clone().started_at_part(&part, &values))
        }
        None => fit_roughly(problem, structure),
    }
}

/// How often a noise is told anew, and the share of it that less has to be left for that.
const MOST_PASSES: usize = 4;
const LEAST_FALL: f64 = 0.8;

/// Objective of a structure at values.
pub(crate) fn objective_at(
    problem: &Problem<'_>,
    structure: &Structure,
    values: &[f64],
    whitener: &Whitener,
) -> Result<f64, GreyboxError> {
    let search = Search { problem, whitener, secant: false, bar: f64::INFINITY };
    Ok(search.stand(structure, values.to_vec())?.objective)
}

/// A search by damped Gauss-Newton steps.
struct Search<'a> {
    problem: &'a Problem<'a>,
    whitener: &'a Whitener,
    secant: bool,
    bar: f64,
}

/// Where a search stands.
struct Stand {
    values: Vec<f64>,
    drive: PerRecord,
    residuals: PerRecord,
    white: Vec<f64>,
    objective: f64,
}

impl Search<'_> {
    fn run(&self, structure: Structure, known: &[PerRecord]) -> Result<Fitted, GreyboxError> {
        let start = structure.free.iter().map(|f| f.start.clamp(f.least, f.most)).collect();
        let mut stand = self.stand(&structure, start)?;
        let mut sensitivities = known.to_vec();
        sensitivities.extend(self.problem.sensitivities(
            &structure,
            known.len(),
            1.0,
            &stand.values,
            &stand.drive,
        )?);
        let mut damping = 1e-4;
        let mut fresh = known.is_empty();
        let mut was_slow = false;
        let mut shares = SHARES.into_iter();
        let mut share = shares.next().unwrap_or(1.0);
        for _ in 0..MOST_STEPS {
            let (values, white) = (&stand.values, &stand.white);
            let normal = Normal::new(self.whitener, &structure.free, values, &sensitivities, white);
            let Some((next, foretold)) = self.lower(&structure, &stand, &normal, &mut damping)?
            else {
                if fresh {
                    let next = if self.secant { None } else { shares.next() };
                    let Some(next) = next else { break };
                    share = next;
                }
                sensitivities = self.anew(&structure, &stand, share)?;
                (fresh, damping) = (true, 1e-4);
                continue;
            };
            let fallen = stand.objective - next.objective;
            let good = self.secant && fallen >= FORETOLD_SHARE * foretold;
            if good {
                mend(&mut sensitivities, &structure.free, &stand, &next);
            }
            stand = next;
            let is_slow = fallen < LEAST_APPROACH * (stand.objective - self.bar);
            let out_of_reach = is_slow && (self.secant || was_slow);
            was_slow = is_slow;
            let settled = fallen < SETTLED_NATS;
            if out_of_reach || (settled && self.secant && fresh) {
                break;
            }
            if settled && !self.secant {
                let Some(next) = shares.next() else { break };
                share = next;
            }
            // sensitivities mended again and again may show no way down where there is one
            let anew = !good || settled;
            if anew {
                sensitivities = self.anew(&structure, &stand, share)?;
            }
            fresh = anew;
        }
        let Stand { values, residuals, objective, .. } = stand;
        let noise_nats = self.problem.noise_nats();
        Ok(Fitted { structure, values, residuals, sensitivities, objective, noise_nats })
    }

    fn stand(&self, structure: &Structure, values: Vec<f64>) -> Result<Stand, GreyboxError> {
        let state = structure.state(self.problem.machine, &values);
        Ok(self.at(structure, values, self.problem.drives(&[state])?.remove(0)))
    }

    /// Where each of several values leads, one after the other.
    fn stands(
        &self,
        structure: &Structure,
        tried: Vec<Vec<f64>>,
    ) -> impl Iterator<Item = Result<Stand, GreyboxError>> {
        let state = |values: &Vec<f64>| structure.state(self.problem.machine, values);
        let states: Vec<State> = tried.iter().map(state).collect();
        let drives = self.problem.drives_of_each(&states);
        let at = |(values, drive): (Vec<f64>, Result<PerRecord, GreyboxError>)| {
            Ok(self.at(structure, values, drive?))
        };
        tried.into_iter().zip(drives).map(at)
    }

    fn at(&self, structure: &Structure, values: Vec<f64>, drive: PerRecord) -> Stand {
        let residuals = self.problem.residuals(&drive);
        let white = whitened(self.whitener, &residuals);
        let objective = half_square(&white) + structure.cost_of(&values);
        Stand { values, drive, residuals, white, objective }
    }

    fn anew(
        &self,
        structure: &Structure,
        stand: &Stand,
        share: f64,
    ) -> Result<Vec<PerRecord>, GreyboxError> {
        self.problem.sensitivities(structure, 0, share, &stand.values, &stand.drive)
    }

    /// The first of ever shorter steps that lowers the objective, with the fall foretold of it.
    fn lower(
        &self,
        structure: &Structure,
        stand: &Stand,
        normal: &Normal,
        damping: &mut f64,
    ) -> Result<Option<(Stand, f64)>, GreyboxError> {
        // the first step mostly lowers it; where it does not, all others are run side by side
        for together in [1, MOST_ATTEMPTS - 1] {
            let later = |at: &f64| Some(shortened(*at));
            let dampings: Vec<f64> =
                core::iter::successors(Some(*damping), later).take(together).collect();
            let step = |at: &f64| normal.bounded(&structure.free, &stand.values, *at);
            let stands = self.stands(structure, dampings.iter().map(step).collect());
            for (next, at) in stands.zip(dampings) {
                // a machine that cannot be run so is no step
                let next = if_run(next)?.filter(|next| next.objective < stand.objective);
                if let Some(next) = next {
                    *damping = at * 0.1;
                    let foretold = normal.foretold(&stand.values, &next.values);
                    return Ok(Some((next, foretold)));
                }
                *damping = shortened(at);
            }
        }
        Ok(None)
    }
}

/// The damping of a step that is shorter than that of another.
fn shortened(damping: f64) -> f64 {
    (damping * 10.0).max(1e-3)
}

/// Broyden's update: the sensitivities change least, in units of the steps of the free numbers,
/// to give what the step did.
fn mend(sensitivities: &mut [PerRecord], free: &[Free], from: &Stand, to: &Stand) {
    let moved: Vec<f64> = to.values.iter().zip(&from.values).map(|(b, a)| b - a).collect();
    let length: f64 = moved.iter().zip(free).map(|(d, f)| (d / f.step) * (d / f.step)).sum();
    if length <= 0.0 {
        return;
    }
    for record in 0..from.drive.len() {
        let mut missed: Vec<f64> =
            to.drive[record].iter().zip(&from.drive[record]).map(|(b, a)| b - a).collect();
        for (column, d) in sensitivities.iter().zip(&moved) {
            for (miss, slope) in missed.iter_mut().zip(&column[record]) {
                *miss -= slope * d;
            }
        }
        for ((column, d), free) in sensitivities.iter_mut().zip(&moved).zip(free) {
            let weight = d / (free.step * free.step * length);
            for (slope, miss) in column[record].iter_mut().zip(&missed) {
                *slope += weight * miss;
            }
        }
    }
}

fn half_square(white: &[f64]) -> f64 {
    0.5 * dot(white, white)
}

/// Normal equations of a step.
pub(crate) struct Normal {
    pub(crate) curvature: DMatrix<f64>,
    pub(crate) descent: DVector<f64>,
}

impl Normal {
    fn new(
        whitener: &Whitener,
        free: &[Free],
        values: &[f64],
        sensitivities: &[PerRecord],
        white: &[f64],
    ) -> Self {
        let columns: Vec<Vec<f64>> =
            sensitivities.iter().map(|column| whitened(whitener, column)).collect();
        let n = columns.len();
        let mut curvature = DMatrix::zeros(n, n);
        let mut descent = DVector::zeros(n);
        for i in 0..n {
            descent[i] = dot(&columns[i], white);
            for j in 0..=i {
                let product = dot(&columns[i], &columns[j]);
                curvature[(i, j)] = product;
                curvature[(j, i)] = product;
            }
        }
        Self { curvature, descent }.with_priors(free, values)
    }

    /// Normal equations with what is known of the numbers beforehand.
    pub(crate) fn with_priors(mut self, free: &[Free], values: &[f64]) -> Self {
        for (i, (free, value)) in free.iter().zip(values).enumerate() {
            if let Some(prior) = free.prior {
                self.curvature[(i, i)] += prior.weight(*value);
                self.descent[i] -= prior.slope(*value);
            }
        }
        self
    }

    /// Fall of the objective that a linear model foretells.
    fn foretold(&self, from: &[f64], to: &[f64]) -> f64 {
        let step = DVector::from_fn(from.len(), |i, _| to[i] - from[i]);
        self.descent.dot(&step) - 0.5 * step.dot(&(&self.curvature * &step))
    }

    /// Where the damped step within the bounds and within reach leads.
    pub(crate) fn bounded(&self, free: &[Free], values: &[f64], damping: f64) -> Vec<f64> {
        let mut curvature = self.curvature.clone();
        for i in 0..values.len() {
            curvature[(i, i)] *= 1.0 + damping;
        }
        let places = || free.iter().zip(values);
        let (least, most): (Vec<f64>, Vec<f64>) = places().map(|(f, v)| f.room(*v)).unzip();
        let (curvature, descent) = (symmetric(&curvature), self.descent.as_slice().to_vec());
        let step = least_in_box(&QuadraticForm { curvature, descent }, &least, &most);
        let next = places().zip(step.iter());
        next.map(|((free, value), step)| (value + step).clamp(free.least, free.most)).collect()
    }
}

/// Covariance of the fitted numbers that holds without a right noise model: curvature about the
/// scatter of the gradients of half-second blocks (sandwich). What stands on a bound has none.
pub(crate) fn sandwich(
    fitted: &Fitted,
    problem: &Problem<'_>,
    whitener: &Whitener,
) -> DMatrix<f64> {
    let n = fitted.values.len();
    let mut curvature = DMatrix::<f64>::zeros(n, n);
    let mut scatter = DMatrix::<f64>::zeros(n, n);
    for (record, prepared) in problem.records.iter().enumerate() {
        let residual = whitener.apply(&fitted.residuals[record]);
        let columns: Vec<Vec<f64>> =
            fitted.sensitivities.iter().map(|column| whitener.apply(&column[record])).collect();
        let block = (libm::round(0.5 * prepared.rate_hz()) as usize).max(1);
        for i in 0..n {
            for j in 0..n {
                curvature[(i, j)] += dot(&columns[i], &columns[j]);
            }
        }
        for start in (0..residual.len()).step_by(block) {
            let range = start..(start + block).min(residual.len());
            let gradient = DVector::from_fn(n, |i, _| {
                dot(&columns[i][range.clone()], &residual[range.clone()])
            });
            scatter += &gradient * gradient.transpose();
        }
    }
    for (i, free) in fitted.structure.free.iter().enumerate() {
        if let Some(prior) = free.prior {
            let weight = prior.weight(fitted.values[i]);
            curvature[(i, i)] += weight;
            scatter[(i, i)] += weight;
        }
    }
    let inverse = inverse(&curvature);
    // never smaller than the noise alone makes it
    let robust = &inverse * scatter * &inverse;
    DMatrix::from_fn(n, n, |i, j| {
        if i == j { robust[(i, i)].max(inverse[(i, i)]) } else { robust[(i, j)] }
    })
}

pub(crate) fn inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let n = matrix.nrows();
    let mut inverse = DMatrix::zeros(n, n);
    for i in 0..n {
        let mut unit = DVector::zeros(n);
        unit[i] = 1.0;
        inverse.set_column(i, &solve(matrix, &unit));
    }
    inverse
}
