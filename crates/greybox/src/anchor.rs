//! Prediction of a recording by a machine in its electronics: where a simpler model has to be moved
//! to, and how much the noise in the control loop scatters it.
//!
//! ```text
//! y(t) = s(θ, t) + a(t) + e(t),   a = mean_k m_k(θ_0) − s(θ_0)
//! cov e = σ²·I + V·(1 + 1/n)
//! ```
//!
//! with the simple model `s`, without noise or steps, that is cheap and smooth in its numbers `θ`;
//! the runs `m_k` of a finer one with the noise and the steps of its electronics, by `n` seeds, at
//! the numbers `θ_0`; their covariance `V`, tapered; the noise `σ` of the sensors that recorded. Near `θ_0` the
//! prediction is the finer model's, and the simple one says how it changes with each number.
//!
//! # Source
//!
//! Defect correction, as in the space mapping of Bandler et al. 1994; `docs/models/greybox.md`.

use ema_sim::{Electronics, MachineSignals, ModelFidelity};
use inference::{BandedMatrix, shrunk_covariance};

use crate::{
    error::{GreyboxError, if_run},
    machine::{Machine, State},
    record::Record,
};

/// Runs with seeds of their own, from which noise is learnt.
pub(crate) const RUNS: u64 = 12;
/// Runs that tell which model predicts: their means are of use, their scatter is not.
pub(crate) const FEW_RUNS: u64 = 2;
/// Time from which on samples share no noise of the loop, s: a late breakaway shifts what follows.
const MEMORY_S: f64 = 0.15;

/// Mean of runs less the simple model, and the scatter of runs, at the rate of a recording.
#[derive(Clone, Debug)]
pub(crate) struct Anchor {
    /// Mean drive signal of the runs less that of the simple model.
    pub(crate) drive: Vec<f64>,
    /// Mean position of the motor less that of the simple model.
    pub(crate) motor: Vec<f64>,
    /// Drive signals of the runs less their mean.
    pub(crate) scatter: Vec<Vec<f64>>,
}

impl Anchor {
    /// Anchor of a recording in a state of the machine; `None` where the finer model cannot be run
    /// in it.
    pub(crate) fn new(
        machine: &Machine,
        fidelity: ModelFidelity,
        state: &State,
        record: &Record,
        place: usize,
        count: u64,
    ) -> Result<Option<Self>, GreyboxError> {
        let simple = machine.simulate(state, record, place)?;
        let mut runs: Vec<MachineSignals> = Vec::new();
        for seed in 0..count {
            let electronics = Electronics { fidelity, noise_seed: seed };
            let run = machine.run_with_electronics(electronics, state, record, place);
            let Some(run) = if_run(run)? else { return Ok(None) };
            runs.push(run);
        }
        let mean = |of: fn(&MachineSignals) -> &Vec<f64>| -> Vec<f64> {
            let sum = |n: usize| runs.iter().map(|run| of(run)[n]).sum::<f64>();
            (0..simple.drive.len()).map(|n| sum(n) / count as f64).collect()
        };
        let (drive, motor) = (mean(|run| &run.drive), mean(|run| &run.motor));
        let less = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>();
        Ok(Some(Self {
            scatter: runs.iter().map(|run| less(&run.drive, &drive)).collect(),
            drive: less(&drive, &simple.drive),
            motor: less(&motor, &simple.motor),
        }))
    }
}

/// Covariance of the noise in the loop by runs less their mean, of which `n − 1` are free; samples
/// far apart share none, and so few runs are taken to show what is alike throughout.
pub(crate) fn loop_covariance(scatter: &[Vec<f64>], rate_hz: f64) -> BandedMatrix {
    let runs = scatter.len() as f64;
    let support = libm::ceil(MEMORY_S * rate_hz) as usize;
    shrunk_covariance(scatter, support.max(1), (runs - 1.0).max(1.0))
}
