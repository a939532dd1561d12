//! The formats of file that a recording can have: one table.
//!
//! # Adding a format
//!
//! 1. Write `reader/NAME.rs` with a function
//!    `pub(super) fn read(name: String, bytes: Vec<u8>, map: &ColumnMap) -> Result<Recording, RecordError>`.
//!    A file of named columns implements `Container` (`reader/container.rs`) and hands itself to
//!    `assemble`, which finds channels, units, time axes and metadata; `reader/mf4.rs` is the
//!    shortest example.
//! 2. Add its line to the table `formats!` below. A format that needs a crate names a feature there,
//!    declared in `Cargo.toml`.
//!
//! File names, error texts, folders, and the choice of the reader follow from the table.

use std::path::Path;

/// Calls a macro with the table of formats.
///
/// A line has the variant of [`FileFormat`], the ending of file names, the format in words, the
/// feature that it needs (or none), whose decoder reads it, and the module under `reader/`.
/// `foreign` decoders are crates of others: a panic in one is told as an error of the file.
macro_rules! formats {
    ($make:ident) => {
        $make! {
            Csv ".csv" "CSV, compressed or not" [] own csv;
            CsvGz ".csv.gz" "CSV compressed with gzip" [] own csv_gz;
            Hdf5 ".h5" "HDF5" ["hdf5"] foreign hdf5;
            Mat ".mat" "MATLAB 5 to 7, with `hdf5` 7.3" ["mat"] own mat;
            Mf4 ".mf4" "ASAM MDF 4" ["mf4"] foreign mf4;
            Parquet ".parquet" "Apache Parquet" ["parquet"] foreign parquet;
            Tdms ".tdms" "NI TDMS" ["tdms"] own tdms;
            Tsv ".tsv" "text, cells apart by tabs" [] own tsv;
            Txt ".txt" "text, in whatever way its table is written" [] own txt;
        }
    };
}
pub(crate) use formats;

macro_rules! file_format {
    ($($variant:ident $ending:literal $what:literal [$($feature:tt)?] $decoder:ident $module:ident;)+) => {
        /// The format of a recording on disk.
        ///
        /// Formats other than CSV need a feature of this crate. A format that was left out of a
        /// build is still known by its name, and refused with the feature named.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[non_exhaustive]
        pub enum FileFormat {
            $(
                #[doc = concat!($what, ", `", $ending, "`", $("; feature `", $feature, "`",)? ".")]
                $variant,
            )+
        }

        impl FileFormat {
            /// Every format, built in or not.
            pub const ALL: [Self; [$(stringify!($variant)),+].len()] = [$(Self::$variant,)+];

            /// The ending of the names of such files.
            pub fn extension(self) -> &'static str {
                match self { $(Self::$variant => $ending,)+ }
            }

            /// The format in words.
            pub fn description(self) -> &'static str {
                match self { $(Self::$variant => $what,)+ }
            }

            /// The feature that the format needs, if it needs one.
            pub fn feature(self) -> Option<&'static str> {
                let feature = match self { $(Self::$variant => concat!($($feature)?),)+ };
                (!feature.is_empty()).then_some(feature)
            }

            /// True where this build reads the format.
            pub fn is_built_in(self) -> bool {
                match self { $(Self::$variant => true $(&& cfg!(feature = $feature))?,)+ }
            }

            /// True where a crate of others decodes the format.
            pub(crate) fn has_foreign_decoder(self) -> bool {
                match self { $(Self::$variant => matches!(Decoder::$decoder, Decoder::foreign),)+ }
            }
        }
    };
}

/// Whose decoder reads a format, in the words of the table.
#[expect(non_camel_case_types, reason = "the words of the table")]
enum Decoder {
    own,
    foreign,
}

formats!(file_format);

/// First bytes of HDF5; MATLAB 7.3 writes 512 bytes of its own before them.
pub(crate) const HDF5_MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Endings of files that are of a format too.
const OTHER_ENDINGS: [(&str, FileFormat); 10] = [
    (".txt.gz", FileFormat::Txt),
    (".tsv.gz", FileFormat::Txt),
    (".asc", FileFormat::Txt),
    (".dat", FileFormat::Txt),
    (".lvm", FileFormat::Txt),
    (".prn", FileFormat::Txt),
    (".mdf", FileFormat::Mf4),
    (".hdf5", FileFormat::Hdf5),
    (".hdf", FileFormat::Hdf5),
    (".he5", FileFormat::Hdf5),
];

/// How to save what other endings stand for.
const ADVICE: [(&[&str], &str); 4] = [
    (&["xlsx", "xls", "xlsm", "xlsb", "ods"], "save the sheet as CSV"),
    (
        &[
            "nc", "feather", "arrow", "ipc", "json", "jsonl", "ndjson", "pkl", "pickle", "orc",
            "avro",
        ],
        "save it as Parquet (pandas: `to_parquet`, polars: `write_parquet`)",
    ),
    (&["npy", "npz"], "save it as text (`numpy.savetxt(FILE, table, header=NAMES)`) or Parquet"),
    (&["zip", "7z", "tar", "tgz", "bz2", "xz", "zst"], "unpack it; `.csv.gz` is read as it is"),
];

impl FileFormat {
    /// The format that the name of a file tells, if it is that of a recording.
    pub fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        let ends = |ending: &str| name.strip_suffix(ending).is_some_and(|stem| !stem.is_empty());
        let known = Self::ALL.into_iter().find(|format| ends(format.extension()));
        let other = || OTHER_ENDINGS.iter().find(|(ending, _)| ends(ending));
        known.or_else(|| other().map(|(_, format)| *format))
    }

    /// Advice on a file that is none of a recording, by its name; empty where its kind is not known.
    pub(crate) fn advice(path: &Path) -> &'static str {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let of = |(endings, _): &&(&[&str], _)| endings.contains(&ending.as_str());
        ADVICE.iter().find(of).map_or("", |(_, advice)| advice)
    }

    /// The format that the first bytes of a file tell; of others it is text.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        match bytes {
            [0x1f, 0x8b, ..] => Self::CsvGz,
            [b'P', b'A', b'R', b'1', ..] => Self::Parquet,
            [b'M', b'D', b'F', b' ', ..] => Self::Mf4,
            [b'T', b'D', b'S', b'm', ..] => Self::Tdms,
            _ if bytes.starts_with(b"MATLAB 5.0 MAT-file") => Self::Mat,
            _ if bytes.starts_with(b"MATLAB 7.3 MAT-file") => Self::Mat,
            _ if bytes.starts_with(HDF5_MAGIC) => Self::Hdf5,
            _ => Self::Csv,
        }
    }

    /// The endings that this build reads, as a message lists them: `` `.csv` or `.csv.gz` ``.
    pub fn listed() -> String {
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
        assert_eq!(of("r.txt"), Some(FileFormat::Txt));
        assert_eq!(of("r.txt.gz"), Some(FileFormat::Txt));
        assert_eq!(of("r.LVM"), Some(FileFormat::Txt));
        assert_eq!(of("r.mdf"), Some(FileFormat::Mf4));
        assert_eq!(of("r.hdf5"), Some(FileFormat::Hdf5));
        for name in ["r.tdms_index", "r.gz", ".mat", "mat", "r.doc", ""] {
            assert_eq!(of(name), None, "{name}");
        }
    }
}
