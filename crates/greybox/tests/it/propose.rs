//! The recording to take next.

use ema_sim::{Effect, EffectId, Geometry};
use greybox::{Options, Recordings, propose};

use crate::bench_top::{Motion, Truth, model, record};

fn recordings(effects: Vec<Effect>) -> Recordings {
    let truth = Truth { effects, seed: 6, ..Truth::default() };
    // there and back without a rest: an offset of the current sensor looks like dry friction
    // that is larger one way
    Recordings {
        train: vec![record(&truth, Motion::Back, 6.0, 0)],
        holdout: vec![record(&truth, Motion::Back, 5.0, 2)],
        repeat: vec![record(&truth, Motion::Back, 6.0, 3)],
    }
}

#[test]
fn a_standstill_tells_an_offset_from_friction_that_is_larger_one_way() {
    let offset = Effect::new(EffectId::CurrentSensor, Geometry::Rotary).with("offset_a", 0.02);
    let recordings = recordings(vec![offset.expect("a number of the effect")]);
    let proposal = propose(&model(), &recordings, &Options::default()).expect("good recordings");
    let pair = [EffectId::CurrentSensor, EffectId::DirectionalFriction];
    assert!(pair.iter().all(|id| proposal.open.contains(id)), "{:?}", proposal.open);
    let best = &proposal.menu[0];
    assert_eq!(best.description, "at rest");
    assert!(best.separation() > 9.0, "{:?}", best.separations);
    let command = &recordings.train[0].command;
    let within = |x: &f64| {
        let least = command.iter().copied().fold(f64::INFINITY, f64::min);
        let most = command.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (least..=most).contains(x)
    };
    for item in &proposal.menu {
        assert!(item.command.iter().all(within), "{}", item.description);
        assert!(item.separation() <= best.separation());
    }
}

#[test]
fn the_menu_has_sines_up_to_the_bandwidth_that_the_machine_can_do() {
    let offset = Effect::new(EffectId::CurrentSensor, Geometry::Rotary).with("offset_a", 0.02);
    let recordings = recordings(vec![offset.expect("a number of the effect")]);
    let proposal = propose(&model(), &recordings, &Options::default()).expect("good recordings");
    let has = |description: &str| proposal.menu.iter().any(|item| item.description == description);
    // 20 1/s of the position loop, 100 1/s of the speed loop: 16 Hz
    assert!(has("a sine of 0.5 Hz") && has("a sine of 8 Hz") && !has("a sine of 16 Hz"));
}

#[test]
fn where_nothing_is_open_nothing_is_proposed() {
    let proposal =
        propose(&model(), &recordings(Vec::new()), &Options::default()).expect("good recordings");
    assert!(proposal.open.is_empty() && proposal.menu.is_empty(), "{:?}", proposal.open);
}
