//! Prediction of a recording by a machine in its electronics: where a simpler model has to be moved
//! to, and how much the noise in the control loop scatters it.
//!
//! ```text
//! y(t) = s(θ, t) + a(t) + e(t),   a = mean_k m_k(θ_0) − s(θ_0)
//! var e(t) = σ² + v(t)·(1 + 1/n)
//! ```
//!
//! with the simple model `s`, without noise or steps, that is cheap and smooth in its numbers `θ`;
//! the runs `m_k` of a finer one with the noise and the steps of its electronics, by `n` seeds, at
//! the numbers `θ_0`; their variance `v`; the noise `σ` of the sensors that recorded. Near `θ_0` the
//! prediction is the finer model's, and the simple one says how it changes with each number.
//!
//! # Source
//!
//! Defect correction, as in the space mapping of Bandler et al. 1994; `docs/models/greybox.md`.

use ema_sim::{Electronics, MachineSignals, ModelFidelity};

use crate::{
    error::{GreyboxError, if_run},
    machine::{Machine, State},
    record::Record,
};

/// Runs with seeds of their own.
const RUNS: u64 = 8;
/// Half of the stretch over which a variance is averaged, s: the loop's answer to its noise.
const SMOOTHED_S: f64 = 0.02;

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
    ) -> Result<Option<Self>, GreyboxError> {
        let simple = machine.simulate(state, record, place)?;
        let mut runs: Vec<MachineSignals> = Vec::new();
        for seed in 0..RUNS {
            let electronics = Electronics { fidelity, noise_seed: Some(seed), is_digitised: true };
            let run = machine.run_with_electronics(electronics, state, record, place);
            let Some(run) = if_run(run)? else { return Ok(None) };
            runs.push(run);
        }
        let mean = |of: fn(&MachineSignals) -> &Vec<f64>| -> Vec<f64> {
            let sum = |n: usize| runs.iter().map(|run| of(run)[n]).sum::<f64>();
            (0..simple.drive.len()).map(|n| sum(n) / RUNS as f64).collect()
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

/// Variance at each sample of signals about zero, averaged over stretches: of `n` signals `n − 1`
/// are free, and the mean that was taken off scatters by an `n`-th.
pub(crate) fn local_variance(scatter: &[Vec<f64>], rate_hz: f64) -> Vec<f64> {
    let runs = scatter.len() as f64;
    let samples = scatter.first().map_or(0, Vec::len);
    let at = |n: usize| scatter.iter().map(|run| run[n] * run[n]).sum::<f64>();
    let squares: Vec<f64> = (0..samples).map(at).collect();
    let half = libm::round(SMOOTHED_S * rate_hz) as usize;
    let mean = |n: usize| {
        let stretch = &squares[n.saturating_sub(half)..(n + half + 1).min(samples)];
        stretch.iter().sum::<f64>() / stretch.len() as f64
    };
    let scale = (1.0 + 1.0 / runs) / (runs - 1.0).max(1.0);
    (0..samples).map(|n| scale * mean(n)).collect()
}
