//! Phases in another order or sense than the columns state.

use std::{fmt::Write, fs, path::Path};

use assert_cmd::Command;
use fdi_core::{
    ChannelName::{MotorAngle, PhaseACurrent, PhaseBCurrent, PhaseCCurrent},
    ColumnMap, Recording,
    report::{Diagnosis, NoticeCode, RecordDiagnosis},
};

/// A recording with columns under these names, the phases A, B and C behind them times a sign.
fn text(path: &Path, header: &str, sign: f64) -> String {
    let recording = Recording::read(path, &ColumnMap::default()).unwrap();
    let names = [PhaseACurrent, PhaseBCurrent, PhaseCCurrent, MotorAngle];
    let channels = names.map(|name| recording.channel(name).unwrap());
    let mut text = format!("# command = \"chirp\"\ntime_s,{header},motor_angle_rad\n");
    for (row, time_s) in channels[0].times_s().iter().enumerate() {
        let [a, b, c, angle_rad] = channels.map(|channel| channel.values()[row]);
        writeln!(text, "{time_s},{},{},{},{angle_rad}", sign * a, sign * b, sign * c).unwrap();
    }
    text
}

fn answer(path: &Path, words: &[&str]) -> RecordDiagnosis {
    let always = ["diagnose", "--tolerance", "none", "--stable", "--output-format", "json"];
    let mut command = Command::cargo_bin("fdi").unwrap();
    let output = command.args(always).args(words).arg(path).output().unwrap();
    let document: Diagnosis = serde_json::from_slice(&output.stdout).unwrap();
    document.records.into_iter().next().unwrap()
}

/// The options that state how the phases were read.
fn told(answer: &RecordDiagnosis) -> Option<String> {
    let mut notices = answer.notices.iter();
    let told = notices.find(|one| one.code == NoticeCode::PhasesRewired)?;
    Some(told.message.split('`').nth(1).unwrap().to_owned())
}

#[test]
fn phases_in_another_order_give_the_same_answer_and_the_option_that_states_it() {
    let folder = tempfile::tempdir().unwrap();
    let recordings = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/recordings");
    let file = folder.path().join("r.csv");
    // true levels: none; 4.4 % of the turns of B
    for name in ["r01", "r12"] {
        let recorded = recordings.join(format!("{name}.csv.gz"));
        let put = |header, sign| fs::write(&file, text(&recorded, header, sign)).unwrap();
        put("phase_a_current_a,phase_b_current_a,phase_c_current_a", 1.0);
        let plain = answer(&file, &[]);
        assert_eq!(told(&plain), None);
        put("phase_c_current_a,phase_a_current_a,phase_b_current_a", -1.0);
        let mut rewired = answer(&file, &[]);
        let options = told(&rewired).unwrap();
        let want = "--map phase_a_current_a=phase_c_current_a*-1 \
                    --map phase_b_current_a=phase_a_current_a*-1 \
                    --map phase_c_current_a=phase_b_current_a*-1";
        assert_eq!(options, want);
        rewired.notices.retain(|one| one.code != NoticeCode::PhasesRewired);
        assert_eq!(rewired, plain, "{name}");
        let words: Vec<&str> = options.split(' ').collect();
        assert_eq!(answer(&file, &words), plain, "{name}");
    }
}
