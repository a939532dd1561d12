//! Shares of the diagnosed signal that errors of the phases' current sensors have.
//!
//! ```text
//! i'_j = (1 + g_j)·i_j + o_j
//! y'   = y + Σ_j g_j·F(w_j·i_j) + o_j·F(w_j)
//! ```
//!
//! with `w_j(θ)` the weight of phase `j` in the envelope and `F` its filter.
//!
//! # Source
//!
//! The envelope is a sum over the phases, `docs/models/envelope.md`.

use ema_sim::{Envelope, LowFidelityTrace};

use crate::{
    offline::error_model::add_scaled,
    simulation::experiment::Experiment,
    unit::layout::{Acts, Layout},
};

/// Filtered signals that one unit of each error adds, by phase.
#[derive(Clone, Debug)]
pub(crate) struct SensorShares {
    gains: [Vec<f64>; 3],
    offsets: [Vec<f64>; 3],
}

impl SensorShares {
    /// The share of a number, `None` for one of the machine.
    pub(crate) fn of(&self, acts: Acts) -> Option<&[f64]> {
        match acts {
            Acts::PhaseGain(phase) => Some(&self.gains[phase]),
            Acts::PhaseOffset(phase) => Some(&self.offsets[phase]),
            _ => None,
        }
    }

    /// Shares of measured phases with the sum over the gains that a model expects of the signal.
    ///
    /// All gains together have the signal itself for their share. Measured, it has the noise that
    /// the residual has, and a regression of one on the other finds a gain where there is none: with
    /// `N` white samples and the variance `s²` of the gain, `N·s²`. The differences of the gains keep
    /// their measured shares, whose noise is not that of the signal.
    pub(crate) fn with_expected_sum(&self, expected_a: &[f64]) -> Self {
        let mut shares = self.clone();
        for (n, expected) in expected_a.iter().enumerate() {
            let sum: f64 = self.gains.iter().map(|share| share[n]).sum();
            for share in &mut shares.gains {
                share[n] -= (sum - expected) / 3.0;
            }
        }
        shares
    }

    /// Adds what the sensors' errors at a point of the unknowns add to a signal.
    pub(crate) fn add(&self, layout: &Layout, point: &[f64], signal: &mut [f64]) {
        for (number, size) in layout.at(point) {
            if let Some(share) = self.of(number.acts) {
                add_scaled(signal, size, share);
            }
        }
    }
}

/// Shares in a recording of three phases.
pub(crate) fn measured_shares(
    phases_a: [&[f64]; 3],
    electrical_rad: &[f64],
    experiment: &Experiment,
    filtered: impl Fn(&[f64]) -> Vec<f64>,
) -> SensorShares {
    let envelope = linear(experiment.envelope);
    let unit = vec![1.0; electrical_rad.len()];
    let share = |phase: usize, channel: &[f64]| {
        filtered(
            &envelope.of_phases(alone(phase, channel, &vec![0.0; channel.len()]), electrical_rad),
        )
    };
    SensorShares {
        gains: [0, 1, 2].map(|phase| share(phase, phases_a[phase])),
        offsets: [0, 1, 2].map(|phase| share(phase, &unit)),
    }
}

/// Shares in the signal of a simulated test, whose phases carry the drive's current as the envelope
/// has it.
pub(crate) fn simulated_shares(
    trace: &LowFidelityTrace,
    experiment: &Experiment,
    filtered: impl Fn(&[f64]) -> Vec<f64>,
) -> SensorShares {
    let envelope = linear(experiment.envelope);
    let samples = trace.current_a.len();
    let (silent, unit) = (vec![0.0; samples], vec![1.0; samples]);
    let over_weight = match envelope {
        Envelope::SignedProjection => 2.0,
        Envelope::QAxis => 1.5,
        _ => 1.0,
    };
    let pole_pairs = experiment.actuator.motor.pole_pairs;
    let weights = [0, 1, 2].map(|phase| {
        envelope.of_phases_at(alone(phase, &unit, &silent), &trace.motor_angle_rad, pole_pairs)
    });
    // the current of a phase is the drive's times its weight, over what the weight is of one
    let of_current = |weight: &Vec<f64>| {
        let pairs = weight.iter().zip(&trace.current_a);
        filtered(&pairs.map(|(w, i)| over_weight * w * w * i).collect::<Vec<_>>())
    };
    SensorShares {
        gains: weights.each_ref().map(of_current),
        offsets: weights.each_ref().map(|weight| filtered(weight)),
    }
}

/// The envelope as a sum over the phases: half of the sum of magnitudes grows as the projection on
/// the pattern does.
fn linear(envelope: Envelope) -> Envelope {
    match envelope {
        Envelope::HalfAbsSum => Envelope::SignedProjection,
        other => other,
    }
}

/// Channels of which one phase has a current.
fn alone<'a>(phase: usize, channel: &'a [f64], silent: &'a [f64]) -> [&'a [f64]; 3] {
    let mut channels = [silent; 3];
    channels[phase] = channel;
    channels
}
