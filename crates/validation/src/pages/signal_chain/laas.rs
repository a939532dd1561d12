//! Mutations of the LAAS recordings: a motion without its controller.

use anyhow::Result;
use greybox::{Recordings, SignalCode};

use super::mutation::{Asked, Case, Channel, Set};
use crate::pages::measured::{Laas, laas_model};

/// Range of the current of a converter, A: the controller's limit.
const RANGE_A: f64 = 5.0;
/// Inertia over the motor's constant in the model file, A·s²/rad.
const INERTIA_A_S2: f64 = 5.4e-6 / 0.0276;
/// Samples over which a position is averaged on either side before its acceleration is taken.
const REACH: usize = 15;

/// The set of the page of measured machines.
pub(crate) fn sound() -> Result<Set> {
    Ok(Set { model: laas_model()?, recordings: Laas::read()?.recordings() })
}

/// Mutations that spoil the recordings or the model file.
pub(super) fn harmful(sound: &Set) -> Result<Vec<Case>> {
    let mut cases = Vec::new();
    let mut add = |name: String, code: SignalCode, set: Set| {
        cases.push(Case { name, asked: Asked::Code(code), is_development: false, set });
    };
    for ms in [2, 5, 10, 20] {
        let late = sound.late(Channel::Drive, ms);
        add(format!("current {ms} ms late"), SignalCode::Late, late);
    }
    add("sign of the current".to_owned(), SignalCode::Sign, sound.times(Channel::Drive, -1.0));
    for factor in [2.0, 0.5] {
        let scaled = sound.times(Channel::Drive, factor);
        add(format!("current times {factor}"), SignalCode::Gain, scaled);
    }
    for factor in [2.0, 0.5] {
        let key = "torque-constant-n-m-per-a";
        let set = sound.with(&[(key, factor)])?;
        add(format!("`{key}` of the file times {factor}"), SignalCode::Constant, set);
    }
    add("current cut at 60 % of its peak".to_owned(), SignalCode::Saturated, sound.cut(0.6));
    add("current of 8 bits to 5 A".to_owned(), SignalCode::Quantised, sound.bits(8, RANGE_A));
    for samples in [1000..1060, 3000..3200] {
        let name = format!("{} samples missing", samples.len());
        add(name, SignalCode::Gap, sound.without(samples));
    }
    let mut again = sound.clone();
    again.recordings.holdout = vec![sound.recordings.holdout[1].clone()];
    again.recordings.train.remove(0);
    add("the second half of the same run held out".to_owned(), SignalCode::SameMotion, again);
    add(
        "hold-out of a machine of 2 times the inertia".to_owned(),
        SignalCode::OtherMachine,
        heavy(sound),
    );
    Ok(cases)
}

/// The hold-outs of a machine of twice the inertia: more current, in proportion to the measured
/// acceleration.
fn heavy(sound: &Set) -> Set {
    let mut set = sound.clone();
    let Recordings { holdout, .. } = &mut set.recordings;
    for record in holdout {
        let Some(position) = &record.position else { continue };
        let smooth = (0..3).fold(position.clone(), |signal, _| averaged(&signal));
        let last = smooth.len() - 1;
        for n in 1..last {
            let second = smooth[n + 1] - 2.0 * smooth[n] + smooth[n - 1];
            record.drive[n] += INERTIA_A_S2 * second * record.rate_hz * record.rate_hz;
        }
    }
    set
}

fn averaged(signal: &[f64]) -> Vec<f64> {
    let last = signal.len() - 1;
    let mean = |n: usize| {
        let reach = REACH.min(n).min(last - n);
        let around = &signal[n - reach..=n + reach];
        around.iter().sum::<f64>() / around.len() as f64
    };
    (0..signal.len()).map(mean).collect()
}
