//! The file of settings.

use std::{collections::BTreeMap, fs, ops::Range, path::Path};

use anyhow::{Context, Result, anyhow, bail};
use fdi_core::nearest;
use toml::{
    Spanned,
    de::{DeString, DeTable, DeValue},
};

use super::Setting;
use crate::regular_file::require_file;

/// The settings that a file gives.
#[derive(Debug, Default)]
pub(super) struct SettingsFile {
    name: String,
    /// Values and line by the setting's path.
    entries: BTreeMap<String, (Vec<String>, usize)>,
}

impl SettingsFile {
    /// Reads a file and refuses what is no setting, or no value of one.
    pub(super) fn read(path: &Path, settings: &[Setting]) -> Result<Self> {
        require_file(path)?;
        let name = path.display().to_string();
        let text = fs::read_to_string(path).with_context(|| format!("`{name}` cannot be read"))?;
        let mut file = Self::parse(name, &text, settings)?;
        if let Some(folder) = path.parent() {
            file.move_paths_to(folder, settings);
        }
        Ok(file)
    }

    /// Counts relative paths from a folder.
    fn move_paths_to(&mut self, folder: &Path, settings: &[Setting]) {
        for setting in settings.iter().filter(|setting| setting.is_path()) {
            let Some((values, _)) = self.entries.get_mut(&setting.path()) else { continue };
            for value in values {
                *value = folder.join(&*value).display().to_string();
            }
        }
    }

    pub(super) fn parse(name: String, text: &str, settings: &[Setting]) -> Result<Self> {
        let line_of = |span: Range<usize>| {
            1 + text.bytes().take(span.start).filter(|&byte| byte == b'\n').count()
        };
        let table = DeTable::parse(text).map_err(|error| {
            let line = error.span().map_or(1, line_of);
            anyhow!("`{name}` line {line}: {}", error.message())
        })?;
        let mut entries = BTreeMap::new();
        let mut add =
            |command: Option<&str>, key: &Spanned<DeString<'_>>, value: &Spanned<DeValue<'_>>| {
                let line = line_of(key.span());
                add_entry(&mut entries, settings, (command, key.get_ref()), value.get_ref(), line)
                    .with_context(|| format!("`{name}` line {line}"))
            };
        for (key, value) in table.get_ref() {
            let DeValue::Table(inner) = value.get_ref() else {
                add(None, key, value)?;
                continue;
            };
            check_table(key.get_ref(), settings)
                .with_context(|| format!("`{name}` line {}", line_of(key.span())))?;
            for (inner_key, inner_value) in inner {
                add(Some(key.get_ref()), inner_key, inner_value)?;
            }
        }
        Ok(Self { name, entries })
    }

    /// The values of a setting, where the file has it.
    pub(super) fn values(&self, path: &str) -> Option<&[String]> {
        self.entries.get(path).map(|(values, _)| values.as_slice())
    }

    /// File and line of a setting, where the file has it.
    pub(super) fn origin(&self, path: &str) -> Option<String> {
        let (_, line) = self.entries.get(path)?;
        Some(format!("{} line {line}", self.name))
    }
}

fn check_table(name: &str, settings: &[Setting]) -> Result<()> {
    let mut known: Vec<&str> = settings.iter().filter_map(|one| one.command.as_deref()).collect();
    known.dedup();
    if known.contains(&name) {
        return Ok(());
    }
    bail!("unknown table `[{name}]`{}", hint(name, &known, "tables"))
}

fn add_entry(
    entries: &mut BTreeMap<String, (Vec<String>, usize)>,
    settings: &[Setting],
    (command, key): (Option<&str>, &str),
    value: &DeValue<'_>,
    line: usize,
) -> Result<()> {
    let of_table: Vec<&Setting> =
        settings.iter().filter(|setting| setting.command.as_deref() == command).collect();
    let Some(setting) = of_table.iter().find(|setting| setting.key() == key) else {
        let known: Vec<&str> = of_table.iter().map(|setting| setting.key()).collect();
        bail!("unknown key `{key}`{}", hint(key, &known, "keys"));
    };
    let path = setting.path();
    let values = words(value)
        .with_context(|| format!("`{path}`: expected a text, a number, or a list of them"))?;
    if let Some(reason) = setting.refuses(&values) {
        bail!("`{path}`: {reason}");
    }
    entries.insert(path, (values, line));
    Ok(())
}

/// The nearest of what is known, or all of it.
fn hint(word: &str, known: &[&str], what: &str) -> String {
    if let Some(near) = nearest(word, known.iter().copied()) {
        return format!("; did you mean `{near}`?");
    }
    let all: Vec<_> = known.iter().map(|key| format!("`{key}`")).collect();
    format!("; the {what} are {}", all.join(", "))
}

/// A value as it would stand on the command line.
fn words(value: &DeValue<'_>) -> Option<Vec<String>> {
    let one = |value: &DeValue<'_>| match value {
        DeValue::String(text) => Some(text.clone().into_owned()),
        DeValue::Integer(number) => Some(number.as_str().to_owned()),
        DeValue::Float(number) => Some(number.as_str().to_owned()),
        _ => None,
    };
    match value {
        DeValue::Array(list) => list.iter().map(|value| one(value.get_ref())).collect(),
        other => one(other).map(|word| vec![word]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::settings;

    fn parse(text: &str) -> Result<SettingsFile> {
        SettingsFile::parse("fdi.toml".to_owned(), text, &settings())
    }

    #[test]
    fn values_keep_their_line() {
        let text =
            "jobs = 2\n\n[diagnose]\nnoise-a = 2e-2\nmap = [\"current_a=I\", \"time_s=t\"]\n";
        let file = parse(text).unwrap();
        assert_eq!(file.values("jobs"), Some(&["2".to_owned()][..]));
        assert_eq!(file.values("diagnose.map").map(<[String]>::len), Some(2));
        assert_eq!(file.origin("diagnose.noise-a").as_deref(), Some("fdi.toml line 4"));
        assert_eq!(file.values("evaluate.noise-a"), None);
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        let error = |text: &str| format!("{:#}", parse(text).unwrap_err());
        assert_eq!(
            error("[diagnose]\nnoise = 0.02\n"),
            "`fdi.toml` line 2: unknown key `noise`; did you mean `noise-a`?"
        );
        assert_eq!(
            error("[diagnoze]\nnoise-a = 1\n"),
            "`fdi.toml` line 1: unknown table `[diagnoze]`; did you mean `diagnose`?"
        );
        assert_eq!(
            error("colour-of-the-sky = \"blue\"\n"),
            "`fdi.toml` line 1: unknown key `colour-of-the-sky`; the keys are `output-format`, \
             `seed`, `jobs`, `color`"
        );
        assert_eq!(
            error("seed = 1\n[diagnose]\nnoise-a = -0.1\n"),
            "`fdi.toml` line 3: `diagnose.noise-a`: invalid value '-0.1' for '--noise-a <RMS>': \
             expected a number that is not negative"
        );
        let method = error("[diagnose]\nmethod = \"gess\"\n");
        let start = "`fdi.toml` line 2: `diagnose.method`: invalid value 'gess' for";
        assert!(method.starts_with(start) && method.ends_with("ei, ucb]"), "{method}");
        assert_eq!(
            error("jobs = true\n"),
            "`fdi.toml` line 1: `jobs`: expected a text, a number, or a list of them"
        );
        assert!(error("jobs = [1, 2]\n").contains("cannot be used multiple times"));
        assert!(error("[diagnose]\nreport = \"x.html\"\n").contains("unknown key `report`"));
        assert!(error("jobs = \n").starts_with("`fdi.toml` line 1: "));
    }
}
