//! Information that recordings hold on the numbers fitted to them, and its use by other steps.

use inference::{Whitener, rms};
use nalgebra::{DMatrix, DVector};

use crate::{
    elsewhere::drive_and_residuals,
    error::GreyboxError,
    fit::{Fitted, Normal, inverse, whitened},
    gram::{Gram, dot},
    problem::{PerRecord, Problem},
    structure::{Free, Structure},
};

/// The free numbers of a fit that are one number in all recordings, with what the recordings say
/// of them. What has another size in each is not known in a new one: it is left out, and
/// projected off what they say of the others.
#[derive(Clone, Debug)]
pub(crate) struct Known {
    pub(crate) structure: Structure,
    pub(crate) values: Vec<f64>,
    /// Inverse of their covariance.
    pub(crate) information: DMatrix<f64>,
    /// Slope of the log-likelihood over each number that stands on a bound and is pushed there.
    pub(crate) push: DVector<f64>,
}

impl Known {
    pub(crate) fn new(fitted: &Fitted, noise: &Whitener) -> Self {
        let mut columns: Vec<Vec<f64>> =
            fitted.sensitivities.iter().map(|column| whitened(noise, column)).collect();
        columns.push(whitened(noise, &fitted.residuals));
        Self::told_by(&Gram::new(&columns), &fitted.structure, &fitted.values)
    }

    /// By the products of the whitened columns of all free numbers and, last, of the residual.
    pub(crate) fn told_by(products: &Gram, of: &Structure, values: &[f64]) -> Self {
        let kept = of.same_everywhere();
        let structure = of.only(&kept);
        let values: Vec<f64> = kept.iter().map(|&place| values[place]).collect();
        let residual = of.free.len();
        let others: Vec<usize> = (0..residual).filter(|n| !kept.contains(n)).collect();
        let mut information = products.without(&others).block(&kept);
        for (i, free) in structure.free.iter().enumerate() {
            information[(i, i)] += beforehand(free, values[i]);
        }
        let push = DVector::from_fn(kept.len(), |i, _| {
            let (free, value) = (&structure.free[i], values[i]);
            let of_prior = free.prior.map_or(0.0, |prior| prior.slope(value));
            let slope = products.get(kept[i], residual) - of_prior;
            let is_least = value <= free.least && slope < 0.0;
            let is_most = value >= free.most && slope > 0.0;
            if is_least || is_most { slope } else { 0.0 }
        });
        Self { structure, values, information, push }
    }

    /// Where recordings that were not fitted would have the numbers, by the whitened sensitivities
    /// `columns` and the whitened residual there.
    fn moved_by(&self, columns: &[Vec<f64>], white: &[f64]) -> Moved {
        let there = There {
            products: Gram::new(columns).first(columns.len()),
            descent: DVector::from_iterator(columns.len(), columns.iter().map(|c| dot(c, white))),
            energy: dot(white, white),
            samples: white.len(),
        };
        self.moved(&there)
    }

    /// Where recordings that were not fitted would have the numbers.
    pub(crate) fn moved(&self, there: &There) -> Moved {
        let Self { structure, values, information, push } = self;
        let There { products, descent, energy, samples } = there;
        let samples = (*samples).max(1) as f64;
        let size = |energy: f64| libm::sqrt(energy.max(0.0) / samples).max(f64::MIN_POSITIVE);
        let mut moved = Moved {
            values: values.clone(),
            both: information.clone(),
            size: size(*energy),
            price_nats: 0.0,
        };
        // the noise is as large as what is left, and what is left goes by the noise
        for _ in 0..PASSES {
            let weight = 1.0 / (moved.size * moved.size);
            let curvature = information + products * weight;
            let price = 0.5 * log_ratio(&curvature, information);
            let normal = Normal { curvature, descent: descent * weight + push };
            moved.values = normal.bounded(&structure.free, values, 0.0);
            let by = DVector::from_fn(values.len(), |n, _| moved.values[n] - values[n]);
            moved.price_nats = 0.5 * by.dot(&(information * &by)) - push.dot(&by) + price;
            moved.size = size(energy - 2.0 * descent.dot(&by) + by.dot(&(products * &by)));
            moved.both = normal.curvature;
        }
        moved
    }

    /// Standard deviation of each number, times how many of its own the `moved` one is off, at least
    /// one; the information of all recordings together is `both`. What stops at an edge is not
    /// estimated: the others move as if it were known.
    fn stds(&self, moved: &[f64], both: &DMatrix<f64>) -> Vec<f64> {
        let Self { structure, values, information, .. } = self;
        let is_held = |n: usize| {
            let (free, by) = (&structure.free[n], moved[n] - values[n]);
            let (least, most) = free.room(values[n]);
            let near = LEAST_MOVE * free.step;
            by <= least + near || by >= most - near
        };
        let held: Vec<bool> = (0..values.len()).map(is_held).collect();
        let variance = |matrix: &DMatrix<f64>, n: usize| {
            let open: Vec<usize> = (0..values.len()).filter(|&m| m == n || !held[m]).collect();
            let block = DMatrix::from_fn(open.len(), open.len(), |i, j| matrix[(open[i], open[j])]);
            let place = open.iter().position(|&m| m == n).unwrap_or(0);
            inverse(&block)[(place, place)]
        };
        let alone = inverse(information);
        let std = |n: usize| {
            let fitted = variance(information, n);
            let of_move = (fitted - variance(both, n)).max(LEAST_NEWS * fitted);
            let off = (moved[n] - values[n]).abs() / libm::sqrt(of_move.max(f64::MIN_POSITIVE));
            off.max(1.0) * libm::sqrt(alone[(n, n)].max(0.0))
        };
        (0..values.len()).map(std).collect()
    }
}

/// Information of recordings that were not fitted on the numbers: products of the whitened sensitivities
/// there, with one another and with the whitened residual, and the energy of that.
pub(crate) struct There {
    pub(crate) products: DMatrix<f64>,
    pub(crate) descent: DVector<f64>,
    pub(crate) energy: f64,
    pub(crate) samples: usize,
}

/// Numbers moved by recordings that were not fitted.
pub(crate) struct Moved {
    pub(crate) values: Vec<f64>,
    /// Information of all recordings together on them.
    both: DMatrix<f64>,
    /// Root mean square of the whitened residual with them.
    pub(crate) size: f64,
    /// Both later terms of [`HeldOut`], nats.
    pub(crate) price_nats: f64,
}

/// Information on a number before any recording: its prior, else that of the uniform distribution
/// within its bounds.
fn beforehand(free: &Free, value: f64) -> f64 {
    let range = free.most - free.least;
    free.prior.map_or(12.0 / (range * range), |prior| prior.weight(value))
}

/// Recordings that were not fitted, at the numbers fitted.
pub(crate) struct Unfitted {
    /// Drive signals without what differs between recordings.
    pub(crate) drive: PerRecord,
    pub(crate) residuals: PerRecord,
    /// Change of the prediction with each number of [`Structure::same_everywhere`].
    pub(crate) sensitivities: Vec<PerRecord>,
}

impl Unfitted {
    /// With what differs between recordings fitted to each, under its `own` noise.
    pub(crate) fn new(
        problem: &Problem<'_>,
        fitted: &Fitted,
        own: &Whitener,
    ) -> Result<Self, GreyboxError> {
        let (drive, residuals) =
            drive_and_residuals(problem, &fitted.structure, &fitted.values, own)?;
        let kept = fitted.structure.same_everywhere();
        let values: Vec<f64> = kept.iter().map(|&place| fitted.values[place]).collect();
        let structure = fitted.structure.only(&kept);
        let sensitivities = problem.sensitivities(&structure, 0, 1.0, &values, &drive)?;
        Ok(Self { drive, residuals, sensitivities })
    }
}

/// Recordings that were not fitted, before numbers known as well as the others tell.
///
/// With whitened residual `r` at the fitted numbers, the sensitivities `J` there, the information
/// `F` of the recordings fitted and noise of unit size their log-likelihood is, but for a constant,
///
/// ```text
/// ln p(r) = −½·|r − J·δ|² − ½·δᵀ·F·δ − ½·ln det(I + F⁻¹·Jᵀ·J)
/// ```
///
/// at its largest over the change `δ` of the numbers, within their bounds and reach: of all
/// recordings together less that of those fitted (Laplace). A number that the recordings fitted
/// push against a bound pays for leaving it by that slope too.
///
/// # Source
///
/// Laplace's approximation of a posterior predictive likelihood: Kass and Raftery 1995.
#[derive(Clone, Debug)]
pub(crate) struct HeldOut {
    /// `r − J·δ`, not whitened.
    pub(crate) residuals: PerRecord,
    /// The numbers changed by `δ`, of [`Structure::same_everywhere`].
    pub(crate) values: Vec<f64>,
    /// Standard deviation of each as fitted, by the noise alone, times the standard deviations of
    /// its own that `δ` is off zero, at least one (Birge 1932).
    pub(crate) stds: Vec<f64>,
    /// Root mean square of the residual through the noise.
    pub(crate) size: f64,
    /// Both later terms, nats.
    pub(crate) price_nats: f64,
}

impl HeldOut {
    /// With the noise, whose size is each rival's own in what is held out; `own` is that of the
    /// recordings fitted.
    pub(crate) fn new(
        problem: &Problem<'_>,
        fitted: &Fitted,
        own: &Whitener,
        noise: &Whitener,
    ) -> Result<Self, GreyboxError> {
        // by the noise alone: what a wrong model misses does not free its numbers
        let known = Known::new(fitted, noise);
        let values = &known.values;
        let Unfitted { mut residuals, sensitivities, .. } = Unfitted::new(problem, fitted, own)?;
        let columns: Vec<Vec<f64>> = sensitivities.iter().map(|c| whitened(noise, c)).collect();
        let moved = known.moved_by(&columns, &whitened(noise, &residuals));
        for (record, residual) in residuals.iter_mut().enumerate() {
            for ((column, from), to) in sensitivities.iter().zip(values).zip(&moved.values) {
                for (r, slope) in residual.iter_mut().zip(&column[record]) {
                    *r -= (to - from) * slope;
                }
            }
        }
        let stds = known.stds(&moved.values, &moved.both);
        let Moved { values, size, price_nats, .. } = moved;
        Ok(Self { residuals, values, stds, size, price_nats })
    }

    /// Root mean square of the residual.
    pub(crate) fn rms(&self) -> f64 {
        rms(&self.residuals.concat())
    }
}

/// Share of the step of a number within which it stands at an edge.
const LEAST_MOVE: f64 = 1e-9;

/// Share of the variance of a number by which others lower it at least, else they say nothing.
const LEAST_NEWS: f64 = 1e-6;

/// How often size and numbers are found from one another.
const PASSES: usize = 5;

/// Logarithm of the ratio of two determinants, both in units of the first.
fn log_ratio(more: &DMatrix<f64>, less: &DMatrix<f64>) -> f64 {
    let unit: Vec<f64> =
        more.diagonal().iter().map(|d| 1.0 / libm::sqrt(d.max(f64::MIN_POSITIVE))).collect();
    let half_log = |matrix: &DMatrix<f64>| {
        let n = matrix.nrows();
        let jitter = |i, j| if i == j { ROUNDING } else { 0.0 };
        let scaled =
            DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * unit[i] * unit[j] + jitter(i, j));
        scaled.cholesky().map(|c| c.l_dirty().diagonal().iter().map(|d| libm::log(*d)).sum::<f64>())
    };
    match (half_log(more), half_log(less)) {
        (Some(more), Some(less)) => 2.0 * (more - less),
        _ => 0.0,
    }
}

/// Loss by rounding of the eigenvalues of a scaled matrix, at most.
const ROUNDING: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

    use super::*;
    use crate::{random::normal, structure::Target};

    const SAMPLES: usize = 60;

    /// Two numbers known to a standard deviation of 0.5 and 2 with some correlation, and what they
    /// do to recordings that were not fitted.
    fn known(bounds: [f64; 2]) -> (Known, Vec<Vec<f64>>) {
        let free = |place| Free {
            target: Target::Rough(place),
            key: String::new(),
            start: 0.0,
            least: bounds[0],
            most: bounds[1],
            step: 1.0,
            reach: f64::INFINITY,
            prior: None,
        };
        let structure = Structure { effects: Vec::new(), free: vec![free(0), free(1)] };
        let covariance = DMatrix::from_row_slice(2, 2, &[0.25, 0.3, 0.3, 4.0]);
        let information = covariance.try_inverse().expect("a covariance");
        let column = |pace: f64| (0..SAMPLES).map(|n| libm::sin(pace * n as f64)).collect();
        let push = DVector::zeros(2);
        (
            Known { structure, values: vec![0.0; 2], information, push },
            vec![column(0.1), column(0.37)],
        )
    }

    /// The likelihood is the Gaussian one of a residual whose covariance is that of the noise and
    /// of the numbers together.
    #[test]
    fn law_the_likelihood_is_that_of_noise_and_uncertain_numbers() {
        let (known, columns) = known([-1e9, 1e9]);
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let white: Vec<f64> = (0..SAMPLES)
            .map(|n| 0.8 * columns[0][n] - 3.0 * columns[1][n] + normal(&mut random))
            .collect();
        let moved = known.moved_by(&columns, &white);
        let variance = moved.size * moved.size;
        let rest =
            |n: usize| white[n] - (0..2).map(|k| moved.values[k] * columns[k][n]).sum::<f64>();
        let energy: f64 = (0..SAMPLES).map(|n| rest(n) * rest(n)).sum();
        assert!((energy / SAMPLES as f64 - variance).abs() < 1e-9 * variance);
        let slopes = DMatrix::from_fn(SAMPLES, 2, |n, k| columns[k][n]);
        let numbers = known.information.clone().try_inverse().expect("informative");
        let together =
            DMatrix::identity(SAMPLES, SAMPLES) * variance + &slopes * numbers * slopes.transpose();
        let residual = DVector::from_vec(white);
        let factor = together.cholesky().expect("a covariance");
        let volume: f64 = factor.l().diagonal().iter().map(|d| libm::log(*d / moved.size)).sum();
        let direct = -0.5 * residual.dot(&factor.solve(&residual)) - volume;
        let ours = -0.5 * energy / variance - moved.price_nats;
        assert!((ours - direct).abs() < 1e-3, "{ours} {direct}");
    }

    /// The variance of a move is that of noise and of the numbers' own uncertainty together.
    #[test]
    fn law_a_number_is_as_uncertain_as_what_is_held_out_has_it_elsewhere() {
        let (known, columns) = known([-1e9, 1e9]);
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let white: Vec<f64> = columns[0].iter().map(|x| 3.0 * x + normal(&mut random)).collect();
        let moved = known.moved_by(&columns, &white);
        let stds = known.stds(&moved.values, &moved.both);
        let there = DMatrix::from_fn(2, 2, |i, j| dot(&columns[i], &columns[j]))
            / (moved.size * moved.size);
        let alone = known.information.clone().try_inverse().expect("informative");
        let both = (&known.information + &there).try_inverse().expect("informative");
        let of_move = &both * (&there + &there * &alone * &there) * &both;
        for n in 0..2 {
            let off = moved.values[n].abs() / libm::sqrt(of_move[(n, n)]);
            let wanted = off.max(1.0) * libm::sqrt(alone[(n, n)]);
            assert!((stds[n] / wanted - 1.0).abs() < 0.01, "{stds:?} {wanted}");
        }
        assert!(stds[0] > 1.5 && (stds[1] - 2.0).abs() < 1e-3, "{stds:?}");
    }

    #[test]
    fn what_stands_on_its_bound_does_not_make_another_number_uncertain() {
        let (mut known, columns) = known([-1.0, 1.0]);
        known.structure.free[1].least = 0.0;
        known.information = DMatrix::from_diagonal(&DVector::from_vec(vec![1e4, 12.0]));
        let column: Vec<f64> = columns[0].iter().map(|x| 180.0 * x).collect();
        let noise = |n: usize| if n.is_multiple_of(2) { 1.0 } else { -1.0 };
        // one standard deviation of the first number off
        let white: Vec<f64> = column.iter().enumerate().map(|(n, x)| noise(n) - 0.01 * x).collect();
        let moved = known.moved_by(&[column.clone(), column], &white);
        assert_eq!(moved.values[1], 0.0);
        let stds = known.stds(&moved.values, &moved.both);
        assert!(stds[0] < 0.02, "{stds:?}");
    }

    #[test]
    fn what_is_known_well_does_not_move_and_nothing_leaves_its_bounds() {
        let (mut known, columns) = known([-1e9, 0.5]);
        let white: Vec<f64> = columns[1].iter().map(|x| 3.0 * x).collect();
        let moved = known.moved_by(&columns, &white);
        assert!(moved.values.iter().all(|value| *value <= 0.5), "{:?}", moved.values);
        // pushed back by more than the recordings that were not fitted want
        known.push[1] = -1e3;
        let pushed = known.moved_by(&columns, &white);
        assert!(pushed.values[1] < -1.0, "{:?}", pushed.values);
        known.push[1] = 0.0;
        known.information *= 1e12;
        let held = known.moved_by(&columns, &white);
        assert!(held.values.iter().all(|value| value.abs() < 1e-6), "{:?}", held.values);
    }
}
