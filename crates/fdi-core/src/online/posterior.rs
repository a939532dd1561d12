//! From an estimate and its covariance to levels, intervals and decisions.
//!
//! `k1..k5` are decided each, `k6` and `k7` jointly as the point `(k6·cos φ, k6·sin φ)`.

use core::f64::consts::TAU;
use ema_sim::{FAULT_COUNT, FaultCoordinates};

use fdi_report::FALSE_ALARM_RATE;
use nalgebra::{DMatrix, Matrix2, Vector2};
use statrs::distribution::{ContinuousCDF, Normal};

use crate::{
    report::{Covariance, Fault, FaultId},
    unit::search::Explained,
};

/// Probability of the stated intervals.
const LEVEL: f64 = 0.95;
/// Two-sided normal quantile of [`LEVEL`].
pub(crate) const TWO_SIDED: f64 = 1.959_963_984_540_054;

/// Knowledge of the damage: an estimate free of bounds, with its covariance, for the
/// coordinates that the recording determines.
#[derive(Clone, Debug)]
pub(crate) struct Posterior {
    /// Indices of the coordinates of `FaultCoordinates` that are determined.
    pub(crate) indices: Vec<usize>,
    pub(crate) estimate: Vec<f64>,
    pub(crate) covariance: DMatrix<f64>,
    /// Evidence of the recording on its machine, where the machine was within its tolerances.
    pub(crate) explained: Option<Explained>,
}

/// Where the eccentricity stands in the coordinates.
pub(crate) const ECCENTRICITY: [usize; 2] = [5, 6];

impl Posterior {
    /// The coordinates found, those not determined zero.
    pub(crate) fn damage(&self) -> FaultCoordinates {
        let mut damage = FaultCoordinates([0.0; FAULT_COUNT]);
        for (&index, &value) in self.indices.iter().zip(&self.estimate) {
            damage.0[index] = value;
        }
        damage
    }

    /// All seven faults, those not determined null.
    pub(crate) fn faults(&self) -> Vec<Fault> {
        let mut faults: Vec<Fault> = FaultId::ALL.map(Fault::undetermined).into();
        for (place, &index) in self.indices.iter().enumerate() {
            if index < ECCENTRICITY[0] {
                let std = self.covariance[(place, place)].sqrt();
                faults[index] = one_sided(FaultId::ALL[index], self.estimate[place], std);
            }
        }
        if let Some((point, covariance)) = self.eccentricity() {
            let (amplitude, direction) = polar(&point, &covariance);
            faults[5] = amplitude;
            faults[6] = direction;
        }
        faults
    }

    /// The joint covariance as the report has it.
    pub(crate) fn report_covariance(&self) -> Covariance {
        let names = ema_sim::FaultCoordinates::NAMES;
        let order = self.indices.len();
        Covariance {
            parameters: self.indices.iter().map(|&i| names[i].to_owned()).collect(),
            estimate: self.estimate.clone(),
            matrix: (0..order)
                .map(|i| (0..order).map(|j| self.covariance[(i, j)]).collect())
                .collect(),
        }
    }

    /// Point and covariance of the eccentricity, where both coordinates are determined.
    fn eccentricity(&self) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let place = |index| self.indices.iter().position(|&i| i == index);
        let (x, y) = (place(ECCENTRICITY[0])?, place(ECCENTRICITY[1])?);
        let c = &self.covariance;
        Some((
            Vector2::new(self.estimate[x], self.estimate[y]),
            Matrix2::new(c[(x, x)], c[(x, y)], c[(y, x)], c[(y, y)]),
        ))
    }
}

/// A level that cannot be negative: the estimate cut at zero, and the shortest interval of the
/// normal cut to the levels that exist.
fn one_sided(id: FaultId, estimate: f64, std: f64) -> Fault {
    let threshold = standard().inverse_cdf(1.0 - FALSE_ALARM_RATE);
    let detected = estimate > threshold * std;
    let interval = truncated_interval(estimate, std);
    Fault::determined(id, estimate.clamp(0.0, 1.0), std, interval, Some(detected))
}

/// Shortest interval that holds [`LEVEL`] of a normal cut to `[0, 1]`; the upper cut only clips,
/// since no level of interest lies near it.
pub(crate) fn truncated_interval(mean: f64, std: f64) -> [f64; 2] {
    let normal = standard();
    let above_zero = normal.cdf(mean / std);
    let half = std * normal.inverse_cdf(0.5 + 0.5 * LEVEL * above_zero);
    if mean - half >= 0.0 {
        return [(mean - half).min(1.0), (mean + half).min(1.0)];
    }
    // from zero up to where 1 − LEVEL of what is above zero is left
    let tail = (1.0 - LEVEL) * above_zero;
    let upper = mean - std * normal.inverse_cdf(tail.max(f64::MIN_POSITIVE));
    [0.0, upper.clamp(0.0, 1.0)]
}

/// Amplitude and direction of the eccentricity.
fn polar(point: &Vector2<f64>, covariance: &Matrix2<f64>) -> (Fault, Fault) {
    let amplitude = point.norm();
    let undetermined = Fault::undetermined(FaultId::K7);
    let Some(inverse) = covariance.try_inverse() else {
        return (Fault::undetermined(FaultId::K6), undetermined);
    };
    let distance2 = (point.transpose() * inverse * point)[0];
    // for two degrees of freedom the quantile of χ² is −2·ln(rate)
    let detected = distance2 > -2.0 * FALSE_ALARM_RATE.ln();
    let along = if amplitude > 0.0 { point / amplitude } else { Vector2::new(1.0, 0.0) };
    let across = Vector2::new(-along.y, along.x);
    let spread =
        |direction: &Vector2<f64>| (direction.transpose() * covariance * direction)[0].sqrt();
    let std = spread(&along);
    let interval = if detected {
        [(amplitude - TWO_SIDED * std).max(0.0), (amplitude + TWO_SIDED * std).min(1.0)]
    } else {
        [0.0, (amplitude + TWO_SIDED * std).min(1.0)]
    };
    let k6 = Fault::determined(FaultId::K6, amplitude.min(1.0), std, interval, Some(detected));
    if !detected {
        return (k6, undetermined);
    }
    let turn = |angle_turns: f64| angle_turns.rem_euclid(1.0);
    let k7 = turn(point.y.atan2(point.x) / TAU + 0.5);
    let k7_std = spread(&across) / amplitude / TAU;
    let half = (TWO_SIDED * k7_std).min(0.5);
    let region = [turn(k7 - half), turn(k7 + half)];
    (k6, Fault::determined(FaultId::K7, k7, k7_std, region, None))
}

pub(crate) fn standard() -> Normal {
    Normal::new(0.0, 1.0).expect("the standard normal exists")
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn far_from_zero_the_interval_is_the_usual_one() {
        let [low, high] = truncated_interval(0.03, 0.002);
        assert_abs_diff_eq!(low, 0.03 - TWO_SIDED * 0.002, epsilon = 1e-9);
        assert_abs_diff_eq!(high, 0.03 + TWO_SIDED * 0.002, epsilon = 1e-9);
    }

    #[test]
    fn near_zero_the_interval_holds_95_percent_of_what_is_possible() {
        let normal = standard();
        for z in [-3.0, -1.0, 0.0, 0.5, 1.5, 1.8] {
            let [low, high] = truncated_interval(z * 0.001, 0.001);
            let cdf = |k: f64| normal.cdf(k / 0.001 - z);
            let mass = (cdf(high) - cdf(low)) / (1.0 - cdf(0.0));
            // accuracy of statrs' inverse in the tail
            assert!((mass - LEVEL).abs() < 1e-6, "{z}: {mass}");
        }
    }

    #[test]
    fn law_coverage_at_zero_and_false_alarms() {
        // The interval holds 0 unless the estimate exceeds about 1.7 standard deviations, and a
        // false alarm needs 2.75: exact probabilities, by quadrature over the estimate.
        let normal = standard();
        let (mut covered, mut alarms) = (0.0, 0.0);
        let step = 1e-3;
        for k in -6000..6000 {
            let z = f64::from(k) * step;
            let mass = normal.cdf(z + 0.5 * step) - normal.cdf(z - 0.5 * step);
            let fault = one_sided(FaultId::K1, z * 1e-3, 1e-3);
            if fault.interval_95.unwrap()[0] == 0.0 {
                covered += mass;
            }
            if fault.detected == Some(true) {
                alarms += mass;
            }
        }
        assert!((0.95..0.96).contains(&covered), "{covered}");
        assert_abs_diff_eq!(alarms, FALSE_ALARM_RATE, epsilon = 1e-5);
    }

    #[test]
    fn direction_is_null_while_the_eccentricity_is_undetected() {
        let posterior = |x: f64| Posterior {
            indices: vec![5, 6],
            estimate: vec![x, 0.0],
            covariance: DMatrix::from_diagonal_element(2, 2, 1e-6),
            explained: None,
        };
        let faults = posterior(0.002).faults();
        assert_eq!(faults[5].detected, Some(false));
        assert_eq!(faults[6].value, None);
        let faults = posterior(0.02).faults();
        assert_eq!(faults[5].detected, Some(true));
        assert_eq!(faults[6].value, Some(0.5));
        assert_eq!(faults[0].value, None);
    }
}
