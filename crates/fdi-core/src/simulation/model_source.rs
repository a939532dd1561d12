//! Where a model comes from: a preset by its name, or a file on disk.

use std::{
    fs,
    path::{Path, PathBuf},
};

use ema_sim::model_file::{self, MachineModel, Model, ModelFileError, PRESETS};

/// Most files that may stand one on another as `base`.
const MOST_BASES: usize = 8;

/// Why a model could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadModelError {
    /// Not a preset, and the file cannot be read.
    #[error(
        "{}: neither a preset ({}) nor a model file: {reason}",
        path.display(),
        PRESETS.map(|(name, _)| format!("`{name}`")).join(", ")
    )]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Message of the operating system.
        reason: String,
    },
    /// The text is not a model.
    #[error("{}: {reason}", path.display())]
    Text {
        /// The file.
        path: PathBuf,
        /// Line and key.
        reason: ModelFileError,
    },
    /// A servo axis where only an actuator will do.
    #[error("{}: a servo axis, where an actuator is expected", path.display())]
    ServoAxis {
        /// The file.
        path: PathBuf,
    },
    /// Files stand on one another without end.
    #[error("{}: `base` leads through more than {most} files", path.display())]
    TooManyBases {
        /// The file where it was given up.
        path: PathBuf,
        /// Most files.
        most: usize,
    },
}

/// Reads a model of an actuator: the preset of that name, or the file. The `base` of a file is a
/// preset or another file, beside it unless its path is absolute.
///
/// The model always has a name: its own, or else that of preset or file.
///
/// # Errors
///
/// [`ReadModelError`], which names the file.
pub fn read_model(source: &str) -> Result<Model, ReadModelError> {
    match read_machine(source)? {
        MachineModel::Actuator(model) => Ok(model),
        MachineModel::ServoAxis(_) => Err(ReadModelError::ServoAxis { path: source.into() }),
    }
}

/// Reads a model of either kind, as [`read_model`] does.
///
/// # Errors
///
/// [`ReadModelError`], which names the file.
pub fn read_machine(source: &str) -> Result<MachineModel, ReadModelError> {
    let mut model = read(Path::new(source), 0)?;
    let stem = Path::new(source).file_stem();
    let fallback = stem.map_or_else(|| source.to_owned(), |stem| stem.to_string_lossy().into());
    model.kind_mut().name_mut().get_or_insert(fallback);
    Ok(model)
}

fn read(path: &Path, depth: usize) -> Result<MachineModel, ReadModelError> {
    if let Some(preset) = preset(path) {
        return Ok(MachineModel::Actuator(preset));
    }
    if depth > MOST_BASES {
        return Err(ReadModelError::TooManyBases { path: path.to_owned(), most: MOST_BASES });
    }
    let text = fs::read_to_string(path).map_err(|error| ReadModelError::Unreadable {
        path: path.to_owned(),
        reason: error.to_string(),
    })?;
    let wrong = |reason| ReadModelError::Text { path: path.to_owned(), reason };
    let parsed = match model_file::base_of(&text).map_err(wrong)? {
        Some(base) if preset(Path::new(&base)).is_none() => {
            let beside = path.parent().unwrap_or(Path::new("")).join(base);
            let mut base = read(&beside, depth + 1)?;
            // what a machine is called is not inherited
            *base.kind_mut().name_mut() = None;
            model_file::parse_machine_onto(&text, &base)
        }
        _ => model_file::parse_machine(&text),
    };
    parsed.map_err(wrong)
}

fn preset(path: &Path) -> Option<Model> {
    let (name, actuator) = PRESETS.iter().find(|(name, _)| Path::new(name) == path)?;
    Some(Model { name: Some((*name).to_owned()), ..(*actuator).into() })
}
