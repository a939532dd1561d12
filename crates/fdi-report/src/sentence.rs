//! Meaning of a diagnosis, in sentences that an engineer can act on.

use crate::{Fault, FaultId, INCIPIENT_LEVEL, RecordDiagnosis, Verdict};

/// Friction at k1 = 1 is three times nominal: FREEDOM paper, Table 1, read linearly.
const FRICTION_GAIN: f64 = 2.0;

/// Backlash at k2 = 1 is a hundred times nominal: FREEDOM paper, Table 1, read linearly.
const BACKLASH_GAIN: f64 = 99.0;

/// Findings of a recording in words; `None` of a healthy one.
pub fn sentence(record: &RecordDiagnosis) -> Option<String> {
    let detected = record.faults.iter().filter(|fault| fault.detected == Some(true));
    let mut found: Vec<_> = detected.filter_map(|fault| of_fault(fault, record)).collect();
    let missing = missing(record);
    match record.verdict {
        Verdict::Healthy => return None,
        Verdict::ModelInadequate => return Some(residual(record)),
        Verdict::Faulty => {}
        Verdict::Undetermined => found.push("no fault detected".to_owned()),
    }
    if !missing.is_empty() {
        found.push(format!("{missing} not determined"));
    }
    Some(found.join("; "))
}

fn residual(record: &RecordDiagnosis) -> String {
    let (rms_a, floor_a) = (record.fit.rms_a, record.fit.noise_floor_a);
    let times = if floor_a > 0.0 { rms_a / floor_a } else { f64::INFINITY };
    format!(
        "no fault levels explain the recording: residual {rms_a:.4} A rms, {times:.1} times what \
         noise explains"
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
    let meaning = match fault.id {
        FaultId::K1 => {
            format!("{:+.1} % of nominal friction torque", 100.0 * FRICTION_GAIN * value)
        }
        FaultId::K2 => format!("{:.2} times nominal backlash", 1.0 + BACKLASH_GAIN * value),
        FaultId::K3 | FaultId::K4 | FaultId::K5 => {
            format!("{:.1} % of the turns shorted", 100.0 * value)
        }
        FaultId::K6 => format!("{:.1} % of the air gap{}", 100.0 * value, direction(record)),
        FaultId::K7 => return None,
    };
    let beyond = if value >= INCIPIENT_LEVEL { ", beyond incipient" } else { "" };
    let level = plus_minus(value, std, " ± ");
    Some(format!("{} {level} ({meaning}{beyond})", fault.name))
}

/// Where the rotor is displaced to, if the recording tells.
fn direction(record: &RecordDiagnosis) -> String {
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
    const FEWEST: i32 = 3;
    const MOST: i32 = 6;
    let needed = if std > 0.0 { -std.log10().floor() } else { f64::from(MOST) };
    let decimals = (needed as i32).clamp(FEWEST, MOST) as usize;
    format!("{value:.decimals$}{sign}{std:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_uncertainty() {
        assert_eq!(plus_minus(0.0312, 0.0021, "±"), "0.031±0.002");
        assert_eq!(plus_minus(0.0312, 0.000_25, "±"), "0.0312±0.0003");
        assert_eq!(plus_minus(0.5, 0.2, "±"), "0.500±0.200");
        assert_eq!(plus_minus(0.5, 0.0, "±"), "0.500000±0.000000");
    }
}
