//! Time axes as loggers write them: what is diagnosed from them beside the plain twin.

use std::{fmt::Write, fs, path::Path};

use assert_cmd::Command;
use fdi_core::{
    ChannelName::{self, MotorAngle, PhaseACurrent, PhaseBCurrent, PhaseCCurrent},
    ColumnMap, Recording,
    report::{Diagnosis, NoticeCode, RecordDiagnosis},
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Committed recordings of 10 kHz, healthy and faulty.
const RECORDINGS: [&str; 6] = ["r01", "r03", "r05", "r12", "r17", "r20"];
const RATE_HZ: f64 = 10_000.0;

/// Rows of a recording: times and what stands beside them.
struct Rows {
    head: String,
    times_s: Vec<f64>,
    values: Vec<Vec<f64>>,
}

impl Rows {
    fn of(name: &str) -> Self {
        let path = format!("../../fixtures/recordings/{name}.csv.gz");
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
        let recording = Recording::read(&path, &ColumnMap::default()).unwrap();
        let names = [PhaseACurrent, PhaseBCurrent, PhaseCCurrent, MotorAngle];
        let channels = names.map(|name| recording.channel(name).unwrap());
        let rows = 0..channels[0].values().len();
        let head = format!(
            "# command = \"chirp\"\n# rate-hz = 10000\ntime_s,{}\n",
            names.map(ChannelName::column).join(",")
        );
        Self {
            head,
            times_s: rows.clone().map(|row| row as f64 / RATE_HZ).collect(),
            values: rows.map(|row| channels.map(|one| one.values()[row]).to_vec()).collect(),
        }
    }

    fn len(&self) -> usize {
        self.times_s.len()
    }

    fn remove(&mut self, row: usize, rows: usize) {
        self.times_s.drain(row..row + rows);
        self.values.drain(row..row + rows);
    }

    /// Samples at other times, on a cubic through the four beside each.
    fn taken_at(&mut self, times_s: Vec<f64>) {
        let last = self.len() - 1;
        let taken = |time_s: &f64| {
            let place = time_s * RATE_HZ;
            let u = place - place.floor();
            let weights = [
                -u * (u - 1.0) * (u - 2.0) / 6.0,
                (u + 1.0) * (u - 1.0) * (u - 2.0) / 2.0,
                -(u + 1.0) * u * (u - 2.0) / 2.0,
                (u + 1.0) * u * (u - 1.0) / 6.0,
            ];
            let row = |tap: usize| (place.floor() as usize + tap).saturating_sub(1).min(last);
            let value = |channel: usize| -> f64 {
                weights.iter().enumerate().map(|(k, w)| w * self.values[row(k)][channel]).sum()
            };
            (0..4).map(value).collect::<Vec<_>>()
        };
        self.values = times_s.iter().map(taken).collect();
        self.times_s = times_s;
    }

    fn text(&self, decimals: usize) -> String {
        let mut text = self.head.clone();
        for (time_s, values) in self.times_s.iter().zip(&self.values) {
            write!(text, "{time_s:.decimals$}").unwrap();
            for value in values {
                write!(text, ",{value:.6}").unwrap();
            }
            text.push('\n');
        }
        text
    }
}

/// Answers to texts of recordings, in their order.
fn answers(texts: &[String], gaps: &str) -> Diagnosis {
    let folder = tempfile::tempdir().unwrap();
    for (index, text) in texts.iter().enumerate() {
        fs::write(folder.path().join(format!("r{index:03}.csv")), text).unwrap();
    }
    let mut command = Command::cargo_bin("fdi").unwrap();
    let words = ["diagnose", "--tolerance", "none", "--stable", "--output-format", "json"];
    let output = command.args(words).args(["--gaps", gaps]).arg(folder.path()).output().unwrap();
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A time axis as a logger may write it: the name, the change, the decimals.
type Case = (&'static str, fn(&mut Rows, &mut ChaCha8Rng), usize);

fn jitter(rows: &mut Rows, rng: &mut ChaCha8Rng, size: f64) {
    let off = |row: usize, rng: &mut ChaCha8Rng| {
        let normal: f64 = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        ((row as f64 + size * normal) / RATE_HZ).max(0.0)
    };
    let times_s = (0..rows.len()).map(|row| off(row, rng)).collect();
    rows.taken_at(times_s);
}

fn inside(rows: &Rows, rng: &mut ChaCha8Rng) -> usize {
    rng.random_range(100..rows.len() - 100)
}

/// Axes that give the very samples of the twin.
const WHOLE: [Case; 8] = [
    ("3 decimals", |_, _| {}, 3),
    ("4 decimals", |_, _| {}, 4),
    ("9 decimals", |_, _| {}, 9),
    (
        "cumulated",
        |rows, _| {
            let mut time_s = 0.0;
            for own_s in &mut rows.times_s {
                *own_s = time_s;
                time_s += 1e-4;
            }
        },
        17,
    ),
    ("100 ppm", |rows, _| rows.times_s.iter_mut().for_each(|time_s| *time_s *= 1.0001), 9),
    (
        "doubled",
        |rows, rng| {
            let row = inside(rows, rng);
            rows.times_s.insert(row, rows.times_s[row]);
            rows.values.insert(row, rows.values[row].clone());
        },
        6,
    ),
    (
        "doubled, 4 decimals",
        |rows, rng| {
            let row = inside(rows, rng);
            rows.times_s.insert(row, rows.times_s[row]);
            rows.values.insert(row, rows.values[row].clone());
        },
        4,
    ),
    (
        "swapped",
        |rows, rng| {
            let row = inside(rows, rng);
            rows.times_s.swap(row, row + 1);
            rows.values.swap(row, row + 1);
        },
        6,
    ),
];

/// Axes whose samples follow from others.
const MENDED: [Case; 7] = [
    (
        "one lost, 4 decimals",
        |rows, rng| {
            let row = inside(rows, rng);
            rows.remove(row, 1);
        },
        4,
    ),
    (
        "five lost, 6 decimals",
        |rows, rng| {
            for _ in 0..5 {
                let row = inside(rows, rng);
                rows.remove(row, 1);
            }
        },
        6,
    ),
    (
        "50 lost, 6 decimals",
        |rows, rng| {
            for _ in 0..50 {
                let row = inside(rows, rng);
                rows.remove(row, 1);
            }
        },
        6,
    ),
    (
        "a gap of 4",
        |rows, rng| {
            let row = inside(rows, rng);
            rows.remove(row, 4);
        },
        6,
    ),
    ("jitter of 0.001", |rows, rng| jitter(rows, rng, 0.001), 9),
    ("jitter of 0.05", |rows, rng| jitter(rows, rng, 0.05), 9),
    ("jitter of 0.3", |rows, rng| jitter(rows, rng, 0.3), 9),
];

fn texts(cases: &[Case]) -> Vec<String> {
    let mut rng = ChaCha8Rng::seed_from_u64(41);
    let mut texts = Vec::new();
    for (_, change, decimals) in cases {
        for name in RECORDINGS {
            let mut rows = Rows::of(name);
            change(&mut rows, &mut rng);
            texts.push(rows.text(*decimals));
        }
    }
    texts
}

fn twins() -> Vec<RecordDiagnosis> {
    let texts: Vec<_> = RECORDINGS.iter().map(|name| Rows::of(name).text(6)).collect();
    answers(&texts, "refuse").records
}

#[test]
fn an_axis_that_lacks_nothing_gives_the_answer_of_its_twin() {
    let found = answers(&texts(&WHOLE), "bridge");
    assert!(found.failed.is_empty(), "{:?}", found.failed);
    let twins = twins();
    for (index, record) in found.records.iter().enumerate() {
        let (twin, case) = (&twins[index % RECORDINGS.len()], WHOLE[index / RECORDINGS.len()].0);
        assert_eq!(record.verdict, twin.verdict, "{case} {}", record.recording);
        assert_eq!(record.faults, twin.faults, "{case} {}", record.recording);
    }
}

/// 42 recordings of 6 levels each, from one seed. A level is known to its standard deviation; what
/// mending moves is less, in 95 % of the levels.
#[test]
fn mended_samples_move_no_verdict_and_are_told() {
    let found = answers(&texts(&MENDED), "bridge");
    assert!(found.failed.is_empty(), "{:?}", found.failed);
    let twins = twins();
    let mut moved = Vec::new();
    for (index, record) in found.records.iter().enumerate() {
        let (twin, case) = (&twins[index % RECORDINGS.len()], MENDED[index / RECORDINGS.len()].0);
        assert_eq!(record.verdict, twin.verdict, "{case} {}", record.recording);
        let is_told = record.notices.iter().any(|one| one.code == NoticeCode::SamplesMended);
        assert!(is_told, "{case} {}", record.recording);
        for (fault, of_twin) in record.faults.iter().zip(&twin.faults).take(6) {
            let (value, std) = (fault.value.unwrap(), fault.std.unwrap());
            moved.push(((value - of_twin.value.unwrap()) / std).abs());
        }
    }
    moved.sort_by(f64::total_cmp);
    let most = moved[moved.len() * 95 / 100];
    assert!(most < 1.0, "{most}");
}

#[test]
fn a_clock_100_ppm_off_a_round_rate_is_taken_for_it_and_told() {
    let off = |name: &&str| {
        let mut rows = Rows::of(name);
        rows.head = rows.head.replace("# rate-hz = 10000\n", "");
        rows.times_s.iter_mut().for_each(|time_s| *time_s *= 1.0001);
        rows.text(9)
    };
    let found = answers(&RECORDINGS.iter().map(off).collect::<Vec<_>>(), "refuse");
    for (record, twin) in found.records.iter().zip(&twins()) {
        assert_eq!(record.faults, twin.faults, "{}", record.recording);
        let told = record.notices.iter().find(|one| one.code == NoticeCode::SamplesMended).unwrap();
        let expected = "the clock of `phase_a_current_a` is 9999.0001 Hz by its stamps, 100 ppm off \
                        10000 Hz, and times are at 10000 Hz; where the stamps are right, state \
                        `rate-hz = 9999.0001`";
        assert_eq!(told.message, expected);
    }
}

/// A phase alone lacks two cells of a recording that begins at 12.345678 s: its clock is filled to
/// other bits than the stamps of the other phases have.
#[test]
fn cells_that_one_phase_lacks_are_filled() {
    let mut rows = Rows::of("r12");
    rows.times_s.iter_mut().for_each(|time_s| *time_s += 12.345_678);
    let text = rows.text(6);
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for line in [1000, 3000] {
        let cells: Vec<_> = lines[line].split(',').collect();
        lines[line] = [cells[0], "", cells[2], cells[3], cells[4]].join(",");
    }
    let found = answers(&[lines.join("\n")], "bridge");
    assert!(found.failed.is_empty(), "{:?}", found.failed);
    let (record, twin) = (&found.records[0], &twins()[3]);
    assert_eq!(record.verdict, twin.verdict);
    for (fault, of_twin) in record.faults.iter().zip(&twin.faults).take(6) {
        let moved = (fault.value.unwrap() - of_twin.value.unwrap()).abs();
        assert!(moved < 0.5 * fault.std.unwrap(), "{fault:?}");
    }
}

#[test]
fn what_lacks_is_refused_with_its_line_unless_it_is_to_be_bridged() {
    let mut rows = Rows::of("r01");
    rows.remove(2500, 1);
    for decimals in [4, 6] {
        let found = answers(&[rows.text(decimals)], "refuse");
        let error = &found.failed[0].error;
        let expected = "line 2504: no sample of `phase_a_current_a` between 0.2499 s and 0.2501 s; \
                        the others are 0.0001 s apart (`--gaps bridge` fills what is lost)";
        assert_eq!(error, expected, "{decimals}");
    }
    // too long to be filled from its sides
    rows.remove(2500, 30);
    let found = answers(&[rows.text(6)], "bridge");
    let error = &found.failed[0].error;
    assert!(error.starts_with("line 2504: no sample of"), "{error}");
    assert!(!error.contains("--gaps"), "{error}");
}

#[test]
fn an_angle_that_is_logged_slower_than_the_currents_changes_nothing() {
    let slowly = |name: &str, rows_apart: usize| {
        let text = Rows::of(name).text(6);
        let kept = |(line, text): (usize, &str)| match text.rsplit_once(',') {
            Some((rest, _)) if line >= 3 && (line - 3) % rows_apart != 0 => format!("{rest},"),
            _ => text.to_owned(),
        };
        text.lines().enumerate().map(kept).collect::<Vec<_>>().join("\n")
    };
    let texts: Vec<String> =
        RECORDINGS.iter().flat_map(|name| [1, 20].map(|apart| slowly(name, apart))).collect();
    let answers = answers(&texts, "refuse").records;
    assert_eq!(answers.len(), texts.len());
    for of_one in answers.chunks(2) {
        let [twin, slow] = of_one else { panic!("two of each") };
        assert_eq!(slow.verdict, twin.verdict, "{}", slow.recording);
        for (slow, twin) in slow.faults.iter().zip(&twin.faults) {
            let (Some(level), Some(twin_level)) = (slow.value, twin.value) else { continue };
            let off = (level - twin_level).abs() / twin.std.unwrap();
            assert!(off < 0.3, "{} off by {off:.2}", slow.id);
        }
    }
}
