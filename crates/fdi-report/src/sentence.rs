//! Meaning of a diagnosis, in sentences that an engineer can act on.

use crate::{Fault, FaultId, Finding, INCIPIENT_LEVEL, NoticeCode, RecordDiagnosis, Verdict};

/// Friction at k1 = 1 is three times nominal: FREEDOM paper, Table 1, read linearly.
pub const FRICTION_GAIN: f64 = 2.0;

/// Backlash at k2 = 1 is a hundred times nominal: FREEDOM paper, Table 1, read linearly.
pub const BACKLASH_GAIN: f64 = 99.0;

/// Answer where the search ended before the model explained the recording.
const UNFINISHED: &str = "the search did not finish; nothing is determined";

/// Findings of a recording in words; `None` of a healthy one.
pub fn sentence(record: &RecordDiagnosis) -> Option<String> {
    let detected = record.faults.iter().filter(|fault| fault.detected == Some(true));
    let mut found: Vec<_> = detected.filter_map(|fault| of_fault(fault, record)).collect();
    let missing = missing(record);
    match record.verdict {
        Verdict::Healthy => return None,
        Verdict::ModelInadequate => return Some(residual(record)),
        Verdict::Faulty => found.extend(beside_faults(record)),
        Verdict::Undetermined if record.is_unfinished() => return Some(UNFINISHED.to_owned()),
        Verdict::Undetermined => found.push("no fault detected".to_owned()),
    }
    if !missing.is_empty() {
        found.push(format!("{missing} not determined"));
    }
    Some(found.join("; "))
}

/// Detected findings none of whose faults is detected by itself.
fn beside_faults(record: &RecordDiagnosis) -> impl Iterator<Item = String> + '_ {
    let is_detected =
        |id| record.fault(id).is_some_and(|fault: &Fault| fault.detected == Some(true));
    let detected = record.findings.iter().filter(|finding| finding.detected);
    let beside = detected.filter(move |finding| {
        finding.faults().next().is_some() && !finding.faults().any(is_detected)
    });
    beside.map(sized)
}

/// A finding with its size.
pub(crate) fn sized(finding: &Finding) -> String {
    format!("{} {}", finding.label(), plus_minus(finding.value, finding.std, " ± "))
}

/// Findings that neither noise nor tolerances explain, in a line; `None` where there are none, or
/// the levels are not to be believed.
pub fn detected_findings(record: &RecordDiagnosis) -> Option<String> {
    let detected = record.findings.iter().filter(|finding| finding.detected);
    let told: Vec<String> = detected.map(sized).collect();
    let any = record.is_believed() && !told.is_empty();
    any.then(|| format!("detected beyond noise and tolerances: {}", told.join(", ")))
}

fn residual(record: &RecordDiagnosis) -> String {
    use NoticeCode::{RecordingsDisagree, SensorsUneven, UnmodelledPhysics};
    let codes = [RecordingsDisagree, SensorsUneven, UnmodelledPhysics];
    if let Some(notice) = codes.into_iter().find_map(|code| record.notice(code)) {
        return notice.message.clone();
    }
    let (rms_a, floor_a) = (record.fit.rms_a, record.fit.noise_floor_a);
    let times = if floor_a > 0.0 { rms_a / floor_a } else { f64::INFINITY };
    if times <= 1.0 {
        return format!(
            "no fault levels explain the recording: the residual of {rms_a:.4} A rms is no larger than \
             noise and learnt error, but has another form"
        );
    }
    format!(
        "no fault levels explain the recording: residual {rms_a:.4} A rms, {times:.1} times what \
         noise and learnt error explain"
    )
}

/// k1 to k6 as far as they are not determined.
fn missing(record: &RecordDiagnosis) -> String {
    let ids = FaultId::ALL.into_iter().filter(|&id| id != FaultId::K7);
    let missing = ids.filter(|&id| record.fault(id).is_none_or(|fault| fault.value.is_none()));
    missing.map(FaultId::id).collect::<Vec<_>>().join(", ")
}

fn of_fault(fault: &Fault, record: &RecordDiagnosis) -> Option<String> {
    let (value, std) = (fault.value?, fault.std?);
    // references have shown the machine as new
    let is_new = record.notice(NoticeCode::ReferenceUsed).is_some();
    let meaning = match fault.id {
        FaultId::K1 => {
            let of = if is_new { "friction torque as new" } else { "nominal friction torque" };
            format!("{:+.1} % of {of}", 100.0 * FRICTION_GAIN * value)
        }
        FaultId::K2 => {
            let of = if is_new { "the backlash as new" } else { "nominal backlash" };
            format!("{:.2} times {of}", 1.0 + BACKLASH_GAIN * value)
        }
        FaultId::K3 | FaultId::K4 | FaultId::K5 => {
            format!("{:.1} % of the turns shorted", 100.0 * value)
        }
        FaultId::K6 => {
            format!("{:.1} % of the air gap{}", 100.0 * value, direction_in_words(record))
        }
        FaultId::K7 => return None,
    };
    let beyond = if value >= INCIPIENT_LEVEL { ", beyond incipient" } else { "" };
    let level = plus_minus(value, std, " ± ");
    Some(format!("{} {level} ({meaning}{beyond})", fault.name))
}

/// Where the rotor is displaced to, if the recording tells: `, towards 30° ± 4°`.
pub fn direction_in_words(record: &RecordDiagnosis) -> String {
    let k7 = record.fault(FaultId::K7).and_then(|fault| Some((fault.value?, fault.std?)));
    // FREEDOM paper, Table 1: 0 to 1 is -180° to 180°
    k7.map(|(value, std)| {
        let (towards, std) = (360.0 * (value - 0.5), 360.0 * std);
        // no angle is known to zero degrees
        let decimals = usize::from(std < 0.5);
        format!(", towards {towards:.decimals$}° ± {std:.decimals$}°")
    })
    .unwrap_or_default()
}

/// A level and its standard deviation, the latter to one significant digit.
pub fn plus_minus(value: f64, std: f64, sign: &str) -> String {
    format!("{}{sign}{}", to_digits_of(value, std), to_digits_of(std, std))
}

/// A number to the digits that its standard deviation leaves it; zero has no sign.
pub(crate) fn to_digits_of(value: f64, std: f64) -> String {
    const FEWEST: i32 = 3;
    const MOST: i32 = 6;
    let needed = if std > 0.0 { -std.log10().floor() } else { f64::from(MOST) };
    let decimals = (needed as i32).clamp(FEWEST, MOST) as usize;
    let text = format!("{value:.decimals$}");
    let is_zero = text.bytes().all(|byte| b"-0.".contains(&byte));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

/// A standard deviation to two digits.
pub fn two_digits(std: f64) -> String {
    let decimals = (1.0 - std.max(1e-9).log10().floor()).max(0.0) as usize;
    format!("{std:.decimals$}")
}

/// A number to three digits, without zeros at its end.
pub fn three_digits(size: f64) -> String {
    let decimals = (2 - size.abs().max(1e-3).log10().floor() as i32).clamp(0, 3) as usize;
    let text = format!("{size:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// A probability in words of percent; what is nearly sure is never said to be.
pub fn percent(probability: f64) -> String {
    match 100.0 * probability {
        most if most > 99.0 => "more than 99 %".to_owned(),
        least if least < 1.0 => "less than 1 %".to_owned(),
        percent => format!("{percent:.0} %"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Notice;
    use crate::document::finding_tests::finding;

    const SHORTS: [&str; 4] = ["k3", "k4", "k5", "motor.back-emf-v-s-per-rad"];

    #[test]
    fn digits_follow_the_uncertainty() {
        assert_eq!(plus_minus(0.0312, 0.0021, "±"), "0.031±0.002");
        assert_eq!(plus_minus(0.0312, 0.000_25, "±"), "0.0312±0.0003");
        assert_eq!(plus_minus(0.5, 0.2, "±"), "0.500±0.200");
        assert_eq!(plus_minus(0.5, 0.0, "±"), "0.500000±0.000000");
        assert_eq!(plus_minus(-0.0312, 0.0021, "±"), "-0.031±0.002");
        assert_eq!(plus_minus(-0.0003, 0.0021, "±"), "0.000±0.002");
    }

    #[test]
    fn a_search_that_did_not_finish_says_nothing_of_faults() {
        let mut record = crate::document::tests::record();
        record.verdict = Verdict::Undetermined;
        for fault in &mut record.faults {
            fault.detected = None;
        }
        let open = "no fault detected; k2, k3, k4, k5, k6 not determined";
        assert_eq!(sentence(&record).as_deref(), Some(open));
        record.notices.push(Notice {
            code: NoticeCode::SearchUnfinished,
            message: "the search did not finish".to_owned(),
        });
        assert_eq!(sentence(&record).as_deref(), Some(UNFINISHED));
    }

    #[test]
    fn what_is_detected_is_a_line_where_it_is_to_be_believed() {
        let mut record = crate::document::tests::record();
        assert_eq!(detected_findings(&record), None);
        record.findings = vec![
            finding("imbalance-a", &["k3", "as-built.turns"], 0.031, 0.004),
            finding("imbalance-b", &["k4", "as-built.turns"], 0.001, 0.004),
        ];
        let told = "detected beyond noise and tolerances: imbalance of phase A (k3) 0.031 ± 0.004";
        assert_eq!(detected_findings(&record).as_deref(), Some(told));
        record.verdict = Verdict::ModelInadequate;
        assert_eq!(detected_findings(&record), None);
    }

    #[test]
    fn a_finding_without_a_detected_fault_is_told() {
        let mut record = crate::document::tests::record();
        record.faults = FaultId::ALL
            .map(|id| Fault::determined(id, 0.01, 0.01, [0.0, 0.03], Some(false)))
            .into();
        record.findings = vec![finding("torque-constant", &SHORTS, 0.2, 0.04)];
        let told = "torque constant (k3, k4, k5) 0.200 ± 0.040";
        assert_eq!(sentence(&record).as_deref(), Some(told));
        record.faults[3].detected = Some(true);
        let told = "short circuit of phase B 0.010 ± 0.010 (1.0 % of the turns shorted)";
        assert_eq!(sentence(&record).as_deref(), Some(told));
    }
}
