//! Covariance matrix adaptation with growing restarts.

use super::crowd::{Crowd, Ended, ranking};
use crate::{
    linalg::eigen,
    matrix::{Matrix, norm},
    random::{Purpose, Stream},
};

/// Weights and rates of a population (Hansen, arXiv:1604.00772, table 1).
struct Rates {
    weights: Vec<f64>,
    mu_eff: f64,
    c_sigma: f64,
    d_sigma: f64,
    c_c: f64,
    c_1: f64,
    c_mu: f64,
    /// Expected norm of a standard normal vector.
    chi: f64,
}

impl Rates {
    fn new(members: usize, d: usize) -> Self {
        let mu = members / 2;
        let raw: Vec<f64> = (0..mu)
            .map(|i| libm::log(0.5 * (members as f64 + 1.0)) - libm::log(i as f64 + 1.0))
            .collect();
        let total: f64 = raw.iter().sum();
        let weights: Vec<f64> = raw.iter().map(|w| w / total).collect();
        let mu_eff = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
        let n = d as f64;
        let c_sigma = (mu_eff + 2.0) / (n + mu_eff + 5.0);
        let c_1 = 2.0 / ((n + 1.3).powi(2) + mu_eff);
        let c_mu =
            (1.0 - c_1).min(2.0 * (mu_eff - 2.0 + 1.0 / mu_eff) / ((n + 2.0).powi(2) + mu_eff));
        Self {
            d_sigma: 1.0 + 2.0 * (((mu_eff - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma,
            c_c: (4.0 + mu_eff / n) / (n + 4.0 + 2.0 * mu_eff / n),
            chi: n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
            weights,
            mu_eff,
            c_sigma,
            c_1,
            c_mu,
        }
    }
}

/// Restarts until the crowd ends the run.
pub(super) fn run<E, F>(crowd: &mut Crowd<'_, F>, members: usize) -> Ended<E>
where
    F: FnMut(&[f64]) -> Result<f64, E>,
{
    let d = crowd.dimension();
    let mut stream = Stream::new(crowd.options.seed, Purpose::Population, 0);
    let (mut mean, sigma) = match &crowd.options.start {
        Some((point, spread)) => (crowd.bounds.to_unit(point), *spread),
        None => ((0..d).map(|_| stream.uniform()).collect(), 0.3),
    };
    let mut size = members;
    loop {
        if let Err(ended) = descend(crowd, &mut stream, Cloud { mean, sigma }, size) {
            return ended;
        }
        mean = (0..d).map(|_| stream.uniform()).collect();
        size *= 2;
    }
}

/// Centre and width of a population, as fractions of the intervals.
struct Cloud {
    mean: Vec<f64>,
    sigma: f64,
}

/// One descent, until the steps or the values no longer differ.
fn descend<E, F>(
    crowd: &mut Crowd<'_, F>,
    stream: &mut Stream,
    start: Cloud,
    members: usize,
) -> Result<(), Ended<E>>
where
    F: FnMut(&[f64]) -> Result<f64, E>,
{
    let Cloud { mut mean, mut sigma } = start;
    let d = mean.len();
    let rates = Rates::new(members, d);
    let mut covariance = Matrix::zeros(d, d);
    for i in 0..d {
        covariance.set(i, i, 1.0);
    }
    let (mut path_sigma, mut path_c) = (vec![0.0; d], vec![0.0; d]);
    let mut flat = 0;
    for generation in 1_u32.. {
        let (squares, axes) = eigen(&covariance);
        let roots: Vec<f64> = squares.iter().map(|s| s.max(1e-20).sqrt()).collect();
        if sigma * roots[d - 1] < 1e-12 || roots[d - 1] > 1e7 * roots[0] {
            return Ok(());
        }
        let mut steps = Vec::with_capacity(members);
        let mut values = Vec::with_capacity(members);
        for _ in 0..members {
            let z: Vec<f64> = roots.iter().map(|r| r * stream.normal()).collect();
            let wish: Vec<f64> =
                axes.times(&z).iter().zip(&mean).map(|(y, m)| m + sigma * y).collect();
            let inside: Vec<f64> = wish.iter().map(|x| x.clamp(0.0, 1.0)).collect();
            let value = crowd.value(&inside)?;
            // a repaired point pays for its distance, in units of the value
            let outside: f64 = wish.iter().zip(&inside).map(|(a, b)| (a - b) * (a - b)).sum();
            values.push(value + (1.0 + value.abs()) * outside);
            steps.push(wish.iter().zip(&mean).map(|(x, m)| (x - m) / sigma).collect::<Vec<f64>>());
        }
        let order = ranking(&values);
        let spread = values[order[members - 1]] - values[order[0]];
        flat = if spread <= 1e-13 * values[order[0]].abs().max(1e-3) { flat + 1 } else { 0 };
        // the usual limit on generations of pycma
        let limit = 100.0 + 50.0 * (d as f64 + 3.0).powi(2) / (members as f64).sqrt();
        if flat > 10 || f64::from(generation) > limit {
            return Ok(());
        }
        let mut shift = vec![0.0; d];
        for (&i, w) in order.iter().zip(&rates.weights) {
            for (s, y) in shift.iter_mut().zip(&steps[i]) {
                *s += w * y;
            }
        }
        for (m, s) in mean.iter_mut().zip(&shift) {
            *m += sigma * s;
        }
        // C^(−½)·shift
        let along: Vec<f64> =
            axes.transpose_times(&shift).iter().zip(&roots).map(|(a, r)| a / r).collect();
        let white = axes.times(&along);
        let keep = (rates.c_sigma * (2.0 - rates.c_sigma) * rates.mu_eff).sqrt();
        for (p, w) in path_sigma.iter_mut().zip(&white) {
            *p = (1.0 - rates.c_sigma) * *p + keep * w;
        }
        let length = norm(&path_sigma);
        let warmed = 1.0 - libm::pow(1.0 - rates.c_sigma, 2.0 * f64::from(generation));
        let moving = length / warmed.sqrt() < (1.4 + 2.0 / (d as f64 + 1.0)) * rates.chi;
        let keep = if moving { (rates.c_c * (2.0 - rates.c_c) * rates.mu_eff).sqrt() } else { 0.0 };
        for (p, s) in path_c.iter_mut().zip(&shift) {
            *p = (1.0 - rates.c_c) * *p + keep * s;
        }
        let ranked: Vec<&[f64]> = order.iter().map(|&k| steps[k].as_slice()).collect();
        adapt(&mut covariance, &rates, &Path { steps: &path_c, moving }, &ranked);
        sigma *= libm::exp((rates.c_sigma / rates.d_sigma) * (length / rates.chi - 1.0));
        sigma = sigma.min(1.0);
    }
    Ok(())
}

/// The evolution path, and whether it is followed in this generation.
struct Path<'a> {
    steps: &'a [f64],
    moving: bool,
}

/// The rank-one and rank-µ updates; `ranked` holds the steps of the members, best first.
fn adapt(covariance: &mut Matrix, rates: &Rates, path: &Path<'_>, ranked: &[&[f64]]) {
    let Path { steps: path, moving } = *path;
    let d = path.len();
    let lost = if moving { 0.0 } else { rates.c_c * (2.0 - rates.c_c) };
    for i in 0..d {
        for j in 0..d {
            let ranked: f64 =
                ranked.iter().zip(&rates.weights).map(|(step, w)| w * step[i] * step[j]).sum();
            let old = covariance.get(i, j);
            let new = (1.0 - rates.c_1 - rates.c_mu) * old
                + rates.c_1 * (path[i] * path[j] + lost * old)
                + rates.c_mu * ranked;
            covariance.set(i, j, new);
        }
    }
}
