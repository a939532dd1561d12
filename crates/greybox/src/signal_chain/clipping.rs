//! Recordings cut at a level: the drive signal stands at an end of its range while the model's goes
//! on.

use inference::{EqualRuns, Standing, ends, rms};

use super::find::{SignalChannel, SignalCode, SignalEquation, SignalFind, SignalSize};
use crate::{
    error::{GreyboxError, if_run},
    machine::Machine,
    record::Recordings,
    structure::Structure,
};

/// The first recording whose drive signal was cut at a level: the signal stands at an end of its
/// range, below the limit of the controller, while that of the machine as its file says goes on.
pub(crate) fn first_clipped(
    machine: &Machine,
    recordings: &Recordings,
) -> Result<Option<SignalFind>, GreyboxError> {
    let nominal = Structure::nominal(machine);
    let state = nominal.state(machine, &nominal.starts());
    for (place, record) in recordings.all().enumerate() {
        // what cannot be run is told where it is fitted
        let Some(predicted) = if_run(machine.simulate(&state, record, place))? else { continue };
        let cut = cut(&record.drive, &predicted.drive, machine.drive_limit());
        if let Some(Standing { level, share, .. }) = cut {
            let (percent, unit) = (100.0 * share, machine.drive_unit().to_uppercase());
            let told = format!(
                "{}: the signal is clipped: {percent:.1} % of the samples stand at {level} {unit} \
                 while the model's signal goes on",
                record.name
            );
            let remedy = "record it with a wider range, or, where the drive limits it there, give \
                          the model file that limit";
            return Ok(Some(SignalFind {
                code: SignalCode::Saturated,
                equation: SignalEquation::Samples,
                record: record.name.clone(),
                channel: Some(SignalChannel::Drive),
                size: SignalSize { value: level, std: None, unit: machine.drive_unit() },
                told,
                remedy: remedy.to_owned(),
                corrected: false,
                correction: None,
            }));
        }
    }
    Ok(None)
}

/// Where a signal was cut, judged beside the model's, whose controller allows no more than a limit.
/// Where the model's signal stands too, as in a staircase, there is nothing that was cut.
fn cut(signal: &[f64], predicted: &[f64], limit: f64) -> Option<Standing> {
    let runs = EqualRuns::of(signal);
    // a signal that is held for several samples stands everywhere
    let standing = runs.standing_at_ends(limit, OVER_MEDIAN * runs.median_length());
    let [least, most] = ends(signal);
    let goes_on = |at: &Standing| {
        let stretches = at.runs.iter().filter_map(|run| predicted.get(run.clone()));
        let about_mean: Vec<f64> = stretches.flat_map(about_mean).collect();
        rms(&about_mean) > f64::max(LEAST_MOVE * (most - least), smallest_step(signal))
    };
    standing.into_iter().filter(goes_on).max_by(|a, b| a.share.total_cmp(&b.share))
}

/// Standard deviation of the model's signal, over the range of the recorded one, from which it goes
/// on.
const LEAST_MOVE: f64 = 0.01;
/// Length of a run over the median one, above which it tells.
const OVER_MEDIAN: usize = 2;

/// A stretch less its mean.
fn about_mean(stretch: &[f64]) -> impl Iterator<Item = f64> {
    let mean = stretch.iter().sum::<f64>() / stretch.len().max(1) as f64;
    stretch.iter().map(move |x| x - mean)
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
            let found = cut(&cut_at(&whole, level), &whole, LIMIT);
            assert_eq!(found.map(|at| at.level.abs()), Some(level));
        }
        // a model a fifth too weak, and a converter of 12 bits behind the cut
        let weak: Vec<f64> = whole.iter().map(|x| 0.8 * x).collect();
        let clamped = in_steps(&cut_at(&whole, 1.0), 1.0 / 2048.0);
        assert!(cut(&clamped, &weak, LIMIT).is_some());
    }

    #[test]
    fn what_stands_with_its_model_or_at_its_limit_was_not_cut() {
        let whole = wave();
        assert_eq!(cut(&whole, &whole, LIMIT), None);
        // the drive's own limit
        assert_eq!(cut(&cut_at(&whole, 0.8), &cut_at(&whole, 0.8), 0.8), None);
        assert_eq!(cut(&cut_at(&whole, 0.8), &whole, 0.8), None);
        // a staircase, and friction alone in a slow triangle, 30 % off
        let stairs: Vec<f64> = (0..4000).map(|n| f64::from(n / 500)).collect();
        let triangle: Vec<f64> =
            (0..4000).map(|n| if n / 500 % 2 == 0 { 1.0 } else { -1.0 }).collect();
        for standing in [stairs, triangle] {
            let off: Vec<f64> = standing.iter().map(|x| 0.7 * x).collect();
            assert_eq!(cut(&standing, &off, LIMIT), None);
        }
    }

    #[test]
    fn coarse_steps_and_held_samples_are_no_cut() {
        let whole = wave();
        for step in [1.0 / 128.0, 1.0 / 32.0] {
            assert_eq!(cut(&in_steps(&whole, step), &whole, LIMIT), None);
        }
        let held: Vec<f64> = (0..4000).map(|n| whole[n / 40 * 40]).collect();
        assert_eq!(cut(&held, &whole, LIMIT), None);
    }
}
