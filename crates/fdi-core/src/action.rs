//! From an answer to what to do about the machine.
//!
//! ```text
//! u₁ = ln(1 + 2·k₁),   u₂ = ln(1 + 99·k₂),   uᵢ = kᵢ else
//! p(u | y) ∝ N(u; û, J·C·J)·Π e^(−k_i/m_i)·dk_i/du_i·e^(−(x² + y²)/(2s²))       k_i ≥ 0
//! ```
//!
//! Friction and play of a worn machine are those of the machine as built times `1 + 2·k₁` and
//! `1 + 99·k₂`. Tolerances of both are shares, so that what they leave open of the damage is the wider the
//! more there is: one width in logarithms, `J = du/dk` at the answer.
//!
//! Machines in service are taken to have damage of each kind below the level at which it is watched:
//! sizes of `k1` to `k5` decay exponentially, an eccentricity is normal in both coordinates, and each is
//! above that level with the same chance, [`ABOVE_WATCH`]. Around the most probable `u` the logarithm of
//! the prior is a parabola; the probabilities are those of a lattice of points of the normal that
//! follows, drawn one coordinate after the other, weighted by what each step cuts off and by what the
//! parabola leaves.
//!
//! # Source
//!
//! Genz, J. Comput. Graph. Statist. 1, 1992 (separation of variables); Richtmyer's lattice: Niederreiter,
//! *Random Number Generation and Quasi-Monte Carlo Methods*, 1992, ch. 5.

use std::cmp::Ordering;

use ema_sim::FaultCoordinates;
use fdi_report::{
    Action, ActionLevels, BACKLASH_GAIN, FRICTION_GAIN, FaultAction, FaultId, FindingKind, Limits,
    NoticeCode, RecordDiagnosis, Severity, percent, three_digits,
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
/// Least friction or play that an answer is taken to say, over that as built.
const LEAST_SHARE: f64 = 0.05;
/// Most steps of Newton's method, and the step at which it has settled.
const STEPS: usize = 100;
const SETTLED: f64 = 1e-9;
/// Cuts beyond so many standard deviations leave an exponential tail.
const FAR: f64 = 8.0;
/// Coordinates of the eccentricity.
const ECCENTRICITY: [&str; 2] = [FaultCoordinates::NAMES[5], FaultCoordinates::NAMES[6]];

/// Decides what to do by an answer to several recordings; where these are not of one state of health, by
/// the answers to each of them: the most severe decision counts, and names its recording.
pub fn decide_together<'a>(
    answer: &RecordDiagnosis,
    alone: impl IntoIterator<Item = &'a RecordDiagnosis>,
    levels: &ActionLevels,
) -> Action {
    let together = decide(answer, levels);
    if answer.notice(NoticeCode::RecordingsDisagree).is_none() {
        return together;
    }
    let decided = alone.into_iter().map(|one| (one, decide(one, levels)));
    let worst = decided
        .filter(|(_, action)| action.severity > Severity::Undecided)
        .max_by_key(|(_, action)| action.severity);
    let Some((one, action)) = worst else { return together };
    let reason = format!("{} by itself: {}; {}", one.recording, action.reason, together.reason);
    Action { reason, ..action }
}

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
    let open = |reason: &str, next: &str| Action {
        severity: Severity::Undecided,
        fault: None,
        probability_above: None,
        reason: reason.to_owned(),
        next: next.to_owned(),
        faults: Vec::new(),
    };
    let shows_none = || open("this test determines no fault", "record one that shows the faults");
    if answer.notice(NoticeCode::RecordingsDisagree).is_some() {
        let reason = "the recordings are not of one state of health";
        return open(reason, "diagnose them one by one: when did the machine change?");
    }
    if !answer.is_believed() {
        return open(
            "the model does not explain the recording",
            "find out why: sensors, command and load first, then `fdi explain`",
        );
    }
    let Some(points) = Points::of(answer, levels) else { return shows_none() };
    let since = Since::of(answer);
    let judged: Vec<Judged> =
        FaultId::ALL[..6].iter().filter_map(|&id| points.fault(id, levels, since)).collect();
    let Some(worst) = judged.iter().max_by(|a, b| a.rank(b)) else { return shows_none() };
    let all = judged.iter().map(|one| one.action.clone()).collect();
    let left_out = answer.notice(NoticeCode::RecordingsLeftOut);
    if worst.action.severity == Severity::Nothing && left_out.is_some() {
        let next = "diagnose those left out by themselves, and record them again";
        return Action { faults: all, ..open("not every recording is explained", next) };
    }
    let (reason, next) = told(&worst.action, answer);
    Action {
        severity: worst.action.severity,
        fault: Some(worst.action.id),
        probability_above: Some(worst.action.probability_above),
        reason,
        next,
        faults: all,
    }
}

/// A fault as a decision sees it.
struct Judged {
    action: FaultAction,
    /// Median level over that for watching.
    share_of_watch: f64,
}

impl Judged {
    /// Which of two is worse.
    fn rank(&self, other: &Self) -> Ordering {
        let (a, b) = (&self.action, &other.action);
        let (own, others) = (a.probability_above, b.probability_above);
        a.severity
            .cmp(&b.severity)
            .then(own.act.total_cmp(&others.act))
            .then(own.watch.total_cmp(&others.watch))
            .then(self.share_of_watch.total_cmp(&other.share_of_watch))
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
    let friction = 100.0 * FRICTION_GAIN;
    match (id, since) {
        (FaultId::K1, Since::Nominal) => (0.0, friction, "% of friction torque above nominal"),
        (FaultId::K1, Since::New) => (0.0, friction, "% of nominal friction torque above new"),
        (FaultId::K2, Since::Nominal) => (1.0, BACKLASH_GAIN, "times nominal play"),
        (FaultId::K2, Since::New) => (0.0, BACKLASH_GAIN, "times nominal play more than new"),
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

/// Why a decision is what it is, and the next step, by the worst fault.
fn told(worst: &FaultAction, answer: &RecordDiagnosis) -> (String, String) {
    let FaultAction { id, size, interval_95: [low, high], unit, levels, probability_above, .. } =
        worst;
    let name = id.name();
    let above =
        |share: f64, level: f64| format!("{} above {}", percent(share), three_digits(level));
    let (watch, act) =
        (above(probability_above.watch, levels.watch), above(probability_above.act, levels.act));
    let (reason, next) = match worst.severity {
        Severity::Act => (
            format!("{name} {} {unit}, {act}", three_digits(*size)),
            format!("take the machine out of service and look at {}", part(*id)),
        ),
        Severity::Watch => (
            format!("{name} {} {unit}, {watch}", three_digits(*size)),
            "record again soon and follow it (`fdi diagnose --report` of all its recordings)"
                .to_owned(),
        ),
        Severity::Undecided => {
            let mut told =
                answer.findings.iter().filter(|one| one.faults().any(|fault| fault == *id));
            let would = told.find_map(|one| one.would_tell.as_deref());
            let tell = would.unwrap_or("a recording with less noise, or several of one session");
            let (low, high) = (three_digits(*low), three_digits(*high));
            let open = format!("{name} between {low} and {high} {unit} is not decided, {watch}");
            (open, format!("{tell} would decide more"))
        }
        _ => (
            "every fault is below its level for watching".to_owned(),
            "record again when it is due".to_owned(),
        ),
    };
    (reason, next)
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
        let coordinates: Vec<Coordinate> = names
            .iter()
            .map(|name| place(name).map(|index| Coordinate::of(index, levels)))
            .collect::<Option<_>>()?;
        let estimate = &answer.covariance.estimate;
        let slope = |row: usize| coordinates[row].slope(estimate[row]);
        let matrix = &answer.covariance.matrix;
        let covariance = DMatrix::from_fn(order, order, |i, j| slope(i) * matrix[i][j] * slope(j));
        let precision = covariance.cholesky()?.inverse();
        let found = estimate.iter().zip(&coordinates).map(|(k, of)| of.scaled(*k));
        let found = DVector::from_iterator(order, found);
        let proposal = Proposal::of(&precision, &found, &coordinates)?;
        let mut points = Self { names, rows: vec![Vec::new(); order], weights: Vec::new() };
        let mut logarithms = Vec::with_capacity(POINTS);
        for point in 0..POINTS {
            let (at, logarithm) = proposal.drawn(point, &coordinates);
            for ((row, u), of) in points.rows.iter_mut().zip(at).zip(&coordinates) {
                row.push(of.level(u));
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

    fn fault(&self, id: FaultId, levels: &ActionLevels, since: Since) -> Option<Judged> {
        let of_fault = self.levels(id)?;
        let index = id as usize;
        let (watch, act) = (levels.watch[index], levels.act[index]);
        let above = |limit: f64| {
            let at = of_fault.iter().zip(&self.weights).filter(|(level, _)| **level > limit);
            // a sum of nothing is -0
            at.map(|(_, weight)| weight).sum::<f64>().clamp(0.0, 1.0) + 0.0
        };
        let probability_above = Limits { watch: above(watch), act: above(act) };
        let (offset, scale, unit) = size_of(id, since);
        let sized = |level: f64| offset + scale * level;
        let [low, middle, high] = self.quantiles(&of_fault, [0.025, 0.5, 0.975]);
        let action = FaultAction {
            id,
            severity: severity(probability_above),
            size: sized(middle),
            interval_95: [sized(low), sized(high)],
            unit: unit.to_owned(),
            levels: Limits { watch: sized(watch), act: sized(act) },
            probability_above,
            prior_above: prior_above(id, watch, act),
        };
        Some(Judged { action, share_of_watch: middle / watch })
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

/// One coordinate of the damage, as it is drawn, and its prior.
#[derive(Clone, Copy)]
enum Coordinate {
    /// `u = ln(1 + gain·k)`, `k` exponential with a rate.
    Share { gain: f64, rate: f64 },
    /// `u = k`, exponential with a rate.
    Level { rate: f64 },
    /// `u` a coordinate of the eccentricity, normal with a precision.
    Eccentricity { precision: f64 },
}

impl Coordinate {
    fn of(index: usize, levels: &ActionLevels) -> Self {
        if index >= 5 {
            let spread = levels.watch[5] / (-2.0 * ABOVE_WATCH.ln()).sqrt();
            return Self::Eccentricity { precision: spread.powi(-2) };
        }
        let rate = -ABOVE_WATCH.ln() / levels.watch[index];
        match index {
            0 => Self::Share { gain: FRICTION_GAIN, rate },
            1 => Self::Share { gain: BACKLASH_GAIN, rate },
            _ => Self::Level { rate },
        }
    }

    fn scaled(self, level: f64) -> f64 {
        match self {
            Self::Share { gain, .. } => (1.0 + gain * level).max(LEAST_SHARE).ln(),
            _ => level,
        }
    }

    /// `du/dk` at a level.
    fn slope(self, level: f64) -> f64 {
        match self {
            Self::Share { gain, .. } => gain / (1.0 + gain * level).max(LEAST_SHARE),
            _ => 1.0,
        }
    }

    fn level(self, u: f64) -> f64 {
        match self {
            Self::Share { gain, .. } => u.exp_m1() / gain,
            _ => u,
        }
    }

    /// Logarithm of the prior's density in `u`, up to a constant, with its first two derivatives.
    fn ln_prior(self, u: f64) -> [f64; 3] {
        match self {
            Self::Share { gain, rate } => {
                let decay = rate / gain * u.exp();
                [u - decay, 1.0 - decay, -decay]
            }
            Self::Level { rate } => [-rate * u, -rate, 0.0],
            Self::Eccentricity { precision } => {
                [-0.5 * precision * u * u, -precision * u, -precision]
            }
        }
    }

    /// True where it has no sign.
    fn is_cut(self) -> bool {
        !matches!(self, Self::Eccentricity { .. })
    }

    /// The nearest value that exists.
    fn existing(self, u: f64) -> f64 {
        if self.is_cut() { u.max(0.0) } else { u }
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
                return Some(Self { mean, order, lower: ordered.cholesky()?.l(), at });
            }
            let part = longest.recip().min(1.0);
            at = (0..at.len()).map(|row| at[row] + part * step(row)).collect();
            steps += 1;
        }
    }

    /// A point of the lattice with the logarithm of its weight.
    fn drawn(&self, point: usize, coordinates: &[Coordinate]) -> (Vec<f64>, f64) {
        let Self { mean, order, lower, at } = self;
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
            let (u, near) = (middle + lower[(row, row)] * step, at[place]);
            let ([prior, ..], [summit, slope, curvature]) = (of.ln_prior(u), of.ln_prior(near));
            let off = u - near;
            logarithm += prior - (summit + slope * off + 0.5 * curvature * off * off);
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
            identifiability: Vec::new(),
            action: None,
            covariance,
            notices: Vec::new(),
            together: Vec::new(),
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

    /// Against sums over a grid of the three levels.
    #[test]
    fn versus_a_grid_a_short_beside_others_with_much_in_common() {
        const STEP: f64 = 0.002;
        let (estimate, common, own) = ([0.088, 0.046, 0.031], 0.04f64.powi(2), 0.0035f64.powi(2));
        let mut shorts = answer(&[0.0, 0.0, 0.088, 0.046, 0.031], &[0.01; 5]);
        for i in 0..3 {
            for j in 0..3 {
                shorts.covariance.matrix[i + 2][j + 2] = common + if i == j { own } else { 0.0 };
            }
        }
        let covariance = nalgebra::Matrix3::from_fn(|i, j| common + if i == j { own } else { 0.0 });
        let precision = covariance.try_inverse().unwrap();
        let levels = ActionLevels::default();
        let rate = -ABOVE_WATCH.ln() / levels.watch[2];
        let (mut whole, mut above) = (0.0, [0.0; 3]);
        let at = |n: usize| (n as f64 + 0.5) * STEP;
        for (i, j, k) in (0..75usize.pow(3)).map(|n| (n / 5625, n / 75 % 75, n % 75)) {
            let point = [at(i), at(j), at(k)];
            let off = nalgebra::Vector3::from_fn(|n, _| point[n] - estimate[n]);
            let density =
                (-0.5 * off.dot(&(precision * off)) - rate * point.iter().sum::<f64>()).exp();
            whole += density;
            for (above, level) in above.iter_mut().zip(point) {
                *above += if level > levels.act[2] { density } else { 0.0 };
            }
        }
        let action = decide(&shorts, &levels);
        for (place, above) in above.into_iter().enumerate() {
            let found = action.faults[2 + place].probability_above.act;
            assert_abs_diff_eq!(found, above / whole, epsilon = 0.01);
        }
        // most of the shorts is in common and may be a torque constant; what the first has beyond is not
        assert!(action.faults[2].probability_above.act > 0.7);
    }

    #[test]
    fn what_tolerances_leave_open_grows_with_the_damage() {
        // play of 2.2 times nominal, known to 30 %: 3 times is as near as with 30 % of 3
        let level = 1.2 / BACKLASH_GAIN;
        let std = 0.3 * 2.2 / BACKLASH_GAIN;
        let mut found = answer(&[0.0, level], &[0.01, std]);
        let above = |found: &RecordDiagnosis| {
            decide(found, &ActionLevels::default()).faults[1].probability_above.watch
        };
        let share = above(&found);
        // ln 3 is 1.03 standard deviations of 0.3 above ln 2.2; the prior halves it
        assert!((0.04..0.16).contains(&share), "{share}");
        found.covariance.matrix[1][1] = (0.1 * std).powi(2);
        assert!(above(&found) < 1e-6);
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
