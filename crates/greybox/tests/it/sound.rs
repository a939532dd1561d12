//! Tests of the tests: what must not change an answer does not, and what is not in the catalogue
//! is not given another's name.

use ema_sim::{Effect, EffectId, Geometry};
use greybox::{Explained, Options, Record, Recordings, Verdict, explain};

use crate::bench_top::{Truth, model, recordings};

fn effect(id: EffectId, numbers: &[(&str, f64)]) -> Effect {
    numbers.iter().fold(Effect::new(id, Geometry::Rotary), |effect, (key, value)| {
        effect.with(key, *value).expect("a number of the effect")
    })
}

/// One of each effect that the bench top can have, well visible.
pub(crate) fn examples() -> Vec<Effect> {
    use EffectId::*;
    vec![
        effect(Stribeck, &[("stribeck_n_m", 0.008), ("stribeck_speed_rad_per_s", 1.0)]),
        effect(
            NonlinearViscous,
            &[("viscous_at_reference_n_m", 0.01), ("reference_speed_rad_per_s", 5.0)],
        ),
        effect(DirectionalFriction, &[("viscous_asymmetry_n_m_s_per_rad", 8e-4)]),
        effect(LoadFriction, &[("load_share_ratio", 0.1)]),
        effect(Presliding, &[("presliding_rad", 0.02)]),
        effect(WornRegion, &[("worn_n_m", 0.01), ("centre_rad", 0.5), ("width_rad", 0.3)]),
        effect(FrictionDrift, &[("friction_drop_ratio", 0.3), ("time_constant_s", 2.0)]),
        effect(
            Compliance,
            &[
                ("compliance_rad_per_n_m", 0.02),
                ("damping_n_m_s_per_rad", 5e-3),
                ("load_inertia_kg_m2", 5e-4),
            ],
        ),
        effect(TransmissionError, &[("error_sin_rad", 2e-3), ("order", 10.0)]),
        effect(Imbalance, &[("spring_n_m_per_rad", 0.003)]),
        effect(Cogging, &[("cogging_sin_n_m", 0.004), ("order", 12.0)]),
        effect(CurrentRipple, &[("ripple_sin_ratio", 0.15), ("order", 6.0)]),
        effect(Saturation, &[("saturation_per_a2", 0.3)]),
        effect(MagnetLoss, &[("torque_constant_loss_ratio", 0.1)]),
        effect(CurrentSensor, &[("gain_error_ratio", 0.08)]),
        effect(PositionSensor, &[("eccentricity_sin_rad", 5e-3)]),
        effect(ControllerMismatch, &[("speed_gain_error_ratio", 0.3)]),
        effect(Vibration, &[("vibration_sin_n_m", 4e-3), ("frequency_hz", 17.0)]),
    ]
}

fn explained(truth: &Truth, options: &Options) -> Explained {
    explain(&model(), &recordings(truth), options).expect("the recordings are good")
}

fn ids(answer: &Explained) -> Vec<EffectId> {
    answer.effects.iter().map(|found| found.effect.id()).collect()
}

/// Leave one effect out of the catalogue: what it does is not given another's name as if that
/// were all.
#[test]
fn what_is_left_out_of_the_catalogue_is_not_confidently_another() {
    let mut failed = Vec::new();
    for (seed, hidden) in examples().into_iter().enumerate() {
        let id = hidden.id();
        let truth = Truth { effects: vec![hidden], seed: 100 + seed as u64, ..Truth::default() };
        let options = Options { without: vec![id], ..Options::default() };
        let answer = explained(&truth, &options);
        assert!(!ids(&answer).contains(&id), "{id:?}");
        if matches!(answer.verdict, Verdict::Named | Verdict::OneOf) {
            failed.push((id, ids(&answer)));
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

/// A hidden effect and the answer to it.
fn hidden() -> Truth {
    let hidden = effect(EffectId::Cogging, &[("cogging_sin_n_m", 0.003), ("order", 12.0)]);
    Truth { effects: vec![hidden], k1: 0.02, seed: 31, ..Truth::default() }
}

#[test]
fn the_order_of_the_recordings_does_not_matter() {
    for truth in [hidden(), Truth { seed: 32, ..Truth::default() }] {
        let plain = recordings(&truth);
        let mut shuffled = plain.clone();
        shuffled.train.reverse();
        let [plain, shuffled] = [plain, shuffled].map(|recordings| {
            explain(&model(), &recordings, &Options::default()).expect("good recordings")
        });
        assert_eq!(plain.verdict, shuffled.verdict, "{:#?}", shuffled.log);
        assert_eq!(ids(&plain), ids(&shuffled));
    }
}

/// Noise that runs backwards is noise.
#[test]
fn reversed_noise_is_no_effect() {
    let truth = Truth { seed: 33, ..Truth::default() };
    let (noisy, clean) = (recordings(&truth), recordings(&Truth { quiet: true, ..truth }));
    let reversed = |noisy: &[Record], clean: &[Record]| -> Vec<Record> {
        let of = |(noisy, clean): (&Record, &Record)| {
            let noise = noisy.drive.iter().zip(&clean.drive).map(|(a, b)| a - b).rev();
            let drive = clean.drive.iter().zip(noise).map(|(a, b)| a + b).collect();
            Record { drive, ..clean.clone() }
        };
        noisy.iter().zip(clean).map(of).collect()
    };
    let recordings = Recordings {
        train: reversed(&noisy.train, &clean.train),
        holdout: reversed(&noisy.holdout, &clean.holdout),
        repeat: reversed(&noisy.repeat, &clean.repeat),
    };
    let answer = explain(&model(), &recordings, &Options::default()).expect("good recordings");
    assert_eq!(answer.verdict, Verdict::Adequate, "{:#?}", answer.log);
}

/// With the calibration off nulls are named; with it on none of these is.
#[test]
fn false_alarms_rise_when_the_calibration_is_off() {
    let off = Options {
        false_alarm_rate: 1.0,
        gain_std_errors: -10.0,
        evidence_nats: -1e3,
        ..Options::default()
    };
    let alarms = |options: &Options| {
        let of = |seed: &u64| {
            let truth = Truth { seed: *seed, ..Truth::default() };
            !explained(&truth, options).effects.is_empty()
        };
        (40..48).filter(of).count()
    };
    let (with, without) = (alarms(&Options::default()), alarms(&off));
    assert_eq!(with, 0);
    assert!(without >= 2, "{without} of 8");
}
