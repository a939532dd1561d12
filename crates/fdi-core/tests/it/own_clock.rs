//! Phases that a logger samples by a clock of its own, where they show the ripple of the carrier.

use fdi_core::{
    Bundle, ColumnMap, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Recording, ToleranceUse,
    ema_sim::{HealthState, Imperfections, PhaseSensors, PhysicalFaults},
    report::RecordDiagnosis,
};

const RATE_HZ: f64 = 10e3;
const SAMPLES: usize = 5000;
const LEVELS: [f64; 7] = [0.020, 0.010, 0.0, 0.030, 0.0, 0.0, 0.5];
/// Standard deviations within which each of k1 to k5 is to be found: 1 in 100 000 beyond, for each
/// of five, if the stated deviations are right.
const DEVIATIONS: f64 = 4.5;

fn chirp() -> Bundle {
    Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes).unwrap()
}

/// A number in ±1 that looks like chance.
fn scatter(index: usize) -> f64 {
    2.0 * ((index as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0) - 1.0
}

/// Instants of the samples of a test, each off its place by so many samples, s.
fn instants_s(off: impl Fn(usize) -> f64) -> Vec<f64> {
    let last_s = (SAMPLES - 1) as f64 / RATE_HZ;
    (0..SAMPLES).map(|n| ((n as f64 + off(n)) / RATE_HZ).clamp(0.0, last_s)).collect()
}

/// The recording of a damaged machine whose phases were taken at some instants, with stamps of their own.
fn recorded(bundle: &Bundle, instants_s: &[f64], stamps_s: &[f64]) -> Recording {
    let experiment = &bundle.experiment;
    let model = experiment.high_fidelity(0.0, Imperfections::REAL).unwrap().with_seed(5);
    let faults = PhysicalFaults::from(&HealthState::new(LEVELS).unwrap().coordinates());
    let (_, logged) = model.simulate_logged(&faults, instants_s).unwrap();
    let [a, b, c] = &logged.phase_currents_a;
    let sensors = PhaseSensors { noise_a: 0.02, converter: None };
    let [a, b, c] = sensors.measure([a, b, c], 7);
    let angle_rad = &logged.motor_angle_rad;
    let rows = stamps_s.iter().enumerate().map(|(n, stamp_s)| {
        format!("{stamp_s:.9},{:.6},{:.6},{:.6},{:.6}\n", a[n], b[n], c[n], angle_rad[n])
    });
    let text = format!(
        "# command = \"{}\"\n\
         time_s,phase_a_current_a,phase_b_current_a,phase_c_current_a,motor_angle_rad\n{}",
        experiment.name,
        rows.collect::<String>()
    );
    Recording::parse("r.csv", text.as_bytes(), &ColumnMap::default()).unwrap()
}

fn answer(diagnoser: &Diagnoser, recording: &Recording) -> RecordDiagnosis {
    let options = DiagnoseOptions { tolerance: ToleranceUse::None, ..DiagnoseOptions::default() };
    diagnoser.diagnose(recording, &options).unwrap()
}

fn finds(answer: &RecordDiagnosis) -> bool {
    answer.fit.adequate
        && answer.faults.iter().zip(LEVELS).take(5).all(|(fault, level)| {
            (fault.value.unwrap() - level).abs() < DEVIATIONS * fault.std.unwrap()
        })
}

#[test]
fn the_ripple_of_jittered_samples_is_taken_off() {
    let diagnoser = Diagnoser::new(chirp()).unwrap();
    let even_s = instants_s(|_| 0.0);
    for size in [0.03, 0.1, 0.25] {
        let jittered_s = instants_s(|n| size * scatter(n));
        let of = |instants_s: &[f64], stamps_s: &[f64]| {
            answer(&diagnoser, &recorded(diagnoser.bundle(), instants_s, stamps_s))
        };
        let taken_so = of(&jittered_s, &jittered_s);
        assert!(finds(&taken_so), "{size}: {:?}", taken_so.faults);
        // stamps that scatter, of samples that do not
        let stamped_so = of(&even_s, &jittered_s);
        assert!(finds(&stamped_so), "{size}: {:?}", stamped_so.faults);
        // what no stamp tells is not explained
        assert!(size < 0.1 || !of(&jittered_s, &even_s).fit.adequate, "{size}");
    }
}
