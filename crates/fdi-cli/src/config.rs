//! Settings: flag over environment over file over default, each with its origin.
//!
//! A setting is an option of the command line that takes a value. The file and the environment
//! give it a default, so that the parser of the command line checks and ranks them all.

mod file;

use std::{
    any::TypeId,
    collections::BTreeSet,
    ffi::OsString,
    fmt::Write,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, anyhow, bail};
use clap::{
    Arg, ArgMatches, ColorChoice, Command, CommandFactory, FromArgMatches, ValueEnum,
    builder::Resettable,
    error::{ContextKind, ContextValue, ErrorKind},
    parser::ValueSource,
};
use fdi_core::nearest;

use crate::{Cli, GlobalArgs, args::Color, setting::ResolvedSetting};
use file::SettingsFile;

/// The file that is read when none is named.
const HERE: &str = "fdi.toml";

/// Options that say what one run reads or writes, and are therefore no settings.
const OF_ONE_RUN: [&str; 16] = [
    "output", "report", "figures", "figure", "resume", "shard", "dataset", "faults", "train",
    "holdout", "repeat", "where", "config", "help", "version", "replaced",
];

/// Why the command line cannot be acted on.
#[derive(Debug)]
pub enum LoadError {
    /// The command line is wrong, or asks for help.
    Usage(clap::Error),
    /// The file of settings or the environment cannot be used.
    Settings(anyhow::Error),
}

/// An option that a file and the environment may give.
#[derive(Debug)]
struct Setting {
    /// The command that it is of; none for those of all commands.
    command: Option<String>,
    arg: Arg,
}

impl Setting {
    /// The name in the file, without the table.
    fn key(&self) -> &str {
        self.arg.get_long().expect("settings have long names")
    }

    /// The name with its table.
    fn path(&self) -> String {
        match &self.command {
            Some(command) => format!("{command}.{}", self.key()),
            None => self.key().to_owned(),
        }
    }

    fn variable(&self) -> String {
        format!("FDI_{}", self.path()).replace(['-', '.'], "_").to_uppercase()
    }

    /// True where its values are files or folders.
    fn is_path(&self) -> bool {
        self.arg.get_value_parser().type_id() == TypeId::of::<PathBuf>()
    }

    /// Why these values are none for it.
    fn refuses(&self, values: &[String]) -> Option<String> {
        // what it needs and excludes is for the whole command line to check
        let arg = self
            .arg
            .clone()
            .global(false)
            .requires(Resettable::Reset)
            .conflicts_with(Resettable::Reset)
            .env(Resettable::Reset);
        let probe = Command::new("fdi").no_binary_name(true).arg(arg);
        let words = values.iter().map(|value| format!("--{}={value}", self.key()));
        let error = probe.try_get_matches_from(words).err()?.to_string();
        let mut lines = error.lines().map(str::trim);
        let first = lines.next().unwrap_or_default().trim_start_matches("error: ").to_owned();
        let possible = lines.find(|line| line.starts_with("[possible values"));
        Some(possible.map_or(first.clone(), |possible| format!("{first} {possible}")))
    }
}

/// All settings, in the order of the commands.
fn settings() -> Vec<Setting> {
    let root = Cli::command();
    let of = |command: Option<&Command>| {
        let name = command.map(|command| command.get_name().to_owned());
        let args = command.unwrap_or(&root).get_arguments();
        let takes = |arg: &&Arg| arg.get_action().takes_values() && !arg.is_positional();
        let kept = |arg: &&Arg| arg.get_long().is_some_and(|long| !OF_ONE_RUN.contains(&long));
        let made = args.filter(takes).filter(kept).cloned();
        made.map(|arg| Setting { command: name.clone(), arg }).collect::<Vec<_>>()
    };
    let own = root.get_subcommands().flat_map(|command| of(Some(command)));
    of(None).into_iter().chain(own).collect()
}

/// Parses the command line, with the environment and the file behind it.
///
/// # Errors
/// [`LoadError::Usage`] for a command line that is wrong or asks for help,
/// [`LoadError::Settings`] for a file of settings that cannot be read or holds something unknown,
/// and for variables `FDI_…` that are unknown or hold what the option cannot be.
pub fn load(words: impl IntoIterator<Item = OsString>) -> Result<Cli, LoadError> {
    let words: Vec<OsString> = words.into_iter().collect();
    let settings = settings();
    let beside = beside_recordings(&words);
    let file = match &beside {
        Some(path) => read_file(Some(path), &settings),
        None => named_file(&words, &settings),
    };
    let file = file.map_err(LoadError::Settings)?;
    let command = with_negative_numbers(Cli::command());
    let command = with_defaults(command, &settings, &file).color(color(&words, &file));
    let parsed = command.try_get_matches_from(words.iter().cloned());
    let matches = parsed.map_err(|error| match blamed_variable(&error, &words, &settings) {
        Some(reason) => LoadError::Settings(anyhow!("{reason}")),
        None => LoadError::Usage(error),
    })?;
    if let Some(reason) = unknown_variable(&settings) {
        return Err(LoadError::Settings(anyhow!("{reason}")));
    }
    let mut cli = Cli::from_arg_matches(&matches).map_err(LoadError::Usage)?;
    cli.global.settings = resolved(&matches, &settings, &file);
    if beside.is_some() {
        (cli.global.config, cli.global.is_config_found) = (beside, true);
    }
    Ok(cli)
}

/// A tree of commands in which `-1` is a number, which an option may refuse by its bounds.
fn with_negative_numbers(command: Command) -> Command {
    command.allow_negative_numbers(true).mut_subcommands(with_negative_numbers)
}

/// The first value that the command line gives to an option, before anything is parsed.
fn value_of(words: &[OsString], option: &str) -> Option<OsString> {
    let mut words = words.iter().take_while(|word| *word != "--");
    while let Some(word) = words.next() {
        if word == option {
            return words.next().cloned();
        }
        let rest = word.to_str().and_then(|word| word.strip_prefix(option));
        if let Some(value) = rest.and_then(|rest| rest.strip_prefix('=')) {
            return Some(value.into());
        }
    }
    None
}

/// Colouring of help and of errors of usage: they are told before `--color` is parsed.
fn color(words: &[OsString], file: &SettingsFile) -> ColorChoice {
    let given = value_of(words, "--color").or_else(|| std::env::var_os("FDI_COLOR"));
    let of_file = || file.values("color").and_then(|values| values.first()).map(OsString::from);
    match given.or_else(of_file).and_then(|value| Color::from_str(value.to_str()?, true).ok()) {
        Some(Color::Never) => ColorChoice::Never,
        Some(Color::Always) => ColorChoice::Always,
        Some(Color::Auto) | None => ColorChoice::Auto,
    }
}

/// The variable that a value is from which the command line is blamed for.
#[expect(clippy::disallowed_methods, reason = "the command line is where the environment is read")]
fn blamed_variable(
    error: &clap::Error,
    words: &[OsString],
    settings: &[Setting],
) -> Option<String> {
    if !matches!(error.kind(), ErrorKind::InvalidValue | ErrorKind::ValueValidation) {
        return None;
    }
    let (Some(ContextValue::String(arg)), Some(ContextValue::String(value))) =
        (error.get(ContextKind::InvalidArg), error.get(ContextKind::InvalidValue))
    else {
        return None;
    };
    let option = arg.split_whitespace().next()?;
    let given = |variable: &str| std::env::var(variable).is_ok_and(|found| found == *value);
    let of = |setting: &&Setting| format!("--{}", setting.key()) == option;
    let setting = settings.iter().filter(of).find(|setting| given(&setting.variable()))?;
    if value_of(words, option).is_some() {
        return None;
    }
    Some(format!("`{}`: {}", setting.variable(), setting.refuses(std::slice::from_ref(value))?))
}

/// Variables that are of the tests, or are read apart.
const OTHER_VARIABLES: [&str; 3] = ["FDI_CONFIG", "FDI_FUZZ_SECONDS", "FDI_MEASURED_DATA"];

/// A variable that looks like a setting and is none.
fn unknown_variable(settings: &[Setting]) -> Option<String> {
    let known: Vec<String> = settings.iter().map(Setting::variable).collect();
    let known = || known.iter().map(String::as_str).chain(OTHER_VARIABLES);
    let mut found: Vec<String> = std::env::vars_os()
        .filter_map(|(name, _)| name.into_string().ok())
        .filter(|name| name.starts_with("FDI_") && known().all(|known| known != name))
        .collect();
    found.sort_unstable();
    let name = found.first()?;
    let hint = match nearest(name, known()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => "`docs/config.md` lists them".to_owned(),
    };
    Some(format!("`{name}` in the environment is no setting; {hint}"))
}

/// The file of settings in the folder of the first recording that is to be diagnosed, where none is named
/// and none lies here.
fn beside_recordings(words: &[OsString]) -> Option<PathBuf> {
    let is_named =
        value_of(words, "--config").is_some() || std::env::var_os("FDI_CONFIG").is_some();
    if is_named || Path::new(HERE).is_file() {
        return None;
    }
    let matches = with_negative_numbers(Cli::command()).try_get_matches_from(words).ok()?;
    let ("diagnose", own) = matches.subcommand()? else { return None };
    let first: &PathBuf = own.get_many("paths")?.next()?;
    let folder = if first.is_dir() { first } else { first.parent()? };
    Some(folder.join(HERE)).filter(|path| path.is_file())
}

/// Refuses recordings of folders that have files of settings of their own, where another file, or none, was
/// read for want of one that is named or lies here.
pub(crate) fn check_beside<'a>(
    recordings: impl Iterator<Item = &'a Path>,
    global: &GlobalArgs,
) -> Result<()> {
    if global.config.is_some() && !global.is_config_found {
        return Ok(());
    }
    // settings here are for what is below, too
    let here = if Path::new(HERE).is_file() { Path::new(".").canonicalize().ok() } else { None };
    let is_below = |path: &PathBuf| {
        here.as_ref()
            .is_some_and(|here| path.canonicalize().is_ok_and(|path| path.starts_with(here)))
    };
    let folders: BTreeSet<&Path> = recordings.filter_map(Path::parent).collect();
    let mut files = folders.into_iter().map(|folder| folder.join(HERE));
    let is_other = |path: &PathBuf| path.is_file() && global.config.as_ref() != Some(path);
    let Some(own) = files.find(|path| is_other(path) && !is_below(path)) else { return Ok(()) };
    let used = match (&global.config, here) {
        (Some(used), _) => format!("those of `{}` were to be used for all", used.display()),
        (None, Some(_)) => format!("those of `{HERE}` were to be used for all"),
        (None, None) => "they would not be used".to_owned(),
    };
    bail!(
        "`{}`: recordings of this folder have settings of their own, and {used}: diagnose the folders \
         one by one, or give settings for all with `--config FILE`",
        own.display()
    )
}

/// The settings of the file that the command line names, or the environment, or that lies here.
fn named_file(words: &[OsString], settings: &[Setting]) -> Result<SettingsFile> {
    if let Some(path) = value_of(words, "--config") {
        return read_file(Some(path.as_ref()), settings);
    }
    let Some(path) = std::env::var_os("FDI_CONFIG") else { return read_file(None, settings) };
    if path.is_empty() {
        bail!("`FDI_CONFIG` is empty; expected a file");
    }
    read_file(Some(path.as_ref()), settings).context("`FDI_CONFIG`")
}

/// The file that the settings are from: the one that is named, else the one that lies here.
pub(crate) fn file(named: Option<&Path>) -> Option<PathBuf> {
    let here = || Some(PathBuf::from(HERE)).filter(|path| path.is_file());
    named.map(Path::to_owned).or_else(here)
}

/// Reads and checks the file; an empty one where there is none.
fn read_file(named: Option<&Path>, settings: &[Setting]) -> Result<SettingsFile> {
    file(named)
        .map_or_else(|| Ok(SettingsFile::default()), |path| SettingsFile::read(&path, settings))
}

/// The command line with the values of environment and file as defaults.
fn with_defaults(mut command: Command, settings: &[Setting], file: &SettingsFile) -> Command {
    for setting in settings {
        let id = setting.arg.get_id().as_str().to_owned();
        let values = file.values(&setting.path()).map(<[String]>::to_vec);
        let change = |arg: Arg| {
            let arg = arg.env(setting.variable()).hide_env(true);
            match values {
                Some(values) => arg.default_values(values),
                None => arg,
            }
        };
        command = match &setting.command {
            None => command.mut_arg(id, change),
            Some(name) => command.mut_subcommand(name, |inner| inner.mut_arg(id, change)),
        };
    }
    command
}

/// The settings of the command that is run, as it sees them.
fn resolved(
    matches: &ArgMatches,
    settings: &[Setting],
    file: &SettingsFile,
) -> Vec<ResolvedSetting> {
    let mut leaf = matches;
    let command = matches.subcommand().map(|(name, _)| name);
    while let Some((_, inner)) = leaf.subcommand() {
        leaf = inner;
    }
    let concerns =
        |setting: &&Setting| setting.command.is_none() || setting.command.as_deref() == command;
    let resolve = |setting: &Setting| {
        let id = setting.arg.get_id().as_str();
        // a setting of `bundle` is none of `bundle show`
        let known = leaf.try_contains_id(id).is_ok();
        let raw = if known { leaf.get_raw(id) } else { None };
        let words = raw.map(|values| values.map(|v| v.to_string_lossy()).collect::<Vec<_>>());
        let origin = match known.then(|| leaf.value_source(id)).flatten() {
            Some(ValueSource::CommandLine) => Some("flag".to_owned()),
            Some(ValueSource::EnvVariable) => Some(setting.variable()),
            _ => file.origin(&setting.path()),
        };
        ResolvedSetting { path: setting.path(), value: words.map(|w| w.join(", ")), origin }
    };
    settings.iter().filter(concerns).map(resolve).collect()
}

/// Every setting of every command: those of this run as it sees them, the others as a run of
/// theirs without flags would.
#[expect(clippy::disallowed_methods, reason = "the command line is where the environment is read")]
pub(crate) fn every_setting(global: &GlobalArgs) -> Result<Vec<ResolvedSetting>> {
    let settings = settings();
    let file = read_file(global.config.as_deref(), &settings)?;
    let mut all = Vec::with_capacity(settings.len());
    for setting in &settings {
        let path = setting.path();
        if let Some(known) = global.settings.iter().find(|known| known.path == path) {
            all.push(known.clone());
            continue;
        }
        let variable = setting.variable();
        let (value, origin) = if let Ok(value) = std::env::var(&variable) {
            if let Some(reason) = setting.refuses(std::slice::from_ref(&value)) {
                bail!("`{variable}`: {reason}");
            }
            (Some(value), Some(variable))
        } else if let Some(values) = file.values(&path) {
            (Some(values.join(", ")), file.origin(&path))
        } else {
            (default_of(&setting.arg), None)
        };
        all.push(ResolvedSetting { path, value, origin });
    }
    Ok(all)
}

fn default_of(arg: &Arg) -> Option<String> {
    let defaults = arg.get_default_values();
    let words: Vec<_> = defaults.iter().map(|value| value.to_string_lossy()).collect();
    (!words.is_empty()).then(|| words.join(", "))
}

/// `docs/config.md`: every setting, from the tree that parses the command line.
pub fn config_reference() -> String {
    let mut page = String::from(PREFACE);
    let mut table = None;
    for setting in settings() {
        if table.as_ref() != Some(&setting.command) {
            let heading = match &setting.command {
                None => "At the top of the file: for every command".to_owned(),
                Some(command) => format!("`[{command}]`"),
            };
            write!(
                page,
                "\n## {heading}\n\n| key | environment | default | what |\n\
                 | --- | --- | --- | --- |\n"
            )
            .expect("a String takes all text");
            table = Some(setting.command.clone());
        }
        let default = default_of(&setting.arg).filter(|text| !text.is_empty());
        let default = default.map_or_else(|| "-".to_owned(), |text| format!("`{text}`"));
        let possible = setting.arg.get_possible_values();
        let names: Vec<_> =
            possible.iter().map(|value| format!("`{}`", value.get_name())).collect();
        let among =
            if names.is_empty() { String::new() } else { format!(": {}", names.join(", ")) };
        let help = setting.arg.get_help().map(ToString::to_string).unwrap_or_default();
        let (help, key) = (help.replace('|', "\\|"), setting.key());
        let variable = setting.variable();
        writeln!(page, "| `{key}` | `{variable}` | {default} | {help}{among} |")
            .expect("a String takes all text");
    }
    page
}

const PREFACE: &str = "# Settings

Generated by `cargo xtask docs` from the command line itself; edits are lost.

Every option below can stand in a file, in the environment or on the command line. A flag goes before the
environment, that before the file, that before the default. The file is `fdi.toml` in the folder in which `fdi` runs, or the
one that `--config FILE` or `FDI_CONFIG` names. It is TOML: a key has the name of its option, and the unit with it; a key that
is not known is refused, and so is a variable `FDI_…`; the nearest one is named. Values are checked before anything runs. Paths count from the
folder of the file. `fdi diagnose` without any of these takes the `fdi.toml` in the folder of the first recording, as `fdi setup` writes it. `fdi inspect config` shows every setting with where it is from.

```toml
jobs = 4

[diagnose]
noise-a = 0.02                            # A rms on each phase per sample
map = [\"time_s=t_ms*0.001\", \"current_a=I\"]
id-from = \"{id}_*\"
date-from = \"*_{date}\"
```

What one run reads or writes (`--output`, `--report`, `--figures`, `--resume`, `--shard`, `--faults` and the like) is given
with the command and is no setting.
";
