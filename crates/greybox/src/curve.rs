//! Curves for a reader: the residual over each coordinate before and after, and how every
//! effect of the catalogue fared.

use ema_sim::{EffectId, Geometry};

use crate::{machine::Machine, problem::PerRecord, rival::Rival, scan::Scan, show::NAMES};

/// The mean residual over a coordinate of all recordings that were fitted or held out.
#[derive(Clone, Debug, PartialEq)]
pub struct ResidualCurve {
    /// `time`, `speed`, `motor-angle` (within a period of the current), `position`, `drive` or
    /// `load`.
    pub coordinate: &'static str,
    /// Unit of the coordinate, as keys are spelt: `rad_per_s`.
    pub unit: &'static str,
    /// Share of the nominal residual's variance that the means over bins explain, beyond chance.
    pub share_before: f64,
    /// Share of the variance of the residual with the effects found, in the same way.
    pub share_after: f64,
    /// The bins that hold samples, along the coordinate.
    pub bins: Vec<CurveBin>,
}

/// A stretch of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveBin {
    /// Middle of the stretch.
    pub centre: f64,
    /// Samples in it.
    pub samples: usize,
    /// Mean residual with the nominal model, in the unit of the drive signal.
    pub mean_before: f64,
    /// Mean residual with the effects found.
    pub mean_after: f64,
}

/// How an effect of the catalogue fared against the nominal model.
#[derive(Clone, Debug, PartialEq)]
pub struct Hypothesis {
    /// The effect.
    pub id: EffectId,
    /// Natural logarithm of the chance that noise alone scores as much for this effect.
    pub log_p: f64,
    /// Share of what the effect does that damage and roughly known numbers cannot imitate.
    pub visible_share: f64,
    /// Outcome of its refit; only the best of the scan are refitted.
    pub refit: Option<Refit>,
}

/// Outcome of fitting an effect together with everything else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refit {
    /// Gain in log-likelihood on recordings not fitted, nats.
    pub holdout_gain_nats: f64,
    /// Standard error of the gain held out.
    pub holdout_gain_se: f64,
    /// Gain in evidence, nats.
    pub evidence_nats: f64,
    /// True where a number of the effect stands on a bound, which no explanation may.
    pub on_bound: bool,
}

/// Bins of a coordinate.
const BINS: usize = 32;

/// The curves, the one that explains most of the nominal residual first. `along` holds each
/// coordinate over all samples, in the order of [`NAMES`].
pub(crate) fn curves(
    machine: &Machine,
    along: &[Vec<f64>; NAMES.len()],
    before: &[f64],
    after: &[f64],
) -> Vec<ResidualCurve> {
    let of = |(place, values): (usize, &Vec<f64>)| {
        let unit = unit(machine, NAMES[place])?;
        curve(values, before, after).map(|curve| ResidualCurve {
            coordinate: NAMES[place],
            unit,
            ..curve
        })
    };
    let mut curves: Vec<ResidualCurve> = along.iter().enumerate().filter_map(of).collect();
    curves.sort_by(|a, b| b.share_before.total_cmp(&a.share_before));
    curves
}

/// The unit of a coordinate; `None` for one that the machine does not have.
fn unit(machine: &Machine, coordinate: &str) -> Option<&'static str> {
    let is_linear = machine.geometry() == Geometry::Linear;
    Some(match (coordinate, is_linear) {
        ("time", _) => "s",
        ("drive", _) => machine.drive_unit(),
        // without commutation no period of the current is known
        ("motor-angle", _) if machine.is_axis() => return None,
        ("speed", false) => "rad_per_s",
        ("speed", true) => "m_per_s",
        ("load", false) => "n_m",
        ("load", true) => "n",
        (_, false) => "rad",
        (_, true) => "m",
    })
}

/// Means of both residuals over bins of equal width; `None` where the coordinate does not move.
fn curve(values: &[f64], before: &[f64], after: &[f64]) -> Option<ResidualCurve> {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let width = (most - least) / BINS as f64;
    if !(width.is_finite() && width > 0.0) {
        return None;
    }
    let mut sums = [(0_usize, [0.0_f64; 2]); BINS];
    for (value, residuals) in values.iter().zip(before.iter().zip(after)) {
        let (count, sum) = &mut sums[(((value - least) / width) as usize).min(BINS - 1)];
        *count += 1;
        sum[0] += residuals.0;
        sum[1] += residuals.1;
    }
    let held = || sums.iter().filter(|(count, _)| *count > 0);
    let by_chance = held().count() as f64 / values.len() as f64;
    let share = |place: usize, residual: &[f64]| {
        let explained: f64 =
            held().map(|(count, sum)| sum[place] * sum[place] / *count as f64).sum();
        let total: f64 = residual.iter().map(|x| x * x).sum();
        (explained / total.max(f64::MIN_POSITIVE) - by_chance).max(0.0)
    };
    let bin = |(place, (samples, sum)): (usize, &(usize, [f64; 2]))| CurveBin {
        centre: least + (place as f64 + 0.5) * width,
        samples: *samples,
        mean_before: sum[0] / *samples as f64,
        mean_after: sum[1] / *samples as f64,
    };
    Some(ResidualCurve {
        coordinate: "",
        unit: "",
        share_before: share(0, before),
        share_after: share(1, after),
        bins: sums.iter().enumerate().filter(|(_, (count, _))| *count > 0).map(bin).collect(),
    })
}

/// Every effect of a scan once, at its best, with its refit where it has one.
pub(crate) fn hypotheses(of_family: &[EffectId], scan: &Scan, rivals: &[Rival]) -> Vec<Hypothesis> {
    let mut all: Vec<Hypothesis> = Vec::new();
    for scored in &scan.scored {
        let id = of_family[scored.family];
        let rival = rivals.iter().find(|rival| rival.family == scored.family);
        let refit = rival.map(|rival| Refit {
            holdout_gain_nats: rival.claim.gain.nats,
            holdout_gain_se: rival.claim.gain.std_error,
            evidence_nats: rival.claim.evidence,
            on_bound: rival.claim.on_bound,
        });
        match all.iter_mut().find(|one| one.id == id) {
            None => all.push(Hypothesis {
                id,
                log_p: scored.log_p,
                visible_share: scored.visible_share,
                refit,
            }),
            // of two questions about one effect the refit that gains more is told
            Some(one) => {
                let gain = |refit: &Option<Refit>| {
                    refit.map_or(f64::NEG_INFINITY, |refit| refit.holdout_gain_nats)
                };
                if gain(&refit) > gain(&one.refit) {
                    one.refit = refit;
                }
            }
        }
    }
    all
}

/// One signal of all recordings.
pub(crate) fn joined<'a>(parts: impl IntoIterator<Item = &'a PerRecord>) -> Vec<f64> {
    parts.into_iter().flatten().flatten().copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_shows_what_follows_the_coordinate_before_and_not_after() {
        let values: Vec<f64> = (0..6400).map(|n| libm::sin(0.01 * f64::from(n))).collect();
        let noise: Vec<f64> = (0..6400).map(|n| 0.1 * libm::sin(f64::from(n * n))).collect();
        let before: Vec<f64> = values.iter().zip(&noise).map(|(x, e)| 2.0 * x + e).collect();
        let curve = curve(&values, &before, &noise).unwrap();
        assert!(curve.share_before > 0.98, "{}", curve.share_before);
        assert!(curve.share_after < 0.02, "{}", curve.share_after);
        assert_eq!(curve.bins.iter().map(|bin| bin.samples).sum::<usize>(), 6400);
        // at the ends of a sine the bins are curved most
        for bin in &curve.bins {
            assert!((bin.mean_before - 2.0 * bin.centre).abs() < 0.05, "{bin:?}");
        }
    }

    #[test]
    fn a_coordinate_that_stands_still_has_no_curve() {
        assert_eq!(curve(&[1.0; 9], &[0.5; 9], &[0.1; 9]), None);
        assert_eq!(curve(&[], &[], &[]), None);
    }
}
