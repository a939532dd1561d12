//! Words and numbers as the page writes them.

use greybox::{Finding, Verdict};

/// Symbols of effects, in their order.
pub(super) fn symbols<'f>(findings: impl IntoIterator<Item = &'f Finding>) -> String {
    let named: Vec<&str> = findings.into_iter().map(|f| f.effect.id().info().symbol).collect();
    if named.is_empty() { "none".to_owned() } else { named.join(", ") }
}

/// A verdict as the reports write it.
pub(crate) fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Adequate => "adequate",
        Verdict::Named => "named",
        Verdict::NamedWithRemainder => "named-with-remainder",
        Verdict::OneOf => "one-of",
        Verdict::Unknown => "unknown",
        Verdict::Absorbed => "absorbed",
        Verdict::Inconclusive => "inconclusive",
    }
}

/// Fall in percent.
pub(super) fn fall(from: f64, to: f64) -> f64 {
    100.0 * (1.0 - to / from)
}

/// Four digits, without a power of ten where it does without.
pub(super) fn short(value: f64) -> String {
    match value.abs() {
        size if (1e-2..10.0).contains(&size) => format!("{value:.4}"),
        size if (10.0..1e4).contains(&size) => format!("{value:.2}"),
        _ => format!("{value:.2e}"),
    }
}
