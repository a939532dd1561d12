//! Names of files that say the actuator and the date.

use std::{fmt, path::Path, str::FromStr};

use crate::{FileFormat, RecordingDate};

/// A pattern for names of files: `{id}` and `{date}` stand for what is looked for, `*` for any
/// text, everything else for itself. With `/`, folders above the file are compared as well.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamePattern {
    parts: Vec<Part>,
    /// Folders above the file that it speaks of.
    folders: usize,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Part {
    Text(String),
    Any,
    Id,
    Date,
}

impl fmt::Display for NamePattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.parts.iter().try_for_each(|part| {
            f.write_str(match part {
                Part::Text(text) => text,
                Part::Any => "*",
                Part::Id => "{id}",
                Part::Date => "{date}",
            })
        })
    }
}

/// Actuator and date that a name says.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NamedRecording {
    /// The actuator.
    pub id: Option<String>,
    /// The date.
    pub date: Option<RecordingDate>,
    /// Text that stands where a date should and looks like one, and is no day of the calendar.
    pub no_day: Option<String>,
}

impl FromStr for NamePattern {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut parts = Vec::new();
        let mut rest = text;
        while let Some(first) = rest.chars().next() {
            let (part, length) = match first {
                '*' => (Part::Any, 1),
                '{' => placeholder(rest)?,
                _ => {
                    let length = rest.find(['*', '{']).unwrap_or(rest.len());
                    (Part::Text(rest[..length].to_owned()), length)
                }
            };
            let open = |part: &Part| !matches!(part, Part::Text(_));
            if open(&part) && parts.last().is_some_and(open) {
                return Err("two places without text between them cannot be told apart".to_owned());
            }
            parts.push(part);
            rest = &rest[length..];
        }
        let sought: Vec<&Part> =
            parts.iter().filter(|part| matches!(part, Part::Id | Part::Date)).collect();
        match sought.as_slice() {
            [] => Err("no place to read from: expected `{id}` or `{date}` in it".to_owned()),
            [_] => Ok(()),
            [one, other] if one != other => Ok(()),
            _ => Err("`{id}` and `{date}` may stand in it once each".to_owned()),
        }?;
        Ok(Self { parts, folders: text.matches('/').count() })
    }
}

/// The placeholder that the text begins with, and its length.
fn placeholder(text: &str) -> Result<(Part, usize), String> {
    for (name, part) in [("{id}", Part::Id), ("{date}", Part::Date)] {
        if text.starts_with(name) {
            return Ok((part, name.len()));
        }
    }
    let found: String = text.chars().take(12).collect();
    Err(format!("`{found}` is no place: they are `{{id}}` and `{{date}}`"))
}

impl NamePattern {
    /// Reads the facts in the name of a file; nothing where the pattern does not fit it.
    pub fn read(&self, path: &Path) -> NamedRecording {
        let text = path.to_string_lossy().replace('\\', "/");
        let from = text.rmatch_indices('/').nth(self.folders).map_or(0, |(at, _)| at + 1);
        let name = &text[from..];
        // a pattern may leave out how the names of recordings end, in whatever case
        let lower = name.to_ascii_lowercase();
        let endings = FileFormat::ALL.map(FileFormat::extension).into_iter().chain([".gz"]);
        let ends = endings.filter(|ending| lower.ends_with(ending));
        let shorter = ends.map(|ending| &name[..name.len() - ending.len()]);
        let names: Vec<&str> = std::iter::once(name).chain(shorter).collect();
        let with = |date: fn(&str) -> Option<Day>| {
            names.iter().find_map(|name| fit(&self.parts, name, date))
        };
        with(day_of).or_else(|| with(looks_like_a_day)).unwrap_or_default()
    }
}

/// The values with which the parts make up the name; the earliest places are the shortest.
fn fit(parts: &[Part], name: &str, day: fn(&str) -> Option<Day>) -> Option<NamedRecording> {
    let Some((part, rest)) = parts.split_first() else {
        return name.is_empty().then(NamedRecording::default);
    };
    if let Part::Text(text) = part {
        return fit(rest, name.strip_prefix(text.as_str())?, day);
    }
    let ends = name.char_indices().map(|(at, _)| at).chain([name.len()]);
    for end in ends {
        let (value, after) = name.split_at(end);
        if value.contains('/') {
            return None;
        }
        let found = if *part == Part::Date { day(value) } else { None };
        let possible = match part {
            Part::Id => !value.is_empty(),
            Part::Date => found.is_some(),
            _ => true,
        };
        if !possible {
            continue;
        }
        if let Some(mut named) = fit(rest, after, day) {
            if *part == Part::Id {
                named.id = Some(value.to_owned());
            }
            match found {
                Some(Day::Real(date)) => named.date = Some(date),
                Some(Day::None(text)) => named.no_day = Some(text),
                None => {}
            }
            return Some(named);
        }
    }
    None
}

/// Text that stands where a date should.
enum Day {
    Real(RecordingDate),
    /// Digits of a date that is no day of the calendar.
    None(String),
}

fn day_of(text: &str) -> Option<Day> {
    date(text).map(Day::Real)
}

/// `2026-02-30`, `20261301`: only after nothing else has fitted.
fn looks_like_a_day(text: &str) -> Option<Day> {
    let digits = text.chars().filter(char::is_ascii_digit).count();
    let begins = text.starts_with(|first: char| first.is_ascii_digit());
    let alone = begins && text.chars().all(|c| c.is_ascii_digit() || "-_T:Z".contains(c));
    (alone && matches!(digits, 8 | 14)).then(|| Day::None(text.to_owned()))
}

/// A date as file names have it: `2026-11-21`, `20261121`, with a time as `T09:30:00`,
/// `T093000`, `_09-30-00` or `_093000`.
fn date(text: &str) -> Option<RecordingDate> {
    if let Some(date) = RecordingDate::parse(text) {
        return Some(date);
    }
    let digits: String = text.chars().filter(char::is_ascii_digit).collect();
    let others_separate = text.chars().all(|c| c.is_ascii_digit() || "-_T:Z".contains(c));
    if !others_separate {
        return None;
    }
    let zone = if text.ends_with('Z') { "Z" } else { "" };
    let day = |d: &str| format!("{}-{}-{}", &d[..4], &d[4..6], &d[6..8]);
    let iso = match digits.len() {
        8 => day(&digits),
        14 => {
            let time = format!("{}:{}:{}", &digits[8..10], &digits[10..12], &digits[12..]);
            format!("{}T{time}{zone}", day(&digits))
        }
        _ => return None,
    };
    RecordingDate::parse(&iso)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(pattern: &str, path: &str) -> (Option<String>, Option<String>) {
        let named = pattern.parse::<NamePattern>().unwrap().read(Path::new(path));
        (named.id, named.date.map(|date| date.to_string()))
    }

    #[test]
    fn names_are_read() {
        let both = |id: &str, date: &str| (Some(id.to_owned()), Some(date.to_owned()));
        assert_eq!(read("{id}_{date}", "bench/A-7_2026-11-21.csv.gz"), both("A-7", "2026-11-21"));
        for ending in ["parquet", "mat", "mf4", "tdms", "csv", "csv.gz", "MF4", "Csv.Gz"] {
            let name = format!("A-7_2026-11-21.{ending}");
            assert_eq!(read("{id}_{date}", &name), both("A-7", "2026-11-21"), "{ending}");
        }
        assert_eq!(read("{id}_{date}", "A-7_2026-11-21.doc"), (None, None));
        assert_eq!(read("{id}_{date}.csv", "A_7_20261121.csv"), both("A_7", "2026-11-21"));
        assert_eq!(
            read("{id}_{date}_*", "x_2026-11-21_09-30-00_run.csv"),
            both("x", "2026-11-21"),
            "the shortest that is a date"
        );
        assert_eq!(
            read("{id}/run{date}.csv", "a/B7/run20261121T093000Z.csv"),
            both("B7", "2026-11-21T09:30:00Z")
        );
        assert_eq!(read("*-{id}-*", "left-42-x.csv"), (Some("42".to_owned()), None));
        assert_eq!(read("{id}_{date}", "A-7.csv"), (None, None));
        assert_eq!(read("{id}_{date}", "A-7_2026-13-21.csv"), (Some("A-7".to_owned()), None));
        assert_eq!(read("{id}.csv", "folder/.csv"), (None, None));
        let no_day =
            |name: &str| "{id}_{date}".parse::<NamePattern>().unwrap().read(Path::new(name)).no_day;
        assert_eq!(no_day("A-7_2026-02-30.csv").as_deref(), Some("2026-02-30"));
        assert_eq!(no_day("A-7_20260431.csv").as_deref(), Some("20260431"));
        assert_eq!(no_day("A-7_2026-02-28.csv"), None);
        assert_eq!(no_day("A-7_new.csv"), None);
    }

    #[test]
    fn patterns_that_say_nothing_are_refused() {
        let error = |text: &str| text.parse::<NamePattern>().unwrap_err();
        assert_eq!(error("*.csv"), "no place to read from: expected `{id}` or `{date}` in it");
        assert_eq!(error("{serial}"), "`{serial}` is no place: they are `{id}` and `{date}`");
        assert_eq!(error("{id}_{id}"), "`{id}` and `{date}` may stand in it once each");
        let apart = "two places without text between them cannot be told apart";
        assert_eq!(error("{id}{date}"), apart);
    }
}
