//! Recordings that begin otherwise than the bundle's test: before or after the command, with the
//! surface elsewhere in its play, with a charged integrator.
//!
//! ```text
//! r(c, n) = y(t + τ) − (y_LF + m)(t; c, s, ξ),   n = (2·τ/τ_max, s, ξ/ξ_p) ~ N(0, I)
//! ```
//!
//! with `τ` the time by which the command comes late in the recording, `s` the place in the play
//! and `ξ` the integral part of the current set-point. Where they are asked for, `c` and `n` are
//! searched together, and the covariance of `c` is that with `n` marginalised. Where they are not,
//! what a delay or another start would change is compared with what is left of the signal, without
//! a run of the monitor, and a notice says where it is found there.

use std::collections::BTreeMap;

use ema_sim::{FaultCoordinates, Imperfections, InitialState, Scenario, SimulationError};
use gp_bayesopt::{Bounds, LevenbergMarquardt, SolveError};
use nalgebra::{DMatrix, DVector};

use super::{
    DIFFERENCE_STEP, DiagnoseError, DiagnoseOptions, Diagnoser, FitResult, Hypothesis, LEAST,
    MISFIT_DEVIATIONS, Run, START, STEP_TOLERANCE, within_training,
};
use crate::{
    offline::bundle::BundleError,
    online::likelihood::{Likelihood, misfit},
    report::{Fidelity, Method, Notice, NoticeCode},
    simulation::{experiment::Experiment, high_fidelity_signal::HighFidelitySignal},
    statistics::{banded::dot, central},
};

/// Longest delay that is looked for, s: a search finds it from delays in even steps.
const MOST_DELAY_S: f64 = 0.05;
/// Steps of the delays that a search starts from, s: a tenth of the filter's shortest period.
const DELAY_STEP_S: f64 = 5e-4;
/// Differences in units of the prior: of the place in the play and of the integrator.
const START_STEP: f64 = 0.1;
/// Places in the play and charges of the integrator that a search starts from, in units of the
/// prior.
const STARTS: [[f64; 2]; 9] = [
    [0.0, 0.0],
    [-1.0, 0.0],
    [1.0, 0.0],
    [0.0, -1.0],
    [0.0, 1.0],
    [-1.0, -1.0],
    [1.0, -1.0],
    [-1.0, 1.0],
    [1.0, 1.0],
];
/// Difference of the delay, in samples.
const DELAY_DIFFERENCE: f64 = 0.25;
/// Evaluations of both models that tell what a start adds to the monitor's error.
const ERROR_EVALUATIONS: u64 = 4;
/// Most evaluations of a search with the start.
const MOST_EVALUATIONS: usize = 400;
/// Most standard deviations of the prior that the integrator is looked for at.
const MOST_DEVIATIONS: f64 = 3.0;
/// Standard deviations from zero at which another start is told.
const SUSPECT: f64 = 4.0;

/// Refuses settings that do not go together.
pub(super) fn check(options: &DiagnoseOptions) -> Result<(), DiagnoseError> {
    let found_s = options.max_delay_s;
    if !(0.0..=MOST_DELAY_S).contains(&found_s) {
        return Err(DiagnoseError::MostDelay { found_s, most_s: MOST_DELAY_S });
    }
    let plain = options.method == Method::Composite && options.fidelity == Fidelity::Low;
    if is_free(options) && !plain {
        return Err(DiagnoseError::StartMethod);
    }
    Ok(())
}

/// Whether the start is estimated with the faults.
pub(super) fn is_free(options: &DiagnoseOptions) -> bool {
    options.max_delay_s > 0.0 || options.free_start
}

/// What of a start may be otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unknown {
    Delay,
    Side,
    Integral,
}

/// What may be otherwise, each with what one unit of it is.
struct Freedom {
    unknowns: Vec<(Unknown, f64)>,
    /// Largest delay, s.
    most_s: f64,
}

/// How a recording begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Start {
    /// The command comes late by this, s.
    delay_s: f64,
    /// Place of the surface in its play, −1 to 1, away from the bundle's.
    side: f64,
    /// Integral part of the current set-point, A, away from the bundle's.
    integral_a: f64,
}

/// How a recording was found to begin.
#[derive(Clone, Debug)]
pub(super) struct Began {
    /// What was looked for, with estimate and standard deviation.
    found: Vec<(Unknown, f64, f64)>,
}

impl Freedom {
    fn of(options: &DiagnoseOptions, experiment: &Experiment) -> Self {
        let mut unknowns = Vec::new();
        if options.max_delay_s > 0.0 {
            unknowns.push((Unknown::Delay, 0.5 * options.max_delay_s));
        }
        if options.free_start {
            unknowns.extend(start_unknowns(experiment));
        }
        Self { unknowns, most_s: options.max_delay_s }
    }

    fn start(&self, units: &[f64]) -> Start {
        let mut start = Start::default();
        for (&(unknown, unit), &value) in self.unknowns.iter().zip(units) {
            *start.place(unknown) = unit * value;
        }
        start
    }

    /// Largest value of each, in its units.
    fn most(&self) -> Vec<f64> {
        let most = |&(unknown, unit): &(Unknown, f64)| match unknown {
            Unknown::Delay => self.most_s / unit,
            Unknown::Side => 1.0,
            Unknown::Integral => MOST_DEVIATIONS,
        };
        self.unknowns.iter().map(most).collect()
    }

    /// Difference of each, in its units.
    fn steps(&self, rate_hz: f64) -> impl Iterator<Item = f64> {
        self.unknowns.iter().map(move |&(unknown, unit)| match unknown {
            Unknown::Delay => DELAY_DIFFERENCE / rate_hz / unit,
            Unknown::Side | Unknown::Integral => START_STEP,
        })
    }
}

/// Place in the play, and the integrator: it may hold what static friction lets stand.
fn start_unknowns(experiment: &Experiment) -> [(Unknown, f64); 2] {
    let actuator = &experiment.actuator;
    let held_a = actuator.transmission.static_friction_n_m / actuator.torque_constant_n_m_per_a();
    [(Unknown::Side, 1.0), (Unknown::Integral, held_a)]
}

impl Start {
    fn place(&mut self, unknown: Unknown) -> &mut f64 {
        match unknown {
            Unknown::Delay => &mut self.delay_s,
            Unknown::Side => &mut self.side,
            Unknown::Integral => &mut self.integral_a,
        }
    }

    /// The experiment with this start.
    fn of(&self, experiment: &Experiment) -> Experiment {
        let own = &experiment.scenario;
        let initial = InitialState {
            speed_integral_a: own.initial.speed_integral_a + self.integral_a,
            ..own.initial
        };
        let scenario = Scenario {
            backlash_side_ratio: (own.backlash_side_ratio + self.side).clamp(-1.0, 1.0),
            initial,
            ..own.clone()
        };
        Experiment { scenario, ..experiment.clone() }
    }

    /// The monitor's signal with this start.
    fn signal(
        &self,
        experiment: &Experiment,
        start_angle_rad: f64,
        faults: &FaultCoordinates,
    ) -> Result<Vec<f64>, SimulationError> {
        Ok(self.of(experiment).monitor(start_angle_rad)?.signal(faults))
    }
}

impl Began {
    /// By how much the command comes late, s.
    pub(super) fn delay_s(&self) -> f64 {
        let delay = self.found.iter().find(|(unknown, ..)| *unknown == Unknown::Delay);
        delay.map_or(0.0, |&(_, value, _)| value)
    }

    /// What the answer says of it.
    pub(super) fn notices(&self, experiment: &Experiment) -> Vec<Notice> {
        let parts: Vec<String> = self
            .found
            .iter()
            .map(|&(unknown, value, std)| match unknown {
                Unknown::Delay => {
                    format!("{} ms (± {:.2})", delay_in_words(value), 1e3 * std)
                }
                Unknown::Side => {
                    let side = experiment.scenario.backlash_side_ratio + value;
                    format!("the surface at {side:.1} of its play (± {std:.1})")
                }
                Unknown::Integral => format!("the integrator at {value:.2} A (± {std:.2})"),
            })
            .collect();
        let message = format!("estimated with the faults: {}", parts.join(", "));
        vec![Notice { code: NoticeCode::OutsideTraining, message }]
    }
}

/// A delay, s, in words and ms.
fn delay_in_words(delay_s: f64) -> String {
    let side = if delay_s >= 0.0 { "before" } else { "after" };
    format!("the recording begins {side} the command by {:.2}", 1e3 * delay_s.abs())
}

/// A search over faults and start.
struct FreeFit<'a> {
    run: &'a Run<'a>,
    hypothesis: &'a Hypothesis<'a>,
    freedom: Freedom,
    /// Coordinates looked for.
    order: usize,
    /// What the start adds to the monitor's error, A.
    error_a: Vec<f64>,
}

/// Where a search over faults and start ended.
struct Settled {
    point: Vec<f64>,
    residual_a: Vec<f64>,
    misfit: f64,
    error_a: Vec<f64>,
    evaluations: u64,
}

impl FreeFit<'_> {
    fn experiment(&self) -> &Experiment {
        &self.run.diagnoser.bundle.experiment
    }

    /// Monitor and mean error at a point of the coordinates.
    fn modelled(&self, point: &[f64], start: &Start) -> Result<Vec<f64>, SimulationError> {
        let faults = FaultCoordinates(self.run.all_coordinates(point));
        let experiment = self.experiment();
        let angle_rad = self.hypothesis.start_angle_rad;
        let mut signal = start.signal(experiment, angle_rad, &faults)?;
        let mean = self.hypothesis.error.mean_at(&within_training(point));
        for ((value, mean), error) in signal.iter_mut().zip(mean).zip(&self.error_a) {
            *value += mean + error;
        }
        Ok(signal)
    }

    /// What a start adds to the monitor's error at a point, from the high-fidelity model without
    /// noise: two runs of it, and two of the monitor.
    fn error_of_start(&self, point: &[f64]) -> Result<Vec<f64>, SimulationError> {
        let (point, units) = point.split_at(self.order);
        let Diagnoser { bundle, .. } = self.run.diagnoser;
        let electronics = bundle.datasets.first().map_or(Imperfections::NONE, |d| d.imperfections);
        let angle_rad = self.hypothesis.start_angle_rad;
        let rate_hz = self.run.observation.phase_rate_hz;
        let faults = FaultCoordinates(self.run.all_coordinates(point));
        let error = |start: &Start| -> Result<Vec<f64>, SimulationError> {
            let begun = start.of(&bundle.experiment);
            let high = HighFidelitySignal::new(&begun, angle_rad, electronics, rate_hz)?;
            Ok(high.residual(&begun.monitor(angle_rad)?.signal(&faults), point))
        };
        let (own, other) = (error(&Start::default())?, error(&self.freedom.start(units))?);
        // residuals are monitor less high fidelity
        Ok(own.iter().zip(&other).map(|(own, other)| own - other).collect())
    }

    /// What is measured from where the command begins on, less what is modelled.
    fn left(&self, modelled: &[f64], delay_s: f64) -> Vec<f64> {
        let mut left = self.run.observation.advanced(delay_s, self.experiment());
        for (value, modelled) in left.iter_mut().zip(modelled) {
            *value -= modelled;
        }
        left
    }

    /// What is left at a point of coordinates and start.
    fn residual(&self, point: &[f64]) -> Result<Vec<f64>, SimulationError> {
        let (point, units) = point.split_at(self.order);
        let start = self.freedom.start(units);
        let residual = self.left(&self.modelled(point, &start)?, start.delay_s);
        (self.run.watch.residual)(&residual);
        Ok(residual)
    }

    /// For each side of the play the start, at even delays and charges, that explains the recording
    /// best with some faults: point and cost, added to those found already.
    fn nearest(
        &self,
        likelihood: &Likelihood,
        point: &[f64],
        found: &mut BTreeMap<i32, (Vec<f64>, f64)>,
    ) -> Result<u64, SimulationError> {
        let starts: &[[f64; 2]] = if self.run.options.free_start { &STARTS } else { &[[0.0, 0.0]] };
        let steps = (self.freedom.most_s / DELAY_STEP_S).floor() as i32;
        for &[side, charge] in starts {
            let units_at = |delay_s: f64| {
                let unit_of = |&(unknown, unit): &(Unknown, f64)| match unknown {
                    Unknown::Delay => delay_s / unit,
                    Unknown::Side => side,
                    Unknown::Integral => charge,
                };
                self.freedom.unknowns.iter().map(unit_of).collect::<Vec<f64>>()
            };
            let modelled = self.modelled(point, &self.freedom.start(&units_at(0.0)))?;
            for step in -steps..=steps {
                let delay_s = f64::from(step) * DELAY_STEP_S;
                let white = likelihood.whiten(&self.left(&modelled, delay_s));
                let cost = dot(&white, &white);
                let known = found.get(&(side as i32));
                if known.is_none_or(|(_, least)| cost < *least) {
                    found.insert(side as i32, ([point, &units_at(delay_s)[..]].concat(), cost));
                }
            }
        }
        Ok(starts.len() as u64)
    }

    /// The search from a start, and again with what the start found adds to the monitor's error.
    fn settle(&mut self, likelihood: &Likelihood, from: &[f64]) -> Result<Settled, DiagnoseError> {
        self.error_a.fill(0.0);
        let (mut point, mut evaluations) = self.search(likelihood, from)?;
        if self.run.options.free_start {
            self.error_a = self.error_of_start(&point).map_err(BundleError::from)?;
            let (again, spent) = self.search(likelihood, &point)?;
            point = again;
            evaluations += spent + ERROR_EVALUATIONS;
        }
        let residual_a = self.residual(&point).map_err(BundleError::from)?;
        let white = likelihood.whiten(&residual_a);
        let misfit = misfit(&white);
        let error_a = self.error_a.clone();
        Ok(Settled { point, residual_a, misfit, error_a, evaluations: evaluations + 1 })
    }

    /// Levenberg-Marquardt from a start, the prior among the residuals.
    fn search(
        &self,
        likelihood: &Likelihood,
        from: &[f64],
    ) -> Result<(Vec<f64>, u64), DiagnoseError> {
        let failed = |reason: String| DiagnoseError::Search { reason };
        let sought = self.experiment().sought_indices();
        let most = self.freedom.most();
        let least = sought.iter().map(|&index| LEAST[index]).chain(most.iter().map(|m| -m));
        let largest = vec![1.0; self.order].into_iter().chain(most.iter().copied());
        let bounds = Bounds::new(&least.collect::<Vec<_>>(), &largest.collect::<Vec<_>>())
            .map_err(|error| failed(error.to_string()))?;
        let solver = LevenbergMarquardt {
            steps: Some(self.steps()),
            max_evaluations: self.run.options.max_evaluations.unwrap_or(MOST_EVALUATIONS),
            step_tolerance: STEP_TOLERANCE,
            ..LevenbergMarquardt::default()
        };
        let residual = |point: &[f64]| -> Result<Vec<f64>, SimulationError> {
            let mut white = likelihood.whiten(&self.residual(point)?);
            white.extend(&point[self.order..]);
            Ok(white)
        };
        let solution = solver
            .solve(residual, from, &bounds)
            .map_err(|error: SolveError<_>| failed(error.to_string()))?;
        Ok((solution.point, solution.evaluations as u64))
    }

    fn steps(&self) -> Vec<f64> {
        let rate_hz = self.experiment().filter.output_hz;
        let levels = std::iter::repeat_n(DIFFERENCE_STEP, self.order);
        levels.chain(self.freedom.steps(rate_hz)).collect()
    }
}

impl Run<'_> {
    /// Goes on from a fit with the start unknown.
    pub(super) fn freed(
        &self,
        hypothesis: &Hypothesis<'_>,
        likelihood: &Likelihood,
        fit: &FitResult,
    ) -> Result<FitResult, DiagnoseError> {
        let experiment = &self.diagnoser.bundle.experiment;
        let freedom = Freedom::of(self.options, experiment);
        let order = fit.estimate.len();
        let error_a = vec![0.0; self.observation.signal_a.len()];
        let mut free = FreeFit { run: self, hypothesis, freedom, order, error_a };
        let middle: Vec<f64> =
            experiment.sought_indices().into_iter().map(|index| START[index]).collect();
        let mut evaluations = fit.evaluations;
        let mut starts = BTreeMap::new();
        // faults found with the wrong start may be far off
        for point in [&fit.estimate, &middle] {
            let spent = free.nearest(likelihood, point, &mut starts);
            evaluations += spent.map_err(BundleError::from)?;
        }
        let mut starts: Vec<(Vec<f64>, f64)> = starts.into_values().collect();
        starts.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut best: Option<Settled> = None;
        for (from, _) in starts {
            let settled = free.settle(likelihood, &from)?;
            evaluations += settled.evaluations;
            if best.as_ref().is_none_or(|best| settled.misfit < best.misfit) {
                best = Some(settled);
            }
            let limit = likelihood.largest_misfit(MISFIT_DEVIATIONS);
            if best.as_ref().is_some_and(|best| best.misfit <= limit) {
                break;
            }
        }
        let Some(Settled { point, residual_a, misfit, error_a, .. }) = best else {
            return Err(DiagnoseError::Undetermined);
        };
        free.error_a = error_a;
        // the signal's slopes are those of the residual, turned round
        let turned = |at: &[f64]| {
            let residual = free.residual(at)?;
            Ok::<_, SimulationError>(residual.into_iter().map(|value| -value).collect())
        };
        let slopes =
            central::differences_of(&point, &free.steps(), turned).map_err(BundleError::from)?;
        let precision: Vec<f64> =
            (0..point.len()).map(|i| f64::from(u8::from(i >= order))).collect();
        let count = slopes.len() as u64;
        let whole = likelihood
            .estimate_covariance_given(&likelihood.slopes(slopes), &precision)
            .ok_or(DiagnoseError::Undetermined)?;
        let found = free.freedom.unknowns.iter().enumerate().map(|(place, &(unknown, unit))| {
            let place = order + place;
            (unknown, unit * point[place], unit * whole[(place, place)].sqrt())
        });
        let began = Began { found: found.collect() };
        let covariance = whole.view((0, 0), (order, order)).into_owned();
        Ok(FitResult {
            misfit,
            estimate: point[..order].to_vec(),
            residual_a,
            evaluations: evaluations + 2 * count,
            cut_short: false,
            slopes: None,
            began: Some((began, covariance)),
        })
    }

    /// What is told where a delay, another side of the play or a charged integrator is found in
    /// what is left of the signal, to first order.
    pub(super) fn suspected_start(
        &self,
        likelihood: &Likelihood,
        slopes: &[Vec<f64>],
        residual_a: &[f64],
    ) -> Result<Vec<Notice>, DiagnoseError> {
        let effects = self.diagnoser.start_effects()?;
        let rate_hz = self.diagnoser.bundle.experiment.filter.output_hz;
        let delay = delay_effect(&self.observation.signal_a, residual_a, rate_hz);
        let order = slopes.len();
        let columns: Vec<&Vec<f64>> = slopes.iter().chain([&delay]).chain(effects).collect();
        let left = residual_a.to_vec();
        let whole = columns.iter().copied().chain([&left]);
        let white = likelihood.factor().whiten_each(whole);
        let mut strongest: Option<(usize, f64)> = None;
        for extra in order..columns.len() {
            let Some((value, std)) = apart(&white[..order], &white[extra], &white[columns.len()])
            else {
                continue;
            };
            let distance = (value / std).abs();
            if distance > SUSPECT && strongest.is_none_or(|(_, most)| distance > most) {
                strongest = Some((extra, distance));
            }
        }
        let Some((extra, _)) = strongest else { return Ok(Vec::new()) };
        let mut joint = slopes.to_vec();
        joint.push(columns[extra].clone());
        let joint = likelihood.slopes(joint);
        let (Some(covariance), Some(step)) =
            (likelihood.estimate_covariance(&joint), joint.step(&white[columns.len()]))
        else {
            return Ok(Vec::new());
        };
        let distance = step[order].abs() / covariance[(order, order)].sqrt();
        if distance <= SUSPECT {
            return Ok(Vec::new());
        }
        let moved = step.rows(0, order).amax();
        Ok(vec![suspicion(extra - order, step[order], distance, moved)])
    }
}

/// What a unit of delay, 1 s, changes of the signal at an answer: differences over a sample to
/// either side, which half of the filter's corner loses a seventh of.
fn delay_effect(signal_a: &[f64], residual_a: &[f64], rate_hz: f64) -> Vec<f64> {
    let modelled: Vec<f64> = signal_a.iter().zip(residual_a).map(|(y, r)| y - r).collect();
    let last = modelled.len().saturating_sub(1);
    let rise = |n: usize| modelled[(n + 1).min(last)] - modelled[n.saturating_sub(1)];
    (0..=last).map(|n| -0.5 * rate_hz * rise(n)).collect()
}

/// Coefficient of one white column beside others in a white residual, and its standard deviation;
/// `None` where the others leave nothing of it.
fn apart(others: &[Vec<f64>], column: &[f64], left: &[f64]) -> Option<(f64, f64)> {
    let order = others.len();
    let gram = DMatrix::from_fn(order, order, |i, j| dot(&others[i], &others[j]));
    let project = |vector: &[f64]| {
        DVector::from_iterator(order, others.iter().map(|other| dot(other, vector)))
    };
    let cholesky = gram.cholesky()?;
    let shared = project(column);
    let weights = cholesky.solve(&shared);
    let information = dot(column, column) - weights.dot(&shared);
    let gradient = dot(column, left) - weights.dot(&project(left));
    (information > 0.0).then(|| (gradient / information, information.sqrt().recip()))
}

/// What is said of a start that is suspected: of a delay, of the side, of the integrator.
fn suspicion(which: usize, value: f64, distance: f64, moved: f64) -> Notice {
    let (what, option) = match which {
        0 => (format!("{} ms", delay_in_words(value)), "--max-delay-s"),
        1 => ("the surface began elsewhere in its play".to_owned(), "--free-start"),
        _ => (format!("the integrator began at {value:.2} A"), "--free-start"),
    };
    let message = format!(
        "the recording is explained better ({distance:.0} standard deviations) if {what}: levels \
         would change by up to {moved:.4}; `{option}` estimates it with the faults"
    );
    Notice { code: NoticeCode::OutsideTraining, message }
}

impl Diagnoser {
    /// What another place in the play and a charge of the integrator change of the signal, for one
    /// unit of each, at damage in the middle of the range.
    fn start_effects(&self) -> Result<&[Vec<f64>], DiagnoseError> {
        if let Some(effects) = self.start_effects.get() {
            return Ok(effects);
        }
        let experiment = &self.bundle.experiment;
        let mut all = START;
        for (index, value) in all.iter_mut().enumerate() {
            *value = if experiment.sought[index] { *value } else { 0.0 };
        }
        let faults = FaultCoordinates(all);
        let angle_rad = experiment.scenario.start_angle_rad;
        let effect = |unknown: Unknown, change: f64| -> Result<Vec<f64>, SimulationError> {
            let side = |sign: f64| {
                let mut start = Start::default();
                *start.place(unknown) = sign * change;
                start.signal(experiment, angle_rad, &faults)
            };
            let (up, down) = (side(1.0)?, side(-1.0)?);
            Ok(up.iter().zip(&down).map(|(u, d)| 0.5 * (u - d) / change).collect())
        };
        let effects = start_unknowns(experiment).map(|(unknown, unit)| match unknown {
            Unknown::Integral => effect(unknown, START_STEP * unit),
            _ => effect(unknown, unit),
        });
        let effects =
            effects.into_iter().collect::<Result<Vec<_>, _>>().map_err(BundleError::from)?;
        Ok(self.start_effects.get_or_init(|| effects))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_apart_of_a_column_is_found() {
        let others = [vec![1.0, 0.0, 0.0, 0.0], vec![0.0, 1.0, 0.0, 0.0]];
        let column = [5.0, -7.0, 2.0, 0.0];
        let left = [1.0, 1.0, 3.0, 9.0];
        let (value, std) = apart(&others, &column, &left).unwrap();
        assert!((value - 1.5).abs() < 1e-12 && (std - 0.5).abs() < 1e-12);
        assert!(apart(&others, &[1.0, 2.0, 0.0, 0.0], &left).is_none());
    }
}
