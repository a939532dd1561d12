//! A set of causes fitted to recordings, and its evidence.
//!
//! ```text
//! y = m(x) + e      e_t = Σ a_i·e_{t−i} + s·ε_t      x_i ~ N(base_i, std_i²)
//! ln Z = Σ_signals −n/2·(ln 2πs² + 1) − p/2·ln n  −  ½·|u|²  −  ½·ln det(I + JᵀJ)  +  h·ln 2
//! ```
//!
//! with `u = (x − base)/std`, the white slopes `J` in these units, the order `p` of the noise, and
//! `h` sizes that have one sign. The noise is fitted with the causes: a set of none with noise that
//! remembers is the rival "something smooth that nobody named".
//!
//! # Source
//!
//! D. `MacKay`, *Information Theory, Inference, and Learning Algorithms*, chapter 28 (Laplace's
//! approximation of the evidence); the noise as in `inference::Whitener`.

use inference::{MostProbable, Unknown, Whitened, Whitener, most_probable, rms};

use crate::{
    cause::{Cause, Size},
    model::ModelError,
    problem::{Problem, Residuals},
};

/// Times that noise and sizes are fitted in turns: with white noise while it falls, then with the
/// noise that the residuals show.
const WHITE_TURNS: usize = 6;
const COLOURED_TURNS: usize = 2;
/// Fall of white noise in a turn below which it has come to its end.
const FALL: f64 = 0.05;
/// Samples of a recording by which the memory of noise is judged, where there are such: what the
/// largest order needs.
const LONG: usize = 300;
/// Step of a derivative in standard deviations: of the prior at first, then of the posterior.
pub(crate) const FIRST_STEP: f64 = 0.02;
const STEP_OVER_STD: f64 = 0.3;
const LEAST_STEP: f64 = 1e-6;
/// White residual in place of one that is no number: any other is better.
const DIVERGED: f64 = 1e6;

/// A set of causes as it fits.
#[derive(Clone, Debug)]
pub(crate) struct Fitted {
    pub(crate) causes: Vec<Cause>,
    /// Values of [`Problem::sizes`], and their standard deviations.
    pub(crate) values: Vec<f64>,
    pub(crate) stds: Vec<f64>,
    /// Correlation of each pair of sizes.
    pub(crate) correlations: Vec<Vec<f64>>,
    pub(crate) residuals: Residuals,
    /// Noise of each signal.
    pub(crate) noise: Vec<Whitener>,
    /// Logarithm of the evidence, without the prior of the set.
    pub(crate) ln_evidence: f64,
}

/// White residuals as a function of the sizes in units of their prior.
struct White<'a> {
    problem: &'a Problem<'a>,
    causes: &'a [Cause],
    sizes: &'a [Size],
    noise: &'a [Whitener],
    steps: Vec<f64>,
    last: Option<(Vec<f64>, Vec<f64>)>,
}

/// Values of sizes within their bounds.
pub(crate) fn values(sizes: &[Size], units: &[f64]) -> Vec<f64> {
    let of =
        |(size, unit): (&Size, &f64)| (size.base + size.std * unit).clamp(size.least, size.most);
    sizes.iter().zip(units).map(of).collect()
}

/// Direction of a step that stays within the bounds of a size.
pub(crate) fn inward(size: &Size, unit: f64, step: f64) -> f64 {
    if size.base + size.std * (unit + step) > size.most { -step } else { step }
}

/// Residuals as white numbers, one signal and recording after the other.
pub(crate) fn whitened(residuals: &Residuals, noise: &[Whitener]) -> Vec<f64> {
    let each = residuals.iter().zip(noise);
    each.flat_map(|(of_signal, noise)| of_signal.iter().flat_map(|e| noise.apply(e))).collect()
}

impl White<'_> {
    fn at(&self, units: &[f64]) -> Result<Vec<f64>, ModelError> {
        let values = values(self.sizes, units);
        let residuals = self.problem.residuals(self.problem.train, self.causes, &values)?;
        let mut white = whitened(&residuals, self.noise);
        if white.iter().any(|z| !z.is_finite()) {
            white.fill(DIVERGED);
        }
        Ok(white)
    }
}

impl Whitened for White<'_> {
    type Error = ModelError;

    fn residual(&mut self, units: &[f64]) -> Result<Vec<f64>, ModelError> {
        let white = self.at(units)?;
        self.last = Some((units.to_vec(), white.clone()));
        Ok(white)
    }

    fn slopes(&mut self, units: &[f64]) -> Result<Vec<Vec<f64>>, ModelError> {
        let here = match self.last.take() {
            Some((at, white)) if at == units => white,
            _ => self.at(units)?,
        };
        let mut slopes = Vec::with_capacity(units.len());
        for (place, size) in self.sizes.iter().enumerate() {
            let step = inward(size, units[place], self.steps[place]);
            let mut moved = units.to_vec();
            moved[place] += step;
            let there = self.at(&moved)?;
            slopes.push(here.iter().zip(there).map(|(a, b)| (a - b) / step).collect());
        }
        self.last = Some((units.to_vec(), here));
        Ok(slopes)
    }
}

/// Fits a set of causes from a start, in units of the priors.
pub(crate) fn fit(
    problem: &Problem<'_>,
    causes: &[Cause],
    start: &[f64],
) -> Result<Fitted, ModelError> {
    let sizes = problem.sizes(causes);
    let unknowns = vec![Unknown { prior_std: Some(1.0), reach: 1.0 }; sizes.len()];
    let mut steps = vec![FIRST_STEP; sizes.len()];
    let mut units = start.to_vec();
    let mut residuals = problem.residuals(problem.train, causes, &values(&sizes, &units))?;
    let mut noise = white_noise(problem, &residuals);
    let mut found: Option<MostProbable> = None;
    let (mut white_turns, mut coloured_turns) = (0, 0);
    while coloured_turns <= COLOURED_TURNS {
        let last = None;
        let mut white = White { problem, causes, sizes: &sizes, noise: &noise, steps, last };
        found = most_probable(&mut white, &unknowns, &units)?;
        steps = white.steps;
        if let Some(found) = &found {
            units.clone_from(&found.numbers);
            for (place, step) in steps.iter_mut().enumerate() {
                let std = found.covariance.at(place, place).sqrt();
                *step = (STEP_OVER_STD * std).clamp(LEAST_STEP, FIRST_STEP);
            }
        }
        residuals = problem.residuals(problem.train, causes, &values(&sizes, &units))?;
        let calmer = white_noise(problem, &residuals);
        white_turns += 1;
        if coloured_turns == 0 && white_turns < WHITE_TURNS && falls(&noise, &calmer) {
            noise = calmer;
        } else {
            noise = coloured_noise(problem, &residuals);
            coloured_turns += 1;
        }
    }
    let correlations = found.as_ref().map_or_else(Vec::new, correlations);
    let std = |(place, size): (usize, &Size)| {
        found.as_ref().map_or(size.std, |f| size.std * f.covariance.at(place, place).sqrt())
    };
    Ok(Fitted {
        causes: causes.to_vec(),
        values: values(&sizes, &units),
        stds: sizes.iter().enumerate().map(std).collect(),
        correlations,
        ln_evidence: ln_likelihood(problem, &residuals) + occam(&sizes, &units, found.as_ref()),
        residuals,
        noise,
    })
}

/// Noise without memory, as large as the residuals.
pub(crate) fn white_noise(problem: &Problem<'_>, residuals: &Residuals) -> Vec<Whitener> {
    let of = |(of_signal, floor): (&Vec<Vec<f64>>, &f64)| {
        Whitener::white(rms(&of_signal.concat()).max(*floor))
    };
    residuals.iter().zip(&problem.floors).map(of).collect()
}

/// True where the noise of some signal fell.
fn falls(before: &[Whitener], after: &[Whitener]) -> bool {
    before.iter().zip(after).any(|(before, after)| after.std() < (1.0 - FALL) * before.std())
}

/// Noise with the memory that the residuals show.
fn coloured_noise(problem: &Problem<'_>, residuals: &Residuals) -> Vec<Whitener> {
    let of = |(of_signal, floor): (&Vec<Vec<f64>>, &f64)| {
        // a short recording would keep the memory of the others out of sight
        let longest = of_signal.iter().map(Vec::len).max().unwrap_or(0);
        let long = of_signal.iter().filter(|e| e.len() >= longest.min(LONG));
        let stretches: Vec<&[f64]> = long.map(Vec::as_slice).collect();
        let noise = Whitener::fit(&stretches, 0);
        // what is below the floor keeps its memory
        if noise.std() < *floor { noise.scaled(floor / noise.std()) } else { noise }
    };
    residuals.iter().zip(&problem.floors).map(of).collect()
}

/// Log-likelihood of residuals under the noise that they show.
fn ln_likelihood(problem: &Problem<'_>, residuals: &Residuals) -> f64 {
    let n = problem.samples() as f64;
    let noise = coloured_noise(problem, residuals);
    let of = |(noise, of_signal): (&Whitener, &Vec<Vec<f64>>)| {
        let white: Vec<f64> = of_signal.iter().flat_map(|e| noise.apply(e)).collect();
        let size = rms(&white);
        let order = noise.order() as f64;
        let per_sample =
            libm::log(core::f64::consts::TAU * noise.std() * noise.std()) + size * size;
        -0.5 * (n * per_sample + order * libm::log(n))
    };
    noise.iter().zip(residuals).map(of).sum()
}

/// Cost of the freedom of the sizes.
fn occam(sizes: &[Size], units: &[f64], found: Option<&MostProbable>) -> f64 {
    let away: f64 = units.iter().map(|u| u * u).sum();
    let one_sided = sizes.iter().filter(|size| size.least >= size.base).count() as f64;
    let ln_det = found.map_or(0.0, |found| {
        let n = found.information.order();
        let matrix = nalgebra::DMatrix::from_fn(n, n, |i, j| found.information.at(i, j));
        let cholesky = matrix.cholesky();
        cholesky.map_or(0.0, |c| 2.0 * c.l().diagonal().iter().map(|x| libm::log(*x)).sum::<f64>())
    });
    one_sided * core::f64::consts::LN_2 - 0.5 * (away + ln_det)
}

fn correlations(found: &MostProbable) -> Vec<Vec<f64>> {
    let c = &found.covariance;
    let n = c.order();
    let of = |i: usize, j: usize| c.at(i, j) / (c.at(i, i) * c.at(j, j)).sqrt();
    (0..n).map(|i| (0..n).map(|j| of(i, j)).collect()).collect()
}
