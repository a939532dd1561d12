//! Where a criterion is largest.

use crate::{
    acquisition::{
        Acquisition, Cumulants, Second, TwoStep, ln_improvement_above, ln_with_slope, one_output,
    },
    bounds::{Bounds, Walls},
    error::AcquisitionError,
    gp::GaussianProcess,
    levenberg::on_surrogate,
    matrix::norm,
    minimise::{Limits, minimise},
    random::{Purpose, Stream},
    sobol::{MAX_INPUTS, Sobol},
};

/// Standard deviations of the candidates around the incumbent, as fractions
/// of the intervals.
const RADII: [f64; 4] = [0.2, 0.05, 0.01, 0.001];

/// The search for the maximum of a criterion on the box.
///
/// Candidates are scrambled Sobol' points and normal ones around the best
/// observation; the best of them are refined by a bounded quasi-Newton
/// method with the analytic gradient. The result depends on the arguments and
/// the seed alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Maximiser {
    /// Candidates over the whole box; a quarter as many around the incumbent.
    pub candidates: usize,
    /// Candidates that are refined.
    pub restarts: usize,
    /// Evaluations with gradient for the leading refinement, a third of them for each other.
    pub evaluations: usize,
    /// Seed of the candidates.
    pub seed: u64,
}

impl Default for Maximiser {
    fn default() -> Self {
        Self { candidates: 512, restarts: 10, evaluations: 30, seed: 0 }
    }
}

/// Candidates and the limits of their refinement.
struct Inside {
    candidates: Vec<Vec<f64>>,
    walls: Walls,
}

/// A point and the criterion there.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// The point, in the box.
    pub point: Vec<f64>,
    /// The criterion; larger is better.
    pub value: f64,
}

impl Maximiser {
    /// Maximises a criterion of one output.
    ///
    /// # Errors
    /// [`AcquisitionError::Outputs`] for several outputs, [`AcquisitionError::Incumbent`] when
    /// `best` is not finite.
    pub fn maximise(
        &self,
        acquisition: &Acquisition,
        gp: &GaussianProcess,
        best: f64,
    ) -> Result<Proposal, AcquisitionError> {
        let candidates = self.candidates(gp);
        let walls = gp.bounds().unit_walls();
        self.maximise_from(acquisition, gp, best, Inside { candidates, walls })
    }

    /// Maximises a criterion of one output in a part of the unit cube.
    ///
    /// # Errors
    /// Those of [`Self::maximise`].
    pub(crate) fn maximise_within(
        &self,
        acquisition: &Acquisition,
        gp: &GaussianProcess,
        best: f64,
        walls: Walls,
    ) -> Result<Proposal, AcquisitionError> {
        let candidates = self.candidates_within(gp, &walls);
        self.maximise_from(acquisition, gp, best, Inside { candidates, walls })
    }

    fn maximise_from(
        &self,
        acquisition: &Acquisition,
        gp: &GaussianProcess,
        best: f64,
        Inside { candidates, walls }: Inside,
    ) -> Result<Proposal, AcquisitionError> {
        one_output(gp)?;
        finite(best)?;
        let signal = gp.signal_variance().sqrt();
        let mut rated = Vec::with_capacity(candidates.len());
        for chunk in candidates.chunks(128) {
            let block = gp.block(chunk);
            for (i, unit) in chunk.iter().enumerate() {
                let std = signal * block.share[i].sqrt();
                rated.push((acquisition.value(block.mean[i], std, best), unit.clone()));
            }
        }
        let slope = |unit: &[f64]| {
            let (belief, slope) = gp.believe_with_slope(unit);
            let root = belief.share.sqrt();
            if root == 0.0 {
                return None;
            }
            let partial = acquisition.partial(belief.mean[0], signal * root, best);
            let by_share = partial.by_std * signal / (2.0 * root);
            let means = slope.mean.row(0).iter();
            let gradient =
                means.zip(&slope.share).map(|(m, s)| -(partial.by_mean * m + by_share * s));
            Some((-partial.value, gradient.collect()))
        };
        Ok(self.refine(gp.bounds(), &walls, rated, self.restarts, slope))
    }

    /// Maximises the two-step criterion of one output. The second points are
    /// the candidates; the first points are the quarter of them where plain
    /// expected improvement is largest and every sixth of the others.
    ///
    /// # Errors
    /// Those of [`Self::maximise`].
    pub fn maximise_two_step(
        &self,
        rule: &TwoStep,
        gp: &GaussianProcess,
        best: f64,
    ) -> Result<Proposal, AcquisitionError> {
        one_output(gp)?;
        finite(best)?;
        let mut candidates = self.candidates(gp);
        let second = Second::new(gp, candidates.clone());
        let order = second.by_improvement(gp, best);
        let leading = order.len() / 4;
        let mut keep: Vec<usize> = order[..leading].to_vec();
        keep.extend(order[leading..].iter().step_by(6));
        keep.sort_unstable();
        candidates = keep.iter().map(|&i| candidates[i].clone()).collect();
        let values = rule.values(gp, &candidates, &second, best);
        let rated = values.into_iter().zip(candidates).collect();
        let slope = |unit: &[f64]| {
            let (value, gradient) = rule.slope(gp, unit, &second, best);
            Some((-value, gradient.iter().map(|g| -g).collect()))
        };
        let short = Self { evaluations: self.evaluations.div_ceil(2), ..self.clone() };
        Ok(short.refine(
            gp.bounds(),
            &gp.bounds().unit_walls(),
            rated,
            self.restarts.div_ceil(4),
            slope,
        ))
    }

    /// Maximises the logarithm of the expected improvement of the squared norm
    /// of all outputs. Beside the usual candidates stand the local minimisers
    /// of the predicted norm, found by Gauss-Newton on the surrogate from its
    /// best observations and from a random point.
    ///
    /// # Errors
    /// [`AcquisitionError::Incumbent`] when `best_norm` is not finite.
    pub fn maximise_norm(
        &self,
        gp: &GaussianProcess,
        best_norm: f64,
    ) -> Result<Proposal, AcquisitionError> {
        finite(best_norm)?;
        let signal: Vec<f64> = gp.signal_std().iter().map(|s| s * s).collect();
        // the likely winners first: the others then need not be worked out to the end
        let mut candidates = self.surrogate_minimisers(gp);
        candidates.extend(self.candidates(gp));
        let walls = gp.bounds().unit_walls();
        let q = gp.outputs();
        let mut floor = f64::NEG_INFINITY;
        let mut rated = Vec::with_capacity(candidates.len());
        let mut mean = vec![0.0; q];
        for chunk in candidates.chunks(128) {
            let block = gp.block(chunk);
            for (i, unit) in chunk.iter().enumerate() {
                for (o, m) in mean.iter_mut().enumerate() {
                    *m = block.mean[o * block.count + i];
                }
                let cumulants = Cumulants::of(&mean, &signal, block.share[i]);
                let value = ln_improvement_above(floor, &cumulants, best_norm);
                if self.restarts == 0 {
                    floor = floor.max(value);
                }
                rated.push((value, unit.clone()));
            }
        }
        if rated.iter().all(|(value, _)| *value == f64::NEG_INFINITY) {
            // nothing to gain anywhere: the smallest predicted norm
            for (value, unit) in &mut rated {
                *value = -norm(&gp.believe(unit).mean);
            }
            return Ok(self.refine(gp.bounds(), &walls, rated, 0, |_| None));
        }
        let slope = |unit: &[f64]| {
            let (belief, slope) = gp.believe_with_slope(unit);
            let (value, gradient) = ln_with_slope(&belief, &slope, &signal, best_norm);
            value.is_finite().then(|| (-value, gradient.iter().map(|g| -g).collect()))
        };
        Ok(self.refine(gp.bounds(), &walls, rated, self.restarts, slope))
    }

    /// Minimisers of the predicted norm.
    fn surrogate_minimisers(&self, gp: &GaussianProcess) -> Vec<Vec<f64>> {
        let mut stream = Stream::new(self.seed, Purpose::Candidates, 1);
        let mut starts = gp.best_points(3);
        starts.push((0..gp.bounds().dimension()).map(|_| stream.uniform()).collect());
        starts
            .into_iter()
            .map(|start| {
                let model = |unit: &[f64]| gp.believe_mean_with_slope(unit);
                gp.bounds().wrap_unit(on_surrogate(model, start, &gp.bounds().unit_walls()))
            })
            .collect()
    }

    /// Candidates of the unit cube.
    fn candidates(&self, gp: &GaussianProcess) -> Vec<Vec<f64>> {
        let bounds = gp.bounds();
        let d = bounds.dimension();
        let mut stream = Stream::new(self.seed, Purpose::Candidates, 0);
        let mut all: Vec<Vec<f64>> = if d <= MAX_INPUTS {
            let mut sobol = Sobol::scrambled(d, self.seed).expect("within the table");
            (0..self.candidates).map(|_| sobol.next_point()).collect()
        } else {
            (0..self.candidates).map(|_| (0..d).map(|_| stream.uniform()).collect()).collect()
        };
        let Some(incumbent) = gp.best_points(1).pop() else {
            return all;
        };
        for radius in RADII {
            for _ in 0..self.candidates / 16 {
                let moved = incumbent.iter().map(|u| u + radius * stream.normal()).collect();
                all.push(bounds.wrap_unit(moved));
            }
        }
        all
    }

    /// Candidates of a part of the unit cube, and around the incumbent in it.
    fn candidates_within(&self, gp: &GaussianProcess, walls: &Walls) -> Vec<Vec<f64>> {
        let Walls { lower, upper } = walls;
        let d = lower.len();
        let mut stream = Stream::new(self.seed, Purpose::Candidates, 2);
        let inside = |unit: Vec<f64>| -> Vec<f64> {
            (0..d).map(|i| lower[i] + unit[i] * (upper[i] - lower[i])).collect()
        };
        let mut all: Vec<Vec<f64>> = if d <= MAX_INPUTS {
            let mut sobol = Sobol::scrambled(d, self.seed).expect("within the table");
            (0..self.candidates).map(|_| inside(sobol.next_point())).collect()
        } else {
            let mut point = || (0..d).map(|_| stream.uniform()).collect();
            (0..self.candidates).map(|_| inside(point())).collect()
        };
        let Some(incumbent) = gp.best_points(1).pop() else {
            return all;
        };
        for radius in RADII {
            for _ in 0..self.candidates / 16 {
                let moved = (0..d).map(|i| {
                    let step = radius * (upper[i] - lower[i]) * stream.normal();
                    (incumbent[i] + step).clamp(lower[i], upper[i])
                });
                all.push(moved.collect());
            }
        }
        all
    }

    /// Refines the best candidates and returns the best of all.
    fn refine(
        &self,
        bounds: &Bounds,
        walls: &Walls,
        mut rated: Vec<(f64, Vec<f64>)>,
        restarts: usize,
        slope: impl Fn(&[f64]) -> Option<(f64, Vec<f64>)>,
    ) -> Proposal {
        // stable: equal values keep the order of the candidates
        rated.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (mut value, mut unit) = rated[0].clone();
        let limits = Limits {
            evaluations: self.evaluations,
            decrease: 1e-6,
            gradient: 1e-9,
            first_step: 0.02,
        };
        let climb = |start: &[f64], evaluations: usize| {
            let limits = Limits { evaluations, ..limits };
            minimise(&slope, start, walls, limits)
        };
        // every start a little, then the leader to the end
        let short = self.evaluations.div_ceil(3);
        for (_, start) in rated.iter().take(restarts) {
            if let Some(found) = climb(start, short)
                && -found.value > value
            {
                (value, unit) = (-found.value, found.point);
            }
        }
        if restarts > 0
            && let Some(found) = climb(&unit, self.evaluations)
            && -found.value > value
        {
            (value, unit) = (-found.value, found.point);
        }
        let unit = bounds.wrap_unit(unit);
        Proposal { point: bounds.at_unit(&unit), value }
    }
}

fn finite(value: f64) -> Result<(), AcquisitionError> {
    if value.is_finite() { Ok(()) } else { Err(AcquisitionError::Incumbent { value }) }
}
