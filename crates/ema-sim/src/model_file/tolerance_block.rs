//! Tolerances in model files: a number, a table, or a list of tables.

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{
    error::ModelFileError,
    reader::{Reader, closest_of, line_of, string},
};
use crate::tolerance::{Level, Spread, UncertainNumber};

/// How far a number scatters at one level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scatter {
    pub(super) spread: Spread,
    pub(super) level: Level,
}

/// A tolerance as a file writes it.
pub(super) struct Line<'a> {
    /// Block and field.
    pub(super) path: &'a str,
    pub(super) scatter: Scatter,
}

const KEYS: [&str; 3] = ["sd", "half-width", "level"];

impl Reader<'_> {
    /// The tolerance of one number at each of its levels.
    ///
    /// `path` is its key below `[tolerance]`; a relative one is below 1.
    pub(super) fn scatters(
        &self,
        path: &str,
        value: &Spanned<DeValue<'_>>,
        is_relative: bool,
    ) -> Result<Vec<Scatter>, ModelFileError> {
        let path = format!("tolerance.{path}");
        match value.get_ref() {
            DeValue::Table(table) => Ok(vec![self.scatter(&path, value, table, is_relative)?]),
            DeValue::Array(list) => self.scatters_of_list(&path, value, list, is_relative),
            _ => {
                let half_width = self.size(&path, value, is_relative)?;
                Ok(vec![Scatter { spread: Spread::HalfWidth(half_width), level: Level::Unit }])
            }
        }
    }

    fn scatters_of_list(
        &self,
        path: &str,
        at: &Spanned<DeValue<'_>>,
        list: &[Spanned<DeValue<'_>>],
        is_relative: bool,
    ) -> Result<Vec<Scatter>, ModelFileError> {
        const EXPECTED: &str = "tables with `sd` or `half-width`, one for each level";
        let mut scatters: Vec<Scatter> = Vec::new();
        for item in list {
            let table = item.get_ref().as_table().ok_or_else(|| {
                let found = format!("a list with {}", item.get_ref().type_str());
                self.wrong(path, EXPECTED, item, found)
            })?;
            let scatter = self.scatter(path, item, table, is_relative)?;
            if scatters.iter().any(|earlier| earlier.level == scatter.level) {
                let found = format!("given twice for level \"{}\"", scatter.level.key());
                return Err(self.wrong(path, "one table for each level", item, found));
            }
            scatters.push(scatter);
        }
        if scatters.is_empty() {
            return Err(self.wrong(path, EXPECTED, at, "an empty list".to_owned()));
        }
        Ok(scatters)
    }

    fn scatter(
        &self,
        path: &str,
        at: &Spanned<DeValue<'_>>,
        table: &DeTable<'_>,
        is_relative: bool,
    ) -> Result<Scatter, ModelFileError> {
        let (mut std, mut half_width, mut level) = (None, None, Level::Unit);
        for (key, value) in table {
            let name = key.get_ref().as_ref();
            let inner = format!("{path}.{name}");
            match name {
                "sd" => std = Some(self.size(&inner, value, is_relative)?),
                "half-width" => half_width = Some(self.size(&inner, value, is_relative)?),
                "level" => level = self.level(&inner, value)?,
                _ => {
                    let line = line_of(self.text, key);
                    let closest = closest_of(name, KEYS.into_iter());
                    return Err(ModelFileError::UnknownKey { line, key: inner, closest });
                }
            }
        }
        let spread = match (std, half_width) {
            (Some(std), None) => Spread::Std(std),
            (None, Some(half_width)) => Spread::HalfWidth(half_width),
            (both, _) => {
                let which = if both.is_some() { "both" } else { "neither" };
                let found = format!("a table with {which} of `sd` and `half-width`");
                return Err(self.wrong(path, "a table with one of them", at, found));
            }
        };
        Ok(Scatter { spread, level })
    }

    fn level(&self, path: &str, value: &Spanned<DeValue<'_>>) -> Result<Level, ModelFileError> {
        let name = string(self.text, path, value)?;
        Level::find(name).ok_or_else(|| {
            let expected = "\"type\", \"unit\", \"session\" or \"recording\"";
            self.wrong(path, expected, value, format!("\"{name}\""))
        })
    }

    fn size(
        &self,
        path: &str,
        value: &Spanned<DeValue<'_>>,
        is_relative: bool,
    ) -> Result<f64, ModelFileError> {
        let size = self.number(path, value)?;
        let (is_good, expected) = if is_relative {
            ((0.0..1.0).contains(&size), "a share of the value, from 0 to 1")
        } else {
            (size >= 0.0 && size.is_finite(), "a finite number from 0")
        };
        if is_good { Ok(size) } else { Err(self.wrong(path, expected, value, size.to_string())) }
    }

    /// A key below `[tolerance]` of an actuator that no number has.
    pub(super) fn unknown_number<T>(&self, path: &str, at: &Spanned<T>) -> ModelFileError {
        let besides = UncertainNumber::BESIDES_PARAMETERS.map(UncertainNumber::key);
        let parameters = crate::Parameter::ALL.iter().map(crate::Parameter::key);
        ModelFileError::UnknownKey {
            line: line_of(self.text, at),
            key: path.to_owned(),
            closest: closest_of(path, parameters.chain(besides)),
        }
    }
}

/// Adds the tables of tolerances: blocks and numbers in the order in which they first appear.
pub(super) fn write(tolerances: &[Line<'_>], lines: &mut Vec<String>) {
    let block = |path: &str| path.split_once('.').map_or("", |(block, _)| block).to_owned();
    let mut written: Vec<&str> = Vec::new();
    let mut blocks: Vec<String> = Vec::new();
    for line in tolerances {
        if blocks.contains(&block(line.path)) {
            continue;
        }
        blocks.push(block(line.path));
        lines.push(format!("\n[tolerance.{}]", block(line.path)));
        for inner in tolerances.iter().filter(|inner| block(inner.path) == block(line.path)) {
            if written.contains(&inner.path) {
                continue;
            }
            written.push(inner.path);
            let alike = tolerances.iter().filter(|other| other.path == inner.path);
            let scatters: Vec<_> = alike.map(|other| other.scatter).collect();
            let key = inner.path.split_once('.').map_or(inner.path, |(_, key)| key);
            lines.push(format!("{key} = {}", value(&scatters)));
        }
    }
}

/// The scatters of one number as a value of TOML.
fn value(scatters: &[Scatter]) -> String {
    match scatters {
        [Scatter { spread: Spread::HalfWidth(half_width), level: Level::Unit }] => {
            format!("{half_width:?}")
        }
        [one] => inline_table(one),
        several => {
            let tables: Vec<_> = several.iter().map(inline_table).collect();
            format!("[{}]", tables.join(", "))
        }
    }
}

fn inline_table(scatter: &Scatter) -> String {
    let spread = match scatter.spread {
        Spread::Std(std) => format!("sd = {std:?}"),
        Spread::HalfWidth(half_width) => format!("half-width = {half_width:?}"),
    };
    format!("{{ {spread}, level = \"{}\" }}", scatter.level.key())
}
