//! Calibration: the numbers that are true are found, and what is not determined is said.

use ema_sim::model_file::MachineModel;
use greybox::{Recordings, calibrate};

use crate::bench_top::{Motion, Truth, model, record, recordings};

#[test]
fn inertia_and_drag_are_found_within_their_intervals() {
    let truth = Truth { rough: [0.08, -0.15], seed: 21, ..Truth::default() };
    let calibrated = calibrate(&model(), &recordings(&truth), 1).expect("good recordings");
    let number = |key: &str| {
        let found = calibrated.numbers.iter().find(|number| number.key.starts_with(key));
        found.unwrap_or_else(|| panic!("{key} among {:?}", calibrated.numbers))
    };
    for (key, value) in
        [("axis.inertia", 1.08e-3), ("axis.kinetic-friction", 0.02), ("drive.torque-constant", 0.1)]
    {
        let found = number(key);
        assert!(found.determined, "{found:?}");
        assert!((found.value - value).abs() < 4.0 * found.std, "{found:?}");
    }
    let [before, after] = calibrated.holdout_rms.expect("a recording was held out");
    assert!(after < before && after < 1.05 * calibrated.noise_floor.rms, "{before} {after}");
    let MachineModel::ServoAxis(found) = &calibrated.model else { panic!("another machine") };
    assert_eq!(found.axis.inertia, number("axis.inertia").value);
}

#[test]
fn a_number_that_standstill_cannot_tell_keeps_its_nominal_value() {
    let truth = Truth { seed: 22, ..Truth::default() };
    let mut still = record(&truth, Motion::Waves, 2.0, 0);
    still.drive.truncate(400);
    still.command.truncate(400);
    still.position.as_mut().expect("measured").truncate(400);
    still.load.as_mut().expect("measured").truncate(400);
    let recordings = Recordings { train: vec![still], ..Recordings::default() };
    let calibrated = calibrate(&model(), &recordings, 1).expect("a good recording");
    assert!(calibrated.numbers.iter().all(|number| !number.determined), "{:?}", calibrated.numbers);
    assert_eq!(calibrated.model, model());
}

#[test]
fn a_recording_that_was_cut_calibrates_nothing() {
    let mut cut = recordings(&Truth { seed: 21, ..Truth::default() });
    let peak = cut.train[1].drive.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    cut.train[1].drive.iter_mut().for_each(|x| *x = x.clamp(-0.8 * peak, 0.8 * peak));
    let refused = calibrate(&model(), &cut, 1).expect_err("cut").to_string();
    let name = &cut.train[1].name;
    assert!(refused.starts_with(&format!("{name}: the signal is clipped: ")), "{refused}");
}
