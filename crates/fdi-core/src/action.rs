//! From an answer to what to do about the machine.
//!
//! ```text
//! p(k | y) ∝ N(k; k̂, C)·Π e^(−k_i/m_i)·e^(−(x² + y²)/(2s²))       k_i ≥ 0
//!          ∝ N(k; A⁻¹b, A⁻¹),   A = C⁻¹ + diag(0, …, s⁻², s⁻²),   b = C⁻¹·k̂ − (1/m, 0, 0)
//! ```
//!
//! Machines in service are taken to have damage of each kind below the level at which it is watched:
//! sizes of `k1` to `k5` decay exponentially, an eccentricity is normal in both coordinates, and each is
//! above that level with the same chance, [`ABOVE_WATCH`]. The answer is then a normal cut to sizes that exist, whose
//! probabilities are those of a lattice of points drawn one coordinate after the other, weighted by
//! what each step cuts off.
//!
//! # Source
//!
//! Genz, J. Comput. Graph. Statist. 1, 1992 (separation of variables); Richtmyer's lattice: Niederreiter,
//! *Random Number Generation and Quasi-Monte Carlo Methods*, 1992, ch. 5.

use ema_sim::FaultCoordinates;
use fdi_report::{
    Action, ActionLevels, FaultAction, FaultId, FindingKind, Limits, RecordDiagnosis, Severity,
};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal};

/// Chance that a machine in service has damage of a kind above the level at which it is watched.
pub const ABOVE_WATCH: f64 = 0.135_335_283_236_612_7;
/// Probability from which a level is taken to be passed, or one less which not to be.
const DECIDED: f64 = 0.9;
/// Points of the lattice; twice as many move no probability by more than 0.002.
const POINTS: usize = 4096;
/// Square roots of these are the steps of the lattice.
const PRIMES: [f64; 7] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0];
/// Cuts beyond so many standard deviations leave an exponential tail.
const FAR: f64 = 8.0;
/// Coordinates of the eccentricity.
const ECCENTRICITY: [&str; 2] = [FaultCoordinates::NAMES[5], FaultCoordinates::NAMES[6]];

/// Decides what to do by an answer: how probable it is that each fault is above levels of k1 to k6.
///
/// # Examples
///
/// ```no_run
/// use fdi_core::{decide, report::{ActionLevels, RecordDiagnosis, Severity}};
///
/// # let answer: RecordDiagnosis = todo!();
/// let action = decide(&answer, &ActionLevels::default());
/// if action.severity == Severity::Act {
///     println!("{}", action.next);
/// }
/// ```
pub fn decide(answer: &RecordDiagnosis, levels: &ActionLevels) -> Action {
    let open = |next: &str| Action {
        severity: Severity::Undecided,
        fault: None,
        probability_above: None,
        next: next.to_owned(),
        faults: Vec::new(),
    };
    if !answer.is_believed() {
        return open(
            "find out why the model does not explain the recording: sensors, command and load first, \
             then `fdi explain`",
        );
    }
    let Some(points) = Points::of(answer, levels) else {
        return open("record a test that shows the faults: this one determines none");
    };
    let since = Since::of(answer);
    let faults: Vec<FaultAction> =
        FaultId::ALL[..6].iter().filter_map(|&id| points.fault(id, levels, since)).collect();
    let worst = faults.iter().max_by(|a, b| {
        let rank = |one: &FaultAction| (one.severity, one.probability_above.watch);
        let ((a, a_above), (b, b_above)) = (rank(a), rank(b));
        a.cmp(&b).then(a_above.total_cmp(&b_above))
    });
    let Some(worst) = worst else {
        return open("record a test that shows the faults: this one determines none");
    };
    Action {
        severity: worst.severity,
        fault: Some(worst.id),
        probability_above: Some(worst.probability_above),
        next: next(worst, answer),
        faults: faults.clone(),
    }
}

/// Origin of the sizes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Since {
    Nominal,
    New,
}

impl Since {
    fn of(answer: &RecordDiagnosis) -> Self {
        let is_change = answer.findings.iter().any(|one| one.kind == FindingKind::Changed);
        if is_change { Self::New } else { Self::Nominal }
    }
}

/// Size of a fault by its level: what is added, what multiplies, and the unit.
fn size_of(id: FaultId, since: Since) -> (f64, f64, &'static str) {
    match (id, since) {
        (FaultId::K1, Since::Nominal) => (0.0, 200.0, "% of friction torque above nominal"),
        (FaultId::K1, Since::New) => (0.0, 200.0, "% of nominal friction torque above new"),
        (FaultId::K2, Since::Nominal) => (1.0, 99.0, "times nominal play"),
        (FaultId::K2, Since::New) => (0.0, 99.0, "times nominal play more than new"),
        (FaultId::K6 | FaultId::K7, _) => (0.0, 100.0, "% of the air gap"),
        _ => (0.0, 100.0, "% of the turns shorted"),
    }
}

/// Part of the machine to look at.
fn part(id: FaultId) -> &'static str {
    match id {
        FaultId::K1 => "bearings, gear, screw and their lubrication",
        FaultId::K2 => "the play of gear and screw",
        FaultId::K3 => "the winding of phase A (resistance, insulation)",
        FaultId::K4 => "the winding of phase B (resistance, insulation)",
        FaultId::K5 => "the winding of phase C (resistance, insulation)",
        FaultId::K6 | FaultId::K7 => "the motor's bearings and rotor",
    }
}

/// The next step for the worst fault.
fn next(worst: &FaultAction, answer: &RecordDiagnosis) -> String {
    let FaultAction { id, size, interval_95: [low, high], unit, levels, probability_above, .. } =
        worst;
    let (name, percent) = (id.name(), |of: f64| (100.0 * of).round());
    match worst.severity {
        Severity::Act => format!(
            "{name} {} {unit}, {} % above {}: take the machine out of service and look at {}",
            short(*size),
            percent(probability_above.act),
            short(levels.act),
            part(*id),
        ),
        Severity::Watch => format!(
            "{name} {} {unit}, {} % above {}: record again soon and follow it (`fdi diagnose --report` of all its recordings)",
            short(*size),
            percent(probability_above.watch),
            short(levels.watch),
        ),
        Severity::Undecided => {
            let mut told =
                answer.findings.iter().filter(|one| one.faults().any(|fault| fault == *id));
            let would = told.find_map(|one| one.would_tell.as_deref());
            let tell = would.unwrap_or("a recording with less noise, or several of one session");
            format!(
                "{name} between {} and {} {unit} is not decided by this test ({} % above \
                 {}): {tell} would decide more",
                short(*low),
                short(*high),
                percent(probability_above.watch),
                short(levels.watch),
            )
        }
        _ => "record again when it is due".to_owned(),
    }
}

/// A size to three digits.
fn short(size: f64) -> String {
    let decimals = (2 - size.abs().max(1e-3).log10().floor() as i32).clamp(0, 3) as usize;
    let text = format!("{size:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Weighted points of the posterior, one row a determined coordinate.
struct Points {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
    weights: Vec<f64>,
}

impl Points {
    /// Points of an answer's posterior; `None` where nothing is determined.
    fn of(answer: &RecordDiagnosis, levels: &ActionLevels) -> Option<Self> {
        let names = answer.covariance.parameters.clone();
        let order = names.len();
        let place = |name: &str| FaultCoordinates::NAMES.iter().position(|one| *one == name);
        let coordinates: Vec<usize> =
            names.iter().map(|name| place(name)).collect::<Option<_>>()?;
        let matrix = &answer.covariance.matrix;
        let covariance = DMatrix::from_fn(order, order, |i, j| matrix[i][j]);
        let mut precision = covariance.cholesky()?.inverse();
        let estimate = DVector::from_column_slice(&answer.covariance.estimate);
        let mut pull = &precision * estimate;
        for (row, &coordinate) in coordinates.iter().enumerate() {
            if coordinate < 5 {
                pull[row] -= rate(levels.watch[coordinate]);
            } else {
                precision[(row, row)] += spread(levels.watch[5]).powi(-2);
            }
        }
        let covariance = precision.cholesky()?.inverse();
        let mean = &covariance * pull;
        let lower = covariance.cholesky()?.l();
        let mut points = Self { names, rows: vec![Vec::new(); order], weights: Vec::new() };
        let mut logarithms = Vec::with_capacity(POINTS);
        for point in 0..POINTS {
            let (at, logarithm) = drawn(point, &mean, &lower, &coordinates);
            for (row, value) in points.rows.iter_mut().zip(at) {
                row.push(value);
            }
            logarithms.push(logarithm);
        }
        let most = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        points.weights = logarithms.iter().map(|logarithm| (logarithm - most).exp()).collect();
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

    fn fault(&self, id: FaultId, levels: &ActionLevels, since: Since) -> Option<FaultAction> {
        let of_fault = self.levels(id)?;
        let index = id as usize;
        let (watch, act) = (levels.watch[index], levels.act[index]);
        let above = |limit: f64| {
            let at = of_fault.iter().zip(&self.weights).filter(|(level, _)| **level > limit);
            at.map(|(_, weight)| weight).sum::<f64>().min(1.0)
        };
        let probability_above = Limits { watch: above(watch), act: above(act) };
        let (offset, scale, unit) = size_of(id, since);
        let sized = |level: f64| offset + scale * level;
        let [low, middle, high] = self.quantiles(&of_fault, [0.025, 0.5, 0.975]);
        Some(FaultAction {
            id,
            severity: severity(probability_above),
            size: sized(middle),
            interval_95: [sized(low), sized(high)],
            unit: unit.to_owned(),
            levels: Limits { watch: sized(watch), act: sized(act) },
            probability_above,
            prior_above: prior_above(id, watch, act),
        })
    }

    fn quantiles<const N: usize>(&self, values: &[f64], at: [f64; N]) -> [f64; N] {
        let mut sorted: Vec<(f64, f64)> =
            values.iter().copied().zip(self.weights.iter().copied()).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        at.map(|share| {
            let mut below = 0.0;
            let found = sorted.iter().find(|(_, weight)| {
                below += weight;
                below >= share
            });
            found.or(sorted.last()).map_or(0.0, |(value, _)| *value)
        })
    }
}

/// Decay of an exponential that is above a level with [`ABOVE_WATCH`].
fn rate(watch: f64) -> f64 {
    -ABOVE_WATCH.ln() / watch
}

/// Standard deviation of both coordinates of an eccentricity that is above a size with [`ABOVE_WATCH`].
fn spread(watch: f64) -> f64 {
    watch / (-2.0 * ABOVE_WATCH.ln()).sqrt()
}

fn prior_above(id: FaultId, watch: f64, act: f64) -> Limits {
    let above = |limit: f64| {
        let decay = if id == FaultId::K6 { (limit / watch).powi(2) } else { limit / watch };
        ABOVE_WATCH.powf(decay)
    };
    Limits { watch: above(watch), act: above(act) }
}

fn severity(above: Limits) -> Severity {
    if above.act >= DECIDED {
        Severity::Act
    } else if above.watch >= DECIDED {
        Severity::Watch
    } else if above.watch <= 1.0 - DECIDED {
        Severity::Nothing
    } else {
        Severity::Undecided
    }
}

/// A point of the lattice as one of the cut normal, with the logarithm of its weight.
fn drawn(
    point: usize,
    mean: &DVector<f64>,
    lower: &DMatrix<f64>,
    coordinates: &[usize],
) -> (Vec<f64>, f64) {
    let normal = Normal::standard();
    let mut white: Vec<f64> = Vec::with_capacity(coordinates.len());
    let mut at = Vec::with_capacity(coordinates.len());
    let mut logarithm = 0.0;
    for (row, &coordinate) in coordinates.iter().enumerate() {
        let share = ((point as f64 + 0.5) * PRIMES[row].sqrt()).fract().clamp(1e-12, 1.0 - 1e-12);
        let before: f64 = (0..row).map(|n| lower[(row, n)] * white[n]).sum();
        let middle = mean[row] + before;
        let step = if coordinate >= 5 {
            normal.inverse_cdf(share)
        } else {
            let cut = -middle / lower[(row, row)];
            let (step, ln_left) = beyond(cut, share, &normal);
            logarithm += ln_left;
            step
        };
        white.push(step);
        at.push(middle + lower[(row, row)] * step);
    }
    (at, logarithm)
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

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;
    use crate::report::{Covariance, Fidelity, Fit, Method, NoiseSource, Status, Verdict};

    /// An answer with independent levels.
    fn answer(estimate: &[f64], stds: &[f64]) -> RecordDiagnosis {
        let parameters = FaultCoordinates::NAMES[..estimate.len()].iter();
        let entry = |i: usize, j: usize| if i == j { stds[i] * stds[i] } else { 0.0 };
        let order = estimate.len();
        let rows = (0..order).map(|i| (0..order).map(|j| entry(i, j)).collect());
        let covariance = Covariance {
            parameters: parameters.map(|&name| name.to_owned()).collect(),
            estimate: estimate.to_vec(),
            matrix: rows.collect(),
        };
        RecordDiagnosis {
            recording: "r".to_owned(),
            recording_sha256: None,
            actuator_id: None,
            date: None,
            status: Status::Ok,
            verdict: Verdict::Healthy,
            bundle: None,
            method: Method::Gls,
            fidelity: Fidelity::Low,
            evaluations: 1,
            elapsed_s: None,
            discrepancy: 0.0,
            fit: Fit {
                rms_a: 0.0,
                noise_floor_a: 1.0,
                noise_a: 0.02,
                noise_source: NoiseSource::Flag,
                adequate: true,
            },
            faults: Vec::new(),
            findings: Vec::new(),
            action: None,
            covariance,
            notices: Vec::new(),
        }
    }

    #[test]
    fn what_a_recording_leaves_open_is_what_is_assumed() {
        let levels = ActionLevels::default();
        let action = decide(&answer(&[0.3; 7], &[1e3; 7]), &levels);
        for fault in &action.faults {
            let FaultAction { probability_above, prior_above, .. } = fault;
            assert_abs_diff_eq!(probability_above.watch, prior_above.watch, epsilon = 0.005);
            assert_abs_diff_eq!(probability_above.act, prior_above.act, epsilon = 0.005);
        }
        assert_abs_diff_eq!(action.faults[5].prior_above.watch, ABOVE_WATCH, epsilon = 1e-12);
    }

    #[test]
    fn sizes_that_are_seen_decide() {
        let levels = ActionLevels::default();
        let severity = |friction: f64, std: f64| {
            decide(&answer(&[friction], &[std]), &levels).faults[0].severity
        };
        assert_eq!(severity(0.01, 0.002), Severity::Nothing);
        assert_eq!(severity(0.15, 0.01), Severity::Watch);
        assert_eq!(severity(0.25, 0.01), Severity::Act);
        assert_eq!(severity(0.1, 0.05), Severity::Undecided);
        // far below what exists there is the least damage, and no division by nothing
        assert_eq!(severity(-0.5, 0.002), Severity::Nothing);
    }

    #[test]
    fn what_shorts_have_in_common_stays_in_common() {
        let mut answer = answer(&[0.0, 0.0, 0.02, 0.02, 0.02], &[0.01; 5]);
        for i in 2..5 {
            for j in 2..5 {
                answer.covariance.matrix[i][j] = if i == j { 1e-4 } else { 0.999e-4 };
            }
        }
        let action = decide(&answer, &ActionLevels::default());
        let above = |place: usize| action.faults[place].probability_above.watch;
        assert_abs_diff_eq!(above(2), above(3), epsilon = 0.01);
        assert_abs_diff_eq!(above(3), above(4), epsilon = 0.01);
        // three priors pull at one size: 0.02 − 3·100·1e-4 is below zero
        assert!(above(2) < 0.1, "{}", above(2));
    }

    #[test]
    fn an_answer_that_is_not_believed_decides_nothing() {
        let mut answer = answer(&[0.3], &[0.001]);
        answer.verdict = Verdict::ModelInadequate;
        let action = decide(&answer, &ActionLevels::default());
        assert_eq!((action.severity, action.fault), (Severity::Undecided, None));
        assert!(action.next.contains("fdi explain"));
    }
}
