//! Files that other programs have written, against their twin in CSV.
//!
//! `fixtures/references/readers` has the script and the versions.

use approx::assert_abs_diff_eq;
use std::path::PathBuf;

use recordings::{ChannelName, ColumnMap, FileFormat, OtherColumn, RecordError, Recording};

/// Doubles are stored as they are; only an axis that is stated as a step is computed, to a
/// few units in the last place of times below a second.
const AGREEMENT_ABS: f64 = 1e-12;

const PHASES: [ChannelName; 3] =
    [ChannelName::PhaseACurrent, ChannelName::PhaseBCurrent, ChannelName::PhaseCCurrent];
const PHASES_AND_ANGLE: [ChannelName; 4] = [
    ChannelName::PhaseACurrent,
    ChannelName::PhaseBCurrent,
    ChannelName::PhaseCCurrent,
    ChannelName::MotorAngle,
];

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/readers").join(name)
}

fn read(name: &str, map: &[&str]) -> Result<Recording, RecordError> {
    Recording::read(&path(name), &ColumnMap::new(map).unwrap())
}

/// Every channel of a file is that of the twin, with its times.
fn assert_twin(name: &str, map: &[&str], channels: &[ChannelName]) -> Recording {
    let twin = read("twin.csv", &[]).unwrap();
    let file = read(name, map).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(file.channels().len(), channels.len(), "{name}");
    for &channel in channels {
        let (want, got) = (twin.channel(channel).unwrap(), file.channel(channel).unwrap());
        assert_eq!(got.values().len(), want.values().len(), "{name} {channel}");
        let pairs =
            |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(pairs(got.times_s(), want.times_s()) <= AGREEMENT_ABS, "{name} {channel} times");
        assert!(pairs(got.values(), want.values()) <= AGREEMENT_ABS, "{name} {channel}");
        let (got, want) = (got.sampling().unwrap(), want.sampling().unwrap());
        assert_eq!((got.rate_hz, got.is_uniform()), (want.rate_hz, true), "{name} {channel}");
    }
    file
}

/// What the files say of themselves beside their channels.
fn assert_metadata(recording: &Recording) {
    assert_eq!(recording.metadata.actuator_id.as_deref(), Some("bench-3"), "{}", recording.name);
    assert_eq!(recording.metadata.rate_hz, Some(2000.0), "{}", recording.name);
}

mod parquet {
    use super::*;

    #[test]
    fn versus_pandas_with_every_codec() {
        for codec in ["snappy", "gzip", "brotli", "zstd", "lz4", "none"] {
            let name = format!("pandas-{codec}.parquet");
            assert_metadata(&assert_twin(&name, &[], &PHASES_AND_ANGLE));
        }
    }

    #[test]
    fn versus_pyarrow_with_every_codec_in_several_row_groups() {
        for form in ["snappy", "gzip", "brotli", "zstd", "lz4", "byte-stream-split"] {
            let name = format!("pyarrow-{form}.parquet");
            assert_metadata(&assert_twin(&name, &[], &PHASES_AND_ANGLE));
        }
    }

    #[test]
    fn versus_polars_with_every_codec() {
        for codec in ["zstd", "snappy", "gzip", "brotli", "lz4", "uncompressed"] {
            assert_twin(&format!("polars-{codec}.parquet"), &[], &PHASES_AND_ANGLE);
        }
    }

    #[test]
    fn dates_are_seconds_and_words_are_left_alone() {
        let file = assert_twin("pandas-dates.parquet", &["time_s=stamp"], &PHASES_AND_ANGLE);
        let others: Vec<_> = file.other_columns().iter().map(|c| (c.name(), c.samples())).collect();
        assert_eq!(others, [("remark", 160)]);
        let error = read("pandas-dates.parquet", &["time_s=stamp", "current_a=remark"]);
        assert_eq!(
            error.unwrap_err().to_string(),
            "column `remark` holds text or bytes, expected numbers (pandas: `astype(float)` before it is \
             saved)"
        );
    }

    #[test]
    fn one_recording_may_be_a_row_of_lists() {
        assert_metadata(&assert_twin("pyarrow-row.parquet", &[], &PHASES));
    }
}

mod mat {
    use super::*;

    #[test]
    fn versus_scipy_plain_and_compressed() {
        for form in ["plain", "compressed"] {
            assert_metadata(&assert_twin(&format!("scipy-{form}.mat"), &[], &PHASES));
        }
    }

    #[test]
    fn versus_scipy_structs_with_their_own_axes() {
        let file = assert_twin("scipy-struct.mat", &[], &PHASES_AND_ANGLE);
        assert_metadata(&file);
        let others: Vec<_> = file.other_columns().iter().map(OtherColumn::name).collect();
        assert_eq!(others, ["rec.list{1}", "empty", "sparse"]);
    }

    #[test]
    fn columns_of_a_matrix_can_be_mapped() {
        let map = [
            "time_s=data(:,1)",
            "phase_a_current_a=data(:,2)",
            "phase_b_current_a=data(:,3)",
            "phase_c_current_a=data(:,4)",
        ];
        assert_twin("scipy-matrix.mat", &map, &PHASES);
        let period = ["time_s=Ts*0.001", "phase_a_current_a=ia"];
        assert_twin("scipy-matrix.mat", &period, &PHASES[..1]);
    }

    #[test]
    fn what_is_not_read_is_named() {
        assert_eq!(
            read("scipy-v4.mat", &[]).unwrap_err().to_string(),
            "`.mat` with version 4 is not read (save it with `-v7`)"
        );
        assert_eq!(
            read("scipy-struct.mat", &["load_n_m=sparse"]).unwrap_err().to_string(),
            "column `sparse` holds a sparse matrix, expected numbers"
        );
    }
}

#[cfg(feature = "hdf5")]
mod hdf5 {
    use super::*;

    #[test]
    fn versus_h5py_in_the_layout_of_matlab_7_3() {
        let file = assert_twin("h5py-v73.mat", &[], &PHASES_AND_ANGLE);
        assert_metadata(&file);
        let others: Vec<_> = file.other_columns().iter().map(OtherColumn::name).collect();
        assert_eq!(others, ["empty", "list", "rec.table(:,1)", "rec.table(:,2)"]);
        let mapped = read("h5py-v73.mat", &["time_s=rec.table(:,1)", "load_n_m=rec.table(:,2)"]);
        let load = mapped.unwrap().channel(ChannelName::Load).unwrap().clone();
        assert_eq!((load.values().len(), load.sampling().unwrap().rate_hz), (40, 500.0));
        assert_eq!(
            read("h5py-v73.mat", &["load_n_m=list"]).unwrap_err().to_string(),
            "column `list` holds a cell array, expected numbers"
        );
    }

    #[test]
    fn versus_h5py_with_groups_and_with_a_table() {
        let file = assert_twin("h5py-groups.h5", &[], &PHASES_AND_ANGLE);
        assert_metadata(&file);
        let others: Vec<_> = file.other_columns().iter().map(OtherColumn::name).collect();
        assert_eq!(others, ["events"]);
        let error = read("h5py-groups.h5", &["load_n_m=drive/phase_a_current_a"]).unwrap_err();
        assert!(error.to_string().contains("is in `A` as the file says"), "{error}");
        let map = [
            "time_s=data(:,1)",
            "phase_a_current_a=data(:,2)",
            "phase_b_current_a=data(:,3)",
            "phase_c_current_a=data(:,4)",
        ];
        assert_twin("h5py-table.h5", &map, &PHASES);
    }

    #[test]
    fn damaged_copies_are_errors() {
        let table = ["time_s=data(:,1)", "phase_c_current_a=data(:,4)"];
        for (name, map) in
            [("h5py-v73.mat", &[][..]), ("h5py-groups.h5", &[]), ("h5py-table.h5", &table)]
        {
            let map = ColumnMap::new(map).unwrap();
            let whole = std::fs::read(path(name)).unwrap();
            let format = FileFormat::of(&path(name)).unwrap();
            let read = |bytes: &[u8]| Recording::from_bytes("r", format, bytes.to_vec(), &map);
            for end in (0..whole.len()).step_by(1500) {
                let error = read(&whole[..end]).unwrap_err().to_string();
                assert!(!error.is_empty() && !error.contains('\n'), "{name} {end}: {error}");
            }
            for place in (600..whole.len()).step_by(97) {
                let mut changed = whole.clone();
                changed[place] ^= 0xff;
                // read or refused, and never a panic
                let _ = read(&changed);
            }
        }
    }
}

#[cfg(not(feature = "hdf5"))]
#[test]
fn what_needs_another_build_is_told() {
    let told = |name: &str| read(name, &[]).unwrap_err().to_string();
    assert!(told("h5py-v73.mat").contains("build with the feature `hdf5`"));
    assert!(told("h5py-groups.h5").contains("lacks the feature `hdf5`"));
}

mod mf4 {
    use super::*;

    #[test]
    fn versus_asammdf_plain_and_compressed() {
        for form in ["plain", "deflate", "transposed", "4.00", "4.20"] {
            assert_twin(&format!("asammdf-{form}.mf4"), &[], &PHASES_AND_ANGLE);
        }
    }

    /// The file states ampere for its currents; with volt in the same places they are refused, unless
    /// a factor says what to make of them.
    #[test]
    fn stated_units_are_looked_at() {
        let mut bytes = std::fs::read(path("asammdf-plain.mf4")).unwrap();
        // a text block: its name, 20 bytes of header, the text
        let is_ampere =
            |at: &usize| bytes[*at..].starts_with(b"##TX") && bytes[*at + 24..].starts_with(b"A\0");
        let places: Vec<usize> = (0..bytes.len() - 26).filter(is_ampere).collect();
        assert!(!places.is_empty());
        for at in places {
            bytes[at + 24] = b'V';
        }
        let read = |map: &[&str]| {
            let map = ColumnMap::new(map).unwrap();
            Recording::from_bytes("r.mf4", FileFormat::Mf4, bytes.clone(), &map)
        };
        let error = read(&[]).unwrap_err().to_string();
        assert!(error.contains("is in `V` as the file says, `phase_a_current_a` in A"), "{error}");
        let map = ["a", "b", "c"].map(|x| format!("phase_{x}_current_a=phase_{x}_current_a*2"));
        let recording = read(&map.each_ref().map(String::as_str)).unwrap();
        assert_eq!(recording.stated_units().len(), 3);
    }

    /// Twelve bits over 20 A: the error of rounding is half a step.
    #[test]
    fn conversions_are_applied() {
        let twin = read("twin.csv", &[]).unwrap();
        let file = read("asammdf-deflate.mf4", &["current_a=counts"]).unwrap();
        let want = twin.channel(ChannelName::PhaseACurrent).unwrap().values();
        let got = file.channel(ChannelName::Current).unwrap().values();
        for (got, want) in got.iter().zip(want) {
            assert_abs_diff_eq!(got, want, epsilon = 10.0 / 4095.0 + AGREEMENT_ABS);
        }
        let error = read("asammdf-plain.mf4", &["current_a=adc/remark"]).unwrap_err();
        assert_eq!(error.to_string(), "column `adc/remark` holds text, expected numbers");
    }
}

mod tdms {
    use super::*;

    #[test]
    fn versus_nptdms_waveforms_in_segments() {
        assert_metadata(&assert_twin("nptdms-waveform.tdms", &[], &PHASES_AND_ANGLE));
    }

    /// Wherever a copy breaks off, it is damaged: neither another file nor one without channels.
    #[test]
    fn truncated_copies_are_called_that() {
        let whole = std::fs::read(path("nptdms-waveform.tdms")).unwrap();
        for length in [10, 30, whole.len() / 3, whole.len() / 2, whole.len() - 1] {
            let bytes = whole[..length].to_vec();
            let map = ColumnMap::default();
            let error = Recording::from_bytes("r", FileFormat::Tdms, bytes, &map).unwrap_err();
            let error = error.to_string();
            assert!(error.starts_with("damaged `.tdms` file: truncated: "), "{length}: {error}");
        }
    }

    #[test]
    fn versus_nptdms_with_a_channel_of_times() {
        let file = assert_twin("nptdms-time.tdms", &[], &PHASES);
        let others: Vec<_> = file.other_columns().iter().map(OtherColumn::name).collect();
        assert_eq!(others, ["drive/remark", "adc/counts", "stamped/stamp", "stamped/ia"]);
    }

    #[test]
    fn scaled_and_stamped_channels_are_physical() {
        let twin = read("twin.csv", &[]).unwrap();
        let want = twin.channel(ChannelName::PhaseACurrent).unwrap();
        let counts = read("nptdms-time.tdms", &["current_a=counts"]).unwrap();
        let got = counts.channel(ChannelName::Current).unwrap();
        for (got, want) in got.values().iter().zip(want.values()) {
            assert_abs_diff_eq!(got, want, epsilon = 0.0005 + 1e-9);
        }
        let stamped = read("nptdms-time.tdms", &["time_s=stamp", "current_a=stamped/ia"]).unwrap();
        let got = stamped.channel(ChannelName::Current).unwrap();
        // 2⁻²⁴ of the value, in single precision; microseconds in the file
        let close = |a: f64, b: f64| (a - b).abs() <= f64::from(f32::EPSILON) * b.abs();
        assert!(got.values().iter().zip(want.values()).all(|(&a, &b)| close(a, b)));
        let apart = got.times_s().iter().zip(want.times_s()).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) <= AGREEMENT_ABS);
    }
}
