//! Files that are damaged, or made to do harm: read or refused, without a panic and without
//! more memory than the limits allow.
//!
//! Seeded, and short unless `FDI_FUZZ_SECONDS` says how long each target is to run
//! (`docs/validation/fuzzing.md`). What was found once is kept in `fixtures/fuzz`.

use std::{
    fs,
    io::{Read, Write},
    path::PathBuf,
    time::{Duration, Instant},
};

use fdi_core::{
    Bundle, ColumnMap, CsvFormat, EMBEDDED_BUNDLES, FileFormat, Recording, dataset_from_bytes,
    ema_sim, read_model,
    store::{ArtefactKind, seal},
};
use flate2::{Compression, read::DeflateDecoder, write::DeflateEncoder};
use proptest::{
    prelude::*,
    test_runner::{Config, RngAlgorithm, TestCaseError, TestError, TestRng, TestRunner},
};

/// Cases of a target when no time is given.
const SHORT_CASES: u32 = 192;
/// Cases between two looks at the clock.
const BATCH_CASES: u32 = 64;

fn fixtures() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../fixtures")
}

/// One change to the bytes of a file.
#[derive(Clone, Debug)]
enum Mutation {
    Flip { at: Place, bit: u8 },
    Byte { at: Place, value: u8 },
    Word { at: Place, value: u64, bytes: usize },
    Cut { at: Place, length: usize },
    Repeat { at: Place, length: usize, times: usize },
    Insert { at: Place, bytes: Vec<u8> },
    Truncate { at: Place },
}

/// A place in a file: anywhere, or near an end, where headers and indices stand.
#[derive(Clone, Copy, Debug)]
enum Place {
    Anywhere(prop::sample::Index),
    Start(usize),
    End(usize),
}

impl Place {
    fn of(self, length: usize) -> usize {
        match self {
            Self::Anywhere(index) => index.index(length + 1),
            Self::Start(at) => at.min(length),
            Self::End(back) => length.saturating_sub(back),
        }
    }
}

fn place() -> impl Strategy<Value = Place> {
    prop_oneof![
        2 => any::<prop::sample::Index>().prop_map(Place::Anywhere),
        1 => (0usize..600).prop_map(Place::Start),
        1 => (0usize..600).prop_map(Place::End),
    ]
}

/// Numbers that lengths, counts and offsets are damaged into.
fn lie() -> impl Strategy<Value = u64> {
    prop_oneof![
        Just(0),
        Just(1),
        Just(0x7fff_ffff),
        Just(0x8000_0000),
        Just(u64::from(u32::MAX)),
        Just(u64::MAX),
        Just(1 << 40),
        Just(i64::MAX as u64),
        0u64..5000,
        any::<u64>(),
    ]
}

fn mutation() -> impl Strategy<Value = Mutation> {
    prop_oneof![
        3 => (place(), 0u8..8).prop_map(|(at, bit)| Mutation::Flip { at, bit }),
        2 => (place(), any::<u8>()).prop_map(|(at, value)| Mutation::Byte { at, value }),
        3 => (place(), lie(), prop_oneof![Just(2usize), Just(4), Just(8)])
            .prop_map(|(at, value, bytes)| Mutation::Word { at, value, bytes }),
        1 => (place(), 1usize..200).prop_map(|(at, length)| Mutation::Cut { at, length }),
        1 => (place(), 1usize..200, 1usize..20)
            .prop_map(|(at, length, times)| Mutation::Repeat { at, length, times }),
        1 => (place(), prop::collection::vec(any::<u8>(), 1..40))
            .prop_map(|(at, bytes)| Mutation::Insert { at, bytes }),
        1 => place().prop_map(|at| Mutation::Truncate { at }),
    ]
}

fn mutate(bytes: &mut Vec<u8>, mutation: &Mutation) {
    let length = bytes.len();
    let range = |at: &Place, size: usize| {
        let start = at.of(length);
        start..(start + size).min(length)
    };
    match mutation {
        Mutation::Flip { at, bit } => {
            bytes[range(at, 1)].iter_mut().for_each(|byte| *byte ^= 1 << bit);
        }
        Mutation::Byte { at, value } => bytes[range(at, 1)].fill(*value),
        Mutation::Word { at, value, bytes: size } => {
            let target = &mut bytes[range(at, *size)];
            target.copy_from_slice(&value.to_le_bytes()[..target.len()]);
        }
        Mutation::Cut { at, length } => {
            bytes.drain(range(at, *length));
        }
        Mutation::Repeat { at, length, times } => {
            let range = range(at, *length);
            let part = bytes[range.clone()].repeat(*times);
            bytes.splice(range, part);
        }
        Mutation::Insert { at, bytes: new } => {
            let at = at.of(length);
            bytes.splice(at..at, new.iter().copied());
        }
        Mutation::Truncate { at } => bytes.truncate(at.of(length)),
    }
}

#[expect(clippy::disallowed_methods, reason = "how long to try is asked for from outside")]
fn clock() -> Instant {
    Instant::now()
}

fn time_given() -> Option<Duration> {
    let seconds = std::env::var_os("FDI_FUZZ_SECONDS")?.into_string().unwrap();
    Some(Duration::from_secs(seconds.parse().unwrap()))
}

/// Hands mutated files to `read`, which must come back with some answer, `true` where the
/// file was read.
fn fuzz(target: &str, files: &[Vec<u8>], read: impl Fn(&[u8]) -> bool) {
    assert!(!files.is_empty(), "{target} has nothing to start from");
    let kept = fs::read_dir(fixtures().join("fuzz").join(target));
    for file in kept.into_iter().flatten() {
        read(&fs::read(file.unwrap().path()).unwrap());
    }
    assert!(files.iter().any(|file| read(file)), "{target}: no file is read as it is");
    let (start, time) = (clock(), time_given());
    let (mut cases, accepted) = (0, std::cell::Cell::new(0u64));
    for batch in 0u64.. {
        let mut seed = [0; 32];
        seed[..8].copy_from_slice(&batch.to_le_bytes());
        let config = Config { cases: BATCH_CASES, failure_persistence: None, ..Config::default() };
        let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &seed);
        let mut runner = TestRunner::new_with_rng(config, rng);
        let input = (0..files.len(), prop::collection::vec(mutation(), 1..8));
        let outcome = runner.run(&input, |(index, mutations)| {
            let mut bytes = files[index].clone();
            for mutation in &mutations {
                mutate(&mut bytes, mutation);
            }
            accepted.set(accepted.get() + u64::from(read(&bytes)));
            Ok::<_, TestCaseError>(())
        });
        if let Err(TestError::Fail(reason, (index, mutations))) = &outcome {
            panic!("{target}: {reason}, file {index}, batch {batch}: {mutations:?}");
        }
        outcome.unwrap();
        cases += BATCH_CASES;
        if time.map_or(cases >= SHORT_CASES, |time| start.elapsed() >= time) {
            break;
        }
    }
    let took = start.elapsed().as_secs_f64();
    eprintln!("{target}: {cases} cases in {took:.0} s, {} read; {}", accepted.get(), peak());
}

/// Most memory that this process has had, where the system tells.
fn peak() -> String {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM"));
    line.unwrap_or("peak memory unknown").to_owned()
}

/// Properties that every caller relies on in a recording that was read.
fn read_recording(format: FileFormat, bytes: &[u8], map: &ColumnMap) -> bool {
    let Ok(recording) = Recording::from_bytes("r", format, bytes.to_vec(), map) else {
        return false;
    };
    for channel in recording.channels() {
        assert!(!channel.values().is_empty());
        assert_eq!(channel.values().len(), channel.times_s().len());
        assert!(channel.values().iter().all(|value| value.is_finite()));
        assert!(channel.times_s().windows(2).all(|pair| pair[0] < pair[1]));
        let _ = (channel.sampling(), recording.require_no_gap(channel));
    }
    let _ = (recording.require_current().is_ok(), recording.to_csv(CsvFormat::default()));
    true
}

fn fuzz_recordings(target: &str, format: FileFormat, names: &[&str], map: &[&str]) {
    let files: Vec<_> =
        names.iter().map(|name| fs::read(fixtures().join("readers").join(name)).unwrap()).collect();
    let map = ColumnMap::new(map).unwrap();
    fuzz(target, &files, |bytes| read_recording(format, bytes, &map));
}

#[test]
fn fuzz_csv() {
    fuzz_recordings("csv", FileFormat::Csv, &["twin.csv"], &[]);
}

#[test]
fn fuzz_csv_gz() {
    let twin =
        Recording::read(&fixtures().join("readers/twin.csv"), &ColumnMap::default()).unwrap();
    let file = twin.to_csv_gz(CsvFormat::default()).unwrap();
    let map = ColumnMap::default();
    fuzz("csv-gz", &[file], |bytes| read_recording(FileFormat::CsvGz, bytes, &map));
}

#[test]
fn fuzz_mat() {
    let names = ["scipy-plain.mat", "scipy-compressed.mat", "scipy-struct.mat", "scipy-matrix.mat"];
    fuzz_recordings("mat", FileFormat::Mat, &names, &[]);
}

#[test]
fn fuzz_mf4() {
    let names = ["asammdf-plain.mf4", "asammdf-deflate.mf4", "asammdf-transposed.mf4"];
    fuzz_recordings("mf4", FileFormat::Mf4, &names, &["current_a=counts"]);
}

#[test]
fn fuzz_parquet() {
    let names = [
        "pandas-none.parquet",
        "pandas-zstd.parquet",
        "pyarrow-snappy.parquet",
        "pyarrow-gzip.parquet",
        "pyarrow-row.parquet",
        "polars-lz4.parquet",
        "polars-brotli.parquet",
    ];
    fuzz_recordings("parquet", FileFormat::Parquet, &names, &[]);
}

#[test]
fn fuzz_tdms() {
    let names = ["nptdms-waveform.tdms", "nptdms-time.tdms"];
    fuzz_recordings("tdms", FileFormat::Tdms, &names, &["current_a=counts"]);
}

/// Where the payload stands in a container (`docs/formats.md`).
const PAYLOAD_START: usize = 56;

/// The container as it is; sealed again, its payload; deflated and sealed again, what it holds.
#[test]
fn fuzz_bundle() {
    let whole = EMBEDDED_BUNDLES[0].bytes;
    fuzz("bundle", &[whole.to_vec()], |bytes| Bundle::from_bytes(bytes).is_ok());
    fuzz("bundle-payload", &[whole[PAYLOAD_START..].to_vec()], |payload| {
        let _ = dataset_from_bytes(&seal(ArtefactKind::Dataset, payload));
        Bundle::from_bytes(&seal(ArtefactKind::Bundle, payload)).is_ok()
    });
    let mut content = Vec::new();
    DeflateDecoder::new(&whole[PAYLOAD_START..]).read_to_end(&mut content).unwrap();
    fuzz("bundle-content", &[content], |content| {
        // blocks that are stored as they stand, because compressing them is the slower part
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::none());
        encoder.write_all(content).unwrap();
        let payload = encoder.finish().unwrap();
        let _ = dataset_from_bytes(&seal(ArtefactKind::Dataset, &payload));
        Bundle::from_bytes(&seal(ArtefactKind::Bundle, &payload)).is_ok()
    });
}

#[test]
fn fuzz_model_file() {
    let models = fs::read_dir(fixtures().join("models")).unwrap();
    let mut paths: Vec<_> = models.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let files: Vec<_> = paths.iter().map(|path| fs::read(path).unwrap()).collect();
    let actuator = fixtures().join("models/ema-48.toml");
    assert!(read_model(&actuator.display().to_string()).is_ok());
    fuzz("model-file", &files, |bytes| {
        let text = String::from_utf8_lossy(bytes);
        let Ok(model) = ema_sim::model_file::parse(&text) else { return false };
        // what was read can be written, and read again
        ema_sim::model_file::parse(&ema_sim::model_file::write(&model))
            .expect("reads its own text");
        true
    });
}
