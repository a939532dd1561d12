//! Choice of rows, where one table holds several recordings: `COLUMN=VALUE`.

use crate::RecordError;

/// Values of a column that a message repeats, and how much of each.
const MOST_SHOWN: usize = 5;
const SHOWN_CHARS: usize = 24;

/// A condition on the rows that are read, as it was given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct RowChoice(String);

impl RowChoice {
    /// Reads `COLUMN=VALUE`; `None` where it is not of this form.
    pub(super) fn parse(entry: &str) -> Option<Self> {
        let (column, _) = entry.split_once('=')?;
        (!column.trim().is_empty()).then(|| Self(entry.to_owned()))
    }

    /// The column and the value; a name may hold a `=` too, so that there may be several.
    fn sides(&self) -> impl Iterator<Item = (&str, &str)> {
        self.0.match_indices('=').map(|(at, _)| (self.0[..at].trim(), self.0[at + 1..].trim()))
    }

    /// The condition on a column that `find` knows by its name, with what it finds.
    ///
    /// # Errors
    /// The error of `find`, or [`RecordError::ChoiceColumnMissing`].
    pub(super) fn condition<T>(
        &self,
        columns: &[String],
        line: Option<u64>,
        mut find: impl FnMut(&str) -> Result<Option<T>, RecordError>,
    ) -> Result<(T, Condition), RecordError> {
        for (column, value) in self.sides() {
            if let Some(found) = find(column)? {
                let (column, value) = (column.to_owned(), value.to_owned());
                let plain = plain_number(&value);
                let condition = Condition { column, value, plain, is_met: false, seen: Vec::new() };
                return Ok((found, condition));
            }
        }
        let column = self.sides().next().map_or("", |(column, _)| column).to_owned();
        Err(RecordError::ChoiceColumnMissing { line, column, columns: columns.to_vec() })
    }
}

/// A condition on the cells of one column, with what was seen of them.
#[derive(Debug)]
pub(super) struct Condition {
    column: String,
    value: String,
    /// The value as a number, where it is a plain one.
    plain: Option<String>,
    is_met: bool,
    /// Other values, as far as a message repeats them.
    seen: Vec<String>,
}

impl Condition {
    /// Tells whether a cell has the value: the same text, or the same plain number.
    pub(super) fn is_met_by(&mut self, cell: &str) -> bool {
        let cell = cell.trim();
        let is_number = || self.plain.is_some() && plain_number(cell) == self.plain;
        let is_met = cell == self.value || is_number();
        self.is_met |= is_met;
        if !is_met && self.seen.len() <= MOST_SHOWN {
            let shown = shown(cell);
            if !self.seen.contains(&shown) {
                self.seen.push(shown);
            }
        }
        is_met
    }
}

/// A number without what does not count: `3.0` and `3,0` are `3`. What is written otherwise, as `007`
/// and `1e2`, is a name.
fn plain_number(text: &str) -> Option<String> {
    let (sign, size) = text.strip_prefix('-').map_or(("", text), |size| ("-", size));
    let (whole, part) = size.split_once(['.', ',']).unwrap_or((size, ""));
    let is_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let is_plain = is_digits(whole) && is_digits(part) && !whole.is_empty();
    let has_zeros = whole.len() > 1 && whole.starts_with('0');
    (is_plain && !has_zeros).then(|| match part.trim_end_matches('0') {
        "" => format!("{sign}{whole}"),
        part => format!("{sign}{whole}.{part}"),
    })
}

/// A cell as a message repeats it: one line, and not all of a long one.
fn shown(cell: &str) -> String {
    let line = |letter: char| if letter.is_control() { ' ' } else { letter };
    let mut shown: String = cell.chars().take(SHOWN_CHARS).map(line).collect();
    if cell.chars().nth(SHOWN_CHARS).is_some() {
        shown.push('…');
    }
    shown
}

/// The choice of the rows with a value in a column, as an option of a shell; `None` where the value is
/// nothing to type.
pub(super) fn choice_of(column: &str, value: &str) -> Option<String> {
    let is_short = !value.is_empty() && shown(value) == value && !column.contains('=');
    let can_be_quoted = !column.contains('\'') && !value.contains('\'');
    (is_short && can_be_quoted).then(|| format!("{column}={value}"))
}

/// The error of conditions that no row has met.
pub(super) fn no_row(conditions: Vec<Condition>) -> RecordError {
    let wanted = conditions.iter().map(|one| format!("{}={}", one.column, one.value)).collect();
    // where each has rows, but none has all, no column is at fault
    let at_fault = conditions.into_iter().find(|one| !one.is_met);
    let (column, mut found) = at_fault.map_or_else(Default::default, |one| (one.column, one.seen));
    let is_more = found.len() > MOST_SHOWN;
    found.truncate(MOST_SHOWN);
    RecordError::NoRowChosen { wanted, column, found, is_more }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_compared_as_text_and_as_plain_numbers() {
        for (choice, cell, is_met) in [
            ("run=3", " 3 ", true),
            ("run = 3", "3.0", true),
            ("run=3.0", "3,00", true),
            ("run=-0.5", "-0.50", true),
            ("run=3", "33", false),
            ("run=7", "007", false),
            ("run=007", "007", true),
            ("run=100", "1e2", false),
            ("run=9007199254740993", "9007199254740992", false),
            ("state=RUN", "RUN", true),
            ("state=RUN", "run", false),
            ("note=", "", true),
        ] {
            let choice = RowChoice::parse(choice).unwrap();
            let ((), mut condition) = choice.condition(&[], None, |_| Ok(Some(()))).unwrap();
            assert_eq!(condition.is_met_by(cell), is_met, "{choice:?} {cell}");
        }
        assert_eq!(["run", "=3"].map(RowChoice::parse), [None, None]);
    }

    #[test]
    fn a_column_may_have_the_sign_in_its_name() {
        let choice = RowChoice::parse("run=id=1").unwrap();
        let known = |name: &str| Ok((name == "run=id").then_some(()));
        let ((), mut condition) = choice.condition(&[], None, known).unwrap();
        assert!(condition.is_met_by("1"));
        let error = choice.condition::<()>(&[], Some(1), |_| Ok(None)).unwrap_err();
        assert!(error.to_string().starts_with("line 1: no column `run` to choose"), "{error}");
    }

    #[test]
    fn values_are_shown_on_one_line_and_cut() {
        assert_eq!(shown("a\nb"), "a b");
        assert_eq!(shown(&"x".repeat(30)), format!("{}…", "x".repeat(24)));
        assert_eq!(choice_of("run", "one two"), Some("run=one two".to_owned()));
        assert_eq!(
            [choice_of("run", ""), choice_of("run", "a\nb"), choice_of("a=b", "1")],
            [None, None, None]
        );
    }
}
