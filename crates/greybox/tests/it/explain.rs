//! Naming: what is hidden is found, what is not there is not.

use ema_sim::{Effect, EffectId, Geometry, Spread, model_file::MachineModel};
use greybox::{
    CommandKind, Explained, NumberInterval, Options, Record, Recordings, Verdict, explain,
};

use crate::bench_top::{Truth, model, recordings};

fn answer(truth: &Truth) -> Explained {
    explain(&model(), &recordings(truth), &Options::default()).expect("the recordings are good")
}

fn effect(id: EffectId, numbers: &[(&str, f64)]) -> Effect {
    numbers.iter().fold(Effect::new(id, Geometry::Rotary), |effect, (key, value)| {
        effect.with(key, *value).expect("a number of the effect")
    })
}

#[test]
fn a_worn_machine_as_modelled_is_adequate() {
    let truth = Truth { k1: 0.03, rough: [0.07, -0.15], seed: 1, ..Truth::default() };
    let answer = answer(&truth);
    assert_eq!(answer.verdict, Verdict::Adequate, "{:?}", answer.log);
    assert!(answer.effects.is_empty());
    let friction = &answer.faults[0];
    assert!((friction.after.value - 0.03).abs() < 4.0 * friction.after.std, "{friction:?}");
    // the base model comes back bit for bit
    assert_eq!(answer.extend(&model()), model());
}

/// Damage does what a friction of the file does that may be 30 % off, and the answer says so; beside
/// numbers that were measured the level is not ambiguous.
#[test]
fn a_friction_that_may_be_off_leaves_damage_open() {
    let truth = Truth { k1: 0.03, seed: 1, ..Truth::default() };
    let answer = |options: &Options| {
        explain(&model(), &recordings(&truth), options).expect("the recordings are good")
    };
    let open = answer(&Options::default()).faults.swap_remove(0);
    assert_eq!(open.key, "k1");
    assert!(open.ambiguous_with.iter().any(|key| key == "axis.kinetic-friction-n-m"), "{open:?}");
    let exact: Vec<String> = open.ambiguous_with.clone();
    let known = answer(&Options { exact, ..Options::default() }).faults.swap_remove(0);
    assert!(known.ambiguous_with.is_empty(), "{known:?}");
    assert!(known.after.std < 0.5 * open.after.std, "{known:?} {open:?}");
    // damage that is less likely than a wrong file is in the interval too
    let worn = Truth { k1: 0.2, seed: 1, ..Truth::default() };
    let level = |options: &Options| {
        let answer =
            explain(&model(), &recordings(&worn), options).expect("the recordings are good");
        answer.faults.into_iter().next().expect("k1")
    };
    let open = level(&Options::default());
    let [low, high] = open.after.interval_95;
    assert!(low <= 0.2 && 0.2 <= high && !open.ambiguous_with.is_empty(), "{open:?}");
    let exact = open.ambiguous_with;
    let known = level(&Options { exact, ..Options::default() }).after;
    let [low, high] = known.interval_95;
    assert!(low <= 0.2 && 0.2 <= high && high - low < 0.1, "{known:?}");
}

#[test]
fn the_extended_model_misses_nothing_more() {
    let cogging = effect(EffectId::Cogging, &[("cogging_sin_n_m", 0.003), ("order", 12.0)]);
    let truth = Truth { effects: vec![cogging], rough: [0.05, 0.1], seed: 3, ..Truth::default() };
    let first = answer(&truth);
    let extended = first.extend(&model());
    let again = explain(&extended, &recordings(&truth), &Options::default()).expect("good ones");
    assert_eq!(again.verdict, Verdict::Adequate, "{:?}", again.log);
    // the numbers fitted beside the effect are those of the extended model
    let stated = ["axis.inertia-kg-m2", "axis.viscous-n-m-s-per-rad"].map(str::to_owned);
    for (before, after) in first.rough.iter().zip(&again.rough) {
        assert_eq!(before.fitted, after.nominal, "{before:?}");
        // what the recordings hardly show stays nearer to its file each time
        let most = if stated.contains(&before.key) { 0.01 } else { 0.02 };
        assert!((after.fitted / after.nominal - 1.0).abs() < most, "{before:?} {after:?}");
    }
    assert!(first.rough.iter().any(|one| (one.fitted / one.nominal - 1.0).abs() > 0.03));
    let [_, before] = first.holdout_rms.expect("judged");
    let [after, _] = again.holdout_rms.expect("judged");
    assert!((after / before - 1.0).abs() < 0.01, "{before} {after}");
}

#[test]
fn a_number_without_tolerance_keeps_its_place() {
    let cogging = effect(EffectId::Cogging, &[("cogging_sin_n_m", 0.003), ("order", 12.0)]);
    let truth = Truth { effects: vec![cogging], rough: [0.0, 0.1], seed: 4, ..Truth::default() };
    let mut exact = model();
    let MachineModel::ServoAxis(axis) = &mut exact else { panic!("an axis") };
    axis.tolerance[0].spread = Spread::HalfWidth(0.0);
    let answer = explain(&exact, &recordings(&truth), &Options::default()).expect("good ones");
    let of = |key: &str| answer.rough.iter().find(|one| one.key.contains(key)).expect("a number");
    let (inertia, viscous) = (of("inertia"), of("viscous"));
    assert_eq!(inertia.nominal, inertia.fitted, "{inertia:?}");
    assert!((viscous.fitted / viscous.nominal - 1.1).abs() < 0.05, "{viscous:?}");
}

/// A number without a stated tolerance may be off by the usual one; beyond it the file is wrong, and
/// that is no effect.
#[test]
fn friction_that_the_file_has_wrong_is_told_as_a_number() {
    const KEY: &str = "axis.kinetic-friction-n-m";
    let within = answer(&Truth { friction: [-0.2; 2], seed: 6, ..Truth::default() });
    assert_eq!(within.verdict, Verdict::Adequate, "{:#?}", within.log);
    assert!(within.numbers.is_empty(), "{:?}", within.numbers);

    let truth = Truth { friction: [-0.55; 2], seed: 7, ..Truth::default() };
    let beyond = answer(&truth);
    assert_eq!((beyond.verdict, beyond.effects.len()), (Verdict::Named, 0), "{:#?}", beyond.log);
    let friction = beyond.numbers.iter().find(|number| number.key == KEY).expect("friction");
    let [least, most] = friction.interval_95;
    assert!(least < 0.009 && 0.009 < most && most < 0.7 * friction.nominal, "{friction:?}");
    let extended = beyond.extend(&model());
    let again = explain(&extended, &recordings(&truth), &Options::default()).expect("good ones");
    assert_eq!(again.verdict, Verdict::Adequate, "{:#?}", again.log);
    assert!(again.numbers.is_empty(), "{:?}", again.numbers);

    // a static friction that shows in what is held out alone is no effect
    let sticking = answer(&Truth { friction: [-0.55, 0.0], seed: 7, ..Truth::default() });
    assert_eq!((sticking.verdict, sticking.effects.len()), (Verdict::Unknown, 0));
    assert!(sticking.numbers.iter().any(|number| number.key == KEY), "{:?}", sticking.numbers);

    // who pins it is not told so
    let pinned = Options { exact: vec![KEY.to_owned()], ..Options::default() };
    let pinned = explain(&model(), &recordings(&truth), &pinned).expect("good ones");
    assert!(pinned.numbers.is_empty() && pinned.verdict != Verdict::Adequate, "{:#?}", pinned.log);

    let unknown = Options { exact: vec!["axis.colour".to_owned()], ..Options::default() };
    let error = explain(&model(), &recordings(&truth), &unknown).expect_err("no such number");
    assert_eq!(
        error.to_string(),
        "`axis.colour`: no number of the machine, expected a key of its model file"
    );
}

#[test]
fn what_is_hidden_is_named_with_its_size_and_no_longer_read_as_damage() {
    let hidden = [
        effect(EffectId::Stribeck, &[("stribeck_n_m", 0.006), ("stribeck_speed_rad_per_s", 1.0)]),
        effect(EffectId::DirectionalFriction, &[("viscous_asymmetry_n_m_s_per_rad", 5e-4)]),
        effect(EffectId::LoadFriction, &[("load_share_ratio", 0.1)]),
        effect(EffectId::Cogging, &[("cogging_sin_n_m", 0.003), ("order", 12.0)]),
        effect(EffectId::CurrentSensor, &[("gain_error_ratio", 0.05)]),
    ];
    for (seed, hidden) in hidden.into_iter().enumerate() {
        let id = hidden.id();
        let truth = Truth {
            effects: vec![hidden.clone()],
            k1: 0.02,
            rough: [0.05, 0.1],
            seed: 10 + seed as u64,
            ..Truth::default()
        };
        let answer = answer(&truth);
        assert_eq!(answer.verdict, Verdict::Named, "{id:?}: {:#?}", answer.log);
        let found = &answer.effects[0];
        assert_eq!(found.effect.id(), id);
        let NumberInterval { key, interval_95: [least, most] } = &found.interval_95[0];
        let (size, width) = (hidden.get(key).expect("the same number"), most - least);
        assert!(size > least - width && size < most + width, "{id:?}: {found:?}");
        let friction = &answer.faults[0];
        assert!(
            (friction.after.value - 0.02).abs() < 4.0 * friction.after.std,
            "{id:?}: {friction:?}"
        );
        let [before, after] = answer.holdout_rms.expect("judged");
        let floor = answer.noise_floor.expect("judged").rms;
        assert!(before > 1.05 * floor && after < 1.05 * floor, "{id:?}: {before} {after} {floor}");
    }
}

#[test]
fn a_torque_that_no_recording_repeats_is_not_taken_for_noise() {
    let truth = Truth { telegraph_n_m: 0.004, seed: 5, ..Truth::default() };
    let answer = answer(&truth);
    // in the difference of two takes it looks like noise; the controller answered to it
    let left_over = answer.remainder.is_some();
    let verdicts = [Verdict::Unknown, Verdict::NamedWithRemainder];
    assert!(left_over && verdicts.contains(&answer.verdict), "{:#?}", answer.log);
}

#[test]
fn what_does_not_fit_where_it_was_fitted_is_not_adequate() {
    let good = recordings(&Truth::default());
    let mut swapped = good.train[0].clone();
    for value in &mut swapped.drive {
        *value = -*value;
    }
    let recordings = Recordings { train: vec![swapped], holdout: good.holdout, repeat: Vec::new() };
    let answer = explain(&model(), &recordings, &Options::default()).expect("good recordings");
    assert_ne!(answer.verdict, Verdict::Adequate);
}

#[test]
fn the_answer_does_not_depend_on_the_number_of_threads() {
    let hidden = effect(EffectId::Cogging, &[("cogging_sin_n_m", 0.003), ("order", 12.0)]);
    let truth = Truth { effects: vec![hidden], seed: 3, ..Truth::default() };
    let of = |jobs: usize| {
        let options = Options { jobs, ..Options::default() };
        explain(&model(), &recordings(&truth), &options).expect("the recordings are good")
    };
    assert_eq!(of(1), of(2));
}

#[test]
fn another_seed_of_the_draws_changes_the_chance_and_not_the_name() {
    let hidden = effect(EffectId::Imbalance, &[("spring_n_m_per_rad", 0.001)]);
    let truth = Truth { effects: vec![hidden], seed: 4, ..Truth::default() };
    let of = |seed: u64| {
        let options = Options { seed, ..Options::default() };
        explain(&model(), &recordings(&truth), &options).expect("the recordings are good")
    };
    let ids = |answer: &Explained| -> Vec<EffectId> {
        answer.effects.iter().map(|found| found.effect.id()).collect()
    };
    assert_eq!(ids(&of(0)), ids(&of(1)));
}

#[test]
fn without_the_gates_noise_is_given_a_name() {
    // the calibration is live: where it is switched off, false alarms come
    let open = Options {
        false_alarm_rate: 1.0,
        gain_std_errors: -10.0,
        evidence_nats: -1e3,
        ..Options::default()
    };
    let truth = Truth { seed: 5, ..Truth::default() };
    let answer = explain(&model(), &recordings(&truth), &open).expect("the recordings are good");
    assert!(!answer.effects.is_empty(), "{:?}", answer.log);
}

#[test]
fn recordings_that_do_not_suffice_are_told_so() {
    let truth = Truth::default();
    let explained = |change: &dyn Fn(&mut Recordings)| {
        let mut recordings = recordings(&truth);
        change(&mut recordings);
        explain(&model(), &recordings, &Options::default())
    };
    let one =
        explained(&|r| *r = Recordings { train: vec![r.train.remove(0)], ..Default::default() });
    let one = one.expect("an answer");
    assert_eq!(one.verdict, Verdict::Inconclusive);
    assert!(one.reason.is_some_and(|reason| reason.starts_with("one recording alone")));

    let blind = explained(&|r| r.train[0].position = None).expect("an answer");
    assert!(blind.reason.is_some_and(|reason| reason.contains("no position of the motor")));

    let peak =
        recordings(&truth).holdout[0].drive.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    for level in [0.05, 0.83 * peak] {
        let clipped = explained(&|r| {
            for x in &mut r.holdout[0].drive {
                *x = x.clamp(-level, level);
            }
        });
        let clipped = clipped.expect("an answer");
        assert_eq!(clipped.verdict, Verdict::Inconclusive);
        assert!(clipped.reason.is_some_and(|reason| reason.contains("the signal is clipped")));
    }

    let none = explained(&|r| r.train.clear()).expect_err("nothing to fit");
    assert_eq!(none.to_string(), "no recording to train on");
}

#[test]
fn a_channel_of_another_length_is_named() {
    let record = Record {
        name: "short.csv".to_owned(),
        rate_hz: 1000.0,
        command: vec![0.0; 300],
        kind: CommandKind::Position,
        drive: vec![0.0; 300],
        position: Some(vec![0.0; 299]),
        load: None,
        filter_hz: None,
        start_rad: None,
    };
    let error = record.check().expect_err("one sample too few");
    assert_eq!(error.to_string(), "short.csv: 299 samples of position, 300 of the drive");
}
