//! Findings: directions of damage with what the tolerances leave open of each.
//!
//! ```text
//! v = wᵀ·x̂,   s² = wᵀ·C·w
//! D = min { ℓ(x) : wᵀ·x = 0 } − min ℓ(x),   detected where D > z² and v > 0
//! imbalance of phase A: k3 − (k4 + k5)/2        torque constant: (k3 + k4 + k5)/3
//! ```
//!
//! with `x̂`, `C` the most probable damage and its covariance, the numbers of the machine marginal, and
//! `ℓ` twice the negative logarithm of their probability: a quadratic form in what the signal shows,
//! which bends with the unknowns, and the priors. A play three times as wide is improbable as a
//! tolerance, however uncertain the level of a fault is that stands beside a tolerance of that size.
//!
//! The chance that any direction of a healthy machine is detected is at most `FAMILY_RATE`.
//!
//! # Source
//!
//! Likelihood ratio (Wilks, Ann. Math. Stat. 9, 1938), Bonferroni's inequality; `docs/models/units.md`.

use core::convert::Infallible;

use inference::{Unknown, Whitened, dot, most_probable};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use statrs::distribution::{ContinuousCDF, Normal};

use crate::{
    report::{FaultId, Finding, FindingKind},
    unit::{
        layout::Layout,
        quantities::Quantities,
        search::{UnitFit, unknowns},
    },
};

/// Largest chance that anything is detected on a healthy machine.
const FAMILY_RATE: f64 = 0.02;
/// Standard deviation over that of known numbers from which a direction is ambiguous: tolerances
/// leave twice as much open as the recording does.
const AMBIGUOUS_RATIO: f64 = 2.236_067_977_499_79;
/// Information of what does not show, over the most that there is.
const LEAST_INFORMATION: f64 = 1e-10;
/// Two-sided normal quantile of 95 %.
const TWO_SIDED: f64 = 1.959_963_984_540_054;
/// Coordinates of the shorts.
const SHORTS: [usize; 3] = [2, 3, 4];
/// Coordinates of the eccentricity.
const ECCENTRICITY: [usize; 2] = [5, 6];

/// A direction in the damage looked for.
struct Direction {
    id: &'static str,
    members: Vec<&'static str>,
    /// One weight a coordinate looked for; two rows are an amplitude in a plane.
    weights: Vec<Vec<f64>>,
    /// Faults that are detected with it.
    faults: Vec<FaultId>,
    would_tell: &'static str,
}

/// Findings of a fit, with the faults that each of them detects.
pub(crate) struct Findings {
    pub(crate) all: Vec<Finding>,
    pub(crate) detected: Vec<FaultId>,
}

impl Findings {
    pub(crate) fn of(quantities: &Quantities, fit: &UnitFit) -> Self {
        let layout = quantities.layout();
        let directions = directions(layout);
        let rate = FAMILY_RATE / directions.len().max(1) as f64;
        let damage = layout.sought.len();
        let estimate = DVector::from_column_slice(&fit.point[..damage]);
        let mut findings = Self { all: Vec::new(), detected: Vec::new() };
        for direction in &directions {
            let loss = loss_without(quantities, fit, &direction.weights);
            let finding = direction.finding(&estimate, fit, rate, loss);
            if finding.detected {
                findings.detected.extend(&direction.faults);
            }
            findings.all.push(finding);
        }
        findings
    }
}

impl Direction {
    fn finding(&self, estimate: &DVector<f64>, fit: &UnitFit, rate: f64, loss: f64) -> Finding {
        let rows = self.weights.len();
        let weights = DMatrix::from_fn(rows, estimate.len(), |row, place| self.weights[row][place]);
        let (size, open) = (&weights * estimate, &weights * &fit.covariance * weights.transpose());
        let known = &weights * &fit.known_numbers * weights.transpose();
        let value = size.norm();
        let (value, along) = if rows == 1 {
            (size[0], DVector::from_element(1, 1.0))
        } else if value > 0.0 {
            (value, size.clone() / value)
        } else {
            (value, DVector::from_fn(rows, |row, _| if row == 0 { 1.0 } else { 0.0 }))
        };
        let spread = |of: &DMatrix<f64>| along.dot(&(of * &along)).max(0.0).sqrt();
        let (std, posterior_std) = (spread(&open), spread(&known));
        let quantile = standard().inverse_cdf(1.0 - rate);
        // for two degrees of freedom the quantile of χ² is −2·ln(rate)
        let limit = if rows == 1 { quantile * quantile } else { -2.0 * rate.ln() };
        let is_told = loss > limit;
        let detected = is_told && (rows > 1 || value > 0.0);
        let ambiguous = !is_told && std > AMBIGUOUS_RATIO * posterior_std;
        let least = if rows == 1 { f64::NEG_INFINITY } else { 0.0 };
        Finding {
            kind: if ambiguous { FindingKind::Ambiguous } else { FindingKind::Known },
            id: self.id.to_owned(),
            members: self.members.iter().map(|&member| member.to_owned()).collect(),
            value,
            std,
            interval_95: [(value - TWO_SIDED * std).max(least), value + TWO_SIDED * std],
            detected,
            prior_std: (std * std - posterior_std * posterior_std).max(0.0).sqrt(),
            posterior_std,
            would_tell: ambiguous.then(|| self.would_tell.to_owned()),
        }
    }
}

/// How much less probable the best explanation is without damage along a direction, `D`.
fn loss_without(quantities: &Quantities, fit: &UnitFit, weights: &[Vec<f64>]) -> f64 {
    // what does not show where the form is taken, such as a static friction below the kinetic one,
    // gets next to no information in place of none, so that there is a factor
    let mut information = fit.shown.information.clone();
    let least = LEAST_INFORMATION * information.diagonal().max();
    for place in 0..information.nrows() {
        information[(place, place)] += least;
    }
    let Some(factor) = information.cholesky() else { return 0.0 };
    let layout = quantities.layout();
    let whole = sum_of(&mut Form::new(quantities, fit, &factor, &[]), layout, fit);
    let without = sum_of(&mut Form::new(quantities, fit, &factor, weights), layout, fit);
    (without - whole).max(0.0)
}

/// Least sum of a form and the priors.
fn sum_of(form: &mut Form<'_>, layout: &Layout, fit: &UnitFit) -> f64 {
    let all = unknowns(layout);
    let kept: Vec<Unknown> = form.kept.iter().map(|&place| all[place]).collect();
    let start: Vec<f64> = form.kept.iter().map(|&place| fit.point[place]).collect();
    let Ok(found) = most_probable(form, &kept, &start);
    let Some(found) = found else { return 0.0 };
    let prior = kept
        .iter()
        .zip(&found.numbers)
        .map(|(unknown, value)| unknown.prior_std.map_or(0.0, |std| (value / std) * (value / std)));
    dot(&found.white, &found.white) + prior.sum::<f64>()
}

/// The log-likelihood as white numbers, with damage along a direction left out.
struct Form<'a> {
    quantities: &'a Quantities,
    fit: &'a UnitFit,
    /// Lower factor of the curvature, transposed.
    upper: DMatrix<f64>,
    /// White residual where the form is taken.
    white: DVector<f64>,
    /// Unknowns that stay free.
    kept: Vec<usize>,
    /// Unknowns that follow from them, each with its shares.
    bound: Vec<(usize, Vec<f64>)>,
}

impl<'a> Form<'a> {
    /// A row of weights takes out the coordinate that weighs most.
    fn new(
        quantities: &'a Quantities,
        fit: &'a UnitFit,
        factor: &Cholesky<f64, Dyn>,
        weights: &[Vec<f64>],
    ) -> Self {
        let lower = factor.l();
        let descent = DVector::from_column_slice(&fit.shown.descent);
        let white = lower.solve_lower_triangular(&descent).unwrap_or(descent);
        let bound: Vec<(usize, Vec<f64>)> = weights
            .iter()
            .filter_map(|row| {
                let place =
                    (0..row.len()).max_by(|&a, &b| row[a].abs().total_cmp(&row[b].abs()))?;
                let share = |(n, weight): (usize, &f64)| {
                    if n == place { 0.0 } else { -weight / row[place] }
                };
                Some((place, row.iter().enumerate().map(share).collect()))
            })
            .collect();
        let is_free = |place: &usize| !bound.iter().any(|(one, _)| one == place);
        let kept = (0..quantities.layout().len()).filter(is_free).collect();
        Self { quantities, fit, upper: lower.transpose(), white, kept, bound }
    }

    fn point(&self, kept: &[f64]) -> Vec<f64> {
        let mut point = vec![0.0; self.quantities.layout().len()];
        for (&place, &value) in self.kept.iter().zip(kept) {
            point[place] = value;
        }
        for (place, shares) in &self.bound {
            point[*place] = shares.iter().zip(&point).map(|(share, value)| share * value).sum();
        }
        point
    }
}

impl Whitened for Form<'_> {
    type Error = Infallible;

    fn residual(&mut self, kept: &[f64]) -> Result<Vec<f64>, Infallible> {
        let shown = self.quantities.shown_at(&self.point(kept));
        let moved = shown.iter().zip(&self.fit.shown.at).map(|(now, at)| now - at);
        let moved = DVector::from_iterator(shown.len(), moved);
        Ok((&self.white - &self.upper * moved).data.into())
    }

    fn slopes(&mut self, kept: &[f64]) -> Result<Vec<Vec<f64>>, Infallible> {
        let all = self.quantities.shown_slopes(&self.point(kept));
        let row = |&place: &usize| {
            let mut row = DVector::from_column_slice(&all[place]);
            for (bound, shares) in &self.bound {
                let share = shares.get(place).copied().unwrap_or(0.0);
                row += share * DVector::from_column_slice(&all[*bound]);
            }
            (&self.upper * row).data.into()
        };
        Ok(self.kept.iter().map(row).collect())
    }
}

const REFERENCES: &str = "recordings of the same unit as new";

/// The directions that a test of a machine can show.
fn directions(layout: &Layout) -> Vec<Direction> {
    let count = layout.sought.len();
    let along = |pairs: &[(usize, f64)]| {
        let mut weights = vec![0.0; count];
        for &(coordinate, weight) in pairs {
            if let Some(place) = layout.place_of(coordinate) {
                weights[place] = weight;
            }
        }
        weights
    };
    let has = |coordinate: usize| layout.place_of(coordinate).is_some();
    let single = |coordinate: usize, id, members: &[&'static str]| Direction {
        id,
        members: members.to_vec(),
        weights: vec![along(&[(coordinate, 1.0)])],
        faults: vec![FaultId::ALL[coordinate]],
        would_tell: REFERENCES,
    };
    let mut all = Vec::new();
    if has(0) {
        all.push(single(0, "friction", &["k1", "transmission.kinetic-friction-n-m"]));
    }
    if has(1) {
        all.push(single(1, "play", &["k2", "transmission.backlash-rad"]));
    }
    let phases: Vec<usize> = SHORTS.into_iter().filter(|&short| has(short)).collect();
    if let [short] = phases[..] {
        let fault = ["k3", "k4", "k5"][short - SHORTS[0]];
        all.push(single(short, "torque-constant", &[fault, "motor.back-emf-v-s-per-rad"]));
    } else if phases.len() > 1 {
        for &short in &phases {
            let others = phases.iter().filter(|&&other| other != short);
            let share = -1.0 / (phases.len() - 1) as f64;
            let mut pairs: Vec<(usize, f64)> = others.map(|&other| (other, share)).collect();
            pairs.push((short, 1.0));
            let named = short - SHORTS[0];
            all.push(Direction {
                id: ["imbalance-a", "imbalance-b", "imbalance-c"][named],
                members: vec![["k3", "k4", "k5"][named], "as-built.turns", "sensors.phase-gain"],
                weights: vec![along(&pairs)],
                faults: vec![FaultId::ALL[short]],
                would_tell: REFERENCES,
            });
        }
        let share = 1.0 / phases.len() as f64;
        let pairs: Vec<(usize, f64)> = phases.iter().map(|&short| (short, share)).collect();
        all.push(Direction {
            id: "torque-constant",
            members: vec!["k3", "k4", "k5", "motor.back-emf-v-s-per-rad", "sensors.phase-gain"],
            weights: vec![along(&pairs)],
            // which of the phases it is, imbalances say
            faults: Vec::new(),
            would_tell: "recordings of the same unit as new, the winding's temperature, or the \
                         motor's voltage",
        });
    }
    if ECCENTRICITY.into_iter().all(has) {
        all.push(Direction {
            id: "eccentricity",
            members: vec!["k6", "as-built.eccentricity"],
            weights: ECCENTRICITY.iter().map(|&one| along(&[(one, 1.0)])).collect(),
            faults: vec![FaultId::K6],
            would_tell: REFERENCES,
        });
    }
    all
}

fn standard() -> Normal {
    Normal::new(0.0, 1.0).expect("the standard normal exists")
}
