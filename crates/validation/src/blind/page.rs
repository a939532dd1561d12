//! The page of the scored set.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write,
};

use super::{
    baseline,
    bound::Rate,
    case_file::Line,
    kept,
    null_check::NullCheck,
    plan::Set,
    pysindy::Kept,
    score::{self, Bar, Kind, Measured, Pooled, Tally},
};
use crate::median::median;

/// Where a run comes from.
pub(crate) struct Origin {
    pub(crate) set: &'static str,
    /// Source of the seeds.
    pub(crate) root: String,
    /// Cases of the whole set.
    pub(crate) planned: usize,
    /// Cases that the generator could not draw.
    pub(crate) not_drawn: usize,
    /// Answers of `PySINDy`, where it was run.
    pub(crate) pysindy: Vec<Kept>,
}

/// Heading of the part that people write and a new run keeps.
const WHY: &str = "## Why bars are missed";

/// The page; what stands under [`WHY`] in an earlier one is kept.
pub(crate) fn page(lines: &[Line], checks: &[NullCheck], origin: &Origin, earlier: &str) -> String {
    let mut text = String::from(
        "# Blind tests\n\nMade by `cargo xtask blind`; what is hidden, and how, is in `docs/models/blind-test.md`.\n\n",
    );
    let seconds: f64 = lines.iter().map(|line| line.elapsed_s).sum();
    let _ = writeln!(
        text,
        "Set: {}, {} of {} cases, {} not drawn. Answered at commit {}, seeds from `{}`. {:.1} s a case, one job each.\n",
        origin.set,
        lines.len(),
        origin.planned,
        origin.not_drawn,
        commits(lines),
        origin.root,
        seconds / lines.len().max(1) as f64,
    );
    if origin.set == Set::Score.name() {
        let _ = writeln!(text, "What is scored of each case: `{}`.\n", kept::FILE);
    }
    bars(&mut text, &score::bars(lines));
    verdicts(&mut text, lines);
    power(&mut text, lines);
    faults(&mut text, lines);
    confusion(&mut text, lines);
    false_names(&mut text, lines);
    baselines(&mut text, lines, &origin.pysindy);
    nulls(&mut text, checks);
    let _ = write!(text, "{WHY}{}", why(earlier));
    text
}

/// Beginning of the line that says which answers the part that people write is about.
const ABOUT: &str = "*Written on the answers of commit ";

/// The part that people wrote in an earlier page, with the commits of that page where it does not
/// say its own: a new run moves the tables, not these words.
fn why(earlier: &str) -> String {
    let Some((page, why)) = earlier.split_once(WHY) else {
        return "\n\nNothing is written here yet.\n".to_owned();
    };
    let answered = page
        .split_once("Answered at commit ")
        .and_then(|(_, rest)| rest.split_once(", seeds from ").map(|(commits, _)| commits));
    match answered {
        Some(commits) if !commits.is_empty() && !why.contains(ABOUT) => {
            format!("\n\n{ABOUT}{commits}.*{why}")
        }
        _ => why.to_owned(),
    }
}

/// The commits at which cases were answered, each with how many.
fn commits(lines: &[Line]) -> String {
    let mut counts = BTreeMap::new();
    for line in lines {
        *counts.entry(line.commit.as_str()).or_insert(0_usize) += 1;
    }
    let each: Vec<String> =
        counts.iter().map(|(commit, count)| format!("{commit} ({count} cases)")).collect();
    each.join(" and ")
}

fn percent(rate: &Rate) -> String {
    if rate.of == 0 {
        return "-".to_owned();
    }
    format!("{:.1} % ({} of {})", 100.0 * rate.value(), rate.hits, rate.of)
}

fn bars(text: &mut String, bars: &[Bar]) {
    text.push_str("| what | found | 95 % bound | asked | met |\n| --- | --- | --- | --- | --- |\n");
    for bar in bars {
        let (found, bound) = match (bar.measured, bar.kind) {
            (Measured::Figure { value, of }, _) => {
                (format!("{value:.3} (of {of})"), "-".to_owned())
            }
            (Measured::Rate(rate), Kind::AtMost { .. }) => {
                (percent(&rate), format!("≤ {:.1} %", 100.0 * rate.at_most()))
            }
            (Measured::Rate(rate), _) => {
                (percent(&rate), format!("≥ {:.1} %", 100.0 * rate.at_least()))
            }
        };
        let asked = match bar.kind {
            Kind::AtMost { rate, bound } => {
                format!("≤ {:.0} %, bound ≤ {:.0} %", 100.0 * rate, 100.0 * bound)
            }
            Kind::AtLeast { rate } => {
                format!("≥ {:.0} %, bound ≥ {:.0} %", 100.0 * rate, 100.0 * rate - 5.0)
            }
            Kind::Within { from, to } => format!("{:.0} to {:.0} %", 100.0 * from, 100.0 * to),
            Kind::Figure { most } => format!("≤ {most}"),
        };
        let met = match bar.met() {
            None => "not measured".to_owned(),
            Some(true) => "yes".to_owned(),
            Some(false) => format!("**no**{}", missed(bar)),
        };
        let _ = writeln!(text, "| {} | {found} | {bound} | {asked} | {met} |", bar.name);
    }
    text.push_str("\nRates are over all cases of the class. `inconclusive` and no answer miss what is asked at least; they are no alarm and no wrong name (how many: under Verdicts). A bound is one-sided, Clopper and Pearson's. Visible: lambda of 30 or more.\n\n");
}

/// By how much a bar is missed.
fn missed(bar: &Bar) -> String {
    let points = |value: f64| format!(" by {:.1} points", 100.0 * value);
    match (bar.kind, bar.measured) {
        (Kind::AtMost { rate, .. }, Measured::Rate(found)) if found.value() > rate => {
            points(found.value() - rate)
        }
        (Kind::AtMost { bound, .. }, Measured::Rate(found)) => {
            format!(", its bound{}", points(found.at_most() - bound))
        }
        (Kind::AtLeast { rate }, Measured::Rate(found)) if found.value() < rate => {
            points(rate - found.value())
        }
        (Kind::AtLeast { rate }, Measured::Rate(found)) => {
            format!(", its bound{}", points(rate - 0.05 - found.at_least()))
        }
        (Kind::Within { from, to }, Measured::Rate(found)) => {
            points((from - found.value()).max(found.value() - to))
        }
        (Kind::Figure { most }, Measured::Figure { value, .. }) => {
            format!(" by {:.3}", value - most)
        }
        _ => String::new(),
    }
}

fn verdicts(text: &mut String, lines: &[Line]) {
    let counts = score::verdicts(lines);
    let said: BTreeSet<&str> = counts.keys().map(|(_, said)| said.as_str()).collect();
    let classes: BTreeSet<&str> = counts.keys().map(|(class, _)| class.as_str()).collect();
    text.push_str("## Verdicts\n\n");
    grid(text, "class", &classes, &said, |class, said| {
        counts.get(&(class.to_owned(), said.to_owned())).copied().unwrap_or(0)
    });
}

fn grid<'a>(
    text: &mut String,
    corner: &str,
    rows: &BTreeSet<&'a str>,
    columns: &BTreeSet<&'a str>,
    count: impl Fn(&str, &str) -> usize,
) {
    let names: Vec<&str> = columns.iter().copied().collect();
    let _ = writeln!(text, "| {corner} | {} |", names.join(" | "));
    let _ = writeln!(text, "| --- |{}", " ---: |".repeat(names.len()));
    for row in rows {
        let cells: Vec<String> = names
            .iter()
            .map(|column| count(row, column))
            .map(|n| if n == 0 { String::new() } else { n.to_string() })
            .collect();
        let _ = writeln!(text, "| {row} | {} |", cells.join(" | "));
    }
    text.push('\n');
}

fn power(text: &mut String, lines: &[Line]) {
    text.push_str("## Power\n\nSingles by severity, the square root of lambda / 15: 1 is what is found half of the time at best, 1.414 visible.\n\n");
    text.push_str("| severity | right effect | wrong name |\n| --- | --- | --- |\n");
    for (from, to, right, wrong) in score::power(lines) {
        let _ = writeln!(text, "| {from} to {to} | {} | {} |", percent(&right), percent(&wrong));
    }
    let imitated = score::imitated_singles(lines);
    let _ = writeln!(
        text,
        "\nVisible by slopes over faults and nuisance parameters alone, and not when they follow their own course: {} singles, {} of them named right.\n",
        imitated.of, imitated.hits,
    );
}

fn faults(text: &mut String, lines: &[Line]) {
    let visible = score::visible_singles(lines);
    text.push_str("## Faults, visible singles\n\n| fault | median error before | after | intervals that hold the truth | median half width | not given |\n| --- | ---: | ---: | --- | ---: | ---: |\n");
    let of_each = ["k1", "k2", "k3", "k4", "k5", "k6"].map(|id| (id, Pooled::Of(id)));
    let rows = [("all", Pooled::All), ("moved", Pooled::Moved)].into_iter().chain(of_each);
    for (name, pooled) in rows {
        let errors = score::fault_errors(&visible, pooled);
        let _ = writeln!(
            text,
            "| {name} | {:.5} | {:.5} | {} | {:.5} | {} |",
            median(&errors.before),
            median(&errors.after),
            percent(&errors.covered),
            median(&errors.half_widths),
            errors.missing,
        );
    }
    text.push_str("\nMoved: those that by the generator's slopes the effect shifts by more than the half width of the interval given in the end: the wider that is, the fewer they are. Half of the machines are healthy, and most levels are right without the effect already.\n");
    text.push('\n');
}

fn confusion(text: &mut String, lines: &[Line]) {
    let counts = score::confusion(lines);
    let rows: BTreeSet<&str> = counts.keys().map(|(truth, _)| truth.as_str()).collect();
    let columns: BTreeSet<&str> = counts.keys().map(|(_, said)| said.as_str()).collect();
    text.push_str("## Confusion, visible singles\n\nTrue effects down, first answers across.\n\n");
    grid(text, "true", &rows, &columns, |truth, said| {
        counts.get(&(truth.to_owned(), said.to_owned())).copied().unwrap_or(0)
    });
}

fn false_names(text: &mut String, lines: &[Line]) {
    let [singles, doubles] = score::false_names(lines);
    let _ = writeln!(
        text,
        "An answer may name several effects. One at least that is not there, nor any of its alternatives, is among them in {} of the visible singles and {} of the doubles; beside one that is there it is no wrong name as counted above.\n",
        percent(&singles),
        percent(&doubles),
    );
}

fn baselines(text: &mut String, lines: &[Line], kept: &[Kept]) {
    let same: Vec<&Line> = lines.iter().filter(|line| line.baselines.is_some()).collect();
    let _ = writeln!(
        text,
        "## Baselines, same cases\n\nPlain rules on the same files, and `fdi explain` beside them, {} cases; PySINDy, by `fixtures/references/pysindy`, on the set named. What each does is in `docs/models/blind-test.md`. The answer of a rule is its first name; for `fdi explain`, `unknown` counts as an alarm, and a wrong name is an answered set without the truth.\n",
        same.len(),
    );
    text.push_str("| rule | cases | nulls | unusual nulls | faults only | right effect, visible singles | wrong name | outside, named | … without a remainder |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
    let here = format!("{}, here", same.len());
    tally(text, "`fdi explain`", &here, &Tally::of_explain(&same));
    for (rule, title) in baseline::RULES {
        tally(text, title, &here, &Tally::of_rule(&same, rule));
    }
    for kept in kept {
        let lines: Vec<&Line> = kept.lines.iter().collect();
        let cases = format!("{}, {}", lines.len(), kept.set);
        for (rule, title) in &kept.variants {
            let title = format!("PySINDy {}: {title}", kept.version);
            tally(text, &title, &cases, &Tally::of_rule(&lines, rule));
        }
    }
    text.push('\n');
}

fn tally(text: &mut String, title: &str, cases: &str, found: &Tally) {
    let rates = [
        found.null,
        found.unusual,
        found.fault_only,
        found.right,
        found.wrong,
        found.outside,
        found.outside_without_remainder,
    ];
    let cells = rates.map(|rate| percent(&rate));
    let _ = writeln!(text, "| {title} | {cases} | {} |", cells.join(" | "));
}

fn nulls(text: &mut String, checks: &[NullCheck]) {
    text.push_str("## Null check\n\nNominal machines of generator and simulator, without noise: largest rms difference of the current over eight draws, healthy and faulty, with and without steps of the load. Asked: a tenth of the lowest noise, 0.0005 A.\n\n");
    text.push_str("| machine | command | rms, A |\n| --- | --- | ---: |\n");
    for check in checks {
        let (machine, command) = (check.machine.name(), check.command.name());
        let _ = writeln!(text, "| {machine} | {command} | {:.1e} |", check.worst_rms_a);
    }
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn baselines_stand_beside_the_answers_on_the_same_cases() {
        let names = |name: &str| Some([("stlsq".to_owned(), vec![name.to_owned()])].into());
        let null = |baselines| Line { class: "null".to_owned(), baselines, ..Line::default() };
        let mut text = String::new();
        let kept = Kept {
            version: "2.1.0".to_owned(),
            set: "dev".to_owned(),
            variants: [("v".to_owned(), "joint".to_owned())].into(),
            lines: vec![null(Some([("v".to_owned(), Vec::new())].into()))],
        };
        baselines(&mut text, &[null(names("E01")), null(None)], &[kept]);
        let row = |start: &str| text.lines().find(|line| line.starts_with(start)).unwrap();
        assert!(row("| `fdi").starts_with("| `fdi explain` | 1, here | 0.0 % (0 of 1) | -"));
        assert!(row("| thresholded").contains("| 1, here | 100.0 % (1 of 1) | -"));
        assert!(row("| PySINDy 2.1.0: joint").contains("| 1, dev | 0.0 % (0 of 1) | -"));
    }

    #[test]
    fn the_page_keeps_what_people_wrote() {
        let origin = Origin {
            set: "dev",
            root: "development".to_owned(),
            planned: 1900,
            not_drawn: 0,
            pysindy: Vec::new(),
        };
        let first = page(&[], &[], &origin, "");
        assert!(
            first.contains("| tie stated | - | ≥ 0.0 % | ≥ 90 %, bound ≥ 85 % | not measured |")
        );
        let written = first.replace("Nothing is written here yet.", "Because.");
        assert!(
            page(&[], &[], &origin, &written).ends_with("## Why bars are missed\n\nBecause.\n")
        );
    }
}
