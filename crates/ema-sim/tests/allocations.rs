//! What a run allocates does not grow with its length: nothing is allocated in the loops.
//!
//! A binary of its own, because the allocator that counts is the whole binary's.

use allocation_counter::measure;
use ema_sim::{
    AxisInput, AxisScenario, AxisStart, Command, Effect, EffectId, Geometry, HealthState,
    HighFidelity, LowFidelity, PhysicalFaults, Scenario, ServoAxisSimulation,
    model_file::{MachineModel, parse_machine},
    presets::{BENCH, EMA_48},
};

fn worn() -> PhysicalFaults {
    let levels = [0.04, 0.02, 0.05, 0.0, 0.03, 0.05, 0.7];
    (&HealthState::new(levels).expect("on the scale")).into()
}

/// Allocations of a run of a length.
fn counted<T>(prepare: impl Fn(f64) -> T, run: impl Fn(&T), duration_s: f64) -> u64 {
    let model = prepare(duration_s);
    // what is taken once in a process is taken before
    run(&model);
    measure(|| run(&model)).count_total
}

/// The same number for a tenth and for half a second, and some at all: the trace's channels.
fn same<T>(what: &str, prepare: impl Fn(f64) -> T, run: impl Fn(&T)) {
    let (short, long) = (counted(&prepare, &run, 0.1), counted(&prepare, &run, 0.5));
    assert!(short > 0, "{what}: the counter counts");
    assert_eq!(short, long, "{what}");
}

fn chirp(duration_s: f64) -> Scenario {
    Scenario { duration_s, ..Scenario::chirp().with_real_electronics(1) }
}

fn effects() -> [Effect; 3] {
    let made = |id, numbers: &[(&str, f64)]| {
        numbers.iter().fold(Effect::new(id, Geometry::Rotary), |effect, (key, value)| {
            effect.with(key, *value).expect("within bounds")
        })
    };
    [
        made(EffectId::Cogging, &[("cogging_sin_n_m", 4e-3)]),
        made(EffectId::Stribeck, &[("stribeck_n_m", 5e-3)]),
        made(EffectId::ControllerMismatch, &[("delay_s", 1.5e-4)]),
    ]
}

#[test]
fn the_step_loop_of_high_fidelity_allocates_nothing() {
    for actuator in [EMA_48, BENCH] {
        let plain = |duration_s| HighFidelity::new(&actuator, &chirp(duration_s)).expect("valid");
        same("plain", plain, |model| drop(model.simulate(&worn())));
        let with = |duration_s| plain(duration_s).with_effects(&effects()).expect("taken");
        same("with effects", with, |model| drop(model.simulate(&worn())));
    }
}

#[test]
fn the_step_loop_of_low_fidelity_allocates_nothing() {
    for actuator in [EMA_48, BENCH] {
        let plain = |duration_s| LowFidelity::new(&actuator, &chirp(duration_s)).expect("valid");
        same("plain", plain, |model| drop(model.simulate(&worn())));
        let with = |duration_s| plain(duration_s).with_effects(&effects()).expect("taken");
        same("with effects", with, |model| drop(model.simulate(&worn())));
    }
}

#[test]
fn the_step_loop_of_a_batch_allocates_nothing() {
    let clean = |duration_s| Scenario { duration_s, ..Scenario::chirp() };
    for actuator in [EMA_48, BENCH] {
        let plain = |duration_s| LowFidelity::new(&actuator, &clean(duration_s)).expect("valid");
        let faults = [worn(); 32];
        same("batch", plain, |model| model.simulate_currents(&faults, &mut Vec::new()));
    }
}

#[test]
fn the_step_loop_of_an_axis_allocates_nothing() {
    let text = include_str!("../../../fixtures/models/emps.toml");
    let Ok(MachineModel::ServoAxis(emps)) = parse_machine(text) else { panic!("a servo axis") };
    let prepare = |duration_s| {
        let input = AxisInput::Position(Command::SINE);
        let start = AxisStart::default();
        let scenario = AxisScenario { input, load: 0.0, duration_s, start };
        ServoAxisSimulation::new(&emps.axis, &scenario).expect("valid")
    };
    same("axis", prepare, |simulation| drop(simulation.simulate(&worn())));
}
