//! Machines whose numbers are not those of their model file.

use ema_sim::{Parameter, UncertainNumber, model_file::Model, presets};
use fdi_core::{Purpose, RootSeed};

use crate::pages::chance::Chance;

/// Standard deviations at which a number is cut.
const MOST_STDS: f64 = 2.0;
/// Stream of the draws, apart from those of effects.
const STREAM: u64 = 1_000_000;

/// A machine that a model file describes but for errors of its numbers between units, drawn from the
/// usual figures of the presets: normal, cut at two standard deviations. Numbers of tests and sensors
/// are as the file has them.
pub(super) fn drawn(model: &Model, seed: RootSeed) -> Model {
    let mut chance = Chance::new(seed.derive(Purpose::Units, STREAM));
    let usual = presets::bench_tolerance().into_iter();
    usual.filter(|tolerance| tolerance.level.is_of_machine()).fold(
        model.clone(),
        |machine, tolerance| {
            changed(&machine, tolerance.number, tolerance.std() * deviation(&mut chance))
        },
    )
}

/// A machine of which a number is larger by a share; static friction follows the kinetic one.
fn changed(model: &Model, number: UncertainNumber, by: f64) -> Model {
    let mut machine = model.clone();
    let actuator = &mut machine.actuator;
    if let UncertainNumber::Parameter(parameter) = number {
        let (least, most) = parameter.bounds();
        parameter.set(actuator, ((1.0 + by) * parameter.get(actuator)).clamp(least, most));
    }
    let factor = match number {
        UncertainNumber::StaticOverKinetic => 1.0 + by,
        UncertainNumber::Parameter(parameter) if *parameter == Parameter::KINETIC_FRICTION => {
            1.0 + by
        }
        _ => return machine,
    };
    let friction = &mut actuator.transmission;
    friction.static_friction_n_m =
        (factor * friction.static_friction_n_m).max(friction.kinetic_friction_n_m);
    machine
}

/// A normal number that is not far off.
fn deviation(chance: &mut Chance) -> f64 {
    loop {
        let drawn = chance.normal();
        if drawn.abs() <= MOST_STDS {
            return drawn;
        }
    }
}
