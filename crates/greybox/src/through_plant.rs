//! How much of a residual came about through the plant: a disturbance that no recording repeats
//! hides in the difference of two recordings, but it moves the motor, and the controller answers.

use inference::{Whitener, rms};

use crate::{
    error::GreyboxError,
    gram::dot,
    machine::State,
    problem::{PerRecord, Problem},
};

/// Length of the blocks whose scatter says how sure a share is, s.
const BLOCK_S: f64 = 0.25;
/// Energy over that of the noise from which on something is left: the accuracy of the replay.
const LEAST_EXCESS: f64 = 0.02;
/// Share of the energy explained that the form of a catalogue's law may leave: seven hundredths
/// of the amplitude.
const FORM_SHARE: f64 = 0.005;

/// A residual against what of it did not come through the plant: `r = p + n`, where `p` is the
/// controller's answer to the measured position less that to the predicted one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ThroughPlant {
    /// Energy of `r` over that of `n`, both whitened as `n` is, less one.
    pub(crate) excess: f64,
    /// Standard deviation without a disturbance, from the scatter of most blocks.
    pub(crate) std: f64,
    /// Root mean square of `n`.
    pub(crate) rms: f64,
}

impl ThroughPlant {
    /// `None` without positions.
    pub(crate) fn of(
        problem: &Problem<'_>,
        state: &State,
        residuals: &PerRecord,
    ) -> Result<Option<Self>, GreyboxError> {
        let mut beside = PerRecord::new();
        for (prepared, residual) in problem.records.iter().zip(residuals) {
            let (record, place) = (prepared.record, prepared.place);
            let moved = prepared.moved_motor();
            let Some(answer) = problem.machine.through_plant(state, record, place, moved)? else {
                return Ok(None);
            };
            let answer = prepared.of_equal_noise(prepared.reduce(&answer));
            beside.push(residual.iter().zip(&answer).map(|(r, p)| r - p).collect());
        }
        let stretches: Vec<&[f64]> = beside.iter().map(Vec::as_slice).collect();
        let whitener = Whitener::fit(&stretches, 0);
        let (mut gains, mut noise) = (Vec::new(), 0.0);
        for ((prepared, residual), beside) in problem.records.iter().zip(residuals).zip(&beside) {
            let block = (libm::round(BLOCK_S * prepared.rate_hz()) as usize).max(1);
            let (r, n) = (whitener.apply(residual), whitener.apply(beside));
            let blocks = r.chunks(block).zip(n.chunks(block));
            gains.extend(blocks.map(|(r, n)| dot(r, r) - dot(n, n)));
            noise += dot(&n, &n);
        }
        let noise = noise.max(f64::MIN_POSITIVE);
        let count = gains.len().max(1) as f64;
        Ok(Some(Self {
            excess: gains.iter().sum::<f64>() / noise,
            std: usual_scatter(&gains) * libm::sqrt(count) / noise,
            rms: rms(&beside.concat()),
        }))
    }

    /// Tells whether the plant did more than the model says, which explains what the nominal one
    /// left
    /// but for the form of what was found.
    pub(crate) fn is_there(self, nominal: Self) -> bool {
        let explained = (nominal.excess - self.excess).max(0.0);
        self.excess > LEAST_EXCESS + FORM_SHARE * explained + 3.0 * self.std
    }
}

/// Scatter of most values, which a few pulses do not widen: the median departure from the
/// median, as of normal values.
fn usual_scatter(values: &[f64]) -> f64 {
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    };
    let middle = median(values.to_vec());
    1.4826 * median(values.iter().map(|x| (x - middle).abs()).collect())
}
