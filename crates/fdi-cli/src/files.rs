//! The files of a command: what is read is not written over, and nothing is waited for.
//!
//! One place knows every file that a command reads and every file that it writes, so that no
//! command can forget one.

use std::{
    fs::{self, Metadata},
    path::{Path, PathBuf},
};

use anyhow::{Result, bail};
use fdi_core::{
    Experiment,
    ema_sim::model_file::{PRESETS, base_of},
    list_recordings,
};

use crate::{
    DiagnoseArgs, GlobalArgs,
    answering::STANDARD_INPUT,
    args::{BundleCommand, Command, RecordArgs, ReportArgs, TestArgs, UnitCommand},
    config,
    regular_file::require_file,
    report_file, unit_file,
};

/// Bases of a model that are looked for; more are refused when it is read.
const MOST_BASES: usize = 16;
/// Links that are followed to a file that is not there yet.
const MOST_LINKS: usize = 40;

/// The files that a command reads and writes.
#[derive(Debug, Default)]
pub(crate) struct Files {
    /// Description of each file that is read, and where it is.
    read: Vec<(&'static str, PathBuf)>,
    /// The option that asks for each one, and where it goes.
    products: Vec<(&'static str, PathBuf)>,
}

impl Files {
    /// Files that a command reads and writes.
    pub(crate) fn of(command: &Command, global: &GlobalArgs) -> Self {
        let mut files = Self::of_every_command(global);
        match command {
            Command::Diagnose(args) => files.diagnosis(args),
            Command::Setup(args) => {
                files.test(&args.test);
                files.read("the bundle", args.reading.bundle.clone());
                files.read("a recording", args.recordings.iter().cloned());
            }
            Command::Merge(args) => files.read("a part", args.parts.iter().cloned()),
            Command::Simulate(args) => files.test(&args.test),
            Command::Dataset(args) => files.test(&args.test),
            Command::Bundle(BundleCommand::Build(args)) => {
                files.read("a dataset", args.dataset.iter().cloned());
            }
            Command::Bundle(BundleCommand::Show(args)) => {
                files.read("the bundle", args.file.clone());
                files.product("--figure", args.figure.as_ref());
            }
            Command::Evaluate(args) => files.report(&args.report),
            Command::Calibrate(args) => {
                files.machine(&args.model, &args.records);
                files.read("the bundle", args.bundle.clone());
            }
            Command::Explain(args) => {
                files.machine(&args.model, &args.records);
                files.read("the unit", args.unit.clone());
                files.read("the bundle", args.bundle.clone());
                files.report(&args.report);
            }
            Command::Propose(args) => files.machine(&args.model, &args.records),
            Command::Unit(UnitCommand::Learn(args)) => {
                files.read("the bundle", args.reading.bundle.clone());
                files.read("a recording", args.recordings.iter().cloned());
            }
            Command::Unit(UnitCommand::Update(args)) => {
                files.read("the unit", [args.unit.clone()]);
                files.read("the bundle", args.reading.bundle.clone());
                files.read("a recording", args.recordings.iter().cloned());
            }
            Command::Unit(UnitCommand::Reset(args)) => {
                files.read("the unit", [args.unit.clone()]);
            }
            Command::Unit(UnitCommand::Show(args) | UnitCommand::Model(args)) => {
                files.read("the unit", [args.unit.clone()]);
                files.read("the bundle", args.bundle.clone());
            }
            Command::Inspect(args) if args.file != Path::new("config") => {
                files.read("a recording", [args.file.clone()]);
            }
            Command::Inspect(_)
            | Command::Effects(_)
            | Command::Schema(_)
            | Command::Completions(_)
            | Command::Man => {}
        }
        files
    }

    /// Files that `diagnose` reads and writes.
    pub(crate) fn of_diagnosis(args: &DiagnoseArgs, global: &GlobalArgs) -> Self {
        let mut files = Self::of_every_command(global);
        files.diagnosis(args);
        files
    }

    fn of_every_command(global: &GlobalArgs) -> Self {
        let mut files = Self::default();
        files.product("--output", global.output.as_ref());
        files.read("the file of settings", config::file(global.config.as_deref()));
        files
    }

    fn diagnosis(&mut self, args: &DiagnoseArgs) {
        self.read("the bundle", args.bundle.clone());
        self.read("the reference", args.reference.iter().cloned());
        let units = args.unit.iter().flat_map(|path| unit_file::listed(path).unwrap_or_default());
        self.read("the unit", units.collect::<Vec<_>>());
        self.report(&args.report);
        if let Some(report) = &args.report.report {
            for trends in report_file::trends_beside(report) {
                self.product("--report", Some(&trends));
            }
        }
        self.product("--resume", args.resume.as_ref());
        let list = args.files_from.iter().filter(|path| path.as_os_str() != STANDARD_INPUT);
        self.read("the list of recordings", list.cloned());
        // what a path stands for is looked up only where something could be written over it
        if !self.products.is_empty() {
            let listed = |path: &PathBuf| list_recordings(path).unwrap_or_default();
            self.read("a recording", args.paths.iter().flat_map(listed));
        }
    }

    fn test(&mut self, args: &TestArgs) {
        self.model(&args.model);
        self.command(&args.command);
    }

    fn machine(&mut self, model: &str, records: &RecordArgs) {
        self.model(model);
        if let Some(command) = &records.command {
            self.command(command);
        }
        for recordings in [&records.train, &records.holdout, &records.repeat] {
            self.read("a recording", recordings.iter().cloned());
        }
    }

    fn command(&mut self, command: &str) {
        if Experiment::named(command).is_none() {
            self.read("the command", [command.into()]);
        }
    }

    /// A model with those that it is based on.
    fn model(&mut self, model: &str) {
        let is_preset = |path: &Path| PRESETS.iter().any(|(name, _)| Path::new(name) == path);
        let mut next = Some(PathBuf::from(model)).filter(|path| !is_preset(path));
        for _ in 0..MOST_BASES {
            let Some(path) = next else { return };
            let text = match fs::metadata(&path) {
                Ok(found) if found.is_file() => fs::read_to_string(&path).unwrap_or_default(),
                _ => String::new(),
            };
            let base = base_of(&text).ok().flatten().filter(|base| !is_preset(Path::new(base)));
            next = base.map(|base| path.parent().unwrap_or(Path::new("")).join(base));
            self.read("the model", [path]);
        }
    }

    fn report(&mut self, args: &ReportArgs) {
        self.product("--report", args.report.as_ref());
    }

    fn read(&mut self, what: &'static str, paths: impl IntoIterator<Item = PathBuf>) {
        self.read.extend(paths.into_iter().map(|path| (what, path)));
    }

    fn product(&mut self, option: &'static str, path: Option<&PathBuf>) {
        self.products.extend(path.map(|path| (option, path.clone())));
    }

    /// Refuses products that would take the place of a file that is read, or of one another, or go
    /// where there is no folder, and what is no file where one is read.
    pub(crate) fn check(&self) -> Result<()> {
        for (what, path) in &self.read {
            // each recording has its own error
            if *what != "a recording" {
                require_file(path)?;
            }
        }
        for (option, path) in &self.products {
            // before the work, not after it
            if let Some(folder) = path.parent().filter(|folder| *folder != Path::new(""))
                && !folder.is_dir()
            {
                bail!("`{option} {}`: there is no folder `{}`", path.display(), folder.display());
            }
        }
        let products: Vec<_> =
            self.products.iter().map(|(option, path)| (option, path, Place::of(path))).collect();
        for (index, (option, path, place)) in products.iter().enumerate() {
            let same = |(_, _, before): &&(_, _, Place)| before.is(place);
            if let Some((other, ..)) = products[..index].iter().find(same) {
                bail!("`{other}` and `{option}` both write `{}`", path.display());
            }
        }
        // a product that is not there yet is nothing that is read
        let there: Vec<_> = products.iter().filter(|(.., place)| place.file.is_some()).collect();
        if there.is_empty() {
            return Ok(());
        }
        for (what, path) in &self.read {
            let Some(read) = identity(path) else { continue };
            let is_read = |one: &&&(_, _, Place)| one.2.file.as_ref() == Some(&read);
            if let Some((option, path, _)) = there.iter().find(is_read) {
                bail!("`{option} {}` would write over {what} that is read", path.display());
            }
        }
        Ok(())
    }
}

/// Which file a path is of, whatever its name.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Place {
    /// Where it is, or will be.
    real: PathBuf,
    /// The file that is there.
    file: Option<Identity>,
}

impl Place {
    fn of(path: &Path) -> Self {
        Self { real: real(path), file: identity(path) }
    }

    fn is(&self, other: &Self) -> bool {
        self.real == other.real || self.file.is_some() && self.file == other.file
    }
}

/// The path without links, also of a file that is not there yet.
fn real(path: &Path) -> PathBuf {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        if let Ok(real) = fs::canonicalize(&path) {
            return real;
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let Ok(target) = fs::read_link(&path) else { break };
        path = folder.join(target);
    }
    let Some(name) = path.file_name() else { return path };
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    fs::canonicalize(folder).map_or_else(|_| path.clone(), |folder| folder.join(name))
}

/// Key by which a file is known: hard links have one in common.
#[cfg(unix)]
type Identity = (u64, u64);
/// Key by which a file is known.
#[cfg(not(unix))]
type Identity = PathBuf;

/// The identity of a regular file.
#[cfg(unix)]
fn identity(path: &Path) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt;

    let found = fs::metadata(path).ok().filter(Metadata::is_file)?;
    Some((found.dev(), found.ino()))
}

/// The identity of a regular file.
#[cfg(not(unix))]
fn identity(path: &Path) -> Option<Identity> {
    fs::metadata(path).ok().filter(Metadata::is_file)?;
    fs::canonicalize(path).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_not_there_yet_has_one_place() {
        let folder = tempfile::tempdir().unwrap();
        let new = folder.path().join("new.json");
        let around = folder.path().join(".").join("new.json");
        assert!(Place::of(&new).is(&Place::of(&around)));
        assert!(!Place::of(&new).is(&Place::of(&folder.path().join("other.json"))));
        // in this folder, whatever it is
        assert_eq!(real(Path::new("not-there.json")), real(Path::new("./not-there.json")));
        assert!(real(Path::new("not-there.json")).is_absolute());
    }

    #[test]
    fn folders_and_files_are_not_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        assert!(require_file(folder.path()).is_ok());
        assert!(require_file(&folder.path().join("none")).is_ok());
        assert!(require_file(Path::new("/dev/null")).is_ok());
    }
}
