//! Diagnosis on few numbers of a recording.

use std::path::Path;

use fdi_core::{
    Bundle, ColumnMap, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Encoding, Recording,
    report::{NoticeCode, RecordDiagnosis},
};

/// Standard deviations that an estimate may be off: six levels and four encodings exceed it
/// with a chance of 24·6e-7 if the deviations are right.
const DEVIATIONS: f64 = 5.0;
/// A deviation that is equal in theory may be this much smaller by the scatter of the
/// cross-fitted covariance: a hundred errors tell a deviation to 1/√200.
const NARROWER_REL: f64 = 0.07;

fn recordings() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/recordings")
}

/// The levels k1 to k7 of a committed recording.
fn truth(name: &str) -> Vec<f64> {
    let text = std::fs::read_to_string(recordings().join("truth.csv")).unwrap();
    let head: Vec<&str> = text.lines().find(|l| !l.starts_with('#')).unwrap().split(',').collect();
    let row: Vec<&str> = text.lines().find(|l| l.starts_with(name)).unwrap().split(',').collect();
    (1..=7)
        .map(|k| {
            let column = head.iter().position(|field| *field == format!("k{k}")).unwrap();
            row[column].parse().unwrap()
        })
        .collect()
}

fn diagnosed(name: &str, encoding: Encoding) -> RecordDiagnosis {
    let bundle = Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes).unwrap();
    let diagnoser = Diagnoser::with_encoding(bundle, encoding).unwrap();
    let path = recordings().join(format!("{name}.csv.gz"));
    let recording = Recording::read(&path, &ColumnMap::default()).unwrap();
    diagnoser.diagnose(&recording, &DiagnoseOptions::default()).unwrap()
}

#[test]
fn every_encoding_finds_the_levels_within_its_wider_intervals() {
    const NAME: &str = "r16";
    let truth = truth(NAME);
    let full = diagnosed(NAME, Encoding::Full);
    for encoding in Encoding::ALL {
        let answer = diagnosed(NAME, encoding);
        let says = answer.notices.iter().any(|notice| notice.code == NoticeCode::Encoded);
        assert_eq!(says, encoding != Encoding::Full);
        for k in 0..6 {
            let std = |answer: &RecordDiagnosis| answer.faults[k].std.unwrap();
            let away = (answer.faults[k].value.unwrap() - truth[k]).abs();
            let name = encoding.word();
            assert!(away <= DEVIATIONS * std(&answer), "{name} k{}: {away}", k + 1);
            let (narrow, wide) = (std(&full), std(&answer));
            assert!(wide >= (1.0 - NARROWER_REL) * narrow, "{name} k{}: {wide} {narrow}", k + 1);
        }
    }
}
