//! Parts of the messages of errors.

use super::RecordError;

/// Names in backticks, at most eight of them.
pub(super) fn list<T: ToString>(names: &[T]) -> String {
    const SHOWN: usize = 8;
    let shown: Vec<_> =
        names.iter().take(SHOWN).map(|name| format!("`{}`", name.to_string())).collect();
    let rest = names.len().saturating_sub(SHOWN);
    let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
    format!("{}{more}", shown.join(", "))
}

/// Option for tables whose columns have no name of times.
pub(super) fn row_note(columns: &[String]) -> &'static str {
    let is_time = |column: &String| {
        let lower = column.to_lowercase();
        let is_part = ["time", "zeit", "temps", "stamp"].iter().any(|word| lower.contains(word));
        lower == "t" || lower.starts_with("t_") || is_part
    };
    if columns.iter().any(is_time) {
        return "";
    }
    ", `--map time_s=row*FACTOR` gives the time between rows in s"
}

/// Option that takes a word such as `NaN` for a missing sample.
pub(super) const LACKING_NOTE: &str = "`--gaps bridge` takes it for a missing sample";

pub(super) fn lacking_note(found: &str) -> String {
    if RecordError::is_lacking(found) { format!("; {LACKING_NOTE}") } else { String::new() }
}

/// Which columns a file without rows has.
pub(super) fn rowless(columns: &[String]) -> String {
    if columns.is_empty() {
        return "the file has columns and no rows".to_owned();
    }
    format!("the file has {} and no rows of it", list(columns))
}

pub(super) fn columns_are(columns: &[String]) -> String {
    if columns.is_empty() {
        return "there is no column but time".to_owned();
    }
    format!("the columns are {}", list(columns))
}

/// A time to a thousandth of a step: finer than the samples, without the noise of arithmetic.
pub(super) fn time(time_s: f64, step_s: f64) -> String {
    let decimals = (3.0 - step_s.log10().floor()).clamp(0.0, 15.0) as usize;
    let text = format!("{time_s:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Where in a text it is, before a message.
pub(super) fn at(line: Option<u64>) -> String {
    line.map(|line| format!("line {line}: ")).unwrap_or_default()
}

/// Where in a text it is, before the column.
pub(super) fn cell_at(line: Option<u64>) -> String {
    line.map(|line| format!("line {line}, ")).unwrap_or_default()
}

pub(super) fn in_brackets(advice: &str) -> String {
    if advice.is_empty() { String::new() } else { format!(" ({advice})") }
}

pub(super) fn rate_note(rate_hz: Option<f64>) -> String {
    rate_hz.map(|hz| format!(" (the rows before are at {hz} Hz)")).unwrap_or_default()
}

/// A choice of rows as a word of a shell.
fn quoted(choice: &str) -> String {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "_-.:=/".contains(letter);
    if choice.chars().all(is_plain) { choice.to_owned() } else { format!("'{choice}'") }
}

pub(super) fn seen_note(column: &str, found: &[String], is_more: bool) -> String {
    if column.is_empty() {
        return ", though there are rows with each".to_owned();
    }
    format!("; values of `{column}`: {}{}", list(found), if is_more { " and more" } else { "" })
}

/// How many samples a command shows to lack or to be twice, and where the first stands.
pub(super) fn lost_and_doubled(lost: usize, doubled: usize) -> String {
    let count = |count: usize, what: &str| {
        (count > 0).then(|| format!("{count} {}{what}", if count == 1 { "row" } else { "rows" }))
    };
    let all: Vec<String> =
        [count(lost, " lost"), count(doubled, " too many")].into_iter().flatten().collect();
    format!("{}, the first", all.join(" and "))
}

/// A choice of rows as a word of a shell, or its form.
pub(super) fn chosen(choice: Option<&str>) -> String {
    choice.map_or_else(|| "COLUMN=VALUE".to_owned(), quoted)
}

pub(super) fn order_note(
    can_be_bridged: bool,
    begins_again: bool,
    rows_before: Option<&str>,
) -> String {
    match (can_be_bridged, begins_again) {
        (true, _) => "; `--gaps bridge` puts the samples in order".to_owned(),
        (false, true) => format!(
            "; of several recordings under one another `--where {}` reads one; in Python \
             `fdi.diagnose(table, group=COLUMN)` reads all",
            chosen(rows_before)
        ),
        (false, false) => String::new(),
    }
}
