//! A diagnosis for the tests of the batch machinery: not of this world, but with
//! every form that an answer can have. It reads the wanted form off the file name.

use std::{fs, path::Path, thread, time::Duration};

use anyhow::{Result, bail};
use clap::Parser;
use fdi_cli::{Cli, Diagnoser, Streams, args::Command, diagnose_with};
use fdi_core::{
    Recording,
    report::{
        Covariance, Fault, FaultId, Fidelity, Finding, FindingKind, Fit, Method, NoiseSource,
        Notice, NoticeCode, RecordDiagnosis, Status, Verdict,
    },
};

pub(crate) struct StandIn;

impl Diagnoser for StandIn {
    fn bundle_sha256(&self) -> &'static str {
        "00ff"
    }

    fn rates_hz(&self) -> &[f64] {
        &[2000.0]
    }

    fn diagnose(&self, recording: &Recording) -> Result<RecordDiagnosis> {
        recording.require_current()?;
        let name = Path::new(&recording.name).file_stem().unwrap().to_string_lossy().into_owned();
        // so that later recordings overtake earlier ones
        thread::sleep(Duration::from_micros(name.len() as u64 % 3 * 700));
        match name.split('-').next().unwrap() {
            "healthy" => Ok(record(recording, Verdict::Healthy, [0.0; 7])),
            "faulty" => {
                let levels = [0.031, 0.02, 0.0, 0.06, 0.0, 0.012, 0.75];
                Ok(record(recording, Verdict::Faulty, levels))
            }
            "half" => {
                let mut record = partial(recording);
                record.verdict = Verdict::Faulty;
                let interval = [0.01, 0.03];
                let level = Fault::determined(FaultId::K2, 0.02, 0.005, interval, Some(true));
                record.faults[FaultId::K2 as usize] = level;
                Ok(record)
            }
            "partial" => Ok(partial(recording)),
            "unit" => {
                let mut record = record(recording, Verdict::Faulty, [0.0; 7]);
                record.findings = findings().into();
                Ok(record)
            }
            "strange" => {
                let mut record = record(recording, Verdict::ModelInadequate, [0.0; 7]);
                record.fit.rms_a = 0.0126;
                record.fit.adequate = false;
                Ok(record)
            }
            "broken" => {
                let mut record = record(recording, Verdict::Healthy, [0.0; 7]);
                record.faults[1].std = Some(f64::NAN);
                Ok(record)
            }
            "panic" => panic!("a defect"),
            other => bail!("`{other}` is refused: 25 Hz, the bundle is for 2000 Hz"),
        }
    }
}

fn record(recording: &Recording, verdict: Verdict, levels: [f64; 7]) -> RecordDiagnosis {
    let std = 0.002;
    let faults = FaultId::ALL.map(|id| {
        let value = levels[id as usize];
        let interval = [value - 1.96 * std, value + 1.96 * std];
        let detected = (id != FaultId::K7).then_some(value > 0.01);
        if id == FaultId::K7 && levels[5] < 0.01 {
            return Fault::undetermined(id);
        }
        Fault::determined(id, value, std, interval, detected)
    });
    RecordDiagnosis {
        recording: recording.name.clone(),
        recording_sha256: None,
        actuator_id: None,
        date: None,
        operator: None,
        status: Status::Ok,
        verdict,
        bundle: None,
        method: Method::Gls,
        fidelity: Fidelity::Low,
        evaluations: 18,
        elapsed_s: None,
        discrepancy: 0.041,
        fit: Fit {
            rms_a: 0.0036,
            noise_floor_a: 0.0035,
            noise_a: 0.02,
            noise_source: NoiseSource::OutOfBand,
            adequate: true,
        },
        faults: faults.into(),
        findings: Vec::new(),
        identifiability: Vec::new(),
        action: None,
        covariance: Covariance {
            parameters: vec!["k1".to_owned()],
            estimate: vec![0.02],
            matrix: vec![vec![4e-6]],
        },
        notices: Vec::new(),
        together: Vec::new(),
    }
}

/// One finding of each kind, and one that is not detected.
fn findings() -> [Finding; 3] {
    let known = Finding {
        kind: FindingKind::Known,
        id: "torque-constant".to_owned(),
        members: ["k3", "k4", "k5", "motor.back-emf-v-s-per-rad"].map(str::to_owned).into(),
        value: 0.2,
        std: 0.04,
        interval_95: [0.12, 0.28],
        detected: true,
        prior_std: 0.039,
        posterior_std: 0.009,
        would_tell: None,
    };
    let ambiguous = Finding {
        kind: FindingKind::Ambiguous,
        id: "friction".to_owned(),
        members: ["k1", "transmission.kinetic-friction-n-m"].map(str::to_owned).into(),
        detected: false,
        would_tell: Some("recordings of the same unit as new".to_owned()),
        ..known.clone()
    };
    let undetected = Finding { id: "play".to_owned(), detected: false, ..known.clone() };
    [known, ambiguous, undetected]
}

fn partial(recording: &Recording) -> RecordDiagnosis {
    let mut record = record(recording, Verdict::Undetermined, [0.0; 7]);
    for id in [FaultId::K3, FaultId::K4, FaultId::K5] {
        record.faults[id as usize] = Fault::undetermined(id);
    }
    record.status = Status::Partial;
    let message = "the start angle is not known".to_owned();
    record.notices.push(Notice { code: NoticeCode::StartAngleUnknown, message });
    record
}

/// A recording that can be read.
pub(crate) const GOOD: &str = "time_s,current_a\n0,1\n0.0005,2\n0.001,3\n";

/// A folder with the named files.
pub(crate) fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// What a command came to.
pub(crate) struct Outcome {
    pub(crate) code: u8,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Outcome {
    /// All of it, without the name of the temporary folder and the version.
    pub(crate) fn text(&self, folder: &Path) -> String {
        let text = format!("exit {}\n--- stdout\n{}--- stderr\n{}", self.code, self.out, self.err);
        let version = concat!("fdi ", env!("CARGO_PKG_VERSION"));
        text.replace(&folder.display().to_string(), "[folder]").replace(version, "fdi [version]")
    }
}

/// Runs `fdi diagnose` with the stand-in, as if neither stream were a terminal.
pub(crate) fn diagnose(arguments: &[&str]) -> Outcome {
    let mut outcome = diagnose_coloured(arguments);
    outcome.out = anstream::adapter::strip_str(&outcome.out).to_string();
    outcome
}

/// Runs `fdi diagnose` with the stand-in, as if both streams wanted colours.
pub(crate) fn diagnose_coloured(arguments: &[&str]) -> Outcome {
    try_diagnose(arguments).unwrap()
}

/// The same, or what keeps the command from being done at all.
pub(crate) fn try_diagnose(arguments: &[&str]) -> Result<Outcome> {
    let command_line = ["fdi", "diagnose"].iter().chain(arguments);
    let cli = Cli::try_parse_from(command_line).unwrap();
    let Command::Diagnose(args) = &cli.command else { panic!("diagnose") };
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let mut streams = Streams { out: &mut out, err: &mut err, is_terminal: false };
    let status = diagnose_with(&StandIn, args, &cli.global, &mut streams)?;
    let text = |bytes| String::from_utf8(bytes).unwrap();
    Ok(Outcome { code: status.code(), out: text(out), err: text(err) })
}
