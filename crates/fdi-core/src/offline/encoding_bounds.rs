//! Cost of each encoding in the accuracy that a bundle's experiment allows.

use inference::{BandedMatrix, NotPositiveDefinite};
use nalgebra::DMatrix;

use crate::{
    offline::{
        bundle::{Bundle, BundleError},
        dataset::ReferenceDesign,
        encoder_fit::fitted_encoder,
        estimator::information,
        factor::Factor,
    },
    report::{Encoding, EncodingSummary, FaultId},
    statistics::noise_covariance::unit_noise_covariance,
};

/// Differences for the derivatives of the low-fidelity model, as for
/// [`sensor_bound_std`](crate::sensor_bound_std).
const STEP: f64 = 1e-3;

/// Size and cost of every encoding, the whole envelope first.
///
/// The cost is the median, over the incipient conditions, of the Cramér-Rao bound of a level's
/// standard deviation over that from the whole envelope. The noise is the bundle's, white on
/// phases sampled at the controller's rate; the derivatives are the low-fidelity model's, so that
/// an encoding by regressed sensitivities is not judged by itself. `k6` and `k7` are judged where
/// there is an eccentricity.
pub(crate) fn encoding_summaries(bundle: &Bundle) -> Result<Vec<EncodingSummary>, BundleError> {
    let cases = cases(bundle)?;
    let noise = stated_covariance(bundle);
    let whole = deviations(&Factor::new(noise.clone(), None)?, &cases)?;
    Encoding::ALL
        .into_iter()
        .map(|encoding| {
            let encoder = fitted_encoder(bundle, encoding)?;
            let factor = Factor::new(noise.clone(), encoder.as_ref())?;
            let kept = deviations(&factor, &cases)?;
            let bound_inflation = FaultId::ALL
                .into_iter()
                .enumerate()
                .filter_map(|(fault, id)| {
                    let ratios =
                        kept.iter().zip(&whole).filter_map(|(a, b)| Some(a[fault]? / b[fault]?));
                    Some((id.to_string(), median(ratios.collect())?))
                })
                .collect();
            let size = factor.size() as u64;
            Ok(EncodingSummary { name: encoding, size, bound_inflation })
        })
        .collect()
}

/// A condition at which encodings are judged.
struct Case {
    /// One row a coordinate looked for.
    jacobian: Vec<Vec<f64>>,
    indices: Vec<usize>,
    /// Direction of the eccentricity, where there is one.
    direction: Option<[f64; 2]>,
}

/// The incipient conditions, with central differences of the low-fidelity model.
fn cases(bundle: &Bundle) -> Result<Vec<Case>, BundleError> {
    let dataset = bundle.dataset(ReferenceDesign::Incipient).ok_or(BundleError::NoIncipient)?;
    let mut monitor = bundle.experiment.monitor(0.0)?;
    let indices = bundle.experiment.sought_indices();
    Ok(dataset
        .conditions
        .iter()
        .map(|condition| {
            monitor.turn_to(condition.start_angle_rad);
            let coordinates = condition.coordinates();
            let [x, y] = [coordinates.0[5], coordinates.0[6]];
            let size = x.hypot(y);
            let jacobian = monitor.jacobian(&coordinates, &indices, STEP);
            let direction = (size > 0.0).then(|| [x / size, y / size]);
            Case { jacobian, indices: indices.clone(), direction }
        })
        .collect())
}

/// Covariance of the sensors' noise that the bundle states.
fn stated_covariance(bundle: &Bundle) -> BandedMatrix {
    let experiment = &bundle.experiment;
    let rate_hz = experiment.actuator.controller.sample_hz;
    let unit = unit_noise_covariance(experiment, rate_hz);
    unit.scaled(bundle.noise_a.powi(2))
}

/// Bounds for `k1` to `k7` in each case; that of `k7` is of `k6·φ`, the arc.
fn deviations(
    factor: &Factor,
    cases: &[Case],
) -> Result<Vec<[Option<f64>; FaultId::ALL.len()]>, NotPositiveDefinite> {
    cases
        .iter()
        .map(|case| {
            let singular = NotPositiveDefinite { row: 0, pivot: 0.0 };
            let covariance = information(factor, &case.jacobian).try_inverse().ok_or(singular)?;
            Ok(case.bounds(&covariance))
        })
        .collect()
}

impl Case {
    fn bounds(&self, covariance: &DMatrix<f64>) -> [Option<f64>; FaultId::ALL.len()] {
        let mut bounds = [None; FaultId::ALL.len()];
        for (place, &index) in self.indices.iter().enumerate().filter(|(_, index)| **index < 5) {
            bounds[index] = Some(covariance[(place, place)].sqrt());
        }
        let place = |index| self.indices.iter().position(|&i| i == index);
        if let (Some(x), Some(y), Some([u, v])) = (place(5), place(6), self.direction) {
            let spread = |a: f64, b: f64| {
                let (xx, yy) = (covariance[(x, x)], covariance[(y, y)]);
                (a * a * xx + 2.0 * a * b * covariance[(x, y)] + b * b * yy).sqrt()
            };
            bounds[5] = Some(spread(u, v));
            bounds[6] = Some(spread(-v, u));
        }
        bounds
    }
}

/// Median; none of no value.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some(f64::midpoint(values[last / 2], values[values.len() / 2]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offline::embedded::EMBEDDED_BUNDLES;

    #[test]
    fn the_whole_costs_nothing_and_few_numbers_cost_something() {
        for embedded in EMBEDDED_BUNDLES {
            let bundle = Bundle::from_bytes(embedded.bytes).unwrap();
            let summaries = encoding_summaries(&bundle).unwrap();
            let names: Vec<_> = summaries.iter().map(|one| one.name.word()).collect();
            assert_eq!(names, ["full", "points", "cluster-means", "modes", "sensitivities"]);
            let full = &summaries[0];
            assert_eq!(full.size, bundle.experiment.samples() as u64);
            assert!(full.bound_inflation.values().all(|&inflation| inflation == 1.0));
            assert_eq!(full.bound_inflation.len(), bundle.experiment.sought_indices().len());
            for encoded in &summaries[1..] {
                assert!(encoded.size <= 30, "{} {}", encoded.name, encoded.size);
                // rounding of two bounds from factors of condition below 1e6
                assert!(encoded.bound_inflation.values().all(|&x| x > 1.0 - 1e-9));
            }
        }
    }
}
