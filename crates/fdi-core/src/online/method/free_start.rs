//! Faults and the start of the recording, searched together.
//!
//! ```text
//! r(c, n) = y(t + τ) − (y_LF + m)(t; c, s, ξ),   n = (2·τ/τ_max, s, ξ/ξ_p) ~ N(0, I)
//! ```
//!
//! The covariance of `c` is that with `n` marginalised.
//!
//! # Source
//!
//! `docs/decisions/0067-another-start-of-the-test.md`.

use std::collections::BTreeMap;

use ema_sim::{FaultCoordinates, Imperfections, SimulationError};
use gp_bayesopt::{Bounds, LevenbergMarquardt, SolveError};
use inference::{dot, try_central_differences};

use crate::{
    offline::bundle::BundleError,
    online::{
        beginning::{Began, Freedom, Start, Unknown},
        damage::{DIFFERENCE_STEP, LEAST, START, STEP_TOLERANCE, within_training},
        error::DiagnoseError,
        fit::FitResult,
        likelihood::{Likelihood, misfit},
        outcome::MISFIT_DEVIATIONS,
        run::{Hypothesis, Run},
    },
    simulation::{experiment::Experiment, high_fidelity_signal::HighFidelitySignal},
};

/// Steps of the delays that a search starts from, s: a tenth of the filter's shortest period.
const DELAY_STEP_S: f64 = 5e-4;
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
/// Evaluations of both models that tell what a start adds to the low-fidelity model's error.
const ERROR_EVALUATIONS: u64 = 4;

/// A search over faults and start.
struct FreeFit<'a> {
    run: &'a Run<'a>,
    hypothesis: &'a Hypothesis,
    freedom: &'a Freedom,
    /// Coordinates looked for.
    order: usize,
    /// Error of the low-fidelity model that the start adds, A.
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
        self.run.experiment()
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

    /// Error of the low-fidelity model that a start adds at a point, from the high-fidelity model
    /// without noise: two runs of it, and two of the low-fidelity model.
    fn error_of_start(&self, point: &[f64]) -> Result<Vec<f64>, SimulationError> {
        let (point, units) = point.split_at(self.order);
        let bundle = &self.run.learnt.bundle;
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
        // residuals are low less high fidelity
        Ok(own.iter().zip(&other).map(|(own, other)| own - other).collect())
    }

    /// Measured signal from where the command begins on, less a modelled one.
    fn left(&self, modelled: &[f64], delay_s: f64) -> Vec<f64> {
        let mut left = self.run.observation.advanced(delay_s, self.experiment());
        for (value, modelled) in left.iter_mut().zip(modelled) {
            *value -= modelled;
        }
        left
    }

    /// Residual at a point of coordinates and start.
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
        let starts: &[[f64; 2]] = if self.freedom.free_start { &STARTS } else { &[[0.0, 0.0]] };
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

    /// The search from a start, and again with what the start found adds to the low-fidelity
    /// model's error.
    fn settle(&mut self, likelihood: &Likelihood, from: &[f64]) -> Result<Settled, DiagnoseError> {
        self.error_a.fill(0.0);
        let (mut point, mut evaluations) = self.search(likelihood, from)?;
        if self.freedom.free_start {
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
            max_evaluations: self.run.plan.budget.free_start,
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
    pub(crate) fn freed(
        &self,
        hypothesis: &Hypothesis,
        likelihood: &Likelihood,
        fit: &FitResult,
        freedom: &Freedom,
    ) -> Result<FitResult, DiagnoseError> {
        let experiment = self.experiment();
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
            try_central_differences(&point, &free.steps(), turned).map_err(BundleError::from)?;
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
}
