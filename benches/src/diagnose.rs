//! The paper's inference budgets on committed recordings: shared by bench and test.

use std::path::Path;

use fdi_core::{
    Bundle, ColumnMap, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Recording,
    report::{Method, RecordDiagnosis},
};

/// Noise told, A: 20 mA and the converter's; so that no evaluation goes into finding it.
const TOLD_NOISE_A: f64 = 0.0202;

/// A budget of the FREEDOM paper: its search on a committed recording.
#[derive(Debug)]
pub struct BudgetCase {
    /// Faults, initial and sequential evaluations.
    pub name: &'static str,
    /// Evaluations of the monitor: the search's, one at its end, two a fault for uncertainty.
    pub evaluations: u64,
    diagnoser: Diagnoser,
    recording: Recording,
}

impl BudgetCase {
    /// The two settings: seven faults in 25 s, two in 6 s.
    ///
    /// # Panics
    ///
    /// When the committed recordings or embedded bundles cannot be read.
    pub fn both() -> [Self; 2] {
        [
            Self::of("two-step-ei/7-faults/20+130", "r16.csv.gz", 0, 150 + 1 + 14),
            Self::of("two-step-ei/2-faults/10+40", "r25.csv.gz", 1, 50 + 1 + 4),
        ]
    }

    fn of(name: &'static str, file: &str, bundle: usize, evaluations: u64) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/recordings");
        let recording = Recording::read(&folder.join(file), &ColumnMap::default())
            .expect("the recording is committed");
        let bundle = Bundle::from_bytes(EMBEDDED_BUNDLES[bundle].bytes)
            .expect("the embedded bundle is whole");
        let diagnoser = Diagnoser::new(bundle).expect("the embedded bundle can be learnt from");
        Self { name, evaluations, diagnoser, recording }
    }

    /// One diagnosis.
    ///
    /// # Panics
    ///
    /// When the recording cannot be diagnosed.
    pub fn run(&self) -> RecordDiagnosis {
        let options = DiagnoseOptions {
            method: Method::TwoStepEi,
            noise_a: Some(TOLD_NOISE_A),
            ..DiagnoseOptions::default()
        };
        self.diagnoser.diagnose(&self.recording, &options).expect("the recording fits the bundle")
    }
}
