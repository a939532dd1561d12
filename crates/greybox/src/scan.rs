//! The score scan: how much of the residual each effect of the catalogue explains that neither
//! damage nor rough numbers can.

use inference::{Whitener, chi_squared_log_tail};
use nalgebra::{DMatrix, DVector};
use rand::RngExt;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use ema_sim::Effect;

use crate::{
    fit::{Fitted, whitened},
    gram::Gram,
    hypothesis::{Family, is_nonlinear_in_size},
    random::normal,
    trial::Tried,
};

/// Draws of noise that the largest score is compared with.
pub(crate) const DRAWS: usize = 999;

/// Addition to a variance of one against rounding, the least that does.
const ROUNDING: [f64; 5] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2];

/// How well one explains the residual.
#[derive(Clone, Debug)]
pub(crate) struct Scored {
    pub(crate) family: usize,
    /// Place among those tried.
    pub(crate) tried: usize,
    /// Natural logarithm of the chance that noise scores as much, for this one alone.
    pub(crate) log_p: f64,
    /// Share of what the effect does that damage and rough numbers cannot imitate, whatever they are.
    pub(crate) visible_share: f64,
    /// Energy of the effect, at the sizes tried, before projection.
    pub(crate) raw_energy: f64,
    /// Place of the free number of the fit that imitates most of it.
    pub(crate) imitated_by: Option<usize>,
    /// Energy of the effect, at the sizes tried, that is left after projection.
    pub(crate) energy: f64,
    /// Cosine of residual and effect before projection.
    pub(crate) raw_cosine: f64,
    /// Sizes by least squares.
    pub(crate) sizes: Vec<f64>,
    /// Columns of what its sizes do.
    places: Vec<usize>,
}

/// The outcome of a scan.
#[derive(Clone, Debug)]
pub(crate) struct Scan {
    /// The best shape of each question, best question first.
    pub(crate) scored: Vec<Scored>,
    /// Chance that noise alone reaches the best score of the whole catalogue.
    pub(crate) p_familywise: f64,
    /// Products of all that was tried and, last, of the residual, beside the free numbers.
    rest: Gram,
    target: usize,
}

impl Scan {
    /// How many questions would score better than one if its effect were added, so many times as
    /// large as its sizes were tried.
    pub(crate) fn better_than(
        &self,
        round: (&[Family], &[Tried]),
        own: &Scored,
        times: &[f64],
    ) -> usize {
        let (families, tried) = round;
        let added = own.places.iter().zip(times);
        let along = |place: usize| {
            let of = |(&column, times): (&usize, &f64)| times * self.rest.get(place, column);
            self.rest.get(place, self.target) + added.clone().map(of).sum::<f64>()
        };
        let log_p = |scored: &Scored| {
            let of = &tried[scored.tried];
            let along: Vec<f64> = scored.places.iter().map(|&place| along(place)).collect();
            let looked = libm::log(families[scored.family].screened());
            log_chance(&self.rest, of, &scored.places, &along).0 + looked
        };
        let least = log_p(own);
        self.scored
            .iter()
            .filter(|other| other.family != own.family && log_p(other) < least)
            .count()
    }
}

/// Logarithm of the chance that noise scores as much as an effect does whose columns have these
/// products with a residual, for this one alone; the multiples of the sizes tried that explain most.
fn log_chance(rest: &Gram, tried: &Tried, places: &[usize], along: &[f64]) -> (f64, Vec<f64>) {
    let (statistic, weights) = if is_nonlinear_in_size(tried.plain.id()) {
        as_it_is(rest, places, along)
    } else {
        rest.explained_by(places, along)
    };
    let allowed = sign_allowed(&tried.plain, &tried.sizes, &weights);
    let chance = chi_squared_log_tail(statistic, places.len());
    (if allowed { chance + one_sided(&tried.plain, &tried.sizes) } else { 0.0 }, weights)
}

/// Scores all that was tried against the residual of a fit.
pub(crate) fn score(
    families: &[Family],
    tried: &[Tried],
    fitted: &Fitted,
    whitener: &Whitener,
    seed: u64,
) -> Scan {
    let mut columns: Vec<Vec<f64>> =
        fitted.sensitivities.iter().map(|column| whitened(whitener, column)).collect();
    let known: Vec<usize> = (0..columns.len()).collect();
    let mut places = Vec::new();
    for entry in tried {
        let from = columns.len();
        columns.extend(entry.columns.iter().map(|column| whitened(whitener, column)));
        places.push((from..columns.len()).collect::<Vec<usize>>());
    }
    let target = columns.len();
    columns.push(whitened(whitener, &fitted.residuals));
    let raw = Gram::new(&columns);
    let off = raw.without(&known);
    let raw = with_priors(raw, fitted, target);
    let rest = raw.without(&known);

    let mut scored: Vec<Scored> = tried
        .iter()
        .zip(&places)
        .enumerate()
        .map(|(number, (entry, places))| {
            let along: Vec<f64> = places.iter().map(|&place| rest.get(place, target)).collect();
            let (log_p, weights) = log_chance(&rest, entry, places, &along);
            let sum = |gram: &Gram| places.iter().map(|&p| gram.get(p, p)).sum::<f64>();
            let explained = raw.explained(target, places).0;
            let raw_energy = sum(&raw);
            Scored {
                family: entry.family,
                tried: number,
                log_p,
                visible_share: libm::sqrt(sum(&off) / raw_energy.max(f64::MIN_POSITIVE)),
                raw_energy,
                imitated_by: imitated_by(&raw, places[0], &known),
                energy: sum(&rest),
                raw_cosine: libm::sqrt(
                    (explained / raw.get(target, target).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0),
                ),
                sizes: weights.iter().zip(&entry.sizes).map(|(w, (_, s))| w * s).collect(),
                places: places.clone(),
            }
        })
        .collect();
    let looked = |s: &Scored| libm::log(families[s.family].screened());
    let observed = scored.iter().map(|s| s.log_p + looked(s)).fold(0.0, f64::min);
    let p_familywise = familywise(families, tried, &places, &rest, observed, seed);
    scored.sort_by(|a, b| (a.log_p + looked(a)).total_cmp(&(b.log_p + looked(b))));
    let mut seen = Vec::new();
    scored.retain(|s| {
        let new = !seen.contains(&s.family);
        seen.push(s.family);
        new
    });
    Scan { scored, p_familywise, rest, target }
}

/// Products with what is known of the free numbers, the first columns, beforehand: one observation
/// each of `(value − mean)/std` (of a tail the least squares with its slope there), in which the
/// `residual` shows and no effect does.
fn with_priors(mut products: Gram, fitted: &Fitted, residual: usize) -> Gram {
    let free = fitted.structure.free.iter().zip(&fitted.values).enumerate();
    for (number, (free, value)) in free {
        let Some(prior) = free.prior else { continue };
        let (weight, slope) = (prior.weight(*value), prior.slope(*value));
        products.add(number, number, weight);
        products.add(number, residual, -slope);
        products.add(residual, residual, slope * slope / weight);
    }
    products
}

/// The column among some that makes up most of another.
fn imitated_by(gram: &Gram, column: usize, known: &[usize]) -> Option<usize> {
    let (_, weights) = gram.explained(column, known);
    let part = |&n: &usize| weights[n] * weights[n] * gram.get(known[n], known[n]);
    (0..known.len()).max_by(|a, b| part(a).total_cmp(&part(b)))
}

/// Energy of a residual, with whose products `along`, that columns explain at the size that they have.
fn as_it_is(gram: &Gram, by: &[usize], along: &[f64]) -> (f64, Vec<f64>) {
    let of = |(&i, along): (&usize, &f64)| -> f64 {
        let own: f64 = by.iter().map(|&j| gram.get(i, j)).sum();
        2.0 * along - own
    };
    (by.iter().zip(along).map(of).sum(), vec![1.0; by.len()])
}

/// Chance that noise scores `observed` somewhere in the catalogue: draws of the projected
/// scores, and a uniform chance for each question whose shapes were screened.
fn familywise(
    families: &[Family],
    tried: &[Tried],
    places: &[Vec<usize>],
    rest: &Gram,
    observed: f64,
    seed: u64,
) -> f64 {
    let all: Vec<usize> =
        places.iter().flatten().copied().filter(|&p| rest.get(p, p) > 0.0).collect();
    let block = rest.block(&all);
    let scale: Vec<f64> = (0..all.len()).map(|i| libm::sqrt(block[(i, i)])).collect();
    let correlation =
        DMatrix::from_fn(all.len(), all.len(), |i, j| block[(i, j)] / (scale[i] * scale[j]));
    let Some(lower) = root(&correlation) else { return 1.0 };
    let within: Vec<(usize, Vec<usize>)> = places
        .iter()
        .enumerate()
        .map(|(number, columns)| {
            let of = |c: &usize| all.iter().position(|p| p == c);
            (number, columns.iter().filter_map(of).collect())
        })
        .collect();
    let blocks: Vec<DMatrix<f64>> = within
        .iter()
        .map(|(_, at)| {
            let block = DMatrix::from_fn(at.len(), at.len(), |i, j| {
                let pair: f64 = lower.row(at[i]).dot(&lower.row(at[j]));
                pair + if i == j { 1e-9 } else { 0.0 }
            });
            block.clone().cholesky().map_or(block, |c| c.inverse())
        })
        .collect();
    let free: usize = families.iter().filter(|family| family.screened() > 1.0).count();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut reached = 0;
    for _ in 0..DRAWS {
        let z = DVector::from_fn(all.len(), |_, _| normal(&mut random));
        let scores = &lower * z;
        let mut least = 0.0_f64;
        for ((number, at), inverse) in within.iter().zip(&blocks) {
            let entry = &tried[*number];
            if at.is_empty() || families[entry.family].screened() > 1.0 {
                continue;
            }
            let w = DVector::from_fn(at.len(), |i, _| scores[at[i]]);
            let statistic = (inverse * &w).dot(&w);
            let sign = w.iter().copied().collect::<Vec<_>>();
            if sign_allowed(&entry.plain, &entry.sizes, &sign) {
                let log_p = chi_squared_log_tail(statistic, at.len())
                    + one_sided(&entry.plain, &entry.sizes);
                least = least.min(log_p);
            }
        }
        for _ in 0..free {
            least = least.min(libm::log(random.random::<f64>().max(f64::MIN_POSITIVE)));
        }
        if least <= observed {
            reached += 1;
        }
    }
    (1.0 + f64::from(reached)) / (DRAWS as f64 + 1.0)
}

/// A lower triangular root of a matrix of correlations, of which those of one that others make up
/// wholly may be off by rounding.
fn root(correlation: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let raised = |by: &f64| {
        let mut matrix = correlation.clone();
        (0..matrix.nrows()).for_each(|n| matrix[(n, n)] += by);
        Some(matrix.cholesky()?.l())
    };
    ROUNDING.iter().find_map(raised)
}

/// Tells whether a size can only have the sign tried.
pub(crate) fn is_signed(plain: &Effect, place: usize) -> bool {
    plain.id().info().parameters[place].bounds().0 >= 0.0
}

fn sign_allowed(plain: &Effect, sizes: &[(usize, f64)], weights: &[f64]) -> bool {
    sizes.len() > 1
        || weights.iter().zip(sizes).all(|(w, (p, _))| *w > 0.0 || !is_signed(plain, *p))
}

/// Half the chance where only one sign can be.
fn one_sided(plain: &Effect, sizes: &[(usize, f64)]) -> f64 {
    if sizes.len() == 1 && is_signed(plain, sizes[0].0) { -core::f64::consts::LN_2 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Draws are made also of two columns that are the same, and of three in a plane.
    #[test]
    fn law_correlations_have_a_root_where_columns_make_up_others() {
        let third = libm::sqrt(0.5);
        let correlation = DMatrix::from_row_slice(
            4,
            4,
            &[
                [1.0, 1.0 + 1e-12, 0.0, third],
                [1.0 + 1e-12, 1.0, 0.0, third],
                [0.0, 0.0, 1.0, third],
                [third, third, third, 1.0 - 1e-5],
            ]
            .concat(),
        );
        assert!(correlation.clone().cholesky().is_none());
        let root = root(&correlation).expect("a root");
        let off = &root * root.transpose() - correlation;
        assert!(off.amax() < 1e-3, "{off}");
    }
}
