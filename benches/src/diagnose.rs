//! Diagnoses of committed recordings with their noise told: shared by bench and `cargo xtask budget`.

use std::path::Path;

use anyhow::{Context, Result};
use fdi_core::{
    Bundle, ColumnMap, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Recording,
    report::{Fidelity, Method, RecordDiagnosis},
};

/// Noise told, A: 20 mA and the converter's; so that no evaluation goes into finding it.
const TOLD_NOISE_A: f64 = 0.0202;
/// The chirp with seven faults at once.
const SEVEN: (&str, usize) = ("r16.csv.gz", 0);
/// The sine with two.
const TWO: (&str, usize) = ("r25.csv.gz", 1);

/// A budget: a diagnosis of a committed recording, and what it may take.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Method, faults, initial and sequential evaluations where they are told.
    pub name: &'static str,
    /// Evaluations of the models, pinned: the search's own, and those for uncertainty.
    pub evaluations: u64,
    /// The paper's time, s, where it gives one.
    pub limit_s: Option<f64>,
    /// Recording, and place of its bundle among the embedded ones.
    recording: (&'static str, usize),
    method: Method,
    fidelity: Fidelity,
}

/// The paper's inference, 25 s for seven faults and 6 s for two with its method, and what the
/// other methods of this project are to keep to.
pub const BUDGETS: [Budget; 6] = [
    Budget {
        name: "two-step-ei/7-faults/20+130",
        evaluations: 150 + 1 + 14,
        limit_s: Some(25.0),
        recording: SEVEN,
        method: Method::TwoStepEi,
        fidelity: Fidelity::Low,
    },
    Budget {
        name: "two-step-ei/2-faults/10+40",
        evaluations: 50 + 1 + 4,
        limit_s: Some(6.0),
        recording: TWO,
        method: Method::TwoStepEi,
        fidelity: Fidelity::Low,
    },
    Budget {
        name: "low/7-faults",
        evaluations: 20,
        limit_s: None,
        recording: SEVEN,
        method: Method::Gls,
        fidelity: Fidelity::Low,
    },
    Budget {
        name: "bench/2-faults",
        evaluations: 8,
        limit_s: None,
        recording: TWO,
        method: Method::Gls,
        fidelity: Fidelity::Low,
    },
    Budget {
        name: "high/7-faults",
        evaluations: 46,
        limit_s: None,
        recording: SEVEN,
        method: Method::Gls,
        fidelity: Fidelity::High,
    },
    Budget {
        name: "emulator/7-faults",
        evaluations: 0,
        limit_s: None,
        recording: SEVEN,
        method: Method::Emulator,
        fidelity: Fidelity::Low,
    },
];

/// A budget with what it is run on.
#[derive(Debug)]
pub struct BudgetCase {
    /// The budget.
    pub budget: Budget,
    diagnoser: Diagnoser,
    recording: Recording,
}

impl Budget {
    /// Reads the recording and prepares the bundle.
    ///
    /// # Errors
    ///
    /// When the committed recording or the embedded bundle cannot be read.
    pub fn prepare(self) -> Result<BudgetCase> {
        let (file, bundle) = self.recording;
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/recordings");
        let recording = Recording::read(&folder.join(file), &ColumnMap::default()).context(file)?;
        let diagnoser = Diagnoser::new(Bundle::from_bytes(EMBEDDED_BUNDLES[bundle].bytes)?)?;
        Ok(BudgetCase { budget: self, diagnoser, recording })
    }
}

impl BudgetCase {
    /// One diagnosis; the first one prepares what is the same for all.
    ///
    /// # Errors
    ///
    /// When the recording cannot be diagnosed.
    pub fn run(&self) -> Result<RecordDiagnosis> {
        let options = DiagnoseOptions {
            method: self.budget.method,
            fidelity: self.budget.fidelity,
            noise_a: Some(TOLD_NOISE_A),
            ..DiagnoseOptions::default()
        };
        Ok(self.diagnoser.diagnose(&self.recording, &options)?)
    }
}
