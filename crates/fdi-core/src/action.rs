//! From an answer to what to do about the machine.
//!
//! ```text
//! u₁ = ln(1 + 2·k₁),   u₂ = ln(1 + 99·k₂),   uᵢ = kᵢ else
//! p(u | y) ∝ N(u; û, J·C·J)·Π p(k_i)·dk_i/du_i·p(x, y)       k_i ≥ 0
//! ```
//!
//! Friction and play of a worn machine are those of the machine as built times `1 + 2·k₁` and
//! `1 + 99·k₂`. Tolerances of both are shares, so that what they leave open of the damage is the wider the
//! more there is: one width in logarithms, `J = du/dk` at the answer.
//!
//! A machine is worn by the friction that has come to it, and loose by all the play that it has. Levels of
//! play are those of the model file's play times `1 + 99·k₂`, and what is compared with them is the play
//! itself, which a recording tells without knowing that as built: `û₂` is its logarithm over that of the
//! model file, and its row and column of `C` are shrunk to what the recording leaves open. With references
//! `k₂` is what has come since, as all else.
//!
//! Machines in service are assumed to have damage as [`damage_prior`] says; what follows together with an
//! answer is in [`posterior`].

mod damage_prior;
mod posterior;

use std::cmp::Ordering;

use fdi_report::{
    Action, ActionLevels, BACKLASH_GAIN, FRICTION_GAIN, FaultAction, FaultId, Finding, FindingKind,
    Limits, NoticeCode, RecordDiagnosis, Severity, direction_in_words, percent, plus_minus,
    three_digits,
};

pub use damage_prior::{SEVERE_SHARE, SEVERE_TIMES};

use damage_prior::prior_above;
use posterior::Points;

/// Probability from which a level is taken to be passed, or one less which not to be.
const DECIDED: f64 = 0.9;
/// Measurements that tell more where noise is what leaves a fault open.
const LESS_NOISE: &str = "a recording with less noise, or several of one session";

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
    let since = Since::of(answer);
    let Some(points) = Points::of(answer, levels, since) else { return shows_none() };
    let judged: Vec<Judged> =
        FaultId::ALL[..6].iter().filter_map(|&id| judged(&points, id, levels, since)).collect();
    let Some(worst) = judged.iter().max_by(|a, b| a.rank(b)) else { return shows_none() };
    if worst.action.severity < Severity::Watch
        && let Some(finding) = answer.findings.iter().find(|one| is_open_to_watch(one, levels))
    {
        let size = plus_minus(finding.value, finding.std, " ± ");
        let reason =
            format!("{} {size} is detected: which of these it is, is open", finding.label());
        let would = finding.would_tell.as_deref();
        let would = would.unwrap_or("recordings of the same unit as new, or the motor's voltage,");
        let faults = judged.into_iter().map(|one| one.action).collect();
        return Action { faults, ..open(&reason, &format!("{would} would decide more")) };
    }
    let all: Vec<FaultAction> = judged.iter().map(|one| one.action.clone()).collect();
    let left_out = answer.notice(NoticeCode::RecordingsLeftOut);
    if worst.action.severity == Severity::Nothing && left_out.is_some() {
        let next = "diagnose those left out by themselves, and record them again";
        return Action { faults: all, ..open("not every recording is explained", next) };
    }
    let nominal_backlash_rad = levels.nominal_backlash_rad;
    let told_by = ToldBy { answer, since, nominal_backlash_rad };
    let (reason, next) = told(&worst.action, &all, &told_by);
    Action {
        severity: worst.action.severity,
        fault: Some(worst.action.id),
        probability_above: Some(worst.action.probability_above),
        reason,
        next,
        faults: all,
    }
}

/// True where a finding of several faults is detected, and of a size from which one of them is watched.
fn is_open_to_watch(finding: &Finding, levels: &ActionLevels) -> bool {
    let is_above =
        |id: FaultId| levels.watch.get(id as usize).is_some_and(|&watch| finding.value > watch);
    finding.detected && finding.faults().count() > 1 && finding.faults().any(is_above)
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
        let is_used = answer.notice(NoticeCode::ReferenceUsed).is_some();
        if is_change || is_used { Self::New } else { Self::Nominal }
    }
}

/// Size of a fault by its level: what is added, what multiplies, and the unit.
fn size_of(id: FaultId, since: Since, play_rad: Option<f64>) -> (f64, f64, &'static str) {
    let friction = 100.0 * FRICTION_GAIN;
    let play_mrad = play_rad.map(|play_rad| 1e3 * play_rad);
    match (id, since) {
        (FaultId::K1, Since::Nominal) => {
            (0.0, friction, "% of friction torque above that as built")
        }
        (FaultId::K1, Since::New) => (0.0, friction, "% of friction torque above that as new"),
        (FaultId::K2, Since::Nominal) => match play_mrad {
            Some(mrad) => (mrad, mrad * BACKLASH_GAIN, "mrad of play"),
            None => (1.0, BACKLASH_GAIN, "times nominal play"),
        },
        // the play as new is another than that of the model file, and not in the answer
        (FaultId::K2, Since::New) => (1.0, BACKLASH_GAIN, "times the play as new"),
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

/// Why a decision is what it is, and the next step: by the worst fault, with others that are to be watched
/// or acted on.
fn told(worst: &FaultAction, faults: &[FaultAction], told_by: &ToldBy<'_>) -> (String, String) {
    let FaultAction { id, interval_95: [low, high], unit, levels, probability_above, .. } = worst;
    let above =
        |share: f64, level: f64| format!("{} above {}", percent(share), three_digits(level));
    let (watch, act) =
        (above(probability_above.watch, levels.watch), above(probability_above.act, levels.act));
    let others = |least: Severity| {
        faults.iter().filter(move |one| one.id != worst.id && one.severity >= least)
    };
    let listed = |word: &str, severity: Severity| {
        let of = others(severity).filter(|one| one.severity == severity);
        let named: Vec<String> = of.map(|one| told_by.sized(one)).collect();
        if named.is_empty() { String::new() } else { format!("; {word} {}", named.join(", ")) }
    };
    match worst.severity {
        Severity::Act => {
            let parts = std::iter::once(worst).chain(others(Severity::Act));
            let parts: Vec<&str> = parts.map(|one| part(one.id)).collect();
            let next =
                format!("take the machine out of service and look at {}", parts.join(", and at "));
            let also = listed("also", Severity::Act) + &listed("to be watched:", Severity::Watch);
            (format!("{}, {act}{also}", told_by.sized(worst)), next)
        }
        Severity::Watch => {
            let is_near = probability_above.act > 1.0 - DECIDED;
            let act = if is_near { format!(", {act}") } else { String::new() };
            let also = listed("also", Severity::Watch);
            (
                format!("{}, {watch}{act}{also}", told_by.sized(worst)),
                "record again soon and follow it (`fdi diagnose --report` of all its recordings)"
                    .to_owned(),
            )
        }
        Severity::Undecided => {
            let (low, high) = (three_digits(*low), three_digits(*high));
            let name = id.name();
            let open = format!("{name} between {low} and {high} {unit} is not decided, {watch}");
            (open, format!("{} would decide more", told_by.would_tell(*id)))
        }
        _ => {
            let open: Vec<&str> = FaultId::ALL[..6]
                .iter()
                .filter(|id| faults.iter().all(|one| one.id != **id))
                .map(|id| id.name())
                .collect();
            let [which, beside] = if open.is_empty() {
                ["every fault", ""]
            } else {
                ["every fault that this test tells", "; it does not tell "]
            };
            let share = 100.0 * DECIDED;
            let reason = format!(
                "{which} is below its level for watching with a probability of {share:.0} % or \
                 more{beside}{}",
                open.join(", ")
            );
            (reason, "record again when it is due".to_owned())
        }
    }
}

/// Facts that words about a decision go by.
struct ToldBy<'a> {
    answer: &'a RecordDiagnosis,
    since: Since,
    nominal_backlash_rad: Option<f64>,
}

impl ToldBy<'_> {
    /// A fault with its size: `backlash 0.65 mrad of play (13 times nominal)`.
    fn sized(&self, fault: &FaultAction) -> String {
        let FaultAction { id, size, unit, .. } = fault;
        let beside = match (id, self.since, self.nominal_backlash_rad) {
            (FaultId::K2, Since::Nominal, Some(play_rad)) => {
                format!(" ({} times nominal)", three_digits(1e-3 * size / play_rad))
            }
            (FaultId::K6, ..) => direction_in_words(self.answer),
            _ => String::new(),
        };
        format!("{} {} {unit}{beside}", id.name(), three_digits(*size))
    }

    /// Measurements that would tell more of a fault.
    fn would_tell(&self, id: FaultId) -> &str {
        let mut findings =
            self.answer.findings.iter().filter(|one| one.faults().any(|fault| fault == id));
        // of all the play that there is no tolerance leaves anything open
        let is_all_play = id == FaultId::K2 && self.since == Since::Nominal;
        let Some(first) = findings.next().filter(|_| !is_all_play) else { return LESS_NOISE };
        let mut told = std::iter::once(first).chain(findings).map(|one| one.would_tell.as_deref());
        match told.find_map(|one| one) {
            Some(would) => would,
            None if first.prior_std < first.posterior_std => LESS_NOISE,
            None if self.since == Since::New => "recordings of other days",
            None => "recordings of the same unit as new",
        }
    }
}

/// A fault by the points of the posterior; `None` where it is not determined.
fn judged(points: &Points, id: FaultId, levels: &ActionLevels, since: Since) -> Option<Judged> {
    let found = points.marginal(id)?;
    let index = id as usize;
    let (watch, act) = (levels.watch[index], levels.act[index]);
    let probability_above = Limits { watch: found.above(watch), act: found.above(act) };
    let (offset, scale, unit) = size_of(id, since, levels.nominal_backlash_rad);
    let sized = |level: f64| offset + scale * level;
    let [low, middle, high] = found.quantiles([0.025, 0.5, 0.975]);
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

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use ema_sim::FaultCoordinates;

    use super::*;
    use crate::report::{Covariance, Fidelity, Finding, Fit, Method, NoiseSource, Status, Verdict};

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
            operator: None,
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
        // e⁻² of most machines, e^(−2/100) of the one in fifty
        let above = 0.98 * (-2.0f64).exp() + 0.02 * (-0.02f64).exp();
        assert_abs_diff_eq!(action.faults[5].prior_above.watch, above, epsilon = 1e-12);
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
        let rate = 2.0 / levels.watch[2];
        let prior = |level: f64| {
            let severe = 0.1 * rate;
            0.98 * rate * (-rate * level).exp() + 0.02 * severe * (-severe * level).exp()
        };
        let (mut whole, mut above) = (0.0, [0.0; 3]);
        let at = |n: usize| (n as f64 + 0.5) * STEP;
        for (i, j, k) in (0..75usize.pow(3)).map(|n| (n / 5625, n / 75 % 75, n % 75)) {
            let point = [at(i), at(j), at(k)];
            let off = nalgebra::Vector3::from_fn(|n, _| point[n] - estimate[n]);
            let density = (-0.5 * off.dot(&(precision * off))).exp()
                * point.map(prior).iter().product::<f64>();
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

    /// Against sums over a grid of the level, with friction as built normal in itself.
    #[test]
    fn versus_a_grid_friction_whose_tolerance_leaves_it_open() {
        const STEP: f64 = 1e-4;
        let (level, tolerance) = (0.4, 0.2);
        let share = 1.0 + FRICTION_GAIN * level;
        let std = tolerance * share / FRICTION_GAIN;
        let mut found = answer(&[level], &[std]);
        let members = vec!["k1".to_owned()];
        found.findings = vec![Finding { members, prior_std: std, posterior_std: 1e-3, ..play() }];
        let levels = ActionLevels::default();
        let (mut whole, mut above) = (0.0, 0.0);
        for k in (0..10_000).map(|n| (f64::from(n) + 0.5) * STEP) {
            let worn = 1.0 + FRICTION_GAIN * k;
            let as_built = (share / worn - 1.0) / tolerance;
            let [most, severe] = [1.0, 0.1].map(|part| part * 2.0 / levels.watch[0]);
            let prior = 0.98 * most * (-most * k).exp() + 0.02 * severe * (-severe * k).exp();
            let density = prior * (-0.5 * as_built * as_built).exp() / worn;
            whole += density;
            above += if k > levels.watch[0] { density } else { 0.0 };
        }
        let found = decide(&found, &levels).faults[0].probability_above.watch;
        assert_abs_diff_eq!(found, above / whole, epsilon = 0.01);
    }

    /// Play of 13 times nominal, known but for that as built.
    fn loose() -> RecordDiagnosis {
        let (level, std) = (12.0 / BACKLASH_GAIN, 0.3 * 13.0 / BACKLASH_GAIN);
        let mut found = answer(&[0.0, level], &[0.01, std]);
        found.findings = vec![Finding { value: level, std, posterior_std: 0.01 * std, ..play() }];
        found
    }

    fn play() -> Finding {
        Finding {
            kind: FindingKind::Known,
            id: "play".to_owned(),
            members: vec!["k2".to_owned()],
            value: 0.1,
            std: 0.04,
            interval_95: [0.02, 0.18],
            detected: true,
            prior_std: 0.04,
            posterior_std: 0.001,
            would_tell: None,
        }
    }

    #[test]
    fn play_is_judged_by_all_that_there_is() {
        let known = ActionLevels { nominal_backlash_rad: Some(5e-5), ..ActionLevels::default() };
        let action = decide(&loose(), &known);
        let play = &action.faults[1];
        assert_eq!((action.severity, play.unit.as_str()), (Severity::Act, "mrad of play"));
        assert_abs_diff_eq!(play.size, 0.65, epsilon = 0.005);
        assert_abs_diff_eq!(play.levels.watch, 0.15, epsilon = 1e-12);
        assert_abs_diff_eq!(play.levels.act, 0.5, epsilon = 1e-12);
        assert!(action.reason.contains("mrad of play (13 times nominal), more than"), "{action:?}");
        let unknown = decide(&loose(), &ActionLevels::default());
        assert!(unknown.reason.contains("backlash 13 times nominal play"), "{}", unknown.reason);
    }

    #[test]
    fn play_since_references_is_what_has_come() {
        let mut found = loose();
        found.findings[0].kind = FindingKind::Changed;
        let known = ActionLevels { nominal_backlash_rad: Some(5e-5), ..ActionLevels::default() };
        let play = &decide(&found, &known).faults[1];
        assert_eq!(play.unit, "times the play as new");
        assert_abs_diff_eq!(play.levels.watch, 3.0, epsilon = 1e-12);
        // what references leave open is that of the change
        assert!(play.probability_above.act < 0.9, "{play:?}");
    }

    #[test]
    fn what_is_seen_is_not_doubted() {
        // twice the level for acting, known to a tenth: no machine of an exponential alone has that much
        let levels = ActionLevels::default();
        for place in [0, 2, 5] {
            let mut estimate = [0.0; 7];
            estimate[place] = 2.0 * levels.act[place];
            let stds = estimate.map(|level| 0.05 * level + 0.002);
            let action = decide(&answer(&estimate, &stds), &levels);
            let [low, high] = action.faults[place].interval_95;
            let gain = if place == 0 { FRICTION_GAIN } else { 1.0 };
            let size = 100.0 * gain * estimate[place];
            assert_eq!(action.severity, Severity::Act, "{place}: {action:?}");
            assert!(low < size && size < high, "{place}: {size} in {low} to {high}");
        }
    }

    #[test]
    fn what_is_not_told_is_said() {
        let action = decide(&answer(&[0.0, 0.0], &[0.01, 1e-4]), &ActionLevels::default());
        assert_eq!(action.severity, Severity::Nothing);
        let untold = "it does not tell short circuit of phase A, short circuit of phase B, short \
                      circuit of phase C, eccentricity";
        assert!(action.reason.ends_with(untold), "{}", action.reason);
    }

    #[test]
    fn what_is_detected_and_of_several_faults_is_not_nothing() {
        let mut found = answer(&[0.0; 5], &[0.01, 1e-4, 0.01, 0.01, 0.01]);
        let members = ["k3", "k4", "k5"].map(str::to_owned).into();
        let id = "torque-constant".to_owned();
        found.findings = vec![Finding { id, members, value: 0.156, std: 0.036, ..play() }];
        let action = decide(&found, &ActionLevels::default());
        assert_eq!((action.severity, action.fault), (Severity::Undecided, None));
        assert!(
            action.reason.starts_with("torque constant (k3, k4, k5) 0.156 ± 0.036 is detected")
        );
        assert_eq!(action.faults.len(), 5);
        // less than is watched is nothing
        (found.findings[0].value, found.findings[0].std) = (0.012, 0.002);
        assert_eq!(decide(&found, &ActionLevels::default()).severity, Severity::Nothing);
    }

    #[test]
    fn all_faults_that_are_to_be_acted_on_are_named() {
        let found = answer(&[0.4, 0.0, 0.1, 0.0, 0.0], &[0.01, 1e-4, 1e-3, 1e-3, 1e-3]);
        let action = decide(&found, &ActionLevels::default());
        assert!(action.reason.contains("; also "), "{}", action.reason);
        for part in ["the winding of phase A", "lubrication"] {
            assert!(action.next.contains(part), "{}", action.next);
        }
    }

    #[test]
    fn the_next_step_is_against_what_leaves_it_open() {
        let next = |kind: FindingKind, posterior_std: f64| {
            let mut found = answer(&[0.09], &[0.03]);
            let finding = Finding { kind, members: vec!["k1".to_owned()], posterior_std, ..play() };
            found.findings = vec![Finding { prior_std: 0.03, ..finding }];
            let action = decide(&found, &ActionLevels::default());
            assert_eq!(action.severity, Severity::Undecided);
            action.next
        };
        assert!(next(FindingKind::Known, 0.001).starts_with("recordings of the same unit as new"));
        assert!(next(FindingKind::Changed, 0.001).starts_with("recordings of other days"));
        assert!(next(FindingKind::Known, 0.04).starts_with("a recording with less noise"));
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
