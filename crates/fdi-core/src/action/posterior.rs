//! Posterior of the damage, by an answer and the damage that machines in service are assumed to have.
//!
//! The prior of each kind of damage has two parts ([`super::damage_prior`]), the product of all kinds
//! 2⁶. Each product of one part a kind is concave in its logarithm and gives a posterior with one summit,
//! where the logarithm of the prior is a parabola: points are those of a lattice of the normal that
//! follows, drawn one coordinate after the other, weighted by what each step cuts off and by what the
//! parabola leaves. The mean weight of the points is the evidence of the product. Products are added one
//! severe kind at a time to those whose evidence counts.
//!
//! # Source
//!
//! Genz, J. Comput. Graph. Statist. 1, 1992 (separation of variables); Richtmyer's lattice: Niederreiter,
//! *Random Number Generation and Quasi-Monte Carlo Methods*, 1992, ch. 5.

use ema_sim::FaultCoordinates;
use fdi_report::{ActionLevels, FaultId, Finding, RecordDiagnosis};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal};

use super::{
    Since,
    damage_prior::{Coordinate, KINDS, SEVERE_SHARE, kind_of},
};

/// Points of the lattice; twice as many moved no probability of 46 recordings by more than 0.008.
const POINTS: usize = 4096;
/// Points by which the evidence of a product of priors is judged first, and least of one that counts.
const TRIED: usize = 64;
const FEWEST: usize = 256;
/// Share of the largest evidence from which on a product of priors counts.
const COUNTS: f64 = 1e-4;
/// Square roots of these are the steps of the lattice.
const PRIMES: [f64; 7] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0];
/// Most steps of Newton's method, and the step at which it has settled.
const STEPS: usize = 100;
const SETTLED: f64 = 1e-9;
/// Cuts beyond so many standard deviations leave an exponential tail.
const FAR: f64 = 8.0;
/// Coordinates of friction and of play.
const FRICTION: &str = FaultCoordinates::NAMES[0];
const PLAY: &str = FaultCoordinates::NAMES[1];
/// Coordinates of the eccentricity.
const ECCENTRICITY: [&str; 2] = [FaultCoordinates::NAMES[5], FaultCoordinates::NAMES[6]];

/// Standard deviation of the play that there is over that of the play that has come to the machine as
/// built: the tolerance of the latter is no error of the former.
fn share_of_recording(answer: &RecordDiagnosis) -> f64 {
    of_fault(answer, FaultId::K2)
        .map_or(1.0, |Finding { posterior_std, std, .. }| posterior_std / std)
}

/// The finding that is of a fault alone.
fn of_fault(answer: &RecordDiagnosis, id: FaultId) -> Option<&Finding> {
    answer.findings.iter().find(|one| one.faults().eq([id]))
}

/// Weighted points of the posterior, one row a determined coordinate.
pub(super) struct Points {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
    weights: Vec<f64>,
}

impl Points {
    /// Points of an answer's posterior; `None` where nothing is determined.
    pub(super) fn of(
        answer: &RecordDiagnosis,
        levels: &ActionLevels,
        since: Since,
    ) -> Option<Self> {
        let likelihood = Likelihood::of(answer, levels, since)?;
        let products = likelihood.products(levels);
        let most = products.iter().map(|one| one.ln_evidence).fold(f64::NEG_INFINITY, f64::max);
        let share = |one: &Product| (one.ln_evidence - most).exp();
        let whole: f64 = products.iter().map(share).sum();
        let names = likelihood.names.clone();
        let mut points = Self { rows: vec![Vec::new(); names.len()], names, weights: Vec::new() };
        for product in &products {
            let share = share(product) / whole;
            let count = ((share * POINTS as f64) as usize).max(FEWEST);
            for point in 0..count {
                let (levels, logarithm) = product.drawn(point, &likelihood);
                for (row, level) in points.rows.iter_mut().zip(levels) {
                    row.push(level);
                }
                points.weights.push((logarithm - most).exp() / count as f64);
            }
        }
        let sum: f64 = points.weights.iter().sum();
        for weight in &mut points.weights {
            *weight /= sum;
        }
        Some(points)
    }

    /// Levels of a fault at the points.
    fn levels(&self, id: FaultId) -> Option<Vec<f64>> {
        let row = |name: &str| {
            let place = self.names.iter().position(|one| one == name)?;
            Some(&self.rows[place])
        };
        if id == FaultId::K6 {
            let (x, y) = (row(ECCENTRICITY[0])?, row(ECCENTRICITY[1])?);
            return Some(x.iter().zip(y).map(|(x, y)| x.hypot(*y)).collect());
        }
        row(id.id()).cloned()
    }

    /// Levels of a fault with their weights, in their order; `None` where it is not determined.
    pub(super) fn marginal(&self, id: FaultId) -> Option<Marginal> {
        let weights = self.weights.iter().copied();
        let mut sorted: Vec<(f64, f64)> = self.levels(id)?.into_iter().zip(weights).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        Some(Marginal(sorted))
    }
}

/// Levels of a fault with their weights, in their order.
pub(super) struct Marginal(Vec<(f64, f64)>);

impl Marginal {
    /// Probability of a level above a limit.
    pub(super) fn above(&self, limit: f64) -> f64 {
        let at = self.0.iter().filter(|(level, _)| *level > limit);
        // a sum of nothing is -0
        at.map(|(_, weight)| weight).sum::<f64>().clamp(0.0, 1.0) + 0.0
    }

    pub(super) fn quantiles<const N: usize>(&self, at: [f64; N]) -> [f64; N] {
        at.map(|share| {
            let mut below = 0.0;
            let found = self.0.iter().find(|(_, weight)| {
                below += weight;
                below >= share
            });
            found.or(self.0.last()).map_or(0.0, |(value, _)| *value)
        })
    }
}

/// Likelihood of an answer: a normal in the coordinates in which it is drawn.
struct Likelihood {
    names: Vec<String>,
    /// Index of each coordinate in the names of all.
    indices: Vec<usize>,
    found: DVector<f64>,
    precision: DMatrix<f64>,
    friction: Option<AsBuilt>,
}

/// Friction that a recording shows, where its tolerance is what leaves it open: that as built times what has
/// come. The former is normal, its logarithm is not.
///
/// ```text
/// p(y | u) ∝ e^w·exp(−(e^w − 1)²/(2σ²))         w = û − u,   σ the standard deviation of û
/// ```
struct AsBuilt {
    row: usize,
    found: f64,
    std: f64,
}

impl AsBuilt {
    /// Logarithm of that over a normal of the same standard deviation.
    fn ln_over_normal(&self, u: f64) -> f64 {
        let w = self.found - u;
        w - (w.exp_m1().powi(2) - w * w) / (2.0 * self.std * self.std)
    }
}

impl Likelihood {
    fn of(answer: &RecordDiagnosis, levels: &ActionLevels, since: Since) -> Option<Self> {
        let names = answer.covariance.parameters.clone();
        let place = |name: &String| FaultCoordinates::NAMES.iter().position(|one| one == name);
        let indices: Vec<usize> = names.iter().map(place).collect::<Option<_>>()?;
        let estimate = &answer.covariance.estimate;
        let matrix = &answer.covariance.matrix;
        let of = |row: usize| Coordinate::of(indices[row], levels, false);
        let share = |row: usize| match names[row].as_str() {
            PLAY if since == Since::Nominal => share_of_recording(answer),
            _ => 1.0,
        };
        let order = names.len();
        let scale: Vec<f64> =
            (0..order).map(|row| of(row).slope(estimate[row]) * share(row)).collect();
        let covariance = DMatrix::from_fn(order, order, |i, j| scale[i] * matrix[i][j] * scale[j]);
        let precision = covariance.clone().cholesky()?.inverse();
        let found = DVector::from_fn(order, |row, _| of(row).scaled(estimate[row]));
        let as_built =
            |row: usize| AsBuilt { row, found: found[row], std: covariance[(row, row)].sqrt() };
        let friction = names.iter().position(|name| name == FRICTION);
        let is_open =
            of_fault(answer, FaultId::K1).is_some_and(|one| one.prior_std > one.posterior_std);
        let friction = friction.filter(|_| since == Since::Nominal && is_open).map(as_built);
        Some(Self { names, indices, found, precision, friction })
    }

    /// Products of priors whose evidence counts: each severe kind is added to those that do.
    fn products(&self, levels: &ActionLevels) -> Vec<Product> {
        let none = [false; KINDS];
        let mut tried = vec![none];
        let mut products: Vec<Product> = self.product(none, levels).into_iter().collect();
        let mut next = 0;
        while let Some(severe) = products.get(next).map(|one| one.severe) {
            let most = products.iter().map(|one| one.ln_evidence).fold(f64::NEG_INFINITY, f64::max);
            let counts = |one: &Product| one.ln_evidence > most + COUNTS.ln();
            // the product without any severe kind is the beginning of all
            if next == 0 || counts(&products[next]) {
                for kind in 0..KINDS {
                    let mut more = severe;
                    more[kind] = true;
                    let is_told = self.indices.iter().any(|&index| kind_of(index) == kind);
                    if is_told && !tried.contains(&more) {
                        tried.push(more);
                        products.extend(self.product(more, levels));
                    }
                }
            }
            next += 1;
        }
        let most = products.iter().map(|one| one.ln_evidence).fold(f64::NEG_INFINITY, f64::max);
        products.retain(|one| one.ln_evidence > most + COUNTS.ln());
        products
    }

    /// The product of priors with severe damage of these kinds.
    fn product(&self, severe: [bool; KINDS], levels: &ActionLevels) -> Option<Product> {
        let of = |&index: &usize| Coordinate::of(index, levels, severe[kind_of(index)]);
        let coordinates: Vec<Coordinate> = self.indices.iter().map(of).collect();
        let proposal = Proposal::of(&self.precision, &self.found, &coordinates)?;
        let kinds = severe.iter().filter(|is_severe| **is_severe).count() as i32;
        let ln_share = f64::from(kinds) * (SEVERE_SHARE / (1.0 - SEVERE_SHARE)).ln();
        let ln_height = ln_share + proposal.ln_summit;
        let mut product = Product { severe, coordinates, proposal, ln_height, ln_evidence: 0.0 };
        let logarithms: Vec<f64> = (0..TRIED).map(|point| product.drawn(point, self).1).collect();
        let most = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mean = logarithms.iter().map(|one| (one - most).exp()).sum::<f64>() / TRIED as f64;
        product.ln_evidence = most + mean.ln();
        Some(product)
    }
}

/// One product of priors, with what the answer makes of it.
struct Product {
    /// Kinds of damage that are severe.
    severe: [bool; KINDS],
    coordinates: Vec<Coordinate>,
    proposal: Proposal,
    /// Logarithm of the share of the machines, over that of those without severe damage, times the volume
    /// under the normal.
    ln_height: f64,
    /// Logarithm of that share times the density of the answer, up to what all have in common.
    ln_evidence: f64,
}

impl Product {
    /// Levels at a point of the lattice, and the logarithm of its weight.
    fn drawn(&self, point: usize, likelihood: &Likelihood) -> (Vec<f64>, f64) {
        let (at, logarithm) = self.proposal.drawn(point, &self.coordinates);
        let friction =
            likelihood.friction.as_ref().map_or(0.0, |one| one.ln_over_normal(at[one.row]));
        let levels = at.into_iter().zip(&self.coordinates).map(|(u, of)| of.level(u)).collect();
        (levels, self.ln_height + logarithm + friction)
    }
}

/// A normal near the posterior, from which points are drawn.
struct Proposal {
    mean: DVector<f64>,
    /// Coordinates in the order in which they are drawn, and the factor of their covariance in it.
    order: Vec<usize>,
    lower: DMatrix<f64>,
    /// Where the prior is a parabola.
    at: Vec<f64>,
    /// Logarithm of the volume under the normal: its height times the root of the determinant.
    ln_summit: f64,
}

impl Proposal {
    /// The most probable point by Newton's method, each step at most of length one, and the normal of
    /// its curvature. The posterior has one summit: likelihood and priors are concave.
    fn of(
        precision: &DMatrix<f64>,
        found: &DVector<f64>,
        coordinates: &[Coordinate],
    ) -> Option<Self> {
        let mut at: Vec<f64> =
            found.iter().zip(coordinates).map(|(u, of)| of.existing(*u)).collect();
        let mut steps = 0;
        loop {
            let (mut whole, mut pull) = (precision.clone(), precision * found);
            for (row, of) in coordinates.iter().enumerate() {
                let [_, slope, curvature] = of.ln_prior(at[row]);
                whole[(row, row)] -= curvature;
                pull[row] += slope - curvature * at[row];
            }
            let factor = whole.cholesky()?;
            let mean = factor.solve(&pull);
            let step = |row: usize| coordinates[row].existing(mean[row]) - at[row];
            let longest = (0..at.len()).map(|row| step(row).abs()).fold(0.0, f64::max);
            // points are weighted, so that a normal beside the summit only costs some of them
            if longest < SETTLED || steps == STEPS {
                let covariance = factor.inverse();
                let order = most_cut_first(&mean, &covariance, coordinates);
                let size = order.len();
                let ordered = DMatrix::from_fn(size, size, |i, j| covariance[(order[i], order[j])]);
                let off = &mean - found;
                let half_ln_determinant: f64 = factor.l_dirty().diagonal().map(f64::ln).sum();
                let parabola: f64 = coordinates
                    .iter()
                    .zip(&at)
                    .zip(&mean)
                    .map(|((of, at), u)| of.near(*at, *u))
                    .sum();
                let ln_summit = parabola - 0.5 * off.dot(&(precision * &off)) - half_ln_determinant;
                let lower = ordered.cholesky()?.l();
                return Some(Self { mean, order, lower, at, ln_summit });
            }
            let part = longest.recip().min(1.0);
            at = (0..at.len()).map(|row| at[row] + part * step(row)).collect();
            steps += 1;
        }
    }

    /// A point of the lattice with the logarithm of its weight.
    fn drawn(&self, point: usize, coordinates: &[Coordinate]) -> (Vec<f64>, f64) {
        let Self { mean, order, lower, at, .. } = self;
        let normal = Normal::standard();
        let mut white: Vec<f64> = Vec::with_capacity(order.len());
        let mut drawn = vec![0.0; order.len()];
        let mut logarithm = 0.0;
        for (row, &place) in order.iter().enumerate() {
            let of = coordinates[place];
            let share =
                ((point as f64 + 0.5) * PRIMES[row].sqrt()).fract().clamp(1e-12, 1.0 - 1e-12);
            let before: f64 = (0..row).map(|n| lower[(row, n)] * white[n]).sum();
            let middle = mean[place] + before;
            let step = if of.is_cut() {
                let (step, ln_left) = beyond(-middle / lower[(row, row)], share, &normal);
                logarithm += ln_left;
                step
            } else {
                normal.inverse_cdf(share)
            };
            white.push(step);
            let u = middle + lower[(row, row)] * step;
            let [prior, ..] = of.ln_prior(u);
            logarithm += prior - of.near(at[place], u);
            drawn[place] = u;
        }
        (drawn, logarithm)
    }
}

/// Coordinates in the order in which the least of each is left of what was drawn before: what is cut
/// most is drawn first, so that what follows is drawn where it can be.
///
/// # Source
///
/// Gibson, Glasbey, Elston, Adv. Appl. Probab. 26, 1994; Genz and Bretz, *Computation of Multivariate
/// Normal and t Probabilities*, 2009, section 4.1.3.
fn most_cut_first(
    mean: &DVector<f64>,
    covariance: &DMatrix<f64>,
    coordinates: &[Coordinate],
) -> Vec<usize> {
    let normal = Normal::standard();
    let (mut mean, mut covariance) = (mean.clone(), covariance.clone());
    let mut rest: Vec<usize> = (0..coordinates.len()).collect();
    let mut order = Vec::with_capacity(rest.len());
    while !rest.is_empty() {
        let std = |place: usize| covariance[(place, place)].max(f64::MIN_POSITIVE).sqrt();
        let cut = |place: usize| {
            let is_cut = coordinates[place].is_cut();
            if is_cut { -mean[place] / std(place) } else { f64::NEG_INFINITY }
        };
        let Some((at, place)) =
            rest.iter().copied().enumerate().max_by(|a, b| cut(a.1).total_cmp(&cut(b.1)))
        else {
            break;
        };
        rest.remove(at);
        order.push(place);
        if cut(place).is_finite() {
            // the middle of what is left of it stands for it
            let (step, _) = beyond(cut(place), 0.5, &normal);
            let moved = step * std(place);
            let variance = covariance[(place, place)].max(f64::MIN_POSITIVE);
            let gains = covariance.column(place) / variance;
            mean += &gains * moved;
            covariance -= &gains * gains.transpose() * variance;
        }
    }
    order
}

/// The quantile of a standard normal beyond a cut, and the logarithm of what is beyond it.
fn beyond(cut: f64, share: f64, normal: &Normal) -> (f64, f64) {
    if cut > FAR {
        // Mills' ratio: beyond the cut the density decays by 1/cut
        let ln_left = -0.5 * cut * cut - (cut * core::f64::consts::TAU.sqrt()).ln();
        return (cut - (1.0 - share).ln() / cut, ln_left);
    }
    let left = normal.cdf(-cut);
    (-normal.inverse_cdf(left * (1.0 - share)), left.ln())
}
