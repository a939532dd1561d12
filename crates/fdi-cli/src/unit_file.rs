//! Files of learnt units.

use std::{
    ffi::OsStr,
    fs::{self, File, TryLockError},
    io::{Read, Write},
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, Result, bail};
use fdi_core::{Diagnoser, LearntUnit, Recording};

use crate::streams::{Worth, in_place_of};

/// Ending of the files of units that a folder is searched for.
const ENDING: &str = "fdi-unit";

/// Reads the file of a unit.
pub(crate) fn read(path: &Path) -> Result<LearntUnit> {
    let named = || path.display().to_string();
    let bytes = fs::read(path).with_context(named)?;
    LearntUnit::from_bytes(&bytes).with_context(named)
}

/// Folders within folders that are looked into.
const MOST_FOLDERS_DEEP: usize = 8;

/// The files of units at a path: the file itself, or those of a folder and the folders in it.
pub(crate) fn listed(path: &Path) -> Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let mut files = Vec::new();
    add_folder(path, MOST_FOLDERS_DEEP, &mut files)?;
    files.sort();
    if files.is_empty() {
        bail!("{}: no file `*.{ENDING}` in this folder", path.display());
    }
    Ok(files)
}

fn add_folder(folder: &Path, deep: usize, files: &mut Vec<PathBuf>) -> Result<()> {
    let named = || folder.display().to_string();
    for entry in fs::read_dir(folder).with_context(named)? {
        let entry = entry.with_context(named)?;
        // a link to a folder may lead back to where it stands
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) && deep > 0 {
            add_folder(&entry.path(), deep - 1, files)?;
        } else if entry.path().extension() == Some(OsStr::new(ENDING)) {
            files.push(entry.path());
        }
    }
    Ok(())
}

/// Units to diagnose recordings with.
#[derive(Debug, Default)]
pub(crate) struct Units {
    /// Units with the files that they are from.
    units: Vec<(PathBuf, Arc<LearntUnit>)>,
    /// True where one file was named: it is of every recording that states no other actuator.
    is_named: bool,
}

impl Units {
    /// Units at a path; none without one.
    pub(crate) fn of(path: Option<&Path>) -> Result<Self> {
        let Some(path) = path else { return Ok(Self::default()) };
        let files = listed(path)?;
        let mut units: Vec<(PathBuf, Arc<LearntUnit>)> = Vec::new();
        for file in files {
            let unit = read(&file)?;
            let same = |(_, known): &&(PathBuf, Arc<LearntUnit>)| {
                known.actuator_id().is_some()
                    && known.actuator_id() == unit.actuator_id()
                    && known.is_of_test_of(&unit)
            };
            if let Some((other, known)) = units.iter().find(same) {
                let id = known.actuator_id().unwrap_or_default();
                bail!("{} and {} are both of actuator `{id}`", other.display(), file.display());
            }
            units.push((file, Arc::new(unit)));
        }
        Ok(Self { units, is_named: !path.is_dir() })
    }

    /// The unit of a recording that a diagnoser is for; `None` where there is none.
    pub(crate) fn unit_of(
        &self,
        recording: &Recording,
        diagnoser: &Diagnoser,
    ) -> Result<Option<&Arc<LearntUnit>>> {
        let id = recording.metadata.actuator_id.as_deref();
        if let (true, [(file, unit)]) = (self.is_named, &self.units[..]) {
            if let (Some(found), Some(expected)) = (id, unit.actuator_id())
                && found != expected
            {
                let file = file.display();
                bail!("the recording is of actuator `{found}`, `{file}` of `{expected}`");
            }
            return Ok(Some(unit));
        }
        let is_own = |unit: &&Arc<LearntUnit>| id.is_some() && unit.actuator_id() == id;
        let own = || self.units.iter().map(|(_, unit)| unit).filter(is_own);
        let command = &diagnoser.bundle().experiment.name;
        // one of the same command that was learnt with another bundle is refused, not passed over
        let of_command = || own().find(|unit| unit.command() == command);
        Ok(own().find(|unit| diagnoser.knows_unit(unit)).or_else(of_command))
    }
}

/// The file of a unit, held against other writers until it is written or dropped.
pub(crate) struct HeldUnit {
    path: PathBuf,
    /// Open while it is held.
    _lock: File,
    bytes: Vec<u8>,
    pub(crate) unit: LearntUnit,
}

impl HeldUnit {
    /// Reads the file of a unit and keeps others from writing it.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let named = || path.display().to_string();
        let mut file = File::open(path).with_context(named)?;
        // a file system without locks holds nobody back
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            bail!("{}: another program is writing it; run this again", named());
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).with_context(named)?;
        let unit = LearntUnit::from_bytes(&bytes).with_context(named)?;
        Ok(Self { path: path.to_owned(), _lock: file, bytes, unit })
    }

    /// Writes a unit in the place of the one that was read.
    pub(crate) fn write(self, unit: &LearntUnit) -> Result<()> {
        let named = || format!("`{}` cannot be written", self.path.display());
        if fs::read(&self.path).ok().as_ref() != Some(&self.bytes) {
            bail!("{}: another program has written it meanwhile; run this again", named());
        }
        let write = |out: &mut dyn Write| out.write_all(&unit.to_bytes()).map(|()| Worth::Keeping);
        in_place_of(&self.path, write).with_context(named)?;
        Ok(())
    }
}
