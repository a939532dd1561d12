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
        /// What the operating system says.
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
    /// Files stand on one another without end.
    #[error("{}: `base` leads through more than {most} files", path.display())]
    TooManyBases {
        /// The file where it was given up.
        path: PathBuf,
        /// Most files.
        most: usize,
    },
}

/// Reads a model: the preset of that name, or the file. The `base` of a file is a preset or
/// another file, beside it unless its path is absolute.
///
/// The model always has a name: its own, or else that of preset or file.
///
/// # Errors
///
/// [`ReadModelError`], which names the file.
pub fn read_model(source: &str) -> Result<Model, ReadModelError> {
    let mut model = read(Path::new(source), 0)?;
    let stem = Path::new(source).file_stem();
    let fallback = stem.map_or_else(|| source.to_owned(), |stem| stem.to_string_lossy().into());
    model.name.get_or_insert(fallback);
    Ok(model)
}

/// Reads a model of either kind: an actuator as [`read_model`] does, or the file of a servo axis.
///
/// # Errors
///
/// [`ReadModelError`], which names the file.
pub fn read_machine(source: &str) -> Result<MachineModel, ReadModelError> {
    let path = Path::new(source);
    if preset(path).is_none()
        && let Ok(text) = fs::read_to_string(path)
    {
        let wrong = |reason| ReadModelError::Text { path: path.to_owned(), reason };
        if model_file::base_of(&text).map_err(wrong)?.is_none() {
            let machine = model_file::parse_machine(&text).map_err(wrong)?;
            if matches!(machine, MachineModel::ServoAxis(_)) {
                return Ok(machine);
            }
        }
    }
    read_model(source).map(MachineModel::Actuator)
}

fn read(path: &Path, depth: usize) -> Result<Model, ReadModelError> {
    if let Some(preset) = preset(path) {
        return Ok(preset);
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
            // what a machine is called is not inherited
            let base = Model { name: None, ..read(&beside, depth + 1)? };
            model_file::parse_onto(&text, &base)
        }
        _ => model_file::parse(&text),
    };
    parsed.map_err(wrong)
}

fn preset(path: &Path) -> Option<Model> {
    let (name, actuator) = PRESETS.iter().find(|(name, _)| Path::new(name) == path)?;
    Some(Model { name: Some((*name).to_owned()), ..(*actuator).into() })
}
