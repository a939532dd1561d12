//! The signal chain on machines whose recordings are sound, whatever the machine hides: no channel
//! is called wrong.

use std::path::Path;

use fdi_core::{
    ColumnMap, ComparedSignals, Recording, ema_sim::model_file::MachineModel, read_machine,
};
use greybox::{Record, Recordings, SignalFault, check_signals};
use greybox_blind::{Case, Class, Role};

use crate::binary::fdi;

/// Seeds of these cases: neither those of development nor the scored ones.
const SEEDS: u64 = 11 << 16;
/// Cases of a class.
const CASES: u64 = 6;

fn record(path: &Path, model: &MachineModel) -> Record {
    let recording = Recording::read(path, &ColumnMap::default()).unwrap();
    let signals = ComparedSignals::of_recording(&recording, model, None).unwrap();
    Record {
        name: path.display().to_string(),
        rate_hz: signals.rate_hz,
        command: signals.command,
        kind: signals.kind,
        drive: signals.drive,
        position: signals.position,
        load: signals.load,
        filter_hz: signals.filter_hz,
        start_rad: signals.start_rad,
    }
}

fn faults_of(case: &Case) -> Vec<SignalFault> {
    let folder = tempfile::tempdir().unwrap();
    let files = case.write(folder.path()).unwrap();
    let model = read_machine(folder.path().join("nominal.toml").to_str().unwrap()).unwrap();
    let of = |role: Role| {
        let files = files.iter().filter(|file| file.role == role);
        files.map(|file| record(&folder.path().join(&file.name), &model)).collect()
    };
    let recordings =
        Recordings { train: of(Role::Train), holdout: of(Role::HoldOut), repeat: of(Role::Repeat) };
    check_signals(&model, &recordings).unwrap().faults
}

/// A late current channel is one, whether it is the sensor's or the log's: the blind E19 that is as
/// late as that is the only hidden effect that may be told as a channel.
#[test]
fn no_hidden_effect_is_called_a_wrong_channel() {
    let mut told = Vec::new();
    for class in Class::ALL {
        for number in 0..CASES {
            let Ok(case) = Case::draw(SEEDS | number, class) else { continue };
            for fault in faults_of(&case) {
                let hidden = &case.truth().hidden;
                let late = hidden.iter().any(|h| h.symbol == "E19") && fault.code.name() == "late";
                let hidden: Vec<_> = hidden.iter().map(|h| h.symbol).collect();
                let line =
                    format!("{class:?} {number} {hidden:?}: {} {}", fault.code.name(), fault.told);
                eprintln!("{line}");
                if !late {
                    told.push(line);
                }
            }
        }
    }
    assert!(told.is_empty(), "{told:#?}");
}

/// Recordings of `fdi simulate` as they come, with noise, steps of a converter and electronics.
#[test]
fn healthy_recordings_are_sound() {
    let folder = tempfile::tempdir().unwrap();
    let ema_270 = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/models/ema-270.toml");
    for name in ["ema-48", "bench", ema_270] {
        let model = read_machine(name).unwrap();
        for fidelity in ["high", "low"] {
            let of = |command: &str| {
                let path = folder.path().join(format!("{fidelity}-{command}.csv"));
                let file = path.to_str().unwrap();
                let options = ["simulate", "--model", name, "--command", command, "--fidelity"];
                let more = [fidelity, "--noise-a", "0.02", "--adc-bits", "12", "-q", "-o", file];
                let (status, _, said) = fdi(&[&options[..], &more].concat());
                assert_eq!(status, 0, "{said}");
                record(&path, &model)
            };
            let recordings = Recordings {
                train: vec![of("chirp")],
                holdout: vec![of("sine")],
                repeat: Vec::new(),
            };
            let faults = check_signals(&model, &recordings).unwrap().faults;
            assert!(faults.is_empty(), "{name} {fidelity}: {faults:#?}");
        }
    }
}
