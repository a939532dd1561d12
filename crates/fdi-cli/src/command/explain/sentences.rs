//! The answer in words.

use std::iter;

use fdi_core::report::{
    CoordinateShare, EffectFinding, Explanation, ExplanationVerdict, FaultBeforeAfter,
    NominalChange, NumberFinding, Prediction, Remainder,
};

use super::signals;

/// The answer in one sentence.
pub(super) fn sentence(answer: &Explanation, reason: Option<&str>) -> String {
    let gain = answer.holdout.as_ref().map_or_else(String::new, |holdout| {
        let unit = holdout.unit.to_uppercase();
        let floor = rounded(holdout.noise_floor);
        let noise = answer.floor_name();
        let moves = moves(holdout.rms_before, holdout.rms_after, &unit);
        format!("; on recordings it has not seen the residual {moves} ({noise} {floor} {unit})")
    });
    match answer.verdict {
        ExplanationVerdict::Adequate => {
            "The model explains the recordings to the noise; no effect of the catalogue is visible."
                .to_owned()
        }
        ExplanationVerdict::Named
        | ExplanationVerdict::NamedWithRemainder
        | ExplanationVerdict::OneOf => {
            let (missed, apart) = missed(answer);
            let (which, apart) = apart.map_or_else(Default::default, |apart| {
                (": these recordings cannot tell which", format!(" To tell them apart: {apart}."))
            });
            let left = if answer.verdict == ExplanationVerdict::NamedWithRemainder {
                ", and something else is left that nothing in the catalogue surely explains"
            } else {
                ""
            };
            let wrong = wrong(answer);
            if answer.effects.is_empty() {
                return format!(
                    "The model file is wrong in {wrong}; no effect is visible beside it."
                );
            }
            let wrong = match &wrong[..] {
                "" => String::new(),
                wrong => format!(" Its file is wrong in {wrong}."),
            };
            format!("The model misses {missed}{which}{gain}{left}.{wrong}{apart}")
        }
        ExplanationVerdict::Unknown => {
            let leading = answer.remainder.as_ref().and_then(|r| r.shares.first());
            let follows = leading.map_or_else(String::new, |share| {
                format!(
                    "; it follows the {} most ({:.0} % of what is left, noise included)",
                    share.coordinate,
                    100.0 * share.share
                )
            });
            let unless = match answer.absorbed.join(", ") {
                absorbed if absorbed.is_empty() => String::new(),
                absorbed => format!(
                    ", unless it is one that these recordings cannot tell from damage or tolerance \
                     ({absorbed})"
                ),
            };
            format!(
                "The model misses something that no effect of the catalogue explains{unless}\
                 {follows}. Fault levels may be off by more than their intervals."
            )
        }
        ExplanationVerdict::Absorbed => format!(
            "What these recordings show as damage or tolerance may be an effect that looks the same \
             in them: {}.",
            answer.absorbed.join(" or ")
        ),
        ExplanationVerdict::Inconclusive => {
            format!("No conclusion: {}.", reason.unwrap_or("the recordings do not suffice"))
        }
    }
}

/// Numbers of the model file that are wrong, each with what the recordings have.
fn wrong(answer: &Explanation) -> String {
    let one = |number: &NumberFinding| {
        let [nominal, value] = [number.nominal, number.value].map(rounded);
        format!("{}: {value}, not {nominal}", number.key())
    };
    answer.numbers.iter().map(one).collect::<Vec<_>>().join(", and ")
}

/// Numbers of the model file that may be off, each with the change that the recordings ask for.
fn free(answer: &Explanation) -> String {
    let one = |(key, number): (&String, &NominalChange)| match number.change_percent() {
        Some(change) => format!("{key} {change:+.1} %"),
        None => format!("{key} {}", rounded(number.fitted)),
    };
    answer.nominal.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// The model of an actuator that predicts; of an axis there is one.
fn predicted(model: Prediction) -> Option<&'static str> {
    match model {
        Prediction::Low => Some("the low-fidelity model with its electronics"),
        Prediction::High => Some("the high-fidelity model with its electronics"),
        Prediction::Learnt => Some("the low-fidelity model with its learnt error"),
        _ => None,
    }
}

/// Which way a size goes, as it is shown.
fn moves(before: f64, after: f64, unit: &str) -> String {
    let [from, to] = [before, after].map(rounded);
    if from == to {
        format!("stays at {from} {unit}")
    } else {
        let verb = if after < before { "falls" } else { "rises" };
        format!("{verb} from {from} to {to} {unit}")
    }
}

/// The effects found, each with what it may be instead; and what would tell the first ones that
/// are tied apart.
fn missed(answer: &Explanation) -> (String, Option<&str>) {
    let (mut each, mut apart) = (Vec::new(), None);
    for effect in &answer.effects {
        let instead = |one: &&EffectFinding| one.instead_of.as_deref() == Some(&effect.id);
        let set = iter::once(effect).chain(answer.alternatives.iter().filter(instead));
        let set: Vec<_> = set.map(|e| format!("{} ({})", e.name, e.id)).collect();
        if set.len() == 1 {
            each.extend(set);
        } else {
            each.push(format!("one of {}", set.join(", ")));
            apart = apart.or(Some(effect.separated_by.as_str()));
        }
    }
    (each.join(" and "), apart)
}

/// A fault level and its interval; one that may be anything is none.
fn shown(level: f64, [from, to]: [f64; 2]) -> (String, String) {
    if !FaultBeforeAfter::determines([from, to]) {
        return ("-".to_owned(), "not determined".to_owned());
    }
    (format!("{level:.4}"), format!("{from:.4} to {to:.4}"))
}

/// Four significant digits, or as many more as tell the ends of an interval apart.
fn to_the_width(value: f64, width: f64) -> String {
    let decades = (value.abs() / width.abs()).log10();
    if !decades.is_finite() || decades < 1.0 {
        return rounded(value);
    }
    significant(value, (decades.ceil() as usize + 3).min(16))
}

/// Four significant digits.
pub(crate) fn rounded(value: f64) -> String {
    significant(value, 4)
}

/// So many significant digits, without zeros behind them.
fn significant(value: f64, digits: usize) -> String {
    let text = format!("{value:.0$e}", digits - 1);
    text.parse::<f64>().map_or_else(|_| value.to_string(), |v| v.to_string())
}

/// Names the effect that an alternative may be the cause instead of.
pub(crate) fn instead(effect: &EffectFinding) -> String {
    let instead = effect.instead_of.as_ref();
    instead.map_or_else(String::new, |id| format!(", instead of {id}"))
}

/// The coordinates that the remainder follows, in a line.
fn left(remainder: &Remainder) -> String {
    let share = |s: &CoordinateShare| format!("{} {:.0} %", s.coordinate, 100.0 * s.share);
    let shares: Vec<String> = remainder.shares.iter().map(share).collect();
    format!("\nWhat is left follows: {}; kurtosis {:.1}", shares.join(", "), remainder.kurtosis)
}

/// Numbers of the model file, those that are wrong last, in lines.
fn numbers(answer: &Explanation) -> Vec<String> {
    let fitted = format!("Numbers of the model file as fitted: {}", free(answer));
    let fitted = (!answer.nominal.is_empty()).then_some(fitted);
    fitted.into_iter().chain(answer.numbers.iter().flat_map(wrong_number)).collect()
}

/// A number of the model file that is wrong, in lines.
fn wrong_number(number: &NumberFinding) -> [String; 3] {
    let [low, high] = number.interval_95;
    let [value, low, high] =
        [number.value, low, high].map(|number| to_the_width(number, high - low));
    [
        format!("\nWrong in the model file: {}", number.key()),
        format!("  {value} for {}   95 % {low} to {high}", rounded(number.nominal)),
        format!(
            "  beyond its tolerance of ±{}; chance of as much from noise {:.1e} at most; gain held out \
             {:.1} ± {:.1} nats",
            rounded(number.tolerance),
            number.p_familywise,
            number.holdout_gain_nats,
            number.holdout_gain_se
        ),
    ]
}

/// The answer for people.
pub(super) fn human(answer: &Explanation) -> String {
    let mut text = format!("{}\n", answer.sentence);
    let mut line = |content: String| {
        text.push_str(&content);
        text.push('\n');
    };
    let is_conclusive = answer.verdict != ExplanationVerdict::Inconclusive;
    for told in signals::lines(&answer.signals, is_conclusive) {
        line(told);
    }
    if let Some(predicted) = answer.prediction.and_then(predicted) {
        line(format!("Recordings are predicted by {predicted}."));
    }
    for told in numbers(answer) {
        line(told);
    }
    for (title, effects) in [("Found", &answer.effects), ("As likely", &answer.alternatives)] {
        for effect in effects {
            let instead = instead(effect);
            let EffectFinding { id, name, port, .. } = effect;
            line(format!("\n{title}: {id} {name}, port {port}{instead}"));
            for (key, number) in &effect.parameters {
                let Some([from, to]) = number.interval_95 else {
                    line(format!("  {key:<34} {:>12}   not fitted", rounded(number.value)));
                    continue;
                };
                let [value, low, high] =
                    [number.value, from, to].map(|number| to_the_width(number, to - from));
                line(format!("  {key:<34} {value:>12}   95 % {low} to {high}"));
            }
            line(format!(
                "  chance of as much from noise {} at most; gain held out {:.1} ± {:.1} nats",
                effect.p_familywise, effect.holdout_gain_nats, effect.holdout_gain_se
            ));
        }
    }
    for row in levels(answer) {
        line(row);
    }
    if !answer.records.is_empty() {
        line(
            "\nRecording                                   use       fit %  before   after"
                .to_owned(),
        );
        for record in &answer.records {
            line(format!(
                "  {:<40} {:<10} {:>13.2} {:>7.2}",
                record.recording, record.role, record.fit_percent_before, record.fit_percent_after
            ));
        }
        for record in answer.records.iter().filter(|record| record.fit_percent_after < 0.0) {
            line(format!(
                "  {}: a constant is nearer to what was measured than the model: are sign, unit and \
                 machine right?",
                record.recording
            ));
        }
    }
    if let Some(remainder) = &answer.remainder {
        line(left(remainder));
    }
    if !answer.absorbed.is_empty() {
        line(format!(
            "\nNot to be told from damage or tolerance by these recordings: {}",
            answer.absorbed.join(", ")
        ));
    }
    text
}

/// Fault levels without and with what was found, and the numbers that leave them open.
fn levels(answer: &Explanation) -> Vec<String> {
    if answer.faults.is_empty() {
        return Vec::new();
    }
    let head = "\nFault levels     nominal model   95 %                with what was found   95 %";
    let row = |(key, f): (&String, &FaultBeforeAfter)| {
        let (before, before_95) = shown(f.before, f.interval_95_before);
        let (after, after_95) = shown(f.after, f.interval_95_after);
        format!("  {key:<14} {before:>13}   {before_95:<18}  {after:>19}   {after_95}")
    };
    let open = |(key, f): (&String, &FaultBeforeAfter)| {
        let with = f.ambiguous_with.join(", ");
        (!with.is_empty()).then(|| {
            format!(
                "  {key} is ambiguous with {with}: numbers of the model file, which leave it open; \
                 `--exact` pins one that was measured"
            )
        })
    };
    let levels = answer.faults.iter();
    core::iter::once(head.to_owned())
        .chain(levels.clone().map(row))
        .chain(levels.filter_map(open))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::moves;

    #[test]
    fn a_residual_falls_only_where_it_does() {
        assert_eq!(moves(0.025_59, 0.006_372, "A"), "falls from 0.02559 to 0.006372 A");
        assert_eq!(moves(0.006_372, 0.025_59, "V"), "rises from 0.006372 to 0.02559 V");
        assert_eq!(moves(0.025_590_01, 0.025_59, "A"), "stays at 0.02559 A");
    }
}
