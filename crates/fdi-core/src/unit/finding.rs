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
//! The chance that any direction of a healthy machine is detected is at most
//! `FAMILY_FALSE_ALARM_RATE`, that of a learnt unit over its whole history: the `n`-th recording since
//! it was new may spend `1/(n·(n + 1))` of it. From the second one on, half of that is for what the
//! recording shows itself, and half for a wear that all of them show together.
//!
//! # Source
//!
//! Likelihood ratio (Wilks, Ann. Math. Stat. 9, 1938), Bonferroni's inequality, spending of an error
//! rate over a sequence (Lan and `DeMets`, Biometrika 70, 1983); `docs/models/units.md`.

use ema_sim::{Parameter, UncertainNumber};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::ContinuousCDF;

use crate::{
    online::posterior::{ECCENTRICITY, TWO_SIDED, standard},
    report::{FAMILY_FALSE_ALARM_RATE, FaultId, Finding, FindingKind},
    unit::{
        joint::{DamageFit, Joint},
        layout::Layout,
    },
};

/// Standard deviation over that of known numbers from which a direction is ambiguous: tolerances
/// leave twice as much open as the recording does.
const AMBIGUOUS_RATIO: f64 = 2.236_067_977_499_79;
/// Coordinates of the shorts.
const SHORTS: [usize; 3] = [2, 3, 4];

/// A direction in the damage looked for.
struct Direction {
    id: &'static str,
    members: Vec<&'static str>,
    /// One weight a coordinate looked for; two rows are an amplitude in a plane.
    weights: Vec<Vec<f64>>,
    /// Faults that are detected with it.
    faults: Vec<FaultId>,
    /// Measurements that would tell, without references and with them.
    would_tell: [&'static str; 2],
}

/// Origin that damage is counted from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Since {
    /// The machine as its data sheet has it.
    AsBuilt,
    /// The machine as its references have it.
    References,
}

/// Recordings of a unit that findings are of.
#[derive(Clone, Debug)]
pub(crate) struct History<'a> {
    /// The recording diagnosed with others, its damage looked for by itself.
    pub(crate) joint: Joint<'a>,
    /// Fit of the recordings with the damage a wear; `None` where none of them is of a later session.
    pub(crate) worn: Option<Joint<'a>>,
    pub(crate) since: Since,
    /// Place of the recording among those since the unit was new, from 1.
    pub(crate) nth: usize,
}

impl History<'_> {
    /// Chance of a false alarm that the recording may spend.
    fn rate(&self) -> f64 {
        let nth = self.nth as f64;
        match self.since {
            Since::AsBuilt => FAMILY_FALSE_ALARM_RATE,
            Since::References => FAMILY_FALSE_ALARM_RATE / (nth * (nth + 1.0)),
        }
    }
}

/// Findings of a fit, with the faults that each of them detects.
pub(crate) struct Findings {
    pub(crate) all: Vec<Finding>,
    pub(crate) detected: Vec<FaultId>,
}

impl Findings {
    /// Findings of damage that recordings of a unit show together.
    pub(crate) fn of(layout: &Layout, history: &History<'_>, damage: &DamageFit) -> Self {
        Self::at_rate(history.rate(), layout, history, damage)
    }

    /// Findings, any of them detected by chance at some rate.
    pub(crate) fn at_rate(
        rate: f64,
        layout: &Layout,
        history: &History<'_>,
        damage: &DamageFit,
    ) -> Self {
        let directions = directions(layout, history.joint.has_voltage());
        let tests = if history.worn.is_some() { 2.0 } else { 1.0 };
        let rate = rate / (tests * directions.len().max(1) as f64);
        let estimate = DVector::from_column_slice(&damage.estimate);
        let joint = &history.joint;
        let whole = joint.least_sum(&[]);
        let worn = history.worn.as_ref().and_then(|worn| Some((worn, worn.least_sum(&[])?)));
        let mut findings = Self { all: Vec::new(), detected: Vec::new() };
        for direction in &directions {
            let without = joint.least_sum(&direction.weights);
            // how much less probable the best explanation is without damage along a direction, `D`
            let loss = without.zip(whole).map_or(0.0, |(without, whole)| without - whole);
            let of_wear = worn.and_then(|(worn, whole)| {
                Some(worn.least_sum_of_wear(&direction.weights)? - whole)
            });
            let loss = loss.max(of_wear.unwrap_or(0.0));
            let finding = direction.finding(&estimate, damage, rate, loss, history.since);
            if finding.detected {
                findings.detected.extend(&direction.faults);
            }
            findings.all.push(finding);
        }
        findings
    }
}

impl Direction {
    fn finding(
        &self,
        estimate: &DVector<f64>,
        fit: &DamageFit,
        rate: f64,
        loss: f64,
        since: Since,
    ) -> Finding {
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
        let told = match since {
            Since::AsBuilt => FindingKind::Known,
            Since::References => FindingKind::Changed,
        };
        Finding {
            kind: if ambiguous { FindingKind::Ambiguous } else { told },
            id: self.id.to_owned(),
            members: self.members.iter().map(|&member| member.to_owned()).collect(),
            value,
            std,
            interval_95: [(value - TWO_SIDED * std).max(least), value + TWO_SIDED * std],
            detected,
            prior_std: (std * std - posterior_std * posterior_std).max(0.0).sqrt(),
            posterior_std,
            would_tell: ambiguous.then(|| self.would_tell[since as usize].to_owned()),
        }
    }
}

const REFERENCES: [&str; 2] = ["recordings of the same unit as new", "recordings of other days"];

const REFERENCES_OR_A_THERMOMETER: [&str; 2] = [
    "recordings of the same unit as new, or the winding's temperature",
    "the winding's temperature, or recordings of other days",
];

const REFERENCES_OR_READINGS: [&str; 2] = [
    "recordings of the same unit as new, the winding's temperature, or the motor's voltage",
    "the winding's temperature, or the motor's voltage",
];

/// The directions that a test of a machine can show, with the motor's voltage or without.
fn directions(layout: &Layout, has_voltage: bool) -> Vec<Direction> {
    let thermometer =
        if has_voltage { REFERENCES_OR_A_THERMOMETER } else { REFERENCES_OR_READINGS };
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
        all.push(single(0, "friction", &["k1", Parameter::KINETIC_FRICTION.key()]));
    }
    if has(1) {
        all.push(single(1, "play", &["k2", Parameter::BACKLASH.key()]));
    }
    let phases: Vec<usize> = SHORTS.into_iter().filter(|&short| has(short)).collect();
    if let [short] = phases[..] {
        let fault = ["k3", "k4", "k5"][short - SHORTS[0]];
        all.push(single(short, "torque-constant", &[fault, Parameter::BACK_EMF.key()]));
    } else if phases.len() > 1 {
        for &short in &phases {
            let others = phases.iter().filter(|&&other| other != short);
            let share = -1.0 / (phases.len() - 1) as f64;
            let mut pairs: Vec<(usize, f64)> = others.map(|&other| (other, share)).collect();
            pairs.push((short, 1.0));
            let named = short - SHORTS[0];
            all.push(Direction {
                id: ["imbalance-a", "imbalance-b", "imbalance-c"][named],
                members: vec![
                    ["k3", "k4", "k5"][named],
                    UncertainNumber::Turns.key(),
                    UncertainNumber::PhaseGain.key(),
                ],
                weights: vec![along(&pairs)],
                faults: vec![FaultId::ALL[short]],
                would_tell: REFERENCES,
            });
        }
        let share = 1.0 / phases.len() as f64;
        let pairs: Vec<(usize, f64)> = phases.iter().map(|&short| (short, share)).collect();
        all.push(Direction {
            id: "torque-constant",
            members: vec![
                "k3",
                "k4",
                "k5",
                Parameter::BACK_EMF.key(),
                UncertainNumber::PhaseGain.key(),
            ],
            weights: vec![along(&pairs)],
            // which of the phases it is, imbalances say
            faults: Vec::new(),
            would_tell: thermometer,
        });
    }
    if ECCENTRICITY.into_iter().all(has) {
        all.push(Direction {
            id: "eccentricity",
            members: vec!["k6", UncertainNumber::Eccentricity.key()],
            weights: ECCENTRICITY.iter().map(|&one| along(&[(one, 1.0)])).collect(),
            faults: vec![FaultId::K6],
            would_tell: REFERENCES,
        });
    }
    all
}
