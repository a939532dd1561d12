//! Which columns of a foreign file are which channel: `NAME=COLUMN[*FACTOR[+OFFSET]]`, where a sum
//! of columns stands in brackets.

use super::{ChannelName, Gaps, nearest::nearest, row_choice::RowChoice, unit::Scale};

/// Meaning of a mapped column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    Time,
    Channel(ChannelName),
}

impl Target {
    pub(super) fn column(self) -> &'static str {
        match self {
            Self::Time => "time_s",
            Self::Channel(name) => name.column(),
        }
    }

    pub(super) fn from_column(column: &str) -> Option<Self> {
        if column == "time_s" {
            return Some(Self::Time);
        }
        ChannelName::from_column(column).map(Self::Channel)
    }
}

/// One entry of a [`ColumnMap`].
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    pub(super) target: Target,
    pub(super) column: String,
    /// Where one is given: it goes before the unit that the file states.
    pub(super) scale: Option<Scale>,
    /// True for a part of a sum with a minus before it; a scale that is given has no sign of it.
    pub(super) is_subtracted: bool,
}

/// Column of row numbers from 0, where no column has that name.
const ROW_COLUMN: &str = "row";

impl Entry {
    /// Tells whether times are those of the rows, where no column has the name.
    pub(super) fn is_of_rows(&self) -> bool {
        self.target == Target::Time && self.column == ROW_COLUMN
    }

    /// Time between rows where times are those of the rows, s.
    pub(super) fn row_step_s(&self) -> f64 {
        self.scale.unwrap_or(Scale::ONE).factor
    }
}

/// How a file is read: columns that stand for channels under other names or units, which rows, and
/// what is done where samples lack.
///
/// # Examples
///
/// ```
/// use recordings::{ColumnMap, Recording, ChannelName};
///
/// let map = ColumnMap::new(["time_s=t_ms*0.001", "current_a=Strom"])?;
/// let recording = Recording::parse("b.csv", b"t_ms,Strom\n0,1.5\n5,1.6\n", &map).expect("reads");
/// assert_eq!(recording.channel(ChannelName::Current).expect("mapped").times_s(), [0.0, 0.005]);
/// # Ok::<_, recordings::ColumnMapError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColumnMap {
    entries: Vec<Entry>,
    gaps: Gaps,
    skipped_lines: usize,
    rows: Vec<RowChoice>,
}

/// Why a `NAME=COLUMN[*FACTOR[+OFFSET]]`, a sum of columns or a choice of rows cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ColumnMapError {
    /// There is no `=`, or one side is empty.
    #[error(
        "`{entry}` is not of the form `NAME=COLUMN` or `NAME=COLUMN*FACTOR` (a channel, and the \
         column of the file that it is read from: `current_a=Strom*0.001`)"
    )]
    Form {
        /// The entry as given.
        entry: String,
    },
    /// The name is no channel.
    #[error("`{name}` in `--map` is no channel{}", hint(*nearest))]
    UnknownChannel {
        /// The name as given.
        name: String,
        /// A channel that is spelt almost like it.
        nearest: Option<&'static str>,
    },
    /// The factor is zero, infinite or not a number.
    #[error("factor {factor} of `{name}` must be finite and not zero")]
    Factor {
        /// The channel.
        name: &'static str,
        /// The factor as given.
        factor: f64,
    },
    /// The offset is infinite or not a number, or of the time, whose zero is free.
    #[error("offset {offset} of `{name}` {}", if *name == "time_s" {
        "does nothing: times begin where they do"
    } else {
        "must be finite"
    })]
    Offset {
        /// The channel.
        name: &'static str,
        /// The offset as given.
        offset: f64,
    },
    /// The time is a sum, or the Hall sensors are.
    #[error("`{name}` cannot be the sum of columns")]
    NoSum {
        /// The channel.
        name: &'static str,
    },
    /// A choice of rows has no `=`, or no column before it.
    #[error("`{entry}` is not of the form `COLUMN=VALUE` (rows that are read: `run=3`)")]
    RowForm {
        /// The entry as given.
        entry: String,
    },
    /// The channel is mapped twice.
    #[error("`{name}` is mapped twice")]
    ChannelTwice {
        /// The channel.
        name: &'static str,
    },
    /// The column is mapped twice.
    #[error("column `{column}` is mapped twice")]
    ColumnTwice {
        /// The column.
        column: String,
    },
}

fn hint(nearest: Option<&'static str>) -> String {
    nearest.map_or_else(
        || "; `fdi schema recording` lists them".to_owned(),
        |name| format!("; did you mean `{name}`?"),
    )
}

impl ColumnMap {
    /// Reads entries of the form `NAME=COLUMN`, `NAME=COLUMN*FACTOR` or `NAME=COLUMN*FACTOR+OFFSET`,
    /// where the offset may be negative.
    ///
    /// The value of the channel is that of the column times the factor, and the offset is added, in
    /// the unit of the channel: `winding_temperature_k=T*1+273.15`. Without a factor, the unit that the
    /// file states for the column says what makes SI of it, if it states one. What follows the last
    /// `*` is read so only where it is one number or two, so a column whose name holds a `*` can
    /// be named.
    ///
    /// A sum of columns stands in brackets, with blanks around each sign, and each column may have
    /// a factor: `position_m=(a - b)*0.001`, `motor_angle_rad=(coarse*4096 + fine)*1e-4`. With any
    /// factor, no unit that the file states counts. Columns have no brackets in their names, and their
    /// samples at the same times.
    ///
    /// # Errors
    /// A [`ColumnMapError`] for the first entry that cannot be used.
    pub fn new<S: AsRef<str>>(
        entries: impl IntoIterator<Item = S>,
    ) -> Result<Self, ColumnMapError> {
        let mut map = Self::default();
        for text in entries {
            let parts = parts(text.as_ref())?;
            if parts.iter().any(|part| map.maps(part.target)) {
                return Err(ColumnMapError::ChannelTwice { name: parts[0].target.column() });
            }
            for part in parts {
                if map.reads(&part.column) {
                    return Err(ColumnMapError::ColumnTwice { column: part.column });
                }
                map.entries.push(part);
            }
        }
        Ok(map)
    }

    /// Columns read with a choice of what is done where samples are lost, doubled or out of order.
    #[must_use]
    pub fn with_gaps(self, gaps: Gaps) -> Self {
        Self { gaps, ..self }
    }

    /// Columns of texts whose first lines are left out.
    #[must_use]
    pub fn with_skipped_lines(self, skipped_lines: usize) -> Self {
        Self { skipped_lines, ..self }
    }

    /// Columns of which only those rows are read that have a value in a column: of a table that
    /// holds several recordings, one.
    ///
    /// Each condition is `COLUMN=VALUE`, and rows meet all of them. A cell has a value where it is
    /// the same text, or the same number written plainly (`3`, `3.0` and `3,0`; not `007` or `3e0`).
    ///
    /// # Errors
    /// [`ColumnMapError::RowForm`] for the first that is not of this form.
    pub fn with_rows<S: AsRef<str>>(
        self,
        conditions: impl IntoIterator<Item = S>,
    ) -> Result<Self, ColumnMapError> {
        let choice = |text: S| {
            let entry = text.as_ref();
            let form = || ColumnMapError::RowForm { entry: entry.to_owned() };
            RowChoice::parse(entry).ok_or_else(form)
        };
        let rows = conditions.into_iter().map(choice).collect::<Result<_, _>>()?;
        Ok(Self { rows, ..self })
    }

    pub(super) fn rows(&self) -> &[RowChoice] {
        &self.rows
    }

    pub(super) fn skipped_lines(&self) -> usize {
        self.skipped_lines
    }

    pub(super) fn gaps(&self) -> Gaps {
        self.gaps
    }

    /// Tells whether no column is mapped.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Tells whether a channel, or the time, is read from the column.
    pub fn reads(&self, column: &str) -> bool {
        self.of_column(column).is_some()
    }

    pub(super) fn entries(&self) -> &[Entry] {
        &self.entries
    }

    pub(super) fn of_column(&self, column: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.column == column)
    }

    pub(super) fn maps(&self, target: Target) -> bool {
        self.columns_of(target) > 0
    }

    /// Columns that a channel is read from: several where it is their sum.
    pub(super) fn columns_of(&self, target: Target) -> usize {
        self.entries.iter().filter(|entry| entry.target == target).count()
    }
}

/// The columns of an entry: one, or the parts of a sum.
fn parts(text: &str) -> Result<Vec<Entry>, ColumnMapError> {
    let form = || ColumnMapError::Form { entry: text.to_owned() };
    let (name, columns) = text.split_once('=').ok_or_else(form)?;
    let (name, columns) = (name.trim(), columns.trim());
    if name.is_empty() {
        return Err(form());
    }
    let target = Target::from_column(name).ok_or_else(|| unknown(name))?;
    let (columns, of_all) = scaled(columns);
    check(target, of_all)?;
    let Some(terms) = terms(columns) else {
        if columns.is_empty() {
            return Err(form());
        }
        let column = columns.to_owned();
        return Ok(vec![Entry { target, column, scale: of_all, is_subtracted: false }]);
    };
    if matches!(target, Target::Time | Target::Channel(ChannelName::HallState)) {
        return Err(ColumnMapError::NoSum { name: target.column() });
    }
    let terms: Vec<(&str, Option<Scale>, bool)> = terms
        .into_iter()
        .map(|(term, is_subtracted)| {
            let (column, own) = scaled(term);
            (column, own, is_subtracted)
        })
        .collect();
    // one factor is enough for the numbers of all columns to be taken as they are
    let is_scaled = of_all.is_some() || terms.iter().any(|(_, own, _)| own.is_some());
    let part = |(index, (column, own, is_subtracted)): (usize, (&str, Option<Scale>, bool))| {
        let own = own.unwrap_or(Scale::ONE);
        if column.is_empty() || own.offset != 0.0 {
            return Err(form());
        }
        let all = of_all.unwrap_or(Scale::ONE);
        let scale = own.then(if index == 0 { all } else { Scale::by(all.factor) });
        check(target, Some(scale))?;
        let scale = is_scaled.then_some(scale);
        Ok(Entry { target, column: column.to_owned(), scale, is_subtracted })
    };
    terms.into_iter().enumerate().map(part).collect()
}

/// A text before the last `*`, and the scale behind it, where there is one.
fn scaled(text: &str) -> (&str, Option<Scale>) {
    text.rsplit_once('*')
        .and_then(|(before, scale)| Some((before.trim(), Some(scale_of(scale.trim())?))))
        .unwrap_or((text, None))
}

/// Refuses a scale that loses the numbers.
fn check(target: Target, scale: Option<Scale>) -> Result<(), ColumnMapError> {
    let Scale { factor, offset } = scale.unwrap_or(Scale::ONE);
    let name = target.column();
    if !factor.is_finite() || factor == 0.0 {
        return Err(ColumnMapError::Factor { name, factor });
    }
    if !offset.is_finite() || target == Target::Time && offset != 0.0 {
        return Err(ColumnMapError::Offset { name, offset });
    }
    Ok(())
}

/// The terms of `(A + B - C)`, and whether each is subtracted; `None` where a text is no sum, as one
/// with brackets within.
fn terms(text: &str) -> Option<Vec<(&str, bool)>> {
    const SIGNS: [&str; 2] = [" + ", " - "];
    let mut rest = text.strip_prefix('(')?.strip_suffix(')')?;
    if rest.contains(['(', ')']) {
        return None;
    }
    let (mut terms, mut is_subtracted) = (Vec::new(), false);
    while let Some(place) = SIGNS.iter().filter_map(|sign| rest.find(sign)).min() {
        let (term, behind) = rest.split_at(place);
        terms.push((term.trim(), is_subtracted));
        is_subtracted = behind.starts_with(SIGNS[1]);
        rest = &behind[SIGNS[0].len()..];
    }
    terms.push((rest.trim(), is_subtracted));
    (terms.len() > 1).then_some(terms)
}

/// `FACTOR`, or `FACTOR+OFFSET` with either sign; `None` where these are no numbers.
fn scale_of(text: &str) -> Option<Scale> {
    if let Ok(factor) = text.parse() {
        return Some(Scale::by(factor));
    }
    // a sign may also be that of an exponent
    text.match_indices(['+', '-']).find_map(|(place, _)| {
        let (factor, offset) = text.split_at(place);
        let offset = offset.split_at(1);
        let sign = if offset.0 == "-" { -1.0 } else { 1.0 };
        let offset: f64 = offset.1.trim_start().parse().ok()?;
        Some(Scale { factor: factor.trim_end().parse().ok()?, offset: sign * offset })
    })
}

fn unknown(name: &str) -> ColumnMapError {
    let known = ChannelName::ALL.iter().map(|channel| channel.column()).chain(["time_s"]);
    ColumnMapError::UnknownChannel { name: name.to_owned(), nearest: nearest(name, known) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_names_columns_and_factors() {
        let map = ColumnMap::new([
            "time_s = t [ms] * 1e-3",
            "current_a=i*q",
            "load_n_m=x=y*-2",
            "winding_temperature_k=a*b*1e-1 + 273.15",
            "phase_a_current_a=adc*-1.2e+1-2.5",
            "phase_b_current_a=i*2+x",
        ])
        .unwrap();
        let read: Vec<_> = map
            .entries()
            .iter()
            .map(|entry| (entry.target.column(), entry.column.as_str(), entry.scale))
            .collect();
        let want = [
            ("time_s", "t [ms]", Some(Scale::by(1e-3))),
            ("current_a", "i*q", None),
            ("load_n_m", "x=y", Some(Scale::by(-2.0))),
            ("winding_temperature_k", "a*b", Some(Scale { factor: 0.1, offset: 273.15 })),
            ("phase_a_current_a", "adc", Some(Scale { factor: -12.0, offset: -2.5 })),
            ("phase_b_current_a", "i*2+x", None),
        ];
        assert_eq!(read, want);
    }

    #[test]
    fn sums_of_columns_are_read_part_by_part() {
        let map = ColumnMap::new([
            "position_m=(a - b)*0.001+0.5",
            "current_a = (i [A] + j*2 - k-l) ",
            "motor_angle_rad=(m - n)",
            "motor_voltage_v=(Drive) x - y (A)",
            "load_n_m=(x)",
            "command_rad=(x+y)",
        ])
        .unwrap();
        let read: Vec<_> = map
            .entries()
            .iter()
            .map(|entry| (entry.column.as_str(), entry.scale, entry.is_subtracted))
            .collect();
        let want = [
            ("a", Some(Scale { factor: 0.001, offset: 0.5 }), false),
            ("b", Some(Scale::by(0.001)), true),
            ("i [A]", Some(Scale::ONE), false),
            ("j", Some(Scale::by(2.0)), false),
            ("k-l", Some(Scale::ONE), true),
            ("m", None, false),
            ("n", None, true),
            ("(Drive) x - y (A)", None, false),
            ("(x)", None, false),
            ("(x+y)", None, false),
        ];
        assert_eq!(read, want);
        assert_eq!(map.columns_of(Target::Channel(ChannelName::Current)), 3);
    }

    #[test]
    fn says_what_is_wrong_with_an_entry() {
        let error = |entries: &[&str]| ColumnMap::new(entries).unwrap_err().to_string();
        assert_eq!(
            error(&["current_a"]),
            "`current_a` is not of the form `NAME=COLUMN` or `NAME=COLUMN*FACTOR` (a channel, and \
             the column of the file that it is read from: `current_a=Strom*0.001`)"
        );
        assert_eq!(
            error(&["curent_a=i"]),
            "`curent_a` in `--map` is no channel; did you mean `current_a`?"
        );
        assert_eq!(
            error(&["foo=i"]),
            "`foo` in `--map` is no channel; `fdi schema recording` lists them"
        );
        assert_eq!(
            error(&["current_a=i*0"]),
            "factor 0 of `current_a` must be finite and not zero"
        );
        assert_eq!(error(&["current_a=i*1+inf"]), "offset inf of `current_a` must be finite");
        assert_eq!(
            error(&["time_s=t*1-5"]),
            "offset -5 of `time_s` does nothing: times begin where they do"
        );
        assert_eq!(error(&["current_a=i", "current_a=j"]), "`current_a` is mapped twice");
        assert_eq!(error(&["current_a=i", "load_n_m=i"]), "column `i` is mapped twice");
        assert_eq!(error(&["current_a=(i - i)"]), "column `i` is mapped twice");
        let rows = ColumnMap::default().with_rows(["run"]).unwrap_err().to_string();
        assert_eq!(rows, "`run` is not of the form `COLUMN=VALUE` (rows that are read: `run=3`)");
        assert_eq!(error(&["time_s=(t + u)"]), "`time_s` cannot be the sum of columns");
        for wrong in ["current_a=(i +  - j)", "current_a=(i*2+1 - j)"] {
            assert!(error(&[wrong]).contains("is not of the form"), "{wrong}");
        }
    }
}
