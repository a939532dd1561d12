//! The motor's voltage beside the current.

use fdi_core::{
    Bundle, Channel, ChannelName, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Experiment,
    RecordedContent, Recording, SimulatedRecording, ToleranceUse,
    ema_sim::{HealthState, Imperfections, PhaseSensors},
    report::{FaultId, Further, NoticeCode, RecordDiagnosis, Verdict},
};

fn recorded(k3: f64, has_voltage: bool) -> Recording {
    let levels = [0.0, 0.0, k3, 0.0, 0.0, 0.0, 0.0];
    let simulated = SimulatedRecording {
        faults: HealthState::new(levels).unwrap().coordinates(),
        start_angle_rad: 0.0,
        imperfections: Imperfections::REAL,
        controller_seed: 5,
        sensors: PhaseSensors { noise_a: 0.02, converter: None },
        phase_rate_hz: None,
        sensor_seed: 5,
        content: RecordedContent::Phases,
        has_voltage,
    };
    simulated.record(&Experiment::chirp(), "r").unwrap()
}

fn diagnoser() -> Diagnoser {
    Diagnoser::new(Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes).unwrap()).unwrap()
}

fn diagnosed(recording: &Recording) -> RecordDiagnosis {
    let options = DiagnoseOptions {
        tolerance: ToleranceUse::Model,
        identifiability: true,
        ..DiagnoseOptions::default()
    };
    diagnoser().diagnose(recording, &options).unwrap()
}

/// The recording with other channels of its voltage, made of the samples of `motor_voltage_v`.
fn with(
    recording: &Recording,
    channels: impl Fn(&[f64]) -> Vec<(ChannelName, Vec<f64>)>,
) -> Recording {
    let (voltage, mut others): (Vec<Channel>, Vec<Channel>) = recording
        .channels()
        .iter()
        .cloned()
        .partition(|channel| channel.name() == ChannelName::MotorVoltage);
    let made = channels(voltage[0].values()).into_iter();
    others.extend(made.map(|(name, values)| Channel::uniform(name, 0.0, 10e3, values).unwrap()));
    Recording::new("r", recording.metadata.clone(), others).unwrap()
}

fn unused(answer: &RecordDiagnosis) -> Option<&str> {
    answer.notice(NoticeCode::VoltageUnused).map(|notice| notice.message.as_str())
}

/// Levels and standard deviations of k1 to k6.
fn levels(answer: &RecordDiagnosis) -> Vec<(Option<f64>, Option<f64>)> {
    answer.faults[..6].iter().map(|fault| (fault.value, fault.std)).collect()
}

#[test]
fn a_voltage_tells_shorts_from_weak_magnets() {
    let (with, without) = (diagnosed(&recorded(0.0, true)), diagnosed(&recorded(0.0, false)));
    assert_eq!(with.verdict, without.verdict);
    assert_eq!(unused(&with), None);
    let std = |answer: &RecordDiagnosis, fault: usize| answer.faults[fault].std.unwrap();
    // of one recording torque constant and resistance have their tolerances of 3 and 5 %; of the
    // current alone the phases differ by 2.5 thousandths and more
    assert!(std(&with, 2) < 0.9 * std(&without, 2), "{} {}", std(&with, 2), std(&without, 2));
    // friction over torque constant is all that either shows
    assert!(std(&with, 0) < 1.001 * std(&without, 0));
}

#[test]
fn duty_and_supply_are_the_voltage() {
    let recording = recorded(0.03, true);
    let of_duty = with(&recording, |voltage_v| {
        let duty = voltage_v.iter().map(|v| v / 48.0).collect();
        vec![(ChannelName::Duty, duty), (ChannelName::BusVoltage, vec![48.0; voltage_v.len()])]
    });
    let (plain, of_duty) = (diagnosed(&recording), diagnosed(&of_duty));
    assert_eq!(plain.verdict, Verdict::Faulty);
    for (plain, of_duty) in levels(&plain).iter().zip(levels(&of_duty)) {
        assert!((plain.0.unwrap() - of_duty.0.unwrap()).abs() < 1e-9);
        assert!((plain.1.unwrap() - of_duty.1.unwrap()).abs() < 1e-9);
    }
}

/// Makes channels of the samples of a voltage.
type Made = fn(&[f64]) -> Vec<(ChannelName, Vec<f64>)>;

#[test]
fn a_voltage_that_cannot_be_used_is_told_and_changes_nothing() {
    let without = diagnosed(&recorded(0.03, false));
    let recording = recorded(0.03, true);
    let cases: [(&str, Made); 8] = [
        ("`q_axis_voltage_v` is of a field-oriented drive", |v| {
            vec![(ChannelName::QAxisVoltage, v.to_vec())]
        }),
        ("`duty_frac` is recorded without `bus_voltage_v`", |v| {
            vec![(ChannelName::Duty, v.iter().map(|v| v / 48.0).collect())]
        }),
        ("expected −1 to 1; of percent, `--map duty_frac=COLUMN*0.01`", |v| {
            let duty = v.iter().map(|v| 100.0 * v / 48.0).collect();
            vec![(ChannelName::Duty, duty), (ChannelName::BusVoltage, vec![48.0; v.len()])]
        }),
        ("expected 0.5 s for the command `chirp`", |v| {
            vec![(ChannelName::MotorVoltage, v[..v.len() / 2].to_vec())]
        }),
        ("is it of this motor, in V, and positive", |v| {
            vec![(ChannelName::MotorVoltage, v.iter().map(|v| -v).collect())]
        }),
        ("is it of this motor, in V, and positive", |v| {
            vec![(ChannelName::MotorVoltage, v.iter().map(|v| 1e3 * v).collect())]
        }),
        ("is it in V and of this motor, and the machine under the load of the test?", |v| {
            vec![(ChannelName::MotorVoltage, v.iter().map(|v| 1.4 * v).collect())]
        }),
        (
            "`duty_frac · bus_voltage_v` is 1.25 times `motor_voltage_v`, and both are recorded",
            |v| {
                vec![
                    (ChannelName::MotorVoltage, v.to_vec()),
                    (ChannelName::Duty, v.iter().map(|v| v / 48.0).collect()),
                    (ChannelName::BusVoltage, vec![60.0; v.len()]),
                ]
            },
        ),
    ];
    for (told, made) in cases {
        let answer = diagnosed(&with(&recording, made));
        let message = unused(&answer).unwrap_or_else(|| panic!("nothing told: {told}"));
        assert!(message.contains(told), "{message}");
        assert_eq!(levels(&answer), levels(&without), "{message}");
    }
}

#[test]
fn a_thermometer_that_contradicts_the_resistance_is_told() {
    let told = |kelvin: f64| {
        let mut recording = recorded(0.0, true);
        recording.metadata.winding_temperature_k = Some(kelvin);
        recording.metadata.winding_temperature_std_k = Some(0.5);
        diagnosed(&recording).notice(NoticeCode::TemperatureContradicts).is_some()
    };
    assert!(!told(293.15) && !told(298.0));
    assert!(told(400.0));
}

#[test]
fn an_answer_says_how_well_each_fault_is_told() {
    let (with, without) = (diagnosed(&recorded(0.0, true)), diagnosed(&recorded(0.0, false)));
    for answer in [&with, &without] {
        let ids: Vec<FaultId> = answer.identifiability.iter().map(|one| one.id).collect();
        assert_eq!(ids, FaultId::ALL[..6]);
        for one in &answer.identifiability {
            assert!(one.least_std <= one.std && one.std > 0.0, "{one:?}");
            if let Some(further) = &one.would_help {
                assert!(further.std < 0.9 * one.std, "{one:?}");
                assert!(
                    answer.identifiability != with.identifiability
                        || further.what != Further::Voltage
                );
            }
        }
    }
    // k1 is a tolerance of friction
    let friction = &without.identifiability[0];
    let shared = friction.shared_with.as_ref().unwrap();
    assert_eq!(shared.key, "transmission.kinetic-friction-n-m");
    assert!(shared.std < 0.5 * friction.std, "{friction:?}");
    // what tolerances hide, recordings as new tell
    for one in &without.identifiability {
        let told = one.would_help.as_ref().map(|further| further.what);
        assert_eq!(told, Some(Further::References), "{one:?}");
    }
    // it is what the answer states
    let std = without.faults[3].std.unwrap();
    assert!((without.identifiability[3].std / std - 1.0).abs() < 0.02);
}
