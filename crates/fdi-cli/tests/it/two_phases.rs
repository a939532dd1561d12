//! Two phases of a star.

use std::{fmt::Write, fs, path::Path};

use assert_cmd::Command;
use fdi_core::{
    ChannelName::{self, MotorAngle, PhaseACurrent, PhaseBCurrent, PhaseCCurrent},
    ColumnMap, Recording,
    report::{Diagnosis, NoticeCode},
};

/// Most that standard deviations grow. Of noise alone: half the difference of two recorded phases has
/// half the variance of a phase; with a computed one, which holds minus the noise of both, it has 5/4.
/// A third of the time conducts through each pair: (1/2 + 5/4 + 5/4)/3 over 1/2 is 2.
const MOST_RATIO: f64 = std::f64::consts::SQRT_2;
/// Standard deviations of the twin with all three phases that a level may move. By those bounds the
/// difference has at most the twin's variance; of 18 levels one is beyond 3.5 with a chance of 0.8 %.
const MOST_MOVED: f64 = 3.5;

fn answer(path: &Path) -> Diagnosis {
    let words = ["diagnose", "--tolerance", "none", "--stable", "--output-format", "json"];
    let output = Command::cargo_bin("fdi").unwrap().args(words).arg(path).output().unwrap();
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Some channels of a recording of a chirp.
fn text(path: &Path, names: [ChannelName; 3]) -> String {
    let recording = Recording::read(path, &ColumnMap::default()).unwrap();
    let channels = names.map(|name| recording.channel(name).unwrap());
    let columns = names.map(ChannelName::column).join(",");
    let mut text = format!("# command = \"chirp\"\ntime_s,{columns}\n");
    for (row, time_s) in channels[0].times_s().iter().enumerate() {
        let [one, other, angle] = channels.map(|channel| channel.values()[row]);
        writeln!(text, "{time_s:.6},{one:.6},{other:.6},{angle:.6}").unwrap();
    }
    text
}

#[test]
fn two_phases_give_the_answer_of_three_and_say_so() {
    let folder = tempfile::tempdir().unwrap();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/recordings");
    let recorded = [
        ("r01", [PhaseBCurrent, PhaseCCurrent]),
        ("r04", [PhaseACurrent, PhaseCCurrent]),
        ("r12", [PhaseACurrent, PhaseBCurrent]),
    ];
    for (name, [one, other]) in recorded {
        let three = fixtures.join(format!("{name}.csv.gz"));
        let two = folder.path().join(format!("{name}.csv"));
        fs::write(&two, text(&three, [one, other, MotorAngle])).unwrap();
        let (twin, found) = (answer(&three), answer(&two));
        let (twin, found) = (&twin.records[0], &found.records[0]);
        assert_eq!(found.verdict, twin.verdict, "{name}");
        assert!(found.notices.iter().any(|one| one.code == NoticeCode::PhaseComputed), "{name}");
        for (fault, of_twin) in found.faults.iter().zip(&twin.faults).take(6) {
            let [std, twins_std] = [fault, of_twin].map(|one| one.std.unwrap());
            let moved = (fault.value.unwrap() - of_twin.value.unwrap()).abs() / twins_std;
            assert!(moved < MOST_MOVED && std < MOST_RATIO * twins_std, "{name} {fault:?}");
        }
    }
}
