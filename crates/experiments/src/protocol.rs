//! The experiments: whose models, which faults, how many conditions.

use fdi_core::{
    Experiment, ExperimentError,
    ema_sim::{model_file::Model, presets::BENCH},
};

use crate::contender::Contender;

/// An experiment of the FREEDOM paper, or of ours with noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Protocol {
    /// The high-fidelity model monitors (Tables 2 and 3).
    High,
    /// The low-fidelity model monitors (Tables 4 and 5).
    Low,
    /// The low-fidelity model monitors, population methods search (Table 6).
    Metaheuristics,
    /// Friction and backlash alone, on the sine of the preset `bench` (Tables 7 and 8).
    Bench,
    /// [`Bench`](Self::Bench) with noise of the sensors, judged as [`Noisy`](Self::Noisy).
    BenchNoisy,
    /// Noise of the sensors: errors against the Cramér-Rao bound, coverage, false alarms.
    Noisy,
}

impl Protocol {
    /// Every protocol.
    pub const ALL: [Self; 6] =
        [Self::High, Self::Low, Self::Metaheuristics, Self::Bench, Self::BenchNoisy, Self::Noisy];

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::High => "high",
            Self::Low => "low",
            Self::Metaheuristics => "metaheuristics",
            Self::Bench => "bench",
            Self::BenchNoisy => "bench-noisy",
            Self::Noisy => "noisy",
        }
    }

    /// True where errors are judged against bounds, under noise of the sensors.
    pub fn is_noisy(self) -> bool {
        matches!(self, Self::Noisy | Self::BenchNoisy)
    }

    /// The actuator, its test and the faults looked for.
    ///
    /// # Errors
    ///
    /// [`ExperimentError`] for a preset that cannot be tested; none is such.
    pub fn experiment(self) -> Result<Experiment, ExperimentError> {
        match self {
            Self::Bench | Self::BenchNoisy => {
                Experiment::sine().of_model("bench", &Model::from(BENCH))
            }
            _ => Ok(Experiment::chirp()),
        }
    }

    /// Test conditions of the paper; of ours under noise.
    pub fn default_conditions(self) -> usize {
        match self {
            Self::Bench => 10,
            Self::Noisy => 1000,
            Self::BenchNoisy => 200,
            Self::High | Self::Low | Self::Metaheuristics => 100,
        }
    }

    /// The methods that search unless others are told.
    pub fn default_contenders(self) -> &'static [Contender] {
        match self {
            Self::Noisy | Self::BenchNoisy => &[Contender::Gls],
            Self::High | Self::Low | Self::Bench => &[
                Contender::Gls,
                Contender::Emulator,
                Contender::Ei,
                Contender::Ucb,
                Contender::TwoStepEi,
            ],
            Self::Metaheuristics => &[
                Contender::Gls,
                Contender::Genetic,
                Contender::Swarm,
                Contender::DifferentialEvolution,
                Contender::GreyWolves,
                Contender::CmaEs,
            ],
        }
    }
}
