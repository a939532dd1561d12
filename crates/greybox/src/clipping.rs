//! Recordings cut at a level: the drive signal stands at an end of its range while the model's goes
//! on.

use ema_sim::model_file::MachineModel;
use inference::{EqualRuns, ends};

use crate::{
    error::{GreyboxError, if_run},
    machine::{Machine, State},
    record::{Record, Recordings},
    structure::Structure,
};

/// The first recording whose drive signal was cut at a level, told in a sentence: the signal stands
/// at an end of its range, below the limit of the controller, while that of the machine as its file
/// says goes on.
///
/// # Errors
///
/// [`GreyboxError`] where the machine cannot be run on the command of a recording.
pub fn clipped(
    model: &MachineModel,
    recordings: &Recordings,
) -> Result<Option<String>, GreyboxError> {
    Ok(first_clipped(&Machine::new(model), recordings)?.map(told))
}

/// Refuses recordings of which one was cut at a level.
pub(crate) fn refuse_clipped(
    machine: &Machine,
    recordings: &Recordings,
) -> Result<(), GreyboxError> {
    match first_clipped(machine, recordings)? {
        Some((record, reason)) => Err(GreyboxError::Record { record, reason }),
        None => Ok(()),
    }
}

/// Name of the first recording that was cut at a level, and what it shows.
pub(crate) fn first_clipped(
    machine: &Machine,
    recordings: &Recordings,
) -> Result<Option<(String, String)>, GreyboxError> {
    let nominal = Structure::nominal(machine);
    let values: Vec<f64> = nominal.free.iter().map(|free| free.start).collect();
    let state = nominal.state(machine, &values);
    for (place, record) in recordings.all().enumerate() {
        if let Some(Clipping { level, share }) = Clipping::of(record, machine, &state, place)? {
            let (percent, unit) = (100.0 * share, machine.drive_unit().to_uppercase());
            let reason = format!(
                "the signal is clipped: {percent:.1} % of the samples stand at {level} {unit} \
                 while the model's signal goes on; record it with a wider range, or, where the \
                 drive limits it there, give the model file that limit"
            );
            return Ok(Some((record.name.clone(), reason)));
        }
    }
    Ok(None)
}

/// A sentence on a recording.
pub(crate) fn told((record, reason): (String, String)) -> String {
    format!("{record}: {reason}")
}

/// A level at which a recording was cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Clipping {
    /// The level, A or V.
    pub(crate) level: f64,
    /// Share of all samples that stand at it.
    pub(crate) share: f64,
}

impl Clipping {
    /// Level at which a recording was cut, judged beside the machine in a state; `None` where it
    /// was not, or where the machine cannot be run on its command.
    pub(crate) fn of(
        record: &Record,
        machine: &Machine,
        state: &State,
        place: usize,
    ) -> Result<Option<Self>, GreyboxError> {
        let ready = machine.prepared(record);
        let predicted = if_run(machine.drive(state, record, &ready, place))?;
        let limit = machine.drive_limit();
        Ok(predicted.and_then(|predicted| Self::beside(&record.drive, &predicted, limit)))
    }

    /// Judges a signal beside the model's, whose controller allows no more than a limit. Where the
    /// signal stands at that limit the machine did, and where the model's signal stands too, as in
    /// a staircase, there is nothing that was cut.
    fn beside(signal: &[f64], predicted: &[f64], limit: f64) -> Option<Self> {
        let levels = ends(signal);
        let range = levels[1] - levels[0];
        if range <= 0.0 {
            return None;
        }
        let runs = EqualRuns::of(signal);
        let least = LEAST_RUN.max(OVER_MEDIAN * runs.median_length() + 1);
        let still = f64::max(LEAST_MOVE * range, smallest_step(signal));
        let at = |level: f64| {
            let standing = runs.iter().filter(|(value, run)| *value == level && run.len() >= least);
            let cut: Vec<&[f64]> = standing.filter_map(|(_, run)| predicted.get(run)).collect();
            let samples: usize = cut.iter().map(|run| run.len()).sum();
            let share = samples as f64 / signal.len() as f64;
            let is_limit = level.abs() >= LIMIT_SHARE * limit;
            let is_cut = samples >= LEAST_SAMPLES && share >= LEAST_SHARE && spread(&cut) > still;
            (!is_limit && is_cut).then_some(Self { level, share })
        };
        levels.into_iter().filter_map(at).max_by(|a, b| a.share.total_cmp(&b.share))
    }
}

/// Fewest samples that stand at a level, and their least share of all.
const LEAST_SAMPLES: usize = 8;
const LEAST_SHARE: f64 = 1e-3;
/// Standard deviation of the model's signal, over the range of the recorded one, from which it goes
/// on.
const LEAST_MOVE: f64 = 0.01;
/// Share of the controller's limit from which a level is that limit.
const LIMIT_SHARE: f64 = 0.98;
/// Fewest samples of a run, and their multiple of the median run: a signal that is held for several
/// samples stands everywhere.
const LEAST_RUN: usize = 3;
const OVER_MEDIAN: usize = 2;

/// Standard deviation of several stretches, each about its own mean.
fn spread(stretches: &[&[f64]]) -> f64 {
    let square = |stretch: &&[f64]| {
        let mean = stretch.iter().sum::<f64>() / stretch.len().max(1) as f64;
        stretch.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>()
    };
    let samples: usize = stretches.iter().map(|stretch| stretch.len()).sum();
    libm::sqrt(stretches.iter().map(square).sum::<f64>() / samples.max(1) as f64)
}

/// Smallest difference of two values: the step of a converter.
fn smallest_step(signal: &[f64]) -> f64 {
    let mut values = signal.to_vec();
    values.sort_by(f64::total_cmp);
    let steps = values.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0);
    let step = steps.fold(f64::INFINITY, f64::min);
    if step.is_finite() { step } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: f64 = 10.0;

    /// Two slow waves, of a magnitude up to 1.3.
    fn wave() -> Vec<f64> {
        (0..4000).map(f64::from).map(|t| libm::sin(0.01 * t) + 0.3 * libm::sin(0.037 * t)).collect()
    }

    fn cut_at(signal: &[f64], level: f64) -> Vec<f64> {
        signal.iter().map(|x| x.clamp(-level, level)).collect()
    }

    fn in_steps(signal: &[f64], step: f64) -> Vec<f64> {
        signal.iter().map(|x| step * libm::round(x / step)).collect()
    }

    #[test]
    fn a_log_cut_below_its_peak_is_found() {
        let whole = wave();
        for level in [0.3, 0.83 * 1.2, 1.15] {
            let found = Clipping::beside(&cut_at(&whole, level), &whole, LIMIT);
            assert_eq!(found.map(|cut| cut.level.abs()), Some(level));
        }
        // a model a fifth too weak, and a converter of 12 bits behind the cut
        let weak: Vec<f64> = whole.iter().map(|x| 0.8 * x).collect();
        let cut = in_steps(&cut_at(&whole, 1.0), 1.0 / 2048.0);
        assert!(Clipping::beside(&cut, &weak, LIMIT).is_some());
    }

    #[test]
    fn what_stands_with_its_model_or_at_its_limit_was_not_cut() {
        let whole = wave();
        assert_eq!(Clipping::beside(&whole, &whole, LIMIT), None);
        // the drive's own limit
        assert_eq!(Clipping::beside(&cut_at(&whole, 0.8), &cut_at(&whole, 0.8), 0.8), None);
        assert_eq!(Clipping::beside(&cut_at(&whole, 0.8), &whole, 0.8), None);
        // a staircase, and friction alone in a slow triangle, 30 % off
        let stairs: Vec<f64> = (0..4000).map(|n| f64::from(n / 500)).collect();
        let triangle: Vec<f64> =
            (0..4000).map(|n| if n / 500 % 2 == 0 { 1.0 } else { -1.0 }).collect();
        for standing in [stairs, triangle] {
            let off: Vec<f64> = standing.iter().map(|x| 0.7 * x).collect();
            assert_eq!(Clipping::beside(&standing, &off, LIMIT), None);
        }
    }

    #[test]
    fn coarse_steps_and_held_samples_are_no_cut() {
        let whole = wave();
        for step in [1.0 / 128.0, 1.0 / 32.0] {
            assert_eq!(Clipping::beside(&in_steps(&whole, step), &whole, LIMIT), None);
        }
        let held: Vec<f64> = (0..4000).map(|n| whole[n / 40 * 40]).collect();
        assert_eq!(Clipping::beside(&held, &whole, LIMIT), None);
    }
}
