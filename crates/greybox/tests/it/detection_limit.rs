//! Sizes that would have been named: effects of about that size, on the machine and in its recordings.

use ema_sim::{Effect, EffectId, Geometry};
use greybox::{Options, Recordings, explain, with_effect};

use crate::bench_top::{Truth, model, recordings};

fn names_cogging(recordings: &Recordings) -> bool {
    let answer = explain(&model(), recordings, &Options::default()).expect("good recordings");
    answer.effects.iter().any(|found| found.effect.id() == EffectId::Cogging)
}

/// A machine that has the effect at a quarter of the limit is not given it, and one that has twice the
/// limit is, in any phase. At half of it noise decides: the limit has room for nine in ten.
#[test]
fn law_a_machine_is_given_an_effect_from_its_detection_limit_on() {
    let healthy = Truth { k1: 0.02, rough: [0.03, -0.1], seed: 21, ..Truth::default() };
    let answer = explain(&model(), &recordings(&healthy), &Options::default()).expect("good ones");
    let mut limits = answer.smallest_named_90.iter();
    let limit = limits.find(|limit| limit.effect.id() == EffectId::Cogging).expect("a limit");
    for (times, is_named) in [(0.25, false), (2.0, true)] {
        for phase in [0.4_f64, 2.5] {
            let size = times * limit.size;
            let effect = limit.effect.clone().with("cogging_cos_n_m", size * libm::cos(phase));
            let effect = effect.and_then(|e| e.with("cogging_sin_n_m", size * libm::sin(phase)));
            let truth = Truth { effects: vec![effect.expect("a size")], ..healthy.clone() };
            assert_eq!(names_cogging(&recordings(&truth)), is_named, "{times} at {phase}");
        }
    }
}

/// Recordings of a machine as its model, with an effect added, are those of a machine that has it.
#[test]
fn an_effect_added_to_recordings_is_that_of_the_machine() {
    let effect = Effect::new(EffectId::Cogging, Geometry::Rotary)
        .with("cogging_sin_n_m", 0.003)
        .and_then(|effect| effect.with("order", 12.0))
        .expect("a cogging");
    let quiet = Truth { quiet: true, ..Truth::default() };
    let added = with_effect(&model(), &recordings(&quiet), &effect).expect("they can be run");
    let whole = recordings(&Truth { effects: vec![effect], ..quiet.clone() });
    let all = |recordings: &Recordings| -> Vec<f64> {
        recordings.all().flat_map(|record| record.drive.clone()).collect()
    };
    let (added, whole, without) = (all(&added), all(&whole), all(&recordings(&quiet)));
    let most =
        |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0, |m, (a, b)| f64::max(m, (a - b).abs()));
    assert!(most(&whole, &without) > 0.02);
    assert!(most(&added, &whole) < 1e-9, "{}", most(&added, &whole));
}
