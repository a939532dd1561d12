//! Answers from few evaluations and few samples.

use fdi_core::{
    Bundle, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Experiment, RecordedContent,
    SimulatedRecording, SimulatedRecordingError,
    ema_sim::{HealthState, Imperfections, PhaseSensors},
    report::{NoticeCode, Verdict},
};

fn simulated() -> SimulatedRecording {
    SimulatedRecording {
        faults: HealthState::new([0.0; 7]).unwrap().coordinates(),
        start_angle_rad: 0.0,
        imperfections: Imperfections::REAL,
        controller_seed: 3,
        sensors: PhaseSensors { noise_a: 0.02, converter: None },
        phase_rate_hz: None,
        sensor_seed: 3,
        content: RecordedContent::Phases,
        has_voltage: false,
    }
}

#[test]
fn a_search_cut_short_decides_nothing() {
    let diagnoser = Diagnoser::new(Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes).unwrap()).unwrap();
    let healthy = simulated().record(&Experiment::chirp(), "r").unwrap();
    for max_evaluations in [1, 3, 5] {
        let options = DiagnoseOptions {
            max_evaluations: Some(max_evaluations),
            noise_a: Some(0.02),
            ..DiagnoseOptions::default()
        };
        let answer = diagnoser.diagnose(&healthy, &options).unwrap();
        let told = |code| answer.notices.iter().any(|notice| notice.code == code);
        if answer.verdict == Verdict::Healthy {
            continue;
        }
        assert!(told(NoticeCode::SearchUnfinished), "{max_evaluations}: {:?}", answer.notices);
        assert!(
            !told(NoticeCode::OutsideTraining) && !told(NoticeCode::StartSuspected),
            "{:?}",
            answer.notices
        );
        assert!(!told(NoticeCode::PhaseUndetermined), "{:?}", answer.notices);
        assert!(answer.faults.iter().all(|fault| fault.detected.is_none()));
        assert_eq!(answer.faults[6].value, None);
    }
    let answer = diagnoser.diagnose(&healthy, &DiagnoseOptions::default()).unwrap();
    assert_eq!(answer.verdict, Verdict::Healthy);
}

#[test]
fn a_rate_that_leaves_one_sample_is_refused_with_the_least() {
    let few = |rate_hz| SimulatedRecording { phase_rate_hz: Some(rate_hz), ..simulated() };
    for rate_hz in [0.5, 1.0, 2.0] {
        let refused = few(rate_hz).record_low_fidelity(&Experiment::chirp(), "r").unwrap_err();
        let SimulatedRecordingError::TooSlow { least_hz, .. } = refused else {
            panic!("{refused}")
        };
        assert!(least_hz > 2.0 && least_hz < 2.1, "{least_hz}");
        assert!(few(least_hz * 1.01).record_low_fidelity(&Experiment::chirp(), "r").is_ok());
        assert!(few(rate_hz).record(&Experiment::chirp(), "r").is_err());
    }
}
