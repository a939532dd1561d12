//! Bounded least squares on whitened residuals.

use nalgebra::{DMatrix, DVector};

use crate::{
    error::GreyboxError,
    gram::{dot, solve},
    noise::Whitener,
    problem::{PerRecord, Problem},
    structure::{Free, Structure},
};

/// Most steps.
const MOST_STEPS: usize = 10;
/// Most attempts at one step.
const MOST_ATTEMPTS: usize = 5;
/// Fall of the objective, in nats, that ends the search.
const SETTLED_NATS: f64 = 0.2;

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
}

/// Signals of all recordings through the whitener, in one row.
pub(crate) fn whitened(whitener: &Whitener, signals: &PerRecord) -> Vec<f64> {
    signals.iter().flat_map(|signal| whitener.apply(signal)).collect()
}

/// Fits from the starts of the structure. What the first of its free numbers do there may be
/// known nearly: it serves for the first step.
pub(crate) fn fit(
    problem: &Problem<'_>,
    structure: Structure,
    whitener: &Whitener,
    known: &[PerRecord],
) -> Result<Fitted, GreyboxError> {
    let mut values: Vec<f64> =
        structure.free.iter().map(|f| f.start.clamp(f.least, f.most)).collect();
    let mut drive = problem.drives(&[structure.state(problem.machine, &values)])?.remove(0);
    let mut residuals = problem.residuals(&drive);
    let mut white = whitened(whitener, &residuals);
    let mut objective = half_square(&white) + prior(&structure.free, &values);
    let mut sensitivities = known.to_vec();
    sensitivities.extend(problem.sensitivities(&structure, known.len(), &values, &drive)?);
    let mut damping = 1e-4;
    for _ in 0..MOST_STEPS {
        let step = Normal::new(whitener, &structure.free, &values, &sensitivities, &white);
        let mut fallen = None;
        for _ in 0..MOST_ATTEMPTS {
            let next = step.bounded(&structure.free, &values, damping);
            let drive_next = problem.drives(&[structure.state(problem.machine, &next)])?.remove(0);
            let residuals_next = problem.residuals(&drive_next);
            let white_next = whitened(whitener, &residuals_next);
            let objective_next = half_square(&white_next) + prior(&structure.free, &next);
            if objective_next < objective {
                fallen = Some(objective - objective_next);
                (values, drive, residuals) = (next, drive_next, residuals_next);
                (white, objective) = (white_next, objective_next);
                damping *= 0.1;
                break;
            }
            damping = (damping * 10.0).max(1e-3);
        }
        let Some(fallen) = fallen else { break };
        if fallen < SETTLED_NATS {
            break;
        }
        sensitivities = problem.sensitivities(&structure, 0, &values, &drive)?;
    }
    Ok(Fitted { structure, values, residuals, sensitivities, objective })
}

fn half_square(white: &[f64]) -> f64 {
    0.5 * dot(white, white)
}

/// Half the squared distance from what is known beforehand.
fn prior(free: &[Free], values: &[f64]) -> f64 {
    let of = |(free, value): (&Free, &f64)| {
        free.prior.map_or(0.0, |(mean, std)| {
            let z = (value - mean) / std;
            0.5 * z * z
        })
    };
    free.iter().zip(values).map(of).sum()
}

/// Normal equations of a step.
struct Normal {
    curvature: DMatrix<f64>,
    descent: DVector<f64>,
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
            if let Some((mean, std)) = free[i].prior {
                let weight = 1.0 / (std * std);
                curvature[(i, i)] += weight;
                descent[i] -= (values[i] - mean) * weight;
            }
        }
        Self { curvature, descent }
    }

    /// The damped step within the bounds: what would leave them is held there and the others
    /// step without it.
    fn bounded(&self, free: &[Free], values: &[f64], damping: f64) -> Vec<f64> {
        let n = values.len();
        let mut held = vec![None; n];
        for (place, free) in free.iter().enumerate() {
            let at_least = values[place] <= free.least && self.descent[place] < 0.0;
            let at_most = values[place] >= free.most && self.descent[place] > 0.0;
            if at_least || at_most {
                held[place] = Some(0.0);
            }
        }
        loop {
            let open: Vec<usize> = (0..n).filter(|&i| held[i].is_none()).collect();
            let matrix = DMatrix::from_fn(open.len(), open.len(), |i, j| {
                let damped = if i == j { 1.0 + damping } else { 1.0 };
                self.curvature[(open[i], open[j])] * damped
            });
            let taken = |i: usize| -> f64 {
                let fixed = held.iter().enumerate();
                fixed.map(|(j, d)| d.unwrap_or(0.0) * self.curvature[(open[i], j)]).sum()
            };
            let right = DVector::from_fn(open.len(), |i, _| self.descent[open[i]] - taken(i));
            let step = solve(&matrix, &right);
            let mut left = false;
            for (i, &place) in open.iter().enumerate() {
                let (next, free) = (values[place] + step[i], &free[place]);
                if next < free.least || next > free.most {
                    held[place] = Some(next.clamp(free.least, free.most) - values[place]);
                    left = true;
                }
            }
            if !left {
                let mut next = values.to_vec();
                for (place, d) in held.iter().enumerate() {
                    next[place] += d.unwrap_or(0.0);
                }
                for (i, &place) in open.iter().enumerate() {
                    next[place] += step[i];
                }
                for (value, free) in next.iter_mut().zip(free) {
                    *value = value.clamp(free.least, free.most);
                }
                return next;
            }
        }
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
        if let Some((_, std)) = free.prior {
            let weight = 1.0 / (std * std);
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

fn inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let n = matrix.nrows();
    let mut inverse = DMatrix::zeros(n, n);
    for i in 0..n {
        let mut unit = DVector::zeros(n);
        unit[i] = 1.0;
        inverse.set_column(i, &solve(matrix, &unit));
    }
    inverse
}
