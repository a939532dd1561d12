//! Scores of many answers whose truth is known.

use fdi_core::{
    ema_sim::FaultCoordinates,
    report::{RecordDiagnosis, Verdict},
};

use crate::score::median;

/// Scores of one way to diagnose the machines of a line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UnitsScore {
    /// Machines.
    pub machines: usize,
    /// Counts of the verdicts healthy, faulty, undetermined, model-inadequate, and refusals.
    pub verdicts: [usize; 5],
    /// Machines on which something is detected.
    pub detected: usize,
    /// Machines on which each of k1 to k6 is detected.
    pub detected_of: [usize; 6],
    /// Machines with a short on which one is detected, of whichever phase.
    pub short_detected: usize,
    /// Machines on which the damaged phase alone is detected among the shorts.
    pub phase_right: usize,
    /// Machines whose truth the 95 % interval of k1 to k5, and the region of (k6, k7), holds.
    pub covered: [usize; 6],
    /// Median standard deviations of k1 to k5 and k6.
    pub std_median: [f64; 6],
    /// Root mean square errors of k1 to k5, and of each of the eccentricity's coordinates.
    pub error_rms: [f64; 6],
    /// Median evaluations of the low-fidelity model.
    pub evaluations_median: f64,
}

pub(super) fn scored(judged: &[(&FaultCoordinates, Option<&RecordDiagnosis>)]) -> UnitsScore {
    let mut score = UnitsScore { machines: judged.len(), ..UnitsScore::default() };
    let mut stds: [Vec<f64>; 6] = Default::default();
    let mut errors: [Vec<f64>; 6] = Default::default();
    let mut evaluations = Vec::new();
    for (damage, answer) in judged {
        let Some(answer) = answer else {
            score.verdicts[4] += 1;
            continue;
        };
        let place = match answer.verdict {
            Verdict::Healthy => 0,
            Verdict::Faulty => 1,
            Verdict::Undetermined => 2,
            Verdict::ModelInadequate => 3,
        };
        score.verdicts[place] += 1;
        let finding = answer.findings.iter().any(|finding| finding.detected);
        score.detected += usize::from(answer.any_detected() || finding);
        for (fault, found) in answer.faults[..6].iter().zip(&mut score.detected_of) {
            *found += usize::from(fault.detected == Some(true));
        }
        let shorts = [2, 3, 4].map(|place| answer.faults[place].detected == Some(true));
        let truth = [2, 3, 4].map(|place| damage.0[place] > 0.0);
        score.short_detected += usize::from(truth.contains(&true) && shorts.contains(&true));
        score.phase_right += usize::from(truth.contains(&true) && shorts == truth);
        for place in 0..5 {
            let interval = answer.faults[place].interval_95;
            let holds = interval.is_some_and(|[a, b]| (a..=b).contains(&damage.0[place]));
            score.covered[place] += usize::from(holds);
            stds[place].extend(answer.faults[place].std);
        }
        score.covered[5] += usize::from(region_holds(answer, damage));
        stds[5].extend(answer.faults[5].std);
        for (off, of) in errors_of(answer, damage) {
            errors[of].push(off);
        }
        evaluations.push(answer.evaluations as f64);
    }
    score.std_median = stds.map(median);
    score.error_rms = errors.map(|of| inference::rms(&of));
    score.evaluations_median = median(evaluations);
    score
}

/// Errors of the estimate, each with the fault that it is of.
fn errors_of(answer: &RecordDiagnosis, damage: &FaultCoordinates) -> Vec<(f64, usize)> {
    let covariance = &answer.covariance;
    let known = covariance.parameters.iter().zip(&covariance.estimate);
    let error = |(name, estimate): (&String, &f64)| {
        let place = FaultCoordinates::NAMES.iter().position(|coordinate| coordinate == name)?;
        Some((estimate - damage.0[place], place.min(5)))
    };
    known.filter_map(error).collect()
}

/// Tells whether the 95 % region of the eccentricity holds the truth.
fn region_holds(answer: &RecordDiagnosis, damage: &FaultCoordinates) -> bool {
    let covariance = &answer.covariance;
    let place = |name: &str| covariance.parameters.iter().position(|parameter| parameter == name);
    let (Some(x), Some(y)) = (place("k6_cos"), place("k6_sin")) else { return false };
    let off = [damage.0[5] - covariance.estimate[x], damage.0[6] - covariance.estimate[y]];
    let m = &covariance.matrix;
    let (a, b, c) = (m[x][x], m[x][y], m[y][y]);
    let determinant = a * c - b * b;
    let distance2 =
        (c * off[0] * off[0] - 2.0 * b * off[0] * off[1] + a * off[1] * off[1]) / determinant;
    // the 95 % quantile of χ² with two degrees of freedom
    distance2 <= -2.0 * 0.05f64.ln()
}
