//! Options of `fdi evaluate`.

use std::num::NonZeroUsize;

use clap::{Args, ValueEnum};
use experiments::Contender;

use super::{ReportArgs, noise_a};

/// Options of `fdi evaluate`.
#[derive(Clone, Debug, Args)]
pub struct EvaluateArgs {
    /// Which experiment
    #[arg(value_enum)]
    pub protocol: ProtocolArg,
    /// Test conditions [default: the paper's number; 1000 for `noisy`, 200 for `bench-noisy`]
    #[arg(long, value_name = "N")]
    pub conditions: Option<NonZeroUsize>,
    /// Search methods, by the names of [`Contender::ALL`]
    #[arg(long, value_delimiter = ',', value_name = "METHOD,...", help = methods_help())]
    pub methods: Vec<String>,
    /// Noise inside the controller of the reference
    #[arg(long, value_enum, default_value_t = Switch::Off)]
    pub controller_noise: Switch,
    /// Digitisation inside the control loop of the reference
    #[arg(long, value_enum, default_value_t = Switch::Off)]
    pub digitisation: Switch,
    /// Noise on each phase sample before a 12-bit converter, rms [default: 0, neither; 0.02 for the noisy ones]
    #[arg(long, value_name = "A", value_parser = noise_a)]
    pub noise_a: Option<f64>,
    /// Rate of the phase samples
    #[arg(long, default_value_t = 10_000.0, value_name = "N")]
    pub phase_rate_hz: f64,
    /// Reference signals that everything is learnt on
    #[arg(long, default_value = "100", value_name = "N")]
    pub snapshots: NonZeroUsize,
    /// Reference signals with most faults absent beside them [default: 0; 100 for the noisy ones]
    #[arg(long, value_name = "N")]
    pub sparse_snapshots: Option<usize>,
    /// Healthy recordings on which false alarms are counted (the noisy ones)
    #[arg(long, default_value_t = 500, value_name = "N")]
    pub healthy: usize,
    /// Largest level that `ei`, `ucb`, `two-step-ei` and the population methods look at
    #[arg(long, default_value_t = 1.0, value_name = "LEVEL")]
    pub largest_level: f64,
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub report: ReportArgs,
    /// Most evaluations of the model in one search [default: the method's own]
    #[arg(long, value_name = "N")]
    pub max_evaluations: Option<NonZeroUsize>,
}

/// Help that lists the methods as the experiments name them.
fn methods_help() -> String {
    let names = Contender::ALL.map(|one| format!("`{}`", one.name()));
    format!("Search methods: {} [default: those of the experiment]", names.join(", "))
}

/// An experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ProtocolArg {
    /// High-fidelity model as monitor (Tables 2, 3)
    High,
    /// Low-fidelity model as monitor (Tables 4, 5)
    Low,
    /// Population methods (Table 6)
    Metaheuristics,
    /// Friction and backlash on the sine of the preset `bench` (Tables 7, 8)
    Bench,
    /// Bench with sensor noise: bounds, coverage, false alarms
    BenchNoisy,
    /// Sensor noise: bounds, coverage, false alarms
    Noisy,
}

/// On or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    /// Present
    On,
    /// Absent
    Off,
}
