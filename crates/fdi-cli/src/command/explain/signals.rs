//! What the signal chain of the recordings shows, as JSON and in words.

use fdi_core::report::{SignalCheck, SignalCode, SignalFinding};
use greybox::{Explained, SignalChannel, SignalFault};

/// All that it shows, the first to be set right first.
pub(super) fn findings(explained: &Explained) -> Vec<SignalFinding> {
    explained.signals.faults.iter().filter_map(finding).collect()
}

/// One that stands, else one that was set right.
pub(super) fn first(findings: &[SignalFinding]) -> Option<&SignalFinding> {
    findings.iter().find(|finding| !finding.corrected).or_else(|| findings.first())
}

fn finding(fault: &SignalFault) -> Option<SignalFinding> {
    Some(SignalFinding {
        code: code(fault.code)?,
        equation: fault.equation.name().to_owned(),
        recording: fault.record.clone(),
        channel: fault.channel.map(SignalChannel::name).map(str::to_owned),
        value: fault.value,
        unit: fault.unit.to_owned(),
        told: fault.told.clone(),
        corrected: fault.corrected,
        correctable: fault.is_correctable(),
    })
}

/// The published word of a code; `None` for one that this form does not know.
fn code(code: greybox::SignalCode) -> Option<SignalCode> {
    use greybox::SignalCode as Code;
    Some(match code {
        Code::Gap => SignalCode::Gap,
        Code::Saturated => SignalCode::Saturated,
        Code::Quantised => SignalCode::Quantised,
        Code::Sign => SignalCode::Sign,
        Code::Late => SignalCode::Late,
        Code::Gain => SignalCode::Gain,
        Code::Controller => SignalCode::Controller,
        Code::Constant => SignalCode::Constant,
        Code::Disabled => SignalCode::Disabled,
        Code::Disturbed => SignalCode::Disturbed,
        Code::SameMotion => SignalCode::SameMotion,
        Code::OtherMachine => SignalCode::OtherMachine,
        _ => return None,
    })
}

/// Estimates for each recording.
pub(super) fn checks(explained: &Explained, unit: &str) -> Vec<SignalCheck> {
    let of = |check: &greybox::SignalCheck| SignalCheck {
        recording: check.record.clone(),
        law_left_frac: check.law_left,
        law_gain: check.law_gain,
        law_offset: check.law_offset,
        drive_late_s: check.drive_late_s,
        balance_left_frac: check.balance_left,
        inertia_ratio: check.inertia_ratio,
        drive_step: check.drive_step,
        position_step: check.position_step,
        saturated_frac: check.saturated_share,
        inputs_s: check.inputs_s,
        unit: unit.to_owned(),
    };
    explained.signals.checks.iter().map(of).collect()
}

/// What is wrong, a line each.
pub(super) fn lines(findings: &[SignalFinding]) -> Vec<String> {
    let line = |finding: &SignalFinding| {
        let done = match (finding.corrected, finding.correctable) {
            (true, _) => " (set right)",
            (false, true) => " (`--correct` sets it right)",
            (false, false) => "",
        };
        format!("signal: {}{done}", finding.told)
    };
    findings.iter().map(line).collect()
}
