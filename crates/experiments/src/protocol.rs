//! The experiments: whose models, which faults, how many conditions.

use fdi_core::Experiment;

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
    /// Friction and backlash alone, on the sine (Tables 7 and 8).
    Bench,
    /// Noise of the sensors: errors against the Cramér-Rao bound, coverage, false alarms.
    Noisy,
}

impl Protocol {
    /// Every protocol.
    pub const ALL: [Self; 5] =
        [Self::High, Self::Low, Self::Metaheuristics, Self::Bench, Self::Noisy];

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::High => "high",
            Self::Low => "low",
            Self::Metaheuristics => "metaheuristics",
            Self::Bench => "bench",
            Self::Noisy => "noisy",
        }
    }

    /// The actuator, its test and the faults looked for.
    pub fn experiment(self) -> Experiment {
        if self == Self::Bench { Experiment::sine() } else { Experiment::chirp() }
    }

    /// Test conditions of the paper (of ours for [`Noisy`](Self::Noisy)).
    pub fn default_conditions(self) -> usize {
        match self {
            Self::Bench => 10,
            Self::Noisy => 1000,
            Self::High | Self::Low | Self::Metaheuristics => 100,
        }
    }

    /// The methods that search unless others are told.
    pub fn default_contenders(self) -> &'static [Contender] {
        match self {
            Self::Noisy => &[Contender::Gls],
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
