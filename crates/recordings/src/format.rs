//! The forms of file that a recording can have.

use std::path::Path;

/// The form of a recording on disk.
///
/// All but CSV need a feature of this crate; a form that was left out is still known by its
/// name, and refused with the feature named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FileFormat {
    /// CSV, `.csv`; compressed or not.
    Csv,
    /// CSV compressed with gzip, `.csv.gz`.
    CsvGz,
    /// MATLAB 5 to 7, `.mat`; feature `mat`.
    Mat,
    /// ASAM MDF 4, `.mf4`; feature `mf4`.
    Mf4,
    /// Apache Parquet, `.parquet`; feature `parquet`.
    Parquet,
    /// NI TDMS, `.tdms`; feature `tdms`.
    Tdms,
}

impl FileFormat {
    /// Every form, whether it is built in or not.
    pub const ALL: [Self; 6] =
        [Self::Csv, Self::CsvGz, Self::Mat, Self::Mf4, Self::Parquet, Self::Tdms];

    /// The form that the name of a file tells, if it is that of a recording.
    pub fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        Self::ALL.into_iter().find(|format| {
            name.strip_suffix(format.extension()).is_some_and(|stem| !stem.is_empty())
        })
    }

    /// How the names of such files end.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Csv => ".csv",
            Self::CsvGz => ".csv.gz",
            Self::Mat => ".mat",
            Self::Mf4 => ".mf4",
            Self::Parquet => ".parquet",
            Self::Tdms => ".tdms",
        }
    }

    /// The feature that it needs, if it needs one.
    pub fn feature(self) -> Option<&'static str> {
        match self {
            Self::Csv | Self::CsvGz => None,
            Self::Mat => Some("mat"),
            Self::Mf4 => Some("mf4"),
            Self::Parquet => Some("parquet"),
            Self::Tdms => Some("tdms"),
        }
    }

    /// Whether this build reads it.
    pub fn is_built_in(self) -> bool {
        match self {
            Self::Csv | Self::CsvGz => true,
            Self::Mat => cfg!(feature = "mat"),
            Self::Mf4 => cfg!(feature = "mf4"),
            Self::Parquet => cfg!(feature = "parquet"),
            Self::Tdms => cfg!(feature = "tdms"),
        }
    }

    /// The error of a build that leaves it out.
    #[cfg(not(all(feature = "mat", feature = "mf4", feature = "parquet", feature = "tdms")))]
    pub(super) fn left_out(self) -> super::RecordError {
        self.feature().map_or(super::RecordError::UnknownFormat, |feature| {
            super::RecordError::NotBuiltIn { format: self, feature }
        })
    }

    /// The endings that this build reads, as a message lists them.
    pub(super) fn listed() -> String {
        let read: Vec<_> = Self::ALL.into_iter().filter(|format| format.is_built_in()).collect();
        let names: Vec<_> = read.iter().map(|format| format!("`{}`", format.extension())).collect();
        match names.split_last() {
            Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
            _ => names.concat(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms_are_known_by_their_names() {
        let of = |name: &str| FileFormat::of(Path::new(name));
        assert_eq!(of("a/r01.csv"), Some(FileFormat::Csv));
        assert_eq!(of("R01.CSV.GZ"), Some(FileFormat::CsvGz));
        assert_eq!(of("r.Mat"), Some(FileFormat::Mat));
        assert_eq!(of("r.mf4"), Some(FileFormat::Mf4));
        assert_eq!(of("r.parquet"), Some(FileFormat::Parquet));
        assert_eq!(of("r.tdms"), Some(FileFormat::Tdms));
        for name in ["r.tdms_index", "r.gz", ".mat", "mat", "r.txt", ""] {
            assert_eq!(of(name), None, "{name}");
        }
    }
}
