//! Starts of a recording that are not the bundle's: before or after the command, with the surface
//! elsewhere in its play, with a charged integrator.
//!
//! ```text
//! n = (2·τ/τ_max, s, ξ/ξ_p) ~ N(0, I)
//! ```
//!
//! with `τ` the time by which the command comes late in the recording, `s` the place in the play
//! and `ξ` the integral part of the current set-point.
//!
//! # Source
//!
//! Derived in `docs/models/diagnosis.md`, section "Another start of the test"; chosen in
//! `docs/decisions/0067-another-start-of-the-test.md`.

use ema_sim::{FaultCoordinates, InitialState, Scenario, SimulationError};

use crate::{
    online::{damage::START, options::DiagnoseOptions},
    report::{Notice, NoticeCode},
    simulation::experiment::Experiment,
};

/// Difference of the delay, in samples.
const DELAY_DIFFERENCE: f64 = 0.25;
/// Differences in units of the prior: of the place in the play and of the integrator.
const START_STEP: f64 = 0.1;
/// Most standard deviations of the prior that the integrator is looked for at.
const MOST_DEVIATIONS: f64 = 3.0;

/// True where the start is estimated with the faults.
pub(crate) fn is_free(options: &DiagnoseOptions) -> bool {
    options.max_delay_s > 0.0 || options.free_start
}

/// Part of a start that may be otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unknown {
    Delay,
    Side,
    Integral,
}

/// Parts of a start that are looked for.
#[derive(Clone, Debug)]
pub(crate) struct Freedom {
    /// Each with the size of its unit.
    pub(crate) unknowns: Vec<(Unknown, f64)>,
    /// Largest delay, s.
    pub(crate) most_s: f64,
    /// True where place in the play and integrator are among them.
    pub(crate) free_start: bool,
}

/// How a recording begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Start {
    /// The command comes late by this, s.
    pub(crate) delay_s: f64,
    /// Place of the surface in its play, −1 to 1, away from the bundle's.
    pub(crate) side: f64,
    /// Integral part of the current set-point, A, away from the bundle's.
    pub(crate) integral_a: f64,
}

/// How a recording was found to begin.
#[derive(Clone, Debug)]
pub(crate) struct Began {
    /// Parts that were looked for, with estimate and standard deviation.
    pub(crate) found: Vec<(Unknown, f64, f64)>,
}

impl Freedom {
    /// Freedom that options give; `None` where the recording begins as the bundle's test does.
    pub(crate) fn of(options: &DiagnoseOptions, experiment: &Experiment) -> Option<Self> {
        if !is_free(options) {
            return None;
        }
        let mut unknowns = Vec::new();
        if options.max_delay_s > 0.0 {
            unknowns.push((Unknown::Delay, 0.5 * options.max_delay_s));
        }
        if options.free_start {
            unknowns.extend(start_unknowns(experiment));
        }
        let (most_s, free_start) = (options.max_delay_s, options.free_start);
        Some(Self { unknowns, most_s, free_start })
    }

    pub(crate) fn start(&self, units: &[f64]) -> Start {
        let mut start = Start::default();
        for (&(unknown, unit), &value) in self.unknowns.iter().zip(units) {
            *start.place(unknown) = unit * value;
        }
        start
    }

    /// Largest value of each, in its units.
    pub(crate) fn most(&self) -> Vec<f64> {
        let most = |&(unknown, unit): &(Unknown, f64)| match unknown {
            Unknown::Delay => self.most_s / unit,
            Unknown::Side => 1.0,
            Unknown::Integral => MOST_DEVIATIONS,
        };
        self.unknowns.iter().map(most).collect()
    }

    /// Difference of each, in its units.
    pub(crate) fn steps(&self, rate_hz: f64) -> impl Iterator<Item = f64> {
        self.unknowns.iter().map(move |&(unknown, unit)| match unknown {
            Unknown::Delay => DELAY_DIFFERENCE / rate_hz / unit,
            Unknown::Side | Unknown::Integral => START_STEP,
        })
    }
}

/// Place in the play, and the integrator: it may hold what static friction lets stand.
pub(crate) fn start_unknowns(experiment: &Experiment) -> [(Unknown, f64); 2] {
    let actuator = &experiment.actuator;
    let held_a = actuator.transmission.static_friction_n_m / actuator.torque_constant_n_m_per_a();
    [(Unknown::Side, 1.0), (Unknown::Integral, held_a)]
}

impl Start {
    pub(crate) fn place(&mut self, unknown: Unknown) -> &mut f64 {
        match unknown {
            Unknown::Delay => &mut self.delay_s,
            Unknown::Side => &mut self.side,
            Unknown::Integral => &mut self.integral_a,
        }
    }

    /// The experiment with this start.
    pub(crate) fn of(&self, experiment: &Experiment) -> Experiment {
        let own = &experiment.scenario;
        let initial = InitialState {
            speed_integral_a: own.initial.speed_integral_a + self.integral_a,
            ..own.initial
        };
        let scenario = Scenario {
            backlash_side_ratio: (own.backlash_side_ratio + self.side).clamp(-1.0, 1.0),
            initial,
            ..own.clone()
        };
        Experiment { scenario, ..experiment.clone() }
    }

    /// The low-fidelity model's signal with this start.
    pub(crate) fn signal(
        &self,
        experiment: &Experiment,
        start_angle_rad: f64,
        faults: &FaultCoordinates,
    ) -> Result<Vec<f64>, SimulationError> {
        Ok(self.of(experiment).monitor(start_angle_rad)?.signal(faults))
    }
}

impl Began {
    /// By how much the command comes late, s.
    pub(crate) fn delay_s(&self) -> f64 {
        let delay = self.found.iter().find(|(unknown, ..)| *unknown == Unknown::Delay);
        delay.map_or(0.0, |&(_, value, _)| value)
    }

    /// Notice of how the recording begins.
    pub(crate) fn notices(&self, experiment: &Experiment) -> Vec<Notice> {
        let parts: Vec<String> = self
            .found
            .iter()
            .map(|&(unknown, value, std)| match unknown {
                Unknown::Delay => {
                    format!("{} ms (± {:.2})", delay_in_words(value), 1e3 * std)
                }
                Unknown::Side => {
                    let side = experiment.scenario.backlash_side_ratio + value;
                    format!("the surface at {side:.1} of its play (± {std:.1})")
                }
                Unknown::Integral => format!("the integrator at {value:.2} A (± {std:.2})"),
            })
            .collect();
        let message = format!("estimated with the faults: {}", parts.join(", "));
        vec![Notice { code: NoticeCode::StartEstimated, message }]
    }
}

/// A delay, s, in words and ms.
pub(crate) fn delay_in_words(delay_s: f64) -> String {
    let side = if delay_s >= 0.0 { "before" } else { "after" };
    format!("the recording begins {side} the command by {:.2}", 1e3 * delay_s.abs())
}

/// Changes of the signal by another place in the play and by a charge of the integrator, for one
/// unit of each, at damage in the middle of the range.
pub(crate) fn start_effects(experiment: &Experiment) -> Result<Vec<Vec<f64>>, SimulationError> {
    let mut all = START;
    for (index, value) in all.iter_mut().enumerate() {
        *value = if experiment.sought[index] { *value } else { 0.0 };
    }
    let faults = FaultCoordinates(all);
    let angle_rad = experiment.scenario.start_angle_rad;
    let effect = |unknown: Unknown, change: f64| -> Result<Vec<f64>, SimulationError> {
        let side = |sign: f64| {
            let mut start = Start::default();
            *start.place(unknown) = sign * change;
            start.signal(experiment, angle_rad, &faults)
        };
        let (up, down) = (side(1.0)?, side(-1.0)?);
        Ok(up.iter().zip(&down).map(|(u, d)| 0.5 * (u - d) / change).collect())
    };
    let effects = start_unknowns(experiment).map(|(unknown, unit)| match unknown {
        Unknown::Integral => effect(unknown, START_STEP * unit),
        _ => effect(unknown, unit),
    });
    effects.into_iter().collect()
}
