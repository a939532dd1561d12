//! Signal chain of recordings: corrections, JSON and words.

use anyhow::{Result, bail};
use fdi_core::{
    Channel,
    ema_sim::model_file::MachineModel,
    report::{SignalCode, SignalFinding},
};
use greybox::{Recordings, SignalChannel, SignalEquation, SignalFind};

use crate::{GlobalArgs, Streams, args::RecordArgs};

/// Recordings for a command that does not judge the signal chain itself: set right where that is
/// asked for, which is said.
///
/// # Errors
///
/// For a find that stands, unless it concerns numbers that the command looks for.
pub(in crate::command) fn sound(
    recordings: Recordings,
    args: &RecordArgs,
    model: &MachineModel,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<Recordings> {
    let jobs = global.threads();
    let (recordings, finds) = if args.correct {
        greybox::correct_signals(model, &recordings, jobs)?
    } else {
        let finds = greybox::check_signals(model, &recordings, jobs)?;
        (recordings, finds)
    };
    for find in finds.iter().filter(|find| find.corrected) {
        streams.say(format_args!("set right: {}", find.told));
    }
    let of_numbers = |find: &&SignalFind| {
        let is_scale =
            matches!(find.code, greybox::SignalCode::Constant | greybox::SignalCode::Gain);
        (is_scale && find.equation == SignalEquation::Balance)
            || find.code == greybox::SignalCode::SameMotion
    };
    let stands = finds.iter().filter(|find| !find.corrected).find(|find| !of_numbers(find));
    if let Some(find) = stands {
        bail!("{}: {}", find.code.word(), find.sentence());
    }
    Ok(recordings)
}

/// Longest step between time stamps over the usual one, from which samples are missing between
/// them.
const GAP_STEPS: f64 = 1.5;

/// Samples that are missing by the time stamps of a channel.
pub(super) fn gap(record: &str, channel: &Channel) -> Option<SignalFind> {
    let times_s = channel.times_s();
    let mut steps: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
    let all = steps.iter().copied().enumerate();
    let (place, longest_s) = all.max_by(|a, b| a.1.total_cmp(&b.1))?;
    steps.sort_by(f64::total_cmp);
    let usual_s = steps[steps.len() / 2];
    let is_gap = longest_s > GAP_STEPS * usual_s;
    is_gap.then(|| SignalFind::gap_of_stamps(record, times_s[place], longest_s, usual_s))
}

/// All that it shows.
pub(super) fn findings(finds: &[SignalFind]) -> Vec<SignalFinding> {
    finds.iter().filter_map(finding).collect()
}

/// One that stands, else one that was set right.
pub(super) fn decisive(findings: &[SignalFinding]) -> Option<SignalFinding> {
    let stands = findings.iter().find(|finding| !finding.corrected);
    stands.or_else(|| findings.first()).cloned()
}

fn finding(find: &SignalFind) -> Option<SignalFinding> {
    Some(SignalFinding {
        code: code(find.code)?,
        equation: find.equation.word().to_owned(),
        recording: find.record.clone(),
        channel: find.channel.map(SignalChannel::word).map(str::to_owned),
        value: find.size.value,
        std: find.size.std.filter(|std| std.is_finite()),
        unit: find.size.unit.to_owned(),
        told: find.told.clone(),
        remedy: find.remedy.clone(),
        corrected: find.corrected,
        correctable: find.is_correctable(),
    })
}

/// Published word of a code; `None` for one that this form does not know.
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
        Code::Disturbed => SignalCode::Disturbed,
        Code::OtherMachine => SignalCode::OtherMachine,
        Code::SameMotion => SignalCode::SameMotion,
        _ => return None,
    })
}

/// Finds besides the one that the sentence tells, a line each.
pub(super) fn lines(findings: &[SignalFinding], is_conclusive: bool) -> Vec<String> {
    let (set_right, standing): (Vec<_>, Vec<_>) =
        findings.iter().partition(|finding| finding.corrected);
    let told = usize::from(!is_conclusive);
    let right = set_right.into_iter().map(|finding| format!("Set right: {}", finding.told));
    let stands = standing.into_iter().skip(told);
    right
        .chain(stands.map(|finding| format!("Also: {}; {}", finding.told, finding.remedy)))
        .collect()
}
