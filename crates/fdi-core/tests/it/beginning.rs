//! Recordings that begin otherwise than the bundle's test, and machines that differ from its.

use fdi_core::{
    Bundle, Channel, ChannelName, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Encoding,
    Experiment, Metadata, RecordedContent, Recording, SimulatedRecording, ToleranceUse,
    ema_sim::{HealthState, Imperfections, PhaseSensors},
    report::{NoticeCode, RecordDiagnosis},
};

const PHASES: [ChannelName; 3] =
    [ChannelName::PhaseACurrent, ChannelName::PhaseBCurrent, ChannelName::PhaseCCurrent];
const LEVELS: [f64; 7] = [0.020, 0.010, 0.0, 0.030, 0.0, 0.0, 0.5];
/// Standard deviations within which each of k1 to k5 is to be found: 1 in 20 000 beyond, for each
/// of five, if the stated deviations are right, and they may be half as large as they should.
const DEVIATIONS: f64 = 8.0;

fn chirp() -> Bundle {
    Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes).unwrap()
}

fn recorded(experiment: &Experiment, levels: [f64; 7], seed: u64) -> Recording {
    SimulatedRecording {
        faults: HealthState::new(levels).unwrap().coordinates(),
        start_angle_rad: 0.0,
        imperfections: Imperfections::REAL,
        controller_seed: seed,
        sensors: PhaseSensors { noise_a: 0.02, converter: None },
        phase_rate_hz: None,
        sensor_seed: seed,
        content: RecordedContent::Phases,
        has_voltage: false,
    }
    .record(experiment, "r")
    .unwrap()
}

/// The recording with everything later by some samples, what is before it held.
fn later(recording: &Recording, samples: usize) -> Recording {
    let names = [
        ChannelName::PhaseACurrent,
        ChannelName::PhaseBCurrent,
        ChannelName::PhaseCCurrent,
        ChannelName::MotorAngle,
    ];
    let channels = names.map(|name| {
        let values = recording.channel(name).unwrap().values();
        let held = (0..values.len()).map(|n| values[n.saturating_sub(samples)]).collect();
        Channel::uniform(name, 0.0, 10_000.0, held).unwrap()
    });
    Recording::new("r", recording.metadata.clone(), channels.into()).unwrap()
}

fn finds(answer: &RecordDiagnosis) -> bool {
    answer.faults.iter().zip(LEVELS).take(5).all(|(fault, level)| {
        (fault.value.unwrap() - level).abs() < DEVIATIONS * fault.std.unwrap()
    })
}

fn tells(answer: &RecordDiagnosis, code: NoticeCode, words: &str) -> bool {
    answer.notices.iter().any(|notice| notice.code == code && notice.message.contains(words))
}

#[test]
fn a_delay_is_told_and_estimated_where_it_may_be() {
    let bundle = chirp();
    let recording = later(&recorded(&bundle.experiment, LEVELS, 11), 7);
    let diagnoser = Diagnoser::new(bundle).unwrap();
    let answer = |max_delay_s: f64| {
        let options = DiagnoseOptions { max_delay_s, ..DiagnoseOptions::default() };
        diagnoser.diagnose(&recording, &options).unwrap()
    };
    let without = answer(0.0);
    assert!(!without.fit.adequate && !finds(&without));
    let with = answer(2e-3);
    assert!(with.fit.adequate && finds(&with), "{:?}", with.faults);
    let told = tells(&with, NoticeCode::StartEstimated, "begins before the command by 0.70 ms");
    assert!(told, "{:?}", with.notices);
    let refused = DiagnoseOptions { max_delay_s: 0.1, ..DiagnoseOptions::default() };
    assert_eq!(
        diagnoser.diagnose(&recording, &refused).unwrap_err().to_string(),
        "a largest delay of 0.1 s, expected 0 to 0.05 s"
    );
}

/// The recording after some samples of rest, with its command where that was recorded.
fn after_a_rest(
    recording: &Recording,
    experiment: &Experiment,
    rest: usize,
    command: bool,
) -> Recording {
    let names = [
        ChannelName::PhaseACurrent,
        ChannelName::PhaseBCurrent,
        ChannelName::PhaseCCurrent,
        ChannelName::MotorAngle,
    ];
    let mut channels: Vec<Channel> = names
        .into_iter()
        .map(|name| {
            let values = recording.channel(name).unwrap().values();
            // the noise of the first samples, over and over
            let noise = values[..16].iter().copied().cycle().take(rest);
            let whole = noise.chain(values.iter().copied()).collect();
            Channel::uniform(name, -0.05, 10_000.0, whole).unwrap()
        })
        .collect();
    if command {
        let test = &experiment.scenario.command;
        let samples = channels[0].values().len() as i32;
        let at = |n: i32| test.at((f64::from(n - rest as i32) / 10e3).max(0.0));
        let values = (0..samples).map(at).collect();
        channels.push(Channel::uniform(ChannelName::Command, -0.05, 10_000.0, values).unwrap());
    }
    Recording::new("r", recording.metadata.clone(), channels).unwrap()
}

#[test]
fn what_is_before_the_command_is_left_out() {
    let bundle = chirp();
    let plain = recorded(&bundle.experiment, LEVELS, 13);
    let experiment = bundle.experiment.clone();
    let diagnoser = Diagnoser::new(bundle).unwrap();
    let answer = |recording: &Recording, tolerance| {
        let options = DiagnoseOptions { tolerance, ..DiagnoseOptions::default() };
        diagnoser.diagnose(recording, &options).unwrap()
    };
    for tolerance in [ToleranceUse::None, ToleranceUse::Model] {
        let twin = answer(&plain, tolerance);
        for rest in [73, 20_000] {
            let known = answer(&after_a_rest(&plain, &experiment, rest, true), tolerance);
            assert_eq!(known.faults, twin.faults, "{rest}");
            let words = format!("begins {:.2} ms after the first sample", 0.1 * rest as f64);
            assert!(tells(&known, NoticeCode::BeginsBeforeCommand, &words), "{:?}", known.notices);
            let found = answer(&after_a_rest(&plain, &experiment, rest, false), tolerance);
            assert_eq!(found.verdict, twin.verdict);
            for (found, twin) in found.faults.iter().zip(&twin.faults).take(6) {
                let (std, off) = (found.std.unwrap(), found.value.unwrap() - twin.value.unwrap());
                // half a sample of the clock is within what the start leaves open
                assert!(off.abs() < std && std < 1.5 * twin.std.unwrap(), "{found:?} {twin:?}");
            }
        }
    }
}

#[test]
fn a_recording_that_goes_on_after_the_test_is_not_moved() {
    let bundle = chirp();
    let plain = recorded(&bundle.experiment, LEVELS, 14);
    let diagnoser = Diagnoser::new(bundle).unwrap();
    let longer = plain.channels().iter().map(|channel| {
        let rest = channel.values()[..16].iter().copied().cycle().take(3000);
        let values = channel.values().iter().copied().chain(rest).collect();
        Channel::uniform(channel.name(), 0.0, 10_000.0, values).unwrap()
    });
    let longer = Recording::new("r", plain.metadata.clone(), longer.collect()).unwrap();
    let options = DiagnoseOptions::default();
    let [plain, longer] = [plain, longer].map(|one| diagnoser.diagnose(&one, &options).unwrap());
    let is_moved = longer.notices.iter().any(|one| one.code == NoticeCode::BeginsBeforeCommand);
    assert!(!is_moved && longer.fit.adequate, "{:?}", longer.notices);
    for (longer, plain) in longer.faults.iter().zip(&plain.faults).take(6) {
        // the noise is read off all samples
        let off = (longer.value.unwrap() - plain.value.unwrap()).abs();
        assert!(off < 0.05 * plain.std.unwrap(), "{longer:?} {plain:?}");
    }
}

#[test]
fn the_side_of_the_play_and_the_integrator_are_estimated() {
    let bundle = chirp();
    let mut begun = bundle.experiment.clone();
    begun.scenario.backlash_side_ratio = 1.0;
    begun.scenario.initial.speed_integral_a = 0.3;
    let recording = recorded(&begun, LEVELS, 12);
    let diagnoser = Diagnoser::new(bundle).unwrap();
    let answer = |free_start: bool| {
        let options = DiagnoseOptions { free_start, ..DiagnoseOptions::default() };
        diagnoser.diagnose(&recording, &options).unwrap()
    };
    let without = answer(false);
    assert!(!without.fit.adequate);
    let told = tells(&without, NoticeCode::StartSuspected, "`--free-start` estimates it");
    assert!(told, "{:?}", without.notices);
    let with = answer(true);
    assert!(with.fit.adequate && finds(&with), "{:?}", with.faults);
}

#[test]
fn levels_are_against_a_reference() {
    let bundle = chirp();
    let mut stiff = bundle.experiment.clone();
    stiff.actuator.transmission.kinetic_friction_n_m *= 1.05;
    stiff.actuator.transmission.static_friction_n_m *= 1.05;
    let healthy = HealthState::HEALTHY.levels();
    let reference = recorded(&stiff, healthy, 21);
    let recording = recorded(&stiff, healthy, 22);
    let options = DiagnoseOptions::default();
    let plain = Diagnoser::new(bundle.clone()).unwrap().diagnose(&recording, &options).unwrap();
    // 5 % more friction is half of that in the level
    assert!((plain.faults[0].value.unwrap() - 0.025).abs() < 0.005, "{:?}", plain.faults[0]);
    let referred = Diagnoser::with_references(bundle, Encoding::Full, &[reference]).unwrap();
    let answer = referred.diagnose(&recording, &options).unwrap();
    assert!(answer.faults.iter().all(|fault| fault.detected != Some(true)), "{:?}", answer.faults);
    assert!(answer.notices.iter().any(|one| one.code == NoticeCode::ReferenceUsed));
    let turned = SimulatedRecording {
        faults: HealthState::HEALTHY.coordinates(),
        start_angle_rad: 0.5,
        imperfections: Imperfections::REAL,
        controller_seed: 1,
        sensors: PhaseSensors { noise_a: 0.02, converter: None },
        phase_rate_hz: None,
        sensor_seed: 1,
        content: RecordedContent::Phases,
        has_voltage: false,
    };
    let turned = turned.record(&stiff, "r").unwrap();
    assert_eq!(
        referred.diagnose(&turned, &options).unwrap_err().to_string(),
        "recording and references start at one angle, known for each: found 0.5000 rad, expected \
         0.0000 rad"
    );
}

/// Each tenth of the samples of a recording at 100 kHz from one on, with the command.
fn between_ticks(bundle: &Bundle, first: usize) -> Recording {
    let experiment = &bundle.experiment;
    let simulated = SimulatedRecording {
        faults: HealthState::new(LEVELS).unwrap().coordinates(),
        start_angle_rad: 0.0,
        imperfections: Imperfections::REAL,
        controller_seed: 5,
        sensors: PhaseSensors { noise_a: 0.0, converter: None },
        phase_rate_hz: Some(100e3),
        sensor_seed: 5,
        content: RecordedContent::Phases,
        has_voltage: false,
    };
    let fine = simulated.record(experiment, "r").unwrap();
    let taken = |name: ChannelName| -> Vec<f64> {
        fine.channel(name).unwrap().values().iter().skip(first).step_by(10).copied().collect()
    };
    let [a, b, c] = PHASES.map(taken);
    let [a, b, c] = PhaseSensors { noise_a: 0.02, converter: None }.measure([&a, &b, &c], 5);
    // at rest before the command, so that its start is looked for
    let rest = 400;
    let before = |values: Vec<f64>, held: f64| [vec![held; rest], values].concat();
    let command = |n: i64| {
        let since_s = (1e-5 * first as f64 + 1e-4 * (n - rest as i64) as f64).max(0.0);
        experiment.scenario.command.at(since_s)
    };
    let samples = (a.len() + rest) as i64;
    let channels = [
        (ChannelName::PhaseACurrent, before(a, 0.0)),
        (ChannelName::PhaseBCurrent, before(b, 0.0)),
        (ChannelName::PhaseCCurrent, before(c, 0.0)),
        (ChannelName::MotorAngle, before(taken(ChannelName::MotorAngle), 0.0)),
        (ChannelName::Command, (0..samples).map(command).collect()),
    ];
    let channels =
        channels.map(|(name, values)| Channel::uniform(name, 0.0, 10e3, values).unwrap());
    Recording::new("r", Metadata::default(), channels.into()).unwrap()
}

#[test]
fn samples_between_ticks_show_no_ripple_as_damage() {
    let diagnoser = Diagnoser::new(chirp()).unwrap();
    let options = DiagnoseOptions { tolerance: ToleranceUse::None, ..DiagnoseOptions::default() };
    // where the ripple of the carrier is at its least and at its most
    for first in [3, 5, 7] {
        let answer =
            diagnoser.diagnose(&between_ticks(diagnoser.bundle(), first), &options).unwrap();
        assert!(answer.fit.adequate && finds(&answer), "{first}: {:?}", answer.faults);
    }
}

#[test]
fn a_quadrature_axis_current_of_six_steps_is_refused() {
    let bundle = chirp();
    let phases = recorded(&bundle.experiment, LEVELS, 3);
    let named = |channel: &Channel| {
        let values = channel.values().to_vec();
        Channel::uniform(ChannelName::QAxisCurrent, 0.0, 10e3, values).unwrap()
    };
    let channels = vec![named(&phases.channels()[0])];
    let recording = Recording::new("r", phases.metadata.clone(), channels).unwrap();
    let refused = Diagnoser::new(bundle).unwrap().diagnose(&recording, &DiagnoseOptions::default());
    let told = refused.unwrap_err().to_string();
    assert!(
        told.starts_with("`q_axis_current_a` is the current of a field-oriented drive"),
        "{told}"
    );
}
